//! Tests of paths and overlaps by parallel rays through the pieces.
//!
//! Along each ray, a piece is a list of stretches inside it. A piece that leaves along the rays hits another
//! one exactly if, on some ray, a stretch of the other is not behind its own. Rays are [`PIXEL_MM`] apart, so
//! an obstacle that covers a block of two by two rays is certain to be real. Single rays hit the slivers that
//! rounding leaves along walls parallel to the path, and count with their area only.

use crate::Tested;
use crate::mesh::Mesh;
use crate::vector::{Vec3, cross, dot, norm, scale};

/// Distance between neighbouring rays, mm.
const PIXEL_MM: f64 = 0.25;
/// Greatest overlap of two stretches that counts as rounding, mm.
const ROUNDING_MM: f64 = 0.02;
/// Greatest share of a piece's shadow in which single rays may find an obstacle.
const SLIVERS: f64 = 1e-3;
/// Area that is always allowed for single rays, mm², for small pieces.
const SLIVERS_MM2: f64 = 1.0;
/// Greatest number of rays: 2.5 m by 2.5 m.
const MOST_RAYS: usize = 100_000_000;
/// Direction of the rays for overlaps, parallel to no face of a common model.
const OBLIQUE: Vec3 = [0.3713, 0.5219, 0.7680];

/// Tests that piece `moving` can leave along `direction` past the `others`, which stay.
pub fn test_path(meshes: &[Mesh], moving: usize, direction: Vec3, others: &[usize]) -> Tested {
    if (norm(direction) - 1.0).abs() > 1e-6 {
        return Err("the direction is no unit vector".into());
    }
    let mesh = meshes.get(moving).ok_or("there is no such piece")?;
    let grid = Grid::around(direction, [mesh])?;
    let own = grid.stretches(mesh);
    let mut is_blocked = vec![false; grid.n[0] * grid.n[1]];
    for &other in others {
        let theirs = grid.stretches(&meshes[other]);
        visit_pairs(&own, &theirs, |pixel, mine, other| {
            let past_mm = (other[1] - mine[0])
                .min(other[1] - other[0])
                .min(mine[1] - mine[0]);
            if past_mm > ROUNDING_MM {
                is_blocked[pixel] = true;
            }
        });
    }
    let mut shadow = own.iter().map(|s| s.pixel).collect::<Vec<_>>();
    shadow.dedup();
    verdict(&grid, &is_blocked, shadow.len(), "in its way")
}

/// Tests that no two pieces overlap at rest, except where they are `pressed` on purpose. `pressed` takes two
/// pieces and a place that they share.
pub fn test_apart(meshes: &[Mesh], pressed: impl Fn([usize; 2], Vec3) -> bool) -> Tested {
    let length = norm(OBLIQUE);
    let grid = Grid::around(scale(OBLIQUE, 1.0 / length), meshes)?;
    let mut all: Vec<(usize, Stretch)> = Vec::new();
    meshes
        .iter()
        .enumerate()
        .for_each(|(i, mesh)| all.extend(grid.stretches(mesh).into_iter().map(|s| (i, s))));
    all.sort_by(|(_, s), (_, t)| s.pixel.cmp(&t.pixel).then(s.inside[0].total_cmp(&t.inside[0])));
    let mut is_shared = vec![false; grid.n[0] * grid.n[1]];
    let by_ray = || all.chunk_by(|(_, s), (_, t)| s.pixel == t.pixel);
    for stretches in by_ray() {
        let (mut end, mut last) = (f64::NEG_INFINITY, 0);
        for (i, s) in stretches {
            let until = end.min(s.inside[1]);
            let midway = || grid.place(s.pixel, 0.5 * (s.inside[0] + until));
            if until - s.inside[0] > ROUNDING_MM && !pressed([last, *i], midway()) {
                is_shared[s.pixel] = true;
            }
            if s.inside[1] > end {
                (end, last) = (s.inside[1], *i);
            }
        }
    }
    let n_rays = by_ray().count();
    verdict(&grid, &is_shared, n_rays, "shared")
}

