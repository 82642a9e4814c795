//! Plans and kits of one division, until one passes or nothing new can be tried.

use super::budget::{BLOCKED_PLANS, Budget, Levers, Pace};
use super::division::{Division, WallGrid, joined};
use super::kit::{Recipe, make};
use super::lesson::{Lesson, lessons};
use super::strengthen::{Remedy, remedy};
use super::{DesignError, Job, Kit, Params};
use crate::body::{BodyError, GridError, PatchDistances};
use crate::handling::Handling;
use crate::key::Turn;
use crate::metric::{Choice, Chosen, ClimbParams, Foresight};
use crate::plan::{Blocker, LatticePlan, PlanConstraints, PlanOutcome, PlanSurvey};
use crate::{Ctx, PatchId, SegmentedSurface, key, metric, plan};
use shellock_geom::{Solid, Vec3};

/// How one division went.
pub(super) enum Attempt {
    Passed,
    /// Nothing was made, since pieces are foreseen to rattle; with these pieces less.
    Joined(SegmentedSurface),
    /// Nothing was made, since it would bear too little; what helps.
    Weak(Box<Remedy>),
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
    /// Pieces that rattle in the last kit, where nothing else is wrong with it; the loosest first, and
    /// without the key.
    pub rattling: Vec<PatchId>,
}

/// Keeps a kit where it is the best so far: that with the fewest failures, then that rattles least, the
/// earliest of several.
pub(super) fn keep(best: &mut Option<Kit>, kit: Kit) {
    if best.as_ref().is_none_or(|b| kit.is_better_than(b)) {
        *best = Some(kit);
    }
}

/// Plans and makes kits of one division. The best kit goes to `best`, what it cost off the `budget`.
pub(super) fn plans(
    ctx: &Ctx,
    job: &Job<'_>,
    turn: &Turn,
    wall: &mut WallGrid<'_>,
    division: &Division,
    budget: &mut Budget,
    best: &mut Option<Kit>,
) -> Result<Attempt, DesignError> {
    let params = job.params;
    let Division {
        surface,
        settings,
        chosen,
        ..
    } = division;
    let survey = plan::survey(
        &ctx.fork(),
        &settings.plan,
        surface,
        &surface.seams(),
        &chosen.sizes,
    )?;
    let mut distances: Option<PatchDistances> = None;
    let mut learned = Learned::default();
    let most_kits = budget.kits_each.min(budget.kits);
    while learned.n_kits < most_kits && learned.n_blocked < BLOCKED_PLANS {
        let is_first = learned.n_kits + learned.n_blocked == 0;
        if !is_first && job.pace.is_late(ctx) {
            job.pace.skip(ctx, "another plan");
            break;
        }
        let left_s = ctx.seconds_left();
        // A kit that is given up takes its warnings with it.
        let kit_ctx = ctx.fork();
        division.tell(&kit_ctx);
        // The proof of a plan runs on one thread; the grid and distances in it are made beside it.
        let may_join = budget.foreseen_joinings > 0;
        let levers = learned.levers(budget);
        budget.spent.plans += 1;
        let (measured, next) = rayon::join(
            || {
                let grid = wall.get()?;
                distances.get_or_insert_with(|| PatchDistances::measure(grid, surface));
                Ok::<(), GridError>(())
            },
            || {
                let planning = Planning {
                    params,
                    model: job.model,
                    turn,
                    division,
                    survey: &survey,
                    constraints: &learned.constraints,
                    begun_s: job.begun_s,
                    pace: &job.pace,
                };
                next_plan(&kit_ctx, &planning, may_join, &levers)
            },
        );
        measured?;
        let chosen = match next? {
            Next::Plan(chosen) => *chosen,
            Next::Joined(fewer) => return Ok(Attempt::Joined(fewer)),
            Next::Weak(remedy) => return Ok(Attempt::Weak(remedy)),
            Next::None(failure) => return Ok(Attempt::Failed(learned.failure.after(failure))),
        };
        let grid = wall.get()?;
        let distances = distances.as_ref().expect("they were measured beside the plan");
        let recipe = Recipe {
            params,
            division,
            model: job.model,
            turn,
            grid,
            distances,
            chosen,
        };
        let kit = match unless_blocked(make(kit_ctx, recipe))? {
            Ok(kit) => kit,
            Err(lesson) => {
                learned.give_up(ctx, lesson);
                continue;
            }
        };
        job.pace.made(ctx, left_s);
        budget.kits -= 1;
        budget.spent.kits += 1;
        let ending = learned.learn(ctx, &kit, budget.kits_each);
        keep(best, kit);
        if let Some(ending) = ending {
            return Ok(ending);
        }
    }
    let reason = "no kit passed its verification within the allowed rounds".into();
    Ok(Attempt::Failed(Failure {
        reason,
        ..learned.failure
    }))
}

