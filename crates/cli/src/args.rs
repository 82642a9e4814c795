//! What can be said on the command line.

mod blows;
mod keep_whole;
mod pieces;

use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use shellock::connector::ConnectorParams;
use shellock::coupon::N_FITS;
use shellock::design::{self, KeySource, Params};
use shellock::piece::LabelParams;
use shellock::segmentation::{KeepWhole, Method};
use shellock::sizes::SizeChoice;
use shellock_mechanics::Material;
use shellock_print::Printer;

pub use blows::{Blows, Place};
pub use pieces::{Key, Pieces, Symmetric};

use crate::stress;
use keep_whole::keep_whole;

/// Exit codes, shown in the help.
const EXIT_CODES: &str = "Exit codes: 0 made and verified, or it holds · 1 made, but a check or test failed · 2 the input or an argument is wrong · \
3 no plan could be found · 4 a file could not be written · 130 stopped with Ctrl-C (nothing is left behind)";

/// Turns a closed 3D model into hollow pieces that lock each other without glue.
#[derive(Parser)]
#[command(name = "shellock", version, about, after_help = EXIT_CODES)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
    /// Print one JSON object on standard output instead of text, and progress as JSON lines on standard error
    #[arg(long, global = true)]
    pub json: bool,
    /// Show no progress; a kit that is made says nothing but what is wrong with it
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Tell all: every check, note and figure of the plan
    #[arg(long, short, global = true, conflicts_with = "quiet")]
    pub verbose: bool,
    /// Threads to use; the result does not depend on it [default: all]
    #[arg(long, global = true, value_name = "N")]
    pub threads: Option<usize>,
}

