//! Goldens: digests of kits of the program's own figures, and of models from elsewhere if they are present.

use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;
use shellock_testkit::golden::{self, Case, Ending, Goldens};

use crate::failure::Failure;

/// Cases to compare, and the files of their digests.
#[derive(Args)]
pub struct Options {
    /// Write the digests anew instead of comparing
    #[arg(long)]
    update: bool,
    /// Only cases whose name has this in it
    #[arg(long, value_name = "WORDS")]
    only: Option<String>,
    /// Folder of models from elsewhere
    #[arg(long, value_name = "DIR", default_value = "../shared/models")]
    models: PathBuf,
    /// Digests of kits of those models, which are not part of the repository
    #[arg(long, value_name = "FILE", default_value = "target/golden/models.json")]
    digests: PathBuf,
    /// The program; built from what is here where it is not named
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// Threads to run on, one after the other
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "1,2")]
    threads: Vec<usize>,
}

/// Compares with the goldens, or rewrites them; returns the files written.
pub fn run(options: &Options) -> Result<Vec<PathBuf>, Failure> {
    let program = options.program.clone().map_or_else(build_program, Ok)?;
    let mut changes = Vec::new();
    let mut written = Vec::new();
    for cases in [golden::QUICK.as_slice(), &golden::FIGURES] {
        written.extend(suite(
            options,
            &program,
            cases,
            None,
            &golden::of_figures(),
            &mut changes,
        )?);
    }
    written.dedup();
    if options.models.is_dir() {
        let models = Some(options.models.as_path());
        written.extend(suite(
            options,
            &program,
            &golden::MODELS,
            models,
            &options.digests,
            &mut changes,
        )?);
    } else {
        eprintln!(
            "{} is no folder: no models from elsewhere",
            options.models.display()
        );
    }
    if changes.is_empty() {
        Ok(written)
    } else {
        Err(Failure::Changed(changes))
    }
}

/// Runs all selected cases. `changes` collects the differences from the goldens in `file`.
fn suite(
    options: &Options,
    program: &Path,
    cases: &[Case],
    models: Option<&Path>,
    file: &Path,
    changes: &mut Vec<String>,
) -> Result<Option<PathBuf>, Failure> {
    let of_file = |source| Failure::File {
        path: file.to_owned(),
        source,
    };
    let mut goldens = Goldens::read(file).map_err(of_file)?;
    let machine = golden::machine();
    if !options.update && goldens.machine != machine {
        eprintln!(
            "{}: made on \"{}\", this is \"{machine}\"; compared all the same",
            file.display(),
            goldens.machine
        );
    }
    let is_asked = |case: &&Case| {
        options
            .only
            .as_ref()
            .is_none_or(|words| case.name.contains(words.as_str()))
    };
    for case in cases.iter().filter(is_asked) {
        let ending = on_threads(options, program, case, models, changes)?;
        let before = goldens.endings.get(case.name);
        let differences = match before {
            Some(before) => ending.changes_since(before),
            None => vec!["it was not run before".to_owned()],
        };
        let word = if differences.is_empty() {
            "same".to_owned()
        } else {
            differences.join(", ")
        };
        eprintln!(
            "{}: exit code {}, {} files: {word}",
            case.name,
            ending.exit_code,
            ending.files.len()
        );
        if !options.update && !differences.is_empty() {
            changes.push(format!("{}: {word}", case.name));
        }
        goldens.endings.insert(case.name.to_owned(), ending);
    }
    if !options.update {
        return Ok(None);
    }
    goldens.machine = machine;
    goldens.write(file).map_err(of_file)?;
    Ok(Some(file.to_owned()))
}

/// Runs a case on each number of threads; its ending must be the same on all.
fn on_threads(
    options: &Options,
    program: &Path,
    case: &Case,
    models: Option<&Path>,
    changes: &mut Vec<String>,
) -> Result<Ending, Failure> {
    let mut first: Option<Ending> = None;
    for &n in &options.threads {
        let failed = |e: std::io::Error| Failure::Program {
            program: case.name.to_owned(),
            problem: e.to_string(),
        };
        let ending = golden::run(program, case, n, models).map_err(failed)?;
        if let Some(first) = &first {
            let differences = ending.changes_since(first);
            let told = |change: &String| format!("{} on {n} threads: {change}", case.name);
            changes.extend(differences.iter().map(told));
        }
        first.get_or_insert(ending);
    }
    first.ok_or_else(|| Failure::Options(vec!["--threads names none".into()]))
}

/// Builds the program from this source tree and returns its path.
fn build_program() -> Result<PathBuf, Failure> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let failed = |problem: String| Failure::Program {
        program: "cargo build".into(),
        problem,
    };
    let status = Command::new(cargo)
        .args(["build", "--release", "--quiet", "--package", "shellock-cli"])
        .status()
        .map_err(|e| failed(e.to_string()))?;
    if !status.success() {
        return Err(failed("it failed".into()));
    }
    let beside = std::env::current_exe().map_err(|e| failed(e.to_string()))?;
    let name = format!("shellock{}", std::env::consts::EXE_SUFFIX);
    Ok(beside.parent().unwrap_or(Path::new(".")).join(name))
}
