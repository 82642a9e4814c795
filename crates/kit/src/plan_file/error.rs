//! Problems with a plan file, in sentences.

/// Reasons why a file is no plan, or lacks something that was asked of it.
#[derive(Debug, thiserror::Error)]
pub enum PlanFileError {
    /// The file is no JSON.
    #[error("not a plan: {0}")]
    NotJson(#[source] serde_json::Error),
    /// The file is JSON, but a list, a number or a text.
    #[error("not a plan: it contains no object, which begins with {{")]
    NotAnObject,
    /// `format` or `version` has another value or type.
    #[error("\"format\" and \"version\" are not \"shellock-plan\" and a number; build the kit again")]
    OtherFormat,
    /// The file was written in another version of the format.
    #[error(
        "its version is {version}, but this program reads {}: build the kit again, or use the program that \
         made it",
        super::VERSION
    )]
    OtherVersion {
        /// Version given in the file.
        version: u64,
    },
    /// A command needs a field that the file lacks.
    #[error("\"{field}\" is missing")]
    Missing {
        /// Path of the field, such as `pieces[0].file`.
        field: String,
    },
    /// A field has the wrong type, or lacks a field of its own.
    #[error("\"{field}\": {problem}")]
    Mistyped {
        /// Path of the field, such as `pieces[0].id`; `.` for the whole file.
        field: String,
        /// Problem in the reader's words.
        problem: String,
    },
    /// All fields have the right types, but they contradict each other.
    #[error("{0}")]
    Contradiction(String),
}

impl PlanFileError {
    /// Error for a missing field.
    pub(super) fn missing_field(field: &str) -> Self {
        Self::Missing {
            field: field.to_owned(),
        }
    }
}
