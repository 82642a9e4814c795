//! Cross-section of a connector: rectangles of pin, foot and channel.

use shellock_geom::Vec3;
use shellock_mechanics::connector::{FLOOR, FOOT_WIDTH, LEAST_FOOT_MM, LEAST_PART_MM, PIN_DEPTH, PIN_WIDTH};

use super::ConnectorParams;
use super::station::{RailPart, RunShape, RunStation};

/// A rectangle of the cross-section: from `n0` to `n1` along the frame's `n`, from `s0` to `s1` along ŝ, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileRect {
    /// Least coordinate along `n`, mm.
    pub n0: f64,
    /// Greatest coordinate along `n`, mm.
    pub n1: f64,
    /// Least coordinate along ŝ, mm.
    pub s0: f64,
    /// Greatest coordinate along ŝ, mm.
    pub s1: f64,
}

impl ProfileRect {
    /// The rectangle with all sides moved outwards by `by_mm`.
    pub fn grown(self, by_mm: f64) -> Self {
        Self {
            n0: self.n0 - by_mm,
            n1: self.n1 + by_mm,
            s0: self.s0 - by_mm,
            s1: self.s1 + by_mm,
        }
    }

    /// Five by five points inside, along `n` and ŝ, mm. The outer ones keep a share of the width from the
    /// sides, since clearances and sampled fields round off edges.
    pub fn points(self) -> impl Iterator<Item = [f64; 2]> {
        const N: usize = 5;
        const FROM_SIDE: f64 = 0.16;
        let between = move |from: f64, to: f64, i: usize| {
            let at = FROM_SIDE + (1.0 - 2.0 * FROM_SIDE) * i as f64 / (N - 1) as f64;
            from + (to - from) * at
        };
        (0..N * N).map(move |i| [between(self.n0, self.n1, i % N), between(self.s0, self.s1, i / N)])
    }

    /// Corners of the rectangle in space, at a station.
    pub fn corners(self, at: &RunStation) -> [Vec3; 4] {
        [
            (self.n0, self.s0),
            (self.n1, self.s0),
            (self.n1, self.s1),
            (self.n0, self.s1),
        ]
        .map(|(n, s)| at.place(n, s))
    }
}

/// Least share of the [points](ProfileRect::points) of each part of a section that is free before carving,
/// and left by it, where the section counts as whole.
pub(crate) const WHOLE: f64 = 0.9;

/// The cross-section at a station: convex parts whose unions are the male and the female half.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Pin below the seam; then, where the male leaves sideways, the foot that joins it to its body.
    pub male: [Option<ProfileRect>; 2],
    /// Bottom, far wall and near wall of the channel; then what fills a closed end.
    pub female: [Option<ProfileRect>; 4],
    /// Filling of the corner between a tongue and the edge of the wall that it hangs from, a slot as narrow
    /// as the clearance. Reaches beyond the wall's side of the seam.
    pub corner: Option<ProfileRect>,
}

/// Angle between ŝ and the surface normal below which the pin is a tongue and needs a foot, rad: −40°.
const TONGUE_ANGLE: f64 = -0.698;
/// Depth to which parts reach into the wall they hang from, mm.
const ROOT_MM: f64 = 0.6;
/// Depth to which the filling of a tongue's corner reaches into tongue and wall, mm.
const CORNER_MM: f64 = 0.1;

/// Distance of the lip of a key's groove from the seam, mm.
const LIP_GAP_MM: f64 = 0.1;
/// Reduction of the tip of a rail's tongue, mm, so that the groove finds it.
const LEAD_IN_MM: f64 = 0.3;
/// Height to which a rail reaches up into walls that are less flat than the rail, mm.
const RAIL_ROOT_MM: f64 = 1.2;

impl Section {
    /// The cross-section at a station.
    pub fn at(params: &ConnectorParams, station: &RunStation) -> Self {
        match station.shape {
            RunShape::Seam => Self::seam(station),
            RunShape::Stop => Self::stop(station),
            RunShape::Rail(part) => Self::rail(params, station, part),
        }
    }

    /// Rectangle around all parts.
    pub fn bounds(&self) -> ProfileRect {
        Self::bounds_of(self.male.iter().chain(&self.female).flatten())
    }

