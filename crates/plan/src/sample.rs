//! Random plans that satisfy every condition, for studies of metrics (Sect. 5.4).

use std::collections::BTreeSet;

use shellock_surface::seam::rules::COUNTED_RUN_SIZES;

use super::draw::{DrawLimits, draw};
use super::key::choices;
use super::search::stream;
use super::space::Space;
use super::{LatticePlan, PlanConstraints, PlanParams, PlanSurvey};

/// Index of the widest spread, with which draws depend little on costs.
const WIDEST: usize = 3;
/// Draws per wanted plan, after which a key is abandoned.
const DRAWS_PER_PLAN: usize = 4;
const TRIES_PER_PIECE: usize = 20;

/// Up to `n` different plans, all with one key: the one with the most plans within the allowed draws.
pub fn random_plans(params: &PlanParams, survey: &PlanSurvey, n: usize) -> Vec<LatticePlan> {
    let constraints = PlanConstraints::default();
    let mut most = Vec::new();
    for sizes in COUNTED_RUN_SIZES {
        let mut counted = survey.clone();
        counted.contacts.iter_mut().for_each(|c| c.count_runs_from(sizes));
        let space = Space::new(&counted, &constraints, params.relaxed_tolerance);
        for key in choices(params, &counted) {
            let mut plans: Vec<LatticePlan> = Vec::new();
            let mut seen = BTreeSet::new();
            let mut is_new = |plan: &LatticePlan| {
                let steps = plan.steps.iter().map(|step| (step.piece, step.separation));
                seen.insert(steps.collect::<Vec<_>>())
            };
            for i in 0..DRAWS_PER_PLAN * n {
                let limits = DrawLimits {
                    bound: f64::INFINITY,
                    max_tries: TRIES_PER_PIECE * space.n,
                };
                let drawn = draw(&space, &key, stream(params.seed, i), WIDEST, limits);
                plans.extend(drawn.plan.filter(|p| is_new(p)));
                let is_hopeless = plans.is_empty() && i >= n;
                if plans.len() >= n {
                    return plans;
                }
                if is_hopeless {
                    break;
                }
            }
            if plans.len() > most.len() {
                most = plans;
            }
        }
    }
    most
}
