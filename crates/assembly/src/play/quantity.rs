//! Bounded quantities: rotations and displacements of pieces.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use serde::{Deserialize, Serialize};
use shellock_geom::Vec3;

use super::barrier::Region;
use super::bearing::Bearing;
use crate::{IdVec, LatticeDirection, PatchId};

/// Edge of the cells in which bearings of a pair of pieces are grouped, mm.
const CELL_MM: f64 = 2.5;
/// Greatest length of a vector whose component along every lattice direction is at most 1: the inverse of
/// `1/√(1 + (√2−1)² + (√3−√2)²)`.
const BETWEEN_LATTICE: f64 = 1.1281;
/// Margin of regions for rounding, mm.
const ROUNDING_MM: f64 = 1e-6;

/// Vector that is linear in the logarithms of poses: of one piece, or of one relative to another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// Piece that counts as positive; `None` if it is held.
    pub plus: Option<PatchId>,
    /// Piece that counts as negative; `None` if it is held.
    pub minus: Option<PatchId>,
    /// Place of a displacement, mm; `None` for a rotation, rad.
    pub at: Option<[f64; 3]>,
    /// Directions in which the vector is bounded, unit vectors; the first three are orthogonal.
    pub axes: Vec<[f64; 3]>,
    /// Bounds against each axis and along it, ≥ 0, mm or rad.
    pub most: Vec<[f64; 2]>,
}

impl Quantity {
    fn new(plus: Option<PatchId>, minus: Option<PatchId>, at: Option<Vec3>, axes: Vec<[f64; 3]>) -> Self {
        let most = vec![[0.0; 2]; axes.len()];
        Self {
            plus,
            minus,
            at: at.map(|p| p.to_array()),
            axes,
            most,
        }
    }

    /// Upper bound on the length of all vectors within the bounds.
    pub fn norm(&self) -> f64 {
        let longest = |[low, high]: &[f64; 2]| low.max(*high);
        let of_box = self.most[..3]
            .iter()
            .map(|m| longest(m).powi(2))
            .sum::<f64>()
            .sqrt();
        if self.axes.len() < LINES {
            return of_box;
        }
        of_box.min(BETWEEN_LATTICE * self.most.iter().map(longest).fold(0.0, f64::max))
    }

    /// Upper bound on the component along `t`.
    fn along(&self, t: Vec3) -> f64 {
        let part = |k: usize| match Vec3::from_array(self.axes[k]).dot(t) {
            x if x > 0.0 => x * self.most[k][1],
            x => -x * self.most[k][0],
        };
        (0..3).map(part).sum()
    }
}

/// Number of lines along the lattice's directions.
const LINES: usize = LatticeDirection::COUNT / 2;

/// Coordinate axes, along which a piece's own rotation and displacement are bounded.
const COORDINATES: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];

/// Lines of the lattice, without the coordinate axes.
pub(super) fn other_lines() -> impl Iterator<Item = Vec3> {
    let is_other = |d: &Vec3| COORDINATES.iter().all(|a| a.dot(*d).abs() < 0.99);
    LatticeDirection::all()
        .filter(|d| *d < d.opposite())
        .map(LatticeDirection::unit)
        .filter(is_other)
}

/// Quantities that determine the motion of a bearing's point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Index of the displacement of the bearing's cell.
    pub cell: usize,
    /// Sign of the cell: 1 if it counts `a` relative to `b`, −1 if `b` relative to `a`.
    cell_sign: f64,
    /// Vector from the cell's place to the point.
    off: Vec3,
    /// Index of the rotation of one piece relative to the other, with its sign below.
    pub turn: usize,
    turn_sign: f64,
    /// Rotation and displacement of `a`, if both `a` and `b` are free.
    of_a: Option<[usize; 2]>,
    /// Rotation of `b`, if it is free.
    of_b: Option<usize>,
}

/// All quantities of some free pieces.
pub(super) struct Quantities {
    pub all: Vec<Quantity>,
    /// Rotation and displacement of each free piece, the latter at its centre.
    pub of_piece: BTreeMap<PatchId, [usize; 2]>,
    /// Places of the bearings, one for each.
    pub places: Vec<Place>,
}

