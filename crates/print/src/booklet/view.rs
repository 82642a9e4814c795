//! Choice of the viewpoint for each assembly step.

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Aabb, TriMesh, Vec3};
use shellock_render::ReportPiece;
use shellock_render::stills::Camera;

/// Sample points on a piece for visibility tests.
const N_POINTS: usize = 48;
/// Offset of ray origins from the surface, mm.
const OFF_MM: f64 = 0.02;
/// Sine of the angle from which on a path counts as fully visible: 45° to the line of sight.
const SIN_WELL: f64 = 0.707;

/// Viewpoint of one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    /// Viewing direction, from the viewer to the scene.
    pub direction: Vec3,
    /// Distance of the new piece from its place, mm.
    pub travel_mm: f64,
    /// Direction of a second view that shows the piece's place, if that is hidden along `direction`.
    pub other: Option<Vec3>,
}

impl Sight {
    pub fn camera(&self) -> Camera {
        Camera::along(self.direction, Vec3::Z)
    }
}

/// Chooses a viewpoint for each step. `pieces` come in order of installation.
pub(super) fn sights(pieces: &[&ReportPiece<'_>]) -> Vec<Sight> {
    let trees: Vec<TriangleBvh> = pieces.par_iter().map(|p| TriangleBvh::new(p.mesh)).collect();
    let all = pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(p.mesh.bounds()));
    let directions = directions();
    let seen: Vec<(f64, Vec<f64>, Vec<f64>)> = (0..pieces.len())
        .into_par_iter()
        .map(|i| {
            let travel_mm = travel_mm(pieces[i], all.diagonal());
            let step = ViewStep::new(pieces[i], &trees[..i], travel_mm, all.diagonal());
            let places = directions.iter().map(|d| step.place_visibility(*d)).collect();
            (
                travel_mm,
                directions.iter().map(|d| step.score(*d)).collect(),
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

/// Limits for a second view: less than `HIDDEN` of the place is visible, and another direction shows more
/// than `CLEARER` in addition. Shares of the place's surface.
const HIDDEN: f64 = 0.3;
const CLEARER: f64 = 0.15;

/// Score for keeping the previous viewpoint, so that the reader turns the kit less often.
const STAYING: f64 = 0.5;

/// Candidate viewing directions, the front view first: eight around the model at each of three elevations,
/// from a little above, from high above and from below.
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

/// Score of what people prefer among equally good views: from a little above, and not from below.
fn preference(direction: Vec3) -> f64 {
    match direction.z {
        z if z > 0.0 => -0.35,
        z if z < -0.7 => -0.12,
        _ => 0.0,
    }
}

/// Distance of a piece from its place before installation, mm: clear of the place, but near it.
fn travel_mm(piece: &ReportPiece<'_>, diagonal_mm: f64) -> f64 {
    let along = Vec3::from(piece.installation_direction);
    let heights = || piece.mesh.points.iter().map(|p| p.dot(along));
    let extent = heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
    (0.5 * extent + 0.1 * diagonal_mm).clamp(0.16 * diagonal_mm, 0.42 * diagonal_mm)
}

/// All pieces in place, for visibility tests of points on them.
pub(super) struct Lookout {
    trees: Vec<TriangleBvh>,
    diagonal_mm: f64,
}

impl Lookout {
    /// Offset of tested points towards the viewer, as a share of the diagonal. Seams are cut and meshes
    /// simplified, so points do not lie exactly on the surface.
    const OFF: f64 = 0.012;

    pub fn new(pieces: &[&ReportPiece<'_>]) -> Self {
        let all = pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(p.mesh.bounds()));
        Self {
            trees: pieces.par_iter().map(|p| TriangleBvh::new(p.mesh)).collect(),
            diagonal_mm: all.diagonal(),
        }
    }

    /// Returns true if a distant viewer who looks along `direction` sees `place`.
    pub fn is_seen(&self, place: Vec3, direction: Vec3) -> bool {
        let from = place - Self::OFF * self.diagonal_mm * direction;
        let far_mm = 3.0 * self.diagonal_mm;
        self.trees
            .iter()
            .all(|tree| tree.first_hit(from, -direction, far_mm).is_none())
    }

    /// Returns the viewing direction that shows a place and most of the lines through it.
    pub fn best(&self, at: Vec3, lines: &[Vec<Vec3>]) -> Vec3 {
        /// Weight of the place relative to that of all lines.
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

/// One step: sample points of the new piece with their normals, and the earlier pieces that may hide them.
struct ViewStep<'a> {
    points: Vec<(Vec3, Vec3)>,
    along: Vec3,
    travel_mm: f64,
    there: &'a [TriangleBvh],
    far_mm: f64,
}

impl<'a> ViewStep<'a> {
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

    /// Visible share of the piece's place along `direction`, [0, 1]. Half of a closed surface faces the
    /// viewer and counts as 1.
    fn place_visibility(&self, direction: Vec3) -> f64 {
        self.share(direction, Vec3::ZERO)
    }

    /// Visible share of the piece along `direction` when moved by `shift`, [0, 1].
    fn share(&self, direction: Vec3, shift: Vec3) -> f64 {
        let free = self
            .points
            .iter()
            .filter(|(_, normal)| normal.dot(direction) < 0.0)
            .filter(|(p, _)| self.is_free(*p + shift - OFF_MM * direction, -direction));
        (2.0 * free.count() as f64 / self.points.len().max(1) as f64).min(1.0)
    }

    /// Score of a direction: visible shares of the piece, of its place and of its path.
    fn score(&self, direction: Vec3) -> f64 {
        let back = -self.travel_mm * self.along;
        let sine = self.along.cross(direction).length();
        self.share(direction, back)
            + 0.8 * self.share(direction, Vec3::ZERO)
            + 0.8 * (sine / SIN_WELL).min(1.0)
    }

    /// Returns true if no earlier piece lies between the point and a distant viewer.
    fn is_free(&self, from: Vec3, towards: Vec3) -> bool {
        self.there
            .iter()
            .all(|tree| tree.first_hit(from, towards, self.far_mm).is_none())
    }
}

/// Samples face centres with their normals so that each stands for the same area. Empty for a mesh without
/// area.
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

/// Names the side on which something far along `towards` lies, for an upright model that faces −y.
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
