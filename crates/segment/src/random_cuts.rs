//! Division by the best of many random least cuts.
//!
//! [Golovinskiy, Funkhouser, *Randomized Cuts for 3D Mesh Analysis*, ACM TOG 27(5), 2008]: on a mesh of a few
//! thousand triangles each part is cut in two many times, between random seeds that random margins keep
//! apart. The number of cuts over an edge (the partition function) measures how far the cuts agree on it. The
//! best cut of all parts is made, and the search repeated, until there are enough parts.
//!
//! Deviations: only least cuts between two seeds are used, the kind that the paper finds best. The paper's
//! best cut is the one with the most agreement. Here agreement counts little beside the cut's own shape:
//!
//! ```text
//! score = agreement^¼ · (2 · smaller side / whole area)^0.3 · e^(−6 tightness − 2 mean price)
//! ```
//!
//! The price of a millimetre is 1 on flat and convex edges and falls to 0.05 in concave creases. The
//! tightness is the cut's price divided by the circumference of a disk as large as the cut's smaller side:
//! small at a limb's root, near 1 on a plain. On every second model of the benchmark, with people's number of
//! parts, agreement alone gives 0.21 (1 − Rand index), this score 0.11.

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
use crate::mirrored::Mirrored;
use crate::params::{no_parts, outside};
use crate::parts::number_parts;
use crate::symmetry::{self, Plane};
use crate::whole::Whole;

/// Relative lengthening of the path over an edge per radian of concavity, used to choose seeds.
const DETOUR_A_RAD: f64 = 4.0;
/// Exponent of the agreement in a cut's score. On 76 models of the Princeton benchmark 1 is worse by 0.02, 0
/// by 0.005.
const AGREEMENT_POWER: f64 = 0.25;
/// Weight of tightness: a cut's score falls by a factor of e when its tightness grows by a sixth.
const TIGHTNESS: f64 = 6.0;
/// Weight of the mean price of a millimetre, from 0.05 where concave to 1 where flat: e for each half.
const CONCAVITY: f64 = 2.0;
/// Largest number of parts if no number is requested.
const MOST_PARTS: usize = 36;
/// Exponent of a part's share of the area in the worth of cutting that part.
const WORTH_OF_SIZE: f64 = 0.3;

/// Parameters of the division by random cuts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RandomCutsParams {
    /// Number of triangles that the model is simplified to. [500, 20 000]; 3000, between the paper's 2000 and
    /// 4000.
    pub n_faces: usize,
    /// Number of random cuts of each part. [8, 1000]; 64.
    pub n_cuts: usize,
    /// Worth ([`Step::worth`]) below which cutting stops, if no number of parts is requested. [0, 1]; 0.075.
    pub least_worth: f64,
    /// Limit relative to the best of the first three cuts: below this share of its worth cutting stops, too.
    /// [0, 1]; 0.2.
    pub least_worth_share: f64,
    /// Exponent of the smaller side's share of the area in a cut's score. [0, 1]; 0.3.
    pub balance: f64,
    /// Number of parts; `None`: cut until no cut is worth it.
    pub n_parts: Option<usize>,
    /// True to divide the model alike on both sides of its plane of symmetry, if there is one; false.
    pub symmetric: bool,
    /// Seed of all random choices; 0.
    pub seed: u64,
}

impl Default for RandomCutsParams {
    fn default() -> Self {
        Self {
            n_faces: 3000,
            n_cuts: 64,
            least_worth: 0.075,
            least_worth_share: 0.2,
            balance: 0.3,
            n_parts: None,
            symmetric: false,
            seed: 0,
        }
    }
}

impl RandomCutsParams {
    /// Returns all problems at once, as messages for people; empty if there are none.
    pub fn problems(&self) -> Vec<String> {
        let found = [
            outside("n_faces", self.n_faces as f64, 500.0, 20_000.0),
            outside("n_cuts", self.n_cuts as f64, 8.0, 1000.0),
            outside("balance", self.balance, 0.0, 1.0),
            outside("least_worth", self.least_worth, 0.0, 1.0),
            outside("least_worth_share", self.least_worth_share, 0.0, 1.0),
            no_parts(self.n_parts),
        ];
        found.into_iter().flatten().collect()
    }
}

