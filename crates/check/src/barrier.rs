//! Height that a point can reach before a closed surface stops it, while the point stays within a prism.
//!
//! The prism is open, eight-sided and infinite along a normal. The search starts from a triangle above the
//! point. It crosses every edge that has a part in the prism, to all triangles of that edge. The set found,
//! `S`, ends nowhere within the prism: each of its edges there has an even number of triangles of `S`, as the
//! surface is closed. So the number of sheets of `S` above a place, modulo 2, changes only where a path
//! within the prism crosses `S`. A point that starts with an odd number of sheets above it and crosses no
//! surface keeps an odd number above it. Hence the point never rises above the highest place of `S` in the
//! prism. Crossing more edges than needed does no harm.

use crate::mesh::Mesh;
use crate::vector::{Vec3, add, cross, dot, scale, sub};

/// Number of sides of a prism.
pub const SIDES: usize = 8;
/// Height from which a barrier holds nothing, mm.
pub const MOST_RISE_MM: f64 = 1.0;
/// Greatest number of triangles that a search visits.
const MOST_TRIANGLES: usize = 400;
/// Margin of the box around a ray, mm, for rounding.
const BESIDE_RAY_MM: f64 = 1e-6;

/// Place, normal there and direction across that; the directions are unit vectors.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Place where heights are 0, mm.
    pub origin: Vec3,
    /// Direction in which heights are measured.
    pub normal: Vec3,
    /// Direction of the first side, perpendicular to the normal.
    pub across: Vec3,
}

impl Frame {
    /// Unit vectors towards the sides, each 45° from the one before.
    pub fn sides(&self) -> [Vec3; SIDES] {
        let [u, v] = [self.across, self.up()];
        let slanted = |x: Vec3, y: Vec3| scale(add(x, y), std::f64::consts::FRAC_1_SQRT_2);
        let [minus_u, minus_v] = [u, v].map(|x| scale(x, -1.0));
        [
            u,
            slanted(u, v),
            v,
            slanted(minus_u, v),
            minus_u,
            slanted(minus_u, minus_v),
            minus_v,
            slanted(u, minus_v),
        ]
    }

    fn up(&self) -> Vec3 {
        cross(self.normal, self.across)
    }

    fn height(&self, p: Vec3) -> f64 {
        dot(self.normal, sub(p, self.origin))
    }

    /// Height at which the line through the origin along the normal meets a triangle.
    ///
    /// On each side of a shared edge, the line meets one of the triangles or none. For this, ends are
    /// compared by the same sum whichever triangle asks, and the height comes from the ends that decided.
    fn meets(&self, t: &[Vec3; 3]) -> Option<f64> {
        let flat = t.map(|p| {
            let off = sub(p, self.origin);
            [dot(self.across, off), dot(self.up(), off), self.height(p)]
        });
        let mut crossings = Vec::with_capacity(3);
        for k in 0..3 {
            let (p, q) = (flat[k], flat[(k + 1) % 3]);
            let (low, high) = if p[1] <= q[1] { (p, q) } else { (q, p) };
            if !(low[1] <= 0.0 && high[1] > 0.0) {
                continue;
            }
            let (beside, rise) = (low[0] * high[1] - high[0] * low[1], high[1] - low[1]);
            crossings.push([
                beside,
                beside / rise,
                low[2] - (high[2] - low[2]) * (low[1] / rise),
            ]);
        }
        let [[p, x, from], [q, y, to]] = crossings[..] else {
            return None;
        };
        let share = if x == y {
            0.5
        } else {
            (x / (x - y)).clamp(0.0, 1.0)
        };
        ((p > 0.0) != (q > 0.0)).then_some(from + (to - from) * share)
    }
}

/// Open prism: the points nearer to the line along the normal than each side.
#[derive(Clone, Debug)]
pub struct Prism {
    frame: Frame,
    sides: [Vec3; SIDES],
    far_mm: [f64; SIDES],
}

impl Prism {
    /// Builds a prism with sides `far_mm` from the line, in the order of [`Frame::sides`].
    pub fn new(frame: Frame, far_mm: [f64; SIDES]) -> Self {
        Self {
            frame,
            sides: frame.sides(),
            far_mm,
        }
    }

    /// Distance of `p` beyond a side, mm; negative inside.
    fn beyond(&self, side: usize, p: Vec3) -> f64 {
        dot(self.sides[side], sub(p, self.frame.origin)) - self.far_mm[side]
    }

