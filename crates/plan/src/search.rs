//! The search for the best plan (Sect. 6.2): random draws, local improvement, then a proof.
//!
//! Keys are tried in order of preference, until one has any plan. For that key, plans are drawn from the last
//! piece to the first. All keys as good as it (equally flat, sliding the same way) are left to the exact
//! search. Every draw has its own random stream, batches have a fixed size, and no clock is read, so the
//! answer does not depend on the threads. The cluster test prunes every step: if a part is loose while the
//! remaining pieces move as one block, the plan can never lock. The cheapest plans of a batch are improved
//! one direction at a time. Finally, [`exact`](super::exact) looks for better plans with any of the keys and
//! proves how good any can be.
//!
//! Deviation: the paper prunes by the best score so far, which would let threads influence each other. Here
//! the bound is the best score of the batches before.

use crate::causes::Cause;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use shellock_report::{Cancelled, Ctx, PatchId, Warning};
use shellock_surface::seam::rules::COUNTED_RUN_SIZES;

use super::draw::{DrawLimits, Drawn, Draws, draw};
use super::exact::{Budget, Candidate, least_cost, lower_bound, prove, vary};
use super::improve::{Improved, improve};
use super::key::{KeyChoice, choices};
use super::local_cost::{PieceCosts, SeamCosts};
use super::pool::{MOST_PLANS, Pool};
use super::score::just_below;
use super::space::Space;
use super::{
    FoundPlan, LatticePlan, PieceSet, PlanConstraints, PlanOutcome, PlanParams, PlanScore, PlanSurvey,
    ProofScope, RankedPlan, diagnose,
};

/// Draws that run in parallel before their results are read.
const BATCH: usize = 32;

/// Batches without any plan after which a key is abandoned.
const MAX_EMPTY_BATCHES: usize = 2;

/// Batches in a row without improvement, after which a full pool is left to the exact search: this many, plus
/// one for each ten pieces.
///
/// The exact search proves the optimum of a figure in 12 pieces in less time than eight batches take.
const LEAST_STALE_BATCHES: usize = 2;
const PIECES_PER_STALE_BATCH: usize = 10;

/// Tries of one draw, per piece. Enough to undo some wrong choices near the end; a wrong beginning needs a
/// new draw.
const TRIES_PER_PIECE: usize = 20;

/// Plans of a batch that are improved: the cheapest ones drawn.
const N_IMPROVED: usize = 4;

/// First random stream of the draws. Separates them from the streams of the key planes, which use one for
/// each piece.
const FIRST_STREAM: u64 = 1 << 32;

/// Creates the costs of pieces for a survey and constraints.
pub type MakeCosts<'a> = &'a dyn Fn(&PlanSurvey, &PlanConstraints) -> Box<dyn PieceCosts>;

/// Finds the best plan for `survey` under `constraints` by the default costs, or the reason why there is
/// none.
///
/// Short joints count only if no plan exists without them. Warns with `occlusion-tolerance-raised` and
/// `short-joints`. Not promised: if no plan is found, one may still exist, unless the reason is in the
/// contacts. The quality of the plan among those with equally good keys is proven, see
/// [`FoundPlan::lower_bound`].
pub fn search(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    survey: &PlanSurvey,
    constraints: &PlanConstraints,
) -> Result<PlanOutcome, Cancelled> {
    search_with(ctx, params, survey, constraints, &|s, c| {
        Box::new(SeamCosts::new(s, c))
    })
}

