//! Makes all patches disks and their contacts 2-connected, by dividing the patches that stand in the way.
//!
//! A piece that alone holds others is divided through its seam with them, so that two pieces hold them; a ring around a limb is divided
//! lengthwise, as it could hardly be put on otherwise. See [`crate::contact_graph`] for why.

use shellock_geom::{HalfEdge, Solid, Topology};

use super::dual_graph::{CreaseCost, DualGraph};
use super::split::{Divider, euler_characteristics, raw_contact_graph};
use super::{FaceLabels, LabelOrigin, SegmentationError, SegmentationParams};
use crate::seams::seam_half_edges;
use crate::{ContactGraph, Ctx, PatchId, Warning};

/// How much longer a seam along triangle edges is than the smooth one: 4/π for random directions on a square grid.
const ZIGZAG: f64 = 1.27;

/// How much larger than the smallest piece a half must be, as smoothing takes from narrow patches.
const SPLIT_RESERVE: f64 = 2.0;

/// The labels with patches divided until each is a disk and no piece alone holds others, or until `max_splits` or `min_piece_mm2`
/// forbid more. Pieces that touch nothing long enough join a neighbour. Old patches keep their numbers unless some are joined.
///
/// Warns `piece-split` and `piece-joined` where the labels are the user's. The result may still fall short; ask
/// [`SegmentedSurface::contact_graph`](crate::SegmentedSurface::contact_graph).
pub fn mend(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
    labels: &FaceLabels,
    origin: LabelOrigin,
) -> Result<FaceLabels, SegmentationError> {
    let topology = Topology::new(solid);
    let faces = DualGraph::of_faces(solid.mesh(), &topology, CreaseCost::NONE);
    let divider = Divider {
        mesh: solid.mesh(),
        topology: &topology,
        faces: &faces,
        min_piece_mm2: SPLIT_RESERVE * params.min_piece_mm2,
    };
    let mut work = Work {
        divider,
        label: labels.as_slice().to_vec(),
        n_patches: labels.n_patches(),
        min_contact_mm: params.min_contact_mm * ZIGZAG,
    };
    for _ in 0..params.max_splits {
        ctx.check()?;
        let seam = work.seam();
        let graph = work.graph(&seam);
        if let Some((loose, into)) = weakest_link(&work, &graph) {
            work.warn(
                ctx,
                origin,
                "piece-joined",
                loose,
                "touches its neighbours too shortly for a connector and joins one",
            );
            work.join(loose, into);
        } else if !work.divide_worst(ctx, origin, &seam, &graph) {
            break;
        }
    }
    Ok(FaceLabels { patch_of_face: work.label, n_patches: work.n_patches })
}

struct Work<'a> {
    divider: Divider<'a>,
    label: Vec<u32>,
    n_patches: usize,
    min_contact_mm: f64,
}

/// Where the graph falls apart: the piece of the smaller part with the longest contact to the rest, and the piece it has that with.
fn weakest_link(work: &Work, graph: &ContactGraph) -> Option<(u32, u32)> {
    let parts = graph.parts();
    if parts.len() < 2 || graph.n_patches() <= 2 {
        return None;
    }
    let mut areas = vec![0.0; work.n_patches];
    work.label.iter().enumerate().for_each(|(f, &k)| areas[k as usize] += work.divider.faces.area[f]);
    let area = |part: &[PatchId]| part.iter().map(|p| areas[p.0 as usize]).sum::<f64>();
    let smallest = parts.iter().min_by(|p, q| area(p).total_cmp(&area(q)))?;
    let crossing = graph.contacts().iter().filter(|c| smallest.contains(&c.a) != smallest.contains(&c.b));
    let longest = crossing.max_by(|c, d| c.total_mm.total_cmp(&d.total_mm))?;
    let (inner, outer) = if smallest.contains(&longest.a) { (longest.a, longest.b) } else { (longest.b, longest.a) };
    Some((inner.0, outer.0))
}

