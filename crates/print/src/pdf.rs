//! Pages of text, pictures and filled shapes as PDF 1.7. Lengths in mm, from the upper left corner of an A4
//! page.
//!
//! Text is set in Helvetica, one of the fonts that every reader has. Characters that the font lacks become
//! "?".

use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::Predictor;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str, TextStr};
use rayon::prelude::*;
use shellock_render::stills::Image;

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
/// Distance from a line's baseline to the middle of its digits, as a share of the text size.
const MIDDLE_OF_DIGITS: f64 = 0.36;
/// Width of bold text relative to plain text, approximately.
const BOLD: f64 = 1.06;
/// Compression level of pictures: a higher one that takes twice the time saves a twentieth.
const EFFORT: u8 = 4;

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
pub(crate) struct Page {
    content: Content,
    pictures: Vec<Image>,
    #[cfg(test)]
    texts: Vec<TextBox>,
}

/// Bounding box of a line of text, mm.
#[cfg(test)]
#[derive(Clone, Debug)]
pub(crate) struct TextBox {
    pub min: [f64; 2],
    pub max: [f64; 2],
    pub text: String,
}

/// Reach of a line above and below its baseline, as shares of the text size.
#[cfg(test)]
const ASCENT: f64 = 0.74;
#[cfg(test)]
const DESCENT: f64 = 0.22;

impl Page {
    pub fn new() -> Self {
        Self {
            content: Content::new(),
            pictures: Vec::new(),
            #[cfg(test)]
            texts: Vec::new(),
        }
    }

    /// Bounding boxes of all lines of text so far.
    #[cfg(test)]
    pub fn texts(&self) -> &[TextBox] {
        &self.texts
    }

    /// Draws text with the left end of its baseline at `at`.
    pub fn text(&mut self, at: [f64; 2], style: Style, text: &str) {
        let [x, y] = on_paper(at);
        #[cfg(test)]
        self.texts.push(TextBox {
            min: [at[0], at[1] - ASCENT * style.size_mm],
            max: [at[0] + width_mm(style, text), at[1] + DESCENT * style.size_mm],
            text: text.to_owned(),
        });
        self.fill_color(style.color);
        let font = Name(if style.is_bold { b"Bold" } else { b"Plain" });
        let size = (style.size_mm * POINTS_PER_MM) as f32;
        self.content.begin_text().set_font(font, size).next_line(x, y);
        self.content.show(Str(&encoded(text))).end_text();
    }

    /// Draws text as [`Self::text`] does, smaller or shortened if it would be wider than `room_mm`.
    pub fn text_within(&mut self, at: [f64; 2], room_mm: f64, style: Style, text: &str) {
        let (style, text) = fitted(style, text, room_mm);
        self.text(at, style, &text);
    }

    /// Draws text centred on `at` in both directions.
    pub fn text_amid(&mut self, at: [f64; 2], style: Style, text: &str) {
        let left = at[0] - 0.5 * width_mm(style, text);
        self.text([left, at[1] + MIDDLE_OF_DIGITS * style.size_mm], style, text);
    }

    /// Draws a picture of the given width with its upper left corner at `at`.
    pub fn picture(&mut self, at: [f64; 2], width_mm: f64, picture: Image) {
        let height_mm = width_mm * picture.height as f64 / picture.width.max(1) as f64;
        let [x, y] = on_paper([at[0], at[1] + height_mm]);
        let [w, h] = [width_mm, height_mm].map(|mm| (mm * POINTS_PER_MM) as f32);
        let name = format!("P{}", self.pictures.len());
        self.content.save_state().transform([w, 0.0, 0.0, h, x, y]);
        self.content.x_object(Name(name.as_bytes())).restore_state();
        self.pictures.push(picture);
    }

