//! Sheets along which the wall is cut: through each seam and straight inwards, or leaning as far as the
//! leaving piece needs.
//!
//! ```text
//!            B ↑ into the piece that leaves
//!    outside ──●── γ, a point of the seam
//!              │ ╲
//!              │  ╲ leaning by α, where s would not lead away
//!       inside │   ╲
//! ```
//!
//! Every sample of a seam has a plane through its tangent. Near a seam the field of a cut is the mean
//! distance to the planes of the samples around,
//!
//! ```text
//! φ(x) = Σ w_k B_k · (x − γ_k) / Σ w_k,   w_k = (1 − r_k²/R²)² / (r_k² + ε²)²
//! ```
//!
//! with r_k the distance of x from the line through γ_k along the surface normal: implicit moving least
//! squares [Kolluri 2005]. The field has slope 1 and is as smooth as the seam. (The distance of γ_k from the
//! point of the surface nearest to x jumps below every convex edge of the model. The difference of distances
//! to the two patches has no slope where the surface is flat, and vanishes in the whole wedge below a concave
//! edge.)
//!
//! The samples lie on a smoothed seam: the seam itself turns at every triangle of the model.

use rayon::prelude::*;
use shellock_assembly::LatticeDirection;
use shellock_geom::Vec3;
use shellock_report::PatchId;
use shellock_surface::SegmentedSurface;

use super::ShellGrid;

/// Distance between samples along a seam, mm: a seam with a radius of 3 mm is followed within 4 µm.
const STEP_MM: f64 = 0.3;
/// Rounds of averaging the points of a seam with their neighbours. They amount to a Gaussian of 0.95 mm (one
/// sigma): a seam of 3 mm radius moves by 0.15 mm.
const LINE_ROUNDS: usize = 20;
/// Rounds of averaging normals and tangents. They amount to a Gaussian of 1.65 mm, so that bumps smaller than
/// the wall thickness do not bend a sheet. With 20 rounds relief cuts a third more.
const FRAME_ROUNDS: usize = 60;
/// Softening length ε, mm: the step between samples. A field that followed each of them would be finer than
/// the grid.
const SOFT_MM: f64 = STEP_MM;
/// Reach R of the weights, in cells: as far as fields are kept.
const REACH_CELLS: f64 = 3.5;
/// Share of R from which on the sheet blends into the distances to the patches. Chosen by eye.
const SURE: f64 = 0.6;
/// Least angle between a sheet and the way out, rad: more than the draft of the sweeps, which would shave the
/// sheet otherwise.
const DRAFT: f64 = 0.1;
/// Greatest lean of a sheet, rad; beyond it edges become feather-thin.
const MOST_LEAN: f64 = 1.0;
/// Sine of the angle between the way out and the seam up to which a sheet need not lean, and that from which
/// on it must lean in full.
const ALONG: [f64; 2] = [0.1, 0.3];

/// A point of a seam with the frame of its sheet.
#[derive(Clone, Copy, Debug)]
struct Sample {
    point: Vec3,
    tangent: Vec3,
    /// Outward surface normal, perpendicular to the tangent.
    normal: Vec3,
    /// The patches to the left and to the right of the tangent, as seen from outside.
    sides: [PatchId; 2],
}

/// The plane of a sample's sheet.
#[derive(Clone, Copy)]
struct Plane {
    point: Vec3,
    /// Outward normal of the model's surface at the point.
    axis: Vec3,
    /// Normal of the sheet.
    normal: Vec3,
}

/// All seams of a surface, sampled.
pub(super) struct Sheets {
    samples: Vec<Sample>,
    /// Nodes near seams, each with its nearest point of the surface, mm.
    feet: Vec<(u32, Vec3)>,
    reach_mm: f64,
}

impl Sheets {
    /// Samples the seams of `surface`; `foot` gives the nearest point of the surface for each of `nodes`.
    pub fn new(
        grid: &ShellGrid,
        surface: &SegmentedSurface,
        nodes: &[u32],
        foot: impl Fn(Vec3) -> Option<Vec3> + Sync,
    ) -> Self {
        let samples: Vec<Sample> = surface.seams().iter().flat_map(sample_seam).collect();
        let reach_mm = REACH_CELLS * grid.band.cell_mm();
        let near = Buckets::new(&samples, reach_mm);
        let feet = nodes
            .par_iter()
            .filter_map(|&n| {
                let foot = foot(grid.band.position(n as usize))?;
                let is_near = |s: &Sample| s.point.distance_squared(foot) < reach_mm * reach_mm;
                near.around(foot)
                    .any(|k| is_near(&samples[k as usize]))
                    .then_some((n, foot))
            })
            .collect();
        Self {
            samples,
            feet,
            reach_mm,
        }
    }

