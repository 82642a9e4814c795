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
//! cut on both.

use std::collections::BTreeSet;

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;

use crate::coarse::Coarse;
use crate::face_graph::FaceGraph;
use crate::parts::{absorb_small, connected, sums};
use crate::symmetry::{Plane, plane};

/// A part lies on one side where that has this share of it; else across the plane.
const ON_ONE_SIDE: f64 = 0.85;
/// What mirroring leaves over and is smaller than this share of the whole area joins a neighbour.
const CRUMB_SHARE: f64 = 0.004;

/// Which face is whose mirror image.
pub struct Mirrored {
    /// What is mirrored in.
    pub plane: Plane,
    /// The face on which the image of each face's centre lies.
    image: Vec<u32>,
    is_behind: Vec<bool>,
}

impl Mirrored {
    /// The faces' images in the plane of symmetry; `None` where there is none.
    pub fn new(coarse: &Coarse) -> Option<Self> {
        plane(&coarse.mesh).map(|plane| Self::about(plane, coarse))
    }

    /// The same in `plane`, whatever it is.
    pub fn about(plane: Plane, coarse: &Coarse) -> Self {
        let bvh = TriangleBvh::new(&coarse.mesh);
        let center = &coarse.graph.center;
        let image = |face: usize| {
            let nearest = bvh.nearest(plane.image(center[face]), f64::INFINITY);
            nearest.map_or(face as u32, |n| n.face)
        };
        Self {
            image: (0..center.len()).into_par_iter().map(image).collect(),
            is_behind: center.iter().map(|&c| plane.height(c) < 0.0).collect(),
            plane,
        }
    }

    /// Prices (one an edge) of which each is the mean, by the millimetre, of an edge's and of its image's: the edge of
    /// the images of its faces that lies most like it.
    pub fn prices(&self, graph: &FaceGraph, price: &[f64]) -> Vec<f64> {
        let per_mm = |crease: usize| price[crease] / graph.creases[crease].length_mm.max(f64::MIN_POSITIVE);
        // An edge lies between its faces' centres, about at right angles to the way from one to the other.
        let ends = |crease: usize| graph.creases[crease].faces.map(|f| graph.center[f as usize]);
        let image_of = |crease: usize| {
            let [a, b] = ends(crease).map(|p| self.plane.image(p));
            let images = graph.creases[crease].faces.map(|f| self.image[f as usize]);
            let arcs = images.into_iter().flat_map(|f| graph.arcs(f));
            let unlike = |other: usize| {
                let [c, d] = ends(other);
                let either_way = [a.distance(c) + b.distance(d), a.distance(d) + b.distance(c)];
                either_way[0].min(either_way[1])
            };
            arcs.map(|&(_, other)| other as usize)
                .min_by(|&c, &d| unlike(c).total_cmp(&unlike(d)).then(c.cmp(&d)))
        };
        (0..price.len())
            .map(|crease| {
                let own = per_mm(crease);
                let other = image_of(crease).map_or(own, per_mm);
                0.5 * (own + other) * graph.creases[crease].length_mm
            })
            .collect()
    }

    /// `labels` made the same on both sides: connected parts, numbered by their lowest face.
    pub fn labels(&self, graph: &FaceGraph, labels: &[u32]) -> Vec<u32> {
        let drawn = [false, true].map(|from_behind| self.drawn_from(from_behind, graph, labels));
        let n_parts = |labels: &[u32]| labels.iter().collect::<BTreeSet<_>>().len();
        let [front, behind] = drawn;
        if n_parts(&front) >= n_parts(&behind) {
            front
        } else {
            behind
        }
    }

    /// One side's parts on both.
    fn drawn_from(&self, from_behind: bool, graph: &FaceGraph, labels: &[u32]) -> Vec<u32> {
        let n = labels.iter().max().map_or(0, |&l| l as usize + 1);
        let own: Vec<f64> = (0..labels.len())
            .map(|f| {
                if self.is_behind[f] == from_behind {
                    graph.area_mm2[f]
                } else {
                    0.0
                }
            })
            .collect();
        let (own, all) = (sums(labels, n, &own), sums(labels, n, &graph.area_mm2));
        let has_image = |part: u32| own[part as usize] >= ON_ONE_SIDE * all[part as usize];
        let drawn: Vec<u32> = (0..labels.len())
            .map(|face| {
                if self.is_behind[face] == from_behind {
                    return labels[face];
                }
                let part = labels[self.image[face] as usize];
                if has_image(part) { part + n as u32 } else { part }
            })
            .collect();
        absorb_small(graph, &connected(graph, &drawn).0, CRUMB_SHARE)
    }
}
