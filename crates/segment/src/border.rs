//! Placing borders: least cuts within a band around the present border.

use std::collections::{BTreeMap, BTreeSet};

use crate::face_graph::FaceGraph;
use crate::max_flow::{FlowGraph, Terminal};

/// Lowest price of a millimetre of border, reached in sharp concave creases.
const LEAST_PRICE: f64 = 0.05;
/// Concavity by which the price of a millimetre falls by a factor of e: 0.2 rad.
const FALL_RAD: f64 = 0.2;

/// Price of a border on each edge, mm: the edge's length, reduced to a twentieth in sharp concave creases.
pub fn prices(graph: &FaceGraph) -> Vec<f64> {
    graph
        .creases
        .iter()
        .map(|c| c.length_mm * (LEAST_PRICE + (1.0 - LEAST_PRICE) * (-c.concavity_rad() / FALL_RAD).exp()))
        .collect()
}

/// Moves the borders between labels to where they are cheapest ([`prices`]), by `band_mm` at most.
///
/// Pairs of labels are processed one by one, in ascending order. For each pair, only faces of these two
/// labels within the band may change.
pub fn settle(graph: &FaceGraph, band_mm: f64, labels: &mut [u32]) {
    Settler::new(graph).settle(band_mm, labels, |_, _| true);
}

/// A graph together with its prices of borders.
pub struct Settler<'a> {
    graph: &'a FaceGraph,
    price: Vec<f64>,
}

impl<'a> Settler<'a> {
    /// Computes the prices of `graph` with [`prices`].
    pub fn new(graph: &'a FaceGraph) -> Self {
        Self {
            price: prices(graph),
            graph,
        }
    }

    /// Moves borders like [`settle`], but keeps the old border of a pair if `allows` rejects the new one.
    /// `allows` is given the labels after the move and the pair; it is not asked about a border that stays.
    pub fn settle(&self, band_mm: f64, labels: &mut [u32], mut allows: impl FnMut(&[u32], [u32; 2]) -> bool) {
        let mut seeds: BTreeMap<[u32; 2], BTreeSet<u32>> = BTreeMap::new();
        for crease in &self.graph.creases {
            let [a, b] = crease.faces.map(|f| labels[f as usize]);
            if a != b {
                seeds
                    .entry([a.min(b), a.max(b)])
                    .or_default()
                    .extend(crease.faces);
            }
        }
        let mut distance = vec![f64::INFINITY; self.graph.n_faces()];
        let mut moved = labels.to_vec();
        for (pair, seeds) in seeds {
            let changed = settle_pair(
                self.graph,
                band_mm,
                &self.price,
                pair,
                &seeds,
                &mut distance,
                &mut moved,
            );
            if changed.is_empty() {
                continue;
            }
            let (from, to): (&[u32], &mut [u32]) = match allows(&moved, pair) {
                true => (&moved, labels),
                false => (labels, &mut moved),
            };
            for face in changed {
                to[face as usize] = from[face as usize];
            }
        }
    }
}

/// Moves the border between two labels. Returns the faces whose label changed.
fn settle_pair(
    graph: &FaceGraph,
    band_mm: f64,
    price: &[f64],
    [a, b]: [u32; 2],
    seeds: &BTreeSet<u32>,
    distance: &mut [f64],
    labels: &mut [u32],
) -> Vec<u32> {
    let band = within(graph, seeds, band_mm, distance, |f| {
        [a, b].contains(&labels[f as usize])
    });
    let node: BTreeMap<u32, u32> = band.iter().copied().zip(0..).collect();
    let mut flow = FlowGraph::new(band.len());
    for (&face, &here) in &node {
        for &(other, crease) in graph.arcs(face) {
            let w = price[crease as usize];
            match node.get(&other) {
                Some(&there) if face < other => flow.join(here, there, w, w),
                Some(_) => {}
                None if labels[other as usize] == a => flow.tie(here, w, 0.0),
                None if labels[other as usize] == b => flow.tie(here, 0.0, w),
                None => {}
            }
        }
    }
    // A part that lies entirely in the band keeps its innermost face, so that it cannot vanish.
    for label in [a, b] {
        let reaches_out = node.keys().any(|&face| {
            labels[face as usize] == label
                && graph
                    .arcs(face)
                    .iter()
                    .any(|&(other, _)| labels[other as usize] == label && !node.contains_key(&other))
        });
        let inmost = band
            .iter()
            .filter(|&&f| labels[f as usize] == label)
            .max_by(|&&f, &&g| distance[f as usize].total_cmp(&distance[g as usize]));
        if let (false, Some(inmost)) = (reaches_out, inmost) {
            let all = price.iter().sum::<f64>();
            let (source, sink) = if label == a { (all, 0.0) } else { (0.0, all) };
            flow.tie(node[inmost], source, sink);
        }
    }
    let (_, sides) = flow.least_cut();
    let mut changed = Vec::new();
    for (&face, &here) in &node {
        let label = if sides[here as usize] == Terminal::Source {
            a
        } else {
            b
        };
        if labels[face as usize] != label {
            labels[face as usize] = label;
            changed.push(face);
        }
        distance[face as usize] = f64::INFINITY;
    }
    changed
}

/// Faces within `band_mm` of `seeds`, reached through faces that `allowed` accepts, in ascending order.
/// Writes their distances to `distance`, which the caller has filled with infinity.
fn within(
    graph: &FaceGraph,
    seeds: &BTreeSet<u32>,
    band_mm: f64,
    distance: &mut [f64],
    allowed: impl Fn(u32) -> bool,
) -> Vec<u32> {
    let mut found = Vec::new();
    let mut front: BTreeSet<(u64, u32)> = BTreeSet::new();
    for &face in seeds.iter().filter(|&&f| allowed(f)) {
        distance[face as usize] = 0.0;
        front.insert((0, face));
    }
    while let Some((bits, face)) = front.pop_first() {
        let so_far = f64::from_bits(bits);
        if so_far > distance[face as usize] {
            continue;
        }
        found.push(face);
        for &(other, crease) in graph.arcs(face) {
            let reached = so_far + graph.creases[crease as usize].step_mm;
            if reached <= band_mm && reached < distance[other as usize] && allowed(other) {
                distance[other as usize] = reached;
                front.insert((reached.to_bits(), other));
            }
        }
    }
    found.sort_unstable();
    found
}
