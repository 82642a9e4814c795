//! The loop and its lessons, with kits that are made up.

mod kits;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use kits::*;
use shellock_geom::{Solid, Vec3};

use super::failure::Failure;
use super::job::Job;
use super::*;
use crate::body::BodyError;
use crate::connector::SeamRoom;
use crate::key::{KeyPrism, KeySite, Turn};
use crate::metric::ChoiceError;
use crate::motion::RelativePlay;
use crate::piece::PieceError;
use crate::plan::lesson::Lesson;
use crate::plan::{Handover, PlanConstraints};
use crate::segmentation::{SegmentationError, SegmentationParams, Twins};
use crate::strength::StrengthError;
use crate::verify::Finding;
use crate::{Cancelled, LatticeDirection, MakeError, PatchId, Progress};

#[test]
fn a_stop_inside_of_a_stage_is_a_stop_of_the_job() {
    let stopped = [
        DesignError::from(StrengthError::Cancelled(Cancelled)),
        SegmentationError::Cancelled(Cancelled).into(),
        MakeError::from(BodyError::Cancelled(Cancelled)).into(),
        ChoiceError::Cancelled(Cancelled).into(),
        MakeError::from(PieceError::Cancelled(Cancelled)).into(),
    ];
    assert!(
        stopped.iter().all(|e| matches!(e, DesignError::Cancelled(_))),
        "{stopped:?}"
    );
}

