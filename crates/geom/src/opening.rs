//! Parts of a solid that hang together only by thin bridges.
//!
//! The solid becomes voxels and is eroded by a ball. If the points that the ball's centre can reach fall
//! apart, the smaller parts hang on bridges thinner than the ball (an opening, in mathematical morphology).
//!
//! Voxels are bits: a row along x is a sequence of words, and erosion is a conjunction of shifted rows.
//! Layers are swept in z, and only as many are held as the ball is high, so memory follows the surface.

mod neck;

pub use neck::Neck;

use std::cmp::Reverse;
use std::collections::BTreeMap;

use crate::union_find::root;
use crate::{TriMesh, Vec3};

/// Offset of the voxel centres from round numbers, mm: surfaces with round coordinates pass between them.
const OFFSET_MM: Vec3 = Vec3::new(1.9e-5, 3.7e-5, 7.1e-5);

/// Rounding of a radius in voxels: one of three voxels reaches the third one.
const ROUNDING: f64 = 1e-9;

/// Greatest number of voxels along an axis. A mesh that needs more is larger than any print.
const MOST_VOXELS: f64 = 8192.0;

/// A part of a solid that hangs on a thin bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HangingPart {
    /// Volume that the centre of the ball reaches in the part, mm³.
    pub core_mm3: f64,
    /// Mean position of that volume, mm.
    pub at: Vec3,
    /// Joint with the rest; `None` if part or neck are so large that it is not measured.
    pub neck: Option<Neck>,
}

/// Finds the parts of a closed mesh that hang on bridges thinner than a ball, largest first; without the
/// largest part of all. Parts whose eroded volume is less than `least_mm3` do not count.
///
/// `whole` is a solid that contains the mesh. A bridge that is thin in the whole, too, does not count.
///
/// `ball_mm` is the ball's diameter, `voxel_mm` the edge of the voxels: a quarter of the diameter or less.
/// Where the mesh overlaps itself, the union counts. Empty for a mesh that is larger than 8192 voxels. Time
/// and memory are O(surface / voxel²), apart from a layer of voxels. The whole is read only if a part hangs.
pub fn hanging_parts(
    mesh: &TriMesh,
    whole: Option<&TriMesh>,
    ball_mm: f64,
    voxel_mm: f64,
    least_mm3: f64,
) -> Vec<HangingPart> {
    let radius = 0.5 * ball_mm / voxel_mm + ROUNDING;
    let parts_of = |mesh| Grid::around(mesh, voxel_mm).map(|grid| Parts::of(mesh, grid, radius));
    let Some(parts) = parts_of(mesh) else {
        return Vec::new();
    };
    let order = parts.by_size();
    let Some((&largest, smaller)) = order.split_first() else {
        return Vec::new();
    };
    let smaller = smaller.iter().map(|&id| (id, parts.hanging(id)));
    let mut hanging: Vec<(u32, HangingPart)> =
        smaller.filter(|(_, part)| part.core_mm3 > least_mm3).collect();
    if !hanging.is_empty()
        && let Some(whole) = whole.and_then(parts_of)
    {
        let with_largest = parts.home(largest, &whole);
        hanging.retain(|&(id, _)| parts.home(id, &whole) == with_largest);
    }
    let measured = hanging.into_iter().map(|(id, part)| HangingPart {
        neck: Neck::of(mesh, &parts, id, radius),
        ..part
    });
    measured.collect()
}

/// Positions of the voxels.
struct Grid {
    /// Position of the first voxel, in voxels from that at the origin; whole numbers.
    first: Vec3,
    voxel_mm: f64,
    n: [usize; 3],
}

impl Grid {
    /// Places voxels around a mesh; `None` if there would be too many. Grids of one voxel size share centres.
    fn around(mesh: &TriMesh, voxel_mm: f64) -> Option<Self> {
        let bounds = mesh.bounds();
        let size = bounds.size() / voxel_mm;
        if !(size.min_element() >= 0.0 && size.max_element() <= MOST_VOXELS) {
            return None;
        }
        let n = size.to_array().map(|n| n.ceil() as usize + 3);
        let first = (bounds.min / voxel_mm).floor() - Vec3::ONE;
        Some(Self { first, voxel_mm, n })
    }

    /// Coordinates in voxels from the first one.
    fn coordinates(&self, p: Vec3) -> Vec3 {
        (p - OFFSET_MM) / self.voxel_mm - self.first
    }

