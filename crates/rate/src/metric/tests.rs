use shellock_assembly::LatticeDirection;
use shellock_geom::Vec3;
use shellock_mechanics::{Material, Resistance, Side};
use shellock_plan::sizes::ConnectorSizes;
use shellock_plan::{
    FoundPlan, LatticePlan, LatticeStep, PlanConstraints, PlanOutcome, PlanParams, search, survey,
};
use shellock_report::{Ctx, PatchId, Warning};
use shellock_surface::SegmentedSurface;
use shellock_test_surfaces::{label, seams, sphere, voronoi};

use super::*;
use crate::handling::Handling;

fn octants() -> PlanModel {
    let octant = |p: Vec3| u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0) + 4 * u32::from(p.z > 0.0);
    let surface = label(sphere(5, Vec3::splat(40.0)), 8, octant);
    PlanModel::new(&MetricParams::default(), &surface, &ConnectorSizes::default())
}

fn plan(directions: impl Fn(u32) -> Vec3) -> LatticePlan {
    let step = |i: u32| LatticeStep {
        piece: PatchId(i),
        separation: LatticeDirection::nearest(directions(i)),
    };
    LatticePlan {
        steps: (0..8).map(step).collect(),
    }
}

fn outwards(i: u32) -> Vec3 {
    Vec3::from_array([i & 1, i >> 1 & 1, i >> 2].map(|bit| 2.0 * f64::from(bit) - 1.0))
}

#[test]
fn every_parameter_out_of_its_range_is_named_and_the_defaults_are_within() {
    let right = MetricParams::default();
    assert_eq!(right.problems(), []);
    let edges = |edge_share| MetricParams { edge_share, ..right };
    let wrong = [f64::NAN, f64::INFINITY, 0.0, -1.0, 0.19, 5.1].map(edges);
    assert!(
        wrong
            .iter()
            .all(|w| w.problems().iter().map(|p| p.name).eq(["edge share"]))
    );
    let mut all = MetricParams {
        wall_mm: 0.0,
        connector_mm: 0.9,
        beta: -0.1,
        ..edges(0.0)
    };
    (all.material.youngs_modulus_mpa, all.material.poissons_ratio) = (f64::NAN, 0.5);
    assert_eq!(all.problems().len(), 6);
}

#[test]
fn stations_lie_on_both_pieces_in_right_handed_frames() {
    let model = octants();
    assert!(model.assembly.stations.len() > 50);
    for (i, s) in model.assembly.stations.iter().enumerate() {
        let [a, b] = s.points.map(|p| p as usize);
        assert_eq!(model.assembly.points[a], model.assembly.points[b]);
        assert_eq!(
            [a, b].map(|p| PatchId(model.assembly.part_of_point[p])),
            model.pieces_at(i)
        );
        assert!((s.tangent.cross(s.normal) - s.across).length() < 1e-9);
        // `across` leads from a to b: towards the middle of b's octant.
        let toward_b = outwards(model.pieces_at(i)[1].0) - outwards(model.pieces_at(i)[0].0);
        assert!(s.across.dot(toward_b) > 0.5);
    }
}

#[test]
fn the_male_is_the_piece_that_moves_outwards_and_both_are_pulled_apart() {
    let model = octants();
    let joints: Vec<_> = model
        .meetings(&plan(outwards))
        .into_iter()
        .map(|m| m.joint)
        .collect();
    assert!(joints.iter().flatten().count() > 40);
    for (i, joint) in joints
        .iter()
        .enumerate()
        .filter_map(|(i, j)| Some((i, j.as_ref()?)))
    {
        // Here the later piece has the higher id: side b, and it leaves outwards.
        assert_eq!(joint.male, Side::B);
        assert!(joint.leaves.dot(model.assembly.stations[i].tangent).abs() < 1e-9);
        assert!(joint.leaves.dot(joint.pull_on_a) < 0.0);
    }
    let inwards = model.meetings(&plan(|i| -outwards(i)));
    assert!(inwards.iter().filter_map(|m| m.joint).all(|j| j.male == Side::A));
}

