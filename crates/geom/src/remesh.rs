//! Remeshing: even triangles of a chosen size on a labelled surface.
//!
//! Isotropic remeshing [Botsch and Kobbelt 2004]: long edges are split, short ones merged, and edges flipped
//! where that is nearer to Delaunay. Points move to the middle of their neighbours and back onto the input.
//! Before that, fine input is coarsened by merging edges into one of their ends, shortest first, so that the
//! rounds work on few triangles.
//!
//! Lines between labels (*seams*) are kept. Points on them move along the input's own line by its arc length,
//! and points where seams meet do not move. An edge that joins two seam points through the inside of a region
//! (a *bridge*) is flipped or split, so that every triangle has a point inside its region, however narrow
//! that is.
//!
//! Limits: sharp edges of the input are not features and get chamfered by up to an edge length, unless a seam
//! runs along them. Features thinner than an edge may stay finer than requested, because no triangle may face
//! against the input. Corners much closer together than an edge keep thin triangles between them.

mod seams;
mod surface;
#[cfg(test)]
mod tests;

use seams::{Seam, find_seams};
use surface::{NO_SEAM, Place, Surface};

use crate::bvh::TriangleBvh;
use crate::{HalfEdge, TriMesh, Vec3};

/// Length above which edges are split, and which no merge exceeds, in target lengths. [Botsch and Kobbelt
/// 2004]
const LONGEST: f64 = 4.0 / 3.0;
/// Length below which edges are merged, in target lengths. [Botsch and Kobbelt 2004]
const SHORTEST: f64 = 4.0 / 5.0;
/// Length from which coarsening leaves edges to the rounds, in target lengths. The rounds compare with the
/// input and place points better.
const COARSE: f64 = 0.6;
/// Largest edge length that a coarsening merge may make, in target lengths.
const COARSE_LONGEST: f64 = 1.1;
/// Least cosine between a triangle's normal and the input's at the nearest point (and, while coarsening, at
/// the triangle's corners).
const LEAST_COS: f64 = 0.2;
/// Least height of a new triangle, as a share of its longest edge, unless the triangle was worse before.
const LEAST_HEIGHT: f64 = 0.05;
/// Height share above which new triangles justify flipping a bridge, unless the old ones were worse;
/// otherwise the bridge is split.
const LEAST_TURNED_HEIGHT: f64 = 0.25;
/// Largest distance by which flipping an edge may take the surface off, in target lengths.
const MOST_OFF: f64 = 0.3;
/// Least cosine, 18°, of coarse triangles' normals with their mean at a point that is smoothed.
const MOST_BENT: f64 = 0.95;
/// Largest number of passes. Each pass of coarsening or refining halves a quantity, and 2⁻³⁰ of any model is
/// below its precision.
const MOST_PASSES: u32 = 30;
/// Share of points merged in a pass, at or below which coarsening stops.
const WORTH_A_PASS: f64 = 0.02;
/// Number of triangles above which the target is raised, since analyses on such a mesh would not end.
const MOST_TRIANGLES: f64 = 1e6;
/// Area of a triangle with three edges of length 1: √3 / 4.
const UNIT_TRIANGLE: f64 = 0.433;

/// Parameters of the function [`remesh`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RemeshParams {
    /// Target edge length, mm, > 0. Most edges come out between 0.6 and 1.5 of it. Raised if it would need
    /// more than a million triangles.
    pub target_edge_mm: f64,
    /// Rounds of splitting, merging, flipping and smoothing. The tests and the figures in these docs use 6.
    pub n_rounds: u32,
}

/// Result of [`remesh`], a labelled mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Remeshed {
    /// Closed mesh, oriented like the input.
    pub mesh: TriMesh,
    /// Label of each triangle.
    pub labels: Vec<u32>,
}

