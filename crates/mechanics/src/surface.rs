//! Surface-based metric: a projective-dynamics model of the shell (Sect. 5.2, Eq. 5).
//!
//! Parts are triangle meshes at mid-wall; along every seam both sides carry a narrow strip of triangles, the connectors:
//!
//! ```text
//!   ───a────b   b────b───         b: seam points, two at one place; t: tips of the strips, ℓ below along −ŝ
//!            \ /                  the male's tip is projected onto the female's strip: it may leave along ŝ and
//!             t   (both strips)   slide along the seam, and nothing else
//! ```
//!
//! The energy is Eq. 5's without inertia: `Σ k/2 ‖A x − B p‖²` over edges (stretch), hinges (bending) and contacts
//! (position), each `p` the nearest configuration in which the constraint has no energy. Loads move things by far less than
//! a triangle, so the projections are taken at the rest shape: an edge keeps its length, a hinge its angle, to first order.
//!
//! As in the paper the minimum is sought by descent, preconditioned with one constant matrix whose factor serves all plans
//! and many of them per solve. It is accelerated by conjugate directions with an exact line search over the piecewise
//! quadratic energy; Chebyshev's or Anderson's schemes need more steps for the same residual, as the contacts switch.
//!
//! Weights follow the material: `k = E h A/l²` for edges (a regular mesh then has Young's modulus E and Poisson's ratio
//! 1/3), `k = B l²/A` for hinges with `B = E h³/12(1 − ν²)`, A the area of the triangles at the edge.

mod solve;
mod terms;

use rayon::prelude::*;
use shellock_geom::Vec3;
use shellock_geom::sparse::{Cholesky, SparseError, SparseSymmetric};

use crate::assembly::{Joint, Opening, Resistance, ShellAssembly};
use crate::{Material, SIDES};
use terms::{Term, contacts, hinge, patch_terms, strip_terms};

/// Plans that are solved together on one factor: each further one costs a third of the first.
const PLANS_PER_SOLVE: usize = 16;

/// How the shell resists. Lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceParams {
    /// Wall thickness H. (0, 10]; 2.
    pub wall_mm: f64,
    /// Connector size D: pins are 0.6 D deep below the wall and half as thick as D. [1, 10]; 2.5.
    pub connector_mm: f64,
    /// What parts are made of.
    pub material: Material,
    /// Separation force on the connectors, N per mm of seam. (0, 1]; 0.01, which is Sect. 5.1's 10 N/m.
    pub force_n_per_mm: f64,
    /// Factors on the weights of stretch, bending and position constraints. > 0; 1, the material's.
    pub stiffness_ratios: [f64; 3],
    /// Relative error of the displacements, in the norm of the preconditioner, at which a solve ends. [10⁻⁹, 0.1]; 10⁻³.
    pub tolerance: f64,
    /// Iterations after which a plan is called separable if it still moves: those that hold need 20 to 80. [1, 10⁵]; 1000.
    pub max_iterations: usize,
}

impl Default for SurfaceParams {
    fn default() -> Self {
        Self {
            wall_mm: 2.0,
            connector_mm: 2.5,
            material: Material::default(),
            force_n_per_mm: 0.01,
            stiffness_ratios: [1.0; 3],
            tolerance: 1e-3,
            max_iterations: 1000,
        }
    }
}

impl SurfaceParams {
    /// Depth of the strips below mid-wall, mm.
    fn strip_mm(&self) -> f64 {
        0.5 * self.wall_mm + 0.6 * self.connector_mm
    }

    fn pin_mm(&self) -> f64 {
        0.5 * self.connector_mm
    }
}

/// One factorised model: parts, strips and what is held; plans differ in their joints alone.
#[derive(Debug)]
pub struct SurfaceModel {
    params: SurfaceParams,
    assembly: ShellAssembly,
    /// Mid-wall points, then two strip tips a station; tips have no place before there is a plan.
    points: Vec<Vec3>,
    /// Row of a point's x coordinate in the system; `None` where it is held.
    row: Vec<Option<u32>>,
    n_rows: usize,
    /// The point of the patch across each step's edge, on either side.
    beside: Vec<[Option<u32>; 2]>,
    patches: SparseSymmetric,
    factor: Cholesky,
}

/// A solved plan.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceSolution {
    /// Whether and how well it holds.
    pub resistance: Resistance,
    /// Iterations that it took.
    pub n_iterations: usize,
    /// Estimated relative error at the end.
    pub error: f64,
}