    /// Height of the highest place of a triangle inside the prism; `None` if no part of the triangle is
    /// inside.
    fn highest_mm(&self, t: &[Vec3; 3]) -> Option<f64> {
        let mut polygon = t.to_vec();
        for side in 0..SIDES {
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            for (i, &p) in polygon.iter().enumerate() {
                let q = polygon[(i + 1) % polygon.len()];
                let (from, to) = (self.beyond(side, p), self.beyond(side, q));
                if from < 0.0 {
                    kept.push(p);
                }
                if (from < 0.0) != (to < 0.0) {
                    kept.push(add(p, scale(sub(q, p), from / (from - to))));
                }
            }
            polygon = kept;
        }
        polygon
            .into_iter()
            .map(|p| self.frame.height(p))
            .max_by(f64::total_cmp)
    }

    /// Returns true if a part of the edge from `p` to `q` is inside.
    fn has_part(&self, p: Vec3, q: Vec3) -> bool {
        let mut part = [0.0_f64, 1.0];
        for side in 0..SIDES {
            let (from, to) = (self.beyond(side, p), self.beyond(side, q));
            match (from < 0.0, to < 0.0) {
                (true, true) => {}
                (true, false) => part[1] = part[1].min(from / (from - to)),
                (false, true) => part[0] = part[0].max(from / (from - to)),
                (false, false) => return false,
            }
        }
        part[0] < part[1]
    }
}

/// Connected part of a surface within a prism.
#[derive(Debug)]
struct Flooded {
    highest_mm: f64,
    /// Number of times that the line along the normal meets the part above the origin.
    n_above: usize,
}

/// Collects everything connected with triangle `first` within `prism`. An error if that is too much or not
/// lower than `most_mm`.
fn flood(mesh: &Mesh, first: usize, prism: &Prism, most_mm: f64) -> Result<Flooded, String> {
    let mut flooded = Flooded {
        highest_mm: f64::NEG_INFINITY,
        n_above: 0,
    };
    let (mut found, mut next) = (vec![first], 0);
    while let Some(&t) = found.get(next) {
        next += 1;
        let corners = &mesh.triangles[t];
        let Some(highest_mm) = prism.highest_mm(corners) else {
            continue;
        };
        flooded.highest_mm = flooded.highest_mm.max(highest_mm);
        flooded.n_above += usize::from(prism.frame.meets(corners).is_some_and(|height| height > 0.0));
        if flooded.highest_mm >= most_mm {
            return Err(format!("a surface goes on to {:.2} mm above", flooded.highest_mm));
        }
        for k in (0..3).filter(|&k| prism.has_part(corners[k], corners[(k + 1) % 3])) {
            for other in mesh.triangles_at_edge(t, k) {
                if !found.contains(&other) {
                    found.push(other);
                }
            }
        }
        if found.len() > MOST_TRIANGLES {
            return Err(format!("more than {MOST_TRIANGLES} triangles are above"));
        }
    }
    if flooded.highest_mm.is_finite() {
        Ok(flooded)
    } else {
        Err("no surface is there".into())
    }
}

/// Height of the barrier that `mesh` forms above a point at the prism's origin, mm. The point cannot rise
/// higher while it stays within the prism.
pub fn rise_mm(mesh: &Mesh, prism: &Prism) -> Result<f64, String> {
    let (from, to) = (
        prism.frame.origin,
        add(prism.frame.origin, scale(prism.frame.normal, MOST_RISE_MM)),
    );
    let low = std::array::from_fn(|k| from[k].min(to[k]) - BESIDE_RAY_MM);
    let high = std::array::from_fn(|k| from[k].max(to[k]) + BESIDE_RAY_MM);
    let mut above: Option<(usize, f64)> = None;
    for t in mesh.in_box(low, high) {
        let height = prism
            .frame
            .meets(&mesh.triangles[t])
            .filter(|height| *height > 0.0 && *height <= MOST_RISE_MM);
        above = match (above, height) {
            (Some(least), Some(height)) if least.1 <= height => Some(least),
            (least, height) => height.map(|height| (t, height)).or(least),
        };
    }
    let Some((first, height)) = above else {
        return Err("nothing is above".into());
    };
    let [a, b, c] = mesh.triangles[first];
    // A point inside the other piece has its surface from inside above it: that stops nothing.
    if dot(cross(sub(b, a), sub(c, a)), prism.frame.normal) >= 0.0 {
        return Err("what is above does not face the point".into());
    }
    let flooded = flood(mesh, first, prism, MOST_RISE_MM)?;
    match flooded.n_above % 2 {
        1 if flooded.highest_mm >= height * (1.0 - 1e-9) => Ok(flooded.highest_mm),
        _ => Err(format!("{} sheets are above", flooded.n_above)),
    }
}

