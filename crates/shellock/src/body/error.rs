//! Why there are no bodies.

use crate::{LatticeDirection, PatchId};

/// Why the wall cannot be split.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// Most of a piece lies behind others on its way out, so that it would have to leave that behind.
    #[error("piece {piece} could take only {:.0} % of its wall along", 100.0 * kept)]
    Blocked {
        /// The piece.
        piece: PatchId,
        /// The direction in which it was to leave.
        separation: LatticeDirection,
        /// Share of its wall that is free, in [0, 1].
        kept: f64,
    },
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] crate::Cancelled),
}
