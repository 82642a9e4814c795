//! Least distance of two triangles, at rest or over all travels of one along z.

use super::TOUCH_MM;
use crate::bvh::nearest_on_triangle;
use crate::{Aabb, Vec3};

/// Nearest approach of two triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Approach {
    /// Squared least distance, mm².
    pub distance_sq: f64,
    /// Travel of the first triangle at which the distance is least, mm.
    pub travel_mm: f64,
    /// Point on the first triangle at that travel.
    pub on_a: Vec3,
    /// Point on the second triangle.
    pub on_b: Vec3,
}

impl Approach {
    const NONE: Self = Self {
        distance_sq: f64::INFINITY,
        travel_mm: 0.0,
        on_a: Vec3::ZERO,
        on_b: Vec3::ZERO,
    };

    fn between(on_a: Vec3, on_b: Vec3) -> Self {
        Self {
            distance_sq: on_a.distance_squared(on_b),
            travel_mm: 0.0,
            on_a,
            on_b,
        }
    }

    fn nearer(self, other: Self) -> Self {
        if other.distance_sq < self.distance_sq {
            other
        } else {
            self
        }
    }
}

/// Least distance of `a + t·z` to `b` over `t` in `[from, far]`; `None` if it exceeds `√limit_sq`.
///
/// The distance is convex in `t` and at least the distance of the two shadows along z. Any `t` that attains
/// the shadows' distance is therefore a minimum. If that `t` is outside the travels, the nearer end of these
/// is the minimum.
pub(super) fn swept(a: [Vec3; 3], b: [Vec3; 3], [from, far]: [f64; 2], limit_sq: f64) -> Option<Approach> {
    let free = if from == far {
        None
    } else {
        Some(between_shadows(a, b))
    };
    let free_mm = free.map_or(from, |f| f.on_b.z - f.on_a.z);
    let travel_mm = free_mm.max(from).min(far);
    let best = match free {
        Some(free) if free.distance_sq > limit_sq => return None,
        Some(free) if travel_mm == free_mm => Approach {
            on_a: free.on_a.with_z(free.on_b.z),
            ..free
        },
        _ => at_rest(a.map(|p| p + travel_mm * Vec3::Z), b, limit_sq)?,
    };
    (best.distance_sq <= limit_sq).then_some(Approach { travel_mm, ..best })
}

/// Least distance of the shadows along z, and one pair of points that attains it.
fn between_shadows(a: [Vec3; 3], b: [Vec3; 3]) -> Approach {
    let flat = |p: Vec3| p.with_z(0.0);
    let touch = |on_a: Vec3, on_b: Vec3| Approach {
        distance_sq: 0.0,
        travel_mm: 0.0,
        on_a,
        on_b,
    };
    for p in a {
        if let Some(z) = height_over(b, p) {
            return touch(p, p.with_z(z));
        }
    }
    for q in b {
        if let Some(z) = height_over(a, q) {
            return touch(q.with_z(z), q);
        }
    }
    let mut best = Approach::NONE;
    for (p, q) in edges(a) {
        for (r, s) in edges(b) {
            if let Some((u, v)) = flat_crossing(p, q, r, s) {
                return touch(p.lerp(q, u), r.lerp(s, v));
            }
            for x in [p, q] {
                let on_b = r.lerp(s, nearest_parameter(flat(r), flat(s), flat(x)));
                let distance_sq = flat(x).distance_squared(flat(on_b));
                best = best.nearer(Approach {
                    distance_sq,
                    ..Approach::between(x, on_b)
                });
            }
            for y in [r, s] {
                let on_a = p.lerp(q, nearest_parameter(flat(p), flat(q), flat(y)));
                let distance_sq = flat(y).distance_squared(flat(on_a));
                best = best.nearer(Approach {
                    distance_sq,
                    ..Approach::between(on_a, y)
                });
            }
        }
    }
    best
}

