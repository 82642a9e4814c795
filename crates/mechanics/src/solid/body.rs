//! A piece with its factorised stiffness: displacements from forces at its places.

use shellock_geom::sparse::{Cholesky, EliminationOrder, SparseSymmetric};
use shellock_geom::{Solid, Vec3};

use super::cells::{Cells, Copy};
use super::element::{Elements, N_NODES, NODES, centre, pairs, shapes};
use super::voxels::{N_VOXELS, SIDE, voxels};
use super::{SolidError, SolidParams};

/// Stiffness of the empty share of a cell, relative to the material's. It keeps nodes with almost no material
/// from being free. Chosen small beside voxels of which a hundredth is full.
const VOID: f64 = 1e-5;
/// Greatest loose share of a piece's volume at voxel resolution.
const MOST_LOOSE: f64 = 0.02;
/// Greatest number of cells of a piece; their factor takes about 2 GB.
const MOST_CELLS: usize = 60_000;
/// Greatest distance of a place from its piece's material, in voxels.
const REACH: i64 = 4;
/// Least share of material in the cells that hold a piece's frame.
const FIRM_SHARE: f32 = 0.3;

/// Place in a piece: a copy of a cell, and the weights of its nodes there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub copy: u32,
    pub shapes: [f64; N_NODES],
}

/// Reference frame of a piece, from its mass distribution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub center: Vec3,
    /// Radius of gyration, mm. Rotations are measured in mm at this distance.
    pub radius_mm: f64,
}

impl Frame {
    /// Displacements of point `p` under the six motions of the frame, each by 1 mm.
    pub fn motions(&self, p: Vec3) -> [Vec3; 6] {
        let arm = (p - self.center) / self.radius_mm;
        std::array::from_fn(|j| {
            if j < 3 {
                Vec3::AXES[j]
            } else {
                Vec3::AXES[j - 3].cross(arm)
            }
        })
    }
}

/// A piece, discretised and factorised.
pub(super) struct Body {
    pub cells: Cells,
    pub frame: Frame,
    pub volume_mm3: f64,
    cell_mm: f64,
    factor: Cholesky,
}

impl Body {
    pub fn new(
        params: &SolidParams,
        elements: &Elements,
        piece: usize,
        solid: &Solid,
    ) -> Result<Self, SolidError> {
        let size = solid.mesh().bounds().size() / params.cell_mm;
        let shell = solid.mesh().area() / params.cell_mm.powi(2);
        if shell > MOST_CELLS as f64 || size.max_element() > 1e4 {
            return Err(SolidError::TooLarge { piece });
        }
        let cells = Cells::new(voxels(solid.mesh(), params.cell_mm));
        if cells.copies.is_empty() {
            return Err(SolidError::Empty { piece });
        }
        if cells.copies.len() > MOST_CELLS {
            return Err(SolidError::TooLarge { piece });
        }
        if cells.loose_share > MOST_LOOSE {
            return Err(SolidError::Apart {
                piece,
                percent: 100.0 * cells.loose_share,
            });
        }
        let (frame, volume_mm3) = frame_of(&cells, params.cell_mm);
        let factor = factorise(&cells, elements, params.cell_mm)?;
        Ok(Self {
            cells,
            frame,
            volume_mm3,
            cell_mm: params.cell_mm,
            factor,
        })
    }

    /// Number of unknown displacements of the piece.
    pub fn n_rows(&self) -> usize {
        3 * self.cells.n_nodes
    }

    /// Finds the material nearest to `p + inside`; the vector `inside`, mm, leads into the piece.
    pub fn place(&self, p: Vec3, inside: Vec3) -> Option<Place> {
        let voxel_mm = self.cell_mm / SIDE as f64;
        let from = (p + inside) / voxel_mm;
        let home = [from.x, from.y, from.z].map(|x| x.floor() as i64);
        let mut best: Option<(f64, u32)> = None;
        for k in -REACH..=REACH {
            for j in -REACH..=REACH {
                for i in -REACH..=REACH {
                    let at = [home[0] + i, home[1] + j, home[2] + k];
                    let centre = Vec3::from(at.map(|x| x as f64 + 0.5));
                    let distance = centre.distance_squared(from);
                    if best.is_some_and(|b| distance >= b.0) {
                        continue;
                    }
                    best = self.cells.copy_at(at).map(|copy| (distance, copy)).or(best);
                }
            }
        }
        best.map(|(_, copy)| Place {
            copy,
            shapes: shapes(self.xi(copy, p)),
        })
    }

    /// Local coordinates of `p` in a copy's cell: in [−1, 1]³, or a little outside.
    pub fn xi(&self, copy: u32, p: Vec3) -> Vec3 {
        let cell = Vec3::from(self.cells.copies[copy as usize].cell.map(f64::from));
        2.0 * (p / self.cell_mm - cell) - Vec3::ONE
    }

    /// Position of node `i` of a copy, mm.
    pub fn node(&self, copy: &Copy, i: usize) -> Vec3 {
        let at = |k: usize| f64::from(copy.cell[k]) + 0.5 + 0.5 * f64::from(NODES[i][k]);
        self.cell_mm * Vec3::new(at(0), at(1), at(2))
    }

    /// Adds a force at a place to the nodal loads.
    pub fn push(&self, side: &mut [f64], place: &Place, force_n: Vec3) {
        let nodes = &self.cells.copies[place.copy as usize].nodes;
        for (node, weight) in nodes.iter().zip(place.shapes) {
            let at = 3 * *node as usize;
            (0..3).for_each(|k| side[at + k] += weight * force_n[k]);
        }
    }

