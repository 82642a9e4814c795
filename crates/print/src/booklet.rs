//! The assembly booklet: a cover, an overview of all numbered pieces, then one picture per step, like the
//! sheets that come with furniture.
//!
//! Pieces already in place are grey, the new piece has its colour, and an arrow shows where it goes. Each
//! step is drawn from the viewpoint that shows most of the new piece, its place and its path (`view`). A note
//! marks the steps where the viewpoint changes.

mod bears;
mod texts;
mod view;

use rayon::prelude::*;
use shellock_geom::{Aabb, TriMesh, Vec3};
use shellock_render::stills::{Camera, Image, Painted, crease_normals, projection, render};
use shellock_render::{ReportPiece, exploded_shifts, from_inside};

use crate::fonts::{ExtraFont, Fonts, isolate};
pub use crate::pdf::{Color, Paper};
use crate::pdf::{PAGE_MM, Page, Style, document};
use bears::wrap;
pub use bears::{Borne, WeakPlace};
use texts::text_pages;
use view::{Sight, side, sights};

/// Margin of a page, mm.
const RIM_MM: f64 = 14.0;
/// Grid of steps on a page: columns and rows.
const STEPS: [usize; 2] = [2, 2];
/// Grid of pieces on a page, columns and rows; `MANY_PIECES` is for kits that do not fit on one page of it.
const PIECES: [usize; 2] = [3, 4];
const MANY_PIECES: [usize; 2] = [4, 5];
/// Resolution of step pictures and of all other pictures, pixels per mm.
const STEP_DENSITY: f64 = 4.4;
const OTHER_DENSITY: f64 = 4.0;

const INK: Color = [34, 34, 38];
const FAINT: Color = [110, 110, 118];
const GREY: Color = [206, 206, 204];
const ARROW: Color = [206, 44, 30];
const WHITE: Color = [255; 3];

/// Content of a booklet: the pieces of a kit and the texts around them.
#[derive(Default)]
pub struct Booklet<'a> {
    /// Heading on the cover page.
    pub title: String,
    /// Lines of text below the heading.
    pub lines: Vec<String>,
    /// Loads that the finished kit withstands, if known.
    pub bears: Option<Borne>,
    /// Pieces in assembled position, in any order. z is up and the model faces −y.
    pub pieces: Vec<ReportPiece<'a>>,
    /// Sections on pages before the first step; empty for none.
    pub before: Vec<Section>,
    /// Sections on pages after the last step; empty for none.
    pub after: Vec<Section>,
    /// Paper that the booklet is printed on.
    pub paper: Paper,
    /// Fonts for characters that the program's fonts lack
    /// ([`missing_characters`](crate::fonts::missing_characters)), the preferred first.
    pub fonts: Vec<ExtraFont>,
}

/// A heading with paragraphs of text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// Heading of the section.
    pub title: String,
    /// Paragraphs, one string each.
    pub lines: Vec<String>,
}

/// One assembly step as the booklet draws it.
pub struct Step {
    /// Earlier pieces in grey and the new piece in its colour, drawn back along its path.
    pub picture: Image,
    /// Corners of the arrow over the picture, pixels. Empty for the first piece, which has no path.
    pub arrow: Vec<[f64; 2]>,
    /// Colour and number of the new piece.
    pub piece: (Color, u32),
    /// Instruction, such as the side from which the piece is inserted.
    pub heading: String,
    /// Words for the viewpoint, and true if it differs from the previous step's.
    pub viewpoint: (String, bool),
}

/// Best viewing direction for the installation of each of `pieces`, in their order: unit vectors from the
/// viewer to the scene.
pub fn looks(pieces: &[ReportPiece<'_>]) -> Vec<[f64; 3]> {
    let mut order: Vec<usize> = (0..pieces.len()).collect();
    order.sort_by_key(|&i| pieces[i].order);
    let in_order: Vec<&ReportPiece<'_>> = order.iter().map(|&i| &pieces[i]).collect();
    let mut looks = vec![[0.0; 3]; pieces.len()];
    for (sight, &i) in sights(&in_order).iter().zip(&order) {
        looks[i] = sight.direction.to_array();
    }
    looks
}

/// A piece with its shading normals, which several pictures share.
struct Drawn<'a> {
    piece: &'a ReportPiece<'a>,
    normals: Vec<[Vec3; 3]>,
}

