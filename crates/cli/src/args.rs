//! Command-line arguments: commands, options, and the values that they take.

mod blows;
mod options;

use std::path::PathBuf;
use std::sync::OnceLock;

use clap::{ArgAction, Args, CommandFactory, Parser, Subcommand};
use shellock::coupon::N_FITS;
use shellock_job::options::units;
use shellock_job::printers::find_printer;
use shellock_print::Printer;

pub use blows::Blows;
pub use options::JobOptions;

/// Exit codes, shown in the help.
const EXIT_CODES: &str = "Exit codes: 0 made and verified, or it holds · 1 made, but a check or test failed \
                          · 2 the input or an argument is wrong · 3 no plan could be found · 4 a file could \
                          not be written · 130 stopped with Ctrl-C (nothing is left behind)";

/// Version of the program, with the commit that a release was built from (`scripts/release`).
fn version() -> &'static str {
    match option_env!("SHELLOCK_COMMIT") {
        None => env!("CARGO_PKG_VERSION"),
        Some(commit) => {
            static WITH_COMMIT: OnceLock<String> = OnceLock::new();
            WITH_COMMIT.get_or_init(|| format!("{} ({commit})", env!("CARGO_PKG_VERSION")))
        }
    }
}

/// Turns a closed 3D model into hollow pieces that lock each other without glue.
#[derive(Parser)]
#[command(name = "shellock", version = version(), about, after_help = EXIT_CODES, disable_help_flag = true)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
    /// Print help with the most used options
    #[arg(short, long, global = true, action = ArgAction::HelpShort)]
    pub help: Option<bool>,
    /// Print help with every option, its range and its purpose
    #[arg(long, global = true, action = ArgAction::HelpLong)]
    pub help_all: Option<bool>,
    /// Print JSON: the result, and progress on standard error
    #[arg(long, global = true)]
    pub json: bool,
    /// Print nothing but problems
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Print every check, note and figure of the plan
    #[arg(long, short, global = true, conflicts_with = "quiet")]
    pub verbose: bool,
    /// End as with Ctrl-C where standard input ends.
    #[arg(long, global = true, hide = true)]
    pub stop_with_stdin: bool,
    /// Threads to use; the result does not depend on it [default: all]
    #[arg(long, global = true, value_name = "N")]
    pub threads: Option<usize>,
}

