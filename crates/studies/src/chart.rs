//! Charts as SVG text: scatters, bands over seeds, and curves of several metrics over the same plans.

use std::error::Error;
use std::ops::Range;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::failure::Failure;
use crate::statistics::{BandPoint, kendall, normalise, spearman};

const SIZE_PX: (u32, u32) = (900, 600);
const MARGIN_PX: u32 = 18;
const TITLE_PX: i32 = 22;
const TEXT_PX: i32 = 16;
const LINE_PX: u32 = 2;
/// Empty space around the data, as a share of its range.
const PADDING: f64 = 0.05;
/// Colours that most colour-blind readers can distinguish, on white. [Okabe and Ito 2008], without yellow.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
];

/// Texts at the chart's edges.
pub struct Labels<'a> {
    /// Title above the chart.
    pub title: &'a str,
    /// Label below the chart, with the unit.
    pub x: &'a str,
    /// Label on the left, with the unit.
    pub y: &'a str,
}

/// A named series of points with their range over seeds.
pub struct Curve<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Points in order of x.
    pub points: Vec<BandPoint>,
}

/// Position of the legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corner {
    /// Lower right, for curves that rise.
    LowerRight,
    /// Upper right, for curves that fall.
    UpperRight,
}

/// A named value that lies between two known bounds.
pub struct Interval {
    /// Name, on the left of the line.
    pub name: String,
    /// Proven lower bound of the value.
    pub low: f64,
    /// Best value that was reached.
    pub high: f64,
}

type Plane<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Drawn = Result<(), Box<dyn Error>>;

/// Scatter plot with a dot for each pair (`x[i]`, `y[i]`). The title gives both rank correlations.
pub fn scatter(labels: &Labels<'_>, x: &[f64], y: &[f64]) -> Result<String, Failure> {
    let say = |r: Option<f64>| r.map_or("undefined".to_owned(), |r| format!("{r:.2}"));
    let title = format!(
        "{}: Spearman ρ = {}, Kendall τ = {}, n = {}",
        labels.title,
        say(spearman(x, y)),
        say(kendall(x, y)),
        x.len().min(y.len())
    );
    let labels = Labels {
        title: &title,
        ..*labels
    };
    svg(
        &labels,
        padded_range(x.iter().copied()),
        padded_range(y.iter().copied()),
        None,
        |plane| {
            let dots = x
                .iter()
                .zip(y)
                .map(|(&x, &y)| Circle::new((x, y), 4, COLOURS[0].mix(0.6).filled()));
            plane.draw_series(dots)?;
            Ok(())
        },
    )
}

/// Line through the medians of each curve, in a band from least to greatest; `optimum`, if known, is a dashed
/// line.
pub fn bands(
    labels: &Labels<'_>,
    curves: &[Curve<'_>],
    optimum: Option<f64>,
    legend: Corner,
) -> Result<String, Failure> {
    let points = || curves.iter().flat_map(|c| &c.points);
    let x = points().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| {
        (l.min(p.x), h.max(p.x))
    });
    let y = padded_range(points().flat_map(|p| [p.low, p.high]).chain(optimum));
    svg(labels, widen(x.0, x.1), y, Some(legend.into()), |plane| {
        for (curve, colour) in curves.iter().zip(COLOURS.iter().cycle()) {
            let steps = as_steps(&curve.points);
            let below = steps.iter().map(|p| (p.x, p.low));
            let outline: Vec<_> = below.chain(steps.iter().rev().map(|p| (p.x, p.high))).collect();
            plane.draw_series([Polygon::new(outline, colour.mix(0.18))])?;
            draw_line(
                plane,
                curve.name,
                steps.iter().map(|p| (p.x, p.middle)).collect(),
                *colour,
            )?;
        }
        if let Some(best) = optimum {
            let ends = [(x.0, best), (x.1, best)];
            plane
                .draw_series(DashedLineSeries::new(ends, 7, 5, BLACK.stroke_width(LINE_PX)))?
                .label("proven optimum")
                .legend(|(x, y)| PathElement::new(vec![(x, y), (x + 22, y)], BLACK.stroke_width(LINE_PX)));
        }
        Ok(())
    })
}