impl Work<'_> {
    fn seam(&self) -> Vec<HalfEdge> {
        seam_half_edges(self.divider.topology, &self.label, 0..self.label.len() as u32)
    }

    fn graph(&self, seam: &[HalfEdge]) -> ContactGraph {
        raw_contact_graph(&self.divider, &self.label, self.n_patches, seam, self.min_contact_mm)
    }

    /// Divides the patch with most faults that can be divided; false where there is none.
    fn divide_worst(&mut self, ctx: &Ctx, origin: LabelOrigin, seam: &[HalfEdge], graph: &ContactGraph) -> bool {
        let euler = euler_characteristics(self.divider.mesh, self.divider.topology, &self.label, self.n_patches);
        let mut faulty: Vec<(usize, u32)> = Vec::new();
        for (k, &characteristic) in euler.iter().enumerate() {
            let hanging = graph.parts_without(PatchId::from(k)).len().saturating_sub(1);
            let faults = (1 - characteristic).unsigned_abs() as usize + hanging;
            if faults > 0 {
                faulty.push((faults, k as u32));
            }
        }
        let n_parts = graph.parts().len();
        faulty.sort_by_key(|&(faults, k)| (std::cmp::Reverse(faults), k));
        for (_, patch) in faulty {
            let parts = graph.parts_without(PatchId(patch));
            // A part that no counted contact ties to this patch cannot be reached by dividing it.
            let pairs: Vec<[u32; 2]> = if parts.len() > 1 {
                parts.iter().filter_map(|s| self.far_points(seam, patch, s)).collect()
            } else {
                Vec::new()
            };
            let n = self.n_patches;
            let (divider, min_contact_mm) = (&self.divider, self.min_contact_mm);
            let faults = |label: &[u32], inner: &[HalfEdge]| {
                // Numbers grew, so an old seam edge may now have its higher number on its own side.
                let all = seam.iter().chain(inner).map(|&h| {
                    let o = divider.topology.opposite(h);
                    if label[h as usize / 3] < label[o as usize / 3] { h } else { o }
                });
                let seams: Vec<HalfEdge> = all.collect();
                let after = raw_contact_graph(divider, label, n + 1, &seams, min_contact_mm);
                // A half that nothing holds would be joined again, and so on without end.
                if after.parts().len() > n_parts { f64::INFINITY } else { after.n_faults() as f64 }
            };
            let Some(division) = divider.best(&mut self.label, n, patch, &pairs, faults) else { continue };
            self.warn(
                ctx,
                origin,
                "piece-split",
                patch,
                if parts.len() > 1 {
                    "alone would hold other pieces, which could then slide off together, and is divided"
                } else {
                    "is not a disk but has holes or runs around a limb, so it could not be put on, and is divided"
                },
            );
            division.moved.iter().for_each(|&f| self.label[f as usize] = n as u32);
            self.n_patches += 1;
            return true;
        }
        false
    }

    /// Two triangles of `patch`, far apart along its seam with the pieces of `part`.
    fn far_points(&self, seam: &[HalfEdge], patch: u32, part: &[PatchId]) -> Option<[u32; 2]> {
        let beside: Vec<u32> = seam
            .iter()
            .flat_map(|&h| [h, self.divider.topology.opposite(h)])
            .filter(|&h| self.label[h as usize / 3] == patch)
            .filter(|&h| part.contains(&PatchId(self.label[self.divider.topology.opposite(h) as usize / 3])))
            .map(|h| h / 3)
            .collect();
        let center = |f: u32| self.divider.faces.center[f as usize];
        let farthest = |from: u32| {
            beside.iter().copied().max_by(|&f, &g| {
                center(f).distance_squared(center(from)).total_cmp(&center(g).distance_squared(center(from)))
            })
        };
        let one = farthest(*beside.first()?)?;
        Some([one, farthest(one)?])
    }

    /// Gives `loose` to `into`; the last number takes the one that became free.
    fn join(&mut self, loose: u32, into: u32) {
        let last = self.n_patches as u32 - 1;
        for k in &mut self.label {
            if *k == loose {
                *k = into;
            }
        }
        self.label.iter_mut().filter(|k| **k == last).for_each(|k| *k = loose);
        self.n_patches -= 1;
    }

    fn warn(&self, ctx: &Ctx, origin: LabelOrigin, code: &str, patch: u32, what: &str) {
        if origin == LabelOrigin::Automatic {
            return;
        }
        let face = self.label.iter().position(|&k| k == patch);
        ctx.warn(Warning {
            code: code.into(),
            message: format!("piece \"{patch}\" {what}"),
            pieces: vec![PatchId(patch)],
            at: face.map(|f| self.divider.mesh.face_center(f).to_array()),
        });
    }
}
