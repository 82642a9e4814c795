//! Prediction of the play of pieces from a plan, before anything is built.
//!
//! Along a seam the walls of two pieces are a clearance apart. So are a pin and its channel, on all sides
//! except the one by which the pin leaves. Each gap limits the small motions of a piece while its neighbours
//! rest; a linear program for each piece gives its greatest motion.
//!
//! ```text
//!   ───a──┐┌──b───   walls: at the outside and at the inside of the wall
//!       ┌─┘└─┐
//!       │ pin│       pin: at its root and its tip, across ŝ, and against ŝ
//!       └────┘
//! ```
//!
//! The key may slide on its way out as far as proofs assume. Limits: its ribs are not known; they can only
//! make its play less.

use shellock_assembly::motion::{Contact, farthest, most_play};
use shellock_assembly::play::SLIDE_MM;
use shellock_geom::{Aabb, Vec3};
use shellock_plan::LatticePlan;
use shellock_report::PatchId;

use super::PlanModel;

/// Predicted play of each piece, and its ratio to the allowed play: at most 1 where allowed.
pub struct Foreseen {
    /// Displacement of the middle of each piece's surface, mm, and turn, degrees. Each is no less than the
    /// greatest along the coordinate axes and no more than √3 of that.
    pub play: Vec<[f64; 2]>,
    /// Ratio of each piece's play to the allowed play, in the same order.
    pub excess: Vec<f64>,
}

/// Predicts the play of pieces that touch at `contacts`, and compares it to the limits. `size_mm` is the
/// longest side of the model.
pub fn foreseen(
    model: &PlanModel,
    plan: &LatticePlan,
    contacts: &[Contact],
    clearance_mm: f64,
    size_mm: f64,
) -> Foreseen {
    let play = plays(model, plan, contacts);
    let mut bounds = vec![Aabb::EMPTY; model.assembly.n_parts];
    for (p, part) in model.assembly.points.iter().zip(&model.assembly.part_of_point) {
        bounds[*part as usize] = bounds[*part as usize].union(Aabb::around([*p]));
    }
    let excess = |(play, room): (&[f64; 2], &Aabb)| {
        let [most_mm, most_deg] = most_play(size_mm, clearance_mm, room.diagonal());
        (play[0] / most_mm).max(play[1] / most_deg)
    };
    let excess = play.iter().zip(&bounds).map(excess).collect();
    Foreseen { play, excess }
}

/// Displacement, mm, and turn, degrees, of each piece.
fn plays(model: &PlanModel, plan: &LatticePlan, contacts: &[Contact]) -> Vec<[f64; 2]> {
    let mut of_piece: Vec<Vec<Contact>> = vec![Vec::new(); model.assembly.n_parts];
    for contact in contacts {
        for piece in [contact.a, contact.b] {
            of_piece[usize::from(piece)].push(*contact);
        }
    }
    let centers = centers(model);
    let key = plan.key();
    let at = centers[usize::from(key)];
    of_piece[usize::from(key)].push(end_of_slide(plan, at));
    let play = |(i, own): (usize, &Vec<Contact>)| farthest(PatchId::from(i), own, centers[i]);
    of_piece.iter().enumerate().map(play).collect()
}

/// Contact that ends the slide of a key whose middle is `at`, against the piece that is installed first.
fn end_of_slide(plan: &LatticePlan, at: Vec3) -> Contact {
    let key = plan.key();
    Contact {
        a: key,
        b: plan.steps[0].piece,
        point: at,
        normal: plan.separation(key).unit(),
        gap_mm: SLIDE_MM,
        area_mm2: 0.0,
    }
}

/// Centre of each part's surface, weighted by area, mm.
fn centers(model: &PlanModel) -> Vec<Vec3> {
    let assembly = &model.assembly;
    let mut sums = vec![(Vec3::ZERO, 0.0); assembly.n_parts];
    for t in &assembly.triangles {
        let [a, b, c] = t.map(|v| assembly.points[v as usize]);
        let area = (b - a).cross(c - a).length();
        let sum = &mut sums[assembly.part_of_point[t[0] as usize] as usize];
        *sum = (sum.0 + area * (a + b + c) / 3.0, sum.1 + area);
    }
    sums.into_iter()
        .map(|(moment, area)| if area > 0.0 { moment / area } else { moment })
        .collect()
}
