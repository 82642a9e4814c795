//! Curves of how searches improve with work, as charts and tables (Fig. 14 and 16).

use shellock::plan::study::{Technique, convergence};
use shellock::plan::{PlanParams, PlanSurvey};
use shellock::{Cancelled, Ctx};

use crate::chart::{Corner, Curve, Labels, bands};
use crate::failure::Failure;
use crate::sheet::Sheet;
use crate::statistics::band;
use crate::table::{Table, markdown};

/// Runs of one search with several seeds: for each, its improvements (evaluations, cost).
pub type Runs = Vec<Vec<(f64, f64)>>;

/// Runs the search once for each seed with `n_evaluations` each. A run is empty if no key has a plan.
pub fn runs(
    ctx: &Ctx<'_>,
    params: &PlanParams,
    survey: &PlanSurvey,
    technique: Technique,
    seeds: impl Iterator<Item = u64>,
    n_evaluations: usize,
) -> Result<Runs, Cancelled> {
    let run = |seed: u64| {
        let params = PlanParams {
            seed,
            ..params.clone()
        };
        let samples = convergence(ctx, &params, survey, technique, n_evaluations)?;
        Ok(samples
            .iter()
            .map(|s| (s.n_evaluations as f64, s.best_cost))
            .collect())
    };
    seeds.map(run).collect()
}

/// Chart and tables of several named searches with their runs: `file`.svg, .csv and .md. A proven `optimum`
/// becomes a line of the chart.
pub fn convergence_sheets(
    file: &str,
    title: &str,
    runs: &[(String, Runs)],
    optimum: Option<f64>,
) -> Result<Vec<Sheet>, Failure> {
    let mut table = Table {
        columns: ["variant", "seed", "evaluations", "cost"]
            .map(|n| (n.into(), vec![]))
            .into(),
    };
    let (mut curves, mut rows) = (Vec::new(), Vec::new());
    for (variant, (name, runs)) in runs.iter().enumerate() {
        for (seed, &(evaluations, cost)) in runs
            .iter()
            .enumerate()
            .flat_map(|(i, r)| r.iter().map(move |p| (i, p)))
        {
            let row = [variant as f64, seed as f64, evaluations, cost];
            table.columns.iter_mut().zip(row).for_each(|(c, v)| c.1.push(v));
        }
        let points = band(runs);
        if let Some(end) = points.last() {
            let figures = [end.middle, end.low, end.high].map(|v| format!("{v:.4}"));
            rows.push(std::iter::once(name.clone()).chain(figures).collect());
        }
        curves.push(Curve { name, points });
    }
    let labels = Labels {
        title,
        x: "plans looked at and costs of pieces asked for",
        y: "cost of the best plan's worst piece",
    };
    Ok(vec![
        (
            format!("{file}.svg"),
            bands(&labels, &curves, optimum, Corner::UpperRight)?,
        ),
        (format!("{file}.csv"), table.to_csv()),
        (
            format!("{file}.md"),
            markdown(&["search", "median at the end", "least", "greatest"], &rows),
        ),
    ])
}
