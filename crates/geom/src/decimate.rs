//! Decimation: fewer triangles for nearly the same surface.
//!
//! Edges collapse by quadric error [Garland and Heckbert 1997]. A vertex represents input triangles. Its
//! quadric sums, over their planes, the squared distance times the triangle's area in mean triangle areas
//! (its *share*). Divided by the sum of shares this is the mean square distance. Beyond 30 shares the divisor
//! stays constant, so that a bump in a wide plain is not averaged away.

mod caps;
mod shown;

pub use shown::decimate_for_display;

use glam::DMat3;
use rayon::prelude::*;

use crate::topology::{HalfEdge, Topology};
use crate::{TriMesh, Vec3};

/// Largest sum of shares over which a squared distance is averaged. No vertex is farther than √30 tolerances
/// from the plane of a represented triangle of mean size.
const MOST_SHARES: f64 = 30.0;
/// Pull towards the middle of the edge, relative to the weight of one mean triangle. Determines the new
/// vertex where flat surroundings leave its position open.
const PULL: f64 = 1e-3;
/// Share of the squared edge length in the cost of a collapse, so that flat regions lose short edges first.
const SHORT_FIRST: f64 = 1e-5;
/// Shares of the squared tolerance available to the first rounds, so that cheap collapses come first.
const EARLY_SHARES: [f64; 3] = [0.1, 0.3, 0.6];
/// Share of vertices removed in a round, at or below which decimation stops.
const WORTH_A_ROUND: f64 = 0.02;
/// Largest number of rounds; twenty halvings are enough for any mesh.
const MOST_ROUNDS: u32 = 20;
/// Marks a merged vertex; no round has this number.
const GONE: u32 = u32::MAX;
/// Least cosine between a triangle's normals before and after a collapse: 60°.
const LEAST_COS: f64 = 0.5;
/// Height of a sliver, as a share of the tolerance, and least cosine between its normal after a collapse and
/// the mean normal around it: 78°, as on the edge of a cube.
const FLAT_SHARE: f64 = 1.0;
const LEAST_MEAN_COS: f64 = 0.1;
/// Least height of a triangle after a collapse, as a share of its longest edge, unless the triangle was worse
/// before.
const LEAST_HEIGHT: f64 = 0.03;

/// Decimates `mesh` by collapsing edges. On average, each remaining vertex stays within tolerance of the
/// planes of the triangles that it represents. `tolerance_mm` has one value per point, mm; 0 keeps the point.
/// The smaller tolerance of both ends applies.
///
/// Closed manifold meshes stay closed manifold; other meshes are returned unchanged. In each round every
/// vertex takes part in at most one collapse, along its cheapest edge. This needs no queue and gives even
/// triangles. Sequential, so that the same mesh always gives the same bytes.
pub fn decimate(mesh: TriMesh, tolerance_mm: &[f64]) -> TriMesh {
    run(mesh, tolerance_mm, Care::Fast, &[])
}

/// Decimates like [`decimate`], and leaves fewer triangles and hardly any sliver: a vertex whose cheapest
/// edge may not collapse tries its others, the long edges of flat triangles are flipped, and a point without
/// tolerance takes others in.
pub fn decimate_with_care(mesh: TriMesh, tolerance_mm: &[f64]) -> TriMesh {
    run(mesh, tolerance_mm, Care::Thorough, &[])
}

/// Decimates like [`decimate_with_care`], but slivers at the points `folded`, by their indices, may turn
/// over: beside a fold the mean normal does not tell which side is out.
pub fn decimate_at_folds(mesh: TriMesh, tolerance_mm: &[f64], folded: &[u32]) -> TriMesh {
    run(mesh, tolerance_mm, Care::Thorough, folded)
}

/// Edges that are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Care {
    /// The cheapest of each vertex.
    Fast,
    /// All edges of each vertex, cheapest first; slivers are removed, too.
    Thorough,
}

fn run(mesh: TriMesh, tolerance_mm: &[f64], care: Care, folded: &[u32]) -> TriMesh {
    assert_eq!(mesh.points.len(), tolerance_mm.len(), "one tolerance a point");
    let Some(mut state) = Decimation::new(&mesh, tolerance_mm, care) else {
        return mesh;
    };
    folded.iter().for_each(|&v| state.is_folded[v as usize] = true);
    let mut alive: Vec<u32> = (0..mesh.points.len() as u32)
        .filter(|&v| tolerance_mm[v as usize] > 0.0)
        .collect();
    for round in 1..=MOST_ROUNDS {
        let share = EARLY_SHARES.get(round as usize - 1).copied().unwrap_or(1.0);
        let n_before = alive.len();
        for &v in &alive {
            state.collapse_at(v, round, share);
        }
        if care == Care::Thorough {
            state.flip_caps();
        }
        alive.retain(|&v| state.is_alive(v));
        let n_gone = n_before - alive.len();
        if round as usize > EARLY_SHARES.len() && n_gone as f64 <= WORTH_A_ROUND * n_before as f64 {
            break;
        }
    }
    state.finish()
}

