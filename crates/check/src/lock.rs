//! Checks that contacts and their multipliers prove that nothing moves except the key.
//!
//! A motion gives each piece that is not held a velocity `v` and a spin `w`. A contact with normal `n` at
//! `p`, from `a` to `b`, allows the motion if `n · (v_a − v_b) + (p × n) · (w_a − w_b) ≤ 0`: one row of
//! `A x ≤ 0`. With multipliers `μ > 0`, over all columns, such an `x` has `‖D A x‖ ≤ |Aᵀμ| |x|`, where
//! `D = diag(min(μ, 1))` (docs/notes/certificate.md).
//!
//! Let `x = (x_o, x_k)`, the key's unknowns last, `B = D A_o`, `C = D A_k`. Some columns of `C` are nearly
//! sums of others. Let `Q` be an orthonormal basis of the remaining ones. Then `C = Q R + E`, where `E` is
//! the residue of the nearly dependent columns: `‖E‖ ≤ ε`, measured. So
//! `‖D A x‖ ≥ |(1 − Q Qᵀ) (B x_o + C x_k)| ≥ σ |x_o| − ε |x_k|`, where `σ²` is the least eigenvalue of
//! `S = Bᵀ (1 − Q Qᵀ) B`, and the others move by at most `(|Aᵀμ| + ε) / σ` of the whole motion. The key's way
//! out is such a nearly empty column: its walls are parallel to the way out except for the rounding of files.
//! Where walls are exactly parallel, `ε` is rounding, as `|Aᵀμ|` is.

use crate::vector::{Vec3, cross, scale, sub};
use crate::{Contact, Tested};

/// Greatest share of the multipliers' sum that may be missing from equilibrium: rounding.
const EQUILIBRIUM: f64 = 1e-9;
/// Least share of the stated hold that must be found.
const HOLD: f64 = 0.999;
/// Squared share of all below which a column of the key counts as a sum of others and is left out.
const LEFT_OUT: f64 = 1e-9;
/// Number of unknowns of a piece.
const UNKNOWNS: usize = 6;

/// Frame of reference of twists.
pub struct Frame {
    /// Point that twists are about.
    pub center: Vec3,
    /// Distance at which spins count as velocities, mm.
    pub length_mm: f64,
    /// Number of all pieces, held or not.
    pub n_pieces: usize,
}

/// Tests that only `key` moves while the pieces in `held` do not.
pub fn test(frame: &Frame, contacts: &[Contact], held: &[usize], key: usize, claim: &Held) -> Tested {
    let others = (0..frame.n_pieces).filter(|id| *id != key && !held.contains(id));
    let free: Vec<usize> = others.chain(Some(key).filter(|id| !held.contains(id))).collect();
    let column = |id: usize| free.iter().position(|other| *other == id).map(|i| UNKNOWNS * i);
    let n = UNKNOWNS * free.len();
    // Weighted rows of the contacts, stored by columns.
    let mut columns = vec![vec![0.0; claim.multipliers.len()]; n];
    let (mut sum, mut total) = (vec![0.0; n], 0.0);
    for (r, &(i, multiplier)) in claim.multipliers.iter().enumerate() {
        let contact = contacts.get(i).ok_or("a multiplier of no contact")?;
        if !(multiplier > 0.0 && multiplier.is_finite()) {
            return Err(format!("the multiplier of contact {i} is {multiplier}"));
        }
        for (c, x) in sparse_row(frame, contact, column(contact.a), column(contact.b)) {
            sum[c] += multiplier * x;
            columns[c][r] += multiplier.min(1.0) * x;
        }
        total += multiplier;
    }
    let residual = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
    let hold = claim.hold;
    let figures = format!(
        "residual {residual:.1e}, hold {hold:.4}, {} contacts",
        claim.multipliers.len()
    );
    if residual.is_nan() || residual > EQUILIBRIUM * total {
        return Err(format!("{figures}: the multipliers are not in equilibrium"));
    }
    let n_others = column(key).unwrap_or(n);
    if n_others == 0 {
        return Ok("no other piece is left to move".into());
    }
    let of_key = columns.split_off(n_others);
    let left_over = eliminate(&mut columns, of_key);
    let least = HOLD * hold;
    // Twice the residual leaves room for the rounding of the sum.
    if !(2.0 * (residual + left_over) < least && exceeds(gram(&columns), n_others, least)) {
        return Err(format!("{figures}: that does not hold"));
    }
    Ok(format!(
        "{figures}; others move by up to {:.0e} of the whole motion",
        (residual + left_over) / least
    ))
}

