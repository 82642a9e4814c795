//! Benchmark of the surface metric on a ball of eight octants with 180 stations: about as many as a remeshed
//! model of twelve pieces has.

use divan::{Bencher, black_box};
use shellock_mechanics::{Joint, Meeting, Resistance, Side, SurfaceModel, SurfaceParams, sample};

/// Number of edges along a side of an octant.
const FREQUENCY: u32 = 16;

fn main() {
    divan::main();
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn build(bencher: Bencher) {
    let ball = sample::ball(60.0, FREQUENCY);
    bencher.bench_local(|| SurfaceModel::new(black_box(&SurfaceParams::default()), &ball));
}

#[divan::bench(sample_count = 20, sample_size = 1)]
fn resist(bencher: Bencher) {
    let (model, plan) = (model(), plan(0));
    let solution = model.resist(&plan, 0).expect("a ball is a sound assembly");
    assert!(
        matches!(solution.resistance, Resistance::Holds(_)),
        "what comes apart is not worth timing"
    );
    bencher.bench_local(|| model.resist(black_box(&plan), 0));
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn resist_100(bencher: Bencher) {
    let (model, plans) = (model(), (0..100).map(plan).collect::<Vec<_>>());
    bencher.bench_local(|| model.resist_all(black_box(&plans), 0));
}

fn model() -> SurfaceModel {
    SurfaceModel::new(&SurfaceParams::default(), &sample::ball(60.0, FREQUENCY))
        .expect("a ball is a sound assembly")
}

/// Plan in which pieces leave along their neighbours' walls, turned by a different angle on each seam and in
/// each plan.
fn plan(number: u32) -> Vec<Meeting> {
    let ball = sample::ball(60.0, FREQUENCY);
    let joint = |(i, s): (u32, &shellock_mechanics::Station)| {
        let angle = f64::from(1 + i / (FREQUENCY - 1)) * f64::from(7 + number);
        let leaves = (s.normal + s.across * angle.sin()).normalize();
        let is_fast = s.points.iter().any(|p| ball.part_of_point[*p as usize] == 0);
        let joint = Joint {
            male: Side::A,
            leaves,
            is_fast,
            pull_on_a: leaves,
            weight: 1.0,
            size_mm: 2.5,
        };
        Meeting {
            wall: s.across,
            joint: Some(joint),
        }
    };
    (0..).zip(&ball.stations).map(joint).collect()
}
