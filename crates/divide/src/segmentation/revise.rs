//! Changes of a division after its plans or kits failed.

use shellock_geom::{Solid, Topology};
use shellock_report::{Ctx, PatchId};
use shellock_surface::SegmentedSurface;

use super::ground::Ground;
use super::refine::refine_on;
use super::smooth::smooth_and_cut;
use super::split::split_between_regions;
use super::{FaceLabels, SegmentationError, SegmentationParams, has_short_contacts, kept_limit_mm};

/// Pieces joined at once; more would change too much of the structure.
const MOST_JOINED: usize = 2;

/// Changes pieces after a failure; `None` if nothing can be changed.
///
/// Dividing one of the `suspects`, most promising first, keeps the user's labels, so it comes first. Pieces
/// that came `loose` where seams are short would only get shorter seams: they are joined to a neighbour.
pub fn revise(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    suspects: &[PatchId],
    loose: &[PatchId],
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    if !loose.is_empty() && has_short_contacts(params, surface) {
        let joined = join(ctx, params, surface, loose)?;
        if joined.is_some() {
            return Ok(joined);
        }
    }
    first(suspects, |piece| divide(ctx, params, surface, piece))
}

/// Joins the first two of `pieces` to neighbours; `None` if that leaves nothing to lock.
pub fn join(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    pieces: &[PatchId],
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    match &pieces[..pieces.len().min(MOST_JOINED)] {
        [] => Ok(None),
        first => unite(ctx, params, surface, first),
    }
}

/// Joins the first of `pieces` that can be joined to a neighbour.
pub fn join_first(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    pieces: &[PatchId],
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    first(pieces, |piece| unite(ctx, params, surface, &[piece]))
}

/// Makes the first change of a piece that is possible.
fn first(
    pieces: &[PatchId],
    mut change: impl FnMut(PatchId) -> Result<Option<SegmentedSurface>, SegmentationError>,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    for &piece in pieces {
        let changed = change(piece)?;
        if changed.is_some() {
            return Ok(changed);
        }
    }
    Ok(None)
}

/// Divides `patch` of the surface in two, then refines and smooths again. `None` if it cannot be divided.
///
/// The feedback loop uses this if no plan takes the piece out or holds it. Patches may be renumbered. Fails
/// if the user stopped, or if the seams cannot be smoothed.
pub fn divide(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    patch: PatchId,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    try_change(ctx, params, surface, |solid, labels| {
        split_between_regions(
            &Ground::with_regions(params, solid, &surface.source_face),
            labels,
            patch,
        )
    })
}

/// Refines and smooths the surface again with its present patches. `None` if a patch would vanish. Patches
/// may be renumbered.
pub fn refined_again(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    try_change(ctx, params, surface, |_, labels| Some(labels.clone()))
}

/// Joins each of `patches` to the neighbour with the longest common seam, then refines and smooths again.
/// `None` if too few pieces would be left to lock, or if nothing is joined.
///
/// The feedback loop uses this if dividing did not help. Patches may be renumbered.
pub fn unite(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    patches: &[PatchId],
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    let graph = surface.contact_graph(0.0);
    let mut number: Vec<u32> = (0..surface.n_patches as u32).collect();
    for &patch in patches {
        let touching = graph.contacts().iter().filter(|c| c.a == patch || c.b == patch);
        let Some(longest) = touching.max_by(|c, d| c.total_mm.total_cmp(&d.total_mm)) else {
            return Ok(None);
        };
        let into = number[usize::from(if longest.a == patch { longest.b } else { longest.a })];
        let own = number[usize::from(patch)];
        number.iter_mut().filter(|k| **k == own).for_each(|k| *k = into);
    }
    try_change(ctx, params, surface, |solid, labels| {
        let label: Vec<u32> = labels.as_slice().iter().map(|&k| number[k as usize]).collect();
        let joined = FaceLabels::from_components(&Topology::new(solid), &label);
        accept_join(joined, surface)
    })
}

/// Joins two pieces that touch, then refines and smooths again. `None` if too few pieces would be left to
/// lock.
pub fn unite_two(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    [a, b]: [PatchId; 2],
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    try_change(ctx, params, surface, |solid, labels| {
        let label: Vec<u32> = labels
            .as_slice()
            .iter()
            .map(|&k| if k == b.0 { a.0 } else { k })
            .collect();
        let joined = FaceLabels::from_components(&Topology::new(solid), &label);
        accept_join(joined, surface)
    })
}

/// Returns `joined` if it has fewer patches than `surface` and still at least three: of two pieces, each can
/// leave the other.
fn accept_join(joined: FaceLabels, surface: &SegmentedSurface) -> Option<FaceLabels> {
    const FEWEST: usize = 3;
    (FEWEST..surface.n_patches)
        .contains(&joined.n_patches())
        .then_some(joined)
}

/// Changes the labels of `surface`, then refines and smooths again. `None` if nothing is changed, or if a
/// patch would vanish.
pub(super) fn try_change(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    change: impl Fn(&Solid, &FaceLabels) -> Option<FaceLabels>,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    let limited = SegmentationParams {
        min_contact_mm: kept_limit_mm(params, surface),
        ..params.clone()
    };
    let Ok(solid) = Solid::new(surface.mesh.clone()) else {
        return Ok(None);
    };
    let label: Vec<u32> = surface.patch_of_face.iter().map(|p| p.0).collect();
    let labels = FaceLabels::from_components(&Topology::new(&solid), &label);
    let Some(changed) = change(&solid, &labels) else {
        return Ok(None);
    };
    let ground = Ground::with_regions(params, &solid, &surface.source_face);
    let refined = refine_on(ctx, &limited, &ground, &changed)?;
    let mut next = match smooth_and_cut(ctx, params, &solid, &refined) {
        // Another choice of pieces may succeed.
        Err(SegmentationError::PatchVanished { .. }) => return Ok(None),
        made => made?,
    };
    next.source_face
        .iter_mut()
        .for_each(|f| *f = surface.source_face[*f as usize]);
    Ok(Some(next))
}