    /// Displacement of a place, mm.
    pub fn displacement(&self, displaced: &[f64], place: &Place) -> Vec3 {
        let nodes = &self.cells.copies[place.copy as usize].nodes;
        nodes
            .iter()
            .zip(place.shapes)
            .map(|(node, weight)| weight * Vec3::from_slice(&displaced[3 * *node as usize..][..3]))
            .sum()
    }

    /// Solves for displacements relative to the frame, in place; several loads may follow each other.
    pub fn solve(&self, sides: &mut [f64]) {
        self.factor.solve_in_place(sides);
    }

    /// Iterates over the piece's material as points: copy, voxel of the cell, position, volume in mm³.
    pub fn points(&self) -> impl Iterator<Item = (&Copy, usize, Vec3, f64)> {
        points(&self.cells, self.cell_mm)
    }
}

fn points(cells: &Cells, cell_mm: f64) -> impl Iterator<Item = (&Copy, usize, Vec3, f64)> {
    let voxel_mm3 = (cell_mm / SIDE as f64).powi(3);
    cells.copies.iter().flat_map(move |copy| {
        let corner = Vec3::from(copy.cell.map(f64::from));
        (0..N_VOXELS)
            .filter(|at| copy.fills[*at].share > 0.0)
            .map(move |at| {
                let fill = &copy.fills[at];
                let p = (corner + 0.5 * (centre(at, fill) + Vec3::ONE)) * cell_mm;
                (copy, at, p, f64::from(fill.share) * voxel_mm3)
            })
    })
}

fn frame_of(cells: &Cells, cell_mm: f64) -> (Frame, f64) {
    let (mut volume, mut first) = (0.0, Vec3::ZERO);
    for (_, _, p, v) in points(cells, cell_mm) {
        volume += v;
        first += v * p;
    }
    let center = first / volume;
    let second: f64 = points(cells, cell_mm)
        .map(|(_, _, p, v)| v * p.distance_squared(center))
        .sum();
    let frame = Frame {
        center,
        radius_mm: (second / volume).sqrt().max(cell_mm / 4.0),
    };
    (frame, volume)
}

/// Factorises the piece's stiffness, held at its frame.
fn factorise(cells: &Cells, elements: &Elements, cell_mm: f64) -> Result<Cholesky, SolidError> {
    let nodes: Vec<[u32; N_NODES]> = cells.copies.iter().map(|c| c.nodes).collect();
    let mut matrix = SparseSymmetric::of_cells(cells.n_nodes, 3, &nodes);
    for copy in &cells.copies {
        let blocks = elements.stiffness(&copy.fills, VOID);
        for ((i, j), block) in pairs().zip(blocks.iter()) {
            add_block(&mut matrix, copy.nodes[i], copy.nodes[j], block);
        }
    }
    for (node, direction) in holds(cells) {
        let spring = elements.lame[1] * cell_mm;
        let block: [f64; 9] = std::array::from_fn(|k| spring * direction[k / 3] * direction[k % 3]);
        add_block(&mut matrix, node, node, &block);
    }
    let order = EliminationOrder::of_blocks(&matrix, 3)?;
    Ok(Cholesky::in_order(&order, &matrix)?)
}

/// Adds the block for the rows of node `i` and the columns of node `j`.
fn add_block(matrix: &mut SparseSymmetric, i: u32, j: u32, block: &[f64; 9]) {
    let is_upper = i <= j;
    let (row, column) = if is_upper { (i, j) } else { (j, i) };
    for c in 0..3 {
        let first = matrix
            .position(3 * row, 3 * column + c as u32)
            .expect("the pattern has all pairs of a cell's nodes");
        let n_rows = if i == j { c + 1 } else { 3 };
        for r in 0..n_rows {
            let value = if is_upper {
                block[3 * r + c]
            } else {
                block[3 * c + r]
            };
            matrix.values_mut()[first + r] += value;
        }
    }
}

/// Selects six directions at three nodes that hold the piece's frame. They carry nothing when forces balance.
///
/// Node a, farthest from the centre, is held in all three directions. Node b, farthest from a, is held in the
/// two across line ab. Node c, farthest from that line, is held in the one across plane abc.
fn holds(cells: &Cells) -> Vec<(u32, Vec3)> {
    let is_firm = |c: &&Copy| c.fills.iter().map(|f| f.share).sum::<f32>() >= FIRM_SHARE * N_VOXELS as f32;
    let place = |copy: &Copy, i: usize| {
        let at = |k: usize| f64::from(2 * copy.cell[k] + 1 + NODES[i][k]);
        Vec3::new(at(0), at(1), at(2))
    };
    let corners = |copies: Vec<&Copy>| -> Vec<(u32, Vec3)> {
        copies
            .iter()
            .flat_map(|copy| (0..8).map(|i| (copy.nodes[i], place(copy, i))))
            .collect()
    };
    let mut all = corners(cells.copies.iter().filter(is_firm).collect());
    if all.is_empty() {
        all = corners(cells.copies.iter().collect());
    }
    let center = all.iter().map(|n| n.1).sum::<Vec3>() / all.len() as f64;
    let farthest = |distance: &dyn Fn(Vec3) -> f64| {
        all.iter()
            .copied()
            .reduce(|a, b| if distance(b.1) > distance(a.1) { b } else { a })
            .expect("a piece has cells")
    };
    let (a, pa) = farthest(&|p| p.distance_squared(center));
    let (b, pb) = farthest(&|p| p.distance_squared(pa));
    let along = (pb - pa).normalize();
    let (c, pc) = farthest(&|p| (p - pa).reject_from_normalized(along).length_squared());
    let aside = (pc - pa).reject_from_normalized(along).normalize();
    let across = along.cross(aside);
    vec![
        (a, Vec3::X),
        (a, Vec3::Y),
        (a, Vec3::Z),
        (b, aside),
        (b, across),
        (c, across),
    ]
}
