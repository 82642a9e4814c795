//! How good a plan is, before anything is built.
//!
//! A stand-in for the paper's metrics (Sect. 5), which need simulated connectors: like them it is a bottleneck over the
//! pieces, and like Eq. 6 the cost of a piece depends only on the directions along its own boundaries. The metrics of a
//! later stage may rank the same plans anew; [`score`] is the one place to change.

use super::{InstallationPlan, PlanConstraints, PlanSurvey};
use crate::{IdVec, PatchId};

/// What the share of seam without connectors costs, in units of Eq. 4's weight.
const UNUSABLE_COST: f64 = 0.5;

/// What leaving inwards instead of outwards costs, in units of Eq. 4's weight.
///
/// Walls of pieces that leave along their mean normal need the least carving.
const INWARD_COST: f64 = 0.25;

/// How much the mean over the pieces counts beside the worst piece.
///
/// Enough to choose among plans that share a bottleneck, too little to trade the bottleneck away.
const MEAN_SHARE: f64 = 0.25;

/// How good a plan is; lower is better.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanScore {
    /// Cost of the worst piece plus a smaller part of the mean, about in [0.1, 2.5].
    pub value: f64,
    /// Cost of each piece, in [β, 2 + β).
    pub pieces: IdVec<PatchId, f64>,
}

/// Costs of `plan`: of each piece the mean over its seams, by length, of Eq. 4's weight and of what cannot be used.
pub fn score(survey: &PlanSurvey, constraints: &PlanConstraints, plan: &InstallationPlan) -> PlanScore {
    let n = survey.n_pieces;
    let mut position = vec![0; n];
    let mut separation = vec![plan.steps[0].separation; n];
    for (i, step) in plan.steps.iter().enumerate() {
        position[usize::from(step.piece)] = i;
        separation[usize::from(step.piece)] = step.separation;
    }
    let mut cost = vec![0.0; n];
    let mut length_mm = vec![0.0; n];
    for contact in &survey.contacts {
        let (a, b) = (usize::from(contact.a), usize::from(contact.b));
        let later = if position[a] > position[b] { contact.a } else { contact.b };
        let is_weak = constraints.weak_contacts.contains(&(contact.a, contact.b));
        let contact_cost = contact_cost(survey, contact, later, separation[usize::from(later)], is_weak);
        for p in [a, b] {
            cost[p] += contact_cost * contact.length_mm;
            length_mm[p] += contact.length_mm;
        }
    }
    for (p, cost) in cost.iter_mut().enumerate() {
        *cost /= length_mm[p].max(f64::MIN_POSITIVE);
        // The first piece never leaves, and the key slides out along the surface.
        if position[p] != 0 && position[p] != n - 1 {
            *cost += inward_cost(survey, PatchId::from(p), separation[p]);
        }
    }
    let worst = cost.iter().copied().fold(0.0, f64::max);
    let mean = cost.iter().sum::<f64>() / n as f64;
    PlanScore { value: worst + MEAN_SHARE * mean, pieces: cost.into_iter().collect() }
}

/// Cost of one contact where `later` leaves along `s`; a contact that joins nothing costs as much as any can.
pub(super) fn contact_cost(
    survey: &PlanSurvey,
    contact: &super::contact::Contact,
    later: PatchId,
    s: crate::LatticeDirection,
    is_weak: bool,
) -> f64 {
    let joint = contact.joint(later, s);
    if joint.holds && !is_weak {
        joint.weight + UNUSABLE_COST * (1.0 - joint.usable)
    } else {
        1.0 + survey.beta + UNUSABLE_COST
    }
}

/// Cost of `piece` leaving along `s` instead of straight outwards, in [0, 0.5].
pub(super) fn inward_cost(survey: &PlanSurvey, piece: PatchId, s: crate::LatticeDirection) -> f64 {
    INWARD_COST * (1.0 - survey.mean_normal[piece].dot(s.unit()))
}

#[cfg(test)]
mod tests {
    use shellock_geom::Vec3;

    use super::*;
    use crate::LatticeDirection;
    use crate::plan::testing::{label, seams, sphere};
    use crate::plan::{InstallationStep, PlanParams, survey};

    #[test]
    fn a_hemisphere_that_leaves_along_its_axis_beats_every_other_direction() {
        let surface = label(sphere(4, Vec3::splat(50.0)), 2, |p| u32::from(p.z > 0.0));
        let stop = std::sync::atomic::AtomicBool::new(false);
        let ctx = crate::Ctx::new(&|_| {}, &stop);
        let survey = survey(&ctx, &PlanParams::default(), &surface, &seams(&surface)).unwrap();
        let up = LatticeDirection::nearest(Vec3::Z);
        let value = |separation| {
            let steps = [0, 1].map(|p| InstallationStep { piece: PatchId(p), separation }).to_vec();
            score(&survey, &PlanConstraints::default(), &InstallationPlan { steps }).value
        };
        for s in LatticeDirection::all().filter(|&s| s != up) {
            assert!(value(up) < value(s));
        }
        // Weight β = 0.1 for both pieces, nothing unusable.
        assert!((value(up) - 0.125).abs() < 0.03);
    }
}
