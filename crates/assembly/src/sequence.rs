//! Assembly sequence: the order of installation of the pieces, and the direction of each.

use serde::{Deserialize, Serialize};

use crate::{Direction, PatchId};

/// One piece of a plan and the direction along which it leaves everything installed before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InstallationStep<D = Direction> {
    /// Piece that is installed.
    pub piece: PatchId,
    /// Direction along which the piece separates; it is installed along the opposite one. Meaningless for the
    /// first piece.
    pub separation: D,
}

/// Order in which pieces are installed, first to last, each with its direction: an arbitrary one, or one of a
/// few that a search chooses from. The last piece is the key.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InstallationPlan<D = Direction> {
    /// Steps, first to last; every piece once; at least two.
    pub steps: Vec<InstallationStep<D>>,
}

impl<D: Copy> InstallationPlan<D> {
    /// Builds a plan of pieces, first to last, each with the direction along which it separates.
    pub fn new(steps: impl IntoIterator<Item = (PatchId, D)>) -> Self {
        let step = |(piece, separation)| InstallationStep { piece, separation };
        Self {
            steps: steps.into_iter().map(step).collect(),
        }
    }

    /// Piece installed last, the only one that can be taken out.
    pub fn key(&self) -> PatchId {
        self.steps[self.steps.len() - 1].piece
    }

    /// Position of `piece` in the order, 0 for the first installed.
    pub fn position(&self, piece: PatchId) -> usize {
        self.steps
            .iter()
            .position(|s| s.piece == piece)
            .expect("a plan names every piece once")
    }

    /// Separation direction of `piece`, as planned.
    pub fn separation(&self, piece: PatchId) -> D {
        self.steps[self.position(piece)].separation
    }

    /// Disassembly sequence: key first, first-installed piece last.
    pub fn removal(&self) -> impl Iterator<Item = InstallationStep<D>> + '_ {
        self.steps.iter().rev().copied()
    }
}
