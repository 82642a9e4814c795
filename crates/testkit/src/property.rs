//! What tests of properties share: the same few cases on each run, and motions that take the lattice of
//! directions to itself.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use shellock_geom::{TriMesh, Vec3};

/// So many cases, the same ones on each run; nothing is written where one fails.
pub fn cases(n: u32) -> ProptestConfig {
    ProptestConfig {
        cases: n,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(2017),
        ..ProptestConfig::default()
    }
}

/// One of the 24 rotations that take axes to axes. It rounds nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatticeTurn {
    /// From which coordinate each one comes, and its sign.
    from: [(usize, f64); 3],
}

impl LatticeTurn {
    /// All of them, the one that turns nothing first.
    pub fn all() -> Vec<Self> {
        let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
        let signs = |i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 0 { 1.0 } else { -1.0 });
        let turns = (0..6).flat_map(|order| (0..8).map(move |sign| (order, sign)));
        turns
            .filter(|&(order, sign)| {
                let is_odd = order >= 3;
                (signs(sign).iter().product::<f64>() < 0.0) == is_odd
            })
            .map(|(order, sign)| Self {
                from: [0, 1, 2].map(|k| (orders[order][k], signs(sign)[k])),
            })
            .collect()
    }

    /// A point or a direction, turned about the origin.
    pub fn apply(&self, v: Vec3) -> Vec3 {
        Vec3::from_array(self.from.map(|(k, sign)| sign * v[k]))
    }

    /// A mesh, turned and then shifted.
    pub fn mesh(&self, mesh: &TriMesh, shift: Vec3) -> TriMesh {
        TriMesh {
            points: mesh.points.iter().map(|&p| self.apply(p) + shift).collect(),
            triangles: mesh.triangles.clone(),
        }
    }
}

/// Any of the 24 rotations.
pub fn turns() -> impl Strategy<Value = LatticeTurn> {
    prop::sample::select(LatticeTurn::all())
}

/// Any order of the numbers below `n`.
pub fn orders(n: usize) -> impl Strategy<Value = Vec<usize>> {
    Just((0..n).collect::<Vec<_>>()).prop_shuffle()
}

/// A vector with each component in [−`most`, `most`].
pub fn vectors(most: f64) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-most..=most).prop_map(Vec3::from_array)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_of_the_lattice_are_24_different_rotations() {
        let all = LatticeTurn::all();
        assert_eq!(all.len(), 24);
        for (i, t) in all.iter().enumerate() {
            let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|v| t.apply(v));
            assert_eq!(x.cross(y), z);
            assert!(!all[..i].contains(t));
        }
    }
}
