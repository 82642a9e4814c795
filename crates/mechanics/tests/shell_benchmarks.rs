//! Published benchmarks of shell elements: our results against their references.
//!
//! `cargo test --release -p shellock-mechanics --test shell_benchmarks -- --nocapture` prints the table of
//! docs/notes/shell.md. Quantities have the units of the sources, which are consistent.

use std::f64::consts::FRAC_PI_2;

use shellock_geom::{TriMesh, Vec3};
use shellock_mechanics::{LoadCase, Material, ShellModel, Support};

/// Grid of `cells` over the unit square, cut along alternating diagonals, placed by `place`.
fn grid(cells: [usize; 2], place: impl Fn(f64, f64) -> Vec3) -> TriMesh {
    let [nu, nv] = cells;
    let points = (0..=nv).flat_map(|j| (0..=nu).map(move |i| (i, j)));
    let points = points
        .map(|(i, j)| place(i as f64 / nu as f64, j as f64 / nv as f64))
        .collect();
    let corner = |i: usize, j: usize| (j * (nu + 1) + i) as u32;
    let triangles = (0..nv)
        .flat_map(|j| (0..nu).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [
                corner(i, j),
                corner(i + 1, j),
                corner(i + 1, j + 1),
                corner(i, j + 1),
            ];
            if (i + j) % 2 == 0 {
                [[a, b, d], [b, c, d]]
            } else {
                [[a, b, c], [a, c, d]]
            }
        });
    TriMesh {
        points,
        triangles: triangles.collect(),
    }
}

/// Holds the degrees of freedom named in `dofs` (`xyz` displacements, `XYZ` rotations) at the points selected
/// by `at`.
fn hold(mesh: &TriMesh, dofs: &str, at: impl Fn(Vec3) -> bool) -> Vec<Support> {
    let is_held = ['x', 'y', 'z', 'X', 'Y', 'Z'].map(|dof| dofs.contains(dof));
    let points = (0..).zip(&mesh.points).filter(|(_, p)| at(**p));
    points.map(|(point, _)| Support { point, is_held }).collect()
}

fn is_zero(x: f64) -> bool {
    x.abs() < 1e-9
}

fn material(youngs_modulus_mpa: f64, poissons_ratio: f64) -> Material {
    Material {
        youngs_modulus_mpa,
        poissons_ratio,
        ..Material::SLA_RESIN
    }
}

/// Displacements of `mesh` under `forces`.
fn solve(
    mesh: &TriMesh,
    m: Material,
    thickness: f64,
    supports: &[Support],
    forces_n: Vec<Vec3>,
) -> Vec<Vec3> {
    let model = ShellModel::new(mesh, &m).unwrap();
    let solver = model.at_thickness_with(thickness, supports).unwrap();
    let case = LoadCase {
        forces_n,
        ..LoadCase::default()
    };
    solver.solve(&[case]).unwrap().swap_remove(0).moves_mm
}

fn nearest(mesh: &TriMesh, p: Vec3) -> usize {
    (0..mesh.points.len())
        .min_by(|&i, &j| mesh.points[i].distance(p).total_cmp(&mesh.points[j].distance(p)))
        .unwrap()
}

fn point_load(mesh: &TriMesh, at: Vec3, force: Vec3) -> Vec<Vec3> {
    let mut forces = vec![Vec3::ZERO; mesh.points.len()];
    forces[nearest(mesh, at)] = force;
    forces
}

fn roof(n: usize) -> f64 {
    let mesh = grid([n, n], |u, v| {
        let angle = (40.0 * v).to_radians();
        Vec3::new(25.0 * u, 25.0 * angle.sin(), 25.0 * angle.cos())
    });
    let supports = [
        hold(&mesh, "yz", |p| is_zero(p.x)),
        hold(&mesh, "xYZ", |p| is_zero(p.x - 25.0)),
        hold(&mesh, "yXZ", |p| is_zero(p.y)),
    ]
    .concat();
    let m = material(4.32e8, 0.0);
    let areas = ShellModel::new(&mesh, &m).unwrap();
    let forces = areas.areas_mm2().iter().map(|a| Vec3::Z * (-90.0 * a)).collect();
    let free_edge = nearest(&mesh, Vec3::new(25.0, 25.0, 0.0));
    -solve(&mesh, m, 0.25, &supports, forces)[free_edge].z / 0.3024
}

fn cylinder(n: usize) -> f64 {
    let mesh = grid([n, n], |u, v| {
        let angle = FRAC_PI_2 * v;
        Vec3::new(300.0 * u, 300.0 * angle.sin(), 300.0 * angle.cos())
    });
    let supports = [
        hold(&mesh, "yz", |p| is_zero(p.x)),
        hold(&mesh, "xYZ", |p| is_zero(p.x - 300.0)),
        hold(&mesh, "yXZ", |p| is_zero(p.y)),
        hold(&mesh, "zXY", |p| is_zero(p.z)),
    ]
    .concat();
    let top = Vec3::new(300.0, 0.0, 300.0);
    let moves = solve(
        &mesh,
        material(3e6, 0.3),
        3.0,
        &supports,
        point_load(&mesh, top, Vec3::Z * -0.25),
    );
    -moves[nearest(&mesh, top)].z / 1.8248e-5
}

