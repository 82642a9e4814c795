//! Generated STL, OBJ, PLY and OFF files, and surfaces that need a decision of their owner.

use std::fmt::Write as _;

use shellock_formats::{write_ply, write_stl_binary};
use shellock_geom::{TriMesh, Vec3, Volume};
use shellock_testkit::shapes;

use super::{Case, Claim, body, scale, shift};
use Claim::{Labels, Note, Refused, Size, Warning};

const WHOLE: Claim = Size([60.0, 40.0, 30.0]);

fn color(p: Vec3) -> [u8; 3] {
    if p.x > 0.0 { [255, 0, 0] } else { [0, 0, 255] }
}

fn coloured_ply() -> Vec<u8> {
    let mesh = body();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float \
         z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\nproperty list \
         uchar int vertex_indices\nend_header\n",
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

/// Writes an OBJ text; `more` gives further numbers after the coordinates of a point.
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

/// Writes the body as an OBJ text with two materials, left and right.
fn two_materials(left: &str, right: &str) -> String {
    let mesh = body();
    let mut text = String::new();
    for p in &mesh.points {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).expect("memory takes all");
    }
    for (name, is_left) in [(left, true), (right, false)] {
        writeln!(text, "usemtl {name}").expect("memory takes all");
        let own = (0..mesh.triangles.len()).filter(|&f| (mesh.face_center(f).x < 0.0) == is_left);
        for [a, b, c] in own.map(|f| mesh.triangles[f]) {
            writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).expect("memory takes all");
        }
    }
    text
}

/// Prism of 30 × 30 × 20 mm whose ends are polygons in the shape of a U.
fn notch() -> String {
    let u = [
        [0, 0],
        [30, 0],
        [30, 30],
        [20, 30],
        [20, 10],
        [10, 10],
        [10, 30],
        [0, 30],
    ];
    let mut text = String::new();
    for z in [0, 20] {
        for [x, y] in u {
            writeln!(text, "v {x} {y} {z}").expect("memory takes all");
        }
    }
    text += "f 8 7 6 5 4 3 2 1\nf 9 10 11 12 13 14 15 16\n";
    for i in 0..8 {
        let j = (i + 1) % 8;
        writeln!(text, "f {} {} {} {}", i + 1, j + 1, j + 9, i + 9).expect("memory takes all");
    }
    text
}

fn point_coloured_off() -> String {
    let mesh = body();
    let mut text = format!("COFF\n{} {} 0\n", mesh.points.len(), mesh.triangles.len());
    for p in &mesh.points {
        let [r, g, b] = color(*p);
        writeln!(text, "{} {} {} {r} {g} {b} 255", p.x, p.y, p.z).expect("memory takes all");
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "3 {a} {b} {c}").expect("memory takes all");
    }
    text
}

/// Two bodies beside each other, "left" and "right".
fn left_and_right() -> String {
    let n = body().points.len();
    let later = |corners: &str| {
        let corners = corners
            .split(' ')
            .map(|v| v.parse::<usize>().expect("a number") + n);
        corners.map(|v| v.to_string()).collect::<Vec<_>>().join(" ")
    };
    let right = obj(&shift(&body(), Vec3::X * 90.0), |_| String::new());
    let right: String = right
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => format!("f {}\n", later(corners)),
            None => format!("{line}\n"),
        })
        .collect();
    format!("o left\n{}o right\n{right}", obj(&body(), |_| String::new()))
}

/// The body with a stray point and one label a side.
fn labelled_ply() -> Vec<u8> {
    let mut labelled = body();
    labelled.points.push(Vec3::splat(9000.0));
    let labels: Vec<i32> = (0..labelled.triangles.len())
        .map(|f| i32::from(labelled.face_center(f).x > 0.0))
        .collect();
    write_ply(&labelled, Some(&labels))
}

