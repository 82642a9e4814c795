//! Proofs that contacts allow no motion; checking them needs no solver.
//!
//! The contacts of some free pieces allow the motions `x` with `A x ≤ 0` ([`crate::motion`]). A proof is a
//! positive multiplier `μ` for some of them. With `D = diag(min(μ, 1))`, let
//!
//! ```text
//!  residual ≥ |Aᵀμ|        deviation of the multipliers, as forces, from equilibrium
//!  hold     ≤ σ_min(D A)   least weighted closing or opening of contacts by a unit motion
//! ```
//!
//! *If `residual < hold`, then `x = 0` is the only solution of `A x ≤ 0`.* For such an `x`, all entries of `A
//! x` are ≤ 0, so `−μᵀA x = Σ μᵢ |aᵢ x|`, and
//!
//! ```text
//!  hold |x| ≤ ‖D A x‖₂ ≤ ‖D A x‖₁ ≤ −μᵀA x ≤ |Aᵀμ| |x| ≤ residual |x|,
//! ```
//!
//! which leaves `|x| = 0`. The conclusion is exact although `μ` is not: rounding only has to stay below
//! `hold`. Weights are limited to 1 so that a few large forces do not drown the rest in the rounding of
//! `(D A)ᵀ D A`.
//!
//! If one piece may leave, the multipliers are in equilibrium on it, too. Then `hold` is the least singular
//! value of the Schur complement that remains for the others: they move by at most `residual / hold` of the
//! whole motion.
//!
//! The multipliers are found in two steps. Each contact of a well-conditioned spanning set `S`, chosen by a
//! Cholesky factor of `A Aᵀ` with pivoting, gets the force 1. Then the least-squares forces of all contacts
//! balance `Aᵀ1_S`. Contacts that the leaving piece opens on any of its ways bear no force and are not
//! chosen. Multipliers exist exactly if nothing moves [Stiemke1915], and there are never more than `2 n` of
//! them, for `n` unknowns. Because the multipliers of `S` are at least 1, `hold ≥ σ_min(A_S)`: the contacts
//! that only balance may have forces near 0.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};
use shellock_geom::{Aabb, TriMesh, Vec3};

use super::{Balance, Contact, Freedom, Row, System, centered};
use crate::{IdVec, InstallationPlan, PatchId};

/// Residual of a load, as the sum of its components, from which refinement starts.
const BALANCED: f64 = 1e-10;
/// Least force of a contact, as a share of the spanning contacts'; smaller ones are left out.
const LEAST_FORCE: f64 = 1e-9;
/// Least squared part of a row outside the span of others that adds rank. Rows are 1 to 2 long; a lock that
/// relies on less is due to rounding.
const DEPENDENT: f64 = 1e-9;
/// Least hold of a lock; a smaller one is due to rounding. Kits that hold have 0.025 or more, and the program
/// that checks certificates leaves out shares of 3e-5.
const LEAST_HOLD: f64 = 1e-3;
/// Regularisation of a matrix that may be singular, as a share of its mean diagonal.
const SINGULAR: f64 = 1e-13;
/// Speed of a row, as a share of the motion, above which the motion opens the row.
const OPENED: f64 = 1e-6;
/// Number of corrections of the multipliers; each gains several digits, and two have been enough.
const CORRECTIONS: usize = 4;

/// Multipliers which prove that contacts allow no motion.
pub(crate) struct LockProof {
    /// Contacts with their multipliers, all positive; in the order of the contacts.
    pub multipliers: Vec<(usize, f64)>,
    /// Residual of the equilibrium, `|Aᵀμ|`.
    pub residual: f64,
    /// Least singular value `σ_min(D A)`; greater than the residual. 1 if no piece is free.
    pub hold: f64,
}

/// Question for a proof: the pieces that may move.
#[derive(Clone, Copy)]
pub(crate) struct Question<'a> {
    /// Number of all pieces.
    pub n_pieces: usize,
    /// Pieces that do not move.
    pub at_rest: &'a [PatchId],
    /// Piece that may move freely, along this direction at least: nothing is claimed of it.
    pub leaves: Option<(PatchId, Vec3)>,
    /// Distance from the origin, which twists are about, at which spins count as velocities, mm.
    pub length_mm: f64,
    pub freedom: Freedom,
}

