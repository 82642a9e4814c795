//! Local optimisation: other directions for the worst piece, then for its neighbours (Sect. 6.3); before them for the
//! piece that is held least and for its neighbours, while there is one that might come loose.

use super::key::KeyChoice;
use super::score::HELD_MM3;
use super::space::Space;
use super::{InstallationPlan, PieceSet, score};
use crate::{LatticeDirection, PatchId};

/// Improvements after which a plan is left as it is: a bound on time, since each one lowers the cost anyway.
const MAX_IMPROVEMENTS: usize = 100;

/// Cost gain that counts; below, rounding decides.
const LEAST_GAIN: f64 = 1e-9;

/// A plan of the same order that is at least as good as `plan`, and its cost.
///
/// Stops where no single change of direction of the worst or least held piece or of a piece that touches it helps.
pub(super) fn improve(space: &Space<'_>, key: &KeyChoice, mut plan: InstallationPlan) -> (f64, InstallationPlan) {
    let mut cost = space.cost(&plan);
    for _ in 0..MAX_IMPROVEMENTS {
        let better = worst_first(space, &plan).into_iter().find_map(|p| better_direction(space, key, &plan, cost, p));
        match better {
            Some(found) => (cost, plan) = found,
            None => break,
        }
    }
    (cost, plan)
}

/// The least held piece and its neighbours where it may be loose, then the worst piece and its neighbours, by cost.
fn worst_first(space: &Space<'_>, plan: &InstallationPlan) -> Vec<PatchId> {
    let score = score(space.survey, space.constraints, plan);
    let mut by_cost: Vec<PatchId> = score.pieces.ids().collect();
    by_cost.sort_by(|&x, &y| score.pieces[y].total_cmp(&score.pieces[x]).then(x.cmp(&y)));
    let worst = by_cost[0];
    let loosest = score.hold_mm3.ids().min_by(|&x, &y| score.hold_mm3[x].total_cmp(&score.hold_mm3[y]));
    let loosest = loosest.filter(|&p| score.hold_mm3[p] < HELD_MM3);
    let near = |to: PatchId| by_cost.iter().copied().filter(move |&p| space.neighbours[usize::from(to)].contains(p));
    let mut order: Vec<PatchId> = Vec::with_capacity(2 * by_cost.len());
    for piece in loosest.into_iter().chain([worst]) {
        order.extend([piece].into_iter().chain(near(piece)));
    }
    // A piece named twice is tried where it comes first.
    let mut seen = PieceSet::EMPTY;
    order.retain(|&p| {
        let is_new = !seen.contains(p);
        seen = seen.union(PieceSet::one(p));
        is_new
    });
    order
}

/// The best other direction of `piece`, where one is better than `cost`.
fn better_direction(
    space: &Space<'_>,
    key: &KeyChoice,
    plan: &InstallationPlan,
    cost: f64,
    piece: PatchId,
) -> Option<(f64, InstallationPlan)> {
    let at = plan.position(piece);
    if at == 0 {
        return None;
    }
    let mut best: Option<(f64, InstallationPlan)> = None;
    for s in LatticeDirection::all() {
        if piece == plan.key() && !key.directions.contains(&s) {
            continue;
        }
        let mut other = plan.clone();
        other.steps[at].separation = s;
        let other_cost = space.cost(&other);
        let to_beat = best.as_ref().map_or(cost, |b| b.0);
        if other_cost < to_beat - LEAST_GAIN && space.allows(&other) {
            best = Some((other_cost, other));
        }
    }
    best
}
