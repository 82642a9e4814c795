//! Reasons why a surface cannot be divided, as messages for people.

use shellock_report::{Cancelled, PatchId};

/// Error of the division of a surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SegmentationError {
    /// Stopped by the user.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Number of labels differs from the number of triangles.
    #[error(
        "there are {n_labels} labels for {n_faces} triangles: give one label for each triangle, in the \
         order of the model file"
    )]
    LabelCount {
        /// Number of labels given.
        n_labels: usize,
        /// Number of triangles of the model.
        n_faces: usize,
    },
    /// Only one label, so there is nothing to take apart.
    #[error(
        "all {n_faces} triangles have the label {label}: give at least two labels, or none for automatic \
         patches"
    )]
    OneLabel {
        /// Label of all triangles.
        label: i64,
        /// Number of triangles of the model.
        n_faces: usize,
    },
    /// Labels that number triangles rather than patches.
    #[error(
        "{n_faces} triangles have {n_labels} different labels: give patches of at least 3 triangles on \
         average, at most 1000"
    )]
    TooManyLabels {
        /// Number of different labels.
        n_labels: usize,
        /// Number of triangles of the model.
        n_faces: usize,
    },
    /// Fewer than two patches were left after merging small ones.
    #[error(
        "after merging patches below {min_piece_mm2} mm² only one is left: lower min_piece_mm2 or scale the \
         model up"
    )]
    AllTooSmall {
        /// Smallest area of a patch, mm².
        min_piece_mm2: f64,
    },
    /// A region to keep whole without any surface in it.
    #[error(
        "keep-whole: {region} has nothing of the surface; the model reaches from {} to {} mm: name another \
         place or a larger radius, or a label that the model has",
        point(min_mm),
        point(max_mm)
    )]
    KeepWholeEmpty {
        /// Description of the region.
        region: String,
        /// Lowest coordinates of the model.
        min_mm: [f64; 3],
        /// Highest coordinates of the model.
        max_mm: [f64; 3],
    },
    /// A region to keep whole that leaves too little to divide.
    #[error(
        "keep-whole: {region} is {:.0} % of the surface, but may be half of it at most: \
         give a smaller radius, or a label of a smaller part",
        100.0 * share
    )]
    KeepWholeTooLarge {
        /// Description of the region.
        region: String,
        /// Share of the surface in the region.
        share: f64,
    },
    /// A label to keep whole in a model without labels.
    #[error(
        "keep-whole names label {0}, but the model has no labels: give a place and a radius, X,Y,Z,R in mm"
    )]
    KeepWholeNoLabels(i64),
    /// More patches wanted than triangles.
    #[error("{n_pieces} pieces are wanted of {n_faces} triangles: ask for fewer pieces")]
    TooManyPieces {
        /// Number of pieces wanted.
        n_pieces: usize,
        /// Number of triangles of the model.
        n_faces: usize,
    },
    /// A patch smaller than the mesh can represent, even unsmoothed.
    #[error(
        "patch {patch} of {area_mm2:.1} mm² vanishes when seams are smoothed: merge it with a neighbour or \
         raise min_piece_mm2"
    )]
    PatchVanished {
        /// Patch that would vanish.
        patch: PatchId,
        /// Area of the patch, mm².
        area_mm2: f64,
    },
    /// The smoothing matrix could not be factorised: coordinates far beyond the size of any printer.
    #[error("seams cannot be smoothed: {0}; check the model's scale")]
    Solve(#[from] shellock_geom::sparse::SparseError),
}

/// Formats a point for messages.
fn point([x, y, z]: &[f64; 3]) -> String {
    format!("({x:.1}, {y:.1}, {z:.1})")
}