#[test]
fn a_ball_whose_octants_all_leave_outwards_holds_and_one_whose_pieces_slide_off_together_does_not() {
    let model = octants();
    let solver = model.surface_model().unwrap();
    let held = solver.resist(&model.meetings(&plan(outwards)), 7).unwrap();
    let Resistance::Holds(opening) = &held.resistance else {
        panic!("{held:?}")
    };
    assert!(
        opening.quality_mm < 0.0 && opening.quality_mm > -1.0,
        "{}",
        opening.quality_mm
    );
    let up = solver.resist(&model.meetings(&plan(|_| Vec3::Z)), 7).unwrap();
    assert!(
        matches!(up.resistance, Resistance::Separable(_)),
        "all along one direction: {up:?}"
    );
}

#[test]
fn with_no_part_held_the_pull_opens_seams_no_less_than_with_one_that_is_held_and_so_rigid() {
    let model = octants();
    let solver = model.surface_model().unwrap();
    let meetings = model.meetings(&plan(outwards));
    let Resistance::Holds(held) = solver.resist(&meetings, 7).unwrap().resistance else {
        panic!("it holds")
    };
    let free = solver.join(&meetings).unwrap().pull(&meetings, None).unwrap().0;
    let ratio = free.quality_mm / held.quality_mm;
    assert!((0.999..2.0).contains(&ratio), "{ratio}");
}

#[test]
fn a_piece_opens_no_farther_with_its_neighbours_held_than_free() {
    let model = octants();
    let solver = model.surface_model().unwrap();
    let meetings = model.meetings(&plan(outwards));
    let Resistance::Holds(all) = solver.resist(&meetings, 7).unwrap().resistance else {
        panic!("it holds")
    };
    let alone = pieces_alone(&model, &solver, &meetings, PatchId(7))
        .unwrap()
        .unwrap();
    assert!(
        alone < 0.0 && alone >= all.quality_mm,
        "{alone} {}",
        all.quality_mm
    );
}

#[test]
fn the_published_metric_is_at_least_what_each_seam_opens_along_its_own_direction() {
    // The openings do not depend on how a piece is held elsewhere: this is what the maximum of Eq. 6 hides.
    let model = octants();
    let tests = shellock_plan::local_tests::LocalTests::simulate(&model.params.surface()).unwrap();
    let meetings = model.meetings(&plan(outwards));
    let quality = data_driven(&model, &tests, &meetings);
    for (station, meeting) in model.assembly.stations.iter().zip(&meetings) {
        let Some(joint) = meeting.joint else { continue };
        let (tangent, normal, across) = (station.tangent, station.normal, station.across);
        let frame = shellock_plan::interface::SeamFrame {
            tangent,
            normal,
            across,
        };
        let own = tests.opening_mm(&frame, joint.pull_on_a, joint.pull_on_a);
        assert!(-quality >= joint.weight * own - 1e-12 && own > 0.0);
    }
}

/// The plan that is chosen for `surface`, its resistance, and the warnings on the way.
fn choose_for(surface: &SegmentedSurface) -> (FoundPlan, Holding, Vec<Warning>) {
    let ctx = Ctx::quiet();
    let (params, sizes) = (
        PlanParams {
            n_plans: 40,
            ..PlanParams::default()
        },
        ConnectorSizes::default(),
    );
    let survey = survey(&ctx, &params, surface, &seams(surface), &sizes).unwrap();
    let outcome = search(&ctx, &params, &survey, &PlanConstraints::default()).unwrap();
    let PlanOutcome::Found(found) = outcome else {
        panic!("{outcome:?}")
    };
    let ctx = ctx.fork();
    let (handling, climb) = (
        Handling::new(params.up, 2.0, Material::default()),
        ClimbParams::default(),
    );
    let (survey, constraints) = (&survey, &PlanConstraints::default());
    let (params, sizes, handling) = (&params, &sizes, &handling);
    let choice = Choice {
        params,
        surface,
        even: &EvenSurface::new(surface, 1.0),
        former: None,
        sizes,
        survey,
        constraints,
        handling,
        climb,
    };
    let Chosen {
        search_result: found,
        holding,
        deformation,
        is_cut_short,
    } = choose(&ctx, &choice, &Foresight::of(&choice, &found), *found).unwrap();
    assert!(!is_cut_short, "without a clock nothing ends early");
    check_deformation(&holding, &deformation);
    (found, holding, ctx.into_warnings())
}

