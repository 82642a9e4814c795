//! What loads do to the pieces, for the page to show one at a time, larger than it is.
//!
//! ```text
//!    ▼ arrow            carriers: each piece's outer surface, coarse; their points move, and the points of the
//!   ╭┄┄┄╮               piece that are near a triangle go with it
//!   │   │┄ place        place: where it gives way, with the line along which
//!  ─┴───┴─ floor
//! ```

use serde::Serialize;
use shellock_geom::{Aabb, TriMesh, Vec3};

use crate::page::{PointArray, TriangleArray, align, append_points, append_triangles};

/// The largest displacement shows as this share of the diagonal of all carriers: enough to see where it bends, and
/// what it is still shows.
const SEEN: f64 = 0.05;

/// Largest value of what is moved, in the steps of the page.
const STEPS: f64 = 32_767.0;

/// All loads. Lengths in mm, assembly space.
#[derive(Clone, Debug, Default)]
pub struct ReportLoads {
    /// Heading of their list.
    pub title: String,
    /// What to know of all of them.
    pub note: String,
    /// For each piece of the report its outer surface, as coarsely as it bends.
    pub carriers: Vec<TriMesh>,
    /// In the order of their buttons; may be empty.
    pub loads: Vec<ReportLoad>,
    /// What gives way before all else, in words, and where.
    pub weakest: Option<(String, ReportPlace)>,
}

/// One load.
#[derive(Clone, Debug, Default)]
pub struct ReportLoad {
    /// What is done, for its button.
    pub name: String,
    /// How much of it is borne, with unit.
    pub figure: String,
    /// One sentence that says what is to be seen.
    pub title: String,
    /// Where it acts.
    pub arrows: Vec<ReportArrow>,
    /// What it stands or falls on: a point of the plane and its unit normal.
    pub floor: Option<[[f64; 3]; 2]>,
    /// Where it gives way; `None` where it does not.
    pub place: Option<ReportPlace>,
    /// For each carrier, how far each of its points goes, mm.
    pub moved_mm: Vec<Vec<Vec3>>,
}

/// A force.
#[derive(Clone, Debug, Serialize)]
pub struct ReportArrow {
    /// How much it is, or what makes it; may be empty.
    pub name: String,
    /// Where its tip is.
    pub tip: [f64; 3],
    /// Unit vector.
    pub along: [f64; 3],
}

/// A place on the seam of two pieces.
#[derive(Clone, Debug, Serialize)]
pub struct ReportPlace {
    /// For its label.
    pub name: String,
    /// The place.
    pub at: [f64; 3],
    /// Lines along the seam, each by its points in order.
    pub lines: Vec<Vec<[f64; 3]>>,
    /// Index into the pieces of the report: the one that it moves with.
    #[serde(rename = "mesh")]
    pub piece: usize,
}

/// What the viewer reads.
#[derive(Serialize)]
pub(crate) struct LoadsHeader<'a> {
    title: &'a str,
    note: &'a str,
    carriers: Vec<CarrierHeader>,
    loads: Vec<LoadHeader<'a>>,
    weakest: Option<WeakestHeader<'a>>,
}

#[derive(Serialize)]
struct CarrierHeader {
    points: PointArray,
    triangles: TriangleArray,
}

#[derive(Serialize)]
struct LoadHeader<'a> {
    name: &'a str,
    figure: &'a str,
    title: &'a str,
    arrows: &'a [ReportArrow],
    floor: Option<[[f64; 3]; 2]>,
    place: Option<&'a ReportPlace>,
    /// By how many times more than it is it shows.
    scale: f64,
    /// Of what is moved, mm.
    step_mm: f64,
    /// 3 × int16 a point of each carrier, in steps.
    moved: Vec<MovedArray>,
}

#[derive(Serialize)]
struct MovedArray {
    offset: usize,
    count: usize,
}

#[derive(Serialize)]
struct WeakestHeader<'a> {
    text: &'a str,
    place: &'a ReportPlace,
}

impl<'a> LoadsHeader<'a> {
    /// Appends the arrays of all loads to `arrays`; `None` where there is nothing to show.
    pub fn new(loads: &'a ReportLoads, arrays: &mut Vec<u8>) -> Option<Self> {
        if loads.loads.is_empty() {
            return None;
        }
        let size_mm = loads
            .carriers
            .iter()
            .fold(Aabb::EMPTY, |b, c| b.union(c.bounds()))
            .diagonal();
        let carrier = |mesh: &TriMesh, arrays: &mut Vec<u8>| CarrierHeader {
            points: append_points(mesh, arrays),
            triangles: append_triangles(mesh, arrays),
        };
        Some(Self {
            title: &loads.title,
            note: &loads.note,
            carriers: loads.carriers.iter().map(|c| carrier(c, arrays)).collect(),
            loads: loads
                .loads
                .iter()
                .map(|l| LoadHeader::new(l, size_mm, arrays))
                .collect(),
            weakest: loads
                .weakest
                .as_ref()
                .map(|(text, place)| WeakestHeader { text, place }),
        })
    }
}

