//! How a piece lies best on its plate.
//!
//! Tried are the facets of its convex hull, on which it rests by itself, and the 26 lattice directions, on
//! which supports hold it. What counts is set by the process: marks of supports on the skin that is seen,
//! supports at all, height, and whether it stands.

use shellock_geom::{Aabb, TriMesh, Vec3, Volume};

use super::Printable;
use crate::printer::{Printer, Process};

/// Cosine of the angle from straight down within which a face needs support: 45°.
const COS_OVERHANG: f64 = 0.707;
/// A face that lies so near to the plate, mm, and as flat as this needs none.
const RESTING_MM: f64 = 0.05;
const COS_RESTING: f64 = 0.999;
/// Facets of the hull that are tried, largest first, and the angle below which two count as one: 8°.
const N_FACETS: usize = 24;
const COS_SAME: f64 = 0.99;
/// A piece stands on what is so near to the plate, mm, if its centre of mass is above that by so much on all
/// sides, mm.
const FOOT_MM: f64 = 0.3;
const STANDING_MM: f64 = 1.0;
/// Turns about the vertical that are tried within a quarter.
const N_YAWS: u32 = 36;

/// A piece as it is laid, before it is moved.
#[derive(Clone)]
pub(super) struct Pose {
    /// The axes of the plate as the piece sees them: a point is at their products with it.
    pub axes: [Vec3; 3],
    /// The box around the piece, in these axes.
    pub bounds: Aabb,
    pub support: Support,
}

impl Pose {
    pub fn footprint_mm2(&self) -> f64 {
        let size = self.bounds.size();
        size.x * size.y
    }

    /// A quarter further about the vertical.
    pub fn quarter_turned(&self) -> Self {
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
        }
    }
}

/// What must be held up.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Support {
    /// Area of outer skin, mm².
    pub outer_mm2: f64,
    /// Area of everything, mm².
    pub all_mm2: f64,
    /// Volume below, down to the plate, mm³.
    pub below_mm3: f64,
}

/// What counts how much, in shares: of the area, of the diagonal.
///
/// Skin goes before all. Supports inside a piece cost a resin printer hardly anything, and height is its
/// time; a filament printer pays for supports with time and material.
struct Weights {
    outer: f64,
    all: f64,
    height: f64,
    falling: f64,
}

fn weights(process: Process) -> Weights {
    match process {
        Process::Sla => Weights {
            outer: 6.0,
            all: 0.3,
            height: 1.0,
            falling: 0.0,
        },
        Process::Fdm => Weights {
            outer: 6.0,
            all: 2.0,
            height: 0.3,
            falling: 1.5,
        },
        Process::Sls => Weights {
            outer: 0.0,
            all: 0.0,
            height: 1.0,
            falling: 0.0,
        },
    }
}

/// The best pose within `room_mm`, width, depth and height; `None` where the piece is too large in every pose
/// that is tried.
pub(super) fn best(printer: &Printer, piece: &Printable<'_>, room_mm: [f64; 3]) -> Option<Pose> {
    let body = Body::of(piece)?;
    let weights = weights(printer.process);
    let mut poses: Vec<(f64, Vec3, Support)> = body
        .directions()
        .into_iter()
        .map(|up| body.judged(&weights, up))
        .collect();
    // Stable: of equally good directions the first stays first.
    poses.sort_by(|a, b| a.0.total_cmp(&b.0));
    poses
        .into_iter()
        .find_map(|(_, up, support)| body.turned(up, support, room_mm))
}

/// What of a piece decides how it lies.
struct Body {
    hull: TriMesh,
    center: Vec3,
    area_mm2: f64,
    diagonal_mm: f64,
    faces: Vec<Face>,
}

struct Face {
    normal: Vec3,
    center: Vec3,
    area_mm2: f64,
    is_outer: bool,
}

