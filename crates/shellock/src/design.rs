//! The whole job: from a closed mesh to interlocking pieces that were verified.
//!
//! Feedback goes one way: what a finished kit teaches becomes a constraint for the next plan of the same
//! division; when plans run out, the division is revised at the pieces to blame, and planning starts afresh;
//! when revisions run out, the next key is tried.
//!
//! ```text
//!  Params ─► Settings ─► Candidate (a key) ─► Division (pieces) ─► plan ─► Kit ─► verdict ─► Design
//!                           ▲                    ▲                  ▲                │
//!                           └─ next key ─────────┴─ revised ────────┴─ lessons ◄─────┘
//! ```

mod attempt;
mod budget;
mod candidate;
#[cfg(test)]
mod cost_tests;
mod division;
mod handover;
mod kit;
mod lesson;
mod outcome;
mod outlook;
mod params;
mod settings;
mod strengthen;
#[cfg(test)]
mod tests;
mod wall;
mod ways;

use std::borrow::Cow;

use shellock_geom::Solid;

use crate::key::{KeySite, Turn};
use crate::metric::{Chosen, Holding};
use crate::plan::{PlanConstraints, PlanProof, survey};
use crate::strength::StressMap;
use crate::{Ctx, IdVec, InstallationPlan, PatchId, SegmentedSurface, Warning, segmentation};
use attempt::{Attempt, Failure, Next, Planning};
pub use budget::Effort;
use budget::{Budget, Pace, RESERVE, ROUNDS_BESIDE_OTHERS, THICKER_WALLS};
use candidate::Candidate;
use division::{Division, WallGrid, revised};
use handover::Handover;
pub use kit::Kit;
use outcome::Best;
pub use outcome::{Design, DesignError, DesignOutcome, NoPlan, PrintedFit};
pub use outlook::{Outlook, Verdict, first_division, outlook};
pub use params::{KeySource, Params, Rounds, Thickness};
pub use settings::Settings;
use strengthen::{Remedy, Thicker};
use wall::Wall;
use ways::{Ask, Ended, Input, Walls, try_ways, with_reserve};

/// Makes a kit of `model` (mm), from `labels` (one a triangle) where given. Kits are made until one passes or
/// the rounds are used up; then the best of them is returned, its failures told.
///
/// Where a person would cut comes first (`auto`). Such a kit is asked to bear what people do with a reserve; where
/// none passes with the wall that this takes, its wall is as thin as a fall allows, and what is borne too little is
/// warned of. Where none passes at all, fewer pieces are tried, then still fewer with walls as thin as are made, then
/// pieces of similar size with such walls: that a kit locks comes before what it bears.
pub fn design(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
) -> Result<DesignOutcome, DesignError> {
    let params = &resolved(params, model, labels)?;
    let thinnest = Wall::decide(ctx, params, model)?;
    let input = Input {
        params,
        model,
        labels,
    };
    one_way_or_another(ctx, &input, &thinnest)
}

/// The first kit that passes of all ways to divide the model in turn; the best where none does.
fn one_way_or_another(ctx: &Ctx, input: &Input<'_>, thinnest: &Wall) -> Result<DesignOutcome, DesignError> {
    let ways = ways::ways(input);
    let few = input.params.rounds.least(&ROUNDS_BESIDE_OTHERS);
    let total_s = ctx.seconds_left();
    let mut effort = Effort::default();
    let mut thin: Option<Cow<'_, Wall>> = None;
    let ended = try_ways(ctx, &ways, |i, way| {
        let is_last = i + 1 == ways.len();
        let rounds = if is_last { input.params.rounds } else { few };
        let reserved_s = ways::reserved_s(total_s, i, ways.len());
        let seconds_left = || ctx.seconds_left() - reserved_s;
        let in_time = ctx.fork().with_deadline(&seconds_left);
        let wall = match &mut thin {
            _ if way.walls != Walls::Thin => thinnest,
            Some(thin) => thin,
            none => match thinnest.thin(&in_time, input) {
                Ok(wall) => none.insert(wall),
                Err(e) => return Ended::new(Err(e)),
            },
        };
        let ended = with_reserve(&in_time, input, &wall.divided(way), way.ask(rounds), &mut effort);
        in_time.into_warnings().into_iter().for_each(|w| ctx.warn(w));
        ended
    });
    ended.conclude(effort)
}

