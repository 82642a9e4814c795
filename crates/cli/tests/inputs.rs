//! Tests of typical input files, good and bad, all generated: the outcome of each, and the messages.

use std::fmt::Write as _;
use std::fs;
use std::io::{Cursor, Write as _};
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use shellock_formats::{write_ply, write_stl_binary};
use shellock_geom::{TriMesh, Vec3};
use shellock_testkit::shapes;

fn shellock(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_shellock"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

/// Ball of 512 triangles, 60 mm wide, around `center`.
fn ball(center: Vec3) -> TriMesh {
    shapes::ball(3, center, 30.0)
}

fn both(mut a: TriMesh, b: TriMesh) -> TriMesh {
    let n = a.points.len() as u32;
    a.points.extend(b.points);
    a.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + n)));
    a
}

/// Makes a ball and applies `change` to it.
fn ball_with(change: impl Fn(&mut TriMesh)) -> TriMesh {
    let mut mesh = ball(Vec3::ZERO);
    change(&mut mesh);
    mesh
}

fn scale(mesh: &TriMesh, factor: f64, by: Vec3) -> TriMesh {
    let mut mesh = mesh.clone();
    mesh.points.iter_mut().for_each(|p| *p = factor * *p + by);
    mesh
}

fn ply(mesh: &TriMesh) -> Vec<u8> {
    write_ply(mesh, None)
}

fn obj(mesh: &TriMesh) -> String {
    let mut text = String::new();
    mesh.points
        .iter()
        .for_each(|p| writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap());
    mesh.triangles
        .iter()
        .for_each(|[a, b, c]| writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap());
    text
}

fn ascii_stl(mesh: &TriMesh) -> String {
    let mut text = "solid ☠\n".to_owned();
    for face in 0..mesh.triangles.len() {
        text += "facet normal 0 0 0\nouter loop\n";
        mesh.corners(face)
            .iter()
            .for_each(|p| writeln!(text, "vertex {} {} {}", p.x, p.y, p.z).unwrap());
        text += "endloop\nendfacet\n";
    }
    text + "endsolid\n"
}

fn package(model: &str) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    archive
        .start_file("3D/3dmodel.model", zip::write::SimpleFileOptions::default())
        .unwrap();
    archive.write_all(model.as_bytes()).unwrap();
    archive.finish().unwrap().into_inner()
}

/// 3MF model with the ball as object 1, in inches.
fn three_mf(mesh: &TriMesh, more: &str, build: &str) -> String {
    let mut model = "<model unit=\"inch\"><resources><object id=\"1\"><mesh><vertices>".to_owned();
    let inch = 1.0 / 25.4;
    for p in &mesh.points {
        write!(
            model,
            "<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>",
            inch * p.x,
            inch * p.y,
            inch * p.z
        )
        .unwrap();
    }
    model += "</vertices><triangles>";
    mesh.triangles
        .iter()
        .for_each(|[a, b, c]| write!(model, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>").unwrap());
    model + "</triangles></mesh></object>" + more + "</resources><build>" + build + "</build></model>"
}

/// Expected outcome for a file.
enum Outcome {
    /// The file can be made as it is.
    Sound,
    /// The file can be made after these repairs.
    Repaired(&'static [&'static str]),
    /// The file is refused with these words.
    Refused(&'static [&'static str]),
}
use Outcome::{Refused, Repaired, Sound};

