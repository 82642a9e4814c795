//! How far a point can rise before a surface stops it, while it moves sideways by no more than a radius.
//!
//! Let the point start at height 0 on an axis, and let `S` be what of a closed surface hangs together, within
//! the open cylinder of the radius about the axis, with a triangle above the point. Edges within the cylinder
//! have triangles of `S` on both sides, so `S` is a cycle modulo the cylinder's wall: how often a ray upwards
//! meets it is the same, modulo 2, for all places that a path within the cylinder joins without crossing `S`.
//! Where the point meets it an odd number of times, and `S` ends at a height `g`, no such path leads above
//! `g`.
//!
//! ```text
//!        |   ______   |  g: the highest place of S within the cylinder
//!        |__/      \__|
//!        |      p     |  an odd number of sheets of S above p
//!        |<--r->|     |
//! ```
//!
//! Nothing else is asked of the surface: it may be rough, and neither a graph over the disc nor parallel to
//! it.

use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Aabb, TriMesh, Vec3};

/// Triangles of a barrier before it is given up: real ones have some tens.
const MOST_TRIANGLES: usize = 380;
/// Sides of a region.
pub(super) const SIDES: usize = 8;

/// A convex region across an axis, around it: how far each of its sides is from the axis, mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    pub far_mm: [f64; SIDES],
}

impl Region {
    /// As far to every side.
    pub fn of_radius(mm: f64) -> Self {
        Self { far_mm: [mm; SIDES] }
    }

    /// Unit vectors towards the sides.
    fn sides(&self) -> [[f64; 2]; SIDES] {
        const H: f64 = std::f64::consts::FRAC_1_SQRT_2;
        [
            [1.0, 0.0],
            [H, H],
            [0.0, 1.0],
            [-H, H],
            [-1.0, 0.0],
            [-H, -H],
            [0.0, -1.0],
            [H, -H],
        ]
    }
}

/// A closed surface with its triangles' neighbours.
pub(super) struct Surface {
    pub mesh: TriMesh,
    pub tree: TriangleBvh,
    pub bounds: Aabb,
    /// Triangles that share an edge with each, three lists a triangle: `start[3 f + k]..start[3 f + k + 1]`.
    neighbours: Vec<u32>,
    start: Vec<u32>,
}

/// Where a barrier is looked for: heights are along `normal` from `origin`.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    origin: Vec3,
    normal: Vec3,
    across: [Vec3; 2],
}

impl Axis {
    /// `normal` is a unit vector.
    pub fn new(origin: Vec3, normal: Vec3) -> Self {
        let u = normal.any_orthonormal_vector();
        Self {
            origin,
            normal,
            across: [u, normal.cross(u)],
        }
    }

    /// The directions in space of a region's sides.
    pub fn sides(&self) -> [Vec3; SIDES] {
        Region::of_radius(0.0)
            .sides()
            .map(|[x, y]| self.across[0] * x + self.across[1] * y)
    }

    /// Place across the axis, and height.
    fn local(&self, p: Vec3) -> Vec3 {
        let d = p - self.origin;
        Vec3::new(d.dot(self.across[0]), d.dot(self.across[1]), d.dot(self.normal))
    }
}

/// What of a triangle is within a cylinder.
struct Clip {
    highest: f64,
    /// Which edges come into the cylinder.
    edges: [bool; 3],
    /// Height on the axis, where the triangle covers it.
    on_axis: Option<f64>,
}

