//! How good a plan is, before anything is built.
//!
//! A stand-in for the paper's metrics (Sect. 5), which need simulated connectors: like them it is a bottleneck over the
//! pieces, and like Eq. 6 the cost of a piece depends only on the directions along its own boundaries. The metrics of a
//! later stage may rank the same plans anew; [`score`] is the one place to change. Pieces that the verification would find
//! loose cost more than anything else: see [`contact`](super::contact).

use super::{InstallationPlan, PlanConstraints, PlanSurvey};
use crate::push::N_PUSHES;
use crate::{IdVec, PatchId};

/// What the share of seam without connectors costs, in units of Eq. 4's weight.
const UNUSABLE_COST: f64 = 0.5;

/// What leaving inwards instead of outwards costs, in units of Eq. 4's weight.
///
/// Walls of pieces that leave along their mean normal need the least carving.
const INWARD_COST: f64 = 0.25;

/// What a hundredth of a piece costs that others occlude on its way, in units of Eq. 4's weight.
///
/// Carving must absorb it: three of four paths that rubbed in finished kits of four models had some, most free paths have none.
const OCCLUDED_COST: f64 = 0.3;

/// How much the mean over the pieces counts beside the worst piece.
///
/// Enough to choose among plans that share a bottleneck, too little to trade the bottleneck away.
const MEAN_SHARE: f64 = 0.25;

/// Estimated hold from which a piece counts as held, mm³: three times what the verification asks for.
pub(super) const HELD_MM3: f64 = 1.5;

/// What a piece that is not held at all costs, in units of Eq. 4's weight.
///
/// A loose piece costs a whole second round, so a tenth of the target outweighs most of what else can differ.
const LOOSE_COST: f64 = 20.0;

/// How good a plan is; lower is better.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanScore {
    /// Cost of the worst piece plus a smaller part of the mean, about in [0.1, 2.5]; more by up to 25 where one is loose.
    pub value: f64,
    /// Cost of each piece, in [β, 2 + β) and more where others occlude it on its way.
    pub pieces: IdVec<PatchId, f64>,
    /// Estimated overlap, mm³, with which each piece resists the push that it resists least; infinite for the key.
    pub hold_mm3: IdVec<PatchId, f64>,
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
    let mut pushed = vec![[0.0_f32; N_PUSHES]; n];
    for contact in &survey.contacts {
        let (a, b) = (usize::from(contact.a), usize::from(contact.b));
        let later = if position[a] > position[b] { contact.a } else { contact.b };
        let s = separation[usize::from(later)];
        let is_weak = constraints.is_weak(later, contact.other(later), s);
        let contact_cost = contact_cost(survey, contact, later, s, is_weak);
        if let Some(hold) = contact.hold(later, s).filter(|_| !is_weak) {
            for (piece, held) in [later, contact.other(later)].into_iter().zip(hold) {
                pushed[usize::from(piece)].iter_mut().zip(held).for_each(|(sum, mm3)| *sum += mm3);
            }
        }
        for p in [a, b] {
            cost[p] += contact_cost * contact.length_mm;
            length_mm[p] += contact.length_mm;
        }
    }
    for (p, cost) in cost.iter_mut().enumerate() {
        *cost = *cost / length_mm[p].max(f64::MIN_POSITIVE) + path_cost(survey, &position, p, separation[p]);
    }
    let worst = cost.iter().copied().fold(0.0, f64::max);
    let mean = cost.iter().sum::<f64>() / n as f64;
    let least = |p: usize| pushed[p].iter().copied().fold(f32::INFINITY, f32::min);
    let hold_mm3: IdVec<PatchId, f64> =
        (0..n).map(|p| if position[p] == n - 1 { f64::INFINITY } else { f64::from(least(p)) }).collect();
    let value = worst + MEAN_SHARE * mean + loose_cost(&hold_mm3);
    PlanScore { value, pieces: cost.into_iter().collect(), hold_mm3 }
}

/// Cost of the way of piece `p` along `s`, out of the pieces with a lower `position`.
fn path_cost(survey: &PlanSurvey, position: &[usize], p: usize, s: crate::LatticeDirection) -> f64 {
    let piece = PatchId::from(p);
    // The first piece never leaves, and the key slides out along the surface.
    let is_between = position[p] != 0 && position[p] != position.len() - 1;
    let inward = if is_between { inward_cost(survey, piece, s) } else { 0.0 };
    let earlier = (0..position.len()).filter(|&q| position[q] < position[p]).map(PatchId::from);
    inward + occluded_cost(survey, piece, s, earlier)
}

/// Cost of pieces that are held less than they should be: of the loosest one, and a smaller part of the mean.
fn loose_cost(hold_mm3: &IdVec<PatchId, f64>) -> f64 {
    let missing = || hold_mm3.as_slice().iter().map(|h| (1.0 - h / HELD_MM3).max(0.0));
    let mean = missing().sum::<f64>() / hold_mm3.len() as f64;
    LOOSE_COST * (missing().fold(0.0, f64::max) + MEAN_SHARE * mean)
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

/// Cost of what the `earlier` pieces occlude of `piece` on its way along `s`.
pub(super) fn occluded_cost(
    survey: &PlanSurvey,
    piece: PatchId,
    s: crate::LatticeDirection,
    earlier: impl Iterator<Item = PatchId>,
) -> f64 {
    OCCLUDED_COST * 100.0 * earlier.map(|q| survey.occlusion.share(piece, q, s)).sum::<f64>()
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
    }

    /// Hold of a plate in the +z plane, whose only neighbour, all round it, leaves later along `s`.
    fn hold_of_plate(s: Vec3, is_weak: bool) -> f64 {
        let surface = label(sphere(4, Vec3::splat(50.0)), 2, |p| u32::from(p.z < 0.0));
        let stop = std::sync::atomic::AtomicBool::new(false);
        let ctx = crate::Ctx::new(&|_| {}, &stop);
        let survey = survey(&ctx, &PlanParams::default(), &surface, &seams(&surface)).unwrap();
        let separation = LatticeDirection::nearest(s);
        let steps = [0, 1].map(|p| InstallationStep { piece: PatchId(p), separation }).to_vec();
        let mut constraints = PlanConstraints::default();
        if is_weak {
            constraints.weak_contacts.insert((PatchId(0), PatchId(1)));
        }
        score(&survey, &constraints, &InstallationPlan { steps }).hold_mm3[PatchId(0)]
    }

    #[test]
    fn a_piece_is_loose_opposite_to_its_only_later_neighbour_and_without_connectors() {
        // The later one leaves along −z, so the plate may go along +z; across, nothing gives.
        assert!(hold_of_plate(-Vec3::Z, false) < 1e-3);
        assert_eq!(hold_of_plate(-Vec3::Z, true), 0.0);
    }
}
