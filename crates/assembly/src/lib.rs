//! Is this an assembly that locks? Pieces as closed meshes, the order in which they are put together and the
//! direction of each go in; a verdict, the play of the pieces and a certificate of both come out.
//!
//! Nothing here knows how the pieces were made. [`verify`] judges at rest and on the ways out, [`motion`]
//! holds contacts as inequalities, [`play`] bounds motions of any size, [`certificate`] writes the proofs
//! down.

pub mod certificate;
pub mod context;
pub mod direction;
pub mod ids;
pub mod motion;
pub mod params;
pub mod play;
pub mod press_fit;
pub mod push;
pub mod sequence;
pub mod verify;

pub use context::{Cancelled, Ctx, Warning};
pub use direction::LatticeDirection;
pub use ids::{IdVec, PatchId};
pub use press_fit::{PressFit, PressFitKind};
pub use sequence::{InstallationPlan, InstallationStep};
