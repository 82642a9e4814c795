//! Deformation of the pieces under loads, for the page to show one load at a time, exaggerated.
//!
//! ```text
//!    ▼ arrow            carriers: coarse outer surfaces of the pieces. Their points move,
//!   ╭┄┄┄╮               and points of a piece follow the nearby triangles of its carrier.
//!   │   │┄ place        place: the weakest point under this load, with the line of its seam
//!  ─┴───┴─ floor
//! ```

use serde::Serialize;
use shellock_geom::{Aabb, TriMesh, Vec3};

use crate::arrays::{PointArray, TriangleArray, align, append_points, append_triangles};

/// Displayed size of the largest displacement, as a share of the diagonal of all carriers. Large enough to
/// show where the model bends, and small enough to keep its shape recognisable.
const SEEN: f64 = 0.05;

/// Largest value of a stored displacement, in the page's integer steps.
const STEPS: f64 = 32_767.0;

/// All loads of a report. Lengths in mm, assembly space.
#[derive(Clone, Debug, Default)]
pub struct ReportLoads {
    /// Heading of the list of loads.
    pub title: String,
    /// Note that applies to all loads.
    pub note: String,
    /// Outer surface of each piece of the report, coarse, at the resolution of the deformation.
    pub carriers: Vec<TriMesh>,
    /// Loads in the order of their buttons; may be empty.
    pub loads: Vec<ReportLoad>,
    /// Description and place of the weakest spot, which gives way before all others.
    pub weakest: Option<(String, ReportPlace)>,
}

/// A load with the deformation that it causes.
#[derive(Clone, Debug, Default)]
pub struct ReportLoad {
    /// Name of the load, for its button.
    pub name: String,
    /// Load that the kit withstands, with unit.
    pub figure: String,
    /// One sentence that describes the picture.
    pub title: String,
    /// Forces of the load, drawn as arrows.
    pub arrows: Vec<ReportArrow>,
    /// Ground on which the model stands or falls: a point of the plane and its unit normal.
    pub floor: Option<[[f64; 3]; 2]>,
    /// Place that gives way; `None` if none does.
    pub place: Option<ReportPlace>,
    /// Displacement of each point of each carrier, mm.
    pub moved_mm: Vec<Vec<Vec3>>,
}

/// An arrow for a force.
#[derive(Clone, Debug, Serialize)]
pub struct ReportArrow {
    /// Magnitude or cause of the force; may be empty.
    pub name: String,
    /// Position of the arrow's tip, mm.
    pub tip: [f64; 3],
    /// Unit vector along the force.
    pub along: [f64; 3],
}

/// A place on the seam of two pieces.
#[derive(Clone, Debug, Serialize)]
pub struct ReportPlace {
    /// Text of the place's label.
    pub name: String,
    /// Position of the place, mm.
    pub at: [f64; 3],
    /// Polylines along the seam, each as its points in order, mm.
    pub lines: Vec<Vec<[f64; 3]>>,
    /// Index into the report's pieces of the one that the place moves with.
    #[serde(rename = "mesh")]
    pub piece: usize,
}

/// Loads in the form that the viewer reads.
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
    /// Factor by which displacements are exaggerated.
    scale: f64,
    /// Step of the stored displacements, mm.
    step_mm: f64,
    /// Displacements of each carrier: 3 × int16 per point, in steps.
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
    /// Converts the loads and appends their arrays to `arrays`; `None` if there is no load.
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

/// Exaggeration of displacements, rounded to two digits, for which the largest shows as [`SEEN`] of
/// `size_mm`; 1 if nothing moves.
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
        // A diagonal of 100 mm and a displacement of 0.12 mm: 41.67 times, in two digits.
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
