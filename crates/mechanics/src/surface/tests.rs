use nalgebra::{DMatrix, DVector};
use shellock_geom::Vec3;

use super::contact::{ContactSpring, contacts_at, forces};
use super::parts::Motions;
use super::terms::{Root, Term, patch_terms};
use super::*;
use crate::neighbourhood::{outer_ring, two_plates};
use crate::sample::ball;
use crate::{Joint, Side};

const N: usize = 8;
const ROWS: usize = 4;

fn plates(params: &SurfaceParams) -> SurfaceModel {
    SurfaceModel::with_held_points(params, &two_plates(N, ROWS, 5.0), &outer_ring(N, ROWS)).unwrap()
}

/// Joints with side a as the male, leaving along `leaves`, pulled along `pull`.
fn joints(leaves: Vec3, pull: Vec3) -> Vec<Meeting> {
    let joint = Joint {
        male: Side::A,
        leaves,
        is_fast: false,
        pull_on_a: pull,
        weight: 1.0,
        size_mm: 2.5,
    };
    vec![
        Meeting {
            wall: Vec3::Y,
            joint: Some(joint)
        };
        N - 1
    ]
}

fn pull_apart(model: &SurfaceModel, plan: &[Meeting]) -> SurfaceSolution {
    model.respond(plan, &model.pulls(plan)).unwrap()
}

fn opening(solution: &SurfaceSolution) -> f64 {
    let Resistance::Holds(opening) = &solution.resistance else {
        panic!("held all round: {solution:?}")
    };
    -opening.quality_mm
}

#[test]
fn rigid_motions_cost_nothing_and_stretching_costs_about_as_much_as_in_a_plate() {
    let params = SurfaceParams::default();
    let assembly = two_plates(N, ROWS, 5.0);
    let points = assembly.points.clone();
    let terms = patch_terms(&params, &assembly, &points);
    let energy = |motion: &dyn Fn(Vec3) -> Vec3| -> f64 {
        let stretched = |t: &Term| {
            t.corners
                .iter()
                .map(|&(p, g)| g.dot(motion(points[p as usize])))
                .sum::<f64>()
        };
        terms
            .iter()
            .map(|t| 0.5 * t.stiffness * stretched(t).powi(2))
            .sum()
    };
    assert!(energy(&|p| Vec3::new(1.0, 2.0, 3.0) + Vec3::new(0.3, 0.2, -0.5).cross(p)) < 1e-15);
    // Uniform stretch in x with ν = 1/3 across costs E ε² / 2 per volume: exactly so on equilateral
    // triangles; these have right angles, the worst that a remeshed surface has.
    let volume = 2.0 * 40.0 * 20.0 * 2.0;
    let expected = 0.5 * 2000.0 * volume;
    let found = energy(&|p| Vec3::new(p.x, -p.y / 3.0, 0.0));
    assert!((found / expected - 1.0).abs() < 0.25, "{found} for {expected}");
}

#[test]
fn a_joint_opens_along_its_direction_and_hardly_across_it() {
    let model = plates(&SurfaceParams::default());
    let free = opening(&pull_apart(&model, &joints(Vec3::Z, Vec3::Z)));
    let pushed = opening(&pull_apart(&model, &joints(Vec3::Z, -Vec3::Z)));
    let across = opening(&pull_apart(&model, &joints(Vec3::Z, Vec3::Y)));
    assert!(
        free > 10.0 * pushed && free > 10.0 * across,
        "{free} {pushed} {across}"
    );
    let sideways = opening(&pull_apart(&model, &joints(-Vec3::Y, Vec3::Z)));
    assert!(free > 5.0 * sideways, "{free} {sideways}");
}

/// The bending stiffness `D = E h³/12(1 − ν²)` of a plate, N mm.
fn plate_stiffness(params: &SurfaceParams) -> f64 {
    let m = params.material;
    m.youngs_modulus_mpa * params.wall_mm.powi(3) / (12.0 * (1.0 - m.poissons_ratio.powi(2)))
}

