//! Removal of caps: flat triangles whose middle corner lies almost on their longest edge.
//!
//! No collapse removes a cap without moving the surface along. Flipping its longest edge joins it with the
//! triangle beyond: the two share the other diagonal afterwards. The surface moves by the cap's height at
//! most.

use super::{Decimation, HalfEdge, LEAST_COS, prev, shape_of};
use crate::Vec3;
use crate::topology::Topology;

/// Height of a cap, as a share of its longest edge. Flatter triangles are flipped.
const CAP_HEIGHT: f64 = 0.1;

impl Decimation {
    /// Flips the longest edges of caps that are no higher than the tolerance, where that leaves better
    /// triangles.
    pub(super) fn flip_caps(&mut self) {
        for face in 0..self.is_dead.len() as u32 {
            if self.is_dead[face as usize] {
                continue;
            }
            let h = self.longest_edge(face);
            if self.may_flip(h) {
                self.flip(h);
            }
        }
    }

    fn longest_edge(&self, face: u32) -> HalfEdge {
        let length_sq = |h: HalfEdge| {
            let [u, v] = self.ends(h).map(|x| self.points[x as usize]);
            u.distance_squared(v)
        };
        let edges = [3 * face, 3 * face + 1, 3 * face + 2];
        let longest = |a: HalfEdge, b: HalfEdge| if length_sq(b) > length_sq(a) { b } else { a };
        edges
            .into_iter()
            .reduce(longest)
            .expect("a triangle has three edges")
    }

    /// Ends of an edge, and the corners across it on either side.
    fn diamond(&self, h: HalfEdge) -> [u32; 4] {
        let [u, v] = self.ends(h);
        let across = [h, self.opposite[h as usize]].map(|h| self.start[prev(h) as usize]);
        [u, v, across[0], across[1]]
    }

    fn may_flip(&self, h: HalfEdge) -> bool {
        let [u, v, w, x] = self.diamond(h);
        let limit_mm = [u, v, w]
            .iter()
            .map(|&p| self.tolerance[p as usize])
            .fold(f64::INFINITY, f64::min);
        if limit_mm <= 0.0 || w == x {
            return false;
        }
        let at = |p: u32| self.points[p as usize];
        let doubled = |a: u32, b: u32, c: u32| (at(b) - at(a)).cross(at(c) - at(a));
        let shape = |corners: [u32; 3]| shape_of(corners.map(at));
        let (cap, beyond) = (doubled(u, v, w), doubled(v, u, x));
        let cap_shape = shape([u, v, w]);
        if cap_shape >= CAP_HEIGHT || cap.length() > limit_mm * at(u).distance(at(v)) {
            return false;
        }
        let halves = [(doubled(w, x, v), [w, x, v]), (doubled(x, w, u), [x, w, u])];
        let is_upright = |area: Vec3| beyond.dot(area) > LEAST_COS * beyond.length() * area.length();
        let is_better = halves
            .iter()
            .all(|&(area, corners)| is_upright(area) && shape(corners) > cap_shape);
        let has_edges = [u, v].iter().all(|&p| self.around(p).nth(3).is_some());
        is_better && has_edges && !self.around(w).any(|h| self.ends(h)[1] == x)
    }

    /// Replaces the edge of `h` by the other diagonal of its two triangles.
    fn flip(&mut self, h: HalfEdge) {
        let [u, v, w, x] = self.diamond(h);
        let o = self.opposite[h as usize];
        let [after_h, before_h, after_o, before_o] = [Topology::next(h), prev(h), Topology::next(o), prev(o)];
        // Half-edges beyond the four sides: v to w, w to u, u to x and x to v.
        let beyond = [after_h, before_h, after_o, before_o].map(|side| self.opposite[side as usize]);
        let places = [
            (h, x, o),
            (after_h, w, beyond[1]),
            (before_h, u, beyond[2]),
            (o, w, h),
            (after_o, x, beyond[3]),
            (before_o, v, beyond[0]),
        ];
        for (half_edge, start, opposite) in places {
            self.start[half_edge as usize] = start;
            self.opposite[half_edge as usize] = opposite;
            self.opposite[opposite as usize] = half_edge;
            self.out[start as usize] = half_edge;
        }
    }
}