/// Claimed figures of a lock.
pub struct Held<'a> {
    /// Contacts with their forces.
    pub multipliers: &'a [(usize, f64)],
    /// Least effect that a motion of the others, of length 1, has on the contacts.
    pub hold: f64,
}

/// Removes from `columns` the part in the span of the key's columns. Those of the key that are nearly sums of
/// others are left out; returns the length of their residue.
fn eliminate(columns: &mut [Vec<f64>], mut of_key: Vec<Vec<f64>>) -> f64 {
    let length_sq = |c: &[f64]| c.iter().map(|x| x * x).sum::<f64>();
    let least_sq = LEFT_OUT * of_key.iter().map(|c| length_sq(c)).sum::<f64>();
    let longest = |of_key: &[Vec<f64>]| {
        (0..of_key.len()).max_by(|&i, &j| length_sq(&of_key[i]).total_cmp(&length_sq(&of_key[j])))
    };
    while let Some(pivot) = longest(&of_key).filter(|&i| length_sq(&of_key[i]) > least_sq) {
        let mut unit = of_key.swap_remove(pivot);
        let length = length_sq(&unit).sqrt();
        unit.iter_mut().for_each(|x| *x /= length);
        // Two passes, so that the rounding left by the first is removed, too.
        for column in columns.iter_mut().chain(&mut of_key) {
            for _ in 0..2 {
                let share: f64 = column.iter().zip(&unit).map(|(x, u)| x * u).sum();
                column.iter_mut().zip(&unit).for_each(|(x, u)| *x -= share * u);
            }
        }
    }
    of_key.iter().map(|c| length_sq(c)).sum::<f64>().sqrt()
}

/// All scalar products of columns.
fn gram(columns: &[Vec<f64>]) -> Vec<f64> {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    columns
        .iter()
        .flat_map(|a| columns.iter().map(move |b| product(a, b)))
        .collect()
}

/// Non-zero columns of a contact's row.
fn sparse_row(
    frame: &Frame,
    contact: &Contact,
    plus: Option<usize>,
    minus: Option<usize>,
) -> Vec<(usize, f64)> {
    let arm = scale(sub(contact.point, frame.center), 1.0 / frame.length_mm);
    let wrench = [contact.normal, cross(arm, contact.normal)].concat();
    let columns = [(plus, 1.0), (minus, -1.0)]
        .into_iter()
        .filter_map(|(at, sign)| Some((at?, sign)));
    let part = |(at, sign): (usize, f64)| wrench.iter().zip(at..).map(move |(x, at)| (at, sign * x));
    columns.flat_map(part).collect()
}

