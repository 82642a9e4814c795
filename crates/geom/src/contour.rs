//! Contouring: the zero surface of a function as a closed mesh of well-shaped triangles, for models made by
//! code.
//!
//! Marching cubes, but with triangles from a rule for faces instead of a published table. On each face of a
//! cell the surface cuts off the inside corners one by one. Neighbouring cells therefore agree, and no
//! triangle has a diagonal within a face. With one vertex per crossed grid edge the result is manifold by
//! construction [Lorensen1987, Montani1994]. Vertices are then spread out along the surface and pulled onto
//! it by Newton steps, for which the function must be smooth enough.
//!
//! The grid is dense: memory grows with the cube of the resolution. Features thinner than a cell are lost.

use rayon::prelude::*;

use crate::{Aabb, TriMesh, Vec3};

/// Least distance of an initial vertex from the ends of its grid edge, as a share of the edge.
///
/// Without this margin, vertices of neighbouring edges meet at grid points. The resulting slivers survive any
/// smoothing.
const EDGE_MARGIN: f64 = 0.2;

/// Number of rounds that move each vertex towards the mean of its neighbours and back onto the surface.
///
/// After three rounds the least angle of a sphere is above 20°; further rounds change little.
const N_SPREAD_ROUNDS: usize = 3;

/// Longest Newton step, as a share of the cell. For longer steps the linear model is wrong, or the vertex is
/// beside a crease.
const MAX_STEP_CELLS: f64 = 0.5;

/// Contours the surface where `field` is 0 as a closed manifold mesh, oriented from positive (inside) to
/// negative.
///
/// `bounds` must contain the surface; otherwise the solid ends at the grid's border. `field` is called about
/// `(size / cell_mm)³` times, from several threads. The mesh is empty if no grid point has a positive value.
pub fn contour(bounds: Aabb, cell_mm: f64, field: impl Fn(Vec3) -> f64 + Sync) -> TriMesh {
    let grid = ScalarGrid::sample(bounds, cell_mm, &field);
    let (points, vertex_of_edge) = grid.crossings();
    let triangles = grid.triangles(&vertex_of_edge);
    let mut mesh = TriMesh { points, triangles };
    pull_to_surface(&mut mesh.points, cell_mm, &field);
    for _ in 0..N_SPREAD_ROUNDS {
        spread(&mut mesh);
        pull_to_surface(&mut mesh.points, cell_mm, &field);
    }
    mesh
}

/// Values at the points of a grid; x runs fastest.
struct ScalarGrid {
    origin: Vec3,
    cell_mm: f64,
    n: [usize; 3],
    values: Vec<f64>,
}

/// Marks a grid edge that the surface does not cross.
const NO_VERTEX: u32 = u32::MAX;

impl ScalarGrid {
    fn sample(bounds: Aabb, cell_mm: f64, field: &(impl Fn(Vec3) -> f64 + Sync)) -> Self {
        let n = (bounds.size() / cell_mm)
            .to_array()
            .map(|cells| cells.ceil() as usize + 3);
        // One empty cell on all sides keeps the surface away from the border.
        let origin = bounds.min - cell_mm;
        let mut values = vec![0.0; n[0] * n[1] * n[2]];
        values
            .par_chunks_mut(n[0] * n[1])
            .enumerate()
            .for_each(|(k, layer)| {
                for (at, value) in layer.iter_mut().enumerate() {
                    let [i, j] = [at % n[0], at / n[0]];
                    let border = [i, j, k].iter().zip(n).any(|(&x, n)| x == 0 || x + 1 == n);
                    let p = origin + cell_mm * Vec3::new(i as f64, j as f64, k as f64);
                    let raw = field(p);
                    // A value of exactly 0 would put several vertices on one grid point.
                    let nudged = if raw.abs() < 1e-9 * cell_mm {
                        1e-9 * cell_mm
                    } else {
                        raw
                    };
                    *value = if border { nudged.min(-cell_mm) } else { nudged };
                }
            });
        Self {
            origin,
            cell_mm,
            n,
            values,
        }
    }

    fn strides(&self) -> [usize; 3] {
        [1, self.n[0], self.n[0] * self.n[1]]
    }

    fn point(&self, at: usize) -> Vec3 {
        let [i, j, k] = [
            at % self.n[0],
            at / self.n[0] % self.n[1],
            at / (self.n[0] * self.n[1]),
        ];
        self.origin + self.cell_mm * Vec3::new(i as f64, j as f64, k as f64)
    }