/// A division, and the plane about which it is symmetric.
#[derive(Clone, Debug, PartialEq)]
pub struct Divided {
    /// Part number of each face.
    pub part_of_face: Vec<u32>,
    /// Plane of symmetry; `None` if the model has none or none was requested.
    pub plane: Option<Plane>,
}

/// Divides `mesh` by random cuts: the part of each face.
pub fn divide(params: &RandomCutsParams, mesh: &TriMesh) -> Vec<u32> {
    divide_with_whole(params, mesh, &Whole::default()).part_of_face
}

/// Divides `mesh` without dividing a set of `whole`. Keeping these sets whole takes precedence over symmetry.
pub fn divide_with_whole(params: &RandomCutsParams, mesh: &TriMesh, whole: &Whole) -> Divided {
    divide_among(params, mesh, whole, |_| Vec::new())
}

/// Divides like [`divide_with_whole`], with divisions of the coarse mesh by other methods as further
/// candidates.
pub(crate) fn divide_among(
    params: &RandomCutsParams,
    mesh: &TriMesh,
    whole: &Whole,
    proposals: impl Fn(&Coarse) -> Vec<Vec<u32>>,
) -> Divided {
    let fine = FaceGraph::new(mesh);
    let coarse = Coarse::new(mesh, params.n_faces);
    let graph = &coarse.graph;
    let on_coarse = whole.on_coarse(&coarse.of_face, &fine.area_mm2, graph.n_faces());
    let plane = params.symmetric.then(|| symmetry::plane(&coarse.mesh)).flatten();
    let mut proposals = proposals(&coarse);
    for labels in &mut proposals {
        on_coarse.gather(labels, &graph.area_mm2);
    }
    let found = hierarchy_with_whole(params, graph, &proposals, &on_coarse);
    let mut labels = match &plane {
        Some(plane) => {
            let mirrored = Mirrored::new(plane, &coarse.mesh, graph);
            let labels = coarse.bring_back(&fine, &found.mirror(params, graph, &mirrored));
            // Borders have settled on each side on their own, so symmetry must be restored.
            Mirrored::new(plane, mesh, &fine).labels(&fine, &labels)
        }
        None => coarse.bring_back(&fine, &found.labels(graph, found.n_steps(params))),
    };
    whole.gather(&mut labels, &fine.area_mm2);
    Divided {
        part_of_face: number_parts(&fine, &labels).0,
        plane,
    }
}

/// Divides `graph`, which should be small: the part of each face.
pub fn divide_graph(params: &RandomCutsParams, graph: &FaceGraph) -> Vec<u32> {
    let found = hierarchy(params, graph, &[]);
    found.labels(graph, found.n_steps(params))
}

/// A division, and the cuts that led to it.
pub struct Hierarchy {
    part: Vec<u32>,
    /// Number of parts before the first cut: the components of the mesh.
    pub n_components: usize,
    /// All cuts, in the order in which they were made.
    pub steps: Vec<Step>,
}

/// A cut that was made, with the data of its score.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Part that was cut. The side cut off became a new part with the next free number.
    pub part: u32,
    /// Quality of the cut, [0, 1].
    pub score: f64,
    /// Share of the smaller side in the whole area, [0, 0.5].
    pub share: f64,
    /// Share of the part in the whole area, before the cut.
    pub of_share: f64,
    /// Mean share of random cuts that run over the cut's edges.
    pub agreement: f64,
    /// Price of the cut, divided by the circumference of a disk as large as the smaller side.
    pub tightness: f64,
    /// Mean price of a millimetre of the cut.
    pub mean_price: f64,
}

impl Step {
    /// Gain of the division by the cut, [0, 1]. Large if the cut is short for the area it cuts off, if it is
    /// concave, and if the part that was cut is large.
    pub fn worth(&self) -> f64 {
        self.shape() * self.of_share.powf(WORTH_OF_SIZE)
    }

    fn shape(&self) -> f64 {
        (-TIGHTNESS * self.tightness - CONCAVITY * self.mean_price).exp()
    }

