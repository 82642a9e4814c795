//! Small meshes that tests of several modules need.

use crate::{TriMesh, Vec3};

/// A corner of the unit cube, outwards.
pub fn tetrahedron() -> TriMesh {
    TriMesh {
        points: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
    }
}

/// Two meshes as one.
pub fn both(mut a: TriMesh, b: TriMesh) -> TriMesh {
    let n = a.points.len() as u32;
    a.points.extend(b.points);
    a.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + n)));
    a
}

/// The same inside out.
pub fn flipped(mut mesh: TriMesh) -> TriMesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    mesh
}

/// Each triangle with points of its own, as in an STL.
pub fn unwelded(mesh: &TriMesh) -> TriMesh {
    TriMesh {
        points: (0..mesh.triangles.len()).flat_map(|f| mesh.corners(f)).collect(),
        triangles: (0..mesh.triangles.len() as u32)
            .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
            .collect(),
    }
}