/// Energy is `D κ²/2` per area, without the half cells at both ends, beyond whose last edges nothing bends.
#[test]
fn a_plate_bent_to_a_cylinder_costs_its_bending_stiffness() {
    let params = SurfaceParams::default();
    let assembly = two_plates(N, ROWS, 5.0);
    let curvature = 1e-3;
    let bent = |term: &Term| {
        let height = |v: u32| 0.5 * curvature * assembly.points[v as usize].x.powi(2);
        term.corners.iter().map(|&(v, g)| g.z * height(v)).sum::<f64>()
    };
    let terms = patch_terms(&params, &assembly, &assembly.points);
    let found: f64 = terms.iter().map(|t| 0.5 * t.stiffness * bent(t).powi(2)).sum();
    let area_mm2 = 2.0 * (5.0 * (N - 1) as f64) * (5.0 * ROWS as f64);
    let expected = 0.5 * plate_stiffness(&params) * curvature.powi(2) * area_mm2;
    assert!(
        (found / expected - 1.0).abs() < 1e-9,
        "{found} N mm for {expected} N mm"
    );
}

/// Deflection of a plate of 95 × 20 mm beyond its clamp, pushed at its end: `F L³/3 D b`, by two theorems of
/// minimum energy. The plate yields at least as a cylinder would, which bends only at the edges across. It
/// yields at most 5/4 of that, as separate rows of squares, whose diagonals then have half of the moment² at
/// twice the stiffness.
#[test]
fn a_cantilever_bends_as_a_plate_strip_does_or_up_to_a_quarter_more() {
    const N_CELLS: usize = 20;
    let (force_n, length_mm, width_mm) = (1.0, 95.0_f64, 20.0);
    let params = SurfaceParams::default();
    let strip = two_plates(N_CELLS, ROWS, 5.0);
    let n = (N_CELLS + 1) * (ROWS + 1);
    let is_held = |v: usize| strip.points[v].x < -0.5 * 100.0 + 5.1;
    let mut stiffness = DMatrix::zeros(3 * n, 3 * n);
    for term in patch_terms(&params, &strip, &strip.points)
        .iter()
        .filter(|t| (t.corners[0].0 as usize) < n)
    {
        let mut gradient = DVector::zeros(3 * n);
        for &(v, g) in term.corners.iter().filter(|c| !is_held(c.0 as usize)) {
            (0..3).for_each(|x| gradient[3 * v as usize + x] += g[x]);
        }
        stiffness.ger(term.stiffness, &gradient, &gradient, 1.0);
    }
    (0..3 * n)
        .filter(|row| is_held(row / 3))
        .for_each(|row| stiffness[(row, row)] = 1.0);
    let end: Vec<usize> = (0..n).filter(|v| strip.points[*v].x > 49.9).collect();
    // The ends of the outer rows carry half of the load.
    let mut force = DVector::zeros(3 * n);
    for &v in &end {
        let share = if [0.0, width_mm].contains(&strip.points[v].y.abs()) {
            0.5
        } else {
            1.0
        };
        force[3 * v + 2] = force_n * share / ROWS as f64;
    }
    let deflection_mm = stiffness.cholesky().unwrap().solve(&force).dot(&force) / force_n;
    // Σ M² over hinges at the near ends of the cells, for the integral.
    let n = (N_CELLS - 1) as f64;
    let of_hinges = (n + 1.0) * (2.0 * n + 1.0) / (2.0 * n * n);
    let cylinder_mm = of_hinges * force_n * length_mm.powi(3) / (3.0 * plate_stiffness(&params) * width_mm);
    let ratio = deflection_mm / cylinder_mm;
    assert!((1.0..1.25).contains(&ratio), "{ratio} of {cylinder_mm} mm");
}

/// Pins are pulled straight out: a wall across their way is the only obstacle, and only if it is on that
/// side.
#[test]
fn a_wall_bears_what_presses_on_it_and_does_not_stick() {
    let model = plates(&SurfaceParams::default());
    let opened = |wall: Vec3| {
        let plan: Vec<Meeting> = joints(Vec3::Z, Vec3::Z)
            .into_iter()
            .map(|m| Meeting { wall, ..m })
            .collect();
        opening(&pull_apart(&model, &plan))
    };
    let (open, blocked) = (opened(-Vec3::Z), opened(Vec3::Z));
    assert!(open > 1e-3 && blocked < 0.1 * open, "{blocked} mm of {open} mm");
    // A wall without pressure carries nothing: as if it stood across another way.
    assert!(
        (opened(Vec3::Y) / open - 1.0).abs() < 1e-2,
        "{} mm, {open} mm",
        opened(Vec3::Y)
    );
}

