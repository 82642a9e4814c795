//! Solids as the intervals in which parallel rays run inside them.
//!
//! A pixel grid lies across a ray direction `s`. One ray goes through the centre of each pixel, and a solid
//! becomes a sorted list of intervals on each ray. So volumes of intersections under any translation along
//! `s` are sums of interval overlaps. The rows of the grid are rotated so that they run along no axis. Then
//! walls parallel to the rays are hit in proportion to their area, instead of all or not at all.

use shellock_geom::{Aabb, Vec3};

/// Rotation of the pixel rows about the rays, rad. Its tangent is no small fraction, so rows, columns and
/// their diagonals are parallel to no wall of an axis-aligned model.
const ROW_ANGLE_RAD: f64 = 0.417;

/// Axes of a pixel grid: `u` and `v` across the rays, `s` along them; right-handed.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    u: Vec3,
    v: Vec3,
    s: Vec3,
}

impl Frame {
    /// Frame with rays along the unit vector `s`.
    pub fn along(s: Vec3) -> Self {
        let (a, b) = s.any_orthonormal_pair();
        let u = a * ROW_ANGLE_RAD.cos() + b * ROW_ANGLE_RAD.sin();
        Self { u, v: s.cross(u), s }
    }

    /// Coordinates (u, v, depth) of a point or a vector, mm.
    pub fn project(&self, p: Vec3) -> Vec3 {
        Vec3::new(p.dot(self.u), p.dot(self.v), p.dot(self.s))
    }
}

/// A rectangle of square pixels across the rays.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    origin: [f64; 2],
    pixel_mm: f64,
    n: [usize; 2],
}

impl Grid {
    /// Grid that covers the shadow of `bounds`, a box in frame coordinates.
    pub fn cover(bounds: Aabb, pixel_mm: f64) -> Self {
        let size = bounds.size();
        let count = |length: f64| (length / pixel_mm).ceil() as usize + 1;
        Self {
            origin: [bounds.min.x, bounds.min.y],
            pixel_mm,
            n: [count(size.x), count(size.y)],
        }
    }

    /// Area that one ray represents, mm².
    pub fn cell_mm2(&self) -> f64 {
        self.pixel_mm * self.pixel_mm
    }

    fn n_pixels(&self) -> usize {
        self.n[0] * self.n[1]
    }

    /// Half-open range of the pixels along `axis` whose centres lie in [low, high] mm.
    fn range(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let first = ((low - self.origin[axis]) / self.pixel_mm - 0.5).ceil().max(0.0);
        let last = ((high - self.origin[axis]) / self.pixel_mm - 0.5).floor() + 1.0;
        first as usize..(last.max(0.0) as usize).min(self.n[axis])
    }

    fn center(&self, axis: usize, i: usize) -> f64 {
        self.origin[axis] + (i as f64 + 0.5) * self.pixel_mm
    }
}

/// Depth intervals inside a solid, mm, for every ray of a grid, in order of depth.
pub struct Columns {
    starts: Vec<u32>,
    intervals: Vec<[f64; 2]>,
}

/// Crossing of a ray with a surface.
#[derive(Clone, Copy)]
struct Hit {
    pixel: u32,
    leaves: bool,
    depth: f64,
}

impl Columns {
    /// Cuts the closed mesh with `points` (frame coordinates, moved by `shift`) into intervals.
    ///
    /// A ray that meets an odd number of faces, which can only be due to rounding, loses its unpaired end.
    pub fn of(grid: &Grid, points: &[Vec3], triangles: &[[u32; 3]], shift: Vec3) -> Self {
        let mut hits = Vec::new();
        for t in triangles {
            cross_triangle(grid, t.map(|v| points[v as usize] + shift), &mut hits);
        }
        Self::from_hits(grid, &hits)
    }

    /// Intervals inside the solid on the ray through `pixel`.
    pub fn on_ray(&self, pixel: usize) -> &[[f64; 2]] {
        &self.intervals[self.starts[pixel] as usize..self.starts[pixel + 1] as usize]
    }

    /// Number of rays in the grid.
    pub fn n_rays(&self) -> usize {
        self.starts.len() - 1
    }

    /// Length common to both, summed over all rays, mm. Multiplied by the cell's area, it is the common
    /// volume.
    pub fn common_length_mm(&self, other: &Self) -> f64 {
        (0..self.n_rays())
            .map(|ray| common_mm(self.on_ray(ray), other.on_ray(ray)))
            .sum()
    }

    /// Total length inside the solid, mm.
    pub fn length_mm(&self) -> f64 {
        self.intervals.iter().map(|[from, to]| to - from).sum()
    }

