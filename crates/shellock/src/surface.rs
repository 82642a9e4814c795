//! The outer surface with its patches: what segmentation hands to every later stage.

use shellock_geom::{TriMesh, Vec3};

use crate::{IdVec, PatchId};

/// The model's closed surface, cut along the seams so that each triangle belongs to one patch.
///
/// Geometrically it is the model's surface: cutting only adds points on edges and triangles inside triangles. Every patch
/// owns at least one triangle.
#[derive(Clone, Debug)]
pub struct SegmentedSurface {
    /// Closed, oriented outwards; two triangles of different patches meet in whole edges.
    pub mesh: TriMesh,
    /// The patch of each triangle of `mesh`.
    pub patch_of_face: Vec<PatchId>,
    /// The triangle of the uncut model that each triangle of `mesh` is a part of.
    pub source_face: Vec<u32>,
    /// How many patches there are; their ids are 0 … n − 1.
    pub n_patches: usize,
}

/// One stretch of seam between two patches: a polyline on the outer surface.
#[derive(Clone, Debug)]
pub struct Seam {
    /// The patch with the lower id.
    pub a: PatchId,
    /// The patch with the higher id.
    pub b: PatchId,
    /// Points in order, mm; the last equals the first where the seam is a loop.
    pub points: Vec<Vec3>,
    /// Outward unit normal of the surface at each point (mean of the adjacent triangles, by area).
    pub normals: Vec<Vec3>,
}

impl Seam {
    /// Length along the polyline, mm.
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|w| w[0].distance(w[1])).sum()
    }

    /// Whether the seam runs back into itself.
    pub fn is_loop(&self) -> bool {
        self.points.len() > 2 && self.points.first() == self.points.last()
    }
}

impl SegmentedSurface {
    /// Area of each patch, mm².
    pub fn areas(&self) -> IdVec<PatchId, f64> {
        let mut areas = IdVec::from_fn(self.n_patches, |_| 0.0);
        for (face, &patch) in self.patch_of_face.iter().enumerate() {
            areas[patch] += self.mesh.face_area(face);
        }
        areas
    }
}
