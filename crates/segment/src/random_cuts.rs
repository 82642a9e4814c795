//! Division by what random least cuts agree on.
//!
//! [Golovinskiy, Funkhouser, *Randomized Cuts for 3D Mesh Analysis*, ACM TOG 27(5), 2008]: on a mesh of a few
//! thousand triangles each part is cut in two many times, between random seeds that are kept apart by random
//! margins. An edge's salience is the share of cuts that run over it (the partition function), and of all cuts
//! of all parts the one with the highest mean salience is made, until there are parts enough.
//!
//! Deviations: cuts of one kind only (least cuts between two seeds), the one that the paper finds best; small
//! parts cost.

use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::TriMesh;

use crate::border::prices;
use crate::coarse::Coarse;
use crate::face_graph::FaceGraph;
use crate::max_flow::{FlowGraph, Terminal};
use crate::parts::connected;

/// By how much a concavity of a radian makes the way over an edge longer, for the choice of seeds.
const DETOUR_A_RAD: f64 = 4.0;
/// How the agreement of cuts counts in their score. On 76 models of the Princeton benchmark 1 is worse by 0.02, 0 by
/// 0.005.
const AGREEMENT_POWER: f64 = 0.25;
/// A cut's score falls by e for each such share of its price in the length around a disk of the smaller side's area.
const TIGHTNESS: f64 = 6.0;
/// It falls by e for each such part of the mean price of a millimetre, from 1 where flat to 0.05 where concave.
const CONCAVITY: f64 = 2.0;
/// Parts that no division goes beyond where none are asked for.
const MOST_PARTS: usize = 40;

/// How random cuts divide a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RandomCutsParams {
    /// Triangles that the model is simplified to. [500, 20 000]; 3000, between the paper's 2000 and 4000.
    pub n_faces: usize,
    /// Cuts of each part. [8, 1000]; 64.
    pub n_cuts: usize,
    /// Cuts whose score times the root of the smaller side's share is less are not made where no number is asked
    /// for. [0, 1]; 0.01.
    pub least_worth: f64,
    /// How much a cut's score falls with the share of the smaller side: its power. [0, 1]; 0.3.
    pub balance: f64,
    /// Parts wanted; `None`: until no cut is worth `least_worth`.
    pub n_parts: Option<usize>,
    /// Seed of all random choices; 0.
    pub seed: u64,
}

impl Default for RandomCutsParams {
    fn default() -> Self {
        Self {
            n_faces: 3000,
            n_cuts: 64,
            least_worth: 0.01,
            balance: 0.3,
            n_parts: None,
            seed: 0,
        }
    }
}

/// A part for each face of `mesh`, by random cuts.
pub fn divide(params: &RandomCutsParams, mesh: &TriMesh) -> Vec<u32> {
    let fine = FaceGraph::new(mesh);
    let coarse = Coarse::new(mesh, params.n_faces);
    let labels = divide_graph(params, &coarse.graph);
    connected(&fine, &coarse.bring_back(&fine, &labels)).0
}

/// A part for each face of `graph`, which is small.
pub fn divide_graph(params: &RandomCutsParams, graph: &FaceGraph) -> Vec<u32> {
    hierarchy(params, graph, &[]).labels
}

/// A division and how it came about.
pub struct Hierarchy {
    /// A part for each face.
    pub labels: Vec<u32>,
    /// Score of each cut in the order in which they were made; cut i made part i + `n_components`.
    pub scores: Vec<f64>,
    /// Parts before the first cut.
    pub n_components: usize,
    /// For each edge the highest score of a cut over it, made or not, [0, 1].
    pub salience: Vec<f64>,
}

