//! Tests on small assemblies of boxes whose verdict can be derived by thought.

use shellock_geom::{TriMesh, Vec3, Volume};

use super::kits::{ALL, Kit, PIN, brick, grown, pinned_kit, pinned_lid};
use super::*;
use crate::{LatticeDirection, PatchId};

#[test]
fn of_a_pinned_lid_nothing_but_the_key_moves() {
    let verdict = pinned_kit(|_| {}).verdict();
    let failed: Vec<&str> = verdict
        .checks
        .iter()
        .filter(|c| !c.ok)
        .map(|c| c.name.as_str())
        .collect();
    assert_eq!(failed, [""; 0], "{verdict:#?}");
    assert_eq!(verdict.findings, []);
}

#[test]
fn a_lock_without_a_proof_does_not_pass() {
    let kit = pinned_kit(|_| {});
    let (_, contacts) = kit.examine();
    let assembly = Assembly {
        model: None,
        pieces: &kit.pieces,
        plan: &kit.plan,
        press_fits: &[],
    };
    let with = |ok: bool, contacts: &[Contact]| {
        let check = Check::new("nothing but the key moves", ok, "as said".to_owned());
        let check = with_proof(check, &assembly, contacts);
        (check.ok, check.figure)
    };
    assert_eq!(with(true, &contacts), (true, "as said".to_owned()));
    let unproven = "as said, but no proof is found".to_owned();
    assert_eq!(with(true, &[]), (false, unproven));
    assert_eq!(with(false, &[]), (false, "as said".to_owned()));
}

#[test]
fn a_tongue_leaves_its_groove_one_way_only() {
    let [base, lid, _] = pinned_lid([[50.0, 51.0], [50.0, 51.0], [50.0, 51.0]]);
    let kit = Kit::new(
        brick(ALL, ALL, ALL),
        &[base, lid, brick([60.0, 61.0], ALL, ALL)],
        &[Vec3::X; 3],
    );
    let verdict = kit.verdict();
    let lid_free = verdict.findings.iter().find_map(|f| match f {
        Finding::Loose {
            piece: PatchId(1),
            directions,
        } => Some(directions.clone()),
        _ => None,
    });
    assert_eq!(lid_free, Some(vec![[1.0, 0.0, 0.0]]));
}

#[test]
fn pieces_of_another_size_are_refused_without_asking_for_paths() {
    let mut kit = pinned_kit(|_| {});
    for piece in 0..3 {
        let mesh = &mut kit.pieces[PatchId(piece)];
        mesh.points.iter_mut().for_each(|p| *p *= 1000.0);
    }
    let (verdict, contacts) = kit.examine();
    assert!(!verdict.has_passed() && contacts.is_empty());
    assert!(
        verdict
            .findings
            .iter()
            .any(|f| matches!(f, Finding::Outside { .. })),
        "{verdict:#?}"
    );
}

#[test]
fn a_path_through_a_wall_is_caught_with_place_and_partner() {
    let mut kit = pinned_kit(|_| {});
    kit.plan.steps[1].separation = LatticeDirection::nearest(Vec3::NEG_X).into();
    let verdict = kit.verdict();
    let rub = verdict
        .findings
        .iter()
        .find(|f| matches!(f, Finding::PathRubs { .. }));
    let Some(Finding::PathRubs {
        piece,
        against,
        at,
        volume_mm3,
        ..
    }) = rub
    else {
        panic!("{verdict:#?}")
    };
    assert_eq!((*piece, *against), (PatchId(1), PatchId(0)));
    assert!(
        at[0] < 11.0 && at[2] > 5.0 && at[2] < 16.0 && *volume_mm3 > 100.0,
        "{rub:?}"
    );
}

#[test]
fn a_pin_that_misses_the_base_leaves_it_loose() {
    let verdict = pinned_kit(|pieces| pieces[2] = brick(PIN[0], PIN[1], [20.0, 30.0])).verdict();
    // The pin still holds the lid. The base slips off both along −x. Only the finite push can see that,
    // because the infinitesimal test holds the base.
    assert_eq!(
        verdict.findings[0],
        Finding::Loose {
            piece: PatchId(0),
            directions: vec![[-1.0, 0.0, 0.0]]
        }
    );
}

