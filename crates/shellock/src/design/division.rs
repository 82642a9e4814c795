//! One division of the surface into pieces, and the changes of it if no plan succeeds.

use super::failure::Failure;
use super::{DesignError, Settings};
use crate::piece::Grip;
use crate::segmentation::{Plane, Twins};
use crate::sizes::ChosenSizes;
use crate::{Ctx, PatchId, SegmentedSurface, Warning, segmentation};

/// Pieces, and the stages' settings for them.
pub(super) struct Division {
    pub surface: SegmentedSurface,
    pub settings: Settings,
    pub sizes: ChosenSizes,
    /// Notch of the key.
    pub grip: Option<Grip>,
    /// Plane about which both sides are divided alike.
    pub mirror: Option<Plane>,
    /// Warnings of pieces that were joined for the sake of use.
    pub changes: Vec<Warning>,
}

impl Division {
    /// Pieces that change together, since both sides are divided alike.
    pub fn twins(&self) -> Twins {
        let of = |plane: &Plane| Twins::new(plane, &self.surface);
        self.mirror.as_ref().map_or_else(Twins::default, of)
    }

    /// Warns of connectors and pieces that are not as the user wished.
    pub fn warn(&self, ctx: &Ctx<'_>) {
        self.sizes.tell(ctx);
        for warning in &self.changes {
            ctx.warn(warning.clone());
        }
    }
}

/// Changes the pieces after a failure; `None` if nothing can be changed. If it `is_hopeless`, the piece that
/// blocked every plan is joined to a neighbour.
pub(super) fn revise(
    ctx: &Ctx,
    division: &Division,
    failure: &Failure,
    is_hopeless: bool,
) -> Result<Option<SegmentedSurface>, DesignError> {
    let (params, surface) = (&division.settings.segmentation, &division.surface);
    let ctx = &ctx.fork();
    Ok(if is_hopeless {
        segmentation::join_first(ctx, params, surface, &failure.suspects, &division.twins())?
    } else {
        segmentation::revise(
            ctx,
            params,
            surface,
            &failure.suspects,
            &failure.loose,
            &division.twins(),
        )?
    })
}

/// Joins pieces to neighbours; `None` if that leaves nothing to lock.
pub(super) fn join(
    ctx: &Ctx,
    division: &Division,
    pieces: &[PatchId],
) -> Result<Option<SegmentedSurface>, DesignError> {
    let (params, surface) = (&division.settings.segmentation, &division.surface);
    Ok(segmentation::join(
        ctx,
        params,
        surface,
        pieces,
        &division.twins(),
    )?)
}
