//! The coupon: a small plate of real joints at five clearances, for finding those that a printer needs.
//!
//! It has five numbers, each with the four parts of two joints. A *pin* goes straight down into a *channel*,
//! as a piece goes in beside its neighbour, and a *key* slides on a *rail*. Profiles and gaps are those of
//! kits: the halves of [`crate::connector`], and walls that stay back from the seam by the printer's
//! tolerance. The rest of each part is for holding it.
//!
//! ```text
//!     ┌───┬─────────────┬─┐  channel, from above:     ┌───┬─────────┬─┐  rail:
//!     │ 1 │             │ │  wall                     │   └─────────┘ │
//!     │   ├─────────────┤ │  seam                     │ 1 │  key,   │ │  tongues on
//!     │   │ pin, in its │ │  cheeks at the            │   │ in its  │ │  both sides
//!     └───┤ place       ├─┘  pin's ends               └───┤  place  ├─┘
//!         └─────────────┘                                 └─────────┘
//! ```
//!
//! No part needs supports. Channels and rails print with their outer side up, pins with it down, and keys
//! stand on the end that leaves first. Edges that lie on the plate where parts meet are bevelled, since first
//! layers come out wider.
//!
//! Parts are modelled in their place in the joint: z points out of the wall, whose inner side is z = 0.

mod engraving;
#[cfg(test)]
mod tests;

use engraving::Sheet;
use shellock_geom::rounding::{NotPrintable, printable_body};
use shellock_geom::{Aabb, TriMesh, Vec3, Volume};
use shellock_report::PatchId;

use crate::connector::{ConnectorParams, RailPart, Run, RunShape, RunStation, Section, rail_places, stop_mm};
use crate::piece::whole_halves;

/// Number of clearances on a coupon.
pub const N_FITS: usize = 5;

/// Connector size D, mm: the smallest of kits, whose walls are the hardest to print.
const SIZE_MM: f64 = 2.0;
/// Thickness of the walls, mm: the smallest of kits.
const WALL_MM: f64 = 1.6;
/// Length of the pin's seam, mm, and distance of the pin's ends from those of its wall, mm.
const SEAM_MM: f64 = 8.6;
const PIN_END_MM: f64 = 0.8;
/// Depths from the seam of the pin's wall and of the channel's, and depth to which cheeks embrace the pin's,
/// mm.
const PIN_DEEP_MM: f64 = 4.8;
const CHANNEL_DEEP_MM: f64 = 1.6;
const CHEEK_DEEP_MM: f64 = 3.5;
/// Length of the key, mm. It prints standing: a resin printer takes half an hour for 6.2 mm.
const KEY_MM: f64 = 5.2;
/// Width of the core that joins the two grooves of a key besides their own walls, mm, so that the number has
/// room.
const CORE_MM: f64 = 0.5;
/// Widths of the holders at both ends of a seam, and at both sides of a rail, mm: the left one carries the
/// number.
const HOLDS_MM: [f64; 2] = [3.9, 1.2];
/// Width of the back that joins the sides of a rail, mm.
const BACK_MM: f64 = 1.2;
/// Depth to which halves reach into the wall they hang from where they end in it, mm.
const ROOT_MM: f64 = 0.6;
/// Bevels of edges of walls that lie on the plate, and of tongues, mm: a first layer comes out some 0.1 to
/// 0.3 mm wider.
const BROKEN_MM: f64 = 0.4;
const BROKEN_TONGUE_MM: f64 = 0.3;
/// Distance between parts on the plate, mm.
const APART_MM: f64 = 3.0;
/// Length by which a cut reaches past the material it removes, mm.
const PAST_MM: f64 = 1.0;

/// Clearances and tolerance of one number on the coupon. Lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Number from 1, the tightest, to [`N_FITS`], the loosest.
    pub number: u32,
    /// Gap of connectors. [0.03, 0.6].
    pub clearance_mm: f64,
    /// Gap of a key on its rails. [0.03, 0.8].
    pub key_clearance_mm: f64,
    /// Distance by which each side of a seam stays back. [0, 0.4].
    pub tolerance_mm: f64,
}