impl Surface {
    /// `mesh` has one name for each place.
    pub fn new(mesh: &TriMesh) -> Self {
        let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * mesh.triangles.len());
        for (f, t) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                sides.push(([a.min(b), a.max(b)], (3 * f + k) as u32));
            }
        }
        sides.sort_unstable();
        let mut beyond: Vec<(u32, u32)> = Vec::with_capacity(sides.len());
        for edge in sides.chunk_by(|x, y| x.0 == y.0) {
            for &(_, side) in edge {
                beyond.extend(
                    edge.iter()
                        .filter(|other| other.1 != side)
                        .map(|other| (side, other.1 / 3)),
                );
            }
        }
        beyond.sort_unstable();
        let n_sides = 3 * mesh.triangles.len();
        let start = (0..=n_sides as u32)
            .map(|side| beyond.partition_point(|b| b.0 < side) as u32)
            .collect();
        let neighbours = beyond.into_iter().map(|b| b.1).collect();
        Self {
            tree: TriangleBvh::new(mesh),
            bounds: mesh.bounds(),
            mesh: mesh.clone(),
            neighbours,
            start,
        }
    }

    /// The height of the barrier that hangs together with triangle `from`, above the origin, for sideways
    /// moves of up to `radius_mm`; `None` where it ends above `most_mm` or is none.
    pub fn barrier_mm(&self, from: u32, axis: &Axis, region: &Region, most_mm: f64) -> Option<f64> {
        let (highest, n_above) = self.flood(from, axis, region, most_mm)?;
        (n_above % 2 == 1).then_some(highest)
    }

    /// The highest place of what hangs together with triangle `from` within the cylinder, if below `most_mm`.
    pub fn highest_mm(&self, from: u32, axis: &Axis, region: &Region, most_mm: f64) -> Option<f64> {
        self.flood(from, axis, region, most_mm).map(|found| found.0)
    }

    /// Also how many triangles are above the origin.
    fn flood(&self, from: u32, axis: &Axis, region: &Region, most_mm: f64) -> Option<(f64, usize)> {
        let (mut highest, mut n_above) = (f64::NEG_INFINITY, 0);
        let (mut found, mut next) = (vec![from], 0);
        while let Some(&face) = found.get(next) {
            next += 1;
            let corners = self.mesh.corners(face as usize).map(|p| axis.local(p));
            let Some(clip) = clip(corners, region) else {
                continue;
            };
            highest = highest.max(clip.highest);
            n_above += usize::from(clip.on_axis.is_some_and(|height| height > 0.0));
            if highest >= most_mm || found.len() > MOST_TRIANGLES {
                return None;
            }
            for k in (0..3).filter(|&k| clip.edges[k]) {
                let side = 3 * face as usize + k;
                let beyond = &self.neighbours[self.start[side] as usize..self.start[side + 1] as usize];
                beyond.iter().for_each(|&f| {
                    if !found.contains(&f) {
                        found.push(f);
                    }
                });
            }
        }
        highest.is_finite().then_some((highest, n_above))
    }
}

/// What of a triangle, as places across an axis and heights, is within `region`; `None` for nothing.
fn clip(t: [Vec3; 3], region: &Region) -> Option<Clip> {
    let mut polygon: Vec<(Vec3, Option<usize>)> = Vec::with_capacity(3 + SIDES);
    let mut next = Vec::with_capacity(3 + SIDES);
    // Each corner with the edge of the triangle that begins there.
    polygon.extend((0..3).map(|k| (t[k], Some(k))));
    for (side, &far) in region.sides().iter().zip(&region.far_mm) {
        let beyond = |p: Vec3| p.x * side[0] + p.y * side[1] - far;
        next.clear();
        for i in 0..polygon.len() {
            let ((p, edge), (q, _)) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let (from, to) = (beyond(p), beyond(q));
            if from < 0.0 {
                next.push((p, edge));
            }
            if (from < 0.0) != (to < 0.0) {
                let cut = p + (q - p) * (from / (from - to));
                // Going out, the region's side begins here; coming in, the rest of the edge.
                next.push((cut, if from < 0.0 { None } else { edge }));
            }
        }
        std::mem::swap(&mut polygon, &mut next);
        if polygon.is_empty() {
            return None;
        }
    }
    let mut edges = [false; 3];
    polygon
        .iter()
        .filter_map(|(_, edge)| *edge)
        .for_each(|k| edges[k] = true);
    let highest = polygon.iter().map(|(p, _)| p.z).fold(f64::NEG_INFINITY, f64::max);
    let on_axis = covers_axis(t).then(|| height_on_axis(t));
    Some(Clip {
        highest,
        edges,
        on_axis,
    })
}

/// Whether a ray along the axis passes the triangle: half-open, so that it passes one of two that share an
/// edge.
fn covers_axis(t: [Vec3; 3]) -> bool {
    let mut is_inside = false;
    for k in 0..3 {
        let (mut p, mut q) = (t[k], t[(k + 1) % 3]);
        // The same order for both triangles of the edge.
        if (p.y, p.x) > (q.y, q.x) {
            std::mem::swap(&mut p, &mut q);
        }
        if p.y <= 0.0 && q.y > 0.0 && p.x + (q.x - p.x) * (-p.y / (q.y - p.y)) > 0.0 {
            is_inside = !is_inside;
        }
    }
    is_inside
}

