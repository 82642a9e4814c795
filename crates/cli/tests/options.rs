//! The guide of options says what the program's help says.

use std::fs;
use std::path::Path;
use std::process::Command;

fn guide() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/guide/options.md");
    fs::read_to_string(path).unwrap()
}

/// Output of the program's `words`.
fn output_of(words: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_shellock"))
        .args(words)
        .output()
        .unwrap();
    assert!(output.status.success(), "{words:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Long names of the options that a help text explains.
fn options_in(help: &str) -> Vec<String> {
    let lines = help.lines().map(str::trim_start);
    let lines = lines.filter(|line| line.starts_with('-'));
    let names = lines.filter_map(|line| line.split([' ', ',', '=']).find(|word| word.starts_with("--")));
    names.map(str::to_owned).collect()
}

#[test]
fn the_guide_is_what_the_declarations_give() {
    assert!(
        guide() == shellock_cli::options_guide(),
        "run `cargo xtask options`"
    );
}

#[test]
fn every_option_of_the_help_is_in_the_section_of_its_command() {
    let guide = guide();
    let section = |name: &str| {
        guide
            .split("\n## ")
            .find(|text| text.starts_with(&format!("{name}\n")))
    };
    let (everywhere, build) = (section("All commands").unwrap(), section("build").unwrap());
    let mut n_options = 0;
    for (name, section) in guide
        .split("\n## ")
        .skip(2)
        .filter_map(|text| text.split_once('\n'))
    {
        for option in options_in(&output_of(&[name, "--help-all"])) {
            let has =
                |text: &str| text.contains(&format!("`{option}`")) || text.contains(&format!("`{option} "));
            let takes_shared = section.contains("options of [build](#build)") && has(build);
            assert!(has(section) || has(everywhere) || takes_shared, "{name} {option}");
            n_options += 1;
        }
    }
    assert!(n_options > 200, "{n_options}");
}

#[test]
fn every_command_has_a_section() {
    let help = output_of(&["--help-all"]);
    let commands = help
        .split("Commands:\n")
        .nth(1)
        .unwrap()
        .split("\n\n")
        .next()
        .unwrap();
    let names = commands
        .lines()
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names: Vec<&str> = names
        .map(|line| line.split_whitespace().next().unwrap())
        .collect();
    assert!(names.len() > 10, "{names:?}");
    for name in names.iter().filter(|name| **name != "help") {
        assert!(guide().contains(&format!("\n## {name}\n")), "{name}");
    }
}
