//! One random plan, taken apart from the key on, with pruning and backtracking (Sect. 6.2).
//!
//! Prunings come in the order of their cost: what is left hangs together, the path is free, the piece costs
//! no more than the bound, and what was taken off does not come loose from the rest (the cluster test, which
//! the paper does not have).

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::cluster::{DirectedJoint, loose_part_fused};
use super::key::KeyChoice;
use super::local_cost::directions_in;
use super::score::just_above;
use super::space::Space;
use super::{LatticePlan, LatticeStep, PieceSet};
use crate::{LatticeDirection, PatchId};

/// Spreads of the random order of candidates, in units of their cost; draws take turns.
///
/// A small spread is greedy, a large one uniform: the first finds good plans, the last finds plans at all.
const SPREADS: [f64; 4] = [0.05, 0.2, 0.6, 100.0];

/// How a draw ended.
pub(super) struct Drawn {
    pub plan: Option<LatticePlan>,
    /// Pieces taken off, put back ones included.
    pub n_tries: usize,
    /// Costs of pieces asked for.
    pub n_evaluations: usize,
    /// Whether nothing was left to try: then no plan within the bound exists for this key.
    pub is_exhausted: bool,
    /// The fewest pieces that were left where the search got stuck.
    pub stuck: PieceSet,
}

/// What a draw may do.
#[derive(Clone, Copy)]
pub(super) struct DrawLimits {
    /// Costs above this are pruned; infinite for none. It must not depend on what other threads find.
    pub bound: f64,
    /// Pieces taken off before the draw is given up.
    pub max_tries: usize,
}

/// State of the draws with one key, from which they can be continued.
#[derive(Clone, Copy, Default)]
pub(super) struct Draws {
    /// Number of batches. Each draw of each batch has its own random stream.
    pub n_batches: usize,
    /// Number of plans.
    pub n_plans: usize,
    /// Number of batches since the best plan was found.
    pub n_stale: usize,
    /// True where a draw had nothing left to try.
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
    removed: Vec<LatticeStep>,
    /// Directions of the pieces taken off.
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
        removed: Vec::new(),
        separations: vec![None; space.n],
        joints: Vec::new(),
        stuck: space.all(),
    };
    let found = draw.descend(space.all(), PieceSet::one(key.piece));
    let plan = found.then(|| {
        draw.removed.reverse();
        LatticePlan {
            steps: std::mem::take(&mut draw.removed),
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
    /// Takes off all of `left`; `attached` holds the pieces that a later one joins. False with everything put
    /// back.
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
            self.removed.push(LatticeStep { piece, separation });
            self.separations[usize::from(piece)] = Some(separation);
            // What comes loose already, with the rest as one block, cannot lock any more.
            let holds = loose_part_fused(self.space.n, &self.joints, self.key.piece, rest).is_none();
            let attached = attached.union(self.space.joined(piece, separation, rest));
            if holds && self.descend(rest, attached) {
                return true;
            }
            self.joints.truncate(n_joints);
            self.removed.pop();
            self.separations[usize::from(piece)] = None;
        }
        if left.len() < self.stuck.len() {
            self.stuck = left;
        }
        false
    }

    /// The first-installed piece: nothing is left that it could leave.
    fn finish(&mut self, left: PieceSet, attached: PieceSet) -> bool {
        let piece = left.iter().next().expect("one piece is left");
        let separation = LatticeDirection::nearest(self.space.survey.mean_normal[piece]);
        let step = LatticeStep { piece, separation };
        let cost = self.cost(step, PieceSet::EMPTY);
        if !attached.contains(piece) || !self.is_cheap(cost) {
            return false;
        }
        self.removed.push(step);
        let mut steps = self.removed.clone();
        steps.reverse();
        if self.space.is_rejected(&LatticePlan { steps }) {
            self.removed.pop();
            return false;
        }
        true
    }

    /// What the piece of `step` costs when it leaves `rest`.
    fn cost(&mut self, step: LatticeStep, rest: PieceSet) -> f64 {
        self.n_evaluations += 1;
        let (role, around) = self.space.leaving(step, rest, &self.separations);
        self.space.costs.bound(step.piece, role, &around)
    }

    fn is_cheap(&self, cost: f64) -> bool {
        cost <= just_above(self.limits.bound)
    }

    /// Who may leave `left` next and along which direction, in random order, good ones likely first.
    fn candidates(&mut self, left: PieceSet, attached: PieceSet) -> Vec<(PatchId, LatticeDirection)> {
        let mut candidates = Vec::new();
        let is_first = left == self.space.all();
        for piece in left.and(attached).iter() {
            let rest = left.minus(PieceSet::one(piece));
            if !rest.is_connected(&self.space.neighbours) {
                continue;
            }
            for separation in directions_in(self.space.allowed(piece)) {
                let step = LatticeStep { piece, separation };
                let is_allowed = !is_first || self.key.directions.contains(&separation);
                if !is_allowed
                    || !self.space.is_free(piece, separation, rest)
                    || self.space.joined(piece, separation, rest).is_empty()
                {
                    continue;
                }
                let cost = self.cost(step, rest);
                if self.is_cheap(cost) {
                    // Gumbel noise: the order is that of drawing without putting back, by weight exp(−cost /
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