/// Curves of columns, each scaled to [0, 1], over the rows sorted by the first column (Fig. 12 and 13).
pub fn sorted_scores(labels: &Labels<'_>, columns: &[(&str, &[f64])]) -> Result<String, Failure> {
    let order = columns.first().map_or_else(Vec::new, |(_, first)| {
        let mut order: Vec<usize> = (0..first.len()).collect();
        order.sort_by(|&i, &j| first[i].total_cmp(&first[j]));
        order
    });
    svg(
        labels,
        widen(1.0, order.len() as f64),
        -PADDING..1.0 + PADDING,
        Some(Corner::LowerRight.into()),
        |plane| {
            // The first column, which the others should follow, is drawn last and so on top.
            for (i, (name, values)) in columns.iter().enumerate().rev() {
                let values = normalise(values);
                let line = order
                    .iter()
                    .enumerate()
                    .filter_map(|(k, &row)| Some((k as f64 + 1.0, *values.get(row)?)));
                draw_line(plane, name, line.collect(), COLOURS[i % COLOURS.len()])?;
            }
            Ok(())
        },
    )
}

/// One line for each interval, in their order from the top, with a dot at the value that was reached.
pub fn intervals(labels: &Labels<'_>, intervals: &[Interval]) -> Result<String, Failure> {
    let n = intervals.len() as f64;
    let most = intervals.iter().map(|i| i.high).fold(0.0, f64::max);
    svg(
        labels,
        widen(0.0, (1.0 + PADDING) * most),
        0.0..n.max(1.0),
        None,
        |plane| {
            for (i, interval) in intervals.iter().enumerate() {
                let y = n - i as f64 - 0.5;
                let colour = COLOURS[0];
                plane.draw_series([PathElement::new(
                    vec![(interval.low, y), (interval.high, y)],
                    colour.mix(0.4).stroke_width(3 * LINE_PX),
                )])?;
                plane.draw_series([Circle::new((interval.high, y), 6, colour.filled())])?;
                let style = ("sans-serif", TEXT_PX - 1).into_font().color(&BLACK);
                plane.draw_series([Text::new(interval.name.clone(), (0.0, y), style)])?;
            }
            Ok(())
        },
    )
}

impl From<Corner> for SeriesLabelPosition {
    fn from(corner: Corner) -> Self {
        match corner {
            Corner::LowerRight => Self::LowerRight,
            Corner::UpperRight => Self::UpperRight,
        }
    }
}

/// Corners of a staircase on which each value holds until the next point.
fn as_steps(points: &[BandPoint]) -> Vec<BandPoint> {
    let corner = |w: &[BandPoint]| [w[0], BandPoint { x: w[1].x, ..w[0] }];
    points
        .windows(2)
        .flat_map(corner)
        .chain(points.last().copied())
        .collect()
}

fn draw_line(plane: &mut Plane<'_, '_>, name: &str, points: Vec<(f64, f64)>, colour: RGBColor) -> Drawn {
    let style = colour.stroke_width(LINE_PX);
    plane
        .draw_series(LineSeries::new(points, style))?
        .label(name)
        .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 22, y)], style));
    Ok(())
}

/// Chart that `draw` fills, as SVG, with a legend at `legend` if given.
fn svg(
    labels: &Labels<'_>,
    x: Range<f64>,
    y: Range<f64>,
    legend: Option<SeriesLabelPosition>,
    draw: impl FnOnce(&mut Plane<'_, '_>) -> Drawn,
) -> Result<String, Failure> {
    let mut text = String::new();
    let drawn = (|| -> Drawn {
        let root = SVGBackend::with_string(&mut text, SIZE_PX).into_drawing_area();
        root.fill(&WHITE)?;
        let mut plane = ChartBuilder::on(&root)
            .caption(labels.title, ("sans-serif", TITLE_PX))
            .margin(MARGIN_PX)
            .x_label_area_size(50)
            .y_label_area_size(80)
            .build_cartesian_2d(x, y)?;
        plane
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.08))
            .x_desc(labels.x)
            .y_desc(labels.y)
            .x_label_formatter(&tick)
            .y_label_formatter(&tick)
            .axis_desc_style(("sans-serif", TEXT_PX + 1))
            .label_style(("sans-serif", TEXT_PX - 2))
            .draw()?;
        draw(&mut plane)?;
        if let Some(position) = legend {
            plane
                .configure_series_labels()
                .position(position)
                .margin(12)
                .legend_area_size(30)
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.25))
                .label_font(("sans-serif", TEXT_PX))
                .draw()?;
        }
        root.present()?;
        Ok(())
    })();
    match drawn {
        Ok(()) => Ok(text),
        Err(e) => Err(Failure::Chart {
            title: labels.title.to_owned(),
            problem: e.to_string(),
        }),
    }
}

