//! Pages of text, pictures and filled shapes as PDF 1.7. Lengths in mm, from the upper left corner of an A4
//! page.
//!
//! The file holds the letters that it uses, of the fonts that [`Fonts`] chose, and the text that they stand
//! for, so it can be searched and copied. It has no date and no random id.

use std::sync::Arc;

use krilla::color::rgb;
use krilla::configure::{Configuration, PdfVersion};
use krilla::geom::{Path, PathBuilder, Point, Size, Transform};
use krilla::image::{BitsPerComponent, CustomImage, ImageColorspace};
use krilla::metadata::Metadata;
use krilla::page::PageSettings;
use krilla::paint::{Fill, Stroke};
use krilla::surface::Surface;
use krilla::{Document, SerializeSettings};
use shellock_render::stills::Image;

use crate::fonts::{Fonts, Run, printable};

/// Page size of the layout, mm: A4.
pub(crate) const PAGE_MM: [f64; 2] = [210.0, 297.0];

/// Paper size for printing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Paper {
    /// ISO A4, 210 × 297 mm.
    #[default]
    A4,
    /// US Letter, 8.5 × 11 inches. Pages are 6 % smaller than on A4 and centred.
    Letter,
}

impl Paper {
    fn size_mm(self) -> [f64; 2] {
        match self {
            Self::A4 => PAGE_MM,
            Self::Letter => [215.9, 279.4],
        }
    }
}
const POINTS_PER_MM: f64 = 72.0 / 25.4;

/// Colour in sRGB: red, green, blue.
pub type Color = [u8; 3];

/// Size, weight and colour of text.
#[derive(Clone, Copy)]
pub(crate) struct Style {
    /// Height of a line, mm.
    pub size_mm: f64,
    pub is_bold: bool,
    pub color: Color,
}

/// A page that is being drawn.
pub(crate) struct Page<'f> {
    fonts: &'f Fonts<'f>,
    marks: Vec<Mark>,
    #[cfg(test)]
    texts: Vec<TextBox>,
}

/// One thing on a page, in the order of drawing.
enum Mark {
    /// A line of text: the left end of its baseline, its style, its runs from left to right.
    Text([f64; 2], Style, Vec<Run>),
    /// A picture: its upper left corner and its size.
    Picture([f64; 2], [f64; 2], Image),
    /// A filled polygon with the width and the colour of its outline.
    Polygon(Vec<[f64; 2]>, Color, f64, Color),
}

/// Bounding box of a line of text, mm.
#[cfg(test)]
#[derive(Clone, Debug)]
pub(crate) struct TextBox {
    pub min: [f64; 2],
    pub max: [f64; 2],
    pub text: String,
}

impl<'f> Page<'f> {
    pub fn new(fonts: &'f Fonts<'f>) -> Self {
        Self {
            fonts,
            marks: Vec::new(),
            #[cfg(test)]
            texts: Vec::new(),
        }
    }

    /// Bounding boxes of all lines of text so far.
    #[cfg(test)]
    pub fn texts(&self) -> &[TextBox] {
        &self.texts
    }

    /// Fonts that the page is set in.
    pub fn fonts(&self) -> &'f Fonts<'f> {
        self.fonts
    }

    /// Width of a line, mm.
    pub fn width_mm(&self, style: Style, text: &str) -> f64 {
        width_mm(self.fonts, style, text)
    }

    /// Draws text with the left end of its baseline at `at`.
    pub fn text(&mut self, at: [f64; 2], style: Style, text: &str) {
        #[cfg(test)]
        self.note(at, style, text);
        let runs = self.fonts.line(text, style.is_bold);
        self.marks.push(Mark::Text(at, style, runs));
    }

    #[cfg(test)]
    fn note(&mut self, at: [f64; 2], style: Style, text: &str) {
        let [above, below] = self.fonts.reach().map(|share| share * style.size_mm);
        self.texts.push(TextBox {
            min: [at[0], at[1] - above],
            max: [at[0] + self.width_mm(style, text), at[1] + below],
            text: text.to_owned(),
        });
    }

