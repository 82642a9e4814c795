//! Reasons why a task fails.

use std::path::{Path, PathBuf};

/// Reason why a task fails, in one line for people.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// A file or folder cannot be read.
    #[error("{path}: {source}", path = path.display())]
    File {
        /// Path as it was given.
        path: PathBuf,
        /// Problem in the words of the system.
        source: std::io::Error,
    },
    /// A source file cannot be parsed.
    #[error("{path}: {problem}", path = path.display())]
    NotRust {
        /// Path as it was given.
        path: PathBuf,
        /// Problem in the words of the parser.
        problem: String,
    },
    /// Comments or lines violate the rules, this many times.
    #[error("{0} violations of the rules for words")]
    Words(usize),
    /// A step of the checks fails.
    #[error("{step} failed: {advice}")]
    Step {
        /// Name of the step that fails.
        step: &'static str,
        /// Next thing to do.
        advice: String,
    },
}

impl Problem {
    /// Makes a failure of a problem with the file at `path`.
    pub fn of_file(path: &Path) -> impl Fn(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::File {
            path: path.clone(),
            source,
        }
    }
}
