//! Benchmark of the volume metric on a ball of eight octants, 17 496 quadratic tetrahedra.

use divan::{Bencher, black_box};
use shellock_mechanics::{Joint, Meeting, Resistance, Side, sample};
use shellock_volume::{Order, VolumeModel, VolumeParams};

fn main() {
    divan::main();
}

#[divan::bench(args = ["linear", "quadratic"], sample_count = 3, sample_size = 1)]
fn build(bencher: Bencher, order: &str) {
    let ball = sample::ball(40.0, 27);
    let params = params(order);
    bencher.bench_local(|| VolumeModel::new(black_box(&params), &ball));
}

#[divan::bench(args = ["linear", "quadratic"], sample_count = 10, sample_size = 1)]
fn resist(bencher: Bencher, order: &str) {
    let ball = sample::ball(40.0, 27);
    let model = VolumeModel::new(&params(order), &ball).expect("a ball is a sound assembly");
    let plan: Vec<Meeting> = (ball.stations.iter())
        .map(|s| {
            let leaves = (s.normal - s.across * 0.5).normalize();
            let is_fast = s.points.iter().any(|p| ball.part_of_point[*p as usize] == 0);
            let joint = Joint {
                male: Side::A,
                leaves,
                is_fast,
                pull_on_a: leaves,
                weight: 1.0,
                size_mm: 3.0,
            };
            Meeting {
                wall: s.across,
                joint: Some(joint),
            }
        })
        .collect();
    assert!(
        matches!(model.resist(&plan, 0), Ok(Resistance::Holds(_))),
        "what comes apart is not worth timing"
    );
    bencher.bench_local(|| model.resist(black_box(&plan), 0));
}

fn params(order: &str) -> VolumeParams {
    let order = if order == "linear" {
        Order::Linear
    } else {
        Order::Quadratic
    };
    VolumeParams {
        order,
        ..VolumeParams::default()
    }
}
