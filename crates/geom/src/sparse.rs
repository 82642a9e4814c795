//! Sparse symmetric positive definite systems, factorised once and solved many times.
//!
//! No other file names the sparse solver. The order of elimination is approximate minimum degree. On the
//! Laplacian of a surface this order costs a tenth of nested dissection, which only pays if one pattern is
//! factorised often.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltRegularization, cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, amd};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Accum, Conj, Mat, MatMut, Par, Side};
use rayon::prelude::*;

/// A symmetric matrix, stored as its upper triangle in compressed columns.
#[derive(Clone, Debug)]
pub struct SparseSymmetric {
    n: usize,
    column_start: Vec<u32>,
    row: Vec<u32>,
    value: Vec<f64>,
}

/// Reason why a matrix could not be factorised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SparseError {
    /// A pivot was not positive, or not a number.
    #[error("the matrix of {n} rows is not positive definite")]
    NotPositiveDefinite {
        /// Number of rows of the matrix.
        n: usize,
    },
    /// The factor needs more memory or larger indices than available.
    #[error("the factor of the matrix of {n} rows does not fit into memory")]
    TooLarge {
        /// Number of rows of the matrix.
        n: usize,
    },
}

impl SparseSymmetric {
    /// Builds the `n × n` matrix with the sums of `entries` (row, column, value). Each off-diagonal pair is
    /// given once, in either order.
    ///
    /// Entries at the same place add up in the order given, so the result has the same bits on every run.
    pub fn from_entries(n: usize, mut entries: Vec<(u32, u32, f64)>) -> Self {
        for e in &mut entries {
            if e.0 > e.1 {
                (e.0, e.1) = (e.1, e.0);
            }
        }
        entries.par_sort_by_key(|e| (e.1, e.0));
        let mut matrix = Self {
            n,
            column_start: vec![0; n + 1],
            row: Vec::new(),
            value: Vec::new(),
        };
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

    /// Builds a zero matrix with `block` rows per node and places between all nodes of each cell, like a
    /// mesh's stiffness matrix.
    ///
    /// # Panics
    /// Panics if a cell names a node that is not below `n_nodes`.
    pub fn of_cells<const N: usize>(n_nodes: usize, block: usize, cells: &[[u32; N]]) -> Self {
        let pairs = cells
            .iter()
            .flat_map(|cell| cell.iter().flat_map(move |&i| cell.iter().map(move |&j| (j, i))));
        let mut pairs: Vec<(u32, u32)> = pairs
            .filter(|(j, i)| i <= j)
            .chain((0..n_nodes as u32).map(|i| (i, i)))
            .collect();
        pairs.par_sort_unstable();
        pairs.dedup();
        let (n, block_rows) = (n_nodes * block, block as u32);
        let mut matrix = Self {
            n,
            column_start: vec![0],
            row: Vec::new(),
            value: Vec::new(),
        };
        for column in pairs.chunk_by(|x, y| x.0 == y.0) {
            for c in 0..block_rows {
                for &(j, i) in column {
                    let n_rows = if i == j { c + 1 } else { block_rows };
                    matrix.row.extend((0..n_rows).map(|r| i * block_rows + r));
                }
                matrix.column_start.push(matrix.row.len() as u32);
            }
        }
        matrix.value = vec![0.0; matrix.row.len()];
        matrix
    }

    /// Number of places in the pattern's upper triangle.
    pub fn n_places(&self) -> usize {
        self.value.len()
    }

    /// Row and column of each place, in the order of [`values_mut`](Self::values_mut).
    pub fn places(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.column_start.windows(2).zip(0..).flat_map(|(ends, column)| {
            self.row[ends[0] as usize..ends[1] as usize]
                .iter()
                .map(move |&row| (row, column))
        })
    }

    /// Index in [`values_mut`](Self::values_mut) of the place at `row` and `column`, in either order; `None`
    /// if the pattern has no such place.
    pub fn position(&self, row: u32, column: u32) -> Option<usize> {
        let (row, column) = (row.min(column), row.max(column) as usize);
        let (start, end) = (
            self.column_start[column] as usize,
            self.column_start[column + 1] as usize,
        );
        self.row[start..end].binary_search(&row).ok().map(|i| start + i)
    }

    /// Mutable values at all places.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.value
    }