/// Cuts the best first, until there are parts enough or no cut is good enough.
///
/// The borders of `proposals`, other divisions of `graph`, stand for election beside the random cuts.
pub fn hierarchy(params: &RandomCutsParams, graph: &FaceGraph, proposals: &[Vec<u32>]) -> Hierarchy {
    let cutter = Cutter {
        params,
        graph,
        proposals,
        price: prices(graph),
        way: graph
            .creases
            .iter()
            .map(|c| c.step_mm * (1.0 + DETOUR_A_RAD * c.concavity_rad()))
            .collect(),
        total_mm2: graph.total_area_mm2(),
    };
    let (mut labels, n_components) = connected(graph, &vec![0; graph.n_faces()]);
    let mut parts: Vec<Vec<u32>> = vec![Vec::new(); n_components];
    for (face, &label) in labels.iter().enumerate() {
        parts[label as usize].push(face as u32);
    }
    let mut salience = vec![0.0; graph.creases.len()];
    let mut best: Vec<Option<Cut>> = (0..n_components)
        .map(|p| cutter.best_cut(&parts[p], p as u64, &labels, &mut salience))
        .collect();
    let wanted = params.n_parts.unwrap_or(MOST_PARTS);
    let least = if params.n_parts.is_some() {
        0.0
    } else {
        params.least_worth
    };
    let mut scores = Vec::new();
    let mut n_asked = n_components as u64;
    while parts.len() < wanted {
        let score = |p: usize| {
            best[p]
                .as_ref()
                .filter(|c| c.worth() > least)
                .map_or(-1.0, |c| c.score)
        };
        let Some(part) = (0..parts.len()).max_by(|&p, &q| score(p).total_cmp(&score(q)).then(q.cmp(&p)))
        else {
            break;
        };
        if score(part) < 0.0 {
            break;
        }
        let Some(cut) = best[part].take() else { break };
        let new = parts.len();
        cut.side.iter().for_each(|&f| labels[f as usize] = new as u32);
        parts[part].retain(|&f| labels[f as usize] == part as u32);
        parts.push(cut.side);
        scores.push(cut.score);
        best.push(None);
        for p in [part, new] {
            best[p] = cutter.best_cut(&parts[p], n_asked, &labels, &mut salience);
            n_asked += 1;
        }
    }
    Hierarchy {
        labels: connected(graph, &labels).0,
        scores,
        n_components,
        salience,
    }
}

/// One side of a part cut in two.
#[derive(Clone)]
struct Cut {
    side: Vec<u32>,
    creases: Vec<u32>,
    /// The smaller side's share of the whole area.
    share: f64,
    score: f64,
}

impl Cut {
    fn worth(&self) -> f64 {
        self.score * (2.0 * self.share).sqrt()
    }
}

struct Cutter<'a> {
    params: &'a RandomCutsParams,
    graph: &'a FaceGraph,
    proposals: &'a [Vec<u32>],
    /// What a cut pays on each edge.
    price: Vec<f64>,
    /// Length of the way over each edge.
    way: Vec<f64>,
    total_mm2: f64,
}

