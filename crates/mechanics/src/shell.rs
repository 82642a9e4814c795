//! Thin shells as flat triangles with six degrees of freedom a node. Computes displacements and stresses
//! under several loads, for many thicknesses.
//!
//! ```text
//!   ShellModel::new(mesh, material)      elements and pattern, once a mesh:   K = H·K_m + H³·K_b
//!         .at_thickness(H)               one factorisation:                   each case holds its own nodes,
//!         .at_thickness_with(H, supports)                                     or these supports hold all
//!             .solve(cases)              two triangular solves a case
//!             .stresses(displacements)   both faces of every triangle
//! ```
//!
//! **Supports.** They differ from case to case. There are two ways to hold a shell, which answer different
//! questions (figures in docs/notes/shell.md):
//!
//! - *In the mean*: one factorisation serves all cases. Over the area of the case's region, the mean
//!   displacement and the mean rotation of its nodes vanish. The reaction is a traction that varies linearly
//!   over the region. Equilibrium alone determines it: six numbers from six equations. So the loads of each
//!   case are first brought into equilibrium. Then the free shell is solved with all six degrees of freedom
//!   of one node held, which carry no force. Last, the rigid motion is subtracted. The region itself bends
//!   under the traction: the 99th percentile of stress was 1.5 to 2.1 times that of a clamped region. Holding
//!   all nodes in the mean is inertia relief: a free body accelerated by its loads.
//! - *Clamped*: each set of supports needs a factorisation (0.2 s for 5 000 points), but no new assembly and
//!   no new elimination order. The stress at the edge of the clamped region grows with every refinement.
//!
//! Each connected part of the mesh needs its own held nodes. The element is described in `element`;
//! docs/notes/shell.md has benchmarks.
//!
//! Source: Sect. 4.3 of the paper, which does not name its element. Limits: small displacements, a uniform
//! thickness that is small compared with the radii of curvature, no shear across the wall.

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

/// Least height of a triangle over its longest edge; flatter triangles are rejected as having no area.
///
/// The entries of a stiffness matrix grow as the inverse of this ratio. Remeshed surfaces stay far above it.
const MIN_HEIGHT: f64 = 1e-5;

/// Range of thickness that can be solved for, mm.
const THICKNESS_MM: std::ops::RangeInclusive<f64> = 1e-3..=1e3;

/// Reasons why a shell could not be modelled or solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShellError {
    /// Young's modulus not in (0, 10¹²], or Poisson's ratio not in [0, 0.49].
    #[error(
        "no shell is made of E = {youngs_modulus_mpa} MPa, ν = {poissons_ratio}: E must be in (0, 1e12], ν \
         in [0, 0.49]"
    )]
    Material {
        /// Young's modulus E, MPa.
        youngs_modulus_mpa: f64,
        /// Poisson's ratio ν, without unit.
        poissons_ratio: f64,
    },
    /// The mesh has no triangles.
    #[error("the mesh has no triangle")]
    Empty,
    /// A coordinate is not finite.
    #[error("point {0} is not finite")]
    PointNotFinite(u32),
    /// A triangle refers to a point that does not exist.
    #[error("triangle {0} names a point that the mesh does not have")]
    MissingPoint(u32),
    /// A triangle degenerates to a line or a point.
    #[error("triangle {0} has no area: remesh the surface")]
    FlatTriangle(u32),
    /// No triangle uses a point, so nothing holds it.
    #[error("point {0} belongs to no triangle: remove unused points")]
    LoosePoint(u32),
    /// The thickness is out of range.
    #[error("a thickness of {0} mm must be in [0.001, 1000]")]
    Thickness(f64),
    /// A support or a load case refers to a point that does not exist.
    #[error("point {0} is held, but the mesh does not have it")]
    MissingSupport(u32),
    /// The supports let part of the shell move as a rigid body.
    #[error("the supports do not hold the part of the shell that has point {0}: hold more nodes of it")]
    Loose(u32),
    /// A load case has a different number of loads than the mesh has points.
    #[error("load case {case} has {have} loads for {want} points")]
    LoadLength {
        /// Index of the load case.
        case: usize,
        /// Number of loads in the case.
        have: usize,
        /// Number of points in the mesh.
        want: usize,
    },
    /// A load is not finite.
    #[error("the load of point {point} in case {case} is not finite")]
    LoadNotFinite {
        /// Index of the load case.
        case: usize,
        /// Point that has the load.
        point: u32,
    },
    /// A connected part has loads that do not balance and no held node.
    #[error(
        "case {case} pushes the part of the shell that has point {point}, and none of its nodes hold: hold \
         some there"
    )]
    Unbalanced {
        /// Index of the load case.
        case: usize,
        /// Lowest-numbered point of the part.
        point: u32,
    },
    /// The held nodes lie on a line, so the shell can turn about it.
    #[error("the nodes held in case {case} lie on a line: hold a region with an area")]
    HeldOnLine {
        /// Index of the load case.
        case: usize,
    },
    /// A load case names held nodes although the solver already has supports.
    #[error("case {case} has its own nodes held, and so has the solver: use one or the other")]
    HeldTwice {
        /// Index of the load case.
        case: usize,
    },
    /// The factorisation of the stiffness failed.
    #[error(transparent)]
    Solve(#[from] SparseError),
}

