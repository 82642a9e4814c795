//! The whole job: from a closed mesh to interlocking pieces that were verified.
//!
//! One loop makes kits until one is good: the `agenda` says what is tried next, a `trial` makes that
//! change, and an `attempt` plans and makes the kit and returns what may help if it fails.
//!
//! ```text
//!               change                     found
//!  agenda ───────────────► trial ─► attempt ─────► best ─► Design
//!    ▲   (one table, one    wall, key,    plan, kit,   (one rule
//!    │    clock)            pieces        lessons       for two kits)
//!    └───────────────────── report ◄──────────┘
//! ```

mod agenda;
mod attempt;
mod best;
mod candidate;
mod causes;
mod cost;
mod division;
mod failure;
mod job;
mod kit;
mod longer;
mod outcome;
mod outlook;
mod planning;
mod strengthen;
#[cfg(test)]
mod tests;
mod trial;
mod wall;
mod ways;

pub use agenda::Effort;
use agenda::{Agenda, Allowance, Grade, Report, Step};
use attempt::Found;
use best::Best;
pub use causes::Cause;
pub use kit::Kit;
pub use outcome::{Design, DesignError, DesignOutcome, NoPlan};
pub use outlook::{Outlook, Verdict, first_division, outlook};
pub use shellock_assembly::PrintedFit;
use shellock_geom::Solid;
pub use shellock_settings::{KeySource, Params, Rounds, Settings, Thickness, WallChoice};
use trial::{Change, Parts, Trial};
use wall::Wall;
pub use wall::WallChoices;
use ways::Input;

use crate::key::Turn;
use crate::metric::{Chosen, Holding};
use crate::plan::{Handover, PlanProof};
use crate::{Ctx, InstallationPlan, SegmentedSurface, Warning, segmentation};

/// Makes a kit of `model` (mm), from `labels` (one a triangle) if given. Kits are made until one passes or
/// nothing else is left to try. Then the best of them is returned with its failures.
///
/// Pieces that a person would cut come first ([`segmentation::Method::Auto`]). Such a kit is asked to
/// withstand its loads with a reserve. If none passes with the wall that this takes, the wall becomes as thin
/// as a fall allows. If none passes at all, fewer pieces are tried, then still fewer with the thinnest walls,
/// then pieces of similar size: that a kit locks comes before what it withstands.
///
/// The work may end early if the context has a deadline ([`Ctx::seconds_left`]), which is then reported.
pub fn design(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
) -> Result<DesignOutcome, DesignError> {
    let params = &resolve_params(params, model, labels)?;
    let input = Input::new(params, model, labels);
    let grade = |kit: &Kit| (kit.grade(), kit.failures());
    let agenda = Agenda::new(ctx, &input);
    let (mut best, mut agenda, mut effort) = run(ctx, input, agenda, attempt::make_kit, grade)?;
    if agenda.has_stopped_kits() && !best.has_end() && !agenda.is_cut_short() {
        // Fewer pieces have no kit, so one that rattles is better than none. Without time it would not be
        // made either, and the reasons of the first run would be lost.
        ctx.note("no kit has less play: now one that rattles");
        let before = effort;
        agenda = Agenda::new(ctx, &input).without_stops();
        (best, agenda, effort) = run(ctx, input, agenda, attempt::make_kit, grade)?;
        effort = before.and(effort);
    }
    best.conclude(ctx, &input, &agenda, effort)
}

/// Runs a job: decides the wall, then tries what the agenda says. Returns the best end with what it took.
fn run<'a, T>(
    ctx: &Ctx,
    input: Input<'a>,
    mut agenda: Agenda,
    attempt: impl Fn(&Ctx<'_>, Parts<'_, 'a>, &Allowance) -> Result<Found<T>, DesignError>,
    grade: impl Fn(&T) -> (Grade, Vec<String>),
) -> Result<(Best<T>, Agenda, Effort), DesignError> {
    let Some(wall) = in_time(ctx, |part| Wall::decide(part, &input))? else {
        agenda.end_late();
        return Ok((Best::new(), agenda, Effort::default()));
    };
    agenda.end_first_wall(ctx, input.params.thickness);
    let mut trial = Trial::new(input, wall);
    let best = explore(ctx, &mut agenda, &mut trial, attempt, grade)?;
    let effort = Effort {
        steps: agenda.words(),
        ..trial.effort
    };
    Ok((best, agenda, effort))
}

/// Returns the parameters with the regions to keep whole as triangles of the model.
fn resolve_params(params: &Params, model: &Solid, labels: Option<&[i64]>) -> Result<Params, DesignError> {
    let mut params = params.clone();
    params.keep_whole = segmentation::resolve_regions(&params.keep_whole, model, labels)?;
    Ok(params)
}

