//! Options of a job as arguments of the command line, made from their declarations.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, value_parser};
use shellock_job::Options;
use shellock_job::options::{DECLARED, Declared, Kind, Take, Word, word};
use shellock_job::printers::shipped;

/// Name of the option after which the configuration file is shown.
const BEFORE_CONFIG: &str = "printer";

/// Options of a job, and the configuration file that they may stand in.
pub struct JobOptions {
    /// Options as they were given, on the command line or in the file.
    pub options: Options,
    /// Configuration file that was named.
    pub config: Option<PathBuf>,
}

impl Args for JobOptions {
    fn augment_args(command: Command) -> Command {
        DECLARED.iter().fold(command, |command, option| {
            let command = command.arg(argument(option));
            if option.name == BEFORE_CONFIG {
                command.arg(config())
            } else {
                command
            }
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for JobOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut options = Options::default();
        for option in DECLARED {
            take(option, matches, &mut options).map_err(|why| {
                let words = format!("{}: {why}\n", option.usage());
                clap::Error::raw(clap::error::ErrorKind::ValueValidation, words)
            })?;
        }
        Ok(Self {
            options,
            config: matches.get_one("config").cloned(),
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Sets an option to the values that were given, or else to its default.
fn take(option: &Declared, matches: &ArgMatches, options: &mut Options) -> Result<(), String> {
    match option.kind {
        Kind::Flag(set) => {
            if matches.get_flag(option.name) {
                set(options);
            }
        }
        Kind::Path(set) => {
            if let Some(path) = matches.get_one::<PathBuf>(option.name) {
                set(options, path.clone());
            }
        }
        Kind::Text(take) | Kind::Choice(take, _) => {
            let mut texts = matches.get_many::<String>(option.name).into_iter().flatten();
            texts.try_for_each(|text| take(options, text))?;
        }
    }
    Ok(())
}

fn config() -> Arg {
    Arg::new("config")
        .long("config")
        .value_name("FILE")
        .value_parser(value_parser!(PathBuf))
        .help_heading("Printer")
        .help("Options and printers, in TOML")
        .long_help(
            "Options and printers, in TOML\n\nOptions and printers, in TOML; the command line takes \
             precedence [default: shellock.toml, if there is one here]",
        )
}

/// Argument of the command line for an option.
fn argument(option: &'static Declared) -> Arg {
    let arg = Arg::new(option.name)
        .long(option.name)
        .help_heading(option.group)
        .help(option.short_help)
        .hide_short_help(option.is_advanced)
        .conflicts_with_all(option.excluded_by);
    let arg = match option.long_help() {
        Some(help) => arg.long_help(help),
        None => arg,
    };
    let arg = match option.alias {
        Some(alias) => arg.alias(alias),
        None => arg,
    };
    if !option.takes_value() {
        return arg.action(ArgAction::SetTrue);
    }
    let action = if option.is_many {
        ArgAction::Append
    } else {
        ArgAction::Set
    };
    let arg = arg.value_name(option.value_name).action(action);
    let arg = arg.allow_hyphen_values(option.may_be_negative);
    let arg = match option.default {
        Some(text) => arg.default_value(text),
        None => arg,
    };
    match option.kind {
        Kind::Flag(_) => arg,
        Kind::Path(_) => arg.value_parser(value_parser!(PathBuf)),
        Kind::Choice(..) => arg
            .value_parser(PossibleValuesParser::new(
                option.words().into_iter().map(possible),
            ))
            .hide_possible_values(true),
        Kind::Text(take) if option.name == "printer" => {
            arg.value_parser(PrinterName(take)).hide_possible_values(true)
        }
        Kind::Text(take) => {
            arg.value_parser(move |text: &str| take(&mut Options::default(), text).map(|()| text.to_owned()))
        }
    }
}

/// Parser of a printer's name. Any name may be a printer of the user, so those that come with the program are
/// only suggested, by the completions of a shell.
#[derive(Clone)]
struct PrinterName(Take);

impl TypedValueParser for PrinterName {
    type Value = String;

    fn parse_ref(
        &self,
        command: &Command,
        arg: Option<&Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<String, clap::Error> {
        let take = self.0;
        let name = move |text: &str| take(&mut Options::default(), text).map(|()| text.to_owned());
        name.parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(
            shipped().iter().map(|p| PossibleValue::new(p.name.as_str())),
        ))
    }
}

fn possible((word, help): (&'static str, &'static str)) -> PossibleValue {
    let value = PossibleValue::new(word);
    if help.is_empty() { value } else { value.help(help) }
}

/// Parser of a value that is one of a few words.
pub(super) fn words<T: Word + Send + Sync>() -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(T::words().into_iter().map(possible))
        .map(|text| word(&text).expect("it is one of all"))
}
