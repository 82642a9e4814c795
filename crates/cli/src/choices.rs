//! Options of `build` as the studio's page shows them, taken from their one declaration.

use clap::{Arg, ArgAction, Parser};
use serde_json::{Map, Value, json};
use shellock_mechanics::Material;
use shellock_print::Printer;
use shellock_studio::Refusal;

use crate::args::{self, Cli, Command, Options};
use crate::build::checked;
use crate::project::Choice;

/// Options that the studio handles itself.
const ITS_OWN: [&str; 12] = [
    "config",
    "labels",
    "help",
    "help-all",
    "json",
    "quiet",
    "verbose",
    "threads",
    "out",
    "force",
    "stop-with-stdin",
    "version",
];

/// Options whose values may be face labels.
const OF_LABELS: [&str; 2] = ["key", "keep-whole"];

/// Chosen options by their long names, in the order of their declaration.
pub type Choices = Vec<(String, Choice)>;

/// Options that a person can choose in the studio.
fn offered() -> Vec<Arg> {
    let mut all = args::command();
    let build = all.find_subcommand_mut("build").expect("there is such a command");
    let is_offered = |a: &&Arg| a.get_long().is_some_and(|name| !ITS_OWN.contains(&name));
    build.get_arguments().filter(is_offered).cloned().collect()
}

/// Lists all options as JSON, each with its chosen value.
pub fn told(choices: &Choices, own_printers: &[Printer]) -> Value {
    let entry = |arg: &Arg| {
        let name = arg.get_long().expect("only such are offered");
        let chosen = choices
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, choice)| match choice {
                Choice::On => json!(true),
                Choice::Text(text) => json!(text),
                Choice::Many(texts) => json!(texts),
            });
        let default = arg.get_default_values().first();
        json!({
            "name": name,
            "group": arg.get_help_heading().unwrap_or("Other"),
            "help": arg.get_help().map(ToString::to_string),
            "more": arg.get_long_help().map(ToString::to_string),
            "kind": kind(arg, own_printers),
            "value_name": arg.get_value_names().and_then(|names| names.first()).map(ToString::to_string),
            "choices": known_values(arg, own_printers),
            "default": default.map(|d| d.to_string_lossy()),
            "value": chosen,
            "is_advanced": arg.is_hide_short_help_set(),
            "is_many": is_many(arg),
        })
    };
    offered().iter().map(entry).collect()
}

fn is_many(arg: &Arg) -> bool {
    matches!(arg.get_action(), ArgAction::Append)
}

fn kind(arg: &Arg, own_printers: &[Printer]) -> &'static str {
    if !arg.get_action().takes_values() {
        "flag"
    } else if known_values(arg, own_printers).is_empty() {
        "text"
    } else {
        "choice"
    }
}

/// Possible values of an option where it has a fixed list; else empty.
fn known_values(arg: &Arg, own_printers: &[Printer]) -> Vec<String> {
    match arg.get_long() {
        Some("printer") => own_printers
            .iter()
            .cloned()
            .chain(Printer::presets())
            .map(|p| p.name)
            .collect(),
        Some("material") => Material::PRESETS.map(|(name, _)| name.to_owned()).to_vec(),
        _ if !arg.get_action().takes_values() => Vec::new(),
        _ => arg
            .get_possible_values()
            .iter()
            .map(|v| v.get_name().to_owned())
            .collect(),
    }
}

/// Applies `changes` to `choices`. Each change is a value, or `null` to clear the choice. Refuses unknown
/// names and values of the wrong kind.
pub fn changed(choices: &Choices, changes: &Map<String, Value>) -> Result<Choices, Refusal> {
    let offered = offered();
    let mut next = choices.clone();
    for (name, value) in changes {
        let arg = offered.iter().find(|a| a.get_long() == Some(name));
        let arg = arg.ok_or_else(|| Refusal::wrong(format!("there is no option \"{name}\"")))?;
        next.retain(|(n, _)| n != name);
        next.extend(choice(arg, value)?.map(|choice| (name.clone(), choice)));
    }
    let place = |name: &str| offered.iter().position(|a| a.get_long() == Some(name));
    next.sort_by_key(|(name, _)| place(name));
    Ok(next)
}

/// Replaces the labels in `choices` after a relabelling of the faces. Labels without a new one stay, and so
/// does every value that is not a label, such as a place.
pub fn relabelled(choices: &Choices, new_label: impl Fn(i64) -> Option<i64>) -> Choices {
    let relabel = |text: &String| {
        let label = text.trim().parse().ok();
        label
            .and_then(&new_label)
            .map_or_else(|| text.clone(), |label| label.to_string())
    };
    let mut choices = choices.clone();
    for (_, choice) in choices
        .iter_mut()
        .filter(|(name, _)| OF_LABELS.contains(&&name[..]))
    {
        *choice = match &*choice {
            Choice::On => Choice::On,
            Choice::Text(text) => Choice::Text(relabel(text)),
            Choice::Many(texts) => Choice::Many(texts.iter().map(relabel).collect()),
        };
    }
    choices
}