/// The same with regions to keep whole as triangles of the model, where labels name them.
fn resolved(params: &Params, model: &Solid, labels: Option<&[i64]>) -> Result<Params, DesignError> {
    Ok(Params {
        keep_whole: segmentation::resolved(&params.keep_whole, model, labels)?,
        ..params.clone()
    })
}

/// How a job with one wall ended.
enum Walled<T> {
    Done(T),
    /// The wall must be thicker, or it bears too little.
    Thicker(Thicker),
}

/// Runs the job with the wall as thick as it is, and adds the cost to `effort`, however it ends.
fn with_wall(ctx: &Ctx, job: &Job<'_>, effort: &mut Effort) -> Result<Walled<DesignOutcome>, DesignError> {
    let mut best = Best::default();
    let places = candidate::places(ctx, job)?;
    for (i, place) in places.iter().enumerate() {
        let has_ended = job.wall.is_thicker() && best.has_kit();
        if has_ended || best.is_enough(place.as_ref()) {
            continue;
        }
        if i > 0 && job.pace.is_late(ctx) {
            job.pace.skip(ctx, "another key");
            break;
        }
        if let Some(site) = place {
            ctx.note(&candidate::words(site));
        }
        if let Some(candidate) = Candidate::new(job, i, place.as_ref()) {
            let mut budget = candidate.budget;
            let explored = explore(ctx, job, &candidate, &mut budget);
            *effort += budget.spent;
            if let Ok(Explored {
                thicker: Some(thicker),
                ..
            }) = explored
            {
                return Ok(Walled::Thicker(thicker));
            }
            best.add(ctx, place.as_ref(), candidate, explored)?;
        }
    }
    best.finished(ctx, job, *effort).map(Walled::Done)
}

/// What came of one candidate.
#[derive(Default)]
struct Explored {
    /// The best of its kits.
    kit: Option<Kit>,
    /// Why there is none, for people, and who is in whose way.
    failure: Failure,
    /// The wall that it needs; nothing was made.
    thicker: Option<Thicker>,
}

/// Makes kits of one candidate until one passes or `budget`, which counts their cost, is used up.
fn explore(
    ctx: &Ctx,
    job: &Job<'_>,
    candidate: &Candidate<'_>,
    budget: &mut Budget,
) -> Result<Explored, DesignError> {
    let mut wall = WallGrid::new(&job.settings().body, &candidate.model);
    let mut explored = Explored::default();
    let Some(mut division) = candidate.division(ctx, job, candidate.surface.clone())? else {
        explored.failure.reason = "the key falls apart".into();
        return Ok(explored);
    };
    budget.spent.segmentations += 1;
    loop {
        wall.make_room(
            division
                .settings
                .connector
                .room_mm(division.chosen.sizes.largest_mm()),
        );
        let (turn, kit) = (&candidate.turn, &mut explored.kit);
        division = match attempt::plans(ctx, job, turn, &mut wall, &division, budget, kit)? {
            Attempt::Passed => return Ok(explored),
            Attempt::Joined(fewer) => join_as_foreseen(ctx, job, candidate, division, fewer, budget)?,
            Attempt::Weak(remedy) => match strengthened(ctx, job, candidate, division, *remedy, budget)? {
                Walled::Done(next) => next,
                Walled::Thicker(thicker) => {
                    explored.thicker = Some(thicker);
                    return Ok(explored);
                }
            },
            Attempt::Failed(failure) => {
                let has_kit = explored.kit.is_some();
                match divide_anew(ctx, job, candidate, &division, &failure, has_kit, budget)? {
                    Some(next) => next,
                    None => {
                        explored.failure = failure;
                        return Ok(explored);
                    }
                }
            }
        };
    }
}