/// Ranges of the clearance of connectors and of keys, and greatest tolerance, mm, as everywhere.
const CLEARANCES_MM: [f64; 2] = [0.03, 0.6];
const KEY_CLEARANCES_MM: [f64; 2] = [0.03, 0.8];
const MOST_TOLERANCE_MM: f64 = 0.4;
/// Step of the clearance from one number to the next, as a share of the printer's, and its bounds, mm.
const STEP_SHARE: f64 = 0.25;
const STEPS_MM: [f64; 2] = [0.02, 0.1];

/// The five fits around those of a printer, which are number 3 where the ranges allow it.
///
/// From number to number, printed faces are assumed to stand out by half a step more. Both clearances
/// therefore grow by the step, since two faces meet there, and the tolerance, which is of one face, by half
/// of it.
pub fn fits(clearance_mm: f64, key_clearance_mm: f64, tolerance_mm: f64) -> [Fit; N_FITS] {
    let hundredths = |mm: f64| (100.0 * mm).round() / 100.0;
    let microns = |mm: f64| (1000.0 * mm).round() / 1000.0;
    let step_mm = hundredths((STEP_SHARE * clearance_mm).clamp(STEPS_MM[0], STEPS_MM[1]));
    let middle = (N_FITS / 2) as f64;
    let [least, most] = CLEARANCES_MM;
    // The series is shifted as a whole where it would leave the range.
    let first_mm = (clearance_mm - middle * step_mm)
        .min(most - 2.0 * middle * step_mm)
        .max(least);
    std::array::from_fn(|i| {
        let wider_mm = first_mm + i as f64 * step_mm - clearance_mm;
        let [key_least, key_most] = KEY_CLEARANCES_MM;
        Fit {
            number: i as u32 + 1,
            clearance_mm: microns(clearance_mm + wider_mm),
            key_clearance_mm: microns((key_clearance_mm + wider_mm).clamp(key_least, key_most)),
            tolerance_mm: microns((tolerance_mm + 0.5 * wider_mm).clamp(0.0, MOST_TOLERANCE_MM)),
        }
    })
}

/// Kind of a part of the coupon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A wall with a channel under its seam.
    Channel,
    /// A wall with a pin, which goes into the channel from outside.
    Pin,
    /// Two walls with tongues under their seams.
    Rail,
    /// A wall with two grooves, which slides on the rail.
    Key,
}

impl Kind {
    /// All kinds, as they lie on the plate from its back to its front.
    pub const ALL: [Self; 4] = [Self::Channel, Self::Pin, Self::Rail, Self::Key];

    /// Name of the kind, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Channel => "channel",
            Self::Pin => "pin",
            Self::Rail => "rail",
            Self::Key => "key",
        }
    }

    /// Directions on the plate of the x, y and z axes of the joint.
    fn axes(self) -> [[f64; 3]; 3] {
        match self {
            Self::Channel | Self::Rail => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Self::Pin => [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]],
            Self::Key => [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
        }
    }

    /// Direction in which the joint comes apart: that of the pin, or of the key.
    pub fn separation(self) -> Vec3 {
        match self {
            Self::Channel | Self::Pin => Vec3::Z,
            Self::Rail | Self::Key => -Vec3::Y,
        }
    }
}

/// A part of the coupon, with its place on the plate.
#[derive(Clone, Debug)]
pub struct Part {
    /// Kind of the part.
    pub kind: Kind,
    /// Clearances and tolerance of the part.
    pub fit: Fit,
    /// One closed body, mm, in its place in the joint.
    pub mesh: TriMesh,
    /// Directions on the plate of the x, y and z axes of the joint.
    pub axes: [[f64; 3]; 3],
    /// Shift of the part after that rotation, mm.
    pub moved_mm: [f64; 3],
}

impl Part {
    /// Number and kind of the part: "3 channel".
    pub fn name(&self) -> String {
        format!("{} {}", self.fit.number, self.kind.name())
    }

