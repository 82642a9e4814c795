//! Thin shells as flat triangles with six degrees of freedom a node: displacements and stresses under several
//! loads, for many thicknesses.
//!
//! ```text
//!   ShellModel::new(mesh, material)      elements and pattern, once a mesh:   K = H·K_m + H³·K_b
//!         .at_thickness(H)               a factorisation:                     no node is held for good,
//!         .at_thickness_held(H, supports)                                     or these are
//!             .solve(cases)              two triangular solves a case
//!             .stresses(displacements)   both faces of every triangle
//! ```
//!
//! **What holds.** It differs from case to case. Two ways, which answer different questions (figures in
//! docs/notes/shell.md):
//!
//! - *In the mean*, for all cases one factorisation: over the area of the case's region, the mean
//!   displacement and the mean rotation of its nodes vanish. The reaction to that is a traction that varies
//!   linearly over the region, and equilibrium alone says which: six numbers from six equations. So each
//!   case's loads are brought into equilibrium first, the free shell is solved with the six supports of one
//!   node, which then carry nothing, and the rigid motion is taken away last. The region itself bends under
//!   the traction: the 99th percentile of stress was 1.5 to 2.1 times that of a clamped region. With all
//!   nodes held so, it is inertia relief: a free body that its loads accelerate.
//! - *Clamped*, for each set of supports a factorisation (0.2 s for 5 000 points), but no assembly and no
//!   order of elimination. The stress at the edge of what is clamped grows with every refinement.
//!
//! Each connected part of the mesh is held by its own nodes. The element is described in `element`;
//! docs/notes/shell.md has benchmarks.
//!
//! Source: Sect. 4.3 of the paper, which does not say what element it uses. Limits: small displacements, a
//! thickness that is the same everywhere and small beside the radii of curvature, no shear across the wall.

mod element;
mod region;
mod solver;
mod stress;
#[cfg(test)]
mod tests;

use nalgebra::Matrix3;
use rayon::prelude::*;
use shellock_geom::sparse::{EliminationOrder, SparseError, SparseSymmetric};
use shellock_geom::{TriMesh, Vec3};

pub use solver::{Displacements, LoadCase, ShellSolver, Support};
pub use stress::{FaceStress, ShellStress};

use crate::Material;
use element::{Element, Stiffness};

/// Degrees of freedom of a node: displacements along x, y and z, rotations about them.
pub(crate) const DOFS: usize = 6;

/// Height of a triangle over its longest edge below which it is refused as having no area.
///
/// The entries of a stiffness grow as the inverse of this. Remeshed surfaces stay far above it.
const MIN_HEIGHT: f64 = 1e-5;

/// Thickness that can be solved for, mm.
const THICKNESS_MM: std::ops::RangeInclusive<f64> = 1e-3..=1e3;

