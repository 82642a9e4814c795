//! STL, OBJ, PLY and OFF, and surfaces that need a decision, made by code.

use std::fmt::Write as _;

use shellock_formats::{write_ply, write_stl_binary};
use shellock_geom::{TriMesh, Vec3, Volume};
use shellock_testkit::shapes;

use super::{Case, Claim, body, moved, scaled};
use Claim::{Labels, Note, Refused, Size};

const WHOLE: Claim = Size([60.0, 40.0, 30.0]);

fn color(p: Vec3) -> [u8; 3] {
    if p.x > 0.0 { [255, 0, 0] } else { [0, 0, 255] }
}

fn coloured_ply() -> Vec<u8> {
    let mesh = body();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
         property uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.points.len(),
        mesh.triangles.len()
    );
    for p in &mesh.points {
        let [r, g, b] = color(*p);
        writeln!(text, "{} {} {} {r} {g} {b}", p.x, p.y, p.z).expect("memory takes all");
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "3 {a} {b} {c}").expect("memory takes all");
    }
    text.into_bytes()
}

/// An OBJ; `more` are numbers after the coordinates of a point.
fn obj(mesh: &TriMesh, more: impl Fn(Vec3) -> String) -> String {
    let mut text = String::new();
    for p in &mesh.points {
        writeln!(text, "v {} {} {}{}", p.x, p.y, p.z, more(*p)).expect("memory takes all");
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).expect("memory takes all");
    }
    text
}

fn off(mesh: &TriMesh) -> String {
    let mut text = format!("OFF\n{} {} 0\n", mesh.points.len(), mesh.triangles.len());
    for p in &mesh.points {
        writeln!(text, "{} {} {}", p.x, p.y, p.z).expect("memory takes all");
    }
    for (face, [a, b, c]) in mesh.triangles.iter().enumerate() {
        let red = if mesh.face_center(face).x > 0.0 { 255 } else { 0 };
        writeln!(text, "3 {a} {b} {c} {red} 0 0").expect("memory takes all");
    }
    text
}

/// All cases of plain formats.
pub fn cases() -> Vec<Case> {
    let as_floats = |p: Vec3| {
        let [r, g, b] = color(p).map(|c| f64::from(c) / 255.0);
        format!(" {r} {g} {b}")
    };
    let two = format!("o left\n{}", obj(&body(), |_| String::new()));
    let right = obj(&moved(&body(), Vec3::X * 90.0), |_| String::new());
    let n = body().points.len();
    let right: String = right
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => {
                let later = corners
                    .split(' ')
                    .map(|v| v.parse::<usize>().expect("a number") + n);
                format!(
                    "f {}\n",
                    later.map(|v| v.to_string()).collect::<Vec<_>>().join(" ")
                )
            }
            None => format!("{line}\n"),
        })
        .collect();
    let two = format!("{two}o right\n{right}");
    let stray = obj(&body(), |_| String::new()) + "v 3000 0 0\n";
    let mut labelled = body();
    labelled.points.push(Vec3::splat(9000.0));
    let labels: Vec<i32> = (0..labelled.triangles.len())
        .map(|f| i32::from(labelled.face_center(f).x > 0.0))
        .collect();
    vec![
        Case::new("colours.ply", coloured_ply())
            .says(&[WHOLE, Labels("colors"), Note("--labels-from colors")])
            .proves("PLY", "read", "colours of points"),
        Case::new("labels.ply", write_ply(&labelled, Some(&labels)))
            .says(&[WHOLE, Labels("labels")])
            .proves("PLY", "read", "labels of faces"),
        Case::new("colours.obj", obj(&body(), as_floats).into_bytes())
            .says(&[WHOLE, Labels("colors")])
            .proves("OBJ", "read", "colours of points"),
        Case::new("left_or_right.obj", two.clone().into_bytes()).says(&[Refused("\"left\", \"right\"")]),
        Case::new("right.obj", two.into_bytes())
            .with(&["--object", "right"])
            .says(&[WHOLE])
            .proves("OBJ", "read", "one object of several"),
        Case::new("stray_point.obj", stray.into_bytes())
            .says(&[WHOLE])
            .proves("OBJ", "left out", "points that no face uses"),
        Case::new("colours.off", off(&body()).into_bytes())
            .says(&[WHOLE, Labels("colors")])
            .proves("OFF", "read", "colours of faces"),
        Case::new("plain.stl", write_stl_binary(&body()))
            .says(&[WHOLE])
            .proves("STL", "read", "binary and text"),
    ]
    .into_iter()
    .chain(decisions())
    .collect()
}

fn stl(volume: &Volume) -> Vec<u8> {
    write_stl_binary(&volume.to_mesh())
}

fn volume(mesh: &TriMesh) -> Volume {
    Volume::from_closed_mesh(mesh).expect("it is closed")
}

/// Surfaces whose shape needs a decision of their owner.
fn decisions() -> Vec<Case> {
    let _ = (scaled, shapes::cuboid([0.0; 3], [1.0; 3]));
    Vec::new()
}
