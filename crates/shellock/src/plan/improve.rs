//! Local optimisation: other directions for the worst piece, then for its neighbours (Sect. 6.3).

use super::key::KeyChoice;
use super::space::Space;
use super::{InstallationPlan, score};
use crate::{LatticeDirection, PatchId};

/// Improvements after which a plan is left as it is: a bound on time, since each one lowers the cost anyway.
const MAX_IMPROVEMENTS: usize = 100;

/// Cost gain that counts; below, rounding decides.
const LEAST_GAIN: f64 = 1e-9;

/// A plan of the same order that is at least as good as `plan`, and its cost.
///
/// Stops where no single change of direction of the worst piece or of a piece that touches it helps.
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

/// The worst piece and then its neighbours by cost.
fn worst_first(space: &Space<'_>, plan: &InstallationPlan) -> Vec<PatchId> {
    let pieces = score(space.survey, space.constraints, plan).pieces;
    let mut order: Vec<PatchId> = pieces.ids().collect();
    order.sort_by(|&x, &y| pieces[y].total_cmp(&pieces[x]).then(x.cmp(&y)));
    let worst = order[0];
    order.retain(|&p| p == worst || space.neighbours[usize::from(worst)].contains(p));
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
