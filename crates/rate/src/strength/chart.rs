//! Chart of the falls (Fig. 7): the stress in the decisive fall, the stress along the seams with the
//! connector sizes that it asks for, and the stress over the thickness.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use rayon::prelude::*;
use shellock_geom::{TriMesh, Vec3};
use shellock_render::stills::{Camera, Painted, render};
use shellock_render::svg::{begin, end, text};

use super::Strength;

/// Pixels of a view along each side.
const VIEW_PX: usize = 420;
/// Width of the chart and of the colour scale, pixels.
const CHART_PX: f64 = 440.0;
/// Height of a row, pixels: a title, two views, a line of words.
const ROW_PX: f64 = VIEW_PX as f64 + 60.0;
/// Colours from no stress to the strength, evenly spaced, sRGB. They grow lighter, so that they remain
/// distinct in grey.
const SCALE: [[u8; 3]; 5] = [
    [68, 1, 84],
    [59, 82, 139],
    [33, 145, 140],
    [94, 201, 98],
    [253, 231, 37],
];
/// Colour of stresses above the strength.
const TOO_MUCH: [u8; 3] = [214, 39, 40];
/// Colour of places where the model is solid.
const SOLID: [u8; 3] = [170, 170, 170];
/// Colour of the model below its seams.
const PALE: [u8; 3] = [225, 222, 215];
/// Number of sides of the tube that shows a seam.
const TUBE_SIDES: u32 = 8;

/// A seam with its stress and its connector size.
#[derive(Clone, Debug)]
pub struct SeamStress {
    /// Points in order, mm.
    pub points: Vec<Vec3>,
    /// Largest stress of all falls at each point, MPa.
    pub stress_mpa: Vec<f64>,
    /// Connector size D, mm, equal to the diameter of the tube.
    pub size_mm: f64,
}

/// Draws the chart as SVG text with embedded pictures, about 1300 × 960 pixels. `stand` turns the model so
/// that it stands on z = 0.
pub fn strength_chart(
    strength: &Strength,
    strength_mpa: f64,
    seams: &[SeamStress],
    stand: impl Fn(Vec3) -> Vec3 + Sync,
) -> String {
    let turned = |mesh: &TriMesh| TriMesh {
        points: mesh.points.iter().map(|p| stand(*p)).collect(),
        triangles: mesh.triangles.clone(),
    };
    let model = turned(&strength.mesh);
    let paint = |(mpa, is_solid): (&f64, &bool)| {
        if *is_solid {
            SOLID
        } else {
            color(mpa / strength_mpa)
        }
    };
    let stress: Vec<[u8; 3]> = strength
        .deciding_mpa
        .iter()
        .zip(&strength.is_solid)
        .map(paint)
        .collect();
    let field = [Painted {
        mesh: &model,
        color: PALE,
        face_colors: Some(&stress),
        shift: Vec3::ZERO,
        normals: None,
    }];
    let (tubes, tube_colors) = tubes(seams, strength_mpa);
    let tubes = turned(&tubes);
    let along = [
        Painted {
            mesh: &model,
            color: PALE,
            face_colors: None,
            shift: Vec3::ZERO,
            normals: None,
        },
        Painted {
            mesh: &tubes,
            color: PALE,
            face_colors: Some(&tube_colors),
            shift: Vec3::ZERO,
            normals: None,
        },
    ];
    let views = [
        (&field[..], Camera::front()),
        (&field, Camera::back()),
        (&along, Camera::front()),
        (&along, Camera::back()),
    ];
    let pictures: Vec<Vec<u8>> = views
        .par_iter()
        .map(|(scene, camera)| render(scene, camera, VIEW_PX, VIEW_PX).on([255; 3]).png())
        .collect();
    page(strength, strength_mpa, seams, &pictures)
}

/// Colour of a share of the strength.
fn color(share: f64) -> [u8; 3] {
    if share > 1.0 {
        return TOO_MUCH;
    }
    let place = share.max(0.0) * (SCALE.len() - 1) as f64;
    let i = (place as usize).min(SCALE.len() - 2);
    let t = place - i as f64;
    std::array::from_fn(|k| {
        (f64::from(SCALE[i][k]) * (1.0 - t) + f64::from(SCALE[i + 1][k]) * t).round() as u8
    })
}

