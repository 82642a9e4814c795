//! Section of the connector over the angle T, and of a rail, drawn from the parts that pieces are made of.

use shellock::connector::{ConnectorParams, ProfileRect, RailPart, RunShape, RunStation, Section};
use shellock_geom::Vec3;

use super::sheet::{Sheet, WIDTH};

/// Connector size and wall, mm, and their scale on the sheet.
const SIZE_MM: f64 = 2.5;
const WALL_MM: f64 = 2.0;
const PX_PER_MM: f64 = 22.0;
/// Half of the drawn width of the wall, mm.
const HALF_MM: f64 = 5.2;
/// Angles T that are shown, degrees: from a tongue to the most backward one that is made.
const ANGLES: [f64; 5] = [-90.0, -45.0, 0.0, 30.0, 60.0];

const MALE: &str = "#e8a05c";
const FEMALE: &str = "#7fa6d8";
const THIN: &str = "stroke=\"#333\" stroke-width=\"0.8\"";

/// Draws sections at five angles and of a rail, three in a row.
pub fn profiles() -> String {
    const CELL: [f64; 2] = [WIDTH / 3.0, 212.0];
    let mut sheet = Sheet::new(2.0 * CELL[1] + 34.0);
    let seams = ANGLES.map(|degrees| (degrees, RunShape::Seam));
    for (i, (degrees, shape)) in seams
        .into_iter()
        .chain([(0.0, RunShape::Rail(RailPart::Full))])
        .enumerate()
    {
        let at = [
            (i % 3) as f64 * CELL[0] + 0.5 * CELL[0],
            (i / 3) as f64 * CELL[1] + 92.0,
        ];
        section(&mut sheet, at, degrees, shape);
        let words = match (degrees, shape) {
            (_, RunShape::Rail(_)) => "rail: tongue left, key right".to_owned(),
            (d, _) if d < 0.0 => format!("T = \u{2212}{}°, forward", -d),
            (0.0, _) => "T = 0°, straight out".to_owned(),
            (d, _) => format!("T = {d}°, backward"),
        };
        sheet.amid([at[0], at[1] - 78.0], &words);
    }
    let at = 2.0 * CELL[1] + 14.0;
    legend(&mut sheet, [40.0, at], MALE, "male: pin");
    legend(&mut sheet, [160.0, at], FEMALE, "female: channel");
    sheet.words([286.0, at], "arrow: ŝ, how the male leaves");
    let clearance_mm = ConnectorParams::default().clearance_mm;
    let sizes = format!("D = {SIZE_MM}, wall {WALL_MM}, gap {clearance_mm} mm");
    sheet.words([560.0, at], &sizes);
    shellock_render::svg::end(sheet.0)
}

fn legend(sheet: &mut Sheet, [x, y]: [f64; 2], fill: &str, words: &str) {
    let corners = [
        [x - 20.0, y - 11.0],
        [x - 6.0, y - 11.0],
        [x - 6.0, y + 1.0],
        [x - 20.0, y + 1.0],
    ];
    sheet.polygon(&corners, fill, THIN);
    sheet.words([x, y], words);
}

/// Draws a section; `at` is the seam on the wall's inner side.
fn section(sheet: &mut Sheet, at: [f64; 2], degrees: f64, shape: RunShape) {
    let params = ConnectorParams::default();
    let station = station(degrees, shape, &params);
    // x across the seam towards the female, y outwards; the inner side of the wall is y = 0.
    let on_sheet = |p: [f64; 2]| [at[0] + PX_PER_MM * p[0], at[1] - PX_PER_MM * p[1]];
    let parts = Section::at(&params, &station);
    let draw = |sheet: &mut Sheet, parts: &[Option<ProfileRect>], fill: &str| {
        for part in parts.iter().flatten() {
            let corners = part.corners(&station).map(|c| on_sheet([c.x, c.y]));
            sheet.polygon(&corners, fill, "");
        }
    };
    let lean = match shape {
        RunShape::Rail(_) => 0.0,
        RunShape::Seam | RunShape::Stop => station.theta.max(0.0).tan(),
    };
    let gap = 0.5 * params.clearance_mm;
    let wall = |side: f64| {
        let far = side * HALF_MM;
        [
            [side * gap, 0.0],
            [side * gap + lean * WALL_MM, WALL_MM],
            [far, WALL_MM],
            [far, 0.0],
        ]
        .map(on_sheet)
    };
    // In a rail, n leads from the neighbour, which has the tongue, to the key.
    draw(sheet, &parts.male, MALE);
    draw(sheet, &parts.female, FEMALE);
    // Parts reach into the wall that they hang from. Whatever lies in the seam or in the other's wall is
    // carved off.
    let slit = [
        [-gap, 0.0],
        [gap, 0.0],
        [gap + lean * WALL_MM, WALL_MM],
        [lean * WALL_MM - gap, WALL_MM],
    ];
    sheet.polygon(&slit.map(on_sheet), "white", "");
    sheet.polygon(&wall(-1.0), MALE, "");
    sheet.polygon(&wall(1.0), FEMALE, "");
    let outside = on_sheet([-HALF_MM, WALL_MM + 0.18]);
    shellock_render::svg::text(&mut sheet.0, outside, "fill=\"#555\" font-size=\"12\"", "outside");
    if shape == RunShape::Seam {
        arrow(sheet, &station, &on_sheet);
    }
}

/// Draws ŝ as an arrow, on the male's side of the cavity.
fn arrow(sheet: &mut Sheet, station: &RunStation, on_sheet: &impl Fn([f64; 2]) -> [f64; 2]) {
    // The arrow is beside the channel, which leans to the other side if ŝ is backward.
    let foot = if station.theta > 0.1 {
        [3.2, -3.2]
    } else {
        [-3.9, -2.0]
    };
    let along = [station.s.x, station.s.y];
    let aside = [-along[1], along[0]];
    let place = |a: f64, b: f64| {
        on_sheet([
            foot[0] + a * along[0] + b * aside[0],
            foot[1] + a * along[1] + b * aside[1],
        ])
    };
    sheet.line(
        [place(-0.75, 0.0), place(0.6, 0.0)],
        "stroke=\"#ce2c1e\" stroke-width=\"3\"",
    );
    let head = [place(0.95, 0.0), place(0.4, 0.32), place(0.4, -0.32)];
    sheet.polygon(&head, "#ce2c1e", "");
}

fn station(degrees: f64, shape: RunShape, params: &ConnectorParams) -> RunStation {
    let theta = degrees.to_radians();
    let (sin, cos) = theta.sin_cos();
    let (to_female, outwards) = (Vec3::X, Vec3::Y);
    let is_rail = shape != RunShape::Seam;
    RunStation {
        point: Vec3::ZERO,
        tangent: Vec3::Z,
        n: if is_rail {
            to_female
        } else {
            cos * to_female - sin * outwards
        },
        s: if is_rail {
            outwards
        } else {
            sin * to_female + cos * outwards
        },
        theta,
        depth: 1.0,
        arc_mm: 0.0,
        size_mm: SIZE_MM,
        clearance_mm: params.clearance_of(is_rail),
        shape,
    }
}
