//! A simplified mesh that is divided in place of the model, and the transfer of labels back to the model.

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::decimate::decimate;
use shellock_geom::{TriMesh, Vec3};

use crate::border::settle;
use crate::face_graph::FaceGraph;
use crate::parts::absorb_small;

/// First tolerance of decimation, as a share of the bounding box's diagonal.
const FIRST_TOLERANCE: f64 = 2e-4;
/// Factor by which the tolerance grows until the mesh has few enough triangles.
const LOOSER: f64 = 1.6;
/// Largest number of tolerances tried: from 2·10⁻⁴ of the diagonal to a twentieth of it.
const MOST_TOLERANCES: usize = 12;
/// Share of the requested number of triangles below which a decimation step is repeated, keeping some points.
const TOO_FEW: f64 = 0.4;
/// Fragments split off during the transfer back join a neighbour if smaller than this share of the whole
/// area.
const CRUMB_SHARE: f64 = 2e-4;
/// Width of the band in which borders settle on the fine mesh, in mean edge lengths of the coarse mesh.
const BAND_EDGES: f64 = 1.5;

/// A simplified mesh, and the map from the model's triangles to its triangles.
pub struct Coarse {
    /// Mesh with fewer triangles than the model.
    pub mesh: TriMesh,
    /// Graph of the simplified triangles.
    pub graph: FaceGraph,
    /// Nearest simplified triangle of each of the model's triangles, preferably one that faces the same way.
    pub of_face: Vec<u32>,
}

impl Coarse {
    /// Simplifies `mesh` to about `n_faces` triangles, seldom to fewer than half of that. The mesh stays
    /// unchanged if it has no more triangles than that, or is not closed and manifold.
    pub fn new(mesh: &TriMesh, n_faces: usize) -> Self {
        let mut coarse = mesh.clone();
        let mut tolerance = FIRST_TOLERANCE * mesh.bounds().diagonal();
        for _ in 0..MOST_TOLERANCES {
            if coarse.triangles.len() <= n_faces || tolerance <= 0.0 {
                break;
            }
            let tolerances = vec![tolerance; coarse.points.len()];
            let fewer = decimate(coarse.clone(), &tolerances);
            if (fewer.triangles.len() as f64) < TOO_FEW * n_faces as f64 {
                coarse = keeping_points(coarse, tolerance, n_faces / 4);
                break;
            }
            coarse = fewer;
            tolerance *= LOOSER;
        }
        let of_face = if coarse.triangles.len() == mesh.triangles.len() {
            (0..mesh.triangles.len() as u32).collect()
        } else {
            nearest_faces(mesh, &coarse)
        };
        Self {
            graph: FaceGraph::new(&coarse),
            mesh: coarse,
            of_face,
        }
    }

    /// Transfers labels of the simplified triangles to the model's triangles, settles the borders into the
    /// model's creases, and merges small fragments into neighbours. Labels may be renumbered; the parts
    /// correspond.
    pub fn bring_back(&self, fine: &FaceGraph, labels: &[u32]) -> Vec<u32> {
        let mut brought: Vec<u32> = self.of_face.iter().map(|&f| labels[f as usize]).collect();
        if self.graph.n_faces() < fine.n_faces() {
            let n_edges = self.graph.creases.len().max(1) as f64;
            let mean = self.graph.creases.iter().map(|c| c.length_mm).sum::<f64>() / n_edges;
            settle(fine, BAND_EDGES * mean, &mut brought);
            brought = absorb_small(fine, &brought, CRUMB_SHARE);
        }
        brought
    }
}

/// Decimates `mesh`, but keeps about `n_points` of its points, evenly spaced in their order. Without these,
/// flat models turn into few long triangles at once, which leaves borders no edges to run along.
fn keeping_points(mesh: TriMesh, tolerance_mm: f64, n_points: usize) -> TriMesh {
    let step = (mesh.points.len() / n_points.max(1)).max(1);
    let kept = |point: usize| point.is_multiple_of(step);
    let tolerances: Vec<f64> = (0..mesh.points.len())
        .map(|p| if kept(p) { 0.0 } else { tolerance_mm })
        .collect();
    decimate(mesh, &tolerances)
}

/// Nearest triangle of `coarse` for each triangle of `mesh`. Prefers a triangle that faces the same way if
/// one is about as near, so that labels do not leak through thin walls.
fn nearest_faces(mesh: &TriMesh, coarse: &TriMesh) -> Vec<u32> {
    /// Limit for a triangle that faces the same way, as a multiple of the nearest squared distance.
    const ABOUT_AS_NEAR: f64 = 16.0;
    let octant = |n: Vec3| {
        let a = n.abs();
        let axis = (0..3).max_by(|&i, &j| a[i].total_cmp(&a[j])).unwrap_or(0);
        2 * axis as u32 + u32::from(n[axis] < 0.0)
    };
    let groups: Vec<u32> = (0..coarse.triangles.len())
        .map(|f| octant(coarse.face_normal(f)))
        .collect();
    let all = TriangleBvh::with_groups(coarse, &groups);
    let same_way: Vec<(TriangleBvh, Vec<u32>)> = (0..6)
        .map(|group| {
            let faces: Vec<u32> = (0..groups.len() as u32)
                .filter(|&f| groups[f as usize] == group)
                .collect();
            let part = TriMesh {
                points: coarse.points.clone(),
                triangles: faces.iter().map(|&f| coarse.triangles[f as usize]).collect(),
            };
            (TriangleBvh::new(&part), faces)
        })
        .collect();
    let slack = 1e-6 * coarse.bounds().diagonal();
    (0..mesh.triangles.len())
        .into_par_iter()
        .map(|f| {
            let (center, normal) = (mesh.face_center(f), mesh.face_normal(f));
            let Some(nearest) = all.nearest(center, f64::INFINITY) else {
                return 0;
            };
            if coarse.face_normal(nearest.face as usize).dot(normal) > 0.0 {
                return nearest.face;
            }
            let (bvh, faces) = &same_way[octant(normal) as usize];
            let limit = ABOUT_AS_NEAR * (nearest.distance_sq + slack * slack);
            bvh.nearest(center, limit)
                .map_or(nearest.face, |n| faces[n.face as usize])
        })
        .collect()
}
