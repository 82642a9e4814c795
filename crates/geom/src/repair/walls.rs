//! Walls inside a body, such as CAD programs leave between parts that were joined. Both sides of such a wall
//! lie inside the body, so the wall bounds nothing.

use rayon::prelude::*;

use super::crossing::crossing_pairs;
use super::shells::solid_angle;
use super::{Draft, NEAR_SHARE, Repair, RepairKind};
use crate::check::{Groups, TriangleSide, inspect_edges, open_edges, sides};
use crate::{TriMesh, Vec3};

/// Largest number of solid angles summed to confirm that walls lie inside: some seconds' work. Beyond that,
/// walls stay and the mesh is rejected.
const MAX_WORK: usize = 200_000_000;

/// Removes open sheets that lie within a closed surface, whether they touch it or not.
///
/// A sheet that protrudes from the surface stays, and the mesh is rejected.
pub(super) fn drop_sheets(draft: &mut Draft) -> Option<Repair> {
    let mesh = &draft.mesh;
    let open = open_edges(mesh);
    if open.is_empty() {
        return None;
    }
    let mut patches = patches(mesh);
    let patch: Vec<u32> = (0..mesh.triangles.len() as u32)
        .map(|f| patches.find(f))
        .collect();
    let mut is_sheet_patch = vec![false; mesh.triangles.len()];
    for edge in &open {
        is_sheet_patch[patch[edge.face as usize] as usize] = true;
    }
    let is_sheet: Vec<bool> = patch.iter().map(|&p| is_sheet_patch[p as usize]).collect();
    let rest = part(mesh, |face| !is_sheet[face]);
    if rest.triangles.is_empty() || !inspect_edges(&rest).is_closed() {
        return None;
    }
    let shrunk = shrunk(mesh, &is_sheet);
    let comes_out = |&[a, b]: &[u32; 2]| is_sheet[a as usize] != is_sheet[b as usize];
    if crossing_pairs(&shrunk).iter().any(comes_out) {
        return None;
    }
    // A sheet without crossings lies on one side as a whole, so its first triangle decides for all.
    let firsts: Vec<u32> = (0..patch.len() as u32)
        .filter(|&face| patch[face as usize] == face && is_sheet[face as usize])
        .collect();
    are_inside(&rest, &shrunk, &firsts)?;
    let is_kept: Vec<bool> = is_sheet.iter().map(|sheet| !sheet).collect();
    Some(remove(draft, &is_kept))
}

/// Removes triangles between two parts of the inside of a closed surface, and turns the others outwards.
/// Applies if some edges have three or more triangles.
///
/// The surface divides space into cells, which are connected around its edges. All but the outermost cell are
/// inside.
pub(super) fn drop_partitions(draft: &mut Draft) -> Option<Repair> {
    let mesh = &draft.mesh;
    let sides = sides(mesh);
    let edges = || sides.chunk_by(TriangleSide::same_edge);
    if !edges().any(|edge| edge.len() > 2) {
        return None;
    }
    let n_faces = mesh.triangles.len();
    let mut complexes = Groups::of(n_faces);
    // Index 2 · face is the triangle's front, and 2 · face + 1 its back.
    let mut cells = Groups::of(2 * n_faces);
    for edge in edges() {
        edge[1..]
            .iter()
            .for_each(|side| complexes.unite(edge[0].face(), side.face()));
        join_around(mesh, edge, &mut cells);
    }
    let complex: Vec<u32> = (0..n_faces as u32).map(|face| complexes.find(face)).collect();
    let mut is_judged = vec![false; n_faces];
    edges()
        .filter(|edge| edge.len() > 2)
        .for_each(|edge| is_judged[complex[edge[0].face() as usize] as usize] = true);
    edges()
        .filter(|edge| edge.len() < 2)
        .for_each(|edge| is_judged[complex[edge[0].face() as usize] as usize] = false);
    let outer = outer_cells(mesh, &complex, &mut cells);
    let mut is_kept = vec![true; n_faces];
    let mut is_turned = vec![false; n_faces];
    for face in 0..n_faces {
        let of = complex[face] as usize;
        if is_judged[of] {
            let [front, back] = [0, 1].map(|side| cells.find(2 * face as u32 + side) == outer[of]);
            is_kept[face] = front || back;
            is_turned[face] = back;
            if front && back {
                return None;
            }
        }
    }
    let walls: Vec<u32> = (0..n_faces as u32)
        .filter(|&face| !is_kept[face as usize])
        .collect();
    if walls.is_empty() {
        return None;
    }
    let mut turned = draft.clone();
    let triangles = turned.mesh.triangles.iter_mut().zip(&is_turned);
    triangles
        .filter(|(_, turned)| **turned)
        .for_each(|(t, _)| t.swap(1, 2));
    are_inside(&part(&turned.mesh, |face| is_kept[face]), mesh, &walls)?;
    *draft = turned;
    Some(remove(draft, &is_kept))
}