/// Centre of all pieces and half their diagonal, mm: the point that twists are about, and the distance at
/// which spins count.
pub(crate) fn frame(pieces: &IdVec<PatchId, TriMesh>) -> (Vec3, f64) {
    let bounds = pieces
        .as_slice()
        .iter()
        .fold(Aabb::EMPTY, |all, mesh| all.union(mesh.bounds()));
    (bounds.center(), 0.5 * bounds.diagonal())
}

/// Proves that only the key moves while the first piece rests; `None` if there is no proof.
pub(crate) fn prove_lock(
    plan: &InstallationPlan,
    contacts: &[Contact],
    pieces: &IdVec<PatchId, TriMesh>,
) -> Option<LockProof> {
    let (center, length_mm) = frame(pieces);
    let key = plan.key();
    let question = Question {
        n_pieces: plan.steps.len(),
        at_rest: &[plan.steps[0].piece],
        leaves: Some((key, plan.separation(key).unit())),
        length_mm,
        freedom: Freedom::Rigid,
    };
    prove(&centered(contacts, center), &question)
}

/// Proves that no piece moves except the one that may leave; `None` if there is no proof.
pub(crate) fn prove(contacts: &[Contact], question: &Question<'_>) -> Option<LockProof> {
    let Question {
        n_pieces,
        at_rest: held,
        leaves,
        length_mm,
        freedom,
    } = *question;
    let free: Vec<PatchId> = (0..n_pieces)
        .map(PatchId::from)
        .filter(|id| !held.contains(id))
        .collect();
    let system = System::new(contacts, &free, length_mm, freedom);
    let leaving = leaves.and_then(|(piece, way)| Some((free.binary_search(&piece).ok()?, way)));
    if free.len() == usize::from(leaving.is_some()) {
        return Some(LockProof {
            multipliers: Vec::new(),
            residual: 0.0,
            hold: 1.0,
        });
    }
    let mut multipliers = find_multipliers(&system, leaving)?;
    for _ in 0..CORRECTIONS {
        correct(&system, &mut multipliers)?;
    }
    let residual = rest(&system, &multipliers).norm();
    let gram = weighted_gram(&system, &multipliers, 1.0);
    let of_others = leaving.map_or_else(|| gram.clone(), |(piece, _)| without(&gram, &system, piece));
    let hold = SymmetricEigen::new(of_others).eigenvalues.min().max(0.0).sqrt();
    let named = multipliers
        .into_iter()
        .map(|(row, value)| (system.rows[row].contact, value));
    (residual < hold && hold > LEAST_HOLD).then(|| LockProof {
        multipliers: named.collect(),
        residual,
        hold,
    })
}

/// Finds multipliers of a spanning set of rows and of those that balance them, up to rounding; `None` if a
/// motion opens rows and no piece may leave.
///
/// A row that any motion opens bears no force. While a piece may leave, the rest of an unbalanced load is
/// such a motion, and the spanning set is chosen again without the rows that it opens.
fn find_multipliers(system: &System, leaving: Option<(usize, Vec3)>) -> Option<BTreeMap<usize, f64>> {
    let mut is_open = vec![false; system.rows.len()];
    loop {
        let spanning = spanning_rows(system, leaving, &is_open)?;
        let mut multipliers: BTreeMap<usize, f64> = spanning.iter().map(|&row| (row, 1.0)).collect();
        let load = rest(system, &multipliers);
        let Balance { forces, rest } = system.balance(&load, BALANCED);
        let opens = |row: usize| system.dot(&system.rows[row], &rest) > OPENED * rest.norm();
        if rest.lp_norm(1) > BALANCED && spanning.iter().any(|&row| opens(row)) {
            leaving?;
            for (row, is_open) in is_open.iter_mut().enumerate() {
                *is_open |= opens(row);
            }
            continue;
        }
        for (row, force) in forces {
            if force > LEAST_FORCE {
                *multipliers.entry(row).or_default() += force;
            }
        }
        return Some(multipliers);
    }
}

