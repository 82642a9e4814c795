//! Thin-walled parts and the stations of the seams between them.
//!
//! ```text
//!                 N                     station: one point of each side at the same place;
//!                 ▲                     u the seam's tangent (towards the reader or away),
//!   ───part a───┬─┼─▶───part b───       N the outward normal, v = `across` from side a to side b
//!               │  v
//!            male's pin, in a channel of the female; the male may leave along ŝ = `leaves`,
//!            and the two may slide along u; every other relative motion is blocked
//! ```

use crate::connector::PIN_DEPTH;
use shellock_geom::Vec3;

/// The two sides of a station.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Side a, where `across` starts.
    A,
    /// Side b, where `across` leads.
    B,
}

/// Both sides of a station, a first.
pub const SIDES: [Side; 2] = [Side::A, Side::B];

impl Side {
    /// Index of the side: 0 for a, 1 for b.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Returns the opposite side of the station.
    pub fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// Parts, each given by its outer surface, and the stations of the seams between them. Lengths in mm.
///
/// The triangulation is coarse enough for mechanics.
#[derive(Clone, Debug, Default)]
pub struct ShellAssembly {
    /// Points of the outer surface. Each point belongs to one part, so several points share a place where
    /// parts touch.
    pub points: Vec<Vec3>,
    /// Outward unit normal at each point; equal for all points at one place.
    pub normals: Vec<Vec3>,
    /// Part that each point belongs to, in [0, `n_parts`).
    pub part_of_point: Vec<u32>,
    /// Triangles, oriented outwards; the three points of a triangle belong to one part.
    pub triangles: Vec<[u32; 3]>,
    /// Number of parts in the assembly.
    pub n_parts: usize,
    /// Places inside seams (not their ends) where two parts touch, in order along each seam.
    pub stations: Vec<Station>,
    /// Pairs of consecutive stations of a seam that are joined by a triangle edge on either side.
    pub steps: Vec<[u32; 2]>,
}

impl ShellAssembly {
    /// Area of each point, mm²: a third of the area of the triangles around it.
    pub fn point_areas_mm2(&self) -> Vec<f64> {
        let mut areas_mm2 = vec![0.0; self.points.len()];
        for t in &self.triangles {
            let [a, b, c] = t.map(|p| self.points[p as usize]);
            let third = (b - a).cross(c - a).length() / 6.0;
            t.iter().for_each(|&p| areas_mm2[p as usize] += third);
        }
        areas_mm2
    }
}

/// A place on a seam with its frame: three unit vectors perpendicular to each other, u × `across` = ± N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// The point of side a and the point of side b.
    pub points: [u32; 2],
    /// Unit vector along the seam.
    pub tangent: Vec3,
    /// Unit vector out of the surface.
    pub normal: Vec3,
    /// Unit vector in the surface, from side a to side b.
    pub across: Vec3,
    /// Length of seam that the station represents, mm.
    pub length_mm: f64,
}

/// Relative motions that a plan allows between the two sides of one station.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// Unit normal of the walls' common face, perpendicular to the tangent, from side a into side b. Side a
    /// cannot move that way without side b.
    pub wall: Vec3,
    /// Connector at the station, if there is one.
    pub joint: Option<Joint>,
}

/// The connector that a plan makes at a station.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Side of the joint with the pin.
    pub male: Side,
    /// Direction ŝ along which the male may leave the female: a unit vector perpendicular to the tangent.
    /// Points outwards or across the seam, never into the surface.
    pub leaves: Vec3,
    /// True if friction also keeps the male from leaving and from sliding. Set on the key, which nothing else
    /// holds.
    pub is_fast: bool,
    /// Unit vector of the separation force on side a; side b is pulled the opposite way.
    pub pull_on_a: Vec3,
    /// Weight w of Eq. 4, > 0.
    pub weight: f64,
    /// Connector size D, mm, > 0. For the proportions see [`crate::connector`].
    pub size_mm: f64,
}

/// Returns true if `opening_mm` pulls the pin of the meeting's connector out of its channel. NaN counts as
/// lost.
pub fn is_lost(meeting: &Meeting, opening_mm: f64) -> bool {
    let lost_mm = meeting
        .joint
        .map_or(f64::INFINITY, |joint| PIN_DEPTH * joint.size_mm);
    opening_mm.is_nan() || opening_mm >= lost_mm
}

/// Openings that a solver found for one plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Opening {
    /// Distance between the male and the female at each station, mm; 0 where there is no joint.
    pub opening_mm: Vec<f64>,
    /// Rating `−max w d` over the stations (Sect. 5.1), mm; higher is better.
    pub quality_mm: f64,
    /// Station with the greatest `w d`, which decides the quality.
    pub worst: Option<u32>,
}

impl Opening {
    /// Rates the openings `opening_mm` at the stations.
    pub fn rate(meetings: &[Meeting], opening_mm: Vec<f64>) -> Self {
        let rated = meetings
            .iter()
            .zip(&opening_mm)
            .map(|(m, d)| m.joint.map(|j| j.weight * d));
        let mut worst: Option<(u32, f64)> = None;
        for (i, value) in (0..).zip(rated) {
            if let Some(value) = value.filter(|v| worst.is_none_or(|w| *v > w.1)) {
                worst = Some((i, value));
            }
        }
        Self {
            opening_mm,
            quality_mm: -worst.map_or(0.0, |w| w.1),
            worst: worst.map(|w| w.0),
        }
    }

    /// Returns [`Resistance::Separable`] if a station has lost its connector, and `Holds` otherwise. `parts`
    /// names the free parts of a station.
    pub fn resistance<I: IntoIterator<Item = u32>>(
        self,
        meetings: &[Meeting],
        parts: impl Fn(usize) -> I,
    ) -> Resistance {
        let lost = (0..self.opening_mm.len()).filter(|i| is_lost(&meetings[*i], self.opening_mm[*i]));
        let mut lost: Vec<u32> = lost.flat_map(parts).collect();
        lost.sort_unstable();
        lost.dedup();
        if lost.is_empty() {
            Resistance::Holds(self)
        } else {
            Resistance::Separable(lost)
        }
    }
}

/// Result of pulling the parts apart with the separation force.
#[derive(Clone, Debug, PartialEq)]
pub enum Resistance {
    /// The parts hold together, with these openings.
    Holds(Opening),
    /// These parts (ascending) can be pulled off without resistance while the fixed part is held.
    Separable(Vec<u32>),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_station_is_that_of_the_largest_weighted_opening_and_only_joints_count() {
        let meeting = |weight: Option<f64>| {
            let joint = |weight| Joint {
                male: Side::A,
                leaves: Vec3::Z,
                is_fast: false,
                pull_on_a: Vec3::Z,
                weight,
                size_mm: 3.0,
            };
            Meeting {
                wall: Vec3::X,
                joint: weight.map(joint),
            }
        };
        let rated = Opening::rate(
            &[Some(1.0), Some(0.1), None, Some(0.5)].map(meeting),
            vec![2.0, 9.0, 50.0, 5.0],
        );
        assert_eq!((rated.quality_mm, rated.worst), (-2.5, Some(3)));
        let none = Opening::rate(&[meeting(None)], vec![1.0]);
        assert_eq!((none.quality_mm, none.worst), (0.0, None));
    }
}
