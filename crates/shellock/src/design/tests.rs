//! The loop, its budgets and lessons, with kits that are made up.

use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, Ordering};

use shellock_geom::{Solid, TriMesh, Vec3};

use super::handover::Handover;
use super::lesson::{Lesson, lessons};
use super::*;
use crate::body::BodyError;
use crate::connector::SeamRoom;
use crate::context::Progress;
use crate::key::{KeyPrism, KeySite, Turn};
use crate::metric::{ChoiceError, Holding};
use crate::piece::PieceError;
use crate::plan::key::KeyDirections;
use crate::plan::{LatticePlan, PlanConstraints, PlanProof, ProofScope};
use crate::play::{KitPlay, Rattle, Slide};
use crate::segmentation::{SegmentationError, SegmentationParams};
use crate::strength::StrengthError;
use crate::verify::{Check, Finding, Play, Verification};
use crate::{Cancelled, Cause, ConnectorSizes, IdVec, LatticeDirection, PatchId, testing};

const N: usize = 3;

fn ids() -> impl Iterator<Item = PatchId> {
    (0..N).map(PatchId::from)
}

fn check(name: &str, ok: bool) -> Check {
    Check {
        name: name.into(),
        ok,
        figure: String::new(),
    }
}

/// A kit of three pieces, the last of them the key, that has these checks and findings.
fn kit(checks: &[(&str, bool)], findings: Vec<Finding>) -> Kit {
    handed_over(
        Handover::new(&Turn::default(), found_plan([0, 1, 2])),
        checks,
        findings,
    )
}

/// Patches in this order, all of which leave upwards.
fn found_plan(order: [u32; N]) -> LatticePlan {
    let up = LatticeDirection::nearest(Vec3::Z);
    LatticePlan::new(order.map(|patch| (PatchId(patch), up)))
}

fn handed_over(handover: Handover, checks: &[(&str, bool)], findings: Vec<Finding>) -> Kit {
    let plan = handover.plan();
    let slide = Slide {
        key: plan.key(),
        seat: PatchId(0),
        at: [0.0; 3],
        along: [0.0, 0.0, 1.0],
        most_mm: 0.3,
    };
    let nothing = || ids().map(|_| None).collect::<IdVec<PatchId, Option<Play>>>();
    Kit {
        surface: testing::voronoi(testing::sphere(2, Vec3::splat(20.0)), N, 1),
        sizes: ConnectorSizes::default(),
        plan,
        proof: PlanProof {
            cost: 1.0,
            lower_bound: 1.0,
            gap: 0.0,
            optimal: true,
            least_cost: 1.0,
            key_lower_bound: 1.0,
            proven_for: ProofScope {
                keys: Vec::new(),
                slides: KeyDirections::WithinPlane,
                n_lessons: 0,
            },
            piece_costs: ids().map(|_| 1.0).collect(),
        },
        holding: Holding {
            quality_mm: None,
            loose: Vec::new(),
            seams: Vec::new(),
            n_compared: 1,
            bears: Vec::new(),
            foreseen_play: Vec::new(),
            foreseen_excess: Vec::new(),
        },
        deformed: crate::metric::Deformed::default(),
        thickness_mm: 2.0,
        pieces: ids().map(|_| TriMesh::default()).collect(),
        joints: Vec::new(),
        press_fits: Vec::new(),
        contacts: Vec::new(),
        verification: Verification {
            checks: checks.iter().map(|&(name, ok)| check(name, ok)).collect(),
            findings,
        },
        touching: Vec::new(),
        rattles: Vec::new(),
        play: KitPlay {
            slide,
            bearings: Vec::new(),
            alone: nothing(),
            estimates: nothing(),
            swings: ids().map(|_| Vec::new()).collect(),
            ways_out: None,
            together: None,
            proofs: Vec::new(),
        },
        warnings: vec![Warning {
            cause: Cause::KeyWithoutGrip,
            pieces: Vec::new(),
            at: None,
        }],
        handover,
    }
}

pub(super) fn good() -> Kit {
    kit(&[("holds", true)], Vec::new())
}