/// Schur complement of the Gram matrix for the other pieces while the free piece at `leaving` moves freely,
/// by the pseudo-inverse of its block.
fn without(gram: &DMatrix<f64>, system: &System, leaving: usize) -> DMatrix<f64> {
    /// Share of the greatest eigenvalue below which a direction is the piece's own way out.
    const NO_HOLD: f64 = 1e-9;
    let own: Vec<usize> = (system.column(leaving)..system.column(leaving + 1)).collect();
    let others: Vec<usize> = (0..system.n).filter(|k| !own.contains(k)).collect();
    let block = |rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |i, k| gram[(rows[i], columns[k])])
    };
    let eigen = SymmetricEigen::new(block(&own, &own));
    let least = NO_HOLD * eigen.eigenvalues.max();
    let across = block(&others, &own) * &eigen.eigenvectors;
    let mut rest = block(&others, &others);
    for (k, &value) in eigen
        .eigenvalues
        .iter()
        .enumerate()
        .filter(|(_, value)| **value > least)
    {
        let column = across.column(k);
        rest -= column * column.transpose() / value;
    }
    rest
}

/// Chooses rows of full rank, each with the largest part outside the span of those before it; ties go to the
/// first. If a piece is leaving, none of the rows is opened or closed by its way out or is among the open
/// ones, and they span all other rows.
fn spanning_rows(system: &System, leaving: Option<(usize, Vec3)>, is_open: &[bool]) -> Option<Vec<usize>> {
    let mut way_out = DVector::zeros(system.n);
    let mut basis = Vec::<DVector<f64>>::new();
    if let Some((piece, way)) = leaving {
        (0..3).for_each(|k| way_out[system.column(piece) + k] = way[k]);
        basis.push(way_out.clone().normalize());
    }
    let n_chosen = system.n - basis.len();
    let outside = |(row, is_open): (&Row, &bool)| -> f64 {
        let inside: f64 = basis.iter().map(|b| system.dot(row, b).powi(2)).sum();
        if *is_open || system.dot(row, &way_out).abs() > OPENED {
            0.0
        } else {
            system.dot_rows(row, row) - inside
        }
    };
    let mut outside_sq: Vec<f64> = system.rows.iter().zip(is_open).map(outside).collect();
    let mut chosen = Vec::new();
    for _ in 0..n_chosen {
        let first_of_most = |best: usize, i: usize| if outside_sq[i] > outside_sq[best] { i } else { best };
        let next = (0..outside_sq.len())
            .reduce(first_of_most)
            .filter(|&i| outside_sq[i] > DEPENDENT);
        let Some(next) = next else {
            // The remaining directions may be other ways of the leaving piece; the hold decides.
            return leaving.map(|_| chosen);
        };
        let mut direction = DVector::zeros(system.n);
        system.add(&system.rows[next], 1.0, &mut direction);
        // Two passes are enough.
        for _ in 0..2 {
            basis
                .iter()
                .for_each(|b| direction.axpy(-b.dot(&direction), b, 1.0));
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

/// Residual of the equilibrium, the vector `Aᵀμ`.
fn rest(system: &System, multipliers: &BTreeMap<usize, f64>) -> DVector<f64> {
    let mut rest = DVector::zeros(system.n);
    multipliers
        .iter()
        .for_each(|(&row, &value)| system.add(&system.rows[row], value, &mut rest));
    rest
}

/// Weighted Gram matrix `(D A)ᵀ D A`, the weights being the multipliers up to `most`.
fn weighted_gram(system: &System, multipliers: &BTreeMap<usize, f64>, most: f64) -> DMatrix<f64> {
    system.gram(
        multipliers
            .iter()
            .map(|(&row, value)| (&system.rows[row], value.min(most).powi(2))),
    )
}

/// Removes the residual from the multipliers by the change `δ` with the least `Σ (δ/μ)²`: small multipliers
/// change little and stay positive. `None` if one would not.
fn correct(system: &System, multipliers: &mut BTreeMap<usize, f64>) -> Option<()> {
    let mut gram = weighted_gram(system, multipliers, f64::INFINITY);
    // Nothing holds a piece along its way out, and there is no residual to remove there.
    let little = SINGULAR * gram.trace() / system.n as f64;
    (0..system.n).for_each(|k| gram[(k, k)] += little);
    let spread = Cholesky::new(gram)?.solve(&rest(system, multipliers));
    for (&row, value) in multipliers.iter_mut() {
        *value *= 1.0 - *value * system.dot(&system.rows[row], &spread);
        if !(*value > 0.0 && value.is_finite()) {
            return None;
        }
    }
    Some(())
}
