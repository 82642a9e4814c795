//! Parts of a division: connected sets of faces with one label.

use std::collections::BTreeMap;

use crate::face_graph::FaceGraph;

/// Numbers the connected sets of equal `labels` from 0, by their lowest face. Returns the part of each face
/// and the number of parts.
pub fn number_parts(graph: &FaceGraph, labels: &[u32]) -> (Vec<u32>, usize) {
    let mut part = vec![u32::MAX; labels.len()];
    let mut n_parts = 0;
    let mut stack = Vec::new();
    for start in 0..labels.len() as u32 {
        if part[start as usize] != u32::MAX {
            continue;
        }
        part[start as usize] = n_parts;
        stack.push(start);
        while let Some(face) = stack.pop() {
            for &(other, _) in graph.arcs(face) {
                if part[other as usize] == u32::MAX && labels[other as usize] == labels[face as usize] {
                    part[other as usize] = n_parts;
                    stack.push(other);
                }
            }
        }
        n_parts += 1;
    }
    (part, n_parts as usize)
}

/// Sum of the values `of_face` over each part.
pub fn sums(part: &[u32], n_parts: usize, of_face: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; n_parts];
    for (&p, x) in part.iter().zip(of_face) {
        sum[p as usize] += x;
    }
    sum
}

/// Merges neighbouring parts of `labels`, cheapest pair first, until `cost` is `None` for every pair. Returns
/// the parts that remain, connected and numbered by their lowest face.
///
/// `cost` is given the border of a pair; `weight` has one value per edge. Prices may depend only on the
/// border, and `None` only on that and the number of parts.
pub fn merge(
    graph: &FaceGraph,
    labels: &[u32],
    weight: &[f64],
    cost: impl Fn(&Border) -> Option<f64>,
) -> Vec<u32> {
    let (mut part, n_parts) = number_parts(graph, labels);
    let mut area = sums(&part, n_parts, &graph.area_mm2);
    let mut borders: Vec<BTreeMap<u32, [f64; 2]>> = vec![BTreeMap::new(); n_parts];
    for (crease, &w) in graph.creases.iter().zip(weight) {
        let [a, b] = crease.faces.map(|f| part[f as usize]);
        if a != b {
            for (x, y) in [(a, b), (b, a)] {
                let border = borders[x as usize].entry(y).or_default();
                border[0] += w;
                border[1] += crease.length_mm;
            }
        }
    }
    let mut into: Vec<u32> = (0..n_parts as u32).collect();
    let mut n_left = n_parts;
    loop {
        let mut best: Option<(f64, u32, u32)> = None;
        for a in 0..n_parts as u32 {
            for (&b, &[weight, length_mm]) in borders[a as usize].range(a + 1..) {
                let border = Border {
                    pair: [a, b],
                    weight,
                    length_mm,
                    area_mm2: [area[a as usize], area[b as usize]],
                    n_parts: n_left,
                };
                if let Some(price) = cost(&border)
                    && best.is_none_or(|(least, ..)| price < least)
                {
                    best = Some((price, a, b));
                }
            }
        }
        let Some((_, a, b)) = best else { break };
        into[b as usize] = a;
        area[a as usize] += area[b as usize];
        for (other, border) in std::mem::take(&mut borders[b as usize]) {
            borders[other as usize].remove(&b);
            if other != a {
                for (x, y) in [(a, other), (other, a)] {
                    let sum = borders[x as usize].entry(y).or_default();
                    *sum = [sum[0] + border[0], sum[1] + border[1]];
                }
            }
        }
        n_left -= 1;
    }
    for p in &mut part {
        while into[*p as usize] != *p {
            *p = into[*p as usize];
        }
    }
    number_parts(graph, &part).0
}

/// Border of two neighbouring parts, with the data that a merge depends on.
#[derive(Clone, Copy, Debug)]
pub struct Border {
    /// Both parts, lower number first.
    pub pair: [u32; 2],
    /// Sum of the weights of the border's edges.
    pub weight: f64,
    /// Length of the border, mm.
    pub length_mm: f64,
    /// Areas of both parts, mm².
    pub area_mm2: [f64; 2],
    /// Number of parts left at present.
    pub n_parts: usize,
}

/// Merges each part smaller than `share` of the whole area into the neighbour with the longest shared border.
pub fn absorb_small(graph: &FaceGraph, labels: &[u32], share: f64) -> Vec<u32> {
    let limit = share * graph.total_area_mm2();
    let length: Vec<f64> = graph.creases.iter().map(|c| c.length_mm).collect();
    merge(graph, labels, &length, |border| {
        let [a, b] = border.area_mm2;
        (a.min(b) < limit).then_some(-border.length_mm / a.min(b).max(f64::MIN_POSITIVE))
    })
}

/// Merges parts until `n_parts` are left. Each step takes the pair with the least product of the border's
/// mean salience per millimetre and the square root of the smaller part's share of the area.
pub fn merge_to(graph: &FaceGraph, labels: &[u32], n_parts: usize, salience: &[f64]) -> Vec<u32> {
    let total = graph.total_area_mm2();
    merge(graph, labels, salience, |border| {
        let small = border.area_mm2[0].min(border.area_mm2[1]) / total;
        let mean = border.weight / border.length_mm.max(f64::MIN_POSITIVE);
        (border.n_parts > n_parts).then_some((mean + 1e-3) * small.max(1e-9).sqrt())
    })
}
