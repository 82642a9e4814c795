//! Narrow band: the grid nodes near a surface, on which all sampled fields are stored.
//!
//! A field is a `Vec<f32>` with one value per node. Only nodes within a given distance of the surface exist,
//! so memory and time grow with the surface. Nodes are stored row by row (x fastest, then y, then z), in runs
//! of consecutive x.

use rayon::prelude::*;

use crate::signed_distance::{SignedDistance, SurfaceDistance};
use crate::{Aabb, Vec3};

/// Marks a missing node.
pub(crate) const NONE: u32 = u32::MAX;

/// Run of consecutive nodes of one row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// Grid index of the first node along x.
    pub(crate) i0: u32,
    /// Index of the first node in a field.
    pub(crate) first: u32,
    /// Number of nodes in the run.
    pub(crate) len: u32,
}

/// Narrow band of grid nodes near a surface.
pub struct Band {
    pub(crate) origin: Vec3,
    pub(crate) cell_mm: f64,
    pub(crate) dims: [usize; 3],
    /// Runs of row (j, k) are `runs[row_start[r] .. row_start[r + 1]]` with `r = j + ny·k`.
    pub(crate) row_start: Vec<u32>,
    pub(crate) runs: Vec<Run>,
    pub(crate) coords: Vec<[u16; 3]>,
    /// Neighbours of each node at y − 1, y + 1, z − 1, z + 1.
    sides: Vec<[u32; 4]>,
}

/// Error: the grid would have too many nodes along an axis.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "a grid of {cell_mm} mm along {size_mm:.1} mm has more than 65 000 steps; use a coarser grid or a \
     smaller model"
)]
pub struct GridTooFine {
    cell_mm: f64,
    size_mm: f64,
}

impl Band {
    /// Creates the band of nodes with a signed distance in [−`outside_mm`, `inside_mm`] to the surface within
    /// `bounds`. Also returns that distance, positive inside, as a first field. Blocks of nodes that lie
    /// deeper than `exact_mm` get distances extrapolated from their middle to first order, since the exact
    /// depth of such nodes does not matter.
    pub fn along(
        surface: &SignedDistance,
        bounds: Aabb,
        cell_mm: f64,
        outside_mm: f64,
        inside_mm: f64,
        exact_mm: f64,
    ) -> Result<(Self, Vec<f32>), GridTooFine> {
        let room = bounds.grown(outside_mm + 2.0 * cell_mm);
        let dims = room.size().to_array().map(|s| (s / cell_mm).ceil() as usize + 1);
        if dims.iter().any(|&n| n > usize::from(u16::MAX) - 1) {
            return Err(GridTooFine {
                cell_mm,
                size_mm: bounds.size().max_element(),
            });
        }
        let rule = BandRule {
            surface,
            origin: room.min,
            cell_mm,
            dims,
            outside_mm,
            inside_mm,
            exact_mm,
        };
        let blocks = rule.blocks();
        let mut found: Vec<(u64, f32)> = blocks.par_iter().flat_map_iter(|&b| rule.nodes_of(b)).collect();
        found.par_sort_unstable_by_key(|n| n.0);
        let keys: Vec<u64> = found.iter().map(|n| n.0).collect();
        let distance = found.into_iter().map(|n| n.1).collect();
        Ok((Self::from_keys(room.min, cell_mm, dims, &keys), distance))
    }

    fn from_keys(origin: Vec3, cell_mm: f64, dims: [usize; 3], keys: &[u64]) -> Self {
        let [nx, ny, nz] = dims;
        let mut runs: Vec<Run> = Vec::new();
        let mut row_start = vec![0u32; ny * nz + 1];
        let mut coords = Vec::with_capacity(keys.len());
        let mut last = None;
        for (node, &key) in keys.iter().enumerate() {
            let (row, i) = ((key / nx as u64) as usize, (key % nx as u64) as usize);
            if last == Some(key.wrapping_sub(1)) && i > 0 {
                runs.last_mut().expect("a run was begun").len += 1;
            } else {
                runs.push(Run {
                    i0: i as u32,
                    first: node as u32,
                    len: 1,
                });
                row_start[row + 1] += 1;
            }
            coords.push([i as u16, (row % ny) as u16, (row / ny) as u16]);
            last = Some(key);
        }
        for r in 0..ny * nz {
            row_start[r + 1] += row_start[r];
        }
        let mut band = Self {
            origin,
            cell_mm,
            dims,
            row_start,
            runs,
            coords,
            sides: Vec::new(),
        };
        band.sides = band
            .coords
            .par_iter()
            .map(|&[i, j, k]| {
                let [i, j, k] = [i, j, k].map(i64::from);
                [(0, -1), (0, 1), (-1, 0), (1, 0)]
                    .map(|(dk, dj)| band.node_at([i, j + dj, k + dk]).unwrap_or(NONE))
            })
            .map(|[y0, y1, z0, z1]| [y0, y1, z0, z1])
            .collect();
        band
    }

