//! Dense pieces of a large symmetric matrix, added up and eliminated one after the other.

use shellock_geom::sparse::{SparseError, eliminate_leading};

/// A symmetric matrix between labelled unknowns: lower triangle by columns.
#[derive(Clone, Debug, Default)]
pub(super) struct Front {
    pub ids: Vec<u32>,
    pub values: Vec<f64>,
}

impl Front {
    /// The sum of `fronts` with all unknowns eliminated that `is_eliminated` names; the others stay, in ascending order.
    pub fn condensed(fronts: &[&Self], is_eliminated: impl Fn(u32) -> bool) -> Result<Self, SparseError> {
        let mut ids: Vec<u32> = fronts.iter().flat_map(|f| &f.ids).copied().collect();
        let key = |id: u32| (!is_eliminated(id), id);
        ids.sort_unstable_by_key(|&id| key(id));
        ids.dedup();
        let n = ids.len();
        let n_eliminated = ids.partition_point(|&id| is_eliminated(id));
        let mut values = vec![0.0; n * n];
        for front in fronts {
            let place: Vec<usize> =
                front.ids.iter().map(|&id| ids.partition_point(|&other| key(other) < key(id))).collect();
            for (j, &column) in place.iter().enumerate() {
                for (i, &row) in place.iter().enumerate().skip(j) {
                    values[row.max(column) + n * row.min(column)] += front.values[i + place.len() * j];
                }
            }
        }
        eliminate_leading(&mut values, n, n_eliminated)?;
        let kept = n - n_eliminated;
        let mut rest = Vec::with_capacity(kept * kept);
        for column in n_eliminated..n {
            rest.extend_from_slice(&values[n * column + n_eliminated..n * (column + 1)]);
        }
        Ok(Self { ids: ids.split_off(n_eliminated), values: rest })
    }

    /// The front with some unknowns held at zero.
    pub fn without(&self, is_held: impl Fn(u32) -> bool) -> Self {
        let n = self.ids.len();
        let kept: Vec<usize> = (0..n).filter(|i| !is_held(self.ids[*i])).collect();
        Self {
            ids: kept.iter().map(|i| self.ids[*i]).collect(),
            values: kept.iter().flat_map(|j| kept.iter().map(move |i| self.values[i + n * j])).collect(),
        }
    }
}