pub(super) fn rattling(piece: u32, translation_mm: f64) -> Kit {
    let play = Play {
        translation_mm,
        rotation_deg: 0.0,
        is_proven: false,
    };
    let (piece, at) = (PatchId(piece), [0.0; 3]);
    let rattle = Rattle {
        piece,
        play,
        most: [1.0, 2.0],
        excess: translation_mm,
        at,
    };
    let finding = Finding::PlayTooWide {
        piece,
        play,
        most: [2.0, 4.0],
        at,
    };
    let is_loose = translation_mm > 2.0;
    let findings = if is_loose { vec![finding] } else { Vec::new() };
    Kit {
        rattles: vec![rattle],
        ..kit(&[("holds", true), ("sits", !is_loose)], findings)
    }
}

pub(super) fn loose(piece: u32) -> Kit {
    kit(
        &[("holds", false), ("sits", true)],
        vec![Finding::Loose {
            piece: PatchId(piece),
            directions: Vec::new(),
        }],
    )
}

#[test]
fn a_stop_inside_of_a_stage_is_a_stop_of_the_job() {
    let stopped = [
        DesignError::from(StrengthError::Cancelled(Cancelled)),
        SegmentationError::Cancelled(Cancelled).into(),
        BodyError::Cancelled(Cancelled).into(),
        ChoiceError::Cancelled(Cancelled).into(),
        PieceError::Cancelled(Cancelled).into(),
    ];
    assert!(
        stopped.iter().all(|e| matches!(e, DesignError::Cancelled(_))),
        "{stopped:?}"
    );
}

#[test]
fn a_stop_while_pieces_are_changed_is_not_taken_for_a_piece_that_cannot_be_changed() {
    let ball = testing::sphere(3, Vec3::splat(20.0));
    let surface = testing::voronoi(ball, 6, 1);
    let (report, stop) = (|_: Progress<'_>| {}, AtomicBool::new(false));
    let ctx = Ctx::new(&report, &stop);
    let params = SegmentationParams::default();
    let divided = || segmentation::divide(&ctx, &params, &surface, PatchId(0));
    assert!(matches!(divided(), Ok(Some(_))), "it can be divided");
    stop.store(true, Ordering::Relaxed);
    let united = segmentation::unite(&ctx, &params, &surface, &[PatchId(0)]);
    let stopped = [
        divided(),
        united,
        segmentation::refined_again(&ctx, &params, &surface),
    ];
    assert!(
        stopped
            .iter()
            .all(|s| matches!(s, Err(SegmentationError::Cancelled(_))))
    );
}

#[test]
fn the_best_kit_fails_least_then_rattles_least_then_is_the_earliest() {
    let two_failures = kit(&[("holds", false), ("sits", false)], Vec::new());
    let mut best = None;
    for (made, keeps) in [
        (two_failures, true),
        (loose(1), true),
        // As many failures, and it rattles besides.
        (rattling(1, 3.0), false),
        (loose(0), false),
        (good(), true),
        (good(), false),
    ] {
        let mut made = made;
        made.thickness_mm = 9.0;
        best.iter_mut().for_each(|kit: &mut Kit| kit.thickness_mm = 2.0);
        attempt::keep(&mut best, made);
        assert_eq!(best.as_ref().unwrap().thickness_mm == 9.0, keeps);
    }
    let mut best = Some(rattling(1, 3.0));
    attempt::keep(&mut best, rattling(0, 2.5));
    assert_eq!(best.unwrap().rattling(), [PatchId(0)]);
}

#[test]
fn a_key_that_rattles_is_nobody_to_join() {
    assert_eq!(rattling(2, 3.0).rattling(), []);
    assert!(
        rattling(2, 3.0).only_rattles()
            && rattling(2, 1.5).only_rattles()
            && !loose(1).only_rattles()
            && !good().only_rattles()
    );
}

#[test]
fn a_kit_that_passed_teaches_nothing_and_one_that_failed_never_comes_again() {
    assert_eq!(lessons(&good()), []);
    for failed in [loose(1), rattling(1, 3.0), kit(&[("closed", false)], Vec::new())] {
        let mut constraints = PlanConstraints::default();
        lessons(&failed)
            .iter()
            .for_each(|lesson| lesson.teach(&mut constraints));
        assert_eq!(constraints.rejected, [found_plan([0, 1, 2])]);
    }
}

#[test]
fn a_kit_tells_pieces_by_their_turn_to_go_in_and_teaches_its_division_by_patches() {
    let turn = Turn::laying(Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.8, 0.0, 0.6)).0;
    let handover = Handover::new(&turn, found_plan([2, 0, 1]));
    let told = handover.warnings(vec![Warning {
        cause: Cause::SeamWithoutConnector { length_mm: 9.0 },
        pieces: vec![PatchId(2), PatchId(1)],
        at: Some(turn.apply(Vec3::X).to_array()),
    }]);
    assert_eq!(told[0].pieces, [PatchId(0), PatchId(2)]);
    assert!(Vec3::from(told[0].at.unwrap()).distance(Vec3::X) < 1e-12);
    let plan = handover.plan();
    assert_eq!(
        plan.steps.iter().map(|s| s.piece.number()).collect::<Vec<_>>(),
        [1, 2, 3]
    );
    assert!(turn.apply(plan.separation(PatchId(1)).unit()).distance(Vec3::Z) < 1e-12);
    let finding = Finding::Loose {
        piece: PatchId(1),
        directions: Vec::new(),
    };
    let learned = lessons(&handed_over(handover, &[("blocked", false)], vec![finding]));
    assert_eq!(
        learned.iter().flat_map(Lesson::loose).collect::<Vec<_>>(),
        [PatchId(0)]
    );
    let mut constraints = PlanConstraints::default();
    learned.iter().for_each(|lesson| lesson.teach(&mut constraints));
    assert_eq!(constraints.rejected, [found_plan([2, 0, 1])]);
}