#[derive(Subcommand)]
pub enum Command {
    /// Make the whole kit of a model: pieces, plan, 3MF, viewer page
    Build {
        /// 3MF, STL, OBJ, PLY, OFF, glTF or GLB file of a closed surface
        model: PathBuf,
        #[command(flatten)]
        options: Options,
        #[command(flatten)]
        out: Out,
    },
    /// Make the kit of a figure that comes with the program
    Demo {
        /// Which figure: squirrel, cat, teddy, octopus, dinosaur, vase, torus, fish or arms
        #[arg(long, default_value = "squirrel", value_name = "NAME")]
        figure: String,
        #[command(flatten)]
        options: Options,
        #[command(flatten)]
        out: Out,
    },
    /// Only divide the surface; write it with one label a triangle (.ply), painted for slicers (.3mf), or the
    /// labels of the model's faces (.seg)
    Segment {
        /// 3MF, STL, OBJ, PLY, OFF, glTF or GLB file of a closed surface
        model: PathBuf,
        #[command(flatten)]
        options: Options,
        /// Where to write: a .ply, .3mf or .seg file
        #[arg(short, long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Only divide and plan: print the order and the directions
    Plan {
        /// 3MF, STL, OBJ, PLY, OFF, glTF or GLB file of a closed surface, such as one that `segment` wrote
        model: PathBuf,
        #[command(flatten)]
        options: Options,
    },
    /// Check a finished kit again from its files, or an assembly of your own
    Verify {
        /// Folder of the kit; or of closed meshes in assembled position, mm, with an assembly.json such as
        /// {"clearance": 0.1, "pieces": [{"file": "base.stl"}, {"file": "lid.stl", "pulled_out_along": [0, 0,
        /// 1]}]}, first to last as they are put together
        kit: PathBuf,
        /// The model it was made from [default: the file named in its plan.json]
        model: Option<PathBuf>,
    },
    /// Punch a finished kit and let it fall, in simulation; compare it with half connectors and with a plan
    /// of half the score
    Test {
        /// Folder of the kit; stress.json and stress.svg go there. Exit code 0: it holds, 1: it does not
        kit: PathBuf,
        #[command(flatten)]
        blows: Blows,
    },
    /// Say what a finished kit saves over the solid model: material, and print time by PrusaSlicer where it
    /// is installed (that takes minutes)
    Report {
        /// Folder of the kit; savings.json goes there
        kit: PathBuf,
        /// The model it was made from [default: the file named in its plan.json]
        model: Option<PathBuf>,
        /// Use closed forms for the print time even where PrusaSlicer is installed
        #[arg(long)]
        closed_form: bool,
    },
    /// Make a small plate of pins, channels, keys and rails at five clearances, to find those that fit on your
    /// printer; then keep them as a printer of your own
    Coupon(CouponOptions),
    /// Print what a shell needs to complete commands and options, for example `shellock completions bash`
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Write manual pages, one a command
    Manual {
        /// Folder for them
        folder: PathBuf,
    },
    /// Say what a file holds and whether it can be made
    Inspect {
        /// 3MF, STL, OBJ, PLY, OFF, glTF or GLB file
        model: PathBuf,
        #[command(flatten)]
        options: Options,
        /// Also divide the surface, by its labels or else by --method, and say where the seams run, who sees them
        /// and how pieces hold each other
        #[arg(long, help_heading = "Pieces")]
        segment: bool,
    },
    /// Write one of the figures that come with the program
    Figure {
        /// Which: squirrel, cat, teddy, octopus, dinosaur, vase, torus, fish or arms
        name: String,
        /// Where to write: a .stl or .ply file
        #[arg(short, long, value_name = "FILE")]
        out: PathBuf,
        /// Longest side, mm
        #[arg(long, default_value_t = 150.0, value_name = "MM")]
        size: f64,
        /// Also write the limb of each triangle there, for `build --labels` (fish and arms)
        #[arg(long, value_name = "FILE")]
        labels: Option<PathBuf>,
    },
}

/// Where a kit goes.
#[derive(Args)]
pub struct Out {
    /// Folder to write [default: the model's name with "-kit", or "shellock-demo"]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace the folder if it holds an earlier kit
    #[arg(short, long)]
    pub force: bool,
}

/// Which fit test is made, or what came of it.
#[derive(Args)]
pub struct CouponOptions {
    /// The printer whose clearances are the middle ones: sla, fdm, fdm-petg, sls, or one of the configuration
    /// file
    #[arg(long, value_name = "NAME", default_value = "sla")]
    pub printer: String,
    /// Options and printers, in TOML; --save writes there [default: shellock.toml]
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// The printers of the configuration file.
    #[arg(skip)]
    pub own_printers: Vec<Printer>,
    /// A .3mf file, and a .stl file beside it; or a folder for both [default: shellock-coupon.3mf]
    #[arg(short, long, value_name = "FILE", conflicts_with = "fits")]
    pub out: Option<PathBuf>,
    /// Replace files of an earlier fit test
    #[arg(short, long, conflicts_with = "fits")]
    pub force: bool,
    /// The number whose parts fit; --printer is the one that the plate was made for
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=N_FITS as i64), requires = "save")]
    pub fits: Option<u32>,
    /// Keep the clearances of that number in the configuration file, as a printer of this name
    #[arg(long, value_name = "NAME", requires = "fits")]
    pub save: Option<String>,
}

impl CouponOptions {
    /// The printer that is named: of the user's own, or of those that come with the program.
    pub fn chosen_printer(&self) -> Result<Printer, String> {
        printer_called(&self.printer, &self.own_printers)
    }
}

/// An axis of the file.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    /// Its index.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The one along a direction, if there is one.
    pub fn of(along: [f64; 3]) -> Option<Self> {
        [Self::X, Self::Y, Self::Z]
            .into_iter()
            .find(|a| a.unit() == along)
    }

    /// Along it.
    pub fn unit(self) -> [f64; 3] {
        std::array::from_fn(|axis| f64::from(u8::from(axis == self.index())))
    }
}

/// A unit of length.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Unit {
    Micron,
    Mm,
    Cm,
    Inch,
    Foot,
    M,
}