/// Remeshes `mesh` with triangles of about `params.target_edge_mm`, labelled like the input (`labels`, one
/// per triangle).
///
/// For closed, consistently oriented meshes. Other meshes are returned unchanged, as are all meshes if the
/// target is not a positive number. Kept are: closedness, orientation and genus; each connected region and so
/// each label; the seams, by pairs of labels, on the input's lines; and each point where three or more labels
/// meet. Points lie on the input, except rare ones where projection would flip a triangle. Sequential and
/// deterministic; about 0.5 s for 100 000 triangles.
pub fn remesh(params: &RemeshParams, mesh: &TriMesh, labels: &[u32]) -> Remeshed {
    assert_eq!(mesh.triangles.len(), labels.len(), "one label a triangle");
    let unchanged = || Remeshed {
        mesh: mesh.clone(),
        labels: labels.to_vec(),
    };
    let least_mm = (mesh.area() / (UNIT_TRIANGLE * MOST_TRIANGLES)).sqrt();
    let target_mm = params.target_edge_mm.max(least_mm);
    if !(params.target_edge_mm > 0.0 && target_mm.is_finite()) {
        return unchanged();
    }
    let Some(mut surface) = Surface::new(mesh, labels) else {
        return unchanged();
    };
    let seams = find_seams(&mut surface);
    let mut work = Remesher::new(mesh, surface, seams, target_mm);
    work.coarsen();
    work.refine();
    work.split_bridges();
    for _ in 0..params.n_rounds {
        work.split_long();
        work.merge_short();
        work.turn_edges();
        work.split_bridges();
        work.smooth(f64::NEG_INFINITY);
    }
    let (mesh, labels) = work.surface.finish();
    Remeshed { mesh, labels }
}

struct Remesher {
    surface: Surface,
    seams: Vec<Seam>,
    input: TriangleBvh,
    /// Unit normal of each triangle of the input.
    input_normals: Vec<Vec3>,
    target_mm: f64,
}

impl Remesher {
    fn new(mesh: &TriMesh, surface: Surface, seams: Vec<Seam>, target_mm: f64) -> Self {
        Self {
            surface,
            seams,
            input: TriangleBvh::new(mesh),
            input_normals: (0..mesh.triangles.len()).map(|f| mesh.face_normal(f)).collect(),
            target_mm,
        }
    }

    /// Point of the input nearest to `p`, and the input's normal there.
    fn on_input(&self, p: Vec3) -> (Vec3, Vec3) {
        let nearest = self.input.nearest(p, f64::INFINITY);
        nearest.map_or((p, Vec3::ZERO), |n| {
            (n.point, self.input_normals[n.face as usize])
        })
    }

    /// Returns true if triangle `corners` faces the same way as the input nearest to it.
    fn agrees(&self, corners: [Vec3; 3]) -> bool {
        self.cosine(corners) >= LEAST_COS
    }

    /// Cosine between the normals of triangle `corners` and of the input nearest to it; 1 if one of them has
    /// none.
    fn cosine(&self, [a, b, c]: [Vec3; 3]) -> f64 {
        let normals = [
            (b - a).cross(c - a).normalize_or_zero(),
            self.on_input((a + b + c) / 3.0).1,
        ];
        if normals.contains(&Vec3::ZERO) {
            1.0
        } else {
            normals[0].dot(normals[1])
        }
    }

    /// Returns true if all triangles at `v` stay sound when `v` moves to `at`. Triangles shared with `gone`
    /// are ignored.
    fn may_move(
        &self,
        v: u32,
        at: Vec3,
        gone: Option<u32>,
        faces_well: impl Fn(HalfEdge, [Vec3; 3]) -> bool,
    ) -> bool {
        self.surface.around(v).all(|h| {
            let [p, b, c] = self.surface.corners(h);
            let is_gone = gone.is_some_and(|g| self.surface.ends(h)[1] == g || self.surface.apex(h) == g);
            let moved = [at, b, c];
            is_gone
                || (height_share(moved) >= LEAST_HEIGHT.min(height_share([p, b, c])) && faces_well(h, moved))
        })
    }

    /// Returns true if the triangle of `h`, moved to `moved`, faces the same way as the input, or no worse
    /// than before.
    fn may_face(&self, h: HalfEdge, moved: [Vec3; 3]) -> bool {
        let cosine = self.cosine(moved);
        cosine >= LEAST_COS || cosine >= self.cosine(self.surface.corners(h))
    }