/// Why a shell could not be modelled or solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShellError {
    /// Young's modulus not in (0, 10¹²], or Poisson's ratio not in [0, 0.49].
    #[error(
        "no shell is made of E = {youngs_modulus_mpa} MPa, ν = {poissons_ratio}: E must be in (0, 1e12], ν in [0, 0.49]"
    )]
    Material {
        /// E, MPa.
        youngs_modulus_mpa: f64,
        /// ν.
        poissons_ratio: f64,
    },
    /// The mesh has no triangle.
    #[error("the mesh has no triangle")]
    Empty,
    /// A coordinate is not finite.
    #[error("point {0} is not finite")]
    PointNotFinite(u32),
    /// A triangle names a point that is not there.
    #[error("triangle {0} names a point that the mesh does not have")]
    MissingPoint(u32),
    /// A triangle is a line or a point.
    #[error("triangle {0} has no area: remesh the surface")]
    FlatTriangle(u32),
    /// Nothing holds a point that no triangle uses.
    #[error("point {0} belongs to no triangle: remove unused points")]
    LoosePoint(u32),
    /// Out of range.
    #[error("a thickness of {0} mm must be in [0.001, 1000]")]
    Thickness(f64),
    /// A support or a case names a point that is not there.
    #[error("point {0} is held, but the mesh does not have it")]
    MissingSupport(u32),
    /// The supports let part of the shell move as a rigid body.
    #[error("the supports do not hold the part of the shell that has point {0}: hold more nodes of it")]
    Loose(u32),
    /// A load case has another number of nodes than the mesh.
    #[error("load case {case} has {have} loads for {want} points")]
    LoadLength {
        /// Place of the case.
        case: usize,
        /// Loads in the case.
        have: usize,
        /// Points of the mesh.
        want: usize,
    },
    /// A load is not finite.
    #[error("the load of point {point} in case {case} is not finite")]
    LoadNotFinite {
        /// Place of the case.
        case: usize,
        /// Point with the load.
        point: u32,
    },
    /// A part of the shell has loads that do not balance and no node that holds.
    #[error(
        "case {case} pushes the part of the shell that has point {point}, and none of its nodes hold: hold some there"
    )]
    Unbalanced {
        /// Place of the case.
        case: usize,
        /// Lowest point of the part.
        point: u32,
    },
    /// The nodes that hold lie on a line, so that the shell can turn about it.
    #[error("the nodes held in case {case} lie on a line: hold a region with an area")]
    HeldOnLine {
        /// Place of the case.
        case: usize,
    },
    /// A case names nodes that hold, but the solver's supports do.
    #[error("case {case} has its own nodes held, and so has the solver: use one or the other")]
    HeldTwice {
        /// Place of the case.
        case: usize,
    },
    /// The factorisation failed.
    #[error(transparent)]
    Solve(#[from] SparseError),
}

/// A shell of unit thickness: what all thicknesses, supports and loads have in common.
#[derive(Debug)]
pub struct ShellModel {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    elements: Vec<Element>,
    elasticity: Matrix3<f64>,
    /// The places of all stiffnesses, with values 0.
    pattern: SparseSymmetric,
    order: EliminationOrder,
    /// Stiffness of the membrane and in bending at thickness 1 mm, at the places of `pattern`.
    membrane: Vec<f64>,
    bending: Vec<f64>,
    /// A third of the area of the triangles around each node, mm².
    areas_mm2: Vec<f64>,
    /// The lowest point of the connected part that each point belongs to.
    part_of_point: Vec<u32>,
}

impl ShellModel {
    /// Computes the elements, adds them up and orders the elimination; 0.2 s for 5 000 points.
    ///
    /// The mesh is the middle surface; it may be open, branch, or have several parts. Corners go
    /// counter-clockwise seen from the outer face.
    pub fn new(mesh: &TriMesh, material: &Material) -> Result<Self, ShellError> {
        check(mesh, material)?;
        let n_nodes = mesh.points.len();
        let (e, nu) = (material.youngs_modulus_mpa, material.poissons_ratio);
        let elasticity = element::plane_stress(e, nu);
        let elements: Vec<(Element, [Stiffness; 2])> = (0..mesh.triangles.len())
            .into_par_iter()
            .map(|t| Element::new(mesh.corners(t), &elasticity))
            .collect();

        let pattern = SparseSymmetric::of_cells(n_nodes, DOFS, &mesh.triangles);
        let [membrane, bending] = assembled(&pattern, &mesh.triangles, &elements);
        let mut areas_mm2 = vec![0.0; n_nodes];
        for (t, corners) in mesh.triangles.iter().enumerate() {
            corners
                .iter()
                .for_each(|&v| areas_mm2[v as usize] += mesh.face_area(t) / 3.0);
        }
        Ok(Self {
            order: EliminationOrder::of_blocks(&pattern, DOFS)?,
            points: mesh.points.clone(),
            triangles: mesh.triangles.clone(),
            elements: elements.into_iter().map(|(element, _)| element).collect(),
            part_of_point: parts(n_nodes, &mesh.triangles),
            elasticity,
            pattern,
            membrane,
            bending,
            areas_mm2,
        })
    }

    /// A third of the area of the triangles around each point, mm²: what turns pressures into forces, areas
    /// into masses.
    pub fn areas_mm2(&self) -> &[f64] {
        &self.areas_mm2
    }

    /// The points of each connected part, in ascending order.
    fn parts(&self) -> Vec<Vec<u32>> {
        let mut parts = vec![Vec::new(); self.points.len()];
        for (v, &part) in (0..).zip(&self.part_of_point) {
            parts[part as usize].push(v);
        }
        parts.retain(|part| !part.is_empty());
        parts
    }

