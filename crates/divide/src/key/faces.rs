//! Part of the model that the user wants in the key.

use shellock_report::{IdVec, PatchId};
use shellock_surface::SegmentedSurface;

/// Set of triangles of the undivided model.
pub struct FaceSet(Vec<bool>);

impl FaceSet {
    /// The triangles with a label; `labels` has one for each triangle.
    pub fn with_label(labels: &[i64], label: i64) -> Self {
        Self(labels.iter().map(|l| *l == label).collect())
    }

    /// The triangles of which a part is in the piece with this number, from 1. `n_triangles` is that of the
    /// undivided model.
    pub fn of_piece(surface: &SegmentedSurface, n_triangles: usize, number: i64) -> Self {
        let mut is_in = vec![false; n_triangles];
        for (patch, &source) in surface.patch_of_face.iter().zip(&surface.source_face) {
            is_in[source as usize] |= i64::from(patch.number()) == number;
        }
        Self(is_in)
    }

    /// Returns true if the set has no triangle.
    pub fn is_empty(&self) -> bool {
        !self.0.contains(&true)
    }

    /// The patch of a division of the model with the largest area in the set.
    pub fn main_patch(&self, surface: &SegmentedSurface) -> Option<PatchId> {
        let mut area_mm2: IdVec<PatchId, f64> = IdVec::from_fn(surface.n_patches, |_| 0.0);
        for (face, &patch) in surface.patch_of_face.iter().enumerate() {
            if self.0[surface.source_face[face] as usize] {
                area_mm2[patch] += surface.mesh.face_area(face);
            }
        }
        let largest = area_mm2.iter().max_by(|a, b| a.1.total_cmp(b.1));
        largest.map(|(patch, _)| patch)
    }
}
