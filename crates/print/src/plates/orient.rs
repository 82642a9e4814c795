//! Choice of the build orientation of a piece.
//!
//! Candidates for the direction that points up come from the facets of the convex hull, on which a piece
//! rests by itself, and from the whole sphere, for pieces on supports. Directions near the best of these are
//! tried, too. A pose costs the time and the plastic given by the closed forms (`time`). In the same unit, it
//! costs the work afterwards: supports leave marks on the visible skin, and unstable pieces fall over.

use rayon::prelude::*;
use shellock_geom::{Aabb, TriMesh, Vec3, Volume};

use super::foothold::Foothold;
use super::{Printable, Skin};
use crate::columns::Columns;
use crate::load::Load;
use crate::printer::{Printer, Process};
use crate::slicing::Slicing;
use crate::supports::Supports;
use crate::time::{grams, seconds};

/// Largest height above the plate, mm, and least cosine of the slope of a face that needs no support because
/// it rests on the plate.
const RESTING_MM: f64 = 0.05;
const COS_RESTING: f64 = 0.999;
/// Cosine of the angle from straight down within which a face of a resin print needs support: 45°.
const COS_OVERHANG: f64 = 0.707;
/// Number of hull facets tried, largest first, and cosine of the angle below which two count as one: 8°.
const N_FACETS: usize = 24;
const COS_SAME: f64 = 0.99;
/// Number of directions over the sphere: 18° from one to the next.
const N_SPREAD: u32 = 120;
/// Cell width for the first judgement of all directions, mm. The best `N_AGAIN` of them are judged again with
/// cells of 1 mm, and so are directions 6° off the best `N_NEAR`.
const COARSE_MM: f64 = 2.0;
/// Largest deviation of the simple mesh from the piece, mm.
const DEVIATION_MM: f64 = 0.2;
const N_AGAIN: usize = 4;
/// Number of directions judged at once.
const N_AT_ONCE: usize = 12;
const N_NEAR: usize = 1;
const NEAR_RAD: f64 = 0.1;
/// Conditions for a stable piece, mm. Its foot is all that lies within `FOOT_MM` of the plate, with the
/// supports. Its centre of mass must be above the foot, by `STANDING_MM` inside on all sides.
const FOOT_MM: f64 = 0.3;
const STANDING_MM: f64 = 1.0;
/// Number of rotations about the vertical tried within a quarter turn.
const N_YAWS: u32 = 36;

/// Orientation of a piece, before its translation on the plate.
#[derive(Clone)]
pub(super) struct Pose {
    /// Axes of the plate in the frame of the piece. Coordinates on the plate are dot products with them.
    pub axes: [Vec3; 3],
    /// Bounding box of the piece in these axes.
    pub bounds: Aabb,
    pub support: Support,
    /// First layer of a filament print; `None` for other processes.
    pub foothold: Option<Foothold>,
    pub load: Load,
}

impl Pose {
    pub fn footprint_mm2(&self) -> f64 {
        let size = self.bounds.size();
        size.x * size.y
    }

    /// Returns the pose turned by 90° about the vertical.
    pub fn quarter_turn(&self) -> Self {
        let [x, y, z] = self.axes;
        let Aabb { min, max } = self.bounds;
        let bounds = Aabb {
            min: Vec3::new(-max.y, min.x, min.z),
            max: Vec3::new(-min.y, max.x, max.z),
        };
        Self {
            axes: [-y, x, z],
            bounds,
            support: self.support,
            foothold: self.foothold,
            load: self.load,
        }
    }
}

/// Areas that need support.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Support {
    /// Area of outer skin, mm².
    pub outer_mm2: f64,
    /// Area of all faces, mm².
    pub all_mm2: f64,
}

/// Prices of a pose's drawbacks, in seconds of print time.
struct Prices {
    /// Price of a gram of material.
    gram_s: f64,
    /// Price of a mm² of outer skin with marks of supports.
    mark_s: f64,
    /// Price of a mm³ of a cup that pulls on the film.
    cup_s: f64,
    /// Price of a mm² of the largest slice, which is peeled off.
    peel_s: f64,
    /// Price of a pose that is not stable, even with its supports.
    falling_s: f64,
    /// Price of a pose in which the piece needs a raft: the raft and its removal.
    raft_s: f64,
}

