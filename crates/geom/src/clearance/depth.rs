//! Penetration depth of one solid in another.

use super::pair::{nearest_on, pierced_at};
use super::{Shape, TOUCH_MM};
use crate::{TriMesh, Vec3};

/// Accuracy of depths, mm: a tenth of what a workshop's measuring gauge resolves.
pub(super) const DEPTH_TOLERANCE_MM: f64 = 1e-4;

/// Deepest point found so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Deepest {
    /// Depth of the point, mm, ≥ 0.
    pub depth_mm: f64,
    /// Travel at which the depth is reached, mm.
    pub travel_mm: f64,
    /// Deepest point, mm, in coordinates in which the other solid is at rest.
    pub point: Vec3,
    /// Nearest point of the other surface, mm.
    pub surface: Vec3,
}

/// Indices of a triangle of the moving shape and of one of the fixed shape, or of the two ends of an edge.
type Pair = (u32, u32);

/// A motion of one shape past another that is at rest.
pub(super) struct Passage<'a> {
    /// Shape that moves past the other.
    pub mover: &'a Shape,
    /// Shape that is at rest.
    pub obstacle: &'a Shape,
    /// Unit vector of the motion, or zero.
    pub along: Vec3,
    /// First and last travel, mm.
    pub travels: [f64; 2],
}

/// A straight line of possible points of the moving surface, from one travel to another.
#[derive(Clone, Copy)]
struct Track {
    ends: [Vec3; 2],
    travels: [f64; 2],
}

impl Track {
    fn part(self, from: f64, to: f64) -> Self {
        let at = |u: f64| {
            (
                self.ends[0].lerp(self.ends[1], u),
                self.travels[0] + u * (self.travels[1] - self.travels[0]),
            )
        };
        let (p, q) = (at(from), at(to));
        Self {
            ends: [p.0, q.0],
            travels: [p.1, q.1],
        }
    }
}

