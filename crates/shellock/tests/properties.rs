//! Results that must not depend on the pose of a model or the numbers of its pieces: its division, and the
//! measurements and costs of planning. Also tests turns of the model.

use std::sync::LazyLock;

use proptest::prelude::*;
use shellock::key::Turn;
use shellock::plan::{LatticePlan, PlanConstraints, PlanParams, PlanSurvey, random_plans, score, survey};
use shellock::segmentation::{SegmentationParams, segment};
use shellock::{ConnectorSizes, Ctx, LatticeDirection, PatchId, SegmentedSurface};
use shellock_geom::topology::components;
use shellock_geom::{Solid, Topology, Vec3};
use shellock_testkit::property::{LatticeTurn, cases, orders, turns, vectors};
use shellock_testkit::shapes::sphere;

/// Number of labels of the pebble.
const N: usize = 7;

/// An egg with three different axes, so that no tie decides anything.
fn pebble() -> Solid {
    Solid::new(sphere(4, Vec3::new(41.0, 34.0, 29.0))).unwrap()
}

/// For each triangle, the nearest of [`N`] unevenly spread directions.
fn labels() -> Vec<usize> {
    let solid = pebble();
    let site = |i: usize| {
        let (t, z) = (2.4 * i as f64, 1.0 - 2.0 * (i as f64 + 0.5) / N as f64);
        Vec3::new((1.0 - z * z).sqrt() * t.cos(), (1.0 - z * z).sqrt() * t.sin(), z)
    };
    let nearest = |f: usize| {
        let p = solid.mesh().face_center(f);
        (0..N).max_by(|&i, &j| site(i).dot(p).total_cmp(&site(j).dot(p)))
    };
    (0..solid.mesh().triangles.len()).filter_map(nearest).collect()
}

/// Turns and shifts the pebble, and divides it along its labels, renamed to `names`.
fn divide(turn: &LatticeTurn, shift: Vec3, names: &[usize]) -> SegmentedSurface {
    let solid = Solid::new(turn.mesh(pebble().mesh(), shift)).unwrap();
    let named: Vec<i64> = labels().iter().map(|&l| names[l] as i64).collect();
    segment(
        &Ctx::quiet(),
        &SegmentationParams::default(),
        &solid,
        Some(&named),
    )
    .unwrap()
}

fn original() -> &'static SegmentedSurface {
    static GIVEN: LazyLock<SegmentedSurface> =
        LazyLock::new(|| divide(&LatticeTurn::all()[0], Vec3::ZERO, &Vec::from_iter(0..N)));
    &GIVEN
}

fn survey_of(surface: &SegmentedSurface) -> PlanSurvey {
    let params = PlanParams::default();
    survey(
        &Ctx::quiet(),
        &params,
        surface,
        &surface.seams(),
        &ConnectorSizes::default(),
    )
    .unwrap()
}

fn survey_of_original() -> &'static PlanSurvey {
    static GIVEN: LazyLock<PlanSurvey> = LazyLock::new(|| survey_of(original()));
    &GIVEN
}

/// Renames the `i`-th piece of the surface to `number[i]`.
fn renumber(surface: &SegmentedSurface, number: &[usize]) -> SegmentedSurface {
    let new = |&p: &PatchId| PatchId::from(number[usize::from(p)]);
    SegmentedSurface {
        patch_of_face: surface.patch_of_face.iter().map(new).collect(),
        ..surface.clone()
    }
}

/// Asserts that `other` has the contacts, areas and mean normals of the original pebble, with piece `i`
/// renamed to `number[i]` and all directions turned.
fn assert_same_contacts(other: &PlanSurvey, turn: &LatticeTurn, number: &[usize], tolerance: f64) {
    let given = survey_of_original();
    assert_eq!(other.contacts.len(), given.contacts.len());
    let new = |p: PatchId| PatchId::from(number[usize::from(p)]);
    let is_near = |a: f64, b: f64| (a - b).abs() <= tolerance * a.abs().max(1.0);
    for contact in &given.contacts {
        let pair = [new(contact.a), new(contact.b)];
        let same = other
            .contacts
            .iter()
            .find(|c| pair.contains(&c.a) && pair.contains(&c.b))
            .unwrap();
        assert!(is_near(same.length_mm, contact.length_mm));
        for (later, s) in [contact.a, contact.b]
            .into_iter()
            .flat_map(|p| LatticeDirection::all().map(move |s| (p, s)))
        {
            let turned = LatticeDirection::nearest(turn.apply(s.unit()));
            let (one, two) = (contact.joint(later, s), same.joint(new(later), turned));
            assert!(is_near(one.weight, two.weight), "{one:?} {two:?}");
            assert!(is_near(one.usable, two.usable), "{one:?} {two:?}");
            assert!(is_near(one.run_mm, two.run_mm), "{one:?} {two:?}");
        }
    }
    for p in (0..N).map(PatchId::from) {
        assert!(is_near(other.area_mm2[new(p)], given.area_mm2[p]));
        let turned = turn.apply(given.mean_normal[p]);
        assert!(other.mean_normal[new(p)].distance(turned) < tolerance);
    }
}

