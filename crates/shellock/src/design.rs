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
mod division;
mod handover;
mod kit;
mod lesson;
mod outcome;
mod params;
mod settings;
mod strengthen;
#[cfg(test)]
mod tests;

use std::borrow::Cow;

use shellock_geom::Solid;

use crate::key::Turn;
use crate::metric::{Chosen, Holding};
use crate::plan::{PlanConstraints, PlanProof, survey};
use crate::strength::{Strength, StrengthError, StressMap};
use crate::{
    Cause, Ctx, IdVec, InstallationPlan, PatchId, SegmentedSurface, Warning, segmentation, strength,
};
use attempt::{Attempt, Failure, Next, Planning};
pub use budget::Effort;
use budget::{ASKED, Budget, Levers, Pace, THICKER_WALLS};
use candidate::Candidate;
use division::{Division, WallGrid, revised};
use handover::Handover;
pub use kit::Kit;
use outcome::Best;
pub use outcome::{Design, DesignError, DesignOutcome, PrintedFit};
pub use params::{KeySource, Params, Rounds, Thickness};
pub use settings::Settings;
use strengthen::{Remedy, Thicker};

/// Makes a kit of `model` (mm), from `labels` (one a triangle) where given. Kits are made until one passes or
/// the rounds are used up; then the best of them is returned, its failures told.
///
/// A kit is asked first to bear what people do with a reserve; where none passes with what that takes (a
/// thicker wall, larger connectors), it is asked to bear it once.
pub fn design(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
) -> Result<DesignOutcome, DesignError> {
    let params = &resolved(params, model, labels)?;
    let thinnest = Wall::decide(ctx, params, model)?;
    let mut effort = Effort::default();
    let [most, least] = ASKED;
    let Asked {
        outcome: first,
        has_changed,
        is_late,
    } = asking(ctx, params, model, labels, (&thinnest, most), &mut effort);
    let passed = |outcome: &DesignOutcome| outcome.kit().is_some_and(|kit| kit.verification.passed());
    let is_stop = matches!(first, Err(DesignError::Cancelled(_)));
    if first.as_ref().is_ok_and(passed) || is_stop || !has_changed || is_late {
        return first;
    }
    ctx.note("no kit passes that bears what people do with a reserve: without one");
    let second = asking(ctx, params, model, labels, (&thinnest, least), &mut effort);
    match (first, second.outcome) {
        (_, Err(stop @ DesignError::Cancelled(_))) => Err(stop),
        (Ok(first), second) if !second.as_ref().is_ok_and(|second| second.is_better_than(&first)) => {
            Ok(first)
        }
        (_, second) => second,
    }
}

/// The same with regions to keep whole as triangles of the model, where labels name them.
fn resolved(params: &Params, model: &Solid, labels: Option<&[i64]>) -> Result<Params, DesignError> {
    Ok(Params {
        keep_whole: segmentation::resolved(&params.keep_whole, model, labels)?,
        ..params.clone()
    })
}

/// How a job ended that asks so much of a kit.
struct Asked {
    outcome: Result<DesignOutcome, DesignError>,
    /// Whether something was changed for the sake of use.
    has_changed: bool,
    /// Whether the time is over for another kit.
    is_late: bool,
}

/// The job from `thinnest`, where a kit is asked to bear so many times what people do to it.
fn asking(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
    (thinnest, asked): (&Wall, f64),
    effort: &mut Effort,
) -> Asked {
    let mut wall = Cow::Borrowed(thinnest);
    let (mut n_left, mut is_late) = (THICKER_WALLS, false);
    let outcome = loop {
        let job = Job::new(ctx, params, model, labels, (&wall, asked), n_left > 0);
        let walled = job.and_then(|job| {
            let walled = with_wall(ctx, &job, effort);
            is_late = job.pace.is_late(ctx);
            walled
        });
        match walled {
            Ok(Walled::Done(outcome)) => break Ok(outcome),
            Ok(Walled::Thicker(thicker)) => {
                n_left -= 1;
                match wall.thicker(ctx, params, model, &thicker) {
                    Ok(next) => wall = Cow::Owned(next),
                    Err(e) => break Err(e),
                }
            }
            Err(e) => break Err(e),
        }
    };
    let has_changed = n_left < THICKER_WALLS || outcome.as_ref().is_ok_and(DesignOutcome::is_changed_for_use);
    Asked {
        outcome,
        has_changed,
        is_late,
    }
}