/// Front faces of a piece. Pieces are closed, so no other face is visible: half the work.
struct Facing {
    mesh: TriMesh,
    normals: Vec<[Vec3; 3]>,
}

impl Drawn<'_> {
    /// Returns the faces turned towards a viewer who looks along `direction`.
    fn visible_faces(&self, direction: Vec3) -> Facing {
        let mesh = self.piece.mesh;
        let seen = (0..mesh.triangles.len()).filter(|&f| mesh.double_area_vector(f).dot(direction) < 0.0);
        let (triangles, normals) = seen.map(|f| (mesh.triangles[f], self.normals[f])).unzip();
        Facing {
            mesh: TriMesh {
                points: mesh.points.clone(),
                triangles,
            },
            normals,
        }
    }
}

impl Facing {
    fn paint(&self, color: Color, shift: Vec3) -> Painted<'_> {
        Painted {
            mesh: &self.mesh,
            color,
            face_colors: None,
            shift,
            normals: Some(&self.normals),
        }
    }
}

/// Renders all pieces in their colours from the front, each moved by its entry in `shifts`.
fn all_pieces(drawn: &[Drawn<'_>], shifts: &[Vec3], [width, height]: [usize; 2]) -> Image {
    let camera = Camera::front();
    let facing: Vec<Facing> = drawn
        .par_iter()
        .map(|d| d.visible_faces(camera.direction))
        .collect();
    let all = facing.iter().zip(drawn).zip(shifts);
    let scene: Vec<Painted<'_>> = all
        .map(|((f, d), &shift)| f.paint(d.piece.color, shift))
        .collect();
    render(&scene, &camera, width, height)
}

impl Booklet<'_> {
    /// Writes the booklet as a PDF file. Deterministic: equal pieces and fonts give equal bytes. Fonts of
    /// which one cannot be embedded are left out.
    pub fn pdf(&self) -> Vec<u8> {
        self.document(&self.fonts)
            .or_else(|| self.document(&[]))
            .expect("the program's own fonts can be embedded")
    }

    fn document(&self, extra: &[ExtraFont]) -> Option<Vec<u8>> {
        let fonts = Fonts::new(extra);
        document(&self.title, self.pages(&fonts), self.paper)
    }

    fn pages<'f>(&self, fonts: &'f Fonts<'f>) -> Vec<Page<'f>> {
        let drawn = self.list_drawings();
        let mut pages = vec![self.cover(&drawn, fonts)];
        pages.extend(text_pages("Before you begin", &self.before, fonts));
        pages.extend(pieces_pages(&drawn, fonts));
        pages.extend(steps_pages(&drawn, self.bears.as_ref(), fonts));
        pages.extend(text_pages("Afterwards", &self.after, fonts));
        let n_pages = pages.len();
        for (i, page) in pages.iter_mut().enumerate().skip(1) {
            let foot = format!("{}  –  {} of {n_pages}", isolate(&self.title), i + 1);
            let style = small(FAINT);
            let room_mm = PAGE_MM[0] - 2.0 * RIM_MM;
            let left = PAGE_MM[0] - RIM_MM - page.width_mm(style, &foot).min(room_mm);
            page.text_within([left, PAGE_MM[1] - 8.0], room_mm, style, &foot);
        }
        pages
    }

    /// Draws the steps alone, in order of installation, for output other than PDF.
    pub fn steps(&self) -> Vec<Step> {
        let drawn = self.list_drawings();
        let pieces: Vec<&ReportPiece<'_>> = drawn.iter().map(|d| d.piece).collect();
        let sights = sights(&pieces);
        let step = |i: usize| {
            let piece = drawn[i].piece;
            let (picture, way) = step_picture(&drawn, i, &sights[i], step_pixels());
            // `arrow` takes lengths in mm, not pixels.
            let on_paper = |way: [[f64; 2]; 2]| arrow(way.map(|p| p.map(|px| px / STEP_DENSITY)));
            let in_pixels = |corner: [f64; 2]| corner.map(|mm| mm * STEP_DENSITY);
            let arrow = way.map(on_paper).unwrap_or_default();
            Step {
                picture,
                arrow: arrow.into_iter().map(in_pixels).collect(),
                piece: (piece.color, piece.number),
                heading: what_to_do(piece, i),
                viewpoint: seen_from(&sights, i),
            }
        };
        (0..drawn.len()).into_par_iter().map(step).collect()
    }

    /// Returns the pieces in order of installation, with their normals.
    fn list_drawings(&self) -> Vec<Drawn<'_>> {
        let drawn = |piece| Drawn {
            piece,
            normals: crease_normals(piece.mesh),
        };
        let mut drawn: Vec<Drawn<'_>> = self.pieces.par_iter().map(drawn).collect();
        drawn.sort_by_key(|d| d.piece.order);
        drawn
    }

    fn cover<'f>(&self, drawn: &[Drawn<'_>], fonts: &'f Fonts<'f>) -> Page<'f> {
        let mut page = Page::new(fonts);
        let room_mm = PAGE_MM[0] - 2.0 * RIM_MM;
        page.text_within([RIM_MM, 30.0], room_mm, bold(11.0, INK), &self.title);
        let seen = format!("the pictures show it from {}", side(-Camera::front().direction));
        let lines: Vec<&String> = self.lines.iter().chain([&seen]).collect();
        for (i, line) in lines.iter().enumerate() {
            page.text_within(
                [RIM_MM, 40.0 + 6.0 * i as f64],
                room_mm,
                Style {
                    size_mm: 4.2,
                    is_bold: false,
                    color: FAINT,
                },
                line,
            );
        }
        let in_order: Vec<ReportPiece<'_>> = drawn.iter().map(|d| d.piece.clone()).collect();
        let (together, apart) = (vec![Vec3::ZERO; drawn.len()], exploded_shifts(&in_order));
        let top = 46.0 + 6.0 * lines.len() as f64;
        let height = 0.5 * (PAGE_MM[1] - RIM_MM - top);
        let width = PAGE_MM[0] - 2.0 * RIM_MM;
        for (i, shifts) in [together, apart].iter().enumerate() {
            let picture = all_pieces(
                drawn,
                shifts,
                [width, height].map(|mm| (mm * OTHER_DENSITY) as usize),
            );
            page.picture([RIM_MM, top + i as f64 * height], width, picture);
        }
        page
    }
}

