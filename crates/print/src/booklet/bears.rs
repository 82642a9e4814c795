//! The last cell of the booklet: loads that the finished kit withstands, and a picture of its weakest place.

use shellock_geom::Vec3;
use shellock_render::stills::{Camera, Painted, projection, render};

use super::view::Lookout;
use super::{
    ARROW, Color, Drawn, FAINT, Facing, GREY, INK, OTHER_DENSITY, STEPS, WHITE, bold, cell_mm, draw_number,
    small,
};
use crate::fonts::Fonts;
use crate::pdf::{Page, Style, width_mm};

/// Distance between lines of text, mm.
const LINE_MM: f64 = 5.2;
/// Half the width of the line along a seam, and radius of the mark on the weakest place, mm.
const HALF_SEAM_MM: f64 = 0.5;
const MARK_MM: f64 = 1.25;

/// Loads that the finished kit withstands, in words and figures.
#[derive(Clone, Debug, Default)]
pub struct Borne {
    /// Load cases, each with the load that it withstands.
    pub figures: Vec<(String, String)>,
    /// Note on how reliable the figures are.
    pub note: String,
    /// Place that gives way first, if known.
    pub weakest: Option<WeakPlace>,
}

/// Place where a kit gives way.
#[derive(Clone, Debug)]
pub struct WeakPlace {
    /// Load case, kind of failure and place, in words.
    pub words: String,
    /// Position of the place on the assembled kit, mm.
    pub at: Vec3,
    /// Seam through the place, as polylines, mm.
    pub lines: Vec<Vec<Vec3>>,
    /// Numbers of the two pieces that separate.
    pub between: [u32; 2],
}

/// Fills the cell whose upper left corner is at `[x, y]`, mm.
pub(super) fn fill(page: &mut Page<'_>, [x, y]: [f64; 2], drawn: &[Drawn<'_>], borne: &Borne) {
    let cell = cell_mm(STEPS, 0.0);
    let (left, room_mm) = (x + 1.0, cell[0] - 4.0);
    page.text([left, y + 6.6], bold(5.0, INK), "loads it can take");
    let mut down = y + 6.6;
    for (what, much) in &borne.figures {
        down += LINE_MM;
        page.text_within([left, down], 0.62 * room_mm, plain(INK), what);
        page.text_within(
            [left + 0.64 * room_mm, down],
            0.36 * room_mm,
            bold(3.4, INK),
            much,
        );
    }
    down += LINE_MM;
    page.text_within([left, down], room_mm, small(FAINT), &borne.note);
    let Some(weakest) = &borne.weakest else { return };
    down += 1.6 * LINE_MM;
    page.text([left, down], bold(3.8, ARROW), "fails first");
    for line in wrap(page.fonts(), &weakest.words, plain(INK), room_mm) {
        down += LINE_MM;
        page.text_within([left, down], room_mm, plain(INK), &line);
    }
    down += 3.0;
    place(
        page,
        [left, down],
        [room_mm, y + cell[1] - 4.0 - down],
        drawn,
        weakest,
    );
}

/// Draws the two separating pieces in their colours among the others in grey, with the seam and the weakest
/// place.
fn place(
    page: &mut Page<'_>,
    [left, top]: [f64; 2],
    [width_mm, height_mm]: [f64; 2],
    drawn: &[Drawn<'_>],
    weakest: &WeakPlace,
) {
    let pieces: Vec<_> = drawn.iter().map(|d| d.piece).collect();
    let lookout = Lookout::new(&pieces);
    let direction = lookout.best(weakest.at, &weakest.lines);
    let camera = Camera::along(direction, Vec3::Z);
    let is_parting = |d: &Drawn<'_>| weakest.between.contains(&d.piece.number);
    let facing: Vec<Facing> = drawn.iter().map(|d| d.visible_faces(direction)).collect();
    let color = |d: &Drawn<'_>| if is_parting(d) { d.piece.color } else { GREY };
    let scene: Vec<Painted<'_>> = facing
        .iter()
        .zip(drawn)
        .map(|(f, d)| f.paint(color(d), Vec3::ZERO))
        .collect();
    let size = [width_mm, height_mm].map(|mm| (mm.max(1.0) * OTHER_DENSITY) as usize);
    let on_picture = projection(&scene, &camera, size[0], size[1]);
    let on_page = |p: Vec3| {
        let [x, y] = on_picture(p).map(|px| px / OTHER_DENSITY);
        [left + x, top + y]
    };
    page.picture(
        [left, top],
        size[0] as f64 / OTHER_DENSITY,
        render(&scene, &camera, size[0], size[1]),
    );
    for step in weakest.lines.iter().flat_map(|line| line.windows(2)) {
        if lookout.is_seen(0.5 * (step[0] + step[1]), direction) {
            stroke(page, [on_page(step[0]), on_page(step[1])]);
        }
    }
    page.disc(on_page(weakest.at), MARK_MM + 0.35, WHITE);
    page.disc(on_page(weakest.at), MARK_MM, ARROW);
    for (i, d) in drawn.iter().filter(|d| is_parting(d)).enumerate() {
        let middle = [left + 5.0 + 11.0 * i as f64, top + height_mm - 5.0];
        draw_number(page, middle, 4.2, d.piece.color, &d.piece.number.to_string());
    }
}

/// Draws a straight line of fixed width; nothing for coinciding ends.
fn stroke(page: &mut Page<'_>, [from, to]: [[f64; 2]; 2]) {
    let way = [to[0] - from[0], to[1] - from[1]];
    let far = way[0].hypot(way[1]);
    if far < 1e-6 {
        return;
    }
    let aside = [-way[1], way[0]].map(|x| HALF_SEAM_MM * x / far);
    let corner = |p: [f64; 2], sign: f64| [p[0] + sign * aside[0], p[1] + sign * aside[1]];
    let corners = [
        corner(from, 1.0),
        corner(to, 1.0),
        corner(to, -1.0),
        corner(from, -1.0),
    ];
    page.polygon(&corners, ARROW, 0.0, ARROW);
}

pub(super) fn plain(color: Color) -> Style {
    Style {
        size_mm: 3.4,
        is_bold: false,
        color,
    }
}

/// Breaks a text into lines of whole words no wider than `room_mm`. A single longer word keeps its width.
pub(super) fn wrap(fonts: &Fonts<'_>, text: &str, style: Style, room_mm: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width_mm(fonts, style, &format!("{line} {word}")) <= room_mm => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_have_room_and_all_words() {
        let text =
            "where it is pressed as it lies: pins between pieces 7 and 10 bend (in the middle, 37 mm up)";
        let fonts = Fonts::new(&[]);
        let lines = wrap(&fonts, text, plain(INK), 50.0);
        let fits = |line: &String| width_mm(&fonts, plain(INK), line) <= 50.0;
        assert!(lines.len() > 1 && lines.iter().all(fits));
        assert_eq!(lines.join(" "), text);
        assert!(wrap(&fonts, "", plain(INK), 50.0).is_empty());
    }
}