    /// Vertices of all grid edges with a change of sign, and the vertex of each edge `3 · grid point + axis`.
    fn crossings(&self) -> (Vec<Vec3>, Vec<u32>) {
        let mut points = Vec::new();
        let mut vertex_of_edge = vec![NO_VERTEX; 3 * self.values.len()];
        for (at, &here) in self.values.iter().enumerate() {
            for (axis, stride) in self.strides().into_iter().enumerate() {
                // Past the border this reads the next row, which also begins with negative values.
                let Some(&there) = self.values.get(at + stride) else {
                    continue;
                };
                if (here > 0.0) != (there > 0.0) {
                    let share = (here / (here - there)).clamp(EDGE_MARGIN, 1.0 - EDGE_MARGIN);
                    vertex_of_edge[3 * at + axis] =
                        u32::try_from(points.len()).expect("fewer than 4 billion points");
                    points.push(self.point(at) + share * self.cell_mm * Vec3::AXES[axis]);
                }
            }
        }
        (points, vertex_of_edge)
    }

    fn triangles(&self, vertex_of_edge: &[u32]) -> Vec<[u32; 3]> {
        let cases: Vec<Vec<[usize; 3]>> = (0..256).map(triangles_of_case).collect();
        let strides = self.strides();
        let corner_offset = |corner: usize| (0..3).map(|a| ((corner >> a) & 1) * strides[a]).sum::<usize>();
        let vertex_at = |cell: usize, edge: usize| {
            let (corner, axis) = edge_start(edge);
            vertex_of_edge[3 * (cell + corner_offset(corner)) + axis]
        };
        let last_corner = corner_offset(7);
        let mut triangles = Vec::new();
        for cell in 0..self.values.len() - last_corner {
            let case = (0..8)
                .filter(|&c| self.values[cell + corner_offset(c)] > 0.0)
                .fold(0, |bits, c| bits | 1 << c);
            triangles.extend(cases[case].iter().map(|t| t.map(|edge| vertex_at(cell, edge))));
        }
        triangles
    }
}

/// Number of the edge with an end at `corner` along `axis`: `4 · axis + position among the four parallel
/// edges`.
///
/// Corners are numbered by bits: bit `a` is set on the far side along axis `a`.
fn edge_at(corner: usize, axis: usize) -> usize {
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    4 * axis + (corner >> u & 1) + 2 * (corner >> v & 1)
}

/// Lower corner of an edge, and the edge's axis.
fn edge_start(edge: usize) -> (usize, usize) {
    let (axis, position) = (edge / 4, edge % 4);
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    ((position & 1) << u | (position >> 1) << v, axis)
}

/// Returns true if two edges lie in a common face of the cell.
fn share_face(a: usize, b: usize) -> bool {
    let sides = |edge: usize| {
        let (corner, axis) = edge_start(edge);
        [(axis + 1) % 3, (axis + 2) % 3].map(|across| (across, corner >> across & 1))
    };
    sides(a).iter().any(|side| sides(b).contains(side))
}

/// Triangles of one of the 256 sign patterns, as cell edges. Bit `c` of `case` is set if corner `c` is
/// inside.
fn triangles_of_case(case: usize) -> Vec<[usize; 3]> {
    // Each face has one directed segment around each run of inside corners, which lie on its right seen from
    // outside.
    let mut next = [None; 12];
    for axis in 0..3 {
        for side in 0..2 {
            for (from, to) in face_segments(case, axis, side) {
                next[from] = Some(to);
            }
        }
    }
    let mut triangles = Vec::new();
    for start in 0..12 {
        let mut polygon = Vec::new();
        let mut edge = start;
        while let Some(following) = next[edge].take() {
            polygon.push(edge);
            edge = following;
        }
        if !polygon.is_empty() {
            triangles
                .extend(triangulate(&polygon).expect("every polygon of a cell has such a triangulation"));
        }
    }
    triangles
}

fn face_segments(case: usize, axis: usize, side: usize) -> Vec<(usize, usize)> {
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    // Corners in counter-clockwise order, seen from outside the cell.
    let mut ring = [0, 1 << u, 1 << u | 1 << v, 1 << v].map(|corner| corner | side << axis);
    if side == 0 {
        ring.reverse();
    }
    let inside = |i: usize| case >> ring[i % 4] & 1 == 1;
    let edge = |i: usize| {
        let [a, b] = [ring[i % 4], ring[(i + 1) % 4]];
        edge_at(a.min(b), (a ^ b).trailing_zeros() as usize)
    };
    let mut segments = Vec::new();
    for i in 0..4 {
        // A run of inside corners begins after edge i and ends before the next outside corner.
        if !inside(i) && inside(i + 1) {
            let end = (i + 1..i + 5)
                .find(|&k| !inside(k + 1))
                .expect("corner i is outside");
            segments.push((edge(i), edge(end)));
        }
    }
    segments
}

