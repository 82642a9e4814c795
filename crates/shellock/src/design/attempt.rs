//! Plans and kits of one division, until one passes or nothing new can be tried.

use super::budget::{BLOCKED_PLANS, Budget};
use super::division::{Division, WallGrid, joined};
use super::kit::{Recipe, make};
use super::lesson::{Lesson, lessons};
use super::{DesignError, KeySource, Kit, Params};
use crate::body::{BodyError, GridError, PatchDistances};
use crate::metric::Holding;
use crate::plan::{Blocker, FoundPlan, InstallationPlan, PlanConstraints, PlanOutcome, PlanSurvey};
use crate::{Ctx, PatchId, SegmentedSurface, key, metric, plan};

/// How one division went.
pub(super) enum Attempt {
    Passed,
    /// Nothing was made, since pieces are foreseen to rattle; with these pieces less.
    Joined(SegmentedSurface),
    Failed(Failure),
}

/// Why a division did not do.
#[derive(Default)]
pub(super) struct Failure {
    pub reason: String,
    pub blockers: Vec<Blocker>,
    /// Pieces whose division may help, most promising first.
    pub blamed: Vec<PatchId>,
    /// Pieces that came out loose in the last kit.
    pub loose: Vec<PatchId>,
    /// Pieces that rattle in the last kit, where nothing else is wrong with it; the loosest first, and without the key.
    pub rattling: Vec<PatchId>,
}

/// Keeps a kit where it is the best so far: that with the fewest failures, then that rattles least, the earliest of several.
pub(super) fn keep(best: &mut Option<Kit>, kit: Kit) {
    if best.as_ref().is_none_or(|b| kit.is_better_than(b)) {
        *best = Some(kit);
    }
}

/// Plans and makes kits of one division. The best kit goes to `best`, what it cost off the `budget`.
pub(super) fn plans(
    ctx: &Ctx,
    params: &Params,
    wall: &mut WallGrid<'_>,
    division: &Division,
    budget: &mut Budget,
    best: &mut Option<Kit>,
) -> Result<Attempt, DesignError> {
    let Division { surface, settings, chosen, grip } = division;
    let sizes = &chosen.sizes;
    let survey = plan::survey(&ctx.fork(), &settings.plan, surface, &surface.seams(), sizes)?;
    let mut distances: Option<PatchDistances> = None;
    let mut constraints = PlanConstraints::default();
    let mut failure = Failure::default();
    let most_kits = budget.kits_each.min(budget.kits);
    let (mut n_kits, mut n_blocked) = (0, 0);
    while n_kits < most_kits && n_blocked < BLOCKED_PLANS {
        // A kit that is given up takes its warnings with it.
        let kit_ctx = ctx.fork();
        chosen.tell(&kit_ctx);
        // The proof of a plan runs on one thread; the grid and distances in it are made beside it.
        let (measured, next) = rayon::join(
            || {
                let grid = wall.get()?;
                distances.get_or_insert_with(|| PatchDistances::measure(grid, surface));
                Ok::<(), GridError>(())
            },
            || next_plan(&kit_ctx, params, division, &survey, &constraints, budget.foreseen_joinings > 0),
        );
        measured?;
        let (found, holding) = match next? {
            Next::Plan(found, holding) => (*found, holding),
            Next::Joined(fewer) => return Ok(Attempt::Joined(fewer)),
            Next::None(none) => {
                let blamed = none.blamed.into_iter().chain(failure.blamed).collect();
                return Ok(Attempt::Failed(Failure { blamed, loose: failure.loose, ..none }));
            }
        };
        let (model, grid) = (wall.model, wall.get()?);
        let distances = distances.as_ref().expect("they were measured beside the plan");
        let recipe = Recipe { params, settings, model, grid, distances, surface, sizes, grip: *grip, found, holding };
        let kit = match make(kit_ctx, recipe) {
            Err(DesignError::Body(BodyError::Blocked { piece, separation, kept })) => {
                let lesson = Lesson::Blocked { piece, separation, kept };
                ctx.note(&format!("another plan: {lesson}"));
                failure.blamed.extend(lesson.blamed());
                lesson.teach(&mut constraints);
                n_blocked += 1;
                continue;
            }
            made => made?,
        };
        n_kits += 1;
        budget.kits -= 1;
        let learned = lessons(&kit);
        let rattling = if kit.only_rattles() { Some(kit.rattling()) } else { None };
        keep(best, kit);
        if learned.is_empty() {
            return Ok(Attempt::Passed);
        }
        if let Some(rattling) = rattling {
            // The plan was chosen to rattle least: other pieces are what helps.
            return Ok(Attempt::Failed(Failure { reason: "pieces rattle".into(), rattling, ..Failure::default() }));
        }
        failure.blamed.extend(learned.iter().flat_map(Lesson::blamed));
        failure.loose = learned.iter().flat_map(Lesson::loose).collect();
        if n_kits < budget.kits_each {
            learned.iter().for_each(|lesson| ctx.note(&format!("another plan: {lesson}")));
        }
        learned.iter().for_each(|lesson| lesson.teach(&mut constraints));
    }
    let reason = "no kit passed its verification within the allowed rounds".into();
    Ok(Attempt::Failed(Failure { reason, ..failure }))
}

