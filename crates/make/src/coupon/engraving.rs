//! Digits engraved into flat faces, in seven straight strokes as wide as two lines of a nozzle.

use shellock_geom::{Vec3, Volume};

/// Height and width of a digit between the middles of its strokes, and advance to the next digit, mm.
const HEIGHT_MM: f64 = 3.0;
const WIDTH_MM: f64 = 1.6;
const ADVANCE_MM: f64 = 3.2;
/// Width and depth of strokes, mm, as those of pieces' numbers.
const STROKE_MM: f64 = 0.8;
const DEPTH_MM: f64 = 0.4;
/// Height of cuts above the face, mm.
const ABOVE_MM: f64 = 0.5;

/// The strokes of each digit: top, upper right, lower right, bottom, lower left, upper left, middle.
const DIGITS: [[u8; 7]; 10] = [
    [1, 1, 1, 1, 1, 1, 0],
    [0, 1, 1, 0, 0, 0, 0],
    [1, 1, 0, 1, 1, 0, 1],
    [1, 1, 1, 1, 0, 0, 1],
    [0, 1, 1, 0, 0, 1, 1],
    [1, 0, 1, 1, 0, 1, 1],
    [1, 0, 1, 1, 1, 1, 1],
    [1, 1, 1, 0, 0, 0, 0],
    [1, 1, 1, 1, 1, 1, 1],
    [1, 1, 1, 1, 0, 1, 1],
];
/// Ends of those strokes, in widths and heights of a digit.
const ENDS: [[[f64; 2]; 2]; 7] = [
    [[0.0, 1.0], [1.0, 1.0]],
    [[1.0, 0.5], [1.0, 1.0]],
    [[1.0, 0.0], [1.0, 0.5]],
    [[0.0, 0.0], [1.0, 0.0]],
    [[0.0, 0.0], [0.0, 0.5]],
    [[0.0, 0.5], [0.0, 1.0]],
    [[0.0, 0.5], [1.0, 0.5]],
];

/// A flat face with the axes that its reader sees; the face looks along `right` × `up`.
pub(super) struct Sheet {
    /// Position of the middle of the text.
    pub middle: Vec3,
    pub right: Vec3,
    pub up: Vec3,
}

impl Sheet {
    /// Volumes that the digits of `text` cut from the face; other characters leave a gap.
    pub(super) fn strokes(&self, text: &str) -> Vec<Volume> {
        let first = -0.5 * (ADVANCE_MM * (text.chars().count() as f64 - 1.0) + WIDTH_MM);
        let mut cuts = Vec::new();
        for (i, c) in text.chars().enumerate() {
            let Some(digit) = c.to_digit(10) else { continue };
            // The digit 1 has only strokes on one side, so it is centred.
            let aside = if digit == 1 { -0.5 * WIDTH_MM } else { 0.0 };
            let left = first + i as f64 * ADVANCE_MM + aside;
            let at = |[x, y]: [f64; 2]| [left + x * WIDTH_MM, (y - 0.5) * HEIGHT_MM];
            let drawn = DIGITS[digit as usize].iter().zip(ENDS).filter(|(d, _)| **d == 1);
            cuts.extend(drawn.map(|(_, ends)| self.stroke(ends.map(at))));
        }
        cuts
    }

    /// Volume of a straight stroke along one of the axes.
    fn stroke(&self, [a, b]: [[f64; 2]; 2]) -> Volume {
        let half = 0.5 * STROKE_MM;
        let normal = self.right.cross(self.up);
        let range = |axis: usize| [a[axis].min(b[axis]) - half, a[axis].max(b[axis]) + half];
        let corners = range(0).into_iter().flat_map(|x| {
            range(1).into_iter().flat_map(move |y| {
                [-DEPTH_MM, ABOVE_MM].map(|z| self.middle + x * self.right + y * self.up + z * normal)
            })
        });
        Volume::hull(&corners.collect::<Vec<_>>())
    }
}
