//! Division into patches around representative faces, by k-means.
//!
//! [Shlafman, Tal, Katz, *Metamorphosis of Polyhedral Surfaces using Decomposition*, Computer Graphics Forum
//! 21(3), 2002, Sect. 4]: the distance of neighbours mixes the path length from centre to centre with the
//! angle between the faces. Representatives start far apart and move to the face with the least total
//! distance to their patch. Deviations: the mesh is simplified first, and a representative tries only a
//! sample of its patch.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::TriMesh;

use crate::coarse::Coarse;
use crate::face_graph::FaceGraph;
use crate::params::{no_parts, outside};
use crate::parts::number_parts;

const MOST_ROUNDS: usize = 12;
/// Number of faces of a patch that a representative tries in each round.
const N_TRIED: usize = 24;
/// Largest number of parts beyond one per component, where no number is requested.
const MOST_PARTS: usize = 20;
/// Distance below which no representatives are added where no number is requested, as a share of the first
/// two's distance. Of 0.35, 0.45 and 0.55 none is better by 0.005 on the Princeton benchmark. The paper's
/// rule, to stop where that distance falls most, stops at 3 parts and is worse by 0.08.
const FAR_SHARE: f64 = 0.4;

/// Parameters of the division by k-means.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KMeansParams {
    /// Number of triangles that the model is simplified to. [500, 20 000]; 3000.
    pub n_faces: usize,
    /// Share δ of path length, against the angle, in the distance of neighbours. [0, 1]; 0.5.
    pub way_share: f64,
    /// Weight of convex angles. [0, 1]; 0.2, since people divide along concave creases.
    pub convex_share: f64,
    /// Number of parts; `None`: as many as there are representatives far from all others.
    pub n_parts: Option<usize>,
}

impl Default for KMeansParams {
    fn default() -> Self {
        Self {
            n_faces: 3000,
            way_share: 0.5,
            convex_share: 0.2,
            n_parts: None,
        }
    }
}

impl KMeansParams {
    /// Returns all problems at once, as messages for people; empty if there are none.
    pub fn problems(&self) -> Vec<String> {
        let found = [
            outside("n_faces", self.n_faces as f64, 500.0, 20_000.0),
            outside("way_share", self.way_share, 0.0, 1.0),
            outside("convex_share", self.convex_share, 0.0, 1.0),
            no_parts(self.n_parts),
        ];
        found.into_iter().flatten().collect()
    }
}

/// Divides `mesh` by k-means, without randomness, and returns the part of each face.
pub fn divide(params: &KMeansParams, mesh: &TriMesh) -> Vec<u32> {
    let fine = FaceGraph::new(mesh);
    let coarse = Coarse::new(mesh, params.n_faces);
    let labels = divide_graph(params, &coarse.graph);
    number_parts(&fine, &coarse.bring_back(&fine, &labels)).0
}

/// Divides `graph`, which should be small: the part of each face.
pub fn divide_graph(params: &KMeansParams, graph: &FaceGraph) -> Vec<u32> {
    let (component, n_components) = number_parts(graph, &vec![0; graph.n_faces()]);
    let ways = ways(params, graph);
    let mut representatives = far_apart(params, graph, &ways, &component, n_components);
    let mut labels = Vec::new();
    for _ in 0..MOST_ROUNDS {
        let sources = representatives.iter().copied().zip(0..);
        labels = graph.distances(sources, &ways, |_| true).1;
        let moved: Vec<u32> = (0..representatives.len() as u32)
            .into_par_iter()
            .map(|part| middle(graph, &ways, &labels, part, representatives[part as usize]))
            .collect();
        if moved == representatives {
            break;
        }
        representatives = moved;
    }
    number_parts(graph, &labels).0
}

/// Distance over each edge. Path length and angle are each measured in their mean over all edges.
fn ways(params: &KMeansParams, graph: &FaceGraph) -> Vec<f64> {
    let angle = |rad: f64| {
        let counts = if rad > 0.0 { params.convex_share } else { 1.0 };
        counts * (1.0 - rad.cos())
    };
    let n = graph.creases.len().max(1) as f64;
    let mean = |values: &mut dyn Iterator<Item = f64>| (values.sum::<f64>() / n).max(f64::MIN_POSITIVE);
    let mean_step = mean(&mut graph.creases.iter().map(|c| c.step_mm));
    let mean_angle = mean(&mut graph.creases.iter().map(|c| angle(c.turning_rad)));
    graph
        .creases
        .iter()
        .map(|c| {
            params.way_share * c.step_mm / mean_step
                + (1.0 - params.way_share) * angle(c.turning_rad) / mean_angle
        })
        .collect()
}

/// Chooses the first representatives: one per component, then repeatedly the face farthest from all chosen
/// ones.
fn far_apart(
    params: &KMeansParams,
    graph: &FaceGraph,
    ways: &[f64],
    component: &[u32],
    n_components: usize,
) -> Vec<u32> {
    let mut chosen: Vec<u32> = (0..n_components as u32)
        .filter_map(|c| component.iter().position(|&d| d == c))
        .map(|f| f as u32)
        .collect();
    // The face farthest from an arbitrary face is an end of the model, which makes a better start.
    let (from_any, _) = graph.distances(chosen.iter().copied().zip(0..), ways, |_| true);
    for (c, first) in chosen.iter_mut().enumerate() {
        let mine = (0..graph.n_faces()).filter(|&f| component[f] as usize == c);
        if let Some(end) = mine.max_by(|&f, &g| from_any[f].total_cmp(&from_any[g])) {
            *first = end as u32;
        }
    }
    let wanted = params.n_parts.unwrap_or(n_components.max(1) + MOST_PARTS);
    let mut apart: Vec<f64> = Vec::new();
    let (mut nearest, _) = graph.distances(chosen.iter().copied().zip(0..), ways, |_| true);
    while chosen.len() < wanted {
        let farthest = (0..graph.n_faces()).max_by(|&f, &g| nearest[f].total_cmp(&nearest[g]));
        let Some(farthest) = farthest.filter(|&f| nearest[f] > 0.0) else {
            break;
        };
        apart.push(nearest[farthest]);
        chosen.push(farthest as u32);
        let (from_new, _) = graph.distances([(farthest as u32, 0)], ways, |_| true);
        nearest.iter_mut().zip(from_new).for_each(|(n, d)| *n = n.min(d));
    }
    if params.n_parts.is_none() {
        let far = apart.iter().take_while(|&&d| d >= FAR_SHARE * apart[0]).count();
        chosen.truncate(n_components + far);
    }
    chosen
}

/// Face with the least total distance to its part, weighted by area, among a sample of the part and `old`.
fn middle(graph: &FaceGraph, ways: &[f64], labels: &[u32], part: u32, old: u32) -> u32 {
    let faces: Vec<u32> = (0..labels.len() as u32)
        .filter(|&f| labels[f as usize] == part)
        .collect();
    let tried = faces
        .iter()
        .copied()
        .step_by(faces.len().div_ceil(N_TRIED).max(1));
    let total = |face: u32| -> f64 {
        let (distance, _) = graph.distances([(face, 0)], ways, |f| labels[f as usize] == part);
        let sum = faces
            .iter()
            .map(|&f| (distance[f as usize], graph.area_mm2[f as usize]));
        sum.filter(|x| x.0.is_finite()).map(|(d, area)| d * area).sum()
    };
    [old]
        .into_iter()
        .chain(tried)
        .map(|f| (total(f), f))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(old, |(_, f)| f)
}