impl Cutter<'_> {
    /// How good a cut is, [0, 1]: many cuts agree on it, it is short for what it cuts off, concave, and cuts off much.
    fn score(&self, share: f64, agreement: f64, price_mm: f64, mean_price: f64) -> f64 {
        let around_disk_mm = (4.0 * PI * share * self.total_mm2).sqrt().max(f64::MIN_POSITIVE);
        agreement.powf(AGREEMENT_POWER)
            * (2.0 * share).powf(self.params.balance)
            * (-TIGHTNESS * price_mm / around_disk_mm - CONCAVITY * mean_price).exp()
    }

    /// The cut of `part` on whose edges most cuts agree; the salience of all its edges goes into `salience`.
    fn best_cut(&self, part: &[u32], stream: u64, labels: &[u32], salience: &mut [f64]) -> Option<Cut> {
        if part.len() < 8 {
            return None;
        }
        let region = Region::new(self, part, labels);
        let mut cuts: Vec<Cut> = (0..self.params.n_cuts as u64)
            .into_par_iter()
            .filter_map(|i| {
                let mut rng = ChaCha8Rng::seed_from_u64(self.params.seed);
                rng.set_stream((stream << 16) + i);
                region.random_cut(&mut rng)
            })
            .collect();
        cuts.extend(self.proposals.iter().flat_map(|labels| region.proposed(labels)));
        let mut share = vec![0.0; self.graph.creases.len()];
        for cut in &cuts {
            for &crease in &cut.creases {
                share[crease as usize] += 1.0 / self.params.n_cuts as f64;
            }
        }
        let mut best: Option<Cut> = None;
        for mut cut in cuts {
            let length = |c: u32| self.graph.creases[c as usize].length_mm;
            let (sum, whole) = cut.creases.iter().fold((0.0, 0.0), |(sum, whole), &c| {
                (sum + share[c as usize].min(1.0) * length(c), whole + length(c))
            });
            let area: f64 = cut.side.iter().map(|&f| self.graph.area_mm2[f as usize]).sum();
            let price: f64 = cut.creases.iter().map(|&c| self.price[c as usize]).sum();
            let whole = whole.max(f64::MIN_POSITIVE);
            cut.share = area.min(region.area_mm2 - area).max(0.0) / self.total_mm2;
            cut.score = self.score(cut.share, sum / whole, price, price / whole);
            for &c in &cut.creases {
                let salience = &mut salience[c as usize];
                *salience = salience.max(cut.score);
            }
            if best.as_ref().is_none_or(|b| cut.score > b.score) {
                best = Some(cut);
            }
        }
        best
    }
}

/// A part as a graph of its own.
struct Region<'a> {
    cutter: &'a Cutter<'a>,
    faces: &'a [u32],
    start: Vec<u32>,
    /// (neighbour in the part, edge).
    arcs: Vec<(u32, u32)>,
    area_mm2: f64,
}

impl<'a> Region<'a> {
    fn new(cutter: &'a Cutter<'a>, faces: &'a [u32], labels: &[u32]) -> Self {
        let graph = cutter.graph;
        let label = labels[faces[0] as usize];
        let mut local = vec![u32::MAX; graph.n_faces()];
        faces.iter().zip(0..).for_each(|(&f, i)| local[f as usize] = i);
        let (mut start, mut arcs) = (vec![0], Vec::new());
        for &face in faces {
            let inside = graph.arcs(face).iter().filter(|a| labels[a.0 as usize] == label);
            arcs.extend(inside.map(|&(f, c)| (local[f as usize], c)));
            start.push(arcs.len() as u32);
        }
        Self {
            cutter,
            faces,
            start,
            arcs,
            area_mm2: faces.iter().map(|&f| graph.area_mm2[f as usize]).sum(),
        }
    }

    fn arcs(&self, face: u32) -> &[(u32, u32)] {
        &self.arcs[self.start[face as usize] as usize..self.start[face as usize + 1] as usize]
    }

    fn distances(&self, from: u32) -> Vec<f64> {
        let mut distance = vec![f64::INFINITY; self.faces.len()];
        let mut front = std::collections::BinaryHeap::new();
        distance[from as usize] = 0.0;
        front.push((std::cmp::Reverse(0), from));
        while let Some((std::cmp::Reverse(bits), face)) = front.pop() {
            let so_far = f64::from_bits(bits);
            if so_far > distance[face as usize] {
                continue;
            }
            for &(other, crease) in self.arcs(face) {
                let reached = so_far + self.cutter.way[crease as usize];
                if reached < distance[other as usize] {
                    distance[other as usize] = reached;
                    front.push((std::cmp::Reverse(reached.to_bits()), other));
                }
            }
        }
        distance
    }

    /// A face by `weight`, ≥ 0.
    fn draw(&self, rng: &mut ChaCha8Rng, weight: impl Fn(usize) -> f64) -> u32 {
        let sum: f64 = (0..self.faces.len()).map(&weight).sum();
        let mut left = rng.random::<f64>() * sum;
        let chosen = (0..self.faces.len()).find(|&f| {
            left -= weight(f);
            left < 0.0
        });
        chosen.unwrap_or(0) as u32
    }

