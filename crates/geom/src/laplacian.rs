//! Cotangent Laplacian and lumped mass of a triangle mesh.

use crate::{TriMesh, Vec3};

/// Largest cotangent used, which is that of an angle of 1.1°.
///
/// Cotangents of a sliver are unbounded and of either sign. Clamped to [0, 50], the matrix stays an M-matrix,
/// so that solutions obey the maximum principle, and is as well conditioned as for a decent mesh.
const MAX_COTANGENT: f64 = 50.0;

/// Weights of a triangle's edges: half the cotangent of the angle opposite each edge. Entry `c` belongs to
/// the edge from corner `c` to corner `c + 1`. An edge's weight in the Laplacian is the sum over its two
/// triangles. Degenerate triangles give 0.
pub fn half_cotangents(corners: [Vec3; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| {
        let (from, to, across) = (corners[c], corners[(c + 1) % 3], corners[(c + 2) % 3]);
        let (u, v) = (from - across, to - across);
        let doubled_area = u.cross(v).length();
        if doubled_area > 0.0 {
            0.5 * (u.dot(v) / doubled_area).clamp(0.0, MAX_COTANGENT)
        } else {
            0.0
        }
    })
}

/// Lumped mass of each point: a third of the area of the triangles around it, mm².
pub fn lumped_mass(mesh: &TriMesh) -> Vec<f64> {
    let mut mass = vec![0.0; mesh.points.len()];
    for (face, t) in mesh.triangles.iter().enumerate() {
        let third = mesh.face_area(face) / 3.0;
        for &v in t {
            mass[v as usize] += third;
        }
    }
    mass
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cotangents_of_a_right_isosceles_triangle() {
        let w = half_cotangents([Vec3::ZERO, Vec3::X, Vec3::Y]);
        for (found, expected) in w.into_iter().zip([0.5, 0.0, 0.5]) {
            assert!((found - expected).abs() < 1e-15);
        }
    }
}