fn of_obj() -> Vec<Case> {
    let as_floats = |p: Vec3| {
        let [r, g, b] = color(p).map(|c| f64::from(c) / 255.0);
        format!(" {r} {g} {b}")
    };
    let plain = obj(&body(), |_| String::new());
    let two = left_and_right();
    vec![
        Case::new("colours.obj", obj(&body(), as_floats).into_bytes())
            .says(&[WHOLE, Labels("colors")])
            .proves("OBJ", "read", "colours of points"),
        Case::new("left_or_right.obj", two.clone().into_bytes()).says(&[Refused("\"left\", \"right\"")]),
        Case::new("right.obj", two.into_bytes())
            .with(&["--object", "right"])
            .says(&[WHOLE])
            .proves("OBJ", "read", "one object of several"),
        Case::new("stray_point.obj", (plain.clone() + "v 3000 0 0\n").into_bytes())
            .says(&[WHOLE])
            .proves("OBJ", "left out", "points that no face uses"),
        Case::new(
            "unknown_statement.obj",
            (plain + "surf 0 1 0 1 1 2 3 4\n").into_bytes(),
        )
        .says(&[WHOLE, Note("\"surf\"")])
        .proves("OBJ", "left out", "statements that are not known"),
        Case::new(
            "number_sign.obj",
            two_materials("paint #1", "paint #2").into_bytes(),
        )
        .says(&[WHOLE, Labels("materials")])
        .proves("OBJ", "read", "names with any characters"),
        Case::new("notch.obj", notch().into_bytes())
            .says(&[Size([30.0, 30.0, 20.0])])
            .proves("all", "read", "polygons with notches"),
    ]
}

fn of_stl() -> Vec<Case> {
    let binary = write_stl_binary(&body());
    let beside = write_stl_binary(&shift(&body(), Vec3::X * 90.0));
    let text = b"solid x\n facet normal 0 0 0\n".repeat(3);
    vec![
        Case::new("one_after_the_other.stl", [binary.clone(), beside].concat())
            .says(&[Note("2 STL files"), Refused("2 separate bodies")])
            .proves("STL", "read", "several binary files one after the other"),
        Case::new("text_after.stl", [binary.clone(), text].concat())
            .says(&[Refused("a text after the triangles")])
            .proves("STL", "refused", "text after the triangles of a binary file"),
        Case::new("plain.stl", binary)
            .says(&[WHOLE])
            .proves("STL", "read", "binary and text"),
    ]
}

fn of_ply_and_off() -> Vec<Case> {
    vec![
        Case::new("colours.ply", coloured_ply())
            .says(&[WHOLE, Labels("colors"), Note("--labels-from colors")])
            .proves("PLY", "read", "colours of points"),
        Case::new("labels.ply", labelled_ply())
            .says(&[WHOLE, Labels("labels")])
            .proves("PLY", "read", "labels of faces"),
        Case::new("colours_of_points.off", point_coloured_off().into_bytes())
            .says(&[WHOLE, Labels("colors")])
            .proves("OFF", "read", "colours of points"),
        Case::new("colours.off", off(&body()).into_bytes())
            .says(&[WHOLE, Labels("colors")])
            .proves("OFF", "read", "colours of faces"),
    ]
}

/// All cases of plain formats.
pub fn cases() -> Vec<Case> {
    [of_obj(), of_stl(), of_ply_and_off(), decisions()].concat()
}

fn stl(volume: &Volume) -> Vec<u8> {
    write_stl_binary(&volume.to_mesh())
}

/// Body with walls of 2.4 mm and round holes of 4 mm, bored along z from the given places outwards.
fn body_with_drains(holes: &[[f64; 3]]) -> Volume {
    let volume = |mesh: &TriMesh| Volume::from_closed_mesh(mesh).expect("it is closed");
    let outer = volume(&smooth(Vec3::new(30.0, 20.0, 15.0)));
    let inner = volume(&smooth(Vec3::new(27.6, 17.6, 12.6)));
    let ring = |[x, y, _]: [f64; 3], z: f64| {
        let point = |i: u32| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / 24.0).sin_cos();
            Vec3::new(x + 2.0 * c, y + 2.0 * s, z)
        };
        (0..24).map(point).collect::<Vec<Vec3>>()
    };
    holes.iter().fold(outer.subtract(&inner), |body, &hole| {
        let [low, high] = if hole[2] < 0.0 { [-40.0, 0.0] } else { [0.0, 40.0] };
        body.subtract(&Volume::loft(&[ring(hole, low), ring(hole, high)]))
    })
}

