//! Labels of least energy: the sum of a cost per face and label and a cost per edge between different labels.

use crate::face_graph::FaceGraph;
use crate::max_flow::{FlowGraph, Terminal};

/// Largest number of rounds over all labels; the energy seldom falls after the third.
const MOST_ROUNDS: usize = 8;

/// Improves `labels`, which are 0 … `n_labels` − 1, until no expansion of a single label lowers the energy.
///
/// The energy is the sum of `cost[face · n_labels + label]` over all faces, and of `weight[edge]` (≥ 0) over
/// all edges between different labels. The result costs at most twice the least energy. [Boykov, Veksler,
/// Zabih, *Fast Approximate Energy Minimization via Graph Cuts*, PAMI 2001]
pub fn expand(graph: &FaceGraph, n_labels: usize, cost: &[f64], weight: &[f64], labels: &mut [u32]) {
    assert_eq!(
        cost.len(),
        graph.n_faces() * n_labels,
        "one cost a face and label"
    );
    let mut unchanged = 0;
    for round in 0..MOST_ROUNDS * n_labels {
        let alpha = (round % n_labels) as u32;
        if expand_one(graph, alpha, n_labels, cost, weight, labels) {
            unchanged = 0;
        } else {
            unchanged += 1;
        }
        if unchanged >= n_labels {
            break;
        }
    }
}

/// Gives `alpha` the faces that lower the energy most. Returns true if any face changed.
fn expand_one(
    graph: &FaceGraph,
    alpha: u32,
    n_labels: usize,
    cost: &[f64],
    weight: &[f64],
    labels: &mut [u32],
) -> bool {
    let mut flow = FlowGraph::new(graph.n_faces());
    // Faces on the source's side keep their label, so keeping it cuts the arc to the sink.
    for (face, &label) in labels.iter().enumerate() {
        let pays = |label: u32| cost[face * n_labels + label as usize];
        if label != alpha {
            flow.tie(face as u32, pays(alpha), pays(label));
        }
    }
    for (crease, &w) in graph.creases.iter().zip(weight) {
        let [f, g] = crease.faces;
        let [a, b] = [f, g].map(|f| labels[f as usize]);
        if a == b {
            if a != alpha {
                flow.join(f, g, w, w);
            }
        } else if a == alpha {
            // Keeping label b beside alpha costs w.
            flow.tie(g, 0.0, w);
        } else if b == alpha {
            flow.tie(f, 0.0, w);
        } else {
            // The cost is w if either is kept, 0 if both change. A kept f pays at the sink, a g kept alone at
            // its arc.
            flow.tie(f, 0.0, w);
            flow.join(g, f, w, 0.0);
        }
    }
    let (_, sides) = flow.least_cut();
    let mut has_changed = false;
    for (label, side) in labels.iter_mut().zip(sides) {
        if *label != alpha && side == Terminal::Sink {
            *label = alpha;
            has_changed = true;
        }
    }
    has_changed
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use shellock_geom::{TriMesh, Vec3};

    use super::*;

    /// An octahedron: eight faces, each with three neighbours.
    fn octahedron() -> FaceGraph {
        let (points, triangles) = shellock_testkit::plain::sphere(0, Vec3::ONE);
        FaceGraph::new(&TriMesh { points, triangles })
    }

    #[test]
    fn two_labels_cost_the_least_and_three_at_most_twice_that() {
        let graph = octahedron();
        let n = graph.n_faces();
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for n_labels in [2, 3] {
            for _ in 0..20 {
                let cost: Vec<f64> = (0..n * n_labels).map(|_| rng.random_range(0.0..3.0)).collect();
                let weight: Vec<f64> = graph.creases.iter().map(|_| rng.random_range(0.0..1.5)).collect();
                let energy = |labels: &[u32]| -> f64 {
                    let own = labels
                        .iter()
                        .enumerate()
                        .map(|(f, &l)| cost[f * n_labels + l as usize]);
                    let cut = graph.creases.iter().zip(&weight);
                    let cut = cut.filter(|(c, _)| labels[c.faces[0] as usize] != labels[c.faces[1] as usize]);
                    own.sum::<f64>() + cut.map(|(_, w)| w).sum::<f64>()
                };
                let mut labels = vec![0; n];
                expand(&graph, n_labels, &cost, &weight, &mut labels);
                let least = (0..n_labels.pow(n as u32))
                    .map(|code| {
                        let digit = |f: usize| (code / n_labels.pow(f as u32) % n_labels) as u32;
                        energy(&(0..n).map(digit).collect::<Vec<_>>())
                    })
                    .fold(f64::INFINITY, f64::min);
                let bound = if n_labels == 2 { least } else { 2.0 * least };
                assert!(energy(&labels) <= bound + 1e-9);
            }
        }
    }
}