/// Replaces the division by the one with `fewer` pieces, where some are foreseen to rattle. Keeps it where no key can be
/// cut of those pieces, and lets no others be joined then.
fn join_as_foreseen(
    ctx: &Ctx,
    job: &Job<'_>,
    candidate: &Candidate<'_>,
    division: Division,
    fewer: SegmentedSurface,
    budget: &mut Budget,
) -> Result<Division, DesignError> {
    budget.foreseen_joinings -= 1;
    let Some(next) = candidate.division(ctx, job, fewer)? else {
        budget.foreseen_joinings = 0;
        return Ok(division);
    };
    budget.spent.segmentations += 1;
    ctx.note(&format!(
        "pieces would rattle: trying {} pieces instead of {}",
        next.surface.n_patches, division.surface.n_patches
    ));
    Ok(next)
}

/// Revises the pieces after a failure; `None` where nothing is left to try, or no time.
fn divide_anew(
    ctx: &Ctx,
    job: &Job<'_>,
    candidate: &Candidate<'_>,
    division: &Division,
    failure: &Failure,
    has_kit: bool,
    budget: &mut Budget,
) -> Result<Option<Division>, DesignError> {
    if budget.may_revise(failure.rattles()) && job.pace.is_late(ctx) {
        job.pace.skip(ctx, "other pieces");
        return Ok(None);
    }
    let Some(surface) = revised(ctx, division, failure, has_kit, budget)? else {
        return Ok(None);
    };
    let Some(next) = candidate.division(ctx, job, surface)? else {
        return Ok(None);
    };
    budget.spent.segmentations += 1;
    ctx.note(&format!(
        "trying other pieces: {} instead of {}",
        next.surface.n_patches, division.surface.n_patches
    ));
    Ok(Some(next))
}

/// The division with what lets it bear more; the lever that was used is used up.
fn strengthened(
    ctx: &Ctx,
    job: &Job<'_>,
    candidate: &Candidate<'_>,
    division: Division,
    remedy: Remedy,
    budget: &mut Budget,
) -> Result<Walled<Division>, DesignError> {
    let next = match remedy {
        Remedy::Wall(thicker) => {
            ctx.note(&thicker.words());
            return Ok(Walled::Thicker(thicker));
        }
        Remedy::Connectors(chosen) => {
            budget.levers.connectors -= 1;
            ctx.note("seams would open where it is used: larger connectors there");
            Division { chosen, ..division }
        }
        Remedy::Joined(surface, told) => {
            budget.levers.weak_joinings -= 1;
            match candidate.division(ctx, job, surface)? {
                Some(next) => {
                    budget.spent.segmentations += 1;
                    ctx.note(&format!("{told}: {} pieces", next.surface.n_patches));
                    let told = division.told.into_iter().chain([told]).collect();
                    Division { told, ..next }
                }
                None => {
                    budget.levers.weak_joinings = 0;
                    division
                }
            }
        }
    };
    Ok(Walled::Done(next))
}

/// The plan that [`design`] would make first, in the space of the model as it was given; pieces are numbered
/// as they go in.
#[non_exhaustive]
pub struct Planned {
    /// The pieces.
    pub surface: SegmentedSurface,
    /// Order and directions.
    pub plan: InstallationPlan,
    /// How good it is.
    pub proof: PlanProof,
    /// Mean cost of its pieces.
    pub mean_cost: f64,
    /// How many plans it was chosen from.
    pub n_plans: usize,
    /// How it holds by simulation.
    pub holding: Holding,
    /// What was warned of on the way.
    pub warnings: Vec<Warning>,
}

impl Planned {
    /// What was found for a `surface` that was turned by `turn`; warnings of its own, then of the wall.
    fn of(
        turn: &Turn,
        surface: &SegmentedSurface,
        Chosen { found, holding, .. }: Chosen,
        (own, of_wall): (Vec<Warning>, Vec<Warning>),
    ) -> Self {
        let (proof, mean_cost, n_plans) = (found.proof(), found.score.mean, found.pool.len());
        let handover = Handover::new(turn, found.plan);
        Self {
            surface: handover.surface(surface),
            plan: handover.plan(),
            proof: handover.proof(proof),
            mean_cost,
            n_plans,
            holding: handover.holding(holding),
            warnings: [handover.warnings(own), of_wall].concat(),
        }
    }
}

