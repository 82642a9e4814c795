//! Removal of duplicate triangles, and flipping of triangles that face against their neighbours.

use std::collections::VecDeque;

use super::{Draft, Repair, RepairKind};
use crate::Vec3;
use crate::check::{TriangleSide, sides};

/// Removes duplicates of triangles with the same corners. Triangles that face opposite ways cancel in pairs.
pub(super) fn drop_copies(draft: &mut Draft) -> Option<Repair> {
    let triangles = &draft.mesh.triangles;
    let mut order: Vec<([u32; 3], u32)> = triangles
        .iter()
        .zip(0..)
        .map(|(t, face)| (sort(*t), face))
        .collect();
    order.sort_unstable();
    let mut is_kept = vec![true; triangles.len()];
    for group in order.chunk_by(|x, y| x.0 == y.0).filter(|group| group.len() > 1) {
        let is_even = |face: u32| {
            let t = triangles[face as usize];
            let least = (0..3).min_by_key(|&k| t[k]).unwrap_or_default();
            t[(least + 1) % 3] < t[(least + 2) % 3]
        };
        let n_even = group.iter().filter(|(_, face)| is_even(*face)).count();
        let stays = match n_even.cmp(&(group.len() - n_even)) {
            std::cmp::Ordering::Equal => None,
            more => group.iter().find(|(_, face)| is_even(*face) == more.is_gt()),
        };
        group.iter().for_each(|(_, face)| is_kept[*face as usize] = false);
        stays.iter().for_each(|(_, face)| is_kept[*face as usize] = true);
    }
    let first = is_kept.iter().position(|kept| !kept)?;
    if !is_kept.contains(&true) {
        return None;
    }
    let at = draft.mesh.face_center(first);
    let count = is_kept.iter().filter(|kept| !**kept).count();
    draft.retain(&is_kept);
    Some(Repair {
        kind: RepairKind::Copies,
        count,
        at,
    })
}

fn sort(mut triangle: [u32; 3]) -> [u32; 3] {
    triangle.sort_unstable();
    triangle
}

/// Flips triangles so that neighbours agree, as few as possible in each connected part. Leaves one-sided
/// parts unchanged.
pub(super) fn turn(draft: &mut Draft) -> Option<Repair> {
    let mesh = &draft.mesh;
    let sides = sides(mesh);
    // Neighbours of each triangle, each with a flag if it faces the other way.
    let mut across: Vec<Vec<(u32, bool)>> = vec![Vec::new(); mesh.triangles.len()];
    let mut has_turned = false;
    for edge in sides.chunk_by(TriangleSide::same_edge) {
        if let [one, other] = edge {
            let is_turned = one.runs_up(mesh) == other.runs_up(mesh);
            has_turned |= is_turned;
            across[one.face() as usize].push((other.face(), is_turned));
            across[other.face() as usize].push((one.face(), is_turned));
        }
    }
    if !has_turned {
        return None;
    }
    let mut state: Vec<Option<bool>> = vec![None; mesh.triangles.len()];
    let mut turned = Vec::new();
    for start in 0..mesh.triangles.len() as u32 {
        if state[start as usize].is_none() {
            turned.extend(to_turn(&across, &mut state, start));
        }
    }
    let at = turned
        .iter()
        .min()
        .map_or(Vec3::ZERO, |&face| mesh.face_center(face as usize));
    turned
        .iter()
        .for_each(|&face| draft.mesh.triangles[face as usize].swap(1, 2));
    (!turned.is_empty()).then_some(Repair {
        kind: RepairKind::Turned,
        count: turned.len(),
        at,
    })
}

/// Triangles to flip in the part that `start` belongs to; none if the part is one-sided.
fn to_turn(across: &[Vec<(u32, bool)>], state: &mut [Option<bool>], start: u32) -> Vec<u32> {
    let (mut part, mut todo) = (vec![start], VecDeque::from([start]));
    state[start as usize] = Some(false);
    let mut is_one_sided = false;
    while let Some(face) = todo.pop_front() {
        let own = state[face as usize].unwrap_or_default();
        for &(other, is_turned) in &across[face as usize] {
            let wanted = own != is_turned;
            match state[other as usize] {
                Some(has) => is_one_sided |= has != wanted,
                None => {
                    state[other as usize] = Some(wanted);
                    part.push(other);
                    todo.push_back(other);
                }
            }
        }
    }
    if is_one_sided {
        return Vec::new();
    }
    let n_turned = part
        .iter()
        .filter(|&&face| state[face as usize] == Some(true))
        .count();
    let minority = 2 * n_turned <= part.len();
    part.into_iter()
        .filter(|&face| state[face as usize] == Some(minority))
        .collect()
}
