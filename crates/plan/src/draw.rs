//! One random plan, built by disassembly from the key on, with pruning and backtracking (Sect. 6.2).
//!
//! The pruning tests run in order of their cost: the pieces left are connected; the path is free; the piece
//! costs no more than the bound; and the removed pieces do not come loose from the rest (the cluster test,
//! which the paper does not have).

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use shellock_assembly::LatticeDirection;
use shellock_report::PatchId;

use super::cluster::{DirectedJoint, loose_part_as_one};
use super::key::KeyChoice;
use super::local_cost::directions_in;
use super::score::just_above;
use super::space::Space;
use super::{LatticePlan, LatticeStep, PieceSet};

/// Spreads of the random order of candidates, in units of their cost. Draws cycle through them.
///
/// A small spread is greedy and finds good plans. A large spread is uniform and finds plans at all.
const SPREADS: [f64; 4] = [0.05, 0.2, 0.6, 100.0];

/// Result of one draw.
pub(super) struct Drawn {
    pub plan: Option<LatticePlan>,
    /// Number of removals, including those undone.
    pub n_tries: usize,
    /// Number of piece costs evaluated.
    pub n_evaluations: usize,
    /// True if nothing was left to try. Without a plan, this means that none within the bound exists for this
    /// key.
    pub is_exhausted: bool,
    /// Smallest set of pieces at which the search got stuck.
    pub stuck: PieceSet,
}

/// Limits of one draw.
#[derive(Clone, Copy)]
pub(super) struct DrawLimits {
    /// Greatest cost of a piece; infinite for no limit. Must not depend on results of other threads.
    pub bound: f64,
    /// Removals after which the draw is abandoned.
    pub max_tries: usize,
}

/// State of the draws with one key, from which they can be continued.
#[derive(Clone, Copy, Default)]
pub(super) struct Draws {
    /// Number of batches. Each draw of each batch has its own random stream.
    pub n_batches: usize,
    /// Number of plans drawn so far.
    pub n_plans: usize,
    /// Number of batches since the best plan was found.
    pub n_stale: usize,
    /// True if a draw found no plan and had nothing left to try.
    pub is_exhausted: bool,
}

struct Draw<'a> {
    space: &'a Space<'a>,
    key: &'a KeyChoice,
    rng: ChaCha8Rng,
    spread: f64,
    limits: DrawLimits,
    tries_left: usize,
    n_evaluations: usize,
    removals: Vec<LatticeStep>,
    /// Directions of the removed pieces.
    separations: Vec<Option<LatticeDirection>>,
    joints: Vec<DirectedJoint>,
    stuck: PieceSet,
}

/// Draws plan number `index` with the given key.
pub(super) fn draw(
    space: &Space<'_>,
    key: &KeyChoice,
    rng: ChaCha8Rng,
    index: usize,
    limits: DrawLimits,
) -> Drawn {
    let mut draw = Draw {
        space,
        key,
        rng,
        spread: SPREADS[index % SPREADS.len()],
        limits,
        tries_left: limits.max_tries,
        n_evaluations: 0,
        removals: Vec::new(),
        separations: vec![None; space.n],
        joints: Vec::new(),
        stuck: space.all(),
    };
    let found = draw.descend(space.all(), PieceSet::one(key.piece));
    let plan = found.then(|| {
        draw.removals.reverse();
        LatticePlan {
            steps: std::mem::take(&mut draw.removals),
        }
    });
    Drawn {
        plan,
        n_tries: limits.max_tries - draw.tries_left,
        n_evaluations: draw.n_evaluations,
        is_exhausted: draw.tries_left > 0,
        stuck: draw.stuck,
    }
}

impl Draw<'_> {
    /// Removes all of `left`; `attached` holds the pieces that a later one joins. On failure, returns false
    /// with all removals undone.
    fn descend(&mut self, left: PieceSet, attached: PieceSet) -> bool {
        if left.len() == 1 {
            return self.finish(left, attached);
        }
        for (piece, separation) in self.candidates(left, attached) {
            if self.tries_left == 0 {
                return false;
            }
            self.tries_left -= 1;
            let rest = left.minus(PieceSet::one(piece));
            let n_joints = self.joints.len();
            self.joints.extend(self.space.joints(piece, separation, rest));
            self.removals.push(LatticeStep { piece, separation });
            self.separations[usize::from(piece)] = Some(separation);
            // A part that is loose already, with the rest as one block, can never lock.
            let holds = loose_part_as_one(self.space.n, &self.joints, self.key.piece, rest).is_none();
            let attached = attached.union(self.space.joint_partners(piece, separation, rest));
            if holds && self.descend(rest, attached) {
                return true;
            }
            self.joints.truncate(n_joints);
            self.removals.pop();
            self.separations[usize::from(piece)] = None;
        }
        if left.len() < self.stuck.len() {
            self.stuck = left;
        }
        false
    }

    /// Adds the first-installed piece, which has no other piece to leave.
    fn finish(&mut self, left: PieceSet, attached: PieceSet) -> bool {
        let piece = left.iter().next().expect("one piece is left");
        let separation = LatticeDirection::nearest(self.space.survey.mean_normal[piece]);
        let step = LatticeStep { piece, separation };
        let cost = self.cost(step, PieceSet::EMPTY);
        if !attached.contains(piece) || !self.is_cheap(cost) {
            return false;
        }
        self.removals.push(step);
        let mut steps = self.removals.clone();
        steps.reverse();
        if self.space.is_rejected(&LatticePlan { steps }) {
            self.removals.pop();
            return false;
        }
        true
    }

    /// Cost of the piece of `step` as it leaves `rest`.
    fn cost(&mut self, step: LatticeStep, rest: PieceSet) -> f64 {
        self.n_evaluations += 1;
        let (role, around) = self.space.departure(step, rest, &self.separations);
        self.space.costs.bound(step.piece, role, &around)
    }

    fn is_cheap(&self, cost: f64) -> bool {
        cost <= just_above(self.limits.bound)
    }

    /// Pieces that may leave `left` next, with their directions, in a random order that favours low costs.
    fn candidates(&mut self, left: PieceSet, attached: PieceSet) -> Vec<(PatchId, LatticeDirection)> {
        let mut candidates = Vec::new();
        let is_first = left == self.space.all();
        for piece in left.and(attached).iter() {
            let rest = left.minus(PieceSet::one(piece));
            if !rest.is_connected(&self.space.neighbours) {
                continue;
            }
            for separation in directions_in(self.space.allowed_mask(piece)) {
                let step = LatticeStep { piece, separation };
                let is_allowed = !is_first || self.key.directions.contains(&separation);
                if !is_allowed
                    || !self.space.is_free(piece, separation, rest)
                    || self.space.joint_partners(piece, separation, rest).is_empty()
                {
                    continue;
                }
                let cost = self.cost(step, rest);
                if self.is_cheap(cost) {
                    // Gumbel noise: the order is that of drawing without replacement, by weight exp(−cost /
                    // spread).
                    let u: f64 = self.rng.random_range(1e-12..1.0);
                    let noise = -(-u.ln()).ln();
                    candidates.push((cost - self.spread * noise, step));
                }
            }
        }
        let name = |step: LatticeStep| (step.piece, step.separation);
        candidates.sort_by(|x, y| x.0.total_cmp(&y.0).then_with(|| name(x.1).cmp(&name(y.1))));
        candidates.into_iter().map(|(_, step)| name(step)).collect()
    }
}