    /// Mesh of the part as it lies on the plate.
    pub fn on_plate(&self) -> TriMesh {
        let [x, y, z] = self.axes.map(Vec3::from_array);
        let moved = Vec3::from_array(self.moved_mm);
        let placed = |p: &Vec3| p.x * x + p.y * y + p.z * z + moved;
        TriMesh {
            points: self.mesh.points.iter().map(placed).collect(),
            triangles: self.mesh.triangles.clone(),
        }
    }
}

/// Lays the parts of all `fits` on a plate whose corner is the origin: one column per number, one row per
/// kind.
///
/// `min_wall_mm` is the thinnest wall that the printer makes, in [0.1, 2].
pub fn coupon(fits: &[Fit], min_wall_mm: f64) -> Result<Vec<Part>, NotPrintable> {
    let columns = fits
        .iter()
        .map(|fit| parts(fit, min_wall_mm))
        .collect::<Result<Vec<_>, _>>()?;
    let mut laid: Vec<Part> = columns.into_iter().flatten().collect();
    let boxes: Vec<Aabb> = laid.iter().map(|part| part.on_plate().bounds()).collect();
    let most = |of: &dyn Fn(&Part) -> bool, axis: usize| {
        let sizes = laid.iter().zip(&boxes).filter(|(part, _)| of(part));
        sizes.map(|(_, b)| b.size()[axis]).fold(0.0, f64::max)
    };
    let widths: Vec<f64> = fits
        .iter()
        .map(|fit| most(&|part| part.fit.number == fit.number, 0))
        .collect();
    let depths = Kind::ALL.map(|kind| most(&|part| part.kind == kind, 1));
    for (part, around) in laid.iter_mut().zip(boxes) {
        let column = fits.iter().position(|fit| fit.number == part.fit.number);
        let (column, row) = (column.unwrap_or_default(), part.kind as usize);
        let left_mm = widths[..column].iter().map(|w| w + APART_MM).sum::<f64>();
        let front_mm = depths[row + 1..].iter().map(|d| d + APART_MM).sum::<f64>();
        part.moved_mm = [
            left_mm + 0.5 * widths[column] - around.center().x,
            front_mm + 0.5 * depths[row] - around.center().y,
            -around.min.z,
        ];
    }
    Ok(laid)
}

/// Size of the box around all parts on their plate, mm.
pub fn size_mm(parts: &[Part]) -> [f64; 3] {
    let boxes = parts.iter().map(|part| part.on_plate().bounds());
    boxes.fold(Aabb::EMPTY, Aabb::union).size().to_array()
}

/// Makes the four parts of one number.
fn parts(fit: &Fit, min_wall_mm: f64) -> Result<[Part; 4], NotPrintable> {
    let connector = ConnectorParams {
        clearance_mm: fit.clearance_mm,
        key_clearance_mm: fit.key_clearance_mm,
        min_wall_mm,
        ..ConnectorParams::default()
    };
    let seam = SeamJoint::of(&connector, fit.tolerance_mm);
    let slide = SlideJoint::of(&connector, fit.tolerance_mm);
    let number = fit.number.to_string();
    let made = [
        (Kind::Channel, seam.channel(&number)),
        (Kind::Pin, seam.pin(&number)),
        (Kind::Rail, slide.rail(&number)),
        (Kind::Key, slide.key(&number)),
    ];
    let [channel, pin, rail, key] = made.map(|(kind, volume)| {
        Ok(Part {
            kind,
            fit: *fit,
            mesh: printable_body(&volume)?,
            axes: kind.axes(),
            moved_mm: [0.0; 3],
        })
    });
    Ok([channel?, pin?, rail?, key?])
}

