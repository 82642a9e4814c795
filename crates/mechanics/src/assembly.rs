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

/// Both, a first.
pub const SIDES: [Side; 2] = [Side::A, Side::B];

impl Side {
    /// 0 for a, 1 for b.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The other one.
    pub fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// Parts by their outer surface, triangulated coarsely enough for mechanics, and the stations of their seams.
/// Lengths in mm.
#[derive(Clone, Debug, Default)]
pub struct ShellAssembly {
    /// Points of the outer surface; each is one part's own, so where parts touch there are several at one
    /// place.
    pub points: Vec<Vec3>,
    /// Outward unit normal at each point; the same for all points at one place.
    pub normals: Vec<Vec3>,
    /// The part of each point, in [0, `n_parts`).
    pub part_of_point: Vec<u32>,
    /// Oriented outwards; the three points of a triangle are of one part.
    pub triangles: Vec<[u32; 3]>,
    /// How many parts there are.
    pub n_parts: usize,
    /// Places inside seams (not their ends) where two parts touch, in order along each seam.
    pub stations: Vec<Station>,
    /// Pairs of stations that follow each other on a seam, by a triangle edge on either side.
    pub steps: Vec<[u32; 2]>,
}

impl ShellAssembly {
    /// A third of its triangles' area for each point, mm².
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
    /// Along the seam.
    pub tangent: Vec3,
    /// Out of the surface.
    pub normal: Vec3,
    /// In the surface, from side a to side b.
    pub across: Vec3,
    /// Length of seam that the station stands for, mm.
    pub length_mm: f64,
}

/// How a plan lets the two sides of one station move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// Unit normal of the walls' common face, perpendicular to the tangent, from side a into side b: a cannot
    /// go that way without b.
    pub wall: Vec3,
    /// The connector, where there is one.
    pub joint: Option<Joint>,
}

/// The connector that a plan makes at a station.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// The side with the pin.
    pub male: Side,
    /// Unit vector perpendicular to the tangent along which the male may leave the female: ŝ. In the half
    /// space of the outward normal, or across it; never into the surface.
    pub leaves: Vec3,
    /// Whether friction keeps the male from leaving and from sliding, too: on the key, which nothing else
    /// holds back.
    pub is_fast: bool,
    /// Unit vector along which side a is pulled by the separation force; side b is pulled the other way.
    pub pull_on_a: Vec3,
    /// Weight w of Eq. 4, > 0.
    pub weight: f64,
    /// Connector size D, mm, > 0; its proportions: [`crate::connector`].
    pub size_mm: f64,
}

/// Whether `opening_mm` lets the connector go that `meeting` has: the pin is out of its channel.
pub(crate) fn is_lost(meeting: &Meeting, opening_mm: f64) -> bool {
    let lost_mm = meeting
        .joint
        .map_or(f64::INFINITY, |joint| PIN_DEPTH * joint.size_mm);
    opening_mm.is_nan() || opening_mm >= lost_mm
}

/// What a solver found for one plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Opening {
    /// Distance between the male and the female at each station, mm; 0 where there is no joint.
    pub opening_mm: Vec<f64>,
    /// `−max w d` over the stations (Sect. 5.1), mm; higher is better.
    pub quality_mm: f64,
    /// The station that decides the quality.
    pub worst: Option<u32>,
}

impl Opening {
    /// Rates the distances `opening_mm` at the stations.
    pub fn rated(meetings: &[Meeting], opening_mm: Vec<f64>) -> Self {
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

    /// Whether that holds: unless a station has let its connector go. `parts` names those of a station that
    /// are free.
    pub(crate) fn resistance<I: IntoIterator<Item = u32>>(
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

/// Whether the parts hold together under the separation force.
#[derive(Clone, Debug, PartialEq)]
pub enum Resistance {
    /// They do, and open so far.
    Holds(Opening),
    /// These parts (ascending) can be pulled off without any resistance, the fixed part held.
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
        let rated = Opening::rated(
            &[Some(1.0), Some(0.1), None, Some(0.5)].map(meeting),
            vec![2.0, 9.0, 50.0, 5.0],
        );
        assert_eq!((rated.quality_mm, rated.worst), (-2.5, Some(3)));
        let none = Opening::rated(&[meeting(None)], vec![1.0]);
        assert_eq!((none.quality_mm, none.worst), (0.0, None));
    }
}
