//! Dense blocks of a large symmetric matrix, assembled and eliminated one after the other.

use shellock_geom::sparse::{SparseError, eliminate_first};

/// Symmetric matrix between labelled unknowns: lower triangle, column-major.
#[derive(Clone, Debug, Default)]
pub(super) struct Front {
    pub ids: Vec<u32>,
    pub values: Vec<f64>,
}

impl Front {
    /// Sums `fronts` and eliminates the unknowns chosen by `is_eliminated`; the others remain, in ascending
    /// order.
    pub fn condense(fronts: &[&Self], is_eliminated: impl Fn(u32) -> bool) -> Result<Self, SparseError> {
        let mut ids: Vec<u32> = fronts.iter().flat_map(|f| &f.ids).copied().collect();
        let key = |id: u32| (!is_eliminated(id), id);
        ids.sort_unstable_by_key(|&id| key(id));
        ids.dedup();
        let n = ids.len();
        let n_eliminated = ids.partition_point(|&id| is_eliminated(id));
        let mut values = vec![0.0; n * n];
        for front in fronts {
            let place: Vec<usize> = front
                .ids
                .iter()
                .map(|&id| ids.partition_point(|&other| key(other) < key(id)))
                .collect();
            let is_sorted = place.is_sorted();
            for (j, &column) in place.iter().enumerate() {
                let source = &front.values[place.len() * j + j..place.len() * (j + 1)];
                if is_sorted && place[place.len() - 1] - column == source.len() - 1 {
                    // Consecutive unknowns, as the wall's are, are added in one run.
                    values[n * column + column..][..source.len()]
                        .iter_mut()
                        .zip(source)
                        .for_each(|(v, s)| *v += s);
                    continue;
                }
                for (&row, s) in place[j..].iter().zip(source) {
                    values[row.max(column) + n * row.min(column)] += s;
                }
            }
        }
        eliminate_first(&mut values, n, n_eliminated)?;
        let kept = n - n_eliminated;
        let mut rest = Vec::with_capacity(kept * kept);
        for column in n_eliminated..n {
            rest.extend_from_slice(&values[n * column + n_eliminated..n * (column + 1)]);
        }
        Ok(Self {
            ids: ids.split_off(n_eliminated),
            values: rest,
        })
    }

    /// Couples unknown `id` to `others`, which are ascending and all before it.
    pub fn coupling(id: u32, others: &[(u32, f64)]) -> Self {
        let n = others.len() + 1;
        let mut values = vec![0.0; n * n];
        for (column, (_, value)) in others.iter().enumerate() {
            values[n - 1 + n * column] = *value;
        }
        Self {
            ids: others.iter().map(|o| o.0).chain([id]).collect(),
            values,
        }
    }

    /// Front with some unknowns held at zero.
    pub fn without(&self, is_held: impl Fn(u32) -> bool) -> Self {
        let n = self.ids.len();
        let kept: Vec<usize> = (0..n).filter(|i| !is_held(self.ids[*i])).collect();
        Self {
            ids: kept.iter().map(|i| self.ids[*i]).collect(),
            values: kept
                .iter()
                .flat_map(|j| kept.iter().map(move |i| self.values[i + n * j]))
                .collect(),
        }
    }
}