/// How a job with one wall ended.
enum Walled<T> {
    Done(T),
    /// The wall must be thicker, or it bears too little.
    Thicker(Thicker),
}

/// The job with the wall as thick as it is, on top of the `effort` that was made.
fn with_wall(ctx: &Ctx, job: &Job<'_>, effort: &mut Effort) -> Result<Walled<DesignOutcome>, DesignError> {
    let mut best = Best::after(*effort);
    let places = candidate::places(ctx, job)?;
    for (i, place) in places.iter().enumerate() {
        let has_ended = job.is_trial() && best.has_kit();
        if has_ended || best.is_enough(place.as_ref()) || (i > 0 && job.pace.is_late(ctx)) {
            continue;
        }
        if let Some(site) = place {
            ctx.note(&candidate::words(site));
        }
        if let Some(candidate) = Candidate::new(job, i, place.as_ref()) {
            let explored = explore(ctx, job, &candidate);
            if let Ok(Explored {
                thicker: Some(thicker),
                effort: spent,
                ..
            }) = explored
            {
                *effort += spent;
                return Ok(Walled::Thicker(thicker));
            }
            best.add(ctx, place.as_ref(), candidate, explored)?;
        }
    }
    best.finished(ctx, job).map(Walled::Done)
}

/// What came of one candidate.
struct Explored {
    /// The best of its kits.
    kit: Option<Kit>,
    /// Why there is none, for people, and who is in whose way.
    failure: Failure,
    /// The wall that it needs; nothing was made.
    thicker: Option<Thicker>,
    effort: Effort,
}

/// Kits of one candidate until one passes or its budget is used up.
fn explore(ctx: &Ctx, job: &Job<'_>, candidate: &Candidate<'_>) -> Result<Explored, DesignError> {
    let mut budget: Budget = candidate.budget;
    let mut wall = WallGrid::new(&job.settings().body, &candidate.model);
    let mut kit = None;
    let Some(mut division) = candidate.division(ctx, job, candidate.surface.clone())? else {
        let failure = Failure {
            reason: "the key falls apart".into(),
            ..Failure::default()
        };
        return Ok(Explored {
            kit,
            failure,
            thicker: None,
            effort: budget.spent,
        });
    };
    loop {
        budget.spent.segmentations += 1;
        wall.make_room(
            division
                .settings
                .connector
                .room_mm(division.chosen.sizes.largest_mm()),
        );
        let n_pieces = division.surface.n_patches;
        match attempt::plans(
            ctx,
            job,
            &candidate.turn,
            &mut wall,
            &division,
            &mut budget,
            &mut kit,
        )? {
            Attempt::Passed => {
                return Ok(Explored {
                    kit,
                    failure: Failure::default(),
                    thicker: None,
                    effort: budget.spent,
                });
            }
            Attempt::Joined(fewer) => {
                budget.foreseen_joinings -= 1;
                match candidate.division(ctx, job, fewer)? {
                    Some(next) => {
                        let n = next.surface.n_patches;
                        ctx.note(&format!("pieces would rattle: {n} pieces instead of {n_pieces}"));
                        division = next;
                    }
                    None => budget.foreseen_joinings = 0,
                }
            }
            Attempt::Weak(remedy) => {
                match strengthened(ctx, job, candidate, division, *remedy, &mut budget.levers)? {
                    Walled::Done(next) => division = next,
                    Walled::Thicker(thicker) => {
                        return Ok(Explored {
                            kit,
                            failure: Failure::default(),
                            thicker: Some(thicker),
                            effort: budget.spent,
                        });
                    }
                }
            }
            Attempt::Failed(failure) => {
                let next = if job.pace.is_late(ctx) {
                    None
                } else {
                    revised(ctx, &division, &failure, kit.is_some(), &mut budget)?
                };
                let next = next
                    .map(|surface| candidate.division(ctx, job, surface))
                    .transpose()?
                    .flatten();
                let Some(next) = next else {
                    return Ok(Explored {
                        kit,
                        failure,
                        thicker: None,
                        effort: budget.spent,
                    });
                };
                ctx.note(&format!(
                    "another segmentation: {} pieces instead of {n_pieces}",
                    next.surface.n_patches
                ));
                division = next;
            }
        }
    }
}

