//! Tests of proven play against exact intersections, and of pieces that come out.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use shellock_geom::{Quat, Volume};

use super::*;
use crate::verify::kits::{ALL, HALF_GAP_MM, Kit, brick, pinned_kit};

const CLEARANCE_MM: f64 = 2.0 * HALF_GAP_MM;

fn measure_kit(kit: &Kit, clearance_mm: f64) -> KitPlay {
    let params = PlayParams {
        clearance_mm,
        slide_mm: SLIDE_MM,
        is_together: true,
        seed: 0,
    };
    let ctx = Ctx::quiet();
    let mut play = measure(&ctx, &params, &kit.pieces, &kit.plan).unwrap();
    look_for_ways_out(&ctx, clearance_mm, &kit.pieces, &mut play).unwrap();
    play
}

/// A cube of 10 mm in a closed cage with a gap all round; the key is elsewhere.
fn cage(gap_mm: f64) -> Kit {
    let hollow = [10.0 - gap_mm, 20.0 + gap_mm];
    let cage = brick(ALL, ALL, ALL).subtract(&brick(hollow, hollow, hollow));
    let inside = [10.0, 20.0];
    let key = brick([40.0, 41.0], ALL, ALL);
    Kit::new(
        brick(ALL, ALL, ALL),
        &[cage, brick(inside, inside, inside), key],
        &[Vec3::X; 3],
    )
}

/// A thin plate in a recess under two lips that reach over it by `lip_mm`, with `gap_mm` on all sides.
fn under_lips(lip_mm: f64, gap_mm: f64) -> Kit {
    let plate = brick([5.0, 25.0], [5.0, 25.0], [20.0, 21.0]);
    let recess = brick(
        [5.0 - gap_mm, 25.0 + gap_mm],
        [5.0 - gap_mm, 25.0 + gap_mm],
        [20.0 - gap_mm, 21.0 + gap_mm],
    );
    let mouth = brick(
        [5.0 + lip_mm, 25.0 - lip_mm],
        [5.0 - gap_mm, 25.0 + gap_mm],
        [20.5, 40.0],
    );
    let base = brick(ALL, ALL, ALL).subtract(&recess).subtract(&mouth);
    let key = brick([40.0, 41.0], ALL, ALL);
    Kit::new(brick(ALL, ALL, ALL), &[base, plate, key], &[Vec3::X; 3])
}

/// The check of a kit and that of its files search ways out alike, although readers of files renumber the
/// points.
#[test]
fn a_way_out_is_sought_from_the_same_points_however_they_are_numbered() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for mesh in under_lips(1.0, 0.1).pieces.as_slice() {
        let mut number: Vec<u32> = (0..mesh.points.len() as u32).collect();
        for i in 1..number.len() {
            number.swap(i, rng.random_range(0..=i));
        }
        let mut renumbered = mesh.clone();
        for (&new, &point) in number.iter().zip(&mesh.points) {
            renumbered.points[new as usize] = point;
        }
        let corners = renumbered.triangles.iter_mut().flatten();
        corners.for_each(|v| *v = number[*v as usize]);
        assert_ne!(mesh.points, renumbered.points);
        assert_eq!(way_out::as_met(mesh), way_out::as_met(&renumbered));
    }
}

#[test]
fn a_cube_in_a_cage_is_proven_to_go_hardly_farther_than_its_gap() {
    let play = measure_kit(&cage(0.1), 0.1);
    let Some(cube) = play.alone[PatchId(1)].filter(|p| p.is_proven) else {
        panic!("{:?}", play.alone)
    };
    // The cube's centre can move 0.1 mm along each axis at once; the cube can turn until its edges meet the
    // walls.
    let diagonal_mm = 0.1 * 3f64.sqrt();
    assert!(
        cube.translation_mm >= diagonal_mm - 1e-3 && cube.translation_mm < 1.5 * diagonal_mm,
        "{cube:?}"
    );
    let about_an_axis = (0.2f64 / 10.0).to_degrees();
    assert!(
        cube.rotation_deg > about_an_axis && cube.rotation_deg < 2.5 * about_an_axis,
        "{cube:?}"
    );
}