    /// Number of nodes in the band.
    pub fn len(&self) -> usize {
        self.coords.len()
    }

    /// Returns true if the band has no nodes.
    pub fn is_empty(&self) -> bool {
        self.coords.is_empty()
    }

    /// Distance between neighbouring nodes, mm.
    pub fn cell_mm(&self) -> f64 {
        self.cell_mm
    }

    /// Position of node `node`, mm.
    pub fn position(&self, node: usize) -> Vec3 {
        let [i, j, k] = self.coords[node].map(f64::from);
        self.origin + self.cell_mm * Vec3::new(i, j, k)
    }

    /// Index of the block of `edge`³ grid nodes that contains `node`, along each axis.
    pub fn block(&self, node: usize, edge: u16) -> [u16; 3] {
        self.coords[node].map(|x| x / edge)
    }

    /// Node at grid coordinates `[i, j, k]`, if the band has it.
    pub(crate) fn node_at(&self, [i, j, k]: [i64; 3]) -> Option<u32> {
        let [nx, ny, nz] = self.dims.map(|n| n as i64);
        if i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz {
            return None;
        }
        let row = (j + ny * k) as usize;
        let runs = &self.runs[self.row_start[row] as usize..self.row_start[row + 1] as usize];
        let at = runs.partition_point(|r| i64::from(r.i0) <= i);
        let run = runs[..at].last()?;
        let offset = i - i64::from(run.i0);
        (offset < i64::from(run.len)).then_some(run.first + offset as u32)
    }

    /// Neighbour of `node` at a step of −1, 0 or 1 along each axis. `None` if the band lacks it, or lacks a
    /// node on the path there: first along y, then z, then x.
    pub(crate) fn neighbour(&self, node: u32, [dx, dy, dz]: [i32; 3]) -> Option<u32> {
        let mut at = node;
        if dy != 0 {
            at = self.sides[at as usize][usize::from(dy > 0)];
            if at == NONE {
                return None;
            }
        }
        if dz != 0 {
            at = self.sides[at as usize][2 + usize::from(dz > 0)];
            if at == NONE {
                return None;
            }
        }
        if dx != 0 {
            let next = at.wrapping_add_signed(dx);
            let here = self.coords[at as usize];
            let there = *self.coords.get(next as usize)?;
            let same_row = here[1..] == there[1..];
            if !same_row || i32::from(there[0]) != i32::from(here[0]) + dx {
                return None;
            }
            at = next;
        }
        Some(at)
    }

    /// Nodes around `node`, at most 26: those with a path in the band along y, then z, then x.
    pub fn all_neighbours(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        (0..27)
            .filter(|&i| i != 13)
            .filter_map(move |i| self.neighbour(node, [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1]))
    }

    /// Nodes next to `node` along the axes, at most six.
    pub fn face_neighbours(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        let along_x = [-1, 1]
            .into_iter()
            .filter_map(move |dx| self.neighbour(node, [dx, 0, 0]));
        along_x.chain(self.sides[node as usize].into_iter().filter(|&n| n != NONE))
    }

    /// Interpolates `field` at `p` trilinearly, ignoring corners outside the band. `None` if all eight
    /// corners are missing.
    pub fn sample(&self, field: &[f32], p: Vec3) -> Option<f64> {
        let q = (p - self.origin) / self.cell_mm;
        let base = q.floor();
        let t = q - base;
        let [i, j, k] = base.to_array().map(|x| x as i64);
        let (mut sum, mut weight) = (0.0, 0.0);
        for c in 0..8i64 {
            let [a, b, d] = [c & 1, c >> 1 & 1, c >> 2];
            let Some(node) = self.node_at([i + a, j + b, k + d]) else {
                continue;
            };
            let share = |bit: i64, t: f64| if bit == 1 { t } else { 1.0 - t };
            // A corner with zero weight still provides the value if all others are missing.
            let w = (share(a, t.x) * share(b, t.y) * share(d, t.z)).max(1e-9);
            sum += w * f64::from(field[node as usize]);
            weight += w;
        }
        (weight > 0.0).then(|| sum / weight)
    }

