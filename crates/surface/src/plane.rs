//! Planes that a surface follows, by random sampling and least squares.

use nalgebra::Matrix3;
use shellock_geom::{TriMesh, Vec3};

/// Greatest distance of a face from its plane, as a share of the model's longest edge: 1.2 mm at 150 mm.
const INLIER_SHARE: f64 = 0.008;

/// Least cosine between the normals of a face and of the plane it lies on (26°).
const INLIER_COSINE: f64 = 0.9;

/// A sampled face, which may stand for several.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Centre of the face.
    pub center: Vec3,
    /// Unit normal, or zero.
    pub normal: Vec3,
    /// Area of the face and of those it stands for, mm².
    pub area: f64,
}

impl Spot {
    /// Samples every `step`-th of `faces`, each with `step` times its area.
    pub fn sample(mesh: &TriMesh, faces: impl IntoIterator<Item = usize>, step: usize) -> Vec<Self> {
        let spot = |f: usize| Self {
            center: mesh.face_center(f),
            normal: mesh.face_normal(f),
            area: mesh.face_area(f) * step as f64,
        };
        faces.into_iter().step_by(step).map(spot).collect()
    }
}

/// A plane, and the tolerance within which faces lie on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point of the plane.
    pub at: Vec3,
    /// Unit normal, which points outwards.
    pub normal: Vec3,
    /// Greatest distance of a face that lies on the plane, mm.
    pub tolerance_mm: f64,
}

impl Plane {
    /// Greatest distance from a plane at which faces of a model of this size lie on it, mm.
    pub fn tolerance_mm(longest_edge_mm: f64) -> f64 {
        INLIER_SHARE * longest_edge_mm
    }

    /// Returns true if the face lies on the plane and faces the same way.
    pub fn has(&self, s: &Spot) -> bool {
        (s.center - self.at).dot(self.normal).abs() < self.tolerance_mm
            && s.normal.dot(self.normal) > INLIER_COSINE
    }

    /// Area of the `spots` on the plane, mm².
    pub fn area_mm2(&self, spots: &[Spot]) -> f64 {
        spots.iter().filter(|s| self.has(s)).map(|s| s.area).sum()
    }

    /// Least-squares plane through the `spots` on this plane, if more area lies on it; else this plane.
    pub fn refine(self, spots: &[Spot]) -> Self {
        let inliers: Vec<Spot> = spots.iter().copied().filter(|s| self.has(s)).collect();
        let Some((at, normal)) = least_squares_plane(&inliers, self.normal) else {
            return self;
        };
        let better = Self { at, normal, ..self };
        if better.area_mm2(spots) > self.area_mm2(spots) {
            better
        } else {
            self
        }
    }
}

/// Centre and unit normal of the least-squares plane, weighted by area; the normal points towards `towards`.
fn least_squares_plane(spots: &[Spot], towards: Vec3) -> Option<(Vec3, Vec3)> {
    let area: f64 = spots.iter().map(|s| s.area).sum();
    if area <= 0.0 {
        return None;
    }
    let center = spots.iter().map(|s| s.center * s.area).sum::<Vec3>() / area;
    let mut spread = Matrix3::<f64>::zeros();
    for s in spots {
        let d = s.center - center;
        let d = nalgebra::Vector3::new(d.x, d.y, d.z);
        spread += s.area * d * d.transpose();
    }
    let eigen = spread.symmetric_eigen();
    let least = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    let normal = Vec3::new(least[0], least[1], least[2]).try_normalize()?;
    Some((
        center,
        if normal.dot(towards) < 0.0 {
            -normal
        } else {
            normal
        },
    ))
}