    /// Draws a filled polygon with an outline of width `rim_mm`.
    pub fn polygon(&mut self, corners: &[[f64; 2]], color: Color, rim_mm: f64, rim: Color) {
        self.fill_color(color);
        let [r, g, b] = rim.map(|c| f32::from(c) / 255.0);
        self.content
            .set_stroke_rgb(r, g, b)
            .set_line_width((rim_mm * POINTS_PER_MM) as f32);
        for (i, &corner) in corners.iter().enumerate() {
            let [x, y] = on_paper(corner);
            if i == 0 {
                self.content.move_to(x, y)
            } else {
                self.content.line_to(x, y)
            };
        }
        if rim_mm > 0.0 {
            self.content.close_fill_nonzero_and_stroke()
        } else {
            self.content.fill_nonzero()
        };
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

    fn fill_color(&mut self, color: Color) {
        let [r, g, b] = color.map(|c| f32::from(c) / 255.0);
        self.content.set_fill_rgb(r, g, b);
    }
}

/// Writes the pages as a PDF file. Deterministic: equal pages give equal bytes.
pub(crate) fn document(title: &str, pages: Vec<Page>, paper: Paper) -> Vec<u8> {
    let (catalog, tree, information) = (Ref::new(1), Ref::new(2), Ref::new(3));
    let fonts = [
        (Ref::new(4), &b"Plain"[..], &b"Helvetica"[..]),
        (Ref::new(5), b"Bold", b"Helvetica-Bold"),
    ];
    let mut next = 6;
    let mut new_ref = || {
        next += 1;
        Ref::new(next - 1)
    };
    let ids: Vec<(Ref, Ref, Vec<Ref>)> = pages
        .iter()
        .map(|page| {
            (
                new_ref(),
                new_ref(),
                page.pictures.iter().map(|_| new_ref()).collect(),
            )
        })
        .collect();
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(tree);
    pdf.document_info(information)
        .title(TextStr(title))
        .producer(TextStr("shellock"));
    pdf.pages(tree)
        .kids(ids.iter().map(|id| id.0))
        .count(ids.len() as i32);
    for (id, _, face) in fonts {
        pdf.type1_font(id)
            .base_font(Name(face))
            .encoding_predefined(Name(b"WinAnsiEncoding"));
    }
    let size_mm = paper.size_mm();
    let [right, top] = size_mm.map(|mm| (mm * POINTS_PER_MM) as f32);
    let placed = placed(size_mm);
    for ((page_id, content_id, picture_ids), page) in ids.into_iter().zip(pages) {
        let mut written = pdf.page(page_id);
        written
            .media_box(Rect::new(0.0, 0.0, right, top))
            .parent(tree)
            .contents(content_id);
        let mut resources = written.resources();
        let mut named = resources.fonts();
        for (id, name, _) in fonts {
            named.pair(Name(name), id);
        }
        named.finish();
        let mut named = resources.x_objects();
        for (i, id) in picture_ids.iter().enumerate() {
            named.pair(Name(format!("P{i}").as_bytes()), *id);
        }
        named.finish();
        resources.finish();
        written.finish();
        let content = [&placed[..], &page.content.finish()].concat();
        pdf.stream(content_id, &compress_to_vec_zlib(&content, EFFORT))
            .filter(Filter::FlateDecode);
        let compressed: Vec<Vec<u8>> = page.pictures.par_iter().map(compressed).collect();
        for ((id, picture), bytes) in picture_ids.into_iter().zip(&page.pictures).zip(&compressed) {
            let mut written = pdf.image_xobject(id, bytes);
            written
                .width(picture.width as i32)
                .height(picture.height as i32)
                .bits_per_component(8);
            written.color_space().device_rgb();
            written.filter(Filter::FlateDecode);
            let mut parameters = written.decode_parms();
            parameters
                .predictor(Predictor::PngOptimum)
                .colors(3)
                .columns(picture.width as i32);
        }
    }
    pdf.finish()
}

/// Drawing operators that centre a page on paper of another size and scale it to fit; empty for the page's
/// own size.
fn placed(size_mm: [f64; 2]) -> Vec<u8> {
    if size_mm == PAGE_MM {
        return Vec::new();
    }
    let scale = (size_mm[0] / PAGE_MM[0]).min(size_mm[1] / PAGE_MM[1]);
    let [x, y] = [0, 1].map(|k| (0.5 * (size_mm[k] - scale * PAGE_MM[k]) * POINTS_PER_MM) as f32);
    let scale = scale as f32;
    let mut content = Content::new();
    content.transform([scale, 0.0, 0.0, scale, x, y]);
    let mut bytes = content.finish().to_vec();
    bytes.push(b'\n');
    bytes
}

/// Compresses a picture on white, with each row as differences to the row above (PNG's filter "up").
fn compressed(picture: &Image) -> Vec<u8> {
    /// Number of the filter at the start of each row.
    const UP: u8 = 2;
    let opaque = picture.clone().on([255; 3]);
    let mut above = vec![0_u8; 3 * picture.width];
    let mut bytes = Vec::with_capacity((3 * picture.width + 1) * picture.height);
    for row in opaque.rgba.chunks_exact(4 * picture.width.max(1)) {
        bytes.push(UP);
        let row: Vec<u8> = row.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        bytes.extend(
            row.iter()
                .zip(&above)
                .map(|(here, above)| here.wrapping_sub(*above)),
        );
        above = row;
    }
    compress_to_vec_zlib(&bytes, EFFORT)
}

fn on_paper([x, y]: [f64; 2]) -> [f32; 2] {
    [x * POINTS_PER_MM, (PAGE_MM[1] - y) * POINTS_PER_MM].map(|p| p as f32)
}

/// Encodes text in Windows-1252, the encoding of the fonts.
fn encoded(text: &str) -> Vec<u8> {
    let byte = |c: char| match c {
        ' '..='~' | '\u{A0}'..='\u{FF}' => c as u32 as u8,
        '…' => 0x85,
        '’' => 0x92,
        '•' => 0x95,
        '–' => 0x96,
        '—' => 0x97,
        _ => b'?',
    };
    text.chars().map(byte).collect()
}

/// Fits text into a width of `room_mm`: scales it down to no less than 0.6 of its size, then shortens it.
fn fitted(style: Style, text: &str, room_mm: f64) -> (Style, String) {
    const SMALLEST: f64 = 0.6;
    let shrunk = room_mm / width_mm(style, text).max(f64::MIN_POSITIVE);
    let style = Style {
        size_mm: style.size_mm * shrunk.clamp(SMALLEST, 1.0),
        ..style
    };
    let mut n_kept = text.chars().count();
    let mut text = text.to_owned();
    while n_kept > 0 && width_mm(style, &text) > room_mm + 1e-9 {
        n_kept -= 1;
        text = text.chars().take(n_kept).collect::<String>() + "...";
    }
    (style, text)
}

/// Width of a line, mm.
pub(crate) fn width_mm(style: Style, text: &str) -> f64 {
    let width = |byte: u8| {
        f64::from(
            WIDTHS
                .get(usize::from(byte.wrapping_sub(b' ')))
                .copied()
                .unwrap_or(556),
        )
    };
    let sum: f64 = encoded(text).into_iter().map(width).sum();
    sum / 1000.0 * style.size_mm * if style.is_bold { BOLD } else { 1.0 }
}

/// Widths of Helvetica's characters from the space to the tilde, thousandths of the text size.
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556,
    556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278,
    500, 667, 556, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469,
    556, 333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500,
    278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_is_fitted_is_no_wider_than_its_room_and_short_ones_stay_as_they_are() {
        let style = Style {
            size_mm: 4.0,
            is_bold: false,
            color: [0; 3],
        };
        let long = "the key, from below, behind and its left: it locks all";
        for room_mm in [200.0, 60.0, 30.0, 8.0] {
            let (fit, text) = fitted(style, long, room_mm);
            assert!(width_mm(fit, &text) <= room_mm + 1e-6, "{text} in {room_mm} mm");
            assert!(fit.size_mm >= 0.6 * style.size_mm - 1e-9);
        }
        assert_eq!(fitted(style, "done", 60.0).1, "done");
        assert!(fitted(style, long, 8.0).1.ends_with("..."));
    }

