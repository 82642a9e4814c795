//! Options by name, as people give them to the studio's page, to Python and in project files.

use serde::Serialize;
use serde_json::{Map, Value};
use shellock_mechanics::Material;
use shellock_print::Printer;

use super::{DECLARED, Declared, Kind, Options};
use crate::build::check_options;
use crate::failure::Failure;
use crate::printers::shipped;

/// Options that the choices leave out, because they name files.
const LEFT_OUT: [&str; 1] = ["labels"];

/// Options whose values may be face labels.
const OF_LABELS: [&str; 2] = ["key", "keep-whole"];

/// Choice for one option.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice {
    /// The flag is set.
    On,
    /// The option has this value.
    Text(String),
    /// The option is given several times.
    Many(Vec<String>),
}

/// Chosen options by their names, in the order of their declaration.
pub type Choices = Vec<(String, Choice)>;

/// Options that can be chosen by name.
fn options_to_choose() -> impl Iterator<Item = &'static Declared> {
    DECLARED.iter().filter(|option| !LEFT_OUT.contains(&option.name))
}

/// An option as a page or a program offers it.
#[derive(Clone, Debug, Serialize)]
pub struct Offer {
    choices: Vec<String>,
    default: Option<&'static str>,
    group: &'static str,
    help: &'static str,
    is_advanced: bool,
    is_many: bool,
    kind: &'static str,
    more: Option<String>,
    name: &'static str,
    value: Option<Chosen>,
    value_name: String,
}

/// Value of a choice: `true`, a text, or a list of texts.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
enum Chosen {
    On(bool),
    Text(String),
    Many(Vec<String>),
}

impl From<&Choice> for Chosen {
    fn from(choice: &Choice) -> Self {
        match choice {
            Choice::On => Self::On(true),
            Choice::Text(text) => Self::Text(text.clone()),
            Choice::Many(texts) => Self::Many(texts.clone()),
        }
    }
}

/// Lists all options, each with its chosen value.
pub fn offers(choices: &[(String, Choice)], own_printers: &[Printer]) -> Vec<Offer> {
    let offer = |option: &'static Declared| {
        let known = known_values(option, own_printers);
        let chosen = choices.iter().find(|(name, _)| name == option.name);
        let value_name = if option.takes_value() {
            option.value_name.to_owned()
        } else {
            option.name.to_uppercase().replace('-', "_")
        };
        Offer {
            kind: match (option.takes_value(), known.is_empty()) {
                (false, _) => "flag",
                (true, true) => "text",
                (true, false) => "choice",
            },
            choices: known,
            default: option.default,
            group: option.group,
            help: option.short_help,
            is_advanced: option.is_advanced,
            is_many: option.is_many,
            more: option.long_help(),
            name: option.name,
            value: chosen.map(|(_, choice)| choice.into()),
            value_name,
        }
    };
    options_to_choose().map(offer).collect()
}

/// Possible values of an option where it has a fixed list; else empty.
fn known_values(option: &Declared, own_printers: &[Printer]) -> Vec<String> {
    match option.name {
        "printer" => own_printers
            .iter()
            .cloned()
            .chain(shipped().iter().cloned())
            .map(|p| p.name)
            .collect(),
        "material" => Material::PRESETS.map(|(name, _)| name.to_owned()).to_vec(),
        _ => option
            .words()
            .into_iter()
            .map(|(word, _)| word.to_owned())
            .collect(),
    }
}

/// Applies `changes` to `choices`. Each change is a value, or `null` to clear the choice. Refuses unknown
/// names and values of the wrong kind.
pub fn apply_changes(choices: &[(String, Choice)], changes: &Map<String, Value>) -> Result<Choices, Failure> {
    let mut next = choices.to_vec();
    for (name, value) in changes {
        let option = options_to_choose().find(|option| option.name == name);
        let option = option.ok_or_else(|| Failure::Wrong(format!("there is no option \"{name}\"")))?;
        next.retain(|(n, _)| n != name);
        next.extend(choice(option, value)?.map(|choice| (name.clone(), choice)));
    }
    let place = |name: &str| options_to_choose().position(|option| option.name == name);
    next.sort_by_key(|(name, _)| place(name));
    Ok(next)
}

