//! Sheets of pictures and words, written as small files.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use shellock_render::stills::Image;
use shellock_render::svg::{begin, end, text};

/// Width of a sheet, and of the column in which it is read.
pub const WIDTH: f64 = 800.0;
/// Pixels of a still per pixel of the sheet: sharp on high-resolution screens.
pub const DENSITY: f64 = 1.5;
/// Number of colours of a still.
const N_COLORS: usize = 96;

/// Number of pixels of a still for a length on the sheet.
pub fn pixels(length: f64) -> usize {
    (DENSITY * length).round() as usize
}

/// An SVG text under construction.
pub struct Sheet(pub String);

impl Sheet {
    /// Begins a white sheet, [`WIDTH`] wide.
    pub fn new(height: f64) -> Self {
        Self(begin(WIDTH, height))
    }

    /// Places a still with its upper left corner at a point; its size follows from [`pixels`].
    pub fn still(&mut self, [x, y]: [f64; 2], still: Image) {
        let [width, height] = [still.width, still.height].map(|n| n as f64 / DENSITY);
        let data = STANDARD.encode(small_png(&still.on([255; 3]), N_COLORS));
        // Writing to a string cannot fail.
        let _ = writeln!(
            self.0,
            "<image x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" \
             href=\"data:image/png;base64,{data}\"/>"
        );
    }

    /// Writes words that begin at a point.
    pub fn words(&mut self, at: [f64; 2], words: &str) {
        text(&mut self.0, at, "fill=\"#222\"", words);
    }

    /// Writes words centred at a point.
    pub fn amid(&mut self, at: [f64; 2], words: &str) {
        text(&mut self.0, at, "fill=\"#222\" text-anchor=\"middle\"", words);
    }

    /// Writes words centred at a point, fainter and smaller.
    pub fn note(&mut self, at: [f64; 2], words: &str) {
        let style = "fill=\"#555\" text-anchor=\"middle\" font-size=\"13\"";
        text(&mut self.0, at, style, words);
    }

    /// Draws a filled polygon; `style` has more attributes.
    pub fn polygon(&mut self, corners: &[[f64; 2]], fill: &str, style: &str) {
        let points: Vec<String> = corners.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let _ = writeln!(
            self.0,
            "<polygon points=\"{}\" fill=\"{fill}\" {style}/>",
            points.join(" ")
        );
    }

    /// Draws a straight line.
    pub fn line(&mut self, [a, b]: [[f64; 2]; 2], style: &str) {
        let _ = writeln!(
            self.0,
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" {style}/>",
            a[0], a[1], b[0], b[1]
        );
    }

    /// Draws a disc in a piece's colour with its number.
    pub fn disc(&mut self, middle: [f64; 2], color: [u8; 3], number: u32) {
        let [x, y] = middle;
        let _ = writeln!(
            self.0,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"12\" fill=\"{}\"/>",
            hex(color)
        );
        self.amid([x, y + 5.0], &number.to_string());
    }

    /// Ends the sheet and returns the bytes of its file.
    pub fn bytes(self) -> Vec<u8> {
        end(self.0).into_bytes()
    }
}

/// Reduces the colours of the stills embedded in an SVG text to those of a sheet's stills.
pub fn with_small_stills(svg: &str) -> String {
    const START: &str = "data:image/png;base64,";
    let mut parts = svg.split(START);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (data, rest) = part.split_once('"').unwrap_or((part, ""));
        let small = decode_still(data).map(|still| STANDARD.encode(small_png(&still.on([255; 3]), N_COLORS)));
        text += START;
        text += small.as_deref().unwrap_or(data);
        text += "\"";
        text += rest;
    }
    text
}

/// Decodes a still of four channels, as the program makes them; `None` for anything else.
fn decode_still(data: &str) -> Option<Image> {
    let bytes = STANDARD.decode(data).ok()?;
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().ok()?;
    let mut rgba = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut rgba).ok()?;
    (info.color_type == png::ColorType::Rgba).then_some(Image {
        width: info.width as usize,
        height: info.height as usize,
        rgba,
    })
}

