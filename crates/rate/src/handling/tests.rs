use nalgebra::Vector3;
use shellock_geom::Vec3;
use shellock_plan::sizes::ConnectorSizes;
use shellock_surface::SegmentedSurface;
use shellock_test_surfaces::{label, sphere};

use super::*;
use crate::metric::{MetricParams, PlanModel};

fn handling() -> Handling {
    Handling::new([0.0, 0.0, 1.0], 2.0, Material::default())
}

fn octants(centered: Vec3) -> ShellAssembly {
    let octant = |p: Vec3| u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0) + 4 * u32::from(p.z > 0.0);
    let mut surface = label(sphere(5, Vec3::splat(40.0)), 8, octant);
    surface.mesh.points.iter_mut().for_each(|p| *p += centered);
    assembly(&surface)
}

fn assembly(surface: &SegmentedSurface) -> ShellAssembly {
    PlanModel::new(&MetricParams::default(), surface, &ConnectorSizes::default()).assembly
}

/// Sum of forces and of torques about the origin, N and N·mm.
fn wrench(assembly: &ShellAssembly, case: &LoadCase) -> [Vec3; 2] {
    let all = || assembly.points.iter().zip(&case.forces_n);
    [
        all().map(|(_, f)| *f).sum(),
        all().map(|(p, f)| p.cross(*f)).sum(),
    ]
}

#[test]
fn what_rests_or_is_held_is_in_balance_and_what_falls_is_stopped_by_what_it_lands_on() {
    let ball = octants(Vec3::new(5.0, -7.0, 3.0));
    let cases = load_cases(&handling(), &ball);
    for case in &cases {
        let [force, torque] = wrench(&ball, case);
        match case.deed {
            Deed::FallUpright | Deed::Fall { .. } => {
                assert!((force.length() / case.force_n - 1.0).abs() < 1e-9)
            }
            Deed::GripNarrow | Deed::GripWide => assert!(force.length() < 1e-9 * case.force_n, "{case:?}"),
            _ => assert!(
                force.length() < 1e-6 * case.force_n && torque.length() < 1e-4 * case.force_n,
                "{:?}: {force} N, {torque} N mm",
                case.deed
            ),
        }
    }
    let n = |is: fn(&Deed) -> bool| cases.iter().filter(|c| is(&c.deed)).count();
    assert_eq!(n(|d| matches!(d, Deed::Fall { .. })), 12);
    assert_eq!(n(|d| matches!(d, Deed::Hang { .. })), 8);
    assert_eq!(
        n(|d| matches!(d, Deed::PressTop | Deed::PressMiddle | Deed::FallUpright)),
        3
    );
}

#[test]
fn a_press_avoids_what_is_thin_and_what_would_tip_over() {
    // A table of 60 mm with a needle on top, and an arm that hangs over.
    let block = |from: [f64; 3], to: [f64; 3]| {
        let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|i: usize| {
            Vec3::from_array(std::array::from_fn(
                |k| if i >> k & 1 == 1 { to[k] } else { from[k] },
            ))
        });
        Volume::hull(&corners)
    };
    let table = block([0.0; 3], [60.0, 60.0, 60.0]);
    let needle = block([28.0, 28.0, 50.0], [33.0, 33.0, 100.0]);
    let arm = block([50.0, 20.0, 50.0], [140.0, 45.0, 75.0]);
    let mesh = table.union(&needle).union(&arm).to_mesh();
    let surface = label(mesh, 2, |p| u32::from(p.z > 30.0));
    let assembly = assembly(&surface);
    let top = load_cases(&handling(), &assembly)
        .into_iter()
        .find(|c| c.deed == Deed::PressTop)
        .expect("the table is wide enough");
    assert!(top.at.z < 76.0 && top.at.x < 65.0, "{}", top.at);
}

