//! Local optimisation: other directions for the worst piece, then for its neighbours (Sect. 6.2), then for
//! all others. The last step may lower the mean if the worst piece cannot be improved.

use shellock_assembly::LatticeDirection;
use shellock_report::{IdVec, PatchId};

use super::key::KeyChoice;
use super::local_cost::{Role, Surroundings, mask_of};
use super::score::PlanScore;
use super::space::Space;
use super::{LatticePlan, PieceSet};

/// Improvements after which a plan is left as it is. Bounds the time only, since each one lowers the cost
/// anyway.
const MAX_IMPROVEMENTS: usize = 100;

/// An improved plan, its cost, and the number of plans evaluated for it.
pub(super) struct Improved {
    pub score: PlanScore,
    pub plan: LatticePlan,
    pub n_evaluations: usize,
}

/// Finds a plan of the same order that is at least as good as `plan`, which must satisfy all conditions.
///
/// Stops when no change of a single direction helps.
pub(super) fn improve(space: &Space<'_>, key: &KeyChoice, plan: LatticePlan) -> Improved {
    let mut best = Improved {
        score: space.score(&plan),
        plan,
        n_evaluations: 1,
    };
    for _ in 0..MAX_IMPROVEMENTS {
        let is_improved = worst_first(space, &best.score)
            .into_iter()
            .any(|p| turn(space, key, &mut best, p));
        if !is_improved {
            break;
        }
    }
    best
}

/// Order of improvement: the worst piece and its neighbours by cost, then all others by cost.
fn worst_first(space: &Space<'_>, score: &PlanScore) -> Vec<PatchId> {
    let mut by_cost: Vec<PatchId> = score.pieces.ids().collect();
    by_cost.sort_by(|&x, &y| score.pieces[y].total_cmp(&score.pieces[x]).then(x.cmp(&y)));
    let near: PieceSet = space.neighbours[usize::from(by_cost[0])].union(PieceSet::one(by_cost[0]));
    let (mut first, others): (Vec<PatchId>, Vec<PatchId>) =
        by_cost.into_iter().partition(|&p| near.contains(p));
    first.extend(others);
    first
}

/// Turns `piece` to the best other direction, if one improves the plan. Returns true if so.
fn turn(space: &Space<'_>, key: &KeyChoice, best: &mut Improved, piece: PatchId) -> bool {
    let at = best.plan.position(piece);
    if at == 0 {
        return false;
    }
    let from = best.plan.clone();
    let costs = best.score.pieces.clone();
    let mut around = space.surroundings(&from);
    let mut is_improved = false;
    for s in LatticeDirection::all() {
        if s == from.steps[at].separation || (piece == from.key() && !key.directions.contains(&s)) {
            continue;
        }
        best.n_evaluations += 1;
        let score = score_along(space, &mut around, &costs, piece, s);
        if score.is_better_than(&best.score) {
            let mut other = from.clone();
            other.steps[at].separation = s;
            if space.allows(&other) {
                (best.score, best.plan) = (score, other);
                is_improved = true;
            }
        }
    }
    is_improved
}

/// Score of the plan if `piece` leaves along `s`. Only its own cost and those of its earlier neighbours
/// differ from `costs`.
fn score_along(
    space: &Space<'_>,
    around: &mut [(Role, Surroundings)],
    costs: &IdVec<PatchId, f64>,
    piece: PatchId,
    s: LatticeDirection,
) -> PlanScore {
    let at = usize::from(piece);
    let mut costs = costs.clone();
    for (k, &contact) in space.contacts_of[at].iter().enumerate() {
        let is_later = around[at].1.seams[k].own != 0;
        if !is_later {
            continue;
        }
        around[at].1.seams[k].own = mask_of(s);
        let q = space.survey.contacts[contact].other(piece);
        let of_other = &space.contacts_of[usize::from(q)];
        let (role, near) = &mut around[usize::from(q)];
        if let Some(k) = of_other.iter().position(|&c| c == contact) {
            near.seams[k].others = mask_of(s);
        }
        costs[q] = space.costs.bound(q, *role, near);
    }
    let (role, near) = &mut around[at];
    *role = if let Role::Key(_) = role {
        Role::Key(s)
    } else {
        Role::Between(s)
    };
    costs[piece] = space.costs.bound(piece, *role, near);
    PlanScore::of(costs)
}