fn verdict(grid: &Grid, is_hit: &[bool], n_rays: usize, what: &str) -> Tested {
    if n_rays == 0 {
        return Err("no ray meets a piece".into());
    }
    let n_hit = is_hit.iter().filter(|&&hit| hit).count();
    let width = grid.n[0];
    let is_block = |&i: &usize| {
        [i, i + 1, i + width, i + width + 1]
            .iter()
            .all(|&k| is_hit.get(k) == Some(&true))
    };
    let n_blocks = (0..is_hit.len()).filter(is_block).count();
    let cell_mm2 = PIXEL_MM * PIXEL_MM;
    let (area_mm2, most_mm2) = (
        n_hit as f64 * cell_mm2,
        SLIVERS_MM2.max(SLIVERS * n_rays as f64 * cell_mm2),
    );
    let figure = format!("{n_hit} of {n_rays} rays find something {what}, {n_blocks} blocks of four");
    if n_blocks > 0 || area_mm2 > most_mm2 {
        Err(figure)
    } else {
        Ok(figure)
    }
}

/// Stretch of a ray inside a body.
struct Stretch {
    pixel: usize,
    /// Depths at which the ray enters and leaves, mm.
    inside: [f64; 2],
}

/// Calls `visit` with every two stretches on the same ray. Both lists are sorted by pixel.
fn visit_pairs(a: &[Stretch], b: &[Stretch], mut visit: impl FnMut(usize, [f64; 2], [f64; 2])) {
    let mut from = 0;
    for s in a {
        while from < b.len() && b[from].pixel < s.pixel {
            from += 1;
        }
        b[from..]
            .iter()
            .take_while(|t| t.pixel == s.pixel)
            .for_each(|t| visit(s.pixel, s.inside, t.inside));
    }
}

/// Parallel rays through the centres of square pixels.
struct Grid {
    axes: [Vec3; 3],
    origin: [f64; 2],
    n: [usize; 2],
}

