//! Division into planes, spheres and cylinders.
//!
//! [Attene, Falcidieno, Spagnuolo, *Hierarchical mesh segmentation based on fitting primitives*, The Visual
//! Computer 22(3), 2006]: at first each triangle is a part. Each step merges the two neighbouring parts that
//! together are nearest to a plane, a sphere or a cylinder, until few enough parts are left.
//!
//! Deviations: the mesh is simplified first; spheres and circles are fitted by linear least squares.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::{TriMesh, Vec3};

use crate::coarse::Coarse;
use crate::face_graph::FaceGraph;
use crate::params::{no_parts, outside};
use crate::parts::number_parts;

/// Number of points that a fit uses, about; larger parts are sampled evenly.
const MOST_POINTS: usize = 300;

/// Smallest number of triangles fitted by spheres and cylinders. Two across any edge lie on a sphere exactly.
const LEAST_ROUND: usize = 8;

/// Largest distance of a centre from the mean of the points, in multiples of the points' reach.
const FARTHEST_CENTER: f64 = 1e3;

/// Parameters of the division into primitives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PrimitivesParams {
    /// Number of triangles that the model is simplified to. [200, 10 000]; 2000.
    pub n_faces: usize,
    /// Error above which no merge is made, if no number of parts is requested. The error is the root of the
    /// summed squared distances times areas, as a share of the same root for the whole model at its radius of
    /// gyration. [0, 1]; 0.03.
    pub tolerance: f64,
    /// Number of parts; `None`: as many as `tolerance` leaves.
    pub n_parts: Option<usize>,
}

impl Default for PrimitivesParams {
    fn default() -> Self {
        Self {
            n_faces: 2000,
            tolerance: 0.03,
            n_parts: None,
        }
    }
}

impl PrimitivesParams {
    /// Returns all problems at once, as messages for people; empty if there are none.
    pub fn problems(&self) -> Vec<String> {
        let found = [
            outside("n_faces", self.n_faces as f64, 200.0, 10_000.0),
            outside("tolerance", self.tolerance, 0.0, 1.0),
            no_parts(self.n_parts),
        ];
        found.into_iter().flatten().collect()
    }
}

/// Divides `mesh` into parts near primitives: the part of each face. No choice is random.
pub fn divide(params: &PrimitivesParams, mesh: &TriMesh) -> Vec<u32> {
    let fine = FaceGraph::new(mesh);
    let coarse = Coarse::new(mesh, params.n_faces);
    let labels = divide_coarse(params, &coarse.mesh, &coarse.graph);
    number_parts(&fine, &coarse.bring_back(&fine, &labels)).0
}

/// A possible merge: the error's bits, both parts, and their ages, which reveal outdated offers.
type Offer = Reverse<(u64, [u32; 2], [u32; 2])>;

/// Divides `mesh`, which should be small and has the graph `graph`: the part of each face.
pub fn divide_coarse(params: &PrimitivesParams, mesh: &TriMesh, graph: &FaceGraph) -> Vec<u32> {
    let n = graph.n_faces();
    let samples = Samples::new(mesh, graph);
    let mut faces: Vec<Vec<u32>> = (0..n as u32).map(|f| vec![f]).collect();
    let mut beside: Vec<BTreeSet<u32>> = (0..n as u32)
        .map(|f| graph.arcs(f).iter().map(|a| a.0).collect())
        .collect();
    let mut age = vec![0_u32; n];
    let offer = |faces: &[Vec<u32>], age: &[u32], a: u32, b: u32| -> Offer {
        let pair = [a.min(b), a.max(b)];
        let error = samples.error(&faces[a as usize], &faces[b as usize]);
        Reverse((error.to_bits(), pair, pair.map(|p| age[p as usize])))
    };
    let mut offers: BinaryHeap<Offer> = graph
        .creases
        .par_iter()
        .map(|c| offer(&faces, &age, c.faces[0], c.faces[1]))
        .collect::<Vec<_>>()
        .into();
    let mut n_parts = n;
    let limit = params.tolerance.powi(2) * samples.inertia;
    while let Some(Reverse((error, [a, b], ages))) = offers.pop() {
        let done = match params.n_parts {
            Some(wanted) => n_parts <= wanted,
            None => f64::from_bits(error) > limit,
        };
        if done {
            break;
        }
        if [a, b].map(|p| age[p as usize]) != ages {
            continue;
        }
        let moved = std::mem::take(&mut faces[b as usize]);
        faces[a as usize].extend(moved);
        for other in std::mem::take(&mut beside[b as usize]) {
            beside[other as usize].remove(&b);
            if other != a {
                beside[other as usize].insert(a);
                beside[a as usize].insert(other);
            }
        }
        age[a as usize] += 1;
        age[b as usize] = u32::MAX;
        n_parts -= 1;
        let neighbours: Vec<u32> = beside[a as usize].iter().copied().collect();
        offers.extend(
            neighbours
                .par_iter()
                .map(|&other| offer(&faces, &age, a, other))
                .collect::<Vec<_>>(),
        );
    }
    let mut labels = vec![0; n];
    for (part, faces) in faces.iter().enumerate() {
        faces.iter().for_each(|&f| labels[f as usize] = part as u32);
    }
    number_parts(graph, &labels).0
}