impl<'a> LoadHeader<'a> {
    fn new(load: &'a ReportLoad, size_mm: f64, arrays: &mut Vec<u8>) -> Self {
        let all = || load.moved_mm.iter().flatten();
        let farthest_mm = all().map(|m| m.length()).fold(0.0, f64::max);
        let step_mm = all().map(|m| m.abs().max_element()).fold(0.0, f64::max) / STEPS;
        let moved = |moved_mm: &Vec<Vec3>, arrays: &mut Vec<u8>| {
            align(arrays);
            let offset = arrays.len();
            let steps = moved_mm.iter().flat_map(|m| m.to_array()).map(|mm| {
                if step_mm > 0.0 {
                    (mm / step_mm).round()
                } else {
                    0.0
                }
            });
            steps.for_each(|step| arrays.extend((step as i16).to_le_bytes()));
            MovedArray {
                offset,
                count: moved_mm.len(),
            }
        };
        Self {
            name: &load.name,
            figure: &load.figure,
            title: &load.title,
            arrows: &load.arrows,
            floor: load.floor,
            place: load.place.as_ref(),
            scale: exaggeration(farthest_mm, size_mm),
            step_mm,
            moved: load.moved_mm.iter().map(|m| moved(m, arrays)).collect(),
        }
    }
}

/// By how many times a displacement shows larger than it is, in two digits, so that it shows as [`SEEN`] of
/// what is `size_mm` large; 1 where nothing moves.
fn exaggeration(farthest_mm: f64, size_mm: f64) -> f64 {
    let factor = SEEN * size_mm / farthest_mm;
    if !(factor.is_finite() && factor > 0.0) {
        return 1.0;
    }
    format!("{factor:.1e}").parse().unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loads() -> ReportLoads {
        let mesh = TriMesh {
            points: vec![Vec3::ZERO, 60.0 * Vec3::X, 80.0 * Vec3::Y],
            triangles: vec![[0, 1, 2]],
        };
        let load = |moved_mm: Vec<Vec3>| ReportLoad {
            moved_mm: vec![moved_mm],
            ..ReportLoad::default()
        };
        ReportLoads {
            carriers: vec![mesh],
            loads: vec![
                load(vec![Vec3::ZERO, -0.12 * Vec3::Z, Vec3::new(0.03, 0.0, 0.04)]),
                load(vec![Vec3::ZERO; 3]),
            ],
            ..ReportLoads::default()
        }
    }

    #[test]
    fn what_moves_farthest_shows_as_a_twentieth_of_the_whole_and_what_does_not_stays() {
        let (loads, mut arrays) = (loads(), Vec::new());
        let header = LoadsHeader::new(&loads, &mut arrays).unwrap();
        // 100 mm of diagonal, 0.12 mm: 41.67 times, in two digits.
        assert_eq!(
            header.loads.iter().map(|l| l.scale).collect::<Vec<_>>(),
            [42.0, 1.0]
        );
        for (read, load) in header.loads.iter().zip(&loads.loads) {
            let at = read.moved[0].offset;
            for (i, moved) in load.moved_mm[0].iter().enumerate() {
                for (axis, mm) in moved.to_array().into_iter().enumerate() {
                    let byte = at + 2 * (3 * i + axis);
                    let step = i16::from_le_bytes([arrays[byte], arrays[byte + 1]]);
                    assert!((f64::from(step) * read.step_mm - mm).abs() <= 0.5 * read.step_mm);
                }
            }
        }
    }

    #[test]
    fn without_loads_nothing_is_told_of_carriers() {
        let none = ReportLoads {
            loads: Vec::new(),
            ..loads()
        };
        let mut arrays = Vec::new();
        assert!(LoadsHeader::new(&none, &mut arrays).is_none() && arrays.is_empty());
    }

    #[test]
    fn factors_have_two_digits() {
        for (farthest_mm, factor) in [(1.0, 10.0), (0.75, 13.0), (13.0, 0.77), (0.0031, 3200.0)] {
            assert_eq!(exaggeration(farthest_mm, 200.0), factor);
        }
    }
}
