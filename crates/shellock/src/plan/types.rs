//! What a plan is, and what keeps one from being found.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::key::KeyDirections;
use super::space::MOST_RUBS;
use super::{PlanScore, PlanSurvey};
use crate::{IdVec, InstallationPlan, InstallationStep, LatticeDirection, PatchId};

/// A plan whose directions are of the 26: what the search finds and pieces are made by.
pub type LatticePlan = InstallationPlan<LatticeDirection>;
/// A step of it.
pub type LatticeStep = InstallationStep<LatticeDirection>;

/// What earlier rounds taught: the search must respect all of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PlanConstraints {
    /// A later piece, an earlier one and the direction of the later one with which their connectors came out
    /// too small to hold: they touch, but join nothing. Along other directions they may.
    pub weak_joints: BTreeSet<(PatchId, PatchId, LatticeDirection)>,
    /// Directions that a piece must not take, because its path rubbed.
    pub forbidden: BTreeSet<(PatchId, LatticeDirection)>,
    /// How often a piece rubbed against an earlier one; twice, along two directions, and it must go in before
    /// it.
    pub rubbed: BTreeMap<(PatchId, PatchId), usize>,
    /// Whole plans that failed for a reason that none of the above says.
    pub rejected: Vec<LatticePlan>,
}

impl PlanConstraints {
    /// How many things there are that restrict plans.
    pub fn n_lessons(&self) -> usize {
        let Self {
            weak_joints,
            forbidden,
            rubbed,
            rejected,
        } = self;
        let n_orders = rubbed.values().filter(|&&n| n >= MOST_RUBS).count();
        weak_joints.len() + forbidden.len() + n_orders + rejected.len()
    }

    /// The two join nothing any more, whatever goes in later and along which direction.
    #[cfg(test)]
    pub fn weaken(&mut self, a: PatchId, b: PatchId) {
        self.weak_joints
            .extend(LatticeDirection::all().flat_map(|s| [(a, b, s), (b, a, s)]));
    }

    /// Whether nothing joins the two where `later` leaves along `s`.
    pub fn is_weak(&self, later: PatchId, earlier: PatchId, s: LatticeDirection) -> bool {
        self.weak_joints.contains(&(later, earlier, s))
    }
}

/// `by` prevents `piece` from leaving.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Blocker {
    /// The piece that should leave.
    pub piece: PatchId,
    /// The piece in its way.
    pub by: PatchId,
    /// Where, mm in assembly space.
    pub at: [f64; 3],
    /// Share of `piece` that `by` occludes along the best direction, in [0, 1].
    pub occluded: f64,
}

/// A plan and what it costs.
#[derive(Clone, Debug, PartialEq)]
pub struct RankedPlan {
    /// The plan.
    pub plan: LatticePlan,
    /// Its cost, which is that of its worst piece, and the cost of every piece.
    pub score: PlanScore,
    /// Pieces that are held by less than the verification asks for, by estimate.
    pub loose: Vec<PatchId>,
}

/// The best plan found, and how good any other with a key as good as its own can be.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundPlan {
    /// The best plan.
    pub plan: LatticePlan,
    /// Its cost, which is that of its worst piece, and the cost of every piece.
    pub score: PlanScore,
    /// Proven: no allowed plan within `scope` costs less.
    pub lower_bound: f64,
    /// The same for plans within `scope` that have this plan's key: at least as much, since one key is less
    /// to search.
    pub key_lower_bound: f64,
    /// Whether the plan's own cost was proven to be the least within `scope`.
    pub is_optimal: bool,
    /// For which plans that holds.
    pub scope: ProofScope,
    /// Share of a piece that others may occlude, under which it was found.
    pub tolerance: f64,
    /// Runs of this many connector sizes counted as joints.
    pub run_sizes: f64,
    /// Up to 100 plans with the same key and different relations between pieces: `plan`, then the others,
    /// cheapest first.
    pub pool: Vec<RankedPlan>,
}

/// The plans for which a lower bound holds; about all others it says nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProofScope {
    /// Pieces that may be the key: as flat as the plan's own, or as curved; the one that is liked best first.
    pub keys: Vec<PatchId>,
    /// How the key slides out.
    #[serde(rename = "key_slides")]
    pub slides: KeyDirections,
    /// Lessons of failed kits that plans must respect; 0 where nothing but the model restricts them.
    #[serde(rename = "lessons")]
    pub n_lessons: usize,
}

/// What is known of how good a plan is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanProof {
    /// Cost of the plan's worst piece.
    pub cost: f64,
    /// See [`FoundPlan::lower_bound`].
    pub lower_bound: f64,
    /// How much cheaper another plan may be, as share of the cost, in [0, 1].
    pub gap: f64,
    /// Whether the cost was proven to be the least.
    pub optimal: bool,
    /// Cost of the cheapest plan that is known; less than `cost` where a plan that costs a little more was
    /// chosen.
    pub least_cost: f64,
    /// See [`FoundPlan::key_lower_bound`].
    pub key_lower_bound: f64,
    /// For which plans the bound holds.
    pub proven_for: ProofScope,
    /// Cost of each piece.
    pub piece_costs: IdVec<PatchId, f64>,
}

impl FoundPlan {
    /// The survey with joints counted as when the plan was found.
    pub fn counted(&self, survey: &PlanSurvey) -> PlanSurvey {
        let mut counted = survey.clone();
        counted
            .contacts
            .iter_mut()
            .for_each(|c| c.count_runs_from(self.run_sizes));
        counted
    }

    /// The figures alone.
    pub fn proof(&self) -> PlanProof {
        let (cost, lower_bound) = (self.score.worst, self.lower_bound);
        let (proven_for, piece_costs) = (self.scope.clone(), self.score.pieces.clone());
        let least_cost = self.pool.iter().map(|p| p.score.worst).fold(cost, f64::min);
        PlanProof {
            cost,
            lower_bound,
            gap: self.gap(),
            optimal: self.is_optimal,
            least_cost,
            key_lower_bound: self.key_lower_bound,
            proven_for,
            piece_costs,
        }
    }

    /// How much cheaper another plan may be, as share of this one's cost, in [0, 1].
    pub fn gap(&self) -> f64 {
        if self.score.worst > 0.0 {
            1.0 - self.lower_bound / self.score.worst
        } else {
            0.0
        }
    }
}

/// The answer of the search. Both are results, not errors.
#[derive(Clone, Debug, PartialEq)]
pub enum PlanOutcome {
    /// A plan that keeps every condition.
    Found(Box<FoundPlan>),
    /// None was found.
    Infeasible {
        /// Why, for people.
        reason: String,
        /// Who is in whose way; empty where paths are free but no plan locks.
        blockers: Vec<Blocker>,
        /// Articulation pieces of the contact graph: splitting one of them may help.
        articulations: Vec<PatchId>,
    },
}
