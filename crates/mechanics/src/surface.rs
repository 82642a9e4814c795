//! Surface-based metric: a projective-dynamics model of the shell (Sect. 5.2, Eq. 5).
//!
//! Parts are triangle meshes at mid-wall. Along every seam both sides carry a narrow strip of triangles,
//! which models the connectors:
//!
//! ```text
//!   ───a────b   b────b───         b: seam points, two at one place; t: tips of the strips, ℓ below along −ŝ;
//!            \ /                  the male's tip is projected onto the female's strip: it may only leave
//!             t   (both strips)   along ŝ and slide along the seam; walls may part, not enter each other
//! ```
//!
//! Strips are short and thick. Each turns with the triangles at its seam point, and its own bending is
//! modelled by the contact.
//!
//! The energy is that of Eq. 5 without inertia: `Σ k/2 ‖A x − B p‖²` over edges (stretch), hinges (bending)
//! and contacts (position). Each `p` is the nearest configuration in which the constraint has no energy.
//! Displacements are far smaller than a triangle, so projections are taken at the rest shape: to first order,
//! an edge keeps its length and a hinge its angle.
//!
//! The static state is computed directly, not approached by iteration. One factorisation of the meshes serves
//! all plans: it condenses each part onto the motions of its stations. A plan adds contacts between stations,
//! which form a small system in the forces of the closed contacts. Newton's method solves it exactly in about
//! six steps, each of which joins the parts two at a time: 5 to 8 ms in all for a plan with 170 stations.
//! (With the motions as unknowns, four on either side of each station, ten steps took ten times as long.
//! Local and global steps with one matrix, the paper's way, took 240 to 1000 iterations for three digits,
//! even with conjugate directions and the parts' rigid motions projected out, since plans that barely hold
//! are soft where the matrix is stiff.)
//!
//! Weights follow the material: `k = E h A/l²` for edges (a regular mesh then has Young's modulus E and
//! Poisson's ratio 1/3), `k = B l²/A` for hinges with `B = E h³/12(1 − ν²)`, A the area of the triangles at
//! the edge.

mod contact;
mod join;
mod load;
mod parts;
mod solve;
mod terms;

use rayon::prelude::*;
use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;

use crate::Material;
use crate::assembly::{Joint, Meeting, Resistance, ShellAssembly, Station};
use crate::connector::{PIN_DEPTH, PIN_WIDTH};
pub use load::{Bearing, Closed, Drift, JoinedParts};
use parts::{N_MOTIONS, Part, parts};
use solve::Layout;
pub use solve::SOLVES;

/// Stiffness, force and solver parameters of the shell. Lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceParams {
    /// Wall thickness H. (0, 10]; 2.
    pub wall_mm: f64,
    /// Connector size D that sets the stiffness of contacts where walls meet without a connector. A connector
    /// has its own size. [1, 10]; 2.5.
    pub connector_mm: f64,
    /// Material of all the parts.
    pub material: Material,
    /// Separation force on the connectors, N per mm of seam. (0, 1]; 0.01, which is Sect. 5.1's 10 N/m.
    pub force_n_per_mm: f64,
    /// Factors on the weights of stretch, bending and position constraints. > 0; 1, the material's.
    pub stiffness_ratios: [f64; 3],
    /// Greatest residual force, as a share of the force. [10⁻⁹, 0.1]; 10⁻⁶.
    pub tolerance: f64,
    /// Newton steps after which the solver stops and reports the remaining error; most plans take 4 to 10.
    /// [1, 10⁴]; 100.
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
            tolerance: 1e-6,
            max_iterations: 100,
        }
    }
}

impl SurfaceParams {
    /// Depth of a joint's strips below mid-wall, mm.
    fn strip_mm(&self, joint: &Joint) -> f64 {
        0.5 * self.wall_mm + PIN_DEPTH * joint.size_mm
    }