impl SurfaceModel {
    /// The model with part `fixed` held.
    pub fn new(params: &SurfaceParams, assembly: &ShellAssembly, fixed: u32) -> Result<Self, SparseError> {
        let is_held: Vec<bool> = assembly.part_of_point.iter().map(|&p| p == fixed).collect();
        Self::with_held_points(params, assembly, &is_held)
    }

    /// The model with some points held.
    ///
    /// # Panics
    /// Where `is_held` is shorter than the assembly's points.
    pub fn with_held_points(
        params: &SurfaceParams,
        assembly: &ShellAssembly,
        is_held: &[bool],
    ) -> Result<Self, SparseError> {
        let mid_wall = assembly.points.iter().zip(&assembly.normals).map(|(p, n)| *p - 0.5 * params.wall_mm * *n);
        let mut points: Vec<Vec3> = mid_wall.collect();
        points.resize(points.len() + 2 * assembly.stations.len(), Vec3::ZERO);
        let mut n_rows = 0;
        let row: Vec<Option<u32>> = (0..points.len())
            .map(|i| {
                let is_free = i >= assembly.points.len() || !is_held[i];
                is_free.then(|| {
                    n_rows += 3;
                    n_rows - 3
                })
            })
            .collect();
        let n_rows = n_rows as usize;
        let beside = beside_steps(assembly);
        let terms = patch_terms(params, assembly, &points);
        let patches = matrix(n_rows, &row, &terms, &[]);
        let springs = isotropic(params, assembly, &points);
        let factor = Cholesky::new(&matrix(n_rows, &row, &terms, &springs))?;
        let (params, assembly) = (*params, assembly.clone());
        Ok(Self { params, assembly, points, row, n_rows, beside, patches, factor })
    }

    /// Unknowns of the system.
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// How well each plan, given by its joint at every station, resists the separation force; on all cores.
    pub fn resist_all(&self, plans: &[Vec<Option<Joint>>]) -> Vec<SurfaceSolution> {
        let loaded: Vec<(&[Option<Joint>], Vec<Vec3>)> = plans.iter().map(|j| (j.as_slice(), self.pulls(j))).collect();
        self.respond_all(&loaded)
    }

    /// How well one plan resists.
    pub fn resist(&self, joints: &[Option<Joint>]) -> SurfaceSolution {
        self.respond_all(&[(joints, self.pulls(joints))]).swap_remove(0)
    }

    /// Answers to given forces, N, on the tip of side a of each station; on side b the opposite.
    pub fn respond_all(&self, plans: &[(&[Option<Joint>], Vec<Vec3>)]) -> Vec<SurfaceSolution> {
        // Chunks of fixed size, so that results do not depend on the number of threads.
        let chunks = plans.par_chunks(PLANS_PER_SOLVE.min(plans.len().div_ceil(2)).max(1));
        chunks.flat_map_iter(|chunk| solve::solve(self, chunk)).collect()
    }

    fn pulls(&self, joints: &[Option<Joint>]) -> Vec<Vec3> {
        let pull = |(j, s): (&Option<Joint>, &crate::Station)| {
            j.map_or(Vec3::ZERO, |j| self.params.force_n_per_mm * s.length_mm * j.pull_on_a)
        };
        joints.iter().zip(&self.assembly.stations).map(pull).collect()
    }

    /// The tip of one side's strip at a station.
    fn tip(&self, station: usize, side: usize) -> usize {
        self.assembly.points.len() + 2 * station + side
    }

    /// Constraints of strips and contacts under a plan.
    fn terms_of(&self, joints: &[Option<Joint>]) -> Vec<Term> {
        let mut points = self.points.clone();
        for (i, (station, joint)) in self.assembly.stations.iter().zip(joints).enumerate() {
            let leaves = joint.map_or(station.normal, |j| j.leaves);
            for side in SIDES.map(crate::Side::index) {
                points[self.tip(i, side)] = points[station.points[side] as usize] - self.params.strip_mm() * leaves;
            }
        }
        let mut terms = Vec::new();
        for (step, &stations) in self.assembly.steps.iter().enumerate() {
            for side in 0..2 {
                let [s, t] = stations.map(|s| s as usize);
                let at = |s: usize| self.assembly.stations[s].points[side] as usize;
                let quad = [at(s), at(t), self.tip(s, side), self.tip(t, side)];
                let beside = self.beside[step][side].map(|v| v as usize);
                terms.extend(strip_terms(&self.params, &points, quad, beside));
            }
        }
        for (i, (station, joint)) in self.assembly.stations.iter().zip(joints).enumerate() {
            if let Some(joint) = joint {
                let tips = [0, 1].map(|side| self.tip(i, side));
                terms.extend(contacts(&self.params, station, joint, tips));
            }
        }
        terms
    }

