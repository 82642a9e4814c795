//! Cells with material, split into connected parts, and their nodes.
//!
//! ```text
//!   ┌─────────┐       ┌─────────┐   ┌─────────┐
//!   │▒▒▒   ▓▓▓│       │▒▒▒      │   │      ▓▓▓│     two lips in one cell: each gets a copy of the cell,
//!   │▒▒▒   ▓▓▓│  ──►  │▒▒▒      │ + │      ▓▓▓│     which shares nodes only with those copies of the
//!   │▒▒▒   ▓▓▓│       │▒▒▒      │   │      ▓▓▓│     next cell that touch the same lip
//!   └─────────┘       └─────────┘   └─────────┘
//! ```
//!
//! Source: virtual nodes of Molino, Bao, Fedkiw 2004, on voxels.

use std::collections::HashMap;
use std::ops::Range;

use super::element::{N_NODES, NODES};
use super::voxels::{Cell, Fill, N_VOXELS, SIDE, Voxels};

/// Least share of material for a voxel to count. Smaller shares are slivers where a face runs beside a
/// voxel's own face; they would join separate parts.
const LEAST_SHARE: f32 = 0.05;

/// Marks a voxel without a component.
const NONE: u8 = u8::MAX;

/// Copy of a cell with one connected part of its material.
pub(super) struct Copy {
    pub cell: Cell,
    pub nodes: [u32; N_NODES],
    pub fills: [Fill; N_VOXELS],
}

/// All copies of all cells, with their nodes.
pub(super) struct Cells {
    /// Copies in the order of their cells.
    pub copies: Vec<Copy>,
    pub n_nodes: usize,
    /// Loose share of the volume: material not connected to the largest body.
    pub loose_share: f64,
    first: HashMap<Cell, (u32, [u8; N_VOXELS])>,
}

/// Component of each voxel of a cell, and the number of components.
fn components(fills: &[Fill; N_VOXELS]) -> ([u8; N_VOXELS], u8) {
    let mut of = [NONE; N_VOXELS];
    let mut n = 0;
    for start in 0..N_VOXELS {
        if of[start] != NONE || fills[start].share < LEAST_SHARE {
            continue;
        }
        let mut stack = vec![start];
        of[start] = n;
        while let Some(at) = stack.pop() {
            for next in neighbors(at) {
                if of[next] == NONE && fills[next].share >= LEAST_SHARE {
                    of[next] = n;
                    stack.push(next);
                }
            }
        }
        n += 1;
    }
    (of, n)
}

/// Voxels of the same cell that share a face with voxel `at`.
fn neighbors(at: usize) -> impl Iterator<Item = usize> {
    let place = [at % SIDE, at / SIDE % SIDE, at / SIDE / SIDE];
    (0..3).flat_map(move |axis| {
        let step = SIDE.pow(axis as u32);
        let below = (place[axis] > 0).then(|| at - step);
        let above = (place[axis] + 1 < SIDE).then(|| at + step);
        below.into_iter().chain(above)
    })
}

/// Pairs of voxels that face each other across a cell border: the last layer along `axis`, and the first
/// layer of the next cell.
fn voxel_pairs(axis: usize) -> impl Iterator<Item = (usize, usize)> {
    let step = SIDE.pow(axis as u32);
    (0..N_VOXELS)
        .filter(move |at| at / step % SIDE == SIDE - 1)
        .map(move |at| (at, at - (SIDE - 1) * step))
}

/// Pairs of nodes that coincide: those on a cell's far face along `axis`, and those on the next cell's near
/// face.
fn node_pairs(axis: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..N_NODES).filter(move |i| NODES[*i][axis] == 1).map(move |i| {
        let mut near = NODES[i];
        near[axis] = -1;
        let j = NODES.iter().position(|n| *n == near);
        (i, j.expect("a cube's opposite faces have the same nodes"))
    })
}

fn root(parent: &mut [u32], mut at: u32) -> u32 {
    while parent[at as usize] != at {
        parent[at as usize] = parent[parent[at as usize] as usize];
        at = parent[at as usize];
    }
    at
}

fn join(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}

impl Cells {
    pub fn new(voxels: Voxels) -> Self {
        let mut first = HashMap::new();
        let mut copies = Vec::new();
        for (&cell, fills) in voxels.cells.iter().zip(&voxels.fills) {
            let (of, n) = components(fills);
            first.insert(cell, (copies.len() as u32, of));
            copies.extend((0..n).map(|own| Copy {
                cell,
                nodes: [0; N_NODES],
                fills: std::array::from_fn(|at| if of[at] == own { fills[at] } else { Fill::default() }),
            }));
        }
        let mut cells = Self {
            copies,
            n_nodes: 0,
            loose_share: 0.0,
            first,
        };
        let mut parent = cells.join_copies();
        cells.keep_largest(&mut parent);
        cells
    }