    fn pattern(&self) -> SymbolicSparseColMatRef<'_, u32> {
        SymbolicSparseColMatRef::new_checked(self.n, self.n, &self.column_start, None, &self.row)
    }

    /// Multiplies the matrix by `x`.
    ///
    /// # Panics
    /// Panics if `x` has fewer numbers than the matrix has rows.
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

    /// Schur complement of the last `n_kept` rows and columns, after elimination of all others: dense, lower
    /// triangle by columns, with zeros above.
    ///
    /// Costs one factorisation. The matrix need only be positive definite in the rows eliminated, and
    /// positive semidefinite as a whole.
    pub fn schur_complement(mut self, n_kept: usize) -> Result<Vec<f64>, SparseError> {
        let (n, first_kept) = (self.n, self.n - n_kept.min(self.n));
        // The kept rows are eliminated last, and multiplied back together. Springs on their diagonal make
        // them definite, and are subtracted at the end.
        let mut spring = 0.0_f64;
        for column in first_kept..n {
            let last = self.column_start[column + 1] as usize - 1;
            spring = spring.max(self.value[last].abs());
        }
        for column in first_kept..n {
            self.value[self.column_start[column + 1] as usize - 1] += spring;
        }
        let leading = SymbolicSparseColMatRef::new_checked(
            first_kept,
            first_kept,
            &self.column_start[..=first_kept],
            None,
            &self.row[..self.column_start[first_kept] as usize],
        );
        let ordered = symbolic(leading, SymmetricOrdering::Amd)?;
        let (order, place) = ordered.perm().ok_or(SparseError::TooLarge { n })?.arrays();
        let kept = first_kept as u32..n as u32;
        let order: Vec<u32> = order.iter().copied().chain(kept.clone()).collect();
        let place: Vec<u32> = place.iter().copied().chain(kept).collect();
        let factor = Cholesky::factorise(
            &self,
            SymmetricOrdering::Custom(PermRef::new_checked(&order, &place, n)),
        )?;

        let l = factor.trailing_block(first_kept)?;
        let mut schur = Mat::<f64>::zeros(n_kept, n_kept);
        let (lower, upper) = (BlockStructure::TriangularLower, BlockStructure::TriangularUpper);
        triangular::matmul(
            schur.as_mut(),
            lower,
            Accum::Replace,
            l.as_ref(),
            lower,
            l.transpose(),
            upper,
            1.0,
            Par::Seq,
        );
        Ok((0..n_kept * n_kept)
            .map(|at| {
                let (row, column) = (at % n_kept, at / n_kept);
                schur[(row, column)] - if row == column { spring } else { 0.0 }
            })
            .collect())
    }
}

/// Order of elimination of a pattern, for all matrices that have that pattern.
#[derive(Clone, Debug)]
pub struct EliminationOrder(Arc<SymbolicCholesky<u32>>);

impl EliminationOrder {
    /// Computes the order from the places of `matrix`; its values do not matter.
    pub fn new(matrix: &SparseSymmetric) -> Result<Self, SparseError> {
        symbolic(matrix.pattern(), SymmetricOrdering::Amd).map(|s| Self(Arc::new(s)))
    }