    /// Replaces `preference`, positive on the side of `p`, near the seams that `p` shares with remaining
    /// patches.
    pub fn shape(
        &self,
        grid: &ShellGrid,
        p: PatchId,
        remains: &[bool],
        separation: LatticeDirection,
        preference: &mut [f32],
    ) {
        let s = separation.unit();
        let planes: Vec<Plane> = self
            .samples
            .iter()
            .filter_map(|sample| {
                let towards = match sample.sides {
                    [left, other] if left == p && remains[usize::from(other)] => 1.0,
                    [other, right] if right == p && remains[usize::from(other)] => -1.0,
                    _ => return None,
                };
                Some(Plane {
                    point: sample.point,
                    axis: sample.normal,
                    normal: sample.sheet_normal(towards, s),
                })
            })
            .collect();
        let near = Buckets::over(planes.iter().map(|p| p.point), self.reach_mm);
        let shaped: Vec<Option<f32>> = self
            .feet
            .par_iter()
            .map(|&(n, foot)| {
                let x = grid.band.position(n as usize);
                let planes = near.around(foot).map(|k| planes[k as usize]);
                let (value, nearest_mm) = mean_distance(planes, x, self.reach_mm)?;
                let far = ((nearest_mm / self.reach_mm - SURE) / (1.0 - SURE)).clamp(0.0, 1.0);
                let otherwise = f64::from(preference[n as usize]);
                let otherwise = otherwise.signum() * nearest_mm.max(otherwise.abs());
                Some((value * (1.0 - far) + otherwise * far) as f32)
            })
            .collect();
        let cutoff = grid.cutoff_mm();
        for ((n, _), value) in self.feet.iter().zip(shaped) {
            if let Some(value) = value {
                preference[*n as usize] = value.clamp(-cutoff, cutoff);
            }
        }
    }
}

/// Value of φ at `x`, and the least distance r_k, mm; `None` where no sample is within reach.
fn mean_distance(planes: impl Iterator<Item = Plane>, x: Vec3, reach_mm: f64) -> Option<(f64, f64)> {
    let (mut sum, mut weights, mut nearest_sq) = (0.0, 0.0, f64::INFINITY);
    for Plane { point, axis, normal } in planes {
        let off = x - point;
        let r_sq = off.reject_from_normalized(axis).length_squared();
        let inside = 1.0 - r_sq / (reach_mm * reach_mm);
        if inside > 0.0 {
            let w = inside * inside / (r_sq + SOFT_MM * SOFT_MM).powi(2);
            sum += w * normal.dot(off);
            weights += w;
            nearest_sq = nearest_sq.min(r_sq);
        }
    }
    (weights > 0.0).then(|| (sum / weights, nearest_sq.sqrt()))
}

impl Sample {
    /// Unit normal of the sample's sheet, into the patch to the left (`towards` 1) or to the right (−1). The
    /// sheet leans so that a piece that leaves along `s` does not rub.
    fn sheet_normal(&self, towards: f64, s: Vec3) -> Vec3 {
        let b = towards * self.normal.cross(self.tangent).normalize_or_zero();
        let across = s - s.dot(self.tangent) * self.tangent;
        let must = ((across.length() - ALONG[0]) / (ALONG[1] - ALONG[0])).clamp(0.0, 1.0);
        let angle = across.dot(self.normal).atan2(across.dot(b));
        let free = std::f64::consts::FRAC_PI_2 - DRAFT;
        let lean = if angle > free {
            angle - free
        } else if angle < -free {
            angle + free
        } else {
            0.0
        };
        let lean = must * lean.clamp(-MOST_LEAN, MOST_LEAN);
        lean.cos() * b + lean.sin() * self.normal
    }
}

/// Samples a seam, with smoothed frames.
fn sample_seam(seam: &shellock_surface::Seam) -> Vec<Sample> {
    let n = (seam.length() / STEP_MM).ceil().max(1.0) as usize;
    let stations = seam.resample(n);
    let is_loop = seam.is_loop();
    let n_stations = stations.len();
    let smoothed = |values: Vec<Vec3>| smooth(values, FRAME_ROUNDS, is_loop, 0);
    let normals = smoothed(stations.iter().map(|s| s.1.normalize_or_zero()).collect());
    // The ends, where other seams meet this one, stay.
    let fixed = usize::from(!is_loop);
    let points = smooth(
        stations.iter().map(|s| s.0).collect(),
        LINE_ROUNDS,
        is_loop,
        fixed,
    );
    let chords = (0..n_stations).map(|i| {
        let (before, after) = neighbours(i, n_stations, is_loop);
        (points[after] - points[before]).normalize_or_zero()
    });
    let tangents = smoothed(chords.collect());
    (0..n_stations)
        .map(|i| {
            let tangent = tangents[i].normalize_or_zero();
            Sample {
                point: points[i],
                tangent,
                normal: (normals[i] - normals[i].dot(tangent) * tangent).normalize_or_zero(),
                sides: [seam.a, seam.b],
            }
        })
        .collect()
}

/// Averages all values along a seam with those before and after them, `rounds` times, except the first and
/// the last `n_fixed`.
fn smooth(mut values: Vec<Vec3>, rounds: usize, is_loop: bool, n_fixed: usize) -> Vec<Vec3> {
    let n = values.len();
    for _ in 0..rounds {
        let old = values.clone();
        for i in n_fixed..n.saturating_sub(n_fixed) {
            let (before, after) = neighbours(i, n, is_loop);
            values[i] = 0.5 * old[i] + 0.25 * (old[before] + old[after]);
        }
    }
    values
}

