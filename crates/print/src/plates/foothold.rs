//! Foothold of a posed piece: what its first layer covers of the plate.

use shellock_geom::{TriMesh, Vec3};

use super::orient::Axes;

/// Least area by which a filament print holds on to the plate, mm²: about eight millimetres square.
const LEAST_MM2: f64 = 60.0;
/// Number of directions in which the reach of a foothold is measured.
const N_SIDES: u32 = 24;

/// The section of a piece at the top of its first layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Foothold {
    /// Area of the section, mm².
    pub area_mm2: f64,
    /// Distance of the centre of mass from the edge of the section's convex hull, mm; negative if the centre
    /// of mass is not above the hull.
    pub inside_mm: f64,
}

impl Foothold {
    /// Measures the foothold of a closed `mesh` in a pose with the given axes. Its lowest point is at the
    /// height `lowest_mm`, a layer is `layer_mm` high, and `middle` is the mesh's centre of mass.
    ///
    /// The hull is measured in 24 directions, so `inside_mm` is too large by 1 % of the hull's width at most.
    pub fn of(mesh: &TriMesh, [x, y, up]: Axes, [lowest_mm, layer_mm]: [f64; 2], middle: Vec3) -> Self {
        let heights: Vec<f64> = mesh
            .points
            .iter()
            .map(|p| p.dot(up) - lowest_mm - layer_mm)
            .collect();
        let mut double_mm2 = 0.0;
        let mut reach_mm = [f64::NEG_INFINITY; N_SIDES as usize];
        for t in &mesh.triangles {
            let h = t.map(|v| heights[v as usize]);
            let Some([from, to]) = crossing(mesh, *t, h) else {
                continue;
            };
            let [p, q] = [from, to].map(|at| [(at - middle).dot(x), (at - middle).dot(y)]);
            double_mm2 += p[0] * q[1] - p[1] * q[0];
            for (i, reach) in reach_mm.iter_mut().enumerate() {
                let (sin, cos) = (i as f64 * std::f64::consts::TAU / f64::from(N_SIDES)).sin_cos();
                *reach = reach.max(p[0] * cos + p[1] * sin);
            }
        }
        Self {
            area_mm2: 0.5 * double_mm2,
            inside_mm: reach_mm.into_iter().fold(f64::INFINITY, f64::min),
        }
    }

    /// Returns true if a filament print holds on to the plate by itself.
    pub fn is_enough(self) -> bool {
        self.area_mm2 >= LEAST_MM2 && self.inside_mm >= 0.0
    }
}

/// Crossing of a triangle with the plane of height zero, `None` if there is none. Seen from above, the solid
/// lies on its left.
fn crossing(mesh: &TriMesh, t: [u32; 3], h: [f64; 3]) -> Option<[Vec3; 2]> {
    let is_above = h.map(|h| h > 0.0);
    // The corner that is alone on its side of the plane.
    let alone =
        (0..3).find(|&i| is_above[i] != is_above[(i + 1) % 3] && is_above[i] != is_above[(i + 2) % 3])?;
    let on_edge = |j: usize| {
        let [a, b] = [alone, j].map(|k| mesh.points[t[k] as usize]);
        a + h[alone] / (h[alone] - h[j]) * (b - a)
    };
    let (next, last) = (on_edge((alone + 1) % 3), on_edge((alone + 2) % 3));
    Some(if is_above[alone] {
        [next, last]
    } else {
        [last, next]
    })
}

#[cfg(test)]
mod tests {
    use shellock_testkit::shapes::{contoured_ball, cuboid};

    use super::*;

    const AXES: Axes = [Vec3::X, Vec3::Y, Vec3::Z];

    fn of(mesh: &TriMesh, middle: Vec3) -> Foothold {
        Foothold::of(mesh, AXES, [mesh.bounds().min.z, 0.2], middle)
    }

    #[test]
    fn a_foothold_is_the_section_at_the_top_of_the_first_layer() {
        // Two feet of 5 × 4 mm under a table whose middle is 3 mm from the outer edge of the feet.
        let feet = [0.0, 20.0].map(|x| cuboid([x, 0.0, 0.0], [x + 5.0, 4.0, 10.0]));
        let table = cuboid([0.0, 0.0, 9.0], [25.0, 4.0, 12.0]);
        let mesh = feet[0].union(&feet[1]).union(&table).to_mesh();
        let foothold = of(&mesh, Vec3::new(12.5, 3.0, 10.0));
        assert!((foothold.area_mm2 - 40.0).abs() < 1e-9, "{foothold:?}");
        assert!((foothold.inside_mm - 1.0).abs() < 1e-9, "{foothold:?}");
        assert!(of(&mesh, Vec3::new(12.5, 6.0, 10.0)).inside_mm < 0.0);
        // In any frame.
        let turned = mesh.points.iter().map(|p| Vec3::new(p.y, p.z, p.x)).collect();
        let turned = TriMesh {
            points: turned,
            triangles: mesh.triangles.clone(),
        };
        let axes = [Vec3::Z, Vec3::X, Vec3::Y];
        let same = Foothold::of(&turned, axes, [0.0, 0.2], Vec3::new(3.0, 10.0, 12.5));
        assert!(
            (same.area_mm2 - foothold.area_mm2).abs() < 1e-9
                && (same.inside_mm - foothold.inside_mm).abs() < 1e-9
        );
    }

    #[test]
    fn a_ball_needs_a_raft_and_a_brick_does_not() {
        // A ball of radius r stands on a cap: 2π r h − π h².
        let ball = contoured_ball(20.0, 0.5);
        let cap_mm2 = std::f64::consts::PI * (2.0 * 20.0 * 0.2 - 0.04);
        let foothold = of(&ball, Vec3::ZERO);
        assert!((foothold.area_mm2 / cap_mm2 - 1.0).abs() < 0.1, "{foothold:?}");
        assert!(!foothold.is_enough());
        let brick = cuboid([0.0; 3], [10.0, 8.0, 30.0]).to_mesh();
        assert!(of(&brick, Vec3::new(5.0, 4.0, 15.0)).is_enough());
    }
}