#[test]
fn faces_that_stand_back_are_a_wider_gap() {
    let (narrow, wide) = (cage(0.1), cage(0.2));
    let play = measure_kit(&narrow, 0.2);
    let thin = printed_thin(&Ctx::quiet(), &narrow.pieces, &play, 0.05).unwrap();
    let cube = |plays: &IdVec<PatchId, Option<Play>>| plays[PatchId(1)].unwrap();
    let (thin, wide) = (cube(&thin), cube(&measure_kit(&wide, 0.2).estimates));
    assert!(
        (thin.translation_mm - wide.translation_mm).abs() < 0.02,
        "{thin:?} {wide:?}"
    );
    assert!(thin.translation_mm > 1.8 * cube(&play.estimates).translation_mm);
    let as_is = printed_thin(&Ctx::quiet(), &narrow.pieces, &play, 0.0).unwrap();
    assert_eq!(as_is, play.estimates);
}

/// A random walk of the lid, each step with exact intersections, never leaves the proven bounds.
#[test]
fn no_free_walk_leads_beyond_the_proven_play() {
    let kit = pinned_kit(|_| {});
    let play = measure_kit(&kit, CLEARANCE_MM);
    let Some(lid) = play.alone[PatchId(1)].filter(|p| p.is_proven) else {
        panic!("{:?}", play.alone)
    };
    let solids: Vec<Volume> = kit
        .pieces
        .as_slice()
        .iter()
        .map(|m| Volume::from_closed_mesh(m).unwrap())
        .collect();
    let center = kit.pieces[PatchId(1)].centroid();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (mut turn, mut shift, mut farthest) = (Quat::IDENTITY, Vec3::ZERO, [0.0f64; 2]);
    for _ in 0..400 {
        let mut random = |size: f64| Vec3::from_array(std::array::from_fn(|_| rng.random_range(-size..size)));
        let (to_turn, to_shift) = (Quat::from_scaled_axis(random(0.003)) * turn, shift + random(0.04));
        let mut mesh = kit.pieces[PatchId(1)].clone();
        mesh.points
            .iter_mut()
            .for_each(|p| *p = center + to_shift + to_turn * (*p - center));
        let moved = Volume::from_closed_mesh(&mesh).unwrap();
        if [0, 2]
            .iter()
            .all(|&other| moved.intersect(&solids[other]).volume() < 1e-6)
        {
            (turn, shift) = (to_turn, to_shift);
            farthest = [
                farthest[0].max(shift.length()),
                farthest[1].max(turn.to_scaled_axis().length().to_degrees()),
            ];
        }
    }
    assert!(
        farthest[0] > 0.5 * CLEARANCE_MM && farthest[1] > 0.1,
        "the walk went nowhere: {farthest:?}"
    );
    assert!(
        farthest[0] <= lid.translation_mm && farthest[1] <= lid.rotation_deg,
        "{farthest:?} beyond {lid:?}"
    );
}

#[test]
fn the_play_of_all_together_is_no_less_than_that_of_each_alone() {
    // A cube in a cage, and a key that fills a shaft beside it.
    let (inside, shaft) = ([4.0, 12.0], [16.0, 26.0]);
    let wide = |[low, high]: [f64; 2]| [low - 0.1, high + 0.1];
    let cage = brick(ALL, ALL, ALL)
        .subtract(&brick(wide(inside), wide(inside), wide(inside)))
        .subtract(&brick(wide(shaft), wide(shaft), [9.9, 40.0]));
    let pieces = [
        cage,
        brick(inside, inside, inside),
        brick(shaft, shaft, [10.0, 30.0]),
    ];
    let play = measure_kit(
        &Kit::new(brick(ALL, ALL, ALL), &pieces, &[Vec3::X, Vec3::X, Vec3::Z]),
        0.1,
    );
    let Some(together) = &play.together else {
        panic!("not proven: {:?}", play.alone)
    };
    assert_eq!(together[PatchId(0)], None, "the cage touches both and is held");
    for id in [PatchId(1), PatchId(2)] {
        let (Some(both), Some(alone)) = (together[id], play.alone[id]) else {
            panic!("{together:?}")
        };
        assert!(
            both.is_proven && (both.translation_mm - alone.translation_mm).abs() < 0.02,
            "{both:?} {alone:?}"
        );
    }
    assert!(
        play.alone[PatchId(2)].is_some_and(|key| key.translation_mm > SLIDE_MM),
        "the key may slide"
    );
}

