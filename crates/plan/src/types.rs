//! Plans, the constraints on them, and the reasons why none is found.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use shellock_assembly::{InstallationPlan, InstallationStep, LatticeDirection};
use shellock_report::{IdVec, PatchId};
use shellock_surface::Turn;

use super::key::KeyDirections;
use super::space::MOST_RUBS;
use super::{PlanScore, PlanSurvey};

/// A plan whose directions are among the 26 lattice directions. The search finds such plans, and pieces are
/// made by them.
pub type LatticePlan = InstallationPlan<LatticeDirection>;
/// One step of a lattice plan.
pub type LatticeStep = InstallationStep<LatticeDirection>;

/// Lessons of earlier rounds, all of which the search must respect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanConstraints {
    /// (later piece, earlier piece, separation direction of the later one) whose connectors came out too
    /// small to hold. Such a pair touches but joins nothing. Along other directions it may join.
    pub weak_joints: BTreeSet<(PatchId, PatchId, LatticeDirection)>,
    /// Directions that a piece must not take because it rubbed on its way.
    pub forbidden: BTreeSet<(PatchId, LatticeDirection)>,
    /// Number of times that a piece (first) rubbed against an earlier one (second). After two, along two
    /// directions, the first piece must be installed before the second.
    pub rubs: BTreeMap<(PatchId, PatchId), usize>,
    /// Whole plans that failed for a reason not covered by the fields above.
    pub rejections: Vec<LatticePlan>,
    /// Share of the foreseen hold of a piece that connectors had in a plan that was given up, in [0, 1).
    pub held_shares: BTreeMap<PatchId, f64>,
}

impl PlanConstraints {
    /// Number of lessons that restrict plans.
    pub fn n_lessons(&self) -> usize {
        let Self {
            weak_joints,
            forbidden,
            rubs: rubbed,
            rejections,
            // Restricts no plan of the search, only the choice among them.
            held_shares: _,
        } = self;
        let n_orders = rubbed.values().filter(|&&n| n >= MOST_RUBS).count();
        weak_joints.len() + forbidden.len() + n_orders + rejections.len()
    }

    /// Marks that `a` and `b` join nothing, whichever is later and along any direction.
    #[cfg(test)]
    pub fn weaken(&mut self, a: PatchId, b: PatchId) {
        self.weak_joints
            .extend(LatticeDirection::all().flat_map(|s| [(a, b, s), (b, a, s)]));
    }

    /// Returns true if nothing joins the two when `later` leaves along `s`.
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
    /// Place of the obstruction, mm in assembly space.
    pub at: [f64; 3],
    /// Share of `piece` that `by` occludes along the best direction, in [0, 1].
    pub occluded: f64,
}

impl Blocker {
    /// Moves the place to the model after a turn.
    pub fn rotate(self, turn: &Turn) -> Self {
        Self {
            at: turn.apply(self.at.into()).to_array(),
            ..self
        }
    }
}

/// A plan with its cost.
#[derive(Clone, Debug, PartialEq)]
pub struct RankedPlan {
    /// Plan that was ranked.
    pub plan: LatticePlan,
    /// Cost of the plan, which is that of its worst piece, and cost of every piece.
    pub score: PlanScore,
    /// Pieces held by less than the verification requires, by estimate.
    pub loose: Vec<PatchId>,
}

/// The best plan found, with bounds on how good any other plan with an equally good key can be.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundPlan {
    /// Best plan that was found.
    pub plan: LatticePlan,
    /// Cost of the plan, which is that of its worst piece, and cost of every piece.
    pub score: PlanScore,
    /// Proven lower bound: no allowed plan within `scope` costs less.
    pub lower_bound: f64,
    /// Proven lower bound for plans within `scope` that have this plan's key. At least `lower_bound`, since a
    /// single key leaves fewer plans.
    pub key_lower_bound: f64,
    /// True if the cost of `plan` is proven to be the least within `scope`.
    pub is_optimal: bool,
    /// Plans for which the bounds hold.
    pub scope: ProofScope,
    /// Share of a piece that others may occlude, as used in the search for this plan.
    pub tolerance: f64,
    /// Shortest run that counted as a joint, in connector sizes.
    pub run_sizes: f64,
    /// Up to 100 plans with the same key and different relations between pieces: first `plan`, then the
    /// others, cheapest first.
    pub pool: Vec<RankedPlan>,
}

/// The plans for which a lower bound holds. The bound says nothing about any other plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProofScope {
    /// Pieces that may be the key, most preferred first. All are flat or all are curved, as the plan's own
    /// key is.
    pub keys: Vec<PatchId>,
    /// Kind of direction along which the key slides out.
    #[serde(rename = "key_slides")]
    pub slides: KeyDirections,
    /// Number of lessons of failed kits that plans must respect; 0 if nothing but the model restricts them.
    #[serde(rename = "lessons")]
    pub n_lessons: usize,
}

/// Cost of a plan with its proven bounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanProof {
    /// Cost of the plan's worst piece.
    pub cost: f64,
    /// Proven lower bound, see [`FoundPlan::lower_bound`].
    pub lower_bound: f64,
    /// Greatest possible saving by another plan, as a share of the cost, in [0, 1].
    pub gap: f64,
    /// True if the cost is proven to be the least.
    pub optimal: bool,
    /// Cost of the cheapest known plan. Less than `cost` if a slightly costlier plan was chosen.
    pub least_cost: f64,
    /// Lower bound with this key, see [`FoundPlan::key_lower_bound`].
    pub key_lower_bound: f64,
    /// Plans for which the bound holds.
    pub proven_for: ProofScope,
    /// Cost of each piece.
    pub piece_costs: IdVec<PatchId, f64>,
}

impl FoundPlan {
    /// Returns a copy of `survey` in which joints count as they did when the plan was found.
    pub fn apply_counts(&self, survey: &PlanSurvey) -> PlanSurvey {
        let mut counted = survey.clone();
        counted
            .contacts
            .iter_mut()
            .for_each(|c| c.count_runs_from(self.run_sizes));
        counted
    }

    /// Returns the figures of the proof without the plans.
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

    /// Greatest possible saving by another plan, as a share of this plan's cost, in [0, 1]; 0 if the plan
    /// costs nothing.
    pub fn gap(&self) -> f64 {
        if self.score.worst > 0.0 {
            1.0 - self.lower_bound / self.score.worst
        } else {
            0.0
        }
    }
}

/// Answer of the search. Both variants are results, not errors.
#[derive(Clone, Debug, PartialEq)]
pub enum PlanOutcome {
    /// A plan that satisfies every condition.
    Found(Box<FoundPlan>),
    /// No plan was found.
    Infeasible {
        /// Reason, as a message for people.
        reason: String,
        /// Pieces in each other's way; empty if paths are free but no plan locks.
        blockers: Vec<Blocker>,
        /// Articulation pieces of the contact graph. Splitting one of them may help.
        articulations: Vec<PatchId>,
        /// Pieces that seams long enough for connectors do not join to most others, or only through an
        /// articulation piece. Longer seams may help.
        apart: Vec<PatchId>,
    },
}
