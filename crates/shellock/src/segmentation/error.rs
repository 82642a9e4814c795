//! Why a surface is not divided, for people.

use crate::{Cancelled, PatchId};

/// Why there are no patches.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SegmentationError {
    /// The user stopped.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A label is missing or left over.
    #[error(
        "there are {n_labels} labels for {n_faces} triangles: give one label for each triangle, in the order of the model file"
    )]
    LabelCount {
        /// Labels given.
        n_labels: usize,
        /// Triangles of the model.
        n_faces: usize,
    },
    /// Nothing to take apart.
    #[error(
        "all {n_faces} triangles have the label {label}: give at least two labels, or none for automatic patches"
    )]
    OneLabel {
        /// The label.
        label: i64,
        /// Triangles of the model.
        n_faces: usize,
    },
    /// Labels that number triangles rather than patches.
    #[error(
        "{n_faces} triangles have {n_labels} different labels: give patches of at least 3 triangles on average, at most 1000"
    )]
    TooManyLabels {
        /// Different labels.
        n_labels: usize,
        /// Triangles of the model.
        n_faces: usize,
    },
    /// Everything was merged away.
    #[error(
        "after merging patches below {min_piece_mm2} mm² only one is left: lower min_piece_mm2 or scale the model up"
    )]
    AllTooSmall {
        /// The limit.
        min_piece_mm2: f64,
    },
    /// A region to keep whole that has nothing of the surface.
    #[error(
        "keep-whole: {region} has nothing of the surface; the model reaches from {} to {} mm: name another place or a larger radius, or a label that the model has",
        point(min_mm),
        point(max_mm)
    )]
    KeepWholeEmpty {
        /// The region in words.
        region: String,
        /// Lowest coordinates of the model.
        min_mm: [f64; 3],
        /// Highest coordinates of the model.
        max_mm: [f64; 3],
    },
    /// A region to keep whole that leaves too little to divide.
    #[error(
        "keep-whole: {region} is {:.0} % of the surface, but may be half of it at most: give a smaller radius, or a label of a smaller part",
        100.0 * share
    )]
    KeepWholeTooLarge {
        /// The region in words.
        region: String,
        /// Its share of the surface.
        share: f64,
    },
    /// A label to keep whole of a model without labels.
    #[error(
        "keep-whole names label {0}, but the model has no labels: give a place and a radius, X,Y,Z,R in mm"
    )]
    KeepWholeNoLabels(i64),
    /// More patches than triangles.
    #[error("{n_pieces} pieces are wanted of {n_faces} triangles: ask for fewer pieces")]
    TooManyPieces {
        /// Pieces wanted.
        n_pieces: usize,
        /// Triangles of the model.
        n_faces: usize,
    },
    /// The patch is smaller than the mesh can show, even unsmoothed.
    #[error(
        "patch {patch} of {area_mm2:.1} mm² vanishes when seams are smoothed: merge it with a neighbour or raise min_piece_mm2"
    )]
    PatchVanished {
        /// The patch.
        patch: PatchId,
        /// Its area.
        area_mm2: f64,
    },
    /// The smoothing matrix could not be factorised: coordinates far outside of any printer.
    #[error("seams cannot be smoothed: {0}; check the model's scale")]
    Solve(#[from] shellock_geom::sparse::SparseError),
}

/// A point in words.
fn point([x, y, z]: &[f64; 3]) -> String {
    format!("({x:.1}, {y:.1}, {z:.1})")
}