    #[test]
    fn pages_come_out_with_their_pictures_and_the_same_each_time() {
        let made = || {
            let mut page = Page::new();
            let style = Style {
                size_mm: 5.0,
                is_bold: true,
                color: [0; 3],
            };
            page.text([10.0, 20.0], style, "(piece) 7 \\ ☂ – ü");
            page.picture(
                [10.0, 30.0],
                40.0,
                Image {
                    width: 2,
                    height: 3,
                    rgba: vec![200; 24],
                },
            );
            page.disc([50.0, 50.0], 5.0, [255, 0, 0]);
            document("a (title", vec![page, Page::new()], Paper::Letter)
        };
        let bytes = made();
        assert!(bytes.starts_with(b"%PDF-1.7") && bytes.ends_with(b"%%EOF"));
        let count = |what: &[u8]| bytes.windows(what.len()).filter(|w| *w == what).count();
        assert_eq!((count(b"/Type /Page\n"), count(b"/Subtype /Image")), (2, 1));
        assert_eq!(bytes, made());
    }

    #[test]
    fn rows_come_back_from_their_differences() {
        let picture = Image {
            width: 2,
            height: 2,
            rgba: vec![9, 8, 7, 255, 1, 2, 3, 255, 4, 5, 6, 255, 0, 0, 0, 0],
        };
        let rows = miniz_oxide::inflate::decompress_to_vec_zlib(&compressed(&picture)).unwrap();
        let (first, second) = rows.split_at(7);
        assert_eq!(first, [2, 9, 8, 7, 1, 2, 3]);
        let back: Vec<u8> = second[1..]
            .iter()
            .zip(&first[1..])
            .map(|(d, above)| d.wrapping_add(*above))
            .collect();
        assert_eq!(back, [4, 5, 6, 255, 255, 255]);
    }

    #[test]
    fn a_line_is_as_wide_as_its_letters() {
        let style = Style {
            size_mm: 10.0,
            is_bold: false,
            color: [0; 3],
        };
        assert!((width_mm(style, "007") - 3.0 * 5.56).abs() < 1e-9);
        assert!(width_mm(style, "wide") > width_mm(style, "lil"));
    }
}
