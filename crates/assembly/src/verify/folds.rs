//! Folds of a surface: faces that have material right in front of them.
//!
//! A closed, oriented surface can still fold back on itself by some micrometres, where rounding moved a point
//! across a face. No count of edges sees that, but a ray does: in front of a sound face it leaves through the
//! air, so the first face that it meets shows its outer side.

use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{TriMesh, Vec3};

/// Area up to which faces are not judged, mm²: no slicer shows what happens in a square of 0.1 mm.
const LEAST_MM2: f64 = 0.01;
/// Distance from a face at which there must be air, mm.
const IN_FRONT_MM: f64 = 2e-3;
/// Directions of the rays, turned to the side that the face looks at. All of them must meet material: one ray
/// may pass through an edge.
const DIRECTIONS: [Vec3; 3] = [
    Vec3::new(0.31, 0.62, 0.72),
    Vec3::new(-0.77, 0.21, 0.6),
    Vec3::new(0.2, -0.86, 0.47),
];

/// Faces of a mesh that have material right in front of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold {
    /// Number of the faces, one at least.
    pub n_faces: usize,
    /// Area of the faces, mm².
    pub area_mm2: f64,
    /// Middle of the first face.
    pub at: Vec3,
}

impl Fold {
    /// Finds the faces of a closed mesh that have material right in front of them; `None` if there are none.
    pub fn of(mesh: &TriMesh) -> Option<Self> {
        let faces = faces_turned_inwards(mesh);
        let [a, b, c] = mesh.corners(*faces.first()?);
        Some(Self {
            n_faces: faces.len(),
            area_mm2: faces
                .iter()
                .map(|&face| 0.5 * mesh.double_area_vector(face).length())
                .sum(),
            at: (a + b + c) / 3.0,
        })
    }
}

/// Returns the faces of a closed mesh that have material 2 µm in front of their middle, in order. Faces of
/// 0.01 mm² and less are left out.
fn faces_turned_inwards(mesh: &TriMesh) -> Vec<usize> {
    let bvh = TriangleBvh::new(mesh);
    let is_in_material = |face: usize| {
        let normal = mesh.face_normal(face);
        let [a, b, c] = mesh.corners(face);
        let origin = (a + b + c) / 3.0 + IN_FRONT_MM * normal;
        DIRECTIONS.into_iter().all(|along| {
            let along = along.normalize() * along.dot(normal).signum();
            let first = bvh.first_hit(origin, along, f64::INFINITY);
            first.is_some_and(|(hit, _)| mesh.double_area_vector(hit as usize).dot(along) > 0.0)
        })
    };
    (0..mesh.triangles.len())
        .filter(|&face| mesh.double_area_vector(face).length() > 2.0 * LEAST_MM2 && is_in_material(face))
        .collect()
}

#[cfg(test)]
mod tests {
    use shellock_testkit::shapes::cuboid;

    use super::*;

    #[test]
    fn faces_inside_other_material_are_a_fold_and_those_of_a_cavity_are_none() {
        let outer = cuboid([0.0; 3], [10.0; 3]);
        let inner = cuboid([2.0; 3], [8.0; 3]);
        assert_eq!(Fold::of(&outer.subtract(&inner).to_mesh()), None);
        // Both surfaces at once, not united: the inner one lies within the material of the outer one.
        let (mut both, inner) = (outer.to_mesh(), inner.to_mesh());
        let first = both.points.len() as u32;
        both.points.extend(&inner.points);
        both.triangles
            .extend(inner.triangles.iter().map(|t| t.map(|v| v + first)));
        let fold = Fold::of(&both).expect("the inner faces have material in front");
        assert_eq!(fold.n_faces, inner.triangles.len());
        assert!((fold.area_mm2 - inner.area()).abs() < 1e-9);
        assert!((fold.at - Vec3::splat(5.0)).abs().max_element() > 2.9);
        // Faces of less than 0.01 mm² are not judged.
        let points = both.points.iter().map(|p| 1e-2 * *p).collect();
        assert_eq!(Fold::of(&TriMesh { points, ..both }), None);
    }
}