/// The division with what lets it bear more; the lever that was used is used up.
fn strengthened(
    ctx: &Ctx,
    job: &Job<'_>,
    candidate: &Candidate<'_>,
    division: Division,
    remedy: Remedy,
    levers: &mut Levers,
) -> Result<Walled<Division>, DesignError> {
    let next = match remedy {
        Remedy::Wall(thicker) => {
            ctx.note(&format!(
                "it would give way where it is {}: walls of {:.1} mm",
                thicker.weakest.deed.done(),
                thicker.thickness_mm
            ));
            return Ok(Walled::Thicker(thicker));
        }
        Remedy::Connectors(chosen) => {
            levers.connectors -= 1;
            ctx.note("it would give way where it is used: larger connectors there");
            Division { chosen, ..division }
        }
        Remedy::Joined(surface, told) => {
            levers.weak_joinings -= 1;
            match candidate.division(ctx, job, surface)? {
                Some(next) => {
                    ctx.note(&format!("{told}: {} pieces", next.surface.n_patches));
                    let told = division.told.into_iter().chain([told]).collect();
                    Division { told, ..next }
                }
                None => {
                    levers.weak_joinings = 0;
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
/// first.
pub fn plan(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
) -> Result<Result<Planned, String>, DesignError> {
    let params = &resolved(params, model, labels)?;
    let mut wall = Wall::decide(ctx, params, model)?;
    let mut n_left = THICKER_WALLS;
    loop {
        let job = Job::new(ctx, params, model, labels, (&wall, ASKED[0]), n_left > 0)?;
        match plan_with_wall(ctx, &job)? {
            Walled::Done(planned) => return Ok(planned),
            Walled::Thicker(thicker) => {
                n_left -= 1;
                wall = wall.thicker(ctx, params, model, &thicker)?;
            }
        }
    }
}

/// The same with the wall as thick as it is.
fn plan_with_wall(ctx: &Ctx, job: &Job<'_>) -> Result<Walled<Result<Planned, String>>, DesignError> {
    let mut reason = String::new();
    for (i, place) in candidate::places(ctx, job)?.iter().enumerate() {
        let Some(candidate) = Candidate::new(job, i, place.as_ref()) else {
            continue;
        };
        let mut n_joinings = candidate.budget.foreseen_joinings;
        let mut levers = candidate.budget.levers;
        let mut division = candidate.division(ctx, job, candidate.surface.clone())?;
        while let Some(current) = division {
            let ctx = ctx.fork();
            let Division {
                surface,
                settings,
                chosen,
                ..
            } = &current;
            current.tell(&ctx);
            let survey = survey(&ctx, &settings.plan, surface, &surface.seams(), &chosen.sizes)?;
            let none = PlanConstraints::default();
            let planning = Planning {
                params: job.params,
                model: job.model,
                turn: &candidate.turn,
                division: &current,
                survey: &survey,
                constraints: &none,
            };
            division = match attempt::next_plan(&ctx, &planning, n_joinings > 0, &levers)? {
                Next::Plan(chosen) => {
                    let own = (ctx.into_warnings(), job.wall.warnings.clone());
                    let planned = Planned::of(&candidate.turn, &current.surface, *chosen, own);
                    return Ok(Walled::Done(Ok(planned)));
                }
                Next::Weak(remedy) => {
                    match strengthened(&ctx, job, &candidate, current, *remedy, &mut levers)? {
                        Walled::Done(next) => Some(next),
                        Walled::Thicker(thicker) => return Ok(Walled::Thicker(thicker)),
                    }
                }
                Next::Joined(fewer) => {
                    n_joinings -= 1;
                    match candidate.division(&ctx, job, fewer)? {
                        Some(next) => Some(next),
                        None => {
                            n_joinings = 0;
                            Some(current)
                        }
                    }
                }
                Next::None(failure) => {
                    reason = failure.reason;
                    None
                }
            };
        }
    }
    Ok(Walled::Done(Err(reason)))
}

/// What all kits of a job have in common.
struct Job<'a> {
    params: &'a Params,
    /// As it was given, with its labels.
    model: &'a Solid,
    labels: Option<&'a [i64]>,
    wall: &'a Wall,
    /// How many times a kit is to bear what people do to it.
    asked: f64,
    /// Whether it may begin anew with a thicker wall.
    may_thicken: bool,
    pace: Pace,
    stress: Option<StressMap<'a>>,
    surface: SegmentedSurface,
    /// Which triangles of the model the user wants the key to have; `None` where that is left to us.
    key_faces: Option<Vec<bool>>,
}

impl<'a> Job<'a> {
    /// Divides the model.
    fn new(
        ctx: &Ctx,
        params: &'a Params,
        model: &'a Solid,
        labels: Option<&'a [i64]>,
        (wall, asked): (&'a Wall, f64),
        may_thicken: bool,
    ) -> Result<Self, DesignError> {
        let surface = segmentation::segment(&ctx.fork(), &wall.settings.segmentation, model, labels)?;
        let stress = wall.strength.as_ref().map(StressMap::new);
        Ok(Self {
            params,
            model,
            labels,
            wall,
            asked,
            may_thicken,
            pace: Pace::default(),
            stress,
            key_faces: key_faces(params.key, model, labels, &surface)?,
            surface,
        })
    }

    /// Whether its wall is as thick as it is for a reserve alone: then one kit is made, and where that fails the
    /// job goes back to the wall that it needs.
    fn is_trial(&self) -> bool {
        let [_, once] = ASKED;
        let is_thicker = |w: &Warning| matches!(w.cause, Cause::WallForUse { .. });
        self.asked > once && self.wall.warnings.iter().any(is_thicker)
    }

    /// How many kits may be made.
    fn rounds(&self) -> Rounds {
        let one = Rounds {
            kits: 1,
            refinements: 0,
            kits_in_all: 1,
        };
        if self.is_trial() { one } else { self.params.rounds }
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

/// The wall's thickness in what stages are given, what it bears, and what to tell of it.
#[derive(Clone)]
struct Wall {
    settings: Settings,
    strength: Option<Strength>,
    warnings: Vec<Warning>,
}

impl Wall {
    /// The same model with a thicker wall, for the sake of what people do to the kit.
    fn thicker(
        &self,
        ctx: &Ctx,
        params: &Params,
        model: &Solid,
        thicker: &Thicker,
    ) -> Result<Self, DesignError> {
        let thickness = Thickness::Mm(thicker.thickness_mm);
        let mut wall = Self::decide(
            ctx,
            &Params {
                thickness,
                ..params.clone()
            },
            model,
        )?;
        // The thinnest wall of those before stays the one that a fall asks for.
        let is_told = |w: &&Warning| matches!(w.cause, Cause::WallForUse { .. });
        let from_mm = match self.warnings.iter().find(is_told).map(|w| &w.cause) {
            Some(Cause::WallForUse { from_mm, .. }) => *from_mm,
            _ => self.settings.body.thickness_mm,
        };
        wall.warnings.push(thicker.warning(from_mm));
        Ok(wall)
    }

    fn decide(ctx: &Ctx, params: &Params, model: &Solid) -> Result<Self, DesignError> {
        let nominal = Settings::resolve(params);
        if !params.allows_thin {
            let thinnest_mm = match params.thickness {
                Thickness::Mm(mm) => mm,
                Thickness::Auto => nominal.strength.least_mm,
            };
            strength::is_hollow(model, thinnest_mm)?;
        }
        let ctx = &ctx.fork();
        let found = match params.thickness {
            Thickness::Mm(mm) => strength::stress(ctx, &nominal.strength, model, mm),
            Thickness::Auto => strength::thickness(ctx, &nominal.strength, model),
        };
        match found {
            Ok(strength) => {
                if !params.allows_thin {
                    strength::is_hollow(model, strength.thickness_mm)?;
                }
                let settings = Settings::with_thickness(params, strength.thickness_mm);
                let warnings = strength.warnings(&nominal.strength);
                Ok(Self {
                    settings,
                    strength: Some(strength),
                    warnings,
                })
            }
            Err(StrengthError::Shell(e)) => {
                let warning = Warning {
                    cause: Cause::StrengthUnknown {
                        error: e.to_string(),
                        thickness_mm: nominal.body.thickness_mm,
                    },
                    pieces: Vec::new(),
                    at: None,
                };
                Ok(Self {
                    settings: nominal,
                    strength: None,
                    warnings: vec![warning],
                })
            }
            Err(e) => Err(e.into()),
        }
    }
}
