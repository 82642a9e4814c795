//! The randomised search for the best plan (Sect. 6.3).
//!
//! Keys are tried in order of preference. For each, plans are drawn from the last piece to the first; every draw has its
//! own random stream, batches are of fixed size, and no clock is read, so the answer does not depend on the threads. The
//! cluster test prunes every step: what comes loose with the remaining pieces as one block can never lock. The best plans
//! are then improved one direction at a time.
//!
//! Deviation: the paper prunes by the best score so far, which would let threads influence each other; draws prefer cheap
//! steps instead.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::contact::SHORTEST_RUN_SIZES;
use super::draw::{Drawn, draw};
use super::improve::improve;
use super::key::{KeyChoice, choices};
use super::space::Space;
use super::{InstallationPlan, PieceSet, PlanConstraints, PlanOutcome, PlanParams, PlanSurvey, diagnose};
use crate::{Cancelled, Ctx, Warning};

/// Draws that run side by side before anybody looks at the results.
const BATCH: usize = 32;

/// Batches without any plan after which a key is given up.
const MAX_EMPTY_BATCHES: usize = 2;

/// Tries of one draw, per piece: enough to undo some wrong turns near the end; wrong beginnings need a new draw.
const TRIES_PER_PIECE: usize = 20;

/// Plans that are improved: the cheapest ones drawn.
const N_IMPROVED: usize = 24;

/// Keeps the streams of this stage's draws apart from those of the key planes, one a piece.
const FIRST_STREAM: u64 = 1 << 32;

/// The best plan found for `survey` under `constraints`, or why there is none.
///
/// Short joints count only where there is no plan without them. Warns with `occlusion-tolerance-raised`, `short-joints` and
/// `key-not-flat`. Not promised: that the plan is the best there is, or that none exists where none was found (but where the reason is
/// the contacts', none does).
pub fn search(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    survey: &PlanSurvey,
    constraints: &PlanConstraints,
) -> Result<PlanOutcome, Cancelled> {
    ctx.stage("search for a plan", 0)?;
    if let Some(reason) = out_of_range(survey.n_pieces) {
        return Ok(PlanOutcome::Infeasible { reason, blockers: Vec::new(), articulations: Vec::new() });
    }
    let keys = choices(params, survey);
    let mut first_answer = None;
    for (i, sizes) in SHORTEST_RUN_SIZES.into_iter().enumerate() {
        let mut counted = survey.clone();
        counted.contacts.iter_mut().for_each(|c| c.count_runs_from(sizes * params.connector_size_mm));
        let outcome = with_any_tolerance(ctx, params, &counted, constraints, &keys)?;
        if let PlanOutcome::Found(plan) = outcome {
            if i > 0 {
                warn_of_short_joints(ctx, sizes * params.connector_size_mm);
            }
            return Ok(PlanOutcome::Found(plan));
        }
        // What is wrong with all joints that hold well says best what to change.
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
) -> Result<PlanOutcome, Cancelled> {
    let strict = Space::new(survey, constraints, params.occlusion_tolerance);
    if let Some(outcome) = diagnose::structural(&strict) {
        return Ok(outcome);
    }
    if let Ok((plan, key)) = with_any_key(ctx, params, &strict, keys)? {
        warn_of(ctx, &plan, key, None);
        return Ok(PlanOutcome::Found(plan));
    }
    let relaxed = Space::new(survey, constraints, params.relaxed_tolerance);
    match with_any_key(ctx, params, &relaxed, keys)? {
        Ok((plan, key)) => {
            warn_of(ctx, &plan, key, Some(params.relaxed_tolerance));
            Ok(PlanOutcome::Found(plan))
        }
        Err(stuck) => Ok(diagnose::stuck(&relaxed, stuck)),
    }
}

fn warn_of_short_joints(ctx: &Ctx<'_>, shortest_mm: f64) {
    ctx.warn(Warning {
        code: "short-joints".into(),
        message: format!(
            "no plan locks with long joints alone, so joints from {shortest_mm:.1} mm on count too; they hold less firmly"
        ),
        pieces: Vec::new(),
        at: None,
    });
}

fn out_of_range(n_pieces: usize) -> Option<String> {
    match n_pieces {
        0 | 1 => Some("one piece has nothing to interlock with; segment into at least two".into()),
        n if n > PieceSet::MAX_PIECES => {
            Some(format!("{n} pieces are more than the {} that can be planned; segment coarser", PieceSet::MAX_PIECES))
        }
        _ => None,
    }
}

fn warn_of(ctx: &Ctx<'_>, plan: &InstallationPlan, key: &KeyChoice, tolerance: Option<f64>) {
    if let Some(tolerance) = tolerance {
        ctx.warn(Warning {
            code: "occlusion-tolerance-raised".into(),
            message: format!(
                "no plan leaves all paths free; pieces may now overlap by {} % on their way, which carving must absorb",
                tolerance * 100.0
            ),
            pieces: Vec::new(),
            at: None,
        });
    }
    if !key.is_flat {
        ctx.warn(Warning {
            code: "key-not-flat".into(),
            message: format!(
                "piece {} is the key though it is curved, so it may sit loosely; make a flat piece",
                plan.key()
            ),
            pieces: vec![plan.key()],
            at: None,
        });
    }
}

/// The best plan with the first key that has any; else the least that was left where the search got stuck.
fn with_any_key<'k>(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    space: &Space<'_>,
    keys: &'k [KeyChoice],
) -> Result<Result<(InstallationPlan, &'k KeyChoice), PieceSet>, Cancelled> {
    let mut tries_left = params.max_tries;
    let mut stuck = space.all();
    for key in keys {
        if tries_left == 0 {
            break;
        }
        if params.key.is_none() && space.constraints.bad_keys.contains(&key.piece) {
            continue;
        }
        match with_key(ctx, params, space, key, &mut tries_left)? {
            Ok((_, plan)) => return Ok(Ok((plan, key))),
            Err(left) if left.len() < stuck.len() => stuck = left,
            Err(_) => {}
        }
    }
    Ok(Err(stuck))
}

