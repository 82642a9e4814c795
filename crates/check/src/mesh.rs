//! Mesh of a piece, as the triangles of its file.

use std::sync::OnceLock;

use crate::tree::Tree;
use crate::vector::{Vec3, add, cross, distance, dot, norm, scale, sub};

/// Greatest distance of a contact's point from the triangle that it should lie on, mm: rounding of files.
const ON_SURFACE_MM: f64 = 1e-4;
/// Greatest error of the distance to the other piece, mm.
const SAME_GAP_MM: f64 = 1e-3;
/// Least scalar product of a contact's normal with that of its triangle.
const SAME_NORMAL: f64 = 1.0 - 1e-9;
/// Greatest scalar product of the normals of two faces that face each other (26° from opposite).
const FACING: f64 = -0.9;

/// Greatest coordinate of a printed object, mm.
const FARTHEST_MM: f64 = 1e5;

/// Triangles, counter-clockwise seen from outside, mm.
pub struct Mesh {
    /// Corners of each triangle.
    pub triangles: Vec<[Vec3; 3]>,
    tree: OnceLock<Tree>,
    edges: OnceLock<Edges>,
}

/// Edges of all triangles, sorted so that those between the same points are adjacent.
struct Edges {
    all: Vec<Edge>,
    /// Range of `all` with the same ends as side `k` of triangle `t`, at `3 t + k`.
    of_side: Vec<[usize; 2]>,
}

/// Edge of a triangle. Points are equal if their bytes are.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    ends: [[u64; 3]; 2],
    is_forward: bool,
    /// Side `k` of triangle `t`, as `3 t + k`.
    side: usize,
}

impl Mesh {
    /// Builds a mesh of these triangles.
    pub fn new(triangles: Vec<[Vec3; 3]>) -> Self {
        Self {
            triangles,
            tree: OnceLock::new(),
            edges: OnceLock::new(),
        }
    }

    /// Reads a mesh from the bytes of a binary STL file, without its normals.
    pub fn from_stl(bytes: &[u8]) -> Result<Self, String> {
        const HEADER: usize = 84;
        const RECORD: usize = 50;
        let count = bytes
            .get(80..HEADER)
            .and_then(|b| b.try_into().ok())
            .map(u32::from_le_bytes);
        let n = count.ok_or("shorter than the head of a binary STL file")? as usize;
        if bytes.len() != n.saturating_mul(RECORD).saturating_add(HEADER) {
            return Err(format!(
                "{} bytes are no binary STL file of {n} triangles",
                bytes.len()
            ));
        }
        let number = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let point = |b: &[u8]| [number(b), number(&b[4..]), number(&b[8..])];
        let triangle = |b: &[u8]| [point(&b[12..]), point(&b[24..]), point(&b[36..])];
        let triangles: Vec<[Vec3; 3]> = bytes[HEADER..].chunks_exact(RECORD).map(triangle).collect();
        match triangles
            .iter()
            .flatten()
            .flatten()
            .all(|x| x.abs() <= FARTHEST_MM)
        {
            true => Ok(Self::new(triangles)),
            false => Err(format!("a coordinate is no number, or beyond {FARTHEST_MM} mm")),
        }
    }

    /// Number of edges that are not used equally often in both directions.
    pub fn n_open_edges(&self) -> usize {
        let uses = self
            .edges()
            .all
            .chunk_by(|x, y| x.ends == y.ends)
            .filter(|uses| uses[0].ends[0] != uses[0].ends[1]);
        uses.filter(|uses| 2 * uses.iter().filter(|e| e.is_forward).count() != uses.len())
            .count()
    }

    /// Triangles that share the edge of side `k` of triangle `t`: `t` itself, and those on the other side.
    pub fn triangles_at_edge(&self, t: usize, k: usize) -> impl Iterator<Item = usize> {
        let edges = self.edges();
        let [from, to] = edges.of_side[3 * t + k];
        edges.all[from..to].iter().map(|e| e.side / 3)
    }

