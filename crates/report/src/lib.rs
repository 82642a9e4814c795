//! Reports of a job to its caller: progress, a request to stop, and warnings.
//!
//! A stage borrows a [`Ctx`]. Through it, the stage reports progress, learns that the user wants to stop, and
//! leaves warnings. A [`Warning`] has a cause, which is a [`Diagnostic`] of the crate that found it. Nothing
//! here knows any cause, nor how a user gives a setting: sentences name settings by their plain names, and
//! each interface adds its own spelling.

mod context;
mod ids;
mod params;
mod warning;
pub mod words;

pub use context::{Cancelled, Ctx, Progress};
pub use ids::{IdVec, PatchId};
pub use params::ParamProblem;
pub use warning::{Diagnostic, LONGEST_SENTENCE, Severity, Told, Warning, WarningEntry};
