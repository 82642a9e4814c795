//! Convergence of the search (Fig. 14), and the best plans of different segmentations of a model (Fig. 16).

use std::path::{Path, PathBuf};

use clap::Args;
use shellock::Ctx;
use shellock::design::{Params, Settings};
use shellock::plan::study::Technique;
use shellock::plan::{FoundPlan, PlanConstraints, PlanOutcome, PlanParams, search};

use crate::chart::{Interval, Labels, intervals};
use crate::convergence::{Runs, convergence_sheets, runs};
use crate::failure::Failure;
use crate::model::{Divided, Model, ModelOptions, at_least_one, divide, load, with_ctx};
use crate::sheet::{Sheet, write_all};
use crate::table::{Table, markdown};

/// Which searches of which model.
#[derive(Args)]
pub struct SearchOptions {
    #[command(flatten)]
    model: ModelOptions,
    /// About how many pieces, separated by commas; the techniques are compared on the first
    #[arg(long, value_delimiter = ',', default_value = "10,20,40")]
    pieces: Vec<usize>,
    /// Runs of each search, with different seeds
    #[arg(long, default_value_t = 5, value_parser = at_least_one)]
    seeds: usize,
    /// Work of each run: costs of pieces asked for, and plans looked at
    #[arg(long, default_value_t = 100_000, value_parser = at_least_one)]
    evaluations: usize,
    /// Segmentations compared, each with another seed
    #[arg(long, default_value_t = 8, value_parser = at_least_one)]
    segmentations: usize,
}

/// A divided model and its best known plan.
struct Subject {
    name: String,
    division: Divided,
    /// Parameters with the key of the best plan, so that all searches look for plans with the same key.
    params: PlanParams,
    best: Box<FoundPlan>,
}

/// Runs the study; returns the files written.
pub fn run(options: &SearchOptions, out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let model = load(&options.model)?;
    let name = options.model.name();
    with_ctx(|ctx| {
        let mut sheets = Vec::new();
        let mut subjects = Vec::new();
        for &n_pieces in &options.pieces {
            subjects.push(subject(ctx, options, &model, Some(n_pieces), options.model.seed)?);
        }
        let Some(first) = subjects.first() else {
            return Ok(Vec::new());
        };
        sheets.extend(of_techniques(ctx, options, &name, first)?);
        sheets.extend(of_sizes(ctx, options, &name, &subjects)?);
        sheets.extend(of_segmentations(ctx, options, &name, &model)?);
        write_all(out, &format!("{name}/search"), &sheets)
    })
}

fn subject(
    ctx: &Ctx<'_>,
    options: &SearchOptions,
    model: &Model,
    n_pieces: Option<usize>,
    seed: u64,
) -> Result<Subject, Failure> {
    let mut params: Params = options.model.params();
    params.seed = seed;
    params.n_pieces = n_pieces;
    let divided = divide(ctx, &params, model, &options.model.model)?;
    let fault = |problem: String| Failure::Model {
        path: options.model.model.clone(),
        problem,
    };
    let name = format!("{} pieces", divided.surface.n_patches);
    let mut params = PlanParams {
        seed: options.model.seed,
        ..Settings::resolve(&params).plan
    };
    let best = loop {
        let ctx = ctx.fork();
        let outcome = search(&ctx, &params, &divided.survey, &PlanConstraints::default());
        let best = match outcome.map_err(|_| fault("the study was stopped".into()))? {
            PlanOutcome::Found(found) => found,
            PlanOutcome::Infeasible { reason, .. } => return Err(fault(format!("{name}: {reason}"))),
        };
        if ctx
            .into_warnings()
            .iter()
            .any(|w| w.code() == "occlusion-tolerance-raised")
        {
            params.occlusion_tolerance = params.relaxed_tolerance;
        }
        // The second search has the key fixed, as the compared searches will.
        if params.key.replace(best.plan.key()).is_some() {
            break best;
        }
    };
    eprintln!(
        "{name}: cost {:.4}, proven lower bound {:.4}",
        best.score.worst, best.lower_bound
    );
    Ok(Subject {
        name,
        division: divided,
        params,
        best,
    })
}

