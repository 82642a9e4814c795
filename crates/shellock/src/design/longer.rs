//! Longer seams for pieces that rattle, that part under a load, or that have no room for connectors.

use super::DesignError;
use super::agenda::{Allowance, Step};
use super::division::Division;
use super::trial::Change;
use crate::motion::RelativePlay;
use crate::segmentation::{Wish, lengthen};
use crate::{Ctx, PatchId};

/// Play that is aimed at, as a share of the allowed play. It surely passes. With 0.7 divisions were farther
/// from those of people, and a teddy and a hand were no firmer.
const AIM: f64 = 0.85;
/// Growth wanted of seams that are too short for connectors.
const FOR_CONNECTORS: f64 = 2.0;

/// Offers longer seams for pieces that rattle.
pub(super) fn for_play(
    ctx: &Ctx,
    division: &Division,
    rattling: &[RelativePlay],
    allowance: &Allowance,
) -> Result<Option<Change>, DesignError> {
    // Play falls about as seams grow.
    let wish = |play: &RelativePlay| Wish {
        piece: play.piece,
        growth: play.excess / AIM,
    };
    offer(ctx, division, rattling.iter().map(wish).collect(), allowance)
}

/// Offers longer seams for pieces that no connector joins to most others.
pub(super) fn for_connectors(
    ctx: &Ctx,
    division: &Division,
    apart: &[PatchId],
    allowance: &Allowance,
) -> Result<Option<Change>, DesignError> {
    let wish = |&piece: &PatchId| Wish {
        piece,
        growth: FOR_CONNECTORS,
    };
    offer(ctx, division, apart.iter().map(wish).collect(), allowance)
}

/// Offers a longer seam between two pieces that part under `factor` times a load, where `asked` times it is
/// asked. The border of the smaller one moves.
pub(super) fn for_load(
    ctx: &Ctx,
    division: &Division,
    between: [PatchId; 2],
    (factor, asked): (f64, f64),
    allowance: &Allowance,
) -> Result<Option<Change>, DesignError> {
    let surface = &division.surface;
    let area_mm2 = |piece: PatchId| -> f64 {
        let own = (surface.patch_of_face.iter().enumerate()).filter(|(_, p)| **p == piece);
        own.map(|(f, _)| surface.mesh.face_area(f)).sum()
    };
    let [a, b] = between;
    let piece = if area_mm2(a) <= area_mm2(b) { a } else { b };
    let growth = (asked / factor).min(FOR_CONNECTORS);
    offer(ctx, division, vec![Wish { piece, growth }], allowance)
}

/// Offers longer seams; `None` if that is not allowed, or if no border within reach is longer.
fn offer(
    ctx: &Ctx,
    division: &Division,
    mut wishes: Vec<Wish>,
    allowance: &Allowance,
) -> Result<Option<Change>, DesignError> {
    let settings = &division.settings;
    // A key that is cut stays where it is.
    let key = settings.cut_key();
    wishes.retain(|wish| Some(wish.piece) != key);
    if wishes.is_empty() || !allowance.is_allowed(Step::Lengthen) {
        return Ok(None);
    }
    // Both sides change alike.
    let twins = division.twins();
    for wish in wishes.clone() {
        let twin = twins.of(wish.piece).filter(|twin| Some(*twin) != key);
        if let Some(piece) = twin.filter(|twin| wishes.iter().all(|other| other.piece != *twin)) {
            wishes.push(Wish { piece, ..wish });
        }
    }
    let longer = lengthen(
        &ctx.fork(),
        &settings.segmentation,
        &division.surface,
        &wishes,
        key,
    )?;
    Ok(longer.map(|surface| Change::Divide(Step::Lengthen, surface, None)))
}
