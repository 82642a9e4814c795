//! From where each step is seen.

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Aabb, TriMesh, Vec3};
use shellock_render::ReportPiece;
use shellock_render::stills::Camera;

/// Points of a piece that are looked at.
const N_POINTS: usize = 48;
/// Rays start so far off the surface, mm.
const OFF_MM: f64 = 0.02;
/// A way that is seen under this angle or more is seen well: its sine, 45°.
const SIN_WELL: f64 = 0.707;

/// How one step is seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    /// From the viewer to the scene.
    pub direction: Vec3,
    /// How far the new piece stands back from its place, mm.
    pub travel_mm: f64,
    /// From where its place is seen, where it is hidden along `direction`.
    pub other: Option<Vec3>,
}

impl Sight {
    pub fn camera(&self) -> Camera {
        Camera::along(self.direction, Vec3::Z)
    }
}

/// A sight of each step, for `pieces` in the order in which they are installed.
pub(super) fn sights(pieces: &[&ReportPiece<'_>]) -> Vec<Sight> {
    let trees: Vec<TriangleBvh> = pieces.par_iter().map(|p| TriangleBvh::new(p.mesh)).collect();
    let all = pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(p.mesh.bounds()));
    let directions = directions();
    let seen: Vec<(f64, Vec<f64>, Vec<f64>)> = (0..pieces.len())
        .into_par_iter()
        .map(|i| {
            let travel_mm = travel_mm(pieces[i], all.diagonal());
            let step = Step::new(pieces[i], &trees[..i], travel_mm, all.diagonal());
            let places = directions.iter().map(|d| step.place_seen(*d)).collect();
            (
                travel_mm,
                directions.iter().map(|d| step.seen(*d)).collect(),
                places,
            )
        })
        .collect();
    let mut made: Vec<Sight> = Vec::with_capacity(pieces.len());
    for (travel_mm, seen, places) in seen {
        let last = made.last().map_or(directions[0], |sight: &Sight| sight.direction);
        let worth = |k: usize| {
            seen[k] + preference(directions[k]) + if directions[k] == last { STAYING } else { 0.0 }
        };
        let best = (0..directions.len())
            .rev()
            .max_by(|&a, &b| worth(a).total_cmp(&worth(b)))
            .unwrap_or(0);
        let clearest = (0..directions.len())
            .rev()
            .max_by(|&a, &b| places[a].total_cmp(&places[b]))
            .unwrap_or(0);
        let is_worth_it = places[best] < HIDDEN && places[clearest] > places[best] + CLEARER;
        made.push(Sight {
            direction: directions[best],
            travel_mm,
            other: is_worth_it.then_some(directions[clearest]),
        });
    }
    made
}

/// A place of which less than this share is seen is shown from elsewhere, too, where so much more is seen.
const HIDDEN: f64 = 0.3;
const CLEARER: f64 = 0.15;

/// Turning the thing in one's hands is worth this much of what is seen.
const STAYING: f64 = 0.5;

/// Directions of sight: the front view first, then eight around, from a little above, from high above and
/// from below.
fn directions() -> Vec<Vec3> {
    let front = Camera::front().direction.normalize();
    let around = |k: u32, rise: f64| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
        let flat = front.with_z(0.0).normalize();
        Vec3::new(cos * flat.x - sin * flat.y, sin * flat.x + cos * flat.y, -rise).normalize()
    };
    let slope = -front.z / front.with_z(0.0).length();
    [slope, 1.6, -0.5]
        .iter()
        .flat_map(|&rise| (0..8).map(move |k| around(k, rise)))
        .collect()
}

/// What people prefer where they see the same: to look from a little above, and not from below.
fn preference(direction: Vec3) -> f64 {
    match direction.z {
        z if z > 0.0 => -0.35,
        z if z < -0.7 => -0.12,
        _ => 0.0,
    }
}

/// How far a piece stands back: clear of its place, but near it.
fn travel_mm(piece: &ReportPiece<'_>, diagonal_mm: f64) -> f64 {
    let along = Vec3::from(piece.installation_direction);
    let heights = || piece.mesh.points.iter().map(|p| p.dot(along));
    let extent = heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
    (0.5 * extent + 0.1 * diagonal_mm).clamp(0.16 * diagonal_mm, 0.42 * diagonal_mm)
}

/// All pieces in place, for whoever looks for a place on them.
pub(super) struct Lookout {
    trees: Vec<TriangleBvh>,
    diagonal_mm: f64,
}

impl Lookout {
    /// Places are looked at this share of the diagonal in front of them: seams are cut and meshes made coarser.
    const OFF: f64 = 0.012;

    pub fn new(pieces: &[&ReportPiece<'_>]) -> Self {
        let all = pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(p.mesh.bounds()));
        Self {
            trees: pieces.par_iter().map(|p| TriangleBvh::new(p.mesh)).collect(),
            diagonal_mm: all.diagonal(),
        }
    }

