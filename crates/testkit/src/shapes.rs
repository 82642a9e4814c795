//! Simple bodies.

use std::collections::BTreeMap;

use shellock_geom::{TriMesh, Vec3};

/// An octahedron, `n_splits` times refined, on the ellipsoid with half axes `radii_mm`: 8 · 4ⁿ triangles.
pub fn sphere(n_splits: usize, radii_mm: Vec3) -> TriMesh {
    let mut points = vec![Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 1, 2],
        [1, 3, 2],
        [3, 4, 2],
        [4, 0, 2],
        [1, 0, 5],
        [3, 1, 5],
        [4, 3, 5],
        [0, 4, 5],
    ];
    for _ in 0..n_splits {
        let mut middles = BTreeMap::new();
        let mut middle = |a: u32, b: u32, points: &mut Vec<Vec3>| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let (ab, bc, ca) = (
                middle(a, b, &mut points),
                middle(b, c, &mut points),
                middle(c, a, &mut points),
            );
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    TriMesh {
        points: points.into_iter().map(|p| p * radii_mm).collect(),
        triangles,
    }
}

/// A corner of the unit cube, outwards.
pub fn tetrahedron() -> TriMesh {
    TriMesh {
        points: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
    }
}
