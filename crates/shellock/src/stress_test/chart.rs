//! Openings and stresses of all designs as bars, in SVG.

use std::fmt::Write;

use super::{Outcome, StressReport, Verdict};

const BAR_PX: f64 = 26.0;
const LEFT_PX: f64 = 210.0;
const LONGEST_PX: f64 = 360.0;
const PANEL_PX: f64 = LEFT_PX + LONGEST_PX + 190.0;

/// Two panels side by side: the widest opening in mm, and the stress as a share of the strength, each bar in the colour of its
/// verdict.
pub fn chart(report: &StressReport) -> String {
    let rows: Vec<(String, &Outcome)> = (report.designs().into_iter())
        .flat_map(|(name, pair)| [(format!("{name}, punch"), &pair.punch), (format!("{name}, fall"), &pair.drop)])
        .collect();
    let height = BAR_PX * (rows.len() as f64 + 3.0);
    let width = 2.0 * PANEL_PX;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" \
         font-size=\"14\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    let openings = rows.iter().map(|(name, o)| (name.as_str(), *o, o.opening_mm, "mm"));
    panel(&mut svg, 0.0, "widest opening between pieces", &openings.collect::<Vec<_>>());
    let shares = rows.iter().map(|(name, o)| (name.as_str(), *o, 100.0 * o.strength_share, "%"));
    panel(&mut svg, PANEL_PX, "stress, share of the strength", &shares.collect::<Vec<_>>());
    svg.push_str("</svg>\n");
    svg
}

/// One panel: a title, and name, bar and figure of each row. What is not finite gets the longest bar.
fn panel(svg: &mut String, x: f64, title: &str, rows: &[(&str, &Outcome, f64, &str)]) {
    let largest = rows.iter().map(|r| r.2).filter(|v| v.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
    // Writing to a string cannot fail.
    let _ = writeln!(svg, "<text x=\"{}\" y=\"{BAR_PX}\" font-weight=\"bold\">{title}</text>", x + LEFT_PX);
    for (i, (name, outcome, value, unit)) in rows.iter().enumerate() {
        let y = BAR_PX * (i as f64 + 1.7);
        let length = if value.is_finite() { LONGEST_PX * value / largest } else { LONGEST_PX };
        let figure = if value.is_finite() { format!("{value:.3} {unit}") } else { "without end".to_owned() };
        let (color, word) = style(outcome.verdict);
        let (end, baseline) = (x + LEFT_PX - 8.0, y + 0.65 * BAR_PX);
        let _ = writeln!(svg, "<text x=\"{end}\" y=\"{baseline:.1}\" text-anchor=\"end\">{name}</text>");
        let (left, thick) = (x + LEFT_PX, 0.8 * BAR_PX);
        let _ = writeln!(
            svg,
            "<rect x=\"{left}\" y=\"{y:.1}\" width=\"{length:.1}\" height=\"{thick:.1}\" fill=\"{color}\"/>"
        );
        let after = left + length + 6.0;
        let _ = writeln!(svg, "<text x=\"{after:.1}\" y=\"{baseline:.1}\">{figure} · {word}</text>");
    }
}

fn style(verdict: Verdict) -> (&'static str, &'static str) {
    match verdict {
        Verdict::Holds => ("#4c9a5b", "holds"),
        Verdict::Opens => ("#d8a12f", "opens"),
        Verdict::Yields => ("#d2702f", "yields"),
        Verdict::ComesApart => ("#b53a3a", "comes apart"),
    }
}