    /// Draws text as [`Self::text`] does, smaller or shortened if it would be wider than `room_mm`.
    pub fn text_within(&mut self, at: [f64; 2], room_mm: f64, style: Style, text: &str) {
        let (style, text) = fit(self.fonts, style, text, room_mm);
        self.text(at, style, &text);
    }

    /// Draws text centred on `at` in both directions.
    pub fn text_amid(&mut self, at: [f64; 2], style: Style, text: &str) {
        let left = at[0] - 0.5 * self.width_mm(style, text);
        let down = self.fonts.middle_of_digits(style.is_bold) * style.size_mm;
        self.text([left, at[1] + down], style, text);
    }

    /// Draws a picture of the given width with its upper left corner at `at`.
    pub fn picture(&mut self, at: [f64; 2], width_mm: f64, picture: Image) {
        let height_mm = width_mm * picture.height as f64 / picture.width.max(1) as f64;
        self.marks.push(Mark::Picture(at, [width_mm, height_mm], picture));
    }

    /// Draws a filled polygon with an outline of width `rim_mm`.
    pub fn polygon(&mut self, corners: &[[f64; 2]], color: Color, rim_mm: f64, rim: Color) {
        self.marks
            .push(Mark::Polygon(corners.to_vec(), color, rim_mm, rim));
    }

    /// Draws a filled disc as a polygon of 48 corners.
    pub fn disc(&mut self, middle: [f64; 2], radius_mm: f64, color: Color) {
        const N: u32 = 48;
        let corner = |i: u32| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / f64::from(N)).sin_cos();
            [middle[0] + radius_mm * cos, middle[1] + radius_mm * sin]
        };
        let corners: Vec<[f64; 2]> = (0..N).map(corner).collect();
        self.polygon(&corners, color, 0.0, color);
    }
}

/// Writes the pages as a PDF file. Deterministic: equal pages give equal bytes. `None` if a font that was
/// lent cannot be embedded.
pub(crate) fn document(title: &str, pages: Vec<Page<'_>>, paper: Paper) -> Option<Vec<u8>> {
    let mut document = Document::new_with(SerializeSettings {
        configuration: Configuration::new_with_version(PdfVersion::Pdf17),
        xmp_metadata: false,
        enable_tagging: false,
        ..SerializeSettings::default()
    });
    let metadata = Metadata::new()
        .title(printable(title))
        .producer("shellock".to_owned());
    document.set_metadata(metadata.language("en".to_owned()));
    let size_mm = paper.size_mm();
    let [width, height] = size_mm.map(points);
    for page in pages {
        let settings = PageSettings::from_wh(width, height).unwrap_or_default();
        let mut written = document.start_page_with(settings);
        let mut surface = written.surface();
        surface.push_transform(&fit_to_paper(size_mm));
        for mark in page.marks {
            draw(&mut surface, mark, page.fonts);
        }
        surface.pop();
    }
    document.finish().ok()
}

/// Transform that centres a page on paper of another size and scales it to fit.
fn fit_to_paper(size_mm: [f64; 2]) -> Transform {
    let scale = (size_mm[0] / PAGE_MM[0]).min(size_mm[1] / PAGE_MM[1]);
    let [x, y] = [0, 1].map(|k| points(0.5 * (size_mm[k] - scale * PAGE_MM[k])));
    Transform::from_row(scale as f32, 0.0, 0.0, scale as f32, x, y)
}

fn points(mm: f64) -> f32 {
    (mm * POINTS_PER_MM) as f32
}

/// Draws one mark. Marks at places that are no numbers are left out.
fn draw(surface: &mut Surface<'_>, mark: Mark, fonts: &Fonts<'_>) {
    match mark {
        Mark::Text(at, style, runs) => draw_text(surface, at, style, &runs, fonts),
        Mark::Picture([x, y], [width, height], picture) => {
            let place = Transform::from_translate(points(x), points(y));
            let size = Size::from_wh(points(width), points(height));
            let (Some(size), Ok(picture)) = (size, embed(&picture)) else {
                return;
            };
            surface.push_transform(&place);
            surface.draw_image(picture, size);
            surface.pop();
        }
        Mark::Polygon(corners, color, rim_mm, rim) => {
            let outline = Stroke {
                paint: paint(rim).into(),
                width: points(rim_mm),
                ..Stroke::default()
            };
            surface.set_fill(Some(fill(color)));
            surface.set_stroke((rim_mm > 0.0).then_some(outline));
            if let Some(path) = close_path(&corners) {
                surface.draw_path(&path);
            }
        }
    }
}

