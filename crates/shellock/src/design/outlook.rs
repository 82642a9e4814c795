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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Figure, make};
    use crate::segmentation::Method;
    use crate::testing::{sphere, voronoi};

    fn params(n_pieces: usize) -> Params {
        let mut params = Params::default();
        (params.method, params.n_pieces) = (Method::Creases, Some(n_pieces));
        params
    }

    /// Whether it locks, and what it says.
    fn told(outlook: &Outlook) -> (bool, usize) {
        match &outlook.verdict {
            Verdict::Locks { surface, plan, .. } => {
                assert_eq!(plan.steps.len(), surface.n_patches);
                (true, surface.n_patches)
            }
            Verdict::Blocked { reason, .. } => {
                assert!(!reason.is_empty());
                (false, 0)
            }
        }
    }

    #[test]
    fn what_is_divided_already_is_judged_as_if_it_were_divided_anew() {
        let vase = make(Figure::Vase, 90.0, 2.0);
        let (ctx, params) = (Ctx::quiet(), params(6));
        let divided = first_division(&ctx, &params, &vase, None).unwrap();
        let anew = outlook(&ctx, &params, &vase, None, None).unwrap();
        let known = outlook(&ctx, &params, &vase, None, Some(divided.clone())).unwrap();
        assert_eq!(anew.divided.mesh, divided.mesh);
        assert_eq!(anew.divided.patch_of_face, divided.patch_of_face);
        assert_eq!(told(&anew), told(&known));
        assert_eq!(anew.keys, known.keys);
        assert!(told(&anew).0);
    }

    #[test]
    fn a_key_that_is_wanted_at_a_place_is_the_one_of_the_plan() {
        let vase = make(Figure::Vase, 90.0, 2.0);
        let (ctx, mut params) = (Ctx::quiet(), params(6));
        let best = outlook(&ctx, &params, &vase, None, None).unwrap();
        let other = best.keys.last().expect("a vase has places").prism.middle();
        params.key = KeySource::CutNear(other.to_array());
        let wanted = outlook(&ctx, &params, &vase, None, None).unwrap();
        let Verdict::Locks { key: Some(key), .. } = wanted.verdict else {
            panic!("it has a plan");
        };
        assert!(key.prism.middle().distance(other) < 15.0, "{key:?}");
        assert_eq!(wanted.keys, best.keys, "places are told whatever is chosen");
    }

    #[test]
    fn what_was_changed_of_labels_is_told() {
        let ball = voronoi(sphere(5, Vec3::splat(45.0)), 7, 3);
        let mut labels: Vec<i64> = ball.patch_of_face.iter().map(|p| i64::from(p.0) + 1).collect();
        // A label on the far side of its piece.
        let far = (0..labels.len())
            .max_by(|&a, &b| ball.mesh.face_center(a).z.total_cmp(&ball.mesh.face_center(b).z));
        let far = far.expect("it has triangles");
        let lowest = (0..labels.len())
            .min_by(|&a, &b| ball.mesh.face_center(a).z.total_cmp(&ball.mesh.face_center(b).z));
        labels[far] = labels[lowest.expect("it has triangles")];
        let solid = Solid::new(ball.mesh).unwrap();
        let outlook = outlook(&Ctx::quiet(), &Params::default(), &solid, Some(&labels), None).unwrap();
        let islands = |w: &&Warning| matches!(w.cause, crate::Cause::LabelIslands { n: 1, .. });
        assert_eq!(
            outlook.warnings.iter().filter(islands).count(),
            1,
            "{:?}",
            outlook.warnings
        );
    }
}
