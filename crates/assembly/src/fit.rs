//! Fit of a finished kit once it is printed: tolerance to printing errors, and places that need care.

use shellock_report::Warning;

use crate::causes::Cause;
use crate::play::{self, KitPlay};
use crate::verify::clearance::KitGaps;
use crate::verify::{Assembly, Play, ThinFeature, ThinKind};
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Effect of printing errors on a kit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrintedFit {
    /// Largest distance by which every printed face may lie too far outwards, mm. Half of the least gap
    /// between two pieces, at rest and on any way out; gaps of a key with ribs or bumps, which press on
    /// purpose, do not count. ≤ 0 if surfaces cross; `None` if no two pieces come near each other.
    pub within_mm: Option<f64>,
    /// Piece with the most play, for small motions, if every face lies `within_mm` too far inwards, and that
    /// play; endless if the piece comes loose. `None` if the kit fails, or if `within_mm` is not positive.
    pub loosest: Option<(PatchId, Play)>,
}

impl PrintedFit {
    /// Computes the effect of printing errors on pieces with these gaps and this play. Play of printed pieces
    /// is measured only for a kit that `has_passed` its verification.
    pub fn of(
        ctx: &Ctx,
        assembly: &Assembly<'_>,
        gaps: &KitGaps,
        play: &KitPlay,
        has_passed: bool,
    ) -> Result<Self, Cancelled> {
        let within_mm = fits_within_mm(assembly, gaps);
        let tried_mm = within_mm.filter(|mm| *mm > 0.0 && has_passed);
        let loosest = tried_mm.map(|mm| {
            let plays = play::printed_thin(ctx, assembly.pieces, play, mm)?;
            let plays = plays
                .iter()
                .map(|(piece, play)| (piece, play.unwrap_or(Play::ENDLESS)));
            Ok(plays.max_by(|a, b| a.1.translation_mm.total_cmp(&b.1.translation_mm)))
        });
        Ok(Self {
            within_mm,
            loosest: loosest.transpose()?.flatten(),
        })
    }
}

/// Returns half of the least gap between pieces that do not press on purpose, mm.
fn fits_within_mm(assembly: &Assembly<'_>, gaps: &KitGaps) -> Option<f64> {
    let (key, presses) = (assembly.plan.key(), !assembly.press_fits.is_empty());
    let is_pressed = |a: PatchId, b: PatchId| presses && (a == key || b == key);
    let at_rest = gaps
        .pairs
        .iter()
        .filter(|p| !is_pressed(p.a, p.b))
        .map(|p| p.overall.gap_mm);
    let on_ways = gaps
        .paths
        .iter()
        .filter(|p| !is_pressed(p.piece, p.against))
        .map(|p| p.overall.gap_mm);
    at_rest
        .chain(on_ways)
        .min_by(f64::total_cmp)
        .map(|gap_mm| 0.5 * gap_mm)
}

/// Warns of the deepest crossing of finished pieces, on a way out or at rest, unless it is a key
/// with press fits that crosses.
pub fn crossing_warning(assembly: &Assembly<'_>, gaps: &KitGaps) -> Option<Warning> {
    /// Least depth that is not rounding, mm.
    const LEAST_MM: f64 = 0.02;
    let deepest = gaps
        .paths
        .iter()
        .min_by(|a, b| a.overall.gap_mm.total_cmp(&b.overall.gap_mm))?;
    let place = deepest.overall;
    let is_meant = deepest.piece == assembly.plan.key() && !assembly.press_fits.is_empty();
    (place.gap_mm < -LEAST_MM && !is_meant).then(|| {
        Warning::new(
            Cause::SurfacesCross {
                by_mm: -place.gap_mm,
                after_mm: place.travel_mm,
            },
            vec![deepest.piece, deepest.against],
            Some(place.at),
        )
    })
}

/// Warns of pieces with sheets that may break off or slots that may fuse.
pub fn thin_warning(thin: &IdVec<PatchId, Vec<ThinFeature>>) -> Option<Warning> {
    let all = || thin.as_slice().iter().flatten();
    let longest = all().max_by(|a, b| a.length_mm.total_cmp(&b.length_mm))?;
    let n_sheets = all().filter(|place| place.kind == ThinKind::Sheet).count();
    Some(Warning::new(
        Cause::ThinPlaces {
            n_sheets,
            n_slots: all().count() - n_sheets,
            longest_mm: longest.length_mm,
            thickness_mm: longest.thickness_mm,
            is_slot: longest.kind == ThinKind::Slot,
        },
        thin.iter()
            .filter(|(_, places)| !places.is_empty())
            .map(|(p, _)| p)
            .collect(),
        Some(longest.at),
    ))
}
