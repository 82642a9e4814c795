//! Proofs that contacts allow no motion, which need no solver to be checked.
//!
//! The contacts of some free pieces allow the motions `x` with `A x ≤ 0` ([`crate::verify::motion`]). A proof is a positive
//! multiplier `μ` for some of them. With `D = diag(min(μ, 1))`, let
//!
//! ```text
//!  residual ≥ |Aᵀμ|        how far the multipliers, as forces, are from equilibrium
//!  hold     ≤ σ_min(D A)   by how much every unit motion closes or opens contacts, weighted
//! ```
//!
//! *If `residual < hold`, then `x = 0` is the only solution of `A x ≤ 0`.* For such an `x`, all entries of `A x` are ≤ 0, so
//! `−μᵀA x = Σ μᵢ |aᵢ x|`, and
//!
//! ```text
//!  hold |x| ≤ ‖D A x‖₂ ≤ ‖D A x‖₁ ≤ −μᵀA x ≤ |Aᵀμ| |x| ≤ residual |x|,
//! ```
//!
//! which leaves `|x| = 0`. The conclusion is exact although `μ` is not: rounding only has to stay under `hold`. Weights end
//! at 1 so that a few great forces do not drown the rest in the rounding of `(D A)ᵀ D A`.
//!
//! Multipliers are found by giving each contact of a well-conditioned spanning set `S` the force 1 (a Cholesky factor of
//! `A Aᵀ` with pivoting chooses it) and balancing `Aᵀ1_S` by the least-squares forces of all contacts. They exist exactly
//! where nothing moves [Stiemke1915], and there are never more than `2 n` of them, for `n` unknowns. Because the
//! multipliers of `S` are at least 1, `hold ≥ σ_min(A_S)`: the contacts that only balance may have forces near 0.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use crate::PatchId;
use crate::verify::contact::Contact;
use crate::verify::motion::{Freedom, System};

/// Rest of a load, as the sum of its components, from which refining starts.
const BALANCED: f64 = 1e-10;
/// Forces below this share of the spanning contacts' carry nothing and are left out.
const LEAST_FORCE: f64 = 1e-9;
/// Squared part of a row outside the span of others below which it adds no rank. Rows are 1 to 2 long; a lock that
/// rests on less is one of rounding.
const DEPENDENT: f64 = 1e-9;
/// Corrections of the multipliers; each gains several digits, and two have been enough.
const CORRECTIONS: usize = 4;

/// Multipliers that show that contacts allow no motion.
pub(super) struct Proof {
    /// Contacts with their multipliers, all positive; in the order of the contacts.
    pub multipliers: Vec<(usize, f64)>,
    /// `|Aᵀμ|`.
    pub residual: f64,
    /// `σ_min(D A)`; greater than the residual. 1 where no piece is free.
    pub hold: f64,
}

/// A proof that of `n_pieces` none moves while those of `held` do not; `None` where there is none.
///
/// Twists are about the origin, and spins count as velocities at `length_mm` from it.
pub(super) fn prove(
    contacts: &[Contact],
    n_pieces: usize,
    held: &[PatchId],
    length_mm: f64,
    freedom: Freedom,
) -> Option<Proof> {
    let free: Vec<PatchId> = (0..n_pieces).map(PatchId::from).filter(|id| !held.contains(id)).collect();
    if free.is_empty() {
        return Some(Proof { multipliers: Vec::new(), residual: 0.0, hold: 1.0 });
    }
    let system = System::new(contacts, &free, length_mm, freedom);
    let mut multipliers: BTreeMap<usize, f64> = spanning_rows(&system)?.into_iter().map(|row| (row, 1.0)).collect();
    let load = rest(&system, &multipliers);
    for (row, force) in system.balance(&load, BALANCED).forces {
        if force > LEAST_FORCE {
            *multipliers.entry(row).or_default() += force;
        }
    }
    for _ in 0..CORRECTIONS {
        correct(&system, &mut multipliers)?;
    }
    let residual = rest(&system, &multipliers).norm();
    let hold = SymmetricEigen::new(weighted_gram(&system, &multipliers, 1.0)).eigenvalues.min().max(0.0).sqrt();
    let named = multipliers.into_iter().map(|(row, value)| (system.rows[row].contact, value));
    (residual < hold).then(|| Proof { multipliers: named.collect(), residual, hold })
}

/// Rows of full rank, each the one with the largest part outside the span of those before it; the first of equals.
fn spanning_rows(system: &System) -> Option<Vec<usize>> {
    let mut outside_sq: Vec<f64> = system.rows.iter().map(|row| system.dot_rows(row, row)).collect();
    let (mut chosen, mut basis) = (Vec::new(), Vec::<DVector<f64>>::new());
    for _ in 0..system.n {
        let first_of_most = |best: usize, i: usize| if outside_sq[i] > outside_sq[best] { i } else { best };
        let next = (0..outside_sq.len()).reduce(first_of_most).filter(|&i| outside_sq[i] > DEPENDENT)?;
        let mut direction = DVector::zeros(system.n);
        system.add(&system.rows[next], 1.0, &mut direction);
        // Twice is enough.
        for _ in 0..2 {
            basis.iter().for_each(|b| direction.axpy(-b.dot(&direction), b, 1.0));
        }
        let direction = direction.try_normalize(0.0)?;
        for (row, outside_sq) in system.rows.iter().zip(&mut outside_sq) {
            *outside_sq -= system.dot(row, &direction).powi(2);
        }
        outside_sq[next] = 0.0;
        chosen.push(next);
        basis.push(direction);
    }
    Some(chosen)
}

/// `Aᵀμ`.
fn rest(system: &System, multipliers: &BTreeMap<usize, f64>) -> DVector<f64> {
    let mut rest = DVector::zeros(system.n);
    multipliers.iter().for_each(|(&row, &value)| system.add(&system.rows[row], value, &mut rest));
    rest
}

/// `(D A)ᵀ D A`, the weights being the multipliers up to `most`.
fn weighted_gram(system: &System, multipliers: &BTreeMap<usize, f64>, most: f64) -> DMatrix<f64> {
    system.gram(multipliers.iter().map(|(&row, value)| (&system.rows[row], value.min(most).powi(2))))
}

/// Takes what is left of equilibrium out of the multipliers, by the change `δ` with the least `Σ (δ/μ)²`: small
/// multipliers change little, and stay positive. `None` where one would not.
fn correct(system: &System, multipliers: &mut BTreeMap<usize, f64>) -> Option<()> {
    let spread = Cholesky::new(weighted_gram(system, multipliers, f64::INFINITY))?.solve(&rest(system, multipliers));
    for (&row, value) in multipliers.iter_mut() {
        *value *= 1.0 - *value * system.dot(&system.rows[row], &spread);
        if !(*value > 0.0 && value.is_finite()) {
            return None;
        }
    }
    Some(())
}