/// Stations before and after station `i` of `n`; the first and the last of a loop are the same place.
fn neighbours(i: usize, n: usize, is_loop: bool) -> (usize, usize) {
    match (is_loop && n > 2, i) {
        (true, 0) => (n - 2, 1),
        (true, i) if i + 1 == n => (n - 2, 1),
        _ => (i.saturating_sub(1), (i + 1).min(n - 1)),
    }
}

/// Points sorted into cubes whose edge is the search radius.
struct Buckets {
    edge_mm: f64,
    /// Cubes with the indices of their points, sorted.
    of: Vec<([i32; 3], u32)>,
}

impl Buckets {
    fn new(samples: &[Sample], edge_mm: f64) -> Self {
        Self::over(samples.iter().map(|s| s.point), edge_mm)
    }

    fn over(points: impl Iterator<Item = Vec3>, edge_mm: f64) -> Self {
        let mut of: Vec<([i32; 3], u32)> = points
            .enumerate()
            .map(|(k, p)| (Self::cube(p, edge_mm), k as u32))
            .collect();
        of.sort_unstable();
        Self { edge_mm, of }
    }

    fn cube(p: Vec3, edge_mm: f64) -> [i32; 3] {
        (p / edge_mm).floor().to_array().map(|x| x as i32)
    }

    /// Points of the 27 cubes around `q`, always in the same order.
    fn around(&self, q: Vec3) -> impl Iterator<Item = u32> + '_ {
        let [i, j, k] = Self::cube(q, self.edge_mm);
        (0..9).flat_map(move |at| {
            let (x, y) = (i + at / 3 - 1, j + at % 3 - 1);
            // Cubes that differ only in z are adjacent in the sorted list.
            let from = self.of.partition_point(|e| e.0 < [x, y, k - 1]);
            self.of[from..]
                .iter()
                .take_while(move |e| e.0 <= [x, y, k + 1])
                .map(|e| e.1)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A seam along x on a surface that faces z; patch 0 is on its left, where y > 0.
    fn sample() -> Sample {
        Sample {
            point: Vec3::ZERO,
            tangent: Vec3::X,
            normal: Vec3::Z,
            sides: [PatchId(0), PatchId(1)],
        }
    }

    #[test]
    fn a_sheet_stands_straight_where_the_way_out_leads_away_and_leans_no_more_than_it_must_elsewhere() {
        let sample = sample();
        for degrees in (-140i32..=140).step_by(5) {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let s = Vec3::new(0.3, cos, sin).normalize();
            let b = sample.sheet_normal(1.0, s);
            let across = Vec3::new(0.0, s.y, s.z);
            assert!(
                b.dot(across) >= across.length() * DRAFT.sin() - 1e-9,
                "at {degrees}°"
            );
            if f64::from(degrees).to_radians().abs() < std::f64::consts::FRAC_PI_2 - DRAFT {
                assert!((b - Vec3::Y).length() < 1e-12);
            } else {
                assert!((b.dot(across) - across.length() * DRAFT.sin()).abs() < 1e-9);
            }
        }
        assert!((sample.sheet_normal(-1.0, -Vec3::Y) + Vec3::Y).length() < 1e-12);
        assert!((sample.sheet_normal(1.0, Vec3::X) - Vec3::Y).length() < 1e-12);
    }

    #[test]
    fn around_a_straight_seam_the_field_is_the_distance_to_its_sheet_at_any_depth() {
        let planes: Vec<Plane> = (-20..=20)
            .map(|i| Plane {
                point: 0.3 * f64::from(i) * Vec3::X,
                axis: Vec3::Z,
                normal: sample().sheet_normal(1.0, Vec3::Y),
            })
            .collect();
        for (y, depth) in [(0.0, 0.0), (0.4, 1.0), (-1.1, 2.0), (1.9, 0.3)] {
            let x = Vec3::new(0.17, y, -depth);
            let (value, nearest_mm) = mean_distance(planes.iter().copied(), x, 2.8).unwrap();
            assert!((value - y).abs() < 1e-9);
            assert!(nearest_mm >= y.abs() && nearest_mm < y.abs() + 0.15);
        }
        assert!(mean_distance(planes.into_iter(), 9.0 * Vec3::Y, 2.8).is_none());
    }

    /// A straight seam that turns at every triangle, by 0.2 mm every 0.9 mm.
    #[test]
    fn a_seam_that_turns_at_every_triangle_becomes_straight_and_keeps_its_ends() {
        let zigzag: Vec<Vec3> = (0..=100i32)
            .map(|i| Vec3::new(0.3 * f64::from(i), 0.2 * f64::from((i % 6 - 3).abs() - 1), 0.0))
            .collect();
        let line = smooth(zigzag.clone(), LINE_ROUNDS, false, 1);
        assert_eq!((line[0], line[100]), (zigzag[0], zigzag[100]));
        let inner = &line[10..91];
        let mean = inner.iter().map(|p| p.y).sum::<f64>() / inner.len() as f64;
        assert!(inner.iter().all(|p| (p.y - mean).abs() < 0.02), "{inner:?}");
    }
}