/// Writes a colour in SVG notation.
pub fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Places pictures on a white still of this size.
pub fn paste([width, height]: [usize; 2], pictures: &[([usize; 2], Image)]) -> Image {
    let mut rgba = vec![255; 4 * width * height];
    for ([left, top], picture) in pictures {
        let picture = picture.clone().on([255; 3]);
        for (row, bytes) in picture.rgba.chunks_exact(4 * picture.width).enumerate() {
            rgba[4 * ((top + row) * width + left)..][..bytes.len()].copy_from_slice(bytes);
        }
    }
    Image { width, height, rgba }
}

/// Encodes an opaque still as a PNG file with a palette of at most `n` colours, and white; 256 at most.
pub fn small_png(still: &Image, n: usize) -> Vec<u8> {
    let palette = palette(still, n);
    let nearest = |cell: usize| {
        let [r, g, b] = middle(cell);
        let far = |c: &[u8; 3]| {
            [(c[0], r), (c[1], g), (c[2], b)]
                .map(|(p, q)| u32::from(p.abs_diff(q)).pow(2))
                .iter()
                .sum::<u32>()
        };
        (0..palette.len()).min_by_key(|&i| far(&palette[i])).unwrap_or(0) as u8
    };
    let mut index_of_cell = vec![None; 1 << 15];
    let indices: Vec<u8> = still
        .rgba
        .chunks_exact(4)
        .map(|p| {
            let cell = cell(p);
            *index_of_cell[cell].get_or_insert_with(|| nearest(cell))
        })
        .collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, still.width as u32, still.height as u32);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette.concat());
    encoder.set_compression(png::Compression::High);
    encoder.set_filter(png::Filter::NoFilter);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(&indices)?;
        writer.finish()
    });
    written.expect("writing to memory cannot fail");
    bytes
}

/// Index of a pixel's colour, with five bits of each channel.
fn cell(pixel: &[u8]) -> usize {
    pixel[..3]
        .iter()
        .fold(0, |cell, &c| cell << 5 | usize::from(c >> 3))
}

fn middle(cell: usize) -> [u8; 3] {
    // The scale runs from 0 to 255, so that white stays white.
    [10, 5, 0].map(|shift| ((cell >> shift & 31) * 255 / 31) as u8)
}

/// Palette for the colours of a still: boxes of colours, split at the median, the widest and fullest first
/// [Heckbert 1982]. White is always included.
fn palette(still: &Image, n: usize) -> Vec<[u8; 3]> {
    let mut count = vec![0_u64; 1 << 15];
    still.rgba.chunks_exact(4).for_each(|p| count[cell(p)] += 1);
    let used: Vec<usize> = (0..count.len()).filter(|&c| count[c] > 0).collect();
    let spread = |cells: &[usize]| {
        (0..3)
            .map(|k| {
                let values = || cells.iter().map(|&c| middle(c)[k]);
                (values().max().unwrap_or(0) - values().min().unwrap_or(0), k)
            })
            .max()
            .unwrap_or((0, 0))
    };
    let weight = |cells: &[usize]| {
        let n: u64 = cells.iter().map(|&c| count[c]).sum();
        f64::from(spread(cells).0) * (n as f64).sqrt()
    };
    let mut boxes = vec![used];
    while boxes.len() < n {
        let Some(widest) = (0..boxes.len()).max_by(|&i, &j| weight(&boxes[i]).total_cmp(&weight(&boxes[j])))
        else {
            break;
        };
        if boxes[widest].len() < 2 {
            break;
        }
        let mut cells = boxes.swap_remove(widest);
        let (_, axis) = spread(&cells);
        cells.sort_by_key(|&c| (middle(c)[axis], c));
        let half: u64 = cells.iter().map(|&c| count[c]).sum::<u64>() / 2;
        let mut below = 0;
        let at = cells.iter().position(|&c| {
            below += count[c];
            below > half
        });
        let upper = cells.split_off(at.unwrap_or(0).clamp(1, cells.len() - 1));
        boxes.extend([cells, upper]);
    }
    let mean = |cells: &Vec<usize>| {
        let n: u64 = cells.iter().map(|&c| count[c]).sum();
        [0, 1, 2].map(|k| {
            let sum: u64 = cells.iter().map(|&c| count[c] * u64::from(middle(c)[k])).sum();
            (sum as f64 / n.max(1) as f64).round() as u8
        })
    };
    let mut palette: Vec<[u8; 3]> = boxes.iter().map(mean).collect();
    // The background stays white.
    palette.truncate(255);
    palette.push([255; 3]);
    palette
}
