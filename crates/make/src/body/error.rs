//! Reasons why there are no bodies.

use shellock_assembly::LatticeDirection;
use shellock_report::PatchId;

/// Reason why the wall cannot be split.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// Most of a piece lies behind other pieces on its way out, so it would have to leave that part behind.
    #[error("piece {piece} could take only {:.0} % of its wall along", 100.0 * free_share)]
    Blocked {
        /// The piece that is blocked.
        piece: PatchId,
        /// The direction in which it was to leave.
        separation: LatticeDirection,
        /// Share of the piece's wall that is free to leave, in [0, 1].
        free_share: f64,
    },
    /// The user asked to stop.
    #[error(transparent)]
    Cancelled(#[from] shellock_report::Cancelled),
}