    /// The least cut between two random seeds and what is nearer to one of them by a random margin; `None`
    /// where it leaves nothing on a side.
    fn random_cut(&self, rng: &mut ChaCha8Rng) -> Option<Cut> {
        let area = |f: usize| self.cutter.graph.area_mm2[self.faces[f] as usize];
        let first = self.draw(rng, area);
        let from_first = self.distances(first);
        let finite = |d: f64| if d.is_finite() { d } else { 0.0 };
        let second = self.draw(rng, |f| area(f) * finite(from_first[f]).powi(2));
        if first == second {
            return None;
        }
        let from_second = self.distances(second);
        let margin = [0, 1].map(|_| rng.random_range(0.03..0.5));
        let mut flow = FlowGraph::new(self.faces.len());
        let tied = self.cutter.price.iter().sum::<f64>();
        for face in 0..self.faces.len() as u32 {
            let (a, b) = (from_first[face as usize], from_second[face as usize]);
            if face == first || a < margin[0] * (a + b) {
                flow.tie(face, tied, 0.0);
            } else if face == second || b < margin[1] * (a + b) {
                flow.tie(face, 0.0, tied);
            }
            for &(other, crease) in self.arcs(face).iter().filter(|a| a.0 > face) {
                let w = self.cutter.price[crease as usize];
                flow.join(face, other, w, w);
            }
        }
        let (_, sides) = flow.least_cut();
        self.cut(|f| sides[f as usize] == Terminal::Source)
    }

    /// The cuts that divide what one label of `labels` has in the part from all else in it, where both hang
    /// together.
    fn proposed(&self, labels: &[u32]) -> Vec<Cut> {
        let label = |f: u32| labels[self.faces[f as usize] as usize];
        let mut found: Vec<u32> = (0..self.faces.len() as u32).map(label).collect();
        found.sort_unstable();
        found.dedup();
        found
            .into_iter()
            .filter(|&l| self.n_components(|f| label(f) == l) == 2)
            .filter_map(|l| self.cut(|f| label(f) == l))
            .collect()
    }

    /// How many connected sets the faces inside and those outside of a set are.
    fn n_components(&self, is_inside: impl Fn(u32) -> bool) -> usize {
        let mut seen = vec![false; self.faces.len()];
        let mut stack = Vec::new();
        let mut n = 0;
        for start in 0..self.faces.len() as u32 {
            if std::mem::replace(&mut seen[start as usize], true) {
                continue;
            }
            n += 1;
            stack.push(start);
            while let Some(face) = stack.pop() {
                for &(other, _) in self.arcs(face) {
                    if is_inside(other) == is_inside(face)
                        && !std::mem::replace(&mut seen[other as usize], true)
                    {
                        stack.push(other);
                    }
                }
            }
        }
        n
    }

    /// The part cut along the border of a set; `None` where that is all or nothing.
    fn cut(&self, is_inside: impl Fn(u32) -> bool) -> Option<Cut> {
        let n = self.faces.len();
        let n_inside = (0..n as u32).filter(|&f| is_inside(f)).count();
        let keeps = n_inside * 2 > n;
        let side = (0..n as u32)
            .filter(|&f| is_inside(f) != keeps)
            .map(|f| self.faces[f as usize])
            .collect();
        let creases = (0..n as u32)
            .flat_map(|f| self.arcs(f).iter().map(move |&(g, c)| (f, g, c)))
            .filter(|&(f, g, _)| f < g && is_inside(f) != is_inside(g))
            .map(|(.., c)| c)
            .collect();
        (n_inside > 0 && n_inside < n).then_some(Cut {
            side,
            creases,
            share: 0.0,
            score: 0.0,
        })
    }
}
