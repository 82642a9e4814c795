//! Cost of a plan, estimated before anything is built.
//!
//! Stands in for the paper's metrics (Sect. 5), which need simulated connectors. Like them, the cost is a
//! bottleneck over the pieces. As in Eq. 6, the cost of a piece depends only on the directions along its own
//! boundaries. The metrics of a later stage may rank the same plans anew; [`score`](super::space::score) is
//! the one place to change. Pieces that the verification would find loose cost more than anything else: see
//! [`interface`](super::interface). The cost of a plan is the pure bottleneck, so that bounds can be proved.
//! The mean decides between plans with the same bottleneck.

use shellock_report::{IdVec, PatchId};

use super::PlanSurvey;

/// Cost of a seam without any usable length, in units of Eq. 4's weight. Scales with the unusable share.
const UNUSABLE_COST: f64 = 0.5;

/// Cost scale of leaving inwards instead of outwards, in units of Eq. 4's weight.
///
/// Pieces that leave along their mean normal need the least carving of walls.
const INWARD_COST: f64 = 0.25;

/// Cost of each hundredth of a piece that others occlude on its way, in units of Eq. 4's weight.
///
/// Carving must absorb the occlusion. In finished kits of four models, three of four paths that rubbed had
/// some occlusion; most free paths have none.
const OCCLUDED_COST: f64 = 0.3;

/// Hold that the verification requires, mm³.
pub const ASKED_MM3: f64 = 0.5;

/// Estimated hold from which a piece counts as held, mm³: three times what the verification requires.
pub(super) const HELD_MM3: f64 = 3.0 * ASKED_MM3;

/// Estimated hold from which a piece counts as firmly held, mm³.
///
/// Plans optimised for load use up whatever margin is allowed. When only [`HELD_MM3`] was required, two of
/// five first kits (a gargoyle, a cat) came out with a loose piece: a short connector that the estimate
/// relied on was carved away.
pub(super) const FIRM_MM3: f64 = 3.0 * HELD_MM3;

/// Cost of a piece that is not held at all, in units of Eq. 4's weight.
///
/// A loose piece costs a whole second round. So missing a tenth of the target hold outweighs most other
/// differences.
pub(super) const LOOSE_COST: f64 = 20.0;

/// Cost of a plan; lower is better.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanScore {
    /// Cost of the worst piece, usually in [0.1, 2]; up to 20 more if a piece is loose.
    pub worst: f64,
    /// Mean cost of the pieces. Decides between plans with the same worst cost.
    pub mean: f64,
    /// Cost of each piece, in [β, 2 + β), and more if others occlude it on its way or if it is loose.
    pub pieces: IdVec<PatchId, f64>,
}

/// Relative difference of costs below which rounding decides. Relative, since metrics may have any unit.
const COST_TIE: f64 = 1e-9;

/// Greatest cost that is less than `cost` by more than rounding.
pub(super) fn just_below(cost: f64) -> f64 {
    cost * (1.0 - COST_TIE)
}

/// Greatest cost that equals `cost` up to rounding.
pub(super) fn just_above(cost: f64) -> f64 {
    cost * (1.0 + COST_TIE)
}

/// Rounds `cost` to 30 binary digits, a step slightly finer than the rounding tolerance. Equality of rounded
/// costs is an equivalence relation.
pub(super) fn round_cost(cost: f64) -> f64 {
    const DROPPED: u32 = 52 - 30;
    let half = 1 << (DROPPED - 1);
    f64::from_bits(cost.to_bits().wrapping_add(half) >> DROPPED << DROPPED)
}

impl PlanScore {
    /// Builds the score from the cost of each piece.
    pub fn of(pieces: IdVec<PatchId, f64>) -> Self {
        let worst = pieces.as_slice().iter().copied().fold(0.0, f64::max);
        let mean = pieces.as_slice().iter().sum::<f64>() / pieces.len().max(1) as f64;
        Self { worst, mean, pieces }
    }

    /// Returns true if the worst piece costs less than `other`'s, or as much and the mean is lower.
    pub fn is_better_than(&self, other: &Self) -> bool {
        self.worst < just_below(other.worst)
            || (self.worst <= just_above(other.worst) && self.mean < just_below(other.mean))
    }
}

/// Cost of one contact if `later` leaves along `s`. A contact that joins nothing has the greatest possible
/// cost.
pub(super) fn contact_cost(
    survey: &PlanSurvey,
    contact: &super::interface::Interface,
    later: PatchId,
    s: shellock_assembly::LatticeDirection,
    is_weak: bool,
) -> f64 {
    let joint = contact.joint(later, s);
    if joint.holds && !is_weak {
        joint.weight + UNUSABLE_COST * (1.0 - joint.usable)
    } else {
        1.0 + survey.beta + UNUSABLE_COST
    }
}

/// Cost of `piece` for leaving along `s` instead of straight outwards, in [0, 0.5].
pub(super) fn inward_cost(
    survey: &PlanSurvey,
    piece: PatchId,
    s: shellock_assembly::LatticeDirection,
) -> f64 {
    INWARD_COST * (1.0 - survey.mean_normal[piece].dot(s.unit()))
}

/// Cost of the share of `piece` that the earlier piece `q` occludes on its way along `s`.
pub(super) fn occluded_cost(
    survey: &PlanSurvey,
    piece: PatchId,
    s: shellock_assembly::LatticeDirection,
    q: PatchId,
) -> f64 {
    OCCLUDED_COST * 100.0 * survey.occlusion.share(piece, q, s)
}
