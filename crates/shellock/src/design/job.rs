//! The model divided with one wall, from which the trials of its keys begin.

use std::sync::Arc;

use super::wall::Wall;
use super::ways::Input;
use super::{DesignError, KeySource, Settings};
use crate::key::FaceSet;
use crate::segmentation::Plane;
use crate::strength::StressMap;
use crate::{Ctx, PatchId, SegmentedSurface, segmentation};

/// The model divided with one wall.
pub(super) struct Job<'a> {
    pub input: Input<'a>,
    pub wall: Arc<Wall>,
    pub surface: SegmentedSurface,
    stress: Option<StressMap>,
    /// Plane about which both sides are divided alike; `None` if they are divided as they are.
    pub mirror: Option<Plane>,
    /// Triangles of the model that the user wants in the key; `None` if the key is ours to choose.
    key_faces: Option<FaceSet>,
}

impl<'a> Job<'a> {
    /// Divides the model into pieces with this wall.
    pub fn new(ctx: &Ctx, input: Input<'a>, wall: Arc<Wall>) -> Result<Self, DesignError> {
        let params = &wall.settings.segmentation;
        let surface = segmentation::segment(&ctx.fork(), params, input.model, input.labels)?;
        Self::of(input, wall, surface)
    }

    /// Takes the model as it is divided already.
    pub fn of(input: Input<'a>, wall: Arc<Wall>, surface: SegmentedSurface) -> Result<Self, DesignError> {
        let stress = wall.strength.as_ref().map(StressMap::new);
        Ok(Self {
            key_faces: key_faces(&input, &surface)?,
            input,
            wall,
            surface,
            stress,
            mirror: None,
        })
    }

    /// The job with both sides divided alike about a plane.
    pub fn with_mirror(self, mirror: Option<Plane>) -> Self {
        Self { mirror, ..self }
    }

    /// The patch with the largest share of what the user wants in the key.
    pub fn key_of(&self, surface: &SegmentedSurface) -> Option<PatchId> {
        self.key_faces.as_ref()?.main_patch(surface)
    }

    pub fn settings(&self) -> &Settings {
        &self.wall.settings
    }

    /// Stress of the uncut wall, by place in the model as it was given.
    pub fn stress(&self) -> Option<&StressMap> {
        self.stress.as_ref()
    }
}

/// Triangles of the model that are to be in the key, as [`KeySource::Piece`] says.
fn key_faces(input: &Input<'_>, surface: &SegmentedSurface) -> Result<Option<FaceSet>, DesignError> {
    let KeySource::Piece(name) = input.params.key else {
        return Ok(None);
    };
    let faces = match input.labels {
        Some(labels) => FaceSet::with_label(labels, name),
        None => FaceSet::of_piece(surface, input.model.mesh().triangles.len(), name),
    };
    match (faces.is_empty(), input.labels) {
        (false, _) => Ok(Some(faces)),
        (true, Some(_)) => Err(DesignError::NoLabelOfKey(name)),
        (true, None) => Err(DesignError::NoPieceOfKey(name, surface.n_patches)),
    }
}