/// Greatest difference between the occlusion shares of the original and the turned pebble.
fn farthest_share(other: &PlanSurvey, turn: &LatticeTurn, number: &[usize]) -> f64 {
    let given = survey_of_original();
    let new = |p: usize| PatchId::from(number[p]);
    let mut farthest = 0.0f64;
    for (p, q) in (0..N)
        .flat_map(|p| (0..N).map(move |q| (p, q)))
        .filter(|(p, q)| p != q)
    {
        for s in LatticeDirection::all() {
            let turned = LatticeDirection::nearest(turn.apply(s.unit()));
            let one = given.occlusion.share(p.into(), q.into(), s);
            farthest = farthest.max((one - other.occlusion.share(new(p), new(q), turned)).abs());
        }
    }
    farthest
}

/// Asserts that patches are connected, divide a closed surface and have a 2-connected contact graph.
fn assert_valid(surface: &SegmentedSurface, volume_mm3: f64) {
    let cut = Solid::new(surface.mesh.clone()).unwrap();
    assert!((cut.volume() / volume_mm3 - 1.0).abs() < 1e-9);
    let patch = &surface.patch_of_face;
    let (_, n) = components(&Topology::new(&cut), |f, g| {
        patch[f as usize] == patch[g as usize]
    });
    assert_eq!(n, surface.n_patches);
    let least_mm = SegmentationParams::default().min_contact_mm;
    assert!(surface.contact_graph(least_mm).is_two_connected());
}

proptest! {
    #![proptest_config(cases(6))]

    #[test]
    fn a_division_along_labels_is_the_same_however_the_model_lies_and_its_labels_are_named(
        turn in turns(), shift in vectors(80.0), names in orders(N),
    ) {
        let surface = divide(&turn, shift, &names);
        prop_assert_eq!(surface.n_patches, original().n_patches);
        assert_valid(&surface, pebble().volume());
        let (areas, given) = (surface.areas(), original().areas());
        for (label, &name) in names.iter().enumerate() {
            let (a, b) = (areas[PatchId::from(name)], given[PatchId::from(label)]);
            prop_assert!((a / b - 1.0).abs() < 1e-6, "label {}: {} mm² and {} mm²", label, a, b);
        }
    }

    #[test]
    fn an_automatic_division_is_valid_and_has_as_many_pieces_however_the_model_lies(
        turn in turns(), shift in vectors(80.0),
    ) {
        let params = SegmentationParams { n_pieces: Some(6), ..SegmentationParams::default() };
        let of = |solid: &Solid| segment(&Ctx::quiet(), &params, solid, None).unwrap();
        let surface = of(&Solid::new(turn.mesh(pebble().mesh(), shift)).unwrap());
        assert_valid(&surface, pebble().volume());
        prop_assert_eq!(surface.n_patches, of(&pebble()).n_patches);
    }

    #[test]
    fn what_seams_offer_and_what_is_in_the_way_turn_with_the_model(turn in turns()) {
        let mut turned = original().clone();
        turned.mesh = turn.mesh(&turned.mesh, Vec3::ZERO);
        let survey = survey_of(&turned);
        let same = Vec::from_iter(0..N);
        assert_same_contacts(&survey, &turn, &same, 1e-6);
        // Pictures have pixels, so they turn only approximately with the model.
        let farthest = farthest_share(&survey, &turn, &same);
        prop_assert!(farthest < 0.01, "{}", farthest);
    }

    #[test]
    fn a_plan_costs_the_same_however_its_pieces_are_numbered(number in orders(N), seed in 0..1000u64) {
        let survey = survey_of(&renumber(original(), &number));
        let none = LatticeTurn::all()[0];
        assert_same_contacts(&survey, &none, &number, 1e-9);
        prop_assert!(farthest_share(&survey, &none, &number) < 1e-9);
        let params = PlanParams { seed, ..PlanParams::default() };
        for plan in random_plans(&params, survey_of_original(), 20) {
            let new = |p: PatchId| PatchId::from(number[usize::from(p)]);
            let other = LatticePlan::new(plan.steps.iter().map(|s| (new(s.piece), s.separation)));
            let one = score(survey_of_original(), &PlanConstraints::default(), &plan);
            let two = score(&survey, &PlanConstraints::default(), &other);
            prop_assert!((one.worst - two.worst).abs() < 1e-9, "{:?} {:?}", one, two);
            for (p, cost) in one.pieces.iter() {
                prop_assert!((cost - two.pieces[new(p)]).abs() < 1e-9, "{:?} {:?}", one, two);
            }
        }
    }
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn a_turn_keeps_lengths_and_hands_and_its_inverse_undoes_it(
        normal in vectors(1.0), slide in vectors(1.0), a in vectors(50.0), b in vectors(50.0),
    ) {
        prop_assume!(normal.length() > 0.1 && slide.cross(normal).length() > 0.01);
        let normal = normal.normalize();
        let slide = slide.reject_from_normalized(normal).normalize();
        let (turn, along) = Turn::align(normal, slide);
        prop_assert!(turn.apply(slide).distance(along.unit()) < 1e-9);
        prop_assert!((turn.apply(normal).abs().max_element() - 1.0).abs() < 1e-9);
        prop_assert!(turn.inverse().apply(turn.apply(a)).distance(a) < 1e-9);
        prop_assert!(turn.inverse().inverse() == turn);
        prop_assert!((turn.apply(a).dot(turn.apply(b)) - a.dot(b)).abs() < 1e-9);
        prop_assert!(turn.apply(a).cross(turn.apply(b)).distance(turn.apply(a.cross(b))) < 1e-9);
        prop_assert!((turn.angle() - turn.inverse().angle()).abs() < 1e-6);
    }
}
