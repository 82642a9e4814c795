//! From a closed mesh to interlocking, printable shell pieces, the plan to install them and the proof that they hold.
//!
//! After Yao, Chen, Xu, Wang, "Interlocking-shell pieces", 2017. The stages, in the only direction that data flows:
//! segmentation → key → sizes → plan → body → connector → piece → verify → certificate → report.

pub mod body;
pub mod certificate;
pub mod connector;
pub mod context;
pub mod direction;
pub mod feedback;
pub mod figure;
pub mod ids;
mod impact;
pub mod key;
pub mod metric;
pub mod motion;
pub mod params;
pub mod piece;
pub mod pipeline;
pub mod plan;
pub mod play;
pub mod push;
pub mod report;
pub mod seam;
pub mod segmentation;
pub mod sizes;
pub mod strength;
pub mod stress_test;
pub mod surface;
mod svg;
#[cfg(test)]
mod testing;
pub mod verify;

pub use context::{Cancelled, Ctx, Warning};
pub use direction::LatticeDirection;
pub use ids::{IdVec, PatchId};
pub use seam::graph::{Contact, ContactGraph};
pub use sizes::ConnectorSizes;
pub use surface::{Seam, SegmentedSurface};