/// Triangulates a polygon of cell edges without any diagonal in a face; `None` if that is impossible.
fn triangulate(polygon: &[usize]) -> Option<Vec<[usize; 3]>> {
    let last = polygon.len() - 1;
    if last < 2 {
        return Some(Vec::new());
    }
    (1..last).find_map(|apex| {
        let free = |a: usize, b: usize| a + 1 == b || !share_face(polygon[a], polygon[b]);
        if !free(0, apex) || !free(apex, last) {
            return None;
        }
        let mut triangles = triangulate(&polygon[..=apex])?;
        triangles.extend(triangulate(&polygon[apex..])?);
        triangles.push([polygon[0], polygon[apex], polygon[last]]);
        Some(triangles)
    })
}

/// Moves each point halfway towards the mean of its neighbours.
fn spread(mesh: &mut TriMesh) {
    // Each neighbour is counted twice, once for each triangle at the common edge, which leaves the mean
    // unchanged.
    let mut sums = vec![(Vec3::ZERO, 0.0); mesh.points.len()];
    for &[a, b, c] in &mesh.triangles {
        for (at, [p, q]) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
            let sum = &mut sums[at as usize];
            sum.0 += mesh.points[p as usize] + mesh.points[q as usize];
            sum.1 += 2.0;
        }
    }
    for (point, (sum, count)) in mesh.points.iter_mut().zip(sums) {
        *point = 0.5 * (*point + sum / count);
    }
}

/// Moves points by two Newton steps along the gradient, which is computed by differences.
fn pull_to_surface(points: &mut [Vec3], cell_mm: f64, field: &(impl Fn(Vec3) -> f64 + Sync)) {
    let h = 1e-4 * cell_mm;
    points.par_iter_mut().for_each(|p| {
        for _ in 0..2 {
            let slope = |axis: Vec3| (field(*p + h * axis) - field(*p - h * axis)) / (2.0 * h);
            let gradient = Vec3::new(slope(Vec3::X), slope(Vec3::Y), slope(Vec3::Z));
            let step = field(*p) * gradient / gradient.length_squared().max(1e-12);
            *p -= step.clamp_length_max(MAX_STEP_CELLS * cell_mm);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Solid;

    const BOX: Aabb = Aabb {
        min: Vec3::splat(-6.0),
        max: Vec3::splat(6.0),
    };

    #[test]
    fn a_sphere_has_its_volume_and_no_slivers() {
        let ball = contour(BOX, 0.4, |p| 5.0 - p.length());
        assert!(ball.points.iter().all(|p| (p.length() - 5.0).abs() < 1e-6));
        let least = ball
            .triangles
            .iter()
            .map(|t| least_angle(t.map(|v| ball.points[v as usize])))
            .fold(4.0, f64::min);
        assert!(least.to_degrees() > 15.0, "least angle {}°", least.to_degrees());
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 125.0;
        assert!((Solid::new(ball).unwrap().volume() / exact - 1.0).abs() < 0.01);
    }

    #[test]
    fn noise_gives_a_solid_whatever_the_signs() {
        // Signs from a hash of the grid point, so that every sign pattern occurs.
        let noise = |p: Vec3| {
            let q = (p * 2.0).round().as_i64vec3();
            let mix = ((q.x * 73_856_093) ^ (q.y * 19_349_663) ^ (q.z * 83_492_791))
                .wrapping_mul(2_654_435_761)
                >> 7;
            (mix & 1023) as f64 - 511.5
        };
        let grid = ScalarGrid::sample(BOX, 0.5, &noise);
        let (points, vertex_of_edge) = grid.crossings();
        let triangles = grid.triangles(&vertex_of_edge);
        Solid::new(TriMesh { points, triangles }).unwrap();
    }

    fn least_angle(t: [Vec3; 3]) -> f64 {
        (0..3)
            .map(|i| (t[(i + 1) % 3] - t[i]).angle_between(t[(i + 2) % 3] - t[i]))
            .fold(4.0, f64::min)
    }
}