/// The plan of `model` that [`design`] would make first, or why there is none: the same key, pieces and
/// connector sizes. Where pieces have no plan it goes on with the next key, while [`design`] divides them anew
/// first. No further key and no thicker wall is begun where the time is over ([`Ctx::seconds_left`]), which is reported.
pub fn plan(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
) -> Result<Result<Planned, NoPlan>, DesignError> {
    let params = &resolved(params, model, labels)?;
    let input = Input {
        params,
        model,
        labels,
    };
    let ask = Ask {
        factor: RESERVE,
        rounds: params.rounds,
        n_thicker: THICKER_WALLS,
    };
    let wall = Wall::decide(ctx, params, model)?;
    let mut wall = wall.divided(ways::ways(&input)[0]);
    let (mut n_left, mut is_cut_short) = (ask.n_thicker, false);
    loop {
        let job = Job::new(ctx, &input, &wall, ask, n_left > 0)?;
        let places = candidate::places(ctx, &job)?;
        let walled = try_keys(ctx, &job.pace, &places, |i, place| {
            plan_with_key(ctx, &job, i, place)
        })?;
        is_cut_short |= job.pace.is_cut_short();
        match walled {
            Walled::Done(planned) => return Ok(outcome::conclude_plan(planned, is_cut_short)),
            Walled::Thicker(thicker) => {
                n_left -= 1;
                wall = wall.thicker(ctx, &input, &thicker)?;
            }
        }
    }
}

/// Tries the keys in turn until one has a plan or needs a thicker wall; else gives the reason of the last key. Records
/// keys that are left out for want of time.
fn try_keys<T>(
    ctx: &Ctx,
    pace: &Pace,
    places: &[Option<KeySite>],
    mut attempt: impl FnMut(usize, Option<&KeySite>) -> Result<Walled<Result<T, String>>, DesignError>,
) -> Result<Walled<Result<T, String>>, DesignError> {
    let mut reason = String::new();
    for (i, place) in places.iter().enumerate() {
        if i > 0 && pace.is_late(ctx) {
            pace.skip(ctx, "another key");
            break;
        }
        match attempt(i, place.as_ref())? {
            Walled::Done(Err(why)) if why.is_empty() => {}
            Walled::Done(Err(why)) => reason = why,
            ended => return Ok(ended),
        }
    }
    Ok(Walled::Done(Err(reason)))
}

/// Plans with the `i`-th key: a plan, a thicker wall that it needs, or the reason why there is none (empty for a key that
/// cannot be cut).
fn plan_with_key(
    ctx: &Ctx,
    job: &Job<'_>,
    i: usize,
    place: Option<&KeySite>,
) -> Result<Walled<Result<Planned, String>>, DesignError> {
    let no_plan = |reason| Ok(Walled::Done(Err(reason)));
    let Some(candidate) = Candidate::new(job, i, place) else {
        return no_plan(String::new());
    };
    let Some(mut division) = candidate.division(ctx, job, candidate.surface.clone())? else {
        return no_plan(String::new());
    };
    let mut budget = candidate.budget;
    loop {
        let ctx = ctx.fork();
        division.tell(&ctx);
        let Division {
            surface,
            settings,
            chosen,
            ..
        } = &division;
        let survey = survey(&ctx, &settings.plan, surface, &surface.seams(), &chosen.sizes)?;
        let planning = Planning {
            params: job.params,
            model: job.model,
            turn: &candidate.turn,
            division: &division,
            survey: &survey,
            constraints: &PlanConstraints::default(),
            begun_s: job.begun_s,
            pace: &job.pace,
        };
        let may_join = budget.foreseen_joinings > 0;
        division = match attempt::next_plan(&ctx, &planning, may_join, &budget.levers)? {
            Next::Plan(chosen) => {
                let own = (ctx.into_warnings(), job.wall.warnings.clone());
                let planned = Planned::of(&candidate.turn, surface, *chosen, own);
                return Ok(Walled::Done(Ok(planned)));
            }
            Next::Weak(remedy) => {
                match strengthened(&ctx, job, &candidate, division, *remedy, &mut budget)? {
                    Walled::Done(next) => next,
                    Walled::Thicker(thicker) => return Ok(Walled::Thicker(thicker)),
                }
            }
            Next::Joined(fewer) => join_as_foreseen(&ctx, job, &candidate, division, fewer, &mut budget)?,
            Next::None(failure) => return no_plan(failure.reason),
        };
    }
}

