//! The division to take where nobody says how: the cuts of all methods, the best of them made.
//!
//! Random least cuts, levels of the shape diameter, k-means and primitives all propose where to cut; what is cut,
//! and when to stop, is decided as in [`crate::random_cuts`], by how many agree on a cut, how short it is for what
//! it cuts off, and how concave.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::TriMesh;

use crate::coarse::Coarse;
use crate::face_graph::FaceGraph;
use crate::kmeans::{self, KMeansParams};
use crate::parts::connected;
use crate::primitives::{self, PrimitivesParams};
use crate::random_cuts::{RandomCutsParams, hierarchy};
use crate::sdf::{self, SdfParams};
use crate::shape_diameter::{diameters_mm, normalised};

/// Levels of thickness, and weight of short borders, of the divisions that shape diameters propose.
const LEVELS: [(usize, f64); 6] = [(2, 0.05), (2, 0.26), (3, 0.05), (3, 0.26), (5, 0.05), (5, 0.26)];
/// Parts of the divisions that k-means and primitives propose.
const N_PROPOSED: [usize; 3] = [3, 6, 12];

/// How a model is divided where nobody says how.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AutoParams {
    /// How cuts are drawn and judged; the number of parts, too.
    pub cuts: RandomCutsParams,
}

/// A part for each face of `mesh`.
pub fn divide(params: &AutoParams, mesh: &TriMesh) -> Vec<u32> {
    let fine = FaceGraph::new(mesh);
    let coarse = Coarse::new(mesh, params.cuts.n_faces);
    let proposals = proposals(params, &coarse);
    let found = hierarchy(&params.cuts, &coarse.graph, &proposals);
    let labels = found.labels(&coarse.graph, found.n_steps(&params.cuts));
    connected(&fine, &coarse.bring_back(&fine, &labels)).0
}

/// Divisions of the coarse mesh by all other methods.
fn proposals(params: &AutoParams, coarse: &Coarse) -> Vec<Vec<u32>> {
    let graph = &coarse.graph;
    let use_it = |name: &str| !std::env::var("SKIP").unwrap_or_default().contains(name);
    let mut found = Vec::new();
    if use_it("sdf") {
        let values = normalised(&diameters_mm(&coarse.mesh, graph, SdfParams::default().n_rays));
        found.par_extend(LEVELS.par_iter().map(|&(n_levels, smoothness)| {
            let sdf = SdfParams {
                n_levels,
                smoothness,
                n_parts: None,
                seed: params.cuts.seed,
                ..SdfParams::default()
            };
            sdf::divide_by(&sdf, graph, &values)
        }));
    }
    if use_it("kmeans") {
        found.extend(N_PROPOSED.map(|n| {
            let kmeans = KMeansParams {
                n_parts: Some(n),
                ..KMeansParams::default()
            };
            kmeans::divide_graph(&kmeans, graph)
        }));
    }
    if use_it("prim") {
        found.par_extend(N_PROPOSED.par_iter().map(|&n| {
            let primitives = PrimitivesParams {
                n_parts: Some(n),
                ..PrimitivesParams::default()
            };
            primitives::divide_coarse(&primitives, &coarse.mesh, graph)
        }));
    }
    found
}