/// Prices of somebody who prints by `process`. In resin, skin matters most, as supports leave pits. In
/// filament, a cm² of marks costs ten minutes: at seven and a half, nine kits took 2 % less time, and 68 cm²
/// of their skin were marked instead of 42. A gram of filament costs two minutes, less than half of the
/// time to print it. A raft costs ten minutes: it takes a hundredth of the time to print, and it must be
/// peeled off.
fn prices(process: Process) -> Prices {
    match process {
        Process::Sla => Prices {
            gram_s: 60.0,
            mark_s: 12.0,
            cup_s: 0.5,
            peel_s: 0.3,
            falling_s: 0.0,
            raft_s: 0.0,
        },
        Process::Fdm => Prices {
            gram_s: 120.0,
            mark_s: 6.0,
            cup_s: 0.0,
            peel_s: 0.0,
            falling_s: 3600.0,
            raft_s: 600.0,
        },
        Process::Sls => Prices {
            gram_s: 0.0,
            mark_s: 0.0,
            cup_s: 0.0,
            peel_s: 0.0,
            falling_s: 0.0,
            raft_s: 0.0,
        },
    }
}

/// A direction that may point up, with its cost in seconds of print time.
struct Judged {
    cost_s: f64,
    up: Vec3,
}

/// Finds the best pose within `room_mm`: width, depth and height. `None` if the piece is too large in every
/// pose tried, or has no convex hull.
pub(super) fn best(
    printer: &Printer,
    slicing: Slicing,
    piece: &Printable<'_>,
    room_mm: [f64; 3],
) -> Option<Pose> {
    let body = Body::of(piece, slicing)?;
    let all = |directions: Vec<Vec3>, cell_mm: f64, most_s: f64| -> Vec<Judged> {
        directions
            .into_par_iter()
            .map(|up| body.judge(printer, up, cell_mm, most_s))
            .collect()
    };
    let mut coarse: Vec<Judged> = Vec::new();
    let mut rest = body.by_least_cost(printer);
    // A direction whose lower bound exceeds the cost of `N_AGAIN` judged ones cannot be among the best.
    while !rest.is_empty() && (coarse.len() < N_AGAIN || rest[0].0 < coarse[N_AGAIN - 1].cost_s) {
        let few = rest
            .drain(..rest.len().min(N_AT_ONCE))
            .map(|(_, up)| up)
            .collect();
        let most_s = coarse
            .get(N_AGAIN - 1)
            .map_or(f64::INFINITY, |judged| judged.cost_s);
        coarse.extend(all(few, COARSE_MM, most_s));
        cheapest_first(&mut coarse);
    }
    let again: Vec<Vec3> = coarse.iter().take(N_AGAIN).map(|j| j.up).collect();
    let mut fine = all(again, crate::load::CELL_MM, f64::INFINITY);
    cheapest_first(&mut fine);
    let near = fine.iter().take(N_NEAR).flat_map(|j| nearby(j.up)).collect();
    fine.extend(all(near, crate::load::CELL_MM, f64::INFINITY));
    cheapest_first(&mut fine);
    let judged = fine.into_iter().chain(coarse).map(|judged| judged.up);
    let unjudged = rest.into_iter().map(|(_, up)| up);
    let turn = judged
        .chain(unjudged)
        .find_map(|up| body.best_turn(up, room_mm))?;
    Some(pose(printer, piece, &body, turn))
}

/// Measures the piece, with all its triangles, in the pose that was found.
fn pose(printer: &Printer, piece: &Printable<'_>, body: &Body<'_>, (axes, bounds): (Axes, Aabb)) -> Pose {
    let (mesh, up) = (piece.mesh, axes[2]);
    let overhangs = (0..mesh.triangles.len()).filter(|&f| -mesh.face_normal(f).dot(up) >= COS_OVERHANG);
    let faces: Vec<Face> = overhangs.map(|f| Face::of(mesh, f, &piece.skin, 0.0)).collect();
    let (x, y) = up.any_orthonormal_pair();
    Pose {
        axes,
        bounds,
        support: support(&faces, bounds.min.z, up),
        foothold: (printer.process == Process::Fdm).then(|| body.foothold(printer, up)),
        load: Load::of(mesh, [x, y, up], printer, body.slicing),
    }
}

/// Sorts stably, so that the first of equally good directions stays first.
fn cheapest_first(judged: &mut [Judged]) {
    judged.sort_by(|a, b| a.cost_s.total_cmp(&b.cost_s));
}

/// Returns true if some pose fits into `room_mm`: width, depth and height.
pub(super) fn fits(piece: &Printable<'_>, room_mm: [f64; 3]) -> bool {
    Body::of(piece, Slicing::USUAL).is_some_and(|body| {
        let mut directions = body.directions().into_iter();
        directions.any(|up| body.best_turn(up, room_mm).is_some())
    })
}

/// Returns six directions around one, 6° off.
fn nearby(up: Vec3) -> Vec<Vec3> {
    let (x, y) = up.any_orthonormal_pair();
    (0..6)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 6.0).sin_cos();
            (up + NEAR_RAD * (cos * x + sin * y)).normalize()
        })
        .collect()
}

