//! Command-line options that say how a model is made into a kit.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use shellock::connector::ConnectorParams;
use shellock::design::{self, KeySource, Params};
use shellock::segmentation::{KeepWhole, Method};
use shellock::sizes::SizeChoice;
use shellock_mechanics::Material;
use shellock_print::Printer;

use super::keep_whole::keep_whole;
use super::pieces::{Key, Pieces, Symmetric};
use super::{
    Axis, InsideOutMeans, LabelsFrom, PaperSize, Thickness, Unit, connector_size, label, printer_called,
};
use crate::{stress, units};

#[derive(Args)]
pub struct Options {
    /// sla, fdm, fdm-petg, sls, or a printer of your own
    ///
    /// Printer that the kit is made for: sla, fdm, fdm-petg, sls, or a printer of the configuration file;
    /// its clearances, walls and material are used where nothing else is said
    #[arg(long, value_name = "NAME", default_value = "sla", help_heading = "Printer")]
    pub printer: String,
    /// Options and printers, in TOML
    ///
    /// Options and printers, in TOML; what is said on the command line goes before it [default:
    /// shellock.toml, if there is one here]
    #[arg(long, value_name = "FILE", help_heading = "Printer")]
    pub config: Option<PathBuf>,
    /// The printers of the configuration file.
    #[arg(skip)]
    pub own_printers: Vec<Printer>,
    /// SHA-256 that the model's file must have, as recorded in a project.
    #[arg(skip)]
    pub model_sha256: Option<String>,
    /// Longest side of the made thing
    ///
    /// Longest side of the made thing, mm [default: the file's own size if that is 20 to 1000, else 150]
    #[arg(value_parser = units::length_mm,
        long,
        value_name = "MM",
        allow_hyphen_values = true,
        help_heading = "Size",
        conflicts_with_all = ["height", "scale"]
    )]
    pub size: Option<f64>,
    /// Height of the made thing along --up
    ///
    /// Height of the made thing along --up, mm
    #[arg(value_parser = units::length_mm,
        long,
        value_name = "MM",
        allow_hyphen_values = true,
        help_heading = "Size",
        conflicts_with = "scale"
    )]
    pub height: Option<f64>,
    /// Millimetres a file unit
    ///
    /// Millimetres a file unit
    #[arg(
        hide_short_help = true,
        long,
        value_name = "F",
        allow_hyphen_values = true,
        help_heading = "Size"
    )]
    pub scale: Option<f64>,
    /// Unit of the file: micron, mm, cm, inch, foot or m
    ///
    /// Unit of the file's lengths [default: the file's own, as 3MF has one, else mm where that gives a
    /// sensible size]
    #[arg(
        hide_possible_values = true,
        long,
        value_enum,
        help_heading = "Size",
        conflicts_with_all = ["size", "height", "scale"]
    )]
    pub unit: Option<Unit>,
    /// Axis of the file that points up: x, y or z
    ///
    /// Which axis of the file points up
    #[arg(
        hide_possible_values = true,
        long,
        value_enum,
        default_value = "z",
        help_heading = "Size"
    )]
    pub up: Axis,
    /// Make one object of the file, by its name
    ///
    /// Which object of the file is made, where it has several: its name, or "object 2" where it has none
    #[arg(long, value_name = "NAME", help_heading = "Surface")]
    pub object: Option<String>,
    /// Make one plate of a slicer's project
    ///
    /// Which plate of a slicer's project is made, by its number or its name
    #[arg(hide_short_help = true, long, value_name = "N|NAME", help_heading = "Surface")]
    pub plate: Option<String>,
    /// Refuse a surface that needs repair
    ///
    /// Refuse a surface that needs repair instead of mending it
    #[arg(
        hide_short_help = true,
        long,
        help_heading = "Surface",
        conflicts_with = "largest"
    )]
    pub no_repair: bool,
    /// Make only the largest of several bodies
    ///
    /// Make only the largest of several bodies that lie apart from each other
    #[arg(long, help_heading = "Surface")]
    pub largest: bool,
    /// Close a hollow model's openings: it is made solid
    ///
    /// Close the openings of a model that is hollow already, as slicers for resin make it, and make the solid
    /// figure of it
    #[arg(hide_short_help = true, long, help_heading = "Surface")]
    pub fill: bool,
    /// A body inside out that overlaps another: ask, cut or unite
    ///
    /// Meaning of a body that is inside out and overlaps another: ask, the model is refused and the body's
    /// place is named; cut, it is a hole; unite, it is a part
    #[arg(
        hide_short_help = true,
        hide_possible_values = true,
        long,
        value_enum,
        default_value = "ask",
        value_name = "ask|cut|unite",
        help_heading = "Surface"
    )]
    pub inside_out: InsideOutMeans,
    /// Detail to keep of a surface of very many triangles
    ///
    /// Detail to keep of a surface with more than 100 000 triangles, mm, 0 to 0.1: it is described by
    /// fewer, none farther from it than this; 0 keeps all, as `segment` does
    #[arg(hide_short_help = true, value_parser = units::length_mm,
        long,
        value_name = "MM",
        default_value_t = 0.015,
        allow_hyphen_values = true,
        help_heading = "Surface"
    )]
    pub resolution: f64,
    /// One label a face: a .seg or .ply file
    ///
    /// One label a face: a .seg file (one integer a line) or a .ply with a face property; a label is a
    /// piece
    #[arg(long, value_name = "FILE", help_heading = "Pieces")]
    pub labels: Option<PathBuf>,
    /// Source of the division: labels, paint, colors …
    ///
    /// Data in the model's own file that divide it into pieces
    #[arg(
        hide_possible_values = true,
        long,
        value_enum,
        default_value = "auto",
        value_name = "WHAT",
        help_heading = "Pieces",
        conflicts_with = "labels"
    )]
    pub labels_from: LabelsFrom,
    /// auto, creases, random-cuts, sdf, primitives or kmeans
    ///
    /// How pieces are found where there are no labels: creases, of similar size with seams in creases;
    /// auto, where people would divide, by the best cuts of the others; random-cuts, the cuts that most of
    /// many agree on; sdf, by thickness; primitives, by what planes, spheres and cylinders fit; kmeans, by
    /// distance and turning
    #[arg(hide_possible_values = true,
        long,
        value_name = "METHOD",
        default_value = Method::default().name(),
        value_parser = PossibleValuesParser::new(Method::ALL.map(Method::name))
            .map(|name| Method::named(&name).expect("it is one of all")),
        help_heading = "Pieces"
    )]
    pub method: Method,
    /// About how many pieces to make
    ///
    /// About how many pieces to make where there are no labels: auto, what the method finds, about 10 for a
    /// 150 mm figure; a number; or fits-bed, as few as fit the printer
    #[arg(
        long,
        value_name = "auto|N|fits-bed",
        default_value = "auto",
        help_heading = "Pieces"
    )]
    pub pieces: Pieces,
    /// Divide both sides of a symmetric model alike
    ///
    /// Whether both sides of a symmetric model are divided alike, where the method is auto or random-cuts
    #[arg(
        hide_possible_values = true,
        long,
        value_enum,
        default_value = "off",
        value_name = "on|off",
        help_heading = "Pieces"
    )]
    pub symmetric: Symmetric,
    /// A region that no seam divides, such as a face
    ///
    /// A region that no seam is to divide, such as a face: the surface within R mm of a place in the made
    /// thing's space, or what has a label, where there are labels; may be given several times
    #[arg(
        long,
        value_name = "X,Y,Z,R|LABEL",
        value_parser = keep_whole,
        allow_hyphen_values = true,
        help_heading = "Pieces"
    )]
    pub keep_whole: Vec<KeepWhole>,
    /// Goes in last: cut, the flattest piece, or piece N
    ///
    /// What goes in last and can be taken out again: auto, a key on rails that is cut where it slides best;
    /// X,Y,Z, the same near that place in the made thing's space; piece, the flattest piece that works, as it
    /// is; or a piece, by its label or by the number that `segment` gives it
    #[arg(
        long,
        value_name = "auto|piece|N|X,Y,Z",
        allow_hyphen_values = true,
        default_value = "auto",
        help_heading = "Pieces"
    )]
    pub key: Key,
    /// For the whole job; 0: as long as it takes
    ///
    /// Seconds for the whole job: no further kit is begun that would end later, and the best so far is
    /// finished; 0 takes the time it takes
    #[arg(value_parser = units::seconds,
        long,
        value_name = "SECONDS",
        allow_hyphen_values = true,
        default_value_t = 60.0,
        help_heading = "Pieces"
    )]
    pub time: f64,
    /// Work spent on proving that no plan is better
    ///
    /// Work spent on proving that no plan is better, in seconds of an ordinary computer; a slower one ends
    /// after twice that
    #[arg(hide_short_help = true, value_parser = units::seconds,
        long,
        value_name = "SECONDS",
        allow_hyphen_values = true,
        default_value_t = 10.0,
        help_heading = "Pieces"
    )]
    pub plan_time: f64,
    /// Wall, 0.8 to 10 mm
    ///
    /// Wall thickness, mm, 0.8 to 10, or auto: the least from 1.6 (or four times --min-wall, if that is
    /// more) to 3 mm that bears a fall
    #[arg(
        long,
        value_name = "auto|MM",
        allow_hyphen_values = true,
        default_value = "auto",
        help_heading = "Make"
    )]
    pub thickness: Thickness,
    /// sla-resin, pla, petg or pa12 [default: printer's]
    ///
    /// What it is printed of: what it bears decides how thick walls must be [default: the printer's]
    #[arg(long, value_name = "NAME", value_parser = stress::material, help_heading = "Make")]
    pub material: Option<Material>,
    /// Fall that walls must bear
    ///
    /// Height of the fall that walls must bear, 0.01 to 20 m
    #[arg(long, value_name = "HEIGHT", default_value_t = Params::default().drop_m, allow_hyphen_values = true,
          value_parser = units::metres, help_heading = "Make")]
    pub drop: f64,
    /// Size of connectors, 1.5 to 6 mm
    ///
    /// Connector size: 1.5 to 6 mm for all seams, or "auto": 2 to 4 mm, by the stress at each seam and by
    /// what fits
    #[arg(
        value_parser = connector_size,
        long,
        value_name = "auto|MM",
        allow_hyphen_values = true,
        default_value = "auto",
        help_heading = "Make"
    )]
    pub connector: SizeChoice,
    /// Gap of connectors, mm [default: printer's]
    ///
    /// Gap between mating faces of connectors, mm, 0.03 to 0.6: 0.05 to 0.15 for resin, 0.15 to 0.3 for
    /// filament [default: the printer's]
    #[arg(value_parser = units::length_mm,
        long,
        value_name = "MM",
        allow_hyphen_values = true,
        help_heading = "Make"
    )]
    pub clearance: Option<f64>,
    /// Gap on the key's rails, mm [default: printer's]
    ///
    /// Gap between mating faces of the key's rails, mm, 0.03 to 0.8 [default: the printer's]
    #[arg(hide_short_help = true, value_parser = units::length_mm,
        long,
        value_name = "MM",
        allow_hyphen_values = true,
        help_heading = "Make"
    )]
    pub key_clearance: Option<f64>,
    /// Bump that the key clicks past, 0 to 0.4 mm
    ///
    /// Height of a bump on each rail that the key clicks past, mm, 0 to 0.4; 0 makes none
    #[arg(hide_short_help = true, value_parser = units::length_mm,
        long,
        value_name = "MM",
        allow_hyphen_values = true,
        default_value_t = 0.0,
        help_heading = "Make"
    )]
    pub detent: f64,
    /// How far ribs press on a key without rails, mm
    ///
    /// How far ribs on a key without rails press on the pieces around it, mm, 0 to 0.3; 0 makes none
    #[arg(hide_short_help = true, value_parser = units::length_mm,
        long,
        value_name = "MM",
        allow_hyphen_values = true,
        default_value_t = Params::default().connector.key_rib_mm,
        help_heading = "Make"
    )]
    pub key_ribs: f64,
    /// Also prove how far pieces move all together
    ///
    /// Also look for a proof of how far pieces move within the gaps while all others but one move too;
    /// closes for small kits only, and takes some seconds to a minute
    #[arg(hide_short_help = true, long, help_heading = "Make")]
    pub play_together: bool,
    /// Make pieces though hardly anything can be hollow
    ///
    /// Make pieces though hardly anything of the model can be hollow; they are mostly solid, with few
    /// connectors
    #[arg(long, help_heading = "Make")]
    pub allow_thin: bool,
    /// Cut a notch for a fingernail into the key
    ///
    /// Cut a notch for a fingernail into the key, 0.45 mm deep
    #[arg(long, help_heading = "Make")]
    pub key_grip: bool,
    /// Leave the numbers off the pieces' inner sides
    ///
    /// Leave the pieces' numbers off their inner sides
    #[arg(long, help_heading = "Make")]
    pub no_labels: bool,
    /// Paper of the booklet
    #[arg(
        long,
        value_enum,
        default_value = "a4",
        value_name = "a4|letter",
        hide_possible_values = true,
        help_heading = "Make"
    )]
    pub paper: PaperSize,
    /// Leave out instructions.pdf
    ///
    /// Leave out instructions.pdf, which takes about a second
    #[arg(long, help_heading = "Make")]
    pub no_booklet: bool,
    /// How far each side of a seam stays back, mm
    ///
    /// How far each side of a seam stays back, mm, 0 to 0.4; less for those who sand [default: the
    /// printer's tolerance]
    #[arg(hide_short_help = true, value_parser = units::length_mm,
        long,
        alias = "wall-gap",
        value_name = "MM",
        allow_hyphen_values = true,
        help_heading = "Make"
    )]
    pub seam_gap: Option<f64>,
    /// Thinnest wall that the printer makes, mm
    ///
    /// Thinnest wall that the printer makes, mm, 0.1 to 2; thinner parts are reported [default: the
    /// printer's]
    #[arg(hide_short_help = true, value_parser = units::length_mm,
        long,
        value_name = "MM",
        allow_hyphen_values = true,
        help_heading = "Make"
    )]
    pub min_wall: Option<f64>,
    /// Spacing of the grid behind the walls, mm
    ///
    /// Spacing of the grid behind the walls, mm [default: thickness / 2.5]
    #[arg(hide_short_help = true, value_parser = units::length_mm,
        long,
        value_name = "MM",
        allow_hyphen_values = true,
        help_heading = "Make"
    )]
    pub grid: Option<f64>,
    /// Seed of all random choices
    ///
    /// Seed of all random choices: the same seed gives the same kit
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Make")]
    pub seed: u64,
}

/// Work units of the exact search per second, measured on one core at 3 GHz, on models of 8 to 45 pieces.
///
/// Plans depend on work instead of time, so that every computer that is not far slower finds the same plan.
const REVISIONS_PER_SECOND: f64 = 20_000.0;

impl Options {
    /// Finds the named printer among the user's own and those that come with the program.
    pub fn chosen_printer(&self) -> Result<Printer, String> {
        printer_called(&self.printer, &self.own_printers)
    }

    /// Parameters of the library for pieces made on `printer`.
    pub fn params(&self, printer: &Printer) -> Params {
        let mut p = Params::default();
        p.seed = self.seed;
        p.method = self.method;
        p.n_pieces = self.pieces.number();
        p.keep_whole = self.keep_whole.clone();
        p.symmetric = self.symmetric == Symmetric::On;
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
        p.material = self.material.unwrap_or(printer.material);
        p.drop_m = self.drop;
        p.seam_gap_mm = self.seam_gap.unwrap_or(printer.tolerance_mm);
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
        p.is_play_together = self.play_together;
        p.allows_thin = self.allow_thin;
        p
    }
}
