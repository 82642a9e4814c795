//! Prepares a model for studies: reads it, divides it and surveys its pieces.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::{Args, ValueEnum};
use shellock::ParamProblem;
use shellock::Progress;
use shellock::connector::ConnectorParams;
use shellock::design::{Params, Settings, Thickness};
use shellock::plan::{PlanSurvey, survey};
use shellock::segmentation::{Method, segment};
use shellock::sizes::{self, SizeChoice, SizeRange};
use shellock::{ConnectorSizes, Ctx, SegmentedSurface};
use shellock_formats::{read_labels, read_mesh};
use shellock_geom::Solid;
use shellock_geom::check::into_solid;
use shellock_print::Printer;

use crate::failure::Failure;

/// Which model, and how it is divided.
#[derive(Args, Clone)]
pub struct ModelOptions {
    /// A closed mesh: OBJ, PLY, OFF, STL or 3MF
    pub model: PathBuf,
    /// Longest side, mm: 10 to 2000
    #[arg(long, default_value_t = 150.0, allow_negative_numbers = true)]
    pub size: f64,
    /// Which axis of the file points up
    #[arg(long, value_enum, default_value = "z")]
    pub up: Axis,
    /// One label a face, one integer a line; a label is a piece
    #[arg(long, value_name = "FILE")]
    pub labels: Option<PathBuf>,
    /// Seed of all random choices
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

/// An axis of the file.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    /// First coordinate of the file.
    X,
    /// Second coordinate of the file.
    Y,
    /// Third coordinate of the file.
    Z,
}

impl ModelOptions {
    /// Parameters of the product, except for the seed and the up axis.
    pub fn params(&self) -> Params {
        let mut params = Params::default();
        params.seed = self.seed;
        params.up = std::array::from_fn(|axis| if axis == self.up as usize { 1.0 } else { 0.0 });
        params
    }

    /// Parameters with which the command line makes a kit for the printer `sla`, divided by `auto`.
    pub fn kit_params(&self) -> Params {
        let mut params = made_params();
        (params.seed, params.up) = (self.seed, self.params().up);
        params.method = Method::Auto;
        params
    }

    /// Name of the model in titles and folders.
    pub fn name(&self) -> String {
        self.model
            .file_stem()
            .map_or_else(|| "model".to_owned(), |s| s.to_string_lossy().into_owned())
    }
}

/// A model in mm, with the user's labels.
pub struct Model {
    /// Mesh of the file, scaled.
    pub solid: Solid,
    /// Labels, one a face of `solid`, if there are any.
    pub labels: Option<Vec<i64>>,
}

/// A model that has been divided into pieces.
pub struct Divided {
    /// Surface with its patches.
    pub surface: SegmentedSurface,
    /// Connector size of each pair of pieces.
    pub sizes: ConnectorSizes,
    /// Survey of the pieces for planning.
    pub survey: PlanSurvey,
}

/// Parameters with which the command line makes kits for the printer `sla`, except for the division.
pub fn made_params() -> Params {
    let printer = Printer::sla();
    let mut params = Params::default();
    params.thickness = Thickness::Auto;
    // The work of ten seconds, as the command line counts it.
    params.proof_budget = 200_000;
    params.material = printer.material;
    params.seam_gap_mm = printer.tolerance_mm;
    params.connector = ConnectorParams {
        size: SizeChoice::Auto(SizeRange::default()),
        clearance_mm: printer.clearance_mm,
        key_clearance_mm: printer.key_clearance_mm,
        min_wall_mm: printer.min_wall_mm,
        ..ConnectorParams::default()
    };
    params
}

/// Parses a whole number from 1 on.
pub fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("there must be at least one".to_owned()),
        Ok(n) => Ok(n),
        Err(_) => Err("this is no whole number from 1 on".to_owned()),
    }
}

/// Reads the model and its labels, and scales the mesh to the requested length of its longest side.
pub fn load(options: &ModelOptions) -> Result<Model, Failure> {
    Failure::unless_right(ParamProblem::unless_within(
        "size",
        "mm",
        options.size,
        10.0,
        2000.0,
    ))?;
    let path = &options.model;
    let fault = |problem: String| Failure::Model {
        path: path.clone(),
        problem,
    };
    let extension = path.extension().and_then(|e| e.to_str());
    let loaded = read_mesh(&read(path)?, extension).map_err(|e| fault(e.to_string()))?;
    let (solid, kept) = into_solid(&loaded.mesh).map_err(|e| fault(e.to_string()))?;
    let labels = options.labels.as_ref().map(|file| {
        let fault = |problem: String| Failure::Model {
            path: file.clone(),
            problem,
        };
        let labels = read_labels(&read(file)?).map_err(|e| fault(e.to_string()))?;
        let (n_labels, n_faces) = (labels.len(), loaded.n_file_faces());
        if n_labels != n_faces {
            return Err(fault(format!("{n_labels} labels for a model of {n_faces} faces")));
        }
        Ok(kept
            .iter()
            .map(|&k| labels[loaded.file_face[k as usize] as usize])
            .collect())
    });
    let mut mesh = solid.into_mesh();
    let scale = options.size / mesh.bounds().size().max_element();
    if !(scale.is_finite() && scale > 0.0) {
        return Err(fault(format!("it cannot be made {} mm long", options.size)));
    }
    mesh.points.iter_mut().for_each(|p| *p *= scale);
    let solid = Solid::new(mesh).map_err(|e| fault(e.to_string()))?;
    Ok(Model {
        solid,
        labels: labels.transpose()?,
    })
}

/// Divides the model and surveys the pieces.
pub fn divide(ctx: &Ctx<'_>, params: &Params, model: &Model, path: &Path) -> Result<Divided, Failure> {
    let settings = Settings::resolve(params);
    let problems = params.problems();
    if !problems.is_empty() {
        return Err(Failure::Options(problems));
    }
    let fault = |problem: String| Failure::Model {
        path: path.to_owned(),
        problem,
    };
    let surface = segment(ctx, &settings.segmentation, &model.solid, model.labels.as_deref())
        .map_err(|e| fault(e.to_string()))?;
    let stopped = |_| fault("the study was stopped".into());
    let sizes = sizes::choose(ctx, &settings.sizes, &surface, None)
        .map_err(stopped)?
        .sizes;
    let survey = survey(ctx, &settings.plan, &surface, &surface.seams(), &sizes).map_err(stopped)?;
    Ok(Divided {
        surface,
        sizes,
        survey,
    })
}

/// Calls `work` with a context that prints stages on standard error and never stops.
pub fn with_ctx<T>(work: impl FnOnce(&Ctx<'_>) -> T) -> T {
    let stop = AtomicBool::new(false);
    let report = |progress: Progress<'_>| {
        if let Progress::Stage { name, .. } = progress {
            eprintln!("{name}");
        }
    };
    work(&Ctx::new(&report, &stop))
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    fs::read(path).map_err(|source| Failure::File {
        path: path.to_owned(),
        source,
    })
}
