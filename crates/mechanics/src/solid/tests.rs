use shellock_geom::{Aabb, Quat, TriMesh, Volume};
use shellock_testkit::plain;

use super::voxels::voxels;
use super::*;

/// Box that is rotated about the origin, then translated.
fn block(min: Vec3, max: Vec3, turn: Quat, by: Vec3) -> Solid {
    let (points, triangles) = plain::cuboid(min, max);
    let points = points.into_iter().map(|p| turn * p + by).collect();
    Solid::new(TriMesh { points, triangles }).unwrap()
}

fn upright(min: [f64; 3], max: [f64; 3]) -> Solid {
    block(min.into(), max.into(), Quat::IDENTITY, Vec3::ZERO)
}

fn model(params: &SolidParams, pieces: &[Solid], held: &[Hold]) -> SolidModel {
    SolidModel::new(params, pieces, held, &|_| false, &|| false).unwrap()
}

/// Rotation that lies along no axis.
fn aslant() -> Quat {
    Quat::from_axis_angle(Vec3::new(1.0, 2.0, -1.5).normalize(), 0.7)
}

const STEEP: SolidParams = SolidParams {
    cell_mm: 2.5,
    reach_mm: 0.8,
    spacing_mm: 2.0,
    material: Material::SLA_RESIN,
};

#[test]
fn voxels_have_the_volume_of_what_fills_them_however_it_lies() {
    let solid = block(
        Vec3::ZERO,
        Vec3::new(20.0, 7.0, 2.0),
        aslant(),
        Vec3::new(3.1, -8.2, 0.4),
    );
    let found = voxels(solid.mesh(), 2.5);
    let share: f64 = found.fills.iter().flatten().map(|f| f64::from(f.share)).sum();
    assert!((share * 0.125 / 280.0 - 1.0).abs() < 2e-3, "{}", share * 0.125);
}

#[test]
fn a_bar_that_is_pulled_stretches_evenly_in_cells_that_are_cut_to_two_hundredths() {
    // A bar whose square section fills no cell, pulled at its ends by the forces of a uniform stress.
    let bar = upright([0.3, 0.2, 0.0], [4.2, 4.1, 20.0]);
    let mut model = model(&STEEP, &[bar], &[]);
    let mut pushes = Vec::new();
    for i in 0..20 {
        for j in 0..20 {
            let at = |k: i32, from: f64| from + 3.9 * (f64::from(k) + 0.5) / 20.0;
            for (z, sign) in [(0.0, -1.0), (20.0, 1.0)] {
                pushes.push(Push {
                    part: 0,
                    at: Vec3::new(at(i, 0.3), at(j, 0.2), z),
                    force_n: Vec3::new(0.0, 0.0, sign * 3.9 * 3.9 / 400.0),
                });
            }
        }
    }
    let places = [5.0, 15.0].map(|z| model.spot(0, Vec3::new(2.2, 2.1, z)).unwrap());
    let moved = model
        .under_load(&pushes, Answer::Springs, 0.0, &|| false)
        .unwrap();
    let stretch = (moved.moved_mm(&places[1]) - moved.moved_mm(&places[0])).z;
    // 1 MPa over 2000 MPa along 10 mm.
    assert!((stretch / 0.005 - 1.0).abs() < 0.02, "{stretch}");
    assert!(
        (moved.stress()[0].robust_mpa - 1.0).abs() < 0.15,
        "{:?}",
        moved.stress()
    );
}

/// Deflection of the tip of a strip of 40 mm × 8 mm × 2 mm, relative to beam theory.
fn cantilever(turn: Quat, cell_mm: f64) -> f64 {
    let (length, width, thickness) = (40.0, 8.0, 2.0);
    let by = Vec3::new(0.7, 0.9, 1.1);
    let strip = block(
        Vec3::new(-4.0, 0.0, 0.0),
        Vec3::new(length, width, thickness),
        turn,
        by,
    );
    let place = |x: f64, y: f64, z: f64| turn * Vec3::new(x, y, z) + by;
    // The root and 4 mm of it are held.
    let held: Vec<Hold> = (0..5 * 8 * 4)
        .map(|i| Hold {
            part: 0,
            at: place(
                -4.0 + f64::from(i % 5),
                0.5 + f64::from(i / 5 % 8),
                2.0 / 3.0 * f64::from(i / 40),
            ),
            area_mm2: 1.0,
        })
        .collect();
    let params = SolidParams { cell_mm, ..STEEP };
    let mut model = model(&params, &[strip], &held);
    let push = |y: f64| Push {
        part: 0,
        at: place(length, y, 1.0),
        force_n: turn * Vec3::new(0.0, 0.0, 0.25),
    };
    let tip = model.spot(0, place(length, 4.0, 1.0)).unwrap();
    let moved = model
        .under_load(
            &[push(1.0), push(3.0), push(5.0), push(7.0)],
            Answer::Held,
            0.0,
            &|| false,
        )
        .unwrap();
    let second = width * f64::powi(thickness, 3) / 12.0;
    let beam = f64::powi(length, 3) / (3.0 * 2000.0 * second);
    (turn.inverse() * moved.moved_mm(&tip)).z / beam
}