    fn from_hits(grid: &Grid, hits: &[Hit]) -> Self {
        let mut first = vec![0u32; grid.n_pixels() + 1];
        for hit in hits {
            first[hit.pixel as usize + 1] += 1;
        }
        for i in 1..first.len() {
            first[i] += first[i - 1];
        }
        let mut sorted = vec![(0.0f64, false); hits.len()];
        let mut free = first.clone();
        for hit in hits {
            let at = &mut free[hit.pixel as usize];
            sorted[*at as usize] = (hit.depth, hit.leaves);
            *at += 1;
        }
        let mut starts = Vec::with_capacity(first.len());
        let mut intervals = Vec::with_capacity(hits.len() / 2);
        starts.push(0);
        for ray in first.windows(2) {
            pair_up(&mut sorted[ray[0] as usize..ray[1] as usize], &mut intervals);
            starts.push(intervals.len() as u32);
        }
        Self { starts, intervals }
    }
}

fn common_mm(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    a.iter()
        .flat_map(|x| b.iter().map(|y| (x[1].min(y[1]) - x[0].max(y[0])).max(0.0)))
        .sum()
}

/// Pairs the crossings of one ray to intervals.
fn pair_up(crossings: &mut [(f64, bool)], intervals: &mut Vec<[f64; 2]>) {
    crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let (mut inside, mut from) = (0u32, 0.0);
    for &(depth, leaves) in crossings.iter() {
        match (leaves, inside) {
            (false, 0) => (inside, from) = (1, depth),
            (false, _) => inside += 1,
            (true, 0) => {}
            (true, 1) => {
                inside = 0;
                intervals.push([from, depth]);
            }
            (true, _) => inside -= 1,
        }
    }
}

/// Returns true if `c` lies left of the line from `p` to `q`. Swapping `p` and `q` gives exactly the
/// opposite, so a ray meets exactly one of two triangles that share an edge.
fn is_left(p: Vec3, q: Vec3, [x, y]: [f64; 2]) -> bool {
    let turn = |p: Vec3, q: Vec3| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
    if (p.x, p.y) < (q.x, q.y) {
        turn(p, q) >= 0.0
    } else {
        turn(q, p) < 0.0
    }
}

fn cross_triangle(grid: &Grid, [a, b, c]: [Vec3; 3], hits: &mut Vec<Hit>) {
    let (ab, ac) = (b - a, c - a);
    let area_doubled = ab.x * ac.y - ab.y * ac.x;
    if area_doubled == 0.0 {
        return;
    }
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let columns = grid.range(0, low.x, high.x);
    if columns.is_empty() {
        return;
    }
    // Along the rays, a face that turns left faces away from the viewer: there the ray leaves.
    let leaves = area_doubled > 0.0;
    let slope_u = (ab.z * ac.y - ac.z * ab.y) / area_doubled;
    let slope_v = (ac.z * ab.x - ab.z * ac.x) / area_doubled;
    for row in grid.range(1, low.y, high.y) {
        let y = grid.center(1, row);
        for column in columns.clone() {
            let x = grid.center(0, column);
            let at = [x, y];
            if is_left(a, b, at) == leaves && is_left(b, c, at) == leaves && is_left(c, a, at) == leaves {
                // Faces almost parallel to the ray have steep slopes; the corners bound the depth.
                let depth = (a.z + slope_u * (x - a.x) + slope_v * (y - a.y)).clamp(low.z, high.z);
                hits.push(Hit {
                    pixel: (row * grid.n[0] + column) as u32,
                    leaves,
                    depth,
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use shellock_geom::Volume;
    use shellock_testkit::shapes::cuboid;

    use super::*;

    #[test]
    fn ray_lengths_add_up_to_volumes_of_solids_and_of_their_common_part() {
        let holed = cuboid([0.0; 3], [8.0; 3]).subtract(&cuboid([3.0, -1.0, 3.0], [5.0, 9.0, 5.0]));
        let other = cuboid([4.1; 3], [11.0, 7.3, 9.0]);
        for s in [Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::new(-1.0, 1.0, 1.0)] {
            let frame = Frame::along(s.normalize());
            let projected = |v: &Volume| -> (Vec<Vec3>, Vec<[u32; 3]>) {
                let mesh = v.to_mesh();
                (
                    mesh.points.iter().map(|&p| frame.project(p)).collect(),
                    mesh.triangles,
                )
            };
            let (p, q) = (projected(&holed), projected(&other));
            let grid = Grid::cover(Aabb::around(p.0.iter().copied()), 0.1);
            let (p, q) = (
                Columns::of(&grid, &p.0, &p.1, Vec3::ZERO),
                Columns::of(&grid, &q.0, &q.1, Vec3::ZERO),
            );
            let (volume, common) = (
                p.length_mm() * grid.cell_mm2(),
                p.common_length_mm(&q) * grid.cell_mm2(),
            );
            assert!((volume - holed.volume()).abs() < 0.5, "{volume}");
            assert!(
                (common - holed.intersect(&other).volume()).abs() < 0.3,
                "{common}"
            );
        }
    }
}
