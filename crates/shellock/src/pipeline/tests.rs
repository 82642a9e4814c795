//! The job as a whole.

use std::sync::atomic::{AtomicBool, Ordering};

use super::*;
use crate::context::Progress;
use crate::testing;

#[test]
fn a_stop_inside_of_a_stage_is_a_stop_of_the_job() {
    let stopped = [
        DesignError::from(StrengthError::Cancelled(Cancelled)),
        SegmentationError::Cancelled(Cancelled).into(),
        BodyError::Cancelled(Cancelled).into(),
        ChoiceError::Cancelled(Cancelled).into(),
        PieceError::Cancelled(Cancelled).into(),
    ];
    assert!(stopped.iter().all(|e| matches!(e, DesignError::Cancelled(_))), "{stopped:?}");
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
    let stopped = [divided(), united, segmentation::mended_again(&ctx, &params, &surface)];
    assert!(stopped.iter().all(|s| matches!(s, Err(SegmentationError::Cancelled(_)))));
}
