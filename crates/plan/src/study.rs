//! Convergence of the randomised search, with and without its two techniques (Fig. 14).

use rayon::prelude::*;
use shellock_report::{Cancelled, Ctx};

use super::draw::{DrawLimits, draw};
use super::improve::improve;
use super::key::choices;
use super::score::PlanScore;
use super::search::stream;
use super::space::Space;
use super::{LatticePlan, PlanConstraints, PlanParams, PlanSurvey};

/// Draws between two updates of the best cost. The bound of a batch is the best cost of the batches before.
const BATCH: usize = 8;

/// Techniques of the search, beside connectivity, free paths and the cluster test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Technique {
    /// Neither of the two techniques.
    Random,
    /// Prunes pieces that cost more than the worst piece of the best plan.
    Pruning,
    /// Improves each drawn plan locally.
    LocalOptimisation,
    /// Both pruning and local optimisation.
    Both,
}

impl Technique {
    /// All four combinations of techniques.
    pub const ALL: [Self; 4] = [Self::Random, Self::Pruning, Self::LocalOptimisation, Self::Both];

    fn prunes(self) -> bool {
        matches!(self, Self::Pruning | Self::Both)
    }

    fn improves(self) -> bool {
        matches!(self, Self::LocalOptimisation | Self::Both)
    }
}

/// Best cost after a given amount of work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostSample {
    /// Number of piece costs that draws evaluated, plus number of plans that local optimisation evaluated.
    pub n_evaluations: usize,
    /// Number of plans drawn.
    pub n_plans: usize,
    /// Cost of the best plan's worst piece.
    pub best_cost: f64,
}

/// Convergence curve of the first key that has any plan: one sample each time the best cost falls, and one at
/// the end of `n_evaluations`.
///
/// All draws are alike here (none is greedy), so the curves show the effect of the techniques. Empty if no
/// key has a plan. One seed gives one curve on any number of threads.
pub fn convergence(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    survey: &PlanSurvey,
    technique: Technique,
    n_evaluations: usize,
) -> Result<Vec<CostSample>, Cancelled> {
    let constraints = PlanConstraints::default();
    let space = Space::new(survey, &constraints, params.occlusion_tolerance);
    for key in choices(params, survey) {
        let mut samples: Vec<CostSample> = Vec::new();
        let (mut n_done, mut n_plans, mut best) = (0, 0, f64::INFINITY);
        let mut batch = 0;
        while n_done < n_evaluations && (n_plans > 0 || batch < MOST_EMPTY_BATCHES) {
            ctx.check()?;
            let limits = DrawLimits {
                bound: if technique.prunes() { best } else { f64::INFINITY },
                max_tries: 20 * space.n,
            };
            let one = |i: usize| {
                // The last of the spreads is uniform.
                let drawn = draw(&space, &key, stream(params.seed, i), UNIFORM, limits);
                let done = |plan: LatticePlan| finish(&space, &key, technique, plan);
                (drawn.n_evaluations, drawn.plan.map(done))
            };
            let found: Vec<(usize, Option<(usize, PlanScore)>)> = (batch * BATCH..(batch + 1) * BATCH)
                .into_par_iter()
                .map(one)
                .collect();
            for (n_asked, plan) in found {
                n_done += n_asked.max(1);
                let Some((n_looked_at, score)) = plan else {
                    continue;
                };
                n_done += n_looked_at;
                n_plans += 1;
                if score.worst < best {
                    best = score.worst;
                    samples.push(CostSample {
                        n_evaluations: n_done,
                        n_plans,
                        best_cost: best,
                    });
                }
            }
            batch += 1;
        }
        if n_plans > 0 {
            samples.push(CostSample {
                n_evaluations: n_done,
                n_plans,
                best_cost: best,
            });
            return Ok(samples);
        }
    }
    Ok(Vec::new())
}

/// Batches without any plan after which a key is abandoned.
const MOST_EMPTY_BATCHES: usize = 8;

/// Index of the spread with a uniform order of candidates.
const UNIFORM: usize = 3;

/// Score of a plan after local optimisation, if any, and number of plans evaluated for it.
fn finish(
    space: &Space<'_>,
    key: &super::key::KeyChoice,
    technique: Technique,
    plan: LatticePlan,
) -> (usize, PlanScore) {
    if technique.improves() {
        let improved = improve(space, key, plan);
        (improved.n_evaluations, improved.score)
    } else {
        (1, space.score(&plan))
    }
}

#[cfg(test)]
mod tests {

    use shellock_geom::Vec3;
    use shellock_test_surfaces::{seams, sphere, voronoi};

    use super::*;
    use crate::{PlanOutcome, search, survey};

    #[test]
    fn every_technique_gets_better_with_work_and_none_beats_the_proven_bound() {
        let ctx = Ctx::quiet();
        let params = PlanParams {
            n_plans: 40,
            ..PlanParams::default()
        };
        let surface = voronoi(sphere(4, Vec3::new(50.0, 55.0, 70.0)), 8, 1);
        let survey = survey(
            &ctx,
            &params,
            &surface,
            &seams(&surface),
            &crate::sizes::ConnectorSizes::default(),
        )
        .unwrap();
        let PlanOutcome::Found(found) = search(&ctx, &params, &survey, &PlanConstraints::default()).unwrap()
        else {
            panic!("a ball has a plan")
        };
        let curves = Technique::ALL.map(|t| convergence(&ctx, &params, &survey, t, 20_000).unwrap());
        for curve in &curves {
            assert!(
                curve.is_sorted_by(|x, y| x.n_evaluations <= y.n_evaluations && x.best_cost >= y.best_cost)
            );
            assert!(curve.last().unwrap().best_cost >= found.lower_bound - 1e-9);
        }
        // The first plan is the same for both, and one of them improves it.
        let [random, _, improving, both] = curves;
        assert!(improving[0].best_cost < random[0].best_cost);
        assert!(both.last().unwrap().best_cost <= random.last().unwrap().best_cost);
    }
}
