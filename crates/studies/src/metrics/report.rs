//! Report of the metrics study, in Markdown for people.

use super::Subject;
use super::column::{Column, Score};
use super::outliers::{Outlier, outliers};
use crate::statistics::{kendall, spearman};
use crate::table::markdown;

/// Number of outliers that the report lists.
const N_OUTLIERS: usize = 5;

/// Writes correlations, verdicts on separability, times and the worst outliers.
pub fn markdown_of(
    name: &str,
    subject: &Subject,
    columns: &[Column],
    stiffness: &[Column],
    linearity: &Option<f64>,
) -> String {
    let model = &subject.model;
    let (n_points, n_stations) = (model.assembly.points.len(), model.assembly.stations.len());
    let mut text = format!(
        "# Metrics on random plans of {name}\n\n{} plans of {} pieces, key {}; {n_points} points, {} \
         triangles, {n_stations} stations\n\n",
        subject.plans.len(),
        model.assembly.n_parts,
        subject.key,
        model.assembly.triangles.len(),
    );
    let (reference, others) = columns.split_first().expect("there is a first metric");
    text += &format!(
        "## Rank correlations with {}\n\n{}\n",
        reference.name,
        correlations(reference, others)
    );
    if let Some(surface) = columns.get(1) {
        text += &format!(
            "## Rank correlations with {}\n\n{}\n",
            surface.name,
            correlations(surface, columns[2..].iter().chain(stiffness))
        );
    }
    if let Some(deviation) = linearity {
        text += &format!("Volume openings with 0.5 E and 2 E follow 1/E to within {deviation:.1e}.\n\n");
    }
    for other in others.iter().filter(|c| c.knows_separable()) {
        let head = ["", &format!("{} holds", other.name), "separable", "unsolved"];
        text += &format!(
            "## Who is separable\n\n{}\n",
            markdown(&head, &verdicts(reference, other))
        );
    }
    text += &format!("## Wall times\n\n{}\n", times(columns.iter().chain(stiffness)));
    if let Some(surface) = columns.get(1) {
        let told = outliers(subject, reference, surface);
        text += &format!(
            "## Plans whose ranks differ most\n\n{}\n",
            worst(&told[..told.len().min(N_OUTLIERS)])
        );
    }
    text
}

fn correlations<'a>(reference: &Column, others: impl IntoIterator<Item = &'a Column>) -> String {
    let say = |r: Option<f64>| r.map_or("undefined".to_owned(), |r| format!("{r:.3}"));
    let row = |other: &Column| {
        let pairs = reference.qualities().into_iter().zip(other.qualities());
        let (a, b): (Vec<f64>, Vec<f64>) = pairs.filter(|(a, b)| a.is_finite() && b.is_finite()).unzip();
        vec![
            other.name.clone(),
            a.len().to_string(),
            say(spearman(&a, &b)),
            say(kendall(&a, &b)),
        ]
    };
    let rows: Vec<Vec<String>> = others.into_iter().map(row).collect();
    markdown(
        &["metric", "plans that hold by both", "Spearman ρ", "Kendall τ-b"],
        &rows,
    )
}

/// Counts each pair of verdicts: rows by the reference, columns by the other.
fn verdicts(reference: &Column, other: &Column) -> Vec<Vec<String>> {
    let verdict = |s: &Score| match s {
        Score::Holds(_) | Score::Rated(_) => 0,
        Score::Separable => 1,
        Score::Unsolved => 2,
    };
    let mut n = [[0usize; 3]; 3];
    for (a, b) in reference.scores.iter().zip(&other.scores) {
        n[verdict(a)][verdict(b)] += 1;
    }
    let said = ["holds", "separable", "unsolved"].map(|v| format!("{} {v}", reference.name));
    said.into_iter()
        .zip(n)
        .map(|(v, n)| std::iter::once(v).chain(n.map(|n| n.to_string())).collect())
        .collect()
}

fn times<'a>(columns: impl Iterator<Item = &'a Column>) -> String {
    let row = |c: &Column| {
        let seconds = [c.times.setup, c.times.alone, c.times.together].map(|s| format!("{s:.3}"));
        std::iter::once(c.name.clone()).chain(seconds).collect()
    };
    let rows: Vec<Vec<String>> = columns.map(row).collect();
    markdown(
        &[
            "metric",
            "once, s",
            "a plan, one by one, s",
            "a plan, side by side, s",
        ],
        &rows,
    )
}

fn worst(outliers: &[Outlier]) -> String {
    let row = |o: &Outlier| {
        let mut row = vec![
            o.plan.to_string(),
            format!("{:.0}, {:.0}", o.ranks[0], o.ranks[1]),
        ];
        row.extend(o.stations.iter().map(|d| {
            let [v, s] = d.weighted_mm.map(|w| format!("{w:.2e}"));
            format!(
                "{} of pieces {}–{}: {v}, {s}",
                d.station, d.pieces[0], d.pieces[1]
            )
        }));
        row
    };
    let rows: Vec<Vec<String>> = outliers.iter().map(row).collect();
    let head = [
        "plan",
        "ranks",
        "station decisive by the first: w d by both, mm",
        "by the second: w d by both, mm",
    ];
    markdown(&head, &rows)
}
