//! Which piece goes in when and along which direction (Sect. 6).

pub mod types;

pub use types::{Blocker, InstallationPlan, InstallationStep, PlanConstraints, PlanOutcome};