/// The best plan with `key` and its cost; else the least that was left.
fn with_key(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    space: &Space<'_>,
    key: &KeyChoice,
    tries_left: &mut usize,
) -> Result<Result<(f64, InstallationPlan), PieceSet>, Cancelled> {
    let mut stuck = space.all();
    let mut plans: Vec<(f64, InstallationPlan)> = Vec::new();
    for batch in 0..params.n_plans.div_ceil(BATCH) * 4 {
        ctx.check()?;
        let drawn: Vec<Drawn> = (batch * BATCH..(batch + 1) * BATCH)
            .into_par_iter()
            .map(|i| {
                let mut rng = ChaCha8Rng::seed_from_u64(params.seed);
                rng.set_stream(FIRST_STREAM + i as u64);
                draw(space, key, rng, i, TRIES_PER_PIECE * space.n)
            })
            .collect();
        let is_exhausted = drawn.iter().any(|d| d.plan.is_none() && d.is_exhausted);
        for d in drawn {
            *tries_left = tries_left.saturating_sub(d.n_tries);
            if d.stuck.len() < stuck.len() {
                stuck = d.stuck;
            }
            plans.extend(d.plan.map(|plan| (space.cost(&plan), plan)));
        }
        let gives_up = plans.is_empty() && batch + 1 >= MAX_EMPTY_BATCHES;
        if is_exhausted || gives_up || plans.len() >= params.n_plans || *tries_left == 0 {
            break;
        }
    }
    // The sort is stable: of equal plans the one drawn first wins.
    plans.sort_by(|x, y| x.0.total_cmp(&y.0));
    plans.dedup_by(|x, y| x.1 == y.1);
    plans.truncate(N_IMPROVED);
    let improved: Vec<(f64, InstallationPlan)> =
        plans.into_par_iter().map(|(_, plan)| improve(space, key, plan)).collect();
    Ok(improved.into_iter().min_by(|x, y| x.0.total_cmp(&y.0)).ok_or(stuck))
}
