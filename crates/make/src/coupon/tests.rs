//! Properties of a coupon's parts and of the joints that they make.

use shellock_assembly::LatticeDirection;
use shellock_assembly::verify::{ThinKind, thin_places};
use shellock_geom::Solid;
use shellock_geom::clearance::{Scope, Shape, Translation, least_gap, swept_gap};

use super::*;

/// Clearance, key clearance, tolerance and thinnest wall of the printers that come with the program, mm.
const PRINTERS: [[f64; 4]; 4] = [
    [0.12, 0.15, 0.05, 0.4],
    [0.2, 0.22, 0.1, 0.45],
    [0.3, 0.32, 0.14, 0.45],
    [0.25, 0.28, 0.12, 0.6],
];
/// Rounding of coordinates to single precision, mm.
const ROUNDING_MM: f64 = 1e-5;
const REST: Translation = Translation {
    along: Vec3::ZERO,
    from_mm: 0.0,
    far_mm: 0.0,
};

fn coupons() -> Vec<(Vec<Part>, f64)> {
    let made = |[clearance, key_clearance, tolerance, wall]: [f64; 4]| {
        let fits = fits(clearance, key_clearance, tolerance);
        (coupon(&fits, wall).unwrap(), wall)
    };
    PRINTERS.map(made).into()
}

/// The moving and the fixed part of each joint of a coupon.
fn joints(parts: &[Part]) -> Vec<[&Part; 2]> {
    let of = |number, kind| {
        let is_it = |part: &&Part| part.fit.number == number && part.kind == kind;
        parts.iter().find(is_it).unwrap()
    };
    (1..=N_FITS as u32)
        .flat_map(|n| {
            [
                [of(n, Kind::Pin), of(n, Kind::Channel)],
                [of(n, Kind::Key), of(n, Kind::Rail)],
            ]
        })
        .collect()
}

fn shape(part: &Part) -> Shape {
    Shape::new(&Solid::new(part.mesh.clone()).unwrap())
}

/// Returns true if a face of a moving part belongs to its pin or its grooves, not to its wall.
fn is_beneath_wall(part: &Part, face: usize) -> bool {
    let corners = part.mesh.corners(face);
    let wall = corners.iter().any(|p| p.z > ROUNDING_MM) || corners.iter().all(|p| p.z > -ROUNDING_MM);
    !wall
}

fn connector_mm(part: &Part) -> f64 {
    if part.kind == Kind::Key {
        part.fit.key_clearance_mm
    } else {
        part.fit.clearance_mm
    }
}

#[test]
fn every_part_is_one_closed_body_that_stands_on_the_plate_and_touches_no_other() {
    for (parts, _) in coupons() {
        assert_eq!(parts.len(), N_FITS * Kind::ALL.len());
        let boxes: Vec<Aabb> = parts.iter().map(|p| p.on_plate().bounds()).collect();
        for (i, part) in parts.iter().enumerate() {
            let solid = Solid::new(part.on_plate()).unwrap();
            let bodies = Volume::from_solid(&solid).unwrap().components().len();
            assert_eq!((bodies, solid.mesh().bounds().min.z), (1, 0.0), "{}", part.name());
            for (other, around) in boxes[..i].iter().enumerate() {
                assert!(
                    !around.grown(APART_MM - ROUNDING_MM).intersects(boxes[i]),
                    "{} and {}",
                    part.name(),
                    parts[other].name()
                );
            }
        }
    }
}

#[test]
fn joints_have_their_clearance_beneath_the_wall_and_twice_the_tolerance_in_the_seam_at_rest_and_on_the_way() {
    for (parts, _) in coupons() {
        for [moving, fixed] in joints(&parts) {
            let connector_mm = connector_mm(moving);
            let whole_mm = connector_mm.min(2.0 * moving.fit.tolerance_mm);
            let (a, b) = (shape(moving), shape(fixed));
            let gap = |a: &Shape, scope| least_gap(a, &b, scope, 2.0).unwrap().gap_mm;
            let name = format!("{} {:?}", moving.name(), moving.fit);
            assert!(
                (gap(&a, Scope::Everything) - whole_mm).abs() < ROUNDING_MM,
                "{name}"
            );
            let beneath = shape(moving).count_only(|face| is_beneath_wall(moving, face));
            assert!(
                (gap(&beneath, Scope::WhatCounts) - connector_mm).abs() < ROUNDING_MM,
                "{name}: {:?}",
                least_gap(&beneath, &b, Scope::WhatCounts, 2.0)
            );
            let way_out = Translation {
                along: moving.kind.separation(),
                from_mm: 0.0,
                far_mm: f64::INFINITY,
            };
            let least = |a: &Shape, scope| swept_gap(a, &b, &way_out, scope, 2.0).unwrap().gap_mm;
            assert!(least(&a, Scope::Everything) > whole_mm - ROUNDING_MM, "{name}");
            assert!(
                least(&beneath, Scope::WhatCounts) > connector_mm - ROUNDING_MM,
                "{name}"
            );
        }
    }
}

