//! Places where the pieces of a whole plan would touch each other, before anything is built: walls at the
//! outside and at the inside, and pins with their channels.
//!
//! Unlike the tables of a contact, which know two pieces, these know all pieces: a run also ends where a
//! third piece would sweep over it, or where one of its own pieces would run into a third.

use shellock_assembly::LatticeDirection;
use shellock_assembly::motion::Contact;
use shellock_geom::Vec3;
use shellock_mechanics::connector::{PIN_DEPTH, PIN_WIDTH};
use shellock_report::PatchId;

use super::Interface;
use super::blocking::LEFT_SHARE;
use super::obstruction::Leave;
use super::sample::{Kind, Sample, Way};
use crate::{LatticePlan, PlanParams};

/// Samples from one that touches to the next.
const STEP: usize = 3;
/// Depths at which walls touch, as shares of their thickness.
const DEPTHS: [f64; 2] = [0.1, 0.9];

/// Contacts of the walls of all pieces, with the gaps of walls.
pub fn wall_contacts(params: &PlanParams, interfaces: &[Interface], plan: &LatticePlan) -> Vec<Contact> {
    interfaces
        .iter()
        .flat_map(|interface| walls(params, interface, plan))
        .collect()
}

fn walls(params: &PlanParams, interface: &Interface, plan: &LatticePlan) -> Vec<Contact> {
    let (side, [later, earlier]) = order(interface, plan);
    let s = plan.separation(later).unit();
    let height_mm = LEFT_SHARE * params.wall_mm / DEPTHS.len() as f64;
    let at = |x: &Sample, depth: f64| Contact {
        a: later,
        b: earlier,
        point: x.point + (1.0 - depth) * params.wall_mm * x.normal,
        normal: x.frame(side).wall(s),
        gap_mm: match later == plan.key() {
            true => params.key_gap_mm,
            false => params.wall_gap_mm,
        },
        area_mm2: height_mm * STEP as f64 * x.length_mm,
    };
    let samples = interface
        .lines
        .iter()
        .flat_map(|line| line.samples.iter().step_by(STEP));
    samples.flat_map(|x| DEPTHS.map(|depth| at(x, depth))).collect()
}

/// Side of a pair as in [`Way`], and its later and its earlier piece.
fn order(interface: &Interface, plan: &LatticePlan) -> (f64, [PatchId; 2]) {
    match plan.position(interface.a) > plan.position(interface.b) {
        true => (1.0, [interface.a, interface.b]),
        false => (-1.0, [interface.b, interface.a]),
    }
}

/// Contacts of all pins of a plan with their channels, each a clearance apart; those of a key that slides on
/// rails by its own clearance.
pub fn pin_contacts(params: &PlanParams, interfaces: &[Interface], plan: &LatticePlan) -> Vec<Contact> {
    let leaves = Leave::all(plan);
    let of_pair = |interface: &Interface| pins(params, interface, plan, &leaves);
    interfaces.iter().flat_map(of_pair).collect()
}

fn pins(params: &PlanParams, interface: &Interface, plan: &LatticePlan, leaves: &[Leave]) -> Vec<Contact> {
    let (side, [later, earlier]) = order(interface, plan);
    let (pair, s) = ([interface.a, interface.b], plan.separation(later));
    let way = Way::new(params, pair, side, s);
    let is_clear = |x: &Sample| {
        let sights = x.sights.as_ref();
        !sights.is_some_and(|sights| sights.is_blocked(pair, later == interface.a, leaves))
    };
    let gap_mm = match params.slides_on_rails(later, s) {
        true => params.key_gap_mm.max(params.clearance_mm),
        false => params.clearance_mm,
    };
    let contact = |face: Face, length_mm: f64| Contact {
        a: if face.is_of_later { later } else { earlier },
        b: if face.is_of_later { earlier } else { later },
        point: face.point,
        normal: face.normal,
        gap_mm,
        area_mm2: face.width_mm * length_mm,
    };
    let mut found = Vec::new();
    for line in &interface.lines {
        let runs = line.runs_where(way, &is_clear);
        for run in runs.into_iter().filter(|run| run.is_made(interface.size_mm)) {
            let last = run.samples.len() - 1;
            let places: Vec<usize> = (0..=last).filter(|i| i % STEP == 0 || *i == last).collect();
            let length_mm = LEFT_SHARE * run.length_mm / places.len() as f64;
            let samples = places.iter().map(|i| &line.samples[run.samples[*i]]);
            let faces = samples.flat_map(|x| faces(run.kind, interface.size_mm, x, s, side));
            found.extend(faces.map(|face| contact(face, length_mm)));
            for (i, outwards) in line.stops(&run, way, interface.size_mm, gap_mm) {
                let ends = end_faces(run.kind, interface.size_mm, &line.samples[i], s, side, outwards);
                // Carving decides where stops stand, so they do not count as a hold.
                found.extend(ends.map(|face| contact(face, 0.0)));
            }
        }
    }
    found
}