/// Returns true if everything connected with triangle `first` within the prism stays lower than `most_mm`.
pub fn stays_below(mesh: &Mesh, first: usize, prism: &Prism, most_mm: f64) -> bool {
    flood(mesh, first, prism, most_mm).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::cuboid;

    const UP: Frame = Frame {
        origin: [0.0, 0.0123, 0.0],
        normal: [0.0, 0.0, 1.0],
        across: [1.0, 0.0, 0.0],
    };

    /// Prism with equal distances to all sides, around a point that is `sideways` along x.
    fn around(sideways: f64, far_mm: f64) -> Prism {
        Prism::new(
            Frame {
                origin: [sideways, 0.0123, 0.0],
                ..UP
            },
            [far_mm; SIDES],
        )
    }

    fn is_near(found: Result<f64, String>, expected_mm: f64) -> bool {
        found.is_ok_and(|mm| (mm - expected_mm).abs() < 1e-12)
    }

    /// Closed surface below `top_mm`, with a lower side that follows points (x, z), from y −2 to y 2.
    fn roof(profile: &[[f64; 2]], top_mm: f64) -> Mesh {
        let mut outline = profile.to_vec();
        outline.extend(profile.iter().rev().map(|&[x, _]| [x, top_mm]));
        let at = |[x, z]: [f64; 2], y: f64| [x, y, z];
        let n = outline.len();
        let mut triangles = Vec::new();
        for i in 0..n {
            let (p, q) = (outline[i], outline[(i + 1) % n]);
            triangles.extend([
                [at(p, -2.0), at(q, -2.0), at(q, 2.0)],
                [at(p, -2.0), at(q, 2.0), at(p, 2.0)],
            ]);
        }
        for i in 0..profile.len() - 1 {
            let [p, q, r, s] = [outline[i], outline[i + 1], outline[n - 2 - i], outline[n - 1 - i]];
            for (y, is_front) in [(-2.0, true), (2.0, false)] {
                for [a, b, c] in [[p, q, r], [p, r, s]].map(|t| t.map(|p| at(p, y))) {
                    triangles.push(if is_front { [a, c, b] } else { [a, b, c] });
                }
            }
        }
        let roof = Mesh::new(triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect());
        assert_eq!(roof.n_open_edges(), 0);
        roof
    }

    /// Wedge below the point. With a frame that is perpendicular to 1e-9 only, a version that computed hits
    /// and heights from different directions placed it above.
    #[test]
    fn a_height_is_told_by_the_ends_that_decide_the_hit() {
        let frame = Frame {
            origin: [3e-10, 0.0, 0.0],
            normal: [-4e-10, 0.0, 1.0],
            across: [1.0, 0.0, -5e-10],
        };
        let wedge =
            [[12.5, -1.0, -2.0], [12.5, 1.0, -2.0], [12.5, 1.0, 0.9]].map(|[x, y, z]| [x - 12.5, y, z]);
        assert!(frame.meets(&wedge).is_none_or(|height| height < 0.0));
    }

    #[test]
    fn a_flat_roof_stops_a_point_at_its_height_as_far_as_it_reaches() {
        let high = cuboid([-2.0, -2.0, 0.3], [2.0, 2.0, 8.0]);
        assert!(is_near(rise_mm(&high, &around(0.0, 1.9)), 0.3));
        assert!(is_near(rise_mm(&high, &around(1.0, 0.99)), 0.3));
        assert!(
            rise_mm(&high, &around(1.0, 1.01)).is_err(),
            "beside it a point rises to the top"
        );
        let low = cuboid([-2.0, -2.0, 0.3], [2.0, 2.0, 0.9]);
        assert!(
            rise_mm(&low, &around(1.0, 1.01)).is_err(),
            "beside a low one, too"
        );
        let far = cuboid([-2.0, -2.0, 1.1], [2.0, 2.0, 8.0]);
        assert!(rise_mm(&far, &around(0.0, 0.5)).is_err(), "too far above");
    }

    #[test]
    fn a_step_or_a_pit_counts_only_where_it_is_reached() {
        let step = roof(&[[-2.0, 0.3], [0.5, 0.3], [0.5, 0.4], [2.0, 0.4]], 8.0);
        assert!(is_near(rise_mm(&step, &around(0.0, 0.49)), 0.3));
        assert!(is_near(rise_mm(&step, &around(0.0, 0.51)), 0.4));
        let mut far_mm = [0.51; SIDES];
        far_mm[0] = 0.49;
        assert!(
            is_near(rise_mm(&step, &Prism::new(UP, far_mm)), 0.3),
            "that side alone is near"
        );
        let pit = |deep_mm: f64| {
            let z = 0.3 + deep_mm;
            roof(
                &[
                    [-2.0, 0.3],
                    [0.5, 0.3],
                    [0.5, z],
                    [0.7, z],
                    [0.7, 0.3],
                    [2.0, 0.3],
                ],
                8.0,
            )
        };
        assert!(is_near(rise_mm(&pit(0.2), &around(0.0, 0.6)), 0.5));
        assert!(is_near(rise_mm(&pit(2.0), &around(0.0, 0.49)), 0.3));
        assert!(rise_mm(&pit(2.0), &around(0.0, 0.6)).is_err(), "too deep a pit");
    }

    #[test]
    fn a_slope_is_as_high_as_its_highest_place_within() {
        let slope = roof(&[[-2.0, -1.5], [2.0, 2.5]], 8.0);
        for far_mm in [0.1, 0.3, 0.45] {
            assert!(is_near(rise_mm(&slope, &around(0.0, far_mm)), 0.5 + far_mm));
        }
    }

    #[test]
    fn the_top_of_a_solid_is_no_barrier_for_what_is_above_it_or_in_a_shell() {
        let below = cuboid([-2.0, -2.0, -3.0], [2.0, 2.0, -1.0]);
        assert!(rise_mm(&below, &around(0.0, 0.5)).is_err(), "nothing is above");
        let thin = cuboid([-0.4, -2.0, 0.3], [0.4, 2.0, 0.5]);
        assert!(
            rise_mm(&thin, &around(0.0, 0.5)).is_err(),
            "two sheets: the point passes beside"
        );
        assert!(is_near(rise_mm(&thin, &around(0.0, 0.39)), 0.3));
        // The search from the triangle below reaches a top whose edges are inside.
        let first = (0..12)
            .find(|&t| below.triangles[t].iter().all(|p| p[2] == -1.0))
            .unwrap();
        assert_eq!(flood(&below, first, &around(0.0, 0.5), 1.0).unwrap().n_above, 0);
    }

    #[test]
    fn a_triangle_is_clipped_to_the_prism() {
        let large = [[-9.0, -9.0, 1.0], [9.0, -9.0, 1.0], [0.0, 18.0, 1.0]];
        assert_eq!(
            around(0.0, 0.5).highest_mm(&large),
            Some(1.0),
            "larger than the prism, no edge within"
        );
        assert!(!around(0.0, 0.5).has_part(large[0], large[1]));
        let steep = [[0.0, 0.0, 0.0], [1.0, 0.0, 2.0], [0.0, 0.01, 0.0]];
        assert!((around(0.0, 0.25).highest_mm(&steep).unwrap() - 0.5).abs() < 1e-12);
        assert!(around(0.0, 0.25).has_part(steep[0], steep[1]));
        let wall = [[0.2, -1.0, -1.0], [0.2, 1.0, -1.0], [0.2, 0.0, 0.6]];
        assert!(
            (around(0.0, 0.25).highest_mm(&wall).unwrap() - 0.6).abs() < 1e-12,
            "parallel to the normal"
        );
        assert_eq!(around(0.0, 0.15).highest_mm(&wall), None);
        assert!(
            !around(0.0, 0.25).has_part([0.4, 0.0, 0.0], [0.0, 0.4123, 0.0]),
            "beyond a slanted side"
        );
        assert!(around(0.0, 0.29).has_part([0.4, 0.0123, 0.0], [0.0, 0.4123, 0.0]));
    }

    #[test]
    fn a_line_meets_one_of_the_triangles_around_a_point_or_an_edge() {
        let ring: Vec<Vec3> = (0..6)
            .map(f64::from)
            .map(|a| [a.cos(), a.sin() + 0.0123, 0.5])
            .collect();
        let fan = (0..6).map(|i| [[0.0, 0.0123, 0.5], ring[i], ring[(i + 1) % 6]]);
        assert_eq!(fan.filter(|t| UP.meets(t).is_some()).count(), 1);
    }
}
