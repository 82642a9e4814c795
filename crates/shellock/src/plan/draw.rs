//! One random plan, taken apart from the key on, with pruning and backtracking (Sect. 6.3).

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::cluster::{DirectedJoint, loose_part_fused};
use super::key::KeyChoice;
use super::score::{contact_cost, inward_cost, occluded_cost};
use super::space::Space;
use super::{InstallationPlan, InstallationStep, PieceSet};
use crate::{LatticeDirection, PatchId};

/// Spreads of the random order of candidates, in units of their cost; draws take turns.
///
/// A small spread is greedy, a large one uniform: the first finds good plans, the last finds plans at all.
const SPREADS: [f64; 4] = [0.05, 0.2, 0.6, 100.0];

/// How a draw ended.
pub(super) struct Drawn {
    pub plan: Option<InstallationPlan>,
    /// Pieces taken off, put back ones included.
    pub n_tries: usize,
    /// Whether nothing was left to try: then no plan exists for this key.
    pub is_exhausted: bool,
    /// The fewest pieces that were left where the search got stuck.
    pub stuck: PieceSet,
}

struct Draw<'a> {
    space: &'a Space<'a>,
    key: &'a KeyChoice,
    rng: ChaCha8Rng,
    spread: f64,
    tries_left: usize,
    removed: Vec<InstallationStep>,
    joints: Vec<DirectedJoint>,
    stuck: PieceSet,
}

/// Draws plan number `index` with the given key, taking off at most `max_tries` pieces.
pub(super) fn draw(space: &Space<'_>, key: &KeyChoice, rng: ChaCha8Rng, index: usize, max_tries: usize) -> Drawn {
    let spread = SPREADS[index % SPREADS.len()];
    let (removed, joints, stuck) = (Vec::new(), Vec::new(), space.all());
    let mut draw = Draw { space, key, rng, spread, tries_left: max_tries, removed, joints, stuck };
    let found = draw.descend(space.all(), PieceSet::one(key.piece));
    let plan = found.then(|| {
        draw.removed.reverse();
        InstallationPlan { steps: std::mem::take(&mut draw.removed) }
    });
    Drawn { plan, n_tries: max_tries - draw.tries_left, is_exhausted: draw.tries_left > 0, stuck: draw.stuck }
}

impl Draw<'_> {
    /// Takes off all of `left`; `attached` holds the pieces that a later one joins. False with everything put back.
    fn descend(&mut self, left: PieceSet, attached: PieceSet) -> bool {
        if left.len() == 1 {
            return self.finish(left);
        }
        for (piece, separation) in self.candidates(left, attached) {
            if self.tries_left == 0 {
                return false;
            }
            self.tries_left -= 1;
            let rest = left.minus(PieceSet::one(piece));
            let n_joints = self.joints.len();
            self.joints.extend(self.space.joints(piece, separation, rest));
            self.removed.push(InstallationStep { piece, separation });
            // What comes loose already, with the rest as one block, cannot lock any more.
            let holds = loose_part_fused(self.space.n, &self.joints, self.key.piece, rest).is_none();
            let attached = attached.union(self.space.joined(piece, separation, rest));
            if holds && self.descend(rest, attached) {
                return true;
            }
            self.joints.truncate(n_joints);
            self.removed.pop();
        }
        if left.len() < self.stuck.len() {
            self.stuck = left;
        }
        false
    }

    /// The first-installed piece: nothing is left that it could leave.
    fn finish(&mut self, left: PieceSet) -> bool {
        let piece = left.iter().next().expect("one piece is left");
        let outwards = LatticeDirection::nearest(self.space.survey.mean_normal[piece]);
        self.removed.push(InstallationStep { piece, separation: outwards });
        let mut steps = self.removed.clone();
        steps.reverse();
        if self.space.is_rejected(&InstallationPlan { steps }) {
            self.removed.pop();
            return false;
        }
        true
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
            for s in LatticeDirection::all() {
                let is_allowed = !is_first || self.key.directions.contains(&s);
                if is_allowed && self.space.is_free(piece, s, rest) && !self.space.joined(piece, s, rest).is_empty() {
                    // Gumbel noise: the order is that of drawing without putting back, by weight exp(−cost / spread).
                    let u: f64 = self.rng.random_range(1e-12..1.0);
                    let noise = -(-u.ln()).ln();
                    candidates.push((self.local_cost(piece, s, rest) - self.spread * noise, piece, s));
                }
            }
        }
        candidates.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        candidates.into_iter().map(|(_, piece, s)| (piece, s)).collect()
    }

    /// Mean cost, by length, of the seams that `piece` decides by leaving `rest` along `s`.
    fn local_cost(&self, piece: PatchId, s: LatticeDirection, rest: PieceSet) -> f64 {
        let (mut cost, mut length_mm) = (0.0, 0.0);
        for &i in &self.space.contacts_of[usize::from(piece)] {
            let contact = &self.space.survey.contacts[i];
            if rest.contains(contact.other(piece)) {
                let is_weak = self.space.constraints.is_weak(piece, contact.other(piece), s);
                cost += contact_cost(self.space.survey, contact, piece, s, is_weak) * contact.length_mm;
                length_mm += contact.length_mm;
            }
        }
        let survey = self.space.survey;
        cost / f64::max(length_mm, f64::MIN_POSITIVE)
            + inward_cost(survey, piece, s)
            + occluded_cost(survey, piece, s, rest.iter())
    }
}
