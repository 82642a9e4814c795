//! Failures of a job, and the exit code of each.

use std::path::{Path, PathBuf};

use shellock::MakeError;
use shellock::design::DesignError;
use shellock::stress_test::StressError;
use shellock_formats::ReadError;
use shellock_geom::check::InputError;

/// Code of the warning or failure that says that the time ran out.
pub const TIME_UP: &str = "time-up";

/// Reason why a job failed; the message says what to do if anything can be done.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A file cannot be read.
    #[error("{}: {source}", path.display())]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Reason that the system gives.
        source: std::io::Error,
    },
    /// A file is no mesh.
    #[error("{}: {source}", path.display())]
    NotAMesh {
        /// Path of the file.
        path: PathBuf,
        /// Fault of its contents.
        source: ReadError,
    },
    /// The surface in a file is not one closed body.
    #[error("{}: {source}{}", path.display(), hint(source, objects))]
    NotOneBody {
        /// Path of the file.
        path: PathBuf,
        /// Fault of its surface.
        source: InputError,
        /// Names of the file's objects, where it has several.
        objects: Vec<String>,
    },
    /// An option or an input is wrong.
    #[error("{0}")]
    Wrong(String),
    /// No plan was found.
    #[error("{reason}")]
    NoPlan {
        /// Reason, in words for people.
        reason: String,
        /// True if the time ran out.
        is_cut_short: bool,
    },
    /// A file or folder cannot be written.
    #[error("{}: {source}; nothing was written", path.display())]
    Unwritable {
        /// Path of the file or folder.
        path: PathBuf,
        /// Reason that the system gives.
        source: std::io::Error,
    },
    /// A stage of the design failed.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// A test of a kit failed.
    #[error(transparent)]
    Stress(#[from] StressError),
    /// The user stopped the job.
    #[error("stopped; nothing was written")]
    Stopped,
    /// The user stopped a batch.
    #[error("stopped; finished kits are kept, and the same command continues from here")]
    BatchStopped,
}

/// Names the option that helps, if there is one.
fn hint(error: &InputError, objects: &[String]) -> String {
    match error {
        InputError::Bodies(_) => {}
        InputError::Cutter { .. } => {
            return " (--inside-out cut makes it a hole, --inside-out unite makes it a part)".to_owned();
        }
        _ => return String::new(),
    }
    if objects.is_empty() {
        return " (--largest keeps the largest)".to_owned();
    }
    let listed = list_names(objects);
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
pub fn list_names(names: &[String]) -> String {
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
            | Self::Design(DesignError::Cancelled(_)) => 130,
            Self::NoPlan { .. } => 3,
            Self::Unwritable { .. } | Self::Design(DesignError::Make(MakeError::Piece(_))) => 4,
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
