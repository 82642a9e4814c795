//! What a job costs is counted, however it ends; what no time was left for is told.

use shellock_geom::{Solid, Vec3};

use super::division::Division;
use super::strengthen::Remedy;
use super::tests::{Ball, good, made, site};
use super::ways::{Ask, Input, asking};
use super::*;
use crate::{Cause, testing};

/// How a job on a ball ends whose labels are its two halves, which never lock, and what it cost.
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
    (ended.concluded(effort), effort)
}

/// A piece is the key, and nothing is divided again.
fn at_once() -> Params {
    let mut params = Params::default();
    params.key = KeySource::Flattest;
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
fn a_design_tells_the_effort_of_the_whole_job() {
    let (_, design) = Ball::new().outcome(vec![(None, made(good()))]);
    let made = DesignOutcome::Made(Box::new(design.expect("a kit was made")));
    let effort = Effort { kits: 7, ..IN_VAIN };
    let DesignOutcome::Made(design) = Ended::of(Ok(made)).concluded(effort).expect("it was made") else {
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
            assert!(with_fewer(ctx, job, candidate, first, fewer, budget).is_ok());
            assert_eq!(budget.foreseen_joinings == 0, n == 0);
        });
        assert_eq!((for_use, foreseen), (n, n));
    }
}

#[test]
fn pieces_that_are_not_divided_again_for_want_of_time_are_told() {
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
