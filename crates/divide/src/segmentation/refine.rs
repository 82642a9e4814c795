//! Makes all patches disks and their contacts 2-connected, by dividing the patches that prevent it.
//!
//! A piece that is the only link to others is divided through its seam with them, so that two pieces hold
//! them. A ring around a limb is divided lengthwise, since it is hard to put on otherwise. The reasons are in
//! [`shellock_surface::seam::graph`]. If no division helps, because the seam is too short for two contacts,
//! the dependent pieces are joined to the piece that holds them.

use rayon::prelude::*;
use shellock_geom::{HalfEdge, Solid};
use shellock_report::{Ctx, PatchId};
use shellock_surface::seam::graph::{Adjacency, ContactGraph};
use shellock_surface::seam::seam_half_edges;

use super::ground::Ground;
use super::split::{Divider, Division, euler_characteristics, raw_contact_graph};
use super::{FaceLabels, SegmentationError, SegmentationParams};

/// Ratio of the length of a seam along triangle edges to that of the smooth one: 4/π for random directions on
/// a square grid.
const ZIGZAG: f64 = 1.27;

/// Least area of a half, as a multiple of the smallest piece. Smoothing shrinks narrow patches.
const SPLIT_RESERVE: f64 = 2.0;

/// Divisions in a row that may leave as many faults as before. A handle or a patch with several holes needs
/// some of them before one helps.
const MAX_IDLE_DIVISIONS: usize = 3;

/// Divides patches until each is a disk and no piece is the only link to others, or until `max_splits` or
/// `min_piece_mm2` forbid more. A piece without any contact that is long enough joins a neighbour. So does
/// one that is linked to a single piece by a seam too short for two contacts. Old patches keep their numbers
/// unless some are joined.
///
/// The result may still have faults; check
/// [`SegmentedSurface::contact_graph`](shellock_surface::SegmentedSurface::contact_graph).
pub fn refine(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
    labels: &FaceLabels,
) -> Result<FaceLabels, SegmentationError> {
    refine_on(ctx, params, &Ground::new(solid), labels)
}

/// Runs [`refine`] on a surface that is already prepared.
pub(super) fn refine_on(
    ctx: &Ctx,
    params: &SegmentationParams,
    ground: &Ground<'_>,
    labels: &FaceLabels,
) -> Result<FaceLabels, SegmentationError> {
    let mut work = Work::new(params, ground, labels);
    let mut best = (work.n_faults(), work.labels());
    let mut n_idle = 0;
    for _ in 0..params.max_splits {
        ctx.check()?;
        let seam = work.seam();
        let graph = work.graph(&seam);
        if let Some((loose, into)) = weakest_link(&work, &graph) {
            work.join(loose, into);
        } else if !work.divide_worst(&seam, &graph, n_idle < MAX_IDLE_DIVISIONS)
            && !work.join_articulation(&seam, &graph)
        {
            break;
        }
        let n_faults = work.n_faults();
        if n_faults < best.0 {
            best = (n_faults, work.labels());
            n_idle = 0;
        } else {
            n_idle += 1;
        }
    }
    Ok(best.1)
}

/// Number of faults of `labels`: pieces that are the only link to others, and patches that are no disks.
pub(super) fn n_faults(params: &SegmentationParams, ground: &Ground<'_>, labels: &FaceLabels) -> usize {
    Work::new(params, ground, labels).n_faults()
}

struct Work<'a> {
    divider: Divider<'a>,
    label: Vec<u32>,
    n_patches: usize,
    min_contact_mm: f64,
}

/// Missing link of a disconnected graph: the piece of the smallest part with the longest contact to the rest,
/// and its partner in that contact. `None` if the graph is connected.
fn weakest_link(work: &Work, graph: &ContactGraph) -> Option<(u32, u32)> {
    let parts = graph.parts();
    if parts.len() < 2 || graph.n_patches() <= 2 {
        return None;
    }
    let areas = work.areas();
    let area = |part: &[PatchId]| part.iter().map(|p| areas[p.0 as usize]).sum::<f64>();
    let smallest = parts.iter().min_by(|p, q| area(p).total_cmp(&area(q)))?;
    let crossing = graph
        .contacts()
        .iter()
        .filter(|c| smallest.contains(&c.a) != smallest.contains(&c.b));
    let longest = crossing.max_by(|c, d| c.total_mm.total_cmp(&d.total_mm))?;
    let (inner, outer) = if smallest.contains(&longest.a) {
        (longest.a, longest.b)
    } else {
        (longest.b, longest.a)
    };
    Some((inner.0, outer.0))
}