/// A box, from its least to its greatest coordinates.
fn block(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> Volume {
    Volume::cuboid(Aabb {
        min: Vec3::new(x[0], y[0], z[0]),
        max: Vec3::new(x[1], y[1], z[1]),
    })
}

/// Hull of two rectangles, each given by x and y ranges and a height z.
fn frustum(ends: [([f64; 2], [f64; 2], f64); 2]) -> Volume {
    let corners = |(x, y, z): ([f64; 2], [f64; 2], f64)| {
        [[x[0], y[0]], [x[1], y[0]], [x[0], y[1]], [x[1], y[1]]].map(|[x, y]| Vec3::new(x, y, z))
    };
    Volume::hull(&ends.map(corners).concat())
}

/// The range extended by `by_mm` at both ends.
fn grown([least, most]: [f64; 2], by_mm: f64) -> [f64; 2] {
    [least - by_mm, most + by_mm]
}

/// Lowest coordinate of a section's parts, mm, at most 0; 0 is the wall's inner side.
fn lowest<'a>(parts: impl IntoIterator<Item = &'a Option<crate::connector::ProfileRect>>) -> f64 {
    let heights = parts.into_iter().flatten().map(|part| part.s0);
    heights.fold(0.0, f64::min)
}

/// Pin and channel: the seam runs along x at y = 0, the pin's wall lies at y < 0 and leaves along z.
struct SeamJoint<'a> {
    connector: &'a ConnectorParams,
    tolerance_mm: f64,
    /// Lowest coordinate of the channel, mm.
    floor_mm: f64,
}

impl<'a> SeamJoint<'a> {
    fn of(connector: &'a ConnectorParams, tolerance_mm: f64) -> Self {
        let section = Section::at(connector, &Self::station(connector, 0.0));
        Self {
            connector,
            tolerance_mm,
            floor_mm: lowest(&section.female),
        }
    }

    fn station(connector: &ConnectorParams, x: f64) -> RunStation {
        RunStation {
            point: Vec3::new(x, 0.0, 0.0),
            tangent: Vec3::X,
            n: Vec3::Y,
            s: Vec3::Z,
            theta: 0.0,
            depth: 1.0,
            arc_mm: x,
            size_mm: SIZE_MM,
            clearance_mm: connector.clearance_mm,
            shape: RunShape::Seam,
        }
    }

    /// Both halves of a run that extends `half_mm` each way from the middle.
    fn halves(&self, half_mm: f64) -> [Volume; 2] {
        let run = Run {
            male: PatchId(0),
            female: PatchId(1),
            stations: [-half_mm, half_mm]
                .map(|x| Self::station(self.connector, x))
                .to_vec(),
        };
        whole_halves(self.connector, &run)
    }

    fn channel(&self, number: &str) -> Volume {
        let (gap, floor, half) = (self.tolerance_mm, self.floor_mm, 0.5 * SEAM_MM);
        let outer = [-half - HOLDS_MM[0], half + HOLDS_MM[1]];
        let [_, female] = self.halves(half + ROOT_MM + gap);
        // As in kits, the parts that hang from a wall stay back with it above the clearance.
        let near = -0.5 * self.connector.clearance_mm;
        let above = [-self.connector.clearance_mm, WALL_MM];
        let female = female.subtract(&block(grown([-half, half], PAST_MM), [near, gap], above));
        let behind = [0.5 * SIZE_MM - 0.5 * ROOT_MM, CHANNEL_DEEP_MM];
        let cheek_y = [-CHEEK_DEEP_MM, CHANNEL_DEEP_MM];
        let body = Volume::union_all(vec![
            female,
            block(outer, [gap, CHANNEL_DEEP_MM], [0.0, WALL_MM]),
            block(outer, behind, [floor, 0.5 * WALL_MM]),
            block([outer[0], -half - gap], cheek_y, [floor, WALL_MM]),
            block([half + gap, outer[1]], cheek_y, [floor, WALL_MM]),
        ]);
        let cheek = Sheet {
            middle: Vec3::new(
                0.5 * (outer[0] - half - gap),
                0.5 * (cheek_y[0] + cheek_y[1]),
                WALL_MM,
            ),
            right: Vec3::X,
            up: Vec3::Y,
        };
        body.subtract(&Volume::union_all(cheek.strokes(number)))
    }