impl Body {
    fn of(piece: &Printable<'_>) -> Option<Self> {
        let mesh = piece.mesh;
        let hull = Volume::hull(&mesh.points).to_mesh();
        if hull.triangles.is_empty() {
            return None;
        }
        let face = |f: usize| Face {
            normal: mesh.face_normal(f),
            center: mesh.face_center(f),
            area_mm2: mesh.face_area(f),
            is_outer: piece.is_outer.get(f).copied().unwrap_or(false),
        };
        let area_mm2 = mesh.area().max(f64::MIN_POSITIVE);
        let faces = (0..mesh.triangles.len()).map(face).collect();
        Some(Self {
            center: center_of_mass(mesh),
            area_mm2,
            diagonal_mm: mesh.bounds().diagonal(),
            faces,
            hull,
        })
    }

    /// Directions that may point up.
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
        let step = |i: i32, place: i32| f64::from(i / place % 3 - 1);
        let lattice = (0..27).map(|i| Vec3::new(step(i, 1), step(i, 3), step(i, 9)));
        resting
            .chain(lattice.filter_map(Vec3::try_normalize))
            .filter(|d| *d != Vec3::ZERO)
            .collect()
    }

    /// The cost of a direction, and what it makes one support.
    fn judged(&self, weights: &Weights, up: Vec3) -> (f64, Vec3, Support) {
        let heights = || self.hull.points.iter().map(|p| p.dot(up));
        let lowest = heights().fold(f64::INFINITY, f64::min);
        let highest = heights().fold(f64::NEG_INFINITY, f64::max);
        let mut support = Support::default();
        for face in &self.faces {
            let downwards = -face.normal.dot(up);
            let height = face.center.dot(up) - lowest;
            let rests = height < RESTING_MM && downwards > COS_RESTING;
            if downwards < COS_OVERHANG || rests {
                continue;
            }
            support.all_mm2 += face.area_mm2;
            support.below_mm3 += face.area_mm2 * downwards * height;
            if face.is_outer {
                support.outer_mm2 += face.area_mm2;
            }
        }
        let mut cost = weights.outer * support.outer_mm2 / self.area_mm2
            + weights.all * support.all_mm2 / self.area_mm2
            + weights.height * (highest - lowest) / self.diagonal_mm.max(f64::MIN_POSITIVE);
        if weights.falling > 0.0 && !self.stands(up, lowest) {
            cost += weights.falling;
        }
        (cost, up, support)
    }

    /// Whether the centre of mass is above the foot.
    fn stands(&self, up: Vec3, lowest: f64) -> bool {
        let (x, y) = up.any_orthonormal_pair();
        let foot: Vec<Vec3> = self
            .hull
            .points
            .iter()
            .copied()
            .filter(|p| p.dot(up) - lowest < FOOT_MM)
            .collect();
        (0..24).all(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 24.0).sin_cos();
            let towards = cos * x + sin * y;
            let reach = foot
                .iter()
                .map(|p| p.dot(towards))
                .fold(f64::NEG_INFINITY, f64::max);
            reach >= self.center.dot(towards) + STANDING_MM
        })
    }

    /// The turn about `up` with the smallest box that has room.
    fn turned(&self, up: Vec3, support: Support, room_mm: [f64; 3]) -> Option<Pose> {
        let (x, y) = up.any_orthonormal_pair();
        let poses = (0..N_YAWS).map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_2 / f64::from(N_YAWS)).sin_cos();
            let axes = [cos * x + sin * y, cos * y - sin * x, up];
            let bounds = Aabb::around(
                self.hull
                    .points
                    .iter()
                    .map(|p| Vec3::from_array(axes.map(|a| a.dot(*p)))),
            );
            Pose {
                axes,
                bounds,
                support,
            }
        });
        let [width, depth, height] = room_mm;
        let has_room = |pose: &Pose| {
            let [a, b, c] = pose.bounds.size().to_array();
            c <= height && (a <= width && b <= depth || b <= width && a <= depth)
        };
        poses
            .filter(has_room)
            .min_by(|a, b| a.footprint_mm2().total_cmp(&b.footprint_mm2()))
    }
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
