//! Joint between a hanging part of a solid and the rest.

use std::collections::VecDeque;

use super::{Crossing, Parts, crossings};
use crate::TriMesh;

/// Greatest number of voxels of a box that is examined. Each takes five bytes, 40 MB in all.
const MOST_VOXELS: usize = 1 << 23;
/// Length of the longest neck that is measured, in radii of the ball, between the places that its centre
/// reaches.
const LONGEST: f64 = 8.0;

/// Border between a hanging part and the rest.
///
/// Every point of the solid belongs to the part or to the rest: to the one with the shorter way within the
/// solid, along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neck {
    /// Area of the border, mm²: the sum of its shadows on the coordinate planes. Where the border is
    /// oblique, the sum is too large by up to 1.7 times.
    pub area_mm2: f64,
    /// Longest way within the part to the border, along the axes, mm. Where the way is oblique, it is too
    /// long by up to 1.7 times.
    pub lever_mm: f64,
}

/// Owner of a voxel.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Owner {
    /// Lies outside the solid.
    Nothing,
    /// Lies in the solid, where no ball's centre comes.
    Open,
    Part,
    Rest,
}

/// Voxels around a part.
struct Cells {
    /// First voxel along x, y and z, and the number of voxels.
    first: [i64; 3],
    n: [usize; 3],
    owner: Vec<Owner>,
}

impl Neck {
    /// Measures the joint of a part; `None` if the part is too large for that, or if the rest is farther away
    /// than [`LONGEST`] radii.
    pub(super) fn of(mesh: &TriMesh, parts: &Parts, part: u32, radius: f64) -> Option<Self> {
        let mut cells = Cells::around(parts, part, radius)?;
        cells.fill(&crossings(mesh, &parts.grid));
        cells.claim(parts, part);
        cells.spread();
        let border = cells.border();
        let voxel_mm = parts.grid.voxel_mm;
        (!border.is_empty()).then(|| Self {
            area_mm2: border.len() as f64 * voxel_mm * voxel_mm,
            lever_mm: f64::from(cells.longest_way(&border)) * voxel_mm,
        })
    }
}

impl Cells {
    /// Cells of a box around a part, all of them empty; `None` if there are too many.
    fn around(parts: &Parts, part: u32, radius: f64) -> Option<Self> {
        let margin = (LONGEST * radius).ceil() as i64;
        let (mut low, mut high) = ([i64::MAX; 3], [i64::MIN; 3]);
        for run in parts.runs_of(part) {
            let [from, to] = run.x.map(i64::from);
            let [y, z] = [run.y, run.z].map(i64::from);
            for (axis, [least, most]) in [[from, to - 1], [y, y], [z, z]].into_iter().enumerate() {
                low[axis] = low[axis].min(least - margin);
                high[axis] = high[axis].max(most + margin);
            }
        }
        let n = [0, 1, 2].map(|axis| (high[axis] - low[axis] + 1).max(0) as usize);
        let n_cells = n.into_iter().try_fold(1usize, usize::checked_mul)?;
        (n_cells <= MOST_VOXELS).then(|| Self {
            first: low,
            n,
            owner: vec![Owner::Nothing; n_cells],
        })
    }

    /// Cells of a row from `x[0]` to one before `x[1]`, as far as they lie in the box.
    fn row(&self, x: [u32; 2], y: u32, z: u32) -> std::ops::Range<usize> {
        let [y, z] = [(1, y), (2, z)].map(|(axis, at)| i64::from(at) - self.first[axis]);
        let is_inside = (0..self.n[1] as i64).contains(&y) && (0..self.n[2] as i64).contains(&z);
        if !is_inside {
            return 0..0;
        }
        let start = (z as usize * self.n[1] + y as usize) * self.n[0];
        let [from, to] = x.map(|at| (i64::from(at) - self.first[0]).clamp(0, self.n[0] as i64) as usize);
        start + from..start + to.max(from)
    }

    /// Marks the cells of the solid as open.
    fn fill(&mut self, crossings: &[Crossing]) {
        let mut winding = 0;
        for pair in crossings.windows(2) {
            let is_same_row = (pair[0].y, pair[0].z) == (pair[1].y, pair[1].z);
            winding = if is_same_row { winding + pair[0].step } else { 0 };
            if winding > 0 {
                let row = self.row([pair[0].x, pair[1].x], pair[0].y, pair[0].z);
                self.owner[row].fill(Owner::Open);
            }
        }
    }

