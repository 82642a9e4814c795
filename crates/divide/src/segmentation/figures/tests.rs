use std::f64::consts::{PI, TAU};

use shellock_geom::{Solid, TriMesh, Vec3};
use shellock_test_surfaces::{label, sphere};
use shellock_testkit::shapes::{cuboid, torus};

use super::*;
use crate::segmentation::SegmentationParams;
use crate::segmentation::halve::halve_long_edges;

const RADIUS_MM: f64 = 30.0;

fn ball() -> TriMesh {
    sphere(5, Vec3::splat(RADIUS_MM))
}

/// A cube of 40 mm with short edges.
fn cube() -> TriMesh {
    let cube = cuboid([0.0; 3], [40.0; 3]).to_mesh();
    let params = SegmentationParams::default();
    halve_long_edges(&params, &Solid::new(cube).unwrap())
        .0
        .into_mesh()
}

/// Two overlapping balls of 30 mm, their centres 48 mm apart on the z axis, which meet in a circle of radius
/// 18 mm.
fn two_balls() -> TriMesh {
    let mut mesh = sphere(6, Vec3::splat(RADIUS_MM));
    // The equator moves to the neck, and each half to the ball beyond the neck's plane.
    let neck_z = 24.0;
    for p in &mut mesh.points {
        let d = *p / RADIUS_MM;
        let polar = d.z.clamp(-1.0, 1.0).asin().abs();
        // From the neck at asin(−24 / 30) to the pole.
        let low = -(neck_z / RADIUS_MM).asin();
        let high = low + (PI / 2.0 - low) * polar / (PI / 2.0);
        let aside = Vec3::new(d.x, d.y, 0.0).normalize_or_zero();
        let (sin, cos) = high.sin_cos();
        let sign = if d.z < 0.0 { -1.0 } else { 1.0 };
        *p = RADIUS_MM * cos * aside + Vec3::Z * sign * (neck_z + RADIUS_MM * sin);
    }
    mesh
}

fn figures_of(surface: &SegmentedSurface) -> DivisionFigures {
    figures(&FigureParams::default(), surface)
}

fn assert_near(value: f64, expected: f64, most: f64) {
    assert!(
        (value - expected).abs() <= most,
        "{value} is not {expected} ± {most}"
    );
}

#[test]
fn a_ball_cut_at_its_equator_has_a_seam_of_two_pi_r_half_of_it_in_sight_and_none_in_a_crease() {
    let surface = label(ball(), 2, |p| u32::from(p.z > 0.0));
    let found = figures_of(&surface);
    let seams = found.seams;
    assert_near(seams.length_mm / (TAU * RADIUS_MM), 1.0, 0.01);
    assert_eq!((seams.concave_share, seams.n_triple_points), (0.0, 0));
    assert_near(seams.flat_share + seams.convex_share, 1.0, 1e-12);
    // Each level view sees half of a level circle.
    assert_near(seams.visible_share, 0.5, 0.02);
    assert_near(seams.front_share, 0.5, 0.02);
    assert_eq!(found.contacts.n_contacts, 1);
    assert_near(found.area_mm2.least / (TAU * RADIUS_MM * RADIUS_MM), 1.0, 0.01);
}

/// 95 % of a half ball's area lies within acos 0.05 of its pole.
#[test]
fn a_half_ball_faces_one_way_and_a_whole_one_does_not() {
    let tilt = Vec3::new(1.0, 2.0, 3.0).normalize();
    let found = figures_of(&label(ball(), 2, |p| u32::from(p.dot(tilt) > 0.0)));
    let faces = found.pieces[1].faces;
    assert!(
        faces.is_one_way() && Vec3::from(faces.axis).dot(tilt) > 0.99,
        "{faces:?}"
    );
    assert_near(faces.half_angle_deg, 0.05f64.acos().to_degrees(), 1.5);
    let whole = figures_of(&label(ball(), 1, |_| 0));
    assert!(!whole.pieces[0].faces.is_one_way() && !whole.pieces[0].is_disk);
    assert_eq!(
        (whole.seams, whole.contacts.shortest_mm),
        (SeamFigures::default(), None)
    );
}

#[test]
fn a_seam_at_the_neck_of_two_balls_lies_in_a_crease_and_not_on_the_front() {
    let surface = label(two_balls(), 2, |p| u32::from(p.z > 0.0));
    let seams = figures_of(&surface).seams;
    assert_near(seams.length_mm, TAU * 18.0, 1.0);
    assert_eq!((seams.concave_share, seams.front_share), (1.0, 0.0));
    // The crease is visible from views level with it, half of it from each.
    assert_near(seams.visible_share, 0.5, 0.02);
}

