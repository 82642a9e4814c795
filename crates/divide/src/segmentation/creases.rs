//! Patches of similar size without a user's labels: k-means on the surface.
//!
//! Triangles are first merged into a few thousand cells, and seeds are spread over the cells. Patches grow
//! from the seeds in a geodesic metric that counts creases. Each seed moves to the middle of its patch, as in
//! Lloyd's algorithm. Patches that stay too large grow more slowly in the next round. Finally, patches of
//! triangles grow from the final seeds.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use shellock_geom::{Solid, Topology, TriMesh};
use shellock_report::Ctx;

use super::dual_graph::{CreaseCost, DualGraph};
use super::{FaceLabels, SegmentationError, SegmentationParams};

/// Number of cells to cluster. With 10 patches, 400 cells for each place a seed to 3 % of the patch's width.
const N_CELLS: usize = 4000;
/// Rounds of growing and centring; the seeds rarely move after ten.
const N_ROUNDS: usize = 12;
/// Starts with different random seeds, of which the most compact clustering is taken.
const N_STARTS: u64 = 4;
/// Candidates for the middle of a patch, besides its present seed.
const N_CANDIDATES: usize = 8;
/// Detours for one radian of concave and of convex crease, in radii of a patch.
const CONCAVE_RADII: f64 = 0.3;
const CONVEX_RADII: f64 = 0.04;

/// Node of a seed and slowness of its patch.
type Seed = (u32, f64);

/// Divides into about `n_pieces` connected patches of similar area, with seams preferably in concave creases.
/// One seed gives one result.
///
/// Patches are connected, but disks only after [`super::refine`]. Fails if the model has fewer triangles than
/// patches wanted. Takes 0.2 s for 60 000 triangles.
pub(super) fn crease_labels(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
) -> Result<FaceLabels, SegmentationError> {
    let mesh = solid.mesh();
    let n_pieces = params.n_pieces.unwrap_or_else(|| usual_n_pieces(mesh.area()));
    if n_pieces > mesh.triangles.len() {
        return Err(SegmentationError::TooManyPieces {
            n_pieces,
            n_faces: mesh.triangles.len(),
        });
    }
    ctx.check()?;
    let topology = Topology::new(solid);
    let radius_mm = (mesh.area() / n_pieces as f64 / std::f64::consts::PI).sqrt();
    let cost = CreaseCost {
        concave_mm: CONCAVE_RADII * radius_mm,
        convex_mm: CONVEX_RADII * radius_mm,
    };
    let (cell, n_cells) = cells(mesh, &topology, N_CELLS.max(20 * n_pieces));
    let graph = DualGraph::of_cells(mesh, &topology, &cell, n_cells, cost);
    ctx.check()?;
    let starts: Vec<(f64, Vec<Seed>)> = (0..N_STARTS)
        .into_par_iter()
        .map(|start| cluster(&graph, n_pieces, stream(params.seed, start)))
        .collect();
    ctx.check()?;
    let (_, seeds) = starts
        .into_iter()
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .expect("there is at least one start");

    let faces = DualGraph::of_faces(mesh, &topology, cost);
    let mut face_of_cell = vec![(f64::INFINITY, 0); n_cells];
    for (face, &c) in cell.iter().enumerate() {
        let d = faces.center[face].distance_squared(graph.center[c as usize]);
        if d < face_of_cell[c as usize].0 {
            face_of_cell[c as usize] = (d, face as u32);
        }
    }
    let face_seeds: Vec<Seed> = seeds
        .iter()
        .map(|&(c, slowness)| (face_of_cell[c as usize].1, slowness))
        .collect();
    let (_, mut owner) = faces.grow(&face_seeds, |_| true);
    // Only bodies without a seed stay unreached. They go to the first patch, and the labels' check splits
    // them off again.
    owner.iter_mut().filter(|o| **o == u32::MAX).for_each(|o| *o = 0);
    Ok(FaceLabels::from_components(&topology, &owner))
}

/// Default number of pieces for a surface of `area_mm2`, in [6, 24]: 10 for a 150 mm figure, as the paper's 9
/// to 13. It grows with the figure's height to the power of two thirds.
pub fn usual_n_pieces(area_mm2: f64) -> usize {
    (10.0 * (area_mm2 / 45_000.0).cbrt()).round().clamp(6.0, 24.0) as usize
}

fn stream(seed: u64, start: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(start);
    rng
}