/// Number with three digits, and an exponent if there would be many zeros.
fn tick(value: &f64) -> String {
    let size = value.abs();
    match size {
        _ if size < 1e-12 => "0".to_owned(),
        _ if !(1e-3..1e5).contains(&size) => format!("{value:.1e}"),
        _ => {
            let decimals = (2 - size.log10().floor() as i32).clamp(0, 5) as usize;
            let text = format!("{value:.decimals$}");
            if text.contains('.') {
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                text
            }
        }
    }
}

fn padded_range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
        (l.min(v), h.max(v))
    });
    let padding = PADDING * (high - low);
    widen(low - padding, high + padding)
}

/// Returns the range from `low` to `high`, or a wider one if it is empty or not finite, because a chart needs
/// some width.
fn widen(low: f64, high: f64) -> Range<f64> {
    match (low.is_finite() && high.is_finite(), low < high) {
        (false, _) => 0.0..1.0,
        (true, true) => low..high,
        (true, false) => low - 0.5 * low.abs().max(1.0)..low + 0.5 * low.abs().max(1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LABELS: Labels<'_> = Labels {
        title: "agreement",
        x: "volume score, mm",
        y: "surface score, mm",
    };

    #[test]
    fn a_scatter_has_a_dot_for_each_pair_and_says_how_the_ranks_agree() {
        let x: Vec<f64> = (0..17).map(f64::from).collect();
        let text = scatter(&LABELS, &x, &x.iter().map(|v| -v * v).collect::<Vec<_>>()).unwrap();
        assert_eq!(text.matches("<circle").count(), 17);
        assert!(text.contains("ρ = -1.00") && text.contains("τ = -1.00") && text.contains("n = 17"));
        assert!(text.contains("volume score, mm") && text.contains("surface score, mm"));
    }

    #[test]
    fn every_curve_and_the_optimum_are_in_the_legend() {
        let points = vec![
            BandPoint {
                x: 0.0,
                low: 1.0,
                middle: 2.0,
                high: 3.0,
            },
            BandPoint {
                x: 1.0,
                low: 2.0,
                middle: 2.5,
                high: 3.0,
            },
        ];
        let curves = ["full", "no pruning"].map(|name| Curve {
            name,
            points: points.clone(),
        });
        let text = bands(&LABELS, &curves, Some(4.0), Corner::LowerRight).unwrap();
        assert!(
            ["full", "no pruning", "proven optimum"]
                .iter()
                .all(|name| text.contains(name))
        );
        assert_eq!(text.matches("<polygon").count(), 2);
        assert!(
            !bands(&LABELS, &curves, None, Corner::UpperRight)
                .unwrap()
                .contains("proven optimum")
        );
    }

    #[test]
    fn nothing_and_one_point_are_charts_too() {
        assert!(scatter(&LABELS, &[], &[]).unwrap().contains("ρ = undefined"));
        assert!(scatter(&LABELS, &[1.0], &[0.0]).is_ok());
        assert!(sorted_scores(&LABELS, &[]).is_ok());
        assert!(sorted_scores(&LABELS, &[("volume", &[1.0])]).is_ok());
        assert!(bands(&LABELS, &[], None, Corner::LowerRight).is_ok());
    }

    #[test]
    fn ticks_are_short() {
        let ticks = [0.0, 0.25, -1.5, 12.0, 1234.0, 2.5e-7, 0.1 + 0.2].map(|v| tick(&v));
        assert_eq!(ticks, ["0", "0.25", "-1.5", "12", "1234", "2.5e-7", "0.3"]);
    }
}