/// The kit, or the lesson of a piece that something stands in the way of.
fn unless_blocked(made: Result<Kit, DesignError>) -> Result<Result<Kit, Lesson>, DesignError> {
    match made {
        Err(DesignError::Body(BodyError::Blocked {
            piece,
            separation,
            kept,
        })) => Ok(Err(Lesson::Blocked {
            piece,
            separation,
            kept,
        })),
        made => made.map(Ok),
    }
}

/// What the plans and kits of a division taught so far.
#[derive(Default)]
struct Learned {
    constraints: PlanConstraints,
    failure: Failure,
    n_kits: usize,
    n_blocked: usize,
}

impl Learned {
    /// What may be changed so that a kit bears more: nothing where kits taught something of these pieces, which
    /// would be lost.
    fn levers(&self, budget: &Budget) -> Levers {
        if self.n_kits == 0 {
            budget.levers
        } else {
            Levers::default()
        }
    }

    /// A plan was given up since a piece could not take its wall along.
    fn give_up(&mut self, ctx: &Ctx, lesson: Lesson) {
        ctx.note(&format!("{lesson}: trying another plan"));
        self.failure.blamed.extend(lesson.blamed());
        lesson.teach(&mut self.constraints);
        self.n_blocked += 1;
    }

    /// A kit was made; how the attempt ends where no other plan can help.
    fn learn(&mut self, ctx: &Ctx, kit: &Kit, most_kits: usize) -> Option<Attempt> {
        self.n_kits += 1;
        if kit.is_firm() {
            return Some(Attempt::Passed);
        }
        if kit.only_rattles() {
            // The plan was chosen to rattle least: other pieces are what helps.
            let patch = |piece: PatchId| kit.handover.patch(piece);
            let rattling = kit.rattling().into_iter().map(patch).collect();
            let reason = "pieces rattle".into();
            return Some(Attempt::Failed(Failure {
                reason,
                rattling,
                ..Failure::default()
            }));
        }
        let lessons = lessons(kit);
        self.failure
            .blamed
            .extend(lessons.iter().flat_map(Lesson::blamed));
        self.failure.loose = lessons.iter().flat_map(Lesson::loose).collect();
        for lesson in &lessons {
            if self.n_kits < most_kits {
                ctx.note(&format!("{lesson}: trying another plan"));
            }
            lesson.teach(&mut self.constraints);
        }
        None
    }
}

impl Failure {
    /// True where nothing but pieces that rattle is wrong with the last kit.
    pub fn rattles(&self) -> bool {
        !self.rattling.is_empty()
    }

    /// Where the key leaves one way, the other piece leaves the opposite way: it is held by nothing.
    fn of_two() -> Self {
        Self {
            reason: "two pieces come apart whichever of them is pulled; three can lock".into(),
            blamed: vec![PatchId(0), PatchId(1)],
            ..Self::default()
        }
    }

    /// The failure of a later plan, which is to blame first, with what was blamed before.
    fn after(self, later: Self) -> Self {
        let blamed = later.blamed.into_iter().chain(self.blamed).collect();
        Self {
            blamed,
            loose: self.loose,
            ..later
        }
    }
}

/// The pieces that are foreseen to rattle far more than they may, the loosest first.
fn foreseen_to_rattle(key: PatchId, excess: &[f64]) -> Vec<PatchId> {
    /// Play is foreseen within about this factor.
    const SURELY: f64 = 1.2;
    let excess = excess
        .iter()
        .enumerate()
        .map(|(i, excess)| (PatchId::from(i), *excess));
    let mut wide: Vec<(PatchId, f64)> = excess
        .filter(|(p, excess)| *excess > SURELY && *p != key)
        .collect();
    wide.sort_by(|a, b| b.1.total_cmp(&a.1));
    wide.into_iter().map(|w| w.0).collect()
}

/// What is to be made of a division.
pub(super) enum Next {
    /// The plan that holds best of those that cost about the least.
    Plan(Box<Chosen>),
    /// Nothing yet: pieces are foreseen to rattle; with these pieces less.
    Joined(SegmentedSurface),
    /// Nothing yet: it would bear too little; what helps.
    Weak(Box<Remedy>),
    /// Nothing, and why.
    None(Failure),
}

/// What a plan is sought for.
pub(super) struct Planning<'a> {
    pub params: &'a Params,
    /// As it was given, and how it was turned for the division.
    pub model: &'a Solid,
    pub turn: &'a Turn,
    pub division: &'a Division,
    pub survey: &'a PlanSurvey,
    pub constraints: &'a PlanConstraints,
    /// What was left of the time when the job with this wall began, s.
    pub begun_s: f64,
    /// Record of what is left out for want of time.
    pub pace: &'a Pace,
}

impl Planning<'_> {
    /// Whether the job may begin anew: as much time is left as it has taken.
    pub fn may_begin_anew(&self, ctx: &Ctx) -> bool {
        2.0 * ctx.seconds_left() >= self.begun_s
    }

    /// How the kit is handled, in the space of the division.
    pub fn handling(&self) -> Handling {
        let up = self.turn.apply(Vec3::from_array(self.params.up)).to_array();
        let thickness_mm = self.division.settings.body.thickness_mm;
        Handling::new(up, thickness_mm, self.params.material)
    }

    /// What plans are compared by.
    pub fn choice<'b>(&'b self, handling: &'b Handling) -> Choice<'b> {
        Choice {
            params: &self.division.settings.plan,
            surface: &self.division.surface,
            sizes: &self.division.chosen.sizes,
            survey: self.survey,
            constraints: self.constraints,
            handling,
            climb: ClimbParams::default(),
        }
    }
}