    fn pin(&self, number: &str) -> Volume {
        let gap = self.tolerance_mm;
        let [male, _] = self.halves(0.5 * SEAM_MM - PIN_END_MM);
        // Where the tolerance is larger than the clearance, the pin's root stays back, too.
        let above = [-self.connector.clearance_mm, WALL_MM];
        let male = male.subtract(&block([-SEAM_MM, SEAM_MM], [-gap, PAST_MM], above));
        let wall_x = [gap - 0.5 * SEAM_MM, 0.5 * SEAM_MM - gap];
        let wall_y = [-PIN_DEEP_MM, -gap];
        let broken = |range| grown(range, -BROKEN_MM);
        let wall = [
            block(wall_x, wall_y, [0.0, WALL_MM - BROKEN_MM]),
            frustum([
                (wall_x, wall_y, WALL_MM - BROKEN_MM),
                (broken(wall_x), broken(wall_y), WALL_MM),
            ]),
        ];
        let body = Volume::union_all(wall.into_iter().chain([male]).collect());
        // The number runs sideways, where it has more room.
        let inner_side = Sheet {
            middle: Vec3::new(0.0, -0.5 * (PIN_DEEP_MM + 0.5 * SIZE_MM), 0.0),
            right: -Vec3::Y,
            up: -Vec3::X,
        };
        body.subtract(&Volume::union_all(inner_side.strokes(number)))
    }
}

/// Rail and key: seams at two x run along y, the key lies between them and leaves along −y.
struct SlideJoint<'a> {
    connector: &'a ConnectorParams,
    tolerance_mm: f64,
    clearance_mm: f64,
    /// Half the distance from seam to seam, mm.
    half_mm: f64,
    /// Distance from a seam to the far side of the groove, mm.
    groove_mm: f64,
    /// Length by which a tongue reaches past its seam, mm.
    reach_mm: f64,
    /// Lowest coordinates of the tongue and of the key, mm.
    tongue_floor_mm: f64,
    key_floor_mm: f64,
}

impl<'a> SlideJoint<'a> {
    fn of(connector: &'a ConnectorParams, tolerance_mm: f64) -> Self {
        let clearance_mm = connector.clearance_of(true);
        let section = Section::at(
            connector,
            &Self::station(connector, 0.0, 1.0, 0.0, RailPart::Full),
        );
        let [Some(tongue), _] = section.male else {
            unreachable!("a whole rail has a tongue")
        };
        let outer_mm = section.female.iter().flatten().map(|p| p.n1).fold(0.0, f64::max);
        Self {
            connector,
            tolerance_mm,
            clearance_mm,
            half_mm: outer_mm + 0.5 * CORE_MM,
            groove_mm: tongue.n1 + clearance_mm,
            reach_mm: tongue.n1,
            tongue_floor_mm: lowest(&section.male),
            key_floor_mm: lowest(&section.female),
        }
    }

    /// Section of the rail whose seam is at `seam_x` and whose key lies on the side to which `side` points.
    fn station(
        connector: &ConnectorParams,
        seam_x: f64,
        side: f64,
        arc_mm: f64,
        part: RailPart,
    ) -> RunStation {
        RunStation {
            point: Vec3::new(seam_x, -arc_mm, 0.0),
            tangent: -Vec3::Y,
            n: side * Vec3::X,
            s: Vec3::Z,
            theta: 0.0,
            depth: 1.0,
            arc_mm,
            size_mm: SIZE_MM,
            clearance_mm: connector.clearance_of(true),
            shape: RunShape::Rail(part),
        }
    }

    /// Both halves of both rails, from `start_mm` along the way out from the back seam.
    fn halves(&self, start_mm: f64) -> [Volume; 2] {
        let end_mm = KEY_MM - stop_mm(SIZE_MM, self.clearance_mm);
        let places = rail_places([start_mm, end_mm], SIZE_MM, self.clearance_mm);
        let of_side = |side: f64| {
            let seam_x = -side * self.half_mm;
            let station = |(arc_mm, part)| Self::station(self.connector, seam_x, side, arc_mm, part);
            let run = Run {
                male: PatchId(0),
                female: PatchId(1),
                stations: places.map(station).to_vec(),
            };
            whole_halves(self.connector, &run)
        };
        let ([male_a, female_a], [male_b, female_b]) = (of_side(1.0), of_side(-1.0));
        [male_a.union(&male_b), female_a.union(&female_b)]
    }