impl Unit {
    /// Its length, mm.
    pub fn mm(self) -> f64 {
        match self {
            Self::Micron => 1e-3,
            Self::Mm => 1.0,
            Self::Cm => 10.0,
            Self::Inch => 25.4,
            Self::Foot => 304.8,
            Self::M => 1000.0,
        }
    }
}

/// What of a file is taken for labels.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LabelsFrom {
    /// Labels of faces, or paint of a slicer
    Auto,
    /// A property of the faces (PLY)
    Labels,
    /// Multi-material paint of a slicer (3MF)
    Paint,
    /// Colours of faces (STL, PLY, OFF, 3MF)
    Colors,
    /// Materials (OBJ, 3MF, glTF)
    Materials,
    /// Groups (OBJ)
    Groups,
    /// Objects, solids or nodes
    Objects,
    /// Nothing: pieces are found automatically
    None,
}

/// Where the wall's thickness comes from.
#[derive(Clone, Copy, PartialEq)]
pub enum Thickness {
    Auto,
    Mm(f64),
}

impl FromStr for Thickness {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.eq_ignore_ascii_case("auto") {
            return Ok(Self::Auto);
        }
        text.parse()
            .map(Self::Mm)
            .map_err(|_| "give millimetres, such as 2.4, or auto".to_owned())
    }
}

