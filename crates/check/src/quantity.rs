//! Bounded quantities: rotations and displacements of a piece, or of one relative to another.

use serde::Deserialize;

use crate::vector::{Vec3, distance, dot, norm, scale};

/// Tolerance for unit vectors, for perpendicularity, and for directions that are written out.
const SAME: f64 = 1e-9;
/// Greatest rotation that is accepted, rad.
const MOST_TURN: f64 = 0.5;
/// Number of lines along directions with coordinates −1, 0 or 1.
const LINES: usize = 13;
/// Greatest length of a vector whose component along each of these lines is at most 1:
/// `√(1 + (√2 − 1)² + (√3 − √2)²)`, rounded up.
const BETWEEN_LINES: f64 = 1.1281;

/// Vector that is linear in the logarithms of the poses, with its bounds.
#[derive(Clone, Deserialize)]
pub struct Quantity {
    /// Free piece that counts as positive, and below the one that counts as negative; `None` for one at rest.
    #[serde(deserialize_with = "crate::number::place_if_any")]
    pub plus: Option<usize>,
    #[serde(deserialize_with = "crate::number::place_if_any")]
    pub minus: Option<usize>,
    /// Place of a displacement, mm; `None` for a rotation, rad.
    pub at: Option<Vec3>,
    /// Unit vectors; the first three are perpendicular.
    pub axes: Vec<Vec3>,
    /// Bounds against each axis and along it, mm or rad, above 0.
    pub most: Vec<[f64; 2]>,
}

/// Returns true if two unit vectors lie along the same line.
fn is_along(axis: Vec3, line: Vec3) -> bool {
    distance(axis, line) <= SAME || distance(axis, scale(line, -1.0)) <= SAME
}

impl Quantity {
    /// Checks the form. An error if the pieces are not among `free`, or the quantity is not well formed.
    pub fn test(&self, free: &[usize]) -> Result<(), String> {
        let is_free = |id: Option<usize>| id.is_none_or(|id| free.binary_search(&id).is_ok());
        if !is_free(self.plus) || !is_free(self.minus) || self.plus == self.minus {
            return Err("is not one of free pieces".into());
        }
        let n = self.axes.len();
        let is_unit = |axis: &Vec3| (norm(*axis) - 1.0).abs() <= SAME;
        if n < 3 || self.most.len() != n || !self.axes.iter().all(is_unit) {
            return Err("has not three axes or more of length 1, with a bound each".into());
        }
        if ![[0, 1], [1, 2], [2, 0]]
            .iter()
            .all(|&[i, j]| dot(self.axes[i], self.axes[j]).abs() <= SAME)
        {
            return Err("has axes that are not perpendicular".into());
        }
        if !self.most.iter().flatten().all(|m| *m > 0.0 && m.is_finite()) {
            return Err("has a bound that is not above 0".into());
        }
        if self.at.is_some_and(|at| !norm(at).is_finite()) || (self.at.is_none() && self.norm() >= MOST_TURN)
        {
            return Err("is a turn, or a place, that is too far".into());
        }
        Ok(())
    }

    /// Upper bound on the length of all vectors within the bounds, mm or rad.
    pub fn norm(&self) -> f64 {
        let longer = |[low, high]: &[f64; 2]| low.max(*high);
        let of_box = self
            .most
            .iter()
            .take(3)
            .map(|m| longer(m).powi(2))
            .sum::<f64>()
            .sqrt();
        if !self.covers_lines() {
            return of_box;
        }
        of_box.min(BETWEEN_LINES * self.most.iter().map(longer).fold(0.0, f64::max))
    }

    /// Returns true if the axes cover all lines along directions with coordinates −1, 0 or 1.
    fn covers_lines(&self) -> bool {
        let is_covered = |line: Vec3| {
            self.axes
                .iter()
                .any(|axis| is_along(*axis, scale(line, 1.0 / norm(line))))
        };
        let digits = |i: usize| [i % 3, i / 3 % 3, i / 9].map(|digit| digit as f64 - 1.0);
        // The numbers below the middle one, which is no direction, give one direction along each line.
        self.axes.len() >= LINES && (0..LINES).map(digits).all(is_covered)
    }

