//! From a drawn division to one whose smooth seams hold every piece twice.

use shellock_segment::mirrored::Mirrored;

use super::method::symmetry_plane;
use super::refine::{Ground, n_faults, refine_on};
use super::settle::settled;
use super::smooth::smooth_and_cut;
use super::{FaceLabels, LabelOrigin, SegmentationError, SegmentationParams};
use crate::{Ctx, SegmentedSurface};

/// How often refining is repeated with a stricter limit when smoothing shortened a contact below the limit.
const MAX_ROUNDS: usize = 4;
/// How much stricter each repetition is.
const STRICTER: f64 = 1.15;
/// Both sides are divided alike where that takes at most so many times the pieces.
const MORE_FOR_SYMMETRY: f64 = 1.5;

/// Mends, smooths and cuts until the smooth seams hold every piece twice; the best round and its faults where
/// none does. Ends before it cuts what `is_too_dear`.
///
/// Both sides alike where that is asked for and leaves no fault.
pub(super) fn held_twice(
    ctx: &Ctx,
    params: &SegmentationParams,
    ground: &Ground<'_>,
    labels: &FaceLabels,
    origin: LabelOrigin<'_>,
    is_too_dear: impl Fn(&FaceLabels) -> bool,
) -> Result<Option<(usize, SegmentedSurface)>, SegmentationError> {
    let job = Job {
        ctx,
        params,
        ground,
        is_drawn: matches!(origin, LabelOrigin::Drawn { .. }),
        is_too_dear: &is_too_dear,
    };
    if let Some(mirrored) = origin.mirrored()
        && let Some((0, surface)) = job.rounds(labels.clone(), Some(mirrored))?
    {
        return Ok(Some((0, surface)));
    }
    job.rounds(labels.clone(), None)
}

struct Job<'a> {
    ctx: &'a Ctx<'a>,
    params: &'a SegmentationParams,
    ground: &'a Ground<'a>,
    is_drawn: bool,
    is_too_dear: &'a dyn Fn(&FaceLabels) -> bool,
}

impl Job<'_> {
    /// Rounds with ever stricter limits: the best, and its faults.
    fn rounds(
        &self,
        mut labels: FaceLabels,
        mirrored: Option<&Mirrored>,
    ) -> Result<Option<(usize, SegmentedSurface)>, SegmentationError> {
        let mut strict = self.params.clone();
        let mut best: Option<(usize, SegmentedSurface)> = None;
        for _ in 0..MAX_ROUNDS {
            labels = refine_on(self.ctx, &strict, self.ground, &labels)?;
            if let Some(mirrored) = mirrored {
                labels = mended_alike(self.ctx, &strict, self.ground, mirrored, labels)?;
            }
            if (self.is_too_dear)(&labels) {
                break;
            }
            let surface = if self.is_drawn {
                settled_surface(self.ctx, &strict, self.ground, &labels)?
            } else {
                smooth_and_cut(self.ctx, self.params, self.ground.solid, &labels)?
            };
            let graph = surface.contact_graph_below(self.params.wall_mm, self.params.min_contact_mm);
            let faults = graph.n_faults();
            if best.as_ref().is_none_or(|b| faults < b.0) {
                best = Some((faults, surface));
            }
            if faults == 0 {
                break;
            }
            strict.min_contact_mm *= STRICTER;
        }
        Ok(best)
    }
}

/// Which triangle is whose mirror image where both sides are to be divided alike; `None` without a plane.
pub(super) fn mirror_images(params: &SegmentationParams, ground: &Ground<'_>) -> Option<Mirrored> {
    let is_asked = params.symmetric && params.method.knows_symmetry();
    let plane = is_asked.then(|| symmetry_plane(params, ground.solid)).flatten()?;
    Some(Mirrored::new(&plane, ground.solid.mesh(), ground.graph()))
}

/// One side's patches on both sides, mended once more; `labels` as they are where that takes too many pieces or has
/// more faults.
fn mended_alike(
    ctx: &Ctx,
    params: &SegmentationParams,
    ground: &Ground<'_>,
    mirrored: &Mirrored,
    labels: FaceLabels,
) -> Result<FaceLabels, SegmentationError> {
    let mut alike = mirrored.labels(ground.graph(), labels.as_slice());
    ground.whole.gather(&mut alike, &ground.graph().area_mm2);
    let alike = FaceLabels::from_connected(&ground.topology, &alike);
    let mended = refine_on(ctx, params, ground, &alike)?;
    let most = MORE_FOR_SYMMETRY * labels.n_patches() as f64;
    let is_good = mended.n_patches() as f64 <= most
        && n_faults(params, ground, &mended) <= n_faults(params, ground, &labels);
    Ok(if is_good { mended } else { labels })
}

/// The surface with its seams settled and smooth, or smooth alone where a patch would vanish.
fn settled_surface(
    ctx: &Ctx,
    params: &SegmentationParams,
    ground: &Ground<'_>,
    labels: &FaceLabels,
) -> Result<SegmentedSurface, SegmentationError> {
    let settled = settled(params, ground, labels);
    match smooth_and_cut(ctx, params, ground.solid, &settled) {
        Err(SegmentationError::PatchVanished { .. }) => smooth_and_cut(ctx, params, ground.solid, labels),
        made => made,
    }
}
