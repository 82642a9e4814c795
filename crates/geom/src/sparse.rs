//! Sparse symmetric positive definite systems: factorised once, solved many times.
//!
//! The only file that names the sparse solver. The order of elimination is approximate minimum degree: on the Laplacian of
//! a surface it costs a tenth of nested dissection, which pays only where one pattern is factorised often.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use rayon::prelude::*;

/// A symmetric matrix by its upper triangle, in compressed columns.
#[derive(Clone, Debug)]
pub struct SparseSymmetric {
    n: usize,
    column_start: Vec<u32>,
    row: Vec<u32>,
    value: Vec<f64>,
}

/// Why a matrix could not be factorised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SparseError {
    /// A pivot was not positive, or not a number.
    #[error("the matrix of {n} rows is not positive definite")]
    NotPositiveDefinite {
        /// Number of rows.
        n: usize,
    },
    /// The factor needs more memory or larger indices than there are.
    #[error("the factor of the matrix of {n} rows does not fit into memory")]
    TooLarge {
        /// Number of rows.
        n: usize,
    },
}

impl SparseSymmetric {
    /// The `n × n` matrix with the sums of `entries` (row, column, value), each off-diagonal pair given once in any order.
    ///
    /// Entries at the same place add up in the order given, so the result is the same bits on every run.
    pub fn from_entries(n: usize, mut entries: Vec<(u32, u32, f64)>) -> Self {
        for e in &mut entries {
            if e.0 > e.1 {
                (e.0, e.1) = (e.1, e.0);
            }
        }
        entries.par_sort_by_key(|e| (e.1, e.0));
        let mut matrix = Self { n, column_start: vec![0; n + 1], row: Vec::new(), value: Vec::new() };
        for same in entries.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
            matrix.row.push(same[0].0);
            matrix.value.push(same.iter().map(|e| e.2).sum());
            matrix.column_start[same[0].1 as usize + 1] += 1;
        }
        for column in 0..n {
            matrix.column_start[column + 1] += matrix.column_start[column];
        }
        matrix
    }

    /// Where the values of a place of the matrix are in [`values_mut`](Self::values_mut); `None` where it has none.
    pub fn position(&self, row: u32, column: u32) -> Option<usize> {
        let (row, column) = (row.min(column), row.max(column) as usize);
        let (start, end) = (self.column_start[column] as usize, self.column_start[column + 1] as usize);
        self.row[start..end].binary_search(&row).ok().map(|i| start + i)
    }

    /// The values at all places, to be changed.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.value
    }

    fn pattern(&self) -> SymbolicSparseColMatRef<'_, u32> {
        SymbolicSparseColMatRef::new_checked(self.n, self.n, &self.column_start, None, &self.row)
    }

    /// The matrix times `x`.
    ///
    /// # Panics
    /// Where `x` has fewer numbers than the matrix rows.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.n];
        for (column, ends) in self.column_start.windows(2).enumerate() {
            let mut sum = 0.0;
            for i in ends[0] as usize..ends[1] as usize {
                let (row, value) = (self.row[i] as usize, self.value[i]);
                sum += value * x[row];
                if row != column {
                    y[row] += value * x[column];
                }
            }
            y[column] += sum;
        }
        y
    }
}

/// The order of elimination of a pattern, for all matrices that have it.
#[derive(Clone, Debug)]
pub struct EliminationOrder(Arc<SymbolicCholesky<u32>>);

impl EliminationOrder {
    /// Looks at the places of `matrix` alone, not at its values.
    pub fn new(matrix: &SparseSymmetric) -> Result<Self, SparseError> {
        let n = matrix.n;
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        factorize_symbolic_cholesky(matrix.pattern(), Side::Upper, SymmetricOrdering::Amd, params)
            .map(|symbolic| Self(Arc::new(symbolic)))
            .map_err(|_| SparseError::TooLarge { n })
    }
}

/// The Cholesky factor of a matrix, kept for many right-hand sides.
#[derive(Debug)]
pub struct Cholesky {
    symbolic: Arc<SymbolicCholesky<u32>>,
    values: Vec<f64>,
}

impl Cholesky {
    /// Factorises `matrix`; about 0.1 s for the Laplacian of a surface with 30 000 points.
    pub fn new(matrix: &SparseSymmetric) -> Result<Self, SparseError> {
        Self::in_order(&EliminationOrder::new(matrix)?, matrix)
    }

    /// Factorises `matrix`, which has the pattern that `order` was made for.
    pub fn in_order(order: &EliminationOrder, matrix: &SparseSymmetric) -> Result<Self, SparseError> {
        let n = matrix.n;
        let (pattern, symbolic) = (matrix.pattern(), order.0.clone());
        let mut values = vec![0.0; symbolic.len_val()];
        // More threads never helped at our sizes and made solves tens of times slower.
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).map_err(|_| SparseError::TooLarge { n })?;
        symbolic
            .factorize_numeric_llt(
                &mut values,
                SparseColMatRef::new(pattern, &matrix.value),
                Side::Upper,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|_| SparseError::NotPositiveDefinite { n })?;
        Ok(Self { symbolic, values })
    }

    /// Replaces the right-hand sides, `n` numbers each and one after the other, by their solutions.
    ///
    /// # Panics
    /// Where the length of `sides` is not a multiple of the matrix's rows.
    pub fn solve_in_place(&self, sides: &mut [f64]) {
        let n = self.symbolic.nrows();
        if n == 0 {
            return;
        }
        let n_sides = sides.len() / n;
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(n_sides, Par::Seq));
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(sides, n, n_sides),
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_of_springs_is_solved_exactly() {
        // −x'' = 1 with x = 0 just outside both ends: a parabola, and differences are exact for parabolas.
        let n = 50;
        let mut entries: Vec<(u32, u32, f64)> = (0..n).map(|i| (i, i, 2.0)).collect();
        entries.extend((1..n).map(|i| (i, i - 1, -1.0)));
        let mut x = vec![1.0; 2 * n as usize];
        Cholesky::new(&SparseSymmetric::from_entries(n as usize, entries)).unwrap().solve_in_place(&mut x);
        for i in 0..n as usize {
            let expected = 0.5 * (i + 1) as f64 * (n as usize - i) as f64;
            assert!((x[i] - expected).abs() < 1e-9 && x[i] == x[i + n as usize]);
        }
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let matrix = SparseSymmetric::from_entries(2, vec![(0, 0, 1.0), (1, 1, 1.0), (0, 1, 2.0)]);
        assert_eq!(Cholesky::new(&matrix).unwrap_err(), SparseError::NotPositiveDefinite { n: 2 });
    }
}