    const NONE: Self = Self {
        part: 0,
        score: 0.0,
        share: 0.0,
        of_share: 0.0,
        agreement: 0.0,
        tightness: 0.0,
        mean_price: 0.0,
    };
}

impl Hierarchy {
    /// Number of cuts that `params` asks for; if it names no number, the number of cuts that are worth it.
    pub fn n_steps(&self, params: &RandomCutsParams) -> usize {
        if let Some(n_parts) = params.n_parts {
            return n_parts.saturating_sub(self.n_components);
        }
        let best = self.steps.iter().take(3).map(Step::worth).fold(0.0, f64::max);
        let least = params.least_worth.max(params.least_worth_share * best);
        let end = self.steps.iter().position(|s| s.worth() < least);
        end.unwrap_or(self.steps.len())
    }

    /// Connected parts after the first `n_steps` cuts, numbered by their lowest face.
    pub fn labels(&self, graph: &FaceGraph, n_steps: usize) -> Vec<u32> {
        let n = self.n_components + n_steps.min(self.steps.len());
        let labels: Vec<u32> = self
            .part
            .iter()
            .map(|&p| {
                let mut p = p as usize;
                while p >= n {
                    p = self.steps[p - self.n_components].part as usize;
                }
                p as u32
            })
            .collect();
        number_parts(graph, &labels).0
    }

    /// Symmetric parts after as many cuts as `params` asks for. Uses fewer cuts if mirroring would make more
    /// parts than requested.
    fn mirror(&self, params: &RandomCutsParams, graph: &FaceGraph, mirrored: &Mirrored) -> Vec<u32> {
        let most = params.n_parts.unwrap_or(usize::MAX).max(self.n_components);
        let after = |n_steps: usize| mirrored.labels(graph, &self.labels(graph, n_steps));
        let n_parts = |labels: &[u32]| labels.iter().max().map_or(0, |&l| l as usize + 1);
        let mut fewer = (0..=self.n_steps(params)).rev().map(after);
        fewer
            .find(|labels| n_parts(labels) <= most)
            .unwrap_or_else(|| after(0))
    }
}

/// Makes the best cut repeatedly, until there are enough parts or no cut has a positive score.
///
/// The borders of `proposals`, other divisions of `graph`, are candidates beside the random cuts.
pub fn hierarchy(params: &RandomCutsParams, graph: &FaceGraph, proposals: &[Vec<u32>]) -> Hierarchy {
    hierarchy_with_whole(params, graph, proposals, &Whole::default())
}

/// Makes cuts like [`hierarchy`], but none through a set of `whole`. Edges within a set cost more than all
/// others together, so a cut over them has a score of 0.
pub fn hierarchy_with_whole(
    params: &RandomCutsParams,
    graph: &FaceGraph,
    proposals: &[Vec<u32>],
    whole: &Whole,
) -> Hierarchy {
    let cutter = Cutter {
        params,
        graph,
        proposals,
        price: prices_with_whole(graph, whole),
        way: graph
            .creases
            .iter()
            .map(|c| c.step_mm * (1.0 + DETOUR_A_RAD * c.concavity_rad()))
            .collect(),
        total_mm2: graph.total_area_mm2(),
    };
    let (mut labels, n_components) = number_parts(graph, &vec![0; graph.n_faces()]);
    let mut parts: Vec<Vec<u32>> = vec![Vec::new(); n_components];
    for (face, &label) in labels.iter().enumerate() {
        parts[label as usize].push(face as u32);
    }
    let mut best: Vec<Option<Cut>> = (0..n_components)
        .map(|p| cutter.best_cut(&parts[p], p as u64, &labels))
        .collect();
    let wanted = params.n_parts.unwrap_or(MOST_PARTS);
    let mut steps = Vec::new();
    let mut n_asked = n_components as u64;
    while parts.len() < wanted {
        let score = |p: usize| best[p].as_ref().map_or(0.0, |c| c.step.score);
        let Some(part) = (0..parts.len()).max_by(|&p, &q| score(p).total_cmp(&score(q)).then(q.cmp(&p)))
        else {
            break;
        };
        if score(part) <= 0.0 {
            break;
        }
        let Some(cut) = best[part].take() else { break };
        let new = parts.len();
        cut.side.iter().for_each(|&f| labels[f as usize] = new as u32);
        parts[part].retain(|&f| labels[f as usize] == part as u32);
        parts.push(cut.side);
        steps.push(Step {
            part: part as u32,
            ..cut.step
        });
        best.push(None);
        for p in [part, new] {
            best[p] = cutter.best_cut(&parts[p], n_asked, &labels);
            n_asked += 1;
        }
    }
    Hierarchy {
        part: labels,
        n_components,
        steps,
    }
}

