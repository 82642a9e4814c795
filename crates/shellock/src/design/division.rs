//! One way to divide the surface into pieces, and what is changed where no plan of it will do.

use shellock_geom::Solid;

use super::attempt::Failure;
use super::budget::Budget;
use super::{DesignError, Settings};
use crate::body::{BodyParams, GridError, ShellGrid};
use crate::piece::Grip;
use crate::segmentation::{self, SegmentationError, SegmentationParams};
use crate::sizes::ChosenSizes;
use crate::{Ctx, PatchId, SegmentedSurface, Warning};

/// Pieces, and what stages are given for them.
pub(super) struct Division {
    pub surface: SegmentedSurface,
    pub settings: Settings,
    pub chosen: ChosenSizes,
    /// The notch that the key is to have.
    pub grip: Option<Grip>,
    /// What was changed for the sake of use.
    pub told: Vec<Warning>,
}

impl Division {
    /// Warns of what is not as it was wished.
    pub fn tell(&self, ctx: &Ctx<'_>) {
        self.chosen.tell(ctx);
        self.told.iter().for_each(|w| ctx.warn(w.clone()));
    }
}

/// The grid of a model's wall, made when it is first asked for.
pub(super) struct WallGrid<'a> {
    params: &'a BodyParams,
    pub model: &'a Solid,
    /// Room for connectors below the wall.
    room_mm: f64,
    made: Option<ShellGrid>,
}

impl<'a> WallGrid<'a> {
    pub fn new(params: &'a BodyParams, model: &'a Solid) -> Self {
        Self {
            params,
            model,
            room_mm: 0.0,
            made: None,
        }
    }

    /// Makes sure that there will be so much room.
    pub fn make_room(&mut self, room_mm: f64) {
        if room_mm > self.room_mm {
            (self.room_mm, self.made) = (room_mm, None);
        }
    }

    pub fn get(&mut self) -> Result<&ShellGrid, GridError> {
        if self.made.is_none() {
            self.made = Some(ShellGrid::new(self.params, self.model, self.room_mm)?);
        }
        Ok(self.made.as_ref().expect("it was made just now"))
    }
}

/// Other pieces for those whose kits failed; `None` where the budget is used up or nothing can be changed.
///
/// Pieces that only rattle are joined to neighbours. Else dividing comes first, as it keeps the user's
/// labels. What came loose where seams are short would only get shorter ones: it is joined to a neighbour; so
/// is what stood in the way of every plan until half of the revisions were gone.
pub(super) fn revised(
    ctx: &Ctx,
    division: &Division,
    failure: &Failure,
    has_kit: bool,
    budget: &mut Budget,
) -> Result<Option<SegmentedSurface>, DesignError> {
    let Division {
        surface, settings, ..
    } = division;
    let params = &settings.segmentation;
    let ctx = &ctx.fork();
    let is_hopeless = !has_kit && budget.is_half_gone();
    if !budget.may_revise(failure.rattles()) {
        return Ok(None);
    }
    budget.revise(failure.rattles());
    Ok(if failure.rattles() {
        joined(ctx, params, surface, &failure.rattling)?
    } else if is_hopeless {
        first(&failure.blamed, |p| {
            segmentation::unite(ctx, params, surface, &[p])
        })?
    } else {
        divided(ctx, params, surface, failure)?
    })
}

/// The surface with a piece divided, or what came loose joined where seams are short.
fn divided(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    failure: &Failure,
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    if !failure.loose.is_empty() && segmentation::has_short_contacts(params, surface) {
        let joined = joined(ctx, params, surface, &failure.loose)?;
        if joined.is_some() {
            return Ok(joined);
        }
    }
    first(&failure.blamed, |p| segmentation::divide(ctx, params, surface, p))
}

/// The surface with the first of `pieces` joined to neighbours; `None` where that leaves nothing to lock.
pub(super) fn joined(
    ctx: &Ctx,
    params: &SegmentationParams,
    surface: &SegmentedSurface,
    pieces: &[PatchId],
) -> Result<Option<SegmentedSurface>, SegmentationError> {
    /// Pieces joined at once; more would change what holds.
    const MOST_JOINED: usize = 2;
    let first = &pieces[..pieces.len().min(MOST_JOINED)];
    if first.is_empty() {
        Ok(None)
    } else {
        segmentation::unite(ctx, params, surface, first)
    }
}

/// The first change of a piece that can be made.
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
