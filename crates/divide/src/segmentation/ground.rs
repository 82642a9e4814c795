//! A surface prepared for refining, with the sets of faces that no division may part.

use std::sync::OnceLock;

use shellock_geom::{Solid, Topology};
use shellock_segment::face_graph::FaceGraph;
use shellock_segment::whole::Whole;

use super::SegmentationParams;
use super::dual_graph::{CreaseCost, DualGraph};
use super::keep_whole::{margin_mm, whole};

/// Data of a surface for refining, computed once for all rounds.
pub(super) struct Ground<'a> {
    pub solid: &'a Solid,
    pub topology: Topology,
    pub faces: DualGraph,
    /// Sets of faces that no division may part.
    pub whole: Whole,
    graph: OnceLock<FaceGraph>,
}

impl<'a> Ground<'a> {
    /// Prepares a surface without regions to keep whole.
    pub fn new(solid: &'a Solid) -> Self {
        Self::with_regions(&SegmentationParams::default(), solid, &[])
    }

    /// Prepares a surface with the resolved regions that `params` keep whole; `source_face` refers to the
    /// model's triangles.
    pub fn with_regions(params: &SegmentationParams, solid: &'a Solid, source_face: &[u32]) -> Self {
        let topology = Topology::new(solid);
        let (keep, margin_mm) = (&params.keep_whole, margin_mm(params));
        Self {
            solid,
            whole: whole(keep, solid.mesh(), &topology, source_face, margin_mm),
            faces: DualGraph::of_faces(solid.mesh(), &topology, CreaseCost::NONE),
            topology,
            graph: OnceLock::new(),
        }
    }

    /// Graph of the triangles and their creases, in the form that methods use.
    pub fn graph(&self) -> &FaceGraph {
        self.graph.get_or_init(|| FaceGraph::new(self.solid.mesh()))
    }
}
