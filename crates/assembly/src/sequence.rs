//! In which order pieces are put together, and along which direction each: the assembly sequence.

use serde::{Deserialize, Serialize};

use crate::{Direction, PatchId};

/// One piece of a plan and the direction along which it leaves everything installed before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InstallationStep<D = Direction> {
    /// The piece that is put in.
    pub piece: PatchId,
    /// The direction along which it separates; it is installed along the opposite. Without meaning for the
    /// first piece.
    pub separation: D,
}

/// The order in which pieces are installed, first to last, each with its direction: any, or one of a few that
/// a search chooses from. The last piece is the key.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InstallationPlan<D = Direction> {
    /// First to last; every piece once; at least two.
    pub steps: Vec<InstallationStep<D>>,
}

impl<D: Copy> InstallationPlan<D> {
    /// Pieces, first to last, each with the direction along which it separates.
    pub fn new(steps: impl IntoIterator<Item = (PatchId, D)>) -> Self {
        let step = |(piece, separation)| InstallationStep { piece, separation };
        Self {
            steps: steps.into_iter().map(step).collect(),
        }
    }

    /// The piece installed last, the only one that can be taken out.
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

    /// The separation direction of `piece`.
    pub fn separation(&self, piece: PatchId) -> D {
        self.steps[self.position(piece)].separation
    }

    /// The disassembly sequence: key first, first-installed last.
    pub fn removal(&self) -> impl Iterator<Item = InstallationStep<D>> + '_ {
        self.steps.iter().rev().copied()
    }
}