/// Shell of unit thickness: the data shared by all thicknesses, supports and loads.
#[derive(Debug)]
pub struct ShellModel {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    elements: Vec<Element>,
    elasticity: Matrix3<f64>,
    /// Sparsity pattern of the stiffness matrices, with values 0.
    pattern: SparseSymmetric,
    order: EliminationOrder,
    /// Membrane and bending stiffness at thickness 1 mm, at the entries of `pattern`.
    membrane: Vec<f64>,
    bending: Vec<f64>,
    /// A third of the area of the triangles around each node, mm².
    areas_mm2: Vec<f64>,
    /// Lowest-numbered point of the connected part that each point belongs to.
    part_of_point: Vec<u32>,
}

impl ShellModel {
    /// Computes the elements, assembles them and orders the elimination; 0.2 s for 5 000 points.
    ///
    /// The mesh is the middle surface. It may be open, branch, or have several parts. Corners are ordered
    /// counter-clockwise as seen from the outer face.
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
        let [membrane, bending] = assemble(&pattern, &mesh.triangles, &elements);
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

    /// Area of each point, mm²: a third of the area of the triangles around it. Converts pressures into
    /// forces and areas into masses.
    pub fn areas_mm2(&self) -> &[f64] {
        &self.areas_mm2
    }

    /// Points of each connected part, in ascending order.
    fn parts(&self) -> Vec<Vec<u32>> {
        let mut parts = vec![Vec::new(); self.points.len()];
        for (v, &part) in (0..).zip(&self.part_of_point) {
            parts[part as usize].push(v);
        }
        parts.retain(|part| !part.is_empty());
        parts
    }

    /// Factorises the stiffness of the shell for `thickness_mm`, in [0.001, 1000]. Each load case is held in
    /// the mean over its own nodes.
    pub fn at_thickness(&self, thickness_mm: f64) -> Result<ShellSolver<'_>, ShellError> {
        ShellSolver::free(self, thickness_mm)
    }

    /// Like [`at_thickness`](Self::at_thickness), but `supports` hold the shell in all load cases.
    pub fn at_thickness_with(
        &self,
        thickness_mm: f64,
        supports: &[Support],
    ) -> Result<ShellSolver<'_>, ShellError> {
        ShellSolver::with_supports(self, thickness_mm, supports)
    }
}

/// Assembles the membrane and bending stiffnesses of all elements at the entries of `pattern`.
fn assemble(
    pattern: &SparseSymmetric,
    triangles: &[[u32; 3]],
    elements: &[(Element, [Stiffness; 2])],
) -> [Vec<f64>; 2] {
    let mut sums = [vec![0.0; pattern.n_places()], vec![0.0; pattern.n_places()]];
    let pairs: Vec<[usize; 2]> = (0..3).flat_map(|i| (0..3).map(move |j| [i, j])).collect();
    for (corners, (_, stiffnesses)) in triangles.iter().zip(elements) {
        for &[i, j] in pairs.iter().filter(|[i, j]| corners[*i] <= corners[*j]) {
            for c in 0..DOFS {
                // A column lists all rows of a node consecutively, down to the diagonal.
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
        let has_area = mesh.double_area_vector(t).length() > MIN_HEIGHT * longest_sq;
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

/// Lowest-numbered point of the connected part of each point.
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
