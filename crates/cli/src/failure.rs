//! How a command can end badly, and the exit code of each way.

use std::path::{Path, PathBuf};

use shellock::design::DesignError;
use shellock::stress_test::StressError;
use shellock_formats::ReadError;
use shellock_geom::check::InputError;

/// The code of the warning, or failure, that the time was over.
pub const TIME_UP: &str = "time-up";

/// Why a command failed; each message says what to do where something can be done.
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
    #[error("stopped; nothing was written")]
    Stopped,
    #[error("stopped; kits that are made stay, and the same command goes on from here")]
    BatchStopped,
}

/// The option that helps, where there is one.
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
        "; the file's objects are {listed}: choose one with --object NAME{plate}, or --largest keeps the largest body"
    )
}

/// The first of some names, and how many more there are.
pub fn listed(names: &[String]) -> String {
    /// Names that a message lists.
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
            | Self::Design(DesignError::Cancelled(_)) => 130,
            Self::NoPlan { .. } => 3,
            Self::Unwritable { .. } | Self::Design(DesignError::Piece(_)) => 4,
            _ => 2,
        }
    }

    /// What programs know it by, where they need to: as of a warning.
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

    /// A file that could not be written.
    pub fn unwritable(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |source| Self::Unwritable {
            path: path.to_owned(),
            source,
        }
    }
}
