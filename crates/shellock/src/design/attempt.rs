//! One attempt: the plan of a trial, and the kit that is made of it.

use shellock_make::Parts as KitParts;

use super::agenda::{Allowance, Step};
use super::division::{Division, join, revise};
use super::failure::Failure;
use super::kit::{Recipe, make};
use super::longer;
use super::planning::Planning;
use super::strengthen::strengthen;
use super::trial::{Change, Learned, Parts};
use super::{DesignError, Kit, Planned};
use crate::body::BodyError;
use crate::metric::{Chosen, EvenSurface, Foresight, LoadBorne, MetricParams, Stand};
use crate::motion::RelativePlay;
use crate::plan::lesson::Lesson;
use crate::plan::{FoundPlan, Handover, LatticePlan, PlanOutcome, PlanParams};
use crate::{Cancelled, Ctx, MakeError, PatchId, key, metric, plan};

/// The part of the proof's work limit that a plan gets before it is chosen: one of so many. A tenth proves
/// the optimum of a koala in ten pieces, but not that of a bunny in twelve.
const SHARE_WHILE_PLANNING: usize = 10;

/// Result of an attempt.
pub(super) struct Found<T> {
    /// A kit or a plan.
    pub end: Option<T>,
    /// Reason for another attempt.
    pub failure: Failure,
    /// Changes that may help, most promising first.
    pub changes: Vec<Change>,
    /// Change that a lack of time rules out.
    pub late: Option<Step>,
    /// True if a lack of time ended the improvement of its plan.
    pub is_hurried: bool,
    /// True if a kit was given up before it was finished.
    pub is_stopped: bool,
}

impl<T> Found<T> {
    /// Result of a trial that nothing can be made of.
    pub fn nothing(failure: Failure) -> Self {
        Self {
            end: None,
            failure,
            changes: Vec::new(),
            late: None,
            is_hurried: false,
            is_stopped: false,
        }
    }

    fn with(mut self, change: Option<Change>) -> Self {
        self.changes.extend(change);
        self
    }
}

/// Makes the kit of the best plan of a trial.
pub(super) fn make_kit(
    ctx: &Ctx,
    mut parts: Parts<'_, '_>,
    allowance: &Allowance,
) -> Result<Found<Kit>, DesignError> {
    // Warnings of a kit that is given up are dropped with it, so they get a context of their own.
    let kit_ctx = ctx.fork();
    let (choice, foresight, late) = match plan_or_changes(ctx, &kit_ctx, &mut parts, allowance)? {
        Ok(plan) => plan,
        Err(found) => return Ok(found),
    };
    // A kit that cannot be made in time is not begun.
    if ctx.seconds_left() < allowance.least_kit_s {
        return Err(DesignError::Cancelled(Cancelled));
    }
    let (input, setup) = (&parts.job.input, parts.setup);
    let (division, model) = (&setup.division, &*setup.candidate.model);
    ctx.stage("wall", 0)?;
    let (grid, distances) = setup
        .grid
        .measure(&division.settings.body, model, &division.surface)?;
    let is_hurried = choice.is_cut_short;
    let recipe = Recipe {
        params: input.params,
        division,
        model: input.model,
        turn: &setup.candidate.turn,
        grid,
        distances,
        choice,
    };
    let learned = &mut setup.lessons;
    let instead = |handover: &Handover, parts: &KitParts| {
        rather_than_finish(ctx, division, &foresight, (handover, parts), allowance)
    };
    let found = match make(kit_ctx, recipe, instead) {
        Ok(Ok(kit)) => {
            parts.effort.kits += 1;
            learn(ctx, division, learned, kit, allowance)?
        }
        Ok(Err(instead)) => Found {
            is_stopped: true,
            ..match instead {
                Instead::Change(change) => Found::nothing(Failure::of("pieces rattle")).with(Some(change)),
                Instead::Replan(lessons) => {
                    learn_and_replan(ctx, division, learned, (Step::Reconnect, &lessons), allowance)?
                }
            }
        },
        // A piece that cannot take enough of its wall along costs only the plan.
        Err(DesignError::Make(MakeError::Body(BodyError::Blocked {
            piece,
            separation,
            free_share,
        }))) => {
            let lesson = Lesson::Blocked {
                piece,
                separation,
                free_share,
            };
            learned.add(&lesson);
            another_plan(ctx, division, learned, (Step::Replan, &[lesson]), allowance)?
        }
        Err(e) => return Err(e),
    };
    Ok(Found {
        late: late.or(found.late),
        is_hurried: is_hurried || found.end.as_ref().is_some_and(Kit::is_hurried),
        ..found
    })
}