    /// Edges of all triangles, computed once.
    fn edges(&self) -> &Edges {
        self.edges.get_or_init(|| {
            // Zero has two signs; adding 0 leaves only one.
            let name = |p: Vec3| p.map(|x| (x + 0.0).to_bits());
            let mut all = Vec::with_capacity(3 * self.triangles.len());
            for (triangle, t) in self.triangles.iter().enumerate() {
                let corners = t.map(name);
                all.extend((0..3).map(|k| {
                    let (from, to) = (corners[k], corners[(k + 1) % 3]);
                    Edge {
                        ends: [from.min(to), from.max(to)],
                        is_forward: from < to,
                        side: 3 * triangle + k,
                    }
                }));
            }
            all.sort_unstable();
            let (mut of_side, mut from) = (vec![[0; 2]; all.len()], 0);
            for uses in all.chunk_by(|x, y| x.ends == y.ends) {
                let to = from + uses.len();
                uses.iter().for_each(|e| of_side[e.side] = [from, to]);
                from = to;
            }
            Edges { all, of_side }
        })
    }

    /// Number of surfaces that are connected by edges.
    pub fn n_surfaces(&self) -> usize {
        let edges = &self.edges().all;
        let mut leader: Vec<usize> = (0..self.triangles.len()).collect();
        let mut n_surfaces = leader.len();
        for pair in edges.windows(2).filter(|pair| pair[0].ends == pair[1].ends) {
            let [a, b] = [pair[0].side / 3, pair[1].side / 3].map(|i| {
                let mut i = i;
                while leader[i] != i {
                    leader[i] = leader[leader[i]];
                    i = leader[i];
                }
                i
            });
            n_surfaces -= usize::from(a != b);
            leader[a.max(b)] = a.min(b);
        }
        n_surfaces
    }

    /// Centroid of the volume; the first corner if there is no volume.
    pub fn centroid(&self) -> Vec3 {
        let origin = self.triangles.first().map_or([0.0; 3], |t| t[0]);
        let (mut moment, mut volume) = ([0.0; 3], 0.0);
        for t in &self.triangles {
            let [a, b, c] = t.map(|p| sub(p, origin));
            let part = dot(a, cross(b, c)) / 6.0;
            volume += part;
            moment = add(moment, scale(add(a, add(b, c)), 0.25 * part));
        }
        if volume > 0.0 {
            add(origin, scale(moment, 1.0 / volume))
        } else {
            origin
        }
    }

    /// Volume enclosed by the mesh, mm³.
    pub fn volume_mm3(&self) -> f64 {
        self.triangles
            .iter()
            .map(|[a, b, c]| dot(*a, cross(*b, *c)) / 6.0)
            .sum()
    }

    /// Triangle nearest to `point`, with its nearest point; `None` if that is farther away than rounding.
    pub fn on_surface(&self, point: Vec3) -> Option<(usize, Vec3)> {
        let near = self
            .numbers_near(point, ON_SURFACE_MM)
            .into_iter()
            .map(|i| (i, nearest_point(&self.triangles[i], point)));
        let on = near.filter(|(_, nearest)| distance(*nearest, point) <= ON_SURFACE_MM);
        on.min_by(|a, b| {
            distance(a.1, point)
                .total_cmp(&distance(b.1, point))
                .then(a.0.cmp(&b.0))
        })
    }

    /// Triangles that may enter a box: all that do, and a few beside it.
    pub fn in_box(&self, low: Vec3, high: Vec3) -> Vec<usize> {
        self.tree().near(low, high)
    }

    /// Returns true if `point` is within `reach_mm` of the bounding box of all triangles.
    pub fn is_in_bounds(&self, point: Vec3, reach_mm: f64) -> bool {
        let is_in = |[low, high]: [Vec3; 2]| {
            (0..3).all(|k| low[k] - reach_mm <= point[k] && point[k] <= high[k] + reach_mm)
        };
        self.tree().bounds().is_some_and(is_in)
    }

    /// Search tree of the triangles, built once.
    fn tree(&self) -> &Tree {
        self.tree.get_or_init(|| Tree::new(&self.triangles))
    }

    /// Finds the triangle with this `normal` on which `point` lies: its nearest point and its normal.
    pub fn triangle_at(&self, point: Vec3, normal: Vec3) -> Option<(Vec3, Vec3)> {
        let on = self.near(point, ON_SURFACE_MM).filter_map(|t| {
            let own = normal_of(t)?;
            let nearest = nearest_point(t, point);
            (dot(own, normal) >= SAME_NORMAL && distance(nearest, point) <= ON_SURFACE_MM)
                .then_some((nearest, own))
        });
        on.min_by(|a, b| distance(a.0, point).total_cmp(&distance(b.0, point)))
    }

