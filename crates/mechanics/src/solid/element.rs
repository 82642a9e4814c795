//! Quadratic brick element with 20 nodes, and its stiffness voxel by voxel.
//!
//! All cells are equal cubes. So the stiffness that a full voxel adds to its cell is computed once for each
//! of the [`N_VOXELS`] positions, and then only weighted. Twenty nodes represent all quadratic polynomials,
//! so a wall of any orientation bends correctly within one cell.

use shellock_geom::Vec3;

use super::voxels::{Fill, N_VOXELS, SIDE};
use crate::Material;

/// Number of nodes of a cell.
pub(super) const N_NODES: usize = 20;
/// Number of unordered pairs of nodes, each node with itself included.
const N_PAIRS: usize = N_NODES * (N_NODES + 1) / 2;

/// Positions of the nodes in [−1, 1]³: eight corners, then twelve edge midpoints.
pub(super) const NODES: [[i32; 3]; N_NODES] = [
    [-1, -1, -1],
    [1, -1, -1],
    [-1, 1, -1],
    [1, 1, -1],
    [-1, -1, 1],
    [1, -1, 1],
    [-1, 1, 1],
    [1, 1, 1],
    [0, -1, -1],
    [0, 1, -1],
    [0, -1, 1],
    [0, 1, 1],
    [-1, 0, -1],
    [1, 0, -1],
    [-1, 0, 1],
    [1, 0, 1],
    [-1, -1, 0],
    [1, -1, 0],
    [-1, 1, 0],
    [1, 1, 0],
];

/// Values of the shape functions at `xi` in [−1, 1]³. They sum to 1 and reproduce quadratic polynomials.
pub(super) fn shapes(xi: Vec3) -> [f64; N_NODES] {
    NODES.map(|node| {
        let n = Vec3::from(node.map(f64::from));
        let factor = |k: usize| {
            if node[k] == 0 {
                1.0 - xi[k] * xi[k]
            } else {
                1.0 + xi[k] * n[k]
            }
        };
        let product = factor(0) * factor(1) * factor(2);
        if node.contains(&0) {
            product / 4.0
        } else {
            product / 8.0 * (xi.dot(n) - 2.0)
        }
    })
}

/// Derivatives of the shape functions with respect to xi.
pub(super) fn slopes(xi: Vec3) -> [Vec3; N_NODES] {
    NODES.map(|node| {
        let n = Vec3::from(node.map(f64::from));
        let is_middle = node.contains(&0);
        let factor = |k: usize| {
            if node[k] == 0 {
                1.0 - xi[k] * xi[k]
            } else {
                1.0 + xi[k] * n[k]
            }
        };
        let slope = |k: usize| if node[k] == 0 { -2.0 * xi[k] } else { n[k] };
        Vec3::from(std::array::from_fn::<f64, 3, _>(|k| {
            let others = factor((k + 1) % 3) * factor((k + 2) % 3);
            if is_middle {
                slope(k) * others / 4.0
            } else {
                (slope(k) * (xi.dot(n) - 2.0) + factor(k) * n[k]) * others / 8.0
            }
        }))
    })
}

/// Centre of voxel `at` in the cell, in [−1, 1]³.
pub(super) fn middle(at: usize) -> Vec3 {
    let of = |k: usize| (2 * k + 1) as f64 / SIDE as f64 - 1.0;
    Vec3::new(of(at % SIDE), of(at / SIDE % SIDE), of(at / SIDE / SIDE))
}

/// Stiffness blocks, three by three, of all pairs of nodes i ≤ j, N/mm.
pub(super) type Blocks = [[f64; 9]; N_PAIRS];

/// Stiffness of each full voxel, and other quantities that all cells share.
pub(super) struct Elements {
    pub cell_mm: f64,
    pub lame: [f64; 2],
    voxels: Vec<Blocks>,
    full: Box<Blocks>,
}

