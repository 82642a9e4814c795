//! Contact forces that balance a load as far as pushing can: non-negative least squares [LawsonHanson1974,
//! ch. 23] on a Cholesky factor of the active contacts, which are never more than the unknowns.

use nalgebra::DVector;

use super::system::{Row, System};

/// Greatest violation of a contact, relative to the motion, at which the search for contacts to add ends.
const VIOLATION: f64 = 1e-6;
/// Least share of a contact outside the span of the active ones; a smaller share adds only rounding errors.
const INDEPENDENT: f64 = 1e-9;
/// Rounds for each unknown before the search ends undecided, which counts as a motion. It guards against
/// endless rounds due to rounding. The number that real assemblies need has not been measured.
const ROUNDS: usize = 30;

/// Contact forces `μ ≥ 0`, and the rest of the load that they leave.
pub(crate) struct Balance {
    /// Rows with their forces, all positive; the rows are independent.
    pub forces: Vec<(usize, f64)>,
    /// Rest `load + Aᵀμ`, the least that contacts can leave of the load.
    pub rest: DVector<f64>,
}

impl System {
    /// Finds the forces that leave the least rest of `load`. Ends as soon as the rest's components sum to no
    /// more than `enough`.
    pub fn balance(&self, load: &DVector<f64>, enough: f64) -> Balance {
        let mut active = Active::default();
        let mut rest = load.clone();
        let mut is_refused = vec![false; self.rows.len()];
        for _ in 0..ROUNDS * self.n {
            if rest.lp_norm(1) <= enough {
                break;
            }
            let Some(entering) = self.worst_violation(&rest, &is_refused) else {
                break;
            };
            if !active.push(self, entering) {
                is_refused[entering] = true;
                continue;
            }
            is_refused.fill(false);
            let left_at_once = active.solve(self, load, entering);
            if left_at_once {
                // Due to rounding, the contact that should have gained a force lost it. The next one may do
                // better.
                is_refused[entering] = true;
            }
            rest.copy_from(load);
            for (&row, &force) in active.rows.iter().zip(&active.forces) {
                self.add(&self.rows[row], force, &mut rest);
            }
        }
        Balance {
            forces: active.rows.into_iter().zip(active.forces).collect(),
            rest,
        }
    }

    /// Row along which `−rest` violates its contact most, relative to the row's length.
    fn worst_violation(&self, rest: &DVector<f64>, is_refused: &[bool]) -> Option<usize> {
        let limit = -VIOLATION * rest.norm();
        let violation = |row: &Row| self.dot(row, rest) / self.dot_rows(row, row).sqrt();
        let open = self.rows.iter().enumerate().filter(|(i, _)| !is_refused[*i]);
        let worst = open
            .map(|(i, row)| (i, violation(row)))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        (worst.1 < limit).then_some(worst.0)
    }
}

/// Contacts that carry force, and the Cholesky factor of their products `A_P A_Pᵀ`.
#[derive(Default)]
pub(super) struct Active {
    pub(super) rows: Vec<usize>,
    forces: Vec<f64>,
    /// Lower triangular factor; row `i` has `i + 1` entries.
    lower: Vec<Vec<f64>>,
}

impl Active {
    /// Adds a row with no force. Returns `false` and adds nothing if the row depends on the others.
    pub(super) fn push(&mut self, system: &System, entering: usize) -> bool {
        let row = &system.rows[entering];
        let products: Vec<f64> = self
            .rows
            .iter()
            .map(|&p| system.dot_rows(row, &system.rows[p]))
            .collect();
        let mut line = self.forward(&products);
        let whole = system.dot_rows(row, row);
        let rest = whole - line.iter().map(|x| x * x).sum::<f64>();
        if rest <= INDEPENDENT * whole {
            return false;
        }
        line.push(rest.sqrt());
        self.lower.push(line);
        self.rows.push(entering);
        self.forces.push(0.0);
        true
    }

    /// Moves the forces to the least-squares solution, and drops rows whose force would become negative.
    /// Returns true if `entering` was the first to be dropped.
    fn solve(&mut self, system: &System, base: &DVector<f64>, entering: usize) -> bool {
        let mut entering_left = false;
        let mut is_first = true;
        while !self.rows.is_empty() {
            let against: Vec<f64> = self
                .rows
                .iter()
                .map(|&p| -system.dot(&system.rows[p], base))
                .collect();
            let target = self.backward(&self.forward(&against));
            let share = |i: usize| self.forces[i] / (self.forces[i] - target[i]);
            let leaving = (0..target.len())
                .filter(|&i| target[i] <= 0.0)
                .map(|i| (i, share(i)));
            let Some((leaving, share)) = leaving.min_by(|a, b| a.1.total_cmp(&b.1)) else {
                self.forces = target;
                break;
            };
            let share = if share.is_finite() {
                share.clamp(0.0, 1.0)
            } else {
                0.0
            };
            self.forces
                .iter_mut()
                .zip(&target)
                .for_each(|(force, to)| *force += share * (to - *force));
            entering_left |= is_first && self.rows[leaving] == entering;
            is_first = false;
            self.remove(leaving);
        }
        entering_left
    }

    /// Solves with the lower triangular factor.
    pub(super) fn forward(&self, right: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = Vec::with_capacity(right.len() + 1);
        for (line, b) in self.lower.iter().zip(right) {
            let known: f64 = line.iter().zip(&y).map(|(l, y)| l * y).sum();
            y.push((b - known) / line[line.len() - 1]);
        }
        y
    }

    /// Solves with the transposed factor.
    pub(super) fn backward(&self, right: &[f64]) -> Vec<f64> {
        let mut x = right.to_vec();
        for i in (0..x.len()).rev() {
            x[i] /= self.lower[i][i];
            let known = x[i];
            x[..i]
                .iter_mut()
                .zip(&self.lower[i])
                .for_each(|(x, l)| *x -= l * known);
        }
        x
    }

    /// Removes row `at` from the factor; Givens rotations make it triangular again.
    pub(super) fn remove(&mut self, at: usize) {
        self.rows.remove(at);
        self.forces.remove(at);
        self.lower.remove(at);
        for i in at..self.lower.len() {
            let (p, q) = (self.lower[i][i], self.lower[i][i + 1]);
            let length = p.hypot(q);
            let (cos, sin) = (p / length, q / length);
            for line in &mut self.lower[i..] {
                let (x, y) = (line[i], line[i + 1]);
                (line[i], line[i + 1]) = (cos * x + sin * y, cos * y - sin * x);
            }
            self.lower[i].pop();
        }
    }
}