/// Replaces the labels in `choices` after a relabelling of the faces. Labels without a new one stay, and so
/// does every value that is not a label, such as a place.
pub fn relabel(choices: &[(String, Choice)], new_label: impl Fn(i64) -> Option<i64>) -> Choices {
    let relabel = |text: &String| {
        let label = text.trim().parse().ok();
        label
            .and_then(&new_label)
            .map_or_else(|| text.clone(), |label| label.to_string())
    };
    let mut choices = choices.to_vec();
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

fn choice(option: &Declared, value: &Value) -> Result<Option<Choice>, Failure> {
    let name = option.name;
    let wrong = || Failure::Wrong(format!("{name}: this is not a valid value: {value}"));
    let text = |value: &Value| match value {
        Value::String(text) => Some(text.trim().to_owned()),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    };
    Ok(match value {
        Value::Null | Value::Bool(false) => None,
        Value::Bool(true) if !option.takes_value() => Some(Choice::On),
        Value::Array(all) if option.is_many => {
            let texts: Option<Vec<String>> = all.iter().map(text).collect();
            Some(texts.ok_or_else(wrong)?)
                .filter(|texts| !texts.is_empty())
                .map(Choice::Many)
        }
        single if option.takes_value() => {
            let text = text(single).ok_or_else(wrong)?;
            let choice = if option.is_many {
                Choice::Many(vec![text.clone()])
            } else {
                Choice::Text(text.clone())
            };
            (!text.is_empty()).then_some(choice)
        }
        _ => return Err(wrong()),
    })
}

impl Options {
    /// Options by their names, each with a text, a number, a list of these, or `true` for a flag; refuses
    /// what is wrong with them.
    pub fn from_names(values: &Map<String, Value>) -> Result<Self, Failure> {
        Self::from_choices(&apply_changes(&[], values)?, &[])
    }

    /// Options that were chosen; refuses values that mean nothing, options that exclude each other, and
    /// whatever no kit could be made with.
    pub fn from_choices(choices: &[(String, Choice)], own_printers: &[Printer]) -> Result<Self, Failure> {
        let mut options = Self {
            own_printers: own_printers.to_vec(),
            ..Self::default()
        };
        let mut given = Vec::new();
        for (name, choice) in choices {
            let option = super::declaration(name)
                .ok_or_else(|| Failure::Wrong(format!("there is no option \"{name}\"")))?;
            take(option, choice, &mut options).map_err(Failure::Wrong)?;
            given.push(option);
        }
        exclusion(&given).map_or(Ok(()), |words| Err(Failure::Wrong(words)))?;
        check_options(&options)?;
        Ok(options)
    }
}

/// Sets an option to what was chosen.
fn take(option: &Declared, choice: &Choice, options: &mut Options) -> Result<(), String> {
    let texts: &[String] = match (choice, option.kind) {
        (Choice::On, Kind::Flag(_)) => &[String::new()],
        (Choice::Text(text), _) if option.takes_value() => std::slice::from_ref(text),
        (Choice::Many(texts), _) if option.is_many => texts,
        _ => return Err(format!("{}: this is not a valid value", option.name)),
    };
    texts.iter().try_for_each(|text| {
        option
            .take(options, text)
            .map_err(|why| invalid(option, text, &why))
    })
}

/// Sentence that says why `text` is no value of an option.
fn invalid(option: &Declared, text: &str, why: &str) -> String {
    let usage = option.usage();
    let words: Vec<&str> = option.words().into_iter().map(|(word, _)| word).collect();
    if words.is_empty() {
        format!("invalid value '{text}' for '{usage}': {why}")
    } else {
        let words = words.join(", ");
        format!("invalid value '{text}' for '{usage}'\n  [possible values: {words}]")
    }
}

/// Sentence on the first option that others exclude; `None` if all go together.
fn exclusion(given: &[&Declared]) -> Option<String> {
    given.iter().find_map(|option| {
        let others: Vec<String> = given
            .iter()
            .filter(|other| other.excludes(option))
            .map(|other| other.usage())
            .collect();
        let usage = option.usage();
        match &others[..] {
            [] => None,
            [other] => Some(format!("the argument '{usage}' cannot be used with '{other}'")),
            several => {
                let all = several.join("\n  ");
                Some(format!("the argument '{usage}' cannot be used with:\n  {all}"))
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn changes(text: &str) -> Map<String, Value> {
        serde_json::from_str(text).expect("it is an object")
    }

    #[test]
    fn every_option_of_a_build_is_offered_once() {
        let told = json!(offers(&[], &[]));
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
        for left_out in LEFT_OUT {
            assert!(!names.contains(&left_out), "{left_out}");
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
        let chosen = apply_changes(
            &[],
            &changes(r#"{"size":"15cm","key-grip":true,"keep-whole":["0,0,9,5"],"key":"1,2,3"}"#),
        )
        .unwrap();
        let options = Options::from_choices(&chosen, &[]).unwrap();
        assert_eq!(
            (options.size, options.key_grip, options.keep_whole.len()),
            (Some(150.0), true, 1)
        );
        let without = apply_changes(
            &chosen,
            &changes(r#"{"size":null,"key-grip":false,"keep-whole":[]}"#),
        )
        .unwrap();
        assert_eq!(without.len(), 1);
    }

    #[test]
    fn labels_that_options_name_are_replaced_and_nothing_else() {
        let chosen = changes(r#"{"pieces":"2","key":"2","keep-whole":["2","5","2,2,2,2"],"seed":"2"}"#);
        let chosen = apply_changes(&[], &chosen).unwrap();
        let new_label = |label: i64| (label == 2).then_some(7);
        let expected = changes(r#"{"pieces":"2","key":"7","keep-whole":["7","5","2,2,2,2"],"seed":"2"}"#);
        assert_eq!(
            relabel(&chosen, new_label),
            apply_changes(&[], &expected).unwrap()
        );
        for key in ["auto", "piece", "1,2,3"] {
            let chosen = vec![("key".to_owned(), Choice::Text(key.to_owned()))];
            assert_eq!(relabel(&chosen, |_| Some(7)), chosen);
        }
    }

    #[test]
    fn what_is_wrong_is_refused_in_words() {
        let refused = |text: &str| {
            let chosen = apply_changes(&[], &changes(text));
            chosen
                .and_then(|c| Options::from_choices(&c, &[]).map(|_| ()))
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
