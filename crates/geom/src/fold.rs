//! Folds of a surface: faces that have material right in front of them.
//!
//! A closed, oriented surface can still fold back on itself by some micrometres, where rounding moved a point
//! across a face. No count of edges sees that, but a ray does: from a point in front of a sound face it meets
//! an even number of faces.

use rayon::prelude::*;

use crate::bvh::TriangleBvh;
use crate::{TriMesh, Vec3};

/// Area up to which faces are not judged, mm²: no slicer shows what happens in a square of 0.1 mm.
const LEAST_MM2: f64 = 0.01;
/// Distance from a face at which there must be air, mm.
const IN_FRONT_MM: f64 = 2e-3;
/// Factor by which limits are stricter before rounding, which moves points by less than 0.1 µm.
const ROUNDING_MARGIN: f64 = 1.1;
/// Directions of the rays, turned to the side that the face looks at. All of them must meet material: one ray
/// may pass through an edge.
const DIRECTIONS: [Vec3; 3] = [
    Vec3::new(0.31, 0.62, 0.72),
    Vec3::new(-0.77, 0.21, 0.6),
    Vec3::new(0.2, -0.86, 0.47),
];

/// Returns the faces of a closed mesh that have material 2 µm in front of their middle, in order. Faces of
/// 0.01 mm² and less are left out. `bvh` is that of the mesh.
pub fn folded_faces(mesh: &TriMesh, bvh: &TriangleBvh) -> Vec<u32> {
    faces_that_fold(mesh, bvh, 1.0)
}

/// Returns the faces of a closed mesh that fold, or may fold once their points are rounded to the 32-bit
/// coordinates of files. `bvh` is that of the mesh.
pub(crate) fn nearly_folded_faces(mesh: &TriMesh, bvh: &TriangleBvh) -> Vec<u32> {
    faces_that_fold(mesh, bvh, ROUNDING_MARGIN)
}

fn faces_that_fold(mesh: &TriMesh, bvh: &TriangleBvh, margin: f64) -> Vec<u32> {
    let is_folded = |&face: &u32| {
        let is_large = mesh.double_area_vector(face as usize).length() > 2.0 * LEAST_MM2 / margin;
        is_large && has_material_in_front(mesh, bvh, face, IN_FRONT_MM * margin)
    };
    (0..mesh.triangles.len() as u32)
        .into_par_iter()
        .filter(is_folded)
        .collect()
}

/// Returns true if there is material at `distance` in front of the middle of `face`; `bvh` is that of the
/// mesh.
pub(crate) fn has_material_in_front(mesh: &TriMesh, bvh: &TriangleBvh, face: u32, distance: f64) -> bool {
    let normal = mesh.face_normal(face as usize);
    let origin = mesh.face_center(face as usize) + distance * normal;
    DIRECTIONS.into_iter().all(|along| {
        let along = along.normalize() * along.dot(normal).signum();
        bvh.n_hits(origin, along) % 2 == 1
    })
}
