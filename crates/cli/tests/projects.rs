//! Tests of project files, which the studio writes and `build`, `segment`, `plan` and `inspect` read.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use sha2::{Digest, Sha256};
use shellock_formats::write_stl_binary;
use shellock_testkit::shapes::torus;

fn shellock(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_shellock"))
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder)
        .args(args)
        .output()
        .expect("the program runs")
}

fn errors(o: &Output) -> String {
    String::from_utf8_lossy(&o.stderr).into_owned()
}

/// Writes a project of a ring whose halves are labelled, with these lines before its model.
fn project(folder: &Path, lines: &str) {
    let ring = torus(40.0, 12.0, [60, 24]);
    let bytes = write_stl_binary(&ring);
    let hash: String = Sha256::digest(&bytes)
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect();
    fs::write(folder.join("ring.stl"), bytes).unwrap();
    let label = |f: usize| if ring.face_center(f).y > 0.0 { "1\n" } else { "2\n" };
    let labels: String = (0..ring.triangles.len()).map(label).collect();
    fs::write(folder.join("halves.seg"), labels).unwrap();
    let text = format!("{lines}\n[model]\nfile = \"ring.stl\"\nsha256 = \"{hash}\"\n");
    fs::write(folder.join("ring.shellock.toml"), text).unwrap();
}

#[test]
fn a_project_means_what_its_options_mean_on_the_command_line() {
    let dir = tempfile::tempdir().unwrap();
    project(
        dir.path(),
        "size = \"110mm\"\nlabels = \"halves.seg\"\nthickness = \"2mm\"",
    );
    let by_project = shellock(dir.path(), &["segment", "ring.shellock.toml", "-o", "a.seg"]);
    assert!(by_project.status.success(), "{}", errors(&by_project));
    let args = "segment ring.stl --size 110mm --labels halves.seg --thickness 2mm -o b.seg";
    let by_hand = shellock(dir.path(), &args.split(' ').collect::<Vec<_>>());
    assert!(by_hand.status.success(), "{}", errors(&by_hand));
    let read = |name: &str| fs::read(dir.path().join(name)).unwrap();
    assert!(!read("a.seg").is_empty() && read("a.seg") == read("b.seg"));
    // Options on the command line override the project.
    let ended = |args: &str| shellock(dir.path(), &args.split(' ').collect::<Vec<_>>());
    assert!(
        ended("segment ring.shellock.toml --size 60mm -o c.seg")
            .status
            .success()
    );
    assert!(
        ended("segment ring.stl --size 60mm --labels halves.seg --thickness 2mm -o d.seg")
            .status
            .success()
    );
    assert!(read("c.seg") == read("d.seg"));
}

#[test]
fn a_project_whose_model_changed_or_that_leads_elsewhere_is_refused_in_words() {
    let dir = tempfile::tempdir().unwrap();
    let fails = |lines: &str, change: &dyn Fn(&Path), says: &str| {
        project(dir.path(), lines);
        change(dir.path());
        let made = shellock(dir.path(), &["build", "ring.shellock.toml", "-o", "kit"]);
        assert_eq!(made.status.code(), Some(2), "{}", errors(&made));
        assert!(errors(&made).contains(says), "{}", errors(&made));
        assert!(!dir.path().join("kit").exists());
    };
    let nothing = |_: &Path| ();
    let other = |folder: &Path| {
        fs::write(
            folder.join("ring.stl"),
            write_stl_binary(&torus(40.0, 11.0, [60, 24])),
        )
        .unwrap()
    };
    fails("", &other, "is not the file that the project was made for");
    fails("labels = \"../halves.seg\"", &nothing, "beside the project file");
    fails("labels = \"/etc/passwd\"", &nothing, "beside the project file");
    fails("sice = \"110mm\"", &nothing, "sice");
    fails("size = \"110mm", &nothing, "ring.shellock.toml");
    let no_model =
        |folder: &Path| fs::write(folder.join("ring.shellock.toml"), "size = \"110mm\"\n").unwrap();
    fails("", &no_model, "model");
    let gone = |folder: &Path| fs::remove_file(folder.join("ring.stl")).unwrap();
    fails("", &gone, "ring.stl");
}
