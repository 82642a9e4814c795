//! Rigid motions that no contact stops, and the parts that come off.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::contact::Response;
use super::rows::Law;

/// Mean displacement along blocked directions, as a share of the motion, below which the motion is free.
/// Frames are exact to rounding. A motion that is this nearly free would open seams ten thousand times
/// further than the parts deform.
const FREE: f64 = 1e-4;
/// Depth, as a share of the probe, that counts as zero for any motion.
const ROUNDING: f64 = 1e-9;
/// Rounds of a projection onto the cone of free motions, for each of its dimensions.
const MAX_ROUNDS: usize = 50;

/// Parts (ascending, by index in `parts`) that some rigid motion takes off. Such a motion has no displacement
/// along n, none into the floor along ŝ, and none of a wall into another.
///
/// The motions that keep all gaps along n form a linear space, found from its Gram matrix. In it, the pushes
/// leave a cone. The cone holds more than rest if and only if one of the vectors ± eᵢ has a nearest point in
/// it that is not rest.
pub(super) fn loose_parts(parts: &[Response], laws: &[Law], n_motions: usize) -> Vec<u32> {
    if n_motions == 0 {
        return Vec::new();
    }
    let seen = seen_motions(parts, laws.len());
    let space = free_space(&seen, laws, n_motions);
    let pushes: Vec<DVector<f64>> = (0..laws.len())
        .filter(|row| laws[*row] == Law::Push)
        .map(|row| space.tr_mul(&dense(&seen[row], n_motions)))
        .filter(|h| h.norm() > FREE)
        .map(|h| h.normalize())
        .collect();
    let mut is_loose = vec![false; parts.len()];
    for i in 0..2 * space.ncols() {
        let mut probe = DVector::zeros(space.ncols());
        probe[i / 2] = if i % 2 == 0 { 1.0 } else { -1.0 };
        let free = nearest_in_cone(&pushes, probe);
        if free.norm() < FREE.sqrt() {
            continue;
        }
        let motion = &space * &free;
        for (part, is_loose) in parts.iter().zip(&mut is_loose) {
            let moves = |first: usize| motion.rows(first, 6).norm() > FREE.sqrt() * motion.norm();
            *is_loose |= part.first_motion.is_some_and(moves);
        }
    }
    (0..)
        .zip(is_loose)
        .filter(|(_, is_loose)| *is_loose)
        .map(|(i, _)| i)
        .collect()
}

/// Motions that act on a row, from both sides: first unknown and six coefficients.
type Seen = Vec<(usize, [f64; 6])>;

fn seen_motions(parts: &[Response], n_rows: usize) -> Vec<Seen> {
    let mut seen = vec![Seen::new(); n_rows];
    for part in parts {
        let Some(first) = part.first_motion else { continue };
        for (&row, rigid) in part.rows.iter().zip(&part.rigid) {
            seen[row].push((first, *rigid));
        }
    }
    seen
}

fn dense(seen: &Seen, n_motions: usize) -> DVector<f64> {
    let mut row = DVector::zeros(n_motions);
    for (first, rigid) in seen {
        for (m, r) in rigid.iter().enumerate() {
            row[first + m] += r;
        }
    }
    row
}

/// Orthonormal basis, by columns, of the motions that leave all two-sided rows unchanged.
fn free_space(seen: &[Seen], laws: &[Law], n_motions: usize) -> DMatrix<f64> {
    let mut gram = DMatrix::zeros(n_motions, n_motions);
    for seen in seen
        .iter()
        .zip(laws)
        .filter(|(_, law)| **law == Law::Both)
        .map(|(seen, _)| seen)
    {
        for (first, a) in seen {
            for (second, b) in seen {
                for i in 0..6 {
                    for j in 0..6 {
                        gram[(first + i, second + j)] += a[i] * b[j];
                    }
                }
            }
        }
    }
    let n_rows = laws.iter().filter(|law| **law == Law::Both).count().max(1);
    let eigen = SymmetricEigen::new(gram);
    let is_free = |i: &usize| eigen.eigenvalues[*i] <= FREE * FREE * n_rows as f64;
    let columns: Vec<DVector<f64>> = (0..n_motions)
        .filter(is_free)
        .map(|i| eigen.eigenvectors.column(i).into_owned())
        .collect();
    if columns.is_empty() {
        DMatrix::zeros(n_motions, 0)
    } else {
        DMatrix::from_columns(&columns)
    }
}

/// Point nearest to `probe` with no negative product with any of `pushes` (Lawson and Hanson on the dual
/// problem).
fn nearest_in_cone(pushes: &[DVector<f64>], probe: DVector<f64>) -> DVector<f64> {
    let mut held: Vec<usize> = Vec::new();
    let mut weight: Vec<f64> = Vec::new();
    let mut nearest = probe.clone();
    for _round in 0..MAX_ROUNDS * probe.len() {
        let deepest = (0..pushes.len())
            .map(|i| (i, pushes[i].dot(&nearest)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((entering, depth)) = deepest else { break };
        if depth > -(FREE * nearest.norm()).max(ROUNDING) || held.contains(&entering) {
            break;
        }
        held.push(entering);
        weight.push(0.0);
        while !held.is_empty() {
            let columns = DMatrix::from_columns(&held.iter().map(|i| pushes[*i].clone()).collect::<Vec<_>>());
            // Least squares by singular values, since pushes may depend on each other.
            let Ok(best) = columns.clone().svd(true, true).solve(&-&probe, 1e-12) else {
                return nearest;
            };
            let share = (weight.iter().zip(best.iter()).filter(|(_, b)| **b <= 0.0))
                .map(|(w, b)| w / (w - b))
                .fold(1.0_f64, f64::min);
            for (w, b) in weight.iter_mut().zip(best.iter()) {
                *w += share * (b - *w);
            }
            if best.iter().all(|b| *b > 0.0) {
                nearest = &probe + columns * best;
                break;
            }
            let kept: Vec<bool> = weight.iter().map(|w| *w > 1e-12).collect();
            if kept.iter().all(|k| *k) {
                break;
            }
            let mut keep = kept.iter();
            held.retain(|_| *keep.next().unwrap_or(&false));
            weight.retain(|w| *w > 1e-12);
        }
        if held.is_empty() {
            nearest = probe.clone();
        }
    }
    nearest
}