type Twin = (&'static str, Vec<u8>, Outcome);

/// Files that are broken or odd in their format.
fn odd_files() -> Vec<Twin> {
    let good = ball(Vec3::ZERO);
    let mut files = odd_stl_files(&good);
    files.extend(odd_text_files(&good));
    files.extend(odd_packages(&good));
    files
}

/// STL files, empty files among them, and files whose names promise another format.
fn odd_stl_files(good: &TriMesh) -> Vec<Twin> {
    let stl = write_stl_binary(good);
    let text = ascii_stl(good);
    let with = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = stl.clone();
        change(&mut bytes);
        bytes
    };
    vec![
        ("zero.stl", Vec::new(), Refused(&["empty"])),
        ("good.stl", stl.clone(), Sound),
        ("named.obj", stl.clone(), Sound),
        (
            "header_solid.stl",
            with(&|b| b[..6].copy_from_slice(b"solid ")),
            Sound,
        ),
        (
            "cut.stl",
            stl[..stl.len() / 2].to_vec(),
            Refused(&["promises 512 triangles", "cut off"]),
        ),
        (
            "nan.stl",
            with(&|b| b[96..100].copy_from_slice(&f32::NAN.to_le_bytes())),
            Refused(&["byte 96", "NaN"]),
        ),
        (
            "normals.stl",
            with(&|b| b[84..88].copy_from_slice(&9_f32.to_le_bytes())),
            Sound,
        ),
        (
            "upper.stl",
            text.to_uppercase().replace('\n', "\r\n").into_bytes(),
            Sound,
        ),
        ("no_extension", text.clone().into_bytes(), Sound),
        (
            "no_facet.stl",
            b"solid x\nendsolid x\n".to_vec(),
            Refused(&["no triangles"]),
        ),
    ]
}

/// Files in PLY, OBJ and OFF, in odd encodings, units and places.
fn odd_text_files(good: &TriMesh) -> Vec<Twin> {
    let utf16 = |text: &str| {
        text.encode_utf16()
            .flat_map(u16::to_be_bytes)
            .collect::<Vec<u8>>()
    };
    vec![
        (
            "points.ply",
            b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
              property float z\nend_header\n0 0 0\n"
                .to_vec(),
            Refused(&["no triangles"]),
        ),
        (
            "twice.ply",
            b"ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nelement vertex 9\n\
              end_header\n"
                .to_vec(),
            Refused(&["line 5"]),
        ),
        (
            "index.obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 12\n".to_vec(),
            Refused(&["line 4", "12"]),
        ),
        (
            "huge.off",
            b"OFF\n353535235358 6 0\n0 0 0\n".to_vec(),
            Refused(&["353535235358"]),
        ),
        ("utf16.obj", utf16(&obj(good)), Sound),
        (
            "far.obj",
            obj(&scale(good, 1.0, Vec3::splat(1e9))).into_bytes(),
            Sound,
        ),
        ("metres.ply", ply(&scale(good, 1e-3, Vec3::ZERO)), Sound),
    ]
}

/// Packages in 3MF and GLB with odd items, components and bytes.
fn odd_packages(good: &TriMesh) -> Vec<Twin> {
    let made_of = |more: &str, build: &str| package(&three_mf(good, more, build));
    vec![
        ("inch.3mf", made_of("", "<item objectid=\"1\"/>"), Sound),
        (
            "mirror.3mf",
            made_of(
                "",
                "<item objectid=\"1\" transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\"/>",
            ),
            Sound,
        ),
        (
            "missing.3mf",
            made_of("", "<item objectid=\"2\"/>"),
            Refused(&["object 2"]),
        ),
        (
            "attribute.3mf",
            made_of("", "<item objectid=\"1\" objectid=\"1\"/>"),
            Refused(&["duplicated"]),
        ),
        (
            "two.3mf",
            made_of(
                "",
                "<item objectid=\"1\"/><item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 9 0 0\"/>",
            ),
            Refused(&["2 separate bodies", "--largest"]),
        ),
        (
            "cycle.3mf",
            made_of(
                "<object id=\"2\"><components><component objectid=\"2\"/></components></object>",
                "<item objectid=\"2\"/>",
            ),
            Refused(&["contains itself"]),
        ),
        (
            "damaged.3mf",
            made_of("", "")
                .into_iter()
                .map(|b| if b == b'n' { b'm' } else { b })
                .collect(),
            Refused(&["damaged"]),
        ),
        (
            "garbage.glb",
            b"glTF\x02\0\0\0garbage".to_vec(),
            Refused(&["cut off"]),
        ),
    ]
}