#[test]
fn a_cantilever_bends_as_beams_do_however_it_is_cut_by_the_grid() {
    // A strip this wide is stiffer than a beam at its root by some per cent.
    let upright = cantilever(Quat::IDENTITY, 2.5);
    assert!((0.95..1.02).contains(&upright), "{upright}");
    for cell_mm in [2.0, 2.5, 3.0] {
        let slanted = cantilever(aslant(), cell_mm);
        assert!(
            (slanted / upright - 1.0).abs() < 0.04,
            "{cell_mm} mm: {slanted} {upright}"
        );
    }
}

#[test]
fn two_lips_in_one_cell_are_not_bridged() {
    // A hairpin: two strips 1.2 mm apart that meet at one end, pressed apart at the other.
    let slab = |min: [f64; 3], max: [f64; 3]| {
        Volume::cuboid(Aabb {
            min: min.into(),
            max: max.into(),
        })
    };
    let whole = slab([0.0; 3], [30.0, 6.0, 4.2]);
    let pin = Solid::new(
        whole
            .subtract(&slab([4.0, -1.0, 1.5], [31.0, 7.0, 2.7]))
            .to_mesh(),
    )
    .unwrap();
    let mut model = model(&STEEP, &[pin], &[]);
    let at = [0.0, 4.2].map(|z| Vec3::new(29.0, 3.0, z));
    let spots = at.map(|p| model.spot(0, p).unwrap());
    let pushes = [0, 1].map(|i| Push {
        part: 0,
        at: at[i],
        force_n: Vec3::new(0.0, 0.0, if i == 0 { -1.0 } else { 1.0 }),
    });
    let moved = model
        .under_load(&pushes, Answer::Springs, 0.0, &|| false)
        .unwrap();
    let apart = (moved.moved_mm(&spots[1]) - moved.moved_mm(&spots[0])).z;
    let one = 25.0_f64.powi(3) / (3.0 * 2000.0 * 6.0 * 1.5_f64.powi(3) / 12.0);
    assert!((0.93..1.1).contains(&(apart / (2.0 * one))), "{apart} {one}");
}

/// Displacement of a block on a held table: when the play is taken up, and under weight and pull.
fn on_a_table(gap_mm: f64, weight_n: f64, pull_n: f64, friction: f64) -> [Vec3; 2] {
    let table = upright([-10.0, -10.0, -4.0], [10.0, 10.0, 0.0]);
    let block = upright([-4.0, -4.0, gap_mm], [4.0, 4.0, 6.0]);
    let held: Vec<Hold> = (0..36)
        .map(|i| Hold {
            part: 0,
            at: Vec3::new(-9.0 + 3.6 * f64::from(i % 6), -9.0 + 3.6 * f64::from(i / 6), -4.0),
            area_mm2: 10.0,
        })
        .collect();
    let mut model = model(&STEEP, &[table, block], &held);
    let top = |x: f64, y: f64| Push {
        part: 1,
        at: Vec3::new(x, y, 6.0),
        force_n: Vec3::new(0.0, 0.0, -weight_n / 4.0),
    };
    let mut pushes = vec![top(3.0, 3.0), top(-3.0, 3.0), top(3.0, -3.0), top(-3.0, -3.0)];
    // Low, so that the block does not tip.
    for y in [-3.0, 3.0] {
        pushes.push(Push {
            part: 1,
            at: Vec3::new(4.0, y, 1.0),
            force_n: Vec3::new(pull_n / 2.0, 0.0, 0.0),
        });
    }
    let spot = model.spot(1, Vec3::new(0.0, 0.0, 3.0)).unwrap();
    let moved = model
        .under_load(&pushes, Answer::Held, friction, &|| false)
        .unwrap();
    [moved.moved_mm(&spot), moved.settled_mm(&spot)]
}

#[test]
fn a_gap_closes_by_exactly_the_gap() {
    for gap_mm in [0.0, 0.1, 0.3] {
        let [moved, settled] = on_a_table(gap_mm, 10.0, 0.0, 0.0);
        assert!((settled.z + gap_mm).abs() < 1e-3, "{settled} {gap_mm}");
        // Then the material yields elastically: 10 N on 64 mm², 2000 MPa, some mm high.
        let gives = -gap_mm - moved.z;
        assert!((0.0..2e-3).contains(&gives), "{gives}");
    }
}

