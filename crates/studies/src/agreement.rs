//! Agreement of metrics on the same plans, as charts and tables.

use crate::chart::{Labels, scatter, sorted_scores};
use crate::failure::Failure;
use crate::sheet::Sheet;
use crate::statistics::{kendall, spearman};
use crate::table::{Table, markdown};

/// Curves of all metrics over the plans, a scatter plot of each against the first, and a table of the rank
/// correlations.
pub fn agreement(scores: &Table) -> Result<Vec<Sheet>, Failure> {
    let columns: Vec<(&str, &[f64])> = scores
        .columns
        .iter()
        .map(|(n, v)| (n.as_str(), v.as_slice()))
        .collect();
    let Some(((first, reference), others)) = columns.split_first() else {
        return Ok(Vec::new());
    };
    let x = format!("plan number, sorted by {}", parts(first).0);
    let labels = Labels {
        title: "Scores of the same plans",
        x: &x,
        y: "score, scaled to 0 … 1",
    };
    let mut sheets = vec![("scores.svg".to_owned(), sorted_scores(&labels, &columns)?)];
    let mut rows = Vec::new();
    for (name, values) in others {
        let (title, x, y) = (
            format!("{} and {}", parts(name).0, parts(first).0),
            axis(first),
            axis(name),
        );
        let labels = Labels {
            title: &title,
            x: &x,
            y: &y,
        };
        sheets.push((
            format!("{}.svg", file_name(parts(name).0)),
            scatter(&labels, reference, values)?,
        ));
        let say = |r: Option<f64>| r.map_or("undefined".to_owned(), |r| format!("{r:.3}"));
        rows.push(vec![
            (*name).to_owned(),
            say(spearman(reference, values)),
            say(kendall(reference, values)),
        ]);
    }
    let head = [
        "metric",
        &format!("Spearman ρ with {first}"),
        &format!("Kendall τ-b with {first}"),
    ];
    sheets.push(("correlations.md".to_owned(), markdown(&head, &rows)));
    sheets.push(("scores.csv".to_owned(), scores.to_csv()));
    Ok(sheets)
}

/// Splits the header of a column, "name" or "name [unit]", into name and unit.
fn parts(column: &str) -> (&str, Option<&str>) {
    let split = column.strip_suffix(']').and_then(|c| c.split_once(" ["));
    split.map_or((column, None), |(name, unit)| (name, Some(unit)))
}

fn axis(column: &str) -> String {
    let (name, unit) = parts(column);
    unit.map_or_else(
        || format!("score by {name}"),
        |unit| format!("score by {name}, {unit}"),
    )
}

/// Replaces every character of `name` that is not alphanumeric by `-`.
fn file_name(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_alphanumeric() { c } else { '-' })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agreement_compares_every_metric_with_the_first() {
        let table = Table::from_csv("volume [mm],surface,data-driven\n1,2,3\n2,4,2\n3,8,1\n").unwrap();
        let sheets = agreement(&table).unwrap();
        let names: Vec<&str> = sheets.iter().map(|s| s.0.as_str()).collect();
        assert_eq!(
            names,
            [
                "scores.svg",
                "surface.svg",
                "data-driven.svg",
                "correlations.md",
                "scores.csv"
            ]
        );
        assert!(sheets[1].1.contains("score by volume, mm"));
        assert!(sheets[3].1.contains("| surface | 1.000 | 1.000 |"));
        assert!(sheets[3].1.contains("| data-driven | -1.000 | -1.000 |"));
    }
}