/// Ellipsoid of 2048 triangles with these half axes.
fn smooth(half_axes: Vec3) -> TriMesh {
    scale(&shapes::ball(4, Vec3::ZERO, 1.0), half_axes)
}

/// Box with a slit of this width, mm, across it.
fn slit(width: f64) -> Volume {
    let block = shapes::cuboid([0.0; 3], [60.0, 40.0, 30.0]);
    block.subtract(&shapes::cuboid([12.0, -1.0, 8.0], [12.0 + width, 41.0, 31.0]))
}

/// Box with a wall inside that divides it in two.
fn with_wall(wall_mm: f64) -> TriMesh {
    let mut mesh = shapes::cuboid([0.0; 3], [60.0, 40.0, 30.0]).to_mesh();
    let first = mesh.points.len() as u32;
    // The wall is a sheet across the whole box that touches it all around.
    let corners = [[0.0, 0.0], [40.0, 0.0], [40.0, 30.0], [0.0, 30.0]];
    mesh.points.extend(corners.map(|[y, z]| Vec3::new(wall_mm, y, z)));
    mesh.triangles
        .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    mesh
}

/// The body, with a smaller body that is inside out and sticks out of it.
fn inside_out() -> Vec<u8> {
    let mut mesh = body();
    let mut tool = scale(&shift(&body(), Vec3::X * 90.0), Vec3::splat(1.0 / 3.0));
    tool.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let n = mesh.points.len() as u32;
    mesh.points.extend(tool.points);
    mesh.triangles
        .extend(tool.triangles.iter().map(|t| t.map(|v| v + n)));
    write_ply(&mesh, None)
}

/// Cases of surfaces that need a decision of their owner.
fn decisions() -> Vec<Case> {
    let one = [[0.0, 0.0, -15.0]];
    let two = [[0.0, 0.0, -15.0], [10.0, 0.0, 15.0]];
    vec![
        Case::new("drained.stl", stl(&body_with_drains(&one)))
            .says(&[Refused("already hollow: its wall is 2.4 mm thick")])
            .proves("all", "refused", "models that are hollow already"),
        Case::new("drained_twice.stl", stl(&body_with_drains(&two))).says(&[Refused("2 openings near")]),
        Case::new("drained_filled.stl", stl(&body_with_drains(&two)))
            .with(&["--fill"])
            .says(&[WHOLE, Note("2 openings were closed")])
            .proves("all", "read", "models that are hollow already, with `--fill`"),
        Case::new("slit.stl", stl(&slit(0.05))).says(&[WHOLE, Warning("1 slit in the surface")]),
        Case::new("slit_wider.stl", stl(&slit(0.1))).says(&[WHOLE, Warning("0.10 mm wide near")]),
        Case::new("wall.stl", write_stl_binary(&with_wall(20.0)))
            .says(&[WHOLE, Note("repaired: ")])
            .proves("all", "left out", "walls inside a body"),
        Case::new("wall_elsewhere.ply", write_ply(&with_wall(45.0), None)).says(&[WHOLE, Note("repaired: ")]),
        Case::new("inside_out.ply", inside_out())
            .says(&[Refused("--inside-out cut")])
            .proves("all", "refused", "bodies inside out that overlap others"),
        Case::new("inside_out_cut.ply", inside_out())
            .with(&["--inside-out", "cut"])
            .says(&[Size([58.22, 40.0, 30.0])])
            .proves(
                "all",
                "read",
                "holes and parts that are inside out, with `--inside-out`",
            ),
        Case::new("inside_out_united.ply", inside_out())
            .with(&["--inside-out", "unite"])
            .says(&[Size([70.0, 40.0, 30.0])]),
    ]
}
