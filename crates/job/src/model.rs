//! A model as it was read, ready to be made.

use shellock::Warning;
use shellock_formats::Selection;
use shellock_geom::Solid;
use shellock_geom::repair::Repair;

/// A model that is ready to be made.
pub struct Model {
    /// Closed surface in assembly space, mm.
    pub solid: Solid,
    /// Labels, one for each triangle of `solid`; `None` if there are none.
    pub labels: Option<Vec<i64>>,
    /// For each triangle of `solid`, the face of the file it came from.
    pub file_face: Vec<u32>,
    /// Number of faces in the file.
    pub n_file_faces: usize,
    /// Transform from file to assembly coordinates, 4 × 4, row-major.
    pub transform: [f64; 16],
    /// Name of the file, without folders.
    pub name: String,
    /// SHA-256 of the file's bytes.
    pub sha256: String,
    /// Notes for people on how the file was read.
    pub notes: Vec<String>,
    /// Doubts about how the file was read.
    pub warnings: Vec<Warning>,
    /// Part of the file that was read.
    pub selection: Selection,
    /// Repairs that made one body of the file's surface.
    pub repairs: Vec<Repair>,
}
