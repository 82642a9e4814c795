//! Narrow places of patches: necks between two seams or between a seam and the key, and tips between two
//! seams that meet at a sharp angle.

mod neck;
mod tip;
mod web;

pub use neck::Neck;
pub use tip::{TIP_DEG, Tip};

use crate::SegmentedSurface;
use web::Web;

/// Longest edge on which distances are measured, as a share of the width sought. Along edges, distances are
/// at most a few per cent too long.
const EDGE_SHARE: f64 = 0.25;

/// Finds the places of patches that are narrower than `width_mm`: necks between two parts that are wider,
/// narrowest first, and tips, longest first.
///
/// O(n log n) in the surface's points after subdivision, for each place. Empty if the surface is not closed.
pub fn narrow_places(surface: &SegmentedSurface, width_mm: f64) -> (Vec<Neck>, Vec<Tip>) {
    let Some(web) = Web::of(surface, EDGE_SHARE * width_mm) else {
        return (Vec::new(), Vec::new());
    };
    let depth = web.distances(|v| web.is_border[v]);
    (
        neck::necks(&web, &depth, 0.5 * width_mm),
        tip::tips(&web, &depth, 0.5 * width_mm),
    )
}
