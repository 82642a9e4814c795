//! Picture of a model with many faults, before and after repair.

use std::path::PathBuf;

use shellock::figure::{self, Figure};
use shellock_geom::repair::{RepairMode, Repaired, repair};
use shellock_geom::{TriMesh, Vec3};
use shellock_render::stills::{Camera, Painted, render};
use shellock_testkit::shapes;

use super::draw::{PALE, RED, dots, plain};
use super::sheet::{Sheet, WIDTH, pixels};
use crate::failure::Failure;

const SIZE_MM: f64 = 100.0;
const CELL_MM: f64 = 1.8;
/// Interval at which a triangle is left out.
const MISSING: usize = 331;
/// Half the length of a speck, mm: as a body it is shorter than a hundredth of the model.
const SPECK_MM: f64 = 0.4;
const HAT: [u8; 3] = [110, 150, 205];
const SPECK: [u8; 3] = [30, 130, 70];

/// The figure with its faults, marked by colours.
struct Broken {
    mesh: TriMesh,
    colors: Vec<[u8; 3]>,
    n_missing: usize,
    n_turned: usize,
    n_specks: usize,
}

/// Shows the figure before and after repair, from outside and cut open, and lists the repairs.
pub fn before_and_after() -> Result<Vec<u8>, Failure> {
    let broken = broken();
    let fault = |problem: String| Failure::Model {
        path: PathBuf::from("broken cat"),
        problem,
    };
    let Repaired { solid, repairs, .. } =
        repair(&broken.mesh, RepairMode::Repair).map_err(|e| fault(e.to_string()))?;
    let repaired = solid.into_mesh();
    let all = vec![PALE; repaired.triangles.len()];
    const VIEW: [f64; 2] = [WIDTH / 4.0, 270.0];
    let top = 30.0;
    let said: Vec<String> = repairs.iter().flat_map(|r| lines(&format!("– {r}"))).collect();
    let height = top + VIEW[1] + 20.0 * said.len() as f64 + 70.0;
    let mut sheet = Sheet::new(height);
    let middle = repaired.bounds().center();
    for (i, (mesh, colors)) in [(&broken.mesh, &broken.colors), (&repaired, &all)]
        .into_iter()
        .enumerate()
    {
        let is_behind = |f: usize| mesh.face_center(f).x > middle.x;
        let seen = |keep: &dyn Fn(usize) -> bool, camera: Camera| {
            let kept: Vec<usize> = (0..mesh.triangles.len()).filter(|&f| keep(f)).collect();
            let half = TriMesh {
                points: mesh.points.clone(),
                triangles: kept.iter().map(|&f| mesh.triangles[f]).collect(),
            };
            let colors: Vec<[u8; 3]> = kept.iter().map(|&f| colors[f]).collect();
            let scene = [Painted {
                face_colors: Some(&colors),
                ..plain(&half, PALE)
            }];
            let frame = Some(repaired.bounds().grown(3.0));
            render(
                &scene,
                &Camera { frame, ..camera },
                pixels(VIEW[0]),
                pixels(VIEW[1]),
            )
        };
        let left = 2.0 * VIEW[0] * i as f64;
        sheet.still([left, top], seen(&|_| true, Camera::front()));
        let from_side = Camera::along(Vec3::new(1.0, 0.25, -0.2), Vec3::Z);
        sheet.still([left + VIEW[0], top], seen(&is_behind, from_side));
        let title = ["as read", "repaired"][i];
        sheet.amid([left + 0.5 * VIEW[0], 20.0], title);
        sheet.amid([left + 1.5 * VIEW[0], 20.0], &format!("{title}, cut open"));
    }
    let made = format!(
        "Made with: {} triangles left out, {} turned (red), {} specks (dots), a ball pushed into the head \
         (blue).",
        broken.n_missing, broken.n_turned, broken.n_specks
    );
    sheet.words([24.0, top + VIEW[1] + 26.0], &made);
    sheet.words([24.0, top + VIEW[1] + 50.0], "What mending says:");
    for (i, line) in said.iter().enumerate() {
        sheet.words([36.0, top + VIEW[1] + 70.0 + 20.0 * i as f64], line);
    }
    Ok(sheet.bytes())
}

/// Breaks a text into lines that fit the sheet.
fn lines(words: &str) -> Vec<String> {
    const MOST: usize = 96;
    let mut lines: Vec<String> = Vec::new();
    for word in words.replace('-', "\u{2212}").split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() < MOST => *line += &format!(" {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn broken() -> Broken {
    let cat = figure::make(Figure::Cat, SIZE_MM, CELL_MM).into_mesh();
    let bounds = cat.bounds();
    let size = bounds.size();
    let turned_at = bounds.min + Vec3::new(0.5, 0.1, 0.3) * size;
    let is_turned = |f: usize| cat.face_center(f).distance(turned_at) < 0.2 * SIZE_MM;
    let is_missing = |f: usize| f.is_multiple_of(MISSING);
    let mut mesh = TriMesh {
        points: cat.points.clone(),
        triangles: Vec::new(),
    };
    let mut colors = Vec::new();
    let (mut n_missing, mut n_turned) = (0, 0);
    let mut is_at_hole = vec![false; cat.points.len()];
    for (f, &[a, b, c]) in cat.triangles.iter().enumerate() {
        if is_missing(f) && [a, b, c].iter().all(|v| !is_at_hole[*v as usize]) {
            // Holes that share a point are one hole with more than three edges.
            [a, b, c].iter().for_each(|v| is_at_hole[*v as usize] = true);
            n_missing += 1;
            continue;
        }
        let turned = is_turned(f);
        n_turned += usize::from(turned);
        mesh.triangles.push(if turned { [a, c, b] } else { [a, b, c] });
        colors.push(if turned { RED } else { PALE });
    }
    let top = cat
        .points
        .iter()
        .filter(|p| p.x.abs() < 0.03 * SIZE_MM)
        .fold(bounds.min, |top, &p| if p.z > top.z { p } else { top });
    let mut ball = shapes::sphere(4, Vec3::splat(0.13 * SIZE_MM));
    ball.points
        .iter_mut()
        .for_each(|p| *p += top - 0.03 * SIZE_MM * Vec3::Z);
    let specks: Vec<Vec3> = (0..40)
        .map(|i| {
            let (sin, cos) = (2.4 * f64::from(i)).sin_cos();
            let out = Vec3::new(0.6 * sin * size.x, 0.6 * cos * size.y, 0.0);
            bounds.center().with_z(bounds.min.z) + out + Vec3::Z * size.z * f64::from(i) / 40.0
        })
        .collect();
    let n_specks = specks.len();
    for (other, color) in [(ball, HAT), (dots(specks, SPECK_MM), SPECK)] {
        let first = mesh.points.len() as u32;
        mesh.points.extend(other.points);
        colors.extend(vec![color; other.triangles.len()]);
        mesh.triangles
            .extend(other.triangles.iter().map(|t| t.map(|v| first + v)));
    }
    Broken {
        mesh,
        colors,
        n_missing,
        n_turned,
        n_specks,
    }
}
