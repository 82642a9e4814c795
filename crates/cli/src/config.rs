//! Command line, and the configuration file whose options are added to it.
//!
//! Options become arguments in front of the user's own, so only one place knows them and reports what is
//! wrong with them. Arguments on the command line take precedence.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::parser::ValueSource;
use clap::{ArgAction, ArgMatches, Command, FromArgMatches, Parser};
use shellock_job::config::{Config, USUAL, read};
use shellock_job::{Options, project};
use shellock_print::Printer;

use crate::args::{self, Cli};

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
        let model =
            model.ok_or_else(|| refused("it names no model: add [model] with file and sha256".to_owned()))?;
        let file = model.path(folder).map_err(refused)?;
        if let Some((path, options)) = model_of(&mut cli.command) {
            *path = file;
            options.model_sha256 = Some(model.sha256);
        }
    }
    Ok(cli)
}

/// Returns those of the given arguments of `batch` or `demo` that are options of `build`.
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

/// Limit of a kit that the user gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Time on this machine.
    Time,
    /// Work, which is equal on all machines.
    Work,
}

/// Returns the limit that the arguments or the configuration file give a kit.
pub fn limit(arguments: &[String], config: &[u8]) -> Option<Limit> {
    let of_name = |name: &str| match name {
        "time" => Some(Limit::Time),
        "effort" => Some(Limit::Work),
        _ => None,
    };
    let of_argument = |word: &String| {
        let word = word.strip_prefix("--")?;
        of_name(word.split('=').next().unwrap_or(word))
    };
    let file: toml::Table = toml::from_slice(config).unwrap_or_default();
    // An argument overrides the file.
    let of_arguments = arguments.iter().find_map(of_argument);
    of_arguments.or_else(|| file.keys().find_map(|key| of_name(key)))
}

/// Returns true if the user limits the time or the work of a kit, by an argument or by the configuration file
/// of `options`.
pub fn is_limited(options: &args::JobOptions) -> bool {
    let arguments = build_arguments(std::env::args_os().collect());
    let file = options.config.clone().unwrap_or_else(|| PathBuf::from(USUAL));
    limit(&arguments, &std::fs::read(file).unwrap_or_default()).is_some()
}

/// Returns the project file that is given instead of a model; fails if a configuration file is named, too.
fn project_of(given: &ArgMatches) -> Result<Option<PathBuf>, Refusal> {
    let model = given.try_get_one::<PathBuf>("model").ok().flatten();
    let is_configured = given
        .try_get_one::<PathBuf>("config")
        .is_ok_and(|path| path.is_some());
    match model.filter(|path| given.try_contains_id("config").is_ok() && project::is_project(path)) {
        Some(path) if is_configured => Err(Refusal::File(format!(
            "{} is a project with its own options: leave out --config",
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
        | Inspect { model, options, .. } => Some((model, &mut options.options)),
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
    use args::Command::{Batch, Build, Coupon, Demo, Inspect, Plan, Printers, Segment};
    match command {
        Build { options, .. }
        | Demo { options, .. }
        | Segment { options, .. }
        | Plan { options, .. }
        | Inspect { options, .. } => Some(&mut options.options.own_printers),
        Batch(options) => Some(&mut options.options.options.own_printers),
        Coupon(options) => Some(&mut options.own_printers),
        Printers(options) => Some(&mut options.own_printers),
        _ => None,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_argument_limits_time_or_work_before_the_file_does() {
        let of = |words: &str, config: &str| {
            let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
            limit(&words, config.as_bytes())
        };
        assert_eq!(of("--size 80 --plan-time 5", "size = 80"), None);
        assert_eq!(of("--time 0", "effort = 5"), Some(Limit::Time));
        assert_eq!(of("--effort=9", "time = 30"), Some(Limit::Work));
        assert_eq!(of("--size 80", "time = 30"), Some(Limit::Time));
    }
}
