//! Problems with a plan file, in sentences.

/// Reasons why a file is no plan, or lacks something that was asked of it.
#[derive(Debug, thiserror::Error)]
pub enum PlanFileError {
    /// The file is no JSON.
    #[error("not a plan: {0}")]
    NotJson(#[source] serde_json::Error),
    /// The file is JSON, but a list, a number or a text.
    #[error("not a plan: it holds no object, which begins with {{")]
    NotAnObject,
    /// `format` or `version` has another value or type.
    #[error("\"format\" and \"version\" are not \"shellock-plan\" and a number; build the kit again")]
    OtherFormat,
    /// The file was written in a later version of the format.
    #[error(
        "it is of version {version}, and this program reads 1 to {}: use the program that made the kit, or \
         a later one",
        super::VERSION
    )]
    Later {
        /// Version given in the file.
        version: u64,
    },
    /// A field is missing in the file.
    #[error("{}", missing(field))]
    Missing {
        /// Path of the field, such as `pieces[0].id`.
        field: String,
    },
    /// A field has the wrong type.
    #[error("\"{field}\" {problem}")]
    Mistyped {
        /// Path of the field, such as `pieces[0].id`.
        field: String,
        /// Description of the value found and of the one expected.
        problem: String,
    },
    /// All fields have the right types, but they contradict each other.
    #[error("{0}")]
    Contradiction(String),
}

impl PlanFileError {
    /// Converts serde's message about the field at `path` to plain words.
    pub(super) fn of_field(path: &str, said: &str) -> Self {
        let field = |name: &str| match path {
            "." | "" => name.to_owned(),
            _ => format!("{path}.{name}"),
        };
        let name = said
            .strip_prefix("missing field `")
            .and_then(|rest| rest.strip_suffix('`'));
        match name {
            Some(name) => Self::Missing { field: field(name) },
            None => Self::Mistyped {
                field: path.to_owned(),
                problem: problem(said),
            },
        }
    }

    /// Error for a missing field.
    pub(super) fn missing(field: &str) -> Self {
        Self::Missing {
            field: field.to_owned(),
        }
    }
}

fn missing(field: &str) -> String {
    match field {
        "pieces" => "there is no list of pieces (\"pieces\")".to_owned(),
        "installation_order" => "there is no installation order (\"installation_order\")".to_owned(),
        _ => format!("\"{field}\" is missing"),
    }
}

/// Rewrites "invalid type: string "a", expected f64" as `is the text "a" where a number belongs`.
fn problem(said: &str) -> String {
    let other = || format!("is not what a plan has there: {said}");
    let Some((found, wanted)) = said.rsplit_once(", expected ") else {
        return other();
    };
    if let Some(length) = found.strip_prefix("invalid length ") {
        return format!("has {length} entries where {} belongs", wanted_words(wanted));
    }
    let found = ["invalid type: ", "invalid value: "]
        .iter()
        .find_map(|start| found.strip_prefix(start));
    found.map_or_else(other, |found| {
        format!("is {} where {} belongs", found_words(found), wanted_words(wanted))
    })
}

fn found_words(found: &str) -> String {
    match found {
        "map" => "an object".to_owned(),
        "sequence" => "a list".to_owned(),
        "null" => "null".to_owned(),
        _ => match found.split_once('`') {
            Some((_, number)) => number.trim_end_matches('`').to_owned(),
            None => found.replacen("string", "the text", 1),
        },
    }
}

fn wanted_words(wanted: &str) -> String {
    match wanted {
        "f64" => "a number".to_owned(),
        "u32" | "u64" | "usize" => "a whole number, 0 or more,".to_owned(),
        "a string" => "text".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a sequence" => "a list".to_owned(),
        "fewer elements in array" => "a shorter list".to_owned(),
        _ if wanted.starts_with("struct ") => "an object".to_owned(),
        _ => match wanted.strip_prefix("an array of length ") {
            Some(n) => format!("a list of {n}"),
            None => wanted.to_owned(),
        },
    }
}