/// Height on the axis of a triangle that covers it.
fn height_on_axis(t: [Vec3; 3]) -> f64 {
    let normal = (t[1] - t[0]).cross(t[2] - t[0]);
    t[0].z + (normal.x * t[0].x + normal.y * t[0].y) / normal.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use shellock_geom::Volume;
    use shellock_testkit::shapes::cuboid;

    /// The barrier of `roof` above the origin, which the point is `sideways` off from, for moves of `radius`.
    fn above(roof: &Volume, sideways: f64, radius: f64) -> Option<f64> {
        let surface = Surface::new(&roof.to_mesh());
        let origin = Vec3::new(sideways, 0.0123, 0.0);
        let (from, _) = surface.tree.first_hit(origin, Vec3::Z, 10.0)?;
        surface.barrier_mm(from, &Axis::new(origin, Vec3::Z), &Region::of_radius(radius), 5.0)
    }

    #[test]
    fn a_flat_roof_stops_a_point_at_its_height_as_far_as_it_reaches() {
        let roof = cuboid([-2.0, -2.0, 0.3], [2.0, 2.0, 8.0]);
        assert!((above(&roof, 0.0, 1.9).unwrap() - 0.3).abs() < 1e-12);
        assert!((above(&roof, 1.0, 0.99).unwrap() - 0.3).abs() < 1e-12);
        assert_eq!(
            above(&roof, 1.0, 1.01),
            None,
            "beside it a point rises to the roof's top"
        );
        let low = cuboid([-2.0, -2.0, 0.3], [2.0, 2.0, 4.0]);
        assert_eq!(above(&low, 1.0, 1.01), None, "and beside a low one over its top");
    }

    #[test]
    fn a_step_counts_from_where_it_is_reached() {
        let step = cuboid([0.5, -2.0, 0.1], [2.0, 2.0, 0.4]);
        let roof = cuboid([-2.0, -2.0, 0.3], [2.0, 2.0, 8.0]).subtract(&step);
        assert!((above(&roof, 0.0, 0.49).unwrap() - 0.3).abs() < 1e-12);
        assert!((above(&roof, 0.0, 0.51).unwrap() - 0.4).abs() < 1e-12);
    }

    #[test]
    fn a_slope_is_as_high_as_its_highest_place_within_the_radius() {
        // 45 degrees, 0.5 above the origin.
        let corners = [
            [-3.0, -3.0, -2.5],
            [3.0, -3.0, 3.5],
            [3.0, 3.0, 3.5],
            [-3.0, 3.0, -2.5],
        ];
        let mut mesh = TriMesh {
            points: corners.map(Vec3::from).to_vec(),
            triangles: vec![[0, 2, 1], [0, 3, 2]],
        };
        mesh.points.push(Vec3::new(0.0, 0.0, 20.0));
        mesh.triangles
            .extend([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]);
        let surface = Surface::new(&mesh);
        let from = surface.tree.first_hit(Vec3::ZERO, Vec3::Z, 10.0).unwrap().0;
        for radius in [0.1, 0.5, 1.0] {
            let found = surface
                .barrier_mm(
                    from,
                    &Axis::new(Vec3::ZERO, Vec3::Z),
                    &Region::of_radius(radius),
                    5.0,
                )
                .unwrap();
            assert!((found - (0.5 + radius)).abs() < 1e-9, "{radius}: {found}");
        }
    }

    #[test]
    fn what_is_above_a_solid_has_no_barrier_in_its_top() {
        let block = cuboid([-2.0, -2.0, -3.0], [2.0, 2.0, -1.0]);
        let surface = Surface::new(&block.to_mesh());
        let from = surface.tree.first_hit(Vec3::ZERO, Vec3::NEG_Z, 10.0).unwrap().0;
        assert_eq!(
            surface.barrier_mm(
                from,
                &Axis::new(Vec3::ZERO, Vec3::Z),
                &Region::of_radius(0.5),
                5.0
            ),
            None
        );
    }

    /// Points dropped at random paths: none that stays within the radius gets past a barrier.
    #[test]
    fn no_walk_gets_past_the_barrier_of_a_rough_roof() {
        use rand::RngExt;
        use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut roof = cuboid([-2.0, -2.0, 0.5], [2.0, 2.0, 3.0]);
        for _ in 0..25 {
            let [x, y]: [f64; 2] = std::array::from_fn(|_| rng.random_range(-1.5..1.5));
            let size = rng.random_range(0.1..0.4);
            let bump = cuboid([x, y, 0.5 - size], [x + size, y + size, 0.6]);
            roof = if rng.random() {
                Volume::union_all(vec![roof, bump])
            } else {
                roof.subtract(&bump)
            };
        }
        let surface = Surface::new(&roof.to_mesh());
        let from = surface.tree.first_hit(Vec3::ZERO, Vec3::Z, 10.0).unwrap().0;
        let radius = 0.9;
        let height = surface
            .barrier_mm(
                from,
                &Axis::new(Vec3::ZERO, Vec3::Z),
                &Region::of_radius(radius),
                2.0,
            )
            .unwrap();
        let mut p = Vec3::ZERO;
        for _ in 0..20_000 {
            let step = Vec3::new(
                rng.random_range(-0.2..0.2),
                rng.random_range(-0.2..0.2),
                rng.random_range(-0.1..0.2),
            );
            let to = p + step;
            let is_free = surface
                .tree
                .first_hit(p, step.normalize(), step.length())
                .is_none();
            if is_free && to.truncate().length() < radius && to.z > -0.5 {
                p = to;
                assert!(p.z <= height, "{p} is above {height}");
            }
        }
    }
}