/// Fig. 14a: compares the four techniques on one segmentation.
fn of_techniques(
    ctx: &Ctx<'_>,
    options: &SearchOptions,
    model: &str,
    subject: &Subject,
) -> Result<Vec<Sheet>, Failure> {
    let mut runs = Vec::new();
    for technique in Technique::ALL {
        runs.push((
            name_of(technique).to_owned(),
            runs_of(ctx, options, subject, technique)?,
        ));
    }
    let title = format!(
        "Search for plans of {model}, {}: median and range of {} seeds",
        subject.name, options.seeds
    );
    let optimum = subject.best.is_optimal.then_some(subject.best.score.worst);
    convergence_sheets("techniques", &title, &runs, optimum)
}

/// Fig. 14b: runs both techniques together on segmentations into more and more pieces.
fn of_sizes(
    ctx: &Ctx<'_>,
    options: &SearchOptions,
    model: &str,
    subjects: &[Subject],
) -> Result<Vec<Sheet>, Failure> {
    let mut runs = Vec::new();
    for subject in subjects {
        let (cost, bound) = (subject.best.score.worst, subject.best.lower_bound);
        let known = if subject.best.is_optimal {
            format!("optimum {cost:.3}")
        } else {
            format!("known {cost:.3}, proven ≥ {bound:.3}")
        };
        let name = format!("{}: {known}", subject.name);
        runs.push((name, runs_of(ctx, options, subject, Technique::Both)?));
    }
    let title = format!(
        "Search for plans of {model}: median and range of {} seeds",
        options.seeds
    );
    convergence_sheets("sizes", &title, &runs, None)
}

/// Fig. 16: finds the best plan of each segmentation.
fn of_segmentations(
    ctx: &Ctx<'_>,
    options: &SearchOptions,
    name: &str,
    model: &Model,
) -> Result<Vec<Sheet>, Failure> {
    let (mut found, mut rows) = (Vec::new(), Vec::new());
    let mut table = Table {
        columns: ["seed", "pieces", "cost", "lower bound"]
            .map(|n| (n.into(), vec![]))
            .into(),
    };
    for seed in (options.model.seed..).take(options.segmentations) {
        let subject = match subject(ctx, options, model, options.pieces.first().copied(), seed) {
            Ok(subject) => subject,
            Err(failure) => {
                // Finding no plan is a result, too: this segmentation has none.
                rows.push(vec![
                    seed.to_string(),
                    String::new(),
                    failure.to_string(),
                    String::new(),
                ]);
                continue;
            }
        };
        let (n_pieces, best) = (subject.division.surface.n_patches, &subject.best);
        let (cost, bound) = (best.score.worst, best.lower_bound);
        found.push(Interval {
            name: format!("{n_pieces} pieces, seed {seed}"),
            low: bound,
            high: cost,
        });
        table
            .columns
            .iter_mut()
            .zip([seed as f64, n_pieces as f64, cost, bound])
            .for_each(|(c, v)| c.1.push(v));
        rows.push(vec![
            seed.to_string(),
            n_pieces.to_string(),
            format!("{cost:.4}"),
            format!("{bound:.4}"),
        ]);
    }
    found.sort_by(|x, y| x.high.total_cmp(&y.high));
    let title = format!("Best plans of {} segmentations of {name}", found.len());
    let labels = Labels {
        title: &title,
        x: "cost of the worst piece; the line reaches down to the proven bound",
        y: "",
    };
    let head = [
        "segmentation seed",
        "pieces",
        "cost of the best plan",
        "proven lower bound",
    ];
    Ok(vec![
        ("segmentations.svg".to_owned(), intervals(&labels, &found)?),
        ("segmentations.csv".to_owned(), table.to_csv()),
        ("segmentations.md".to_owned(), markdown(&head, &rows)),
    ])
}

/// Runs a technique on `subject`, once for each seed.
fn runs_of(
    ctx: &Ctx<'_>,
    options: &SearchOptions,
    subject: &Subject,
    technique: Technique,
) -> Result<Runs, Failure> {
    eprintln!("{}, {}", subject.name, name_of(technique));
    let seeds = (options.model.seed..).take(options.seeds);
    let found = runs(
        ctx,
        &subject.params,
        &subject.division.survey,
        technique,
        seeds,
        options.evaluations,
    );
    found.map_err(|_| Failure::Model {
        path: options.model.model.clone(),
        problem: "the study was stopped".to_owned(),
    })
}

fn name_of(technique: Technique) -> &'static str {
    match technique {
        Technique::Random => "neither",
        Technique::Pruning => "pruning",
        Technique::LocalOptimisation => "local optimisation",
        Technique::Both => "both",
    }
}
