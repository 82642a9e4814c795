//! The plans that may be: a survey, seen with a tolerance and with what earlier rounds forbid, as bit sets.

use super::cluster::{DirectedJoint, loose_part};
use super::{InstallationPlan, PieceSet, PlanConstraints, PlanSurvey, score};
use crate::{LatticeDirection, PatchId};

/// Per piece and direction.
type ByDirection<T> = Vec<[T; LatticeDirection::COUNT]>;

/// How often a piece may rub against an earlier one before another order is asked for: the seam between the two is then at fault, not
/// the direction.
const MOST_RUBS: usize = 2;

/// What the search asks, in bits. Holds at most [`PieceSet::MAX_PIECES`] pieces.
pub(super) struct Space<'a> {
    pub survey: &'a PlanSurvey,
    pub constraints: &'a PlanConstraints,
    pub n: usize,
    /// Who keeps a piece from leaving along a direction.
    blocks: ByDirection<PieceSet>,
    /// Which earlier pieces a later one joins if it leaves along a direction.
    joins: ByDirection<PieceSet>,
    /// Pairs that can join in some order along some direction.
    pub neighbours: Vec<PieceSet>,
    /// Contacts of each piece, as positions in the survey's list.
    pub contacts_of: Vec<Vec<usize>>,
}

impl<'a> Space<'a> {
    pub fn new(survey: &'a PlanSurvey, constraints: &'a PlanConstraints, tolerance: f64) -> Self {
        let n = survey.n_pieces;
        let ids = || (0..n).map(PatchId::from);
        let blocks = ids()
            .map(|p| {
                let rubs = |q| constraints.rubbed.get(&(p, q)).is_some_and(|&times| times >= MOST_RUBS);
                let is_blocked = |q, s| survey.occlusion.share(p, q, s) > tolerance || rubs(q);
                let blockers = |s| ids().filter(|&q| q != p && is_blocked(q, s)).collect();
                by_direction(blockers)
            })
            .collect();
        let mut joins = vec![[PieceSet::EMPTY; LatticeDirection::COUNT]; n];
        let mut neighbours = vec![PieceSet::EMPTY; n];
        let mut contacts_of = vec![Vec::new(); n];
        for (i, c) in survey.contacts.iter().enumerate() {
            let is_weak = constraints.weak_contacts.contains(&(c.a, c.b));
            for (p, q) in [(c.a, c.b), (c.b, c.a)] {
                contacts_of[usize::from(p)].push(i);
                for s in LatticeDirection::all().filter(|&s| c.joint(p, s).holds && !constraints.is_weak(p, q, s)) {
                    let set = &mut joins[usize::from(p)][s.index()];
                    *set = set.union(PieceSet::one(q));
                }
                if !is_weak && c.can_hold() {
                    neighbours[usize::from(p)] = neighbours[usize::from(p)].union(PieceSet::one(q));
                }
            }
        }
        Self { survey, constraints, n, blocks, joins, neighbours, contacts_of }
    }

    pub fn all(&self) -> PieceSet {
        PieceSet::first(self.n)
    }

    /// Whether `p` may leave `rest` along `s`.
    pub fn is_free(&self, p: PatchId, s: LatticeDirection, rest: PieceSet) -> bool {
        self.blocks[usize::from(p)][s.index()].and(rest).is_empty() && !self.constraints.forbidden.contains(&(p, s))
    }

    /// The pieces of `rest` that `p` joins if it leaves them along `s`.
    pub fn joined(&self, p: PatchId, s: LatticeDirection, rest: PieceSet) -> PieceSet {
        self.joins[usize::from(p)][s.index()].and(rest)
    }

    /// The joints of `p`, installed after all of `rest`.
    pub fn joints(&self, p: PatchId, s: LatticeDirection, rest: PieceSet) -> impl Iterator<Item = DirectedJoint> {
        self.joined(p, s, rest).iter().map(move |earlier| DirectedJoint { later: p, earlier, separation: s })
    }

    /// Whether `plan` keeps every condition: paths free, each piece joined to an earlier and a later one, what is still
    /// to be installed connected, locked, and not rejected before.
    pub fn allows(&self, plan: &InstallationPlan) -> bool {
        let mut rest = self.all();
        let mut attached = PieceSet::one(plan.key());
        let mut joints = Vec::new();
        for step in plan.removal() {
            rest = rest.minus(PieceSet::one(step.piece));
            if !attached.contains(step.piece) || !rest.is_connected(&self.neighbours) {
                return false;
            }
            if rest.is_empty() {
                break;
            }
            let joined = self.joined(step.piece, step.separation, rest);
            if joined.is_empty() || !self.is_free(step.piece, step.separation, rest) {
                return false;
            }
            attached = attached.union(joined);
            joints.extend(self.joints(step.piece, step.separation, rest));
        }
        loose_part(self.n, &joints, plan.key()).is_none() && !self.is_rejected(plan)
    }

    /// Whether an earlier round turned `plan` down; the first piece's direction has no meaning and is not compared.
    pub fn is_rejected(&self, plan: &InstallationPlan) -> bool {
        self.constraints.rejected.iter().any(|r| {
            r.steps.len() == plan.steps.len()
                && r.steps[1..] == plan.steps[1..]
                && r.steps[0].piece == plan.steps[0].piece
        })
    }

    /// Cost of `plan`; lower is better.
    pub fn cost(&self, plan: &InstallationPlan) -> f64 {
        score(self.survey, self.constraints, plan).value
    }

    /// Pieces whose removal would part the others; all plans fail where there is one.
    pub fn articulations(&self) -> Vec<PatchId> {
        let parts = |p: &PatchId| !self.all().minus(PieceSet::one(*p)).is_connected(&self.neighbours);
        (0..self.n).map(PatchId::from).filter(parts).collect()
    }
}

fn by_direction<T>(make: impl Fn(LatticeDirection) -> T) -> [T; LatticeDirection::COUNT] {
    let mut all = LatticeDirection::all();
    std::array::from_fn(|_| make(all.next().expect("as many as COUNT")))
}
