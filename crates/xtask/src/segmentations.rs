//! What each method's division of a model allows (Fig. 16).

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use shellock::design::{Params, Settings};
use shellock::plan::{PlanConstraints, PlanOutcome, search};
use shellock::segmentation::Method;
use shellock::{Ctx, Seam};

use crate::failure::Failure;
use crate::model::{Divided, Model, ModelOptions, divide, load, with_ctx};
use crate::study::write_all;
use crate::table::{Table, markdown};

/// Of which model.
#[derive(Args)]
pub struct SegmentationsOptions {
    #[command(flatten)]
    model: ModelOptions,
    /// Numbers of pieces asked of each method besides its own, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "8")]
    pieces: Vec<usize>,
}

/// One division of the model.
struct Row {
    method: Method,
    asked: Option<usize>,
    seconds: f64,
    found: Result<Plan, String>,
}

/// Its best plan.
struct Plan {
    n_pieces: usize,
    seam_mm: f64,
    cost: f64,
    lower_bound: f64,
}

/// Runs the study; returns the files written.
pub fn run(options: &SegmentationsOptions, out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let model = load(&options.model)?;
    let name = options.model.name();
    with_ctx(|ctx| {
        let mut rows = Vec::new();
        for method in Method::ALL {
            for asked in std::iter::once(None).chain(options.pieces.iter().copied().map(Some)) {
                rows.push(row(ctx, options, &model, method, asked));
                let row = &rows[rows.len() - 1];
                let answer = row.found.as_ref();
                let said = answer.map_or_else(Clone::clone, |p| format!("cost {:.3}", p.cost));
                eprintln!("{} {}: {said}", method.name(), asked_of(asked));
            }
        }
        let sheets = [
            ("methods.csv".to_owned(), table(&rows).to_csv()),
            (
                "methods.md".to_owned(),
                markdown(&HEAD, &rows.iter().map(cells).collect::<Vec<_>>()),
            ),
        ];
        write_all(out, &format!("{name}/segmentations"), &sheets)
    })
}

const HEAD: [&str; 8] = [
    "method",
    "asked",
    "pieces",
    "seams, mm",
    "cost of the best plan",
    "proven lower bound",
    "locks",
    "s",
];

fn row(
    ctx: &Ctx<'_>,
    options: &SegmentationsOptions,
    model: &Model,
    method: Method,
    asked: Option<usize>,
) -> Row {
    let mut params: Params = options.model.params();
    params.method = method;
    params.n_pieces = asked;
    let begun = Instant::now();
    let divided = divide(ctx, &params, model, &options.model.model).map_err(|e| e.to_string());
    let found = divided.and_then(|divided| plan(ctx, &params, &divided));
    Row {
        method,
        asked,
        seconds: begun.elapsed().as_secs_f64(),
        found,
    }
}

fn plan(ctx: &Ctx<'_>, params: &Params, divided: &Divided) -> Result<Plan, String> {
    let params = Settings::resolve(params).plan;
    let outcome = search(&ctx.fork(), &params, &divided.survey, &PlanConstraints::default());
    let found = match outcome.map_err(|e| e.to_string())? {
        PlanOutcome::Found(found) => found,
        PlanOutcome::Infeasible { reason, .. } => return Err(reason),
    };
    Ok(Plan {
        n_pieces: divided.surface.n_patches,
        seam_mm: divided.surface.seams().iter().map(Seam::length).sum(),
        cost: found.score.worst,
        lower_bound: found.lower_bound,
    })
}

fn asked_of(asked: Option<usize>) -> String {
    asked.map_or_else(|| "its own".to_owned(), |n| n.to_string())
}

fn cells(row: &Row) -> Vec<String> {
    let mut cells = vec![row.method.name().to_owned(), asked_of(row.asked)];
    match &row.found {
        Ok(plan) => cells.extend([
            plan.n_pieces.to_string(),
            format!("{:.0}", plan.seam_mm),
            format!("{:.3}", plan.cost),
            format!("{:.3}", plan.lower_bound),
            "yes".to_owned(),
        ]),
        Err(why) => {
            cells.extend(std::iter::repeat_n(String::new(), 4));
            cells.push(format!("no: {why}"));
        }
    }
    cells.push(format!("{:.1}", row.seconds));
    cells
}

/// What can be counted, where there is a plan; methods by their place in [`Method::ALL`].
fn table(rows: &[Row]) -> Table {
    let names = [
        "method",
        "asked",
        "pieces",
        "seams [mm]",
        "cost",
        "lower bound",
        "s",
    ];
    let mut columns: Vec<(String, Vec<f64>)> = names.map(|n| (n.into(), Vec::new())).into();
    for row in rows {
        let Ok(plan) = &row.found else { continue };
        let place = Method::ALL
            .iter()
            .position(|m| *m == row.method)
            .unwrap_or_default();
        let values = [
            place as f64,
            row.asked.unwrap_or_default() as f64,
            plan.n_pieces as f64,
            plan.seam_mm,
            plan.cost,
            plan.lower_bound,
            row.seconds,
        ];
        columns.iter_mut().zip(values).for_each(|(c, v)| c.1.push(v));
    }
    Table { columns }
}