    /// Upper bound on the component along `t`, a vector of any length. The first three axes are
    /// perpendicular, so the bounds form a box around the origin.
    pub fn most_along(&self, t: Vec3) -> f64 {
        let part = |(axis, [low, high]): (&Vec3, &[f64; 2])| {
            let share = dot(*axis, t);
            if share > 0.0 { share * high } else { -share * low }
        };
        self.axes.iter().zip(&self.most).take(3).map(part).sum()
    }

    /// Sign of the quantity: 1 if it is `a` relative to `b`, −1 if `b` relative to `a`; an argument is `None`
    /// for a piece at rest. Returns `None` for other pieces.
    pub fn sign(&self, a: Option<usize>, b: Option<usize>) -> Option<f64> {
        match (self.plus, self.minus) {
            pair if pair == (a, b) => Some(1.0),
            pair if pair == (b, a) => Some(-1.0),
            _ => None,
        }
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Quantity with equal bounds along each coordinate axis.
    pub fn cube(plus: Option<usize>, minus: Option<usize>, at: Option<Vec3>, most: f64) -> Quantity {
        let axes = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Quantity {
            plus,
            minus,
            at,
            axes,
            most: vec![[most; 2]; 3],
        }
    }

    #[test]
    fn a_box_tells_its_longest_vector_and_how_far_it_goes_along_any() {
        let mut q = cube(Some(1), None, Some([0.0; 3]), 1.0);
        q.most[0] = [2.0, 3.0];
        assert!((q.norm() - 11.0_f64.sqrt()).abs() < 1e-12);
        assert!((q.most_along([2.0, -1.0, 0.0]) - 7.0).abs() < 1e-12);
        assert!((q.most_along([-2.0, 0.0, 0.5]) - 4.5).abs() < 1e-12);
    }

    #[test]
    fn thirteen_lines_tell_a_shorter_one_and_no_vector_is_longer() {
        let mut q = cube(Some(1), None, None, 0.1);
        for i in 0..13_i32 {
            let line = [i % 3, i / 3 % 3, i / 9].map(|digit| f64::from(digit - 1));
            if line.iter().map(|x| x.abs()).sum::<f64>() > 1.0 {
                q.axes.push(line.map(|x| x / norm(line)));
                q.most.push([0.1; 2]);
            }
        }
        assert_eq!(q.axes.len(), LINES);
        assert!((q.norm() - 0.11281).abs() < 1e-12);
        let way = |i: i32| [1.7, 2.3, 0.9].map(|f| (f * f64::from(i) + f).sin());
        for d in (0..20_000)
            .map(way)
            .chain([[1.0, 2.0_f64.sqrt() - 1.0, 3.0_f64.sqrt() - 2.0_f64.sqrt()]])
        {
            let most = q.axes.iter().map(|axis| dot(*axis, d).abs()).fold(0.0, f64::max);
            assert!(norm(d) <= BETWEEN_LINES * most, "{d:?}");
        }
        q.axes[12] = q.axes[11];
        assert!((q.norm() - 0.03_f64.sqrt()).abs() < 1e-12, "a line is missing");
    }

    #[test]
    fn what_is_badly_formed_or_of_pieces_at_rest_is_refused() {
        let good = cube(Some(1), None, None, 0.1);
        assert!(good.test(&[1, 2]).is_ok());
        assert!(good.test(&[2]).is_err(), "at rest");
        assert!(cube(None, None, None, 0.1).test(&[1]).is_err());
        assert!(
            cube(Some(1), None, None, 0.3).test(&[1]).is_err(),
            "turned by more than 0.5"
        );
        assert!(cube(Some(1), None, None, f64::NAN).test(&[1]).is_err());
        let slanted = |axis: Vec3| Quantity {
            axes: vec![axis, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            ..good.clone()
        };
        assert!(slanted([1.1, 0.0, 0.0]).test(&[1]).is_err());
        assert!(slanted([0.6, 0.8, 0.0]).test(&[1]).is_err());
        assert_eq!(
            [
                good.sign(Some(1), None),
                good.sign(None, Some(1)),
                good.sign(Some(1), Some(2))
            ],
            [Some(1.0), Some(-1.0), None]
        );
    }
}
