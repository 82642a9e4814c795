//! Estimate of how firmly contacts hold a piece against the pushes of the verification.

use shellock_geom::Vec3;

use super::Contact;
use crate::push::{self, N_PUSHES};

/// Estimated overlap with which each of `n_pieces` resists its weakest push, mm³.
///
/// A push moves a piece by the same step in each of [`push::directions`] while the others rest. A contact
/// that faces the push resists with its area times the depth of the overlap behind it, as if both sides were
/// thicker than the step is long.
pub fn least_holds(contacts: &[Contact], n_pieces: usize, clearance_mm: f64) -> Vec<f64> {
    let step_mm = push::length_mm(clearance_mm);
    let pushes: [Vec3; N_PUSHES] = push::directions().map(|d| step_mm * d);
    let mut holds = vec![[0.0; N_PUSHES]; n_pieces];
    for contact in contacts.iter().filter(|c| c.area_mm2 > 0.0) {
        for (piece, out) in [(contact.a, contact.normal), (contact.b, -contact.normal)] {
            for (mm3, push) in holds[usize::from(piece)].iter_mut().zip(&pushes) {
                *mm3 += contact.area_mm2 * (out.dot(*push) - contact.gap_mm).max(0.0);
            }
        }
    }
    let least = |held: &[f64; N_PUSHES]| held.iter().copied().fold(f64::INFINITY, f64::min);
    holds.iter().map(least).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PatchId;

    /// Contact of piece 1 with piece 0 in a wall that lies in direction `normal`, of 10 mm².
    fn wall(normal: Vec3) -> Contact {
        Contact {
            a: PatchId(1),
            b: PatchId(0),
            point: Vec3::ZERO,
            normal,
            gap_mm: 0.1,
            area_mm2: 10.0,
        }
    }

    #[test]
    fn a_box_open_to_one_side_holds_nothing_that_way_and_a_closed_one_what_its_least_push_meets() {
        let sides = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, -Vec3::Z].map(wall);
        assert_eq!(least_holds(&sides, 2, 0.1), [0.0, 0.0]);
        let closed = [&sides[..], &[wall(Vec3::Z)]].concat();
        let [held, _] = least_holds(&closed, 2, 0.1)[..] else {
            panic!("two pieces");
        };
        // Along an axis, one side resists alone; all other pushes meet more.
        let alone_mm3 = 10.0 * (push::length_mm(0.1) - 0.1);
        assert!((held - alone_mm3).abs() < 1e-9, "{held} and {alone_mm3}");
    }
}
