//! Options of a job: choices of a person on how a model is made into a kit.
//!
//! [`Options`] has a typed field for each. [`DECLARED`] says for each its name, its help, and how a text
//! becomes its value; [`Choices`] are options by name as people give them.

mod choices;
mod keep_whole;
mod pieces;
mod table;
pub mod units;
mod values;

use std::path::PathBuf;

pub use choices::{Choice, Choices, Offer, apply_changes, offers, relabel};
pub use pieces::{Key, Pieces};
use shellock::connector::ConnectorParams;
use shellock::design::{self, KeySource, Params, WallChoice};
use shellock::segmentation::{KeepWhole, Method};
use shellock::sizes::{SizeChoice, SizeRange};
use shellock_mechanics::Material;
use shellock_print::Printer;
pub use table::{DECLARED, Declared, Kind, declaration};
use values::label;
pub use values::{Axis, InsideOutMeans, LabelsFrom, PaperSize, Thickness, Unit, Word, Words, material, word};

/// Function that sets an option to the value that a text says; fails with the reason if it says none.
pub type Take = fn(&mut Options, &str) -> Result<(), String>;

/// Choices of a person on how a model is made into a kit.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Name of the printer that the kit is made for.
    pub printer: String,
    /// Printers of the user's own.
    pub own_printers: Vec<Printer>,
    /// SHA-256 that the model's file must have, as recorded in a project.
    pub model_sha256: Option<String>,
    /// Longest side of the made thing, mm.
    pub size: Option<f64>,
    /// Height of the made thing along `up`, mm.
    pub height: Option<f64>,
    /// Millimetres a file unit.
    pub scale: Option<f64>,
    /// Unit of the file's lengths.
    pub unit: Option<Unit>,
    /// Axis of the file that points up.
    pub up: Axis,
    /// Object of the file that is made: its name, or "object 2" where it has none.
    pub object: Option<String>,
    /// Plate of a slicer's project that is made, by its number or its name.
    pub plate: Option<String>,
    /// True to refuse a surface that needs repair.
    pub no_repair: bool,
    /// True to make only the largest of several bodies.
    pub largest: bool,
    /// True to close the openings of a hollow model and to make the solid figure of it.
    pub fill: bool,
    /// Meaning of a body that is inside out and overlaps another.
    pub inside_out: InsideOutMeans,
    /// Detail to keep of a surface with very many triangles, mm; 0 keeps all.
    pub resolution: f64,
    /// File with one label a face of the model's file.
    pub labels: Option<PathBuf>,
    /// Data in the model's own file that divide it into pieces.
    pub labels_from: LabelsFrom,
    /// Way in which pieces are found where there are no labels.
    pub method: Method,
    /// Number of pieces to make where there are no labels.
    pub pieces: Pieces,
    /// True to divide both sides of a symmetric model alike.
    pub symmetric: bool,
    /// Regions that no seam is to divide.
    pub keep_whole: Vec<KeepWhole>,
    /// Source of the key, which goes in last.
    pub key: Key,
    /// Time for the whole job, s; 0 takes the time it takes.
    pub time: f64,
    /// Work for the whole job, s on an ordinary computer of two cores; > 0. It takes the place of `time`.
    pub effort: Option<f64>,
    /// Work spent on proving that no plan is better, in seconds of an ordinary computer.
    pub plan_time: f64,
    /// Thickness of the walls.
    pub thickness: Thickness,
    /// Kind of the walls, if their thickness is ours to choose.
    pub wall: WallChoice,
    /// Material that the kit is printed of; the printer's own if `None`.
    pub material: Option<Material>,
    /// Height of the fall that walls must bear, m.
    pub drop: f64,
    /// Size of the connectors.
    pub connector: SizeChoice,
    /// Gap between mating faces of connectors, mm; the printer's own if `None`.
    pub clearance: Option<f64>,
    /// Gap between mating faces of the key's rails, mm; the printer's own if `None`.
    pub key_clearance: Option<f64>,
    /// Height of a bump on each rail that the key clicks past, mm; 0 makes none.
    pub detent: f64,
    /// Depth by which ribs on a key without rails press on the pieces around it, mm; 0 makes none.
    pub key_ribs: f64,
    /// True to look for a proof of how far pieces move while all others but one move too.
    pub play_together: bool,
    /// True to make pieces though hardly anything of the model can be hollow.
    pub allow_thin: bool,
    /// True to cut a notch for a fingernail into the key.
    pub key_grip: bool,
    /// True to leave the pieces' numbers off their inner sides.
    pub no_labels: bool,
    /// Paper of the booklet.
    pub paper: PaperSize,
    /// True to leave out the booklet.
    pub no_booklet: bool,
    /// Depth by which each side of a seam stays back, mm; the printer's tolerance if `None`.
    pub seam_gap: Option<f64>,
    /// Thinnest wall that the printer makes, mm; the printer's own if `None`.
    pub min_wall: Option<f64>,
    /// Spacing of the grid behind the walls, mm; chosen by their thickness if `None`.
    pub grid: Option<f64>,
    /// Seed of all random choices.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        let params = Params::default();
        Self {
            printer: "sla".to_owned(),
            own_printers: Vec::new(),
            model_sha256: None,
            size: None,
            height: None,
            scale: None,
            unit: None,
            up: Axis::Z,
            object: None,
            plate: None,
            no_repair: false,
            largest: false,
            fill: false,
            inside_out: InsideOutMeans::Ask,
            resolution: 0.015,
            labels: None,
            labels_from: LabelsFrom::Auto,
            method: Method::default(),
            pieces: Pieces::Auto,
            symmetric: false,
            keep_whole: Vec::new(),
            key: Key::Auto,
            time: 60.0,
            effort: None,
            plan_time: 10.0,
            thickness: Thickness::Auto,
            wall: WallChoice::default(),
            material: None,
            drop: params.drop_m,
            connector: SizeChoice::Auto(SizeRange::default()),
            clearance: None,
            key_clearance: None,
            detent: 0.0,
            key_ribs: params.connector.key_rib_mm,
            play_together: false,
            allow_thin: false,
            key_grip: false,
            no_labels: false,
            paper: PaperSize::A4,
            no_booklet: false,
            seam_gap: None,
            min_wall: None,
            grid: None,
            seed: 0,
        }
    }
}

