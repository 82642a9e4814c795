//! Static equilibrium of elastic parts in contact: contact forces and motions.
//!
//! The unknowns are the forces λ at the contact rows and the rigid motions α of the free parts. F is the sum
//! of the parts' compliances, B their rigid motions along the rows, d the displacement by the load alone, and
//! g the load's work on rigid motions:
//! ```text
//!     δ = F λ + B α + d      gap at the rows, male minus female; at walls, b minus a
//!     0 = Bᵀ λ + g           equilibrium of every free part
//!     along n: δ = 0         along ŝ and across walls: δ ≥ 0, λ ≥ 0, δ λ = 0         along u: λ = 0
//! ```

use shellock_geom::sparse::{SparseError, eliminate_first};

use super::rows::Law;

/// Compliance of every contact itself, as a share of the mean. It keeps the system definite where two rows
/// are redundant.
const CONTACT_COMPLIANCE: f64 = 1e-10;
/// Stiffness of springs between free parts and the ground, as a share of the contacts' stiffness. It is far
/// below the accuracy of any opening, yet gives each step of the active set a unique solution.
const GROUND_STIFFNESS: f64 = 1e-10;
/// Rounds without improvement of the active set, after which it changes one row at a time, which always
/// terminates.
const MAX_STALLED: usize = 4;
/// Rounds after which a contact problem counts as not converged; the measured ones end within 12.
const MAX_ROUNDS: usize = 400;

/// Response of one part, as the contacts see it.
#[derive(Debug, Default)]
pub(super) struct Response {
    /// Contact rows of the assembly that touch the part, ascending.
    pub rows: Vec<usize>,
    /// Displacement along row i by a unit force along row j, mm/N, at `i + n j`, for i ≥ j.
    pub compliance: Vec<f64>,
    /// Displacement along each row by the load alone, mm.
    pub drift_mm: Vec<f64>,
    /// Displacement along each row by the part's rigid motions; zero where the part is held.
    pub rigid: Vec<[f64; 6]>,
    /// Work of the load on each rigid motion, N.
    pub rigid_load_n: [f64; 6],
    /// Index of the first of its six unknown motions among those of all free parts.
    pub first_motion: Option<usize>,
}

/// Contact forces and rigid motions in equilibrium.
#[derive(Debug)]
pub(super) struct Equilibrium {
    /// Force along each row, N.
    pub force_n: Vec<f64>,
    /// Rigid motions of the free parts, six for each.
    pub motion: Vec<f64>,
}

impl Response {
    fn row_place(&self, n_rows: usize) -> Vec<Option<usize>> {
        let mut place = vec![None; n_rows];
        for (i, &row) in self.rows.iter().enumerate() {
            place[row] = Some(i);
        }
        place
    }

    /// Displacement of the part along its rows, mm.
    pub fn displacement_mm(&self, equilibrium: &Equilibrium) -> Vec<f64> {
        let n = self.rows.len();
        let mut moved = self.drift_mm.clone();
        for (j, &row) in self.rows.iter().enumerate() {
            let force = equilibrium.force_n[row];
            for (i, moved) in moved.iter_mut().enumerate() {
                *moved += force * self.compliance[i.max(j) + n * i.min(j)];
            }
        }
        if let Some(first) = self.first_motion {
            for (moved, rigid) in moved.iter_mut().zip(&self.rigid) {
                *moved += rigid
                    .iter()
                    .zip(&equilibrium.motion[first..first + 6])
                    .map(|(r, a)| r * a)
                    .sum::<f64>();
            }
        }
        moved
    }
}

/// Dense symmetric system `K x = b`, with b as its last column, after elimination of its leading rows. Gives
/// their solution from that of the other rows.
struct Eliminated {
    values: Vec<f64>,
    n: usize,
    k: usize,
}

impl Eliminated {
    fn new(mut values: Vec<f64>, n: usize, k: usize) -> Result<Self, SparseError> {
        eliminate_first(&mut values, n, k)?;
        Ok(Self { values, n, k })
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j) + self.k, i.min(j) + self.k);
        self.values[i + self.n * j]
    }

    /// Solution of the eliminated unknowns, where the others are `rest`.
    fn back_substitute(&self, rest: &[f64]) -> Vec<f64> {
        let (n, k) = (self.n, self.k);
        let mut x: Vec<f64> = (0..k)
            .map(|i| {
                let below = &self.values[n * i + k..n * (i + 1)];
                below[rest.len()] - below.iter().zip(rest).map(|(l, r)| l * r).sum::<f64>()
            })
            .collect();
        for i in (0..k).rev() {
            let column = &self.values[n * i..n * i + k];
            let sum: f64 = (i + 1..k).map(|j| column[j] * x[j]).sum();
            x[i] = (x[i] - sum) / column[i];
        }
        x
    }
}

/// Solves the contact problem to the relative `tolerance`; `None` if the active set does not settle.
pub(super) fn solve(
    parts: &[Response],
    laws: &[Law],
    n_motions: usize,
    tolerance: f64,
) -> Result<Option<Equilibrium>, SparseError> {
    let of = |law: Law| (0..laws.len()).filter(move |i| laws[*i] == law);
    let order: Vec<usize> = of(Law::Both).chain(of(Law::Push)).collect();
    let n_both = of(Law::Both).count();
    let whole = Eliminated::new(
        system(parts, &order, laws.len(), n_motions),
        order.len() + n_motions + 1,
        n_both,
    )?;
    let Some((pushes, motion)) = active_set(&whole, order.len() - n_both, n_motions, tolerance)? else {
        return Ok(None);
    };
    let rest: Vec<f64> = pushes.iter().chain(&motion).copied().collect();
    let mut force_n = vec![0.0; laws.len()];
    for (&row, force) in order
        .iter()
        .zip(whole.back_substitute(&rest).into_iter().chain(pushes))
    {
        force_n[row] = force;
    }
    Ok(Some(Equilibrium { force_n, motion }))
}

