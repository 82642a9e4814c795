//! Division of the space around a solid into the open and a cavity with only narrow ways in.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use rayon::prelude::*;

use super::grid::Grid;
use crate::bvh::TriangleBvh;

/// Radius of the widest ball that is tried in an opening, as a share of the longest side. Openings up to a
/// fifth of the size are found.
const WIDEST_SHARE: f64 = 0.125;
/// Least ratio of a cavity's width to its openings' width. A hollow plate of 6 mm with walls of 2 mm has
/// little more.
const LEAST_WIDENING: f64 = 1.2;
/// Radii that are tried: the first as a share of a cell, then each larger by a constant factor.
const FIRST_CELLS: f64 = 0.35;
const STEP: f64 = 1.3;
/// Share of the largest number of nodes cut off by any radius. The least radius that reaches this share is
/// used.
const MOST: f64 = 0.8;

/// Region that a free node belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Room {
    Open,
    Cavity,
}

/// Region of each free node of the grid; `None` if fewer than `least_nodes` nodes are cut off.
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

/// Distance from each free node to the surface, mm, at most `limit_mm`. Border nodes, beyond which all is
/// free, have the limit; nodes within the solid have 0.
fn clearances(grid: &Grid, tree: &TriangleBvh, limit_mm: f64) -> Vec<f32> {
    let mut clearance = vec![0.0; grid.len()];
    let rows = clearance.par_chunks_mut(grid.row()).enumerate();
    rows.for_each(|(row, clearances)| {
        let mut before_mm = limit_mm;
        for (node, clearance) in (row * grid.row()..).zip(clearances) {
            // Clearances of neighbours differ by at most a cell, and a smaller limit makes the search faster.
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

/// Regions of the nodes where a ball of `radius_mm` fits: open if the ball gets there from outside, cavity if
/// the ball is cut off and the region is wider than the ball. Other nodes have no region yet.
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
            for other in grid.linked_nodes(node) {
                if has_room(other) && !std::mem::replace(&mut is_seen[other], true) {
                    part.push(other);
                }
            }
        }
        part
    };
    // The border is all free and connected.
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

/// Gives each reachable free node the region to which its widest path leads.
fn grow(grid: &Grid, clearance: &[f32], room: &mut [Option<Room>]) {
    let has_way_on = |node: usize| grid.linked_nodes(node).any(|other| room[other].is_none());
    // Pairs of the narrowest clearance on the path to a node, and the node.
    let mut todo: BinaryHeap<(u32, Reverse<usize>)> = (0..grid.len())
        .filter(|&node| room[node].is_some() && has_way_on(node))
        .map(|node| (clearance[node].to_bits(), Reverse(node)))
        .collect();
    // Paths that get no narrower are followed at once.
    let mut at_once: VecDeque<(u32, usize)> = VecDeque::new();
    while let Some((narrowest, node)) = at_once
        .pop_front()
        .or_else(|| todo.pop().map(|(narrowest, Reverse(node))| (narrowest, node)))
    {
        for other in grid
            .linked_nodes(node)
            .filter(|&other| room[other].is_none())
            .collect::<Vec<_>>()
        {
            room[other] = room[node];
            // Non-negative floats have the same order as their bits.
            let width = clearance[other].to_bits();
            if width >= narrowest {
                at_once.push_back((narrowest, other));
            } else {
                todo.push((width, Reverse(other)));
            }
        }
    }
}
