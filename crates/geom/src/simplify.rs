//! Simplification: fewer triangles within a given distance of a solid, so that detail too fine for printing
//! costs no time.
//!
//! [`decimate_with_care`](crate::decimate::decimate_with_care) keeps a mean of squared distances small. Here
//! the distance itself is measured afterwards, both ways, and what is around points that moved too far is
//! allowed to move less. Nor may the result cross itself, or fold where the surface did not fold before.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::bvh::TriangleBvh;
use crate::decimate::{decimate, decimate_at_folds};
use crate::fold::nearly_folded_faces;
use crate::repair::crossing_faces;
use crate::{Solid, TriMesh, Vec3};

/// Share of the distance used as tolerance of the mean distance: nearly all of such a result lies within the
/// distance.
const MEAN_SHARE: f64 = 0.4;
/// Largest number of rounds of restoring points that moved too far.
const MOST_ROUNDS: usize = 12;

/// Number of rounds after which triangles that moved too far may move less, by this share each time. After
/// the later rounds they stay, and their neighbours, too: what lies beside a point may move it.
const GENTLE_ROUNDS: usize = 3;
const GENTLER: f64 = 0.25;

/// Distance up to which a place belongs to a fold, mm.
const AT_FOLD_MM: f64 = 0.5;
/// Attempts to be rid of folds: distance from a fold up to which points may move, mm, and the distance by
/// which they may, as a share of [`Reach::at_folds_mm`].
const ATTEMPTS_AT_FOLDS: [(f64, f64); 4] = [(0.25, 0.25), (0.25, 0.4), (0.5, 0.4), (0.5, 1.0)];
/// Largest number of rounds of closing notches.
const MOST_CLOSING_ROUNDS: usize = 6;
/// Largest number of rounds of restoring triangles that cross.
const MOST_UNCROSSING_ROUNDS: usize = 6;

/// A solid with fewer triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Simplified {
    /// Solid with fewer triangles than before.
    pub solid: Solid,
    /// Triangle of the original solid nearest to the centre of each new triangle.
    pub source_face: Vec<u32>,
    /// Largest distance found, mm, of a point or a triangle's centre of one surface from the other.
    pub farthest_mm: f64,
}

/// Distances that a surface may move, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Distance from the former surface in general.
    pub within_mm: f64,
    /// Distance within 0.5 mm of a fold: notches narrower than this can close. At least `within_mm`.
    pub at_folds_mm: f64,
}

impl Reach {
    /// Takes one distance for folds and all other places, mm.
    pub fn everywhere(within_mm: f64) -> Self {
        Self {
            within_mm,
            at_folds_mm: within_mm,
        }
    }
}

/// Simplifies `solid` by collapsing edges. Points and triangle centres of both surfaces stay within `reach`
/// of the other surface. The points `fixed`, by their indices, stay in place.
///
/// `None` if this distance cannot be kept, or if the surface would cross itself or fold where it did not
/// before. Equal on any number of threads.
pub fn simplify(solid: &Solid, fixed: &[u32], reach: Reach) -> Option<Simplified> {
    let mesh = solid.mesh();
    let job = Job {
        old: mesh,
        tree: TriangleBvh::new(mesh),
        fixed,
        within_mm: reach.within_mm,
    };
    // Most surfaces fold neither before nor after, so former folds are sought only if later ones are found.
    match job.rounds(mesh, None) {
        Outcome::Simple(simplified) => Some(simplified),
        Outcome::TooFar => None,
        Outcome::Folded => job.unfolded(reach.at_folds_mm),
    }
}

/// Result of all rounds of simplifying.
enum Outcome {
    Simple(Simplified),
    /// The distance cannot be kept, or the surface would cross itself or fold.
    TooFar,
    /// The result would fold, and former folds are not known.
    Folded,
}

