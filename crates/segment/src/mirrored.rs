//! Divisions that are the same on both sides of a plane.
//!
//! ```text
//!    one side     plane   the other           what of a division is taken
//!   ┌────────┬──────┆──────────────┐
//!   │ arm    │ body ┆              │   arm   lies on one side: its mirror image is a part of its own
//!   └────────┴──────┆──────────────┘   body  lies across: it is its own mirror image
//! ```
//!
//! One side's parts are drawn on both; that which has more of them, so that a limb that was cut on one side alone is
//! cut on both. What has nothing like it on the other side, such as a vase's only handle, stays as it is.
//!
//! Prices of cuts are each side's own. Means of an edge's and its image's blur creases, as the simplified triangles are
//! not symmetric: on 152 models of the Princeton benchmark 1 − Rand index is 0.128 with them, 0.108 without.

use rayon::prelude::*;
use shellock_geom::TriMesh;
use shellock_geom::bvh::TriangleBvh;

use crate::face_graph::FaceGraph;
use crate::parts::{absorb_small, connected, sums};
use crate::symmetry::Plane;

/// A part lies on one side where that has this share of it; else across the plane.
const ON_ONE_SIDE: f64 = 0.85;
/// A face has an image where the image of its centre is this near to the surface, in the box's diagonal.
const NEAR: f64 = 0.03;
/// A part has an image where this share of its area has.
const MOSTLY: f64 = 0.5;
/// What mirroring leaves over and is smaller than this share of the whole area joins a neighbour.
const CRUMB_SHARE: f64 = 0.004;

/// Which face is whose mirror image.
#[derive(Debug)]
pub struct Mirrored {
    /// The face on which the image of each face's centre lies; `None` where the surface is far from it.
    image: Vec<Option<u32>>,
    is_behind: Vec<bool>,
}

impl Mirrored {
    /// The images of a mesh's faces in `plane`; `graph` is that of the mesh.
    pub fn new(plane: &Plane, mesh: &TriMesh, graph: &FaceGraph) -> Self {
        let bvh = TriangleBvh::new(mesh);
        let center = &graph.center;
        let near_mm = NEAR * mesh.bounds().diagonal();
        let image = |face: usize| {
            let nearest = bvh.nearest(plane.image(center[face]), near_mm * near_mm);
            nearest.map(|n| n.face)
        };
        Self {
            image: (0..center.len()).into_par_iter().map(image).collect(),
            is_behind: center.iter().map(|&c| plane.height(c) < 0.0).collect(),
        }
    }

    /// `labels` made the same on both sides: connected parts, numbered by their lowest face.
    pub fn labels(&self, graph: &FaceGraph, labels: &[u32]) -> Vec<u32> {
        let [front, behind] = [false, true].map(|from_behind| self.drawn_from(from_behind, graph, labels));
        let n_parts = |labels: &[u32]| labels.iter().max().map_or(0, |&l| l + 1);
        if n_parts(&front) >= n_parts(&behind) {
            front
        } else {
            behind
        }
    }

    /// One side's parts on both; what has no image stays as it is.
    fn drawn_from(&self, from_behind: bool, graph: &FaceGraph, labels: &[u32]) -> Vec<u32> {
        let n = labels.iter().max().map_or(0, |&l| l as usize + 1);
        let area_where = |counts: &dyn Fn(usize) -> bool| {
            let of_face = |f: usize| if counts(f) { graph.area_mm2[f] } else { 0.0 };
            sums(labels, n, &(0..labels.len()).map(of_face).collect::<Vec<_>>())
        };
        let all = area_where(&|_| true);
        let here = area_where(&|f| self.is_behind[f] == from_behind);
        let imaged = area_where(&|f| self.image[f].is_some());
        let has_image = |part: u32| imaged[part as usize] >= MOSTLY * all[part as usize];
        let lies_here = |part: u32| here[part as usize] >= ON_ONE_SIDE * all[part as usize];
        let drawn: Vec<u32> = (0..labels.len())
            .map(|face| {
                let own = labels[face];
                let image = self.image[face].map(|f| labels[f as usize]);
                match image.filter(|&part| has_image(part)) {
                    Some(part) if self.is_behind[face] != from_behind && has_image(own) => {
                        if lies_here(part) { part + n as u32 } else { part }
                    }
                    _ => own,
                }
            })
            .collect();
        absorb_small(graph, &connected(graph, &drawn).0, CRUMB_SHARE)
    }
}