/// The ball with corners of its own for each triangle.
fn loose_triangles() -> TriMesh {
    let good = ball(Vec3::ZERO);
    TriMesh {
        points: (0..good.triangles.len()).flat_map(|f| good.corners(f)).collect(),
        triangles: (0..good.triangles.len() as u32)
            .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
            .collect(),
    }
}

/// The unwelded ball with narrow cracks between its triangles.
fn narrow_cracks() -> TriMesh {
    let mut mesh = loose_triangles();
    for (i, p) in mesh.points.iter_mut().enumerate() {
        p.x += 1e-5 * (i % 7) as f64;
    }
    mesh
}

/// The ball with a triangle divided at an edge that its neighbour keeps.
fn split_edge() -> TriMesh {
    ball_with(|m| {
        let [a, b, c] = m.triangles[0];
        m.points.push(0.5 * (m.points[a as usize] + m.points[b as usize]));
        let middle = m.points.len() as u32 - 1;
        m.triangles[0] = [a, middle, c];
        m.triangles.push([middle, b, c]);
    })
}

/// Some triangles of the ball, without their neighbours.
fn soup() -> TriMesh {
    let mut mesh = loose_triangles();
    mesh.triangles = mesh.triangles.into_iter().step_by(9).collect();
    mesh
}

fn turn_inside_out(mut mesh: TriMesh) -> TriMesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    mesh
}

/// Files that are broken or odd in their surface.
fn odd_surfaces() -> Vec<Twin> {
    let good = ball(Vec3::ZERO);
    let inner = scale(&good, 0.3, Vec3::ONE);
    let speck = scale(&good, 0.001, Vec3::splat(29.0));
    vec![
        ("unwelded.ply", ply(&loose_triangles()), Sound),
        ("cracks.ply", ply(&narrow_cracks()), Repaired(&["points-merged"])),
        (
            "copies.ply",
            ply(&ball_with(|m| m.triangles.extend_from_within(..50))),
            Repaired(&["copies-removed"]),
        ),
        (
            "turned.ply",
            ply(&ball_with(|m| {
                m.triangles.iter_mut().step_by(3).for_each(|t| t.swap(0, 1))
            })),
            Repaired(&["triangles-turned"]),
        ),
        (
            "everted.ply",
            ply(&turn_inside_out(good.clone())),
            Repaired(&["body-turned"]),
        ),
        (
            "one_missing.ply",
            ply(&ball_with(|m| m.triangles.truncate(511))),
            Repaired(&["holes-closed"]),
        ),
        (
            "open.ply",
            ply(&ball_with(|m| m.triangles.truncate(300))),
            Refused(&["not closed", "1 hole", "near ("]),
        ),
        ("edge.ply", ply(&split_edge()), Repaired(&["edges-joined"])),
        (
            "cavity.ply",
            ply(&both(good.clone(), turn_inside_out(inner.clone()))),
            Repaired(&["cavities-filled"]),
        ),
        (
            "inner.ply",
            ply(&both(good.clone(), inner)),
            Repaired(&["cavities-filled"]),
        ),
        (
            "specks.ply",
            ply(&both(good.clone(), speck)),
            Repaired(&["specks-removed"]),
        ),
        (
            "overlap.ply",
            ply(&both(good.clone(), ball(Vec3::new(31.0, 7.0, 3.0)))),
            Repaired(&["parts-united"]),
        ),
        (
            "apart.ply",
            ply(&both(good.clone(), ball(Vec3::X * 90.0))),
            Refused(&["2 separate bodies", "--largest"]),
        ),
        ("soup.ply", ply(&soup()), Refused(&["are not connected"])),
        (
            "thin.ply",
            ply(&ball_with(|m| m.points.iter_mut().for_each(|p| p.z *= 0.02))),
            Sound,
        ),
    ]
}