fn hemisphere(n: usize) -> f64 {
    let mesh = grid([n, n], |u, v| {
        let (around, up) = (FRAC_PI_2 * u, (72.0 * v).to_radians());
        10.0 * Vec3::new(up.cos() * around.cos(), up.cos() * around.sin(), up.sin())
    });
    let (a, b) = (Vec3::X * 10.0, Vec3::Y * 10.0);
    let supports = [
        hold(&mesh, "yXZ", |p| is_zero(p.y)),
        hold(&mesh, "xYZ", |p| is_zero(p.x)),
        hold(&mesh, "z", |p| is_zero(p.distance(a))),
    ]
    .concat();
    let mut forces = point_load(&mesh, a, Vec3::X);
    forces[nearest(&mesh, b)] = -Vec3::Y;
    solve(&mesh, material(6.825e7, 0.3), 0.04, &supports, forces)[nearest(&mesh, a)].x / 0.0940
}

/// Deflections under loads along the tip's width and across it.
fn twisted_beam(n: usize) -> [f64; 2] {
    let mesh = grid([3 * n / 2, n / 4], |u, v| {
        let angle = FRAC_PI_2 * u;
        Vec3::new(
            12.0 * u,
            1.1 * (v - 0.5) * angle.cos(),
            1.1 * (v - 0.5) * angle.sin(),
        )
    });
    let supports = hold(&mesh, "xyzXYZ", |p| is_zero(p.x));
    let tip = nearest(&mesh, Vec3::X * 12.0);
    [(Vec3::Z, 0.005_424), (Vec3::Y, 0.001_754)].map(|(direction, reference)| {
        let mut forces = vec![Vec3::ZERO; mesh.points.len()];
        let at_tip: Vec<usize> = (0..mesh.points.len())
            .filter(|&v| is_zero(mesh.points[v].x - 12.0))
            .collect();
        for &v in &at_tip {
            let is_corner = is_zero(mesh.points[v].z.abs() - 0.55);
            forces[v] = direction * (if is_corner { 0.5 } else { 1.0 } / (at_tip.len() - 1) as f64);
        }
        solve(&mesh, material(29e6, 0.22), 0.32, &supports, forces)[tip].dot(direction) / reference
    })
}

/// Quarter of a clamped square plate, 100 mm by 100 mm by 1 mm, under pressure: deflection and stress in the
/// middle [Timoshenko and Woinowsky-Krieger, table 35, with more digits].
fn clamped_plate(n: usize) -> [f64; 2] {
    const PRESSURE: f64 = 1e-3;
    let mesh = grid([n, n], |u, v| Vec3::new(50.0 * u, 50.0 * v, 0.0));
    let supports = [
        hold(&mesh, "xyzXYZ", |p| is_zero(p.x) || is_zero(p.y)),
        hold(&mesh, "xYZ", |p| is_zero(p.x - 50.0)),
        hold(&mesh, "yXZ", |p| is_zero(p.y - 50.0)),
    ]
    .concat();
    let model = ShellModel::new(&mesh, &material(2000.0, 0.3)).unwrap();
    let forces_n = model
        .areas_mm2()
        .iter()
        .map(|a| Vec3::Z * (PRESSURE * a))
        .collect();
    let solver = model.at_thickness_with(1.0, &supports).unwrap();
    let u = solver
        .solve(&[LoadCase {
            forces_n,
            ..LoadCase::default()
        }])
        .unwrap()
        .remove(0);
    let middle = nearest(&mesh, Vec3::new(50.0, 50.0, 0.0));
    let around: Vec<f64> = (solver.stresses(&u).iter().zip(&mesh.triangles))
        .filter(|(_, corners)| corners.contains(&(middle as u32)))
        .map(|(s, _)| s.von_mises_mpa())
        .collect();
    let flexural_rigidity = 2000.0 / (12.0 * (1.0 - 0.09));
    let deflection = 0.001_265_32 * PRESSURE * 1e8 / flexural_rigidity;
    let stress = 6.0 * 0.022_905 * PRESSURE * 1e4;
    [
        u.moves_mm[middle].z / deflection,
        around.iter().sum::<f64>() / around.len() as f64 / stress,
    ]
}

/// Name, and ratio to the reference for n elements a quarter edge.
type Benchmark = (&'static str, fn(usize) -> f64);

const BENCHMARKS: [Benchmark; 7] = [
    ("Scordelis-Lo roof", roof),
    ("pinched cylinder", cylinder),
    ("hemisphere with a hole", hemisphere),
    ("twisted beam, in the plane", |n| twisted_beam(n)[0]),
    ("twisted beam, out of the plane", |n| twisted_beam(n)[1]),
    ("clamped plate, deflection", |n| clamped_plate(n)[0]),
    ("clamped plate, stress", |n| clamped_plate(n)[1]),
];

#[test]
fn sixteen_elements_a_quarter_edge_are_within_2_percent_of_the_references() {
    println!("| problem | n = 8 | n = 16 | n = 32 |\n| --- | --- | --- | --- |");
    for (name, ratio) in BENCHMARKS {
        let [coarse, middle, fine] = [8, 16, 32].map(ratio);
        println!("| {name} | {coarse:.3} | {middle:.3} | {fine:.3} |");
        assert!((middle - 1.0).abs() < 0.02, "{name}: {middle}");
        assert!((fine - 1.0).abs() < 0.011, "{name}: {fine}");
    }
}

#[test]
fn a_coarse_hemisphere_bends_without_stretching() {
    assert!(hemisphere(8) > 0.9, "{}", hemisphere(8));
}
