//! Stages and the whole job on the squirrel at 150 mm.

use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use divan::{Bencher, black_box};
use shellock::body::{BodyParams, PatchDistances, ShellGrid};
use shellock::design::{Params, design};
use shellock::figure::{Figure, make};
use shellock::plan::{PlanConstraints, PlanParams, search, survey};
use shellock::segmentation::{SegmentationParams, segment};
use shellock::strength::{self, StrengthParams};
use shellock::{ConnectorSizes, Ctx, SegmentedSurface};
use shellock_geom::Solid;

fn main() {
    divan::main();
}

static STOP: AtomicBool = AtomicBool::new(false);

fn squirrel() -> &'static Solid {
    static SQUIRREL: OnceLock<Solid> = OnceLock::new();
    SQUIRREL.get_or_init(|| make(Figure::Squirrel, 150.0, 1.6))
}

fn surface() -> SegmentedSurface {
    let ctx = Ctx::new(&|_| {}, &STOP);
    segment(&ctx, &SegmentationParams::default(), squirrel(), None).expect("the squirrel can be divided")
}

#[divan::bench(sample_count = 5)]
fn thickness(bencher: Bencher) {
    squirrel();
    bencher.bench(|| {
        let ctx = Ctx::new(&|_| {}, &STOP);
        strength::thickness(&ctx, &StrengthParams::default(), squirrel()).expect("the squirrel has a wall")
    });
}

#[divan::bench(sample_count = 5)]
fn segmentation(bencher: Bencher) {
    squirrel();
    bencher.bench(|| black_box(surface()));
}

#[divan::bench(sample_count = 5)]
fn plan(bencher: Bencher) {
    let surface = surface();
    let params = PlanParams::default();
    bencher.bench(|| {
        let ctx = Ctx::new(&|_| {}, &STOP);
        let tables = survey(
            &ctx,
            &params,
            &surface,
            &surface.seams(),
            &ConnectorSizes::default(),
        )
        .expect("not stopped");
        search(&ctx, &params, &tables, &PlanConstraints::default())
    });
}

#[divan::bench(sample_count = 5)]
fn grid_and_distances(bencher: Bencher) {
    let surface = surface();
    bencher.bench(|| {
        let grid =
            ShellGrid::new(&BodyParams::default(), squirrel(), 5.4).expect("the squirrel has a cavity");
        PatchDistances::measure(&grid, &surface)
    });
}

#[divan::bench(sample_count = 3)]
fn whole_job(bencher: Bencher) {
    squirrel();
    bencher.bench(|| {
        let ctx = Ctx::new(&|_| {}, &STOP);
        design(&ctx, &Params::default(), squirrel(), None).is_ok()
    });
}