#[test]
fn what_is_pushed_into_the_wall_meets_it_after_the_clearance() {
    for (parts, _) in coupons() {
        for [moving, fixed] in joints(&parts) {
            let (a, b) = (shape(moving), shape(fixed));
            let least = |along: Vec3, far_mm: f64| {
                let push = Translation {
                    along,
                    far_mm,
                    ..REST
                };
                swept_gap(&a, &b, &push, Scope::Everything, 2.0).unwrap().gap_mm
            };
            let both_ways = [Vec3::NEG_Z, Vec3::Z];
            let held = both_ways
                .into_iter()
                .take(if moving.kind == Kind::Key { 2 } else { 1 });
            for along in held {
                let clearance_mm = connector_mm(moving);
                let ends = [-1e-3, 1e-3].map(|by| least(along, clearance_mm + by));
                assert!(
                    ends[0] > 0.0 && ends[1] < 0.0,
                    "{} along {along}: {ends:?}",
                    moving.name()
                );
            }
        }
    }
}

#[test]
fn joints_come_apart_along_one_of_26_directions() {
    /// Length of the push, mm: farther than any gap, and less than any part is thick.
    const PUSH_MM: f64 = 1.0;
    for (parts, _) in coupons() {
        for [moving, fixed] in joints(&parts) {
            let (a, b) = (shape(moving), shape(fixed));
            let is_free = |direction: &LatticeDirection| {
                let push = Translation {
                    along: direction.unit(),
                    far_mm: PUSH_MM,
                    ..REST
                };
                swept_gap(&a, &b, &push, Scope::Everything, PUSH_MM).is_none_or(|gap| gap.gap_mm > 0.0)
            };
            let free: Vec<Vec3> = LatticeDirection::all()
                .filter(is_free)
                .map(LatticeDirection::unit)
                .collect();
            assert_eq!(free, [moving.kind.separation()], "{}", moving.name());
        }
    }
}

#[test]
fn nothing_of_a_part_is_thinner_than_the_printer_makes() {
    for (parts, least_wall_mm) in coupons() {
        for part in &parts {
            let thin = thin_places(&part.mesh, least_wall_mm, 0.2);
            // Over its tongue, a rail's wall ends nearer to the seam than the tongue's root: as in kits.
            let is_joint = |slot_mm: f64| (slot_mm - part.fit.key_clearance_mm).abs() < ROUNDING_MM;
            let told = thin
                .iter()
                .find(|f| f.kind == ThinKind::Sheet || !is_joint(f.thickness_mm));
            assert_eq!(told, None, "{}", part.name());
        }
    }
}

#[test]
fn the_third_of_five_ascending_fits_is_the_printers_own_and_none_leaves_the_ranges() {
    for [clearance, key_clearance, tolerance, _] in PRINTERS {
        let third = fits(clearance, key_clearance, tolerance)[2];
        assert_eq!(
            [third.clearance_mm, third.key_clearance_mm, third.tolerance_mm],
            [clearance, key_clearance, tolerance]
        );
    }
    let within = |mm: f64, [least, most]: [f64; 2]| mm >= least && mm <= most;
    for clearance in [0.03, 0.047, 0.12, 0.3, 0.571, 0.6] {
        for key_clearance in [0.03, 0.15, 0.8] {
            for tolerance in [0.0, 0.05, 0.4] {
                let made = fits(clearance, key_clearance, tolerance);
                for (i, fit) in made.iter().enumerate() {
                    assert_eq!(fit.number, i as u32 + 1);
                    assert!(within(fit.clearance_mm, CLEARANCES_MM), "{fit:?}");
                    assert!(within(fit.key_clearance_mm, KEY_CLEARANCES_MM), "{fit:?}");
                    assert!(within(fit.tolerance_mm, [0.0, MOST_TOLERANCE_MM]), "{fit:?}");
                }
                let steps = made.windows(2).map(|w| w[1].clearance_mm - w[0].clearance_mm);
                assert!(steps.clone().all(|step| step > STEPS_MM[0] - 1e-9), "{made:?}");
            }
        }
    }
}

#[test]
fn widest_and_narrowest_options_still_make_joints_that_are_apart() {
    for values in [
        [0.03, 0.03, 0.0, 0.1],
        [0.6, 0.8, 0.4, 2.0],
        [0.1, 0.03, 0.3, 0.4],
    ] {
        let [clearance, key_clearance, tolerance, wall] = values;
        let parts = coupon(&fits(clearance, key_clearance, tolerance), wall).unwrap();
        for [moving, fixed] in joints(&parts) {
            let gap = least_gap(&shape(moving), &shape(fixed), Scope::Everything, 2.0).unwrap();
            assert!(gap.gap_mm > -ROUNDING_MM, "{}: {gap:?}", moving.name());
        }
    }
}