    /// Stiffness of a contact along `length_mm` of seam, N/mm. Models a pin of size D that bends like a
    /// cantilever.
    fn contact_n_mm(&self, size_mm: f64, length_mm: f64) -> f64 {
        let (thickness, depth) = (PIN_WIDTH * size_mm, PIN_DEPTH * size_mm);
        3.0 * self.stiffness_ratios[2] * terms::bending_stiffness(self, thickness) * length_mm / depth.powi(3)
    }
}

/// Parts, condensed onto their stations. Plans differ in their meetings and in the held part.
#[derive(Debug)]
pub struct SurfaceModel {
    params: SurfaceParams,
    assembly: ShellAssembly,
    parts: Vec<Part>,
    /// True if any point is held.
    is_held: bool,
    /// Layout for plans in which no part is held.
    free: Layout,
}

/// Solution of one plan.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceSolution {
    /// Result for the plan: its openings, or the parts that come off.
    pub resistance: Resistance,
    /// Number of Newton steps taken.
    pub n_iterations: usize,
    /// Residual force, as a share of the force.
    pub error: f64,
}

impl SurfaceModel {
    /// Builds the model of `assembly` without held points.
    pub fn new(params: &SurfaceParams, assembly: &ShellAssembly) -> Result<Self, SparseError> {
        Self::with_held_points(params, assembly, &vec![false; assembly.points.len()])
    }

    /// Builds the model with some points held.
    pub fn with_held_points(
        params: &SurfaceParams,
        assembly: &ShellAssembly,
        is_held: &[bool],
    ) -> Result<Self, SparseError> {
        let parts = parts(params, assembly, is_held)?;
        let (params, assembly) = (*params, assembly.clone());
        let free = Layout::new(&parts, assembly.stations.len(), &[], 0.0);
        Ok(Self {
            free,
            params,
            assembly,
            parts,
            is_held: is_held.contains(&true),
        })
    }

    /// Layout shared by all plans that hold the parts with `is_held`.
    fn layout(&self, is_held: &[bool]) -> Layout {
        let held_mm_n = solve::held_compliance(&self.params);
        Layout::new(&self.parts, self.assembly.stations.len(), is_held, held_mm_n)
    }

    /// Number of unknowns of a plan's equilibrium: the motions of both sides of all stations.
    pub fn n_rows(&self) -> usize {
        2 * N_MOTIONS * self.assembly.stations.len()
    }

    /// Solves each plan under the separation force with part `held` fixed, on all cores. A plan lists its
    /// meeting at every station.
    pub fn resist_all(&self, plans: &[Vec<Meeting>], held: u32) -> Result<Vec<SurfaceSolution>, SparseError> {
        plans.par_iter().map(|plan| self.resist(plan, held)).collect()
    }

    /// Solves one plan under the separation force with part `held` fixed.
    pub fn resist(&self, plan: &[Meeting], held: u32) -> Result<SurfaceSolution, SparseError> {
        let is_held: Vec<bool> = (0..self.parts.len()).map(|p| p == held as usize).collect();
        solve::solve(self, plan, &is_held, &self.pulls(plan))
    }

    /// Solves for part `free` alone, with all others fixed.
    pub fn resist_alone(&self, plan: &[Meeting], free: u32) -> Result<SurfaceSolution, SparseError> {
        let is_held: Vec<bool> = (0..self.parts.len()).map(|p| p != free as usize).collect();
        solve::solve(self, plan, &is_held, &self.pulls(plan))
    }

    /// Separation force on side a of each station, N.
    fn pulls(&self, plan: &[Meeting]) -> Vec<Vec3> {
        let pull = |(m, s): (&Meeting, &Station)| {
            m.joint.map_or(Vec3::ZERO, |j| {
                self.params.force_n_per_mm * s.length_mm * j.pull_on_a
            })
        };
        plan.iter().zip(&self.assembly.stations).map(pull).collect()
    }

    /// Solves for given forces, N, on the tips of side a at each station and, reversed, of side b. Only the
    /// held points are fixed.
    pub fn respond(&self, plan: &[Meeting], pulls: &[Vec3]) -> Result<SurfaceSolution, SparseError> {
        solve::solve(self, plan, &[], pulls)
    }
}

#[cfg(test)]
mod tests;