#[test]
fn a_stop_while_pieces_are_changed_is_not_taken_for_a_piece_that_cannot_be_changed() {
    let ball = shellock_test_surfaces::sphere(3, Vec3::splat(20.0));
    let surface = shellock_test_surfaces::voronoi(ball, 6, 1);
    let (report, stop) = (|_: Progress<'_>| {}, AtomicBool::new(false));
    let ctx = Ctx::new(&report, &stop);
    let params = SegmentationParams::default();
    let divided = || segmentation::divide(&ctx, &params, &surface, PatchId(0));
    assert!(matches!(divided(), Ok(Some(_))), "it can be divided");
    stop.store(true, Ordering::Relaxed);
    let united = segmentation::unite(&ctx, &params, &surface, &[PatchId(0)], &Twins::default());
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
fn a_slight_rattle_is_worth_no_other_kit() {
    let passing = |excess: f64| Kit {
        rattles: kit_that_rattles(1, excess).rattles,
        ..good()
    };
    let (slight, strong) = (passing(1.1), passing(1.3));
    assert!(slight.is_firm() && !slight.only_rattles() && slight.rattling_pieces().is_empty());
    assert!(!strong.is_firm() && strong.only_rattles());
    assert!(matches!(
        strong.rattling_pieces()[..],
        [RelativePlay {
            piece: PatchId(1),
            ..
        }]
    ));
}

#[test]
fn a_key_that_rattles_is_nobody_to_join() {
    assert!(kit_that_rattles(2, 3.0).rattling_pieces().is_empty());
    assert!(
        kit_that_rattles(2, 3.0).only_rattles()
            && kit_that_rattles(2, 1.5).only_rattles()
            && !loose(1).only_rattles()
            && !good().only_rattles()
    );
}

#[test]
fn a_kit_that_passed_teaches_nothing_and_one_that_failed_never_comes_again() {
    assert_eq!(good().lessons(), []);
    for failed in [
        loose(1),
        kit_that_rattles(1, 3.0),
        kit(&[("closed", false)], Vec::new()),
    ] {
        let mut constraints = PlanConstraints::default();
        failed
            .lessons()
            .iter()
            .for_each(|lesson| lesson.teach(&mut constraints));
        assert_eq!(constraints.rejections, [found_plan([0, 1, 2])]);
    }
}

#[test]
fn a_kit_tells_pieces_by_their_turn_to_go_in_and_teaches_its_division_by_patches() {
    let turn = Turn::align(Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.8, 0.0, 0.6)).0;
    let handover = Handover::new(&turn, found_plan([2, 0, 1]));
    let told = handover.warnings(vec![Warning::new(
        crate::causes::Make::SeamWithoutConnector { length_mm: 9.0 },
        vec![PatchId(2), PatchId(1)],
        Some(turn.apply(Vec3::X).to_array()),
    )]);
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
    let learned = handed_over(handover, &[("blocked", false)], vec![finding]).lessons();
    assert_eq!(
        learned.iter().flat_map(Lesson::loose).collect::<Vec<_>>(),
        [PatchId(0)]
    );
    let mut constraints = PlanConstraints::default();
    learned.iter().for_each(|lesson| lesson.teach(&mut constraints));
    assert_eq!(constraints.rejections, [found_plan([2, 0, 1])]);
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
    let learned = failed.lessons();
    assert_eq!(
        learned.iter().flat_map(Lesson::suspects).collect::<Vec<_>>(),
        [PatchId(1)]
    );
    let mut constraints = PlanConstraints::default();
    for times in 1..=2 {
        learned.iter().for_each(|lesson| lesson.teach(&mut constraints));
        assert_eq!(constraints.rubs[&(PatchId(1), PatchId(0))], times);
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
    let learned = failed.lessons();
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
        rubs.lessons()
            .iter()
            .all(|lesson| !matches!(lesson, Lesson::WeakJoints(_)))
    );
}

/// Job on a ball of which no kit is made.
pub(super) struct Ball {
    pub model: Solid,
    pub params: Params,
}

impl Ball {
    pub fn new() -> Self {
        Self {
            model: Solid::new(shellock_test_surfaces::sphere(3, Vec3::splat(40.0))).unwrap(),
            params: Params::default(),
        }
    }

    pub fn input(&self) -> Input<'_> {
        Input {
            params: &self.params,
            model: &self.model,
            labels: None,
        }
    }

    /// The ball in `n` pieces.
    pub fn job(&self, n: usize) -> Job<'_> {
        let surface = shellock_test_surfaces::voronoi(self.model.mesh().clone(), n, 1);
        let mut wall = Wall::nominal(&self.params);
        wall.error = Some("a test".to_owned());
        Job::of(self.input(), Arc::new(wall), surface).expect("no key is named")
    }

    /// Concludes a job that made these kits for these places, one after the other.
    pub fn conclude(
        &self,
        kits: Vec<(Option<KeySite>, Result<Kit, DesignError>)>,
    ) -> Result<DesignOutcome, DesignError> {
        let (ctx, mut best, job) = (Ctx::quiet(), Best::new(), self.job(N));
        for (site, kit) in kits {
            match kit {
                Ok(kit) => {
                    let grade = (kit.grade(), kit.failures());
                    best.offer(kit, grade, site, &job.wall);
                    best.close_key(&ctx, site.as_ref());
                }
                Err(error) => best.close_key_with(&ctx, site.as_ref(), error),
            }
        }
        let agenda = Agenda::new(&ctx, &self.input());
        best.conclude(&ctx, &self.input(), &agenda, Effort::default())
    }

    fn design(&self, kits: Vec<(Option<KeySite>, Result<Kit, DesignError>)>) -> Design {
        match self.conclude(kits) {
            Ok(DesignOutcome::Made(design)) => *design,
            _ => panic!("a kit was made"),
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
        visibility: 0.0,
        score: 1.0,
    }
}

pub(super) fn codes(design: &Design) -> Vec<&str> {
    design.warnings.iter().map(|w| w.code()).collect()
}

#[test]
fn the_best_kit_fails_least_then_rattles_least_then_is_the_earliest() {
    let worse = || kit(&[("holds", false), ("closed", false)], Vec::new());
    // As many failures: the one that rattles less, and of equals the earlier.
    for (first, second, is_second) in [
        (loose(1), loose(0), false),
        (
            loose_kit_that_rattles(1, 1.5),
            loose_kit_that_rattles(0, 2.5),
            false,
        ),
        (
            loose_kit_that_rattles(1, 2.5),
            loose_kit_that_rattles(0, 1.5),
            true,
        ),
        (loose(1), worse(), false),
        (worse(), loose(0), true),
        (loose(1), good(), true),
        (kit_that_rattles(1, 1.5), loose(0), false),
    ] {
        let better = if is_second { second.clone() } else { first.clone() };
        let made = Ball::new().design(vec![(Some(site()), Ok(first)), (None, Ok(second))]);
        assert_eq!(made.kit.verification.findings, better.verification.findings);
    }
}