#[test]
fn a_piece_that_rubs_takes_another_way_and_twice_another_turn() {
    let rubs = Finding::PathRubs {
        piece: PatchId(1),
        against: PatchId(0),
        travel_mm: 4.0,
        thickness_mm: 0.1,
        volume_mm3: 2.0,
        at: [0.0; 3],
    };
    let failed = kit(&[("free", false)], vec![rubs]);
    let learned = lessons(&failed);
    assert_eq!(
        learned.iter().flat_map(Lesson::blamed).collect::<Vec<_>>(),
        [PatchId(1)]
    );
    let mut constraints = PlanConstraints::default();
    for times in 1..=2 {
        learned.iter().for_each(|lesson| lesson.teach(&mut constraints));
        assert_eq!(constraints.rubbed[&(PatchId(1), PatchId(0))], times);
    }
    assert_eq!(
        constraints.forbidden,
        [(PatchId(1), LatticeDirection::nearest(Vec3::Z))].into()
    );
}

#[test]
fn joints_that_came_out_too_short_are_not_counted_on_again_where_something_is_loose() {
    let contact = |later: u32, earlier: u32| SeamRoom {
        later: PatchId(later),
        earlier: PatchId(earlier),
        length_mm: 20.0,
        usable_mm: 10.0,
        at: Vec3::ZERO,
    };
    let mut failed = loose(1);
    failed.contacts = vec![contact(1, 0)];
    let learned = lessons(&failed);
    let mut constraints = PlanConstraints::default();
    learned.iter().for_each(|lesson| lesson.teach(&mut constraints));
    let s = LatticeDirection::nearest(Vec3::Z);
    assert!(
        constraints.is_weak(PatchId(1), PatchId(0), s) && !constraints.is_weak(PatchId(0), PatchId(1), s)
    );
    assert_eq!(
        learned.iter().flat_map(Lesson::loose).collect::<Vec<_>>(),
        [PatchId(1)]
    );
    // Where nothing is loose, short joints hold.
    let mut rubs = kit(&[("closed", false)], Vec::new());
    rubs.contacts = vec![contact(1, 0)];
    assert!(
        lessons(&rubs)
            .iter()
            .all(|lesson| !matches!(lesson, Lesson::WeakJoints(_)))
    );
}

/// A job on a ball, of which no kit is made.
pub(super) struct Ball {
    pub model: Solid,
    pub params: Params,
    pub wall: Wall,
}

impl Ball {
    pub fn new() -> Self {
        let params = Params::default();
        let told = Warning {
            cause: Cause::StrengthUnknown {
                error: String::new(),
                thickness_mm: 2.0,
            },
            pieces: Vec::new(),
            at: None,
        };
        let wall = Wall {
            settings: Settings::resolve(&params),
            strength: None,
            warnings: vec![told],
        };
        Self {
            model: Solid::new(testing::sphere(2, Vec3::splat(20.0))).unwrap(),
            params,
            wall,
        }
    }