/// Axes of the plate in the frame of the piece.
pub(super) type Axes = [Vec3; 3];

/// Properties of a piece that decide its orientation.
struct Body<'a> {
    hull: TriMesh,
    center: Vec3,
    /// The piece with all its triangles.
    exact: &'a TriMesh,
    /// The simple mesh, and its faces.
    mesh: &'a TriMesh,
    faces: Vec<Face>,
    slicing: Slicing,
}

struct Face {
    normal: Vec3,
    center: Vec3,
    area_mm2: f64,
    is_outer: bool,
}

impl Face {
    fn of(mesh: &TriMesh, f: usize, skin: &Skin<'_>, deviation_mm: f64) -> Self {
        let center = mesh.face_center(f);
        Self {
            normal: mesh.face_normal(f),
            center,
            area_mm2: mesh.face_area(f),
            is_outer: skin.holds(center, deviation_mm),
        }
    }
}

impl<'a> Body<'a> {
    fn of(piece: &Printable<'a>, slicing: Slicing) -> Option<Self> {
        let hull = Volume::hull(&piece.mesh.points).to_mesh();
        if hull.triangles.is_empty() {
            return None;
        }
        let mesh = piece.simple;
        let face = |f: usize| Face::of(mesh, f, &piece.skin, DEVIATION_MM);
        Some(Self {
            hull,
            center: center_of_mass(mesh),
            exact: piece.mesh,
            mesh,
            faces: (0..mesh.triangles.len()).map(face).collect(),
            slicing,
        })
    }

