//! Tests that every command of the guides runs. A command that no longer exists, or whose options were
//! renamed, fails.
//!
//! The `sh` blocks of a guide are run in order in a folder of their own, with generated figures in place of
//! the reader's files. Commands that make a kit get options that make it quickly, unless the guide sets them.
//! Python blocks run in python/tests.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::Instant;

/// Commands that are not run: how each begins, and the reason.
const NOT_RUN: [(&str, &str); 6] = [
    ("cargo install ", "builds the program once more"),
    ("scripts/test", "runs this test"),
    (
        "pip install maturin",
        "fetches from the registry; scripts/test does it",
    ),
    (
        "maturin build ",
        "needs maturin; scripts/test builds the same wheel",
    ),
    ("pip install dist/", "needs that wheel; scripts/test installs it"),
    (
        "python -m shellock_ray ",
        "needs a cluster; python/tests has one of two workers",
    ),
];

/// Guides whose kits are made. Commands of the others are only parsed, unless SHELLOCK_GUIDES is `all`: with
/// `--help` at the end they stop at once, or at an option that does not exist. Those of the README are among
/// the commands of these guides, too.
const IN_FULL: [&str; 3] = ["batch.md", "getting-started.md", "reference.md"];

/// Options added to a command that does not set them, for few pieces and a quick run.
const SOON: [(&str, &str); 4] = [
    ("--effort", "20"),
    ("--method", "creases"),
    ("--pieces", "4"),
    ("--plan-time", "1"),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Paths of the guides and of the README, sorted by name.
fn guides() -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> = fs::read_dir(root().join("docs/guide"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "md"))
        .collect();
    all.push(root().join("README.md"));
    all.sort();
    all
}

/// Extracts the commands of a guide's `sh` blocks, without comments.
fn commands(guide: &str) -> Vec<String> {
    let mut is_shell = false;
    let mut found = Vec::new();
    for line in guide.lines() {
        if let Some(language) = line.trim_start().strip_prefix("```") {
            is_shell = language == "sh";
        } else if is_shell {
            let code = line.split(" #").next().unwrap_or_default();
            found.extend(code.split("&&").map(|command| command.trim().to_owned()));
        }
    }
    found.retain(|command| !command.is_empty() && !command.starts_with('#'));
    found
}

/// Options to add to the program's arguments.
fn more_options(args: &[&str]) -> Vec<String> {
    let has = |option: &str| args.contains(&option);
    let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
    match args[0] {
        "build" | "demo" | "batch" => {
            let mut more = words(if has("--size") {
                "--thickness 5mm"
            } else {
                "--thickness 2mm"
            });
            if args[0] == "demo" {
                more.extend(words("--figure torus --size 60"));
            }
            let is_limited = |option: &str| option == "--effort" && has("--time");
            let unsaid = SOON
                .iter()
                .filter(|(option, _)| !has(option) && !is_limited(option));
            more.extend(unsaid.flat_map(|&(option, value)| [option.to_owned(), value.to_owned()]));
            more
        }
        "test" => words("--cell 8"),
        "report" => words("--closed-form"),
        "studio" => words("--no-open --stop-with-stdin"),
        _ => Vec::new(),
    }
}

/// Creates the files that the guides mention.
fn prepare(folder: &Path, torus: &[u8]) {
    fs::create_dir(folder.join("models")).unwrap();
    for file in ["figure.stl", "dragon.stl", "models/figure.stl"] {
        fs::write(folder.join(file), torus).unwrap();
    }
}

/// Returns true if the guide's kits are made.
fn is_in_full(guide: &Path) -> bool {
    let name = guide.file_name().unwrap().to_str().unwrap();
    IN_FULL.contains(&name) || std::env::var("SHELLOCK_GUIDES").is_ok_and(|which| which == "all")
}

/// Runs a command in `folder`, or only has it parsed; fails with the program's output.
fn run(folder: &Path, command: &str, is_in_full: bool) -> Result<(), String> {
    let program = command
        .strip_prefix("cargo run --release -- ")
        .or(command.strip_prefix("shellock "));
    let Some(args) = program else {
        return match command.strip_prefix("shellock-check ") {
            // This command is a program of another crate.
            Some(_) if !is_in_full => Ok(()),
            Some(kit) => shellock_check::check(&folder.join(kit)).map(drop),
            None => Err("no command of this program, and not among those that are not run".into()),
        };
    };
    let args: Vec<&str> = args.split_whitespace().collect();
    let output = Command::new(env!("CARGO_BIN_EXE_shellock"))
        .current_dir(folder)
        .args(&args)
        .args(if is_in_full {
            more_options(&args)
        } else {
            vec!["--help".to_owned()]
        })
        .stdin(Stdio::null())
        .output()
        .unwrap();
    // With exit code 1 the command ran, but its kit fails a check. This test does not ask whether kits pass.
    if matches!(output.status.code(), Some(0 | 1)) {
        return Ok(());
    }
    let said = [output.stdout, output.stderr].concat();
    Err(format!("{}\n{}", output.status, String::from_utf8_lossy(&said)))
}

/// Slow test (half a minute on two cores): makes kits.
#[test]
fn every_command_of_the_guides_runs() {
    let made = tempfile::tempdir().unwrap();
    run(made.path(), "shellock figure torus -o torus.stl --size 60", true).unwrap();
    let torus = fs::read(made.path().join("torus.stl")).unwrap();
    let (wrong, passed_over) = (Mutex::new(Vec::new()), Mutex::new(BTreeSet::new()));
    let follow = |guide: &Path| {
        let folder = tempfile::tempdir().unwrap();
        prepare(folder.path(), &torus);
        for command in commands(&fs::read_to_string(guide).unwrap()) {
            if let Some((start, _)) = NOT_RUN.iter().find(|(start, _)| command.starts_with(start)) {
                passed_over.lock().unwrap().insert(*start);
                continue;
            }
            let since = Instant::now();
            if let Err(why) = run(folder.path(), &command, is_in_full(guide)) {
                wrong
                    .lock()
                    .unwrap()
                    .push(format!("{}: {command}: {why}", guide.display()));
            }
            println!("{:4.0} s  {command}", since.elapsed().as_secs_f64());
        }
    };
    std::thread::scope(|scope| {
        for guide in guides() {
            scope.spawn(move || follow(&guide));
        }
    });
    let wrong = wrong.into_inner().unwrap();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let listed: BTreeSet<&str> = NOT_RUN.iter().map(|(start, _)| *start).collect();
    assert_eq!(
        passed_over.into_inner().unwrap(),
        listed,
        "the list names what no guide has"
    );
}

#[test]
fn commands_are_the_lines_of_sh_blocks_without_comments() {
    let guide =
        "shellock a\n```sh\nshellock b --c 1     # why\n# all of it\nd && e\n\n```\n```toml\nf = 1\n```\n";
    assert_eq!(commands(guide), ["shellock b --c 1", "d", "e"]);
}
