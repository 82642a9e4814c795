//! Tests of `verify` on assemblies that were not made by this program.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use shellock_formats::{read_mesh, write_stl_binary};
use shellock_testkit::shapes::PinnedLid;

/// Writes a base, a lid that slides along x, and a pin from above through both that reaches down to `pin_z`.
fn write_pieces(folder: &Path, pin_z: f64) {
    let lid = PinnedLid {
        gap_mm: 0.1,
        pin: [[12.0, 18.0], [13.0, 17.0], [pin_z, 30.0]],
        ..PinnedLid::default()
    };
    for (name, piece) in ["rail.stl", "slider.stl", "pin.stl"].into_iter().zip(lid.parts()) {
        fs::write(folder.join(name), write_stl_binary(&piece.to_mesh())).unwrap();
    }
}

const ASSEMBLY: &str = r#"{"clearance": 0.1, "pieces": [
    {"file": "rail.stl"},
    {"file": "slider.stl", "pulled_out_along": [1, 0, 0]},
    {"file": "pin.stl", "pulled_out_along": [0, 0, 1]}]}"#;

fn verify(folder: &Path, assembly: &str) -> Output {
    fs::write(folder.join("assembly.json"), assembly).unwrap();
    Command::new(env!("CARGO_BIN_EXE_shellock"))
        .arg("verify")
        .arg(folder)
        .arg("--json")
        .output()
        .unwrap()
}

#[test]
fn boxes_that_lock_pass_and_boxes_that_do_not_fail() {
    let dir = tempfile::tempdir().unwrap();
    write_pieces(dir.path(), 1.0);
    let o = verify(dir.path(), ASSEMBLY);
    let said = String::from_utf8_lossy(&o.stdout);
    assert_eq!(o.status.code(), Some(0), "{said}");
    let certificate = fs::read(dir.path().join("certificate.json")).unwrap();
    let certificate: serde_json::Value = serde_json::from_slice(&certificate).unwrap();
    assert_eq!(certificate["key"], 3);
    assert!(
        certificate["claims"]
            .as_array()
            .unwrap()
            .iter()
            .any(|c| c["claim"] == "locked")
    );
    // A pin that ends above the rail locks nothing.
    write_pieces(dir.path(), 16.0);
    let o = verify(dir.path(), ASSEMBLY);
    assert_eq!(o.status.code(), Some(1));
}

/// The assembly above, turned by 20° about z and then by 35° about x.
#[test]
fn an_assembly_that_lies_askew_is_judged_as_it_was() {
    let dir = tempfile::tempdir().unwrap();
    write_pieces(dir.path(), 1.0);
    let turned = |[x, y, z]: [f64; 3]| {
        let ((s, c), (t, d)) = (20f64.to_radians().sin_cos(), 35f64.to_radians().sin_cos());
        let (x, y) = (c * x - s * y, s * x + c * y);
        [x, d * y - t * z, t * y + d * z]
    };
    let mut assembly = ASSEMBLY.to_owned();
    for way in [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] {
        let told = format!("[{}, {}, {}]", way[0], way[1], way[2]);
        let [x, y, z] = turned(way);
        assert!(assembly.contains(&told));
        assembly = assembly.replace(&told, &format!("[{x}, {y}, {z}]"));
    }
    for name in ["rail.stl", "slider.stl", "pin.stl"] {
        let path = dir.path().join(name);
        let mut mesh = read_mesh(&fs::read(&path).unwrap(), None).unwrap().mesh;
        for p in &mut mesh.points {
            *p = turned(p.to_array()).into();
        }
        fs::write(path, write_stl_binary(&mesh)).unwrap();
    }
    let o = verify(dir.path(), &assembly);
    assert_eq!(o.status.code(), Some(0), "{}", String::from_utf8_lossy(&o.stdout));
}

#[test]
fn what_is_wrong_with_an_assembly_is_said_with_its_name() {
    let dir = tempfile::tempdir().unwrap();
    write_pieces(dir.path(), 1.0);
    for (change, words) in [
        (("\"pulled_out_along\": [0, 0, 1]", "\"way\": [0, 0, 1]"), "way"),
        ((", \"pulled_out_along\": [0, 0, 1]", ""), "pin.stl needs"),
        (("[0, 0, 1]", "[0, 0, 0]"), "is not a direction"),
        (("0.1", "7"), "a clearance of 7 mm"),
        (("rail.stl", "../rail.stl"), "not a file in the folder"),
        (("rail.stl", "gone.stl"), "gone.stl"),
        (("rail.stl", "pin.stl"), "a file of its own"),
        (("rail.stl", "certificate.json"), "a file of its own"),
    ] {
        let o = verify(dir.path(), &ASSEMBLY.replace(change.0, change.1));
        let said = String::from_utf8_lossy(&o.stdout);
        assert_eq!(o.status.code(), Some(2), "{said}");
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn a_file_that_is_named_in_two_ways_is_one_file() {
    let dir = tempfile::tempdir().unwrap();
    let parts = dir.path().join("parts");
    fs::create_dir(&parts).unwrap();
    write_pieces(&parts, 1.0);
    let place = |text: &str, name: &str, path: &str| text.replace(&format!("\"{name}"), &format!("\"{path}"));
    let pieces = |rail: &str| {
        let text = place(ASSEMBLY, "pin.stl", "parts/pin.stl");
        place(&place(&text, "slider.stl", "parts/slider.stl"), "rail.stl", rail)
    };
    let ends = |rail: &str| verify(dir.path(), &pieces(rail)).status.code();
    assert_eq!(ends("parts/rail.stl"), Some(0));
    for same in ["parts/pin.stl", "parts//pin.stl", "parts/./pin.stl"] {
        assert_eq!(ends(same), Some(2), "{same}");
    }
}