fn draw_text(surface: &mut Surface<'_>, [x, y]: [f64; 2], style: Style, runs: &[Run], fonts: &Fonts<'_>) {
    surface.set_fill(Some(fill(style.color)));
    surface.set_stroke(None);
    let mut left = x;
    for run in runs {
        let at = Point::from_xy(points(left), points(y));
        let (font, size) = (fonts.font(run.font), points(style.size_mm));
        surface.draw_glyphs(at, &run.glyphs, font, &run.text, size, false);
        left += run.width() * style.size_mm;
    }
}

fn paint([r, g, b]: Color) -> rgb::Color {
    rgb::Color::new(r, g, b)
}

fn fill(color: Color) -> Fill {
    Fill {
        paint: paint(color).into(),
        ..Fill::default()
    }
}

/// Closed path through `corners`; `None` if it is empty or one of them is no number.
fn close_path(corners: &[[f64; 2]]) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (i, corner) in corners.iter().enumerate() {
        let [x, y] = corner.map(points);
        if i == 0 {
            path.move_to(x, y);
        } else {
            path.line_to(x, y);
        }
    }
    path.close();
    path.finish()
}

/// Pixels of a picture on white: red, green, blue.
#[derive(Clone, Hash)]
struct Pixels {
    rgb: Arc<[u8]>,
    size: [u32; 2],
}

impl CustomImage for Pixels {
    fn color_channel(&self) -> &[u8] {
        &self.rgb
    }
    fn alpha_channel(&self) -> Option<&[u8]> {
        None
    }
    fn bits_per_component(&self) -> BitsPerComponent {
        BitsPerComponent::Eight
    }
    fn size(&self) -> (u32, u32) {
        self.size.into()
    }
    fn icc_profile(&self) -> Option<&[u8]> {
        None
    }
    fn color_space(&self) -> ImageColorspace {
        ImageColorspace::Rgb
    }
}

/// Picture as the file holds it, on white. It is compressed on another thread.
fn embed(picture: &Image) -> Result<krilla::image::Image, String> {
    let opaque = picture.clone().on([255; 3]);
    let rgb = opaque
        .rgba
        .chunks_exact(4)
        .flat_map(|p| [p[0], p[1], p[2]])
        .collect();
    let size = [opaque.width, opaque.height].map(|n| n as u32);
    krilla::image::Image::from_custom(Pixels { rgb, size }, false)
}

/// Fits text into a width of `room_mm`: scales it down to no less than 0.6 of its size, then shortens it.
fn fit(fonts: &Fonts<'_>, style: Style, text: &str, room_mm: f64) -> (Style, String) {
    const SMALLEST: f64 = 0.6;
    let shrunk = room_mm / width_mm(fonts, style, text).max(f64::MIN_POSITIVE);
    let style = Style {
        size_mm: style.size_mm * shrunk.clamp(SMALLEST, 1.0),
        ..style
    };
    let fits = |text: &str| width_mm(fonts, style, text) <= room_mm + 1e-9;
    if fits(text) {
        return (style, text.to_owned());
    }
    let characters: Vec<char> = text.chars().collect();
    let shortened = |n: usize| characters[..n].iter().collect::<String>() + "...";
    // The longest that fits, by bisection: widths grow with the number of characters, but for ligatures.
    let (mut fitting, mut too_long) = (0, characters.len());
    while fitting + 1 < too_long {
        let n = fitting.midpoint(too_long);
        if fits(&shortened(n)) {
            fitting = n;
        } else {
            too_long = n;
        }
    }
    (style, shortened(fitting))
}

/// Width of a line, mm.
pub(crate) fn width_mm(fonts: &Fonts<'_>, style: Style, text: &str) -> f64 {
    fonts.width(text, style.is_bold) * style.size_mm
}

#[cfg(test)]
pub(crate) mod tests;
