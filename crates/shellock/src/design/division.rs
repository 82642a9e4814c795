//! One division of the surface into pieces, and the changes of it if no plan succeeds.

use shellock_geom::Solid;

use super::attempt::Failure;
use super::{DesignError, Settings};
use crate::body::{BodyParams, GridError, PatchDistances, ShellGrid};
use crate::piece::Grip;
use crate::segmentation::{self, SegmentationError, SegmentationParams};
use crate::sizes::ChosenSizes;
use crate::{Ctx, PatchId, SegmentedSurface, Warning};

/// Pieces, and the stages' settings for them.
pub(super) struct Division {
    pub surface: SegmentedSurface,
    pub settings: Settings,
    pub sizes: ChosenSizes,
    /// Notch of the key.
    pub grip: Option<Grip>,
    /// Warnings of pieces that were joined for the sake of use.
    pub changes: Vec<Warning>,
}

impl Division {
    /// Warns of connectors and pieces that are not as the user wished.
    pub fn warn(&self, ctx: &Ctx<'_>) {
        self.sizes.tell(ctx);
        for warning in &self.changes {
            ctx.warn(warning.clone());
        }
    }
}

/// Grid of a model's wall, and distances of its nodes to the pieces; made when first needed.
#[derive(Default)]
pub(super) struct WallGrid {
    /// Room for connectors below the wall, mm.
    room_mm: f64,
    grid: Option<ShellGrid>,
    distances: Option<PatchDistances>,
}

impl WallGrid {
    /// Forgets the distances to other pieces, and makes sure that there will be this much room.
    pub fn begin_division(&mut self, room_mm: f64) {
        self.distances = None;
        if room_mm > self.room_mm {
            (self.room_mm, self.grid) = (room_mm, None);
        }
    }

    /// Returns the grid and the distances, and makes those that are missing.
    pub fn measure(
        &mut self,
        params: &BodyParams,
        model: &Solid,
        surface: &SegmentedSurface,
    ) -> Result<(&ShellGrid, &PatchDistances), GridError> {
        let grid = match &mut self.grid {
            Some(grid) => grid,
            none => none.insert(ShellGrid::new(params, model, self.room_mm)?),
        };
        let distances = self
            .distances
            .get_or_insert_with(|| PatchDistances::measure(grid, surface));
        Ok((grid, distances))
    }
}

/// Changes the pieces after a failure; `None` if nothing can be changed.
///
/// Dividing comes first, since it keeps the user's labels. Pieces that came loose where seams are short would
/// only get shorter seams: they are joined to a neighbour. If `is_hopeless`, so is the piece that blocked
/// every plan.
pub(super) fn revise(
    ctx: &Ctx,
    division: &Division,
    failure: &Failure,
    is_hopeless: bool,
) -> Result<Option<SegmentedSurface>, DesignError> {
    let Division {
        surface, settings, ..
    } = division;
    let params = &settings.segmentation;
    let ctx = &ctx.fork();
    Ok(if is_hopeless {
        first(&failure.suspects, |p| {
            segmentation::unite(ctx, params, surface, &[p])
        })?
    } else {
        divide(ctx, params, surface, failure)?
    })
}

/// Divides a piece to blame, or joins a loose one if seams are short.
fn divide(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    failure: &Failure,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    if !failure.loose.is_empty() && segmentation::has_short_contacts(params, surface) {
        let joined = join(ctx, params, surface, &failure.loose)?;
        if joined.is_some() {
            return Ok(joined);
        }
    }
    first(&failure.suspects, |p| {
        segmentation::divide(ctx, params, surface, p)
    })
}

/// Joins the first of `pieces` to neighbours; `None` if that leaves nothing to lock.
pub(super) fn join(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    pieces: &[PatchId],
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    /// Pieces joined at once; more would change too much of the structure.
    const MOST_JOINED: usize = 2;
    let first = &pieces[..pieces.len().min(MOST_JOINED)];
    if first.is_empty() {
        Ok(None)
    } else {
        segmentation::unite(ctx, params, surface, first)
    }
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
