//! Tests that every program that reads kits also reads those of program 0.1, which numbered pieces from 0.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use shellock_check::{Verdict, check};
use shellock_formats::{LabelSource, read_mesh, write_ply};

fn shellock(folder: &Path, args: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_shellock"))
        .current_dir(folder)
        .args(args.split(' '))
        .output()
        .unwrap()
}

/// Exit code, and all output.
fn ended(o: &Output) -> (Option<i32>, String) {
    let said = [&o.stdout[..], &o.stderr].concat();
    (o.status.code(), String::from_utf8_lossy(&said).into_owned())
}

/// Subtracts 1 from all piece numbers, also in the names of piece files.
fn numbered_from_0(value: &mut Value) {
    const ONE: [&str; 15] = [
        "a",
        "against",
        "b",
        "earlier",
        "female",
        "id",
        "key",
        "key_piece",
        "later",
        "leaves",
        "male",
        "minus",
        "piece",
        "plus",
        "seat",
    ];
    const MANY: [&str; 7] = [
        "between",
        "free",
        "held",
        "installation_order",
        "keys",
        "neighbors",
        "pieces",
    ];
    match value {
        Value::Object(fields) => fields.iter_mut().for_each(|(name, value)| match value {
            Value::Number(number) if ONE.contains(&&name[..]) => {
                *value = (number.as_u64().unwrap() - 1).into()
            }
            Value::Array(list) if MANY.contains(&&name[..]) && list.iter().all(Value::is_u64) => {
                list.iter_mut()
                    .for_each(|number| *number = (number.as_u64().unwrap() - 1).into());
            }
            Value::String(file) if file.starts_with("pieces/") => *file = file_from_0(file),
            _ => numbered_from_0(value),
        }),
        Value::Array(list) => list.iter_mut().for_each(numbered_from_0),
        _ => {}
    }
}

/// Returns `pieces/piece-00.stl` for `pieces/piece-01.stl`, and so on.
fn file_from_0(file: &str) -> String {
    let digits: String = file.chars().filter(char::is_ascii_digit).collect();
    format!("pieces/piece-{:02}.stl", digits.parse::<u32>().unwrap() - 1)
}

fn change(file: &Path, change: impl FnOnce(&mut Value)) {
    let mut value = serde_json::from_slice(&fs::read(file).unwrap()).unwrap();
    change(&mut value);
    fs::write(file, serde_json::to_vec(&value).unwrap()).unwrap();
}

/// Changes a kit into the form that program 0.1 wrote.
fn make_former(kit: &Path) {
    change(&kit.join("plan.json"), |plan| {
        for piece in plan["pieces"].as_array().unwrap() {
            let file = piece["file"].as_str().unwrap();
            fs::rename(kit.join(file), kit.join(file_from_0(file))).unwrap();
        }
        numbered_from_0(plan);
        (plan["version"], plan["program"]) = (1.into(), "0.1.0".into());
        plan.as_object_mut().unwrap().remove("bears");
        plan["holding"] = serde_json::json!({ "quality_mm": -0.1, "loose": [], "seams": [] });
    });
    change(&kit.join("certificate.json"), |certificate| {
        numbered_from_0(certificate);
        certificate["version"] = 3.into();
    });
    let path = kit.join("segmentation.ply");
    let surface = read_mesh(&fs::read(&path).unwrap(), None).unwrap();
    let labels = surface.labels(LabelSource::Property).unwrap();
    let labels: Vec<i32> = labels.iter().map(|&label| label as i32 - 1).collect();
    fs::write(&path, write_ply(&surface.mesh, Some(&labels))).unwrap();
}

fn assert_confirmed(kit: &Path) {
    let findings = check(kit).unwrap();
    assert!(findings.len() > 10);
    let refuted = findings
        .iter()
        .find(|finding| finding.verdict == Verdict::Refuted);
    assert!(refuted.is_none(), "{}", refuted.unwrap());
}

/// Slow test (some 20 s): makes a kit and runs every command that reads one.
#[test]
fn kits_of_program_0_1_are_read_by_all_that_read_kits() {
    let dir = tempfile::tempdir().unwrap();
    let (folder, kit) = (dir.path(), dir.path().join("kit"));
    shellock(folder, "figure torus -o torus.stl --size 60");
    let quick = "--time 0 --method creases --pieces 4 --thickness 2mm --plan-time 1 --no-booklet";
    let built = shellock(folder, &format!("build torus.stl -o kit {quick}"));
    assert_eq!(ended(&built).0, Some(0), "{}", ended(&built).1);
    make_former(&kit);
    assert_confirmed(&kit);
    for command in [
        "report kit torus.stl --closed-form",
        "test kit --cell 8",
        "verify kit torus.stl",
    ] {
        let (code, said) = ended(&shellock(folder, command));
        assert_eq!(code, Some(0), "{command}: {said}");
    }
    // `verify` wrote a certificate of the present version beside the former plan.
    let certificate: Value =
        serde_json::from_slice(&fs::read(kit.join("certificate.json")).unwrap()).unwrap();
    assert_eq!(certificate["version"], 4);
    assert_confirmed(&kit);

    change(&kit.join("plan.json"), |plan| plan["version"] = 3.into());
    let (code, said) = ended(&shellock(folder, "verify kit torus.stl"));
    assert!(
        code == Some(2) && said.contains("version 3, and this program reads 1 to 2"),
        "{said}"
    );
    assert!(check(&kit).is_err_and(|why| why.contains("plan.json is of version 3")));
}