    /// Returns all candidate directions that may point up.
    fn directions(&self) -> Vec<Vec3> {
        let mut facets: Vec<(f64, Vec3)> = Vec::new();
        let n = self.hull.triangles.len();
        let mut by_area: Vec<(f64, Vec3)> = (0..n)
            .map(|f| (self.hull.face_area(f), self.hull.face_normal(f)))
            .collect();
        by_area.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (area, normal) in by_area {
            match facets.iter_mut().find(|facet| facet.1.dot(normal) > COS_SAME) {
                Some(facet) => facet.0 += area,
                None => facets.push((area, normal)),
            }
        }
        facets.sort_by(|a, b| b.0.total_cmp(&a.0));
        let resting = facets.into_iter().take(N_FACETS).map(|facet| -facet.1);
        // A spiral from pole to pole, by the golden angle.
        let spread = (0..N_SPREAD).map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(N_SPREAD);
            let (sin, cos) = (f64::from(i) * 2.399_963).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * cos, r * sin, z)
        });
        let axes = [Vec3::X, Vec3::Y, Vec3::Z]
            .into_iter()
            .flat_map(|axis| [axis, -axis]);
        resting.chain(axes).chain(spread).collect()
    }

    /// Returns all directions with lower bounds of their costs, in seconds of print time, cheapest first. The
    /// bounds count print time by height, without supports, and marks on the skin.
    fn by_least_cost(&self, printer: &Printer) -> Vec<(f64, Vec3)> {
        let prices = prices(printer.process);
        let least = |up: Vec3| {
            let heights = self.hull.points.iter().map(|p| p.dot(up));
            let [lo, hi] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], h| {
                [lo.min(h), hi.max(h)]
            });
            // Columns and simplified meshes may be slightly lower than the hull.
            let load = Load {
                height_mm: (hi - lo - COARSE_MM).max(0.0),
                ..Load::default()
            };
            let mark_s = prices.mark_s * self.support(up).outer_mm2;
            (seconds(printer, &load) + mark_s + self.raft_s(printer, up), up)
        };
        let mut all: Vec<(f64, Vec3)> = self.directions().into_par_iter().map(least).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all
    }

    /// Judges the cost of a direction, with cells of `cell_mm`. A direction that costs more than `most_s` in
    /// any case gets a lower bound of its cost that exceeds `most_s`.
    fn judge(&self, printer: &Printer, up: Vec3, cell_mm: f64, most_s: f64) -> Judged {
        let prices = prices(printer.process);
        let (x, y) = up.any_orthonormal_pair();
        let columns = Columns::of(self.mesh, [x, y, up], cell_mm);
        let supports = Supports::of(&columns, printer, self.slicing.supports);
        let mut load = Load::without_slices(self.mesh, up, printer, self.slicing, &columns, &supports);
        let marks_s = prices.mark_s * self.support(up).outer_mm2;
        let printing_s =
            |load: &Load| seconds(printer, load) + prices.gram_s * grams(printer, load) + marks_s;
        if printer.process == Process::Sla && printing_s(&load) > most_s {
            let cost_s = printing_s(&load);
            return Judged { cost_s, up };
        }
        load.add_slices(printer, &columns, &supports);
        let mut cost_s = printing_s(&load) + prices.cup_s * load.cup_mm3 + prices.peel_s * load.widest_mm2;
        if prices.falling_s > 0.0 && !self.stands(&columns, &supports, [x, y]) {
            cost_s += prices.falling_s;
        }
        cost_s += self.raft_s(printer, up);
        Judged { cost_s, up }
    }

    /// Price of a pose in which a filament print needs a raft.
    fn raft_s(&self, printer: &Printer, up: Vec3) -> f64 {
        let raft_s = prices(printer.process).raft_s;
        if raft_s > 0.0 && !self.foothold(printer, up).is_enough() {
            raft_s
        } else {
            0.0
        }
    }

    fn foothold(&self, printer: &Printer, up: Vec3) -> Foothold {
        let (x, y) = up.any_orthonormal_pair();
        let layer = [self.lowest_mm(up), printer.layer_mm];
        Foothold::of(self.exact, [x, y, up], layer, self.center)
    }

    fn lowest_mm(&self, up: Vec3) -> f64 {
        let heights = self.hull.points.iter().map(|p| p.dot(up));
        heights.fold(f64::INFINITY, f64::min)
    }

    /// Areas that need support with `up` as the vertical.
    fn support(&self, up: Vec3) -> Support {
        support(&self.faces, self.lowest_mm(up), up)
    }

    /// Returns true if the centre of mass is above the foot and the supports on the plate, with a margin.
    fn stands(&self, columns: &Columns, supports: &Supports, axes: [Vec3; 2]) -> bool {
        let [x, y] = axes.map(|axis| self.center.dot(axis));
        let foot: Vec<[f64; 2]> = (0..columns.len())
            .filter(|&column| {
                let lies = columns
                    .spans(column)
                    .first()
                    .is_some_and(|s| s.bottom_mm < FOOT_MM);
                lies || supports
                    .of_column(column)
                    .first()
                    .is_some_and(|[lo, _]| *lo == 0.0)
            })
            .map(|column| columns.middle(column))
            .map(|[at, along]| [at - x, along - y])
            .collect();
        (0..24).all(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 24.0).sin_cos();
            let reach = foot
                .iter()
                .map(|[x, y]| x * cos + y * sin)
                .fold(f64::NEG_INFINITY, f64::max);
            reach >= STANDING_MM
        })
    }

    /// Returns the axes with `up` as the vertical that have the smallest footprint and fit into `room_mm`, if
    /// any do, and the bounds of the piece in them.
    fn best_turn(&self, up: Vec3, room_mm: [f64; 3]) -> Option<(Axes, Aabb)> {
        let (x, y) = up.any_orthonormal_pair();
        let turns = (0..N_YAWS).map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_2 / f64::from(N_YAWS)).sin_cos();
            let axes = [cos * x + sin * y, cos * y - sin * x, up];
            let posed = |p: &Vec3| Vec3::from_array(axes.map(|a| a.dot(*p)));
            (axes, Aabb::around(self.hull.points.iter().map(posed)))
        });
        let [width, depth, height] = room_mm;
        let has_room = |(_, bounds): &(Axes, Aabb)| {
            let [a, b, c] = bounds.size().to_array();
            c <= height && (a <= width && b <= depth || b <= width && a <= depth)
        };
        let footprint_mm2 = |bounds: &Aabb| bounds.size().x * bounds.size().y;
        turns
            .filter(has_room)
            .min_by(|a, b| footprint_mm2(&a.1).total_cmp(&footprint_mm2(&b.1)))
    }
}

/// Areas of overhanging faces with `up` as the vertical, except faces that rest on the plate at the height
/// `lowest`.
fn support(faces: &[Face], lowest: f64, up: Vec3) -> Support {
    let mut support = Support::default();
    for face in faces {
        let downwards = -face.normal.dot(up);
        let rests = face.center.dot(up) - lowest < RESTING_MM && downwards > COS_RESTING;
        if downwards < COS_OVERHANG || rests {
            continue;
        }
        support.all_mm2 += face.area_mm2;
        if face.is_outer {
            support.outer_mm2 += face.area_mm2;
        }
    }
    support
}

fn center_of_mass(mesh: &TriMesh) -> Vec3 {
    let origin = mesh.points.first().copied().unwrap_or_default();
    let (mut sum, mut volume) = (Vec3::ZERO, 0.0);
    for f in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(f).map(|p| p - origin);
        let sixfold = a.dot(b.cross(c));
        sum += sixfold * (a + b + c) / 4.0;
        volume += sixfold;
    }
    if volume > 0.0 {
        origin + sum / volume
    } else {
        mesh.bounds().center()
    }
}