/// The pieces that are foreseen to rattle far more than they may, the loosest first.
fn foreseen_to_rattle(found: &FoundPlan, holding: &Holding) -> Vec<PatchId> {
    /// Play is foreseen within about this factor.
    const SURELY: f64 = 1.4;
    let excess = holding.foreseen_excess.iter().enumerate().map(|(i, excess)| (PatchId::from(i), *excess));
    let mut wide: Vec<(PatchId, f64)> =
        excess.filter(|(p, excess)| *excess > SURELY && *p != found.plan.key()).collect();
    wide.sort_by(|a, b| b.1.total_cmp(&a.1));
    wide.into_iter().map(|w| w.0).collect()
}

/// What is to be made of a division.
pub(super) enum Next {
    /// The plan that holds best of those that cost about the least.
    Plan(Box<FoundPlan>, Holding),
    /// Nothing yet: pieces are foreseen to rattle; with these pieces less.
    Joined(SegmentedSurface),
    /// Nothing, and why.
    None(Failure),
}

/// The next plan of a division to make.
pub(super) fn next_plan(
    ctx: &Ctx,
    params: &Params,
    division: &Division,
    survey: &PlanSurvey,
    constraints: &PlanConstraints,
    may_join: bool,
) -> Result<Next, DesignError> {
    let Division { surface, settings, chosen, .. } = division;
    let found = match plan::search(ctx, &settings.plan, survey, constraints)? {
        PlanOutcome::Found(found) => found,
        PlanOutcome::Infeasible { reason, blockers, articulations } => {
            let blamed = articulations.into_iter().chain(blockers.iter().map(|b| b.piece)).collect();
            return Ok(Next::None(Failure { reason, blockers, blamed, ..Failure::default() }));
        }
    };
    let (found, holding) = metric::choose(ctx, &settings.plan, surface, &chosen.sizes, *found)?;
    if settings.plan.key_slide.is_none() {
        warn_of_key(ctx, params, division, &found.plan);
    }
    let rattling = if may_join { foreseen_to_rattle(&found, &holding) } else { Vec::new() };
    Ok(match joined(ctx, &settings.segmentation, surface, &rattling)? {
        Some(fewer) => Next::Joined(fewer),
        None => Next::Plan(Box::new(found), holding),
    })
}

/// Says which conditions a key breaks that was not cut to meet them.
fn warn_of_key(ctx: &Ctx, params: &Params, division: &Division, plan: &InstallationPlan) {
    let may_be_cut = params.key != KeySource::Cut;
    let Some(last) = plan.steps.last() else { return };
    if let Some(found) = key::conditions(&division.surface, last.piece, last.separation.unit()) {
        let largest_mm = division.chosen.sizes.largest_mm();
        found.problems(last.piece, largest_mm, may_be_cut).into_iter().for_each(|problem| ctx.warn(problem));
    }
}
