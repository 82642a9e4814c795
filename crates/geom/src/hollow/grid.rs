//! Grid of nodes around a solid, with the nodes inside the solid and the grid edges that its surface crosses.

use crate::{Solid, TriMesh, Vec3};

/// Approximate number of nodes, which makes cells a fiftieth of a compact figure's size. More nodes find no
/// more.
const N_NODES: f64 = 130_000.0;
/// Largest number of cells along the longest side.
const MOST_CELLS: f64 = 128.0;
/// Number of cells beyond the box on each side; the outermost layer is free.
const MARGIN: f64 = 1.5;
/// Shift of the nodes, in cells, so that no grid line meets the edges of models with integer coordinates.
const SHIFT: Vec3 = Vec3::new(0.137_241, 0.211_869, 0.317_453);

/// Nodes of a regular grid; x runs fastest.
pub(super) struct Grid {
    origin: Vec3,
    pub(super) cell_mm: f64,
    n: [usize; 3],
    /// Bit `axis` of a node is set if the surface crosses the edge to the next node along that axis, or that
    /// node is missing.
    crossings: Vec<u8>,
    /// True for nodes inside the solid.
    is_solid: Vec<bool>,
}

impl Grid {
    /// Builds the grid around `solid`, in linear time in its triangles and the grid edges that they cross.
    pub(super) fn new(solid: &Solid) -> Self {
        let mesh = solid.mesh();
        let bounds = mesh.bounds();
        let (size, longest) = (bounds.size(), bounds.size().max_element());
        let cell_mm = (size.element_product() / N_NODES)
            .cbrt()
            .max(longest / MOST_CELLS);
        let n = (size / cell_mm).to_array().map(|cells| cells.ceil() as usize + 4);
        let n_nodes = n[0] * n[1] * n[2];
        let mut grid = Self {
            origin: bounds.min + cell_mm * (SHIFT - MARGIN),
            cell_mm,
            n,
            crossings: vec![0; n_nodes],
            is_solid: vec![false; n_nodes],
        };
        let mut entered = vec![0_i32; n_nodes];
        for axis in 0..3 {
            for face in 0..mesh.triangles.len() {
                grid.cross(mesh, face, axis, &mut entered);
            }
        }
        grid.tell_solid(&entered);
        for node in 0..n_nodes {
            let place = grid.place(node);
            for axis in (0..3).filter(|&axis| place[axis] + 1 == n[axis]) {
                grid.crossings[node] |= 1 << axis;
            }
        }
        grid
    }

    /// Length of the longest side, mm, margins included.
    pub(super) fn longest_mm(&self) -> f64 {
        self.cell_mm * self.n.iter().copied().max().unwrap_or(0) as f64
    }

    pub(super) fn len(&self) -> usize {
        self.is_solid.len()
    }

    pub(super) fn is_free(&self, node: usize) -> bool {
        !self.is_solid[node]
    }

    pub(super) fn strides(&self) -> [usize; 3] {
        [1, self.n[0], self.n[0] * self.n[1]]
    }

    /// Number of nodes in a row along x.
    pub(super) fn row(&self) -> usize {
        self.n[0]
    }

    fn place(&self, node: usize) -> [usize; 3] {
        let [_, row, layer] = self.strides();
        [node % row, node % layer / row, node / layer]
    }

    pub(super) fn position(&self, node: usize) -> Vec3 {
        let [i, j, k] = self.place(node);
        self.origin + self.cell_mm * Vec3::new(i as f64, j as f64, k as f64)
    }

    /// Returns true if the node belongs to the outermost layer.
    pub(super) fn is_border(&self, node: usize) -> bool {
        self.place(node)
            .iter()
            .zip(self.n)
            .any(|(&at, n)| at == 0 || at + 1 == n)
    }

    /// Neighbours of `node` along grid edges that do not cross the surface.
    pub(super) fn linked_nodes(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        let strides = self.strides();
        let is_open = move |at: usize, axis: usize| self.crossings[at] >> axis & 1 == 0;
        // The node before the first of a row is the last of another row, whose edge is marked as crossed.
        (0..3).flat_map(move |axis| {
            let on = is_open(node, axis).then(|| node + strides[axis]);
            let back = node.checked_sub(strides[axis]).filter(|&at| is_open(at, axis));
            [on, back].into_iter().flatten()
        })
    }