#[test]
fn every_file_ends_in_a_body_or_in_words_that_help() {
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes, outcome) in odd_files().into_iter().chain(odd_surfaces()) {
        fs::write(dir.path().join(name), bytes).unwrap();
        let o = shellock(dir.path(), &["inspect", name, "--json"]);
        let (code, errors) = (o.status.code(), String::from_utf8_lossy(&o.stderr).into_owned());
        let told: Value = serde_json::from_slice(&o.stdout).unwrap_or_default();
        let strict = shellock(dir.path(), &["inspect", name, "--no-repair"])
            .status
            .code();
        match outcome {
            Sound => assert_eq!(
                (code, &told["repairs"], strict),
                (Some(0), &Value::Array(vec![]), Some(0)),
                "{name}: {errors}"
            ),
            Repaired(codes) => {
                let done: Vec<&str> = told["repairs"]
                    .as_array()
                    .unwrap()
                    .iter()
                    .filter_map(|r| r["kind"].as_str())
                    .collect();
                assert_eq!(
                    (code, done, strict),
                    (Some(0), codes.to_vec(), Some(2)),
                    "{name}: {errors}"
                );
            }
            Refused(words) => {
                assert_eq!((code, strict), (Some(2), Some(2)), "{name}: {errors}");
                let why = told["error"].as_str().unwrap_or_default();
                words
                    .iter()
                    .for_each(|word| assert!(why.contains(word), "{name}: no \"{word}\" in {why}"));
            }
        }
    }
}

#[test]
fn sizes_follow_units_and_thin_models_are_warned_of() {
    let dir = tempfile::tempdir().unwrap();
    let said = |name: &str, bytes: Vec<u8>, options: &[&str]| {
        fs::write(dir.path().join(name), bytes).unwrap();
        let o = shellock(dir.path(), &[&["inspect", name], options].concat());
        String::from_utf8_lossy(&o.stdout).into_owned()
    };
    let good = ball(Vec3::ZERO);
    assert!(
        said(
            "i.3mf",
            package(&three_mf(&good, "", "<item objectid=\"1\"/>")),
            &[]
        )
        .contains("60.0 × 60.0 × 60.0 mm")
    );
    let metres = ply(&scale(&good, 1e-3, Vec3::ZERO));
    assert!(said("m.ply", metres.clone(), &[]).contains("60 mm if the unit is m "));
    assert!(said("m.ply", metres, &["--unit", "m"]).contains("60.0 × 60.0 × 60.0 mm"));
    let thin = ply(&ball_with(|m| m.points.iter_mut().for_each(|p| p.z *= 0.02)));
    let warned = said("thin.ply", thin, &[]);
    assert!(
        warned.contains("warning: ") && warned.contains("thinner than two walls of 1.6 mm"),
        "{warned}"
    );
    assert!(!said("thick.ply", ply(&good), &[]).contains("warning"));
}

#[test]
fn a_segmentation_written_as_paint_is_read_as_the_same_pieces() {
    let dir = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let o = shellock(dir.path(), args);
        assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
        String::from_utf8_lossy(&o.stdout).into_owned()
    };
    fs::write(dir.path().join("ball.ply"), ply(&ball(Vec3::ZERO))).unwrap();
    run(&["segment", "ball.ply", "--pieces", "6", "-o", "painted.3mf"]);
    let told = run(&["inspect", "painted.3mf"]);
    assert!(
        told.contains("divided by paint") && told.contains("the paint in the file defines the pieces"),
        "{told}"
    );
    let pieces = |args: &[&str]| -> Value {
        serde_json::from_str::<Value>(&run(&[args, &["--json", "-o", "again.ply"]].concat())).unwrap()
            ["pieces"]
            .clone()
    };
    assert_eq!(
        pieces(&["segment", "painted.3mf"]),
        pieces(&["segment", "ball.ply", "--pieces", "6"])
    );
    let o = shellock(
        dir.path(),
        &[
            "segment",
            "painted.3mf",
            "--labels-from",
            "groups",
            "-o",
            "again.ply",
        ],
    );
    assert!(String::from_utf8_lossy(&o.stderr).contains("it has no groups to divide it by; it has paint"));
}