/// Something that promises more than finishing a kit.
enum Instead {
    /// Makes the kit of other pieces.
    Change(Change),
    /// Makes the kit of another plan, with what the connectors of this one taught.
    Replan(Vec<Lesson>),
}

/// Decides whether a kit is finished. Pieces that rattle are known as soon as the connectors are.
fn rather_than_finish(
    ctx: &Ctx,
    division: &Division,
    foresight: &Foresight,
    (handover, parts): (&Handover, &KitParts),
    allowance: &Allowance,
) -> Result<Option<Instead>, DesignError> {
    let plan = handover.found_plan();
    let expected = foresight.expect(plan, &parts.contacts);
    let (rattling, loose) = (expected.rattlers(), expected.loose());
    if allowance.may_stop_for(Step::Lengthen)
        && let Some(longer) = longer::for_play(ctx, division, &rattling, allowance)?
    {
        return Ok(Some(Instead::Change(longer)));
    }
    if !rattling.is_empty()
        && allowance.may_stop_for(Step::JoinRattling)
        && let Some(fewer) = join(ctx, division, &loosest_half(&rattling))?
    {
        let change = Change::Divide(Step::JoinRattling, fewer, None);
        return Ok(Some(Instead::Change(change)));
    }
    if loose.is_empty() || !allowance.may_stop_for(Step::Reconnect) {
        return Ok(None);
    }
    let mut lessons: Vec<Lesson> = parts
        .weak_joints(handover, &division.sizes.sizes)
        .into_iter()
        .collect();
    let shares = expected.held_shares().into_iter();
    lessons.extend(shares.map(|(piece, share)| Lesson::BadlyHeld { piece, share }));
    lessons.push(Lesson::FailedPlan {
        plan: plan.clone(),
        loose,
    });
    Ok(Some(Instead::Replan(lessons)))
}

/// Seeks the plan that a kit would be made of, without making it.
pub(super) fn seek_plan(
    ctx: &Ctx,
    mut parts: Parts<'_, '_>,
    allowance: &Allowance,
) -> Result<Found<Planned>, DesignError> {
    let plan_ctx = ctx.fork();
    let (choice, _, late) = match plan_or_changes(ctx, &plan_ctx, &mut parts, allowance)? {
        Ok(plan) => plan,
        Err(found) => return Ok(found),
    };
    let (turn, surface) = (&parts.setup.candidate.turn, &parts.setup.division.surface);
    let is_hurried = choice.is_cut_short;
    let warnings = [plan_ctx.into_warnings(), parts.job.wall.warnings()];
    Ok(Found {
        end: Some(Planned::new(turn, surface, choice, warnings)),
        late,
        is_hurried,
        ..Found::nothing(Failure::default())
    })
}

/// A plan to make, with what is expected of it and the step that a lack of time rules out; or the changes to
/// make instead.
type Decision<T> = Result<(Chosen, Foresight, Option<Step>), Found<T>>;

/// Seeks the next plan to make, or the changes to make instead. Warnings go to `plan_ctx`.
fn plan_or_changes<T>(
    ctx: &Ctx,
    plan_ctx: &Ctx,
    Parts {
        job, setup, effort, ..
    }: &mut Parts<'_, '_>,
    allowance: &Allowance,
) -> Result<Decision<T>, DesignError> {
    setup.division.warn(plan_ctx);
    setup.survey_plans(plan_ctx)?;
    effort.plans += 1;
    let (division, learned) = (&setup.division, &setup.lessons);
    let edge_share = MetricParams::default().edge_share;
    let planning = Planning {
        input: job.input,
        cavity: &job.wall.cavity,
        turn: &setup.candidate.turn,
        division,
        even: setup
            .even
            .get_or_insert_with(|| EvenSurface::new(&division.surface, edge_share)),
        survey: setup.survey.as_ref().expect("plans were surveyed"),
        constraints: &learned.constraints,
    };
    Ok(Err(
        match next_plan(plan_ctx, &planning, allowance, &mut setup.former)? {
            Next::Plan(choice, foresight, late) => return Ok(Ok((*choice, *foresight, late))),
            Next::Changes(changes, late) => Found {
                changes,
                late,
                ..Found::nothing(Failure::default())
            },
            Next::None(failure) => {
                let failure = learned.failure.after(failure);
                let longer = longer::for_connectors(ctx, division, &failure.apart, allowance)?;
                let change = divide(ctx, division, (&failure, learned.n_kits), allowance)?;
                let cut_key = division.settings.cut_key();
                let apart: Vec<PatchId> = (failure.apart.iter().copied())
                    .filter(|piece| Some(*piece) != cut_key)
                    .collect();
                let fewer = match allowance.is_wanted(Step::JoinPredicted) {
                    true => join(ctx, division, &apart)?,
                    false => None,
                };
                let fewer = fewer.map(|surface| Change::Divide(Step::JoinPredicted, surface, None));
                Found::nothing(failure).with(longer).with(change).with(fewer)
            }
        },
    ))
}