/// Quadric, a symmetric 4 × 4 form: weighted squared distance to planes.
#[derive(Clone, Copy)]
struct Quadric {
    a: DMat3,
    b: Vec3,
    c: f64,
    shares: f64,
}

impl Quadric {
    const ZERO: Self = Self {
        a: DMat3::ZERO,
        b: Vec3::ZERO,
        c: 0.0,
        shares: 0.0,
    };

    fn of_plane(normal: Vec3, through: Vec3, weight: f64) -> Self {
        let d = -normal.dot(through);
        let a = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        Self {
            a: a * weight,
            b: normal * (d * weight),
            c: d * d * weight,
            shares: weight,
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            a: self.a + other.a,
            b: self.b + other.b,
            c: self.c + other.c,
            shares: self.shares + other.shares,
        }
    }

    /// Mean square distance of `x` to the planes, mm².
    fn at(&self, x: Vec3) -> f64 {
        (x.dot(self.a * x) + 2.0 * self.b.dot(x) + self.c).max(0.0)
            / self.shares.clamp(f64::MIN_POSITIVE, MOST_SHARES)
    }

    /// Minimum of the form, drawn slightly towards `middle`.
    fn least(&self, middle: Vec3) -> Vec3 {
        let a = self.a + DMat3::from_diagonal(Vec3::splat(PULL));
        middle - a.inverse() * (self.a * middle + self.b)
    }
}

struct Decimation {
    /// Points relative to the middle of the mesh.
    points: Vec<Vec3>,
    middle: Vec3,
    /// Start point of each half-edge; meaningless for dead half-edges.
    start: Vec<u32>,
    opposite: Vec<HalfEdge>,
    is_dead: Vec<bool>,
    /// One half-edge out of each vertex.
    out: Vec<HalfEdge>,
    quadrics: Vec<Quadric>,
    tolerance: Vec<f64>,
    /// Last round in which each vertex took part in a collapse; [`GONE`] if it was merged into another.
    round: Vec<u32>,
    /// True for the vertices at which slivers may turn over.
    is_folded: Vec<bool>,
    care: Care,
}

fn prev(h: HalfEdge) -> HalfEdge {
    Topology::next(Topology::next(h))
}

/// Square of the longest edge, mm².
fn longest_sq([a, b, c]: [Vec3; 3]) -> f64 {
    b.distance_squared(c)
        .max(a.distance_squared(b))
        .max(a.distance_squared(c))
}

/// Height of a triangle, as a share of its longest edge.
fn shape_of([a, b, c]: [Vec3; 3]) -> f64 {
    (b - a).cross(c - a).length() / longest_sq([a, b, c]).max(f64::MIN_POSITIVE)
}

impl Decimation {
    fn new(mesh: &TriMesh, tolerance_mm: &[f64], care: Care) -> Option<Self> {
        let topology = Topology::of_mesh(mesh)?;
        let n_half_edges = topology.n_half_edges() as u32;
        let middle = mesh.bounds().center();
        let start: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
        let mut out = vec![HalfEdge::MAX; mesh.points.len()];
        for (h, &v) in start.iter().enumerate() {
            out[v as usize] = h as HalfEdge;
        }
        let mean_area = mesh.area() / mesh.triangles.len().max(1) as f64;
        let mut quadrics = vec![Quadric::ZERO; mesh.points.len()];
        for (face, corners) in mesh.triangles.iter().enumerate() {
            let weight = mesh.face_area(face) / mean_area;
            let q = Quadric::of_plane(
                mesh.face_normal(face),
                mesh.points[corners[0] as usize] - middle,
                weight,
            );
            for &v in corners {
                quadrics[v as usize] = quadrics[v as usize].plus(q);
            }
        }
        let state = Self {
            points: mesh.points.iter().map(|p| *p - middle).collect(),
            middle,
            start,
            opposite: (0..n_half_edges).map(|h| topology.opposite(h)).collect(),
            is_dead: vec![false; mesh.triangles.len()],
            out,
            quadrics,
            tolerance: tolerance_mm.to_vec(),
            round: vec![0; mesh.points.len()],
            is_folded: vec![false; mesh.points.len()],
            care,
        };
        state.has_disks_only().then_some(state)
    }

