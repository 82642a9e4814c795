//! The space of possible plans: a survey under a tolerance and the constraints of earlier rounds, as bit
//! sets.

use shellock_assembly::LatticeDirection;
use shellock_report::PatchId;

use super::cluster::{DirectedJoint, loose_part};
use super::local_cost::{PieceCosts, Role, SeamCosts, SeamStates, Surroundings, mask_of};
use super::score::PlanScore;
use super::{LatticePlan, LatticeStep, PieceSet, PlanConstraints, PlanSurvey};

/// A table by piece and direction.
type ByDirection<T> = Vec<[T; LatticeDirection::COUNT]>;

/// Number of times that a piece may rub against an earlier one before another order is required. By then the
/// seam between the two is at fault, not the direction.
pub(super) const MOST_RUBS: usize = 2;

/// Lookup tables of the search, as bits. Holds at most [`PieceSet::MAX_PIECES`] pieces.
pub(super) struct Space<'a> {
    pub survey: &'a PlanSurvey,
    pub constraints: &'a PlanConstraints,
    pub n: usize,
    /// Share of a piece that another may occlude while its path counts as free.
    pub tolerance: f64,
    /// Pieces that keep a piece from leaving along a direction.
    blocks: ByDirection<PieceSet>,
    /// Earlier pieces that a later piece joins if it leaves along a direction.
    joins: ByDirection<PieceSet>,
    /// For each piece, those that it can join in some order along some direction.
    pub neighbours: Vec<PieceSet>,
    /// Contacts of each piece, as indices into the survey's list.
    pub contacts_of: Vec<Vec<usize>>,
    /// Cost function of the pieces.
    pub costs: Box<dyn PieceCosts>,
}

/// Distinguishing features of a plan: directions of all pieces but the first, and the later piece of each
/// contact.
///
/// Plans with equal relations make the same joints, whatever the order of pieces that do not touch.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Relations {
    separations: Vec<Option<LatticeDirection>>,
    is_a_later: Vec<bool>,
}

impl<'a> Space<'a> {
    /// Creates the space with the default costs.
    pub fn new(survey: &'a PlanSurvey, constraints: &'a PlanConstraints, tolerance: f64) -> Self {
        Self::with_costs(
            survey,
            constraints,
            tolerance,
            Box::new(SeamCosts::new(survey, constraints)),
        )
    }

    pub fn with_costs(
        survey: &'a PlanSurvey,
        constraints: &'a PlanConstraints,
        tolerance: f64,
        costs: Box<dyn PieceCosts>,
    ) -> Self {
        let n = survey.n_pieces;
        let ids = || (0..n).map(PatchId::from);
        let blocks = ids()
            .map(|p| {
                let rubs = |q| {
                    constraints
                        .rubs
                        .get(&(p, q))
                        .is_some_and(|&times| times >= MOST_RUBS)
                };
                let is_blocked = |q, s| survey.occlusion.share(p, q, s) > tolerance || rubs(q);
                let blockers = |s| ids().filter(|&q| q != p && is_blocked(q, s)).collect();
                by_direction(blockers)
            })
            .collect();
        let mut joins = vec![[PieceSet::EMPTY; LatticeDirection::COUNT]; n];
        let mut neighbours = vec![PieceSet::EMPTY; n];
        let mut contacts_of = vec![Vec::new(); n];
        for (i, c) in survey.contacts.iter().enumerate() {
            for (p, q) in [(c.a, c.b), (c.b, c.a)] {
                contacts_of[usize::from(p)].push(i);
                for s in
                    LatticeDirection::all().filter(|&s| c.joint(p, s).holds && !constraints.is_weak(p, q, s))
                {
                    let set = &mut joins[usize::from(p)][s.index()];
                    *set = set.union(PieceSet::one(q));
                }
                if c.can_hold() {
                    neighbours[usize::from(p)] = neighbours[usize::from(p)].union(PieceSet::one(q));
                }
            }
        }
        Self {
            survey,
            constraints,
            n,
            tolerance,
            blocks,
            joins,
            neighbours,
            contacts_of,
            costs,
        }
    }

    pub fn all(&self) -> PieceSet {
        PieceSet::first(self.n)
    }

    /// Returns true if `p` may leave `rest` along `s`.
    pub fn is_free(&self, p: PatchId, s: LatticeDirection, rest: PieceSet) -> bool {
        self.blocks[usize::from(p)][s.index()].and(rest).is_empty()
            && !self.constraints.forbidden.contains(&(p, s))
    }

    /// Pieces of `rest` that `p` joins if it leaves them along `s`.
    pub fn joint_partners(&self, p: PatchId, s: LatticeDirection, rest: PieceSet) -> PieceSet {
        self.joins[usize::from(p)][s.index()].and(rest)
    }