/// Lays out all pieces by number, each seen from inside.
fn pieces_pages<'f>(drawn: &[Drawn<'_>], fonts: &'f Fonts<'f>) -> Vec<Page<'f>> {
    let middle = drawn
        .iter()
        .fold(Aabb::EMPTY, |b, d| b.union(d.piece.mesh.bounds()))
        .center();
    let grid = if drawn.len() > PIECES[0] * PIECES[1] {
        MANY_PIECES
    } else {
        PIECES
    };
    let cell = cell_mm(grid, 14.0);
    let picture_mm = (cell[1] - 14.0).min(cell[0] - 4.0);
    let n_pixels = (picture_mm * OTHER_DENSITY) as usize;
    let mut by_number: Vec<&Drawn<'_>> = drawn.iter().collect();
    by_number.sort_by_key(|d| d.piece.number);
    let pictures: Vec<Image> = by_number
        .par_iter()
        .map(|d| from_inside(d.piece, &d.normals, middle, n_pixels))
        .collect();
    let mut cells = by_number.into_iter().zip(pictures).peekable();
    let mut pages = Vec::new();
    while cells.peek().is_some() {
        let mut page = start_page(
            "Pieces",
            "each piece has its number on its inner side; assemble them in this order",
            fonts,
        );
        for (i, (d, picture)) in cells.by_ref().take(grid[0] * grid[1]).enumerate() {
            let [x, y] = corner_mm(i, grid, cell, 14.0);
            page.picture([x + 0.5 * (cell[0] - picture_mm), y + 12.0], picture_mm, picture);
            draw_number(
                &mut page,
                [x + 5.0, y + 6.0],
                4.6,
                d.piece.color,
                &d.piece.number.to_string(),
            );
            if let Some(role) = role(d.piece) {
                page.text([x + 12.0, y + 7.4], small(FAINT), role);
            }
        }
        pages.push(page);
    }
    pages
}

