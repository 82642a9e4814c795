//! Benchmark of the shell solver on a torus of 5 000 points: 30 000 unknowns.

use divan::{Bencher, black_box};
use shellock_geom::{TriMesh, Vec3};
use shellock_mechanics::{LoadCase, Material, ShellModel};

const TURN: f64 = std::f64::consts::TAU;
/// Number of cells around the axis and around the tube.
const CELLS: [u32; 2] = [100, 50];
const N_CASES: u32 = 12;

fn main() {
    divan::main();
}

fn torus() -> TriMesh {
    shellock_testkit::shapes::torus(50.0, 25.0, CELLS)
}

/// Load cases that push the lower tenth along each of [`N_CASES`] directions, held at the upper tenth.
fn cases(mesh: &TriMesh) -> Vec<LoadCase> {
    let case = |k: u32| {
        let angle = TURN * f64::from(k) / f64::from(N_CASES);
        let down = Vec3::new(angle.cos(), angle.sin(), 0.3 * (2.0 * angle).sin());
        let force = |p: &Vec3| if p.dot(down) > 60.0 { -down } else { Vec3::ZERO };
        let held = (0..)
            .zip(&mesh.points)
            .filter(|(_, p)| p.dot(down) < -60.0)
            .map(|(v, _)| v);
        LoadCase {
            forces_n: mesh.points.iter().map(force).collect(),
            anchors: held.collect(),
            ..LoadCase::default()
        }
    };
    (0..N_CASES).map(case).collect()
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn assemble(bencher: Bencher) {
    let mesh = torus();
    bencher.bench_local(|| ShellModel::new(black_box(&mesh), &Material::SLA_RESIN));
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn factorise(bencher: Bencher) {
    let model = ShellModel::new(&torus(), &Material::SLA_RESIN).expect("a torus is a sound shell");
    bencher.bench_local(|| model.at_thickness(black_box(2.0)).map(|_| ()));
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn factorise_and_solve_12_cases_with_stresses(bencher: Bencher) {
    let mesh = torus();
    let (model, cases) = (
        ShellModel::new(&mesh, &Material::SLA_RESIN).expect("a torus is a sound shell"),
        cases(&mesh),
    );
    bencher.bench_local(|| {
        let solver = model
            .at_thickness(black_box(2.0))
            .expect("a free shell has a factor");
        let displacements = solver.solve(&cases).expect("regions hold");
        displacements
            .iter()
            .map(|u| solver.stresses(u))
            .collect::<Vec<_>>()
    });
}