    pub fn job(&self) -> Job<'_> {
        let surface = testing::voronoi(self.model.mesh().clone(), N, 1);
        Job {
            ask: Ask {
                factor: 1.0,
                rounds: self.params.rounds,
                n_thicker: 1,
            },
            may_thicken: true,
            pace: Pace::default(),
            begun_s: 0.0,
            params: &self.params,
            model: &self.model,
            labels: None,
            wall: &self.wall,
            stress: None,
            surface,
            key_faces: None,
        }
    }

    pub fn candidate(&self) -> Candidate<'_> {
        Candidate {
            turn: Turn::default(),
            model: Cow::Borrowed(&self.model),
            surface: self.job().surface,
            key: None,
            budget: Budget::of_piece(&self.params.rounds),
        }
    }

    /// The outcome of kits that are made one after the other for these places.
    pub fn outcome(
        &self,
        tried: Vec<(Option<KeySite>, Result<Explored, DesignError>)>,
    ) -> (Vec<bool>, Option<Design>) {
        let (ctx, mut best, mut needed) = (Ctx::quiet(), Best::default(), Vec::new());
        for (place, explored) in tried {
            needed.push(!best.is_enough(place.as_ref()));
            if needed[needed.len() - 1] {
                best.add(&ctx, place.as_ref(), self.candidate(), explored)
                    .unwrap();
            }
        }
        match best.finished(&ctx, &self.job(), Effort::default()).unwrap() {
            DesignOutcome::Made(design) => (needed, Some(*design)),
            DesignOutcome::NoPlan { .. } => (needed, None),
        }
    }
}

pub(super) fn site() -> KeySite {
    let prism = KeyPrism {
        origin: Vec3::ZERO,
        slide: Vec3::X,
        normal: Vec3::Z,
        half_width_mm: 5.0,
        depth_mm: 5.0,
        corner_mm: 1.0,
    };
    KeySite {
        prism,
        flat_share: 1.0,
        side_share: 1.0,
        rail_mm: 0.0,
        area_mm2: 100.0,
        shown: 0.0,
        score: 1.0,
    }
}

pub(super) fn made(kit: Kit) -> Result<Explored, DesignError> {
    Ok(Explored {
        kit: Some(kit),
        ..Explored::default()
    })
}

pub(super) fn codes(design: &Design) -> Vec<&str> {
    design.warnings.iter().map(|w| w.code()).collect()
}

#[test]
fn a_kit_that_passes_ends_the_job() {
    let (needed, design) =
        Ball::new().outcome(vec![(Some(site()), made(good())), (Some(site()), made(good()))]);
    assert_eq!(needed, [true, false]);
    assert!(design.unwrap().kit.verification.passed());
}

#[test]
fn a_kit_that_rattles_and_is_not_loose_passes_where_no_firm_one_is_found() {
    let rattles = || (Some(site()), made(rattling(1, 1.5)));
    let (needed, design) = Ball::new().outcome(vec![rattles(), (Some(site()), made(good()))]);
    assert_eq!(needed, [true, true], "a firmer one is looked for");
    assert!(design.unwrap().kit.is_firm());
    let (_, design) = Ball::new().outcome(vec![rattles(), (None, made(loose(1)))]);
    let kit = design.unwrap().kit;
    assert!(kit.verification.passed() && !kit.is_firm());
}

#[test]
fn keys_whose_kits_only_rattle_are_two_and_no_piece_is_tried_as_the_key() {
    let rattles = || (Some(site()), made(rattling(1, 3.0)));
    let (needed, design) = Ball::new().outcome(vec![rattles(), rattles(), rattles(), (None, made(good()))]);
    assert_eq!(needed, [true, true, false, false]);
    assert!(design.unwrap().kit.only_rattles());
}

