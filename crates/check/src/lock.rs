//! Whether contacts and their multipliers show that nothing moves.
//!
//! A motion gives each piece that is not held a velocity `v` and a spin `w`. A contact with normal `n` at `p`, from `a`
//! to `b`, allows it where `n · (v_a − v_b) + (p × n) · (w_a − w_b) ≤ 0`: one row of `A x ≤ 0`. If multipliers `μ > 0`
//! have `|Aᵀμ| < σ_min(D A)`, with `D = diag(min(μ, 1))`, then `x = 0` is the only solution (docs/certificate.md).

use crate::vector::{Vec3, cross, scale, sub};
use crate::{Contact, Tested};

/// Share of the multipliers' sum that may be left of equilibrium: rounding.
const EQUILIBRIUM: f64 = 1e-9;
/// Share of the stated hold that must be there.
const HOLD: f64 = 0.999;

/// What twists are about.
pub struct Frame {
    /// The point they are about.
    pub center: Vec3,
    /// Spins count as velocities at this distance, mm.
    pub length_mm: f64,
    /// All pieces, held or not.
    pub n_pieces: usize,
}

/// Whether nothing moves while `held` do not.
pub fn test(frame: &Frame, contacts: &[Contact], held: &[usize], multipliers: &[(usize, f64)], hold: f64) -> Tested {
    let free: Vec<usize> = (0..frame.n_pieces).filter(|id| !held.contains(id)).collect();
    let column = |id: usize| free.binary_search(&id).ok().map(|i| 6 * i);
    let n = 6 * free.len();
    if n == 0 {
        return Ok("no piece is left to move".into());
    }
    let (mut sum, mut gram, mut total) = (vec![0.0; n], vec![0.0; n * n], 0.0);
    for &(i, multiplier) in multipliers {
        let contact = contacts.get(i).ok_or("a multiplier of no contact")?;
        if !(multiplier > 0.0 && multiplier.is_finite()) {
            return Err(format!("the multiplier of contact {i} is {multiplier}"));
        }
        let row = sparse_row(frame, contact, column(contact.a), column(contact.b));
        let weight = multiplier.min(1.0);
        for &(c, x) in &row {
            sum[c] += multiplier * x;
            row.iter().for_each(|&(d, y)| gram[c * n + d] += weight * weight * x * y);
        }
        total += multiplier;
    }
    let residual = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
    let figures = format!("residual {residual:.1e}, hold {hold:.4}, {} contacts", multipliers.len());
    if residual.is_nan() || residual > EQUILIBRIUM * total {
        return Err(format!("{figures}: the multipliers are not in equilibrium"));
    }
    let least = HOLD * hold;
    // Twice the residual leaves room for the rounding of the sum.
    if !(2.0 * residual < least && exceeds(gram, n, least)) {
        return Err(format!("{figures}: that does not hold"));
    }
    Ok(figures)
}

/// The columns of a row that are not 0.
fn sparse_row(frame: &Frame, contact: &Contact, plus: Option<usize>, minus: Option<usize>) -> Vec<(usize, f64)> {
    let arm = scale(sub(contact.point, frame.center), 1.0 / frame.length_mm);
    let wrench = [contact.normal, cross(arm, contact.normal)].concat();
    let columns = [(plus, 1.0), (minus, -1.0)].into_iter().filter_map(|(at, sign)| Some((at?, sign)));
    let part = |(at, sign): (usize, f64)| wrench.iter().zip(at..).map(move |(x, at)| (at, sign * x));
    columns.flat_map(part).collect()
}

/// Whether all eigenvalues of the symmetric `gram` are above `least²`, in spite of rounding.
///
/// By whether `gram − shift` has a Cholesky factor. Where it has one in floating point, the least eigenvalue is above
/// `shift − (n + 1) u tr(gram)`, about [Rump2006, theorem 2.3]; the shift has room for eight times that.
fn exceeds(mut gram: Vec<f64>, n: usize, least: f64) -> bool {
    let trace: f64 = (0..n).map(|i| gram[i * n + i]).sum();
    let shift = least * least + 8.0 * (n + 2) as f64 * f64::EPSILON * trace;
    (0..n).for_each(|i| gram[i * n + i] -= shift);
    for i in 0..n {
        for k in 0..=i {
            let known: f64 = (0..k).map(|j| gram[i * n + j] * gram[k * n + j]).sum();
            let rest = gram[i * n + k] - known;
            if i == k && (rest.is_nan() || rest <= 0.0) {
                return false;
            }
            gram[i * n + k] = if i == k { rest.sqrt() } else { rest / gram[k * n + k] };
        }
    }
    true
}