/// Work units of the exact search per second, measured on one core at 3 GHz, on models of 8 to 45 pieces.
///
/// Plans depend on work instead of time, so that every computer that is not far slower finds the same plan.
const REVISIONS_PER_SECOND: f64 = 20_000.0;

impl Options {
    /// Finds the named printer among the user's own and those that come with the program.
    pub fn chosen_printer(&self) -> Result<Printer, String> {
        crate::printers::find_printer(&self.printer, &self.own_printers)
    }

    /// Parameters of the library for pieces made on `printer`.
    pub fn params(&self, printer: &Printer) -> Params {
        let mut p = Params::default();
        p.seed = self.seed;
        p.method = self.method;
        p.n_pieces = self.pieces.number();
        p.keep_whole = self.keep_whole.clone();
        p.symmetric = self.symmetric;
        p.up = self.up.unit();
        p.key = match self.key {
            Key::Auto => KeySource::Cut,
            Key::Flattest => KeySource::Flattest,
            Key::Piece(id) => KeySource::Piece(id),
            Key::Near(place) => KeySource::CutNear(place),
        };
        p.has_grip = self.key_grip;
        p.thickness = match self.thickness {
            Thickness::Auto => design::Thickness::Auto,
            Thickness::Mm(mm) => design::Thickness::Mm(mm),
        };
        p.wall = self.wall;
        p.material = self.material.unwrap_or(printer.material);
        p.drop_m = self.drop;
        p.seam_gap_mm = self.seam_gap.unwrap_or(printer.tolerance_mm);
        p.line_overlap_mm = printer.line_overlap_mm();
        p.cell_mm = self.grid;
        p.connector = ConnectorParams {
            size: self.connector,
            clearance_mm: self.clearance.unwrap_or(printer.clearance_mm),
            key_clearance_mm: self.key_clearance.unwrap_or(printer.key_clearance_mm),
            detent_mm: self.detent,
            key_rib_mm: self.key_ribs,
            min_wall_mm: self.min_wall.unwrap_or(printer.min_wall_mm),
        };
        p.label = (!self.no_labels).then(|| label(p.connector.min_wall_mm));
        p.proof_budget = (self.plan_time * REVISIONS_PER_SECOND).clamp(0.0, 1e9) as usize;
        p.effort_s = self.effort;
        p.is_play_together = self.play_together;
        p.allows_thin = self.allow_thin;
        p
    }
}