/// Without friction a pin may leave and slide; with friction, as on the key, it does neither, and resists
/// both ways alike.
#[test]
fn friction_holds_a_pin_out_of_its_channel_and_along_it() {
    let model = plates(&SurfaceParams::default());
    let opened = |pull: Vec3, is_fast: bool| {
        let mut plan = joints(Vec3::Z, pull);
        plan.iter_mut()
            .filter_map(|m| m.joint.as_mut())
            .for_each(|joint| joint.is_fast = is_fast);
        opening(&pull_apart(&model, &plan))
    };
    for along in [Vec3::Z, Vec3::X] {
        let [free, held] = [false, true].map(|is_fast| opened(along, is_fast));
        assert!(held < 0.2 * free, "{held} mm of {free} mm along {along}");
        assert!(
            (opened(-along, true) / held - 1.0).abs() < 0.01,
            "{} {held}",
            opened(-along, true)
        );
    }
    assert!(opened(Vec3::Z, false) > 5.0 * opened(-Vec3::Z, false));
}

#[test]
fn openings_grow_with_the_force_and_fall_with_the_modulus() {
    let params = SurfaceParams::default();
    let one = opening(&pull_apart(
        &plates(&params),
        &joints(Vec3::Z, Vec3::new(0.0, 0.6, 0.8)),
    ));
    let mut stiff = params;
    stiff.material.youngs_modulus_mpa *= 2.0;
    stiff.force_n_per_mm *= 3.0;
    let other = opening(&pull_apart(
        &plates(&stiff),
        &joints(Vec3::Z, Vec3::new(0.0, 0.6, 0.8)),
    ));
    assert!((other / one - 1.5).abs() < 1e-6, "{one} {other}");
}

#[test]
fn forces_are_in_balance_and_a_finer_tolerance_changes_nothing() {
    let plan = joints(Vec3::new(0.0, -0.6, 0.8), Vec3::new(0.3, 0.5, 0.8));
    let coarse = pull_apart(
        &plates(&SurfaceParams {
            tolerance: 1e-3,
            ..SurfaceParams::default()
        }),
        &plan,
    );
    let fine = pull_apart(
        &plates(&SurfaceParams {
            tolerance: 5e-4,
            ..SurfaceParams::default()
        }),
        &plan,
    );
    assert!(coarse.error <= 1e-3 && fine.error <= 5e-4);
    assert!((opening(&coarse) / opening(&fine) - 1.0).abs() < 1e-3);
}

/// Stiffness of all parts together against motions of side a relative to side b, station by station.
fn stiffness(model: &SurfaceModel) -> DMatrix<f64> {
    let n_stations = model.assembly.stations.len();
    let columns: Vec<DVector<f64>> = (0..N_MOTIONS * n_stations)
        .map(|j| {
            let mut unit = vec![[0.0; N_MOTIONS]; n_stations];
            unit[j / N_MOTIONS][j % N_MOTIONS] = 1.0;
            DVector::from_vec(solve::answer(model, &[], &unit).concat())
        })
        .collect();
    DMatrix::from_columns(&columns).cholesky().unwrap().inverse()
}

/// Energy of the stations' motions, N mm.
fn energy(model: &SurfaceModel, plan: &[Meeting], stiffness: &DMatrix<f64>, motions: &[Motions]) -> f64 {
    let [all, force] =
        [motions, &forces(model, plan, &model.pulls(plan))].map(|m| DVector::from_vec(m.concat()));
    let of_contact = |c: &ContactSpring| {
        let gap = c
            .gradient
            .iter()
            .zip(motions[c.station])
            .map(|(g, r)| g * r)
            .sum();
        0.5 * c.active_gap(gap).powi(2)
    };
    let contacts = (0..plan.len()).flat_map(|i| contacts_at(model, i, &plan[i]));
    let contacts: Vec<ContactSpring> = contacts.collect();
    0.5 * all.dot(&(stiffness * &all)) - all.dot(&force) + contacts.iter().map(of_contact).sum::<f64>()
}

#[test]
fn no_motion_of_a_single_station_lowers_the_energy() {
    let model = plates(&SurfaceParams::default());
    let plan = joints(Vec3::new(0.0, -0.6, 0.8), Vec3::new(0.3, 0.5, 0.8));
    let load = solve::Load::of_pulls(&model, &plan, &model.pulls(&plan));
    let jointed = solve::Jointed::new(&model, &model.free, &plan).unwrap();
    let moved = jointed.balance(&load, None).unwrap().motions;
    let stiffness = stiffness(&model);
    let least = energy(&model, &plan, &stiffness, &moved);
    assert!(least < 0.0);
    for i in 0..N_MOTIONS * moved.len() {
        for by in [1e-4, -1e-4, 1e-6, -1e-6] {
            let mut other = moved.clone();
            other[i / N_MOTIONS][i % N_MOTIONS] += by;
            assert!(energy(&model, &plan, &stiffness, &other) >= least - 1e-12 * least.abs());
        }
    }
}

