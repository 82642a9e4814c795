//! Divisions of a model by each method (Fig. 16): the place of their seams, and the quality of their plans.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use shellock::Ctx;
use shellock::design::{Params, Settings};
use shellock::handling::Handling;
use shellock::metric::{Choice, ClimbParams, EvenSurface, Foresight, choose};
use shellock::plan::study::Technique;
use shellock::plan::{FoundPlan, PlanConstraints, PlanOutcome, PlanParams, search};
use shellock::segmentation::Method;
use shellock::segmentation::figures::{DivisionFigures, FigureParams, figures};

use crate::convergence::{Runs, convergence_sheets, runs};
use crate::failure::Failure;
use crate::model::{Divided, Model, ModelOptions, at_least_one, divide, load, with_ctx};
use crate::sheet::{Sheet, write_all};
use crate::sides;
use crate::table::{Table, markdown};

/// Model, divisions of it, and runs of the search.
#[derive(Args)]
pub struct SegmentationsOptions {
    #[command(flatten)]
    model: ModelOptions,
    /// Numbers of pieces asked of each method besides its own, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "8")]
    pieces: Vec<usize>,
    /// Runs of the search on each division, with different seeds
    #[arg(long, default_value_t = 3, value_parser = at_least_one)]
    seeds: usize,
    /// Work of each run: costs of pieces asked for, and plans looked at
    #[arg(long, default_value_t = 30_000, value_parser = at_least_one)]
    evaluations: usize,
    /// Draw only the sheet of the division as drawn, refined and made, from four sides
    #[arg(long)]
    only_sides: bool,
}

/// One division of the model, or the reason why there is none.
struct Row {
    method: Method,
    n_pieces: Option<usize>,
    seconds: f64,
    division: Result<Made, String>,
}

/// A division with its best plan, or the reason why it has none.
struct Made {
    figures: DivisionFigures,
    plan: Result<Plan, String>,
}

/// Quality of the plans of a division.
struct Plan {
    /// Cost of the best plan that was found.
    cost: f64,
    lower_bound: f64,
    /// Predicted play of the loosest piece except the key, in the steadiest plan, as a share of the allowed
    /// play.
    play: f64,
    /// Least load factor of uses for the plan that a climb from the steady plans ends at, with unchanged
    /// walls and connectors.
    least_use: Option<f64>,
    /// Runs that show how the best cost falls with work.
    runs: Runs,
}

/// Runs the study; returns the files written.
pub fn run(options: &SegmentationsOptions, out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let model = load(&options.model)?;
    let name = options.model.name();
    with_ctx(|ctx| {
        let study = format!("{name}/segmentations");
        let sides = ("sides.svg".to_owned(), sides::sheet(ctx, &options.model, &model)?);
        let (mut rows, mut sheets) = (Vec::new(), vec![sides]);
        if options.only_sides {
            return write_all(out, &study, &sheets);
        }
        for asked in std::iter::once(None).chain(options.pieces.iter().copied().map(Some)) {
            let of_number: Vec<Row> = Method::ALL
                .into_iter()
                .map(|method| row(ctx, options, &model, method, asked))
                .collect();
            sheets.extend(curves(&name, options, asked, &of_number)?);
            rows.extend(of_number);
        }
        sheets.push(("methods.csv".to_owned(), table(&rows).to_csv()));
        let cells: Vec<Vec<String>> = rows.iter().map(cells).collect();
        sheets.push(("methods.md".to_owned(), markdown(&HEAD, &cells)));
        write_all(out, &study, &sheets)
    })
}

/// Chart and tables that show how fast plans of each division improve.
fn curves(
    name: &str,
    options: &SegmentationsOptions,
    asked: Option<usize>,
    rows: &[Row],
) -> Result<Vec<Sheet>, Failure> {
    let curve = |row: &Row| {
        let made = row.division.as_ref().ok()?;
        let plan = made.plan.as_ref().ok()?;
        let label = format!("{}, {} pieces", row.method.name(), made.figures.n_pieces);
        (!plan.runs.iter().any(Vec::is_empty)).then(|| (label, plan.runs.clone()))
    };
    let named: Vec<(String, Runs)> = rows.iter().filter_map(curve).collect();
    let (file, divisions) = match asked {
        None => (
            "search-own".to_owned(),
            "divisions into each method's own number".to_owned(),
        ),
        Some(n) => (format!("search-{n}"), format!("divisions into about {n} pieces")),
    };
    let title = format!(
        "Plans of {name}, {divisions}: median and range of {} seeds",
        options.seeds
    );
    convergence_sheets(&file, &title, &named, None)
}

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
    let made = divided.map(|divided| Made {
        figures: figures_of(&params, &divided),
        plan: plan(ctx, options, &params, &divided),
    });
    let row = Row {
        method,
        n_pieces: asked,
        seconds: begun.elapsed().as_secs_f64(),
        division: made,
    };
    eprintln!("{}", cells(&row).join(" | "));
    row
}

fn figures_of(params: &Params, divided: &Divided) -> DivisionFigures {
    let settings = Settings::resolve(params).segmentation;
    let of = FigureParams {
        up: params.up,
        wall_mm: settings.wall_mm,
        min_contact_mm: settings.min_contact_mm,
        mirror: None,
    };
    figures(&of, &divided.surface)
}