    /// Factorises the stiffness of the shell with thickness `thickness_mm`, in [0.001, 1000], which each load
    /// case holds in the mean of nodes of its own.
    pub fn at_thickness(&self, thickness_mm: f64) -> Result<ShellSolver<'_>, ShellError> {
        ShellSolver::free(self, thickness_mm)
    }

    /// As [`at_thickness`](Self::at_thickness), where `supports` hold the shell in all cases.
    pub fn at_thickness_held(
        &self,
        thickness_mm: f64,
        supports: &[Support],
    ) -> Result<ShellSolver<'_>, ShellError> {
        ShellSolver::held(self, thickness_mm, supports)
    }
}

/// The stiffnesses of all elements, in the membrane and in bending, added up at the places of `pattern`.
fn assembled(
    pattern: &SparseSymmetric,
    triangles: &[[u32; 3]],
    elements: &[(Element, [Stiffness; 2])],
) -> [Vec<f64>; 2] {
    let mut sums = [vec![0.0; pattern.n_places()], vec![0.0; pattern.n_places()]];
    let pairs: Vec<[usize; 2]> = (0..3).flat_map(|i| (0..3).map(move |j| [i, j])).collect();
    for (corners, (_, stiffnesses)) in triangles.iter().zip(elements) {
        for &[i, j] in pairs.iter().filter(|[i, j]| corners[*i] <= corners[*j]) {
            for c in 0..DOFS {
                // Below each other in a column stand all rows of a node, down to the diagonal.
                let n_rows = if i == j { c + 1 } else { DOFS };
                let column = corners[j] * DOFS as u32 + c as u32;
                let Some(first) = pattern.position(corners[i] * DOFS as u32, column) else {
                    continue;
                };
                for (sum, stiffness) in sums.iter_mut().zip(stiffnesses) {
                    for r in 0..n_rows {
                        sum[first + r] += stiffness[(DOFS * i + r, DOFS * j + c)];
                    }
                }
            }
        }
    }
    sums
}

fn check(mesh: &TriMesh, material: &Material) -> Result<(), ShellError> {
    let Material {
        youngs_modulus_mpa,
        poissons_ratio,
        ..
    } = *material;
    let is_elastic =
        0.0 < youngs_modulus_mpa && youngs_modulus_mpa <= 1e12 && (0.0..=0.49).contains(&poissons_ratio);
    if !is_elastic {
        return Err(ShellError::Material {
            youngs_modulus_mpa,
            poissons_ratio,
        });
    }
    if mesh.triangles.is_empty() {
        return Err(ShellError::Empty);
    }
    if let Some(point) = mesh.points.iter().position(|p| !p.is_finite()) {
        return Err(ShellError::PointNotFinite(point as u32));
    }
    let mut is_used = vec![false; mesh.points.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        if corners.iter().any(|&v| v as usize >= mesh.points.len()) {
            return Err(ShellError::MissingPoint(t as u32));
        }
        let [a, b, c] = mesh.corners(t);
        let longest_sq = (b - a)
            .length_squared()
            .max((c - b).length_squared())
            .max((a - c).length_squared());
        let has_area = mesh.area_vector_doubled(t).length() > MIN_HEIGHT * longest_sq;
        if !has_area {
            return Err(ShellError::FlatTriangle(t as u32));
        }
        corners.iter().for_each(|&v| is_used[v as usize] = true);
    }
    match is_used.iter().position(|is_used| !is_used) {
        Some(point) => Err(ShellError::LoosePoint(point as u32)),
        None => Ok(()),
    }
}

/// The lowest point of the connected part that each point belongs to.
fn parts(n_points: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    }
    let mut parent: Vec<u32> = (0..n_points as u32).collect();
    for &[a, b, c] in triangles {
        for other in [b, c] {
            let (x, y) = (root(&mut parent, a), root(&mut parent, other));
            parent[x.max(y) as usize] = x.min(y);
        }
    }
    (0..n_points as u32).map(|v| root(&mut parent, v)).collect()
}