#[test]
fn a_part_that_is_free_alone_opens_its_own_seams_alone() {
    let ball = ball(40.0, 4);
    let model = SurfaceModel::new(&SurfaceParams::default(), &ball).unwrap();
    let plan: Vec<Meeting> = (ball.stations.iter())
        .map(|s| {
            let leaves = (s.normal - s.across * 0.5).normalize();
            let joint = Joint {
                male: Side::A,
                leaves,
                is_fast: true,
                pull_on_a: leaves,
                weight: 1.0,
                size_mm: 2.5,
            };
            Meeting {
                wall: s.across,
                joint: Some(joint),
            }
        })
        .collect();
    let solution = model.resist_alone(&plan, 3).unwrap();
    assert!(solution.error <= 1e-6);
    let Resistance::Holds(opening) = &solution.resistance else {
        panic!("{solution:?}")
    };
    let is_own = |s: &Station| s.points.iter().any(|p| ball.part_of_point[*p as usize] == 3);
    let (own, others): (Vec<_>, Vec<_>) = ball
        .stations
        .iter()
        .zip(&opening.opening_mm)
        .partition(|(s, _)| is_own(s));
    let [own, others] = [own, others].map(|all| all.iter().map(|(_, d)| **d).fold(0.0, f64::max));
    assert!(others > 0.0 && others < 1e-2 * own, "{others} {own}");
}

#[test]
fn plans_have_the_same_bits_on_any_number_of_threads() {
    let model = plates(&SurfaceParams::default());
    let plans: Vec<_> = (0..40)
        .map(|i| joints(Vec3::Z, Vec3::new(0.1, (i as f64).sin(), (i as f64).cos())))
        .collect();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| model.resist_all(&plans, 1)).unwrap()
    };
    assert_eq!(on(1), on(2));
}

#[test]
fn a_plate_that_nothing_holds_back_comes_apart() {
    // Side b floats and is pulled out of its channel.
    let model = SurfaceModel::new(&SurfaceParams::default(), &two_plates(N, ROWS, 5.0)).unwrap();
    let solution = model.resist(&joints(Vec3::Z, Vec3::Z), 0).unwrap();
    assert_eq!(solution.resistance, Resistance::Separable(vec![1]));
}

/// Forces that press plate a down in its middle and lift plate b.
fn twist(model: &SurfaceModel) -> Vec<Vec3> {
    let push = |(p, part): (&Vec3, &u32)| {
        if *part == 0 {
            Vec3::new(0.2, 0.0, -p.x.abs())
        } else {
            Vec3::new(0.0, 0.1 * p.x, 0.5)
        }
    };
    let assembly = &model.assembly;
    assembly
        .points
        .iter()
        .zip(&assembly.part_of_point)
        .map(push)
        .collect()
}

/// Motions of the stations, computed from the displacements of the points.
fn moved_at_stations(model: &SurfaceModel, moved_mm: &[Vec3]) -> Vec<Motions> {
    let points = parts::mid_wall(&model.params, &model.assembly);
    let triangles_at = |point: u32| {
        let of_point = move |t: &[u32; 3]| t.contains(&point);
        let triangles: Vec<[u32; 3]> = model
            .assembly
            .triangles
            .iter()
            .copied()
            .filter(of_point)
            .collect();
        triangles.into_iter()
    };
    let seen = |gradient: Vec<(u32, Vec3)>| {
        let at = |&(v, g): &(u32, Vec3)| g.dot(moved_mm[v as usize]);
        gradient.iter().map(at).sum::<f64>()
    };
    let motions = |station: &Station| {
        let side = |point: u32| {
            let root = Root::new(&points, point, triangles_at(point));
            let [t, n, across] =
                [station.tangent, station.normal, station.across].map(|g| seen(root.shift(g)));
            [t, n, across, seen(root.turn(station.tangent))]
        };
        let [a, b] = station.points.map(side);
        std::array::from_fn(|i| a[i] - b[i])
    };
    model.assembly.stations.iter().map(motions).collect()
}