    /// Centre of the voxel with these coordinates, mm.
    fn centre(&self, coordinates: Vec3) -> Vec3 {
        self.voxel_mm * (self.first + coordinates) + OFFSET_MM
    }
}

/// A crossing of a row of voxels with the surface.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Crossing {
    z: u32,
    y: u32,
    /// First voxel behind the surface.
    x: u32,
    /// 1 where the row enters the solid, -1 where it leaves it.
    step: i32,
}

/// Crossings of all rows with the surface, in order of z, y and x.
///
/// Each edge is tested in the same direction from both of its triangles, so a row that passes an edge crosses
/// exactly one of them, and the steps of every row add up to zero.
fn crossings(mesh: &TriMesh, grid: &Grid) -> Vec<Crossing> {
    let points: Vec<Vec3> = mesh.points.iter().map(|&p| grid.coordinates(p)).collect();
    let mut found = Vec::new();
    for t in &mesh.triangles {
        let corners = t.map(|v| points[v as usize]);
        let low = corners[0].min(corners[1]).min(corners[2]);
        let high = corners[0].max(corners[1]).max(corners[2]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        for z in range(low.z, high.z, grid.n[2]) {
            for y in range(low.y, high.y, grid.n[1]) {
                let at = [y as f64, z as f64];
                let sides = [0, 1, 2].map(|i| is_left([t[i], t[(i + 1) % 3]], &points, at));
                if sides[0] != sides[1] || sides[1] != sides[2] {
                    continue;
                }
                let past = (corners[0].y - at[0]) * normal.y + (corners[0].z - at[1]) * normal.z;
                // A triangle seen edge-on may round to no area: any of its points will do.
                let along = if normal.x == 0.0 { 0.0 } else { past / normal.x };
                let x = (corners[0].x + along).clamp(low.x, high.x);
                found.push(Crossing {
                    z,
                    y,
                    x: x.ceil().clamp(0.0, grid.n[0] as f64) as u32,
                    step: if sides[0] { -1 } else { 1 },
                });
            }
        }
    }
    found.sort_unstable();
    found
}

/// Whole numbers from `low` to `high`, below `n`.
fn range(low: f64, high: f64, n: usize) -> std::ops::Range<u32> {
    let from = low.ceil().max(0.0) as u32;
    let to = ((high.floor() + 1.0).max(0.0) as u32).min(n as u32);
    from..to.max(from)
}

/// True if the point with the given y and z lies on the left of an edge, seen along x.
fn is_left([from, to]: [u32; 2], points: &[Vec3], [y, z]: [f64; 2]) -> bool {
    let (a, b) = (points[from.min(to) as usize], points[from.max(to) as usize]);
    let is_left = (b.y - a.y) * (z - a.z) - (b.z - a.z) * (y - a.y) > 0.0;
    is_left == (from < to)
}

/// A layer of voxels: rows of bits, one after the other.
type Layer = Vec<u64>;

/// A run of voxels that the ball's centre can reach.
#[derive(Clone, Copy)]
struct Run {
    y: u32,
    z: u32,
    x: [u32; 2],
}

/// The eroded solid, as runs in order of z, y and x.
struct Eroded {
    runs: Vec<Run>,
}

impl Eroded {
    /// Erodes by a ball whose radius is given in voxels.
    fn of(mesh: &TriMesh, grid: &Grid, radius: f64) -> Self {
        let crossings = crossings(mesh, grid);
        let [_, n_y, n_z] = grid.n;
        let reach = radius.floor() as usize;
        let n_words = grid.n[0].div_ceil(64);
        let half_widths = half_widths(radius);
        // For each of the layers within reach: its rows, eroded along x by each half width.
        let mut held: Vec<Vec<Layer>> = Vec::new();
        let empty: Vec<Layer> = vec![vec![0; n_words * n_y]; reach + 1];
        let mut next = 0;
        let mut runs = Vec::new();
        for z in 0..n_z + reach {
            let from = next;
            while next < crossings.len() && crossings[next].z as usize == z {
                next += 1;
            }
            held.push(eroded_along_x(&crossings[from..next], n_y, n_words, reach));
            if held.len() > 2 * reach + 1 {
                held.remove(0);
            }
            let Some(middle) = z.checked_sub(reach) else {
                continue;
            };
            let layer_at = |dz: i64| {
                let index = held.len() as i64 - 1 - reach as i64 + dz;
                usize::try_from(index)
                    .ok()
                    .and_then(|i| held.get(i))
                    .unwrap_or(&empty)
            };
            // Where the solid itself has no voxel, the eroded one has none.
            let own = layer_at(0).first().expect("a layer is held uneroded");
            let rows = (0..n_y).filter(|y| own[y * n_words..][..n_words].iter().any(|word| *word != 0));
            for y in rows {
                let mut row = vec![u64::MAX; n_words];
                for &([dy, dz], half_width) in &half_widths {
                    let other = y as i64 + dy;
                    let layer = &layer_at(dz)[half_width];
                    let is_inside = (0..n_y as i64).contains(&other);
                    for (i, word) in row.iter_mut().enumerate() {
                        *word &= if is_inside {
                            layer[other as usize * n_words + i]
                        } else {
                            0
                        };
                    }
                }
                runs.extend(runs_of(&row).map(|x| Run {
                    y: y as u32,
                    z: middle as u32,
                    x,
                }));
            }
        }
        Self { runs }
    }

    /// Labels the runs: those that touch, also at corners, have the same label.
    fn labels(&self) -> Vec<u32> {
        let mut parent: Vec<u32> = (0..self.runs.len() as u32).collect();
        for offset in [[-1, 0], [-1, -1], [0, -1], [1, -1]] {
            self.join_rows(offset, &mut parent);
        }
        (0..self.runs.len() as u32)
            .map(|i| root(&mut parent, i))
            .collect()
    }

    /// Joins each run with those of the row `dy` and `dz` away that it touches.
    fn join_rows(&self, [dy, dz]: [i64; 2], parent: &mut [u32]) {
        let key = |run: &Run| (i64::from(run.z), i64::from(run.y));
        let mut other = 0;
        for (i, run) in self.runs.iter().enumerate() {
            let row = (i64::from(run.z) + dz, i64::from(run.y) + dy);
            let ends_before = |r: &Run| key(r) < row || (key(r) == row && r.x[1] < run.x[0]);
            while other < i && ends_before(&self.runs[other]) {
                other += 1;
            }
            let touching = self.runs[other..i]
                .iter()
                .take_while(|r| key(r) == row && r.x[0] <= run.x[1]);
            for j in 0..touching.count() {
                let (a, b) = (root(parent, i as u32), root(parent, (other + j) as u32));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
    }
}

/// Connected parts of an eroded solid.
struct Parts {
    grid: Grid,
    runs: Vec<Run>,
    /// Part of each run, named by its first run.
    part_of: Vec<u32>,
}

impl Parts {
    fn of(mesh: &TriMesh, grid: Grid, radius: f64) -> Self {
        let eroded = Eroded::of(mesh, &grid, radius);
        let part_of = eroded.labels();
        Self {
            grid,
            runs: eroded.runs,
            part_of,
        }
    }

    /// All parts, the largest first.
    fn by_size(&self) -> Vec<u32> {
        let mut n_voxels: BTreeMap<u32, u64> = BTreeMap::new();
        for (run, &part) in self.runs.iter().zip(&self.part_of) {
            *n_voxels.entry(part).or_default() += u64::from(run.x[1] - run.x[0]);
        }
        let mut parts: Vec<(u32, u64)> = n_voxels.into_iter().collect();
        parts.sort_by_key(|&(part, n)| (Reverse(n), part));
        parts.into_iter().map(|(part, _)| part).collect()
    }

    fn runs_of(&self, part: u32) -> impl Iterator<Item = &Run> {
        let of_part = self.runs.iter().zip(&self.part_of);
        of_part.filter(move |(_, p)| **p == part).map(|(run, _)| run)
    }

    fn hanging(&self, part: u32) -> HangingPart {
        let (mut n, mut sum) = (0.0, Vec3::ZERO);
        for run in self.runs_of(part) {
            let [from, to] = run.x.map(f64::from);
            n += to - from;
            sum += (to - from) * Vec3::new(0.5 * (from + to - 1.0), f64::from(run.y), f64::from(run.z));
        }
        HangingPart {
            core_mm3: n * self.grid.voxel_mm.powi(3),
            at: self.grid.centre(sum / n),
            neck: None,
        }
    }

    /// Part of the `whole` that contains most runs of a part; `None` if none contains any.
    fn home(&self, part: u32, whole: &Self) -> Option<u32> {
        let mut n_runs: BTreeMap<u32, usize> = BTreeMap::new();
        for run in self.runs_of(part) {
            let middle = (run.x[0] + run.x[1]) / 2;
            let voxel = self.grid.first + Vec3::new(f64::from(middle), f64::from(run.y), f64::from(run.z));
            if let Some(home) = whole.part_at(voxel) {
                *n_runs.entry(home).or_default() += 1;
            }
        }
        let most = n_runs.into_iter().max_by_key(|&(home, n)| (n, Reverse(home)));
        most.map(|(home, _)| home)
    }

    /// Part at a voxel, given in voxels from that at the origin.
    fn part_at(&self, voxel: Vec3) -> Option<u32> {
        let own = voxel - self.grid.first;
        if own.min_element() < 0.0 {
            return None;
        }
        let [x, y, z] = own.to_array().map(|c| c as u32);
        let after = self
            .runs
            .partition_point(|run| (run.z, run.y, run.x[0]) <= (z, y, x));
        let i = after.checked_sub(1)?;
        let run = &self.runs[i];
        ((run.z, run.y) == (z, y) && x < run.x[1]).then(|| self.part_of[i])
    }
}

/// Rows of a ball of `radius` voxels: their offsets in y and z, and half their widths.
fn half_widths(radius: f64) -> Vec<([i64; 2], usize)> {
    let reach = radius.floor() as i64;
    let mut rows = Vec::new();
    for dz in -reach..=reach {
        for dy in -reach..=reach {
            let left = radius * radius - (dy * dy + dz * dz) as f64;
            if left >= 0.0 {
                rows.push(([dy, dz], left.sqrt().floor() as usize));
            }
        }
    }
    rows
}

/// Fills the rows of a layer between their crossings, and erodes them along x by 0, 1, … `reach` voxels to
/// both sides.
fn eroded_along_x(crossings: &[Crossing], n_y: usize, n_words: usize, reach: usize) -> Vec<Layer> {
    let mut solid = vec![0u64; n_words * n_y];
    let mut winding = 0;
    for pair in crossings.windows(2) {
        winding = if pair[0].y == pair[1].y {
            winding + pair[0].step
        } else {
            0
        };
        if winding > 0 {
            let row = &mut solid[pair[0].y as usize * n_words..][..n_words];
            fill(row, pair[0].x as usize..pair[1].x as usize);
        }
    }
    let mut layers = vec![solid];
    for _ in 0..reach {
        let last = layers.last().expect("there is a first layer");
        let next = last.chunks(n_words).flat_map(eroded_row).collect();
        layers.push(next);
    }
    layers
}

/// Sets the bits of a range.
fn fill(row: &mut [u64], range: std::ops::Range<usize>) {
    for (i, word) in row.iter_mut().enumerate() {
        let from = range.start.saturating_sub(64 * i).min(64);
        let to = range.end.saturating_sub(64 * i).min(64);
        if from < to {
            *word |= (u64::MAX >> (64 - (to - from))) << from;
        }
    }
}

/// A row whose bits are set where both neighbours and the bit itself are.
fn eroded_row(row: &[u64]) -> impl Iterator<Item = u64> {
    (0..row.len()).map(|i| {
        let before = if i > 0 { row[i - 1] >> 63 } else { 0 };
        let after = row.get(i + 1).map_or(0, |next| next << 63);
        row[i] & (row[i] << 1 | before) & (row[i] >> 1 | after)
    })
}

/// Ranges of set bits, from the first to one past the last.
fn runs_of(row: &[u64]) -> impl Iterator<Item = [u32; 2]> {
    let n = 64 * row.len() as u32;
    let next = move |from: u32, is_set: bool| {
        let mut at = from;
        while at < n {
            let word = row[at as usize / 64];
            let left = (if is_set { word } else { !word }) >> (at % 64);
            if left != 0 {
                return (at + left.trailing_zeros()).min(n);
            }
            at = 64 * (at / 64 + 1);
        }
        n
    };
    let mut at = 0;
    std::iter::from_fn(move || {
        let from = next(at, true);
        at = next(from, false);
        (from < n).then_some([from, at])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::cuboid;
    use crate::{Solid, Volume};

    /// Two blocks of 10 mm, 6 mm apart, with a bar between them.
    fn dumbbell(bar_mm: [f64; 2]) -> Volume {
        let [y, z] = bar_mm.map(|mm| 0.5 * mm);
        cuboid([0.0, -5.0, -5.0], [10.0, 5.0, 5.0])
            .union(&cuboid([16.0, -5.0, -5.0], [24.0, 5.0, 5.0]))
            .union(&cuboid([5.0, -y, -z], [20.0, y, z]))
    }

    #[test]
    fn a_part_hangs_if_the_bar_is_thinner_than_the_ball_in_one_direction() {
        for (bar, n) in [
            ([0.9, 5.0], 1),
            ([5.0, 0.9], 1),
            ([1.0, 1.0], 1),
            ([1.5, 1.5], 0),
            ([3.0, 4.0], 0),
        ] {
            let found = hanging_parts(&dumbbell(bar).to_mesh(), None, 1.2, 0.2, 5.0);
            assert_eq!(found.len(), n, "{bar:?}: {found:?}");
            for part in found {
                // Eroded by 0.6 mm on all sides: 6.8 x 8.8 x 8.8.
                assert!((part.core_mm3 - 526.6).abs() < 2.0, "{part:?}");
                assert!(part.at.distance(Vec3::new(20.0, 0.0, 0.0)) < 0.3, "{part:?}");
            }
        }
    }

    #[test]
    fn a_bridge_that_is_thin_in_the_whole_too_does_not_count() {
        let shell = dumbbell([0.9, 5.0]);
        let n_hanging =
            |whole: &Volume| hanging_parts(&shell.to_mesh(), Some(&whole.to_mesh()), 1.2, 0.2, 5.0).len();
        let blocks =
            cuboid([-1.0, -7.0, -7.0], [10.5, 7.0, 7.0]).union(&cuboid([15.0, -6.0, -6.0], [30.0, 6.0, 6.0]));
        let bar = |mm: f64| cuboid([5.0, -0.5 * mm, -3.0], [20.0, 0.5 * mm, 3.0]);
        assert_eq!(n_hanging(&shell), 0);
        assert_eq!(n_hanging(&blocks.union(&bar(0.9))), 0);
        assert_eq!(n_hanging(&blocks.union(&bar(2.0))), 1);
    }

    #[test]
    fn erosion_agrees_with_a_test_of_every_pair_of_voxels() {
        let mesh = dumbbell([1.3, 1.7]).to_mesh();
        let (radius, grid) = (2.5, Grid::around(&mesh, 0.5).unwrap());
        let solid = Solid::new(mesh.clone()).unwrap();
        let distance = crate::signed_distance::SignedDistance::new(&solid);
        let [n_x, n_y, n_z] = grid.n.map(|n| n as i64);
        let is_solid = |[x, y, z]: [i64; 3]| {
            let p = grid.centre(Vec3::new(x as f64, y as f64, z as f64));
            distance.at(p, 1e3).is_some_and(|d| d.signed_mm > 0.0)
        };
        let mut solids = std::collections::HashSet::new();
        for z in 0..n_z {
            for y in 0..n_y {
                solids.extend((0..n_x).map(|x| [x, y, z]).filter(|&v| is_solid(v)));
            }
        }
        let eroded = Eroded::of(&mesh, &grid, radius);
        let mut found: Vec<[i64; 3]> = Vec::new();
        for run in &eroded.runs {
            found.extend((run.x[0]..run.x[1]).map(|x| [i64::from(x), i64::from(run.y), i64::from(run.z)]));
        }
        let reach = radius.floor() as i64;
        let is_deep = |&[x, y, z]: &[i64; 3]| {
            let mut offsets = (-reach..=reach).flat_map(|dx| {
                (-reach..=reach).flat_map(move |dy| (-reach..=reach).map(move |dz| [dx, dy, dz]))
            });
            offsets.all(|[dx, dy, dz]| {
                ((dx * dx + dy * dy + dz * dz) as f64) > radius * radius
                    || solids.contains(&[x + dx, y + dy, z + dz])
            })
        };
        let mut expected: Vec<[i64; 3]> = solids.iter().copied().filter(is_deep).collect();
        let order = |v: &[i64; 3]| [v[2], v[1], v[0]];
        expected.sort_by_key(order);
        found.sort_by_key(order);
        assert_eq!(found, expected);
        assert!(!found.is_empty());
    }
}