/// Joins the sides of triangles that face each other around an edge.
fn join_around(mesh: &TriMesh, edge: &[TriangleSide], cells: &mut Groups) {
    let [low, high] = [edge[0].low, edge[0].high].map(|v| mesh.points[v as usize]);
    let along = (high - low).normalize_or_zero();
    let across = if along == Vec3::ZERO {
        Vec3::X
    } else {
        along.any_orthonormal_vector()
    };
    let up = along.cross(across);
    let mut around: Vec<(f64, &TriangleSide)> = edge
        .iter()
        .map(|side| {
            let tip = mesh.triangles[side.face() as usize][(side.corner as usize % 3 + 2) % 3];
            let away = mesh.points[tip as usize] - low;
            (away.dot(up).atan2(away.dot(across)), side)
        })
        .collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.corner.cmp(&b.1.corner)));
    // Seen along the edge, the front of a triangle whose side runs along it lies counter-clockwise.
    let side_of =
        |side: &TriangleSide, is_next: bool| 2 * side.face() + u32::from(side.runs_up(mesh) != is_next);
    for (k, &(_, side)) in around.iter().enumerate() {
        let (_, next) = around[(k + 1) % around.len()];
        cells.unite(side_of(side, true), side_of(next, false));
    }
}

/// Cell around each complex: the cell whose triangles enclose the largest volume.
fn outer_cells(mesh: &TriMesh, complex: &[u32], cells: &mut Groups) -> Vec<u32> {
    let n_faces = mesh.triangles.len();
    let mut volume = vec![0.0; 2 * n_faces];
    for face in 0..n_faces {
        // A local origin keeps the volume exact far away from 0.
        let origin = mesh.corners(complex[face] as usize)[0];
        let [a, b, c] = mesh.corners(face).map(|p| p - origin);
        let own = a.dot(b.cross(c));
        volume[cells.find(2 * face as u32) as usize] += own;
        volume[cells.find(2 * face as u32 + 1) as usize] -= own;
    }
    let mut outer: Vec<u32> = (0..n_faces as u32).map(|face| cells.find(2 * face)).collect();
    for face in 0..n_faces as u32 {
        for side in [0, 1] {
            let (cell, best) = (
                cells.find(2 * face + side),
                &mut outer[complex[face as usize] as usize],
            );
            if volume[cell as usize] > volume[*best as usize] {
                *best = cell;
            }
        }
    }
    outer
}

/// Groups of triangles connected across edges of two triangles.
fn patches(mesh: &TriMesh) -> Groups {
    let mut patches = Groups::of(mesh.triangles.len());
    for edge in sides(mesh).chunk_by(TriangleSide::same_edge) {
        if let [one, other] = edge {
            patches.unite(one.face(), other.face());
        }
    }
    patches
}

/// Copy of `mesh` with the rims of its sheets drawn in by some roundings, so that sheets that touch the
/// surface do not cross it.
fn shrunk(mesh: &TriMesh, is_sheet: &[bool]) -> TriMesh {
    let within = 2.0 * NEAR_SHARE * mesh.bounds().diagonal();
    let mut inwards = vec![(Vec3::ZERO, 0.0); mesh.points.len()];
    let mut shrunk = TriMesh::default();
    for face in (0..mesh.triangles.len()).filter(|&face| is_sheet[face]) {
        for &v in &mesh.triangles[face] {
            let (sum, n) = &mut inwards[v as usize];
            *sum += mesh.face_center(face);
            *n += 1.0;
        }
    }
    let mut is_rim = vec![false; mesh.points.len()];
    for edge in sides(mesh)
        .chunk_by(TriangleSide::same_edge)
        .filter(|edge| edge.len() != 2)
    {
        is_rim[edge[0].low as usize] = true;
        is_rim[edge[0].high as usize] = true;
    }
    // Sheets get their own points, since they may share some with the surface.
    shrunk.points.clone_from(&mesh.points);
    for (v, &p) in mesh.points.iter().enumerate() {
        let (sum, n) = inwards[v];
        let way = if is_rim[v] && n > 0.0 {
            sum / n - p
        } else {
            Vec3::ZERO
        };
        shrunk.points.push(p + way.clamp_length_max(within));
    }
    let n_points = mesh.points.len() as u32;
    let own = |face: usize, t: &[u32; 3]| {
        if is_sheet[face] {
            t.map(|v| v + n_points)
        } else {
            *t
        }
    };
    shrunk.triangles = mesh
        .triangles
        .iter()
        .enumerate()
        .map(|(face, t)| own(face, t))
        .collect();
    shrunk
}

fn part(mesh: &TriMesh, has: impl Fn(usize) -> bool) -> TriMesh {
    let triangles = mesh.triangles.iter().enumerate();
    TriMesh {
        triangles: triangles
            .filter(|(face, _)| has(*face))
            .map(|(_, t)| *t)
            .collect(),
        points: mesh.points.clone(),
    }
}

/// Returns `Some` if the centres of `faces` of `mesh` lie within the closed surface.
fn are_inside(closed: &TriMesh, mesh: &TriMesh, faces: &[u32]) -> Option<()> {
    if closed.triangles.len().saturating_mul(faces.len()) > MAX_WORK {
        return None;
    }
    let is_inside = |&face: &u32| {
        let q = mesh.face_center(face as usize);
        let all = (0..closed.triangles.len()).map(|f| solid_angle(closed.corners(f), q));
        // Limit between 4π inside and 2π on the surface itself.
        all.sum::<f64>() > 3.0 * std::f64::consts::PI
    };
    faces.par_iter().all(is_inside).then_some(())
}

fn remove(draft: &mut Draft, is_kept: &[bool]) -> Repair {
    let first = is_kept.iter().position(|kept| !kept);
    let at = first.map_or(Vec3::ZERO, |face| draft.mesh.face_center(face));
    let count = is_kept.iter().filter(|kept| !**kept).count();
    draft.retain(is_kept);
    Repair {
        kind: RepairKind::InnerWalls,
        count,
        at,
    }
}