    /// Computes the order like [`new`](Self::new), but for a matrix of dense blocks of `block` rows and
    /// columns, which stay together. The order is sought on the blocks, in a fraction of the time.
    ///
    /// # Panics
    /// Panics if the number of rows is not a multiple of `block`.
    pub fn of_blocks(matrix: &SparseSymmetric, block: usize) -> Result<Self, SparseError> {
        assert!(
            matrix.n.is_multiple_of(block),
            "{} rows are not blocks of {block}",
            matrix.n
        );
        let (n, n_blocks) = (matrix.n, matrix.n / block);
        let (mut start, mut row) = (vec![0], Vec::new());
        for column in 0..n_blocks {
            let last = column * block + block - 1;
            let rows =
                &matrix.row[matrix.column_start[last] as usize..matrix.column_start[last + 1] as usize];
            row.extend(
                rows.chunk_by(|i, j| *i as usize / block == *j as usize / block)
                    .map(|b| b[0] / block as u32),
            );
            start.push(row.len() as u32);
        }
        let pattern = SymbolicSparseColMatRef::new_checked(n_blocks, n_blocks, &start, None, &row);
        let (mut order, mut place) = (vec![0; n_blocks], vec![0; n_blocks]);
        let mut memory = MemBuffer::try_new(amd::order_scratch::<u32>(n_blocks, row.len()))
            .map_err(|_| SparseError::TooLarge { n })?;
        amd::order(
            &mut order,
            &mut place,
            pattern,
            amd::Control::default(),
            MemStack::new(&mut memory),
        )
        .map_err(|_| SparseError::TooLarge { n })?;
        let rows_of = |blocks: &[u32]| -> Vec<u32> {
            blocks
                .iter()
                .flat_map(|b| (0..block as u32).map(move |r| b * block as u32 + r))
                .collect()
        };
        let (order, place) = (rows_of(&order), rows_of(&place));
        let ordering = SymmetricOrdering::Custom(PermRef::new_checked(&order, &place, n));
        symbolic(matrix.pattern(), ordering).map(|s| Self(Arc::new(s)))
    }
}

/// Number of columns that one thread works on: enough for dense products at full speed, and for several
/// panels in a front of a part.
const PANEL: usize = 192;

/// Eliminates the first `n_eliminated` rows and columns of a dense symmetric `n × n` matrix. `values` has the
/// lower triangle by columns. It is overwritten by the factor L of the eliminated block, `B L⁻ᵀ` below L, and
/// the Schur complement.
///
/// Only the eliminated block must be positive definite. The strict upper triangle of `values` is not read,
/// and is meaningless afterwards.
///
/// # Panics
/// Panics if `values` does not have `n²` entries, or if `n_eliminated` exceeds `n`.
pub fn eliminate_first(values: &mut [f64], n: usize, n_eliminated: usize) -> Result<(), SparseError> {
    let matrix = MatMut::from_column_major_slice_mut(values, n, n);
    let (mut pivot, _, mut below, rest) = matrix.split_at_mut(n_eliminated, n_eliminated);
    let mut memory = MemBuffer::try_new(cholesky_in_place_scratch::<f64>(
        n_eliminated,
        Par::Seq,
        Default::default(),
    ))
    .map_err(|_| SparseError::TooLarge { n })?;
    cholesky_in_place(
        pivot.as_mut(),
        LltRegularization::default(),
        Par::Seq,
        MemStack::new(&mut memory),
        Default::default(),
    )
    .map_err(|_| SparseError::NotPositiveDefinite { n })?;
    for_panels(below.as_mut().transpose_mut(), 0, &|_, panel| {
        solve_lower_triangular_in_place(pivot.as_ref(), panel, Par::Seq);
    });
    let below = below.as_ref();
    for_panels(rest, 0, &|first, panel| {
        let n_rows = panel.nrows() - first;
        let (left, right) = (below.subrows(first, n_rows), below.subrows(first, panel.ncols()));
        matmul(
            panel.subrows_mut(first, n_rows),
            Accum::Add,
            left,
            right.transpose(),
            -1.0,
            Par::Seq,
        );
    });
    Ok(())
}