impl<'a> Work<'a> {
    fn new(params: &SegmentationParams, ground: &'a Ground<'_>, labels: &FaceLabels) -> Self {
        Self {
            divider: Divider {
                mesh: ground.solid.mesh(),
                topology: &ground.topology,
                faces: &ground.faces,
                whole: &ground.whole,
                min_piece_mm2: SPLIT_RESERVE * params.min_piece_mm2,
            },
            label: labels.as_slice().to_vec(),
            n_patches: labels.n_patches(),
            min_contact_mm: params.min_contact_mm * ZIGZAG,
        }
    }

    fn labels(&self) -> FaceLabels {
        FaceLabels {
            patch_of_face: self.label.clone(),
            n_patches: self.n_patches,
        }
    }

    fn seam(&self) -> Vec<HalfEdge> {
        seam_half_edges(self.divider.topology, &self.label, 0..self.label.len() as u32)
    }

    fn graph(&self, seam: &[HalfEdge]) -> ContactGraph {
        raw_contact_graph(
            &self.divider,
            &self.label,
            self.n_patches,
            seam,
            self.min_contact_mm,
        )
    }

    fn areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.n_patches];
        self.label
            .iter()
            .enumerate()
            .for_each(|(f, &k)| areas[k as usize] += self.divider.faces.area[f]);
        areas
    }

    /// Difference of each patch's Euler characteristic from that of a disk.
    fn holes(&self) -> Vec<usize> {
        let euler = euler_characteristics(
            self.divider.mesh,
            self.divider.topology,
            &self.label,
            self.n_patches,
        );
        euler
            .into_iter()
            .map(|characteristic| (1 - characteristic).unsigned_abs() as usize)
            .collect()
    }

    /// Total number of faults of the graph and of all patches.
    fn n_faults(&self) -> usize {
        self.graph(&self.seam()).n_faults() + self.holes().iter().sum::<usize>()
    }

    /// Divides the patch with most faults whose division leaves fewer faults. If there is none and
    /// `may_idle`, divides a patch that is no disk without improvement. Returns false if nothing was divided.
    fn divide_worst(&mut self, seam: &[HalfEdge], graph: &ContactGraph, may_idle: bool) -> bool {
        let holes = self.holes();
        let hanging = |k: usize| graph.parts_without(PatchId::from(k)).len().saturating_sub(1);
        let mut faulty: Vec<(usize, u32)> = (0..self.n_patches)
            .map(|k| (holes[k] + hanging(k), k as u32))
            .collect();
        faulty.retain(|&(faults, _)| faults > 0);
        faulty.sort_by_key(|&(faults, k)| (std::cmp::Reverse(faults), k));
        let mut idle = None;
        for (_, patch) in faulty {
            let n_before = graph.n_faults() + holes[patch as usize];
            let Some(division) = self.best_division(seam, graph, patch) else {
                continue;
            };
            if division.n_faults < n_before as f64 {
                self.apply(&division);
                return true;
            }
            if may_idle && holes[patch as usize] > 0 {
                idle = idle.or(Some(division));
            }
        }
        idle.is_some_and(|division| {
            self.apply(&division);
            true
        })
    }

    fn apply(&mut self, division: &Division) {
        division
            .new_half
            .iter()
            .for_each(|&f| self.label[f as usize] = self.n_patches as u32);
        self.n_patches += 1;
    }

    /// Best division of `patch`, mostly through its seams with the pieces that depend on it.
    fn best_division(&self, seam: &[HalfEdge], graph: &ContactGraph, patch: u32) -> Option<Division> {
        let n_parts = graph.parts().len();
        let parts = graph.parts_without(PatchId(patch));
        // A part without a counted contact to this patch cannot be reached by dividing it.
        let pairs: Vec<[u32; 2]> = if parts.len() > 1 {
            parts
                .iter()
                .filter_map(|s| self.far_points(seam, patch, s))
                .collect()
        } else {
            Vec::new()
        };
        let n = self.n_patches;
        let (divider, min_contact_mm) = (&self.divider, self.min_contact_mm);
        let faults = |label: &[u32], inner: &[HalfEdge]| {
            // Numbers grew, so an old seam edge may now have its higher number on its own side.
            let all = seam.iter().chain(inner).map(|&h| {
                let o = divider.topology.opposite(h);
                if label[h as usize / 3] < label[o as usize / 3] {
                    h
                } else {
                    o
                }
            });
            let seams: Vec<HalfEdge> = all.collect();
            let after = raw_contact_graph(divider, label, n + 1, &seams, min_contact_mm);
            // A half that nothing holds would be joined again, in an endless loop.
            if after.parts().len() > n_parts {
                f64::INFINITY
            } else {
                after.n_faults() as f64
            }
        };
        divider.best(&self.label, n, patch, &pairs, faults)
    }

    /// Two triangles of `patch` that are far apart along its seam with the pieces of `part`.
    fn far_points(&self, seam: &[HalfEdge], patch: u32, part: &[PatchId]) -> Option<[u32; 2]> {
        let beside: Vec<u32> = seam
            .iter()
            .flat_map(|&h| [h, self.divider.topology.opposite(h)])
            .filter(|&h| self.label[h as usize / 3] == patch)
            .filter(|&h| {
                part.contains(&PatchId(
                    self.label[self.divider.topology.opposite(h) as usize / 3],
                ))
            })
            .map(|h| h / 3)
            .collect();
        let center = |f: u32| self.divider.faces.center[f as usize];
        let farthest = |from: u32| {
            beside.iter().copied().max_by(|&f, &g| {
                center(f)
                    .distance_squared(center(from))
                    .total_cmp(&center(g).distance_squared(center(from)))
            })
        };
        let one = farthest(*beside.first()?)?;
        Some([one, farthest(one)?])
    }

    /// Joins two pieces in contact, one of which is an articulation piece. Among the pairs that leave the
    /// fewest faults, takes the one with the smallest piece. Returns false if none leaves fewer faults than
    /// before.
    fn join_articulation(&mut self, seam: &[HalfEdge], graph: &ContactGraph) -> bool {
        if self.n_patches <= 2 {
            return false;
        }
        let articulations = graph.articulation_pieces();
        let areas = self.areas();
        let n_before = graph.n_faults() + self.holes().iter().sum::<usize>();
        let ordered = |c: &Adjacency| {
            let (a, b) = (c.a.0, c.b.0);
            if areas[a as usize] <= areas[b as usize] {
                (a, b)
            } else {
                (b, a)
            }
        };
        let hangs = |c: &&Adjacency| articulations.contains(&c.a) || articulations.contains(&c.b);
        let counted = graph.contacts().iter().filter(|c| graph.counts(c)).filter(hangs);
        let pairs: Vec<(u32, u32)> = counted.map(ordered).collect();
        let joined = pairs.into_par_iter().map(|(small, large)| {
            let n_faults = self.faults_after_join(seam, small, large);
            (n_faults, areas[small as usize], small, large)
        });
        let mut best: Option<(usize, f64, u32, u32)> = None;
        for found in joined.collect::<Vec<_>>() {
            if found.0 < n_before && best.is_none_or(|x| (found.0, found.1) < (x.0, x.1)) {
                best = Some(found);
            }
        }
        best.is_some_and(|(_, _, small, large)| {
            self.join(small, large);
            true
        })
    }

    fn faults_after_join(&self, seam: &[HalfEdge], small: u32, large: u32) -> usize {
        let last = self.n_patches as u32 - 1;
        let number = |k: u32| if k == small { large } else { k };
        let number = |k: u32| {
            if number(k) == last && small != last {
                small
            } else {
                number(k)
            }
        };
        let label: Vec<u32> = self.label.iter().map(|&k| number(k)).collect();
        let side = |h: HalfEdge| label[h as usize / 3];
        let oriented = seam.iter().map(|&h| (h, self.divider.topology.opposite(h)));
        let seam: Vec<HalfEdge> = oriented
            .filter(|&(h, o)| side(h) != side(o))
            .map(|(h, o)| if side(h) < side(o) { h } else { o })
            .collect();
        let n = self.n_patches - 1;
        let graph = raw_contact_graph(&self.divider, &label, n, &seam, self.min_contact_mm);
        let euler = euler_characteristics(self.divider.mesh, self.divider.topology, &label, n);
        graph.n_faults()
            + euler
                .into_iter()
                .map(|x| (1 - x).unsigned_abs() as usize)
                .sum::<usize>()
    }

    /// Merges `loose` into `into`. The last patch takes the number that became free.
    fn join(&mut self, loose: u32, into: u32) {
        let last = self.n_patches as u32 - 1;
        for k in &mut self.label {
            if *k == loose {
                *k = into;
            }
        }
        self.label
            .iter_mut()
            .filter(|k| **k == last)
            .for_each(|k| *k = loose);
        self.n_patches -= 1;
    }
}