fn choice(arg: &Arg, value: &Value) -> Result<Option<Choice>, Refusal> {
    let name = arg.get_long().unwrap_or_default();
    let wrong = || Refusal::wrong(format!("{name}: this cannot be a value of it: {value}"));
    let text = |value: &Value| match value {
        Value::String(text) => Some(text.trim().to_owned()),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    };
    let takes_values = arg.get_action().takes_values();
    Ok(match value {
        Value::Null | Value::Bool(false) => None,
        Value::Bool(true) if !takes_values => Some(Choice::On),
        Value::Array(all) if is_many(arg) => {
            let texts: Option<Vec<String>> = all.iter().map(text).collect();
            Some(texts.ok_or_else(wrong)?)
                .filter(|texts| !texts.is_empty())
                .map(Choice::Many)
        }
        single if takes_values => {
            let text = text(single).ok_or_else(wrong)?;
            let choice = if is_many(arg) {
                Choice::Many(vec![text.clone()])
            } else {
                Choice::Text(text.clone())
            };
            (!text.is_empty()).then_some(choice)
        }
        _ => return Err(wrong()),
    })
}

/// Parses the choices as options; refuses what `build` would refuse, in the same words.
pub fn options(choices: &Choices, own_printers: &[Printer]) -> Result<Options, Refusal> {
    let mut words = vec!["shellock".to_owned(), "build".to_owned(), "model".to_owned()];
    for (name, choice) in choices {
        match choice {
            Choice::On => words.push(format!("--{name}")),
            Choice::Text(text) => words.push(format!("--{name}={text}")),
            Choice::Many(texts) => words.extend(texts.iter().map(|text| format!("--{name}={text}"))),
        }
    }
    let cli = Cli::try_parse_from(words).map_err(|e| Refusal::wrong(words_of(&e)))?;
    let Command::Build { mut options, .. } = cli.command else {
        unreachable!("it was asked for a build");
    };
    options.own_printers = own_printers.to_vec();
    checked(&options).map_err(|e| Refusal::wrong(e.to_string()))?;
    Ok(options)
}

/// Error message of wrong arguments, without the usage text.
fn words_of(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let first = text.trim_start_matches("error: ").split("\n\n").next();
    first.unwrap_or_default().trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changes(text: &str) -> Map<String, Value> {
        serde_json::from_str(text).expect("it is an object")
    }

    #[test]
    fn every_option_of_a_build_is_offered_once() {
        let told = told(&Vec::new(), &[]);
        let names: Vec<&str> = told
            .as_array()
            .unwrap()
            .iter()
            .map(|o| o["name"].as_str().unwrap())
            .collect();
        for name in [
            "size",
            "up",
            "printer",
            "material",
            "method",
            "pieces",
            "keep-whole",
            "key",
            "clearance",
            "seed",
        ] {
            assert_eq!(names.iter().filter(|n| **n == name).count(), 1, "{name}");
        }
        // The studio handles files itself and runs the program as it needs.
        for own in ITS_OWN {
            assert!(!names.contains(&own), "{own}");
        }
        let of = |name: &str| {
            told.as_array()
                .unwrap()
                .iter()
                .find(|o| o["name"] == name)
                .unwrap()
                .clone()
        };
        assert_eq!(
            (&of("key-grip")["kind"], &of("up")["kind"]),
            (&json!("flag"), &json!("choice"))
        );
        assert_eq!(of("up")["choices"], json!(["x", "y", "z"]));
        assert!(
            of("printer")["choices"]
                .as_array()
                .unwrap()
                .contains(&json!("fdm"))
        );
        assert_eq!(of("keep-whole")["is_many"], json!(true));
    }

    #[test]
    fn what_is_chosen_means_the_same_as_on_the_command_line() {
        let chosen = changed(
            &Vec::new(),
            &changes(r#"{"size":"15cm","key-grip":true,"keep-whole":["0,0,9,5"],"key":"1,2,3"}"#),
        )
        .unwrap();
        let options = options(&chosen, &[]).unwrap();
        assert_eq!(
            (options.size, options.key_grip, options.keep_whole.len()),
            (Some(150.0), true, 1)
        );
        let without = changed(
            &chosen,
            &changes(r#"{"size":null,"key-grip":false,"keep-whole":[]}"#),
        )
        .unwrap();
        assert_eq!(without.len(), 1);
    }

    #[test]
    fn labels_that_options_name_are_replaced_and_nothing_else() {
        let chosen = changes(r#"{"pieces":"2","key":"2","keep-whole":["2","5","2,2,2,2"],"seed":"2"}"#);
        let chosen = changed(&Vec::new(), &chosen).unwrap();
        let new_label = |label: i64| (label == 2).then_some(7);
        let expected = changes(r#"{"pieces":"2","key":"7","keep-whole":["7","5","2,2,2,2"],"seed":"2"}"#);
        assert_eq!(
            relabelled(&chosen, new_label),
            changed(&Vec::new(), &expected).unwrap()
        );
        for key in ["auto", "piece", "1,2,3"] {
            let chosen = vec![("key".to_owned(), Choice::Text(key.to_owned()))];
            assert_eq!(relabelled(&chosen, |_| Some(7)), chosen);
        }
    }

    #[test]
    fn what_is_wrong_is_refused_in_words() {
        let refused = |text: &str| {
            let chosen = changed(&Vec::new(), &changes(text));
            chosen
                .and_then(|c| options(&c, &[]).map(|_| ()))
                .unwrap_err()
                .to_string()
        };
        assert!(
            refused(r#"{"size":"big"}"#).contains("--size"),
            "{}",
            refused(r#"{"size":"big"}"#)
        );
        assert!(refused(r#"{"colour":"red"}"#).contains("no option \"colour\""));
        assert!(refused(r#"{"labels":"/etc/passwd"}"#).contains("no option"));
        assert!(refused(r#"{"printer":"fmd"}"#).contains("did you mean fdm?"));
        assert!(refused(r#"{"key-grip":"maybe"}"#).contains("key-grip"));
        assert!(refused(r#"{"size":"100","height":"80"}"#).contains("cannot be used"));
    }
}