/// Learns from a kit what may help.
fn learn(
    ctx: &Ctx,
    division: &Division,
    learned: &mut Learned,
    kit: Kit,
    allowance: &Allowance,
) -> Result<Found<Kit>, DesignError> {
    learned.n_kits += 1;
    if let Some(fault) = kit.fault() {
        ctx.note(&format!("a kit of {} pieces was made: {fault}", kit.pieces.len()));
    }
    let found = if kit.is_firm() {
        Found::nothing(Failure::default())
    } else if kit.only_rattles() {
        // The search already chose the plan with the least rattling, so only other pieces help.
        let of_patch = |play: RelativePlay| RelativePlay {
            piece: kit.handover.patch(play.piece),
            ..play
        };
        let rattling: Vec<RelativePlay> = kit.rattling_pieces().into_iter().map(of_patch).collect();
        let longer = longer::for_play(ctx, division, &rattling, allowance)?;
        let patches: Vec<PatchId> = rattling.iter().map(|r| r.piece).collect();
        let fewer = match allowance.is_wanted(Step::JoinRattling) {
            true => join(ctx, division, &patches)?,
            false => None,
        };
        let fewer = fewer.map(|surface| Change::Divide(Step::JoinRattling, surface, None));
        Found::nothing(Failure::of("pieces rattle"))
            .with(longer)
            .with(fewer)
    } else {
        learn_and_replan(ctx, division, learned, (Step::Remake, &kit.lessons()), allowance)?
    };
    Ok(Found {
        end: Some(kit),
        ..found
    })
}

/// Learns from a kit that failed or was given up, and offers another one.
fn learn_and_replan(
    ctx: &Ctx,
    division: &Division,
    learned: &mut Learned,
    (step, lessons): (Step, &[Lesson]),
    allowance: &Allowance,
) -> Result<Found<Kit>, DesignError> {
    learned.failure.loose = lessons.iter().flat_map(Lesson::loose).collect();
    for lesson in lessons {
        learned.add(lesson);
    }
    another_plan(ctx, division, learned, (step, lessons), allowance)
}

/// Offers another plan, which respects the lessons, or other pieces if no more plans are allowed.
fn another_plan(
    ctx: &Ctx,
    division: &Division,
    learned: &Learned,
    (step, lessons): (Step, &[Lesson]),
    allowance: &Allowance,
) -> Result<Found<Kit>, DesignError> {
    let mut failure = learned.failure.clone();
    failure.reason = "no kit passed its verification within the allowed rounds".to_owned();
    if allowance.is_allowed(step) {
        for lesson in lessons {
            ctx.note(&format!("{lesson}: trying another plan"));
        }
        return Ok(Found::nothing(failure).with(Some(Change::Step(step))));
    }
    let change = divide(ctx, division, (&failure, learned.n_kits), allowance)?;
    let late = allowance.late(step);
    Ok(Found {
        late,
        ..Found::nothing(failure).with(change)
    })
}

/// Offers other pieces, if that is allowed.
fn divide(
    ctx: &Ctx,
    division: &Division,
    (failure, n_kits): (&Failure, usize),
    allowance: &Allowance,
) -> Result<Option<Change>, DesignError> {
    if !allowance.is_wanted(Step::Divide) {
        return Ok(None);
    }
    let surface = revise(ctx, division, failure, allowance.is_hopeless && n_kits == 0)?;
    Ok(surface.map(|surface| Change::Divide(Step::Divide, surface, None)))
}

/// Next thing to do with a division.
pub(super) enum Next {
    /// Make the kit of this plan, the strongest of those with about the least cost. A lack of time may have
    /// ruled out a step that would make it stronger.
    Plan(Box<Chosen>, Box<Foresight>, Option<Step>),
    /// Make nothing yet: change the trial first.
    Changes(Vec<Change>, Option<Step>),
    /// There is no plan, for this reason.
    None(Failure),
}

