//! Division by the shape diameter: parts are as thick throughout.
//!
//! [Shapira, Shamir, Cohen-Or 2008, Sect. 4]: the diameters of faces as a mixture of bells, and labels of least
//! energy between what the bells say and short borders in creases, preferably concave ones.

use serde::{Deserialize, Serialize};
use shellock_geom::TriMesh;

use crate::face_graph::FaceGraph;
use crate::labelling::expand;
use crate::params::{no_parts, outside};
use crate::parts::{absorb_small, connected, merge_to};
use crate::shape_diameter::{diameters_mm, normalised};
use crate::{border, mixture};

/// How much of a convex edge's turning counts.
const CONVEX_SHARE: f64 = 0.08;
/// What λ = 1 weighs, in nats a flat edge's −ln.
const LAMBDA_UNIT: f64 = 100.0;
/// Least probability, and least share of π by which an edge turns, under a logarithm.
const LEAST: f64 = 5e-6;

/// How shape diameters divide a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SdfParams {
    /// Rays a face. [4, 200]; 25.
    pub n_rays: usize,
    /// Bells of the mixture, levels of thickness. [2, 20]; 5.
    pub n_levels: usize,
    /// Weight λ of short borders in creases. [0, 1]; 0.26. On 152 models of the Princeton
    /// benchmark these two give 0.174, 3 and 0.02 0.253.
    pub smoothness: f64,
    /// Parts smaller than this share of the area are merged into a neighbour. [0, 0.1]; 0.002.
    pub least_share: f64,
    /// Parts wanted; `None`: as many as there are. Merges, never splits, but for a second try with more levels.
    pub n_parts: Option<usize>,
    /// Seed of the starts of k-means; 0.
    pub seed: u64,
}

impl Default for SdfParams {
    fn default() -> Self {
        Self {
            n_rays: 25,
            n_levels: 5,
            smoothness: 0.26,
            least_share: 0.002,
            n_parts: None,
            seed: 0,
        }
    }
}

impl SdfParams {
    /// Every problem at once, for people; empty where there is none.
    pub fn problems(&self) -> Vec<String> {
        let found = [
            outside("n_rays", self.n_rays as f64, 4.0, 200.0),
            outside("n_levels", self.n_levels as f64, 2.0, 20.0),
            outside("smoothness", self.smoothness, 0.0, 1.0),
            outside("least_share", self.least_share, 0.0, 0.1),
            no_parts(self.n_parts),
        ];
        found.into_iter().flatten().collect()
    }
}

/// A part for each face of `mesh`, by its shape diameter.
pub fn divide(params: &SdfParams, mesh: &TriMesh) -> Vec<u32> {
    let graph = FaceGraph::new(mesh);
    let values = normalised(&diameters_mm(mesh, &graph, params.n_rays));
    divide_by(params, &graph, &values)
}

/// A part for each face of `graph`, by the diameters `values` in [0, 1].
pub fn divide_by(params: &SdfParams, graph: &FaceGraph, values: &[f64]) -> Vec<u32> {
    let enough = |n: usize| params.n_parts.is_none_or(|wanted| n >= wanted);
    let mut found = (Vec::new(), 0);
    for n_levels in params.n_levels..params.n_levels + 3 {
        let labels = level_labels(params, n_levels, graph, values);
        let labels = absorb_small(graph, &labels, params.least_share);
        found = connected(graph, &labels);
        if enough(found.1) {
            break;
        }
    }
    match params.n_parts {
        Some(n) if n < found.1 => merge_to(graph, &found.0, n, &salience(graph)),
        _ => found.0,
    }
}

/// What a border gains on each edge, mm: its length, less what it costs there.
fn salience(graph: &FaceGraph) -> Vec<f64> {
    let price = border::prices(graph);
    graph
        .creases
        .iter()
        .zip(price)
        .map(|(c, p)| c.length_mm - p)
        .collect()
}

fn level_labels(params: &SdfParams, n_levels: usize, graph: &FaceGraph, values: &[f64]) -> Vec<u32> {
    let bells = mixture::fit(values, n_levels, params.seed);
    let mut cost = Vec::with_capacity(values.len() * n_levels);
    let mut labels = Vec::with_capacity(values.len());
    for &x in values {
        let memberships = mixture::memberships(&bells, x);
        let likeliest = (0..n_levels).max_by(|&i, &j| memberships[i].total_cmp(&memberships[j]));
        labels.push(likeliest.unwrap_or(0) as u32);
        cost.extend(memberships.iter().map(|m| -m.max(LEAST).ln()));
    }
    expand(
        graph,
        n_levels,
        &cost,
        &weights(graph, params.smoothness),
        &mut labels,
    );
    labels
}

/// Weight of each edge: the less, the more it turns.
fn weights(graph: &FaceGraph, smoothness: f64) -> Vec<f64> {
    let of_turning = |rad: f64| {
        let counts = if rad > 0.0 { CONVEX_SHARE * rad } else { -rad };
        -(counts / std::f64::consts::PI).max(LEAST).ln()
    };
    graph
        .creases
        .iter()
        .map(|c| LAMBDA_UNIT * smoothness * of_turning(c.turning_rad))
        .collect()
}