#[test]
fn a_cube_has_seams_over_edges_and_on_planes() {
    let top = figures_of(&label(cube(), 2, |p| u32::from(p.z > 39.9)));
    assert_near(top.seams.convex_share, 1.0, 1e-9);
    assert_near(top.seams.length_mm, 160.0, 1e-9);
    assert!(top.pieces[1].is_disk && top.pieces[1].faces.half_angle_deg < 1e-5);
    assert_near(top.area_mm2.least, 1600.0, 1e-9);
    // A seam on the underside is not visible in level views.
    let under = label(cube(), 2, |p| u32::from(p.z < 0.1 && p.x > 20.0));
    let seams = figures_of(&under).seams;
    assert_near(seams.flat_share, 40.0 / 120.0, 0.03);
    // Three edges, each visible in three of eight views.
    assert_near(seams.visible_share, 3.0 / 8.0 * 80.0 / 120.0, 0.02);
}

#[test]
fn the_front_is_towards_minus_y_where_z_is_up_and_towards_z_where_y_is_up() {
    assert_eq!(front_of([0.0, 0.0, 1.0]), [0.0, -1.0, 0.0]);
    assert_eq!(front_of([0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
    assert_eq!(front_of([1.0, 0.0, 0.0]), [0.0, -1.0, 0.0]);
    assert_eq!(front_of([0.0, 0.0, -1.0]), [0.0, -1.0, 0.0]);
    let up = Vec3::new(0.2, -0.5, 0.7).normalize();
    let front = Vec3::from(front_of(up.to_array()));
    assert!((front.length() - 1.0).abs() < 1e-12 && front.dot(up).abs() < 1e-12);
}

/// Two upright half circles on a ball, at azimuths 0° and 90°, are not visible from the front at −y. Mirrored
/// in y, one of them faces the front.
#[test]
fn a_seam_on_the_back_is_not_on_the_front() {
    let quarter = |p: Vec3| u32::from(p.x > 0.0 && p.y > 0.0);
    let surface = label(ball(), 2, quarter);
    // Half circles at azimuths 0° and 90°: the front at −90° sees neither except at its rim.
    let from_behind = figures_of(&surface).seams;
    assert!(from_behind.front_share < 0.02, "{from_behind:?}");
    let mirrored = label(ball(), 2, |p| quarter(Vec3::new(p.x, -p.y, p.z)));
    assert_near(figures_of(&mirrored).seams.front_share, 0.5, 0.02);
}

#[test]
fn a_ring_is_no_disk_and_its_inner_seam_is_seen_by_nobody_who_looks_level() {
    let torus = torus(40.0, 12.0, [96, 48]);
    let found = figures_of(&label(torus.clone(), 2, |p| u32::from(p.z > 0.0)));
    assert!(found.pieces.iter().all(|p| !p.is_disk));
    assert_eq!(found.seams.concave_share, 0.0);
    // Half of the outer circle of 52 mm is visible, and nothing of the inner one of 28 mm.
    assert_near(found.seams.visible_share, 0.5 * 52.0 / 80.0, 0.02);
    let quarters = label(torus, 4, |p| u32::from(p.x > 0.0) + 2 * u32::from(p.z > 0.0));
    let found = figures_of(&quarters);
    assert!(found.pieces.iter().all(|p| p.is_disk), "{:?}", found.pieces);
    assert_eq!(found.seams.n_triple_points, 4);
    assert_eq!(
        (found.contacts.n_faults, &found.contacts.hold_alone[..]),
        (0, &[][..])
    );
}

/// Three slices of a ball: the middle one is the only link between the others.
#[test]
fn who_alone_holds_others_is_named() {
    let surface = label(ball(), 3, |p| u32::from(p.z > -10.0) + u32::from(p.z > 10.0));
    let contacts = figures_of(&surface).contacts;
    assert_eq!((contacts.hold_alone, contacts.n_faults), (vec![PatchId(1)], 1));
    let params = FigureParams {
        min_contact_mm: 1000.0,
        ..FigureParams::default()
    };
    let short = figures(&params, &surface).contacts;
    assert_eq!((short.n_contacts, short.shortest_mm, short.n_short), (0, None, 2));
}

#[test]
fn halves_mirror_each_other_or_themselves_and_a_cap_on_one_side_does_not() {
    let mirrored = |patch_at: &dyn Fn(Vec3) -> u32| {
        let params = FigureParams {
            mirror: Some(Plane {
                at: Vec3::ZERO,
                normal: Vec3::X,
            }),
            ..FigureParams::default()
        };
        figures(&params, &label(ball(), 2, patch_at))
            .mirrored_share
            .unwrap()
    };
    assert_near(mirrored(&|p| u32::from(p.x > 0.0)), 1.0, 0.01);
    assert_near(mirrored(&|p| u32::from(p.z > 0.0)), 1.0, 0.01);
    // A cap on one side: its image lies in the other piece, whose image is mostly itself.
    let cap = mirrored(&|p| u32::from(p.x > 15.0));
    assert_near(cap, 0.5, 0.01);
    assert_eq!(figures_of(&label(ball(), 1, |_| 0)).mirrored_share, None);
}