impl Passage<'_> {
    /// Raises `best` to the deepest point of the moving surface: corners at any travel, and edges at the
    /// first.
    ///
    /// `crossings` are the pairs (moving, fixed) of triangles that touch at any travel, sorted. `near` are
    /// the moving triangles that may be inside.
    pub fn deepen(&self, near: &[u32], crossings: &[(u32, u32)], best: &mut Deepest) {
        let mut tracks: Vec<(Pair, Track, &[Pair])> = Vec::new();
        for of_face in crossings.chunk_by(|x, y| x.0 == y.0) {
            tracks.extend(
                self.tracks(of_face[0].0)
                    .map(|(name, track)| (name, track, of_face)),
            );
        }
        for face in self.find_faces_inside(near, crossings) {
            tracks.extend(self.tracks(face).map(|(name, track)| (name, track, &[][..])));
        }
        // Each triangle of an edge finds the same track, with the same crossings; one is enough.
        tracks.sort_by_key(|t| t.0);
        tracks.dedup_by_key(|t| t.0);
        for (_, track, crossed) in tracks {
            for part in self.parts_inside(track, crossed) {
                self.dive(part, best);
            }
        }
    }

    /// Tracks of a triangle: paths of its three corners, named by the corner twice, and its edges at the
    /// first travel, named by their ends.
    fn tracks(&self, face: u32) -> impl Iterator<Item = ((u32, u32), Track)> {
        let mesh = self.mover.solid.mesh();
        let t = mesh.triangles[face as usize];
        let [from, far] = self.travels;
        let at = move |v: u32, travel: f64| mesh.points[v as usize] + travel * self.along;
        let paths = t.map(|v| {
            (
                (v, v),
                Track {
                    ends: [at(v, from), at(v, far)],
                    travels: [from, far],
                },
            )
        });
        let sides = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].map(|(v, w)| {
            let (v, w) = (v.min(w), v.max(w));
            (
                (v, w),
                Track {
                    ends: [at(v, from), at(w, from)],
                    travels: [from; 2],
                },
            )
        });
        paths.into_iter().filter(move |_| far > from).chain(sides)
    }

    /// Parts of `track` that may be inside, given all triangles that cross it.
    fn parts_inside(&self, track: Track, crossed: &[(u32, u32)]) -> Vec<Track> {
        let mesh = self.obstacle.solid.mesh();
        let [p, q] = track.ends;
        let length_mm = p.distance(q);
        // Places where the track passes the surface, with two flags: inwards, and outwards.
        let mut passed: Vec<(f64, bool, bool)> = crossed
            .iter()
            .filter_map(|&(_, f)| {
                let u = pierced_at(p, q, mesh.corners(f as usize))?;
                let outwards = mesh.double_area_vector(f as usize).dot(q - p) > 0.0;
                Some((u, !outwards, outwards))
            })
            .collect();
        passed.sort_by(|x, y| x.0.total_cmp(&y.0));
        passed.dedup_by(|next, last| {
            let is_same = (next.0 - last.0) * length_mm <= TOUCH_MM;
            if is_same {
                (last.1, last.2) = (last.1 || next.1, last.2 || next.2);
            }
            is_same
        });
        let ends = [(0.0, true, true), (1.0, true, true)];
        let all: Vec<_> = ends[..1]
            .iter()
            .chain(&passed)
            .chain(&ends[1..])
            .copied()
            .collect();
        // The track is outside after a place where it only leaves, and before one where it only enters.
        let may_be_inside =
            |w: &&[(f64, bool, bool)]| w[0].1 && w[1].2 && (w[1].0 - w[0].0) * length_mm > TOUCH_MM;
        all.windows(2)
            .filter(may_be_inside)
            .map(|w| track.part(w[0].0, w[1].0))
            .collect()
    }

    /// Raises `best` to the deepest point of `track`, by branch and bound.
    ///
    /// No point is deeper than its distance to any one triangle. This distance is convex along the track, so
    /// its maximum is at an end.
    fn dive(&self, track: Track, best: &mut Deepest) {
        let mesh = self.obstacle.solid.mesh();
        let mut todo = vec![track];
        while let Some(track) = todo.pop() {
            let [p, q] = track.ends;
            let half_mm = 0.5 * p.distance(q);
            let Some((depth_mm, face)) = self.probe(track.part(0.5, 0.5), best) else {
                continue;
            };
            let triangle = mesh.corners(face as usize);
            let [to_p, to_q] = [p, q].map(|x| nearest_on(triangle, x).distance(x));
            let bound_mm = to_p.max(to_q).min(depth_mm + half_mm);
            if bound_mm <= best.depth_mm + DEPTH_TOLERANCE_MM {
                continue;
            }
            // Along a plane face the deeper end is the deepest point, and the search ends there.
            let end = if to_p > to_q { 0.0 } else { 1.0 };
            self.probe(track.part(end, end), best);
            if bound_mm > best.depth_mm + DEPTH_TOLERANCE_MM {
                todo.extend([track.part(0.5, 1.0), track.part(0.0, 0.5)]);
            }
        }
    }

    /// Depth of a single point, negative outside, and its nearest triangle. Raises `best`.
    ///
    /// Sheets within rounding of each other may cross, and normals there can give the wrong side. A point
    /// that would raise `best`, which is rare, is therefore checked by the winding number of the whole
    /// surface.
    fn probe(&self, point: Track, best: &mut Deepest) -> Option<(f64, u32)> {
        let x = point.ends[0];
        let near = self.obstacle.distance.at(x, f64::INFINITY)?;
        if near.signed_mm <= best.depth_mm {
            return Some((near.signed_mm, near.face));
        }
        if near.signed_mm > TOUCH_MM && winding_number(self.obstacle.solid.mesh(), x) < 0.5 {
            return Some((-near.signed_mm, near.face));
        }
        *best = Deepest {
            depth_mm: near.signed_mm,
            travel_mm: point.travels[0],
            point: x,
            surface: near.point,
        };
        Some((near.signed_mm, near.face))
    }

    /// Triangles of `near` that are inside at every travel. Connected triangles without crossings are all on
    /// one side, so a test of one point decides for all of them.
    fn find_faces_inside(&self, near: &[u32], crossings: &[(u32, u32)]) -> Vec<u32> {
        let mesh = self.mover.solid.mesh();
        let is_free = |f: &u32| crossings.binary_search_by_key(f, |c| c.0).is_err();
        let free: Vec<u32> = near.iter().copied().filter(is_free).collect();
        let mut leader: Vec<u32> = (0..mesh.points.len() as u32).collect();
        for &f in &free {
            let [a, b, c] = mesh.triangles[f as usize].map(|v| led_by(&mut leader, v));
            let least = a.min(b).min(c);
            [a, b, c].into_iter().for_each(|v| leader[v as usize] = least);
        }
        let bounds = self.obstacle.bounds;
        let mut is_inside: Vec<Option<bool>> = vec![None; mesh.points.len()];
        let mut answer = |v: u32| {
            *is_inside[v as usize].get_or_insert_with(|| {
                let x = mesh.points[v as usize] + self.travels[0] * self.along;
                bounds.contains(x)
                    && self
                        .obstacle
                        .distance
                        .at(x, f64::INFINITY)
                        .is_some_and(|d| d.signed_mm > 0.0)
            })
        };
        free.into_iter()
            .filter(|&f| answer(led_by(&mut leader, mesh.triangles[f as usize][0])))
            .collect()
    }
}