/// A face of a connector's male half.
#[derive(Clone, Copy)]
struct Face {
    is_of_later: bool,
    point: Vec3,
    /// Unit vector that the face looks along.
    normal: Vec3,
    /// Width of the face across the seam that the point represents, mm.
    width_mm: f64,
}

/// Faces of the end of a pin that a stop holds, which looks `outwards`.
fn end_faces(
    kind: Kind,
    size_mm: f64,
    x: &Sample,
    s: LatticeDirection,
    side: f64,
    outwards: Vec3,
) -> impl Iterator<Item = Face> {
    let sides = faces(kind, size_mm, x, s, side);
    // The faces beside the pin come in pairs, at its tip and at its root.
    let between = move |i: usize, j: usize| Face {
        point: sides[i].point.midpoint(sides[j].point),
        normal: outwards,
        ..sides[i]
    };
    [between(1, 3), between(2, 4)].into_iter()
}

/// Faces of the male half at a sample.
fn faces(kind: Kind, size_mm: f64, x: &Sample, s: LatticeDirection, side: f64) -> Vec<Face> {
    let across = side * x.across;
    let face = |is_of_later: bool, point: Vec3, normal: Vec3, width: f64| Face {
        is_of_later,
        point,
        normal,
        width_mm: width * size_mm,
    };
    match kind {
        Kind::Pin { later_is_male } => {
            let sign = if later_is_male { 1.0 } else { -1.0 };
            let leaves = (sign * s.unit())
                .reject_from_normalized(x.tangent)
                .normalize_or_zero();
            // The pin lies on its own side of the seam.
            let to_female = sign * across;
            let n = to_female.reject_from_normalized(leaves).normalize_or(x.normal);
            let at = |beside: f64, below: f64| x.point - size_mm * (beside * n + below * leaves);
            let beside = |beside: f64, below: f64, normal: Vec3| {
                face(later_is_male, at(beside, below), normal, 0.5 * PIN_DEPTH)
            };
            vec![
                face(later_is_male, at(0.5 * PIN_WIDTH, PIN_DEPTH), -leaves, PIN_WIDTH),
                beside(PIN_WIDTH, PIN_DEPTH, -n),
                beside(PIN_WIDTH, 0.1 * PIN_DEPTH, -n),
                beside(0.0, PIN_DEPTH, n),
                beside(0.0, 0.1 * PIN_DEPTH, n),
            ]
        }
        // The earlier piece carries the tongue, which reaches under the later one's wall.
        Kind::Rail => {
            let at = |below: f64| x.point - size_mm * (0.25 * across + below * x.normal);
            vec![
                face(false, at(0.0), x.normal, 0.5),
                face(false, at(0.45), -x.normal, 0.5),
                face(false, at(0.2) - 0.25 * size_mm * across, -across, 0.45),
            ]
        }
    }
}

#[cfg(test)]
mod tests {
    use shellock_test_surfaces::{label, level_seam, seams, sphere};

    use super::*;
    use crate::LatticeStep;
    use crate::interface::sample::lines;
    use crate::interface::{contact, contacts};
    use crate::sizes::ConnectorSizes;

    const LID: PatchId = PatchId(2);

    /// Contacts of a ball with two lower quarters and a lid, which leaves first, along `s`: first those of
    /// walls.
    fn touches_of_ball(s: Vec3) -> [Vec<Contact>; 2] {
        let ball = sphere(5, Vec3::splat(40.0));
        let surface = label(ball, 3, |p| if p.z > 0.0 { 2 } else { u32::from(p.x > 0.0) });
        let params = PlanParams {
            wall_mm: 2.0,
            ..PlanParams::default()
        };
        let step = |piece: u32, along: Vec3| LatticeStep {
            piece: PatchId(piece),
            separation: LatticeDirection::nearest(along),
        };
        let plan = LatticePlan {
            steps: vec![step(0, Vec3::X), step(1, Vec3::X), step(2, s)],
        };
        let found = contacts(&params, &surface, &seams(&surface), &ConnectorSizes::default());
        [
            wall_contacts(&params, &found, &plan),
            pin_contacts(&params, &found, &plan),
        ]
    }

