//! Tests of the program's messages: help that fits a screen, units, and a single verdict.

use std::path::Path;
use std::process::{Command, Output};

fn shellock(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_shellock"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

fn output_of(o: &Output) -> String {
    String::from_utf8_lossy(&o.stdout).into_owned() + &String::from_utf8_lossy(&o.stderr)
}

const COMMANDS: [&str; 13] = [
    "build",
    "demo",
    "segment",
    "plan",
    "verify",
    "test",
    "report",
    "coupon",
    "completions",
    "manual",
    "inspect",
    "figure",
    "printers",
];

#[test]
fn the_help_of_every_command_fits_a_screen_and_has_an_example_where_it_makes_something() {
    let dir = tempfile::tempdir().unwrap();
    for command in COMMANDS {
        let help = output_of(&shellock(dir.path(), &[command, "--help"]));
        assert!(help.lines().count() <= 60, "{command}: {}", help.lines().count());
        assert!(help.contains("Usage: shellock"), "{command}");
        let all = output_of(&shellock(dir.path(), &[command, "--help-all"]));
        assert!(all.len() >= help.len(), "{command}");
    }
    for command in ["build", "demo", "segment", "plan", "inspect", "test"] {
        let help = output_of(&shellock(dir.path(), &[command, "-h"]));
        assert!(help.contains(&format!("  shellock {command} ")), "{command}");
    }
    // Options that dividing does not use are not in its help.
    let segment = output_of(&shellock(dir.path(), &["segment", "--help-all"]));
    assert!(!segment.contains("--no-booklet") && segment.contains("--keep-whole"));
}

#[test]
fn lengths_take_units_and_slips_are_told_what_was_meant() {
    let dir = tempfile::tempdir().unwrap();
    let figure = |size: &str| shellock(dir.path(), &["figure", "vase", "--size", size, "-o", "vase.stl"]);
    assert!(figure("6cm").status.success());
    let wrong = output_of(&figure("6furlong"));
    assert!(wrong.contains("--size") && wrong.contains("15cm"), "{wrong}");
    for (args, meant) in [
        (["--printer", "fmd"], "did you mean fdm?"),
        (["--material", "plaa"], "did you mean pla?"),
        (["--figure", "tedy"], "did you mean teddy?"),
    ] {
        let o = shellock(dir.path(), &["demo", args[0], args[1], "-o", "kit"]);
        assert_eq!(o.status.code(), Some(2));
        assert!(output_of(&o).contains(meant), "{}", output_of(&o));
    }
}

#[test]
fn a_kit_ends_with_one_verdict_and_tells_five_warnings_at_most() {
    let dir = tempfile::tempdir().unwrap();
    let args = [
        "demo", "--figure", "torus", "--size", "60", "--pieces", "3", "--key", "piece", "--time", "0", "-o",
        "kit",
    ];
    let o = shellock(dir.path(), &args);
    let (out, all) = (String::from_utf8_lossy(&o.stdout).into_owned(), output_of(&o));
    let told = out
        .lines()
        .filter(|l| ["note: ", "warning: "].iter().any(|s| l.starts_with(s)));
    assert!(told.count() <= 5, "{out}");
    match o.status.code() {
        Some(0) => assert!(
            out.trim_end().ends_with("report.html shows how it goes together"),
            "{out}"
        ),
        Some(1) => {
            assert!(!all.contains("print plates.3mf"), "{all}");
            assert_eq!(all.matches("do not print it").count(), 1, "{all}");
        }
        other => panic!("{other:?}: {all}"),
    }
}
