//! Checks that multipliers bound how far some pieces move, whatever their motions.
//!
//! Poses are `exp(ξ)`, `ξ = (w, v)`, of each free piece, with the velocity field `u(x) = v + w × x`. The
//! bounded quantities are linear in the `ξ`. So are the rows, which state how far a bearing's point rises. As
//! long as all bounds hold, each point stays within its prism, hence below its barrier, so each row is at
//! most a known number. If the multipliers then give bounds on the quantities that are below the stated ones,
//! no path from rest ever reaches a stated bound (docs/notes/certificate.md).

use serde::Deserialize;

use crate::barrier::{Prism, rise_mm};
use crate::bearing::Bearing;
use crate::mesh::Mesh;
use crate::quantity::Quantity;
use crate::vector::{Vec3, cross, distance, dot, norm, scale, sub};

/// Margin of a region's side for rounding, mm. It also covers axes that are perpendicular except for
/// rounding.
const ROUNDING_MM: f64 = 1e-6;
/// Margin of a bound for the rounding of sums, as a share of the bound, and in mm or rad.
const ROUNDING: f64 = 1e-9;
/// Slide up to which a key counts as at rest, mm.
const MOST_SLIDE_MM: f64 = 0.5;
/// Greatest difference between two directions that count as equal.
const SAME_WAY: f64 = 1e-6;
/// Margin of the box around the key, mm.
const AROUND_KEY_MM: f64 = 1e-3;
/// Number of unknowns of a piece: the displacement at its place, then its rotation.
const UNKNOWNS: usize = 6;

/// Rows with multipliers that bound a quantity against an axis and along it.
pub type Ends = [Vec<(usize, f64)>; 2];

/// Claim that free pieces stay within stated bounds while the others are at rest.
#[derive(Clone, Deserialize)]
pub struct Bounded {
    /// Free pieces, in ascending order.
    #[serde(deserialize_with = "crate::number::places")]
    pub free: Vec<usize>,
    /// Rotation and displacement of each free piece, as indices into `quantities`.
    pub of_piece: Vec<[usize; 2]>,
    pub quantities: Vec<Quantity>,
    /// Rows: a bearing, the quantity of its displacement, and that of its rotation.
    pub rows: Vec<[usize; 3]>,
    /// Multipliers for each quantity and axis. The row after the last is the slide.
    pub multipliers: Vec<Vec<Ends>>,
}

/// Distance that the key may have slid.
#[derive(Clone, Deserialize)]
pub struct Slide {
    #[serde(deserialize_with = "crate::number::place")]
    pub key: usize,
    /// Piece against which the slide is measured.
    #[serde(deserialize_with = "crate::number::place")]
    pub seat: usize,
    /// Point of the key that is measured, mm.
    pub at: Vec3,
    /// Way out of the key, a unit vector.
    pub along: Vec3,
    pub most_mm: f64,
}

/// Kit against which claims are tested.
pub struct Kit<'a> {
    pub meshes: &'a [Mesh],
    /// Bearings with points that lie on the surfaces.
    pub bearings: &'a [Bearing],
    pub slide: Option<&'a Slide>,
    pub key: usize,
    /// Way out of the key as claimed elsewhere in the certificate.
    pub way_out: Option<Vec3>,
}

/// Play of one piece, or the greatest play of several.
#[derive(Clone, Copy, Debug, Default)]
pub struct Play {
    pub shift_mm: f64,
    pub turn_deg: f64,
    /// Slide of the key that the proof assumes, if it needs one, mm.
    pub slid_mm: Option<f64>,
}

/// Inequality of a row: a linear form of the unknowns is at most `most_mm`.
struct Row {
    /// Unknowns with their factors.
    factors: Vec<(usize, f64)>,
    most_mm: f64,
}

/// Play of the free pieces, if the multipliers prove it.
pub fn test(kit: &Kit<'_>, claim: &Bounded) -> Result<Play, String> {
    claim.test_form(kit.meshes.len())?;
    let n_rows = claim.rows.len();
    let row = |(i, row): (usize, &[usize; 3])| claim.row(kit, row).map_err(|why| format!("row {i}: {why}"));
    let mut rows = claim
        .rows
        .iter()
        .enumerate()
        .map(row)
        .collect::<Result<Vec<Row>, String>>()?;
    let mut named = claim.multipliers.iter().flatten().flatten().flatten();
    let is_slide_named = named.any(|(row, _)| *row == n_rows);
    if is_slide_named {
        rows.push(claim.slide_row(kit)?);
    }
    for (q, of_axes) in claim.multipliers.iter().enumerate() {
        for (axis, sides) in of_axes.iter().enumerate() {
            for (side, named) in sides.iter().enumerate() {
                claim.test_bound(&rows, [q, axis, side], named)?;
            }
        }
    }
    let farthest = |k: usize| {
        claim
            .of_piece
            .iter()
            .map(|q| claim.quantities[q[k]].norm())
            .fold(0.0, f64::max)
    };
    // The stated play is that of a centroid, wherever displacements are bounded.
    let of_centroid = |(&piece, &[turn, shift]): (&usize, &[usize; 2])| {
        let (turn, shift) = (&claim.quantities[turn], &claim.quantities[shift]);
        let off_mm = shift
            .at
            .map_or(0.0, |at| distance(at, kit.meshes[piece].centroid()));
        shift.norm() + turn.norm() * off_mm
    };
    let shift_mm = claim
        .free
        .iter()
        .zip(&claim.of_piece)
        .map(of_centroid)
        .fold(0.0, f64::max);
    let slid_mm = kit.slide.filter(|_| is_slide_named).map(|s| s.most_mm);
    Ok(Play {
        shift_mm,
        turn_deg: farthest(0).to_degrees(),
        slid_mm,
    })
}