/// Tries what the agenda says until an end is good enough or nothing is left to try. Trials that are not done
/// in time are given up.
fn explore<'a, T>(
    ctx: &Ctx,
    agenda: &mut Agenda,
    trial: &mut Trial<'a>,
    attempt: impl Fn(&Ctx<'_>, Parts<'_, 'a>, &Allowance) -> Result<Found<T>, DesignError>,
    grade: impl Fn(&T) -> (Grade, Vec<String>),
) -> Result<Best<T>, DesignError> {
    let mut best = Best::new();
    let mut change = None;
    loop {
        let found = in_time(ctx, |part| try_change(part, agenda, trial, change, &attempt));
        let site = trial.site(agenda);
        let (mut changes, mut report) = (Vec::new(), Report::default());
        match found {
            Err(DesignError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Ok(None) => {
                agenda.end_late();
                return Ok(best);
            }
            Err(error) => best.close_key_with(ctx, site.as_ref(), error),
            Ok(Some(found)) => {
                report.offers = found.changes.iter().map(Change::step).collect();
                (report.late, report.is_hurried) = (found.late, found.is_hurried);
                report.is_stopped = found.is_stopped;
                changes = found.changes;
                best.fail(found.failure);
                if let Some(end) = found.end {
                    let grade = grade(&end);
                    report.kit = Some(grade.0);
                    best.offer(end, grade, site, &trial.parts(agenda).job.wall);
                }
            }
        }
        let next = agenda.next(ctx, &report);
        if next.is_none_or(Step::closes_key) {
            best.close_key(ctx, site.as_ref());
        }
        let Some(step) = next else {
            return Ok(best);
        };
        if step.begins_wall() {
            best.begin_wall();
        }
        if step == Step::NextWay {
            ctx.note(&format!("{}: now {}", best.words(), agenda.way().words()));
        }
        let offered = changes.into_iter().find(|change| change.step() == step);
        change = Some(offered.unwrap_or(Change::Step(step)));
    }
}

/// Does a part of the job; `None` if it is not done when the time ends.
fn in_time<T>(
    ctx: &Ctx,
    work: impl FnOnce(&Ctx<'_>) -> Result<T, DesignError>,
) -> Result<Option<T>, DesignError> {
    let part = ctx.fork().ending_in_time();
    let done = work(&part);
    for warning in part.into_warnings() {
        ctx.warn(warning);
    }
    match done {
        Err(DesignError::Cancelled(_)) => {
            ctx.check()?;
            Ok(None)
        }
        done => done.map(Some),
    }
}

/// Makes a change, or begins the job if there is none, and attempts the trial that follows.
fn try_change<'a, T>(
    ctx: &Ctx,
    agenda: &mut Agenda,
    trial: &mut Trial<'a>,
    change: Option<Change>,
    attempt: impl Fn(&Ctx<'_>, Parts<'_, 'a>, &Allowance) -> Result<Found<T>, DesignError>,
) -> Result<Found<T>, DesignError> {
    let impossible = match change {
        None => trial.begin(ctx, agenda),
        Some(change) => trial.apply(ctx, agenda, change),
    };
    let allowance = agenda.allowance(ctx);
    match impossible? {
        None => attempt(ctx, trial.parts(agenda), &allowance),
        Some(failure) => Ok(Found::nothing(failure)),
    }
}

/// The plan that [`design`] would make first, in the space of the model as it was given. Pieces are numbered
/// as they are installed.
#[non_exhaustive]
pub struct Planned {
    /// Surface divided into the pieces.
    pub surface: SegmentedSurface,
    /// Order and directions of installation.
    pub plan: InstallationPlan,
    /// Proven bound of the plan's cost.
    pub proof: PlanProof,
    /// Mean cost of the plan's pieces.
    pub mean_cost: f64,
    /// Number of plans that this one was chosen from.
    pub n_plans: usize,
    /// Load factors and weak places, by simulation.
    pub holding: Holding,
    /// Warnings of the plan and of the wall.
    pub warnings: Vec<Warning>,
}

impl Planned {
    /// Hands over a plan for a `surface` that was turned by `turn`, with warnings of the plan and of the
    /// wall.
    fn new(
        turn: &Turn,
        surface: &SegmentedSurface,
        choice: Chosen,
        [of_plan, of_wall]: [Vec<Warning>; 2],
    ) -> Self {
        let (proof, found) = (choice.search_result.proof(), choice.search_result);
        let handover = Handover::new(turn, found.plan);
        Self {
            surface: handover.surface(surface),
            plan: handover.plan(),
            proof: handover.proof(proof),
            mean_cost: found.score.mean,
            n_plans: found.pool.len(),
            holding: choice.holding.hand_over(&handover),
            warnings: [handover.warnings(of_plan), of_wall].concat(),
        }
    }
}

/// Seeks the plan that [`design`] would make its first kit of, or the reason why there is none: the same
/// loop, ended before anything is made.
pub fn plan(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
) -> Result<Result<Planned, NoPlan>, DesignError> {
    let params = &resolve_params(params, model, labels)?;
    let input = Input::new(params, model, labels);
    let grade = |_: &Planned| (Grade::PERFECT, Vec::new());
    let agenda = Agenda::new(ctx, &input);
    let (best, agenda, _) = run(ctx, input, agenda, attempt::seek_plan, grade)?;
    best.conclude(ctx, &agenda)
}