/// Finds the leader of `v`'s group, and shortens the path to it.
fn led_by(leader: &mut [u32], mut v: u32) -> u32 {
    while leader[v as usize] != v {
        leader[v as usize] = leader[leader[v as usize] as usize];
        v = leader[v as usize];
    }
    v
}

/// Winding number of a closed surface around `q`: 1 inside, 0 outside. [Jacobson2013, eq. 5], after
/// [VanOosterom1983].
fn winding_number(mesh: &TriMesh, q: Vec3) -> f64 {
    let half_angles = (0..mesh.triangles.len()).map(|f| {
        let [a, b, c] = mesh.corners(f).map(|p| p - q);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        a.dot(b.cross(c)).atan2(denominator)
    });
    half_angles.sum::<f64>() / std::f64::consts::TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Solid;
    use crate::samples::cuboid;

    #[test]
    fn a_surface_winds_once_around_what_is_inside() {
        let cube = cuboid(Vec3::ZERO, Vec3::ONE).to_mesh();
        assert!((winding_number(&cube, Vec3::new(0.1, 0.7, 0.9)) - 1.0).abs() < 1e-12);
        assert!(winding_number(&cube, Vec3::new(1.1, 0.7, 0.9)).abs() < 1e-12);
    }

    #[test]
    fn a_flap_turned_inside_out_does_not_make_the_outside_deep() {
        // The flap over the cube is as thin as rounding. Points above and below it are outside, although its
        // normals may say otherwise.
        let mut mesh = cuboid([0.0; 3], [4.0; 3]).to_mesh();
        let flap = cuboid([1.0, 1.0, 4.5], [3.0, 3.0, 4.5 + 1e-7]).to_mesh();
        let first = mesh.points.len() as u32;
        mesh.points.extend(&flap.points);
        mesh.triangles.extend(
            flap.triangles
                .iter()
                .map(|t| [t[0] + first, t[2] + first, t[1] + first]),
        );
        let fixed = Shape::new(&Solid::new(mesh).unwrap());
        let above = Vec3::new(2.0, 2.1, 4.9);
        assert!(
            fixed.distance.at(above, 1.0).unwrap().signed_mm > 0.3,
            "normals alone are wrong here"
        );
        let passage = Passage {
            mover: &fixed,
            obstacle: &fixed,
            along: Vec3::X,
            travels: [0.0, 1.0],
        };
        let mut best = Deepest::default();
        passage.dive(
            Track {
                ends: [above - 0.7 * Vec3::Z, above],
                travels: [0.0; 2],
            },
            &mut best,
        );
        assert!(best.depth_mm < 1e-6, "{best:?}");
    }

    #[test]
    fn depth_along_a_track_is_that_of_dense_samples() {
        // An L-shaped body: the deepest point of its diagonal is neither an end nor the midpoint.
        let solid = cuboid([0.0; 3], [6.0, 2.0, 3.0]).union(&cuboid([0.0; 3], [2.0, 5.0, 3.0]));
        let fixed = Shape::new(&Solid::new(solid.to_mesh()).unwrap());
        let passage = Passage {
            mover: &fixed,
            obstacle: &fixed,
            along: Vec3::X,
            travels: [0.0, 1.0],
        };
        let ends = [Vec3::new(0.2, -1.0, 1.7), Vec3::new(1.9, 4.9, 0.8)];
        let track = Track {
            ends,
            travels: [3.0, 4.0],
        };
        let mut best = Deepest::default();
        passage.dive(track, &mut best);
        let depth = |u: f64| {
            fixed
                .distance
                .at(ends[0].lerp(ends[1], u), f64::INFINITY)
                .unwrap()
                .signed_mm
        };
        let sampled = (0..=20_000)
            .map(|i| depth(f64::from(i) / 20_000.0))
            .fold(0.0, f64::max);
        assert!(
            best.depth_mm <= sampled + 4e-4 && sampled <= best.depth_mm + DEPTH_TOLERANCE_MM,
            "{best:?} {sampled}"
        );
        assert!((best.point - ends[0].lerp(ends[1], best.travel_mm - 3.0)).length() < 1e-12);
        assert!((best.surface.distance(best.point) - best.depth_mm).abs() < 1e-12);
    }
}
