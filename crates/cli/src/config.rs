//! Configuration file: options by their names on the command line, and the user's own printers.
//!
//! ```toml
//! printer = "workshop"
//! size = 180
//! key-grip = true
//!
//! [printers.workshop]
//! like = "fdm"            # what is not said here is taken from this one
//! bed = [300, 300, 340]   # width, depth, height, mm
//! clearance = 0.18
//! ```
//!
//! Options become arguments in front of the user's own, so only one place knows them and reports what is
//! wrong with them. Arguments on the command line take precedence.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use clap::parser::ValueSource;
use clap::{ArgAction, ArgMatches, Command, FromArgMatches, Parser};
use serde::Deserialize;
use shellock_print::{Printer, Process};

use crate::args::{self, Cli, Options};
use crate::project::{self, ModelOf};
use crate::stress;

/// Name of the file that is read without being named.
pub const USUAL: &str = "shellock.toml";
/// Size limit of a configuration file, bytes.
const MOST_BYTES: u64 = 1 << 20;

/// Reason why the arguments give no command.
pub enum Refusal {
    /// Something is wrong with the arguments, or they only request help.
    Arguments(clap::Error),
    /// Something is wrong with the file.
    File(String),
}

/// Parses the command from these arguments and the configuration file.
///
/// A project file takes the place of its model, and of the configuration file unless one is named.
pub fn command_line(arguments: Vec<OsString>) -> Result<Cli, Refusal> {
    let matches = args::command()
        .try_get_matches_from(&arguments)
        .map_err(Refusal::Arguments)?;
    let mut cli = Cli::from_arg_matches(&matches).map_err(Refusal::Arguments)?;
    let Some((name, given)) = matches.subcommand() else {
        return Ok(cli);
    };
    let project = project_of(given)?;
    let Some(path) = project.clone().or_else(|| file_of(given)) else {
        return Ok(cli);
    };
    // The printer to be saved may be the first content of the file.
    let saves = given
        .try_get_one::<String>("save")
        .is_ok_and(|name| name.is_some());
    if saves && !path.exists() {
        return Ok(cli);
    }
    let refused = |problem: String| Refusal::File(format!("{}: {problem}", path.display()));
    let Config {
        mut options,
        printers,
        model,
    } = read(&path).map_err(refused)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    if project.is_some() {
        lay_beside(&mut options, folder).map_err(refused)?;
    }
    let extra = extra_arguments(&args::command(), name, given, &options).map_err(refused)?;
    if !extra.is_empty() {
        let mut all = arguments;
        let at = all.iter().position(|a| a == name).map_or(all.len(), |at| at + 1);
        all.splice(at..at, extra.into_iter().map(OsString::from));
        cli = Cli::try_parse_from(all).map_err(|e| refused(e.to_string()))?;
    }
    if let Some(own) = own_printers(&mut cli.command) {
        *own = printers;
    }
    if project.is_some() {
        let model = model
            .ok_or_else(|| refused("it names no model: write [model] with file and sha256".to_owned()))?;
        let file = model.path(folder).map_err(refused)?;
        if let Some((path, options)) = model_of(&mut cli.command) {
            *path = file;
            options.model_sha256 = Some(model.sha256);
        }
    }
    Ok(cli)
}

/// Returns those of the given arguments of `batch` that are options of `build`.
pub fn build_arguments(arguments: Vec<OsString>) -> Vec<String> {
    let all = args::command();
    let Ok(matches) = all.clone().try_get_matches_from(arguments) else {
        return Vec::new();
    };
    let (Some(build), Some((_, given))) = (all.find_subcommand("build"), matches.subcommand()) else {
        return Vec::new();
    };
    let mut options = Vec::new();
    for arg in build.get_arguments() {
        let id = arg.get_id().as_str();
        let is_shared = given.try_contains_id(id).is_ok_and(|is_there| is_there);
        let is_own = [
            "model",
            "out",
            "force",
            "help",
            "help_all",
            "json",
            "quiet",
            "verbose",
            "threads",
            "stop_with_stdin",
        ];
        let (Some(name), true) = (arg.get_long(), is_shared && !is_own.contains(&id)) else {
            continue;
        };
        if given.value_source(id) != Some(ValueSource::CommandLine) {
            continue;
        }
        if matches!(arg.get_action(), ArgAction::SetTrue) {
            options.push(format!("--{name}"));
        } else {
            let values = given.get_raw(id).into_iter().flatten();
            options.extend(values.map(|value| format!("--{name}={}", value.to_string_lossy())));
        }
    }
    options
}