/// Merges triangles breadth first into about `n_wanted` connected cells of similar area.
fn cells(mesh: &TriMesh, topology: &Topology, n_wanted: usize) -> (Vec<u32>, usize) {
    let n_faces = mesh.triangles.len();
    let enough_mm2 = mesh.area() / n_wanted as f64;
    let mut cell = vec![u32::MAX; n_faces];
    let mut n_cells = 0;
    let mut queue = std::collections::VecDeque::new();
    for start in 0..n_faces as u32 {
        if cell[start as usize] != u32::MAX {
            continue;
        }
        let mut area = 0.0;
        queue.clear();
        queue.push_back(start);
        while let Some(face) = queue.pop_front() {
            if cell[face as usize] != u32::MAX {
                continue;
            }
            cell[face as usize] = n_cells;
            area += mesh.face_area(face as usize);
            if area >= enough_mm2 {
                break;
            }
            queue.extend(
                topology
                    .neighbours(face)
                    .into_iter()
                    .filter(|&f| cell[f as usize] == u32::MAX),
            );
        }
        n_cells += 1;
    }
    (cell, n_cells as usize)
}

/// Runs k-means once. Returns its badness with the seeds: the mean squared distance from the seeds, raised if
/// areas differ.
fn cluster(graph: &DualGraph, n_pieces: usize, mut rng: impl Rng) -> (f64, Vec<Seed>) {
    let n_pieces = n_pieces.min(graph.len());
    let mut seeds = spread(graph, n_pieces, &mut rng);
    let mean_mm2 = graph.area.iter().sum::<f64>() / n_pieces as f64;
    let mut best = (f64::INFINITY, seeds.clone());
    for _ in 0..N_ROUNDS {
        let (distance, owner) = graph.grow(&seeds, |_| true);
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); n_pieces];
        let mut spread_mm4 = 0.0;
        for node in 0..graph.len() {
            if owner[node] != u32::MAX {
                members[owner[node] as usize].push(node as u32);
                spread_mm4 += graph.area[node] * distance[node].powi(2);
            }
        }
        let areas: Vec<f64> = members
            .iter()
            .map(|m| m.iter().map(|&n| graph.area[n as usize]).sum())
            .collect();
        let unevenness = areas.iter().map(|a| (a / mean_mm2 - 1.0).powi(2)).sum::<f64>() / n_pieces as f64;
        let badness = spread_mm4 / (mean_mm2 * mean_mm2 * n_pieces as f64) + 0.2 * unevenness;
        if badness < best.0 {
            best = (badness, seeds.clone());
        }
        for (k, seed) in seeds.iter_mut().enumerate() {
            seed.0 = middle(graph, &members[k], seed.0, &owner, k as u32, &mut rng);
            seed.1 = (seed.1 * (areas[k] / mean_mm2).powf(0.2)).clamp(0.6, 1.7);
        }
    }
    best
}

/// Draws `n` nodes far from each other, each by area times the fourth power of its distance from those
/// before.
fn spread(graph: &DualGraph, n: usize, rng: &mut impl Rng) -> Vec<Seed> {
    let mut seeds = vec![(draw(&graph.area, rng), 1.0)];
    while seeds.len() < n {
        let (distance, _) = graph.grow(&seeds, |_| true);
        let farthest = distance
            .iter()
            .filter(|d| d.is_finite())
            .fold(0.0, |m: f64, &d| m.max(d))
            .max(f64::MIN_POSITIVE);
        let weight: Vec<f64> = (0..graph.len())
            .map(|i| graph.area[i] * (distance[i].min(farthest) / farthest).powi(4))
            .collect();
        seeds.push((draw(&weight, rng), 1.0));
    }
    seeds
}

/// Draws an index with probability proportional to `weight`.
fn draw(weight: &[f64], rng: &mut impl Rng) -> u32 {
    let mut left = rng.random::<f64>() * weight.iter().sum::<f64>();
    for (i, w) in weight.iter().enumerate() {
        left -= w;
        if left < 0.0 {
            return i as u32;
        }
    }
    weight.len() as u32 - 1
}

/// Node nearest to all members, by least sum of squared distances, among the present seed and some members.
fn middle(graph: &DualGraph, members: &[u32], seed: u32, owner: &[u32], k: u32, rng: &mut impl Rng) -> u32 {
    if members.is_empty() {
        return seed;
    }
    let mut best = (f64::INFINITY, seed);
    for i in 0..=N_CANDIDATES {
        let candidate = if i == 0 {
            seed
        } else {
            members[rng.random_range(0..members.len())]
        };
        let (distance, _) = graph.grow(&[(candidate, 1.0)], |n| owner[n as usize] == k);
        let cost: f64 = members
            .iter()
            .map(|&n| graph.area[n as usize] * distance[n as usize].powi(2))
            .sum();
        if cost < best.0 {
            best = (cost, candidate);
        }
    }
    best.1
}