#[test]
fn what_nothing_holds_is_found_to_come_out() {
    // A block, not the key, in a shaft that is open above.
    let (shaft, wide) = ([10.0, 20.0], [9.9, 20.1]);
    let base = brick(ALL, ALL, ALL).subtract(&brick(wide, wide, [19.9, 40.0]));
    let pieces = [
        base,
        brick(shaft, shaft, [20.0, 30.0]),
        brick([40.0, 41.0], ALL, ALL),
    ];
    let kit = Kit::new(brick(ALL, ALL, ALL), &pieces, &[Vec3::X; 3]);
    let play = measure_kit(&kit, 0.1);
    assert!(
        !play.alone[PatchId(1)].is_some_and(|p| p.is_proven),
        "{:?}",
        play.alone
    );
    let (_, poses) = play
        .ways_out
        .iter()
        .flatten()
        .find(|way| way.0 == PatchId(1))
        .expect("it slides out upwards");
    assert_eq!(poses[0], [0.0; 6]);
    assert!(poses[poses.len() - 1][2] > 9.0, "{:?}", poses.last());
    let (check, findings) = check_ways_out(&play, &kit.pieces).expect("it was looked for");
    assert!(
        !check.ok
            && findings.iter().any(|f| matches!(
                f,
                Finding::ComesOut {
                    piece: PatchId(1),
                    ..
                }
            ))
    );
}

#[test]
fn what_lies_under_wide_lips_is_proven_to_stay_and_under_narrow_ones_it_is_not() {
    let held = measure_kit(&under_lips(3.0, 0.12), 0.12);
    assert!(
        held.alone[PatchId(1)].is_some_and(|p| p.is_proven) && held.ways_out == Some(Vec::new()),
        "{:?}",
        held.alone
    );
    // Shifted under one lip by 0.4 mm, the plate is free of the other, which reaches over it by 0.3.
    let loose = measure_kit(&under_lips(0.3, 0.4), 0.4);
    assert!(
        !loose.alone[PatchId(1)].is_some_and(|p| p.is_proven),
        "{:?}",
        loose.alone
    );
}

#[test]
fn a_drawer_is_found_to_come_out_and_a_ball_that_spins_in_its_socket_is_not() {
    let key = brick([60.0, 61.0], ALL, ALL);
    // Open only in front; a drawer of 16 mm that must be pulled all the way out.
    let cabinet = brick(ALL, ALL, ALL).subtract(&brick([10.0, 40.0], [9.9, 20.1], [9.9, 20.1]));
    let drawer = brick([14.0, 30.0], [10.0, 20.0], [10.0, 20.0]);
    let kit = Kit::new(
        brick(ALL, ALL, ALL),
        &[cabinet, drawer, key.clone()],
        &[Vec3::X; 3],
    );
    let play = measure_kit(&kit, 0.1);
    assert!(
        play.ways_out.iter().flatten().any(|way| way.0 == PatchId(1)),
        "{:?}",
        play.alone
    );
    // Nothing ends the ball's rotations; still the ball stays in its place.
    let ball = |radius_mm: f64| {
        let sphere = shellock_testkit::shapes::sphere(3, Vec3::splat(radius_mm));
        Volume::from_closed_mesh(&sphere)
            .unwrap()
            .translate(Vec3::splat(15.0))
    };
    let socket =
        brick(ALL, ALL, ALL)
            .subtract(&ball(8.15))
            .subtract(&brick([14.0, 16.0], [14.0, 16.0], [15.0, 40.0]));
    let kit = Kit::new(brick(ALL, ALL, ALL), &[socket, ball(8.0), key], &[Vec3::X; 3]);
    let play = measure_kit(&kit, 0.1);
    assert!(play.unproven().any(|id| id == PatchId(1)));
    assert_eq!(play.ways_out, Some(Vec::new()));
}

#[test]
fn a_speck_is_no_bearing() {
    // The cube touches its cage only on a needle: 0.05 mm wide, on one side.
    let hollow = [9.0, 21.0];
    let cage = brick(ALL, ALL, ALL).subtract(&brick(hollow, hollow, hollow));
    let needle = brick([19.9, 20.95], [15.0, 15.05], [15.0, 15.05]);
    let cube = Volume::union_all(vec![brick([10.0, 20.0], [10.0, 20.0], [10.0, 20.0]), needle]);
    let kit = Kit::new(
        brick(ALL, ALL, ALL),
        &[cage, cube, brick([40.0, 41.0], ALL, ALL)],
        &[Vec3::X; 3],
    );
    let play = measure_kit(&kit, 0.1);
    assert!(
        play.proofs.iter().all(|proof| proof.free != [PatchId(1)]),
        "{:?}",
        play.alone
    );
}

#[test]
fn play_is_the_same_on_one_thread_and_on_two() {
    let kit = pinned_kit(|_| {});
    let on = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| format!("{:?}", measure_kit(&kit, CLEARANCE_MM)))
    };
    assert!(on(1) == on(2));
}
