//! Checks the least gaps of a claim against the surfaces at the stated places.
//!
//! The place is midway, so both surfaces are half the gap away. Where they cross, other parts of them may be
//! nearer, but not farther than half the depth. This does not test that no gap is smaller elsewhere; rays
//! look for obstacles.

use crate::mesh::Mesh;
use crate::number;
use crate::vector::{Vec3, scale, sub};
use crate::{Gap, LeastGaps, PressFit, Tested};

/// Greatest difference between the stated gap and the one found, mm.
const SAME_GAP_MM: f64 = 1e-3;
/// Greatest amount by which the rim may be nearer than gaps beneath it at their places, mm; these gaps leave
/// the rim out. 0.006 on a torus.
const RIM_NEARER_MM: f64 = 0.02;
/// Greatest depth of a crossing that counts as rounding, mm.
const CROSSING_MM: f64 = 0.02;
/// Greatest depth of a crossing at a press fit beyond its interference, mm.
const FIT_DEEPER_MM: f64 = 0.1;

/// Confirms `figure`, with the gap beneath the rim, if the least gaps are those stated in `least`.
///
/// The gaps are those between the moving piece and one of the `others`, or between any two of `others`.
/// Surfaces may cross only where the key is pressed on purpose. An error if no gap is stated.
pub fn test(
    meshes: &[Mesh],
    press_fits: &[PressFit],
    moving: Option<(usize, Vec3)>,
    others: &[usize],
    least: &LeastGaps,
    figure: String,
) -> Tested {
    for gap in [&least.overall, &least.beneath_rim].into_iter().flatten() {
        if gap.gap_mm < -CROSSING_MM && !press_fits.iter().any(|fit| is_of(fit, gap, moving)) {
            return Err(format!(
                "surfaces cross by {:.3} mm, piece {} one of them",
                -gap.gap_mm,
                number::of(gap.against)
            ));
        }
    }
    let Some(gap) = &least.overall else {
        return Err("no least gap is told".into());
    };
    test_place(meshes, moving, others, gap, SAME_GAP_MM)?;
    let Some(gap) = &least.beneath_rim else {
        return Ok(figure);
    };
    test_place(meshes, moving, others, gap, RIM_NEARER_MM)?;
    let least = match gap.gap_mm {
        depth if depth < 0.0 => format!("where it presses on purpose, by {:.3} mm", -depth),
        gap_mm => format!("least gap {gap_mm:.3} mm beneath the rim"),
    };
    Ok(format!("{figure}; {least}"))
}

/// Returns true if the crossing belongs to a press fit, on the piece at rest or on the moving one.
fn is_of(fit: &PressFit, gap: &Gap, moving: Option<(usize, Vec3)>) -> bool {
    let before = moving.map(|(_, direction)| sub(gap.at, scale(direction, gap.travel_mm)));
    let is_near = |p: Vec3| fit.is_near(p);
    let is_one = moving.is_none_or(|(piece, _)| piece == fit.piece || gap.against == fit.piece);
    is_one
        && (is_near(gap.at) || before.is_some_and(is_near))
        && -gap.gap_mm <= fit.interference_mm + FIT_DEEPER_MM
}

/// Returns true if the overlap of pieces `a` and `b` around `at` belongs to a press fit: it is near the fit's
/// place, and not too deep in either piece.
pub fn is_pressed(meshes: &[Mesh], press_fits: &[PressFit], [a, b]: [usize; 2], at: Vec3) -> bool {
    press_fits
        .iter()
        .filter(|fit| (fit.piece == a || fit.piece == b) && fit.is_near(at))
        .any(|fit| {
            let most_mm = fit.interference_mm + FIT_DEEPER_MM;
            [a, b].iter().all(|&piece| {
                meshes[piece]
                    .distance_mm(at, most_mm)
                    .is_some_and(|mm| mm <= most_mm)
            })
        })
}

/// Checks one gap at its place. Surfaces may be nearer than the gap by `nearer_mm`.
fn test_place(
    meshes: &[Mesh],
    moving: Option<(usize, Vec3)>,
    others: &[usize],
    gap: &Gap,
    nearer_mm: f64,
) -> Result<(), String> {
    let Gap {
        gap_mm,
        travel_mm,
        at,
        against,
    } = gap;
    if !others.contains(against) || *travel_mm < 0.0 {
        return Err(format!(
            "a least gap against piece {}, which is not in the way",
            number::of(*against)
        ));
    }
    let reach_mm = 0.5 * gap_mm.abs() + SAME_GAP_MM;
    let to_other = meshes[*against].distance_mm(*at, reach_mm);
    let to_moving = match moving {
        Some((piece, direction)) => {
            meshes[piece].distance_mm(sub(*at, scale(direction, *travel_mm)), reach_mm)
        }
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
        Some(found_mm) => Err(format!(
            "a gap of {gap_mm:.3} mm is told where it is {found_mm:.3} mm"
        )),
        None => Err(format!(
            "a gap of {gap_mm:.3} mm is told where surfaces are farther apart"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crossing_is_meant_only_at_a_press_fit_and_no_deeper_than_that() {
        let fit = PressFit {
            piece: 1,
            at: [1.0, 0.0, 0.0],
            interference_mm: 0.1,
        };
        let gap = |gap_mm, travel_mm, x| Gap {
            gap_mm,
            travel_mm,
            at: [x, 0.0, 0.0],
            against: 0,
        };
        let moving = Some((1, [1.0, 0.0, 0.0]));
        assert!(is_of(&fit, &gap(-0.15, 0.0, 2.0), moving));
        assert!(
            is_of(&fit, &gap(-0.15, 20.0, 21.0), moving),
            "the fit moves with its piece"
        );
        assert!(!is_of(&fit, &gap(-0.15, 20.0, 30.0), moving), "elsewhere");
        assert!(!is_of(&fit, &gap(-0.25, 0.0, 2.0), moving), "deeper");
        assert!(
            !is_of(&fit, &gap(-0.15, 0.0, 2.0), Some((2, [1.0, 0.0, 0.0]))),
            "another piece"
        );
    }
}
