//! A piece as the triangles of its file.

use crate::vector::{Vec3, add, cross, distance, dot, norm, scale, sub};

/// How far a contact's point may be from the triangle that it is said to lie on, mm: rounding of files.
const ON_SURFACE_MM: f64 = 1e-4;
/// The same for the distance to the other piece.
const SAME_GAP_MM: f64 = 1e-3;
/// Least scalar product of a contact's normal with that of its triangle.
const SAME_NORMAL: f64 = 1.0 - 1e-9;
/// Faces whose normals have a greater scalar product do not face each other (26° from opposite).
const FACING: f64 = -0.9;

/// Nothing that is printed is so far off, mm.
const FARTHEST_MM: f64 = 1e5;

/// Triangles, counter-clockwise seen from outside, mm.
pub struct Mesh {
    /// Corners of each.
    pub triangles: Vec<[Vec3; 3]>,
}

/// An edge of a triangle; points are one where their bytes are.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    ends: [[u64; 3]; 2],
    is_forward: bool,
    triangle: usize,
}

impl Mesh {
    /// From the bytes of a binary STL file; its normals are not read.
    pub fn from_stl(bytes: &[u8]) -> Result<Self, String> {
        const HEADER: usize = 84;
        const RECORD: usize = 50;
        let count = bytes.get(80..HEADER).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        let n = count.ok_or("shorter than the head of a binary STL file")? as usize;
        if bytes.len() != n.saturating_mul(RECORD).saturating_add(HEADER) {
            return Err(format!("{} bytes are no binary STL file of {n} triangles", bytes.len()));
        }
        let number = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let point = |b: &[u8]| [number(b), number(&b[4..]), number(&b[8..])];
        let triangle = |b: &[u8]| [point(&b[12..]), point(&b[24..]), point(&b[36..])];
        let triangles: Vec<[Vec3; 3]> = bytes[HEADER..].chunks_exact(RECORD).map(triangle).collect();
        match triangles.iter().flatten().flatten().all(|x| x.abs() <= FARTHEST_MM) {
            true => Ok(Self { triangles }),
            false => Err(format!("a coordinate is no number, or beyond {FARTHEST_MM} mm")),
        }
    }

    /// Edges that are not used equally often in both directions.
    pub fn n_open_edges(&self) -> usize {
        let edges = self.edges();
        let between = edges.iter().filter(|e| e.ends[0] != e.ends[1]).collect::<Vec<_>>();
        let uses = between.chunk_by(|x, y| x.ends == y.ends);
        uses.filter(|uses| 2 * uses.iter().filter(|e| e.is_forward).count() != uses.len()).count()
    }

    /// The edges of all triangles, those between the same points beside each other.
    fn edges(&self) -> Vec<Edge> {
        // Zero has two signs; adding it leaves one.
        let name = |p: Vec3| p.map(|x| (x + 0.0).to_bits());
        let mut edges = Vec::with_capacity(3 * self.triangles.len());
        for (triangle, t) in self.triangles.iter().enumerate() {
            let corners = t.map(name);
            edges.extend((0..3).map(|k| {
                let (from, to) = (corners[k], corners[(k + 1) % 3]);
                Edge { ends: [from.min(to), from.max(to)], is_forward: from < to, triangle }
            }));
        }
        edges.sort_unstable();
        edges
    }

    /// Surfaces that hang together over edges.
    pub fn n_surfaces(&self) -> usize {
        let edges = self.edges();
        let mut leader: Vec<usize> = (0..self.triangles.len()).collect();
        let mut n_surfaces = leader.len();
        for pair in edges.windows(2).filter(|pair| pair[0].ends == pair[1].ends) {
            let [a, b] = [pair[0].triangle, pair[1].triangle].map(|i| {
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

    /// Volume inside, mm³.
    pub fn volume_mm3(&self) -> f64 {
        self.triangles.iter().map(|[a, b, c]| dot(*a, cross(*b, *c)) / 6.0).sum()
    }

    /// The point and the normal of the triangle on which `point` lies with this `normal`.
    pub fn triangle_at(&self, point: Vec3, normal: Vec3) -> Option<(Vec3, Vec3)> {
        let on = self.near(point, ON_SURFACE_MM).filter_map(|t| {
            let own = normal_of(t)?;
            let nearest = nearest_point(t, point);
            (dot(own, normal) >= SAME_NORMAL && distance(nearest, point) <= ON_SURFACE_MM).then_some((nearest, own))
        });
        on.min_by(|a, b| distance(a.0, point).total_cmp(&distance(b.0, point)))
    }

    /// Whether a triangle within `gap_mm` of `point` faces `normal`.
    pub fn is_faced(&self, point: Vec3, normal: Vec3, gap_mm: f64) -> bool {
        let reach_mm = gap_mm + SAME_GAP_MM;
        let mut near = self.near(point, reach_mm);
        near.any(|t| {
            let is_facing = normal_of(t).is_some_and(|own| dot(own, normal) < FACING);
            is_facing && distance(nearest_point(t, point), point) <= reach_mm
        })
    }

    /// Distance of `point` to the surface, mm; `None` where it is more than `reach_mm`.
    pub fn distance_mm(&self, point: Vec3, reach_mm: f64) -> Option<f64> {
        let distances = self.near(point, reach_mm).map(|t| distance(nearest_point(t, point), point));
        distances.filter(|d| *d <= reach_mm).min_by(f64::total_cmp)
    }

    /// Triangles whose boxes come within `reach_mm` of `point`.
    fn near(&self, point: Vec3, reach_mm: f64) -> impl Iterator<Item = &[Vec3; 3]> {
        self.triangles.iter().filter(move |[a, b, c]| {
            (0..3).all(|k| {
                a[k].min(b[k]).min(c[k]) <= point[k] + reach_mm && a[k].max(b[k]).max(c[k]) >= point[k] - reach_mm
            })
        })
    }
}

/// Unit normal; `None` for a triangle without area.
fn normal_of([a, b, c]: &[Vec3; 3]) -> Option<Vec3> {
    let normal = cross(sub(*b, *a), sub(*c, *a));
    let length = norm(normal);
    (length > 0.0).then(|| scale(normal, 1.0 / length))
}

/// The point of a triangle nearest to `p`.
fn nearest_point(t: &[Vec3; 3], p: Vec3) -> Vec3 {
    let on_edge = |k: usize| {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        let (along, length_sq) = (sub(b, a), dot(sub(b, a), sub(b, a)));
        let share = if length_sq > 0.0 { (dot(sub(p, a), along) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
        add(a, scale(along, share))
    };
    if let Some(normal) = normal_of(t) {
        let foot = sub(p, scale(normal, dot(sub(p, t[0]), normal)));
        let is_inside = |k: usize| dot(cross(sub(t[(k + 1) % 3], t[k]), sub(foot, t[k])), normal) >= 0.0;
        if (0..3).all(is_inside) {
            return foot;
        }
    }
    (0..3).map(on_edge).min_by(|a, b| distance(*a, p).total_cmp(&distance(*b, p))).unwrap_or(t[0])
}
