//! Bands of samples, and the pictures made of them.

use super::sample::{NOTHING, Sample};
use super::{SAMPLES, shade};

/// Distance at which a line looks for a jump, in samples; lines are twice as wide.
pub(super) const LINE_REACH: usize = 2;

/// A picture in sRGB with straight alpha, 8 bits each, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Width of the picture, pixels.
    pub width: usize,
    /// Height of the picture, pixels.
    pub height: usize,
    /// Pixels in four bytes each.
    pub rgba: Vec<u8>,
}

impl Image {
    /// Blends the picture onto an opaque background of one colour.
    pub fn on(mut self, ground: [u8; 3]) -> Self {
        for pixel in self.rgba.chunks_exact_mut(4) {
            let alpha = f32::from(pixel[3]) / 255.0;
            for (channel, ground) in pixel.iter_mut().zip(ground) {
                *channel = (f32::from(*channel) * alpha + f32::from(ground) * (1.0 - alpha)).round() as u8;
            }
            pixel[3] = 255;
        }
        self
    }

    /// Arranges pictures in rows of `columns`. Each cell is as large as the largest picture, which is centred
    /// in it.
    pub fn sheet(pictures: &[Self], columns: usize) -> Self {
        let columns = columns.clamp(1, pictures.len().max(1));
        let cell_width = pictures.iter().map(|p| p.width).max().unwrap_or(0);
        let cell_height = pictures.iter().map(|p| p.height).max().unwrap_or(0);
        let (width, height) = (
            columns * cell_width,
            pictures.len().div_ceil(columns) * cell_height,
        );
        let mut rgba = vec![0; 4 * width * height];
        for (i, picture) in pictures.iter().enumerate() {
            let left = i % columns * cell_width + (cell_width - picture.width) / 2;
            let top = i / columns * cell_height + (cell_height - picture.height) / 2;
            for (row, bytes) in picture.rgba.chunks_exact(4 * picture.width.max(1)).enumerate() {
                rgba[4 * ((top + row) * width + left)..][..bytes.len()].copy_from_slice(bytes);
            }
        }
        Self { width, height, rgba }
    }

    /// Encodes the picture as a PNG file.
    ///
    /// # Panics
    ///
    /// Panics if the picture has no pixels, which PNG cannot represent.
    pub fn png(&self) -> Vec<u8> {
        let side = |n: usize| u32::try_from(n).expect("pictures are small");
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, side(self.width), side(self.height));
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().expect("writing to memory cannot fail");
        writer
            .write_image_data(&self.rgba)
            .expect("there are four bytes a pixel");
        writer.finish().expect("writing to memory cannot fail");
        bytes
    }
}

/// Some rows of samples, with [`LINE_REACH`] more on both sides, so that lines at the border do not depend on
/// the division into bands.
pub(super) struct Band {
    width: usize,
    /// First row that becomes pixels.
    top: usize,
    n_rows: usize,
    samples: Vec<Sample>,
}

impl Band {
    pub fn new(width: usize, top: usize, n_rows: usize) -> Self {
        Self {
            width,
            top,
            n_rows,
            samples: vec![NOTHING; width * (n_rows + 2 * LINE_REACH)],
        }
    }

    pub fn width(&self) -> usize {
        self.width
    }

    /// First row that can be drawn to; −[`LINE_REACH`] in the first band.
    pub fn first_row(&self) -> i64 {
        self.top as i64 - LINE_REACH as i64
    }

    pub fn end_row(&self) -> i64 {
        (self.top + self.n_rows + LINE_REACH) as i64
    }

    /// Stores a sample if it is nearer than the present one. On ties, the first stays.
    #[inline]
    pub fn put(&mut self, x: usize, y: i64, depth: f32, sample: impl FnOnce() -> Sample) {
        let place = &mut self.samples[(y - self.top as i64 + LINE_REACH as i64) as usize * self.width + x];
        if depth > place.depth {
            *place = sample();
        }
    }

    /// Resolves the samples to pixels of four bytes each.
    pub fn resolve(&self) -> Vec<u8> {
        const N: f32 = (SAMPLES * SAMPLES) as f32;
        let mut rgba = Vec::with_capacity(4 * self.width * self.n_rows / (SAMPLES * SAMPLES));
        for row in (0..self.n_rows).step_by(SAMPLES) {
            for column in (0..self.width).step_by(SAMPLES) {
                let mut sum = [0.0; 3];
                let mut covered = 0.0;
                for at in 0..SAMPLES * SAMPLES {
                    let (x, y) = (column + at % SAMPLES, row + at / SAMPLES + LINE_REACH);
                    if let Some(light) = self.light_at(x, y) {
                        (0..3).for_each(|k| sum[k] += light[k]);
                        covered += 1.0;
                    }
                }
                rgba.extend(sum.map(|light| srgb_from_linear(light / f32::max(covered, 1.0))));
                rgba.push((covered * 255.0 / N).round() as u8);
            }
        }
        rgba
    }

    /// Linear light of one sample: the lit surface, darkened by a line if there is one; `None` for nothing.
    fn light_at(&self, x: usize, y: usize) -> Option<[f32; 3]> {
        let here = self.samples[y * self.width + x];
        if here.mesh == 0 {
            return None;
        }
        let light = shade::lit(here.color, here.normal);
        let strength = self.line_at(x, y, here);
        Some(std::array::from_fn(|k| {
            light[k] * (1.0 - strength) + 0.012 * strength
        }))
    }

    /// Strength of the line through a sample, in [0, 1]: 1 on silhouettes, less on creases.
    fn line_at(&self, x: usize, y: usize, here: Sample) -> f32 {
        let mut strength: f32 = 0.0;
        for (dx, dy) in [(LINE_REACH, 0), (0, LINE_REACH)] {
            let before = if x >= dx {
                self.samples[(y - dy) * self.width + x - dx]
            } else {
                NOTHING
            };
            let after = if x + dx < self.width {
                self.samples[(y + dy) * self.width + x + dx]
            } else {
                NOTHING
            };
            strength = strength.max(shade::line_between(before, here, after));
        }
        strength
    }
}

/// Converts an 8-bit sRGB channel to linear light, in [0, 1].
pub(super) fn linear_from_srgb(channel: u8) -> f32 {
    let c = f32::from(channel) / 255.0;
    if c <= 0.040_45 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

fn srgb_from_linear(light: f32) -> u8 {
    let l = light.clamp(0.0, 1.0);
    let c = if l <= 0.003_130_8 {
        12.92 * l
    } else {
        1.055 * l.powf(1.0 / 2.4) - 0.055
    };
    (255.0 * c).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_survive_the_way_to_light_and_back() {
        assert!((0..=255).all(|c| srgb_from_linear(linear_from_srgb(c)) == c));
    }

    #[test]
    fn a_sheet_centres_what_is_smaller() {
        let dot = |side: usize, value: u8| Image {
            width: side,
            height: side,
            rgba: vec![value; 4 * side * side],
        };
        let sheet = Image::sheet(&[dot(3, 1), dot(1, 2), dot(3, 3)], 2);
        assert_eq!((sheet.width, sheet.height), (6, 6));
        let at = |x: usize, y: usize| sheet.rgba[4 * (y * 6 + x)];
        assert_eq!(
            [at(0, 0), at(4, 1), at(3, 0), at(2, 5), at(5, 5)],
            [1, 2, 0, 3, 0]
        );
    }
}