impl Bounded {
    /// Index of a piece among the free ones.
    fn place(&self, piece: usize) -> Option<usize> {
        self.free.binary_search(&piece).ok()
    }

    /// Returns the piece if it is free.
    fn if_free(&self, piece: usize) -> Option<usize> {
        self.place(piece).map(|_| piece)
    }

    /// Checks that all indices are valid, and that the quantities include each piece's rotation and
    /// displacement.
    fn test_form(&self, n_pieces: usize) -> Result<(), String> {
        let n = self.quantities.len();
        let is_ascending = self.free.windows(2).all(|pair| pair[0] < pair[1]);
        if !is_ascending || self.free.last().is_none_or(|last| *last >= n_pieces) {
            return Err("the free pieces are not some pieces in ascending order".into());
        }
        for (i, quantity) in self.quantities.iter().enumerate() {
            quantity
                .test(&self.free)
                .map_err(|why| format!("quantity {i} {why}"))?;
        }
        let is_of = |q: usize, piece: usize, is_turn: bool| {
            let is_it = |q: &Quantity| (q.plus, q.minus, q.at.is_none()) == (Some(piece), None, is_turn);
            self.quantities.get(q).is_some_and(is_it)
        };
        let mut own = self.free.iter().zip(&self.of_piece);
        let are_own =
            own.all(|(&piece, &[turn, shift])| is_of(turn, piece, true) && is_of(shift, piece, false));
        if self.of_piece.len() != self.free.len() || !are_own {
            return Err("a free piece has no bounds of its turn and displacement".into());
        }
        if self.rows.iter().any(|row| row[1].max(row[2]) >= n) {
            return Err("a row names no quantity".into());
        }
        let n_axes = self.quantities.iter().map(|q| q.axes.len());
        match self.multipliers.iter().map(Vec::len).eq(n_axes) {
            true => Ok(()),
            false => Err("a bound has no multipliers".into()),
        }
    }

    /// Greatest rotation of a piece, rad, and greatest displacement of its place `at`, mm; 0 for a piece at
    /// rest.
    fn most_of(&self, piece: usize, at: Vec3) -> [f64; 2] {
        let Some(i) = self.place(piece) else {
            return [0.0; 2];
        };
        let [turn, shift] = self.of_piece[i].map(|q| self.quantities[q].norm());
        [turn, shift + turn * distance(at, self.place_of(i))]
    }

    /// Place where the displacement of a free piece is an unknown.
    fn place_of(&self, i: usize) -> Vec3 {
        self.quantities[self.of_piece[i][1]].at.unwrap_or_default()
    }

    /// Displacement of `plus` relative to `minus` along `d` at a place, as factors of the unknowns; without a
    /// place, the rotation about `d`.
    fn factors(
        &self,
        plus: Option<usize>,
        minus: Option<usize>,
        at: Option<Vec3>,
        d: Vec3,
    ) -> Vec<(usize, f64)> {
        let mut factors = Vec::with_capacity(2 * UNKNOWNS);
        for (piece, sign) in [(plus, 1.0), (minus, -1.0)] {
            let Some(i) = piece.and_then(|piece| self.place(piece)) else {
                continue;
            };
            let parts = match at {
                Some(at) => [d, cross(sub(at, self.place_of(i)), d)],
                None => [[0.0; 3], d],
            };
            factors.extend((UNKNOWNS * i..).zip(parts.into_iter().flatten().map(|x| sign * x)));
        }
        factors
    }

