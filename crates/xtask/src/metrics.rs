//! How well the metrics agree on random plans of one model (Fig. 12), and how little their stiffness matters (Fig. 13).

mod outliers;
mod report;

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use clap::Args;
use rayon::prelude::*;
use shellock::metric::{MetricParams, PlanModel};
use shellock::plan::{InstallationPlan, random_plans};
use shellock_geom::sparse::SparseError;
use shellock_mechanics::{
    Meeting, Opening, Resistance, SurfaceModel, SurfaceParams, SurfaceSolution, VolumeError, VolumeModel, VolumeParams,
};

use crate::failure::Failure;
use crate::model::{Divided, ModelOptions, divide, load, with_ctx};
use crate::study::{Sheet, agreement, write_all};
use crate::table::Table;

/// Plans that are timed one by one, before all are evaluated on all cores.
const N_TIMED: usize = 5;
/// Plans on which linearity in Young's modulus is tested.
const N_LINEAR: usize = 3;

/// Which plans of which model.
#[derive(Args)]
pub struct MetricsOptions {
    #[command(flatten)]
    model: ModelOptions,
    /// How many plans
    #[arg(long, default_value_t = 100)]
    plans: usize,
    /// Length of triangle edges; 1, which build uses, gives about 1000 points
    #[arg(long, default_value_t = 0.7)]
    edge_share: f64,
}

/// The plans and what the metrics know of them.
struct Subject {
    model: PlanModel,
    plans: Vec<InstallationPlan>,
    /// What each plan makes of the stations.
    meetings: Vec<Vec<Meeting>>,
    key: u32,
}

/// What a metric says of a plan.
#[derive(Clone, Debug)]
enum Score {
    Holds(Opening),
    Separable,
    /// The solver failed.
    Unsolved,
}

/// Says why a plan has no score.
fn unsolved(why: &str) -> Score {
    eprintln!("warning: a plan was not solved: {why}");
    Score::Unsolved
}

/// One metric over all plans.
struct Column {
    name: String,
    /// Of each plan.
    scores: Vec<Score>,
    times: Times,
}

/// Wall time, s.
struct Times {
    /// Making what all plans share.
    setup: f64,
    /// A plan, alone on the machine: median of the first ones.
    alone: f64,
    /// A plan, where all are evaluated side by side.
    together: f64,
}

impl Column {
    /// `scores` of plans 0 to `n` − 1 by what `prepare` makes.
    fn new<T: Sync>(
        name: &str,
        n: usize,
        prepare: impl FnOnce() -> Result<T, Failure>,
        score: impl Fn(&T, usize) -> Score + Sync,
    ) -> Result<Self, Failure> {
        eprintln!("{name}: {n} plans");
        let start = Instant::now();
        let metric = prepare()?;
        let setup = start.elapsed().as_secs_f64();
        let timed = |i: usize| {
            let start = Instant::now();
            let _ = score(&metric, i);
            start.elapsed().as_secs_f64()
        };
        let mut alone: Vec<f64> = (0..n.min(N_TIMED)).map(timed).collect();
        alone.sort_by(f64::total_cmp);
        let start = Instant::now();
        let n_done = AtomicUsize::new(0);
        let told = |i: usize| {
            let found = score(&metric, i);
            let done = n_done.fetch_add(1, Ordering::Relaxed) + 1;
            if done.is_multiple_of(10) {
                eprintln!("  {done} of {n} after {:.1} s", start.elapsed().as_secs_f64());
            }
            found
        };
        let scores: Vec<Score> = (0..n).into_par_iter().map(told).collect();
        let together = start.elapsed().as_secs_f64() / n.max(1) as f64;
        let alone = alone.get(alone.len() / 2).copied().unwrap_or(0.0);
        Ok(Self { name: name.to_owned(), scores, times: Times { setup, alone, together } })
    }

    fn by_volume(name: &str, subject: &Subject, youngs_modulus_mpa: f64, n: usize) -> Result<Self, Failure> {
        let mut params = subject.model.params;
        params.material.youngs_modulus_mpa = youngs_modulus_mpa;
        let volume = || volume_model(subject, &params).map_err(|e| failed(name, &e));
        Self::new(name, n, volume, |volume, i| match volume.resist(&subject.meetings[i], subject.key) {
            Ok(resistance) => Score::of(resistance),
            Err(e) => unsolved(&e.to_string()),
        })
    }

    fn by_surface(name: &str, subject: &Subject, stiffness_ratios: [f64; 3]) -> Result<Self, Failure> {
        let params = SurfaceParams { stiffness_ratios, ..subject.model.params.surface() };
        let surface = || SurfaceModel::new(&params, &subject.model.assembly).map_err(|e| failed(name, &e));
        Self::new(name, subject.plans.len(), surface, |surface, i| {
            Score::of_surface(surface.resist(&subject.meetings[i], subject.key), subject)
        })
    }

    /// The qualities, mm; not a number where there is none.
    fn qualities_mm(&self) -> Vec<f64> {
        self.scores.iter().map(|s| s.opening().map_or(f64::NAN, |o| o.quality_mm)).collect()
    }
}

