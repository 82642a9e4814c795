//! Repair of a drawn division until the contact graph of its smooth seams has no faults.

use shellock_report::Ctx;
use shellock_segment::mirrored::Mirrored;
use shellock_surface::SegmentedSurface;

use super::ground::Ground;
use super::method::symmetry_plane;
use super::refine::{n_faults, refine_on};
use super::settle::settle_seams;
use super::smooth::smooth_and_cut;
use super::{FaceLabels, LabelOrigin, SegmentationError, SegmentationParams};

/// Greatest number of repair rounds. A round follows with a stricter limit if smoothing shortened a contact
/// below the limit.
const MAX_ROUNDS: usize = 4;
/// Factor by which the limit grows in each round.
const STRICTER: f64 = 1.15;
/// Greatest factor on the number of pieces for which both sides are divided alike.
const MORE_FOR_SYMMETRY: f64 = 1.5;

/// A division that was repaired and cut.
pub(super) struct Mended {
    /// Number of faults that are left.
    pub n_faults: usize,
    /// Patches before their seams were moved and smoothed.
    pub labels: FaceLabels,
    pub surface: SegmentedSurface,
}

/// Repairs, smooths and cuts until the contact graph of the smooth seams has no faults. If no round achieves
/// this, returns the best round. Stops before it cuts a division that is `not_worth` it.
///
/// Divides both sides alike if that is requested and leaves no fault.
pub(super) fn held_twice(
    ctx: &Ctx,
    params: &SegmentationParams,
    ground: &Ground<'_>,
    labels: &FaceLabels,
    origin: LabelOrigin<'_>,
    not_worth: impl Fn(&FaceLabels) -> bool,
) -> Result<Option<Mended>, SegmentationError> {
    let job = Job {
        ctx,
        params,
        ground,
        is_drawn: matches!(origin, LabelOrigin::Drawn { .. }),
        not_worth: &not_worth,
    };
    if let Some(mirrored) = origin.mirror()
        && let Some(mended) = job.rounds(labels.clone(), Some(mirrored))?
        && mended.n_faults == 0
    {
        return Ok(Some(mended));
    }
    job.rounds(labels.clone(), None)
}

struct Job<'a> {
    ctx: &'a Ctx<'a>,
    params: &'a SegmentationParams,
    ground: &'a Ground<'a>,
    is_drawn: bool,
    not_worth: &'a dyn Fn(&FaceLabels) -> bool,
}

impl Job<'_> {
    /// Runs rounds with ever stricter limits. Returns the best.
    fn rounds(
        &self,
        mut labels: FaceLabels,
        mirrored: Option<&Mirrored>,
    ) -> Result<Option<Mended>, SegmentationError> {
        let mut strict = self.params.clone();
        let mut best: Option<Mended> = None;
        for _ in 0..MAX_ROUNDS {
            labels = refine_on(self.ctx, &strict, self.ground, &labels)?;
            if let Some(mirrored) = mirrored {
                labels = mended_alike(self.ctx, &strict, self.ground, mirrored, labels)?;
            }
            if (self.not_worth)(&labels) {
                break;
            }
            let surface = if self.is_drawn {
                settled_surface(self.ctx, &strict, self.ground, &labels)?
            } else {
                smooth_and_cut(self.ctx, self.params, self.ground.solid, &labels)?
            };
            let graph = surface.contact_graph_below(self.params.wall_mm, self.params.min_contact_mm);
            let n_faults = graph.n_faults();
            if best.as_ref().is_none_or(|b| n_faults < b.n_faults) {
                best = Some(Mended {
                    n_faults,
                    labels: labels.clone(),
                    surface,
                });
            }
            if n_faults == 0 {
                break;
            }
            strict.min_contact_mm *= STRICTER;
        }
        Ok(best)
    }
}

/// Mirror image of each triangle if both sides are to be divided alike; `None` without a plane of symmetry.
pub(super) fn mirror_images(params: &SegmentationParams, ground: &Ground<'_>) -> Option<Mirrored> {
    let is_asked = params.symmetric && params.method.knows_symmetry();
    let plane = is_asked.then(|| symmetry_plane(params, ground.solid)).flatten()?;
    Some(Mirrored::new(&plane, ground.solid.mesh(), ground.graph()))
}

/// Copies one side's patches to the other and repairs again. Returns `labels` unchanged if that needs too
/// many pieces or has more faults.
fn mended_alike(
    ctx: &Ctx,
    params: &SegmentationParams,
    ground: &Ground<'_>,
    mirrored: &Mirrored,
    labels: FaceLabels,
) -> Result<FaceLabels, SegmentationError> {
    let mut alike = mirrored.labels(ground.graph(), labels.as_slice());
    ground.whole.gather(&mut alike, &ground.graph().area_mm2);
    let alike = FaceLabels::from_components(&ground.topology, &alike);
    let mended = refine_on(ctx, params, ground, &alike)?;
    let most = MORE_FOR_SYMMETRY * labels.n_patches() as f64;
    let is_good = mended.n_patches() as f64 <= most
        && n_faults(params, ground, &mended) <= n_faults(params, ground, &labels);
    Ok(if is_good { mended } else { labels })
}

/// Surface with settled and smooth seams. The seams are only smoothed if settling would make a patch vanish.
fn settled_surface(
    ctx: &Ctx,
    params: &SegmentationParams,
    ground: &Ground<'_>,
    labels: &FaceLabels,
) -> Result<SegmentedSurface, SegmentationError> {
    let settled = settle_seams(params, ground, labels);
    match smooth_and_cut(ctx, params, ground.solid, &settled) {
        Err(SegmentationError::PatchVanished { .. }) => smooth_and_cut(ctx, params, ground.solid, labels),
        made => made,
    }
}
