//! Outlook of a division before anything is made of it: the pieces as they will be cut, places for a key, and
//! whether there is a plan. An outlook takes a second, a kit takes a minute.

use shellock_geom::Solid;

use super::agenda::{Agenda, Allowance, Grade};
use super::attempt::Found;
use super::candidate;
use super::failure::Failure;
use super::trial::{Parts, Trial};
use super::wall::Wall;
use super::ways::{self, Input};
use super::{DesignError, KeySource, Params, explore, resolve_params};
use crate::key::{self, KeyParams, KeySite};
use crate::plan::{Blocker, Handover, PlanOutcome, search};
use crate::{Ctx, InstallationPlan, SegmentedSurface, Warning, segmentation};

/// First division of a model and its prospects, in the space of the model as it was given.
#[non_exhaustive]
pub struct Outlook {
    /// Pieces with smooth seams, changed so that no piece alone connects others; no key is cut out of them.
    pub division: SegmentedSurface,
    /// Places where a key can be cut, best first, whatever the user chose.
    pub keys: Vec<KeySite>,
    /// Verdict: they lock or they do not.
    pub verdict: Verdict,
    /// Changes of the user's labels, and what may fail.
    pub warnings: Vec<Warning>,
}

/// Verdict on a division.
pub enum Verdict {
    /// The division has a plan.
    Locks {
        /// The pieces with the key, numbered as they are installed.
        surface: SegmentedSurface,
        /// Order and directions of installation.
        plan: InstallationPlan,
        /// Site of the key; `None` if it is one of the pieces.
        key: Option<KeySite>,
    },
    /// No plan was found with the keys that were tried.
    Blocked {
        /// Reason why there is no plan, for people.
        reason: String,
        /// Pieces that block the way out of others, as ids of `surface`.
        blockers: Vec<Blocker>,
        /// The pieces of the first key that was tried.
        surface: SegmentedSurface,
    },
}

/// Divides a model as [`design`](super::design) does first; [`outlook`] judges that division.
pub fn first_division(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
) -> Result<SegmentedSurface, DesignError> {
    let params = &resolve_params(params, model, labels)?;
    let input = Input::new(params, model, labels);
    let wall = Wall::nominal(params).with_way(ways::ways(&input)[0]);
    Ok(segmentation::segment(
        ctx,
        &wall.settings.segmentation,
        model,
        labels,
    )?)
}

/// Judges the first division that [`design`](super::design) makes kits of, with the wall as thick as `params`
/// say or of usual thickness, and connectors of usual size. `divided` is the result of [`first_division`] for
/// the same input, if that is known: then the model is not divided again.
///
/// Nothing is simulated: pieces that lock here may still rattle or be too weak, and then pieces are joined or
/// walls become thicker. Plans are searched, not proven.
pub fn outlook(
    ctx: &Ctx,
    params: &Params,
    model: &Solid,
    labels: Option<&[i64]>,
    divided: Option<SegmentedSurface>,
) -> Result<Outlook, DesignError> {
    let mut params = resolve_params(params, model, labels)?;
    params.proof_budget = 0;
    let params = &params;
    let input = Input::new(params, model, labels);
    let mut trial = Trial::new(input, Wall::nominal(params));
    trial.take_division(divided);
    let mut agenda = Agenda::of_keys(ctx, &input);
    let grade = |verdict: &Verdict| (verdict.grade(), Vec::new());
    let best = explore(&ctx.fork(), &mut agenda, &mut trial, judge, grade)?;
    let verdict = best.into_end()?;
    let (job, sites) = trial.into_division();
    let job = job.expect("an end or an error came of a model that is divided");
    let told = ctx.fork();
    segmentation::tell(&told, &job.settings().segmentation, model, labels, &job.surface)?;
    let keys = match params.key {
        KeySource::Cut => sites,
        _ => {
            let anywhere = KeyParams {
                near: None,
                ..candidate::key_params(&job)
            };
            key::sites(ctx, &anywhere, &job.surface)?
        }
    };
    Ok(Outlook {
        keys,
        verdict: verdict.unwrap_or_else(|| Verdict::Blocked {
            reason: "no key can be cut of these pieces, and none can be the key".to_owned(),
            blockers: Vec::new(),
            surface: job.surface.clone(),
        }),
        warnings: told.into_warnings(),
        division: job.surface,
    })
}

impl Verdict {
    /// Grade of the verdict: no failure if the division locks, else one. Of equal grades the first is kept.
    fn grade(&self) -> Grade {
        Grade {
            n_failures: usize::from(matches!(self, Self::Blocked { .. })),
            ..Grade::PERFECT
        }
    }
}

/// Searches for a plan with the present key.
fn judge(ctx: &Ctx, parts: Parts<'_, '_>, _: &Allowance) -> Result<Found<Verdict>, DesignError> {
    let setup = parts.setup;
    setup.survey_plans(ctx)?;
    let (division, turn) = (&setup.division, &setup.candidate.turn);
    let survey = setup.survey.as_ref().expect("plans were surveyed");
    let surface = &division.surface;
    let verdict = match search(ctx, &division.settings.plan, survey, &setup.lessons.constraints)? {
        PlanOutcome::Found(found) => {
            let handover = Handover::new(turn, found.plan);
            Verdict::Locks {
                surface: handover.surface(surface),
                plan: handover.plan(),
                key: parts.site,
            }
        }
        PlanOutcome::Infeasible { reason, blockers, .. } => {
            let back = turn.inverse();
            Verdict::Blocked {
                reason,
                blockers: blockers.into_iter().map(|b| b.rotate(&back)).collect(),
                surface: SegmentedSurface {
                    mesh: back.mesh(&surface.mesh),
                    ..surface.clone()
                },
            }
        }
    };
    Ok(Found {
        end: Some(verdict),
        ..Found::nothing(Failure::default())
    })
}

#[cfg(test)]
mod tests {
    use shellock_geom::Vec3;
    use shellock_test_surfaces::{sphere, voronoi};

    use super::*;
    use crate::figure::{Figure, make};
    use crate::segmentation::Method;

    fn params(n_pieces: usize) -> Params {
        let mut params = Params::default();
        (params.method, params.n_pieces) = (Method::Creases, Some(n_pieces));
        params
    }

    /// Returns true if the division locks, and the number of its pieces, 0 if it is blocked.
    fn summary(outlook: &Outlook) -> (bool, usize) {
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
        assert_eq!(anew.division.mesh, divided.mesh);
        assert_eq!(anew.division.patch_of_face, divided.patch_of_face);
        assert_eq!(summary(&anew), summary(&known));
        assert_eq!(anew.keys, known.keys);
        assert!(summary(&anew).0);
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
        let islands =
            |w: &&Warning| matches!(w.cause(), Some(crate::causes::Divide::LabelIslands { n: 1, .. }));
        assert_eq!(
            outlook.warnings.iter().filter(islands).count(),
            1,
            "{:?}",
            outlook.warnings
        );
    }
}