/// Caption of a piece that has a special role: the first one or the key.
fn role(piece: &ReportPiece<'_>) -> Option<&'static str> {
    match (piece.order, piece.is_key) {
        (0, _) => Some("first"),
        (_, true) => Some("the key, last"),
        _ => None,
    }
}

/// Width and height of a step's picture, mm.
fn step_mm() -> [f64; 2] {
    let cell = cell_mm(STEPS, 0.0);
    [cell[0] - 4.0, cell[1] - 24.0]
}

fn step_pixels() -> [usize; 2] {
    step_mm().map(|mm| (mm * STEP_DENSITY) as usize)
}

/// Lays out one picture per step, then the finished kit and the loads that it withstands.
fn steps_pages<'f>(drawn: &[Drawn<'_>], bears: Option<&Borne>, fonts: &'f Fonts<'f>) -> Vec<Page<'f>> {
    let pieces: Vec<&ReportPiece<'_>> = drawn.iter().map(|d| d.piece).collect();
    let sights = sights(&pieces);
    let cell = cell_mm(STEPS, 0.0);
    let (picture_mm, size) = (step_mm(), step_pixels());
    let beside = [OTHER_MM, OTHER_MM].map(|mm| (mm * STEP_DENSITY) as usize);
    let others: Vec<Option<Image>> = (0..drawn.len())
        .into_par_iter()
        .map(|i| {
            sights[i]
                .other
                .map(|direction| in_place(drawn, i, direction, beside))
        })
        .collect();
    let step_pictures: Vec<(Image, Option<[[f64; 2]; 2]>)> = (0..drawn.len())
        .into_par_iter()
        .map(|i| step_picture(drawn, i, &sights[i], room_beside(&sights[i], size)))
        .collect();
    let together = vec![Vec3::ZERO; drawn.len()];
    let finished = (!drawn.is_empty()).then(|| (all_pieces(drawn, &together, size), None));
    let mut pages = Vec::new();
    let page_of = |i: usize, pages: &mut Vec<Page<'f>>| {
        if i.is_multiple_of(STEPS[0] * STEPS[1]) {
            pages.push(Page::new(fonts));
        }
        pages.len() - 1
    };
    for (i, (picture, way)) in step_pictures.into_iter().chain(finished).enumerate() {
        let at = page_of(i, &mut pages);
        let page = &mut pages[at];
        let [x, y] = corner_mm(i, STEPS, cell, 0.0);
        let at = [x + 2.0, y + 20.0];
        page.picture(at, picture_mm[0], picture);
        if let Some(way) = way {
            let on_page = |p: [f64; 2]| [at[0] + p[0] / STEP_DENSITY, at[1] + p[1] / STEP_DENSITY];
            page.polygon(&arrow(way.map(on_page)), ARROW, 0.7, WHITE);
        }
        match drawn.get(i) {
            Some(d) => {
                step_heading(page, [x, y], d.piece, &sights, i);
                if let Some(picture) = others[i].clone() {
                    other_view(page, [x, y], &sights[i], picture);
                }
            }
            None => finish_heading(page, [x, y], drawn),
        }
    }
    if let Some(bears) = bears.filter(|_| !drawn.is_empty()) {
        let i = drawn.len() + 1;
        let at = page_of(i, &mut pages);
        bears::fill(&mut pages[at], corner_mm(i, STEPS, cell, 0.0), drawn, bears);
    }
    pages
}

/// Side length of the square second view, mm.
const OTHER_MM: f64 = 34.0;

/// Size of a step's picture in pixels, less the strip that a second view below it needs.
fn room_beside(sight: &Sight, [width, height]: [usize; 2]) -> [usize; 2] {
    let less = sight.other.map_or(0, |_| (OTHER_MM * STEP_DENSITY) as usize);
    [width, height - less]
}