/// Kit that comes loose and whose pieces rattle besides.
fn loose_kit_that_rattles(piece: u32, excess: f64) -> Kit {
    let rattles = kit_that_rattles(piece, excess).rattles;
    Kit {
        rattles,
        ..loose(piece)
    }
}

fn impossible() -> Result<Kit, DesignError> {
    Err(DesignError::Choice(ChoiceError::NoPlan))
}

#[test]
fn a_key_that_cannot_be_cut_is_a_reason_and_no_end() {
    let design = Ball::new().design(vec![(Some(site()), impossible()), (None, Ok(good()))]);
    let not_cut = design
        .warnings
        .iter()
        .find(|w| w.code() == "key-not-cut")
        .expect("there is a warning");
    assert!(
        not_cut.to_string().contains("cannot be made"),
        "{}",
        not_cut.to_string()
    );
}

#[test]
fn a_piece_that_cannot_be_the_key_throws_no_kit_away() {
    let design = Ball::new().design(vec![(Some(site()), Ok(loose(1))), (None, impossible())]);
    assert_eq!(design.kit.verification.findings, loose(1).verification.findings);
    let alone = Ball::new().conclude(vec![(None, impossible())]);
    assert!(alone.is_err(), "without any kit the job cannot be done");
}

#[test]
fn warnings_are_those_of_the_wall_and_of_the_kit_that_is_kept() {
    let mut other = loose(1);
    other.warnings[0] = Warning::new(crate::causes::Make::KeyWithoutRibs, Vec::new(), None);
    let design = Ball::new().design(vec![(Some(site()), Ok(other)), (None, Ok(good()))]);
    let all = codes(&design);
    for code in ["key-without-grip", "strength-unknown", "key-not-cut"] {
        assert!(all.contains(&code), "{code}: {all:?}");
    }
    assert!(!all.contains(&"key-without-ribs"));
}

#[test]
fn without_any_plan_the_answer_is_the_failure_with_a_piece_as_the_key() {
    let (ctx, ball) = (Ctx::quiet(), Ball::new());
    let mut best: Best<Kit> = Best::new();
    best.fail(Failure::of("the cut key is in the way"));
    best.close_key(&ctx, Some(&site()));
    best.fail(Failure::of("all are in each other's way"));
    best.close_key(&ctx, None);
    best.fail(Failure::of("a later way failed as well"));
    best.close_key(&ctx, None);
    let agenda = Agenda::new(&ctx, &ball.input());
    let Ok(DesignOutcome::NoPlan(NoPlan { reason, .. })) =
        best.conclude(&ctx, &ball.input(), &agenda, Effort::default())
    else {
        panic!("no kit was made")
    };
    assert_eq!(reason, "all are in each other's way");
}

/// Runs the loop on a ball whose labels are its two halves, which never lock.
fn halves(ctx: &Ctx, params: &Params) -> (Result<DesignOutcome, DesignError>, Effort) {
    let model = Solid::new(shellock_test_surfaces::sphere(3, Vec3::splat(40.0))).expect("closed");
    let mesh = model.mesh();
    let is_upper = |face| i64::from(mesh.face_center(face).z > 0.0);
    let labels: Vec<i64> = (0..mesh.triangles.len()).map(is_upper).collect();
    let input = Input {
        params,
        model: &model,
        labels: Some(&labels),
    };
    let (mut trial, mut agenda) = (Trial::new(input, Wall::nominal(params)), Agenda::new(ctx, &input));
    let best = explore(ctx, &mut agenda, &mut trial, attempt::make_kit, |kit: &Kit| {
        (kit.grade(), kit.failures())
    });
    let effort = trial.effort;
    (
        best.and_then(|best| best.conclude(ctx, &input, &agenda, effort.clone())),
        effort,
    )
}