/// Raises the bounds of `found`, a plan from a search with a smaller work limit, as far as `params` allow.
/// The plan stays.
///
/// Searches again unless the bounds say that no plan costs less than the cheapest of its pool.
pub fn raise_bounds(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    survey: &PlanSurvey,
    constraints: &PlanConstraints,
    found: &mut FoundPlan,
) -> Result<(), Cancelled> {
    let least = found
        .pool
        .iter()
        .map(|p| p.score.worst)
        .fold(f64::INFINITY, f64::min);
    if found.lower_bound >= just_below(least) {
        return Ok(());
    }
    // Warnings of this search were given with the plan.
    if let PlanOutcome::Found(again) = search(&ctx.fork(), params, survey, constraints)?
        && again.scope == found.scope
        && again.lower_bound > found.lower_bound
    {
        let cost = found.score.worst;
        found.lower_bound = again.lower_bound.min(cost);
        found.is_optimal = found.lower_bound >= just_below(cost);
        let of_key = match again.plan.key() == found.plan.key() {
            true => again.key_lower_bound,
            false => found.key_lower_bound,
        };
        found.key_lower_bound = of_key.clamp(found.lower_bound, cost);
    }
    Ok(())
}

/// Runs [`search`] with other costs.
pub fn search_with(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    survey: &PlanSurvey,
    constraints: &PlanConstraints,
    costs: MakeCosts<'_>,
) -> Result<PlanOutcome, Cancelled> {
    ctx.stage("search for a plan", 0)?;
    if let Some(reason) = out_of_range(survey.n_pieces, params.key) {
        return Ok(PlanOutcome::Infeasible {
            reason,
            blockers: Vec::new(),
            articulations: Vec::new(),
            apart: Vec::new(),
        });
    }
    let keys = choices(params, survey);
    let mut first_answer = None;
    for (i, sizes) in COUNTED_RUN_SIZES.into_iter().enumerate() {
        let mut counted = survey.clone();
        counted.contacts.iter_mut().for_each(|c| c.count_runs_from(sizes));
        let mut outcome = with_any_tolerance(ctx, params, &counted, constraints, &keys, costs)?;
        if let PlanOutcome::Found(found) = &mut outcome {
            found.run_sizes = sizes;
            if i > 0 {
                let least_mm = survey
                    .contacts
                    .iter()
                    .map(|c| sizes * c.size_mm)
                    .fold(f64::INFINITY, f64::min);
                warn_of_short_joints(ctx, least_mm);
            }
            return Ok(outcome);
        }
        // The diagnosis under the longest required run tells best what to change.
        first_answer.get_or_insert(outcome);
    }
    Ok(first_answer.expect("there is at least one length"))
}

fn with_any_tolerance(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    survey: &PlanSurvey,
    constraints: &PlanConstraints,
    keys: &[KeyChoice],
    costs: MakeCosts<'_>,
) -> Result<PlanOutcome, Cancelled> {
    let space = |tolerance| Space::with_costs(survey, constraints, tolerance, costs(survey, constraints));
    let strict = space(params.occlusion_tolerance);
    if let Some(outcome) = diagnose::structural(&strict) {
        return Ok(outcome);
    }
    if let Ok((found, _)) = with_any_key(ctx, params, &strict, keys)? {
        return Ok(PlanOutcome::Found(Box::new(found)));
    }
    let relaxed = space(params.relaxed_tolerance);
    match with_any_key(ctx, params, &relaxed, keys)? {
        Ok((found, _)) => {
            warn_of_tolerance(ctx, params.relaxed_tolerance);
            Ok(PlanOutcome::Found(Box::new(found)))
        }
        Err(stuck) => Ok(diagnose::stuck(&relaxed, stuck)),
    }
}

fn warn_of_short_joints(ctx: &Ctx<'_>, shortest_mm: f64) {
    ctx.warn(Warning::new(
        Cause::ShortJoints { from_mm: shortest_mm },
        Vec::new(),
        None,
    ));
}

fn out_of_range(n_pieces: usize, key: Option<PatchId>) -> Option<String> {
    match n_pieces {
        0 | 1 => Some("one piece has nothing to interlock with; segment into at least three".into()),
        n if n > PieceSet::MAX_PIECES => Some(format!(
            "{n} pieces are more than the {} that can be planned; segment coarser",
            PieceSet::MAX_PIECES
        )),
        n => key.filter(|&k| usize::from(k) >= n).map(|k| {
            format!("piece {k} is to be the key, but there are only pieces 1 to {n}; choose one of them")
        }),
    }
}

