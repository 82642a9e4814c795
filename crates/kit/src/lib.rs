//! The kit's own file `plan.json`: writing it from a design, and reading it back.
//!
//! Works on bytes. File access is left to the caller.

pub mod plan_file;

pub use plan_file::{PlanFile, PlanFileError};
