//! Contacts as linear inequalities on velocities.

use nalgebra::{DMatrix, DVector};
use shellock_geom::Vec3;

use super::Contact;
use super::{Freedom, Twist};
use crate::PatchId;

/// Share of the fastest component from which a piece counts as moving.
const MOVES: f64 = 0.05;

/// One contact as a row of `A`: `wrench` at the columns of `plus`, its opposite at those of `minus`.
pub(crate) struct Row {
    /// Index in the list of contacts.
    pub contact: usize,
    /// First unknown of `a`; `None` if `a` is held.
    pub(super) plus: Option<usize>,
    /// First unknown of `b`; `None` if `b` is held.
    pub(super) minus: Option<usize>,
    /// Force and moment of the contact.
    pub(super) wrench: [f64; 6],
}

/// The contacts of some free pieces as inequalities `A x ≤ 0` on their velocities and scaled spins.
pub(crate) struct System {
    /// Number of unknowns of a piece: 3 or 6.
    dof: usize,
    /// Number of unknowns of all free pieces.
    pub n: usize,
    /// Rows, one for each contact with a free piece.
    pub rows: Vec<Row>,
}

impl System {
    /// Builds the system for `free`, in ascending order; `scale_mm` makes spins comparable to velocities.
    pub fn new(contacts: &[Contact], free: &[PatchId], scale_mm: f64, freedom: Freedom) -> Self {
        let dof = if freedom == Freedom::Rigid { 6 } else { 3 };
        let column = |id: PatchId| free.binary_search(&id).ok().map(|i| i * dof);
        let rows = contacts.iter().enumerate().map(|(contact, c)| {
            let spin = if freedom == Freedom::Rigid {
                c.point.cross(c.normal) / scale_mm
            } else {
                Vec3::ZERO
            };
            let ([x, y, z], [u, v, w]) = (c.normal.to_array(), spin.to_array());
            Row {
                contact,
                plus: column(c.a),
                minus: column(c.b),
                wrench: [x, y, z, u, v, w],
            }
        });
        let rows = rows.filter(|r| r.plus.is_some() || r.minus.is_some()).collect();
        Self {
            dof,
            n: free.len() * dof,
            rows,
        }
    }

    /// First unknown of the free piece at `position`.
    pub fn column(&self, position: usize) -> usize {
        position * self.dof
    }

    /// Product `a · x` of a row and a motion.
    pub fn dot(&self, row: &Row, x: &DVector<f64>) -> f64 {
        let part =
            |at: Option<usize>| at.map_or(0.0, |at| (0..self.dof).map(|k| row.wrench[k] * x[at + k]).sum());
        part(row.plus) - part(row.minus)
    }

    /// Adds `factor · a` to the vector `x`.
    pub fn add(&self, row: &Row, factor: f64, x: &mut DVector<f64>) {
        for (at, sign) in [(row.plus, 1.0), (row.minus, -1.0)] {
            if let Some(at) = at {
                (0..self.dof).for_each(|k| x[at + k] += sign * factor * row.wrench[k]);
            }
        }
    }

    /// Scalar product of two rows.
    pub fn dot_rows(&self, a: &Row, b: &Row) -> f64 {
        let product: f64 = (0..self.dof).map(|k| a.wrench[k] * b.wrench[k]).sum();
        let meets = |x: Option<usize>, y: Option<usize>| f64::from(u8::from(x.is_some() && x == y));
        product
            * (meets(a.plus, b.plus) + meets(a.minus, b.minus)
                - meets(a.plus, b.minus)
                - meets(a.minus, b.plus))
    }

    /// Gram matrix `Σ w a aᵀ` over the given rows `a` and weights `w`.
    pub fn gram<'a>(&self, rows: impl Iterator<Item = (&'a Row, f64)>) -> DMatrix<f64> {
        let mut gram = DMatrix::<f64>::zeros(self.n, self.n);
        for (row, weight) in rows {
            let blocks = [(row.plus, 1.0), (row.minus, -1.0)];
            for (at, sign) in blocks.iter().filter_map(|&(at, sign)| Some((at?, sign))) {
                for (to, other) in blocks.iter().filter_map(|&(to, other)| Some((to?, other))) {
                    for (i, wi) in row.wrench.iter().take(self.dof).enumerate() {
                        for (k, wk) in row.wrench.iter().take(self.dof).enumerate() {
                            gram[(at + i, to + k)] += weight * sign * other * wi * wk;
                        }
                    }
                }
            }
        }
        gram
    }

    /// Motions of the pieces that move, scaled so that the fastest component of all is 1.
    pub(super) fn twists(&self, x: &DVector<f64>, free: &[PatchId]) -> Vec<Twist> {
        let scale = 1.0 / x.amax().max(f64::MIN_POSITIVE);
        let part = |at: usize| Vec3::new(x[at], x[at + 1], x[at + 2]) * scale;
        let twist = |(i, &piece): (usize, &PatchId)| {
            let spin = if self.dof == 6 {
                part(i * self.dof + 3)
            } else {
                Vec3::ZERO
            };
            Twist {
                piece,
                velocity: part(i * self.dof),
                spin,
            }
        };
        let speed = |t: &Twist| t.velocity.abs().max_element().max(t.spin.abs().max_element());
        free.iter()
            .enumerate()
            .map(twist)
            .filter(|t| speed(t) > MOVES)
            .collect()
    }
}
