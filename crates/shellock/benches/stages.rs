//! Benchmarks of single stages and of the whole job, on the squirrel at 150 mm.

mod made;

use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use divan::{Bencher, black_box};
use made::Made;
use shellock::body::{BodyParams, PatchDistances, ShellGrid};
use shellock::design::{Params, design};
use shellock::figure::{Figure, make};
use shellock::handling::Handling;
use shellock::key::{KeyParams, sites};
use shellock::plan::{PlanConstraints, PlanOutcome, PlanParams, search, survey};
use shellock::segmentation::{SegmentationParams, segment};
use shellock::strength::{self, StrengthParams};
use shellock::verify::clearance::kit_gaps;
use shellock::verify::examine;
use shellock::{ConnectorSizes, Ctx, InstallationStep, SegmentedSurface, metric};
use shellock_geom::Solid;
use shellock_mechanics::Material;
use shellock_render::ReportPiece;
use shellock_render::palette::color;
use shellock_render::pieces_picture;

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

/// Kit for the benchmarks of the stages from the wall on.
fn kit() -> &'static Made {
    static KIT: OnceLock<Made> = OnceLock::new();
    KIT.get_or_init(|| Made::new(squirrel(), surface()))
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn key_search(bencher: Bencher) {
    let surface = surface();
    let params = KeyParams {
        piece_mm2: surface.mesh.area() / surface.n_patches as f64,
        ..KeyParams::default()
    };
    bencher.bench_local(|| sites(&Ctx::quiet(), &params, black_box(&surface)));
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn choice_of_plan(bencher: Bencher) {
    let surface = surface();
    let (params, sizes) = (PlanParams::default(), ConnectorSizes::default());
    let ctx = Ctx::quiet();
    let tables = survey(&ctx, &params, &surface, &surface.seams(), &sizes).expect("not stopped");
    let outcome = search(&ctx, &params, &tables, &PlanConstraints::default()).expect("not stopped");
    let PlanOutcome::Found(found) = outcome else {
        panic!("the squirrel has a plan");
    };
    bencher
        .with_inputs(|| (*found).clone())
        .bench_local_values(|found| {
            let choice = metric::Choice {
                params: &params,
                surface: &surface,
                even: &metric::EvenSurface::new(&surface, 1.0),
                former: None,
                sizes: &sizes,
                survey: &tables,
                constraints: &PlanConstraints::default(),
                handling: &Handling::new(params.up, 2.0, Material::default()),
                climb: metric::ClimbParams::default(),
            };
            let foresight = metric::Foresight::of(&choice, &found);
            metric::choose(&ctx, &choice, &foresight, found).is_ok()
        });
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn body(bencher: Bencher) {
    let k = kit();
    bencher.bench_local(|| {
        made::split(
            &k.settings,
            &k.surface,
            &k.sizes,
            &k.grid,
            &k.distances,
            &k.lattice_plan,
        )
    });
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn connectors(bencher: Bencher) {
    let k = kit();
    bencher.bench_local(|| made::runs(&k.settings, &k.sizes, &k.grid, &k.shell, &k.lattice_plan));
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn pieces(bencher: Bencher) {
    let k = kit();
    bencher.bench_local(|| {
        made::finish(
            &k.settings,
            &k.surface,
            &k.sizes,
            &k.grid,
            &k.shell,
            &k.lattice_plan,
            &k.runs,
        )
    });
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn verification(bencher: Bencher) {
    let k = kit();
    let assembly = k.assembly(squirrel());
    bencher.bench_local(|| examine(&Ctx::quiet(), &k.settings.verify, black_box(&assembly)));
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn gaps(bencher: Bencher) {
    let k = kit();
    let (model, rim_mm) = (Some(squirrel()), k.settings.body.rim_mm);
    bencher.bench_local(|| kit_gaps(&Ctx::quiet(), model, &k.pieces.meshes, &k.plan, rim_mm));
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn pictures(bencher: Bencher) {
    let k = kit();
    let piece = |(order, step): (usize, &InstallationStep)| ReportPiece {
        number: step.piece.number(),
        name: format!("piece {}", step.piece),
        color: color(order),
        mesh: &k.pieces.meshes[step.piece],
        installation_direction: (-step.separation.unit()).to_array(),
        order,
        is_key: step.piece == k.plan.key(),
        facts: Vec::new(),
    };
    let pieces: Vec<ReportPiece<'_>> = k.plan.steps.iter().enumerate().map(piece).collect();
    bencher.bench_local(|| pieces_picture(black_box(&pieces)));
}
