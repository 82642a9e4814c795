//! Reason why a trial failed, with the pieces to blame.

use crate::PatchId;
use crate::plan::Blocker;

/// Reason why a trial failed.
#[derive(Clone, Default)]
pub(super) struct Failure {
    pub reason: String,
    pub blockers: Vec<Blocker>,
    /// Pieces whose division may help, most promising first.
    pub suspects: Vec<PatchId>,
    /// Pieces that no seam long enough for connectors joins to most others, or only through one piece.
    pub apart: Vec<PatchId>,
    /// Pieces that came out loose in the last kit.
    pub loose: Vec<PatchId>,
}

impl Failure {
    pub fn of(reason: &str) -> Self {
        Self {
            reason: reason.to_owned(),
            ..Self::default()
        }
    }

    /// Two pieces never lock: if the key leaves one way, nothing keeps the other piece from leaving the
    /// opposite way.
    pub fn of_two() -> Self {
        Self {
            suspects: vec![PatchId(0), PatchId(1)],
            ..Self::of("two pieces come apart whichever of them is pulled; three can lock")
        }
    }

    /// The failure of a later plan, whose blame comes first, with the blame of this one.
    pub fn after(&self, later: Self) -> Self {
        Self {
            suspects: later.suspects.iter().chain(&self.suspects).copied().collect(),
            loose: self.loose.clone(),
            ..later
        }
    }
}
