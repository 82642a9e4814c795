//! Moving a part of a patch to another patch.

use shellock_report::{Ctx, PatchId};
use shellock_surface::SegmentedSurface;

use super::ground::Ground;
use super::revise::try_change;
use super::{FaceLabels, SegmentationError, SegmentationParams};

/// A part of a patch that goes to another patch.
#[derive(Clone, Debug)]
pub struct Reassignment {
    /// Triangles that go to the other patch.
    pub part: Vec<u32>,
    /// Triangles that stay. A triangle of the patch in neither list goes with the nearer one.
    pub rest: Vec<u32>,
    /// Patch that takes the part.
    pub into: PatchId,
}

/// Moves a part of a patch, then refines and smooths again. `None` if nothing would stay, if a region that is
/// kept whole would be divided, or if a patch would vanish. Patches may be renumbered.
pub fn reassign(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    moved: &Reassignment,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    try_change(ctx, params, surface, |solid, labels| {
        let ground = Ground::with_regions(params, solid, &surface.source_face);
        let own = labels.patch(*moved.rest.first()? as usize).0;
        let mut label = labels.as_slice().to_vec();
        let sources: Vec<(u32, f64)> = moved.part.iter().chain(&moved.rest).map(|&f| (f, 1.0)).collect();
        let (_, nearest) = ground.faces.grow(&sources, |face| label[face as usize] == own);
        for (face, &source) in nearest.iter().enumerate() {
            if label[face] == own && (source as usize) < moved.part.len() {
                label[face] = moved.into.0;
            }
        }
        moved.part.iter().for_each(|&f| label[f as usize] = moved.into.0);
        let is_whole = !ground.whole.is_parted(&label, [own, moved.into.0]);
        is_whole.then(|| FaceLabels::from_components(&ground.topology, &label))
    })
}
