//! Directions along which pieces move in and out: any, and the 26 that plans choose from (Sect. 6.2).

use serde::{Deserialize, Serialize};
use shellock_geom::Vec3;

/// Unit vector of a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction(Vec3);

impl Direction {
    /// Direction of `v`; `None` if `v` is zero or not finite.
    pub fn of(v: Vec3) -> Option<Self> {
        v.try_normalize().map(Self)
    }

    /// Vector of the direction, of length 1.
    pub fn unit(self) -> Vec3 {
        self.0
    }
}

impl From<LatticeDirection> for Direction {
    fn from(d: LatticeDirection) -> Self {
        Self(d.unit())
    }
}

/// One of the 26 directions from a grid cell to its neighbours: 6 axial, 12 in-plane diagonal, 8 space
/// diagonal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct LatticeDirection(u8);

impl LatticeDirection {
    /// Number of lattice directions, 26.
    pub const COUNT: usize = 26;

    /// All lattice directions, in order of their index.
    pub fn all() -> impl Iterator<Item = Self> + Clone {
        (0..Self::COUNT as u8).map(Self)
    }

    /// Position in [`Self::all`], in [0, 26).
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// Direction at this position in [`Self::all`]; `None` from 26 on.
    pub fn from_index(index: usize) -> Option<Self> {
        u8::try_from(index)
            .ok()
            .filter(|&i| usize::from(i) < Self::COUNT)
            .map(Self)
    }

    /// Step to the neighbouring cell: components in {−1, 0, 1}, not all 0.
    pub fn step(self) -> [i32; 3] {
        // Cell 13 of the 3 × 3 × 3 block is the middle, which is no direction.
        let cell = i32::from(self.0) + i32::from(self.0 >= 13);
        [cell / 9 - 1, cell / 3 % 3 - 1, cell % 3 - 1]
    }

    /// Unit vector in world space.
    pub fn unit(self) -> Vec3 {
        let [x, y, z] = self.step();
        Vec3::new(f64::from(x), f64::from(y), f64::from(z)).normalize()
    }

    /// Direction that points the opposite way.
    pub fn opposite(self) -> Self {
        Self(25 - self.0)
    }

    /// Direction nearest to `v`; the lowest index in case of a tie.
    pub fn nearest(v: Vec3) -> Self {
        let mut best = Self(0);
        for d in Self::all() {
            if d.unit().dot(v) > best.unit().dot(v) + 1e-12 {
                best = d;
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opposite_directions_cancel_and_all_differ() {
        let steps: std::collections::BTreeSet<_> =
            LatticeDirection::all().map(LatticeDirection::step).collect();
        assert_eq!(steps.len(), 26);
        for d in LatticeDirection::all() {
            assert_eq!(d.opposite().step(), d.step().map(|x| -x));
            assert_eq!(LatticeDirection::nearest(d.unit()), d);
            assert_eq!(LatticeDirection::from_index(d.index()), Some(d));
        }
    }
}
