//! Prediction of the play of pieces from a plan, before anything is built.
//!
//! At a station the walls of two pieces are a clearance apart. So are a pin and its channel, on all sides
//! except the one by which the pin leaves. Each gap limits the small motions of a piece while its neighbours
//! rest; a linear program for each piece gives its greatest motion.
//!
//! ```text
//!   ───a──┐┌──b───   walls: at the outside and at the inside of the wall
//!       ┌─┘└─┐
//!       │ pin│       pin: at its root and its tip, across ŝ and u, and against ŝ; where it ends, along u
//!       └────┘
//! ```
//!
//! Limits: rails and ribs are not known, so a key has no prediction; pins are taken to be as long as the
//! seams of their stations.

use std::collections::BTreeMap;

use shellock_assembly::motion::{Contact, farthest, most_play};
use shellock_geom::{Aabb, Vec3};
use shellock_mechanics::connector::{PIN_DEPTH, PIN_WIDTH};
use shellock_mechanics::{Meeting, Side};
use shellock_plan::LatticePlan;
use shellock_report::PatchId;

use super::PlanModel;

/// Greatest distance to the next station of a pin, in mean lengths of the two stations.
const NEXT: f64 = 1.6;
/// Predicted play of each piece except the key, and its ratio to the allowed play: at most 1 where allowed.
pub struct Foreseen {
    /// Displacement of the middle of each piece's surface, mm, and turn, degrees. Each is no less than the
    /// greatest along the coordinate axes and no more than √3 of that; zeros for the key.
    pub play: Vec<[f64; 2]>,
    /// Ratio of each piece's play to the allowed play, in the same order; 0 for the key.
    pub excess: Vec<f64>,
}

/// Predicts the play of the pieces and compares it to the limits. `size_mm` is the longest side of the model.
pub fn foreseen(
    model: &PlanModel,
    plan: &LatticePlan,
    meetings: &[Meeting],
    size_mm: f64,
    clearance_mm: f64,
) -> Foreseen {
    let play = plays(model, plan, meetings, clearance_mm);
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
fn plays(model: &PlanModel, plan: &LatticePlan, meetings: &[Meeting], clearance_mm: f64) -> Vec<[f64; 2]> {
    let mut contacts: Vec<Vec<Contact>> = vec![Vec::new(); model.assembly.n_parts];
    let ends = pin_ends(model, meetings);
    for (station, meeting) in meetings.iter().enumerate() {
        let found = at_station(model, station, meeting, ends[station], clearance_mm);
        for piece in model.pieces_at(station) {
            contacts[usize::from(piece)].extend(&found);
        }
    }
    let centers = centers(model);
    let key = plan.key();
    let of_piece = |(i, own): (usize, &Vec<Contact>)| {
        let piece = PatchId::from(i);
        if piece == key {
            [0.0; 2]
        } else {
            farthest(piece, own, centers[i])
        }
    };
    contacts.iter().enumerate().map(of_piece).collect()
}

/// Name of a seam: its pieces and its ends.
type SeamName = ([PatchId; 2], [[u64; 3]; 2]);

/// Ends of pins: true for each station whose pin ends there, against the seam's tangent and along it.
fn pin_ends(model: &PlanModel, meetings: &[Meeting]) -> Vec<[bool; 2]> {
    let seam = |station: usize| -> SeamName {
        (
            model.pieces_at(station),
            model.seam_ends(station).map(|p| p.to_array().map(f64::to_bits)),
        )
    };
    let mut of_seam: BTreeMap<SeamName, Vec<usize>> = BTreeMap::new();
    (0..meetings.len()).for_each(|station| of_seam.entry(seam(station)).or_default().push(station));
    let mut ends = vec![[true; 2]; meetings.len()];
    let male = |station: usize| meetings[station].joint.as_ref().map(|joint| joint.male);
    for &one in of_seam.values().flatten() {
        let frame = &model.assembly.stations[one];
        for &other in of_seam[&seam(one)]
            .iter()
            .filter(|&&other| male(other) == male(one))
        {
            let to = model.place_of(other) - model.place_of(one);
            let far_mm = NEXT * 0.5 * (frame.length_mm + model.assembly.stations[other].length_mm);
            if other != one && to.length() > 0.0 && to.length() <= far_mm {
                ends[one][usize::from(to.dot(frame.tangent) > 0.0)] = false;
            }
        }
    }
    ends
}

/// Contacts of a station; `ends` as from [`pin_ends`].
fn at_station(
    model: &PlanModel,
    station: usize,
    meeting: &Meeting,
    ends: [bool; 2],
    clearance_mm: f64,
) -> Vec<Contact> {
    let [a, b] = model.pieces_at(station);
    let frame = &model.assembly.stations[station];
    let below = |depth_mm: f64| model.place_of(station) - depth_mm * frame.normal;
    let contact = |a, b, point, normal| Contact {
        a,
        b,
        point,
        normal,
        gap_mm: clearance_mm,
        area_mm2: 0.0,
    };
    let wall_mm = model.params.wall_mm;
    let mut found: Vec<Contact> = [0.1, 0.9]
        .map(|share| contact(a, b, below(share * wall_mm), meeting.wall))
        .to_vec();
    if let Some(joint) = &meeting.joint {
        let (male, female) = if joint.male == Side::A { (a, b) } else { (b, a) };
        let across = joint.leaves.cross(frame.tangent).normalize_or_zero();
        for depth_mm in [wall_mm + 0.1 * joint.size_mm, wall_mm + PIN_DEPTH * joint.size_mm] {
            let (middle, half) = (below(depth_mm), 0.5 * PIN_WIDTH * joint.size_mm);
            found.push(contact(male, female, middle - half * joint.leaves, -joint.leaves));
            found.extend([across, -across].map(|side| contact(male, female, middle + half * side, side)));
            let outwards = [-frame.tangent, frame.tangent]
                .into_iter()
                .zip(ends)
                .filter(|(_, is_end)| *is_end);
            found.extend(
                outwards.map(|(side, _)| contact(male, female, middle + 0.5 * frame.length_mm * side, side)),
            );
        }
    }
    found
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