    /// Merges short edges in passes. Each point takes part in at most one merge per pass, which needs no
    /// queue and gives even triangles.
    ///
    /// Normals are compared with the input's at the corners, since all points remain points of the input
    /// here. A search for the nearest point would cost more than everything else.
    fn coarsen(&mut self) {
        let normals = self.point_normals();
        let n_points = self.surface.points.len();
        let mut alive: Vec<u32> = (0..n_points as u32)
            .filter(|&v| self.surface.is_alive(v))
            .collect();
        let mut pass_of = vec![0; n_points];
        let mut short = Vec::new();
        for pass in 1..=MOST_PASSES {
            let n_before = alive.len();
            for &v in &alive {
                if pass_of[v as usize] == pass || !self.surface.is_alive(v) {
                    continue;
                }
                self.short_edges(v, COARSE * self.target_mm, &mut short);
                short.retain(|&(_, h)| pass_of[self.surface.ends(h)[1] as usize] != pass);
                let both_ways = short
                    .iter()
                    .flat_map(|&(_, h)| [h, self.surface.opposite[h as usize]]);
                let found = both_ways.into_iter().find(|&h| {
                    self.may_merge(h, COARSE_LONGEST, |a, t| {
                        let normal = (t[1] - t[0]).cross(t[2] - t[0]);
                        let [b, c] = [self.surface.ends(a)[1], self.surface.apex(a)];
                        [self.surface.ends(h)[0], b, c]
                            .iter()
                            .all(|&v| faces_along(normal, normals[v as usize]))
                    })
                });
                if let Some(h) = found {
                    for end in self.surface.ends(h) {
                        pass_of[end as usize] = pass;
                    }
                    self.surface.merge(h);
                }
            }
            alive.retain(|&v| self.surface.is_alive(v));
            if (n_before - alive.len()) as f64 <= WORTH_A_PASS * n_before as f64 {
                break;
            }
        }
    }

    /// Unit normals at the points, from the triangles around them; zero where these cancel.
    fn point_normals(&self) -> Vec<Vec3> {
        let mut normals = vec![Vec3::ZERO; self.surface.points.len()];
        for h in (0..self.surface.start.len() as HalfEdge).step_by(3) {
            let [a, b, c] = self.surface.corners(h);
            for e in h..h + 3 {
                normals[self.surface.start[e as usize] as usize] += (b - a).cross(c - a);
            }
        }
        normals.iter().map(|n| n.normalize_or_zero()).collect()
    }

