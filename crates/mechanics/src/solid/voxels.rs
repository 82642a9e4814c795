//! Filled share of each voxel of a closed mesh, from exact crossings of parallel lines with its triangles.

use std::collections::HashMap;

use shellock_geom::{TriMesh, Vec3};

/// Number of voxels along a cell's edge. Five give voxels of 0.5 mm in cells of 2.5 mm: a wall of 2 mm is
/// four of them.
pub(super) const SIDE: usize = 5;
/// Number of voxels in a cell.
pub(super) const N_VOXELS: usize = SIDE * SIDE * SIDE;

/// Number of lines along z through each voxel, along x and along y. Four by four locate a face parallel to
/// the lines to an eighth of a voxel, 0.06 mm.
const LINES: i64 = 4;

/// Position of a line in its square, as a share of its side. It is off-centre and differs between the axes,
/// so that lines meet no edge of a mesh with round coordinates.
const OFF_MIDDLE: [f64; 2] = [0.500_137_1, 0.500_271_9];

/// A cell by its number along each axis; cell (0, 0, 0) begins at the origin.
pub(super) type Cell = [i32; 3];

/// Filled voxels, cell by cell.
pub(super) struct Voxels {
    /// Cells with material, in ascending order.
    pub cells: Vec<Cell>,
    /// Fill of each cell's voxels, x fastest.
    pub fills: Vec<[Fill; N_VOXELS]>,
}

/// Material in a voxel: its share and its centroid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Fill {
    /// Filled share of the voxel, in [0, 1].
    pub share: f32,
    /// Centroid of the material relative to the voxel's centre, in voxels. Without it, a wall whose faces lie
    /// inside voxels is up to 12 % too stiff in bending, because its material counts as if farther out.
    pub middle: [f32; 3],
}

/// Computes the fill of the voxels, in cells of `cell_mm`: the points around which `mesh` has a positive
/// winding number.
///
/// Lines whose crossings do not cancel out, as where faces are missing, are skipped.
pub(super) fn voxels(mesh: &TriMesh, cell_mm: f64) -> Voxels {
    let pitch_mm = cell_mm / SIDE as f64 / LINES as f64;
    let mut crossings = crossings(mesh, pitch_mm);
    crossings.sort_by(|a, b| (a.0).cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut at_cell: HashMap<Cell, usize> = HashMap::new();
    let mut found: Vec<(Cell, [Fill; N_VOXELS])> = Vec::new();
    for line in crossings.chunk_by(|a, b| a.0 == b.0) {
        if line.iter().map(|c| i32::from(c.2)).sum::<i32>() != 0 {
            continue;
        }
        let [x, y] = line[0].0.map(|k| k.div_euclid(LINES));
        let aside = line[0]
            .0
            .map(|k| (k.rem_euclid(LINES) as f64 + 0.5) / LINES as f64 - 0.5);
        let mut winding = 0;
        for pair in line.windows(2) {
            winding += i32::from(pair[0].2);
            if winding > 0 {
                fill(
                    [x, y],
                    [pair[0].1, pair[1].1],
                    cell_mm,
                    |cell, voxel, share, height| {
                        let at = *at_cell.entry(cell).or_insert_with(|| {
                            found.push((cell, [Fill::default(); N_VOXELS]));
                            found.len() - 1
                        });
                        let fill = &mut found[at].1[voxel];
                        let share = (share / (LINES * LINES) as f64) as f32;
                        fill.share += share;
                        for (sum, own) in fill.middle.iter_mut().zip([aside[0], aside[1], height]) {
                            *sum += share * own as f32;
                        }
                    },
                );
            }
        }
    }
    found.sort_by_key(|c| c.0);
    for fill in found.iter_mut().flat_map(|c| c.1.iter_mut()) {
        // Sums of sixteenths reach 1 except for rounding.
        if fill.share > 0.999 {
            *fill = Fill {
                share: 1.0,
                middle: [0.0; 3],
            };
        } else if fill.share > 0.0 {
            fill.middle = fill.middle.map(|sum| sum / fill.share);
        }
    }
    let (cells, fills) = found.into_iter().unzip();
    Voxels { cells, fills }
}

/// Calls `add` for each voxel in column (x, y) that the stretch covers, with the cell, the voxel, the covered
/// share, and the height of its middle above the voxel's centre.
fn fill([x, y]: [i64; 2], [from, to]: [f64; 2], cell_mm: f64, mut add: impl FnMut(Cell, usize, f64, f64)) {
    let side = SIDE as i64;
    let (from, to) = (from / cell_mm * SIDE as f64, to / cell_mm * SIDE as f64);
    for z in from.floor() as i64..to.ceil() as i64 {
        let (low, high) = (from.max(z as f64), to.min((z + 1) as f64));
        let share = (high - low).max(0.0);
        let cell = [x, y, z].map(|k| k.div_euclid(side) as i32);
        let [i, j, k] = [x, y, z].map(|k| k.rem_euclid(side) as usize);
        add(
            cell,
            i + SIDE * (j + SIDE * k),
            share,
            0.5 * (low + high) - z as f64 - 0.5,
        );
    }
}

/// Line, height and sense (+1 where the upward line enters) of each crossing.
fn crossings(mesh: &TriMesh, pitch_mm: f64) -> Vec<([i64; 2], f64, i8)> {
    let mut found = Vec::new();
    let line = |k: i64, axis: usize| (k as f64 + OFF_MIDDLE[axis]) * pitch_mm;
    for face in 0..mesh.triangles.len() {
        let corners = mesh.corners(face);
        let range = |axis: usize| {
            let of = corners.map(|c| c[axis]);
            let (low, high) = (of[0].min(of[1]).min(of[2]), of[0].max(of[1]).max(of[2]));
            let first = (low / pitch_mm - OFF_MIDDLE[axis]).ceil() as i64;
            first..=(high / pitch_mm - OFF_MIDDLE[axis]).floor() as i64
        };
        for kx in range(0) {
            for ky in range(1) {
                if let Some((z, sense)) = crossing(corners, line(kx, 0), line(ky, 1)) {
                    found.push(([kx, ky], z, sense));
                }
            }
        }
    }
    found
}

fn crossing(corners: [Vec3; 3], x: f64, y: f64) -> Option<(f64, i8)> {
    // Signed area of an edge with the line. Both triangles of an edge get the same magnitude with opposite
    // signs.
    let edge = |a: Vec3, b: Vec3| {
        let is_swapped = (a.x, a.y, a.z) > (b.x, b.y, b.z);
        let (p, q) = if is_swapped { (b, a) } else { (a, b) };
        let area = (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
        if is_swapped { -area } else { area }
    };
    let [a, b, c] = corners;
    let w = [edge(b, c), edge(c, a), edge(a, b)];
    let total = w[0] + w[1] + w[2];
    let is_in = w.iter().all(|w| *w > 0.0) || w.iter().all(|w| *w < 0.0);
    (is_in && total != 0.0).then(|| {
        let z = (w[0] * a.z + w[1] * b.z + w[2] * c.z) / total;
        (z, if total > 0.0 { -1 } else { 1 })
    })
}