#[derive(Args)]
pub struct Options {
    /// What it is printed on: sla, fdm, fdm-petg, sls, or a printer of the configuration file; its
    /// clearances, walls and material are used where nothing else is said
    #[arg(long, value_name = "NAME", default_value = "sla", help_heading = "Printer")]
    pub printer: String,
    /// Options and printers, in TOML; what is said on the command line goes before it [default:
    /// shellock.toml, if there is one here]
    #[arg(long, value_name = "FILE", help_heading = "Printer")]
    pub config: Option<PathBuf>,
    /// The printers of the configuration file.
    #[arg(skip)]
    pub own_printers: Vec<Printer>,
    /// Longest side of the made thing, mm [default: the file's own size if that is 20 to 1000, else 150]
    #[arg(long, value_name = "MM", allow_hyphen_values = true, help_heading = "Size", conflicts_with_all = ["height", "scale"])]
    pub size: Option<f64>,
    /// Height of the made thing along --up, mm
    #[arg(
        long,
        value_name = "MM",
        allow_hyphen_values = true,
        help_heading = "Size",
        conflicts_with = "scale"
    )]
    pub height: Option<f64>,
    /// Millimetres a file unit
    #[arg(long, value_name = "F", allow_hyphen_values = true, help_heading = "Size")]
    pub scale: Option<f64>,
    /// Unit of the file's lengths [default: the file's own, as 3MF has one, else mm where that gives a
    /// sensible size]
    #[arg(long, value_enum, help_heading = "Size", conflicts_with_all = ["size", "height", "scale"])]
    pub unit: Option<Unit>,
    /// Which axis of the file points up
    #[arg(long, value_enum, default_value = "z", help_heading = "Size")]
    pub up: Axis,
    /// Refuse a surface that needs repair instead of mending it
    #[arg(long, help_heading = "Surface", conflicts_with = "largest")]
    pub no_repair: bool,
    /// Of several bodies apart from each other make the largest
    #[arg(long, help_heading = "Surface")]
    pub largest: bool,
    /// Detail to keep of a surface with more than 100 000 triangles, mm, 0 to 0.1: it is described by fewer,
    /// none farther from it than this; 0 keeps all, as `segment` does
    #[arg(
        long,
        value_name = "MM",
        default_value_t = 0.015,
        allow_hyphen_values = true,
        help_heading = "Surface"
    )]
    pub resolution: f64,
    /// One label a face: a .seg file (one integer a line) or a .ply with a face property; a label is a piece
    #[arg(long, value_name = "FILE", help_heading = "Pieces")]
    pub labels: Option<PathBuf>,
    /// What of the model's own file divides it into pieces
    #[arg(
        long,
        value_enum,
        default_value = "auto",
        value_name = "WHAT",
        help_heading = "Pieces",
        conflicts_with = "labels"
    )]
    pub labels_from: LabelsFrom,
    /// How pieces are found where there are no labels: creases, of similar size with seams in creases; auto,
    /// where people would divide, by the best cuts of the others; random-cuts, the cuts that most of many
    /// agree on; sdf, by thickness; primitives, by what planes, spheres and cylinders fit; kmeans, by
    /// distance and turning
    #[arg(
        long,
        value_name = "METHOD",
        default_value = Method::default().name(),
        value_parser = PossibleValuesParser::new(Method::ALL.map(Method::name)).map(|name| Method::named(&name).expect("it is one of all")),
        help_heading = "Pieces"
    )]
    pub method: Method,
    /// About how many pieces to make where there are no labels: auto, what the method finds, about 10 for a 150 mm
    /// figure; a number; or fits-bed, as few as fit the printer
    #[arg(
        long,
        value_name = "auto|N|fits-bed",
        default_value = "auto",
        help_heading = "Pieces"
    )]
    pub pieces: Pieces,
    /// Whether both sides of a symmetric model are divided alike, where the method is auto or random-cuts
    #[arg(
        long,
        value_enum,
        default_value = "off",
        value_name = "on|off",
        help_heading = "Pieces"
    )]
    pub symmetric: Symmetric,
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
    /// What goes in last and can be taken out again: auto, a key on rails that is cut where it slides best;
    /// piece, the flattest piece that works, as it is; or a piece, by its label or by the number that
    /// `segment` gives it
    #[arg(
        long,
        value_name = "auto|piece|N",
        default_value = "auto",
        help_heading = "Pieces"
    )]
    pub key: Key,
    /// Seconds for the whole job: no further kit is begun that would end later, and the best so far is finished; 0
    /// takes the time it takes
    #[arg(
        long,
        value_name = "SECONDS",
        allow_hyphen_values = true,
        default_value_t = 60.0,
        help_heading = "Pieces"
    )]
    pub time: f64,
    /// Work spent on proving that no plan is better, in seconds of an ordinary computer; a slower one ends
    /// after twice that
    #[arg(
        long,
        value_name = "SECONDS",
        allow_hyphen_values = true,
        default_value_t = 10.0,
        help_heading = "Pieces"
    )]
    pub plan_time: f64,
    /// Wall thickness, mm, 0.8 to 10, or auto: the least from 1.6 (or four times --min-wall, if that is more)
    /// to 3 mm that bears a fall
    #[arg(
        long,
        value_name = "auto|MM",
        allow_hyphen_values = true,
        default_value = "auto",
        help_heading = "Make"
    )]
    pub thickness: Thickness,
    /// What it is printed of: what it bears decides how thick walls must be [default: the printer's]
    #[arg(long, value_name = "NAME", value_parser = stress::material, help_heading = "Make")]
    pub material: Option<Material>,
    /// Height of the fall that walls must bear, 0.01 to 20 m
    #[arg(long, value_name = "HEIGHT", default_value_t = Params::default().drop_m, allow_hyphen_values = true,
          value_parser = stress::metres, help_heading = "Make")]
    pub drop: f64,
    /// Connector size: 1.5 to 6 mm for all seams, or "auto": 2 to 4 mm, by the stress at each seam and by
    /// what fits
    #[arg(
        long,
        value_name = "auto|MM",
        allow_hyphen_values = true,
        default_value = "auto",
        help_heading = "Make"
    )]
    pub connector: SizeChoice,
    /// Gap between mating faces of connectors, mm, 0.03 to 0.6: 0.05 to 0.15 for resin, 0.15 to 0.3 for
    /// filament [default: the printer's]
    #[arg(long, value_name = "MM", allow_hyphen_values = true, help_heading = "Make")]
    pub clearance: Option<f64>,
    /// The same on the rails of the key, mm, 0.03 to 0.8 [default: the printer's]
    #[arg(long, value_name = "MM", allow_hyphen_values = true, help_heading = "Make")]
    pub key_clearance: Option<f64>,
    /// Height of a bump on each rail that the key clicks past, mm, 0 to 0.4; 0 makes none
    #[arg(
        long,
        value_name = "MM",
        allow_hyphen_values = true,
        default_value_t = 0.0,
        help_heading = "Make"
    )]
    pub detent: f64,
    /// How far ribs on a key without rails press on the pieces around it, mm, 0 to 0.3; 0 makes none
    #[arg(long, value_name = "MM", allow_hyphen_values = true, default_value_t = Params::default().connector.key_rib_mm, help_heading = "Make")]
    pub key_ribs: f64,
    /// Also look for a proof of how far pieces move within the gaps while all others but one move too; closes
    /// for small kits only, and takes some seconds to a minute
    #[arg(long, help_heading = "Make")]
    pub play_together: bool,
    /// Make pieces though hardly anything of the model can be hollow; they are mostly solid, with few connectors
    #[arg(long, help_heading = "Make")]
    pub allow_thin: bool,
    /// Cut a notch for a fingernail into the key, 0.45 mm deep
    #[arg(long, help_heading = "Make")]
    pub key_grip: bool,
    /// Leave the pieces' numbers off their inner sides
    #[arg(long, help_heading = "Make")]
    pub no_labels: bool,
    /// Leave out instructions.pdf, which takes about a second
    #[arg(long, help_heading = "Make")]
    pub no_booklet: bool,
    /// How far each side of a seam stays back, mm, 0 to 0.4; less for those who sand [default: the printer's
    /// tolerance]
    #[arg(
        long,
        alias = "wall-gap",
        value_name = "MM",
        allow_hyphen_values = true,
        help_heading = "Make"
    )]
    pub seam_gap: Option<f64>,
    /// Thinnest wall that the printer makes, mm, 0.1 to 2; thinner parts are reported [default: the
    /// printer's]
    #[arg(long, value_name = "MM", allow_hyphen_values = true, help_heading = "Make")]
    pub min_wall: Option<f64>,
    /// Spacing of the grid behind the walls, mm [default: thickness / 2.5]
    #[arg(long, value_name = "MM", allow_hyphen_values = true, help_heading = "Make")]
    pub grid: Option<f64>,
    /// Seed of all random choices: the same seed gives the same kit
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Make")]
    pub seed: u64,
}