    /// Returns true if a triangle within `gap_mm` of `point` faces `normal`.
    pub fn is_faced(&self, point: Vec3, normal: Vec3, gap_mm: f64) -> bool {
        let reach_mm = gap_mm + SAME_GAP_MM;
        let mut near = self.near(point, reach_mm);
        near.any(|t| {
            let is_facing = normal_of(t).is_some_and(|own| dot(own, normal) < FACING);
            is_facing && distance(nearest_point(t, point), point) <= reach_mm
        })
    }

    /// Distance of `point` to the surface, mm; `None` if it is more than `reach_mm`.
    pub fn distance_mm(&self, point: Vec3, reach_mm: f64) -> Option<f64> {
        let distances = self
            .near(point, reach_mm)
            .map(|t| distance(nearest_point(t, point), point));
        distances.filter(|d| *d <= reach_mm).min_by(f64::total_cmp)
    }

    /// Triangles that may come within `reach_mm` of `point`: all that do, and a few more.
    fn near(&self, point: Vec3, reach_mm: f64) -> impl Iterator<Item = &[Vec3; 3]> {
        self.numbers_near(point, reach_mm)
            .into_iter()
            .map(|i| &self.triangles[i])
    }

    fn numbers_near(&self, point: Vec3, reach_mm: f64) -> Vec<usize> {
        self.tree()
            .near(point.map(|x| x - reach_mm), point.map(|x| x + reach_mm))
    }
}

/// Unit normal; `None` for a triangle without area.
fn normal_of([a, b, c]: &[Vec3; 3]) -> Option<Vec3> {
    let normal = cross(sub(*b, *a), sub(*c, *a));
    let length = norm(normal);
    (length > 0.0).then(|| scale(normal, 1.0 / length))
}

/// Point of a triangle nearest to `p`.
fn nearest_point(t: &[Vec3; 3], p: Vec3) -> Vec3 {
    let on_edge = |k: usize| {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        let (along, length_sq) = (sub(b, a), dot(sub(b, a), sub(b, a)));
        let share = if length_sq > 0.0 {
            (dot(sub(p, a), along) / length_sq).clamp(0.0, 1.0)
        } else {
            0.0
        };
        add(a, scale(along, share))
    };
    if let Some(normal) = normal_of(t) {
        let foot = sub(p, scale(normal, dot(sub(p, t[0]), normal)));
        let is_inside = |k: usize| dot(cross(sub(t[(k + 1) % 3], t[k]), sub(foot, t[k])), normal) >= 0.0;
        if (0..3).all(is_inside) {
            return foot;
        }
    }
    (0..3)
        .map(on_edge)
        .min_by(|a, b| distance(*a, p).total_cmp(&distance(*b, p)))
        .unwrap_or(t[0])
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Box between two corners, as a mesh.
    pub fn cuboid(min: Vec3, max: Vec3) -> Mesh {
        let (points, triangles) = shellock_testkit::plain::cuboid(min.into(), max.into());
        let corner = |i: u32| points[i as usize].to_array();
        Mesh::new(triangles.into_iter().map(|t| t.map(corner)).collect())
    }

    /// Box with a hollow inside, half sides in mm, around the origin.
    pub fn hollow(outside_mm: f64, inside_mm: f64) -> Mesh {
        let [mut all, inside] = [outside_mm, inside_mm].map(|h| cuboid([-h; 3], [h; 3]).triangles);
        all.extend(inside.into_iter().map(|[a, b, c]| [a, c, b]));
        Mesh::new(all)
    }

    #[test]
    fn edges_and_places_are_those_of_the_triangles() {
        let cube = cuboid([0.0; 3], [1.0; 3]);
        assert_eq!((cube.n_open_edges(), cube.n_surfaces()), (0, 1));
        assert_eq!(hollow(2.0, 1.0).n_surfaces(), 2);
        for (t, k) in (0..12).flat_map(|t| (0..3).map(move |k| (t, k))) {
            assert_eq!(cube.triangles_at_edge(t, k).count(), 2);
            assert!(cube.triangles_at_edge(t, k).any(|other| other == t));
        }
        let (_, on) = cube.on_surface([0.3, 0.4, 1.00005]).unwrap();
        assert!(distance(on, [0.3, 0.4, 1.0]) < 1e-12);
        assert_eq!(cube.on_surface([0.3, 0.4, 1.001]), None);
        assert!(cube.is_in_bounds([0.5; 3], 0.0) && !cube.is_in_bounds([1.5; 3], 0.0));
        let open = Mesh::new(cube.triangles[1..].to_vec());
        assert_eq!(open.n_open_edges(), 3);
    }
}