    /// Inequality of a bearing: seen from its piece `b`, its point rises no higher than the barrier.
    fn row(&self, kit: &Kit<'_>, &[bearing, cell, turn]: &[usize; 3]) -> Result<Row, String> {
        let b = kit.bearings.get(bearing).ok_or("there is no such bearing")?;
        let (freed_a, freed_b) = (self.if_free(b.a), self.if_free(b.b));
        if freed_a.is_none() && freed_b.is_none() {
            return Err(format!("pieces {} and {} are at rest", b.a, b.b));
        }
        let [cell, turn] = [cell, turn].map(|q| &self.quantities[q]);
        let (Some(at), None) = (cell.at, turn.at) else {
            return Err("has no displacement and turn".into());
        };
        let signs = cell.sign(freed_a, freed_b).zip(turn.sign(freed_a, freed_b));
        let Some((of_cell, of_turn)) = signs else {
            return Err(format!("its quantities are not of pieces {} and {}", b.a, b.b));
        };
        let off = sub(b.point, at);
        let most_turn = turn.norm();
        let most_mm = cell.norm() + most_turn * norm(off);
        // If `b` is at rest, the displacement of `a` is that of the cell; if `a` is, it is 0.
        let of_a_mm = if freed_b.is_none() {
            most_mm
        } else {
            self.most_of(b.a, b.point)[1]
        };
        let error_mm = 0.5 * self.most_of(b.b, b.point)[0] * most_mm + 0.5 * most_turn * of_a_mm;
        let far_mm = b.frame().sides().map(|side| {
            let turned_mm = turn.most_along(scale(cross(off, side), of_turn));
            cell.most_along(scale(side, of_cell)) + turned_mm + error_mm + ROUNDING_MM
        });
        let rise_mm = rise_mm(&kit.meshes[b.b], &Prism::new(b.frame(), far_mm))?;
        let factors = self.factors(freed_a, freed_b, Some(b.point), b.normal);
        Ok(Row {
            factors,
            most_mm: rise_mm + error_mm,
        })
    }

    /// Inequality of the slide: the key moves out of its seat by no more than the claimed slide. Fails if the
    /// key is not among the free pieces.
    fn slide_row(&self, kit: &Kit<'_>) -> Result<Row, String> {
        let slide = kit.slide.ok_or("there is no slide to bound it")?;
        slide.test(kit)?;
        if self.place(slide.key).is_none() {
            return Err("the slide is that of a key at rest".into());
        }
        let ([key, key_mm], [seat, seat_mm]) = (
            self.most_of(slide.key, slide.at),
            self.most_of(slide.seat, slide.at),
        );
        let error_mm = 0.5 * seat * (key_mm + seat_mm) + 0.5 * (key + seat) * key_mm;
        let factors = self.factors(
            self.if_free(slide.key),
            self.if_free(slide.seat),
            Some(slide.at),
            slide.along,
        );
        Ok(Row {
            factors,
            most_mm: slide.most_mm + error_mm,
        })
    }

    /// Checks that the named rows bound a quantity along an axis (side 1) or against it (0), below its stated
    /// bound.
    fn test_bound(
        &self,
        rows: &[Row],
        [q, axis, side]: [usize; 3],
        named: &[(usize, f64)],
    ) -> Result<(), String> {
        let quantity = &self.quantities[q];
        let mut rest = vec![0.0; UNKNOWNS * self.free.len()];
        let towards = scale(quantity.axes[axis], if side == 1 { 1.0 } else { -1.0 });
        let objective = self.factors(quantity.plus, quantity.minus, quantity.at, towards);
        objective.into_iter().for_each(|(k, x)| rest[k] -= x);
        let mut value = 0.0;
        for &(row, multiplier) in named {
            let row = rows.get(row).ok_or("a multiplier of no row")?;
            if !(multiplier >= 0.0 && multiplier.is_finite()) {
                return Err(format!("a multiplier of quantity {q} is {multiplier}"));
            }
            row.factors.iter().for_each(|&(k, x)| rest[k] += multiplier * x);
            value += multiplier * row.most_mm;
        }
        for (&[turn, shift], rest) in self.of_piece.iter().zip(rest.chunks(UNKNOWNS)) {
            let sum = |part: &[f64]| part.iter().map(|x| x.abs()).sum::<f64>();
            value += sum(&rest[..3]) * self.quantities[shift].norm()
                + sum(&rest[3..]) * self.quantities[turn].norm();
        }
        let (value, most) = (value * (1.0 + ROUNDING) + ROUNDING, quantity.most[axis][side]);
        match value < most {
            true => Ok(()),
            false => Err(format!(
                "quantity {q} goes to {value:.6} along axis {axis}, beyond {most:.6}"
            )),
        }
    }
}

impl Slide {
    /// Checks that the slide is that of the key along its way out, measured at the key.
    fn test(&self, kit: &Kit<'_>) -> Result<(), String> {
        let Self {
            key,
            seat,
            at,
            along,
            most_mm,
        } = self;
        if *key != kit.key || seat == key || *seat >= kit.meshes.len() {
            return Err("the slide is not that of the key against another piece".into());
        }
        let is_way_out = kit
            .way_out
            .is_some_and(|way_out| distance(way_out, *along) <= SAME_WAY);
        if !is_way_out || (dot(*along, *along) - 1.0).abs() > SAME_WAY {
            return Err("the slide is not along the key's way out".into());
        }
        if !kit.meshes[*key].is_in_bounds(*at, AROUND_KEY_MM) {
            return Err("the slide is not measured at the key".into());
        }
        match (0.0..=MOST_SLIDE_MM).contains(most_mm) {
            true => Ok(()),
            false => Err(format!(
                "a slide of {most_mm} mm; up to {MOST_SLIDE_MM} mm count as play"
            )),
        }
    }
}

#[cfg(test)]
mod tests;