/// What all kits of a job have in common.
struct Job<'a> {
    params: &'a Params,
    /// As it was given, with its labels.
    model: &'a Solid,
    labels: Option<&'a [i64]>,
    wall: &'a Wall,
    ask: Ask,
    /// Whether it may begin anew with a thicker wall.
    may_thicken: bool,
    pace: Pace,
    /// What was left of the time when it began, s.
    begun_s: f64,
    stress: Option<StressMap<'a>>,
    surface: SegmentedSurface,
    /// Which triangles of the model the user wants the key to have; `None` where that is left to us.
    key_faces: Option<Vec<bool>>,
}

impl<'a> Job<'a> {
    /// Divides the model.
    fn new(
        ctx: &Ctx,
        input: &Input<'a>,
        wall: &'a Wall,
        ask: Ask,
        may_thicken: bool,
    ) -> Result<Self, DesignError> {
        let &Input { model, labels, .. } = input;
        let begun_s = ctx.seconds_left();
        let surface = segmentation::segment(&ctx.fork(), &wall.settings.segmentation, model, labels)?;
        let job = Self::of(input, wall, ask, may_thicken, surface)?;
        Ok(Self { begun_s, ..job })
    }

    /// The model as it is divided already.
    fn of(
        input: &Input<'a>,
        wall: &'a Wall,
        ask: Ask,
        may_thicken: bool,
        surface: SegmentedSurface,
    ) -> Result<Self, DesignError> {
        let &Input {
            params,
            model,
            labels,
        } = input;
        let stress = wall.strength.as_ref().map(StressMap::new);
        Ok(Self {
            params,
            model,
            labels,
            wall,
            ask,
            may_thicken,
            pace: Pace::default(),
            begun_s: 0.0,
            stress,
            key_faces: key_faces(params.key, model, labels, &surface)?,
            surface,
        })
    }

    /// How many kits may be made: one with a wall that is thicker for the sake of use, as the job then goes back to
    /// the wall as it was.
    fn rounds(&self) -> Rounds {
        let one = Rounds {
            kits: 1,
            refinements: 0,
            kits_in_all: 1,
        };
        if self.wall.is_thicker() {
            one
        } else {
            self.ask.rounds
        }
    }

    /// The patch that has most of what the user wants the key to have.
    fn key_of(&self, surface: &SegmentedSurface) -> Option<PatchId> {
        let is_key = self.key_faces.as_ref()?;
        let mut area_mm2: IdVec<PatchId, f64> = IdVec::from_fn(surface.n_patches, |_| 0.0);
        for (face, &patch) in surface.patch_of_face.iter().enumerate() {
            if is_key[surface.source_face[face] as usize] {
                area_mm2[patch] += surface.mesh.face_area(face);
            }
        }
        area_mm2
            .iter()
            .max_by(|a, b| a.1.total_cmp(b.1))
            .map(|(patch, _)| patch)
    }

    fn settings(&self) -> &Settings {
        &self.wall.settings
    }
}

/// Which triangles of `model` the key is to have, as [`KeySource::Piece`] says.
fn key_faces(
    key: KeySource,
    model: &Solid,
    labels: Option<&[i64]>,
    surface: &SegmentedSurface,
) -> Result<Option<Vec<bool>>, DesignError> {
    let KeySource::Piece(name) = key else {
        return Ok(None);
    };
    let mut is_key = vec![false; model.mesh().triangles.len()];
    if let Some(labels) = labels {
        is_key
            .iter_mut()
            .zip(labels)
            .for_each(|(is_key, label)| *is_key = *label == name);
    } else {
        let faces = surface.patch_of_face.iter().zip(&surface.source_face);
        faces
            .filter(|(patch, _)| i64::from(patch.number()) == name)
            .for_each(|(_, &source)| is_key[source as usize] = true);
    }
    if is_key.contains(&true) {
        Ok(Some(is_key))
    } else if labels.is_some() {
        Err(DesignError::NoLabelOfKey(name))
    } else {
        Err(DesignError::NoPieceOfKey(name, surface.n_patches))
    }
}
