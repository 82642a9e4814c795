//! Division by the shape diameter: each part has about one thickness.
//!
//! [Shapira, Shamir, Cohen-Or 2008, Sect. 4]: the diameters of faces are fitted by a mixture of bells. Labels
//! of least energy then balance the bells' probabilities against short borders in creases, preferably concave
//! ones.

use serde::{Deserialize, Serialize};
use shellock_geom::TriMesh;

use crate::face_graph::FaceGraph;
use crate::labelling::expand;
use crate::params::{no_parts, outside};
use crate::parts::{absorb_small, merge_to, number_parts};
use crate::shape_diameter::{diameters_mm, normalise};
use crate::{border, mixture};

/// Weight of a convex edge's turning, relative to a concave one's.
const CONVEX_SHARE: f64 = 0.08;
/// Weight of λ = 1, in nats per −ln of an edge's turning.
const LAMBDA_UNIT: f64 = 100.0;
/// Lower limit for arguments of logarithms: for probabilities and for shares of π by which an edge turns.
const LEAST: f64 = 5e-6;

/// Parameters of the division by shape diameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SdfParams {
    /// Number of rays per face. [4, 200]; 25.
    pub n_rays: usize,
    /// Number of bells of the mixture, the levels of thickness. [2, 20]; 5.
    pub n_levels: usize,
    /// Weight λ of short borders in creases. [0, 1]; 0.26. On 152 models of the Princeton benchmark
    /// `n_levels` 5 with 0.26 gives 0.174, and 3 with 0.02 gives 0.253.
    pub smoothness: f64,
    /// Share of the area below which a part is merged into a neighbour. [0, 0.1]; 0.002.
    pub least_share: f64,
    /// Number of parts; `None`: as many as there are. Surplus parts are merged, none is split. If there are
    /// too few, up to two more levels are tried.
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
    /// Returns all problems at once, as messages for people; empty if there are none.
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

/// Divides `mesh` by its shape diameter: the part of each face.
pub fn divide(params: &SdfParams, mesh: &TriMesh) -> Vec<u32> {
    let graph = FaceGraph::new(mesh);
    let values = normalise(&diameters_mm(mesh, &graph, params.n_rays));
    divide_by(params, &graph, &values)
}

/// Divides `graph` by the diameters `values`, in [0, 1]: the part of each face.
pub fn divide_by(params: &SdfParams, graph: &FaceGraph, values: &[f64]) -> Vec<u32> {
    let enough = |n: usize| params.n_parts.is_none_or(|wanted| n >= wanted);
    let mut found = (Vec::new(), 0);
    for n_levels in params.n_levels..params.n_levels + 3 {
        let labels = level_labels(params, n_levels, graph, values);
        let labels = absorb_small(graph, &labels, params.least_share);
        found = number_parts(graph, &labels);
        if enough(found.1) {
            break;
        }
    }
    match params.n_parts {
        Some(n) if n < found.1 => merge_to(graph, &found.0, n, &salience(graph)),
        _ => found.0,
    }
}

/// Gain of a border on each edge, mm: its length less its price.
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

/// Weight of each edge, smaller the more the edge turns.
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
