//! Tests of `batch` on a folder in which some files are not valid models.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

fn shellock(folder: &Path, args: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_shellock"))
        .current_dir(folder)
        .args(args.split(' '))
        .output()
        .expect("the program runs")
}

fn output_of(o: &Output) -> String {
    String::from_utf8_lossy(&o.stdout).into_owned() + &String::from_utf8_lossy(&o.stderr)
}

/// Slow test (some 10 s): makes two kits.
#[test]
fn what_is_made_stays_what_is_not_is_told_and_kits_are_those_of_build() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir_all(dir.path().join("models/below")).unwrap();
    let options = "--size 60mm --time 0 --method creases --pieces 4 --thickness 2mm";
    shellock(dir.path(), "figure vase --out models/below/vase.stl --size 60");
    fs::write(dir.path().join("models/junk.stl"), "solid\n").unwrap();
    let job = format!("batch models --out kits {options}");
    let first = shellock(dir.path(), &job);
    assert_eq!(first.status.code(), Some(1), "{}", output_of(&first));
    let said = output_of(&first);
    assert!(
        said.contains("below/vase.stl verified") && said.contains("junk.stl refused"),
        "{said}"
    );
    assert!(
        said.contains("1 of 2 models have a kit that passes every check"),
        "{said}"
    );
    // The kit has the same bytes as one made alone.
    shellock(
        dir.path(),
        &format!("build models/below/vase.stl -o alone {options}"),
    );
    let bytes = |folder: &str, name: &str| fs::read(dir.path().join(folder).join(name)).unwrap();
    for name in [
        "plan.json",
        "certificate.json",
        "report.html",
        "pieces/piece-01.stl",
    ] {
        assert!(bytes("kits/below/vase", name) == bytes("alone", name), "{name}");
    }
    let table = String::from_utf8(bytes("kits", "batch.csv")).unwrap();
    assert_eq!(table.lines().count(), 3, "{table}");
    assert!(
        String::from_utf8(bytes("kits", "batch.html"))
            .unwrap()
            .contains("below/vase/pieces.png")
    );
    // A second run makes nothing. A kit that was deleted, or that has other options, is made again.
    let again = output_of(&shellock(dir.path(), &job));
    assert_eq!(again.matches("as it was").count(), 2, "{again}");
    fs::remove_dir_all(dir.path().join("kits/below/vase")).unwrap();
    let third = output_of(&shellock(dir.path(), &format!("{job} --seed 1")));
    assert!(
        third.contains("vase.stl verified") && !third.contains("as it was"),
        "{third}"
    );
    // The table says so when a kit remains although its model is refused now.
    fs::write(dir.path().join("models/below/vase.stl"), "solid\n").unwrap();
    shellock(dir.path(), &job);
    let table = String::from_utf8(bytes("kits", "batch.csv")).unwrap();
    let row = table.lines().find(|line| line.contains("below/vase.stl"));
    assert!(row.is_some_and(|row| row.contains("refused")), "{table}");
    let page = String::from_utf8(bytes("kits", "batch.html")).unwrap();
    assert!(page.contains("is from an earlier run"), "{page}");
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_all_of_them_and_leaves_no_half_kit() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("models")).unwrap();
    for figure in ["cat", "teddy"] {
        shellock(
            dir.path(),
            &format!("figure {figure} --out models/{figure}.stl --size 150"),
        );
    }
    let child = Command::new(env!("CARGO_BIN_EXE_shellock"))
        .current_dir(dir.path())
        .args(["batch", "models", "--out", "kits"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program runs");
    std::thread::sleep(Duration::from_millis(1500));
    let since = Instant::now();
    Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    let ended = { child }.wait().unwrap();
    assert_eq!(ended.code(), Some(130));
    assert!(since.elapsed() < Duration::from_secs(15));
    // Stopped child processes end by themselves and remove what they have begun.
    std::thread::sleep(Duration::from_millis(1500));
    let left: Vec<_> = fs::read_dir(dir.path().join("kits"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != ".batch")
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn a_folder_without_models_and_options_that_are_wrong_are_refused_at_once() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("models")).unwrap();
    let refused = |args: &str, says: &str| {
        let o = shellock(dir.path(), args);
        assert_eq!(o.status.code(), Some(2), "{}", output_of(&o));
        assert!(output_of(&o).contains(says), "{}", output_of(&o));
    };
    refused("batch models --out kits", "contains no model");
    refused("batch nowhere --out kits", "nowhere");
    refused("batch models --out kits --size big", "--size");
    refused("batch models --out kits --thickness 90mm", "thickness");
}