#[test]
fn a_body_laid_down_rests_on_the_side_below_its_middle() {
    let hull = Volume::hull(&[
        Vec3::ZERO,
        Vec3::new(30.0, 0.0, 0.0),
        Vec3::new(0.0, 30.0, 0.0),
        Vec3::new(0.0, 0.0, 30.0),
    ])
    .to_mesh();
    let center = Vec3::splat(7.0);
    // Balanced on a tip it falls on a side. All sides are below its middle, so it stays on each.
    for side in [Vec3::X, Vec3::Y, Vec3::Z] {
        let rest = region::at_rest(&hull, center, side).unwrap();
        assert!((rest - side).length() < 1e-9, "{rest}");
    }
    // A prism that leans over farther than its foot reaches rolls onto its side.
    let corner = |i: usize| Vec3::new(10.0 * (i & 1) as f64, 10.0 * (i >> 1 & 1) as f64, 0.0);
    let leaning = |i: usize| corner(i) + Vec3::new(40.0, 0.0, 30.0) * (i >> 2) as f64;
    let prism = Volume::hull(&[0, 1, 2, 3, 4, 5, 6, 7].map(leaning)).to_mesh();
    let rolled = region::at_rest(&prism, Vec3::new(25.0, 5.0, 15.0), Vec3::Z).unwrap();
    assert!(rolled.dot(Vec3::Z) < 0.9 && rolled.x < 0.0, "{rolled}");
}

#[test]
fn a_floor_presses_as_a_lever_says_and_never_pulls() {
    // Feet at −1 and 1: a force at x between them is shared as by a lever.
    let feet = [
        ([1.0, -1.0, 0.0], 2.0),
        ([1.0, 1.0, 0.0], 2.0),
        ([1.0, 0.0, 1.0], 1e-6),
        ([1.0, 0.0, -1.0], 1e-6),
    ];
    for x in [-0.9, -0.5, 0.0, 0.3] {
        let found = region::pressures(&feet, Vector3::new(70.0, 70.0 * x, 0.0));
        assert!(
            (found[0] - 35.0 * (1.0 - x)).abs() < 1e-2 && (found[1] - 35.0 * (1.0 + x)).abs() < 1e-2,
            "{found:?}"
        );
    }
    let beyond = region::pressures(&feet, Vector3::new(70.0, 90.0, 0.0));
    assert!(beyond.iter().all(|p| *p >= 0.0) && beyond[0] == 0.0, "{beyond:?}");
}

#[test]
fn the_factor_is_that_of_the_joint_that_gives_way_first() {
    use shellock_mechanics::{Joint, Side};
    let joint = |size_mm| Joint {
        male: Side::A,
        leaves: Vec3::Z,
        is_fast: false,
        pull_on_a: Vec3::Z,
        weight: 1.0,
        size_mm,
    };
    let plan: Vec<Meeting> = [Some(2.0), None, Some(4.0)]
        .map(|size| Meeting {
            wall: Vec3::X,
            joint: size.map(joint),
        })
        .to_vec();
    let bearing = |opening_mm: [f64; 3], pin_mpa: [f64; 3]| Bearing {
        opening_mm: opening_mm.to_vec(),
        pin_mpa: pin_mpa.to_vec(),
        length_mm: vec![1.0; 3],
        n_iterations: 1,
        error: 0.0,
    };
    // The openings of 0.6 mm and 1.2 mm are the limits of these connectors.
    let opens = load_factor(&plan, &bearing([0.3, 9.0, 0.4], [1.0, 0.0, 1.0]), 42.0);
    assert_eq!(opens.first, Some((Failure::Opens, 0)));
    assert!((opens.factor - 2.0).abs() < 1e-12);
    let yields = load_factor(&plan, &bearing([0.3, 9.0, 0.4], [1.0, 0.0, 42.0]), 42.0);
    assert_eq!(
        (yields.factor, yields.first),
        (1.0, Some((Failure::PinYields, 2)))
    );
    assert_eq!(load_factor(&plan, &bearing([0.0; 3], [0.0; 3]), 42.0), Borne::ANY);
}

#[test]
fn a_pin_of_three_in_a_hundred_decides_and_one_of_two_does_not() {
    use shellock_mechanics::{Joint, Side};
    let joint = Joint {
        male: Side::A,
        leaves: Vec3::Z,
        is_fast: false,
        pull_on_a: Vec3::Z,
        weight: 1.0,
        size_mm: 2.5,
    };
    let plan = vec![
        Meeting {
            wall: Vec3::X,
            joint: Some(joint)
        };
        100
    ];
    let factor = |n_bent: usize| {
        let bearing = Bearing {
            opening_mm: vec![0.0; 100],
            pin_mpa: (0..100).map(|i| if i < n_bent { 84.0 } else { 21.0 }).collect(),
            length_mm: vec![2.0; 100],
            n_iterations: 1,
            error: 0.0,
        };
        load_factor(&plan, &bearing, 42.0).factor
    };
    assert_eq!([0, 2, 4, 100].map(factor), [2.0, 2.0, 0.5, 0.5]);
}