/// Tube around each seam, open at its ends, and the colours of its triangles.
fn tubes(seams: &[SeamStress], strength_mpa: f64) -> (TriMesh, Vec<[u8; 3]>) {
    let mut mesh = TriMesh::default();
    let mut colors = Vec::new();
    for seam in seams {
        for (ends, mpa) in seam.points.windows(2).zip(seam.stress_mpa.windows(2)) {
            let Some(along) = (ends[1] - ends[0]).try_normalize() else {
                continue;
            };
            let (x, y) = along.any_orthonormal_pair();
            let first = mesh.points.len() as u32;
            for end in ends {
                mesh.points.extend((0..TUBE_SIDES).map(|side| {
                    let (sin, cos) =
                        (std::f64::consts::TAU * f64::from(side) / f64::from(TUBE_SIDES)).sin_cos();
                    *end + 0.5 * seam.size_mm * (cos * x + sin * y)
                }));
            }
            for side in 0..TUBE_SIDES {
                let [a, b] = [first + side, first + (side + 1) % TUBE_SIDES];
                mesh.triangles
                    .extend([[a, b, b + TUBE_SIDES], [a, b + TUBE_SIDES, a + TUBE_SIDES]]);
            }
            colors.resize(mesh.triangles.len(), color(mpa[0].max(mpa[1]) / strength_mpa));
        }
    }
    (mesh, colors)
}

fn page(strength: &Strength, strength_mpa: f64, seams: &[SeamStress], pictures: &[Vec<u8>]) -> String {
    let view = VIEW_PX as f64;
    let (width, height) = (2.0 * view + CHART_PX, 2.0 * ROW_PX);
    let mut svg = begin(width, height);
    let sizes = seams.iter().map(|s| s.size_mm);
    let (least, most) = (
        sizes.clone().fold(f64::INFINITY, f64::min),
        sizes.fold(0.0, f64::max),
    );
    let rows = [
        format!(
            "Von Mises stress in fall {} of the wall of {:.2} mm",
            strength.decisive_fall.0 + 1,
            strength.thickness_mm
        ),
        format!(
            "Largest stress of all falls along the seams; connectors {least:.1} to {most:.1} mm, drawn as \
             thick"
        ),
    ];
    for (row, title) in rows.iter().enumerate() {
        let top = row as f64 * ROW_PX;
        text(&mut svg, [16.0, top + 30.0], "font-weight=\"bold\"", title);
        for (column, picture) in pictures[2 * row..2 * row + 2].iter().enumerate() {
            let _ = writeln!(
                svg,
                "<image x=\"{}\" y=\"{}\" width=\"{view}\" height=\"{view}\" \
                 href=\"data:image/png;base64,{}\"/>",
                column as f64 * view,
                top + 44.0,
                STANDARD.encode(picture)
            );
        }
    }
    legend(&mut svg, [2.0 * view + 40.0, 60.0], strength_mpa);
    curve(
        &mut svg,
        [2.0 * view + 70.0, ROW_PX + 60.0],
        strength,
        strength_mpa,
    );
    end(svg)
}

/// Draws the legend of the colours.
fn legend(svg: &mut String, [x, y]: [f64; 2], strength_mpa: f64) {
    const STEPS: u32 = 60;
    const STEP_PX: f64 = 4.0;
    for step in 0..STEPS {
        let share = (f64::from(step) + 0.5) / f64::from(STEPS);
        swatch(
            svg,
            [x, y + f64::from(STEPS - 1 - step) * STEP_PX],
            [24.0, STEP_PX + 0.5],
            color(share),
        );
    }
    let (bottom, height) = (y + f64::from(STEPS) * STEP_PX, f64::from(STEPS) * STEP_PX);
    for quarter in 0..=4 {
        let share = f64::from(quarter) / 4.0;
        let words = format!("{:.0} MPa", share * strength_mpa);
        text(svg, [x + 34.0, bottom - share * height + 5.0], "", &words);
    }
    for (i, (paint, words)) in [
        (TOO_MUCH, "above the strength of the material"),
        (SOLID, "solid: too thin for a cavity"),
    ]
    .iter()
    .enumerate()
    {
        let top = bottom + 24.0 + 26.0 * i as f64;
        swatch(svg, [x, top], [24.0, 16.0], *paint);
        text(svg, [x + 34.0, top + 13.0], "", words);
    }
}

