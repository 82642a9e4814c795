//! The division to take where nobody says how: the cuts of all methods, the best of them made.
//!
//! Random least cuts, levels of the shape diameter and k-means all propose where to cut; what is cut, and when to
//! stop, is decided as in [`crate::random_cuts`], by how many agree on a cut, how short it is for what it cuts off,
//! and how concave.
//!
//! On 152 models of the Princeton benchmark 1 − Rand index is 0.108, with 9 parts a model; people among each other
//! have 0.103, with 8, and random cuts alone 0.110. Fitted primitives as proposals, too, gain nothing and cost more
//! time than all else.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::TriMesh;

use crate::coarse::Coarse;
use crate::kmeans::{self, KMeansParams};
use crate::random_cuts::{Divided, RandomCutsParams, divide_among};
use crate::sdf::{self, SdfParams};
use crate::shape_diameter::{diameters_mm, normalised};
use crate::whole::Whole;

/// Levels of thickness, and weight of short borders, of the divisions that shape diameters propose.
const LEVELS: [(usize, f64); 6] = [(2, 0.05), (2, 0.26), (3, 0.05), (3, 0.26), (5, 0.05), (5, 0.26)];
/// Parts of the divisions that k-means proposes.
const N_PROPOSED: [usize; 3] = [3, 6, 12];

/// How a model is divided where nobody says how.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AutoParams {
    /// How cuts are drawn and judged; the number of parts, too.
    pub cuts: RandomCutsParams,
}

impl AutoParams {
    /// Every problem at once, for people; empty where there is none.
    pub fn problems(&self) -> Vec<String> {
        self.cuts.problems()
    }
}

/// A part for each face of `mesh`; about a second for 60 000 triangles on two busy cores.
///
/// A mesh without a place where a cut is worth its while, as a ball, is one part.
pub fn divide(params: &AutoParams, mesh: &TriMesh) -> Vec<u32> {
    divide_keeping(params, mesh, &Whole::default()).part_of_face
}

/// The same where no border divides a set of `whole`, which goes before symmetry.
pub fn divide_keeping(params: &AutoParams, mesh: &TriMesh, whole: &Whole) -> Divided {
    divide_among(&params.cuts, mesh, whole, |coarse| proposals(params, coarse))
}

/// Divisions of the coarse mesh by other methods.
fn proposals(params: &AutoParams, coarse: &Coarse) -> Vec<Vec<u32>> {
    let graph = &coarse.graph;
    let values = normalised(&diameters_mm(&coarse.mesh, graph, SdfParams::default().n_rays));
    let by_thickness = LEVELS.par_iter().map(|&(n_levels, smoothness)| {
        let sdf = SdfParams {
            n_levels,
            smoothness,
            seed: params.cuts.seed,
            ..SdfParams::default()
        };
        sdf::divide_by(&sdf, graph, &values)
    });
    let by_distance = N_PROPOSED.par_iter().map(|&n| {
        let kmeans = KMeansParams {
            n_parts: Some(n),
            ..KMeansParams::default()
        };
        kmeans::divide_graph(&kmeans, graph)
    });
    by_thickness.chain(by_distance).collect()
}
