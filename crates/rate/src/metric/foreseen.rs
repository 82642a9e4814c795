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

use shellock_assembly::motion::{Contact, farthest, least_holds, most_play};
use shellock_assembly::play::SLIDE_MM;
use shellock_geom::{Aabb, Vec3};
use shellock_plan::LatticePlan;
use shellock_report::PatchId;

use super::PlanModel;

/// Predicted play of each piece, and its ratio to the allowed play: at most 1 where allowed.
pub struct Foreseen {
    /// Displacement of the middle of each piece's surface, mm, and turn, degrees, of the motions that go
    /// farthest.
    pub play: Vec<[f64; 2]>,
    /// Ratio of each piece's play to the allowed play, in the same order.
    pub excess: Vec<f64>,
    /// Estimated overlap with which each piece resists its weakest push, mm³, in the same order.
    pub holds_mm3: Vec<f64>,
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
    let holds_mm3 = least_holds(contacts, model.assembly.n_parts, clearance_mm);
    Foreseen {
        play,
        excess,
        holds_mm3,
    }
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

#[cfg(test)]
mod tests {
    use shellock_assembly::LatticeDirection;
    use shellock_plan::LatticeStep;
    use shellock_plan::sizes::ConnectorSizes;
    use shellock_test_surfaces::{label, sphere};

    use super::*;
    use crate::metric::MetricParams;

    #[test]
    fn a_key_that_only_its_way_out_leaves_free_slides_as_far_as_proofs_assume() {
        let half = |p: Vec3| u32::from(p.z > 0.0);
        let surface = label(sphere(4, Vec3::splat(40.0)), 2, half);
        let model = PlanModel::new(&MetricParams::default(), &surface, &ConnectorSizes::default());
        let step = |(piece, direction): (u32, Vec3)| LatticeStep {
            piece: PatchId(piece),
            separation: LatticeDirection::nearest(direction),
        };
        let plan = LatticePlan {
            steps: [(0, Vec3::NEG_Z), (1, Vec3::Z)].map(step).to_vec(),
        };
        // Walls around the key at four places, a gap away on all sides but that of its way out.
        let gap_mm = 0.1;
        let around = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y];
        let walls: Vec<Contact> = around
            .iter()
            .flat_map(|&at| around.into_iter().chain([Vec3::NEG_Z]).map(move |to| (at, to)))
            .map(|(at, normal)| Contact {
                a: PatchId(1),
                b: PatchId(0),
                point: 30.0 * at,
                normal,
                gap_mm,
                area_mm2: 1.0,
            })
            .collect();
        let [key_mm, _] = plays(&model, &plan, &walls)[1];
        assert!(
            (SLIDE_MM..=3f64.sqrt() * (SLIDE_MM + gap_mm)).contains(&key_mm),
            "{key_mm}"
        );
        // A stop that is nearer than that is felt.
        let stop = |x: f64| Contact {
            point: Vec3::new(x, 0.0, 0.0),
            normal: Vec3::Z,
            ..walls[0]
        };
        let stopped = [walls.clone(), [-30.0, 30.0].map(stop).to_vec()].concat();
        let [stopped_mm, _] = plays(&model, &plan, &stopped)[1];
        assert!(stopped_mm < key_mm, "{stopped_mm} and {key_mm}");
        // The other piece gets no such end: nothing ends its slide.
        let [other_mm, _] = plays(&model, &plan, &walls)[0];
        assert!(other_mm > 10.0 * key_mm, "{other_mm}");
    }
}
