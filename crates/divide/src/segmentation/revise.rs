//! Changes of a division after its plans or kits failed.

use shellock_report::{Ctx, PatchId};
use shellock_surface::SegmentedSurface;

use super::{SegmentationError, SegmentationParams, divide, has_short_contacts, unite};

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