impl Grid {
    /// Builds a grid that covers the shadow of `meshes`, with rays along `direction`, a unit vector. An error
    /// if that takes too many rays.
    fn around<'a>(direction: Vec3, meshes: impl IntoIterator<Item = &'a Mesh>) -> Result<Self, String> {
        // Rows are parallel to no wall of an axis-aligned model, so that a wall along the path is not hit by
        // a whole row at once.
        let across =
            [[0.4217, -0.2873, 0.8600], [-0.7712, 0.4391, 0.4608]].map(|slant| cross(direction, slant));
        let u = if norm(across[0]) > norm(across[1]) {
            across[0]
        } else {
            across[1]
        };
        let u = scale(u, 1.0 / norm(u));
        let mut grid = Self {
            axes: [u, cross(direction, u), direction],
            origin: [0.0; 2],
            n: [0; 2],
        };
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for corner in meshes.into_iter().flat_map(|m| m.triangles.iter().flatten()) {
            let p = grid.project(*corner);
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]));
            }
        }
        // An empty shadow has no pixels.
        let n = |k: usize| {
            if low[k] <= high[k] {
                ((high[k] - low[k]) / PIXEL_MM).ceil() as usize + 1
            } else {
                0
            }
        };
        (grid.n, grid.origin) = ([n(0), n(1)], low);
        match grid.n[0].checked_mul(grid.n[1]) {
            Some(n_rays) if n_rays <= MOST_RAYS => Ok(grid),
            _ => Err(format!(
                "a shadow of {:.0} × {:.0} mm is too large",
                high[0] - low[0],
                high[1] - low[1]
            )),
        }
    }

    /// Coordinates across the rays, and depth.
    fn project(&self, p: Vec3) -> Vec3 {
        self.axes.map(|axis| dot(axis, p))
    }

    /// Point of a ray at a depth, mm.
    fn place(&self, pixel: usize, depth_mm: f64) -> Vec3 {
        let at = [pixel % self.n[0], pixel / self.n[0]].map(|k| k as f64 * PIXEL_MM);
        let along = [at[0] + self.origin[0], at[1] + self.origin[1], depth_mm];
        std::array::from_fn(|k| (0..3).map(|axis| along[axis] * self.axes[axis][k]).sum())
    }

    /// Stretches inside a closed mesh, sorted by pixel, then by depth. Inside-out parts count as inside,
    /// since printers may fill them.
    fn stretches(&self, mesh: &Mesh) -> Vec<Stretch> {
        let mut crossings: Vec<(usize, f64, i32)> = Vec::new();
        mesh.triangles
            .iter()
            .for_each(|t| self.cross_triangle(t.map(|p| self.project(p)), &mut crossings));
        crossings.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut stretches = Vec::new();
        for ray in crossings.chunk_by(|a, b| a.0 == b.0) {
            let (mut depth, mut start) = (0, 0.0);
            for &(pixel, at, step) in ray {
                if depth == 0 {
                    start = at;
                }
                depth += step;
                if depth == 0 {
                    stretches.push(Stretch {
                        pixel,
                        inside: [start, at],
                    });
                }
            }
        }
        stretches
    }

    /// Adds the rays that cross a triangle. Its rows have half-open ends that neighbours share to the last
    /// bit.
    fn cross_triangle(&self, t: [Vec3; 3], crossings: &mut Vec<(usize, f64, i32)>) {
        let at = |p: Vec3| {
            [
                (p[0] - self.origin[0]) / PIXEL_MM,
                (p[1] - self.origin[1]) / PIXEL_MM,
            ]
        };
        let corners = t.map(at);
        let misses = |k: usize| {
            let end = self.n[k] as f64;
            corners.iter().all(|c| c[k] < 0.0) || corners.iter().all(|c| c[k] > end)
        };
        if misses(0) || misses(1) {
            return;
        }
        let [[ax, ay], [bx, by], [cx, cy]] = corners;
        let twice_area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
        if twice_area == 0.0 {
            return;
        }
        let [slope_x, slope_y] = [
            ((t[1][2] - t[0][2]) * (cy - ay) - (t[2][2] - t[0][2]) * (by - ay)) / twice_area,
            ((t[2][2] - t[0][2]) * (bx - ax) - (t[1][2] - t[0][2]) * (cx - ax)) / twice_area,
        ];
        // Outward normals against the rays are entries.
        let step = if twice_area < 0.0 { 1 } else { -1 };
        let rows =
            [ay.min(by).min(cy), ay.max(by).max(cy)].map(|y| y.ceil().clamp(0.0, self.n[1] as f64) as usize);
        for row in rows[0]..rows[1] {
            let y = row as f64;
            let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
            for k in 0..3 {
                let (mut p, mut q) = (corners[k], corners[(k + 1) % 3]);
                if p[1] > q[1] {
                    (p, q) = (q, p);
                }
                if p[1] <= y && y < q[1] {
                    let x = p[0] + (q[0] - p[0]) * ((y - p[1]) / (q[1] - p[1]));
                    ends = [ends[0].min(x), ends[1].max(x)];
                }
            }
            let columns = ends.map(|x| x.ceil().clamp(0.0, self.n[0] as f64) as usize);
            for column in columns[0]..columns[1] {
                let depth = t[0][2] + slope_x * (column as f64 - ax) + slope_y * (y - ay);
                crossings.push((row * self.n[0] + column, depth, step));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PressFit;
    use crate::gap::is_pressed;
    use crate::mesh::tests::cuboid;

    /// Two cubes of 3 mm, one `deep_mm` in the other, with a press fit of 0.08 mm in the middle of the
    /// overlap.
    fn pressed_cubes(deep_mm: f64) -> Tested {
        let meshes = [
            cuboid([0.0; 3], [3.0; 3]),
            cuboid([0.0, 0.0, 3.0 - deep_mm], [3.0, 3.0, 6.0]),
        ];
        let fit = PressFit {
            piece: 1,
            at: [1.5, 1.5, 3.0],
            interference_mm: 0.08,
        };
        test_apart(&meshes, |pair, at| {
            is_pressed(&meshes, std::slice::from_ref(&fit), pair, at)
        })
    }

    #[test]
    fn what_two_pieces_share_is_refuted_unless_a_press_fit_covers_it_and_is_as_shallow() {
        assert!(pressed_cubes(0.08).is_ok());
        assert!(pressed_cubes(1.0).is_err(), "too deep for a press fit");
        let meshes = [
            cuboid([0.0; 3], [3.0; 3]),
            cuboid([0.0, 0.0, 2.92], [3.0, 3.0, 6.0]),
        ];
        assert!(test_apart(&meshes, |_, _| false).is_err(), "no press fit");
    }
}