/// The next plan of a division to make.
pub(super) fn next_plan(
    ctx: &Ctx,
    planning: &Planning<'_>,
    may_join: bool,
    levers: &Levers,
) -> Result<Next, DesignError> {
    let &Planning {
        params,
        division,
        survey,
        constraints,
        ..
    } = planning;
    let Division {
        surface, settings, ..
    } = division;
    if surface.n_patches == 2 {
        return Ok(Next::None(Failure::of_two()));
    }
    let found = match plan::search(ctx, &settings.plan, survey, constraints)? {
        PlanOutcome::Found(found) => found,
        PlanOutcome::Infeasible {
            reason,
            blockers,
            articulations,
        } => {
            let blamed = articulations
                .into_iter()
                .chain(blockers.iter().map(|b| b.piece))
                .collect();
            return Ok(Next::None(Failure {
                reason,
                blockers,
                blamed,
                ..Failure::default()
            }));
        }
    };
    let handling = planning.handling();
    let choice = planning.choice(&handling);
    ctx.stage("what would rattle", 0)?;
    let foresight = Foresight::of(&choice, &found);
    if may_join && let Some((plan, excess)) = foresight.steadiest() {
        let rattling = foreseen_to_rattle(plan.plan.key(), excess);
        if let Some(fewer) = joined(ctx, &settings.segmentation, surface, &rattling)? {
            return Ok(Next::Joined(fewer));
        }
    }
    let best = metric::choose(ctx, &choice, &foresight, *found)?;
    if settings.plan.key_slide.is_none() {
        warn_of_key(ctx, params, division, &best.found.plan);
    }
    let plan = (&best.found.pool[0], &best.holding);
    Ok(match remedy(ctx, planning, &handling, plan, levers)? {
        Some(remedy) => Next::Weak(Box::new(remedy)),
        None => Next::Plan(Box::new(best)),
    })
}

/// Says which conditions a key breaks that was not cut to meet them.
fn warn_of_key(ctx: &Ctx, params: &Params, division: &Division, plan: &LatticePlan) {
    let may_be_cut = !params.key.is_cut();
    let Some(last) = plan.steps.last() else { return };
    if let Some(found) = key::conditions(&division.surface, last.piece, last.separation.unit()) {
        let largest_mm = division.chosen.sizes.largest_mm();
        found
            .problems(last.piece, largest_mm, may_be_cut)
            .into_iter()
            .for_each(|problem| ctx.warn(problem));
    }
}

#[cfg(test)]
mod tests {
    use super::super::division::revised;
    use super::super::wall::Wall;
    use super::super::ways::{Ask, Input};
    use super::super::{Candidate, Settings};
    use super::*;
    use crate::testing;

    #[test]
    fn no_kit_is_made_of_two_pieces_and_one_of_them_is_divided() {
        let model = Solid::new(testing::sphere(3, Vec3::splat(40.0))).expect("closed");
        let params = Params::default();
        let halves = testing::voronoi(model.mesh().clone(), 2, 1);
        assert_eq!(halves.n_patches, 2);
        let wall = Wall {
            settings: Settings::resolve(&params),
            strength: None,
            warnings: Vec::new(),
        };
        let input = Input {
            params: &params,
            model: &model,
            labels: None,
        };
        let ask = Ask {
            factor: 1.0,
            rounds: params.rounds,
            n_thicker: 0,
        };
        let ctx = Ctx::quiet();
        let job = Job::of(&input, &wall, ask, false, halves).expect("no key is named");
        let candidate = Candidate::new(&job, 0, None).expect("as it lies");
        let division = candidate.division(&ctx, &job, candidate.surface.clone());
        let division = division.expect("sizes").expect("no key is cut");
        let survey = plan::survey(
            &ctx,
            &division.settings.plan,
            &division.surface,
            &division.surface.seams(),
            &division.chosen.sizes,
        );
        let planning = Planning {
            params: &params,
            model: &model,
            turn: &candidate.turn,
            division: &division,
            survey: &survey.expect("not stopped"),
            constraints: &PlanConstraints::default(),
            begun_s: 0.0,
            pace: &job.pace,
        };
        let next = next_plan(&ctx, &planning, false, &Levers::default()).expect("not stopped");
        let Next::None(failure) = next else {
            panic!("two pieces never lock")
        };
        let mut budget = candidate.budget;
        let next = revised(&ctx, &division, &failure, false, &mut budget);
        let revised = next.expect("not stopped").expect("a half can be divided");
        assert!(revised.n_patches > 2, "{}", revised.n_patches);
    }
}
