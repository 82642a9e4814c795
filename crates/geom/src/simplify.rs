//! Simplification: fewer triangles within a given distance of a solid, so that detail too fine for printing
//! costs no time.
//!
//! [`decimate_with_care`] keeps a mean of squared distances small. Here the distance itself is measured
//! afterwards, both ways, and what is around points that moved too far is allowed to move less.

use rayon::prelude::*;

use crate::bvh::TriangleBvh;
use crate::decimate::decimate_with_care;
use crate::fold::folded_faces;
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

/// Distance up to which two folded faces are at the same place, mm.
const SAME_PLACE_MM: f64 = 0.5;

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

/// Simplifies `solid` by collapsing edges. Points and triangle centres of both surfaces stay within
/// `within_mm` of the other surface. The points `fixed`, by their indices, stay in place.
///
/// `None` if this distance cannot be kept, or if the surface would cross itself or fold where it did not
/// before. Equal on any number of threads.
pub fn simplify(solid: &Solid, fixed: &[u32], within_mm: f64) -> Option<Simplified> {
    let mesh = solid.mesh();
    let old = TriangleBvh::new(mesh);
    let mut tolerance = vec![MEAN_SHARE * within_mm; mesh.points.len()];
    for &point in fixed {
        tolerance[point as usize] = 0.0;
    }
    for round in 0..MOST_ROUNDS {
        let few = decimate_with_care(mesh.clone(), &tolerance);
        let new = TriangleBvh::new(&few);
        let (mut away, of_old) = points_away(mesh, &new, within_mm);
        let (stray, of_new) = points_away(&few, &old, within_mm);
        away.extend(stray);
        let mut crossed = Vec::new();
        if away.is_empty() {
            crossed = crossing_faces(&few);
            crossed.extend(new_folds(&few, &new, mesh, &old));
        }
        if away.is_empty() && crossed.is_empty() {
            let nearest = |f: usize| old.nearest(few.face_center(f), f64::INFINITY).map(|n| n.face);
            let source_face: Option<Vec<u32>> =
                (0..few.triangles.len()).into_par_iter().map(nearest).collect();
            return Some(Simplified {
                source_face: source_face?,
                solid: Solid::new(few).ok()?,
                farthest_mm: of_old.max(of_new),
            });
        }
        // A triangle that crosses another may be large, so its corners and its centre are all restored.
        let corners_and_middle = |&f: &u32| {
            few.corners(f as usize)
                .into_iter()
                .chain([few.face_center(f as usize)])
        };
        away.extend(crossed.iter().flat_map(corners_and_middle));
        let nearest = |at: Vec3| old.nearest(at, f64::INFINITY).map(|n| n.face);
        let beside: Vec<u32> = away.into_par_iter().filter_map(nearest).collect();
        let (share, n_rings) = if round < GENTLE_ROUNDS {
            (GENTLER, 0)
        } else {
            (0.0, 1)
        };
        restore(&mut tolerance, mesh, &beside, share, n_rings);
    }
    None
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

/// Returns the faces of `few` that fold, without those at places where the former mesh folds as well.
fn new_folds(few: &TriMesh, few_bvh: &TriangleBvh, mesh: &TriMesh, bvh: &TriangleBvh) -> Vec<u32> {
    let mut folds = folded_faces(few, few_bvh);
    if !folds.is_empty() {
        let former = TriMesh {
            points: mesh.points.clone(),
            triangles: (folded_faces(mesh, bvh).into_iter())
                .map(|f| mesh.triangles[f as usize])
                .collect(),
        };
        let former = TriangleBvh::new(&former);
        let near_sq = SAME_PLACE_MM * SAME_PLACE_MM;
        folds.retain(|&face| former.nearest(few.face_center(face as usize), near_sq).is_none());
    }
    folds
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

/// Points and triangle centres of `mesh` farther than `within_mm` from `other`, and the largest distance of
/// the rest, mm.
fn points_away(mesh: &TriMesh, other: &TriangleBvh, within_mm: f64) -> (Vec<Vec3>, f64) {
    let limit_sq = within_mm * within_mm;
    let of = |at: Vec3| (at, other.nearest(at, limit_sq).map(|n| n.distance_sq));
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
        let few = simplify(&solid, &[], 0.05).expect("a ball is simple");
        assert!(2 * few.solid.mesh().triangles.len() < solid.mesh().triangles.len());
        assert!(farthest(solid.mesh(), few.solid.mesh()) <= 0.05);
        assert!(farthest(few.solid.mesh(), solid.mesh()) <= 0.05);
        assert!(few.farthest_mm <= 0.05 && few.farthest_mm > 0.0);
    }

    #[test]
    fn surfaces_nearer_than_the_distance_neither_cross_nor_fold_afterwards() {
        // A ball in a shell, with a narrow gap between them.
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
        let both = Solid::new(both).expect("closed");
        let folds = |mesh: &TriMesh| folded_faces(mesh, &TriangleBvh::new(mesh));
        let careless = decimate_with_care(
            both.mesh().clone(),
            &vec![MEAN_SHARE * 0.1; both.mesh().points.len()],
        );
        assert!(!crossing_faces(&careless).is_empty());
        assert!(folds(both.mesh()).is_empty() && !folds(&careless).is_empty());
        let few = simplify(&both, &[], 0.1).expect("some of it is simple");
        assert!(crossing_faces(few.solid.mesh()).is_empty());
        assert!(folds(few.solid.mesh()).is_empty());
        assert!(few.solid.mesh().triangles.len() < both.mesh().triangles.len());
    }

    #[test]
    fn borders_of_labels_stay() {
        let solid = ball(20.0);
        let mesh = solid.mesh();
        let label = |mesh: &TriMesh, f: usize| i64::from(mesh.face_center(f).x > 0.3);
        let labels: Vec<i64> = (0..mesh.triangles.len()).map(|f| label(mesh, f)).collect();
        let few = simplify(&solid, &points_between(mesh, &labels), 0.05).expect("a ball is simple");
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
