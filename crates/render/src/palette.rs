//! Colours that distinguish the pieces.

/// Hues in OKLCH, degrees, ordered so that neighbours differ much: a cycle of well-known names, warm and cold
/// in turn.
const HUES: [f64; 10] = [255.0, 55.0, 150.0, 15.0, 300.0, 95.0, 200.0, 345.0, 125.0, 275.0];

/// Lightness and chroma of each pass through the hues: soft first, then darker, lighter and paler.
const TONES: [(f64, f64); 5] = [
    (0.70, 0.125),
    (0.56, 0.11),
    (0.82, 0.085),
    (0.64, 0.06),
    (0.47, 0.08),
];

/// Colour in sRGB of the piece at place `order` of the installation. The first 100 all differ, then they
/// repeat.
pub fn color(order: usize) -> [u8; 3] {
    let turn = order / HUES.len() % 10;
    let (lightness, chroma) = TONES[turn % TONES.len()];
    // The second half of the hundred uses the hues in between.
    let between = if turn >= TONES.len() { 18.0 } else { 0.0 };
    srgb_from_oklch(
        lightness,
        chroma,
        (HUES[order % HUES.len()] + between).to_radians(),
    )
}

/// Converts OKLCH to sRGB, clipped, after Ottosson, "A perceptual color space for image processing", 2020.
fn srgb_from_oklch(lightness: f64, chroma: f64, hue: f64) -> [u8; 3] {
    let (a, b) = (chroma * hue.cos(), chroma * hue.sin());
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    let linear = [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ];
    linear.map(|light| {
        let light = light.clamp(0.0, 1.0);
        let channel = if light <= 0.003_130_8 {
            12.92 * light
        } else {
            1.055 * light.powf(1.0 / 2.4) - 0.055
        };
        (255.0 * channel).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hundred_colours_differ_and_the_first_ten_differ_much() {
        let all: std::collections::BTreeSet<_> = (0..100).map(color).collect();
        assert_eq!(all.len(), 100);
        let apart = |a: [u8; 3], b: [u8; 3]| {
            (0..3)
                .map(|k| i32::from(a[k]).abs_diff(i32::from(b[k])))
                .sum::<u32>()
        };
        let pairs = (0..10).flat_map(|i| (0..i).map(move |j| (i, j)));
        let nearest = pairs.map(|(i, j)| apart(color(i), color(j))).min().unwrap();
        assert!(nearest > 30, "nearest pair differs by {nearest}");
    }
}