fn warn_of_tolerance(ctx: &Ctx<'_>, tolerance: f64) {
    ctx.warn(Warning::new(
        Cause::OcclusionToleranceRaised { share: tolerance },
        Vec::new(),
        None,
    ));
}

/// Best plan with a key as good as the first that has any plan; else the smallest set of pieces at which the
/// search got stuck.
fn with_any_key<'k>(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    space: &Space<'_>,
    keys: &'k [KeyChoice],
) -> Result<Result<(FoundPlan, &'k KeyChoice), PieceSet>, Cancelled> {
    let mut tries_left = params.max_tries;
    let mut stuck = space.all();
    let keys: Vec<&KeyChoice> = keys.iter().filter(|k| !k.directions.is_empty()).collect();
    let mut draws = vec![Draws::default(); keys.len()];
    for (i, &key) in keys.iter().enumerate() {
        if tries_left == 0 {
            break;
        }
        let mut pool = Pool::default();
        match draw_plans(ctx, params, space, key, &mut tries_left, &mut pool, &mut draws[i])? {
            None => {
                let equals = keys.iter().zip(&draws).filter(|(k, _)| k.is_as_good_as(key));
                let mut candidates: Vec<Candidate<'k>> = equals
                    .map(|(k, draws)| {
                        let mut candidate = Candidate::new(k, space.n);
                        candidate.draws = *draws;
                        candidate
                    })
                    .collect();
                candidates
                    .iter_mut()
                    .filter(|c| c.key == key)
                    .for_each(|c| c.pool = std::mem::take(&mut pool));
                return proven(ctx, params, space, candidates, tries_left).map(Ok);
            }
            Some(left) if left.len() < stuck.len() => stuck = left,
            Some(_) => {}
        }
    }
    Ok(Err(stuck))
}

/// Best plan with any of `candidates`, one of which has a plan already, with proven bounds on all of them.
fn proven<'k>(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    space: &Space<'_>,
    mut candidates: Vec<Candidate<'k>>,
    mut tries_left: usize,
) -> Result<(FoundPlan, &'k KeyChoice), Cancelled> {
    prove(ctx, space, &mut candidates, &mut Budget::new(params.proof_budget))?;
    let (least_cost, lower_bound) = (least_cost(&candidates), lower_bound(&candidates));
    let keys: Vec<PatchId> = candidates.iter().map(|c| c.key.piece).collect();
    // Among equals, the most preferred key wins.
    let best = candidates
        .iter()
        .position(|c| c.pool.least_cost() == least_cost)
        .expect("a plan was drawn");
    let Candidate {
        key,
        mut pool,
        mut draws,
        lower_bound: key_bound,
        ..
    } = candidates.swap_remove(best);
    if pool.len() < MOST_PLANS {
        // The exact search gave this key its best plan, but not the others from which metrics choose.
        draw_plans(ctx, params, space, key, &mut tries_left, &mut pool, &mut draws)?;
    }
    if params.proof_budget > 0 {
        vary(
            ctx,
            space,
            key,
            &mut pool,
            &mut stream(params.seed, usize::MAX >> 1),
        );
        ctx.check()?;
    }
    let ranked = |(score, plan): &(PlanScore, LatticePlan)| RankedPlan {
        plan: plan.clone(),
        score: score.clone(),
        loose: space.loose(plan),
    };
    let (score, plan) = pool.best().expect("a plan was drawn").clone();
    // Among plans that cost the same up to rounding, the pool prefers the lower mean.
    let is_optimal = lower_bound >= just_below(score.worst);
    let found = FoundPlan {
        is_optimal,
        lower_bound: if is_optimal { score.worst } else { lower_bound },
        key_lower_bound: key_bound.min(score.worst),
        scope: ProofScope {
            keys,
            slides: key.slides,
            n_lessons: space.constraints.n_lessons(),
        },
        tolerance: space.tolerance,
        run_sizes: COUNTED_RUN_SIZES[0],
        plan,
        score,
        pool: pool.plans().iter().map(ranked).collect(),
    };
    Ok((found, key))
}