#[test]
fn a_key_that_cannot_be_cut_is_a_reason_and_no_end() {
    let impossible = || (Some(site()), Err(DesignError::Choice(ChoiceError::NoPlan)));
    let (_, design) = Ball::new().outcome(vec![impossible(), (None, made(good()))]);
    let design = design.unwrap();
    let told = design
        .warnings
        .iter()
        .find(|w| w.code() == "key-not-cut")
        .expect("it is told");
    assert!(
        told.to_string().contains("cannot be made"),
        "{}",
        told.to_string()
    );
    assert!(
        Best::default()
            .add(
                &Ctx::quiet(),
                Some(&site()),
                Ball::new().candidate(),
                Err(Cancelled.into())
            )
            .is_err()
    );
}

#[test]
fn a_piece_that_cannot_be_the_key_throws_no_kit_away() {
    let impossible = || Err(DesignError::Choice(ChoiceError::NoPlan));
    let (_, design) = Ball::new().outcome(vec![(Some(site()), made(loose(1))), (None, impossible())]);
    assert_eq!(
        design.unwrap().kit.verification.findings,
        loose(1).verification.findings
    );
    let alone = Best::default().add(&Ctx::quiet(), None, Ball::new().candidate(), impossible());
    assert!(alone.is_err(), "without any kit the job cannot be done");
}

/// A kit that comes loose and whose pieces rattle by so much besides.
fn loose_and_rattling(piece: u32, excess: f64) -> Kit {
    let rattles = rattling(piece, excess).rattles;
    Kit {
        rattles,
        ..loose(piece)
    }
}

#[test]
fn the_better_of_two_kits_is_given_out_whichever_key_it_has_and_of_equals_the_earlier() {
    let ball = Ball::new();
    let given_out = |cut: Kit, piece: Kit| {
        let tried = vec![(Some(site()), made(cut)), (None, made(piece))];
        let kit = ball.outcome(tried).1.expect("a kit was made").kit;
        kit.verification.findings
    };
    let first = |kit: Kit| kit.verification.findings;
    let worse = || kit(&[("holds", false), ("closed", false)], Vec::new());
    // As many failures: the one that rattles less, and of equals the earlier.
    for (cut, piece, is_piece) in [
        (loose(1), loose(0), false),
        (loose_and_rattling(1, 1.5), loose_and_rattling(0, 2.5), false),
        (loose_and_rattling(1, 2.5), loose_and_rattling(0, 1.5), true),
        (loose(1), worse(), false),
        (worse(), loose(0), true),
    ] {
        let better = first(if is_piece { piece.clone() } else { cut.clone() });
        assert_eq!(piece.is_better_than(&cut), is_piece);
        assert_eq!(given_out(cut, piece), better);
    }
}

#[test]
fn warnings_are_those_of_the_wall_and_of_the_kit_that_is_given_out() {
    let mut other = loose(1);
    other.warnings[0].cause = Cause::KeyWithoutRibs;
    let (_, design) = Ball::new().outcome(vec![(Some(site()), made(other)), (None, made(good()))]);
    let design = design.unwrap();
    let all = codes(&design);
    assert!(
        all.contains(&"key-without-grip")
            && all.contains(&"strength-unknown")
            && all.contains(&"key-not-cut"),
        "{all:?}"
    );
    assert!(!all.contains(&"key-without-ribs"));
}

#[test]
fn the_settings_of_a_design_have_the_wall_that_was_decided() {
    let mut ball = Ball::new();
    ball.params.thickness = Thickness::Auto;
    ball.wall.settings = Settings::with_thickness(&ball.params, 1.3);
    assert_ne!(Settings::resolve(&ball.params), ball.wall.settings);
    let (_, design) = ball.outcome(vec![(None, made(good()))]);
    assert_eq!(design.unwrap().settings, ball.wall.settings);
}

#[test]
fn without_any_plan_the_answer_is_why() {
    let failure = || Failure {
        reason: "all are in each other's way".into(),
        ..Failure::default()
    };
    let none = || {
        Ok(Explored {
            failure: failure(),
            ..Explored::default()
        })
    };
    let ball = Ball::new();
    let (ctx, mut best) = (Ctx::quiet(), Best::default());
    best.add(&ctx, Some(&site()), ball.candidate(), none()).unwrap();
    best.add(&ctx, None, ball.candidate(), none()).unwrap();
    let DesignOutcome::NoPlan { reason, .. } = best.finished(&ctx, &ball.job(), Effort::default()).unwrap()
    else {
        panic!("no kit")
    };
    assert_eq!(reason, failure().reason);
}