/// Seeks the next plan of a division to make. The climb starts from the `former` strongest plan of the same
/// pieces, too; a plan that is given up for a change takes its place.
pub(super) fn next_plan(
    ctx: &Ctx,
    planning: &Planning<'_>,
    allowance: &Allowance,
    former: &mut Option<LatticePlan>,
) -> Result<Next, DesignError> {
    let division = planning.division;
    let (surface, settings) = (&division.surface, &division.settings);
    if surface.n_patches == 2 {
        return Ok(Next::None(Failure::of_two()));
    }
    let found = match search(ctx, planning)? {
        Ok(found) => found,
        Err(failure) => return Ok(Next::None(failure)),
    };
    let handling = planning.handling();
    let of_other_sizes = former.take();
    let choice = planning.choice(&handling, of_other_sizes.as_ref(), allowance.kit_reserve_s);
    ctx.stage("expected play", 0)?;
    let foresight = Foresight::of(&choice, &found);
    let rattling = foresight.rattlers();
    if let Some(longer) = longer::for_play(ctx, division, &rattling, allowance)? {
        return Ok(Next::Changes(vec![longer], None));
    }
    let mut late = None;
    if allowance.is_wanted(Step::JoinPredicted) && !rattling.is_empty() {
        late = allowance.late(Step::JoinPredicted);
        if late.is_none()
            && let Some(fewer) = join(ctx, division, &loosest_half(&rattling))?
        {
            let change = Change::Divide(Step::JoinPredicted, fewer, None);
            return Ok(Next::Changes(vec![change], None));
        }
    }
    let or_changes = |stand: Stand<'_>| {
        if !stand.is_early {
            ctx.note(&words_of_least(&stand.bears, allowance.least_factor));
        }
        *former = Some(stand.plan.plan.clone());
        match strengthen(ctx, planning, &handling, &stand, allowance) {
            Ok((changes, late_change)) => {
                // The climb may still reach what is asked, so an early look rules nothing out.
                late = late.or(late_change.filter(|_| !stand.is_early));
                (!changes.is_empty()).then_some(Ok(changes))
            }
            Err(e) => Some(Err(e)),
        }
    };
    let mut best = match metric::choose_or_change(ctx, &choice, &foresight, *found, or_changes)? {
        Ok(best) => best,
        Err(changes) => return Ok(Next::Changes(changes?, late)),
    };
    let (survey, constraints) = (planning.survey, planning.constraints);
    plan::raise_bounds(ctx, &settings.plan, survey, constraints, &mut best.search_result)?;
    if settings.plan.key_slide.is_none() {
        let (plan, largest_mm) = (&best.search_result.plan, division.sizes.sizes.largest_mm());
        let slide = plan.separation(plan.key()).unit();
        let may_be_cut = !planning.input.params.key.is_cut();
        key::warn_of_conditions(ctx, surface, (plan.key(), slide), largest_mm, may_be_cut);
    }
    Ok(Next::Plan(Box::new(best), Box::new(foresight), late))
}

/// The pieces to join first of those that would rattle, which come loosest first. Each that is joined holds
/// its neighbours better, too, so the others may need no joining.
fn loosest_half(rattling: &[RelativePlay]) -> Vec<PatchId> {
    let half = &rattling[..rattling.len().div_ceil(2)];
    half.iter().map(|r| r.piece).collect()
}

/// Searches for the cheapest plans, or for the reason why there is none. Most plans are changed before one is
/// made, so the proof gets a part of its work limit.
fn search(ctx: &Ctx, planning: &Planning<'_>) -> Result<Result<Box<FoundPlan>, Failure>, Cancelled> {
    let settings = &planning.division.settings.plan;
    let params = PlanParams {
        proof_budget: settings.proof_budget / SHARE_WHILE_PLANNING,
        ..settings.clone()
    };
    Ok(
        match plan::search(ctx, &params, planning.survey, planning.constraints)? {
            PlanOutcome::Found(found) => Ok(found),
            PlanOutcome::Infeasible {
                reason,
                blockers,
                articulations,
                apart,
            } => {
                let blocked = blockers.iter().map(|b| b.piece);
                let suspects = articulations.into_iter().chain(blocked).collect();
                let back = planning.turn.inverse();
                Err(Failure {
                    suspects,
                    apart,
                    reason,
                    blockers: blockers.into_iter().map(|b| b.rotate(&back)).collect(),
                    ..Failure::default()
                })
            }
        },
    )
}

/// Tells how often a plan withstands its loads, and how often that is asked.
fn words_of_least(bears: &[LoadBorne], asked: f64) -> String {
    let uses = bears.iter().filter(|b| b.deed.is_use()).filter_map(|b| b.factor);
    let least = uses.fold(f64::INFINITY, f64::min);
    format!("the strongest plan bears {least:.2} times its loads, and {asked:.1} times is asked")
}