/// Calls `f` in parallel for panels of [`PANEL`] columns, with the index of the first column. The panels are
/// the same on any number of threads.
fn for_panels(columns: MatMut<'_, f64>, first: usize, f: &(impl Fn(usize, MatMut<'_, f64>) + Sync)) {
    let n_panels = columns.ncols().div_ceil(PANEL);
    if n_panels <= 1 {
        return f(first, columns);
    }
    let half = n_panels / 2 * PANEL;
    let (left, right) = columns.split_at_col_mut(half);
    rayon::join(
        || for_panels(left, first, f),
        || for_panels(right, first + half, f),
    );
}

fn symbolic(
    pattern: SymbolicSparseColMatRef<'_, u32>,
    order: SymmetricOrdering<'_, u32>,
) -> Result<SymbolicCholesky<u32>, SparseError> {
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        ..Default::default()
    };
    factorize_symbolic_cholesky(pattern, Side::Upper, order, params)
        .map_err(|_| SparseError::TooLarge { n: pattern.nrows() })
}

/// Cholesky factor of a matrix, kept for many right-hand sides.
#[derive(Debug)]
pub struct Cholesky {
    symbolic: Arc<SymbolicCholesky<u32>>,
    values: Vec<f64>,
}

impl Cholesky {
    /// Factorises `matrix`; takes about 0.1 s for the Laplacian of a surface with 30 000 points.
    pub fn new(matrix: &SparseSymmetric) -> Result<Self, SparseError> {
        Self::in_order(&EliminationOrder::new(matrix)?, matrix)
    }

    fn factorise(matrix: &SparseSymmetric, order: SymmetricOrdering<'_, u32>) -> Result<Self, SparseError> {
        Self::in_order(
            &EliminationOrder(Arc::new(symbolic(matrix.pattern(), order)?)),
            matrix,
        )
    }

    /// Factorises `matrix`, which must have the pattern that `order` was made for.
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

    /// Rows and columns of the factor from `first` on, in the order of elimination.
    fn trailing_block(&self, first: usize) -> Result<Mat<f64>, SparseError> {
        let n = self.symbolic.nrows();
        let SymbolicCholeskyRaw::Supernodal(symbolic) = self.symbolic.raw() else {
            return Err(SparseError::TooLarge { n });
        };
        let factor = SupernodalLltRef::new(symbolic, &self.values);
        let mut trailing = Mat::zeros(n - first, n - first);
        for s in 0..symbolic.n_supernodes() {
            let node = factor.supernode(s);
            let (value, width) = (node.val(), node.val().ncols());
            for j in 0..width {
                let column = node.start() + j;
                if column < first {
                    continue;
                }
                for i in j..width {
                    trailing[(node.start() + i - first, column - first)] = value[(i, j)];
                }
                for (i, row) in (width..).zip(node.pattern()) {
                    trailing[(*row as usize - first, column - first)] = value[(i, j)];
                }
            }
        }
        Ok(trailing)
    }

    /// Number of rows of the matrix.
    pub fn n_rows(&self) -> usize {
        self.symbolic.nrows()
    }