fn plan(
    ctx: &Ctx<'_>,
    options: &SegmentationsOptions,
    params: &Params,
    divided: &Divided,
) -> Result<Plan, String> {
    let settings = Settings::resolve(params);
    let outcome = search(
        &ctx.fork(),
        &settings.plan,
        &divided.survey,
        &PlanConstraints::default(),
    );
    let found = match outcome.map_err(|e| e.to_string())? {
        PlanOutcome::Found(found) => *found,
        PlanOutcome::Infeasible { reason, .. } => return Err(reason),
    };
    // All runs look for plans with the same key.
    let with_key = PlanParams {
        key: Some(found.plan.key()),
        occlusion_tolerance: found.tolerance,
        ..settings.plan.clone()
    };
    let seeds = (options.model.seed..).take(options.seeds);
    let runs = runs(
        ctx,
        &with_key,
        &divided.survey,
        Technique::Both,
        seeds,
        options.evaluations,
    );
    let (cost, lower_bound) = (found.score.worst, found.lower_bound);
    let (play, least_use) = play_and_use(ctx, &settings, params, divided, found)?;
    Ok(Plan {
        cost,
        lower_bound,
        play,
        least_use,
        runs: runs.map_err(|e| e.to_string())?,
    })
}

/// Predicted play of the steadiest plan found, and the least load factor after a climb from there.
fn play_and_use(
    ctx: &Ctx<'_>,
    settings: &Settings,
    params: &Params,
    divided: &Divided,
    found: FoundPlan,
) -> Result<(f64, Option<f64>), String> {
    let handling = Handling::new(params.up, settings.plan.wall_mm, params.material);
    let Divided {
        surface,
        sizes,
        survey,
    } = divided;
    let choice = Choice {
        params: &settings.plan,
        surface,
        even: &EvenSurface::new(surface, 1.0),
        former: None,
        sizes,
        survey,
        constraints: &PlanConstraints::default(),
        handling: &handling,
        climb: ClimbParams::default(),
    };
    let foresight = Foresight::of(&choice, &found);
    let (plan, excess) = foresight.steadiest().ok_or("no plan is cheap enough")?;
    let key = usize::from(plan.plan.key());
    let of_others = excess.iter().enumerate().filter(|(piece, _)| *piece != key);
    let play = of_others.map(|(_, share)| *share).fold(0.0, f64::max);
    let chosen = choose(&ctx.fork(), &choice, &foresight, found).map_err(|e| e.to_string())?;
    let least_use = chosen.holding.weakest_use().and_then(|worst| worst.factor);
    Ok((play, least_use))
}

fn asked_of(asked: Option<usize>) -> String {
    asked.map_or_else(|| "its own".to_owned(), |n| n.to_string())
}

const HEAD: [&str; 14] = [
    "method",
    "asked",
    "pieces",
    "seams, mm",
    "in creases, %",
    "in sight, %",
    "on the front, %",
    "faults",
    "cost of the best plan",
    "proven lower bound",
    "play foreseen of what is allowed, %",
    "bears of the least use, times",
    "locks",
    "s",
];

fn cells(row: &Row) -> Vec<String> {
    let mut cells = vec![row.method.name().to_owned(), asked_of(row.n_pieces)];
    let percent = |share: f64| format!("{:.0}", 100.0 * share);
    let made = match &row.division {
        Ok(made) => made,
        Err(why) => {
            cells.extend(std::iter::repeat_n(String::new(), 10));
            cells.extend([format!("no: {why}"), format!("{:.1}", row.seconds)]);
            return cells;
        }
    };
    let DivisionFigures { seams, contacts, .. } = &made.figures;
    cells.extend([
        made.figures.n_pieces.to_string(),
        format!("{:.0}", seams.length_mm),
        percent(seams.concave_share),
        percent(seams.visible_share),
        percent(seams.front_share),
        contacts.n_faults.to_string(),
    ]);
    match &made.plan {
        Ok(plan) => cells.extend([
            format!("{:.3}", plan.cost),
            format!("{:.3}", plan.lower_bound),
            percent(plan.play),
            plan.least_use
                .map_or_else(String::new, |times| format!("{times:.2}")),
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

/// Table of the numbers for all rows with a division; methods by their index in [`Method::ALL`].
fn table(rows: &[Row]) -> Table {
    let names = [
        "method",
        "asked",
        "pieces",
        "seams [mm]",
        "in creases",
        "in sight",
        "on the front",
        "faults",
        "cost",
        "lower bound",
        "play",
        "least use",
        "s",
    ];
    let mut columns: Vec<(String, Vec<f64>)> = names.map(|n| (n.into(), Vec::new())).into();
    for row in rows {
        let Ok(made) = &row.division else { continue };
        let method = Method::ALL.iter().position(|m| *m == row.method);
        let DivisionFigures { seams, contacts, .. } = &made.figures;
        let of_plan = |get: &dyn Fn(&Plan) -> f64| made.plan.as_ref().map_or(f64::NAN, get);
        let values = [
            method.unwrap_or_default() as f64,
            row.n_pieces.unwrap_or_default() as f64,
            made.figures.n_pieces as f64,
            seams.length_mm,
            seams.concave_share,
            seams.visible_share,
            seams.front_share,
            contacts.n_faults as f64,
            of_plan(&|p| p.cost),
            of_plan(&|p| p.lower_bound),
            of_plan(&|p| p.play),
            of_plan(&|p| p.least_use.unwrap_or(f64::NAN)),
            row.seconds,
        ];
        columns.iter_mut().zip(values).for_each(|(c, v)| c.1.push(v));
    }
    Table { columns }
}
