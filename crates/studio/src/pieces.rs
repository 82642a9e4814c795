//! Pieces of a model as the page shows them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use shellock::SegmentedSurface;

/// Pieces as the page shows them.
#[derive(Clone)]
pub struct Pieces {
    /// Labels from 0, one for each triangle that is shown.
    pub labels: Arc<Vec<u32>>,
    /// True if a person changed the pieces; otherwise `build` divides by itself.
    pub is_painted: bool,
    /// Division that the pieces show; `None` once the options would give another.
    pub division: Option<Arc<SegmentedSurface>>,
    /// Notes on the division.
    pub notes: Vec<String>,
}

impl Pieces {
    /// Pieces with these labels, which a person chose.
    pub fn painted_by_hand(labels: Vec<u32>) -> Self {
        Self {
            labels: Arc::new(labels),
            is_painted: true,
            division: None,
            notes: Vec::new(),
        }
    }

    /// Number of pieces of the kit.
    pub fn n(&self) -> usize {
        self.labels.iter().collect::<BTreeSet<_>>().len()
    }

    /// Piece number of each triangle, from 1, as in the files and for people.
    pub fn numbers(&self) -> Vec<i64> {
        self.labels.iter().map(|&label| i64::from(label) + 1).collect()
    }
}

/// Label in `after` with most of the area of the faces labelled `label` in `before`; `None` if there are
/// none.
pub fn successor(label: i64, before: &[i64], after: &[i64], area: impl Fn(usize) -> f64) -> Option<i64> {
    let mut areas: BTreeMap<i64, f64> = BTreeMap::new();
    for (face, _) in before.iter().enumerate().filter(|(_, of)| **of == label) {
        *areas.entry(after[face]).or_default() += area(face);
    }
    let largest = areas.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    largest.map(|(label, _)| label)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_successor_of_a_label_has_most_of_its_area() {
        let areas = [1.0, 5.0, 2.0, 2.0, 9.0];
        let (before, after) = ([7, 7, 7, 7, 8], [1, 2, 3, 3, 1]);
        let of = |label| successor(label, &before, &after, |face| areas[face]);
        assert_eq!((of(7), of(8), of(9)), (Some(2), Some(1), None));
    }
}