impl Elements {
    pub fn new(material: &Material, cell_mm: f64) -> Self {
        let (e, nu) = (material.youngs_modulus_mpa, material.poissons_ratio);
        let lame = [e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu))];
        let voxels: Vec<Blocks> = (0..N_VOXELS).map(|at| voxel(lame, cell_mm, at)).collect();
        let mut full = Box::new([[0.0; 9]; N_PAIRS]);
        voxels.iter().for_each(|blocks| add(&mut full, blocks, 1.0));
        Self {
            cell_mm,
            lame,
            voxels,
            full,
        }
    }

    /// Stiffness of a cell with the given fill of its voxels, plus `void` times the material's stiffness
    /// throughout.
    ///
    /// The material of a partly filled voxel counts at its centroid.
    pub fn stiffness(&self, fills: &[Fill; N_VOXELS], void: f64) -> Box<Blocks> {
        if fills.iter().all(|f| f.share == 1.0) {
            return self.full.clone();
        }
        let mut sum = Box::new([[0.0; 9]; N_PAIRS]);
        add(&mut sum, &self.full, void);
        let voxel_mm3 = (self.cell_mm / SIDE as f64).powi(3);
        for (at, fill) in fills.iter().enumerate() {
            if fill.share == 1.0 {
                add(&mut sum, &self.voxels[at], 1.0);
            } else if fill.share > 0.0 {
                let volume_mm3 = f64::from(fill.share) * voxel_mm3;
                add_point(&mut sum, self.lame, self.cell_mm, centre(at, fill), volume_mm3);
            }
        }
        sum
    }
}

/// Centroid of the material of voxel `at` in the cell, in [−1, 1]³.
pub(super) fn centre(at: usize, fill: &Fill) -> Vec3 {
    middle(at) + Vec3::from(fill.middle.map(f64::from)) * (2.0 / SIDE as f64)
}

fn add(sum: &mut Blocks, blocks: &Blocks, factor: f64) {
    for (to, from) in sum.as_flattened_mut().iter_mut().zip(blocks.as_flattened()) {
        *to += factor * from;
    }
}

/// Pairs of nodes, in the order of [`Blocks`].
pub(super) fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..N_NODES).flat_map(|j| (0..=j).map(move |i| (i, j)))
}

/// Integrates `Bᵀ D B` over one voxel with three Gauss points along each axis, which is exact here.
fn voxel(lame: [f64; 2], cell_mm: f64, at: usize) -> Blocks {
    const GAUSS: [(f64, f64); 3] = [
        (-0.774_596_669_241_483_4, 5.0 / 9.0),
        (0.0, 8.0 / 9.0),
        (0.774_596_669_241_483_4, 5.0 / 9.0),
    ];
    let (centre, radius) = (middle(at), 1.0 / SIDE as f64);
    let mut blocks = [[0.0; 9]; N_PAIRS];
    for (x, wx) in GAUSS {
        for (y, wy) in GAUSS {
            for (z, wz) in GAUSS {
                let volume_mm3 = wx * wy * wz * (radius * cell_mm / 2.0).powi(3);
                let xi = centre + radius * Vec3::new(x, y, z);
                add_point(&mut blocks, lame, cell_mm, xi, volume_mm3);
            }
        }
    }
    blocks
}

/// Adds `Bᵀ D B` at one point, times a volume.
fn add_point(blocks: &mut Blocks, [lambda, mu]: [f64; 2], cell_mm: f64, xi: Vec3, volume_mm3: f64) {
    let g = slopes(xi).map(|g| (g * (2.0 / cell_mm)).to_array());
    for ((i, j), block) in pairs().zip(blocks) {
        let (gi, gj) = (g[i], g[j]);
        let shear = volume_mm3 * mu * (gi[0] * gj[0] + gi[1] * gj[1] + gi[2] * gj[2]);
        for a in 0..3 {
            let (press, slide) = (volume_mm3 * lambda * gi[a], volume_mm3 * mu * gj[a]);
            for b in 0..3 {
                block[3 * a + b] += press * gj[b] + slide * gi[b];
            }
            block[3 * a + a] += shear;
        }
    }
}

/// Von Mises stress at `xi` when the nodes of a cell are displaced by `moved_mm`, MPa.
pub(super) fn von_mises_mpa(elements: &Elements, moved_mm: &[Vec3; N_NODES], xi: Vec3) -> f64 {
    let [lambda, mu] = elements.lame;
    let g = slopes(xi).map(|g| g * (2.0 / elements.cell_mm));
    let mut gradient = [[0.0; 3]; 3];
    for (u, g) in moved_mm.iter().zip(&g) {
        for (k, row) in gradient.iter_mut().enumerate() {
            (0..3).for_each(|l| row[l] += u[k] * g[l]);
        }
    }
    let trace = gradient[0][0] + gradient[1][1] + gradient[2][2];
    let s = |a: usize, b: usize| {
        mu * (gradient[a][b] + gradient[b][a]) + if a == b { lambda * trace } else { 0.0 }
    };
    let direct = (s(0, 0) - s(1, 1)).powi(2) + (s(1, 1) - s(2, 2)).powi(2) + (s(2, 2) - s(0, 0)).powi(2);
    let shear = s(0, 1).powi(2) + s(1, 2).powi(2) + s(2, 0).powi(2);
    (0.5 * direct + 3.0 * shear).sqrt()
}
