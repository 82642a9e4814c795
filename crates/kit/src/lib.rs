//! A kit's own file: what `plan.json` says of a design, and reading that back.
//!
//! Bytes in, bytes out: where the file lies is the caller's business.

pub mod plan_file;

pub use plan_file::{PlanFile, PlanFileError};