/// Renders the pieces installed up to step `i`, the new one in its place, seen along `direction`.
fn in_place(drawn: &[Drawn<'_>], i: usize, direction: Vec3, size: [usize; 2]) -> Image {
    let camera = Camera::along(direction, Vec3::Z);
    let facing: Vec<Facing> = drawn[..=i].iter().map(|d| d.visible_faces(direction)).collect();
    let mut scene: Vec<Painted<'_>> = facing.iter().map(|f| f.paint(GREY, Vec3::ZERO)).collect();
    scene[i] = facing[i].paint(drawn[i].piece.color, Vec3::ZERO);
    render(&scene, &camera, size[0], size[1])
}

/// Draws the second view below a step's picture, with its caption.
fn other_view(page: &mut Page<'_>, [x, y]: [f64; 2], sight: &Sight, picture: Image) {
    let Some(direction) = sight.other else { return };
    let [width, height] = step_mm();
    let top = y + 20.0 + height - OTHER_MM;
    page.picture([x + 2.0 + width - OTHER_MM, top], OTHER_MM, picture);
    let room_mm = width - OTHER_MM - 4.0;
    let words = format!("where it goes, seen from {}", view::side(-direction));
    for (k, line) in wrap(page.fonts(), &words, small(FAINT), room_mm)
        .iter()
        .enumerate()
    {
        page.text_within(
            [x + 2.0, top + 14.0 + 5.0 * k as f64],
            room_mm,
            small(FAINT),
            line,
        );
    }
}

fn step_heading(page: &mut Page<'_>, [x, y]: [f64; 2], piece: &ReportPiece<'_>, sights: &[Sight], i: usize) {
    let left = x + 1.0;
    draw_number(
        page,
        [left + 5.0, y + 7.2],
        5.0,
        piece.color,
        &piece.number.to_string(),
    );
    let room_mm = x + cell_mm(STEPS, 0.0)[0] - 2.0 - (left + 13.0);
    page.text_within(
        [left + 13.0, y + 6.6],
        room_mm,
        Style {
            size_mm: 4.0,
            is_bold: false,
            color: INK,
        },
        &what_to_do(piece, i),
    );
    let (note, is_new) = seen_from(sights, i);
    let style = if is_new { bold(3.2, ARROW) } else { small(FAINT) };
    page.text_within([left + 13.0, y + 11.4], room_mm, style, &note);
}

fn what_to_do(piece: &ReportPiece<'_>, i: usize) -> String {
    let from = view::side(-Vec3::from(piece.installation_direction));
    match (i, piece.is_key) {
        (0, _) => "start with this piece".to_owned(),
        (_, true) => format!("the key, from {from}: it locks all pieces"),
        _ => format!("from {from}"),
    }
}

/// Words for the viewpoint of a step, and true if it differs from the previous step's.
fn seen_from(sights: &[Sight], i: usize) -> (String, bool) {
    let seen = format!("seen from {}", view::side(-sights[i].direction));
    let is_new = i > 0 && sights[i].direction != sights[i - 1].direction;
    (
        if is_new {
            format!("turn the model: {seen}")
        } else {
            seen
        },
        is_new,
    )
}

fn finish_heading(page: &mut Page<'_>, [x, y]: [f64; 2], drawn: &[Drawn<'_>]) {
    let room_mm = cell_mm(STEPS, 0.0)[0] - 3.0;
    page.text([x + 1.0, y + 6.6], bold(5.0, INK), "done");
    if let Some(key) = drawn.last() {
        let how = format!(
            "to take the model apart, pull piece {} out first, against its arrow",
            key.piece.number
        );
        page.text_within([x + 1.0, y + 11.4], room_mm, small(FAINT), &how);
    }
}