    /// Gradient of `field` at `p` by central differences of the trilinear interpolant, in units of `field`
    /// per mm. A component is zero if a sample lies outside the band.
    pub fn gradient(&self, field: &[f32], p: Vec3) -> Vec3 {
        let h = 0.5 * self.cell_mm;
        Vec3::from_array([Vec3::X, Vec3::Y, Vec3::Z].map(|axis| {
            match (self.sample(field, p + h * axis), self.sample(field, p - h * axis)) {
                (Some(a), Some(b)) => (a - b) / (2.0 * h),
                _ => 0.0,
            }
        }))
    }

    /// Extracts the part of the band inside `room` as a new band. Also returns the old index of each new
    /// node.
    pub fn part_in(&self, room: Aabb) -> (Self, Vec<u32>) {
        let index = |p: Vec3| ((p - self.origin) / self.cell_mm).to_array();
        let low = index(room.min).map(|x| x.ceil().max(0.0) as usize);
        let high: [usize; 3] = std::array::from_fn(|a| {
            let past = (index(room.max)[a].floor() + 1.0).max(0.0) as usize;
            past.clamp(low[a].min(self.dims[a]), self.dims[a])
        });
        let dims: [usize; 3] = std::array::from_fn(|a| high[a].saturating_sub(low[a]));
        let (mut nodes, mut keys) = (Vec::new(), Vec::new());
        for (k, j) in (low[2]..high[2]).flat_map(|k| (low[1]..high[1]).map(move |j| (k, j))) {
            let row = j + self.dims[1] * k;
            for run in &self.runs[self.row_start[row] as usize..self.row_start[row + 1] as usize] {
                let from = (run.i0 as usize).max(low[0]);
                let to = (run.i0 as usize + run.len as usize).min(high[0]);
                for i in from..to {
                    nodes.push(run.first + (i - run.i0 as usize) as u32);
                    keys.push(((i - low[0]) + dims[0] * ((j - low[1]) + dims[1] * (k - low[2]))) as u64);
                }
            }
        }
        let origin = self.origin + self.cell_mm * Vec3::from_array(low.map(|x| x as f64));
        (Self::from_keys(origin, self.cell_mm, dims, &keys), nodes)
    }

    /// Nodes inside `b`, in ascending order.
    pub fn nodes_in(&self, b: Aabb) -> Vec<u32> {
        (0..self.len() as u32)
            .into_par_iter()
            .filter(|&n| b.contains(self.position(n as usize)))
            .collect()
    }
}

/// Rule that decides which nodes belong to a band.
struct BandRule<'a> {
    surface: &'a SignedDistance,
    origin: Vec3,
    cell_mm: f64,
    dims: [usize; 3],
    outside_mm: f64,
    inside_mm: f64,
    exact_mm: f64,
}

/// Edge lengths, in nodes, of coarse blocks and of the fine blocks into which they are split.
const COARSE: usize = 16;
const FINE: usize = 4;