/// Fills `pool` with plans drawn at random and improved, continuing from the state `draws`. If the pool stays
/// empty, returns the smallest set of pieces at which a draw got stuck.
fn draw_plans(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    space: &Space<'_>,
    key: &KeyChoice,
    tries_left: &mut usize,
    pool: &mut Pool,
    draws: &mut Draws,
) -> Result<Option<PieceSet>, Cancelled> {
    let mut stuck = space.all();
    // A key not tried before gets one batch even if no tries or time are left.
    while may_find_more(params, space, pool, draws)
        && (draws.n_batches == 0 || (*tries_left > 0 && !ctx.is_time_up()))
    {
        ctx.check()?;
        let best_before = pool.least_cost();
        let limits = DrawLimits {
            bound: bound_of(pool),
            max_tries: TRIES_PER_PIECE * space.n,
        };
        let first = draws.n_batches * BATCH;
        let drawn: Vec<Drawn> = (first..first + BATCH)
            .into_par_iter()
            .map(|i| draw(space, key, stream(params.seed, i), i, limits))
            .collect();
        draws.is_exhausted = drawn.iter().any(|d| d.plan.is_none() && d.is_exhausted);
        let mut plans = Vec::new();
        for d in drawn {
            *tries_left = tries_left.saturating_sub(d.n_tries);
            if d.stuck.len() < stuck.len() {
                stuck = d.stuck;
            }
            plans.extend(d.plan.map(|plan| (space.score(&plan), plan)));
        }
        draws.n_batches += 1;
        draws.n_plans += plans.len();
        improve_and_add(space, key, plans, pool);
        draws.n_stale = if pool.least_cost() < best_before {
            0
        } else {
            draws.n_stale + 1
        };
    }
    Ok((pool.len() == 0).then_some(stuck))
}

/// Returns true if another batch of draws may add a plan to `pool` or find a better one.
fn may_find_more(params: &PlanParams, space: &Space<'_>, pool: &Pool, draws: &Draws) -> bool {
    let is_hopeless = pool.len() == 0 && draws.n_batches >= MAX_EMPTY_BATCHES;
    let is_stale =
        pool.len() == MOST_PLANS && draws.n_stale >= LEAST_STALE_BATCHES + space.n / PIECES_PER_STALE_BATCH;
    let most_batches = params.n_plans.div_ceil(BATCH) * 2;
    let is_done = draws.n_plans >= params.n_plans || draws.n_batches >= most_batches;
    !(draws.is_exhausted || is_hopeless || is_stale || is_done)
}

/// Improves the cheapest plans of a batch, then adds all of them to `pool`.
fn improve_and_add(
    space: &Space<'_>,
    key: &KeyChoice,
    mut plans: Vec<(PlanScore, LatticePlan)>,
    pool: &mut Pool,
) {
    // The sort is stable: among equal plans, the one drawn first wins.
    plans.sort_by(|x, y| x.0.worst.total_cmp(&y.0.worst));
    plans.dedup_by(|x, y| x.1 == y.1);
    let cheapest: Vec<&LatticePlan> = plans.iter().take(N_IMPROVED).map(|x| &x.1).collect();
    let improved: Vec<Improved> = cheapest
        .into_par_iter()
        .map(|plan| improve(space, key, plan.clone()))
        .collect();
    improved
        .into_iter()
        .for_each(|x| pool.add(space, x.score, x.plan));
    plans
        .into_iter()
        .for_each(|(score, plan)| pool.add(space, score, plan));
}

/// Cost bound for further plans: no bound until the pool is full, then the cost of the best plan.
fn bound_of(pool: &Pool) -> f64 {
    if pool.len() < MOST_PLANS {
        f64::INFINITY
    } else {
        pool.least_cost()
    }
}