    /// Replaces the right-hand sides, `n` numbers each and one after the other, by their solutions.
    ///
    /// # Panics
    /// Panics if the length of `sides` is not a multiple of the matrix's rows.
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
        // The problem −x'' = 1 with x = 0 just outside both ends has a parabola as solution, for which
        // differences are exact.
        let n = 50;
        let mut entries: Vec<(u32, u32, f64)> = (0..n).map(|i| (i, i, 2.0)).collect();
        entries.extend((1..n).map(|i| (i, i - 1, -1.0)));
        let mut x = vec![1.0; 2 * n as usize];
        Cholesky::new(&SparseSymmetric::from_entries(n as usize, entries))
            .unwrap()
            .solve_in_place(&mut x);
        for i in 0..n as usize {
            let expected = 0.5 * (i + 1) as f64 * (n as usize - i) as f64;
            assert!((x[i] - expected).abs() < 1e-9 && x[i] == x[i + n as usize]);
        }
    }

    /// A chain of springs between fixed ends, whose ends are kept.
    fn chain() -> (Vec<(u32, u32, f64)>, Vec<f64>) {
        let n = 12_u32;
        // Nodes 10 and 11 are the two free ends; the chain is 10 – 0 – 1 … 9 – 11 with springs of stiffness
        // 2.
        let line: Vec<u32> = [10].into_iter().chain(0..10).chain([11]).collect();
        let mut entries: Vec<(u32, u32, f64)> = (0..n).map(|i| (i, i, 0.0)).collect();
        for pair in line.windows(2) {
            entries.extend([
                (pair[0], pair[0], 2.0),
                (pair[1], pair[1], 2.0),
                (pair[0], pair[1], -2.0),
            ]);
        }
        let mut dense = vec![0.0; 144];
        for &(i, j, v) in &entries {
            dense[(i.max(j) + 12 * i.min(j)) as usize] += v;
        }
        (entries, dense)
    }

    #[test]
    fn springs_in_a_row_condense_to_one_spring() {
        // A row of 11 springs of stiffness 2 equals one of 2/11, and the whole is singular.
        let schur = SparseSymmetric::from_entries(12, chain().0)
            .schur_complement(2)
            .unwrap();
        for (have, want) in schur.iter().zip([2.0 / 11.0, -2.0 / 11.0, 0.0, 2.0 / 11.0]) {
            assert!((have - want).abs() < 1e-14, "{schur:?}");
        }
    }

    #[test]
    fn dense_and_sparse_elimination_agree() {
        let (_, mut dense) = chain();
        eliminate_first(&mut dense, 12, 10).unwrap();
        for (at, want) in [
            (10 + 120, 2.0 / 11.0),
            (11 + 120, -2.0 / 11.0),
            (11 + 132, 2.0 / 11.0),
        ] {
            assert!((dense[at] - want).abs() < 1e-14);
        }
    }

    #[test]
    fn blocks_of_a_mesh_are_solved_as_their_entries_are() {
        // A strip of four triangles with two rows per node: one spring matrix in each cell, and one more on
        // each row.
        let cells = [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]];
        let mut matrix = SparseSymmetric::of_cells(6, 2, &cells);
        let mut entries = Vec::new();
        for cell in cells {
            for i in 0..6_u32 {
                for j in 0..=i {
                    let [row, column] = [i, j].map(|at| cell[at as usize / 2] * 2 + at % 2);
                    entries.push((
                        row,
                        column,
                        if i == j { 5.0 } else { -1.0 / f64::from(1 + i + j) },
                    ));
                }
            }
        }
        for &(row, column, value) in &entries {
            let place = matrix.position(row, column).unwrap();
            matrix.values_mut()[place] += value;
        }
        // Nodes 0 and 3 share no cell, so their rows have no place in common.
        assert!(matrix.position(0, 6).is_none() && matrix.n_places() == matrix.places().count());
        let (mut x, mut y) = (vec![1.0; 12], vec![1.0; 12]);
        let order = EliminationOrder::of_blocks(&matrix, 2).unwrap();
        Cholesky::in_order(&order, &matrix)
            .unwrap()
            .solve_in_place(&mut x);
        Cholesky::new(&SparseSymmetric::from_entries(12, entries))
            .unwrap()
            .solve_in_place(&mut y);
        assert!(
            x.iter().zip(&y).all(|(x, y)| (x - y).abs() < 1e-12),
            "{x:?} {y:?}"
        );
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let matrix = SparseSymmetric::from_entries(2, vec![(0, 0, 1.0), (1, 1, 1.0), (0, 1, 2.0)]);
        assert_eq!(
            Cholesky::new(&matrix).unwrap_err(),
            SparseError::NotPositiveDefinite { n: 2 }
        );
    }
}
