//! Free-form shell, held at its top and pushed at its bottom: writes the mesh, the case and our solution as
//! JSON.
//!
//! `cargo run --release -p shellock-mechanics --example shell_free_form -- MODEL SIZE_MM EDGE_MM WALL_MM >
//! case.json`
//!
//! MODEL is a mesh file, scaled to SIZE_MM along its longest side and remeshed to EDGE_MM.
//! `scripts/shell_kratos.py case.json` solves the same case with Kratos and compares.

use std::fmt::{Debug, Write as _};
use std::io::Write as _;

use shellock_formats as io;
use shellock_geom::remesh::{RemeshParams, remesh};
use shellock_geom::{TriMesh, Vec3};
use shellock_mechanics::{Displacements, LoadCase, Material, ShellModel, ShellSolver, Support};

type Any<T> = Result<T, Box<dyn std::error::Error>>;

/// Height of the held and of the pushed region, as a share of the whole.
const REGION: f64 = 0.1;
/// Pushing force along each axis, N.
const PUSH: Vec3 = Vec3::new(30.0, 20.0, 100.0);

fn main() -> Any<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [file, size, edge, wall] = &args[..] else {
        return Err("MODEL SIZE_MM EDGE_MM WALL_MM".into());
    };
    let (mesh, wall_mm) = (model(file, size.parse()?, edge.parse()?)?, wall.parse()?);
    let material = Material::SLA_RESIN;
    let shell = ShellModel::new(&mesh, &material)?;
    let bounds = mesh.bounds();
    let height = |p: &Vec3| (p.y - bounds.min.y) / bounds.size().y;
    let held: Vec<usize> = (0..mesh.points.len())
        .filter(|&v| height(&mesh.points[v]) > 1.0 - REGION)
        .collect();
    let mut forces_n: Vec<Vec3> = (mesh.points.iter().zip(shell.areas_mm2()))
        .map(|(p, area)| {
            if height(p) < REGION {
                PUSH * *area
            } else {
                Vec3::ZERO
            }
        })
        .collect();
    let scale = PUSH.length() / forces_n.iter().sum::<Vec3>().length();
    forces_n.iter_mut().for_each(|f| *f *= scale);

    let supports: Vec<Support> = held
        .iter()
        .map(|&v| Support {
            point: v as u32,
            is_held: [true; 6],
        })
        .collect();
    let solver = shell.at_thickness_with(wall_mm, &supports)?;
    let case = LoadCase {
        forces_n,
        ..LoadCase::default()
    };
    let displacements = solver.solve(std::slice::from_ref(&case))?.swap_remove(0);
    let von_mises = |solver: &ShellSolver<'_>, u: &Displacements| -> Vec<f64> {
        solver.stresses(u).iter().map(|s| s.von_mises_mpa()).collect()
    };
    let clamped_mpa = von_mises(&solver, &displacements);

    let solver = shell.at_thickness(wall_mm)?;
    let in_the_mean = LoadCase {
        anchors: held.iter().map(|&v| v as u32).collect(),
        ..case.clone()
    };
    let in_the_mean_mpa = von_mises(&solver, &solver.solve(&[in_the_mean])?[0]);

    let mut json = format!(
        "{{\"youngs_modulus_mpa\": {:?}, \"poissons_ratio\": {:?}, \"wall_mm\": {wall_mm:?},",
        material.youngs_modulus_mpa, material.poissons_ratio
    );
    let triples = |vectors: &[Vec3]| vectors.iter().map(|v| v.to_array()).collect::<Vec<_>>();
    list(&mut json, "points", &triples(&mesh.points))?;
    list(&mut json, "triangles", &mesh.triangles)?;
    list(&mut json, "held", &held)?;
    list(&mut json, "forces_n", &triples(&case.forces_n))?;
    list(&mut json, "moves_mm", &triples(&displacements.moves_mm))?;
    list(&mut json, "von_mises_mpa", &clamped_mpa)?;
    list(&mut json, "held_in_the_mean_mpa", &in_the_mean_mpa)?;
    json.pop();
    writeln!(std::io::stdout(), "{json}}}")?;
    Ok(())
}

fn list(json: &mut String, name: &str, values: &[impl Debug]) -> std::fmt::Result {
    write!(json, "\"{name}\": {values:?},")
}

fn model(file: &str, size_mm: f64, edge_mm: f64) -> Any<TriMesh> {
    let extension = std::path::Path::new(file).extension().and_then(|e| e.to_str());
    let mut mesh = io::read_mesh(&std::fs::read(file)?, extension)?.mesh;
    let scale = size_mm / mesh.bounds().size().max_element();
    mesh.points.iter_mut().for_each(|p| *p *= scale);
    let labels = vec![0; mesh.triangles.len()];
    Ok(remesh(
        &RemeshParams {
            target_edge_mm: edge_mm,
            n_rounds: 6,
        },
        &mesh,
        &labels,
    )
    .mesh)
}
