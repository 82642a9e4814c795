//! The program as a user meets it.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn shellock(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_shellock")).current_dir(folder).args(args).output().unwrap()
}

fn code(o: &Output) -> i32 {
    o.status.code().unwrap()
}

fn errors(o: &Output) -> String {
    String::from_utf8_lossy(&o.stderr).into_owned()
}

/// All files below `folder` with their content, sorted.
fn content(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        for entry in fs::read_dir(at).unwrap().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                files.push((name, fs::read(&path).unwrap()));
            }
        }
    }
    files.sort();
    files
}

/// Slow (some 20 s): two whole jobs.
#[test]
fn a_kit_is_whole_verified_and_the_same_on_any_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let job = |threads: &str, out: &str| {
        let args =
            ["demo", "--figure", "teddy", "--size", "80", "--pieces", "6", "--threads", threads, "-o", out, "--json"];
        shellock(dir.path(), &args)
    };
    let one = job("1", "one");
    let verdict: serde_json::Value = serde_json::from_slice(&one.stdout).unwrap();
    assert_eq!((code(&one), &verdict["status"]), (0, &"verified".into()), "{verdict:#}");
    assert_eq!(code(&job("2", "two")), 0);
    let (a, b) = (content(&dir.path().join("one")), content(&dir.path().join("two")));
    for (x, y) in a.iter().zip(&b) {
        assert_eq!(x.0, y.0);
        assert!(x.1 == y.1, "{} differs between one and two threads", x.0);
    }
    assert_eq!(a.len(), b.len());
    let plan: serde_json::Value = serde_json::from_slice(&fs::read(dir.path().join("one/plan.json")).unwrap()).unwrap();
    assert_eq!(plan["installation_order"].as_array().unwrap().last(), Some(&plan["key_piece"]));
    for piece in plan["pieces"].as_array().unwrap() {
        assert!(dir.path().join("one").join(piece["file"].as_str().unwrap()).is_file());
    }
    for name in ["assembly.3mf", "report.html", "pieces.png", "segmentation.ply"] {
        assert!(dir.path().join("one").join(name).is_file(), "{name}");
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2, "something was left behind");

    // The kit can be verified again from its files, and a missing piece is noticed.
    assert_eq!(code(&shellock(dir.path(), &["figure", "teddy", "--size", "80", "-o", "teddy.stl"])), 0);
    assert_eq!(code(&shellock(dir.path(), &["verify", "one", "teddy.stl"])), 0);
    fs::copy(dir.path().join("one/pieces/piece-01.stl"), dir.path().join("one/pieces/piece-00.stl")).unwrap();
    assert_eq!(code(&shellock(dir.path(), &["verify", "one", "teddy.stl"])), 1);
}

#[test]
fn an_open_surface_is_refused_with_its_place() {
    let dir = tempfile::tempdir().unwrap();
    let open = "v 0 0 0\nv 30 0 0\nv 0 30 0\nv 0 0 30\nf 1 3 2\nf 1 2 4\nf 2 3 4\n";
    fs::write(dir.path().join("open.obj"), open).unwrap();
    let o = shellock(dir.path(), &["build", "open.obj"]);
    assert_eq!(code(&o), 2);
    assert!(errors(&o).contains("open.obj") && errors(&o).contains('3'), "{}", errors(&o));
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn all_bad_parameters_are_told_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let o = shellock(dir.path(), &["demo", "--thickness", "99", "--clearance", "7", "--connector", "0"]);
    assert_eq!(code(&o), 2);
    for word in ["thickness", "clearance", "connector size"] {
        assert!(errors(&o).contains(word), "{}", errors(&o));
    }
    for seconds in ["NaN", "-1", "-inf"] {
        let o = shellock(dir.path(), &["demo", &format!("--plan-time={seconds}")]);
        assert_eq!(code(&o), 2, "{seconds}");
        assert!(errors(&o).contains("plan time"), "{}", errors(&o));
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn a_strangers_folder_is_never_replaced() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("mine")).unwrap();
    fs::write(dir.path().join("mine/thesis.txt"), "years of work").unwrap();
    let o = shellock(dir.path(), &["demo", "-o", "mine", "--force"]);
    assert_eq!(code(&o), 2);
    assert_eq!(fs::read(dir.path().join("mine/thesis.txt")).unwrap(), b"years of work");
}

#[test]
fn what_is_not_there_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let o = shellock(dir.path(), &["build", "nowhere.stl"]);
    assert_eq!(code(&o), 2);
    assert!(errors(&o).contains("nowhere.stl"));
    let o = shellock(dir.path(), &["demo", "--figure", "unicorn"]);
    assert_eq!(code(&o), 2);
    assert!(errors(&o).contains("squirrel"));
}