    /// Gives the cells that a ball's centre reaches to the part and to the rest.
    fn claim(&mut self, parts: &Parts, part: u32) {
        for (run, &of) in parts.runs.iter().zip(&parts.part_of) {
            let row = self.row(run.x, run.y, run.z);
            self.owner[row].fill(if of == part { Owner::Part } else { Owner::Rest });
        }
    }

    /// Cells that share a face with a cell.
    fn beside(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let [n_x, n_y, _] = self.n;
        let at = [cell % n_x, cell / n_x % n_y, cell / (n_x * n_y)];
        let (n, step) = (self.n, [1, n_x, n_x * n_y]);
        (0..3).flat_map(move |axis| {
            let before = (at[axis] > 0).then(|| cell - step[axis]);
            let after = (at[axis] + 1 < n[axis]).then(|| cell + step[axis]);
            before.into_iter().chain(after)
        })
    }

    /// Gives each open cell to the owner that is nearest to it.
    fn spread(&mut self) {
        let is_owned = |cell: &usize| matches!(self.owner[*cell], Owner::Part | Owner::Rest);
        let mut next: VecDeque<usize> = (0..self.owner.len()).filter(is_owned).collect();
        while let Some(cell) = next.pop_front() {
            for other in self.beside(cell) {
                if self.owner[other] == Owner::Open {
                    self.owner[other] = self.owner[cell];
                    next.push_back(other);
                }
            }
        }
    }

    /// Cells of the part once for each face that they share with a cell of the rest.
    fn border(&self) -> Vec<usize> {
        let of_part = (0..self.owner.len()).filter(|&cell| self.owner[cell] == Owner::Part);
        let towards_rest = |cell| {
            self.beside(cell)
                .filter(|&other| self.owner[other] == Owner::Rest)
        };
        of_part
            .flat_map(|cell| std::iter::repeat_n(cell, towards_rest(cell).count()))
            .collect()
    }

    /// Greatest number of steps within the part from a border.
    fn longest_way(&self, border: &[usize]) -> u32 {
        const FAR: u32 = u32::MAX;
        let mut steps = vec![FAR; self.owner.len()];
        let mut next: VecDeque<usize> = border.iter().copied().collect();
        border.iter().for_each(|&cell| steps[cell] = 0);
        let mut longest = 0;
        while let Some(cell) = next.pop_front() {
            longest = longest.max(steps[cell]);
            for other in self.beside(cell) {
                if self.owner[other] == Owner::Part && steps[other] == FAR {
                    steps[other] = steps[cell] + 1;
                    next.push_back(other);
                }
            }
        }
        longest
    }
}

#[cfg(test)]
mod tests {
    use super::super::hanging_parts;
    use crate::samples::cuboid;

    #[test]
    fn a_neck_is_as_large_as_the_bar_between_two_blocks_unless_it_is_long() {
        let necks = |gap_mm: f64, [y, z]: [f64; 2]| {
            let dumbbell = cuboid([0.0, -5.0, -5.0], [10.0, 5.0, 5.0])
                .union(&cuboid([10.0 + gap_mm, -5.0, -5.0], [18.0 + gap_mm, 5.0, 5.0]))
                .union(&cuboid(
                    [5.0, -0.5 * y, -0.5 * z],
                    [15.0 + gap_mm, 0.5 * y, 0.5 * z],
                ));
            let found = hanging_parts(&dumbbell.to_mesh(), None, 1.2, 0.2, 5.0);
            assert_eq!(found.len(), 1);
            found[0].neck
        };
        for bar in [[0.9, 5.0], [5.0, 0.9], [1.0, 1.0]] {
            let neck = necks(2.0, bar).unwrap();
            assert!((neck.area_mm2 - bar[0] * bar[1]).abs() < 0.6, "{neck:?}");
            // Half of the bar, the block along it, and twice half of the block across.
            let lever_mm = 1.0 + 8.0 + 10.0 - 0.5 * (bar[0] + bar[1]);
            assert!((neck.lever_mm - lever_mm).abs() < 1.0, "{neck:?}, {lever_mm}");
        }
        assert_eq!(necks(8.0, [1.0, 1.0]), None);
    }
}