/// Least distance of two triangles, 0 where they meet; `None` if it exceeds `√limit_sq`.
pub(super) fn at_rest(a: [Vec3; 3], b: [Vec3; 3], limit_sq: f64) -> Option<Approach> {
    let apart_sq = plane_gap_sq(a, b).max(plane_gap_sq(b, a));
    if apart_sq > limit_sq {
        return None;
    }
    if apart_sq == 0.0 {
        let through = |(p, q): (Vec3, Vec3), t| pierced_at(p, q, t).map(|u| p.lerp(q, u));
        let met = edges(a).into_iter().find_map(|e| through(e, b));
        if let Some(x) = met.or_else(|| edges(b).into_iter().find_map(|e| through(e, a))) {
            return Some(Approach::between(x, x));
        }
    }
    let mut best = Approach::NONE;
    for p in a {
        best = best.nearer(Approach::between(p, nearest_on(b, p)));
    }
    for q in b {
        best = best.nearer(Approach::between(nearest_on(a, q), q));
    }
    for (p, q) in edges(a) {
        for (r, s) in edges(b) {
            if let Some((on_a, on_b)) = inner_approach(p, q, r, s) {
                best = best.nearer(Approach::between(on_a, on_b));
            }
        }
    }
    (best.distance_sq <= limit_sq).then_some(best)
}

/// Point of a triangle nearest to `q`; on its edges if the triangle has no area.
pub(super) fn nearest_on(t: [Vec3; 3], q: Vec3) -> Vec3 {
    let longest_sq = edges(t)
        .iter()
        .map(|(p, q)| p.distance_squared(*q))
        .fold(0.0, f64::max);
    let doubled_area_sq = (t[1] - t[0]).cross(t[2] - t[0]).length_squared();
    if doubled_area_sq > FLAT * longest_sq * longest_sq {
        return nearest_on_triangle(t, q).0;
    }
    let on_edges = edges(t).map(|(a, b)| a.lerp(b, nearest_parameter(a, b, q)));
    on_edges
        .into_iter()
        .min_by(|x, y| x.distance_squared(q).total_cmp(&y.distance_squared(q)))
        .unwrap_or(t[0])
}

/// Parameter `u` in [0, 1] at which segment `pq` passes through triangle `t`. The triangle is minimally
/// enlarged, so that no segment slips between two triangles. A segment in the triangle's plane does not
/// count.
pub(super) fn pierced_at(p: Vec3, q: Vec3, [a, b, c]: [Vec3; 3]) -> Option<f64> {
    let n = (b - a).cross(c - a);
    let (above_p, above_q) = (n.dot(p - a), n.dot(q - a));
    if above_p * above_q > 0.0 || above_p == above_q {
        return None;
    }
    let u = above_p / (above_p - above_q);
    let x = p.lerp(q, u);
    let least = -EDGE_SLACK * n.length_squared();
    let is_within = [(a, b), (b, c), (c, a)]
        .into_iter()
        .all(|(r, s)| (s - r).cross(x - r).dot(n) >= least);
    (is_within && n != Vec3::ZERO).then_some(u)
}

/// Squared sine below which a triangle counts as having no area.
const FLAT: f64 = 1e-24;
/// Distance outside a triangle at which a segment still counts as piercing it, in barycentric coordinates.
const EDGE_SLACK: f64 = 1e-9;

/// The three edges of a triangle.
pub(super) fn edges([a, b, c]: [Vec3; 3]) -> [(Vec3, Vec3); 3] {
    [(a, b), (b, c), (c, a)]
}

/// Bounding box of a triangle moved by all travels.
pub(super) fn swept_box(t: [Vec3; 3], [from, far]: [f64; 2]) -> Aabb {
    sweep_box(Aabb::around(t), [from, far])
}

/// Bounding box of a box moved along z by all travels.
pub(super) fn sweep_box(b: Aabb, [from, far]: [f64; 2]) -> Aabb {
    Aabb {
        min: b.min + from * Vec3::Z,
        max: b.max + far * Vec3::Z,
    }
}

/// Squared distance of two boxes, mm².
pub(super) fn box_distance_sq(a: Aabb, b: Aabb) -> f64 {
    (b.min - a.max)
        .max(a.min - b.max)
        .max(Vec3::ZERO)
        .length_squared()
}