    /// Corners of the cell around `q`; fewer at the border.
    pub(super) fn corners_around(&self, q: Vec3) -> impl Iterator<Item = usize> + '_ {
        let at = (q - self.origin) / self.cell_mm;
        let low = at.to_array().map(|x| x.floor().max(0.0) as usize);
        let strides = self.strides();
        (0..8).filter_map(move |corner| {
            let place: [usize; 3] = std::array::from_fn(|axis| low[axis] + (corner >> axis & 1));
            let is_within = place.iter().zip(self.n).all(|(&at, n)| at < n);
            is_within.then(|| (0..3).map(|axis| place[axis] * strides[axis]).sum())
        })
    }

    /// Number of free nodes with the surface on both sides along all three axes.
    pub(super) fn n_enclosed(&self) -> usize {
        let mut n_axes = vec![0_u8; self.len()];
        for axis in 0..3 {
            let stride = self.strides()[axis];
            let starts = (0..self.len()).filter(|&node| self.place(node)[axis] == 0);
            for start in starts {
                let is_crossed = |at: &usize| self.crossings[start + at * stride] & (1 << axis) != 0;
                let mut edges = 0..self.n[axis] - 1;
                let (first, last) = (edges.clone().find(is_crossed), edges.rfind(is_crossed));
                if let (Some(first), Some(last)) = (first, last) {
                    (first + 1..=last).for_each(|at| n_axes[start + at * stride] += 1);
                }
            }
        }
        (0..self.len())
            .filter(|&node| n_axes[node] == 3 && self.is_free(node))
            .count()
    }

    /// Marks the edges along `axis` that triangle `face` crosses. Along z, also counts in `entered`, at the
    /// node above, how often an upward line enters the solid there.
    fn cross(&mut self, mesh: &TriMesh, face: usize, axis: usize, entered: &mut [i32]) {
        let (right, up) = ((axis + 1) % 3, (axis + 2) % 3);
        let names = mesh.triangles[face];
        let at = mesh.corners(face).map(|p| (p - self.origin) / self.cell_mm);
        let low = at[0].min(at[1]).min(at[2]);
        let high = at[0].max(at[1]).max(at[2]);
        let strides = self.strides();
        for i in low[right].ceil() as usize..=high[right].floor() as usize {
            for j in low[up].ceil() as usize..=high[up].floor() as usize {
                let line = [i as f64, j as f64];
                let plane = at.map(|p| [p[right] - line[0], p[up] - line[1]]);
                let turns = [0, 1, 2].map(|k| turn(names, plane, k));
                if turns.iter().any(|t| t.1 != turns[0].1) {
                    continue;
                }
                let weights = [turns[1].0, turns[2].0, turns[0].0];
                let sum: f64 = weights.iter().sum();
                let height: f64 = (0..3).map(|k| weights[k] * at[k][axis]).sum::<f64>() / sum;
                if !height.is_finite() {
                    continue;
                }
                let below = (height.floor().max(0.0) as usize).min(self.n[axis] - 2);
                let node = i * strides[right] + j * strides[up] + below * strides[axis];
                self.crossings[node] |= 1 << axis;
                if axis == 2 {
                    entered[node + strides[2]] += if turns[0].1 { -1 } else { 1 };
                }
            }
        }
    }

    fn tell_solid(&mut self, entered: &[i32]) {
        let layer = self.strides()[2];
        for column in 0..layer {
            let mut winding = 0;
            for node in (column..self.len()).step_by(layer) {
                winding += entered[node];
                self.is_solid[node] = winding > 0;
            }
        }
    }
}

/// Twice the signed area of the origin and side `k` of a triangle, and the side on which the origin counts.
///
/// Both triangles of an edge compute the same number, so that a line meets exactly one of them.
fn turn(names: [u32; 3], plane: [[f64; 2]; 3], k: usize) -> (f64, bool) {
    let (from, to) = (k, (k + 1) % 3);
    let area = |a: usize, b: usize| plane[a][0] * plane[b][1] - plane[a][1] * plane[b][0];
    if names[from] < names[to] {
        let twice = area(from, to);
        (twice, twice >= 0.0)
    } else {
        let twice = area(to, from);
        (-twice, twice < 0.0)
    }
}