    /// Rates the displacements that a plan came to.
    fn rated(&self, joints: &[Option<Joint>], moved: &[f64]) -> Opening {
        let at = |point: usize| self.row[point].map_or(Vec3::ZERO, |r| Vec3::from_slice(&moved[r as usize..]));
        let opening =
            |(i, j): (usize, &Option<Joint>)| j.map_or(0.0, |_| (at(self.tip(i, 0)) - at(self.tip(i, 1))).length());
        Opening::rated(joints, joints.iter().enumerate().map(opening).collect())
    }
}

/// The third point of the patch triangle at the edge of each step, on either side; `None` where no triangle has that edge.
fn beside_steps(assembly: &ShellAssembly) -> Vec<[Option<u32>; 2]> {
    let mut edges: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * assembly.triangles.len());
    for &[a, b, c] in &assembly.triangles {
        edges.extend([(a, b, c), (b, c, a), (c, a, b)].map(|(x, y, z)| ([x.min(y), x.max(y)], z)));
    }
    edges.sort_unstable();
    let find = |x: u32, y: u32| {
        let key = [x.min(y), x.max(y)];
        let i = edges.partition_point(|e| e.0 < key);
        edges.get(i).filter(|e| e.0 == key).map(|e| e.1)
    };
    let stations = &assembly.stations;
    let of_step = |&[s, t]: &[u32; 2]| {
        [0, 1].map(|side| find(stations[s as usize].points[side], stations[t as usize].points[side]))
    };
    assembly.steps.iter().map(of_step).collect()
}

/// Springs `(i, j, k)` that bear on all directions alike: stand-ins for strips and contacts in the preconditioner, and a
/// tie of every point to its rest place that keeps the matrix definite where parts float.
fn isotropic(params: &SurfaceParams, assembly: &ShellAssembly, points: &[Vec3]) -> Vec<(usize, Option<usize>, f64)> {
    let [stretch, _, position] = params.stiffness_ratios;
    let modulus = params.material.youngs_modulus_mpa;
    let (n, strip) = (assembly.points.len(), params.strip_mm());
    let mut springs: Vec<(usize, Option<usize>, f64)> =
        (0..points.len()).map(|i| (i, None, solve::GROUND_SHARE * modulus * params.wall_mm)).collect();
    for (i, s) in assembly.stations.iter().enumerate() {
        let bend = 3.0 * terms::bending(params, params.pin_mm()) * s.length_mm / strip.powi(3);
        for side in 0..2 {
            let tip = n + 2 * i + side;
            springs.push((s.points[side] as usize, Some(tip), stretch.sqrt() * bend));
        }
        let contact = terms::POSITION_SHARE * position * modulus * s.length_mm;
        springs.push((n + 2 * i, Some(n + 2 * i + 1), 0.5 * contact));
        springs.push((s.points[0] as usize, Some(s.points[1] as usize), 0.5 * contact));
    }
    for &[s, t] in &assembly.steps {
        let [x, y] = [s, t].map(|s| assembly.stations[s as usize]);
        let length_mm = points[x.points[0] as usize].distance(points[y.points[0] as usize]).max(0.1);
        let along = stretch * modulus * params.pin_mm() * strip / length_mm;
        for side in 0..2 {
            springs.push((n + 2 * s as usize + side, Some(n + 2 * t as usize + side), along));
        }
    }
    springs
}

/// The matrix of the terms' energies and of springs that bear on all directions alike.
fn matrix(
    n_rows: usize,
    row: &[Option<u32>],
    terms: &[Term],
    springs: &[(usize, Option<usize>, f64)],
) -> SparseSymmetric {
    let mut entries = Vec::new();
    for term in terms {
        let corners: Vec<(u32, Vec3)> = term.corners().filter_map(|(p, g)| row[p].map(|r| (r, g))).collect();
        for (i, &(r, g)) in corners.iter().enumerate() {
            for &(q, h) in &corners[i..] {
                for (x, gx) in (0..).zip(g.to_array()) {
                    for (y, hy) in (0..).zip(h.to_array()) {
                        if r != q || y >= x {
                            entries.push((r + x, q + y, term.stiffness * gx * hy));
                        }
                    }
                }
            }
        }
    }
    for &(i, j, k) in springs {
        let (i, j) = (row[i], j.map(|j| row[j]));
        for x in 0..3 {
            for end in [i, j.flatten()].into_iter().flatten() {
                entries.push((end + x, end + x, k));
            }
            if let (Some(i), Some(Some(j))) = (i, j) {
                entries.push((i + x, j + x, -k));
            }
        }
    }
    SparseSymmetric::from_entries(n_rows, entries)
}

#[cfg(test)]
mod tests;