/// Returns the project file that is given instead of a model; fails if a configuration file is named, too.
fn project_of(given: &ArgMatches) -> Result<Option<PathBuf>, Refusal> {
    let model = given.try_get_one::<PathBuf>("model").ok().flatten();
    let is_configured = given
        .try_get_one::<PathBuf>("config")
        .is_ok_and(|path| path.is_some());
    match model.filter(|path| given.try_contains_id("config").is_ok() && project::is_project(path)) {
        Some(path) if is_configured => Err(Refusal::File(format!(
            "{} is a project with options of its own: leave out --config",
            path.display()
        ))),
        path => Ok(path.cloned()),
    }
}

/// Resolves the files that a project's options name, relative to the project's folder.
fn lay_beside(options: &mut toml::Table, folder: &Path) -> Result<(), String> {
    if let Some(toml::Value::String(labels)) = options.get_mut("labels") {
        *labels = project::beside(folder, labels)?.to_string_lossy().into_owned();
    }
    Ok(())
}

/// Returns the command's model path and options, if it has both.
fn model_of(command: &mut args::Command) -> Option<(&mut PathBuf, &mut Options)> {
    use args::Command::{Build, Inspect, Plan, Segment};
    match command {
        Build { model, options, .. }
        | Segment { model, options, .. }
        | Plan { model, options }
        | Inspect { model, options, .. } => Some((model, options)),
        _ => None,
    }
}

/// Returns the named configuration file, or else the usual one if it exists. `None` for commands that take
/// none.
fn file_of(given: &ArgMatches) -> Option<PathBuf> {
    let named = given.try_get_one::<PathBuf>("config").ok()?;
    named
        .cloned()
        .or_else(|| Path::new(USUAL).is_file().then(|| PathBuf::from(USUAL)))
}

fn own_printers(command: &mut args::Command) -> Option<&mut Vec<Printer>> {
    use args::Command::{Batch, Build, Coupon, Demo, Inspect, Plan, Segment};
    match command {
        Build { options, .. }
        | Demo { options, .. }
        | Segment { options, .. }
        | Plan { options, .. }
        | Inspect { options, .. } => Some(&mut options.own_printers),
        Batch(options) => Some(&mut options.options.own_printers),
        Coupon(options) => Some(&mut options.own_printers),
        _ => None,
    }
}

/// Contents of a configuration file.
struct Config {
    options: toml::Table,
    printers: Vec<Printer>,
    /// Model of a project file; `None` in a plain configuration.
    model: Option<ModelOf>,
}

/// One printer as the file declares it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Own {
    like: Option<String>,
    process: Option<String>,
    bed: Option<[f64; 3]>,
    clearance: Option<f64>,
    key_clearance: Option<f64>,
    #[serde(alias = "wall-gap")]
    tolerance: Option<f64>,
    min_wall: Option<f64>,
    layer: Option<f64>,
    material: Option<String>,
}

fn read(path: &Path) -> Result<Config, String> {
    let size = fs::metadata(path).map_err(|e| e.to_string())?.len();
    if size > MOST_BYTES {
        return Err(format!("{size} bytes are too many for a configuration"));
    }
    parse(&fs::read_to_string(path).map_err(|e| e.to_string())?)
}

/// Returns `[printers]` of the usual file, unchanged. `None` if there is no such file or it cannot be read.
pub fn usual_printers() -> Option<toml_edit::Item> {
    let text = fs::read_to_string(USUAL).ok()?;
    let file: toml_edit::DocumentMut = text.parse().ok()?;
    file.get("printers").cloned()
}

/// Returns the model that a project file names.
pub fn project_model(text: &str) -> Result<Option<ModelOf>, String> {
    Ok(parse(text)?.model)
}

/// Returns the printers of a configuration.
pub fn printers_of(text: &str) -> Result<Vec<Printer>, String> {
    Ok(parse(text)?.printers)
}

