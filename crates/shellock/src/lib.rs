//! From a closed mesh to interlocking, printable shell pieces, the plan to install them and the proof that
//! they hold.
//!
//! After Yao, Chen, Xu, Wang, "Modeling, Evaluation and Optimization of Interlocking Shell Pieces", Computer
//! Graphics Forum 36(7), Pacific Graphics 2017. The stages, in the only direction that data flows:
//! segmentation → key → sizes → plan → body → connector → piece → verify → certificate → report.

pub mod body;
pub mod connector;
pub mod design;
pub mod figure;
mod impact;
pub mod key;
pub mod metric;
pub mod piece;
pub mod plan;
pub mod seam;
pub mod segmentation;
pub mod sizes;
pub mod strength;
pub mod stress_test;
pub mod surface;
#[cfg(test)]
mod testing;

pub use design::{Design, DesignError, DesignOutcome, Kit, Params, Settings, design};
pub use seam::graph::{Contact, ContactGraph};
pub use shellock_assembly::{
    Cancelled, Ctx, IdVec, InstallationPlan, InstallationStep, LatticeDirection, PatchId, PressFit,
    PressFitKind, Verdict, Warning, certificate, context, direction, ids, motion, params, play, push, verify,
};
pub use sizes::ConnectorSizes;
pub use surface::{Seam, SegmentedSurface};
