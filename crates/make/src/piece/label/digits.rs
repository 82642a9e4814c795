//! Digits as strokes of polylines.

/// A point in units of a digit's height: x to the right, y up.
type Point = [f64; 2];

/// Distance from the left edge of a digit to that of the next, and width of a digit, in digit heights.
const ADVANCE: f64 = 0.9;
const WIDTH: f64 = 0.6;
/// Height of the line below a number.
const UNDERLINE: f64 = -0.28;

const ZERO: &[Point] = &[
    [0.15, 0.0],
    [0.45, 0.0],
    [0.6, 0.15],
    [0.6, 0.85],
    [0.45, 1.0],
    [0.15, 1.0],
    [0.0, 0.85],
    [0.0, 0.15],
    [0.15, 0.0],
];
const ONE: &[Point] = &[[0.1, 0.72], [0.38, 1.0], [0.38, 0.0]];
const TWO: &[Point] = &[
    [0.0, 0.82],
    [0.15, 1.0],
    [0.45, 1.0],
    [0.6, 0.85],
    [0.6, 0.65],
    [0.0, 0.0],
    [0.6, 0.0],
];
const THREE: &[Point] = &[
    [0.0, 1.0],
    [0.6, 1.0],
    [0.25, 0.6],
    [0.43, 0.6],
    [0.6, 0.43],
    [0.6, 0.15],
    [0.45, 0.0],
    [0.15, 0.0],
    [0.0, 0.15],
];
const FOUR: &[Point] = &[[0.45, 0.0], [0.45, 1.0], [0.0, 0.3], [0.6, 0.3]];
const FIVE: &[Point] = &[
    [0.56, 1.0],
    [0.05, 1.0],
    [0.0, 0.52],
    [0.4, 0.58],
    [0.6, 0.42],
    [0.6, 0.16],
    [0.42, 0.0],
    [0.15, 0.0],
    [0.0, 0.12],
];
const SIX: &[Point] = &[
    [0.5, 1.0],
    [0.2, 0.82],
    [0.0, 0.45],
    [0.0, 0.15],
    [0.15, 0.0],
    [0.45, 0.0],
    [0.6, 0.15],
    [0.6, 0.4],
    [0.45, 0.55],
    [0.15, 0.55],
    [0.0, 0.42],
];
const SEVEN: &[Point] = &[[0.0, 1.0], [0.6, 1.0], [0.2, 0.0]];
const EIGHT: &[Point] = &[
    [0.15, 0.53],
    [0.0, 0.68],
    [0.0, 0.85],
    [0.15, 1.0],
    [0.45, 1.0],
    [0.6, 0.85],
    [0.6, 0.68],
    [0.45, 0.53],
    [0.15, 0.53],
    [0.0, 0.38],
    [0.0, 0.15],
    [0.15, 0.0],
    [0.45, 0.0],
    [0.6, 0.15],
    [0.6, 0.38],
    [0.45, 0.53],
];
/// The strokes of six, turned upside down.
const NINE: &[Point] = &[
    [0.1, 0.0],
    [0.4, 0.18],
    [0.6, 0.55],
    [0.6, 0.85],
    [0.45, 1.0],
    [0.15, 1.0],
    [0.0, 0.85],
    [0.0, 0.6],
    [0.15, 0.45],
    [0.45, 0.45],
    [0.6, 0.58],
];
const DIGITS: [&[Point]; 10] = [ZERO, ONE, TWO, THREE, FOUR, FIVE, SIX, SEVEN, EIGHT, NINE];

/// A number as polylines, mm, in the box from the origin to [`Drawing::size_mm`].
pub(super) struct Drawing {
    pub strokes: Vec<Vec<Point>>,
}

impl Drawing {
    /// Draws `number` in digits of `height_mm`, underlined where it would be another number upside down.
    pub fn of(number: u32, height_mm: f64) -> Self {
        let digits: Vec<usize> = number
            .to_string()
            .bytes()
            .map(|b| usize::from(b - b'0'))
            .collect();
        let mut strokes: Vec<Vec<Point>> = Vec::new();
        let base = if is_ambiguous(&digits) { -UNDERLINE } else { 0.0 };
        let mut left = 0.0;
        for &digit in &digits {
            strokes.push(DIGITS[digit].iter().map(|p| [p[0] + left, p[1] + base]).collect());
            left += ADVANCE;
        }
        if base > 0.0 {
            strokes.push(vec![[0.0, 0.0], [left - ADVANCE + WIDTH, 0.0]]);
        }
        strokes
            .iter_mut()
            .flatten()
            .flatten()
            .for_each(|x| *x *= height_mm);
        Self { strokes }
    }

    /// Width and height of the drawing, mm.
    pub fn size_mm(&self) -> [f64; 2] {
        let points = || self.strokes.iter().flatten();
        [0, 1].map(|k| points().map(|p| p[k]).fold(0.0, f64::max))
    }
}

/// Returns true if the digits read as another number upside down.
fn is_ambiguous(digits: &[usize]) -> bool {
    let turned: Option<Vec<usize>> = digits
        .iter()
        .rev()
        .map(|digit| match digit {
            0 | 1 | 8 => Some(*digit),
            6 => Some(9),
            9 => Some(6),
            _ => None,
        })
        .collect();
    turned.is_some_and(|turned| turned != digits && turned[0] != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_reads_otherwise_upside_down_is_underlined() {
        let is_underlined = |n: u32| Drawing::of(n, 5.0).strokes.len() > n.to_string().len();
        let all: Vec<u32> = (0..128).filter(|&n| is_underlined(n)).collect();
        let expected = [
            6, 9, 16, 18, 19, 61, 66, 68, 81, 86, 89, 91, 98, 99, 106, 108, 109, 116, 118, 119,
        ];
        assert_eq!(all, expected);
    }

    #[test]
    fn six_and_nine_are_each_other_turned() {
        for (six, nine) in SIX.iter().zip(NINE) {
            assert!((six[0] + nine[0] - WIDTH).abs() < 1e-12 && (six[1] + nine[1] - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn digits_stay_in_their_box() {
        for digit in DIGITS.into_iter().flatten() {
            assert!((0.0..=WIDTH).contains(&digit[0]) && (0.0..=1.0).contains(&digit[1]));
        }
    }
}
