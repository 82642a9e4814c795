//! The test kit's shapes as this crate's own types, of which the kit has other copies, and what is done to
//! meshes to break them.

use shellock_testkit::plain::{self, Plain};

use crate::{Aabb, TriMesh, Vec3, Volume};

fn mesh((points, triangles): Plain) -> TriMesh {
    TriMesh { points, triangles }
}

/// A corner of the unit cube, outwards.
pub fn tetrahedron() -> TriMesh {
    mesh(plain::tetrahedron())
}

/// An octahedron with each edge halved `n_splits` times, on the ellipsoid with half axes `radii_mm`.
pub fn ellipsoid(n_splits: usize, radii_mm: Vec3) -> TriMesh {
    mesh(plain::sphere(n_splits, radii_mm))
}

/// A ball of 8 · 4ⁿ triangles, outwards.
pub fn ball(center: Vec3, radius: f64, n: usize) -> TriMesh {
    let mut ball = ellipsoid(n, Vec3::splat(radius));
    ball.points.iter_mut().for_each(|p| *p += center);
    ball
}

/// A cube of edge `size` with its least corner at `at`, outwards.
pub fn cube(at: Vec3, size: f64) -> TriMesh {
    mesh(plain::cuboid(at, at + size))
}

/// A torus around z as a grid of `cells` around and across it.
pub fn torus(radius_mm: f64, tube_mm: f64, cells: [u32; 2]) -> TriMesh {
    mesh(plain::torus(radius_mm, tube_mm, cells))
}

/// A box between two corners.
pub fn cuboid(min: impl Into<Vec3>, max: impl Into<Vec3>) -> Volume {
    Volume::cuboid(Aabb {
        min: min.into(),
        max: max.into(),
    })
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
