//! Agreement of the metrics on random plans of one model (Fig. 12), and their low sensitivity to stiffness
//! (Fig. 13).

mod column;
mod outliers;
mod report;

use std::path::PathBuf;

use clap::Args;
use shellock::design::Settings;
use shellock::metric::{MetricParams, PlanModel};
use shellock::plan::{LatticePlan, PlanSurvey, random_plans};
use shellock_mechanics::Meeting;

use crate::agreement::agreement;
use crate::failure::Failure;
use crate::model::{Divided, ModelOptions, at_least_one, divide, load, with_ctx};
use crate::sheet::{Sheet, write_all};
use crate::table::Table;
use column::Column;
pub use column::failure_of;

/// Number of plans on which linearity in Young's modulus is tested.
const N_LINEAR: usize = 3;

/// Which plans of which model.
#[derive(Args)]
pub struct MetricsOptions {
    #[command(flatten)]
    subject: SubjectOptions,
}

/// Random plans of a model, and the mesh that they are rated on.
#[derive(Args)]
pub struct SubjectOptions {
    #[command(flatten)]
    pub model: ModelOptions,
    /// Number of random plans to rate, 1 or more
    #[arg(long, default_value_t = 100, value_parser = at_least_one)]
    pub plans: usize,
    /// Length of triangle edges, 0.2 to 5; 1, which build uses, gives about 1000 points
    #[arg(long, default_value_t = 0.7, allow_negative_numbers = true)]
    pub edge_share: f64,
}

/// Random plans of a model, with the data that the metrics need.
pub struct Subject {
    pub model: PlanModel,
    pub survey: PlanSurvey,
    pub plans: Vec<LatticePlan>,
    /// Meetings of each plan: its walls and connectors at the stations.
    pub meetings: Vec<Vec<Meeting>>,
    pub key: u32,
}

/// Columns of all compared metrics. All are compared with the first, and those after the second also with the
/// second. A new metric is one line here.
fn columns(subject: &Subject) -> Result<Vec<Column>, Failure> {
    let e_mpa = subject.model.params.material.youngs_modulus_mpa;
    Ok(vec![
        Column::by_volume("volume [mm]", subject, e_mpa, subject.plans.len())?,
        Column::by_surface("surface [mm]", subject, [1.0; 3])?,
        Column::by_pieces_alone("pieces alone [mm]", subject)?,
        Column::by_eq_6("data-driven [mm]", subject)?,
        Column::by_cost("minus the worst cost", subject, |costs| costs.worst)?,
        Column::by_cost("minus the mean cost", subject, |costs| costs.mean)?,
    ])
}

/// Columns of the surface metric with Fig. 13's other stiffnesses, as stretch : bending : position.
fn stiffness_columns(subject: &Subject) -> Result<Vec<Column>, Failure> {
    Ok(vec![
        Column::by_surface("surface 1:4:16 [mm]", subject, [1.0, 4.0, 16.0])?,
        Column::by_surface("surface 1:16:4 [mm]", subject, [1.0, 16.0, 4.0])?,
    ])
}

/// Runs the study; returns the files written.
pub fn run(options: &MetricsOptions, out: &std::path::Path) -> Result<Vec<PathBuf>, Failure> {
    let subject = subject(&options.subject)?;
    let columns = columns(&subject)?;
    let stiffness = stiffness_columns(&subject)?;
    let linearity = linearity(&subject, &columns[0])?;

    let name = options.subject.model.name();
    let table = table(columns.iter().chain(&stiffness));
    let compared = agreement(&self::table(&columns).complete())?;
    let by_surface = agreement(&self::table(&columns[1..]).complete())?;
    // This compares the surface metric with itself, at other stiffnesses.
    let surface = columns
        .iter()
        .filter(|c| c.name.starts_with("surface"))
        .chain(&stiffness);
    let sensitivity = agreement(&self::table(surface).complete())?;
    let mut whole: Vec<Sheet> = vec![("plans.csv".to_owned(), table.to_csv())];
    whole.push((
        "report.md".to_owned(),
        report::markdown_of(&name, &subject, &columns, &stiffness, &linearity),
    ));
    whole.push((
        "stations.csv".to_owned(),
        outliers::stations(&subject, &columns[0], &columns[1]).to_csv(),
    ));

    let mut files = write_all(out, &name, &whole)?;
    files.extend(write_all(out, &format!("{name}/metrics"), &compared)?);
    files.extend(write_all(out, &format!("{name}/by-surface"), &by_surface)?);
    files.extend(write_all(out, &format!("{name}/sensitivity"), &sensitivity)?);
    Ok(files)
}

/// Divides the model and draws the random plans.
pub fn subject(options: &SubjectOptions) -> Result<Subject, Failure> {
    let path = &options.model.model;
    // Wrong parameters should fail before the model is divided, which takes time.
    let metric = MetricParams {
        edge_share: options.edge_share,
        ..MetricParams::default()
    };
    Failure::unless_right(metric.problems())?;
    let params = options.model.params();
    let solid = load(&options.model)?;
    let Divided {
        surface,
        sizes,
        survey,
    } = with_ctx(|ctx| divide(ctx, &params, &solid, path))?;
    let plan_params = Settings::resolve(&params).plan;
    let plans = random_plans(&plan_params, &survey, options.plans);
    let Some(key) = plans.first().map(|p| p.key().0) else {
        return Err(Failure::Model {
            path: path.clone(),
            problem: "no plan was found".to_owned(),
        });
    };
    let metric = MetricParams {
        edge_share: metric.edge_share,
        ..MetricParams::of_plan(&plan_params, &sizes, params.material)
    };
    Failure::unless_right(metric.problems())?;
    let model = PlanModel::new(&metric, &surface, &sizes);
    let meetings = plans.iter().map(|p| model.meetings(p)).collect();
    Ok(Subject {
        model,
        survey,
        plans,
        meetings,
        key,
    })
}

/// Tests that openings are proportional to 1/E. Returns the largest relative deviation at half and at twice
/// the stiffness; `None` if no plan could be compared.
fn linearity(subject: &Subject, reference: &Column) -> Result<Option<f64>, Failure> {
    let e_mpa = subject.model.params.material.youngs_modulus_mpa;
    let n = subject.plans.len().min(N_LINEAR);
    let mut largest: Option<f64> = None;
    for factor in [0.5, 2.0] {
        let scaled = Column::by_volume("volume, other stiffness", subject, factor * e_mpa, n)?;
        for (a, b) in scaled.qualities().into_iter().zip(reference.qualities()) {
            if a.is_finite() && b.is_finite() && b != 0.0 {
                largest = Some(largest.unwrap_or(0.0).max((a * factor / b - 1.0).abs()));
            }
        }
    }
    Ok(largest)
}

/// Table of the columns' qualities.
fn table<'a>(columns: impl IntoIterator<Item = &'a Column>) -> Table {
    Table {
        columns: columns
            .into_iter()
            .map(|c| (c.name.clone(), c.qualities()))
            .collect(),
    }
}