/// Prices by [`prices`]; edges within sets of `whole` get a price that no cut can pay.
fn prices_with_whole(graph: &FaceGraph, whole: &Whole) -> Vec<f64> {
    /// Multiple of the prices of all edges together, so large that e to the power of minus it is 0.
    const UNPAYABLE: f64 = 1e4;
    let mut price = prices(graph);
    let unpayable = UNPAYABLE * price.iter().sum::<f64>();
    for (price, crease) in price.iter_mut().zip(&graph.creases) {
        if whole.has_both(crease.faces) {
            *price = unpayable;
        }
    }
    price
}

/// One side of a part cut in two.
#[derive(Clone)]
struct Cut {
    side: Vec<u32>,
    creases: Vec<u32>,
    step: Step,
}

struct Cutter<'a> {
    params: &'a RandomCutsParams,
    graph: &'a FaceGraph,
    proposals: &'a [Vec<u32>],
    /// Price of a cut on each edge, mm.
    price: Vec<f64>,
    /// Length of the path over each edge, lengthened by concavity, mm.
    way: Vec<f64>,
    total_mm2: f64,
}

impl Cutter<'_> {
    /// Scores a cut. Good cuts have high agreement, are short for what they cut off, are concave, and cut off
    /// much.
    fn judge(&self, share: f64, agreement: f64, price_mm: f64, mean_price: f64) -> Step {
        let around_disk_mm = (4.0 * PI * share * self.total_mm2).sqrt().max(f64::MIN_POSITIVE);
        let mut step = Step {
            share,
            agreement,
            tightness: price_mm / around_disk_mm,
            mean_price,
            ..Step::NONE
        };
        let size = (2.0 * share).powf(self.params.balance);
        step.score = agreement.powf(AGREEMENT_POWER) * size * step.shape();
        step
    }

    /// Finds the best cut of `part`, if it has any.
    fn best_cut(&self, part: &[u32], stream: u64, labels: &[u32]) -> Option<Cut> {
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
        cuts.extend(self.proposals.iter().flat_map(|labels| region.propose(labels)));
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
            let share = area.min(region.area_mm2 - area).max(0.0) / self.total_mm2;
            cut.step = self.judge(share, sum / whole, price, price / whole);
            cut.step.of_share = region.area_mm2 / self.total_mm2;
            if best.as_ref().is_none_or(|b| cut.step.score > b.step.score) {
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
    /// Pairs of (neighbour in the part, edge).
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

    /// Draws a face with probability proportional to `weight`, ≥ 0.
    fn draw(&self, rng: &mut ChaCha8Rng, weight: impl Fn(usize) -> f64) -> u32 {
        let sum: f64 = (0..self.faces.len()).map(&weight).sum();
        let mut left = rng.random::<f64>() * sum;
        let chosen = (0..self.faces.len()).find(|&f| {
            left -= weight(f);
            left < 0.0
        });
        chosen.unwrap_or(0) as u32
    }

    /// Finds the least cut between two random seeds. Faces nearer to a seed than a random margin stay with
    /// that seed. `None` if one side would be empty.
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

    /// Finds the cuts that separate one label of `labels` from the rest of the part, if both sides are
    /// connected.
    fn propose(&self, labels: &[u32]) -> Vec<Cut> {
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

    /// Total number of connected components of a set of faces and of its complement.
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

    /// Cuts the part along the border of a set; `None` if the set is empty or the whole part.
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
            step: Step::NONE,
        })
    }
}
