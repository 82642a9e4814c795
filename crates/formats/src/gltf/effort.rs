//! Limit on the work that a document can cause beyond the amount bounded by its bytes and triangles.

use std::cell::Cell;

use super::super::ReadError;
use super::error;

/// Largest number of steps: a point moved by one morph target or one joint, or a row that a sparse accessor
/// replaces.
///
/// A step takes 10 to 50 ns, so this is 20 s at worst. A face of 100 000 points with 52 targets and four
/// joints per point takes 6 million.
const MAX_STEPS: u64 = 400_000_000;

/// Counter of the steps so far.
#[derive(Default)]
pub(super) struct Effort(Cell<u64>);

impl Effort {
    /// Counts `n_steps` before they are made; an error beyond the limit.
    pub(super) fn spend(&self, n_steps: usize) -> Result<(), ReadError> {
        let spent = self.0.get().saturating_add(n_steps as u64);
        self.0.set(spent);
        if spent > MAX_STEPS {
            return Err(error(format!(
                "its skins and morph targets need more than {MAX_STEPS} steps; apply them in the program \
                 that made it"
            )));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_steps_than_are_made_are_refused_however_they_are_asked_for() {
        let effort = Effort::default();
        assert_eq!(effort.spend(MAX_STEPS as usize), Ok(()));
        assert!(effort.spend(1).is_err());
        assert!(Effort::default().spend(usize::MAX).is_err());
        assert!(effort.spend(usize::MAX).is_err());
    }
}