    /// Collects the edges out of `v` shorter than `below_mm`, shortest first.
    fn short_edges(&self, v: u32, below_mm: f64, found: &mut Vec<(f64, HalfEdge)>) {
        found.clear();
        let lengths = self.surface.around(v).map(|h| (self.surface.length_sq(h), h));
        found.extend(lengths.filter(|e| e.0 < below_mm * below_mm));
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    fn may_merge(&self, h: HalfEdge, longest: f64, faces_well: impl Fn(HalfEdge, [Vec3; 3]) -> bool) -> bool {
        let [u, v] = self.surface.ends(h);
        let at = self.surface.points[u as usize];
        let longest_sq = (longest * self.target_mm).powi(2);
        let is_short = |a: HalfEdge| {
            let length_sq = at.distance_squared(self.surface.points[self.surface.ends(a)[1] as usize]);
            length_sq <= longest_sq.max(self.surface.length_sq(a))
        };
        self.surface.may_merge(h)
            && self.surface.around(v).all(is_short)
            && self.may_move(v, at, Some(u), faces_well)
    }

    /// Halves edges far longer than the target, as in coarse input.
    fn refine(&mut self) {
        for _ in 0..MOST_PASSES {
            let n_before = self.surface.points.len();
            self.split_long();
            if self.surface.points.len() == n_before {
                break;
            }
            self.turn_edges();
            // At a crease the middle of such distant neighbours lies off the surface.
            self.smooth(MOST_BENT);
        }
    }

    /// Splits each edge that is too long once.
    fn split_long(&mut self) {
        let longest_sq = (LONGEST * self.target_mm).powi(2);
        for h in self.surface.edges() {
            if self.surface.length_sq(h) > longest_sq {
                self.split(h);
            }
        }
    }

    /// Splits `h` at the middle of its stretch of the seam, or at its midpoint. That midpoint is moved onto
    /// the input unless this spoils a triangle.
    fn split(&mut self, h: HalfEdge) {
        let [u, v] = self.surface.ends(h).map(|v| self.surface.points[v as usize]);
        let middle = 0.5 * (u + v);
        let name = self.surface.seam[h as usize];
        if name != NO_SEAM {
            let [from, to] = self.surface.span(h, &self.seams);
            let seam = &self.seams[name as usize];
            let at_mm = seam.wrap(0.5 * (from + to));
            self.surface.split(h, seam.point(at_mm), Place::Seam { at_mm });
            return;
        }
        let m = self.surface.split(h, middle, Place::Inside);
        self.try_move(m, self.on_input(middle).0);
    }

    fn try_move(&mut self, v: u32, at: Vec3) {
        if self.may_move(v, at, None, |h, t| self.may_face(h, t)) {
            self.surface.points[v as usize] = at;
        }
    }

    fn merge_short(&mut self) {
        let mut short = Vec::new();
        for v in 0..self.surface.points.len() as u32 {
            self.short_edges(v, SHORTEST * self.target_mm, &mut short);
            let both_ways = short
                .iter()
                .flat_map(|&(_, h)| [h, self.surface.opposite[h as usize]]);
            let found = both_ways
                .into_iter()
                .find(|&h| self.may_merge(h, LONGEST, |a, t| self.may_face(a, t)));
            if let Some(h) = found {
                self.surface.merge(h);
            }
        }
    }

    /// Flips edges whose opposite angles sum to more than π, and bridges.
    fn turn_edges(&mut self) {
        for _ in 0..3 {
            let mut n_turned = 0;
            for h in self.surface.edges() {
                if self.should_turn(h) {
                    self.surface.turn(h);
                    n_turned += 1;
                }
            }
            if n_turned == 0 {
                break;
            }
        }
    }

    fn should_turn(&self, h: HalfEdge) -> bool {
        let s = &self.surface;
        let [u, v, w] = s.corners(h);
        let x = s.points[s.apex(s.opposite[h as usize]) as usize];
        let turned = [[x, w, u], [w, x, v]];
        // Over a crease of the input the surface would jump to the other side of this tetrahedron.
        if distance_of_lines([u, v], [w, x]) > MOST_OFF * self.target_mm {
            return false;
        }
        let makes_bridge = [h, s.opposite[h as usize]]
            .iter()
            .all(|&h| !s.is_inside(s.apex(h)));
        let least_height = if s.is_bridge(h) {
            LEAST_TURNED_HEIGHT
        } else {
            LEAST_HEIGHT
        };
        if makes_bridge || !(s.is_bridge(h) || angles_exceed_pi([u, v], [w, x])) || !s.may_turn(h) {
            return false;
        }
        let least_height = height_share([u, v, w])
            .min(height_share([v, u, x]))
            .min(least_height);
        turned
            .iter()
            .all(|&t| height_share(t) > least_height && self.agrees(t))
    }

    /// Splits the bridges that could not be flipped, and triangles whose three edges are all on seams.
    fn split_bridges(&mut self) {
        for h in self.surface.edges() {
            if self.surface.is_bridge(h) {
                self.split(h);
                // A bridge may run close to a seam, so that its midpoint makes needles.
                let m = self.surface.points.len() as u32 - 1;
                self.try_move(m, self.relaxed_inside(m, 1.0));
            }
        }
        for face in 0..self.surface.is_dead.len() as u32 {
            let h = 3 * face;
            let is_enclosed = (h..h + 3).all(|e| self.surface.seam[e as usize] != NO_SEAM);
            if !self.surface.is_dead[face as usize] && is_enclosed {
                let [a, b, c] = self.surface.corners(h);
                self.surface.insert(h, (a + b + c) / 3.0);
            }
        }
    }

    /// Moves points to the middle of their neighbours: in the tangent plane and back onto the input, or along
    /// the seam. If the full step spoils a triangle, half and a quarter of it are tried.
    ///
    /// Points inside regions are skipped if the cosine between a triangle's normal and their mean is less
    /// than `least_cos`.
    fn smooth(&mut self, least_cos: f64) {
        for v in 0..self.surface.points.len() as u32 {
            if matches!(self.surface.place[v as usize], Place::Inside) && self.is_bent(v, least_cos) {
                continue;
            }
            for share in [1.0, 0.5, 0.25] {
                let Some((at, place)) = self.relax(v, share) else {
                    break;
                };
                if self.may_move(v, at, None, |h, t| self.may_face(h, t)) {
                    self.surface.points[v as usize] = at;
                    self.surface.place[v as usize] = place;
                    break;
                }
            }
        }
    }

    fn is_bent(&self, v: u32, least_cos: f64) -> bool {
        let normal = |h: HalfEdge| {
            let [a, b, c] = self.surface.corners(h);
            (b - a).cross(c - a)
        };
        let mean = self
            .surface
            .around(v)
            .map(normal)
            .sum::<Vec3>()
            .normalize_or_zero();
        self.surface
            .around(v)
            .any(|h| normal(h).normalize_or_zero().dot(mean) < least_cos)
    }

    /// Position of `v` after this share of the step to the middle of its neighbours; `None` if `v` does not
    /// move.
    fn relax(&self, v: u32, share: f64) -> Option<(Vec3, Place)> {
        match self.surface.place[v as usize] {
            _ if !self.surface.is_alive(v) => None,
            Place::Corner => None,
            Place::Inside => Some((self.relaxed_inside(v, share), Place::Inside)),
            Place::Seam { .. } => {
                let (name, at_mm) = self.surface.relaxed_along(v, share, &self.seams)?;
                Some((self.seams[name as usize].point(at_mm), Place::Seam { at_mm }))
            }
        }
    }

    fn relaxed_inside(&self, v: u32, share: f64) -> Vec3 {
        let p = self.surface.points[v as usize];
        let (mut sum, mut n, mut normal) = (Vec3::ZERO, 0.0, Vec3::ZERO);
        for h in self.surface.around(v) {
            let [_, b, c] = self.surface.corners(h);
            sum += b;
            n += 1.0;
            normal += (b - p).cross(c - p);
        }
        let normal = normal.normalize_or_zero();
        let step = share * (sum / n - p);
        self.on_input(p + step - normal * normal.dot(step)).0
    }
}

/// Returns true if a triangle with this area vector faces along the unit vector `normal`. Always true for
/// zero.
fn faces_along(area_vector: Vec3, normal: Vec3) -> bool {
    area_vector.dot(normal) >= LEAST_COS * area_vector.length() * normal.length()
}

/// Height of a triangle over its longest edge as a share of that edge: at most 0.87, 0 for a degenerate
/// triangle.
fn height_share([a, b, c]: [Vec3; 3]) -> f64 {
    let longest_sq = a
        .distance_squared(b)
        .max(b.distance_squared(c))
        .max(c.distance_squared(a));
    if longest_sq > 0.0 {
        (b - a).cross(c - a).length() / longest_sq
    } else {
        0.0
    }
}

/// Distance of two lines, each through two points; 0 if they are parallel.
fn distance_of_lines([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> f64 {
    (b - a).cross(d - c).normalize_or_zero().dot(c - a).abs()
}

/// Returns true if the angles at `apexes` over the edge `ends` sum to more than π: the edge is not Delaunay.
fn angles_exceed_pi([u, v]: [Vec3; 2], apexes: [Vec3; 2]) -> bool {
    let [(sin_w, cos_w), (sin_x, cos_x)] =
        apexes.map(|w| ((u - w).cross(v - w).length(), (u - w).dot(v - w)));
    let scale = (sin_w + cos_w.abs()) * (sin_x + cos_x.abs());
    sin_w * cos_x + sin_x * cos_w < -1e-9 * scale
}
