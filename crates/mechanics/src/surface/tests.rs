use shellock_geom::Vec3;

use super::*;
use crate::Side;
use crate::neighbourhood::{outer_ring, two_plates};

const N: usize = 8;
const ROWS: usize = 4;

fn plates(params: &SurfaceParams) -> SurfaceModel {
    SurfaceModel::with_held_points(params, &two_plates(N, ROWS, 5.0), &outer_ring(N, ROWS)).unwrap()
}

/// Joints of side a as the male, leaving along `leaves`, pulled along `pull`.
fn joints(leaves: Vec3, pull: Vec3) -> Vec<Option<Joint>> {
    vec![Some(Joint { male: Side::A, leaves, pull_on_a: pull, weight: 1.0 }); N - 1]
}

fn opening(solution: &SurfaceSolution) -> f64 {
    let Resistance::Holds(opening) = &solution.resistance else { panic!("held all round: {solution:?}") };
    -opening.quality_mm
}

#[test]
fn rigid_motions_cost_nothing_and_stretching_costs_about_as_much_as_in_a_plate() {
    let params = SurfaceParams::default();
    let assembly = two_plates(N, ROWS, 5.0);
    let points = assembly.points.clone();
    let terms = patch_terms(&params, &assembly, &points);
    let energy = |motion: &dyn Fn(Vec3) -> Vec3| -> f64 {
        let stretched = |t: &Term| t.corners().map(|(p, g)| g.dot(motion(points[p]))).sum::<f64>();
        terms.iter().map(|t| 0.5 * t.stiffness * stretched(t).powi(2)).sum()
    };
    assert!(energy(&|p| Vec3::new(1.0, 2.0, 3.0) + Vec3::new(0.3, 0.2, -0.5).cross(p)) < 1e-15);
    // Uniform stretch in x with ν = 1/3 across costs E ε² / 2 per volume: exactly so on equilateral triangles; these have
    // right angles, the worst that a remeshed surface has.
    let volume = 2.0 * 40.0 * 20.0 * 2.0;
    let expected = 0.5 * 2000.0 * volume;
    let found = energy(&|p| Vec3::new(p.x, -p.y / 3.0, 0.0));
    assert!((found / expected - 1.0).abs() < 0.25, "{found} for {expected}");
}

#[test]
fn a_joint_opens_along_its_direction_and_hardly_across_it() {
    let model = plates(&SurfaceParams::default());
    let free = opening(&model.resist(&joints(Vec3::Z, Vec3::Z)));
    let pushed = opening(&model.resist(&joints(Vec3::Z, -Vec3::Z)));
    let across = opening(&model.resist(&joints(Vec3::Z, Vec3::Y)));
    assert!(free > 10.0 * pushed && free > 10.0 * across, "{free} {pushed} {across}");
    let sideways = opening(&model.resist(&joints(-Vec3::Y, Vec3::Z)));
    assert!(free > 5.0 * sideways, "{free} {sideways}");
}

#[test]
fn openings_grow_with_the_force_and_fall_with_the_modulus() {
    let params = SurfaceParams { tolerance: 1e-6, ..SurfaceParams::default() };
    let one = opening(&plates(&params).resist(&joints(Vec3::Z, Vec3::new(0.0, 0.6, 0.8))));
    let mut stiff = params;
    stiff.material.youngs_modulus_mpa *= 2.0;
    stiff.force_n_per_mm *= 3.0;
    let other = opening(&plates(&stiff).resist(&joints(Vec3::Z, Vec3::new(0.0, 0.6, 0.8))));
    assert!((other / one - 1.5).abs() < 1e-4, "{one} {other}");
}

#[test]
fn the_static_state_is_reached_a_thousand_times_finer_changes_a_quality_by_less_than_a_percent() {
    let plans: Vec<Vec<Option<Joint>>> = [(Vec3::Z, 0.3), (-Vec3::Y, 1.2), (Vec3::new(0.0, -0.6, 0.8), 2.0)]
        .map(|(leaves, turn): (Vec3, f64)| joints(leaves, Vec3::new(0.3, turn.sin(), turn.cos())))
        .to_vec();
    let coarse = plates(&SurfaceParams::default()).resist_all(&plans);
    let fine = plates(&SurfaceParams { tolerance: 1e-6, ..SurfaceParams::default() }).resist_all(&plans);
    for (c, f) in coarse.iter().zip(&fine) {
        assert!(c.error <= 1e-3 && f.error <= 1e-6 && f.n_iterations < 400);
        assert!((opening(c) / opening(f) - 1.0).abs() < 0.01, "{} {}", opening(c), opening(f));
    }
}

#[test]
fn many_plans_together_give_what_each_gives_alone_and_the_same_bits_on_any_number_of_threads() {
    let model = plates(&SurfaceParams::default());
    let plans: Vec<_> = (0..40).map(|i| joints(Vec3::Z, Vec3::new(0.1, (i as f64).sin(), (i as f64).cos()))).collect();
    let together = model.resist_all(&plans);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(|| model.resist_all(&plans)), together);
    // Solving several sides at once rounds differently.
    assert!((opening(&model.resist(&plans[7])) / opening(&together[7]) - 1.0).abs() < 1e-3);
}

#[test]
fn a_plate_that_nothing_holds_back_comes_apart() {
    // Side b floats and is pulled out of its channel.
    let model = SurfaceModel::new(&SurfaceParams::default(), &two_plates(N, ROWS, 5.0), 0).unwrap();
    let solution = model.resist(&joints(Vec3::Z, Vec3::Z));
    assert_eq!(solution.resistance, Resistance::Separable(vec![1]));
}