/// Squared distance of `a` from the plane of `b`; 0 if `a` crosses the plane or `b` has none.
fn plane_gap_sq(a: [Vec3; 3], b: [Vec3; 3]) -> f64 {
    let n = (b[1] - b[0]).cross(b[2] - b[0]);
    let above = a.map(|p| n.dot(p - b[0]));
    let (low, high) = (
        above[0].min(above[1]).min(above[2]),
        above[0].max(above[1]).max(above[2]),
    );
    let least = low.max(-high);
    if least > 0.0 {
        least * least / n.length_squared()
    } else {
        0.0
    }
}

/// Height at which the vertical line through `p` meets triangle `t`; `None` if it misses the triangle, or if
/// that is vertical.
fn height_over([a, b, c]: [Vec3; 3], p: Vec3) -> Option<f64> {
    let cross = |u: Vec3, v: Vec3| u.x * v.y - u.y * v.x;
    let (wa, wb, wc) = (cross(b - p, c - p), cross(c - p, a - p), cross(a - p, b - p));
    let doubled_area = wa + wb + wc;
    let is_over = (wa >= 0.0 && wb >= 0.0 && wc >= 0.0) || (wa <= 0.0 && wb <= 0.0 && wc <= 0.0);
    let longest_sq = edges([a, b, c])
        .iter()
        .map(|(p, q)| (*p - *q).truncate().length_squared())
        .fold(0.0, f64::max);
    let is_wide = doubled_area * doubled_area > FLAT * longest_sq * longest_sq;
    let over = (is_over && is_wide).then(|| (wa * a + wb * b + wc * c) / doubled_area);
    // For a triangle that is vertical up to rounding, signs and weights are meaningless.
    over.filter(|x| is_same_shadow(*x, p)).map(|x| x.z)
}

/// Returns true if two points coincide as seen along z, up to rounding of coordinates.
fn is_same_shadow(p: Vec3, q: Vec3) -> bool {
    (p - q).truncate().length_squared() <= TOUCH_MM * TOUCH_MM
}

/// Parameters on `pq` and `rs` at which their shadows along z cross.
fn flat_crossing(p: Vec3, q: Vec3, r: Vec3, s: Vec3) -> Option<(f64, f64)> {
    let cross = |u: Vec3, v: Vec3| u.x * v.y - u.y * v.x;
    let (p_side, q_side) = (cross(s - r, p - r), cross(s - r, q - r));
    let (r_side, s_side) = (cross(q - p, r - p), cross(q - p, s - p));
    let is_crossing = p_side * q_side < 0.0 && r_side * s_side < 0.0;
    let crossing = is_crossing.then(|| (p_side / (p_side - q_side), r_side / (r_side - s_side)));
    // Shadows that are collinear up to rounding seem to cross anywhere.
    crossing.filter(|&(u, v)| is_same_shadow(p.lerp(q, u), r.lerp(s, v)))
}

/// Parameter in [0, 1] of the point of `ab` nearest to `q`; 0 if both ends coincide.
fn nearest_parameter(a: Vec3, b: Vec3, q: Vec3) -> f64 {
    let (along, length_sq) = ((b - a).dot(q - a), (b - a).length_squared());
    if length_sq > 0.0 {
        (along / length_sq).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// Nearest points of two segments, if both lie between the ends. Other cases are covered by the corners.
/// [Ericson2005, 5.1.9]
fn inner_approach(p: Vec3, q: Vec3, r: Vec3, s: Vec3) -> Option<(Vec3, Vec3)> {
    let (d, e, w) = (q - p, s - r, p - r);
    let (dd, ee, de, dw, ew) = (d.dot(d), e.dot(e), d.dot(e), d.dot(w), e.dot(w));
    let det = dd * ee - de * de;
    let (u, v) = ((de * ew - ee * dw) / det, (dd * ew - de * dw) / det);
    let is_inner = |x: f64| x > 0.0 && x < 1.0;
    (det > 0.0 && is_inner(u) && is_inner(v)).then(|| (p.lerp(q, u), r.lerp(s, v)))
}
