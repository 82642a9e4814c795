//! What can be said of a division before anything is made of it: the pieces as they will be cut, where a key can be,
//! and whether there is a plan. Takes a second where a kit takes a minute.

use super::budget::RESERVE;
use super::candidate::{self, Candidate};
use super::wall::Wall;
use super::ways::{self, Ask, Input};
use super::{DesignError, Handover, Job, KeySource, Params, Settings, resolved};
use crate::key::{self, KeyParams, KeySite};
use crate::plan::{Blocker, PlanConstraints, PlanOutcome, search, survey};
use crate::{Ctx, InstallationPlan, SegmentedSurface, Warning, segmentation};
use shellock_geom::{Solid, Vec3};

/// The first division of a model and what it promises, in the space of the model as it was given.
#[non_exhaustive]
pub struct Outlook {
    /// The pieces with smooth seams, mended so that no piece alone holds others; no key is cut out of them.
    pub divided: SegmentedSurface,
    /// Where a key can be cut, best first, whatever is chosen.
    pub keys: Vec<KeySite>,
    /// Whether they lock.
    pub verdict: Verdict,
    /// What was changed of the user's labels, and what may fail.
    pub warnings: Vec<Warning>,
}

/// Whether a division has a plan.
pub enum Verdict {
    /// It has.
    Locks {
        /// The pieces with the key, numbered as they go in.
        surface: SegmentedSurface,
        /// Order and directions.
        plan: InstallationPlan,
        /// Where the key is cut; `None` where it is one of the pieces.
        key: Option<KeySite>,
    },
    /// None was found.
    Blocked {
        /// Why, for people.
        reason: String,
        /// Who is in whose way: ids of `surface`.
        blockers: Vec<Blocker>,
        /// The pieces as they were tried last.
        surface: SegmentedSurface,
    },
}

/// The first division that [`design`](super::design) would make kits of: what [`outlook`] judges.
pub fn first_division(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
) -> Result<SegmentedSurface, DesignError> {
    let params = &resolved(params, model, labels)?;
    let wall = wall(params, model, labels);
    let divided = segmentation::segment(ctx, &wall.settings.segmentation, model, labels)?;
    Ok(divided)
}

/// The outlook of the first division that [`design`](super::design) would make kits of, with the wall as thick as
/// `params` say or of usual thickness, with connectors of usual size. `divided` is what [`first_division`] gave for the
/// same, where that is known: then it is not divided again.
///
/// Nothing is simulated: what locks here may still rattle or bear too little, and then pieces are joined or walls
/// grow. Plans are searched, not proven.
pub fn outlook(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
    divided: Option<SegmentedSurface>,
) -> Result<Outlook, DesignError> {
    let params = &Params {
        proof_budget: 0,
        ..resolved(params, model, labels)?
    };
    let input = Input {
        params,
        model,
        labels,
    };
    let wall = wall(params, model, labels);
    let ask = Ask {
        factor: RESERVE,
        rounds: params.rounds,
        n_thicker: 0,
    };
    let job = match divided {
        Some(surface) => Job::of(&input, &wall, ask, false, surface)?,
        None => Job::new(ctx, &input, &wall, ask, false)?,
    };
    let told = ctx.fork();
    segmentation::tell(&told, &wall.settings.segmentation, model, labels, &job.surface)?;
    let anywhere = KeyParams {
        near: None,
        ..candidate::key_params(&job)
    };
    let keys = key::sites(ctx, &anywhere, &job.surface)?;
    let places = match params.key {
        KeySource::Cut => candidate::in_turn(keys.clone()),
        _ => candidate::places(ctx, &job)?,
    };
    let verdict = verdict(&ctx.fork(), &job, &places)?;
    Ok(Outlook {
        keys,
        verdict,
        warnings: told.into_warnings(),
        divided: job.surface,
    })
}

/// The wall as thick as `params` say, of the first way to divide.
fn wall(params: &Params, model: &Solid, labels: Option<&[i64]>) -> Wall {
    let input = Input {
        params,
        model,
        labels,
    };
    let wall = Wall {
        settings: Settings::resolve(params),
        strength: None,
        warnings: Vec::new(),
    };
    wall.divided(ways::ways(&input)[0])
}

/// Plans for the places in turn until there is one; what was in the way at the first where there is none.
fn verdict(ctx: &Ctx, job: &Job<'_>, places: &[Option<KeySite>]) -> Result<Verdict, DesignError> {
    let mut first = None;
    for (i, place) in places.iter().enumerate() {
        let Some(candidate) = Candidate::new(job, i, place.as_ref()) else {
            continue;
        };
        let Some(division) = candidate.division(ctx, job, candidate.surface.clone())? else {
            continue;
        };
        let (surface, settings) = (&division.surface, &division.settings);
        let survey = survey(
            ctx,
            &settings.plan,
            surface,
            &surface.seams(),
            &division.chosen.sizes,
        )?;
        match search(ctx, &settings.plan, &survey, &PlanConstraints::default())? {
            PlanOutcome::Found(found) => {
                let handover = Handover::new(&candidate.turn, found.plan);
                return Ok(Verdict::Locks {
                    surface: handover.surface(surface),
                    plan: handover.plan(),
                    key: *place,
                });
            }
            PlanOutcome::Infeasible { reason, blockers, .. } => {
                let back = candidate.turn.inverse();
                let blocker = |b: Blocker| Blocker {
                    at: back.apply(Vec3::from(b.at)).to_array(),
                    ..b
                };
                first.get_or_insert_with(|| Verdict::Blocked {
                    reason,
                    blockers: blockers.into_iter().map(blocker).collect(),
                    surface: SegmentedSurface {
                        mesh: back.mesh(&surface.mesh),
                        ..surface.clone()
                    },
                });
            }
        }
    }
    Ok(first.unwrap_or_else(|| Verdict::Blocked {
        reason: "no key can be cut of these pieces, and none can be the key".to_owned(),
        blockers: Vec::new(),
        surface: job.surface.clone(),
    }))
}
