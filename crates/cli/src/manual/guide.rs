//! Guide of all options, in Markdown, made from the same declarations as the command line.

use std::fmt::Write as _;

use clap::{Arg, Command, CommandFactory};

use crate::args;

/// Command whose options others share.
const WHOLE_JOB: &str = "build";
const INTRODUCTION: &str = "\
# Options

All commands with their arguments and options, as `shellock COMMAND --help-all` prints them.
Lengths are in mm unless they have a unit: `--size 15cm`, `--size 6in`.
Options can also stand in a file, `shellock.toml`: [printing](printing.md#shellocktoml).

This page is made by `cargo xtask options`; do not edit it.
";

/// Guide of all commands and options in Markdown.
pub fn options_guide() -> String {
    let mut root = args::command();
    root.build();
    let shown: Vec<&Arg> = root.get_arguments().filter(|arg| !arg.is_hide_set()).collect();
    let mut text = format!("{INTRODUCTION}\n## All commands\n\n{}", table(&shown));
    let whole_job = root.find_subcommand(WHOLE_JOB).expect("this command exists");
    for command in args::Cli::command().get_subcommands() {
        let command = root
            .find_subcommand(command.get_name())
            .expect("it has the same commands");
        text += &section(command, whole_job);
    }
    text
}

/// Section of one command: its purpose, its arguments, and its options by their headings.
fn section(command: &Command, whole_job: &Command) -> String {
    let name = command.get_name();
    let purpose = command.get_about().map_or_else(String::new, ToString::to_string);
    let mut text = format!("\n## {name}\n\n{purpose}.\n");
    let shown = own_arguments(command);
    let (shared, own): (Vec<&Arg>, Vec<&Arg>) = shown
        .into_iter()
        .partition(|arg| name != WHOLE_JOB && is_shared(arg, whole_job));
    let mut headings: Vec<Option<&str>> = Vec::new();
    for arg in &own {
        if !headings.contains(&arg.get_help_heading()) {
            headings.push(arg.get_help_heading());
        }
    }
    // Arguments and options without a heading come first.
    headings.sort_by_key(Option::is_some);
    for heading in headings {
        let group: Vec<&Arg> = own
            .iter()
            .copied()
            .filter(|arg| arg.get_help_heading() == heading)
            .collect();
        let title = heading.map_or_else(String::new, |heading| format!("\n### {heading}\n"));
        let _ = write!(text, "{title}\n{}", table(&group));
    }
    if !shared.is_empty() {
        let _ = write!(text, "\n{}\n", shared_options(&shared, whole_job));
    }
    text
}

/// Arguments and options that the help of `command` shows, except those of all commands.
fn own_arguments(command: &Command) -> Vec<&Arg> {
    let is_own = |arg: &&Arg| !arg.is_hide_set() && !arg.is_global_set();
    command.get_arguments().filter(is_own).collect()
}

/// Returns true for an option that `whole_job` has under the same heading.
fn is_shared(arg: &Arg, whole_job: &Command) -> bool {
    let heading = arg.get_help_heading();
    let is_same = |other: &&Arg| other.get_id() == arg.get_id() && other.get_help_heading() == heading;
    heading.is_some() && own_arguments(whole_job).iter().any(is_same)
}

/// Sentence that says which options of `whole_job` a command takes.
fn shared_options(shared: &[&Arg], whole_job: &Command) -> String {
    let of_job = own_arguments(whole_job);
    let of_job = of_job.into_iter().filter(|arg| arg.get_help_heading().is_some());
    let is_missing = |arg: &&Arg| shared.iter().all(|other| other.get_id() != arg.get_id());
    let missing: Vec<&Arg> = of_job.filter(is_missing).collect();
    let names = |args: &[&Arg]| {
        let names = args.iter().filter_map(|arg| arg.get_long());
        names
            .map(|name| format!("`--{name}`"))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let link = format!("[{WHOLE_JOB}](#{WHOLE_JOB})");
    let all = "from [Printer](#printer) to [Make](#make)";
    if missing.is_empty() {
        format!("Also takes all options of {link} {all}.")
    } else if missing.len() < shared.len() {
        format!(
            "Also takes the options of {link} {all}, except {}.",
            names(&missing)
        )
    } else {
        format!("Also takes these options of {link}: {}.", names(shared))
    }
}

/// Table with a row for each argument; values have a column if any argument has some.
fn table(args: &[&Arg]) -> String {
    let has_values = args.iter().any(|arg| !values(arg).is_empty());
    let mut rows = vec![["option", "values", "default", "meaning"].map(str::to_owned)];
    rows.push(["---"; 4].map(str::to_owned));
    for arg in args {
        let (meaning, default) = meaning_and_default(arg);
        rows.push([name(arg), values(arg), default, meaning]);
    }
    let mut text = String::new();
    for [name, values, default, meaning] in rows {
        let cells = if has_values {
            vec![name, values, default, meaning]
        } else {
            vec![name, default, meaning]
        };
        for cell in cells {
            let space = if cell.is_empty() { "" } else { " " };
            let _ = write!(text, "|{space}{} ", cell.replace('|', "\\|"));
        }
        text += "|\n";
    }
    text
}

/// Name as it is typed, with the short form first: `-o`, `--out DIR`.
fn name(arg: &Arg) -> String {
    let value = arg.get_value_names().and_then(|names| names.first());
    let Some(long) = arg.get_long() else {
        let value = value.map_or_else(|| arg.get_id().to_string(), ToString::to_string);
        return if arg.is_required_set() {
            format!("`{value}`")
        } else {
            format!("`[{value}]`")
        };
    };
    let short = arg
        .get_short()
        .map_or_else(String::new, |short| format!("`-{short}`, "));
    match value.filter(|_| arg.get_action().takes_values()) {
        Some(value) => format!("{short}`--{long} {value}`"),
        None => format!("{short}`--{long}`"),
    }
}

/// Values to choose from, if they are few: in one line, or in a line each if they have help of their own.
fn values(arg: &Arg) -> String {
    if !arg.get_action().takes_values() {
        return String::new();
    }
    let all = arg.get_possible_values();
    let has_help = all.iter().any(|value| value.get_help().is_some());
    let word = |value: &clap::builder::PossibleValue| match value.get_help() {
        Some(help) => format!("`{}`: {help}", value.get_name()),
        None => format!("`{}`", value.get_name()),
    };
    let words: Vec<String> = all
        .iter()
        .filter(|value| !value.is_hide_set())
        .map(word)
        .collect();
    words.join(if has_help { "<br>" } else { ", " })
}

/// Long help without its summary, and the default: as declared, or as stated at the end of the help.
fn meaning_and_default(arg: &Arg) -> (String, String) {
    let help = arg
        .get_long_help()
        .or(arg.get_help())
        .map_or_else(String::new, ToString::to_string);
    let paragraphs: Vec<&str> = help.split("\n\n").collect();
    let meaning = match &paragraphs[..] {
        [_, details @ ..] if !details.is_empty() => details.join(" "),
        _ => help.clone(),
    };
    let meaning = meaning.replace('\n', " ");
    if let Some((meaning, default)) = meaning.split_once(" [default: ") {
        return (meaning.to_owned(), default.trim_end_matches(']').to_owned());
    }
    let declared: Vec<String> = arg
        .get_default_values()
        .iter()
        .map(|value| format!("`{}`", value.to_string_lossy()))
        .collect();
    let default = if arg.is_hide_default_value_set() || !arg.get_action().takes_values() {
        String::new()
    } else {
        declared.join(", ")
    };
    (meaning, default)
}