/// Random stream of draw number `i`.
pub(super) fn stream(seed: u64, i: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(FIRST_STREAM.wrapping_add(i as u64));
    rng
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use shellock_geom::Vec3;
    use shellock_test_surfaces::{seams, sphere, voronoi};

    use super::super::local_cost::{Role, Surroundings};
    use super::super::survey;
    use super::*;
    use crate::sizes::ConnectorSizes;

    /// The default costs with a counter of the calls.
    struct Counted {
        costs: SeamCosts,
        n_asked: Arc<AtomicUsize>,
    }

    impl PieceCosts for Counted {
        fn bound(&self, piece: PatchId, role: Role, around: &Surroundings) -> f64 {
            self.n_asked.fetch_add(1, Ordering::Relaxed);
            self.costs.bound(piece, role, around)
        }
    }

    /// Eight pieces of a ball, with parameters that draw too few plans to fill the pool.
    fn eight_pieces() -> (PlanSurvey, PlanParams) {
        let params = PlanParams {
            n_plans: 40,
            proof_budget: 0,
            ..PlanParams::default()
        };
        let ball = voronoi(sphere(4, Vec3::new(50.0, 55.0, 70.0)), 8, 1);
        let sizes = ConnectorSizes::default();
        let survey = survey(&Ctx::quiet(), &params, &ball, &seams(&ball), &sizes);
        (survey.unwrap(), params)
    }

    #[test]
    fn no_draw_is_made_twice() {
        let (survey, params) = eight_pieces();
        let (ctx, none, n_asked) = (Ctx::quiet(), PlanConstraints::default(), Arc::default());
        let costs = Counted {
            costs: SeamCosts::new(&survey, &none),
            n_asked: Arc::clone(&n_asked),
        };
        let space = Space::with_costs(&survey, &none, params.relaxed_tolerance, Box::new(costs));
        let keys = choices(&params, &survey);
        let (_, key) = with_any_key(&ctx, &params, &space, &keys)
            .unwrap()
            .expect("a ball has a plan");
        let first = keys.iter().find(|k| !k.directions.is_empty());
        assert_eq!(Some(key), first, "no other key was drawn before");
        let n_searched = n_asked.swap(0, Ordering::Relaxed);
        let (mut pool, mut tries_left) = (Pool::default(), params.max_tries);
        let draws = &mut Draws::default();
        draw_plans(&ctx, &params, &space, key, &mut tries_left, &mut pool, draws).unwrap();
        let n_drawn = n_asked.load(Ordering::Relaxed);
        assert!(n_drawn > 0 && pool.len() < MOST_PLANS);
        assert_eq!(n_searched, n_drawn, "without a proof a search is its draws");
    }
    #[test]
    fn draws_that_were_cut_short_go_on_where_they_ended() {
        let (survey, params) = eight_pieces();
        let none = PlanConstraints::default();
        let space = Space::new(&survey, &none, params.relaxed_tolerance);
        let keys = choices(&params, &survey);
        let key = keys
            .iter()
            .find(|k| !k.directions.is_empty())
            .expect("one can leave");
        let drawn = |ctx: &Ctx<'_>, draws: &mut Draws, pool: &mut Pool| {
            let mut tries_left = params.max_tries;
            draw_plans(ctx, &params, &space, key, &mut tries_left, pool, draws).unwrap();
            draws.n_batches
        };
        let is_up = || true;
        let (quiet, late) = (Ctx::quiet(), Ctx::quiet().with_time_limit(&is_up));
        let (mut at_once, mut draws) = (Pool::default(), Draws::default());
        let n_batches = drawn(&quiet, &mut draws, &mut at_once);
        assert!(n_batches > 1);
        let (mut in_two, mut draws) = (Pool::default(), Draws::default());
        assert_eq!(drawn(&late, &mut draws, &mut in_two), 1);
        assert_eq!(drawn(&late, &mut draws, &mut in_two), 1, "no time is left");
        assert_eq!(drawn(&quiet, &mut draws, &mut in_two), n_batches);
        let plans = |pool: &Pool| pool.plans().iter().map(|p| p.1.clone()).collect::<Vec<_>>();
        assert_eq!(plans(&in_two), plans(&at_once));
    }
}
