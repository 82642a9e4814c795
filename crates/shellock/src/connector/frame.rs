//! Curves along the seams on the inner surface, with a smooth frame at every point.

use shellock_geom::Vec3;

use crate::body::{ShellGrid, outward};
use crate::plan::LatticePlan;
use crate::{PatchId, Seam, SegmentedSurface};

/// Distance between the points of a curve, mm: half the finest connector, so that smoothing keeps the seam's
/// shape.
const STEP_MM: f64 = 1.0;
/// Rounds of averaging with the neighbours. They take out the grid's ripple (period one to two cells) and
/// little else.
const SMOOTHING_ROUNDS: usize = 6;

/// A seam on the inner surface between two pieces.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The piece installed later.
    pub later: PatchId,
    /// The piece installed earlier.
    pub earlier: PatchId,
    /// Points about 1 mm apart. A loop's last point is its first.
    pub points: Vec<Vec3>,
    /// Unit tangents `u`.
    pub tangents: Vec<Vec3>,
    /// Outward unit normals `N`, perpendicular to `u`.
    pub normals: Vec<Vec3>,
    /// `v = ± N × u`, pointing from the later piece to the earlier one.
    pub across: Vec<Vec3>,
    /// Whether the curve runs back into itself.
    pub is_loop: bool,
}

/// One curve for each seam of the inner surface that is long enough to have points of its own.
pub fn curves(grid: &ShellGrid, inner: &SegmentedSurface, plan: &LatticePlan) -> Vec<Curve> {
    inner
        .seams()
        .iter()
        .filter_map(|seam| curve(grid, seam, plan))
        .collect()
}

fn curve(grid: &ShellGrid, seam: &Seam, plan: &LatticePlan) -> Option<Curve> {
    if seam.length() < 4.0 * STEP_MM {
        return None;
    }
    let is_loop = seam.is_loop();
    let points = smoothed(resampled(&seam.points, STEP_MM), is_loop, SMOOTHING_ROUNDS);
    let tangents = tangents(&points, is_loop);
    let raw: Vec<Vec3> = points.iter().map(|&p| outward(grid, p)).collect();
    let normals: Vec<Vec3> = smoothed(raw, is_loop, SMOOTHING_ROUNDS)
        .into_iter()
        .zip(&tangents)
        .map(|(n, u)| (n - n.dot(*u) * *u).normalize_or_zero())
        .collect();
    if normals.contains(&Vec3::ZERO) {
        return None;
    }
    let a_is_later = plan.position(seam.a) > plan.position(seam.b);
    let (later, earlier) = if a_is_later {
        (seam.a, seam.b)
    } else {
        (seam.b, seam.a)
    };
    // N × u points to the left, where patch a lies.
    let side = if a_is_later { -1.0 } else { 1.0 };
    let across = normals
        .iter()
        .zip(&tangents)
        .map(|(n, u)| side * n.cross(*u))
        .collect();
    Some(Curve {
        later,
        earlier,
        points,
        tangents,
        normals,
        across,
        is_loop,
    })
}

/// The polyline again with points at equal distances of about `step_mm` along it, ends kept.
fn resampled(line: &[Vec3], step_mm: f64) -> Vec<Vec3> {
    let mut at = vec![0.0];
    for w in line.windows(2) {
        at.push(at[at.len() - 1] + w[0].distance(w[1]));
    }
    let length = at[at.len() - 1];
    let n = (length / step_mm).round().max(2.0) as usize;
    let mut segment = 0;
    (0..=n)
        .map(|i| {
            let s = length * i as f64 / n as f64;
            while segment + 2 < at.len() && at[segment + 1] < s {
                segment += 1;
            }
            let span = at[segment + 1] - at[segment];
            let t = if span > 0.0 {
                ((s - at[segment]) / span).clamp(0.0, 1.0)
            } else {
                0.0
            };
            line[segment].lerp(line[segment + 1], t)
        })
        .collect()
}

/// Repeated averaging ¼ ½ ¼ along a line; ends stay, a loop's first and last value stay equal.
pub(super) fn smoothed(mut values: Vec<Vec3>, is_loop: bool, rounds: usize) -> Vec<Vec3> {
    let n = values.len();
    for _ in 0..rounds {
        let old = values.clone();
        for i in 1..n - 1 {
            values[i] = 0.5 * old[i] + 0.25 * (old[i - 1] + old[i + 1]);
        }
        if is_loop {
            values[0] = 0.5 * old[0] + 0.25 * (old[n - 2] + old[1]);
            values[n - 1] = values[0];
        }
    }
    values
}

fn tangents(points: &[Vec3], is_loop: bool) -> Vec<Vec3> {
    let n = points.len();
    (0..n)
        .map(|i| {
            let before = if i > 0 {
                i - 1
            } else if is_loop {
                n - 2
            } else {
                0
            };
            let after = if i + 1 < n {
                i + 1
            } else if is_loop {
                1
            } else {
                n - 1
            };
            (points[after] - points[before]).normalize_or_zero()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resampling_keeps_ends_and_spacing() {
        let line = [Vec3::ZERO, Vec3::X, 1.3 * Vec3::X, Vec3::new(1.3, 5.0, 0.0)];
        let points = resampled(&line, 1.0);
        assert_eq!((points[0], points[points.len() - 1]), (line[0], line[3]));
        let arcs: Vec<f64> = points.windows(2).map(|w| w[0].distance(w[1])).collect();
        assert!(arcs.iter().all(|a| *a <= 6.3 / 6.0 + 1e-12 && *a > 0.6));
    }
}