    /// Joints of `p` when installed after all of `rest`.
    pub fn joints(
        &self,
        p: PatchId,
        s: LatticeDirection,
        rest: PieceSet,
    ) -> impl Iterator<Item = DirectedJoint> {
        self.joint_partners(p, s, rest)
            .iter()
            .map(move |earlier| DirectedJoint {
                later: p,
                earlier,
                separation: s,
            })
    }

    /// Returns true if `plan` satisfies every condition: paths are free; each piece joins an earlier and a
    /// later one; the pieces still in place stay connected; the assembly locks; and the plan was not rejected
    /// before.
    pub fn allows(&self, plan: &LatticePlan) -> bool {
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
            let joined = self.joint_partners(step.piece, step.separation, rest);
            if joined.is_empty() || !self.is_free(step.piece, step.separation, rest) {
                return false;
            }
            attached = attached.union(joined);
            joints.extend(self.joints(step.piece, step.separation, rest));
        }
        loose_part(self.n, &joints, plan.key()).is_none() && !self.is_rejected(plan)
    }

    /// Returns true if an earlier round rejected a plan with the same relations.
    pub fn is_rejected(&self, plan: &LatticePlan) -> bool {
        let is_same = |r: &LatticePlan| r.steps.len() == self.n && self.relations(r) == self.relations(plan);
        self.constraints.rejections.iter().any(is_same)
    }

    /// Relations that distinguish `plan` from others.
    pub fn relations(&self, plan: &LatticePlan) -> Relations {
        let mut position = vec![0; self.n];
        let mut separations = vec![None; self.n];
        for (i, step) in plan.steps.iter().enumerate() {
            position[usize::from(step.piece)] = i;
            separations[usize::from(step.piece)] = (i > 0).then_some(step.separation);
        }
        let is_a_later = self
            .survey
            .contacts
            .iter()
            .map(|c| position[usize::from(c.a)] > position[usize::from(c.b)])
            .collect();
        Relations {
            separations,
            is_a_later,
        }
    }

    /// Costs of `plan` and of its pieces; lower is better.
    pub fn score(&self, plan: &LatticePlan) -> PlanScore {
        let around = self.surroundings(plan);
        let cost =
            |(p, (role, around)): (usize, &(Role, Surroundings))| self.costs.bound(p.into(), *role, around);
        PlanScore::of(around.iter().enumerate().map(cost).collect())
    }

    /// Pieces of `plan` that are held by too little, see [`PieceCosts::is_loose`].
    pub fn loose(&self, plan: &LatticePlan) -> Vec<PatchId> {
        let around = self.surroundings(plan);
        let is_loose = |p: &PatchId| {
            let (role, around) = &around[usize::from(*p)];
            self.costs.is_loose(*p, *role, around)
        };
        (0..self.n).map(PatchId::from).filter(is_loose).collect()
    }

    /// Pieces of `plan` that are not held firmly, see [`PieceCosts::is_firm`].
    pub fn infirm(&self, plan: &LatticePlan) -> Vec<PatchId> {
        let around = self.surroundings(plan);
        let is_firm = |p: &PatchId| {
            let (role, around) = &around[usize::from(*p)];
            self.costs.is_firm(*p, *role, around)
        };
        (0..self.n).map(PatchId::from).filter(|p| !is_firm(p)).collect()
    }

    /// Role and surroundings of each piece in `plan`.
    pub fn surroundings(&self, plan: &LatticePlan) -> Vec<(Role, Surroundings)> {
        let mut separations = vec![None; self.n];
        let mut rest = self.all();
        let mut found = vec![(Role::First, Surroundings::default()); self.n];
        for step in plan.removal() {
            rest = rest.minus(PieceSet::one(step.piece));
            found[usize::from(step.piece)] = self.departure(step, rest, &separations);
            separations[usize::from(step.piece)] = Some(step.separation);
        }
        found
    }

    /// Role and surroundings of the piece of `step` as it leaves `rest`. `separations` are the directions of
    /// the pieces removed before.
    pub fn departure(
        &self,
        step: LatticeStep,
        rest: PieceSet,
        separations: &[Option<LatticeDirection>],
    ) -> (Role, Surroundings) {
        let p = step.piece;
        let role = match rest.len() {
            0 => Role::First,
            left if left + 1 == self.n => Role::Key(step.separation),
            _ => Role::Between(step.separation),
        };
        let seam = |&i: &usize| {
            let q = self.survey.contacts[i].other(p);
            match separations[usize::from(q)] {
                Some(s) => SeamStates {
                    own: 0,
                    others: mask_of(s),
                },
                None => SeamStates {
                    own: mask_of(step.separation),
                    others: 0,
                },
            }
        };
        let seams = self.contacts_of[usize::from(p)].iter().map(seam).collect();
        (
            role,
            Surroundings {
                seams,
                remainder: rest,
            },
        )
    }

    /// Directions that the constraints ever allow `p`, as bits.
    pub fn allowed_mask(&self, p: PatchId) -> u32 {
        let is_allowed = |s: &LatticeDirection| !self.constraints.forbidden.contains(&(p, *s));
        LatticeDirection::all()
            .filter(is_allowed)
            .fold(0, |mask, s| mask | mask_of(s))
    }

    /// Pieces that keep `p` from leaving along `s` as long as they are in place.
    pub fn blockers(&self, p: PatchId, s: LatticeDirection) -> PieceSet {
        self.blocks[usize::from(p)][s.index()]
    }

    /// Articulation pieces, without which the others would be disconnected. If there is one, every plan
    /// fails.
    pub fn articulations(&self) -> Vec<PatchId> {
        let parts = |p: &PatchId| !self.all().minus(PieceSet::one(*p)).is_connected(&self.neighbours);
        (0..self.n).map(PatchId::from).filter(parts).collect()
    }
}

