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
/// By how much a contact's gap may be overdrawn, mm: far below what is told.
const OVERDRAWN_MM: f64 = 1e-5;
/// Contacts that are added at once, the most overdrawn first.
const ADDED: usize = 40;
/// Rounds for each unknown before the search ends with what it has.
const ROUNDS: usize = 300;

/// An allowed motion and the contacts that end it.
///
/// Few of many thousand contacts ever end a motion: only those that once did, or would have been overdrawn, are looked at
/// in every step. They stay for the next objective.
pub(crate) struct Corner {
    x: DVector<f64>,
    active: Active,
    looked_at: Vec<usize>,
    is_looked_at: Vec<bool>,
}

impl Corner {
    /// At rest.
    pub fn at_rest(system: &System) -> Self {
        let is_looked_at = vec![false; system.rows.len()];
        Self { x: DVector::zeros(system.n), active: Active::default(), looked_at: Vec::new(), is_looked_at }
    }

    fn look_at(&mut self, row: usize) {
        if !std::mem::replace(&mut self.is_looked_at[row], true) {
            self.looked_at.push(row);
        }
    }
}

impl System {
    /// The greatest `objective · x` where contact rows stay below `gaps_mm` (one a row, ≥ 0); `None` where it has no end.
    ///
    /// Begins at `corner` and leaves it at the motion found.
    pub fn farthest(&self, objective: &DVector<f64>, gaps_mm: &[f64], corner: &mut Corner) -> Option<f64> {
        let mut is_refused = vec![false; self.rows.len()];
        for _ in 0..ROUNDS * self.n {
            let (way, forces) = self.unopposed(objective, &corner.active);
            if way.norm() <= FLAT * objective.norm() {
                let most = forces.iter().fold(0.0, |m: f64, f| m.max(f.abs()));
                let pulling = (0..forces.len()).min_by(|&i, &k| forces[i].total_cmp(&forces[k]));
                is_refused.fill(false);
                match pulling.filter(|&i| forces[i] < -FLAT * most) {
                    Some(i) => corner.active.remove(i),
                    None if self.draw_back(gaps_mm, corner) => {}
                    None => break,
                }
                continue;
            }
            corner.active.rows.iter().for_each(|&row| is_refused[row] = true);
            let known = self.next_contact(&corner.looked_at, &corner.x, &way, gaps_mm, &is_refused);
            let (row, step) = match known {
                Some(found) => found,
                None => {
                    let all: Vec<usize> = (0..self.rows.len()).collect();
                    self.next_contact(&all, &corner.x, &way, gaps_mm, &is_refused)?
                }
            };
            corner.look_at(row);
            corner.x.axpy(step, &way, 1.0);
            if corner.active.push(self, row) {
                is_refused.fill(false);
            } else {
                is_refused[row] = true;
            }
        }
        Some(objective.dot(&corner.x))
    }

    /// Where the motion overdraws contacts that were not looked at, takes it back towards rest until it does not. Whether
    /// there were any.
    fn draw_back(&self, gaps_mm: &[f64], corner: &mut Corner) -> bool {
        let moved = |row: usize| self.dot(&self.rows[row], &corner.x);
        let mut overdrawn: Vec<(f64, usize)> =
            (0..self.rows.len()).map(|row| (moved(row) - gaps_mm[row], row)).filter(|o| o.0 > OVERDRAWN_MM).collect();
        overdrawn.retain(|&(_, row)| !corner.is_looked_at[row]);
        if overdrawn.is_empty() {
            return false;
        }
        let share = overdrawn.iter().map(|&(by_mm, row)| gaps_mm[row] / (gaps_mm[row] + by_mm)).fold(1.0, f64::min);
        overdrawn.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        overdrawn.iter().take(ADDED).for_each(|&(_, row)| corner.look_at(row));
        corner.x *= share;
        corner.active = Active::default();
        true
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

    /// The row of `among` that `x + step way` reaches first, and the step.
    fn next_contact(
        &self,
        among: &[usize],
        x: &DVector<f64>,
        way: &DVector<f64>,
        gaps_mm: &[f64],
        is_refused: &[bool],
    ) -> Option<(usize, f64)> {
        let least_speed = FLAT * way.norm();
        let mut next: Option<(usize, f64)> = None;
        for &i in among.iter().filter(|&&i| !is_refused[i]) {
            let row = &self.rows[i];
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