    /// Rectangle around some parts; empty, with its sides reversed, if there are none.
    pub fn bounds_of<'a>(parts: impl Iterator<Item = &'a ProfileRect>) -> ProfileRect {
        let empty = ProfileRect {
            n0: f64::INFINITY,
            n1: f64::NEG_INFINITY,
            s0: f64::INFINITY,
            s1: f64::NEG_INFINITY,
        };
        parts.fold(empty, |all, part| ProfileRect {
            n0: all.n0.min(part.n0),
            n1: all.n1.max(part.n1),
            s0: all.s0.min(part.s0),
            s1: all.s1.max(part.s1),
        })
    }

    /// Cross-section of a rail: a tongue of the male under the female's wall, and the female's groove around
    /// it; ŝ points out of the surface.
    ///
    /// ```text
    ///      M M M M│F F F F F F
    ///      ───┐M M│  ┌──┐F F ──      ─── inner side of the wall
    ///         │M M└────┐│F│
    ///         └────────┘│F│          tongue
    ///              ┌────┘F│
    ///              └──────┘          lip
    /// ```
    fn rail(params: &ConnectorParams, station: &RunStation, part: RailPart) -> Self {
        let (d, c) = (station.size_mm, station.clearance_mm);
        let reach = (0.5 * d).max(LEAST_PART_MM + c);
        let thick = (0.45 * d).max(LEAST_PART_MM);
        let wall = (0.5 * d - c).max(LEAST_PART_MM).max(params.min_wall_mm);
        let floor = -2.0 * c - 2.0 * thick;
        let lead = if part == RailPart::LeadIn {
            LEAD_IN_MM.min(0.3 * thick)
        } else {
            0.0
        };
        let has_tongue = part != RailPart::Stop;
        let outer = reach + c + wall;
        let tongue = ProfileRect {
            n0: -reach,
            n1: reach - lead,
            s0: -c - thick + lead,
            s1: -c - lead,
        };
        Self {
            male: [
                has_tongue.then_some(tongue),
                has_tongue.then_some(ProfileRect {
                    n0: -reach,
                    n1: -c,
                    s0: tongue.s0,
                    s1: RAIL_ROOT_MM,
                }),
            ],
            female: [
                Some(ProfileRect {
                    n0: LIP_GAP_MM,
                    n1: outer,
                    s0: floor,
                    s1: -2.0 * c - thick,
                }),
                Some(ProfileRect {
                    n0: reach + c,
                    n1: outer,
                    s0: floor,
                    s1: RAIL_ROOT_MM,
                }),
                None,
                (!has_tongue).then_some(ProfileRect {
                    n0: LIP_GAP_MM,
                    n1: outer,
                    s0: floor,
                    s1: RAIL_ROOT_MM,
                }),
            ],
            corner: None,
        }
    }

    /// Cross-section of a seam for the angle `T` of a station: −90° a tongue under the female (forward
    /// connector), 0 a pin that pulls straight out, up to 60° backward.
    ///
    /// Lengths along ŝ are divided by the station's depth factor, so that they are right when measured across
    /// the seam.
    fn seam(station: &RunStation) -> Self {
        let (d, c) = (station.size_mm, station.clearance_mm);
        let (forward, backward) = ((-station.theta).max(0.0), station.theta.max(0.0));
        // Stretch along ŝ, which leans against the seam by the angle whose cosine is `depth`.
        let k = 1.0 / station.depth.max(0.4);
        let pin_width = (PIN_WIDTH * d).max(LEAST_PART_MM + c);
        let foot_width = (FOOT_WIDTH * d).max(LEAST_FOOT_MM);
        let wall = (PIN_WIDTH * d - c).max(LEAST_PART_MM);
        let bottom = (FLOOR * d).max(LEAST_PART_MM);
        let lean = pin_width * backward.tan();
        let pin_depth = (PIN_DEPTH * d + lean) * k;
        let top_male = d.min(pin_width * forward.min(1.48).tan() + ROOT_MM) * k;
        let is_tongue = station.theta < TONGUE_ANGLE;
        let top_near = if is_tongue {
            0.0
        } else {
            (foot_width * backward.tan() + 0.5) * k
        };
        let (c_s, floor) = (c * k, -pin_depth - c * k - bottom * k);
        let far = -pin_width - c - wall;
        Self {
            corner: is_tongue.then_some(ProfileRect {
                n0: -c - CORNER_MM,
                n1: CORNER_MM,
                s0: -c,
                s1: top_male.min(ROOT_MM),
            }),
            male: [
                Some(ProfileRect {
                    n0: -pin_width,
                    n1: -c,
                    s0: -pin_depth,
                    s1: top_male,
                }),
                is_tongue.then_some(ProfileRect {
                    n0: -pin_width,
                    n1: ROOT_MM,
                    s0: 0.5 * c,
                    s1: top_male,
                }),
            ],
            female: [
                Some(ProfileRect {
                    n0: far,
                    n1: foot_width,
                    s0: floor,
                    s1: -pin_depth - c_s,
                }),
                Some(ProfileRect {
                    n0: far,
                    n1: -pin_width - c,
                    s0: floor,
                    s1: -lean * k - c_s,
                }),
                Some(ProfileRect {
                    n0: 0.0,
                    n1: foot_width,
                    s0: floor,
                    s1: top_near,
                }),
                None,
            ],
        }
    }

    /// Cross-section of a closed end of a channel: there is no pin, and its place is filled up to where the
    /// pin's wall would be.
    fn stop(station: &RunStation) -> Self {
        let open = Self::seam(station);
        let far = open.female[1];
        let filling = Self::bounds_of(open.female.iter().flatten());
        Self {
            male: [None, None],
            female: [
                open.female[0],
                far,
                open.female[2],
                far.map(|far| ProfileRect {
                    s1: far.s1,
                    ..filling
                }),
            ],
            corner: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn station(theta_degrees: f64, size_mm: f64) -> RunStation {
        RunStation {
            point: Vec3::ZERO,
            tangent: Vec3::X,
            n: Vec3::Y,
            s: Vec3::Z,
            theta: theta_degrees.to_radians(),
            depth: 1.0,
            arc_mm: 0.0,
            size_mm,
            clearance_mm: ConnectorParams::default().clearance_mm,
            shape: RunShape::Seam,
        }
    }

    fn angles_and_sizes() -> impl Iterator<Item = (f64, f64)> {
        [2.0, 2.5, 4.0]
            .into_iter()
            .flat_map(|d| (-90..=60).step_by(5).map(move |t| (f64::from(t), d)))
    }

    #[test]
    fn a_straight_channel_is_as_deep_as_sizes_are_chosen_for() {
        let params = ConnectorParams::default();
        let section = Section::at(&params, &station(0.0, 3.0));
        let floor = section
            .female
            .iter()
            .flatten()
            .map(|part| part.s0)
            .fold(f64::INFINITY, f64::min);
        assert!(
            (-floor - shellock_plan::sizes::depth_mm(3.0, params.clearance_mm)).abs() < 1e-12,
            "{floor}"
        );
    }

    #[test]
    fn pin_and_channel_keep_the_clearance_at_every_angle() {
        let params = ConnectorParams::default();
        for (degrees, size_mm) in angles_and_sizes() {
            let section = Section::at(&params, &station(degrees, size_mm));
            let pin = section.male[0].unwrap();
            for wall in section.female.iter().flatten() {
                let gap_n = (wall.n0 - pin.n1).max(pin.n0 - wall.n1);
                let gap_s = (wall.s0 - pin.s1).max(pin.s0 - wall.s1);
                assert!(
                    gap_n.max(gap_s) >= params.clearance_mm - 1e-12,
                    "at {degrees}°: {wall:?}"
                );
            }
        }
    }

    #[test]
    fn a_stop_fills_the_channel_at_every_angle_and_no_more() {
        for (degrees, size_mm) in angles_and_sizes() {
            let at = station(degrees, size_mm);
            let (open, closed) = (Section::seam(&at), Section::stop(&at));
            assert_eq!(open.female[..3], closed.female[..3]);
            let [bottom, far, near] = [0, 1, 2].map(|i| open.female[i].unwrap());
            let filling = closed.female[3].unwrap();
            assert_eq!([filling.n0, filling.n1, filling.s0], [far.n0, near.n1, bottom.s0]);
            assert!(
                filling.s1 == far.s1 && filling.s1 <= -at.clearance_mm,
                "at {degrees}°"
            );
        }
    }

    #[test]
    fn tongue_and_groove_of_a_rail_keep_the_keys_clearance_and_overlap_both_ways() {
        for (size_mm, key_clearance_mm) in [(2.0, 0.1), (2.5, 0.15), (4.0, 0.3)] {
            let params = ConnectorParams::default();
            let station = RunStation {
                clearance_mm: key_clearance_mm,
                ..station(0.0, size_mm)
            };
            for part in [RailPart::Full, RailPart::LeadIn] {
                let section = Section::rail(&params, &station, part);
                let [tongue, root] = section.male.map(Option::unwrap);
                for wall in section.female.iter().flatten() {
                    for male in [tongue, root] {
                        let gap_n = (wall.n0 - male.n1).max(male.n0 - wall.n1);
                        let gap_s = (wall.s0 - male.s1).max(male.s0 - wall.s1);
                        assert!(gap_n.max(gap_s) >= key_clearance_mm - 1e-12, "{wall:?}");
                    }
                    assert!((wall.n1 - wall.n0).min(wall.s1 - wall.s0) >= params.min_wall_mm);
                }
                let lip = section.female[0].unwrap();
                // The key's wall lies above the tongue and its lip below: neither lets the tongue out across
                // the seam.
                assert!(tongue.s1 < 0.0 && tongue.n1 > 0.5 && lip.s1 < tongue.s0 && lip.n0 < 0.3 * tongue.n1);
            }
            assert!(
                Section::rail(&params, &station, RailPart::Stop)
                    .male
                    .iter()
                    .all(Option::is_none)
            );
        }
    }

    #[test]
    fn no_part_is_thinner_than_the_least_at_any_angle_and_size() {
        let params = ConnectorParams::default();
        for (degrees, size_mm) in angles_and_sizes() {
            let station = station(degrees, size_mm);
            for section in [
                Section::seam(&station),
                Section::stop(&station),
                Section::rail(&params, &station, RailPart::Full),
            ] {
                for part in section.male.iter().chain(&section.female).flatten() {
                    assert!(
                        (part.n1 - part.n0).min(part.s1 - part.s0) >= LEAST_PART_MM - 1e-12,
                        "at {degrees}°, {size_mm} mm: {part:?}"
                    );
                }
            }
        }
    }
}