#[derive(Subcommand)]
pub enum Command {
    /// Make a complete kit from a model: pieces, plan, 3MF, viewer page
    Build {
        /// 3MF, STL, OBJ, PLY, OFF, glTF or GLB file of a closed surface
        model: PathBuf,
        #[command(flatten)]
        options: JobOptions,
        #[command(flatten)]
        out: Out,
    },
    /// Make a kit of a figure that comes with the program; the same kit on any machine
    Demo {
        /// Which figure: squirrel, cat, teddy, octopus, dinosaur, vase, torus, fish or arms
        #[arg(long, default_value = "squirrel", value_name = "NAME")]
        figure: String,
        #[command(flatten)]
        options: JobOptions,
        #[command(flatten)]
        out: Out,
    },
    /// Only divide the surface; write it with one label per triangle (.ply), painted for slicers (.3mf), or
    /// as labels of the model's faces (.seg)
    Segment {
        /// 3MF, STL, OBJ, PLY, OFF, glTF or GLB file of a closed surface
        model: PathBuf,
        #[command(flatten)]
        options: JobOptions,
        /// File to write, with the ending .ply, .3mf or .seg
        #[arg(short, long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Only divide and plan: print the order and the directions
    Plan {
        /// 3MF, STL, OBJ, PLY, OFF, glTF or GLB file of a closed surface, such as one that `segment` wrote
        model: PathBuf,
        #[command(flatten)]
        options: JobOptions,
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
    /// Simulate a punch and a fall of a finished kit; compare it with connectors of half the size and with a
    /// plan of half the score
    Test {
        /// Folder of the kit; stress.json and stress.svg go there. Exit code 0: it holds, 1: it does not
        kit: PathBuf,
        #[command(flatten)]
        blows: Blows,
    },
    /// Report what a finished kit saves over the solid model: material, and print time by PrusaSlicer if it
    /// is installed (this takes minutes)
    Report {
        /// Folder of the kit; savings.json goes there
        kit: PathBuf,
        /// The model it was made from [default: the file named in its plan.json]
        model: Option<PathBuf>,
        /// Use closed forms for the print time even if PrusaSlicer is installed
        #[arg(long)]
        closed_form: bool,
    },
    /// Make a small plate of pins, channels, keys and rails at five clearances, to find those that fit on
    /// your printer; then save them as your own printer
    Coupon(CouponOptions),
    /// Open the studio in the browser, on this machine only: open a model, paint the pieces, place the key,
    /// make the kit
    Studio(StudioOptions),
    /// Make kits of all models in a folder; finished kits are kept, so that a stopped batch can continue
    Batch(Box<BatchOptions>),
    /// List the printers that --printer knows: those that come with the program, and your own
    Printers(PrintersOptions),
    /// Print the completions of commands and options for a shell, for example `shellock completions bash`
    Completions {
        /// Shell that the completions are for
        shell: clap_complete::Shell,
    },
    /// Write manual pages, one per command
    Manual {
        /// Folder to write the pages to
        folder: PathBuf,
    },
    /// Report what a file contains and whether a kit can be made from it
    Inspect {
        /// 3MF, STL, OBJ, PLY, OFF, glTF or GLB file
        model: PathBuf,
        #[command(flatten)]
        options: JobOptions,
        /// Also divide the surface, by its labels or else by --method, and report where the seams run, how
        /// visible they are and how the pieces hold each other
        #[arg(long, help_heading = "Pieces")]
        segment: bool,
    },
    /// Write a figure that comes with the program
    Figure {
        /// Which: squirrel, cat, teddy, octopus, dinosaur, vase, torus, fish or arms
        name: String,
        /// File to write, with the ending .stl or .ply
        #[arg(short, long, value_name = "FILE")]
        out: PathBuf,
        /// Longest side of the figure, mm
        #[arg(long, default_value_t = 150.0, value_name = "MM", value_parser = units::length_mm)]
        size: f64,
        /// Also write the limb of each triangle there, for `build --labels` (fish and arms)
        #[arg(long, value_name = "FILE")]
        labels: Option<PathBuf>,
    },
}

/// Model, project folder and port of the studio.
#[derive(Args)]
pub struct StudioOptions {
    /// 3MF, STL, OBJ, PLY, OFF, glTF or GLB file of a closed surface; it is copied into the project
    pub model: Option<PathBuf>,
    /// Folder of the project, for everything that the studio writes [default: the model's name with -studio]
    #[arg(long, value_name = "DIR")]
    pub project: Option<PathBuf>,
    /// Port on 127.0.0.1 [default: any free port]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    pub port: u16,
    /// Only print the address
    #[arg(long)]
    pub no_open: bool,
}

/// Examples at the end of a command's help.
const EXAMPLES: [(&str, &str); 8] = [
    (
        "build",
        "Examples:\n  shellock build dragon.stl --size 15cm --printer fdm\n  shellock build dragon.stl \
         --keep-whole 0,-40,120,25 --pieces 8",
    ),
    ("demo", "Example:\n  shellock demo --figure teddy --size 10cm"),
    (
        "segment",
        "Example:\n  shellock segment dragon.stl --size 15cm --out dragon.3mf   (repaint it in a slicer, \
         give it back to build)",
    ),
    (
        "studio",
        "Examples:\n  shellock studio dragon.stl\n  shellock studio --project dragon-studio   (goes on \
         where you stopped)",
    ),
    (
        "batch",
        "Example:\n  shellock batch models --out kits --size 15cm --printer fdm",
    ),
    ("plan", "Example:\n  shellock plan dragon.stl --size 15cm"),
    (
        "inspect",
        "Example:\n  shellock inspect dragon.stl --size 15cm --segment",
    ),
    (
        "test",
        "Example:\n  shellock test dragon-kit --punch 7kg --drop 2m",
    ),
];

/// Options of `build` that dividing alone does not use.
const NOT_TO_DIVIDE: [&str; 23] = [
    "key",
    "time",
    "plan-time",
    "thickness",
    "wall",
    "material",
    "drop",
    "connector",
    "clearance",
    "key-clearance",
    "detent",
    "key-ribs",
    "play-together",
    "allow-thin",
    "key-grip",
    "no-labels",
    "paper",
    "no-booklet",
    "seam-gap",
    "min-wall",
    "grid",
    "config",
    "resolution",
];
/// Options of `build` that planning alone does not use.
const NOT_TO_PLAN: [&str; 6] = [
    "key-grip",
    "no-labels",
    "paper",
    "no-booklet",
    "play-together",
    "allow-thin",
];

/// Options that belong to one model and make no sense in a batch.
const NOT_TO_MANY: [&str; 2] = ["labels", "keep-whole"];

/// Builds all commands. Each command's help shows only the options that it uses, and examples.
pub fn command() -> clap::Command {
    let without = |command: clap::Command, unused: &[&str]| {
        unused
            .iter()
            .fold(command, |c, name| c.mut_arg(*name, |arg| arg.hide(true)))
    };
    let command = Cli::command()
        .mut_subcommand("segment", |c| without(c, &NOT_TO_DIVIDE))
        .mut_subcommand("batch", |c| without(c, &NOT_TO_MANY))
        .mut_subcommand("plan", |c| without(c, &NOT_TO_PLAN));
    EXAMPLES.into_iter().fold(command, |all, (name, examples)| {
        all.mut_subcommand(name, |c| c.after_help(examples))
    })
}

/// Which models, and how many at a time.
#[derive(Args)]
pub struct BatchOptions {
    /// Folder of models, with its subfolders
    pub folder: PathBuf,
    /// Folder for the kits, one per model, with batch.html and batch.csv
    #[arg(short, long, value_name = "DIR")]
    pub out: PathBuf,
    /// Kits made at the same time [default: one per core]
    #[arg(long, value_name = "N")]
    pub jobs: Option<usize>,
    /// Memory for all kits made at the same time, GB [default: four fifths of the free memory]
    #[arg(long, value_name = "GB")]
    pub memory: Option<f64>,
    /// Time limit for each model; seconds, or with a unit
    #[arg(long, value_name = "SECONDS", default_value = "300", value_parser = units::seconds)]
    pub patience: f64,
    #[command(flatten)]
    pub options: JobOptions,
}

/// Folder that a kit is written to.
#[derive(Args)]
pub struct Out {
    /// Folder to write [default: the model's name with -kit; shellock-demo]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace the folder if it holds an earlier kit
    #[arg(short, long)]
    pub force: bool,
}

/// Which fit test is made, or what came of it.
#[derive(Args)]
pub struct CouponOptions {
    /// Printer whose clearances are in the middle of the range: sla, fdm, fdm-petg, sls, or one from the
    /// configuration file
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
    /// Number whose parts fit; --printer names the printer that the plate was made for
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=N_FITS as i64),
          requires = "save")]
    pub fits: Option<u32>,
    /// Save the clearances of that number in the configuration file, as a printer of this name
    #[arg(long, value_name = "NAME", requires = "fits")]
    pub save: Option<String>,
}

/// Options of the command `printers`.
#[derive(clap::Args)]
pub struct PrintersOptions {
    /// File with printers of your own [default: shellock.toml, if there is one]
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Printers that the file declares.
    #[arg(skip)]
    pub own_printers: Vec<Printer>,
}

impl CouponOptions {
    /// Finds the named printer among the user's own and those that come with the program.
    pub fn chosen_printer(&self) -> Result<Printer, String> {
        find_printer(&self.printer, &self.own_printers)
    }
}