#[test]
fn a_model_too_thin_to_be_hollow_is_refused_at_once_with_what_would_do() {
    let dir = tempfile::tempdir().unwrap();
    let plate = ball_with(|m| m.points.iter_mut().for_each(|p| p.z *= 0.02));
    fs::write(dir.path().join("plate.stl"), write_stl_binary(&plate)).unwrap();
    let o = shellock(dir.path(), &["build", "plate.stl", "-o", "kit"]);
    let said = String::from_utf8_lossy(&o.stderr).into_owned();
    assert_eq!(o.status.code(), Some(2), "{said}");
    for word in ["too thin to be hollow", "mm large", "mm thin", "allow-thin"] {
        assert!(said.contains(word), "{word}: {said}");
    }
    assert!(!dir.path().join("kit").exists());
    let o = shellock(dir.path(), &["build", "plate.stl", "--time", "-1"]);
    assert_eq!(o.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&o.stderr).contains("time is -1 s"));
}

#[test]
fn a_division_is_told_in_figures_and_is_the_one_that_segment_makes() {
    let dir = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let o = shellock(dir.path(), args);
        assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
        String::from_utf8_lossy(&o.stdout).into_owned()
    };
    fs::write(dir.path().join("ball.ply"), ply(&ball(Vec3::ZERO))).unwrap();
    let json =
        |args: &[&str]| -> Value { serde_json::from_str(&run(&[args, &["--json"]].concat())).unwrap() };
    let made = json(&["segment", "ball.ply", "--pieces", "6", "-o", "parts.ply"]);
    let division = json(&["inspect", "ball.ply", "--pieces", "6", "--segment"])["division"].clone();
    assert_eq!(division["n_pieces"], made["pieces"]);
    let pieces = division["pieces"].as_array().unwrap();
    assert_eq!(Some(pieces.len() as u64), made["pieces"].as_u64());
    let seams = |what: &str| division["seams"][what].as_f64().unwrap();
    assert_eq!(seams("concave_share"), 0.0);
    assert!(seams("length_mm") > 100.0 && (0.2..0.6).contains(&seams("visible_share")));
    let told = run(&["inspect", "ball.ply", "--pieces", "6", "--segment"]);
    for words in ["on the front", "eight views", "held", "piece  area, mm²"] {
        assert!(told.contains(words), "{told}");
    }
    // Given labels define the division.
    let given = json(&["inspect", "parts.ply", "--segment"]);
    assert_eq!(given["division"]["n_pieces"], made["pieces"]);
    assert!(json(&["inspect", "ball.ply"])["division"].is_null());
}

/// Ball of 60 mm with walls of 2.4 mm and a hole of 4 mm underneath.
fn hollow_ball() -> TriMesh {
    let [outer, inner] = [30.0, 27.6].map(|radius| {
        let ball = shapes::ball(4, Vec3::ZERO, radius);
        shellock_geom::Volume::from_closed_mesh(&ball).unwrap()
    });
    let ring = |z: f64| {
        let point = |i: u32| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / 24.0).sin_cos();
            Vec3::new(2.0 * c, 2.0 * s, z)
        };
        (0..24).map(point).collect()
    };
    let hole = shellock_geom::Volume::loft(&[ring(-40.0), ring(0.0)]);
    outer.subtract(&inner).subtract(&hole).to_mesh()
}

