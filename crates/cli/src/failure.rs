//! Failures of a command, and the exit code of each.

use std::path::{Path, PathBuf};

use shellock::design::DesignError;
use shellock::stress_test::StressError;
use shellock_formats::ReadError;
use shellock_geom::check::InputError;
use shellock_volume::compare::CompareError;

/// Code of the warning or failure that says that the time ran out.
pub const TIME_UP: &str = "time-up";

/// Reason why a command failed; the message says what to do if anything can be done.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    #[error("{}: {source}", path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error("{}: {source}", path.display())]
    NotAMesh { path: PathBuf, source: ReadError },
    #[error("{}: {source}{}", path.display(), hint(source, objects))]
    NotOneBody {
        path: PathBuf,
        source: InputError,
        /// Names of the file's objects, where it has several.
        objects: Vec<String>,
    },
    #[error("{0}")]
    Wrong(String),
    #[error("{told}")]
    NoPlan { told: String, is_cut_short: bool },
    #[error("{}: {source}; nothing was written", path.display())]
    Unwritable { path: PathBuf, source: std::io::Error },
    #[error(transparent)]
    Design(#[from] DesignError),
    #[error(transparent)]
    Stress(#[from] StressError),
    #[error(transparent)]
    Compare(#[from] CompareError),
    #[error("stopped; nothing was written")]
    Stopped,
    #[error("stopped; kits that are made stay, and the same command goes on from here")]
    BatchStopped,
}

/// Names the option that helps, if there is one.
fn hint(error: &InputError, objects: &[String]) -> String {
    match error {
        InputError::Bodies(_) => {}
        InputError::Cutter { .. } => {
            return " (--inside-out cut makes the hole, --inside-out unite the part)".to_owned();
        }
        _ => return String::new(),
    }
    if objects.is_empty() {
        return " (--largest keeps the largest)".to_owned();
    }
    let listed = listed(objects);
    let plate = if listed.contains("(plate ") {
        " or --plate N"
    } else {
        ""
    };
    format!(
        "; the file's objects are {listed}: choose one with --object NAME{plate}, or --largest keeps the \
         largest body"
    )
}

/// Lists the first names, and the number of those left out.
pub fn listed(names: &[String]) -> String {
    /// Number of names that a message lists.
    const N_LISTED: usize = 8;
    let first = names[..names.len().min(N_LISTED)].join(", ");
    match names.len().saturating_sub(N_LISTED) {
        0 => first,
        n => format!("{first} and {n} more"),
    }
}

impl From<shellock::Cancelled> for Failure {
    fn from(_: shellock::Cancelled) -> Self {
        Self::Stopped
    }
}

impl Failure {
    /// The process exit code.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Stopped
            | Self::BatchStopped
            | Self::Stress(StressError::Cancelled(_))
            | Self::Compare(CompareError::Test(StressError::Cancelled(_)))
            | Self::Design(DesignError::Cancelled(_)) => 130,
            Self::NoPlan { .. } => 3,
            Self::Unwritable { .. } | Self::Design(DesignError::Piece(_)) => 4,
            _ => 2,
        }
    }

    /// Code by which programs can recognise the failure, like the code of a warning; `None` for most.
    pub fn code(&self) -> Option<&'static str> {
        matches!(
            self,
            Self::NoPlan {
                is_cut_short: true,
                ..
            }
        )
        .then_some(TIME_UP)
    }

    /// Returns a function that turns an error into the failure to write `path`.
    pub fn unwritable(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |source| Self::Unwritable {
            path: path.to_owned(),
            source,
        }
    }
}
