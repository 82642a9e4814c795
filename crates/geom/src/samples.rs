//! Shapes of the test kit in this crate's own types, since the kit has separate ones, and functions that
//! break meshes.

use shellock_testkit::plain::{self, Plain};

use crate::{Aabb, TriMesh, Vec3, Volume};

fn mesh((points, triangles): Plain) -> TriMesh {
    TriMesh { points, triangles }
}

/// Corner of the unit cube, oriented outwards.
pub fn tetrahedron() -> TriMesh {
    mesh(plain::tetrahedron())
}

/// Octahedron with each edge halved `n_splits` times, on the ellipsoid with half axes `radii_mm`.
pub fn ellipsoid(n_splits: usize, radii_mm: Vec3) -> TriMesh {
    mesh(plain::sphere(n_splits, radii_mm))
}

/// Ball of 8 · 4ⁿ triangles, oriented outwards.
pub fn ball(center: Vec3, radius: f64, n: usize) -> TriMesh {
    let mut ball = ellipsoid(n, Vec3::splat(radius));
    ball.points.iter_mut().for_each(|p| *p += center);
    ball
}

/// Cube of edge `size` with its least corner at `at`, oriented outwards.
pub fn cube(at: Vec3, size: f64) -> TriMesh {
    mesh(plain::cuboid(at, at + size))
}

/// Torus around z as a grid of `cells` around and across it.
pub fn torus(radius_mm: f64, tube_mm: f64, cells: [u32; 2]) -> TriMesh {
    mesh(plain::torus(radius_mm, tube_mm, cells))
}

/// Box between two opposite corners.
pub fn cuboid(min: impl Into<Vec3>, max: impl Into<Vec3>) -> Volume {
    Volume::cuboid(Aabb {
        min: min.into(),
        max: max.into(),
    })
}

/// Joins two meshes into one, without merging points.
pub fn both(mut a: TriMesh, b: TriMesh) -> TriMesh {
    let n = a.points.len() as u32;
    a.points.extend(b.points);
    a.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + n)));
    a
}

/// Turns the mesh inside out.
pub fn flip(mut mesh: TriMesh) -> TriMesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    mesh
}

/// Gives each triangle its own points, as in an STL.
pub fn unweld(mesh: &TriMesh) -> TriMesh {
    TriMesh {
        points: (0..mesh.triangles.len()).flat_map(|f| mesh.corners(f)).collect(),
        triangles: (0..mesh.triangles.len() as u32)
            .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
            .collect(),
    }
}
