//! Chart of the openings and stresses of all designs, as bars in SVG.

use std::fmt::Write;

use shellock_render::svg::{begin, end, text};

use super::{Outcome, StressReport, StressVerdict};

const ROW_PX: f64 = 26.0;
const NAME_PX: f64 = 130.0;
const LONGEST_PX: f64 = 300.0;
/// Width of a bar's label, pixels: figure and verdict.
const LABEL_PX: f64 = 150.0;
const PANEL_PX: f64 = NAME_PX + LONGEST_PX + LABEL_PX + 20.0;

/// One bar of the chart.
struct Row {
    design: String,
    value: f64,
    /// Value below which the design holds.
    limit: f64,
    label: String,
    color: &'static str,
}

/// Name and bars of each of the two tests.
type Groups = [(String, Vec<Row>); 2];

/// Draws two panels side by side: the widest opening, and the stress as a share of the strength. Each panel
/// shows the designs under the punch, then in the fall. A line marks the limit of each bar. The verdict of a
/// test is written at its opening.
pub fn chart(report: &StressReport) -> String {
    let (width, height) = (2.0 * PANEL_PX, ROW_PX * (2.0 * report.rows().len() as f64 + 6.0));
    let mut svg = begin(width, height);
    panel(&mut svg, 0.0, "widest opening, mm", &groups(report, opening));
    panel(
        &mut svg,
        PANEL_PX,
        "stress, % of the strength",
        &groups(report, stress),
    );
    let note = "Black line: below it the kit holds. Printed: finished pieces with their gaps; μ: friction.";
    text(&mut svg, [NAME_PX, height - 0.6 * ROW_PX], "fill=\"#555\"", note);
    end(svg)
}

fn opening(design: String, outcome: &Outcome) -> Row {
    let Outcome {
        opening_mm: value,
        limit_mm: limit,
        ..
    } = *outcome;
    let figure = if value.is_finite() {
        format!("{value:.2}")
    } else {
        "without end".to_owned()
    };
    let (color, word) = style(outcome.verdict);
    Row {
        design,
        value,
        limit,
        label: format!("{figure} · {word}"),
        color,
    }
}

fn stress(design: String, outcome: &Outcome) -> Row {
    let (value, limit) = (100.0 * outcome.strength_share, 100.0);
    let (color, _) = style(if value > limit {
        StressVerdict::Yields
    } else {
        StressVerdict::Holds
    });
    Row {
        design,
        value,
        limit,
        label: format!("{value:.0}"),
        color,
    }
}

/// The bars of both tests.
fn groups(report: &StressReport, row: fn(String, &Outcome) -> Row) -> Groups {
    let all = report.rows();
    let force_n = |of: fn(&(String, &Outcome, &Outcome)) -> f64| all.first().map_or(0.0, of);
    let (punch_n, impact_n) = (force_n(|r| r.1.force_n), force_n(|r| r.2.force_n));
    let punches = all.iter().map(|r| row(r.0.clone(), r.1)).collect();
    let falls = all.iter().map(|r| row(r.0.clone(), r.2)).collect();
    [
        (format!("punched with {punch_n:.0} N"), punches),
        (format!("fallen, stopped with {impact_n:.0} N"), falls),
    ]
}

/// Draws a panel: a title, and for each test its name and its bars.
fn panel(svg: &mut String, x: f64, title: &str, groups: &Groups) {
    let values = groups
        .iter()
        .flat_map(|(_, rows)| rows)
        .flat_map(|row| [row.value, row.limit]);
    let largest = values.filter(|v| v.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
    let left = x + NAME_PX;
    text(
        svg,
        [left, ROW_PX],
        "font-weight=\"bold\" font-size=\"16\"",
        title,
    );
    let mut y = 1.3 * ROW_PX;
    for (test, rows) in groups {
        text(svg, [left, y + 0.7 * ROW_PX], "fill=\"#555\"", test);
        y += ROW_PX;
        for row in rows {
            bar(svg, [left, y], LONGEST_PX / largest, row);
            y += ROW_PX;
        }
        y += 0.4 * ROW_PX;
    }
}

/// Draws name, bar, limit and figure. A value that is not finite gets the longest bar.
fn bar(svg: &mut String, [left, y]: [f64; 2], px_per_unit: f64, row: &Row) {
    let length = if row.value.is_finite() {
        row.value * px_per_unit
    } else {
        LONGEST_PX
    };
    let (limit, thick) = (row.limit * px_per_unit, 0.8 * ROW_PX);
    let (at, bottom, baseline) = (left + limit, y + thick, y + 0.6 * ROW_PX);
    text(svg, [left - 8.0, baseline], "text-anchor=\"end\"", &row.design);
    // Writing to a string cannot fail.
    let _ = writeln!(
        svg,
        "<rect x=\"{left}\" y=\"{y:.1}\" width=\"{length:.1}\" height=\"{thick:.1}\" fill=\"{}\"/>\n<line \
         x1=\"{at:.1}\" y1=\"{y:.1}\" x2=\"{at:.1}\" y2=\"{bottom:.1}\" stroke=\"black\" \
         stroke-width=\"2\"/>",
        row.color
    );
    // The figure stands behind the bar, and behind the limit where that would cross it.
    let after = if (0.0..LABEL_PX).contains(&(limit - length)) {
        limit
    } else {
        length
    };
    text(svg, [left + after + 8.0, baseline], "", &row.label);
}

fn style(verdict: StressVerdict) -> (&'static str, &'static str) {
    match verdict {
        StressVerdict::Holds => ("#4c9a5b", "holds"),
        StressVerdict::Opens => ("#d8a12f", "opens"),
        StressVerdict::Yields => ("#d2702f", "yields"),
        StressVerdict::ComesApart => ("#b53a3a", "comes apart"),
    }
}