fn parse(text: &str) -> Result<Config, String> {
    let mut options: toml::Table = text.parse().map_err(|e: toml::de::Error| e.to_string())?;
    let printers = match options.remove("printers") {
        None => Vec::new(),
        Some(toml::Value::Table(printers)) => printers
            .into_iter()
            .map(|(name, value)| own_printer(name, value))
            .collect::<Result<_, _>>()?,
        Some(_) => return Err("\"printers\" must be a table; write for example [printers.mine]".to_owned()),
    };
    let model = options.remove("model").map(toml::Value::try_into).transpose();
    let model = model.map_err(|e: toml::de::Error| format!("[model]: {}", e.message()))?;
    Ok(Config {
        options,
        printers,
        model,
    })
}

fn own_printer(name: String, value: toml::Value) -> Result<Printer, String> {
    let fault = |problem: String| format!("printer \"{name}\": {problem}");
    let own: Own = value
        .try_into()
        .map_err(|e: toml::de::Error| fault(e.message().to_owned()))?;
    let process = own.process.as_deref().map(|p| {
        let names = || Process::ALL.map(|(name, _)| name).join(", ");
        Process::named(p)
            .ok_or_else(|| fault(format!("there is no process \"{p}\"; choose one of {}", names())))
    });
    let process = process.transpose()?;
    let is_base = |p: &Printer| match (&own.like, process) {
        (Some(like), _) => p.name.eq_ignore_ascii_case(like),
        (None, process) => p.process == process.unwrap_or(Process::Sla),
    };
    let unknown = || {
        fault(format!(
            "it is like \"{}\", which does not exist",
            own.like.as_deref().unwrap_or_default()
        ))
    };
    let base = Printer::presets().into_iter().find(is_base).ok_or_else(unknown)?;
    let material = own
        .material
        .as_deref()
        .map(stress::material)
        .transpose()
        .map_err(fault)?;
    let printer = Printer {
        process: process.unwrap_or(base.process),
        bed_mm: own.bed.unwrap_or(base.bed_mm),
        clearance_mm: own.clearance.unwrap_or(base.clearance_mm),
        key_clearance_mm: own.key_clearance.unwrap_or(base.key_clearance_mm),
        tolerance_mm: own.tolerance.unwrap_or(base.tolerance_mm),
        min_wall_mm: own.min_wall.unwrap_or(base.min_wall_mm),
        layer_mm: own.layer.unwrap_or(base.layer_mm),
        material: material.unwrap_or(base.material),
        name: name.clone(),
    };
    match printer.problems().first() {
        Some(problem) => Err(fault(problem.to_string())),
        None => Ok(printer),
    }
}

/// Turns the file's options into arguments of the subcommand `name`, except those that were `given`.
fn extra_arguments(
    cli: &Command,
    name: &str,
    given: &ArgMatches,
    options: &toml::Table,
) -> Result<Vec<String>, String> {
    /// Options for size: giving one overrides all three.
    const SIZES: [&str; 3] = ["size", "height", "scale"];
    let command = cli
        .find_subcommand(name)
        .ok_or_else(|| format!("there is no command \"{name}\""))?;
    let is_given = |id: &str| given.value_source(id) == Some(ValueSource::CommandLine);
    let mut extra = Vec::new();
    for (key, value) in options {
        let Some(argument) = command.get_arguments().find(|a| a.get_long() == Some(key)) else {
            let mut others = cli.get_subcommands().flat_map(Command::get_arguments);
            if others.any(|a| a.get_long() == Some(key)) {
                continue;
            }
            return Err(format!(
                "there is no option \"{key}\"; `shellock build --help` lists them"
            ));
        };
        let id = argument.get_id().as_str();
        if is_given(id) || SIZES.contains(&id) && SIZES.iter().any(|id| is_given(id)) {
            continue;
        }
        match (value, argument.get_action().takes_values()) {
            (toml::Value::Boolean(is_on), false) => extra.extend(is_on.then(|| format!("--{key}"))),
            (_, false) => return Err(format!("\"{key}\" must be true or false")),
            (toml::Value::String(text), true) => extra.push(format!("--{key}={text}")),
            (toml::Value::Integer(number), true) => extra.push(format!("--{key}={number}")),
            (toml::Value::Float(number), true) => extra.push(format!("--{key}={number}")),
            (toml::Value::Array(several), true) if matches!(argument.get_action(), ArgAction::Append) => {
                for one in several {
                    let one = one
                        .as_str()
                        .ok_or_else(|| format!("\"{key}\" must be a list of texts"))?;
                    extra.push(format!("--{key}={one}"));
                }
            }
            _ => return Err(format!("\"{key}\" must be a number or a text")),
        }
    }
    Ok(extra)
}