/// Draws the stress over the thickness, as far as computed, with the strength as a line and the choice as a
/// dot.
fn curve(svg: &mut String, [x, y]: [f64; 2], strength: &Strength, strength_mpa: f64) {
    const SIZE: [f64; 2] = [330.0, 290.0];
    text(
        svg,
        [x - 40.0, y - 36.0],
        "font-weight=\"bold\"",
        "Stress and thickness",
    );
    let last_mm = strength.trials.iter().map(|t| t.thickness_mm).fold(1.0, f64::max);
    let last_mm = (last_mm / 2.0).ceil() * 2.0;
    let stresses = strength.trials.iter().map(|t| t.stress_mpa);
    let top_mpa = (stresses.fold(strength_mpa, f64::max) / 20.0).ceil() * 20.0;
    let at = |mm: f64, mpa: f64| [x + mm / last_mm * SIZE[0], y + (1.0 - mpa / top_mpa) * SIZE[1]];
    for i in 0..=4 {
        let share = f64::from(i) / 4.0;
        let ([_, line], [tick, _]) = (at(0.0, share * top_mpa), at(share * last_mm, 0.0));
        let _ = writeln!(svg, "<path d=\"M{x} {line:.1}h{}\" stroke=\"#ddd\"/>", SIZE[0]);
        text(
            svg,
            [x - 8.0, line + 5.0],
            "text-anchor=\"end\"",
            &format!("{:.0}", share * top_mpa),
        );
        text(
            svg,
            [tick, y + SIZE[1] + 20.0],
            "text-anchor=\"middle\"",
            &format!("{:.1}", share * last_mm),
        );
    }
    text(
        svg,
        [x + SIZE[0] / 2.0, y + SIZE[1] + 42.0],
        "text-anchor=\"middle\"",
        "thickness, mm",
    );
    text(svg, [x - 8.0, y - 12.0], "text-anchor=\"end\"", "MPa");
    let [_, limit] = at(0.0, strength_mpa);
    let _ = writeln!(
        svg,
        "<path d=\"M{x} {limit:.1}h{}\" stroke=\"#d62728\" stroke-dasharray=\"6 4\"/>",
        SIZE[0]
    );
    text(
        svg,
        [x + 6.0, limit - 6.0],
        "fill=\"#d62728\"",
        "the material\u{2019}s strength",
    );
    let points: Vec<[f64; 2]> = strength
        .trials
        .iter()
        .map(|t| at(t.thickness_mm, t.stress_mpa))
        .collect();
    let path: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    let _ = writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#3b528b\" stroke-width=\"2\"/>",
        path.join(" ")
    );
    for [cx, cy] in points {
        let _ = writeln!(
            svg,
            "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"3\" fill=\"#3b528b\"/>"
        );
    }
    let [cx, cy] = at(strength.thickness_mm, strength.stress_mpa);
    let _ = writeln!(
        svg,
        "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"7\" fill=\"none\" stroke=\"black\" stroke-width=\"2\"/>"
    );
    let words = format!("{:.2} mm, {:.0} MPa", strength.thickness_mm, strength.stress_mpa);
    text(svg, [cx + 4.0, cy + 24.0], "text-anchor=\"middle\"", &words);
}

fn swatch(svg: &mut String, [x, y]: [f64; 2], [width, height]: [f64; 2], [r, g, b]: [u8; 3]) {
    // Writing to a string cannot fail.
    let _ = writeln!(
        svg,
        "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width}\" height=\"{height}\" fill=\"rgb({r},{g},{b})\"/>"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_the_scale_at_its_ends_grow_lighter_and_warn_above() {
        assert_eq!(
            (color(-1.0), color(0.0), color(1.0), color(1.001)),
            (SCALE[0], SCALE[0], SCALE[4], TOO_MUCH)
        );
        let light = |share: f64| {
            color(share)
                .map(f64::from)
                .iter()
                .zip([0.2126, 0.7152, 0.0722])
                .map(|(c, w)| c * w)
                .sum::<f64>()
        };
        assert!((1..=20).all(|i| light(f64::from(i) / 20.0) > light(f64::from(i - 1) / 20.0)));
    }

    #[test]
    fn a_tube_keeps_its_distance_from_the_seam_and_takes_the_greater_stress() {
        let points = vec![Vec3::ZERO, Vec3::new(0.0, 0.0, 5.0), Vec3::new(0.0, 0.0, 9.0)];
        let seam = SeamStress {
            points,
            stress_mpa: vec![0.0, 42.0, 21.0],
            size_mm: 3.0,
        };
        let (mesh, colors) = tubes(&[seam], 42.0);
        assert!(
            mesh.points
                .iter()
                .all(|p| (p.truncate().length() - 1.5).abs() < 1e-12)
        );
        assert_eq!(colors, vec![SCALE[4]; 4 * TUBE_SIDES as usize]);
    }
}
