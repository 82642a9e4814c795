//! From a closed mesh to interlocking, printable shell pieces, the plan to install them and the proof that they hold.
//!
//! After Yao, Chen, Xu, Wang, "Interlocking-shell pieces", 2017. The stages, in the only direction that data flows:
//! segmentation → plan → body → connector → piece → verify → report.

pub mod context;
pub mod direction;
pub mod ids;
pub mod plan;
pub mod surface;
pub mod verify;

pub use context::{Cancelled, Ctx, Warning};
pub use direction::LatticeDirection;
pub use ids::{IdVec, PatchId};
pub use surface::{Seam, SegmentedSurface};