/// Returns true if all eigenvalues of the symmetric `gram` are above `least²`, in spite of rounding.
///
/// The test is that `gram − shift` has a Cholesky factor. If it has one in floating point, the least
/// eigenvalue is above `shift − (n + 1) u tr(gram)`, approximately [Rump2006, theorem 2.3]; the shift leaves
/// room for eight times that.
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
            gram[i * n + k] = if i == k {
                rest.sqrt()
            } else {
                rest / gram[k * n + k]
            };
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame {
        center: [0.0; 3],
        length_mm: 5.0,
        n_pieces: 3,
    };
    const KEY: usize = 2;

    /// Four contacts of piece `a` with `b` on one side of a cube of 10 mm around (x, 0, 0).
    fn on_side(a: usize, b: usize, x: f64, axis: usize, sign: f64) -> Vec<Contact> {
        let place = |i: usize| {
            let (mut point, mut normal) = ([x, 0.0, 0.0], [0.0; 3]);
            normal[axis] = sign;
            point[axis] += 5.0 * sign;
            point[(axis + 1) % 3] += if i & 1 == 1 { 4.0 } else { -4.0 };
            point[(axis + 2) % 3] += if i & 2 == 2 { 4.0 } else { -4.0 };
            Contact {
                a,
                b,
                point,
                normal,
                gap_mm: 0.1,
            }
        };
        (0..4).map(place).collect()
    }

    /// Contacts of piece 1, a cube in a box, piece 0, whose side along x is the key, which slides along z.
    fn contacts() -> Vec<Contact> {
        let of_cube = [(1, -1.0), (1, 1.0), (2, -1.0), (2, 1.0), (0, -1.0)]
            .map(|(axis, sign)| on_side(1, 0, 0.0, axis, sign));
        let of_key = [(1, -1.0), (1, 1.0), (0, 1.0)].map(|(axis, sign)| on_side(KEY, 0, 10.0, axis, sign));
        [of_cube.concat(), of_key.concat(), on_side(1, KEY, 0.0, 0, 1.0)].concat()
    }

    fn test_hold(contacts: &[Contact], held: &[usize], key: usize, hold: f64) -> Tested {
        let multipliers: Vec<(usize, f64)> = (0..contacts.len()).map(|i| (i, 1.0)).collect();
        test(
            &FRAME,
            contacts,
            held,
            key,
            &Held {
                multipliers: &multipliers,
                hold,
            },
        )
    }

    /// Greatest hold that is confirmed, to within a share of 0.001.
    fn greatest_hold(contacts: &[Contact]) -> f64 {
        let steps = (0..20_000).map(|i| f64::from(i) * 0.001).skip(1);
        steps
            .take_while(|&hold| test_hold(contacts, &[0], KEY, hold).is_ok())
            .last()
            .unwrap_or(0.0)
    }

    #[test]
    fn a_cube_behind_a_sliding_key_is_held_and_the_key_is_not() {
        let told = test_hold(&contacts(), &[0], KEY, 0.5).unwrap();
        assert!(
            told.contains("hold 0.5000, 36 contacts; others move by up to "),
            "{told}"
        );
        assert!(
            test_hold(&contacts(), &[0], 1, 0.1).is_err(),
            "the key moves while the cube counts as free"
        );
        let greatest = greatest_hold(&contacts());
        assert!(test_hold(&contacts(), &[0], KEY, 1.01 * greatest).is_err());
        assert!((0.5..5.0).contains(&greatest), "{greatest}");
    }

    #[test]
    fn a_hold_is_what_the_best_motion_of_the_key_leaves() {
        // Along x the cube meets 4 contacts with the box and 4 with the key, which follows and meets 4
        // contacts with the box.
        let all: f64 = 4.0 + 4.0 * 4.0 / (4.0 + 4.0);
        let along_x = greatest_hold(&contacts());
        assert!(along_x <= all.sqrt() / HOLD + 1e-3, "{along_x}");
        assert!(along_x > 0.9 * all.sqrt(), "{along_x}");
    }

    #[test]
    fn a_cube_that_can_follow_the_key_is_not_held() {
        let along_z = |c: &Contact| c.a == 1 && c.normal[2] != 0.0;
        let loose: Vec<Contact> = contacts().into_iter().filter(|c| !along_z(c)).collect();
        assert!(test_hold(&loose, &[0], KEY, 1e-3).is_err());
    }

    #[test]
    fn multipliers_are_positive_and_in_equilibrium_also_at_the_key() {
        let contacts = contacts();
        let of_key = contacts.iter().position(|c| c.a == KEY).unwrap();
        let told = |change: fn(&mut [(usize, f64)], usize)| {
            let mut multipliers: Vec<(usize, f64)> = (0..contacts.len()).map(|i| (i, 1.0)).collect();
            change(&mut multipliers, of_key);
            test(
                &FRAME,
                &contacts,
                &[0],
                KEY,
                &Held {
                    multipliers: &multipliers,
                    hold: 0.1,
                },
            )
        };
        assert!(told(|_, _| ()).is_ok());
        assert!(told(|m, _| m[7].1 = -1.0).is_err());
        assert!(told(|m, _| m[7].0 = 99).is_err());
        assert!(
            told(|m, of_key| m[of_key].1 = 1.001)
                .unwrap_err()
                .ends_with("not in equilibrium")
        );
    }

    #[test]
    fn walls_of_the_key_that_are_uneven_by_rounding_change_little() {
        let mut rough = contacts();
        let exact = greatest_hold(&rough);
        rough
            .iter_mut()
            .enumerate()
            .filter(|(_, c)| c.a == KEY)
            .for_each(|(i, c)| {
                let slant = 1e-11 * (i as f64).sin();
                c.normal[2] += slant;
            });
        assert!((greatest_hold(&rough) - exact).abs() < 2e-3);
    }
}