/// Renders the pieces present at step `i` with the new one drawn back. Returns the picture and, after the
/// first step, the ends of the new piece's path in pixels.
fn step_picture(
    drawn: &[Drawn<'_>],
    i: usize,
    sight: &Sight,
    size: [usize; 2],
) -> (Image, Option<[[f64; 2]; 2]>) {
    let new = &drawn[i];
    let back = -sight.travel_mm * Vec3::from(new.piece.installation_direction);
    let camera = sight.camera();
    let facing: Vec<Facing> = drawn[..=i]
        .iter()
        .map(|d| d.visible_faces(camera.direction))
        .collect();
    let mut scene: Vec<Painted<'_>> = facing.iter().map(|f| f.paint(GREY, Vec3::ZERO)).collect();
    scene[i] = facing[i].paint(new.piece.color, if i > 0 { back } else { Vec3::ZERO });
    let image = render(&scene, &camera, size[0], size[1]);
    let home = new.piece.mesh.bounds().center();
    let place = projection(&scene, &camera, size[0], size[1]);
    (image, (i > 0).then(|| [place(home + back), place(home)]))
}

/// Corners of an arrow along 90 % of a path, mm. Never shorter than 12 mm, so that its shape stays
/// recognisable.
fn arrow([from, to]: [[f64; 2]; 2]) -> Vec<[f64; 2]> {
    const SHORTEST_MM: f64 = 12.0;
    const HEAD_MM: f64 = 6.5;
    const HALF_HEAD_MM: f64 = 4.4;
    const HALF_SHAFT_MM: f64 = 1.5;
    let way = [to[0] - from[0], to[1] - from[1]];
    let far = way[0].hypot(way[1]);
    let unit = if far > 1e-9 {
        way.map(|x| x / far)
    } else {
        [0.0, 1.0]
    };
    let length = (0.9 * far).max(SHORTEST_MM);
    let corner = |along: f64, aside: f64| {
        [
            from[0] + along * unit[0] - aside * unit[1],
            from[1] + along * unit[1] + aside * unit[0],
        ]
    };
    let neck = length - HEAD_MM;
    vec![
        corner(0.0, -HALF_SHAFT_MM),
        corner(neck, -HALF_SHAFT_MM),
        corner(neck, -HALF_HEAD_MM),
        corner(length, 0.0),
        corner(neck, HALF_HEAD_MM),
        corner(neck, HALF_SHAFT_MM),
        corner(0.0, HALF_SHAFT_MM),
    ]
}

/// Draws a number on a disc in the colour of a piece.
fn draw_number(page: &mut Page<'_>, middle: [f64; 2], radius_mm: f64, color: Color, number: &str) {
    page.disc(middle, radius_mm, color);
    let is_dark = color.iter().map(|&c| u32::from(c)).sum::<u32>() < 400;
    page.text_amid(
        middle,
        bold(1.05 * radius_mm, if is_dark { WHITE } else { INK }),
        number,
    );
}

fn start_page<'f>(title: &str, note: &str, fonts: &'f Fonts<'f>) -> Page<'f> {
    let mut page = Page::new(fonts);
    page.text([RIM_MM, RIM_MM + 6.0], bold(7.0, INK), title);
    if !note.is_empty() {
        let left = RIM_MM + 6.0 + page.width_mm(bold(7.0, INK), title);
        page.text([left, RIM_MM + 6.0], small(FAINT), note);
    }
    page
}

fn cell_mm(grid: [usize; 2], below_mm: f64) -> [f64; 2] {
    let room = [PAGE_MM[0] - 2.0 * RIM_MM, PAGE_MM[1] - 2.0 * RIM_MM - below_mm];
    [room[0] / grid[0] as f64, room[1] / grid[1] as f64]
}

/// Upper left corner of the `i`-th cell, mm, counted by rows; after the last cell of a page the first
/// follows.
fn corner_mm(i: usize, grid: [usize; 2], cell: [f64; 2], below_mm: f64) -> [f64; 2] {
    let i = i % (grid[0] * grid[1]);
    [
        RIM_MM + (i % grid[0]) as f64 * cell[0],
        RIM_MM + below_mm + (i / grid[0]) as f64 * cell[1],
    ]
}

fn bold(size_mm: f64, color: Color) -> Style {
    Style {
        size_mm,
        is_bold: true,
        color,
    }
}

fn small(color: Color) -> Style {
    Style {
        size_mm: 3.2,
        is_bold: false,
        color,
    }
}

#[cfg(test)]
mod tests;
