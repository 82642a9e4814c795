//! The outer surface with its patches, the result of segmentation that all later stages use, and the seams
//! between them.

pub mod narrow;
pub mod plane;
pub mod seam;
mod turn;

use shellock_geom::{TriMesh, Vec3};
use shellock_report::{IdVec, PatchId};
pub use turn::Turn;

/// The model's closed surface, cut along the seams so that each triangle belongs to one patch.
///
/// Geometrically it is the model's surface: cutting only adds points on edges and triangles inside triangles.
/// Every patch owns at least one triangle.
#[derive(Clone, Debug)]
pub struct SegmentedSurface {
    /// Closed, oriented outwards; two triangles of different patches meet in whole edges.
    pub mesh: TriMesh,
    /// The patch of each triangle of `mesh`.
    pub patch_of_face: Vec<PatchId>,
    /// The triangle of the uncut model that contains each triangle of `mesh`.
    pub source_face: Vec<u32>,
    /// Number of patches; their ids are 0 … n − 1.
    pub n_patches: usize,
}

/// One stretch of seam between two patches: a polyline on the outer surface.
#[derive(Clone, Debug)]
pub struct Seam {
    /// The patch with the lower id.
    pub a: PatchId,
    /// The patch with the higher id.
    pub b: PatchId,
    /// Points in order, mm; the last equals the first where the seam is a loop.
    pub points: Vec<Vec3>,
    /// Outward unit normal of the surface at each point (mean of the adjacent triangles, by area).
    pub normals: Vec<Vec3>,
}

impl Seam {
    /// Length along the polyline, mm.
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|w| w[0].distance(w[1])).sum()
    }

    /// Returns true if the seam is closed.
    pub fn is_loop(&self) -> bool {
        self.points.len() > 2 && self.points.first() == self.points.last()
    }
}

impl Seam {
    /// Resamples the seam at `n` + 1 points at equal distances, with their unnormalised normals; none where
    /// the seam has no length.
    pub fn resample(&self, n: usize) -> Vec<(Vec3, Vec3)> {
        let total = self.length();
        if self.points.len() < 2
            || self.normals.len() != self.points.len()
            || total <= 0.0
            || !total.is_finite()
        {
            return Vec::new();
        }
        let mut out = Vec::with_capacity(n + 1);
        let (mut i, mut before) = (0, 0.0);
        for k in 0..=n {
            let target = total * k as f64 / n as f64;
            let mut step = self.points[i].distance(self.points[i + 1]);
            while before + step < target && i + 2 < self.points.len() {
                before += step;
                i += 1;
                step = self.points[i].distance(self.points[i + 1]);
            }
            let t = if step > 0.0 {
                ((target - before) / step).clamp(0.0, 1.0)
            } else {
                0.0
            };
            out.push((
                self.points[i].lerp(self.points[i + 1], t),
                self.normals[i].lerp(self.normals[i + 1], t),
            ));
        }
        out
    }

    /// Moves `n` + 1 points at equal distances along the seam inwards by `depth_mm`, to the inner edge of a
    /// wall of that thickness. Details of the surface are smoothed away.
    pub fn below(&self, depth_mm: f64, n: usize) -> Vec<Vec3> {
        /// Rounds of averaging the normals with their neighbours: bumps narrower than some steps do not show
        /// inside.
        const ROUNDS: usize = 3;
        let stations = self.resample(n);
        let mut normals: Vec<Vec3> = stations.iter().map(|s| s.1).collect();
        for _ in 0..ROUNDS {
            let old = normals.clone();
            for i in 1..old.len().saturating_sub(1) {
                normals[i] = 0.5 * old[i] + 0.25 * (old[i - 1] + old[i + 1]);
            }
        }
        stations
            .iter()
            .zip(normals)
            .map(|(s, n)| s.0 - depth_mm * n.normalize_or_zero())
            .collect()
    }

    /// Length along the inner edge of a wall of `depth_mm`, mm: shorter than outside where the surface
    /// bulges, as round a limb.
    pub fn length_below(&self, depth_mm: f64) -> f64 {
        /// Spacing of the points, mm: so coarse that bumps do not lengthen the line.
        const STEP_MM: f64 = 2.0;
        if depth_mm <= 0.0 {
            return self.length();
        }
        let n = (self.length() / STEP_MM).ceil().max(1.0) as usize;
        self.below(depth_mm, n)
            .windows(2)
            .map(|w| w[0].distance(w[1]))
            .sum()
    }
}

impl SegmentedSurface {
    /// Area of each patch, mm².
    pub fn areas(&self) -> IdVec<PatchId, f64> {
        let mut areas = IdVec::from_fn(self.n_patches, |_| 0.0);
        for (face, &patch) in self.patch_of_face.iter().enumerate() {
            areas[patch] += self.mesh.face_area(face);
        }
        areas
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seam_round_a_limb_is_shorter_inside_by_the_ratio_of_the_radii() {
        let angle = |i: i32| std::f64::consts::TAU * f64::from(i) / 60.0;
        let normals: Vec<Vec3> = (0..=60)
            .map(|i| Vec3::new(angle(i).cos(), angle(i).sin(), 0.0))
            .collect();
        let points = normals.iter().map(|n| 7.0 * *n).collect();
        let seam = Seam {
            a: PatchId(0),
            b: PatchId(1),
            points,
            normals,
        };
        let ratio = seam.length_below(2.0) / seam.length_below(0.0);
        assert!((ratio - 5.0 / 7.0).abs() < 0.02, "{ratio}");
    }
}