    /// Whether somebody far away who looks along `direction` sees a place.
    pub fn is_seen(&self, place: Vec3, direction: Vec3) -> bool {
        let from = place - Self::OFF * self.diagonal_mm * direction;
        let far_mm = 3.0 * self.diagonal_mm;
        self.trees
            .iter()
            .all(|tree| tree.first_hit(from, -direction, far_mm).is_none())
    }

    /// Along which direction a place and most of the lines through it are seen.
    pub fn best(&self, at: Vec3, lines: &[Vec<Vec3>]) -> Vec3 {
        /// The place matters more than the lines.
        const PLACE: f64 = 2.0;
        let points: Vec<Vec3> = lines.iter().flatten().copied().collect();
        let worth = |direction: &Vec3| {
            let seen = points.iter().filter(|p| self.is_seen(**p, *direction)).count();
            let share = seen as f64 / points.len().max(1) as f64;
            let place = if self.is_seen(at, *direction) { PLACE } else { 0.0 };
            place + share + preference(*direction)
        };
        let directions = directions();
        let worths: Vec<f64> = directions.par_iter().map(worth).collect();
        let best = (0..directions.len())
            .rev()
            .max_by(|&a, &b| worths[a].total_cmp(&worths[b]));
        directions[best.unwrap_or(0)]
    }
}

/// One step: points of the new piece, with their normals, and what may hide them.
struct Step<'a> {
    points: Vec<(Vec3, Vec3)>,
    along: Vec3,
    travel_mm: f64,
    there: &'a [TriangleBvh],
    far_mm: f64,
}

impl<'a> Step<'a> {
    fn new(piece: &ReportPiece<'_>, there: &'a [TriangleBvh], travel_mm: f64, diagonal_mm: f64) -> Self {
        let along = Vec3::from(piece.installation_direction);
        Self {
            points: spread(piece.mesh),
            along,
            travel_mm,
            there,
            far_mm: 3.0 * diagonal_mm,
        }
    }

    /// How much of the place is seen along `direction`, [0, 1]: half of a closed surface faces the viewer.
    fn place_seen(&self, direction: Vec3) -> f64 {
        self.share(direction, Vec3::ZERO)
    }

    /// How much of the piece is seen along `direction` where it is shifted, [0, 1].
    fn share(&self, direction: Vec3, shift: Vec3) -> f64 {
        let free = self
            .points
            .iter()
            .filter(|(_, normal)| normal.dot(direction) < 0.0)
            .filter(|(p, _)| self.is_free(*p + shift - OFF_MM * direction, -direction));
        (2.0 * free.count() as f64 / self.points.len().max(1) as f64).min(1.0)
    }

    /// How much is seen along `direction`: of the piece, of its place and of its way.
    fn seen(&self, direction: Vec3) -> f64 {
        let back = -self.travel_mm * self.along;
        let sine = self.along.cross(direction).length();
        self.share(direction, back)
            + 0.8 * self.share(direction, Vec3::ZERO)
            + 0.8 * (sine / SIN_WELL).min(1.0)
    }

    /// Whether a point is seen by somebody far away.
    fn is_free(&self, from: Vec3, towards: Vec3) -> bool {
        self.there
            .iter()
            .all(|tree| tree.first_hit(from, towards, self.far_mm).is_none())
    }
}

/// Centres of faces that have equal shares of the area, with their normals.
fn spread(mesh: &TriMesh) -> Vec<(Vec3, Vec3)> {
    let share = mesh.area() / N_POINTS as f64;
    if share <= 0.0 {
        return Vec::new();
    }
    let (mut sum, mut points) = (0.0, Vec::new());
    for f in 0..mesh.triangles.len() {
        sum += mesh.face_area(f);
        if sum >= share * (points.len() as f64 + 0.5) {
            points.push((mesh.face_center(f), mesh.face_normal(f)));
        }
    }
    points
}

/// Where something far along `towards` is, in words, for a thing that stands and looks along −y.
pub(super) fn side(towards: Vec3) -> String {
    let d = towards.normalize_or_zero();
    let words = [
        (d.z, "above"),
        (-d.z, "below"),
        (-d.y, "the front"),
        (d.y, "behind"),
        (d.x, "its left"),
        (-d.x, "its right"),
    ];
    let mut large: Vec<(f64, &str)> = words.into_iter().filter(|(share, _)| *share > 0.38).collect();
    large.sort_by(|a, b| b.0.total_cmp(&a.0));
    let names: Vec<&str> = large.into_iter().map(|(_, word)| word).collect();
    match names[..] {
        [] => "its place".to_owned(),
        [one] => one.to_owned(),
        [first, second, ..] => format!("{first} and {second}"),
    }
}