/// Room for folds to go.
#[derive(Clone, Copy)]
struct Room<'a> {
    /// Folds of the old mesh, and of the one that is simplified.
    folds: [&'a Folds; 2],
    /// Distance from a fold up to which points may move, mm.
    near_mm: f64,
    /// Distance by which they may move, mm.
    reach_mm: f64,
}

/// Inputs that all rounds of simplifying share.
struct Job<'a> {
    old: &'a TriMesh,
    /// Tree of the old mesh.
    tree: TriangleBvh,
    fixed: &'a [u32],
    within_mm: f64,
}

impl Job<'_> {
    /// Simplifies a surface that would fold afterwards. Where it folded before, points may move by
    /// `at_folds_mm`. Of several attempts, the first without folds counts, else the one with the fewest.
    fn unfolded(&self, at_folds_mm: f64) -> Option<Simplified> {
        let former = Folds::of(self.old, &self.tree);
        let mut best: Option<(usize, Simplified)> = None;
        for (near_mm, share) in ATTEMPTS_AT_FOLDS {
            let reach_mm = self.within_mm.max(share * at_folds_mm);
            let closed = close_notches(self.old, &former, self.fixed, reach_mm);
            let (start, left) = closed.as_ref().map_or((self.old, &former), |c| (&c.0, &c.1));
            let room = Room {
                folds: [&former, left],
                near_mm,
                reach_mm,
            };
            let Outcome::Simple(simplified) = self.rounds(start, Some(room)) else {
                continue;
            };
            let mesh = simplified.solid.mesh();
            let n_folds = nearly_folded_faces(mesh, &TriangleBvh::new(mesh)).len();
            if best.as_ref().is_none_or(|best| n_folds < best.0) {
                best = Some((n_folds, simplified));
            }
            if n_folds == 0 || former.n == 0 {
                break;
            }
        }
        best.map(|best| best.1)
    }

    /// Simplifies `start`, which is the old mesh or has its points elsewhere, with `room` for its folds if
    /// they are known.
    fn rounds(&self, start: &TriMesh, room: Option<Room<'_>>) -> Outcome {
        let folded: Vec<u32> = room.map_or_else(Vec::new, |room| self.points_at(room));
        let mut tolerance = self.tolerance(&folded, room.map_or(self.within_mm, |room| room.reach_mm));
        let limit_mm = |at: Vec3| match room {
            Some(Room {
                folds: [former, _],
                reach_mm,
                ..
            }) if former.are_within(AT_FOLD_MM, at) => reach_mm,
            _ => self.within_mm,
        };
        for round in 0..MOST_ROUNDS {
            let few = decimate_at_folds(start.clone(), &tolerance, &folded);
            let new = TriangleBvh::new(&few);
            let (mut away, of_old) = points_away(self.old, &new, &limit_mm);
            let (stray, of_new) = points_away(&few, &self.tree, &limit_mm);
            away.extend(stray);
            let mut crossed = Vec::new();
            if away.is_empty() {
                crossed = crossing_faces(&few);
                match room {
                    Some(room) => crossed.extend(room.folds[1].new_in(&few, &new)),
                    None if !nearly_folded_faces(&few, &new).is_empty() => return Outcome::Folded,
                    None => {}
                }
            }
            if away.is_empty() && crossed.is_empty() {
                let simplified = self.simplified(few, of_old.max(of_new));
                return simplified.map_or(Outcome::TooFar, Outcome::Simple);
            }
            away.extend(corners_and_middles(&few, &crossed));
            let beside = faces_beside(&self.tree, away);
            let (share, n_rings) = if round < GENTLE_ROUNDS {
                (GENTLER, 0)
            } else {
                (0.0, 1)
            };
            restore(&mut tolerance, start, &beside, share, n_rings);
        }
        Outcome::TooFar
    }

    /// Points near former folds.
    fn points_at(&self, room: Room<'_>) -> Vec<u32> {
        let is_near = |v: &u32| room.folds[0].are_within(room.near_mm, self.old.points[*v as usize]);
        (0..self.old.points.len() as u32).filter(is_near).collect()
    }

    /// Tolerance of each point, mm, which is larger at those that are `folded`.
    fn tolerance(&self, folded: &[u32], reach_mm: f64) -> Vec<f64> {
        let mut tolerance = vec![MEAN_SHARE * self.within_mm; self.old.points.len()];
        for &point in folded {
            tolerance[point as usize] = MEAN_SHARE * reach_mm;
        }
        for &point in self.fixed {
            tolerance[point as usize] = 0.0;
        }
        tolerance
    }

    fn simplified(&self, few: TriMesh, farthest_mm: f64) -> Option<Simplified> {
        let nearest = |f: usize| {
            self.tree
                .nearest(few.face_center(f), f64::INFINITY)
                .map(|n| n.face)
        };
        let source_face: Option<Vec<u32>> = (0..few.triangles.len()).into_par_iter().map(nearest).collect();
        Some(Simplified {
            source_face: source_face?,
            solid: Solid::new(few).ok()?,
            farthest_mm,
        })
    }
}

