//! The space around a solid, divided into the open and a cavity that only narrow ways lead into.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use rayon::prelude::*;

use super::grid::Grid;
use crate::bvh::TriangleBvh;

/// The widest ball that is tried in an opening: its radius as a share of the longest side, so that openings up
/// to a fifth of the size are found.
const WIDEST_SHARE: f64 = 0.125;
/// A cavity is wider than its openings by this factor, at least. A hollow plate of 6 mm with walls of 2 mm has
/// little more.
const LEAST_WIDENING: f64 = 1.2;
/// Radii that are tried: the first as a share of a cell, each next larger by a factor.
const FIRST_CELLS: f64 = 0.35;
const STEP: f64 = 1.3;
/// The least radius counts that cuts off this share of what any radius cuts off.
const MOST: f64 = 0.8;

/// What a free node belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Room {
    Open,
    Cavity,
}

/// The room of each free node of the grid; none where fewer than `least_nodes` nodes are cut off.
pub(super) fn rooms(grid: &Grid, tree: &TriangleBvh, least_nodes: f64) -> Option<Vec<Option<Room>>> {
    let longest_mm = grid.longest_mm();
    let widest_mm = WIDEST_SHARE * longest_mm;
    let clearance = clearances(grid, tree, LEAST_WIDENING * widest_mm);
    let mut radii = vec![0.0];
    let mut radius_mm = FIRST_CELLS * grid.cell_mm;
    while radius_mm <= widest_mm {
        radii.push(radius_mm);
        radius_mm *= STEP;
    }
    let n_cut_off: Vec<usize> = radii
        .par_iter()
        .map(|&mm| {
            let seeds = seeds(grid, &clearance, mm as f32);
            seeds.iter().filter(|s| **s == Some(Room::Cavity)).count()
        })
        .collect();
    let most = n_cut_off.iter().copied().max().unwrap_or(0) as f64;
    if most < least_nodes {
        return None;
    }
    let chosen = n_cut_off.iter().position(|&n| n as f64 >= MOST * most)?;
    let mut room = seeds(grid, &clearance, radii[chosen] as f32);
    grow(grid, &clearance, &mut room);
    Some(room)
}

/// Distance from each free node to the surface, mm, at most `limit_mm`; the limit at the border, beyond which
/// all is free, and 0 within the solid.
fn clearances(grid: &Grid, tree: &TriangleBvh, limit_mm: f64) -> Vec<f32> {
    let mut clearance = vec![0.0; grid.len()];
    let rows = clearance.par_chunks_mut(grid.row()).enumerate();
    rows.for_each(|(row, clearances)| {
        let mut before_mm = limit_mm;
        for (node, clearance) in (row * grid.row()..).zip(clearances) {
            // Clearances of neighbours differ by a cell at most, and a search within less is faster.
            let within_mm = limit_mm.min(before_mm + (1.0 + 1e-9) * grid.cell_mm);
            let near = || tree.nearest(grid.position(node), within_mm * within_mm);
            before_mm = match grid.is_free(node) {
                true if grid.is_border(node) => limit_mm,
                true => near().map_or(within_mm, |n| n.distance_sq.sqrt()),
                false => 0.0,
            };
            *clearance = before_mm as f32;
            if !grid.is_free(node) {
                before_mm = limit_mm;
            }
        }
    });
    clearance
}

/// The nodes where a ball of `radius_mm` has room: those that it reaches from outside, and those of cavities
/// that are wider than it. Others have no room yet.
fn seeds(grid: &Grid, clearance: &[f32], radius_mm: f32) -> Vec<Option<Room>> {
    let has_room = |node: usize| grid.is_free(node) && clearance[node] >= radius_mm;
    let mut room = vec![None; grid.len()];
    let mut is_seen = vec![false; grid.len()];
    let reach = |start: usize, is_seen: &mut [bool]| {
        let mut part = vec![start];
        let mut next = 0;
        is_seen[start] = true;
        while let Some(&node) = part.get(next) {
            next += 1;
            for other in grid.joined(node) {
                if has_room(other) && !std::mem::replace(&mut is_seen[other], true) {
                    part.push(other);
                }
            }
        }
        part
    };
    // The border is all free and hangs together.
    for node in reach(0, &mut is_seen) {
        room[node] = Some(Room::Open);
    }
    for start in 0..grid.len() {
        if !has_room(start) || is_seen[start] {
            continue;
        }
        let part = reach(start, &mut is_seen);
        let widest = part.iter().map(|&node| clearance[node]).fold(0.0, f32::max);
        if widest >= LEAST_WIDENING as f32 * radius_mm {
            part.iter().for_each(|&node| room[node] = Some(Room::Cavity));
        }
    }
    room
}

/// Gives each free node that a way leads to the room that the widest way comes from.
fn grow(grid: &Grid, clearance: &[f32], room: &mut [Option<Room>]) {
    let has_way_on = |node: usize| grid.joined(node).any(|other| room[other].is_none());
    // The narrowest place of the way to a node, and the node.
    let mut todo: BinaryHeap<(u32, Reverse<usize>)> = (0..grid.len())
        .filter(|&node| room[node].is_some() && has_way_on(node))
        .map(|node| (clearance[node].to_bits(), Reverse(node)))
        .collect();
    // Ways that get no narrower are followed at once.
    let mut at_once: VecDeque<(u32, usize)> = VecDeque::new();
    while let Some((narrowest, node)) = at_once
        .pop_front()
        .or_else(|| todo.pop().map(|(narrowest, Reverse(node))| (narrowest, node)))
    {
        for other in grid
            .joined(node)
            .filter(|&other| room[other].is_none())
            .collect::<Vec<_>>()
        {
            room[other] = room[node];
            // Bits of numbers from 0 upwards have their order.
            let width = clearance[other].to_bits();
            if width >= narrowest {
                at_once.push_back((narrowest, other));
            } else {
                todo.push((width, Reverse(other)));
            }
        }
    }
}
