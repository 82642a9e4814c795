//! Height that a point can reach before a surface stops it, while it moves sideways by at most a radius.
//!
//! Let the point start at height 0 on an axis. Let `S` be the part of a closed surface that is connected,
//! within the open cylinder of the radius about the axis, with a triangle above the point. Edges within the
//! cylinder have triangles of `S` on both sides, so `S` is a cycle modulo the cylinder's wall. So the number
//! of sheets of `S` above a place is constant, modulo 2, along a path within the cylinder that does not cross
//! `S`. If this number is odd at the point, and the highest place of `S` has height `g`, no such path leads
//! above `g`.
//!
//! ```text
//!        |   ______   |  g: the highest place of S within the cylinder
//!        |__/      \__|
//!        |      p     |  an odd number of sheets of S above p
//!        |<--r->|     |
//! ```
//!
//! The surface needs no other property: it may be rough, and need be neither a graph over the disc nor
//! parallel to it.

use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Aabb, TriMesh, Vec3};

/// Greatest number of triangles of a barrier before the search gives up: real ones have some tens.
const MOST_TRIANGLES: usize = 380;
/// Number of sides of a region.
pub(super) const SIDES: usize = 8;

/// Convex region around an axis, perpendicular to it, given by the distance of each side from the axis, mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    pub far_mm: [f64; SIDES],
}

impl Region {
    /// Region with equal distances to all sides.
    pub fn of_radius(mm: f64) -> Self {
        Self { far_mm: [mm; SIDES] }
    }

    /// Unit vectors towards the region's sides.
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

/// Closed surface with the neighbours of its triangles.
pub(super) struct Surface {
    pub mesh: TriMesh,
    pub tree: TriangleBvh,
    pub bounds: Aabb,
    /// Triangles that share an edge with each, three lists a triangle: `start[3 f + k]..start[3 f + k + 1]`.
    neighbours: Vec<u32>,
    start: Vec<u32>,
}

/// Axis of a search for a barrier: heights are along `normal` from `origin`.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    origin: Vec3,
    normal: Vec3,
    across: [Vec3; 2],
}

impl Axis {
    /// Builds the axis; `normal` is a unit vector.
    pub fn new(origin: Vec3, normal: Vec3) -> Self {
        let u = normal.any_orthonormal_vector();
        Self {
            origin,
            normal,
            across: [u, normal.cross(u)],
        }
    }

    /// Directions in space of a region's sides.
    pub fn sides(&self) -> [Vec3; SIDES] {
        Region::of_radius(0.0)
            .sides()
            .map(|[x, y]| self.across[0] * x + self.across[1] * y)
    }

    /// Coordinates across the axis, and height.
    fn local(&self, p: Vec3) -> Vec3 {
        let d = p - self.origin;
        Vec3::new(d.dot(self.across[0]), d.dot(self.across[1]), d.dot(self.normal))
    }
}

/// Part of a triangle that lies within a region.
struct Clip {
    highest: f64,
    /// True for edges that enter the region.
    edges: [bool; 3],
    /// Height of the triangle on the axis, if it covers the axis.
    on_axis: Option<f64>,
}

impl Surface {
    /// Builds the surface of `mesh`, which has only one index for each position.
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

    /// Height above the origin of the barrier connected with triangle `from`, for sideways motions within
    /// `region`. `None` if it ends above `most_mm` or is no barrier.
    pub fn barrier_mm(&self, from: u32, axis: &Axis, region: &Region, most_mm: f64) -> Option<f64> {
        let (highest, n_above) = self.flood(from, axis, region, most_mm)?;
        (n_above % 2 == 1).then_some(highest)
    }

    /// Highest place of everything connected with triangle `from` within the region, if below `most_mm`.
    pub fn highest_mm(&self, from: u32, axis: &Axis, region: &Region, most_mm: f64) -> Option<f64> {
        self.flood(from, axis, region, most_mm).map(|found| found.0)
    }

    /// Highest place, and the number of triangles above the origin.
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

/// Clips a triangle, in coordinates across an axis and heights, to `region`; `None` if nothing remains.
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
                // On the way out, the region's side begins here; on the way in, the rest of the edge.
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

/// Returns true if a ray along the axis passes through the triangle. The test is half-open, so the ray passes
/// exactly one of two triangles that share an edge.
fn covers_axis(t: [Vec3; 3]) -> bool {
    let mut is_inside = false;
    for k in 0..3 {
        let (mut p, mut q) = (t[k], t[(k + 1) % 3]);
        // Use the same order for both triangles of the edge.
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
    use shellock_geom::Volume;
    use shellock_testkit::shapes::cuboid;

    use super::*;

    /// Barrier that `roof` forms above the origin, which is `sideways` off the centre, for motions of
    /// `radius`.
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
        // A slope of 45 degrees, 0.5 above the origin.
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

    /// Points that follow random paths: none that stays within the radius passes a barrier.
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