impl BandRule<'_> {
    fn position(&self, ijk: [usize; 3]) -> Vec3 {
        self.origin + self.cell_mm * Vec3::from_array(ijk.map(|x| x as f64))
    }

    /// Signed distance at the middle of a block; `None` if no node of the block can belong to the band.
    fn reach(&self, corner: [usize; 3], edge: usize) -> Option<SurfaceDistance> {
        let half = 0.5 * (edge - 1) as f64 * self.cell_mm;
        let radius = half * 3f64.sqrt();
        let farthest = self.inside_mm.max(self.outside_mm) + radius;
        let d = self.surface.at(self.position(corner) + half, farthest)?;
        (d.signed_mm >= -self.outside_mm - radius && d.signed_mm <= self.inside_mm + radius).then_some(d)
    }

    fn blocks(&self) -> Vec<[usize; 3]> {
        let n = self.dims.map(|d| d.div_ceil(COARSE));
        let coarse: Vec<[usize; 3]> = (0..n[0] * n[1] * n[2])
            .map(|b| [b % n[0], b / n[0] % n[1], b / n[0] / n[1]].map(|x| x * COARSE))
            .collect();
        coarse
            .par_iter()
            .filter(|&&b| self.reach(b, COARSE).is_some())
            .flat_map_iter(|&[i, j, k]| {
                let steps = || (0..COARSE).step_by(FINE);
                steps().flat_map(move |dk| {
                    steps().flat_map(move |dj| steps().map(move |di| [i + di, j + dj, k + dk]))
                })
            })
            .collect()
    }

    /// Nodes of the block that belong to the band, as pairs of row-major key and signed distance.
    fn nodes_of(&self, corner: [usize; 3]) -> Vec<(u64, f32)> {
        let mut nodes = Vec::new();
        let Some(middle) = self.reach(corner, FINE) else {
            return nodes;
        };
        let half = 0.5 * (FINE - 1) as f64 * self.cell_mm;
        let center = self.position(corner) + half;
        let is_deep = middle.signed_mm > self.exact_mm + half * 3f64.sqrt();
        let inwards = (center - middle.point).normalize_or_zero();
        let [nx, ny, nz] = self.dims;
        for k in corner[2]..(corner[2] + FINE).min(nz) {
            for j in corner[1]..(corner[1] + FINE).min(ny) {
                for i in corner[0]..(corner[0] + FINE).min(nx) {
                    let p = self.position([i, j, k]);
                    let signed_mm = if is_deep {
                        middle.signed_mm + (p - center).dot(inwards)
                    } else {
                        // Distance is 1-Lipschitz, so the distance at the middle bounds the search.
                        let bound = (middle.signed_mm.abs() + p.distance(center)) * (1.0 + 1e-9) + 1e-9;
                        let Some(d) = self.surface.at(p, bound) else {
                            continue;
                        };
                        d.signed_mm
                    };
                    if signed_mm >= -self.outside_mm && signed_mm <= self.inside_mm {
                        nodes.push((((k * ny + j) * nx + i) as u64, signed_mm as f32));
                    }
                }
            }
        }
        nodes
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::Solid;
    use crate::samples::cuboid;

    /// Band of the cube [0, 8]³ with h = 0.5, and its distance field.
    pub(crate) fn cube_band() -> (Band, Vec<f32>) {
        let b = Aabb {
            min: Vec3::ZERO,
            max: Vec3::splat(8.0),
        };
        let solid = Solid::new(cuboid(b.min, b.max).to_mesh()).unwrap();
        Band::along(&SignedDistance::new(&solid), b, 0.5, 1.3, 2.6, 2.6).unwrap()
    }

    #[test]
    fn the_band_is_exactly_the_nodes_within_its_distances() {
        let (band, phi) = cube_band();
        let b = Aabb {
            min: Vec3::ZERO,
            max: Vec3::splat(8.0),
        };
        let signed = |p: Vec3| {
            if b.contains(p) {
                (p - b.min).min(b.max - p).min_element()
            } else {
                -b.distance_sq(p).sqrt()
            }
        };
        let [nx, ny, nz] = band.dims.map(|n| n as i64);
        for (i, j, k) in (0..nx).flat_map(|i| (0..ny).flat_map(move |j| (0..nz).map(move |k| (i, j, k)))) {
            let p = band.origin + 0.5 * Vec3::new(i as f64, j as f64, k as f64);
            let expected = signed(p);
            match band.node_at([i, j, k]) {
                Some(n) => assert!((f64::from(phi[n as usize]) - expected).abs() < 1e-6),
                None => assert!(!(-1.299..=2.599).contains(&expected), "{p} at {expected}"),
            }
        }
    }

    #[test]
    fn samples_interpolate_and_gradients_point_inwards() {
        let (band, phi) = cube_band();
        let p = Vec3::new(1.13, 4.0, 4.2);
        assert!((band.sample(&phi, p).unwrap() - 1.13).abs() < 1e-5);
        assert!((band.gradient(&phi, p) - Vec3::X).length() < 1e-5);
        assert_eq!(band.sample(&phi, Vec3::splat(4.0)), None);
    }

    #[test]
    fn neighbours_are_where_they_should_be() {
        let (band, _) = cube_band();
        for node in (0..band.len() as u32).step_by(7) {
            for step in [[1, 0, 0], [-1, 1, 0], [0, -1, -1], [1, 1, 1]] {
                if let Some(other) = band.neighbour(node, step) {
                    let moved = band.position(other as usize) - band.position(node as usize);
                    assert!((moved - 0.5 * Vec3::from_array(step.map(f64::from))).length() < 1e-12);
                }
            }
        }
    }
}