impl Quantities {
    /// Builds the quantities of the pieces in `free` (in ascending order) and their `bearings`.
    pub fn new(free: &[PatchId], centers: &IdVec<PatchId, Vec3>, bearings: &[Bearing]) -> Self {
        let freed = |p: PatchId| Some(p).filter(|p| free.binary_search(p).is_ok());
        let mut made = Self {
            all: Vec::new(),
            of_piece: BTreeMap::new(),
            places: Vec::with_capacity(bearings.len()),
        };
        for &p in free {
            let turn = made.add(Quantity::new(
                Some(p),
                None,
                None,
                COORDINATES.map(|d| d.to_array()).to_vec(),
            ));
            let shift = made.add(Quantity::new(
                Some(p),
                None,
                Some(centers[p]),
                COORDINATES.map(|d| d.to_array()).to_vec(),
            ));
            made.of_piece.insert(p, [turn, shift]);
        }
        let key = |b: &Bearing| {
            (
                b.a.min(b.b),
                b.a.max(b.b),
                (b.point / CELL_MM).floor().to_array().map(|x| x as i64),
            )
        };
        let mut cells: BTreeMap<(PatchId, PatchId, [i64; 3]), Vec<usize>> = BTreeMap::new();
        bearings
            .iter()
            .enumerate()
            .for_each(|(i, b)| cells.entry(key(b)).or_default().push(i));
        let mut of_cell = BTreeMap::new();
        let mut turns: BTreeMap<(PatchId, PatchId), usize> = BTreeMap::new();
        for (cell, list) in &cells {
            let (plus, minus) = (freed(cell.0), freed(cell.1));
            turns
                .entry((cell.0, cell.1))
                .or_insert_with(|| match plus.xor(minus) {
                    Some(alone) => made.of_piece[&alone][0],
                    None => made.add(Quantity::new(plus, minus, None, principal([].into_iter()))),
                });
            let middle = list.iter().map(|&i| bearings[i].point).sum::<Vec3>() / list.len() as f64;
            let axes = principal(list.iter().map(|&i| bearings[i].normal));
            of_cell.insert(
                *cell,
                (made.add(Quantity::new(plus, minus, Some(middle), axes)), middle),
            );
        }
        for b in bearings {
            let (cell, middle) = of_cell[&key(b)];
            let turn = turns[&(b.a.min(b.b), b.a.max(b.b))];
            made.places.push(made.place(b, cell, middle, turn));
        }
        made
    }

    fn add(&mut self, quantity: Quantity) -> usize {
        self.all.push(quantity);
        self.all.len() - 1
    }

    fn place(&self, b: &Bearing, cell: usize, middle: Vec3, turn: usize) -> Place {
        let (of_a, of_b) = (self.of_piece.get(&b.a), self.of_piece.get(&b.b));
        let sign = if b.a < b.b { 1.0 } else { -1.0 };
        // The rotation of a free piece relative to a held one is its own, whichever of the two it is.
        let turn_sign = match (of_a, of_b) {
            (Some(_), None) => 1.0,
            (None, Some(_)) => -1.0,
            _ => sign,
        };
        let of_a = of_a.filter(|_| of_b.is_some()).copied();
        let of_b = of_b.map(|q| q[0]);
        Place {
            cell,
            cell_sign: sign,
            off: b.point - middle,
            turn,
            turn_sign,
            of_a,
            of_b,
        }
    }

    /// Greatest distance of the bearing's point, seen from `b`, from the position predicted by the logarithms
    /// of the poses, mm: docs/notes/certificate.md.
    pub fn error_mm(&self, b: &Bearing, p: &Place, centers: &IdVec<PatchId, Vec3>) -> f64 {
        let norm = |k: usize| self.all[k].norm();
        let turn = norm(p.turn);
        let move_mm = norm(p.cell) + turn * p.off.length();
        let of_b = p.of_b.map_or(0.0, norm);
        let of_a_mm = match (p.of_a, p.of_b) {
            (Some([w, u]), _) => norm(u) + norm(w) * b.point.distance(centers[b.a]),
            // Only `b` moves, so `a` has no displacement.
            (None, Some(_)) => 0.0,
            (None, None) => move_mm,
        };
        0.5 * of_b * move_mm + 0.5 * turn * of_a_mm
    }

    /// Region of the point's sideways motion, seen from `b`, including the error.
    pub fn region(&self, b: &Bearing, p: &Place, error_mm: f64) -> Region {
        let (cell, turn) = (&self.all[p.cell], &self.all[p.turn]);
        let far = |t: Vec3| {
            cell.along(t * p.cell_sign) + turn.along(p.off.cross(t) * p.turn_sign) + error_mm + ROUNDING_MM
        };
        Region {
            far_mm: b.axis().sides().map(far),
        }
    }
}

/// Axes along which displacements are bounded best: those of the bearings' normals.
fn principal(normals: impl Iterator<Item = Vec3>) -> Vec<[f64; 3]> {
    let sum = normals
        .map(|n| Vector3::new(n.x, n.y, n.z))
        .fold(Matrix3::zeros(), |m, n| m + n * n.transpose());
    let vectors = SymmetricEigen::new(sum).eigenvectors;
    (0..3)
        .map(|k| [vectors[(0, k)], vectors[(1, k)], vectors[(2, k)]])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_direction_is_farther_from_the_lattice_than_is_told() {
        let lines: Vec<Vec3> = COORDINATES.into_iter().chain(other_lines()).collect();
        assert_eq!(lines.len(), LINES);
        for i in 0..20_000 {
            let t = f64::from(i);
            let d = Vec3::new((1.7 * t).sin(), (2.3 * t).cos(), (0.9 * t + 1.0).sin()).normalize();
            let most = lines.iter().map(|l| l.dot(d).abs()).fold(0.0, f64::max);
            assert!(most * BETWEEN_LATTICE >= 1.0, "{d}: {most}");
        }
    }
}