    fn rail(&self, number: &str) -> Volume {
        let (gap, floor, half) = (self.tolerance_mm, self.tongue_floor_mm, self.half_mm);
        let outer = [-half - HOLDS_MM[0], half + HOLDS_MM[1]];
        let [tongues, _] = self.halves(-ROOT_MM);
        let along = [-KEY_MM, BACK_MM];
        let below = half + self.clearance_mm.max(gap);
        let body = Volume::union_all(vec![
            tongues,
            block([outer[0], -half - gap], along, [0.0, WALL_MM]),
            block([half + gap, outer[1]], along, [0.0, WALL_MM]),
            block([outer[0], -below], along, [floor, 0.5 * WALL_MM]),
            block([below, outer[1]], along, [floor, 0.5 * WALL_MM]),
            block(outer, [gap, BACK_MM], [floor, WALL_MM]),
        ]);
        // Bevels the edges of the open parts on the plate: tongues and back.
        let (open_x, open_y) = (half - self.reach_mm, [-KEY_MM - PAST_MM, gap]);
        let (open_x, past) = ([-open_x, open_x], BROKEN_TONGUE_MM + PAST_MM);
        let edges = frustum([
            (open_x, open_y, floor + BROKEN_TONGUE_MM),
            (grown(open_x, past), grown(open_y, past), floor - PAST_MM),
        ]);
        let side = Sheet {
            middle: Vec3::new(0.5 * (outer[0] - half - gap), 0.5 * (BACK_MM - KEY_MM), WALL_MM),
            right: Vec3::X,
            up: Vec3::Y,
        };
        let cut = side.strokes(number).into_iter().chain([edges]).collect();
        body.subtract(&Volume::union_all(cut))
    }

    fn key(&self, number: &str) -> Volume {
        let (gap, floor) = (self.tolerance_mm, self.key_floor_mm);
        // Beneath the wall the clearance counts, also from the edge of the other part's wall.
        let back = gap.max(self.clearance_mm - gap);
        let [_, grooves] = self.halves(back);
        let (half, core) = (self.half_mm - gap, self.half_mm - self.groove_mm);
        let along = [-KEY_MM, -gap];
        let body = Volume::union_all(vec![
            grooves,
            block([-half, half], along, [0.0, WALL_MM]),
            block([-core, core], [-KEY_MM, -back], [floor, 0.5 * WALL_MM]),
        ]);
        // As in kits, the parts that hang from a wall stay back with it above the clearance.
        let beside = |from: f64, z: [f64; 2]| {
            let (from, to) = (self.half_mm - from, self.half_mm + PAST_MM);
            [[from, to], [-to, -from]].map(|x| block(x, grown(along, PAST_MM), z))
        };
        let beyond = [
            beside(back, [-self.clearance_mm, 0.0]),
            beside(gap, [-0.5 * self.clearance_mm, WALL_MM + PAST_MM]),
        ]
        .concat();
        // The end that stands on the plate is bevelled.
        let front = -KEY_MM + BROKEN_MM;
        let ends = [
            (
                grown([-half, half], -BROKEN_MM),
                grown([floor, WALL_MM], -BROKEN_MM),
                -KEY_MM,
            ),
            ([-half, half], [floor, WALL_MM], front),
        ];
        let standing = |(x, z, y): ([f64; 2], [f64; 2], f64)| {
            [[x[0], z[0]], [x[1], z[0]], [x[0], z[1]], [x[1], z[1]]].map(|[x, z]| Vec3::new(x, y, z))
        };
        let [foot, shoulder] = ends.map(standing);
        let rest = shoulder.map(|p| Vec3::new(p.x, 0.0, p.z));
        let room = Volume::hull(&[foot, shoulder, rest].concat());
        let skin = Sheet {
            middle: Vec3::new(0.0, -0.5 * (KEY_MM + gap), WALL_MM),
            right: Vec3::X,
            up: Vec3::Y,
        };
        let cut = skin.strokes(number).into_iter().chain(beyond).collect();
        body.intersect(&room).subtract(&Volume::union_all(cut))
    }
}