    /// Returns true if the triangles at each vertex form one fan.
    fn has_disks_only(&self) -> bool {
        let n_reached: usize = (0..self.points.len() as u32)
            .into_par_iter()
            .filter(|&v| self.out[v as usize] != HalfEdge::MAX)
            .map(|v| self.around(v).count())
            .sum();
        n_reached == self.start.len()
    }

    fn ends(&self, h: HalfEdge) -> [u32; 2] {
        [self.start[h as usize], self.start[Topology::next(h) as usize]]
    }

    /// Half-edges that leave `v`.
    fn around(&self, v: u32) -> impl Iterator<Item = HalfEdge> + '_ {
        let first = self.out[v as usize];
        let mut next = Some(first);
        std::iter::from_fn(move || {
            let h = next?;
            let turned = self.opposite[prev(h) as usize];
            next = (turned != first).then_some(turned);
            Some(h)
        })
    }

    fn is_alive(&self, v: u32) -> bool {
        self.round[v as usize] != GONE
    }

    /// Collapses the cheapest edge at `v` within `share` of the squared tolerance; with [`Care::Thorough`]
    /// the cheapest that may collapse. Edges whose ends took part in a collapse of this round are excluded.
    fn collapse_at(&mut self, v: u32, round: u32, share: f64) {
        if self.round[v as usize] >= round {
            return;
        }
        let mut edges: Vec<(HalfEdge, Vec3, f64)> = self
            .around(v)
            .filter(|&h| self.round[self.ends(h)[1] as usize] < round)
            .filter_map(|h| self.place_merge(h, share).map(|(at, cost)| (h, at, cost)))
            .collect();
        edges.sort_by(|a, b| a.2.total_cmp(&b.2));
        let n_tried = match self.care {
            Care::Fast => 1,
            Care::Thorough => edges.len(),
        };
        let tried = &edges[..n_tried.min(edges.len())];
        if let Some(&(h, at, _)) = tried.iter().find(|(h, at, _)| self.may_collapse(*h, *at)) {
            self.collapse(h, at, round);
        }
    }

    /// Position at which the ends of `h` would merge, and the cost of the merge. `None` if the error exceeds
    /// `share` of the squared tolerance.
    fn place_merge(&self, h: HalfEdge, share: f64) -> Option<(Vec3, f64)> {
        let [u, v] = self.ends(h).map(|x| x as usize);
        let [low, high] = match self.tolerance[u] <= self.tolerance[v] {
            true => [u, v],
            false => [v, u],
        };
        let stays = self.tolerance[low] <= 0.0;
        // A point that stays can take another one in.
        let limit = match (stays, self.care) {
            (true, Care::Thorough) => self.tolerance[high],
            _ => self.tolerance[low],
        };
        if limit <= 0.0 {
            return None;
        }
        let q = self.quadrics[u].plus(self.quadrics[v]);
        let at = match stays {
            true => self.points[low],
            false => q.least(0.5 * (self.points[u] + self.points[v])),
        };
        let error = q.at(at);
        let cost = error + SHORT_FIRST * self.points[u].distance_squared(self.points[v]);
        (error <= share * limit * limit && at.is_finite()).then_some((at, cost))
    }

    /// Returns true if the surface stays manifold and no triangle flips or becomes a needle.
    fn may_collapse(&self, h: HalfEdge, at: Vec3) -> bool {
        let [u, v] = self.ends(h);
        let sides = [h, self.opposite[h as usize]].map(|h| self.start[prev(h) as usize]);
        let n_common = self
            .around(u)
            .map(|a| self.ends(a)[1])
            .filter(|&w| self.around(v).any(|b| self.ends(b)[1] == w))
            .count();
        n_common == 2
            && sides[0] != sides[1]
            && sides.iter().all(|&w| self.around(w).nth(3).is_some())
            && [(u, v), (v, u)]
                .iter()
                .all(|&(moved, gone)| self.keeps_shape(moved, gone, at, self.worst_removed(h)))
    }

    /// Least height, as a share of the longest edge, of the triangles that a collapse removes: others may
    /// become as flat. Infinite unless slivers are to be removed.
    fn worst_removed(&self, h: HalfEdge) -> f64 {
        if self.care == Care::Fast {
            return f64::INFINITY;
        }
        let shape = |h: HalfEdge| {
            let corners = [h, Topology::next(h), prev(h)].map(|h| self.start[h as usize]);
            shape_of(corners.map(|v| self.points[v as usize]))
        };
        shape(h).min(shape(self.opposite[h as usize]))
    }

    fn keeps_shape(&self, moved: u32, gone: u32, at: Vec3, worst_removed: f64) -> bool {
        let p = self.points[moved as usize];
        let flat_mm = self.flat_mm(moved);
        let mean = self.mean_normal(moved, flat_mm);
        self.around(moved).all(|h| {
            let (b, c) = (self.ends(h)[1], self.start[prev(h) as usize]);
            if b == gone || c == gone {
                return true;
            }
            let (b, c) = (self.points[b as usize], self.points[c as usize]);
            let (before, after) = ((b - p).cross(c - p), (b - at).cross(c - at));
            let (old, new) = (before.length(), after.length());
            let height = |doubled_area: f64, p: Vec3| doubled_area / longest_sq([p, b, c]);
            // The normal of a sliver says nothing about the surface.
            let is_sliver = old < flat_mm * longest_sq([p, b, c]).sqrt();
            let is_upright = match is_sliver {
                true => self.is_folded[moved as usize] || mean.dot(after) > LEAST_MEAN_COS * new,
                false => before.dot(after) > LEAST_COS * old * new,
            };
            is_upright && height(new, at) >= LEAST_HEIGHT.min(height(old, p)).min(worst_removed)
        })
    }

    /// Height below which a triangle at `v` is a sliver, mm; 0 if none is.
    fn flat_mm(&self, v: u32) -> f64 {
        match self.care {
            Care::Fast => 0.0,
            Care::Thorough => FLAT_SHARE * self.tolerance[v as usize],
        }
    }

    /// Unit normal of the surface around `v`; zero unless it is asked for.
    fn mean_normal(&self, v: u32, flat_mm: f64) -> Vec3 {
        if flat_mm == 0.0 {
            return Vec3::ZERO;
        }
        let p = self.points[v as usize];
        let normal = |h: HalfEdge| {
            let (b, c) = (self.ends(h)[1], self.start[prev(h) as usize]);
            (self.points[b as usize] - p).cross(self.points[c as usize] - p)
        };
        self.around(v).map(normal).sum::<Vec3>().normalize_or_zero()
    }

    /// Merges the end of `h` into its start, which moves to `at`.
    fn collapse(&mut self, h: HalfEdge, at: Vec3, round: u32) {
        let [u, v] = self.ends(h);
        let fan: Vec<HalfEdge> = self.around(v).collect();
        for a in fan {
            self.start[a as usize] = u;
        }
        for side in [h, self.opposite[h as usize]] {
            let (a, b) = (
                self.opposite[Topology::next(side) as usize],
                self.opposite[prev(side) as usize],
            );
            self.opposite[a as usize] = b;
            self.opposite[b as usize] = a;
            self.is_dead[side as usize / 3] = true;
            for kept in [a, b] {
                self.out[self.start[kept as usize] as usize] = kept;
            }
        }
        let [u, v] = [u, v].map(|x| x as usize);
        self.points[u] = at;
        self.quadrics[u] = self.quadrics[u].plus(self.quadrics[v]);
        self.tolerance[u] = self.tolerance[u].min(self.tolerance[v]);
        self.is_folded[u] &= self.is_folded[v];
        (self.round[u], self.round[v]) = (round, GONE);
    }

    fn finish(self) -> TriMesh {
        let mut name = vec![u32::MAX; self.points.len()];
        let mut mesh = TriMesh::default();
        for (corners, _) in self
            .start
            .chunks_exact(3)
            .zip(&self.is_dead)
            .filter(|(_, dead)| !**dead)
        {
            let triangle = [corners[0], corners[1], corners[2]].map(|v| {
                let name = &mut name[v as usize];
                if *name == u32::MAX {
                    *name = mesh.points.len() as u32;
                    mesh.points.push(self.points[v as usize] + self.middle);
                }
                *name
            });
            mesh.triangles.push(triangle);
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::contour;
    use crate::{Aabb, Solid, Volume};

    fn body(size: f64, distance: impl Fn(Vec3) -> f64 + Sync) -> TriMesh {
        contour(
            Aabb {
                min: Vec3::splat(-size),
                max: Vec3::splat(size),
            },
            size / 20.0,
            distance,
        )
    }

    #[test]
    fn a_ball_loses_most_triangles_and_stays_a_ball() {
        let ball = body(11.0, |p| 10.0 - p.length());
        let n = ball.points.len();
        let few = decimate(ball.clone(), &vec![0.05; n]);
        assert!(
            4 * few.triangles.len() < ball.triangles.len(),
            "{} of {}",
            few.triangles.len(),
            ball.triangles.len()
        );
        let solid = Solid::new(few).expect("closed");
        for p in &solid.mesh().points {
            assert!((p.length() - 10.0).abs() < 0.12, "{}", p.length());
        }
        for f in 0..solid.mesh().triangles.len() {
            assert!((solid.mesh().face_center(f).length() - 10.0).abs() < 0.15);
        }
    }

    #[test]
    fn a_cube_becomes_few_triangles_with_its_corners_kept() {
        let cube = body(3.0, |p| 2.0 - p.abs().max_element());
        let n = cube.points.len();
        let few = decimate(cube.clone(), &vec![1e-6; n]);
        assert!(10 * few.triangles.len() < cube.triangles.len());
        assert!((few.signed_volume() - cube.signed_volume()).abs() < 1e-6);
        assert!(Solid::new(few).is_ok());
    }

    #[test]
    fn points_without_tolerance_stay() {
        let ball = body(11.0, |p| 10.0 - p.length());
        let tolerance: Vec<f64> = ball
            .points
            .iter()
            .map(|p| if p.x > 0.0 { 0.0 } else { 0.1 })
            .collect();
        let few = decimate(ball.clone(), &tolerance);
        let right = |m: &TriMesh| {
            let mut bits: Vec<[i64; 3]> = m
                .points
                .iter()
                .filter(|p| p.x > 0.0)
                .map(|p| p.to_array().map(|x| (x * 1e9).round() as i64))
                .collect();
            bits.sort_unstable();
            bits
        };
        assert_eq!(right(&few), right(&ball));
        assert!(few.points.len() < ball.points.len());
    }

    /// Two balls that overlap: their union has slivers along the curve where they meet.
    pub(super) fn two_balls() -> TriMesh {
        let ball = body(11.0, |p| 10.0 - p.length());
        let moved = TriMesh {
            points: ball
                .points
                .iter()
                .map(|p| *p + Vec3::new(7.03, 1.02, 0.51))
                .collect(),
            triangles: ball.triangles.clone(),
        };
        let [a, b] = [&ball, &moved].map(|mesh| Volume::from_closed_mesh(mesh).expect("closed"));
        a.union(&b).to_mesh()
    }

    fn n_slivers(mesh: &TriMesh) -> usize {
        (0..mesh.triangles.len())
            .filter(|&f| mesh.face_area(f) < 1e-3)
            .count()
    }

    #[test]
    fn with_care_there_are_fewer_triangles_and_hardly_any_sliver() {
        let both = two_balls();
        let tolerance = vec![0.02; both.points.len()];
        let fast = decimate(both.clone(), &tolerance);
        let careful = decimate_with_care(both.clone(), &tolerance);
        assert!(careful.triangles.len() < fast.triangles.len());
        assert!(n_slivers(&both) > 20);
        assert!(
            10 * n_slivers(&careful) < n_slivers(&both),
            "{}",
            n_slivers(&careful)
        );
        let solid = Solid::new(careful).expect("closed");
        assert!((solid.mesh().signed_volume() / both.signed_volume() - 1.0).abs() < 2e-3);
        for at in (0..solid.mesh().triangles.len()).map(|f| solid.mesh().face_center(f)) {
            let off = (at.length() - 10.0).min(at.distance(Vec3::new(7.03, 1.02, 0.51)) - 10.0);
            assert!(off.abs() < 0.15, "{off}");
        }
    }

    #[test]
    fn with_care_points_without_tolerance_stay_and_take_others_in() {
        let ball = body(11.0, |p| 10.0 - p.length());
        let stays = |p: &Vec3| p.x > 0.0;
        let tolerance: Vec<f64> = ball
            .points
            .iter()
            .map(|p| if stays(p) { 0.0 } else { 0.1 })
            .collect();
        let n_left = |mesh: &TriMesh| mesh.points.iter().filter(|p| !stays(p)).count();
        let (fast, careful) = (
            decimate(ball.clone(), &tolerance),
            decimate_with_care(ball.clone(), &tolerance),
        );
        let is_kept = |p: &Vec3| careful.points.iter().any(|q| p.distance(*q) < 1e-9);
        assert!(ball.points.iter().filter(|p| stays(p)).all(is_kept));
        assert!(n_left(&careful) < n_left(&fast));
    }

    #[test]
    fn a_tetrahedron_and_an_open_sheet_come_back() {
        let p = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].to_vec();
        let tetrahedron = TriMesh {
            points: p.clone(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        };
        let sheet = TriMesh {
            points: p,
            triangles: vec![[0, 2, 1]],
        };
        assert_eq!(decimate(tetrahedron.clone(), &[9.0; 4]).triangles.len(), 4);
        assert_eq!(decimate(sheet.clone(), &[9.0; 4]), sheet);
    }
}
