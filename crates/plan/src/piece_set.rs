//! Small sets of pieces as bits, so that the search and the cluster test run in microseconds.

use shellock_report::PatchId;

/// A set of up to [`PieceSet::MAX_PIECES`] pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PieceSet(u128);

impl PieceSet {
    /// Exclusive upper bound on the ids in a set.
    pub const MAX_PIECES: usize = 128;

    /// The set without any pieces.
    pub const EMPTY: Self = Self(0);

    /// The pieces 0 … n − 1; `n` ≤ [`Self::MAX_PIECES`].
    pub fn first(n: usize) -> Self {
        assert!(n <= Self::MAX_PIECES, "callers refuse more pieces");
        if n == Self::MAX_PIECES {
            Self(u128::MAX)
        } else {
            Self((1 << n) - 1)
        }
    }

    /// Creates the set of `piece` alone.
    pub fn one(piece: PatchId) -> Self {
        Self(1 << piece.0)
    }

    /// Number of pieces in the set.
    pub fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Returns true if the set has no pieces.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Returns true if the set contains `piece`.
    pub fn contains(self, piece: PatchId) -> bool {
        self.0 >> piece.0 & 1 == 1
    }

    /// Pieces that are in at least one of the sets.
    pub fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Pieces that are in both sets.
    pub fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// The pieces of `self` that are not in `other`.
    pub fn minus(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// The pieces in order of their ids.
    pub fn iter(self) -> impl Iterator<Item = PatchId> {
        let mut left = self.0;
        std::iter::from_fn(move || {
            let lowest = (left != 0).then(|| left.trailing_zeros())?;
            left &= left - 1;
            Some(PatchId(lowest))
        })
    }

    /// Pieces that arcs lead to from `start`, `start` included. `arcs` holds the targets of each piece.
    pub fn reached_from(start: PatchId, arcs: &[Self]) -> Self {
        let mut seen = Self::one(start);
        let mut front = seen;
        while front.0 != 0 {
            let x = front.0.trailing_zeros();
            front.0 &= front.0 - 1;
            let new = arcs[x as usize].minus(seen);
            seen = seen.union(new);
            front = front.union(new);
        }
        seen
    }

    /// Returns true if `neighbours`, a symmetric relation, connects the pieces of the set; true for the empty
    /// set.
    pub fn is_connected(self, neighbours: &[Self]) -> bool {
        self.is_joined_within(self, neighbours)
    }

    /// Returns true if the pieces of the set are connected to each other directly or through pieces of
    /// `bridges`; true for the empty set.
    pub fn is_joined_within(self, bridges: Self, neighbours: &[Self]) -> bool {
        let Some(start) = self.iter().next() else {
            return true;
        };
        let mut seen = Self::one(start);
        let mut front = seen;
        while front.0 != 0 {
            let x = front.0.trailing_zeros();
            front.0 &= front.0 - 1;
            let new = neighbours[x as usize].and(bridges.union(self)).minus(seen);
            seen = seen.union(new);
            front = front.union(new);
        }
        self.minus(seen).is_empty()
    }
}

impl FromIterator<PatchId> for PieceSet {
    fn from_iter<I: IntoIterator<Item = PatchId>>(pieces: I) -> Self {
        pieces
            .into_iter()
            .fold(Self::EMPTY, |set, p| set.union(Self::one(p)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_hold_what_was_put_in_up_to_the_last_id() {
        let ids = [PatchId(0), PatchId(5), PatchId(127)];
        let set: PieceSet = ids.into_iter().collect();
        assert_eq!(set.iter().collect::<Vec<_>>(), ids);
        assert_eq!(PieceSet::first(128).minus(set).len(), 125);
    }

    #[test]
    fn as_many_pieces_may_be_asked_for_as_can_be_planned() {
        assert_eq!(shellock_divide::segmentation::MOST_PIECES, PieceSet::MAX_PIECES);
        let asked = |n| {
            shellock_divide::segmentation::SegmentationParams {
                n_pieces: Some(n),
                ..Default::default()
            }
            .problems()
        };
        assert_eq!(
            (
                asked(PieceSet::MAX_PIECES).len(),
                asked(PieceSet::MAX_PIECES + 1).len()
            ),
            (0, 1)
        );
    }

    #[test]
    fn a_path_without_its_middle_is_not_connected() {
        let arcs =
            [[1].as_slice(), &[0, 2], &[1]].map(|a| a.iter().map(|&i| PatchId(i)).collect::<PieceSet>());
        assert!(PieceSet::first(3).is_connected(&arcs));
        assert!(
            !PieceSet::first(3)
                .minus(PieceSet::one(PatchId(1)))
                .is_connected(&arcs)
        );
    }
}