impl Score {
    fn of(resistance: Resistance) -> Self {
        match resistance {
            Resistance::Holds(opening) => Self::Holds(opening),
            Resistance::Separable(_) => Self::Separable,
        }
    }

    fn of_surface(solution: Result<SurfaceSolution, SparseError>, subject: &Subject) -> Self {
        match solution {
            Ok(solution) if solution.error <= subject.model.params.surface().tolerance => Self::of(solution.resistance),
            Ok(solution) => unsolved(&format!("{:.1e} of the force is left", solution.error)),
            Err(e) => unsolved(&e.to_string()),
        }
    }

    fn opening(&self) -> Option<&Opening> {
        if let Self::Holds(opening) = self { Some(opening) } else { None }
    }
}

/// Every metric that is compared: the first is the one that the others are compared with. A new metric is one line here.
fn columns(subject: &Subject) -> Result<Vec<Column>, Failure> {
    let e_mpa = subject.model.params.material.youngs_modulus_mpa;
    Ok(vec![
        Column::by_volume("volume [mm]", subject, e_mpa, subject.plans.len())?,
        Column::by_surface("surface [mm]", subject, [1.0; 3])?,
    ])
}

/// Fig. 13's other stiffnesses of the surface metric, as stretch : bending : position.
fn stiffness_columns(subject: &Subject) -> Result<Vec<Column>, Failure> {
    Ok(vec![
        Column::by_surface("surface 1:4:16 [mm]", subject, [1.0, 4.0, 16.0])?,
        Column::by_surface("surface 1:16:4 [mm]", subject, [1.0, 16.0, 4.0])?,
    ])
}

/// Runs the study; returns the files written.
pub fn run(options: &MetricsOptions, out: &std::path::Path) -> Result<Vec<PathBuf>, Failure> {
    let subject = subject(options)?;
    let columns = columns(&subject)?;
    let stiffness = stiffness_columns(&subject)?;
    let linearity = linearity(&subject, &columns[0])?;

    let name = options.model.name();
    let table = table(columns.iter().chain(&stiffness));
    let compared = agreement(&self::table(&columns).complete())?;
    // The same metric with other stiffnesses, compared with itself.
    let surface = columns.iter().filter(|c| c.name.starts_with("surface")).chain(&stiffness);
    let sensitivity = agreement(&self::table(surface).complete())?;
    let mut whole: Vec<Sheet> = vec![("plans.csv".to_owned(), table.to_csv())];
    whole.push(("report.md".to_owned(), report::markdown_of(&name, &subject, &columns, &stiffness, &linearity)));
    whole.push(("stations.csv".to_owned(), outliers::stations(&subject, &columns[0], &columns[1]).to_csv()));

    let mut files = write_all(out, &name, &whole)?;
    files.extend(write_all(out, &format!("{name}/metrics"), &compared)?);
    files.extend(write_all(out, &format!("{name}/sensitivity"), &sensitivity)?);
    Ok(files)
}

fn subject(options: &MetricsOptions) -> Result<Subject, Failure> {
    let path = &options.model.model;
    let params = options.model.params();
    let solid = load(&options.model)?;
    let Divided { surface, sizes, survey } = with_ctx(|ctx| divide(ctx, &params, &solid, path))?;
    let plans = random_plans(&params.plan, &survey, options.plans);
    let Some(key) = plans.first().map(|p| p.key().0) else {
        return Err(Failure::Model { path: path.clone(), problem: "no plan was found".to_owned() });
    };
    let metric = MetricParams { edge_share: options.edge_share, ..MetricParams::of_plan(&params.plan, &sizes) };
    let model = PlanModel::new(&metric, &surface, &sizes);
    let meetings = plans.iter().map(|p| model.meetings(p)).collect();
    Ok(Subject { model, plans, meetings, key })
}

fn volume_model(subject: &Subject, params: &MetricParams) -> Result<VolumeModel, VolumeError> {
    let params = VolumeParams { wall_mm: params.wall_mm, material: params.material, ..VolumeParams::default() };
    VolumeModel::new(&params, &subject.model.assembly)
}

/// Openings are proportional to 1/E: the largest relative deviation from that with half and twice the stiffness.
fn linearity(subject: &Subject, reference: &Column) -> Result<Option<f64>, Failure> {
    let e_mpa = subject.model.params.material.youngs_modulus_mpa;
    let n = subject.plans.len().min(N_LINEAR);
    let mut largest: Option<f64> = None;
    for factor in [0.5, 2.0] {
        let scaled = Column::by_volume("volume, other stiffness", subject, factor * e_mpa, n)?;
        for (a, b) in scaled.qualities_mm().into_iter().zip(reference.qualities_mm()) {
            if a.is_finite() && b.is_finite() && b != 0.0 {
                largest = Some(largest.unwrap_or(0.0).max((a * factor / b - 1.0).abs()));
            }
        }
    }
    Ok(largest)
}

/// The qualities as a table.
fn table<'a>(columns: impl IntoIterator<Item = &'a Column>) -> Table {
    Table { columns: columns.into_iter().map(|c| (c.name.clone(), c.qualities_mm())).collect() }
}

fn failed(metric: &str, problem: &dyn std::fmt::Display) -> Failure {
    Failure::Metric { metric: metric.to_owned(), problem: problem.to_string() }
}
