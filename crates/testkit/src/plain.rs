//! Shapes as plain points and triangles, oriented outwards.
//!
//! They serve crates with mesh types of their own, and `shellock-geom` itself, whose tests see other copies
//! of its types than this crate does.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use shellock_geom::Vec3;

/// Points, and the three point indices of each triangle.
pub type Plain = (Vec<Vec3>, Vec<[u32; 3]>);

/// An octahedron, refined `n_splits` times, on the ellipsoid with half axes `radii_mm`: 8 · 4ⁿ triangles.
pub fn sphere(n_splits: usize, radii_mm: Vec3) -> Plain {
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
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (points.into_iter().map(|p| p * radii_mm).collect(), triangles)
}

/// A tetrahedron: the corner of the unit cube at the origin.
pub fn tetrahedron() -> Plain {
    (
        vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
        vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
    )
}

/// A box of twelve triangles. Bit k of a point's index is set if its k-th coordinate is the larger one.
pub fn cuboid(min: Vec3, max: Vec3) -> Plain {
    let corner =
        |i: usize| Vec3::from_array([0, 1, 2].map(|k| if i >> k & 1 == 1 { max[k] } else { min[k] }));
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let halves = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    ((0..8).map(corner).collect(), halves.collect())
}

/// A torus around z as a grid of `n_around` × `n_across` quadrilaterals, each divided into two triangles.
pub fn torus(radius_mm: f64, tube_mm: f64, [n_around, n_across]: [u32; 2]) -> Plain {
    let point = |i: u32, j: u32| {
        let turn = |i: u32, n: u32| (TAU * f64::from(i) / f64::from(n)).sin_cos();
        let ((su, cu), (sv, cv)) = (turn(i, n_around), turn(j, n_across));
        let r = radius_mm + tube_mm * cv;
        Vec3::new(r * cu, r * su, tube_mm * sv)
    };
    let at = |i: u32, j: u32| (i % n_around) * n_across + j % n_across;
    let cells = || (0..n_around).flat_map(|i| (0..n_across).map(move |j| (i, j)));
    let triangles = cells().flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    (cells().map(|(i, j)| point(i, j)).collect(), triangles.collect())
}