/// Deviations are due to the compliance that parts have besides the mesh's, a thousandth of a contact's.
#[test]
fn points_move_as_the_stations_that_the_balance_is_of() {
    let params = SurfaceParams::default();
    let held =
        SurfaceModel::with_held_points(&params, &two_plates(N, ROWS, 5.0), &outer_ring(N, ROWS)).unwrap();
    let free = SurfaceModel::new(&params, &two_plates(N, ROWS, 5.0)).unwrap();
    let mut plan = joints(Vec3::Z, Vec3::Z);
    // A plan that holds both plates, so that neither drifts.
    plan.iter_mut()
        .filter_map(|m| m.joint.as_mut())
        .for_each(|joint| joint.is_fast = true);
    for model in [held, free] {
        let forces_n = twist(&model);
        let joined = model.join(&plan).unwrap();
        let jointed = solve::Jointed::new(&model, &model.free, &plan).unwrap();
        let balance = jointed.balance(&model.drift(&forces_n).0, None).unwrap();
        let found = moved_at_stations(&model, &joined.moved_mm(&forces_n, None).unwrap());
        let largest = balance
            .motions
            .concat()
            .iter()
            .fold(0.0, |l: f64, m| l.max(m.abs()));
        let least = parts::least_compliance(&model.params);
        for ((found, expected), sent) in found.iter().zip(&balance.motions).zip(&balance.sent) {
            for i in 0..N_MOTIONS {
                // Both sides have that compliance.
                let difference = found[i] + 2.0 * least * sent[i] - expected[i];
                assert!(difference.abs() < 1e-8 * largest, "{found:?} {expected:?}");
            }
        }
    }
}

#[test]
fn forces_that_move_the_whole_as_a_rigid_body_bend_nothing() {
    let model = SurfaceModel::new(&SurfaceParams::default(), &two_plates(N, ROWS, 5.0)).unwrap();
    let plan = joints(Vec3::Z, Vec3::Z);
    let points = parts::mid_wall(&model.params, &model.assembly);
    let areas_mm2 = model.assembly.point_areas_mm2();
    let rigid = |p: &Vec3| Vec3::new(0.3, -0.1, 0.2) + Vec3::new(0.01, 0.02, -0.03).cross(*p);
    let forces_n: Vec<Vec3> = points
        .iter()
        .zip(&areas_mm2)
        .map(|(p, a)| *a * rigid(p))
        .collect();
    let joined = model.join(&plan).unwrap();
    let largest = |motions: Vec<Vec3>| motions.iter().map(|m| m.length()).fold(0.0, f64::max);
    let bent = largest(joined.moved_mm(&twist(&model), None).unwrap());
    let moved = largest(joined.moved_mm(&forces_n, None).unwrap());
    assert!(
        moved < 1e-6 * bent,
        "{moved} mm, {bent} mm under forces that bend"
    );
}

#[test]
fn how_the_whole_moves_is_left_out_and_twice_the_load_moves_points_twice_as_far() {
    let model = SurfaceModel::new(&SurfaceParams::default(), &two_plates(N, ROWS, 5.0)).unwrap();
    let mut plan = joints(Vec3::Z, Vec3::Z);
    plan.iter_mut()
        .filter_map(|m| m.joint.as_mut())
        .for_each(|joint| joint.is_fast = true);
    let joined = model.join(&plan).unwrap();
    let forces_n = twist(&model);
    let twice: Vec<Vec3> = forces_n.iter().map(|f| 2.0 * *f).collect();
    let [once, twice] = [forces_n, twice].map(|f| joined.moved_mm(&f, None).unwrap());
    let areas_mm2 = model.assembly.point_areas_mm2();
    let points = parts::mid_wall(&model.params, &model.assembly);
    let largest = once.iter().map(|m| m.length()).fold(0.0, f64::max);
    let area_mm2: f64 = areas_mm2.iter().sum();
    let weighted = || once.iter().zip(&areas_mm2).map(|(m, a)| *m * (*a / area_mm2));
    let center = points
        .iter()
        .zip(&areas_mm2)
        .map(|(p, a)| *p * (*a / area_mm2))
        .sum::<Vec3>();
    let shift = weighted().sum::<Vec3>();
    let turn = weighted()
        .zip(&points)
        .map(|(m, p)| (*p - center).cross(m))
        .sum::<Vec3>();
    assert!(
        shift.length() < 1e-9 * largest && turn.length() < 1e-9 * 20.0 * largest,
        "{shift} {turn}"
    );
    for (one, two) in once.iter().zip(&twice) {
        assert!((2.0 * *one - *two).length() < 1e-6 * largest, "{one} {two}");
    }
}
