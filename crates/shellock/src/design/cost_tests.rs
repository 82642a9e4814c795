//! The cost of a job is bounded and counted, however it ends, and a lack of time is reported.

use shellock_geom::{Solid, Vec3};

use super::division::Division;
use super::strengthen::Remedy;
use super::tests::{Ball, good, made, site};
use super::ways::{Ask, Input, asking};
use super::*;
use crate::{Cause, testing};

/// Runs a job on a ball whose labels are its two halves, which never lock; the outcome and the cost.
fn halves(ctx: &Ctx, params: &Params) -> (Result<DesignOutcome, DesignError>, Effort) {
    let model = Solid::new(testing::sphere(3, Vec3::splat(40.0))).expect("closed");
    let mesh = model.mesh();
    let is_upper = |face| i64::from(mesh.face_center(face).z > 0.0);
    let labels: Vec<i64> = (0..mesh.triangles.len()).map(is_upper).collect();
    let wall = Wall {
        settings: Settings::resolve(params),
        strength: None,
        warnings: Vec::new(),
    };
    let input = Input {
        params,
        model: &model,
        labels: Some(&labels),
    };
    let ask = Ask {
        factor: 1.0,
        rounds: params.rounds,
        n_thicker: 0,
    };
    let mut effort = Effort::default();
    let ended = asking(ctx, &input, &wall, ask, &mut effort);
    (ended.conclude(effort), effort)
}

/// A piece is the key, and nothing is divided again.
fn at_once() -> Params {
    let mut params = Params {
        key: KeySource::Flattest,
        ..Params::default()
    };
    params.rounds.refinements = 0;
    params
}

/// One plan that was sought in vain.
const IN_VAIN: Effort = Effort {
    keys: 1,
    segmentations: 1,
    plans: 1,
    kits: 0,
};

#[test]
fn work_that_leads_to_no_plan_counts() {
    let (outcome, effort) = halves(&Ctx::quiet(), &at_once());
    assert!(matches!(outcome, Ok(DesignOutcome::NoPlan { .. })));
    assert_eq!(effort, IN_VAIN);
}

#[test]
fn work_that_ends_in_an_error_counts() {
    let params = Params {
        cell_mm: Some(1e-4),
        ..at_once()
    };
    let (outcome, effort) = halves(&Ctx::quiet(), &params);
    assert!(matches!(outcome, Err(DesignError::Grid(_))));
    assert_eq!(effort, IN_VAIN);
}

#[test]
fn a_design_has_the_effort_of_the_whole_job() {
    let (_, design) = Ball::new().outcome(vec![(None, made(good()))]);
    let made = DesignOutcome::Made(Box::new(design.expect("a kit was made")));
    let effort = Effort { kits: 7, ..IN_VAIN };
    let DesignOutcome::Made(design) = Ended::new(Ok(made)).conclude(effort).expect("it was made") else {
        panic!("a kit was made")
    };
    assert_eq!(design.effort, effort);
}

