//! Packing of rectangles on few plates by a greedy search.
//!
//! Each plate keeps its maximal free rectangles. A new rectangle is placed as far to the front as possible,
//! upright or turned by 90° ("maximal rectangles, bottom left"; Jylänki, "A thousand ways to pack the bin",
//! 2010).

/// Tolerance for rounding, mm, so that a piece that just fits a plate is not rejected.
const ROUNDING_MM: f64 = 1e-6;

/// Position of a packed rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    pub plate: usize,
    /// Lower left corner on the plate, mm.
    pub corner_mm: [f64; 2],
    /// True if the rectangle is turned by 90°.
    pub is_turned: bool,
}

#[derive(Clone, Copy, PartialEq)]
struct Rect {
    min: [f64; 2],
    max: [f64; 2],
}

impl Rect {
    fn side(&self, axis: usize) -> f64 {
        self.max[axis] - self.min[axis]
    }

    fn overlaps(&self, other: &Self) -> bool {
        (0..2).all(|k| self.min[k] < other.max[k] - ROUNDING_MM && other.min[k] < self.max[k] - ROUNDING_MM)
    }

    fn contains(&self, other: &Self) -> bool {
        (0..2).all(|k| self.min[k] <= other.min[k] && other.max[k] <= self.max[k])
    }
}

/// Packs rectangles of these `sides` in their order. Each must fit an empty plate of size `plate` in one of
/// its two orientations.
pub(super) fn pack(plate: [f64; 2], sides: &[[f64; 2]]) -> Vec<Spot> {
    let mut plates: Vec<Vec<Rect>> = Vec::new();
    let mut spots = Vec::with_capacity(sides.len());
    for &size in sides {
        let found = plates
            .iter()
            .enumerate()
            .find_map(|(i, free)| Some((i, best_of(free, size)?)));
        let (i, (corner_mm, is_turned)) = found.unwrap_or_else(|| {
            plates.push(vec![Rect {
                min: [0.0; 2],
                max: plate,
            }]);
            let free = plates.last().expect("it was added just now");
            (plates.len() - 1, best_of(free, size).unwrap_or(([0.0; 2], false)))
        });
        let [a, b] = if is_turned { [size[1], size[0]] } else { size };
        let taken = Rect {
            min: corner_mm,
            max: [corner_mm[0] + a, corner_mm[1] + b],
        };
        plates[i] = without(&plates[i], &taken);
        spots.push(Spot {
            plate: i,
            corner_mm,
            is_turned,
        });
    }
    spots
}

/// Returns the corner of the free rectangle in which the far edge stays nearest, and true if the sides are
/// swapped. `None` if nothing fits.
fn best_of(free: &[Rect], size: [f64; 2]) -> Option<([f64; 2], bool)> {
    let ways = [(size, false), ([size[1], size[0]], true)];
    let tries = free
        .iter()
        .flat_map(|rect| ways.map(|(size, is_turned)| (rect, size, is_turned)));
    let fitting = tries.filter(|(rect, size, _)| (0..2).all(|k| size[k] <= rect.side(k) + ROUNDING_MM));
    let edges = |rect: &Rect, size: [f64; 2]| [rect.min[1] + size[1], rect.min[0] + size[0]];
    let best = fitting.min_by(|a, b| {
        let (a_edges, b_edges) = (edges(a.0, a.1), edges(b.0, b.1));
        a_edges[0]
            .total_cmp(&b_edges[0])
            .then(a_edges[1].total_cmp(&b_edges[1]))
            .then(a.2.cmp(&b.2))
    });
    best.map(|(rect, _, is_turned)| (rect.min, is_turned))
}

/// Returns the maximal free rectangles after `taken` is occupied.
fn without(free: &[Rect], taken: &Rect) -> Vec<Rect> {
    let mut left = Vec::new();
    for rect in free {
        if !rect.overlaps(taken) {
            left.push(*rect);
            continue;
        }
        for axis in 0..2 {
            let (mut below, mut above) = (*rect, *rect);
            (below.max[axis], above.min[axis]) = (taken.min[axis], taken.max[axis]);
            left.extend([below, above].into_iter().filter(|r| r.side(axis) > ROUNDING_MM));
        }
    }
    let is_inside = |i: usize| {
        let others = left.iter().enumerate();
        others
            .into_iter()
            .any(|(j, other)| j != i && other.contains(&left[i]) && (*other != left[i] || j < i))
    };
    (0..left.len())
        .filter(|&i| !is_inside(i))
        .map(|i| left[i])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn occupy(sides: [f64; 2], spot: &Spot) -> Rect {
        let [a, b] = if spot.is_turned {
            [sides[1], sides[0]]
        } else {
            sides
        };
        Rect {
            min: spot.corner_mm,
            max: [spot.corner_mm[0] + a, spot.corner_mm[1] + b],
        }
    }

    #[test]
    fn rectangles_never_overlap_and_stay_on_their_plates() {
        let sides: Vec<[f64; 2]> = (0..60)
            .map(|i| [5.0 + f64::from(i * 37 % 50), 5.0 + f64::from(i * 53 % 80)])
            .collect();
        let spots = pack([100.0, 90.0], &sides);
        for (i, spot) in spots.iter().enumerate() {
            let mine = occupy(sides[i], spot);
            assert!(
                Rect {
                    min: [0.0; 2],
                    max: [100.0, 90.0]
                }
                .contains(&mine),
                "{i}"
            );
            for (j, other) in spots.iter().enumerate().take(i) {
                assert!(
                    spot.plate != other.plate || !mine.overlaps(&occupy(sides[j], other)),
                    "{i} and {j}"
                );
            }
        }
        let area: f64 = sides.iter().map(|s| s[0] * s[1]).sum();
        let n_plates = spots.iter().map(|s| s.plate).max().unwrap() + 1;
        assert!(
            (n_plates as f64) < 1.0 + area / (0.75 * 9000.0),
            "{n_plates} plates for {area} mm²"
        );
    }

    #[test]
    fn four_quarters_fill_a_plate_and_a_long_one_is_turned() {
        let spots = pack([100.0, 60.0], &[[50.0, 30.0]; 4]);
        assert!(spots.iter().all(|s| s.plate == 0));
        assert!(pack([100.0, 60.0], &[[60.0, 100.0]])[0].is_turned);
    }
}