/// Decimates `mesh` like [`decimate`], but so that no triangles of the result cross each other. The mesh must
/// not cross itself. It comes back unchanged if that cannot be had.
pub fn decimate_without_crossing(mesh: TriMesh, tolerance_mm: &[f64]) -> TriMesh {
    let mut few = decimate(mesh.clone(), tolerance_mm);
    let mut crossed = crossing_faces(&few);
    if crossed.is_empty() {
        return few;
    }
    let (old, mut tolerance) = (TriangleBvh::new(&mesh), tolerance_mm.to_vec());
    for _ in 0..MOST_UNCROSSING_ROUNDS {
        let beside = faces_beside(&old, corners_and_middles(&few, &crossed).collect());
        restore(&mut tolerance, &mesh, &beside, 0.0, 1);
        few = decimate(mesh.clone(), &tolerance);
        crossed = crossing_faces(&few);
        if crossed.is_empty() {
            return few;
        }
    }
    mesh
}

/// Corners and centres of faces: one that crosses another may be large, so all of it is restored.
fn corners_and_middles<'a>(mesh: &'a TriMesh, faces: &'a [u32]) -> impl Iterator<Item = Vec3> + 'a {
    let of = |&f: &u32| {
        let middle = mesh.face_center(f as usize);
        mesh.corners(f as usize).into_iter().chain([middle])
    };
    faces.iter().flat_map(of)
}

/// Nearest face to each place.
fn faces_beside(tree: &TriangleBvh, places: Vec<Vec3>) -> Vec<u32> {
    let nearest = |at: Vec3| tree.nearest(at, f64::INFINITY).map(|n| n.face);
    places.into_par_iter().filter_map(nearest).collect()
}

/// Reduces the tolerance of the corners of `faces` to a `share`, and with `n_rings` of those of as many rings
/// of triangles around them.
fn restore(tolerance: &mut [f64], mesh: &TriMesh, faces: &[u32], share: f64, n_rings: usize) {
    let mut stays = vec![false; tolerance.len()];
    for v in faces.iter().flat_map(|&f| mesh.triangles[f as usize]) {
        stays[v as usize] = true;
    }
    for _ in 0..n_rings {
        let inner = stays.clone();
        for t in mesh
            .triangles
            .iter()
            .filter(|t| t.iter().any(|&v| inner[v as usize]))
        {
            t.iter().for_each(|&v| stays[v as usize] = true);
        }
    }
    for (tolerance, _) in tolerance.iter_mut().zip(&stays).filter(|(_, stays)| **stays) {
        *tolerance *= share;
    }
}

/// Faces of a mesh that fold.
struct Folds {
    n: usize,
    /// Corners of these faces.
    points: Vec<u32>,
    /// Tree of these faces; `None` without any.
    bvh: Option<TriangleBvh>,
}

