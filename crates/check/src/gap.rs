//! Whether the least gaps that a claim tells are those of the surfaces at the places that it tells.
//!
//! At the place, which is midway, both surfaces are half the gap away; where they cross, other parts of them may be nearer,
//! but not farther than half the depth. That a gap is nowhere less is not tested here; rays look for what is in the way.

use crate::mesh::Mesh;
use crate::vector::{Vec3, scale, sub};
use crate::{Gap, LeastGaps, Tested};

/// Difference of the gap told and the one found, mm.
const SAME_GAP_MM: f64 = 1e-3;
/// By how much the rim, which gaps beneath it leave out, may be nearer than these at their places, mm. 0.006 on a torus.
const RIM_NEARER_MM: f64 = 0.02;

/// Confirms `figure`, with the gap beneath the rim, if the gaps are those that `least` tells: of the moving piece to one of
/// the `others`, or of any two of these.
pub fn test(
    meshes: &[Mesh],
    moving: Option<(usize, Vec3)>,
    others: &[usize],
    least: &LeastGaps,
    figure: String,
) -> Tested {
    if let Some(gap) = &least.overall {
        test_place(meshes, moving, others, gap, SAME_GAP_MM)?;
    }
    let Some(gap) = &least.beneath_rim else { return Ok(figure) };
    test_place(meshes, moving, others, gap, RIM_NEARER_MM)?;
    let least = match gap.gap_mm {
        depth if depth < 0.0 => format!("surfaces cross by {:.3} mm beneath the rim", -depth),
        gap_mm => format!("least gap {gap_mm:.3} mm beneath the rim"),
    };
    Ok(format!("{figure}; {least}"))
}

/// `nearer_mm`: how much nearer surfaces may be than the gap.
fn test_place(
    meshes: &[Mesh],
    moving: Option<(usize, Vec3)>,
    others: &[usize],
    gap: &Gap,
    nearer_mm: f64,
) -> Result<(), String> {
    let Gap { gap_mm, travel_mm, at, against } = gap;
    if !others.contains(against) || *travel_mm < 0.0 {
        return Err(format!("a least gap against piece {against}, which is not in the way"));
    }
    let reach_mm = 0.5 * gap_mm.abs() + SAME_GAP_MM;
    let to_other = meshes[*against].distance_mm(*at, reach_mm);
    let to_moving = match moving {
        Some((piece, direction)) => meshes[piece].distance_mm(sub(*at, scale(direction, *travel_mm)), reach_mm),
        None => others
            .iter()
            .filter(|id| *id != against)
            .filter_map(|&id| meshes[id].distance_mm(*at, reach_mm))
            .min_by(f64::total_cmp),
    };
    let found_mm = to_other.zip(to_moving).map(|(a, b)| a + b);
    let is_same = |found_mm: f64| found_mm <= gap_mm + SAME_GAP_MM && found_mm >= gap_mm - nearer_mm;
    let is_within = |found_mm: f64| found_mm <= SAME_GAP_MM - gap_mm;
    match found_mm {
        Some(found_mm) if is_same(found_mm) || is_within(found_mm) => Ok(()),
        Some(found_mm) => Err(format!("a gap of {gap_mm:.3} mm is told where it is {found_mm:.3} mm")),
        None => Err(format!("a gap of {gap_mm:.3} mm is told where surfaces are farther apart")),
    }
}