/// Parameters by which a piece is the key and nothing is divided again.
fn at_once() -> Params {
    let mut params = with_flat_key();
    params.rounds.refinements = 0;
    params
}

/// Parameters by which a piece is the key.
fn with_flat_key() -> Params {
    let mut params = Params::default();
    params.key = KeySource::Flattest;
    params
}

#[test]
fn work_that_leads_to_no_plan_counts() {
    let in_vain = Effort {
        keys: 1,
        segmentations: 1,
        plans: 1,
        ..Effort::default()
    };
    let (outcome, effort) = halves(&Ctx::quiet(), &at_once());
    assert!(matches!(outcome, Ok(DesignOutcome::NoPlan(_))));
    assert_eq!(effort, in_vain);
}

#[test]
fn pieces_that_are_not_divided_again_for_want_of_time_are_reported() {
    let little = || 0.1;
    let late = Ctx::quiet().with_deadline(&little);
    let is_cut_short = |ctx: &Ctx, refinements| {
        let mut params = at_once();
        params.rounds.refinements = refinements;
        match halves(ctx, &params).0 {
            Ok(DesignOutcome::NoPlan(NoPlan {
                is_cut_short, reason, ..
            })) => {
                assert_eq!(reason.contains("the time was over"), is_cut_short, "{reason}");
                is_cut_short
            }
            _ => panic!("two halves never lock"),
        }
    };
    assert!(is_cut_short(&late, 1));
    assert!(!is_cut_short(&late, 0), "nothing was left to try");
    assert!(!is_cut_short(&Ctx::quiet(), 0));
}

#[test]
fn a_half_is_divided_if_two_pieces_cannot_lock() {
    let ball = Ball::new();
    assert_eq!(ball.job(2).surface.n_patches, 2);
    let (ctx, input) = (Ctx::quiet(), ball.input());
    let params = with_flat_key();
    let input_of_piece = Input {
        params: &params,
        ..input
    };
    let mut agenda = Agenda::new(&ctx, &input_of_piece);
    let mut trial = Trial::new(input_of_piece, Wall::nominal(&params));
    trial.take_division(Some(ball.job(2).surface));
    assert!(trial.begin(&ctx, &mut agenda).expect("not stopped").is_none());
    let allowance = agenda.allowance(&ctx);
    let found = attempt::make_kit(&ctx, trial.parts(&agenda), &allowance).expect("not stopped");
    let [Change::Divide(Step::Divide, surface, None)] = &found.changes[..] else {
        panic!("a half can be divided")
    };
    assert!(
        found.end.is_none() && surface.n_patches > 2,
        "{}",
        surface.n_patches
    );
}

#[test]
fn joined_pieces_count_as_another_division_only_if_they_can_be_made() {
    let (ball, ctx) = (Ball::new(), Ctx::quiet());
    let params = with_flat_key();
    let input = Input {
        params: &params,
        ..ball.input()
    };
    let mut agenda = Agenda::new(&ctx, &input);
    let mut trial = Trial::new(input, Wall::nominal(&params));
    trial.take_division(Some(ball.job(N).surface));
    assert!(trial.begin(&ctx, &mut agenda).expect("not stopped").is_none());
    assert_eq!(trial.effort.segmentations, 1);
    let sizes = trial.parts(&agenda).setup.division.sizes.clone();
    trial
        .apply(&ctx, &mut agenda, Change::Enlarge(sizes))
        .expect("not stopped");
    assert_eq!(
        trial.effort.segmentations, 1,
        "other connectors in the same pieces"
    );
    let joined = Change::Divide(Step::JoinPredicted, ball.job(N).surface, None);
    trial.apply(&ctx, &mut agenda, joined).expect("not stopped");
    assert_eq!(trial.effort.segmentations, 2);
}