impl Folds {
    fn of(mesh: &TriMesh, bvh: &TriangleBvh) -> Self {
        let faces = nearly_folded_faces(mesh, bvh);
        let triangles: Vec<[u32; 3]> = faces.iter().map(|&f| mesh.triangles[f as usize]).collect();
        let points = triangles.concat();
        let folded = TriMesh {
            points: mesh.points.clone(),
            triangles,
        };
        Self {
            n: faces.len(),
            bvh: (!points.is_empty()).then(|| TriangleBvh::new(&folded)),
            points,
        }
    }

    /// Returns true if a fold is within `near_mm` of a place.
    fn are_within(&self, near_mm: f64, at: Vec3) -> bool {
        let near_sq = near_mm * near_mm;
        (self.bvh.as_ref()).is_some_and(|bvh| bvh.nearest(at, near_sq).is_some())
    }

    /// Returns the faces of `few` that fold at other places.
    fn new_in(&self, few: &TriMesh, bvh: &TriangleBvh) -> Vec<u32> {
        let mut found = nearly_folded_faces(few, bvh);
        found.retain(|&face| !self.are_within(AT_FOLD_MM, few.face_center(face as usize)));
        found
    }
}

/// Closes notches of `mesh` that count as folds: their bottom is drawn to their lips, which short edges join
/// it to. Returns the mesh with the folds that are left; `None` if there would be as many or it would cross
/// itself.
///
/// Where two cuts meet at a small angle, one leaves a groove some hundredths of a mm deep beside the other.
fn close_notches(mesh: &TriMesh, folds: &Folds, fixed: &[u32], reach_mm: f64) -> Option<(TriMesh, Folds)> {
    let (mut best, mut n_left) = (None, folds.n);
    let (mut now, mut points) = (mesh.clone(), folds.points.clone());
    for _ in 0..MOST_CLOSING_ROUNDS {
        if n_left == 0 {
            break;
        }
        now = drawn_together(now, &points, fixed, reach_mm);
        let left = Folds::of(&now, &TriangleBvh::new(&now));
        if left.n > n_left || !crossing_faces(&now).is_empty() {
            break;
        }
        points.clone_from(&left.points);
        n_left = left.n;
        if n_left < folds.n {
            best = Some((now.clone(), left));
        }
    }
    best
}

/// Moves each of `points` to the middle of the points that edges shorter than `reach_mm` join it to. The
/// points `fixed` stay.
fn drawn_together(mut mesh: TriMesh, points: &[u32], fixed: &[u32], reach_mm: f64) -> TriMesh {
    let free = points.iter().filter(|v| !fixed.contains(v));
    let mut near: BTreeMap<u32, Vec<Vec3>> = free.map(|&v| (v, Vec::new())).collect();
    for t in &mesh.triangles {
        for k in 0..3 {
            let [v, w] = [t[k], t[(k + 1) % 3]];
            let [from, to] = [v, w].map(|v| mesh.points[v as usize]);
            if from.distance(to) < reach_mm
                && let Some(near) = near.get_mut(&v)
            {
                near.push(to);
            }
        }
    }
    for (v, near) in near.into_iter().filter(|(_, near)| !near.is_empty()) {
        mesh.points[v as usize] = near.iter().sum::<Vec3>() / near.len() as f64;
    }
    mesh
}

/// Returns the points where triangles of different `labels`, one per triangle, meet.
pub fn points_between(mesh: &TriMesh, labels: &[i64]) -> Vec<u32> {
    let mut seen: Vec<Option<i64>> = vec![None; mesh.points.len()];
    let mut between = Vec::new();
    for (t, &label) in mesh.triangles.iter().zip(labels) {
        for &v in t {
            match seen[v as usize].replace(label) {
                Some(other) if other != label => between.push(v),
                _ => {}
            }
        }
    }
    between
}