#[test]
fn friction_holds_up_to_its_share_of_the_pressure_and_no_further() {
    let [held, _] = on_a_table(0.1, 10.0, 1.8, 0.2);
    assert!(held.x < 0.01, "{held}");
    let [slides, _] = on_a_table(0.1, 10.0, 2.2, 0.2);
    assert!(slides.x > 1.0, "{slides}");
    // Without friction nothing holds the block.
    let [slides, _] = on_a_table(0.1, 10.0, 1.8, 0.0);
    assert!(slides.x > 10.0, "{slides}");
}

#[test]
fn a_rigid_motion_costs_nothing_and_a_body_that_is_thrown_is_not_deformed_by_its_frame() {
    // Pushed in its middle and balanced by its own inertia, a bar is compressed as one half pushes the other.
    let bar = block(Vec3::ZERO, Vec3::new(30.0, 5.0, 5.0), aslant(), Vec3::ZERO);
    let mut model = model(&STEEP, &[bar], &[]);
    let place = |x: f64, y: f64, z: f64| aslant() * Vec3::new(x, y, z);
    let spots = [5.0, 30.0].map(|x| model.spot(0, place(x, 2.5, 2.5)).unwrap());
    let pushes: Vec<Push> = (0..25)
        .map(|i| Push {
            part: 0,
            at: place(0.0, 0.5 + f64::from(i % 5), 0.5 + f64::from(i / 5)),
            force_n: aslant() * Vec3::new(0.4, 0.0, 0.0),
        })
        .collect();
    let moved = model
        .under_load(&pushes, Answer::Inertia, 0.0, &|| false)
        .unwrap();
    let shorter = (aslant().inverse() * (moved.moved_mm(&spots[0]) - moved.moved_mm(&spots[1]))).x;
    // Force falls from 10 N to 0 along the bar, and acts by its mean, 25 / 60 of it, on the last 25 mm.
    let wanted = 10.0 * 25.0 / 60.0 * 25.0 / (2000.0 * 25.0);
    assert!((shorter / wanted - 1.0).abs() < 0.1, "{shorter} {wanted}");
    assert!(moved.lost().is_empty());
}

#[test]
fn the_answer_is_the_same_on_any_number_of_threads() {
    let answer = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| on_a_table(0.1, 10.0, 1.0, 0.2))
    };
    assert_eq!(answer(1), answer(2));
}

#[test]
fn what_cannot_be_tested_is_refused() {
    let refused = |params: &SolidParams, piece: Solid| {
        SolidModel::new(params, &[piece], &[], &|_| false, &|| false).err()
    };
    let wide = SolidParams {
        cell_mm: f64::NAN,
        ..STEEP
    };
    let cube = || upright([0.0; 3], [5.0; 3]);
    assert!(matches!(refused(&wide, cube()), Some(SolidError::Params(_))));
    let film = upright([0.0, 0.0, 0.1], [5.0, 5.0, 0.11]);
    assert_eq!(refused(&STEEP, film), Some(SolidError::Empty { piece: 0 }));
    let huge = upright([0.0; 3], [3000.0; 3]);
    assert_eq!(refused(&STEEP, huge), Some(SolidError::TooLarge { piece: 0 }));
    let stopped = SolidModel::new(&STEEP, &[cube()], &[], &|_| false, &|| true);
    assert_eq!(stopped.err(), Some(SolidError::Stopped));
    let mut fine = model(&STEEP, &[cube()], &[]);
    let push = Push {
        part: 1,
        at: Vec3::ZERO,
        force_n: Vec3::X,
    };
    let refused = fine.under_load(&[push], Answer::Springs, 0.0, &|| false).err();
    assert_eq!(
        refused,
        Some(SolidError::Load {
            piece: 1,
            n_pieces: 1
        })
    );
}

#[test]
fn a_pin_touches_the_bottom_of_its_channel_all_over_and_from_either_side() {
    // The sides are nearer to the pin's rim than the bottom is.
    let pin = upright([0.0, 0.0, 0.0], [4.0, 4.0, 4.0]);
    let outer = Volume::hull(&corners([-3.0, -3.0, -3.0], [7.0, 7.0, 3.0]));
    let inner = Volume::hull(&corners([-0.15, -0.15, -0.5], [4.15, 4.15, 5.0]));
    let channel = Solid::new(outer.subtract(&inner).to_mesh()).unwrap();
    let touches = super::touch::touches(&[pin, channel], 0.8, 1.0);
    for (parts, down) in [([0, 1], -1.0), ([1, 0], 1.0)] {
        let below = touches
            .iter()
            .filter(|t| t.parts == parts && t.normal.z * down > 0.99);
        let area_mm2: f64 = below.map(|t| t.area_mm2).sum();
        // Half of the pin's face of 16 mm², and half of the bottom that lies before it.
        assert!((7.9..9.3).contains(&area_mm2), "{parts:?}: {area_mm2}");
    }
}

fn corners(min: [f64; 3], max: [f64; 3]) -> Vec<Vec3> {
    plain::cuboid(min.into(), max.into()).0
}