/// Asserts that pictures show reported loads, that all pieces move, and that no point goes far where nothing
/// fails.
fn check_deformation(holding: &Holding, deformed: &Deformed) {
    assert!(deformed.loads.iter().any(|l| l.kind == Told::Feet));
    let n_points = deformed.surface.points.len();
    assert_eq!(deformed.piece_of_point.len(), n_points);
    for load in &deformed.loads {
        assert!(holding.bears.contains(&load.capacity), "{load:?}");
        assert_eq!(load.moved_mm.len(), n_points);
        assert!(load.moved_mm.iter().any(|m| m.length() > 1e-6));
        let (first, second) = (load.touches[0].force_n, load.touches.get(1));
        assert!(
            second.is_none_or(|t| t.force_n.dot(first) < 0.0),
            "{:?}",
            load.touches
        );
    }
}

#[test]
fn pieces_move_by_the_same_bits_on_any_number_of_threads() {
    let surface = voronoi(sphere(4, Vec3::new(50.0, 55.0, 70.0)), 8, 1);
    let sizes = ConnectorSizes::default();
    let model = PlanModel::new(&MetricParams::default(), &surface, &sizes);
    let params = PlanParams::default();
    let ctx = Ctx::quiet();
    let survey = survey(&ctx, &params, &surface, &seams(&surface), &sizes).unwrap();
    let PlanOutcome::Found(found) = search(&ctx, &params, &survey, &PlanConstraints::default()).unwrap()
    else {
        panic!("a sphere has a plan")
    };
    let handling = Handling::new(params.up, 2.0, Material::default());
    let on = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .unwrap();
        pool.install(|| {
            let bench = Bench::new(&handling, &model).unwrap();
            let rated = bench.rate(found.pool[0].clone()).unwrap();
            (0..bench.cases.len())
                .map(|i| rated.moved_mm(i).unwrap())
                .collect::<Vec<_>>()
        })
    };
    assert!(on(1) == on(2));
}

#[test]
fn the_chosen_plan_leads_the_pool_and_the_others_follow_by_cost() {
    let (found, holding, _) = choose_for(&voronoi(sphere(4, Vec3::new(50.0, 55.0, 70.0)), 8, 1));
    assert!(holding.n_compared > 1, "{holding:?}");
    let (first, others) = found.pool.split_first().unwrap();
    assert!(first.plan == found.plan && first.score == found.score);
    assert!(others.is_sorted_by(|x, y| x.score.worst <= y.score.worst * (1.0 + 1e-8)));
    assert!(found.pool.iter().all(|p| p.plan.key() == found.plan.key()));
    let least = found
        .pool
        .iter()
        .map(|p| p.score.worst)
        .fold(f64::INFINITY, f64::min);
    assert!(found.lower_bound <= least && found.score.worst <= 1.26 * least);
}

#[test]
fn a_half_that_nothing_holds_is_told_with_its_place() {
    let (found, _, warnings) = choose_for(&label(sphere(5, Vec3::splat(40.0)), 2, |p| u32::from(p.z > 0.0)));
    let loose = warnings
        .iter()
        .find(|w| w.code() == "piece-loose")
        .unwrap_or_else(|| panic!("{warnings:?}"));
    let first = found.plan.steps[0].piece;
    assert_eq!(loose.pieces, [first]);
    assert_eq!(loose.at.unwrap()[2] > 0.0, first == PatchId(1));
}