/// System matrix `[F B −d; Bᵀ 0 −g; · · 0]` over the rows in `order`, lower triangle.
fn system(parts: &[Response], order: &[usize], n_rows: usize, n_motions: usize) -> Vec<f64> {
    let n = order.len() + n_motions + 1;
    let mut values = vec![0.0; n * n];
    for part in parts {
        let place = part.row_place(n_rows);
        let present: Vec<(usize, usize)> = order
            .iter()
            .enumerate()
            .filter_map(|(i, row)| place[*row].map(|p| (i, p)))
            .collect();
        for (j, &(column, p)) in present.iter().enumerate() {
            for &(row, q) in &present[j..] {
                values[row + n * column] += part.compliance[p.max(q) + part.rows.len() * p.min(q)];
            }
            values[n - 1 + n * column] -= part.drift_mm[p];
            if let Some(first) = part.first_motion {
                for m in 0..6 {
                    values[order.len() + first + m + n * column] = part.rigid[p][m];
                }
            }
        }
        if let Some(first) = part.first_motion {
            for m in 0..6 {
                values[n - 1 + n * (order.len() + first + m)] = -part.rigid_load_n[m];
            }
        }
    }
    let mean = (0..order.len()).map(|i| values[i * (n + 1)]).sum::<f64>() / order.len().max(1) as f64;
    for i in 0..order.len() {
        values[i * (n + 1)] += CONTACT_COMPLIANCE * mean;
    }
    values
}

/// Forces along rows, N, and rigid motions.
type ForcesAndMotions = (Vec<f64>, Vec<f64>);

/// Block principal pivoting. Returns the forces along the unilateral rows, and the rigid motions.
///
/// All wrong rows change sides at once, until that no longer helps; then only the last wrong one does.
fn active_set(
    whole: &Eliminated,
    n_pushes: usize,
    n_motions: usize,
    tolerance: f64,
) -> Result<Option<ForcesAndMotions>, SparseError> {
    let mut is_active = vec![false; n_pushes];
    let (mut fewest_wrong, mut stalled) = (usize::MAX, 0);
    for _round in 0..MAX_ROUNDS {
        let active: Vec<usize> = (0..n_pushes).filter(|i| is_active[*i]).collect();
        let (force, motion) = with_active(whole, &active, n_pushes, n_motions)?;
        let mut pushes = vec![0.0; n_pushes];
        for (&i, f) in active.iter().zip(force) {
            pushes[i] = f;
        }
        let b = n_pushes + n_motions;
        let gaps: Vec<f64> = (0..n_pushes)
            .map(|i| {
                let by_force: f64 = active.iter().map(|&j| whole.at(i, j) * pushes[j]).sum();
                let by_motion: f64 = motion
                    .iter()
                    .enumerate()
                    .map(|(m, a)| whole.at(i, n_pushes + m) * a)
                    .sum();
                by_force + by_motion - whole.at(i, b)
            })
            .collect();
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let (force_bound, gap_bound) = (-tolerance * largest(&pushes), -tolerance * largest(&gaps));
        let wrong: Vec<usize> = (0..n_pushes)
            .filter(|&i| {
                if is_active[i] {
                    pushes[i] < force_bound
                } else {
                    gaps[i] < gap_bound
                }
            })
            .collect();
        let Some(&last) = wrong.last() else {
            return Ok(Some((pushes, motion)));
        };
        stalled = if wrong.len() < fewest_wrong {
            0
        } else {
            stalled + 1
        };
        fewest_wrong = fewest_wrong.min(wrong.len());
        for &i in if stalled > MAX_STALLED {
            std::slice::from_ref(&last)
        } else {
            &wrong[..]
        } {
            is_active[i] = !is_active[i];
        }
    }
    Ok(None)
}

/// Forces along the `active` rows, whose gaps are zero, and the rigid motions.
fn with_active(
    whole: &Eliminated,
    active: &[usize],
    n_pushes: usize,
    n_motions: usize,
) -> Result<(Vec<f64>, Vec<f64>), SparseError> {
    let picked: Vec<usize> = active
        .iter()
        .copied()
        .chain(n_pushes..=n_pushes + n_motions)
        .collect();
    let gather = |picked: &[usize], from: &Eliminated| {
        let n = picked.len();
        (0..n * n)
            .map(|at| {
                if at % n >= at / n {
                    from.at(picked[at % n], picked[at / n])
                } else {
                    0.0
                }
            })
            .collect()
    };
    let forces = Eliminated::new(gather(&picked, whole), picked.len(), active.len())?;
    // The Schur complement for the motions is negative definite: contact resists them.
    let n = n_motions + 1;
    let mut coarse: Vec<f64> = gather(&(0..n).collect::<Vec<_>>(), &forces);
    // While no row is active, a single contact sets the scale.
    let compliance: f64 = (0..n_pushes).map(|i| whole.at(i, i)).sum();
    let contact_n_mm = if compliance > 0.0 {
        n_pushes as f64 / compliance
    } else {
        0.0
    };
    let stiffest = (0..n_motions).fold(contact_n_mm, |m, i| m.max(-coarse[i * (n + 1)]));
    for column in 0..n_motions {
        for row in column..n_motions {
            coarse[row + n * column] = -coarse[row + n * column];
        }
        coarse[n_motions + n * column] = -coarse[n_motions + n * column];
        coarse[column * (n + 1)] += GROUND_STIFFNESS * stiffest;
    }
    let motion = Eliminated::new(coarse, n, n_motions)?.back_substitute(&[]);
    Ok((forces.back_substitute(&motion), motion))
}
