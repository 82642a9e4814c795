//! How far pieces move within their gaps: the greatest `c · x` with `A x ≤ g`.
//!
//! From `x = 0`, which gaps of 0 or more allow, along the objective's part that no active contact opposes, to the next
//! contact, which becomes active; where no such part is left, the contact that pulls is given up, until all push. That is
//! the simplex method on the polyhedron of allowed motions; the next objective goes on from the corner of the last one.

use nalgebra::DVector;

use super::forces::Active;
use super::system::System;

/// Share of the objective, or of a row, that counts as none.
const FLAT: f64 = 1e-9;
/// Rounds for each unknown before the search ends with what it has; measured kits need three.
const ROUNDS: usize = 30;

/// An allowed motion and the contacts that end it.
pub(crate) struct Corner {
    x: DVector<f64>,
    active: Active,
}

impl Corner {
    /// At rest.
    pub fn at_rest(system: &System) -> Self {
        Self { x: DVector::zeros(system.n), active: Active::default() }
    }
}

impl System {
    /// The greatest `objective · x` where contact rows stay below `gaps_mm` (one a row, ≥ 0); `None` where it has no end.
    ///
    /// Begins at `corner` and leaves it at the motion found.
    pub fn farthest(&self, objective: &DVector<f64>, gaps_mm: &[f64], corner: &mut Corner) -> Option<f64> {
        let mut is_refused = vec![false; self.rows.len()];
        let Corner { x, active } = corner;
        for _ in 0..ROUNDS * self.n {
            let (way, forces) = self.unopposed(objective, active);
            if way.norm() <= FLAT * objective.norm() {
                let most = forces.iter().fold(0.0, |m: f64, f| m.max(f.abs()));
                let pulling = (0..forces.len()).min_by(|&i, &k| forces[i].total_cmp(&forces[k]));
                match pulling.filter(|&i| forces[i] < -FLAT * most) {
                    Some(i) => active.remove(i),
                    None => break,
                }
                is_refused.fill(false);
                continue;
            }
            active.rows.iter().for_each(|&row| is_refused[row] = true);
            let (row, step) = self.next_contact(x, &way, gaps_mm, &is_refused)?;
            x.axpy(step, &way, 1.0);
            if active.push(self, row) {
                is_refused.fill(false);
            } else {
                is_refused[row] = true;
            }
        }
        Some(objective.dot(x))
    }

    /// The part of the objective along which no active contact moves, and the forces of these contacts that oppose the
    /// rest of it.
    fn unopposed(&self, objective: &DVector<f64>, active: &Active) -> (DVector<f64>, Vec<f64>) {
        let (mut way, mut forces) = (objective.clone(), vec![0.0; active.rows.len()]);
        // The second round takes out the first one's rounding.
        for _ in 0..2 {
            let products: Vec<f64> = active.rows.iter().map(|&row| self.dot(&self.rows[row], &way)).collect();
            let change = active.backward(&active.forward(&products));
            for ((&row, force), change) in active.rows.iter().zip(&mut forces).zip(change) {
                self.add(&self.rows[row], -change, &mut way);
                *force += change;
            }
        }
        (way, forces)
    }

    /// The row that `x + step way` reaches first, and the step.
    fn next_contact(
        &self,
        x: &DVector<f64>,
        way: &DVector<f64>,
        gaps_mm: &[f64],
        is_refused: &[bool],
    ) -> Option<(usize, f64)> {
        let least_speed = FLAT * way.norm();
        let mut next: Option<(usize, f64)> = None;
        for (i, row) in self.rows.iter().enumerate().filter(|(i, _)| !is_refused[*i]) {
            let speed = self.dot(row, way);
            if speed > least_speed {
                let step = (gaps_mm[i] - self.dot(row, x)).max(0.0) / speed;
                if next.is_none_or(|(_, least)| step < least) {
                    next = Some((i, step));
                }
            }
        }
        next
    }
}