/// Points and triangle centres of `mesh` farther than their limit from `other`, and the largest distance of
/// the rest, mm.
fn points_away(
    mesh: &TriMesh,
    other: &TriangleBvh,
    limit_mm: &(impl Fn(Vec3) -> f64 + Sync),
) -> (Vec<Vec3>, f64) {
    let of = |at: Vec3| {
        let nearest = other.nearest(at, limit_mm(at).powi(2));
        (at, nearest.map(|n| n.distance_sq))
    };
    let points = mesh.points.par_iter().map(|&p| of(p));
    let middles = (0..mesh.triangles.len())
        .into_par_iter()
        .map(|f| of(mesh.face_center(f)));
    let found: Vec<(Vec3, Option<f64>)> = points.chain(middles).collect();
    let farthest_sq = found.iter().filter_map(|f| f.1).fold(0.0, f64::max);
    let away = found.iter().filter(|f| f.1.is_none()).map(|f| f.0).collect();
    (away, farthest_sq.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Aabb;
    use crate::contour::contour;
    use crate::decimate::decimate_with_care;

    fn ball(radius: f64) -> Solid {
        let bounds = Aabb {
            min: Vec3::splat(-1.1 * radius),
            max: Vec3::splat(1.1 * radius),
        };
        Solid::new(contour(bounds, radius / 30.0, |p| radius - p.length())).expect("closed")
    }

    fn farthest(from: &TriMesh, to: &TriMesh) -> f64 {
        let tree = TriangleBvh::new(to);
        let of = |p: &Vec3| {
            tree.nearest(*p, f64::INFINITY)
                .expect("there is a triangle")
                .distance_sq
        };
        from.points.iter().map(of).fold(0.0, f64::max).sqrt()
    }

    #[test]
    fn no_point_is_farther_than_said() {
        let solid = ball(20.0);
        let few = simplify(&solid, &[], Reach::everywhere(0.05)).expect("a ball is simple");
        assert!(2 * few.solid.mesh().triangles.len() < solid.mesh().triangles.len());
        assert!(farthest(solid.mesh(), few.solid.mesh()) <= 0.05);
        assert!(farthest(few.solid.mesh(), solid.mesh()) <= 0.05);
        assert!(few.farthest_mm <= 0.05 && few.farthest_mm > 0.0);
    }

    /// A ball in a shell, with a narrow gap between them.
    fn ball_in_shell() -> Solid {
        let ball = ball(20.0);
        let n_points = ball.mesh().points.len() as u32;
        let mut both = TriMesh::default();
        for (number, (scale, is_inside_out)) in [(1.0, false), (1.003, true), (1.25, false)]
            .into_iter()
            .enumerate()
        {
            let first = number as u32 * n_points;
            both.points.extend(ball.mesh().points.iter().map(|p| *p * scale));
            let turned = |&[a, b, c]: &[u32; 3]| if is_inside_out { [a, c, b] } else { [a, b, c] };
            let triangles = ball.mesh().triangles.iter().map(turned);
            both.triangles.extend(triangles.map(|t| t.map(|v| v + first)));
        }
        Solid::new(both).expect("closed")
    }

    fn folds(mesh: &TriMesh) -> Vec<u32> {
        nearly_folded_faces(mesh, &TriangleBvh::new(mesh))
    }

    #[test]
    fn surfaces_nearer_than_the_distance_neither_cross_nor_fold_afterwards() {
        let both = ball_in_shell();
        let careless = decimate_with_care(
            both.mesh().clone(),
            &vec![MEAN_SHARE * 0.1; both.mesh().points.len()],
        );
        assert!(!crossing_faces(&careless).is_empty());
        assert!(folds(both.mesh()).is_empty() && !folds(&careless).is_empty());
        let few = simplify(&both, &[], Reach::everywhere(0.1)).expect("some of it is simple");
        assert!(crossing_faces(few.solid.mesh()).is_empty());
        assert!(folds(few.solid.mesh()).is_empty());
        assert!(few.solid.mesh().triangles.len() < both.mesh().triangles.len());
    }

    #[test]
    fn decimation_that_would_cross_is_restored_there_and_not_elsewhere() {
        let both = ball_in_shell().into_mesh();
        let tolerance = vec![0.05; both.points.len()];
        let careless = decimate(both.clone(), &tolerance);
        assert!(!crossing_faces(&careless).is_empty());
        let few = decimate_without_crossing(both.clone(), &tolerance);
        assert!(crossing_faces(&few).is_empty());
        let n = |mesh: &TriMesh| mesh.triangles.len();
        assert!(
            n(&careless) <= n(&few) && n(&few) < n(&both),
            "{} of {}",
            n(&few),
            n(&both)
        );
    }

    #[test]
    fn a_notch_thinner_than_a_hair_is_closed() {
        // A groove 0.03 mm deep, whose walls are 8 degrees apart, runs along the top of a block.
        let profile = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 3.0],
            [2.0, 3.0],
            [2.0185, 2.97],
            [2.0, 2.9925],
            [0.0, 2.9925],
        ];
        let n = profile.len() as u32;
        let ends = [0.0, 3.0].map(|z| profile.map(|[x, y]| Vec3::new(x, y, z)));
        let sides = (0..n).flat_map(|i| {
            let j = (i + 1) % n;
            [[i, j, j + n], [i, j + n, i + n]]
        });
        let cap = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [0, 4, 5], [0, 5, 6]];
        let lower = cap.map(|[a, b, c]| [a, c, b]);
        let upper = cap.map(|t| t.map(|v: u32| v + n));
        let block = TriMesh {
            points: ends.concat(),
            triangles: sides.chain(lower).chain(upper).collect(),
        };
        let notched = Solid::new(block).expect("closed");
        assert!(!folds(notched.mesh()).is_empty());
        let reach = Reach {
            within_mm: 0.01,
            at_folds_mm: 0.05,
        };
        let few = simplify(&notched, &[], reach).expect("few triangles stay");
        assert!(folds(few.solid.mesh()).is_empty() && few.farthest_mm <= 0.05);
        assert!((few.solid.volume() - notched.volume()).abs() < 0.1);
    }

    #[test]
    fn a_fold_goes_where_the_surface_may_move_far_enough() {
        // A point pushed past its neighbour turns the triangles between them over.
        const PAST_MM: f64 = 0.06;
        let mut mesh = ball(20.0).into_mesh();
        let [a, b, _] = mesh.triangles[1000];
        let [from, to] = [a, b].map(|v| mesh.points[v as usize]);
        mesh.points[a as usize] = to + (to - from).normalize() * PAST_MM;
        let folded = Solid::new(mesh).expect("still closed");
        assert!(!folds(folded.mesh()).is_empty());
        let reach = Reach {
            within_mm: 0.01,
            at_folds_mm: 0.1,
        };
        let few = simplify(&folded, &[], reach).expect("a ball is simple");
        assert!(folds(few.solid.mesh()).is_empty() && few.farthest_mm <= 0.1);
    }

    #[test]
    fn borders_of_labels_stay() {
        let solid = ball(20.0);
        let mesh = solid.mesh();
        let label = |mesh: &TriMesh, f: usize| i64::from(mesh.face_center(f).x > 0.3);
        let labels: Vec<i64> = (0..mesh.triangles.len()).map(|f| label(mesh, f)).collect();
        let few = simplify(&solid, &points_between(mesh, &labels), Reach::everywhere(0.05))
            .expect("a ball is simple");
        let after: Vec<i64> = few.source_face.iter().map(|&f| labels[f as usize]).collect();
        let border = |mesh: &TriMesh, labels: &[i64]| {
            let mut points: Vec<[i64; 3]> = points_between(mesh, labels)
                .iter()
                .map(|&v| {
                    mesh.points[v as usize]
                        .to_array()
                        .map(|x| (x * 1e6).round() as i64)
                })
                .collect();
            points.sort_unstable();
            points.dedup();
            points
        };
        assert_eq!(border(few.solid.mesh(), &after), border(mesh, &labels));
    }
}