/// Divisions that are counted by a `change` of a candidate's first division.
fn counted(
    ball: &Ball,
    candidate: &Candidate<'_>,
    change: impl FnOnce(&Ctx, &Job<'_>, Division, &mut Budget),
) -> usize {
    let (ctx, job) = (Ctx::quiet(), ball.job());
    let first = ball.candidate().division(&ctx, &job, job.surface.clone());
    let first = first.expect("sizes").expect("no key is cut");
    let mut budget = candidate.budget;
    (budget.levers.connectors, budget.levers.weak_joinings) = (1, 1);
    change(&ctx, &job, first, &mut budget);
    budget.spent.segmentations
}

#[test]
fn larger_connectors_are_no_other_division_and_joined_pieces_are_where_they_can_be_made() {
    let ball = Ball::new();
    let (piece, job) = (ball.candidate(), ball.job());
    let mut beside = site();
    beside.prism.origin = Vec3::splat(1e3);
    let no_key = Candidate::new(&job, 0, Some(&beside)).expect("a turned ball is a solid");
    let told = || Warning {
        cause: Cause::JoinedForUse {
            done: "pressed".into(),
        },
        pieces: Vec::new(),
        at: None,
    };
    let connectors = counted(&ball, &piece, |ctx, job, first, budget| {
        let remedy = Remedy::Connectors(first.chosen.clone());
        assert!(strengthened(ctx, job, &piece, first, remedy, budget).is_ok());
        assert_eq!(budget.levers.connectors, 0);
    });
    assert_eq!(connectors, 0);
    for (candidate, n) in [(&piece, 1), (&no_key, 0)] {
        let for_use = counted(&ball, candidate, |ctx, job, first, budget| {
            let remedy = Remedy::Joined(job.surface.clone(), told());
            assert!(strengthened(ctx, job, candidate, first, remedy, budget).is_ok());
            assert_eq!(budget.levers.weak_joinings, 0);
        });
        let foreseen = counted(&ball, candidate, |ctx, job, first, budget| {
            let fewer = job.surface.clone();
            assert!(join_as_foreseen(ctx, job, candidate, first, fewer, budget).is_ok());
            assert_eq!(budget.foreseen_joinings == 0, n == 0);
        });
        assert_eq!((for_use, foreseen), (n, n));
    }
}

#[test]
fn pieces_that_are_not_divided_again_for_want_of_time_are_reported() {
    let none = || 0.0;
    let late = Ctx::quiet().with_deadline(&none);
    let is_cut_short = |ctx: &Ctx, refinements| {
        let mut params = at_once();
        params.rounds.refinements = refinements;
        match halves(ctx, &params).0 {
            Ok(DesignOutcome::NoPlan { is_cut_short, .. }) => is_cut_short,
            _ => panic!("two halves never lock"),
        }
    };
    assert!(is_cut_short(&late, 1));
    assert!(!is_cut_short(&late, 0), "nothing was left to try");
    assert!(!is_cut_short(&Ctx::quiet(), 0));
}

/// Tries three keys with so many seconds left, of which the second has a plan if `has_plan`: the number of keys tried, the
/// plan, and whether a key was left out.
fn keys_tried(seconds_left: f64, has_plan: bool) -> (usize, Result<(), String>, bool) {
    let left = || seconds_left;
    let (ctx, pace) = (Ctx::quiet().with_deadline(&left), Pace::default());
    let mut n_tried = 0;
    let walled = try_keys(&ctx, &pace, &[Some(site()), Some(site()), None], |i, _| {
        n_tried += 1;
        Ok(Walled::Done(if has_plan && i == 1 {
            Ok(())
        } else {
            // A key that cannot be cut has nothing to say.
            Err([format!("key {i}"), String::new()][i.min(1)].clone())
        }))
    });
    let Ok(Walled::Done(planned)) = walled else {
        panic!("no wall is too thin")
    };
    (n_tried, planned, pace.is_cut_short())
}

#[test]
fn keys_that_no_time_is_left_to_plan_for_are_reported() {
    let reason = || Err("key 0".to_owned());
    assert_eq!(keys_tried(1.0, true), (2, Ok(()), false));
    assert_eq!(keys_tried(1.0, false), (3, reason(), false));
    for has_plan in [true, false] {
        assert_eq!(keys_tried(0.0, has_plan), (1, reason(), true));
    }
}

#[test]
fn a_plan_and_the_lack_of_one_report_that_the_time_was_over() {
    let planned = || {
        let kit = good();
        Planned {
            surface: kit.surface,
            plan: kit.plan,
            proof: kit.proof,
            mean_cost: 1.0,
            n_plans: 1,
            holding: kit.holding,
            warnings: Vec::new(),
        }
    };
    for is_cut_short in [false, true] {
        let found = outcome::conclude_plan(Ok(planned()), is_cut_short);
        let codes: Vec<&str> = found
            .as_ref()
            .map_or(Vec::new(), |p| p.warnings.iter().map(|w| w.code()).collect());
        assert_eq!(codes.contains(&"time-up"), is_cut_short);
        let Err(none) = outcome::conclude_plan(Err("why".to_owned()), is_cut_short) else {
            panic!("there is no plan")
        };
        assert_eq!(none.is_cut_short, is_cut_short);
        assert_eq!(none.reason == "why", !is_cut_short);
        assert!(none.reason.contains("why"));
    }
}

#[test]
fn cut_keys_cost_less_than_a_piece_that_is_the_key() {
    let rounds = Rounds::default();
    let of_piece = Budget::of_piece(&rounds);
    for i in 0..budget::KITS_OF_CUT_KEYS.len() {
        let cut = Budget::of_cut_key(&rounds, i);
        assert!(
            cut.kits < of_piece.kits
                && cut.kits_each < of_piece.kits_each
                && cut.revisions < of_piece.revisions
        );
    }
    let few = Budget::of_cut_key(
        &Rounds {
            kits: 1,
            refinements: 0,
            kits_in_all: 1,
        },
        0,
    );
    assert_eq!(
        (few.kits_each, few.kits, few.revisions),
        (1, 1, 0),
        "the user's bounds are bounds"
    );
    let half_gone = |gone| {
        let mut left = of_piece;
        left.revisions -= gone;
        left.is_half_gone()
    };
    assert_eq!([0, 1, 2, 3].map(half_gone), [false, false, true, true]);
}
