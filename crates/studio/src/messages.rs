//! Answers to the page, in the form in which it reads them. Lengths are in mm, and models stand with z up.

use std::path::PathBuf;

use serde::Serialize;
use serde_json::Value;
use shellock::Severity;

use crate::jobs::Job;

/// State of the project and its jobs, from which the page begins.
#[derive(Debug, Serialize)]
pub struct Shown {
    /// State of the project.
    #[serde(flatten)]
    pub project: Project,
    /// Job that was added last.
    pub job: Option<Job>,
    /// All jobs, the oldest first.
    pub jobs: Vec<Job>,
}

/// State of the project.
#[derive(Debug, Serialize)]
pub struct Project {
    /// Name of the project's folder.
    pub name: Option<String>,
    /// Folder that holds all files written.
    pub folder: PathBuf,
    /// Counter that grows with every change.
    pub revision: u64,
    /// True while a model is being opened.
    pub is_opening: bool,
    /// Reason why the last model could not be opened.
    pub problem: Option<String>,
    /// The model that is open.
    pub model: Option<Model>,
    /// Pieces of the model.
    pub division: Option<Division>,
    /// Kit that was made last.
    pub kit: Option<MadeKit>,
    /// Names of figures that come with the program.
    pub figures: Vec<&'static str>,
    /// Version of the program.
    pub program: &'static str,
}

/// The model that is open.
#[derive(Debug, Serialize)]
pub struct Model {
    /// Name of its file.
    pub name: String,
    /// Number of triangles as it is made.
    pub n_triangles: usize,
    /// Size of its box, mm.
    pub size_mm: [f64; 3],
    /// Notes on how it was read.
    pub notes: Vec<String>,
    /// Warnings about its file and shape.
    pub warnings: Vec<String>,
    /// Share of its surface that is too thin to be hollow.
    pub thin_share: f64,
    /// Number of triangles that are shown.
    pub view_triangles: usize,
    /// True if all triangles of the file are shown.
    pub is_exact: bool,
}

/// Pieces of the model.
#[derive(Debug, Serialize)]
pub struct Division {
    /// Number of pieces of the kit.
    pub n_pieces: usize,
    /// Source of the pieces: `painted` or `automatic`.
    pub origin: &'static str,
    /// Name of the method that divides by itself.
    pub method: &'static str,
    /// Notes on the division.
    pub notes: Vec<String>,
}

/// Kit that was made last.
#[derive(Debug, Serialize)]
pub struct MadeKit {
    /// True if it passes every check.
    pub passed: bool,
    /// True if it is of the project's present state.
    pub is_current: bool,
    /// Result of `build` as it was printed.
    pub summary: Value,
    /// Files of the kit.
    pub files: Vec<KitFile>,
}

/// A file of a kit.
#[derive(Debug, Serialize)]
pub struct KitFile {
    /// Name within the kit's folder.
    pub name: String,
    /// Size of the file, bytes.
    pub bytes: u64,
}

/// New pieces of the model.
#[derive(Debug, Serialize)]
pub struct Divided {
    /// Revision of the project that has the pieces.
    pub revision: u64,
    /// Number of pieces of the kit.
    pub n_pieces: usize,
    /// Name of the method that divides by itself.
    pub method: &'static str,
    /// Notes on the division.
    pub notes: Vec<String>,
    /// True if painted pieces were changed, because a face of the file belongs to one piece only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub is_changed: Option<bool>,
}

/// Judgement of pieces before they are made.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Judgement {
    /// Revision of the project that was judged.
    pub revision: u64,
    /// True if the pieces lock.
    pub locks: bool,
    /// Judgement, in words for people.
    pub words: String,
    /// Number of pieces after mending.
    pub n_pieces: usize,
    /// Pieces in the order of installation.
    pub order: Vec<u32>,
    /// Direction in which each moves in.
    pub ways: Vec<[f64; 3]>,
    /// Pieces that are in the way of others.
    pub blockers: Vec<Blocker>,
    /// True if mending changes anything.
    pub is_mended: bool,
    /// Advice on the pieces.
    pub advice: Vec<Advice>,
    /// Pieces that are shown.
    pub pieces: Vec<ToldPiece>,
    /// Smooth lines between pieces, three coordinates a point.
    pub seams: Vec<Vec<f64>>,
    /// Places for a key.
    pub keys: Vec<Key>,
}

/// A piece that is in the way of another.
#[derive(Clone, Debug, Serialize)]
pub struct Blocker {
    /// Number of the piece that cannot move in, from 1.
    pub piece: u32,
    /// Number of the piece in its way.
    pub by: u32,
    /// Sentence that compares the two.
    pub words: String,
    /// Place of the obstacle.
    pub at: [f64; 3],
}

/// Advice on the painted pieces.
#[derive(Clone, Debug, Serialize)]
pub struct Advice {
    /// Weight of the advice.
    pub severity: Severity,
    /// Advice, in words for people.
    pub words: String,
    /// Place that it is about.
    pub at: Option<[f64; 3]>,
    /// True if mending follows it.
    pub mends: bool,
}

/// A piece that is shown.
#[derive(Clone, Debug, Serialize)]
pub struct ToldPiece {
    /// Label of the piece, from 0.
    pub piece: u32,
    /// Area of the piece, mm².
    pub area_mm2: f64,
    /// True if it fits the printer.
    pub fits_bed: bool,
    /// Number of pieces that it touches.
    pub n_neighbours: usize,
    /// Place in its middle.
    pub at: [f64; 3],
}

/// A place for a key.
#[derive(Clone, Debug, Serialize)]
pub struct Key {
    /// Middle of the key.
    pub at: [f64; 3],
    /// Direction in which it slides out.
    pub slide: [f64; 3],
    /// Direction out of the surface.
    pub normal: [f64; 3],
    /// Corners of its outline.
    pub outline: [[f64; 3]; 4],
    /// Area of the key, mm².
    pub area_mm2: f64,
    /// Worth of the place.
    pub score: f64,
    /// Place, in words for people.
    pub words: String,
    /// True for the key of the plan.
    pub is_chosen: bool,
}