    fn is_of_lid(contact: &Contact) -> bool {
        contact.a == LID || contact.b == LID
    }

    #[test]
    fn connectors_that_a_third_piece_would_sweep_over_touch_nothing() {
        let lower = |s: Vec3| touches_of_ball(s)[1].iter().filter(|c| !is_of_lid(c)).count();
        // Upwards, the lid passes none of them; downwards, its top would pass through all.
        assert!(lower(Vec3::Z) > 20);
        assert_eq!(lower(-Vec3::Z), 0);
    }

    #[test]
    fn walls_and_pins_let_their_piece_out_and_hold_it_on_the_way_in() {
        let [walls, pins] = touches_of_ball(Vec3::Z);
        assert!(
            walls
                .iter()
                .all(|c| c.gap_mm == if is_of_lid(c) { 0.15 } else { 0.1 })
        );
        for of_lid in [walls, pins].map(|touches| {
            let outwards = |c: &Contact| if c.a == LID { c.normal } else { -c.normal };
            touches
                .iter()
                .filter(|c| is_of_lid(c))
                .map(outwards)
                .collect::<Vec<Vec3>>()
        }) {
            assert!(of_lid.iter().all(|normal| normal.z < 0.1), "{of_lid:?}");
            assert!(of_lid.iter().any(|normal| normal.z < -0.9), "{of_lid:?}");
        }
    }

    #[test]
    fn stops_hold_a_pin_along_a_straight_seam_where_it_is_long_enough() {
        let up = LatticeDirection::nearest(Vec3::Z);
        let params = PlanParams::default();
        let plan = LatticePlan {
            steps: [1, 0]
                .map(|piece: u32| LatticeStep {
                    piece: PatchId(piece),
                    separation: up,
                })
                .to_vec(),
        };
        let along = |length_mm: f64| {
            let seam = level_seam(vec![Vec3::ZERO, length_mm * Vec3::X]);
            let lines = lines(&params, 2.5, &seam, None);
            let interface = contact(&params, &ConnectorSizes::uniform(2.5), &[(&seam, lines)]).unwrap();
            let ends = pin_contacts(&params, &[interface], &plan);
            let ends = ends.iter().filter(|c| c.normal.x.abs() > 0.99);
            let sides: Vec<f64> = ends.map(|c| c.normal.x * (c.point.x - 0.5 * length_mm)).collect();
            assert!(
                sides.iter().all(|mm| *mm > 0.0),
                "ends look out of the run: {sides:?}"
            );
            sides.len()
        };
        assert_eq!(along(40.0), 4);
        // Room for one stop.
        assert_eq!(along(11.5), 2);
        assert_eq!(along(8.0), 0);
    }

    #[test]
    fn sides_of_a_pin_hold_along_the_share_of_the_run_that_counts() {
        let (up, size_mm) = (LatticeDirection::nearest(Vec3::Z), 2.5);
        let params = PlanParams::default();
        let seam = level_seam(vec![Vec3::ZERO, 40.0 * Vec3::X]);
        let lines = lines(&params, size_mm, &seam, None);
        let interface = contact(&params, &ConnectorSizes::uniform(size_mm), &[(&seam, lines)]).unwrap();
        let run_mm = interface.joint(PatchId(1), up).run_mm;
        let steps = [0, 1].map(|piece: u32| LatticeStep {
            piece: PatchId(piece),
            separation: up,
        });
        let plan = LatticePlan {
            steps: steps.to_vec(),
        };
        let pins = pin_contacts(&params, &[interface], &plan);
        let area_mm2 = |way: Vec3| -> f64 {
            let facing = pins.iter().filter(|c| c.normal.dot(way) > 0.99);
            facing.map(|c| c.area_mm2).sum()
        };
        let side_mm2 = LEFT_SHARE * run_mm * PIN_DEPTH * size_mm;
        for way in [Vec3::Y, Vec3::NEG_Y] {
            assert!(
                (area_mm2(way) / side_mm2 - 1.0).abs() < 1e-6,
                "{} {side_mm2}",
                area_mm2(way)
            );
        }
        assert_eq!(area_mm2(Vec3::X), 0.0, "stops hold nothing");
    }
}