#[test]
fn a_hollow_model_is_told_with_its_wall_and_opening_and_filled_if_asked() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("drained.stl"), write_stl_binary(&hollow_ball())).unwrap();
    for command in [
        &["inspect", "drained.stl"][..],
        &["build", "drained.stl", "-o", "kit"],
    ] {
        let o = shellock(dir.path(), command);
        let why = String::from_utf8_lossy(&o.stderr).into_owned();
        assert_eq!(o.status.code(), Some(2), "{why}");
        for word in [
            "already hollow",
            "2.4 mm thick",
            "(4.0 mm wide)",
            "--fill",
            "-29.9) mm",
        ] {
            assert!(why.contains(word), "no \"{word}\" in {why}");
        }
    }
    assert!(!dir.path().join("kit").exists());
    let told = |args: &[&str]| {
        let o = shellock(dir.path(), &[&["inspect", "--json"], args].concat());
        assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stderr));
        serde_json::from_slice::<Value>(&o.stdout).unwrap()
    };
    let filled = told(&["drained.stl", "--fill", "--size", "120"]);
    assert_eq!(filled["repairs"][0]["kind"], "openings-closed", "{filled}");
    // Repairs use the file's units; the note uses those of the kit.
    let z = filled["repairs"][0]["at"][2].as_f64().unwrap();
    assert!((z + 29.9).abs() < 0.1, "{z}");
    let note = filled["notes"].to_string();
    assert!(note.contains("1 opening was closed, 8.0 mm wide near"), "{note}");
    // Walls of 4.8 mm are made hollow themselves if the kit's walls are thin.
    let kept = told(&["drained.stl", "--size", "120", "--thickness", "0.8"]);
    assert!(kept["notes"].to_string().contains("already hollow"), "{kept}");
    fs::write(dir.path().join("ball.stl"), write_stl_binary(&ball(Vec3::ZERO))).unwrap();
    let solid = told(&["ball.stl", "--fill"]);
    assert!(solid["notes"].to_string().contains("is not hollow"), "{solid}");
    assert_eq!(solid["repairs"], Value::Array(vec![]));
}

#[test]
fn a_slit_is_told_with_its_width_and_place() {
    let dir = tempfile::tempdir().unwrap();
    let cut = shapes::brick([12.0, 12.05], [-1.0, 41.0], [8.0, 31.0]);
    let sawn = shapes::brick([0.0, 60.0], [0.0, 40.0], [0.0, 30.0]).subtract(&cut);
    fs::write(dir.path().join("sawn.stl"), write_stl_binary(&sawn.to_mesh())).unwrap();
    let o = shellock(dir.path(), &["inspect", "sawn.stl"]);
    let told = String::from_utf8_lossy(&o.stdout).into_owned();
    assert!(
        told.contains("warning: 1 slit in the surface is narrower than 0.20 mm: 0.05 mm wide near (12.0, "),
        "{told}"
    );
}

#[test]
fn a_body_inside_out_that_overlaps_another_is_a_hole_or_a_part_as_its_owner_says() {
    let dir = tempfile::tempdir().unwrap();
    let mut tool = ball(Vec3::new(31.0, 7.0, 3.0));
    tool.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    fs::write(dir.path().join("cutter.ply"), ply(&both(ball(Vec3::ZERO), tool))).unwrap();
    let o = shellock(dir.path(), &["inspect", "cutter.ply"]);
    let why = String::from_utf8_lossy(&o.stderr).into_owned();
    assert_eq!(o.status.code(), Some(2));
    assert!(
        why.contains("near (31, 7, 3)") && why.contains("--inside-out cut"),
        "{why}"
    );
    for (way, kinds) in [
        ("cut", &["bodies-cut-out"][..]),
        ("unite", &["body-turned", "parts-united"]),
    ] {
        let o = shellock(
            dir.path(),
            &["inspect", "cutter.ply", "--inside-out", way, "--json"],
        );
        let told: Value = serde_json::from_slice(&o.stdout).unwrap();
        let repairs = told["repairs"].as_array().unwrap();
        let done: Vec<&str> = repairs.iter().filter_map(|r| r["kind"].as_str()).collect();
        assert_eq!((o.status.code(), done), (Some(0), kinds.to_vec()), "{told}");
    }
}