    /// Joins the (copy, node) pairs that coincide, across faces where voxels of both copies meet.
    fn join_copies(&self) -> Vec<u32> {
        let mut parent: Vec<u32> = (0..(self.copies.len() * N_NODES) as u32).collect();
        let shared: [Vec<(usize, usize)>; 3] = std::array::from_fn(|axis| node_pairs(axis).collect());
        let facing: [Vec<(usize, usize)>; 3] = std::array::from_fn(|axis| voxel_pairs(axis).collect());
        for (at, copy) in self.copies.iter().enumerate() {
            for axis in 0..3 {
                let mut next = copy.cell;
                next[axis] += 1;
                let Some((first, of)) = self.first.get(&next) else {
                    continue;
                };
                let meets = |(here, there): &(usize, usize)| {
                    (copy.fills[*here].share > 0.0 && of[*there] != NONE).then(|| of[*there])
                };
                let mut others: Vec<u8> = facing[axis].iter().filter_map(meets).collect();
                others.sort_unstable();
                others.dedup();
                for other in others {
                    let other = *first as usize + usize::from(other);
                    for (i, j) in &shared[axis] {
                        join(
                            &mut parent,
                            (at * N_NODES + i) as u32,
                            (other * N_NODES + j) as u32,
                        );
                    }
                }
            }
        }
        parent
    }

    /// Numbers the nodes of the largest body and drops the rest, which are chips of voxels.
    fn keep_largest(&mut self, parent: &mut [u32]) {
        let n = self.copies.len();
        let mut body: Vec<u32> = (0..n as u32).collect();
        let mut owner: HashMap<u32, u32> = HashMap::new();
        for at in 0..n * N_NODES {
            let node = root(parent, at as u32);
            let first = *owner.entry(node).or_insert((at / N_NODES) as u32);
            join(&mut body, first, (at / N_NODES) as u32);
        }
        let mut volume = vec![0.0; n];
        for at in 0..n {
            let shares = self.copies[at].fills.iter().map(|f| f64::from(f.share));
            volume[root(&mut body, at as u32) as usize] += shares.sum::<f64>();
        }
        let largest = (0..n).reduce(|a, b| if volume[b] > volume[a] { b } else { a });
        let Some(largest) = largest else { return };
        self.loose_share = 1.0 - volume[largest] / volume.iter().sum::<f64>();
        let mut number: HashMap<u32, u32> = HashMap::new();
        let mut kept = vec![None; n];
        let mut copies = Vec::new();
        for (at, mut copy) in std::mem::take(&mut self.copies).into_iter().enumerate() {
            if root(&mut body, at as u32) as usize != largest {
                continue;
            }
            for (i, node) in copy.nodes.iter_mut().enumerate() {
                let next = number.len() as u32;
                *node = *number
                    .entry(root(parent, (at * N_NODES + i) as u32))
                    .or_insert(next);
            }
            kept[at] = Some(copies.len() as u32);
            copies.push(copy);
        }
        self.n_nodes = number.len();
        self.copies = copies;
        self.renumber(&kept);
    }

    /// Updates each cell's first copy and its voxels' components after copies were dropped.
    fn renumber(&mut self, kept: &[Option<u32>]) {
        for (first, of) in self.first.values_mut() {
            let old = *first as usize;
            let n = of
                .iter()
                .filter(|c| **c != NONE)
                .map(|c| c + 1)
                .max()
                .unwrap_or(0);
            let range: Range<usize> = old..old + usize::from(n);
            let lowest = kept[range].iter().flatten().next().copied().unwrap_or(0);
            for c in of.iter_mut().filter(|c| **c != NONE) {
                *c = kept[old + usize::from(*c)].map_or(NONE, |new| (new - lowest) as u8);
            }
            *first = lowest;
        }
    }

    /// Copy that has the material of a voxel, given by the voxel's number along each axis. `None` if the
    /// voxel is empty.
    pub fn copy_at(&self, voxel: [i64; 3]) -> Option<u32> {
        let side = SIDE as i64;
        let cell = voxel.map(|k| k.div_euclid(side) as i32);
        let [i, j, k] = voxel.map(|k| k.rem_euclid(side) as usize);
        let (first, of) = self.first.get(&cell)?;
        let own = of[i + SIDE * (j + SIDE * k)];
        (own != NONE).then(|| first + u32::from(own))
    }

    /// Share of material of a voxel, in [0, 1].
    pub fn share_at(&self, voxel: [i64; 3]) -> f64 {
        let side = SIDE as i64;
        let [i, j, k] = voxel.map(|k| k.rem_euclid(side) as usize);
        self.copy_at(voxel).map_or(0.0, |copy| {
            f64::from(self.copies[copy as usize].fills[i + SIDE * (j + SIDE * k)].share)
        })
    }
}