/// Corners of triangles, to which primitives are fitted, relative to the model's centre.
struct Samples<'a> {
    mesh: &'a TriMesh,
    graph: &'a FaceGraph,
    middle: Vec3,
    /// Sum of squared distance from the middle times area, mm⁴.
    inertia: f64,
}

impl<'a> Samples<'a> {
    fn new(mesh: &'a TriMesh, graph: &'a FaceGraph) -> Self {
        let total = graph.total_area_mm2().max(f64::MIN_POSITIVE);
        let moments = graph.center.iter().zip(&graph.area_mm2);
        let middle = moments.clone().map(|(&c, &a)| c * a).sum::<Vec3>() / total;
        Self {
            mesh,
            graph,
            middle,
            inertia: moments.map(|(c, a)| c.distance_squared(middle) * a).sum(),
        }
    }

    /// Sum of squared distance times area, mm⁴, of the faces of both parts from their best primitive.
    fn error(&self, a: &[u32], b: &[u32]) -> f64 {
        let step = (3 * (a.len() + b.len())).div_ceil(MOST_POINTS).max(1);
        let mut points: Vec<(Vec3, f64)> = Vec::new();
        let mut normals = Matrix3::zeros();
        let mut area = 0.0;
        for &face in a.iter().chain(b) {
            let weight = self.graph.area_mm2[face as usize];
            area += weight;
            let n = self.graph.normal[face as usize];
            let n = Vector3::new(n.x, n.y, n.z);
            normals += n * n.transpose() * weight;
        }
        for &face in a.iter().chain(b).step_by(step) {
            let weight = self.graph.area_mm2[face as usize] / 3.0;
            let corners = self.mesh.corners(face as usize);
            points.extend(corners.map(|p| (p - self.middle, weight)));
        }
        let sampled: f64 = points.iter().map(|p| p.1).sum();
        if sampled <= 0.0 || !sampled.is_finite() {
            return 0.0;
        }
        let mean = points.iter().map(|&(p, w)| p * w).sum::<Vec3>() / sampled;
        points.iter_mut().for_each(|p| p.0 -= mean);
        let axis = normals.symmetric_eigen();
        let least = axis.eigenvalues.imin();
        let axis = axis.eigenvectors.column(least);
        let axis = Vec3::new(axis[0], axis[1], axis[2]);
        let mut best = plane_error(&points);
        if a.len() + b.len() >= LEAST_ROUND {
            best = best
                .min(round_error(&points, None))
                .min(round_error(&points, Some(axis)));
        }
        best * area / sampled
    }
}

/// Squared error of the best plane through the points' mean, which must be 0.
fn plane_error(points: &[(Vec3, f64)]) -> f64 {
    let mut covariance = Matrix3::zeros();
    for &(p, w) in points {
        let p = Vector3::new(p.x, p.y, p.z);
        covariance += p * p.transpose() * w;
    }
    covariance.symmetric_eigenvalues().min().max(0.0)
}

/// Squared error of the best sphere, or of the best cylinder along `axis`; infinite if there is none.
///
/// Centre c and radius r follow from |p|² = 2 c · p + (r² − |c|²), which is linear in c and the bracket.
fn round_error(points: &[(Vec3, f64)], axis: Option<Vec3>) -> f64 {
    let frame = match axis {
        None => [Vec3::X, Vec3::Y, Vec3::Z],
        Some(axis) if axis.length_squared() > 0.5 => {
            let (u, v) = axis.normalize().any_orthonormal_pair();
            [u, v, Vec3::ZERO]
        }
        Some(_) => return f64::INFINITY,
    };
    let in_frame = |p: Vec3| Vector3::from(frame.map(|u| u.dot(p)));
    let mut normal = Matrix4::zeros();
    let mut right = Vector4::zeros();
    for &(p, w) in points {
        let p = in_frame(p);
        let row = (2.0 * p).push(1.0);
        normal += row * row.transpose() * w;
        right += row * (p.norm_squared() * w);
    }
    if axis.is_some() {
        normal[(2, 2)] = 1.0;
    }
    let Some(solution) = normal.lu().solve(&right) else {
        return f64::INFINITY;
    };
    let center = solution.xyz();
    // A centre far away means a plane; its distances would be mostly rounding.
    let reach = points.iter().map(|p| p.0.length()).fold(0.0, f64::max);
    if !center.norm().is_finite() || center.norm() > FARTHEST_CENTER * reach {
        return f64::INFINITY;
    }
    let radius = (solution.w + center.norm_squared()).max(0.0).sqrt();
    let error: f64 = points
        .iter()
        .map(|&(p, w)| w * ((in_frame(p) - center).norm() - radius).powi(2))
        .sum();
    if error.is_finite() { error } else { f64::INFINITY }
}