/// Work of the exact search in a second: measured on one core at 3 GHz, on models of 8 to 45 pieces.
///
/// Plans depend on work and not on time, so that they are the same on every computer that is not far slower.
const REVISIONS_PER_SECOND: f64 = 20_000.0;

impl Options {
    /// The printer that is named: of the user's own, or of those that come with the program.
    pub fn chosen_printer(&self) -> Result<Printer, String> {
        printer_called(&self.printer, &self.own_printers)
    }

    /// The library's parameters for pieces made on `printer`.
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

/// The printer of that name: one of the user's `own`, or of those that come with the program.
fn printer_called(name: &str, own: &[Printer]) -> Result<Printer, String> {
    let known: Vec<Printer> = own.iter().cloned().chain(Printer::presets()).collect();
    let found = known.iter().find(|p| p.name.eq_ignore_ascii_case(name)).cloned();
    let names = || {
        known
            .iter()
            .map(|p| p.name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    };
    found.ok_or_else(|| format!("there is no printer \"{name}\"; choose one of {}", names()))
}

/// How numbers are engraved: strokes of two lines, and a wall behind them that the printer makes.
fn label(min_wall_mm: f64) -> LabelParams {
    let usual = LabelParams::default();
    let two_lines_mm = 2.0 * min_wall_mm;
    // A wrong wall is told as such, not as a wrong stroke.
    let within = |usual: f64, most: f64| {
        if two_lines_mm.is_finite() {
            usual.max(two_lines_mm).min(most)
        } else {
            usual
        }
    };
    LabelParams {
        stroke_mm: within(usual.stroke_mm, 2.0),
        least_wall_mm: within(usual.least_wall_mm, 5.0),
        ..usual
    }
}