#[test]
fn a_piece_moved_by_more_than_the_gap_overlaps() {
    let verdict = pinned_kit(|pieces| pieces[1] = pieces[1].translate(Vec3::new(0.0, 0.2, 0.0))).verdict();
    let overlaps = verdict.findings.iter().filter(|f| {
        matches!(
            f,
            Finding::Overlap {
                a: PatchId(0),
                b: PatchId(1),
                ..
            }
        )
    });
    assert_eq!(overlaps.count(), 1, "{:?}", verdict.findings);
    assert!(
        verdict
            .findings
            .iter()
            .any(|f| matches!(f, Finding::Outside { .. }))
    );
}

#[test]
fn sliders_in_a_straight_groove_move_together_though_each_is_enclosed() {
    // A tube along x, open at both ends, with three blocks in a row: the key is the middle one.
    let hole = grown([-5.0, 35.0], [10.0, 20.0], [10.0, 20.0]);
    let tube = brick(ALL, ALL, ALL).subtract(&hole);
    let block = |from: f64, to: f64| brick([from, to], [10.0, 20.0], [10.0, 20.0]);
    let pieces = [tube, block(0.0, 9.9), block(20.0, 30.0), block(10.0, 19.9)];
    let kit = Kit::new(
        brick(ALL, ALL, ALL),
        &pieces,
        &[Vec3::X, Vec3::NEG_X, Vec3::X, Vec3::X],
    );
    let verdict = kit.verdict();
    let motions = verdict.findings.iter().find_map(|f| match f {
        Finding::ClusterMoves { motions } => Some(motions.clone()),
        _ => None,
    });
    let motions = motions.expect("both outer blocks can slide away from the key");
    assert!(
        motions
            .iter()
            .all(|m| m.velocity[0].abs() > 0.99 && m.velocity[1].abs() < 1e-3),
        "{motions:?}"
    );
}

#[test]
fn a_missing_lid_is_a_lost_surface_and_a_broken_plan() {
    let mut kit = pinned_kit(|_| {});
    kit.pieces = kit.pieces.as_slice()[..2].iter().cloned().collect();
    let verdict = kit.verdict();
    assert!(
        verdict
            .findings
            .contains(&Finding::PlanBroken { piece: PatchId(2) })
    );
    let mut kit = pinned_kit(|pieces| pieces[1] = brick([40.0, 41.0], ALL, ALL));
    kit.plan.steps.clear();
    let verdict = kit.verdict();
    assert!(
        verdict
            .findings
            .iter()
            .any(|f| matches!(f, Finding::SurfaceLost { fraction, .. } if *fraction > 0.3))
    );
}

#[test]
fn any_input_gives_a_verdict() {
    let mut kit = pinned_kit(|pieces| pieces[1] = Volume::empty());
    assert!(
        kit.verdict()
            .findings
            .contains(&Finding::NotClosed { piece: PatchId(1) })
    );
    kit.pieces = IdVec::from_fn(3, |_| TriMesh {
        points: vec![],
        triangles: vec![[0, 1, 2]],
    });
    assert_eq!(
        kit.verdict()
            .checks
            .iter()
            .filter(|c| c.ok)
            .map(|c| c.name.as_str())
            .next(),
        Some("plan names every piece once")
    );
    assert!(!kit.verdict().has_passed());
}

#[test]
fn the_verdict_is_the_same_on_one_thread_and_on_two_and_survives_json() {
    let kit = pinned_kit(|pieces| pieces[1] = pieces[1].translate(Vec3::new(0.07, 0.13, 0.0)));
    let on = |n| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap()
            .install(|| kit.verdict())
    };
    let (one, two) = (on(1), on(2));
    assert_eq!(one, two);
    assert_eq!(
        serde_json::to_string(&one).unwrap(),
        serde_json::to_string(&two).unwrap()
    );
    // Parsing may change the last digit of a number, so only fields without numbers are compared.
    let parsed: Verification = serde_json::from_str(&serde_json::to_string(&one).unwrap()).unwrap();
    assert_eq!(
        (parsed.checks, parsed.findings.len()),
        (one.checks, one.findings.len())
    );
}
