//! Candidates for the key: cut out of the surface at one of the best places, or one of the pieces as it is.

use std::borrow::Cow;

use shellock_divide::widen;
use shellock_geom::Solid;

use super::division::Division;
use super::job::Job;
use super::{DesignError, KeySource, Settings};
use crate::key::{self, KeyParams, KeyPrism, KeySite, Turn};
use crate::piece::Grip;
use crate::segmentation::Plane;
use crate::{Ctx, LatticeDirection, PatchId, SegmentedSurface, sizes};

/// A key that is cut.
pub(super) struct CutKey {
    /// Site in the turned model.
    site: KeySite,
    /// Direction in which it slides.
    along: LatticeDirection,
}

/// One candidate for the key, with the model and its division turned for it.
pub(super) struct Candidate<'a> {
    pub turn: Turn,
    pub model: Cow<'a, Solid>,
    pub surface: SegmentedSurface,
    /// `None` where the key is one of the pieces.
    key: Option<CutKey>,
}

/// Finds sites to cut the key, best first; none if the key is a piece as it is.
pub(super) fn sites(ctx: &Ctx, job: &Job<'_>) -> Result<Vec<KeySite>, DesignError> {
    Ok(match job.input.params.key.is_cut() {
        true => key::sites(ctx, &key_params(job), &job.surface)?,
        false => Vec::new(),
    })
}

impl<'a> Candidate<'a> {
    /// Turns the model so that a key cut at `place` slides along a lattice direction; `None` if rounding then
    /// leaves no solid.
    pub fn new(job: &Job<'a>, place: Option<&KeySite>) -> Option<Self> {
        let as_it_lies = Self {
            turn: Turn::default(),
            model: Cow::Borrowed(job.input.model),
            surface: job.surface.clone(),
            key: None,
        };
        let Some(site) = place else {
            return Some(as_it_lies);
        };
        let (turn, along) = Turn::align(site.prism.normal, site.prism.slide);
        let key = Some(CutKey {
            site: site.rotate(&turn, along),
            along,
        });
        let mut turned = Self { key, ..as_it_lies };
        if !turn.is_none() {
            turned.model = Cow::Owned(turn.solid(job.input.model).ok()?);
            turned.surface.mesh = turn.mesh(&turned.surface.mesh);
            turned.turn = turn;
        }
        Some(turned)
    }

    /// Cuts the key out of these pieces and resolves the stages' settings. `None` if the key does not come
    /// out as one piece.
    pub fn divide(
        &self,
        ctx: &Ctx,
        job: &Job<'_>,
        surface: SegmentedSurface,
    ) -> Result<Option<Division>, DesignError> {
        let mut settings = self.settings(job);
        let Some(key) = &self.key else {
            let params = &settings.segmentation;
            let as_it_is = |s: &SegmentedSurface| Some((s.clone(), None));
            let widened = widen(ctx, params, &surface, &as_it_is)?;
            let surface = widened.map_or(surface, |(surface, _)| surface);
            settings.plan.key = job.key_of(&surface);
            return Ok(Some(Division {
                sizes: self.sizes(ctx, job, &settings, &surface)?,
                surface,
                settings,
                grip: None,
                mirror: self.mirror(job),
                changes: Vec::new(),
            }));
        };
        let cut = key::imprint_and_refine(ctx, &settings.segmentation, &surface, &key.site.prism)?;
        let Some((surface, patch)) = cut else {
            return Ok(None);
        };
        settings = settings.with_key(patch, key.along);
        let mut sizes = self.sizes(ctx, job, &settings, &surface)?;
        // The key was cut with room for rails of the usual size.
        sizes.cap(patch, settings.connector.size.usual_mm());
        Ok(Some(Division {
            surface,
            settings,
            sizes,
            grip: job.input.params.has_grip.then(|| key.grip(patch)),
            mirror: self.mirror(job),
            changes: Vec::new(),
        }))
    }

    /// Plane of symmetry of the turned model.
    fn mirror(&self, job: &Job<'_>) -> Option<Plane> {
        job.mirror.map(|Plane { at, normal }| Plane {
            at: self.turn.apply(at),
            normal: self.turn.apply(normal),
        })
    }

    /// Returns the job's settings, with the regions to keep whole in the turned model.
    fn settings(&self, job: &Job<'_>) -> Settings {
        let mut settings = job.settings().clone();
        for region in &mut settings.segmentation.keep_whole {
            *region = region.rotate(&self.turn);
        }
        settings
    }

    /// Chooses connector sizes by the stress in the model as it was given.
    fn sizes(
        &self,
        ctx: &Ctx,
        job: &Job<'_>,
        settings: &Settings,
        surface: &SegmentedSurface,
    ) -> Result<sizes::ChosenSizes, DesignError> {
        let back = self.turn.inverse();
        let stress_at = job.stress().map(|map| move |place| map.at(back.apply(place)));
        let stress_mpa = stress_at.as_ref().map(|at| at as sizes::StressField);
        Ok(sizes::choose(&ctx.fork(), &settings.sizes, surface, stress_mpa)?)
    }
}

impl CutKey {
    /// Returns a notch across the key, nearer to its front.
    fn grip(&self, key: PatchId) -> Grip {
        /// Position of the notch from the key's back, as a share of the key's length.
        const FROM_BACK: f64 = 0.65;
        let prism = self.site.prism;
        let KeyPrism {
            origin,
            slide,
            normal,
            ..
        } = prism;
        Grip {
            key,
            at: origin + FROM_BACK * prism.length_mm() * slide,
            slide,
            normal,
        }
    }
}

/// Parameters of the search for sites.
pub(super) fn key_params(job: &Job<'_>) -> KeyParams {
    let settings = job.settings();
    KeyParams {
        seed: settings.segmentation.seed,
        wall_mm: settings.body.thickness_mm,
        size_mm: settings.connector.size.usual_mm(),
        piece_mm2: job.surface.mesh.area() / job.surface.n_patches as f64,
        up: settings.plan.up,
        keep_whole: settings.segmentation.keep_whole.clone(),
        near: match job.input.params.key {
            KeySource::CutNear(place) => Some(place),
            _ => None,
        },
    }
}