fn by_direction<T>(make: impl Fn(LatticeDirection) -> T) -> [T; LatticeDirection::COUNT] {
    let mut all = LatticeDirection::all();
    std::array::from_fn(|_| make(all.next().expect("as many as COUNT")))
}

/// Costs of `plan` by [`SeamCosts`]. The cost of a piece has three parts: the mean over its
/// seams, by length, of Eq. 4's weight and of the unusable share; its path; and its missing hold.
pub fn score(survey: &PlanSurvey, constraints: &PlanConstraints, plan: &LatticePlan) -> PlanScore {
    // The tolerance does not matter: costs do not depend on which paths are free.
    Space::new(survey, constraints, 0.0).score(plan)
}

#[cfg(test)]
mod tests {
    use shellock_geom::Vec3;
    use shellock_test_surfaces::{label, seams, sphere};

    use super::*;
    use crate::{PlanParams, survey};

    #[test]
    fn a_hemisphere_that_leaves_along_its_axis_beats_every_other_direction() {
        let surface = label(sphere(4, Vec3::splat(50.0)), 2, |p| u32::from(p.z > 0.0));
        let ctx = shellock_report::Ctx::quiet();
        let survey = survey(
            &ctx,
            &PlanParams::default(),
            &surface,
            &seams(&surface),
            &crate::sizes::ConnectorSizes::default(),
        )
        .unwrap();
        let up = LatticeDirection::nearest(Vec3::Z);
        let value = |separation| {
            let steps = [0, 1]
                .map(|p| LatticeStep {
                    piece: PatchId(p),
                    separation,
                })
                .to_vec();
            score(&survey, &PlanConstraints::default(), &LatticePlan { steps }).worst
        };
        for s in LatticeDirection::all().filter(|&s| s != up) {
            assert!(value(up) < value(s));
        }
    }

    /// Hold of a plate in the +z plane. Its only neighbour surrounds it, is installed later, and leaves along
    /// `s`.
    fn hold_of_plate(s: Vec3, is_weak: bool) -> f64 {
        let surface = label(sphere(4, Vec3::splat(50.0)), 2, |p| u32::from(p.z < 0.0));
        let ctx = shellock_report::Ctx::quiet();
        let survey = survey(
            &ctx,
            &PlanParams::default(),
            &surface,
            &seams(&surface),
            &crate::sizes::ConnectorSizes::default(),
        )
        .unwrap();
        let separation = LatticeDirection::nearest(s);
        let steps = [0, 1]
            .map(|p| LatticeStep {
                piece: PatchId(p),
                separation,
            })
            .to_vec();
        let mut constraints = PlanConstraints::default();
        if is_weak {
            constraints.weaken(PatchId(0), PatchId(1));
        }
        let plan = LatticePlan { steps };
        let space = Space::new(&survey, &constraints, 0.0);
        let (role, around) = &space.surroundings(&plan)[0];
        super::super::SeamCosts::new(&survey, &constraints).hold_mm3(PatchId(0), *role, around)
    }

    #[test]
    fn a_piece_is_loose_opposite_to_its_only_later_neighbour_and_without_connectors() {
        // The later piece leaves along −z, so nothing stops the plate along +z. Across, it is held.
        assert!(hold_of_plate(-Vec3::Z, false) < 1e-3);
        assert_eq!(hold_of_plate(-Vec3::Z, true), 0.0);
    }
}
