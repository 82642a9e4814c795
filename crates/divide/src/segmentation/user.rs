//! A user's labels, checked and cleaned.

use std::collections::BTreeSet;

use crate::causes::Cause;
use shellock_geom::{Solid, Topology, TriMesh};
use shellock_report::{Ctx, PatchId, Warning};

use super::{FaceLabels, SegmentationError, SegmentationParams};

/// Least number of triangles of a patch, both on average and for each patch.
const MIN_FACES: usize = 3;
/// Greatest number of labels that ids and planning support.
const MAX_LABELS: usize = 1000;
/// Least share of the label's area for a separate part to become a piece of its own. A smaller part is an
/// island.
const ISLAND_SHARE: f64 = 0.1;

/// Makes patches from one label for each triangle. They are numbered without gaps in order of the labels, and
/// each is connected and large enough.
///
/// Distant parts of a label become pieces of their own (`label-split`). Islands (`label-island`, one warning
/// for all) and patches that are too small (`label-merged`) join the neighbour with the longest common seam.
pub fn user_labels(
    ctx: &Ctx,
    params: &SegmentationParams,
    solid: &Solid,
    labels: &[i64],
) -> Result<FaceLabels, SegmentationError> {
    let n_faces = solid.mesh().triangles.len();
    if labels.len() != n_faces {
        return Err(SegmentationError::LabelCount {
            n_labels: labels.len(),
            n_faces,
        });
    }
    let names: Vec<i64> = labels
        .iter()
        .copied()
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect();
    if let &[label] = &names[..] {
        return Err(SegmentationError::OneLabel { label, n_faces });
    }
    if names.len() * MIN_FACES > n_faces || names.len() > MAX_LABELS {
        return Err(SegmentationError::TooManyLabels {
            n_labels: names.len(),
            n_faces,
        });
    }
    ctx.check()?;
    let topology = Topology::new(solid);
    let label: Vec<u32> = labels
        .iter()
        .map(|l| names.partition_point(|n| n < l) as u32)
        .collect();
    let mut parts = LabelParts::new(solid.mesh(), &topology, &label);
    parts.merge_islands(ctx, params, &names);
    parts.merge_small(ctx, params, &names);
    // Parts are numbered by label already, so the patches follow the order of the labels.
    let cleaned = FaceLabels::from_components(&topology, &parts.part_of_face);
    if cleaned.n_patches() < 2 {
        return Err(SegmentationError::AllTooSmall {
            min_piece_mm2: params.min_piece_mm2,
        });
    }
    Ok(cleaned)
}

/// Connected parts of labels, which may be merged.
struct LabelParts<'a> {
    mesh: &'a TriMesh,
    topology: &'a Topology,
    /// The part of each triangle; changes when parts merge.
    part_of_face: Vec<u32>,
    label: Vec<u32>,
    area: Vec<f64>,
    n_faces: Vec<usize>,
}

impl<'a> LabelParts<'a> {
    fn new(mesh: &'a TriMesh, topology: &'a Topology, label_of_face: &[u32]) -> Self {
        let parts = FaceLabels::from_components(topology, label_of_face);
        let n = parts.n_patches();
        let (mut label, mut area, mut n_faces) = (vec![0; n], vec![0.0; n], vec![0; n]);
        for (face, &p) in parts.as_slice().iter().enumerate() {
            label[p as usize] = label_of_face[face];
            area[p as usize] += mesh.face_area(face);
            n_faces[p as usize] += 1;
        }
        Self {
            mesh,
            topology,
            part_of_face: parts.patch_of_face,
            label,
            area,
            n_faces,
        }
    }

    fn merge_islands(&mut self, ctx: &Ctx, params: &SegmentationParams, names: &[i64]) {
        let (mut n_islands, mut islands_mm2, mut largest) = (0, 0.0, None);
        for label in 0..names.len() as u32 {
            let mut same: Vec<usize> = (0..self.label.len())
                .filter(|&p| self.label[p] == label)
                .collect();
            same.sort_by(|&p, &q| self.area[q].total_cmp(&self.area[p]));
            let Some((&main, others)) = same.split_first() else {
                continue;
            };
            let island_mm2 = params.min_piece_mm2.max(ISLAND_SHARE * self.area[main]);
            for &part in others {
                let area = self.area[part];
                let name = names[label as usize];
                if area < island_mm2 {
                    (n_islands, islands_mm2) = (n_islands + 1, islands_mm2 + area);
                    if largest.is_none_or(|(most_mm2, _, _)| area > most_mm2) {
                        largest = Some((area, name, self.place_of(part)));
                    }
                    self.merge(part);
                } else {
                    let area_mm2 = area;
                    self.warn(
                        ctx,
                        part,
                        Cause::LabelSplit {
                            label: name,
                            area_mm2,
                        },
                    );
                }
            }
        }
        if let Some((area, name, at)) = largest {
            ctx.warn(Warning::new(
                Cause::LabelIslands {
                    n: n_islands,
                    area_mm2: islands_mm2,
                    largest_mm2: area,
                    largest_label: name,
                },
                Vec::new(),
                at,
            ));
        }
    }

    fn merge_small(&mut self, ctx: &Ctx, params: &SegmentationParams, names: &[i64]) {
        let is_small = |parts: &Self, p: usize| {
            parts.n_faces[p] > 0 && (parts.area[p] < params.min_piece_mm2 || parts.n_faces[p] < MIN_FACES)
        };
        // Each merge leaves one part fewer, so this ends. The smallest part comes first and may make its
        // neighbour large enough.
        while let Some(part) = (0..self.area.len())
            .filter(|&p| is_small(self, p))
            .min_by(|&p, &q| self.area[p].total_cmp(&self.area[q]))
        {
            let name = names[self.label[part] as usize];
            let cause = Cause::LabelMerged {
                label: name,
                area_mm2: self.area[part],
                n_triangles: self.n_faces[part],
                least_mm2: params.min_piece_mm2,
            };
            self.warn(ctx, part, cause);
            if !self.merge(part) {
                break;
            }
        }
    }

    /// Merges `part` into the neighbour with the longest common seam. Returns false if it has no neighbour.
    fn merge(&mut self, part: usize) -> bool {
        let mut shared_mm = vec![0.0; self.area.len()];
        for h in 0..self.topology.n_half_edges() as u32 {
            let other = self.part_of_face[self.topology.opposite(h) as usize / 3] as usize;
            if self.part_of_face[h as usize / 3] as usize == part && other != part {
                let (from, to) = shellock_geom::topology::ends(self.mesh, h);
                shared_mm[other] += self.mesh.points[from as usize].distance(self.mesh.points[to as usize]);
            }
        }
        let mut into = None;
        for other in 0..shared_mm.len() {
            if shared_mm[other] > into.map_or(0.0, |i: usize| shared_mm[i]) {
                into = Some(other);
            }
        }
        let Some(into) = into else { return false };
        self.part_of_face
            .iter_mut()
            .filter(|p| **p as usize == part)
            .for_each(|p| *p = into as u32);
        self.area[into] += std::mem::take(&mut self.area[part]);
        self.n_faces[into] += std::mem::take(&mut self.n_faces[part]);
        true
    }

    fn warn(&self, ctx: &Ctx, part: usize, cause: Cause) {
        let at = self.place_of(part);
        ctx.warn(Warning::new(cause, Vec::<PatchId>::new(), at));
    }

    fn place_of(&self, part: usize) -> Option<[f64; 3]> {
        let face = self.part_of_face.iter().position(|&p| p as usize == part);
        face.map(|f| self.mesh.face_center(f).to_array())
    }
}
