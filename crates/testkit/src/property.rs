//! Helpers for property tests: reproducible cases, and motions that map the lattice of directions to itself.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use shellock_geom::{TriMesh, Vec3};

/// Configuration of `n` cases, the same ones on each run; failures are not written to disk.
pub fn cases(n: u32) -> ProptestConfig {
    ProptestConfig {
        cases: n,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(2017),
        ..ProptestConfig::default()
    }
}

/// One of the 24 rotations that map axes to axes, without rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatticeTurn {
    /// Source of each coordinate: index and sign.
    from: [(usize, f64); 3],
}

impl LatticeTurn {
    /// Returns all 24 rotations, the identity first.
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

    /// Rotates a point or a direction about the origin.
    pub fn apply(&self, v: Vec3) -> Vec3 {
        Vec3::from_array(self.from.map(|(k, sign)| sign * v[k]))
    }

    /// Rotates a mesh about the origin, then shifts it.
    pub fn mesh(&self, mesh: &TriMesh, shift: Vec3) -> TriMesh {
        TriMesh {
            points: mesh.points.iter().map(|&p| self.apply(p) + shift).collect(),
            triangles: mesh.triangles.clone(),
        }
    }
}

/// Strategy for any of the 24 rotations.
pub fn turns() -> impl Strategy<Value = LatticeTurn> {
    prop::sample::select(LatticeTurn::all())
}

/// Strategy for any order of the numbers below `n`.
pub fn orders(n: usize) -> impl Strategy<Value = Vec<usize>> {
    Just((0..n).collect::<Vec<_>>()).prop_shuffle()
}

/// Strategy for a vector with each component in [−`most`, `most`].
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
