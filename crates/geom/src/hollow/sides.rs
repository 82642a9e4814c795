//! Separation of a hollow body's triangles into those of its cavity and the others, and the rims between
//! them.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use rayon::prelude::*;

use super::cut::Network;
use super::grid::Grid;
use super::rooms::Room;
use crate::bvh::TriangleBvh;
use crate::check::Groups;
use crate::topology::{HalfEdge, Topology, components, ends};
use crate::{TriMesh, Vec3};

/// Distances in front of a triangle at which it looks for a visible node, in cells.
const LOOKS_CELLS: [f64; 3] = [0.6, 0.25, 1.2];
/// Distance in front of a triangle from which it looks, in cells: more than rounding, less than any gap.
const START_SHARE: f64 = 1e-5;
/// Share of a side's area below which connected triangles change sides: they are folds that no ball reaches.
const ISLAND_SHARE: f64 = 0.02;
/// Relative lengthening of an edge for each wall thickness of depth in an opening, so that the outer one of
/// equally long rims is the shortest.
const DEPTH_SHARE: f64 = 0.2;
/// Factor on the length of convex edges of more than 30°. Rims of drilled holes are such edges, and the
/// cavity may have narrower places behind them.
const CREASE_SHARE: f64 = 0.25;
const COS_CREASE: f64 = 0.866_025_403_784_438_6;
/// Largest depth of an opening, in wall thicknesses.
const DEEPEST_WALLS: f64 = 1.5;
/// Number of capacity units per millimetre.
const STEPS_PER_MM: f64 = 1e6;

/// Surface of a body, with the triangles that bound its cavity marked.
pub(super) struct Sides<'a> {
    pub(super) mesh: &'a TriMesh,
    pub(super) topology: &'a Topology,
    pub(super) is_cavity: Vec<bool>,
}

/// A closed line between triangles of the cavity and others, as half-edges of the others.
pub(super) struct CavityRim {
    pub(super) edges: Vec<HalfEdge>,
    pub(super) center: Vec3,
    /// Distance of the farthest point of the line from the centre, mm.
    pub(super) radius_mm: f64,
}

impl<'a> Sides<'a> {
    /// Assigns each triangle the region of a node that it sees, or the region of its neighbours.
    pub(super) fn new(
        mesh: &'a TriMesh,
        topology: &'a Topology,
        tree: &TriangleBvh,
        grid: &Grid,
        rooms: &[Option<Room>],
    ) -> Self {
        let mut seen: Vec<Option<Room>> = (0..mesh.triangles.len())
            .into_par_iter()
            .map(|face| find_room(mesh, face, tree, grid, rooms))
            .collect();
        let mut todo: VecDeque<u32> = (0..seen.len() as u32)
            .filter(|&face| seen[face as usize].is_some())
            .collect();
        while let Some(face) = todo.pop_front() {
            for other in topology.neighbours(face) {
                if seen[other as usize].is_none() {
                    seen[other as usize] = seen[face as usize];
                    todo.push_back(other);
                }
            }
        }
        let mut sides = Self {
            mesh,
            topology,
            is_cavity: seen.iter().map(|room| *room == Some(Room::Cavity)).collect(),
        };
        sides.flood_islands();
        sides
    }

    /// Area of the triangles of the cavity, mm².
    pub(super) fn cavity_mm2(&self) -> f64 {
        let inner = (0..self.is_cavity.len()).filter(|&face| self.is_cavity[face]);
        inner.map(|face| self.mesh.face_area(face)).sum()
    }

    fn flood_islands(&mut self) {
        let is_same = |a: u32, b: u32| self.is_cavity[a as usize] == self.is_cavity[b as usize];
        let (part, n_parts) = components(self.topology, is_same);
        let (mut of_part, mut of_side) = (vec![0.0; n_parts], [0.0; 2]);
        for (face, &part) in part.iter().enumerate() {
            let area = self.mesh.face_area(face);
            of_part[part as usize] += area;
            of_side[usize::from(self.is_cavity[face])] += area;
        }
        for (face, &part) in part.iter().enumerate() {
            let all = of_side[usize::from(self.is_cavity[face])];
            self.is_cavity[face] ^= of_part[part as usize] < ISLAND_SHARE * all;
        }
    }

    /// Lines between both sides; lines that share a point count as one.
    pub(super) fn rims(&self) -> Vec<CavityRim> {
        let is_cavity = |h: HalfEdge| self.is_cavity[h as usize / 3];
        let edges: Vec<HalfEdge> = (0..self.topology.n_half_edges() as u32)
            .filter(|&h| !is_cavity(h) && is_cavity(self.topology.opposite(h)))
            .collect();
        let mut groups = Groups::of(self.mesh.points.len());
        for &h in &edges {
            let (from, to) = ends(self.mesh, h);
            groups.unite(from, to);
        }
        let mut named: Vec<(u32, HalfEdge)> = edges
            .into_iter()
            .map(|h| (groups.find(ends(self.mesh, h).0), h))
            .collect();
        named.sort_unstable();
        named
            .chunk_by(|a, b| a.0 == b.0)
            .map(|rim| self.rim(rim.iter().map(|&(_, h)| h).collect()))
            .collect()
    }

    fn rim(&self, edges: Vec<HalfEdge>) -> CavityRim {
        let (mut moment, mut length) = (Vec3::ZERO, 0.0);
        for [a, b] in edges.iter().map(|&h| self.ends(h)) {
            moment += 0.5 * a.distance(b) * (a + b);
            length += a.distance(b);
        }
        let center = moment / length.max(f64::MIN_POSITIVE);
        let away = edges.iter().map(|&h| self.ends(h)[0].distance(center));
        CavityRim {
            radius_mm: away.fold(0.0, f64::max),
            center,
            edges,
        }
    }

    /// Start and end point of a half-edge, mm.
    pub(super) fn ends(&self, h: HalfEdge) -> [Vec3; 2] {
        let (from, to) = ends(self.mesh, h);
        [from, to].map(|v| self.mesh.points[v as usize])
    }

    /// Moves each rim within its opening to where it is shortest. Of equally short lines it takes the
    /// outermost. Openings are assumed to be as deep as a wall of `wall_mm`, or somewhat deeper.
    pub(super) fn tighten(&mut self, wall_mm: f64, cell_mm: f64) {
        let is_free = self.near_rims(wall_mm, cell_mm);
        let depth_mm = self.depths(&is_free);
        // Source and sink represent all fixed triangles outside and in the cavity.
        let (source, sink) = (0, 1);
        let mut node = vec![source; self.is_cavity.len()];
        let mut n_nodes = 2;
        for face in 0..node.len() {
            if is_free[face] {
                node[face] = n_nodes;
                n_nodes += 1;
            } else if self.is_cavity[face] {
                node[face] = sink;
            }
        }
        let mut network = Network::new(n_nodes as usize);
        for h in 0..self.topology.n_half_edges() as u32 {
            let [here, there] = [h, self.topology.opposite(h)].map(|h| h as usize / 3);
            if h < self.topology.opposite(h) && node[here] != node[there] {
                let deeper = 0.5 * (depth_mm[here] + depth_mm[there]) / (wall_mm + cell_mm);
                let cost = STEPS_PER_MM * self.length(h) * (1.0 + DEPTH_SHARE * deeper);
                network.join(node[here], node[there], cost as u64 + 1);
            }
        }
        let is_open = network.near_source(source, sink);
        for (face, &node) in node.iter().enumerate() {
            if is_free[face] {
                self.is_cavity[face] = !is_open[node as usize];
            }
        }
    }

    /// Marks the triangles that may lie in an opening: those within a ball around a rim's centre. The ball
    /// contains a channel as wide as the rim and as deep as openings are.
    fn near_rims(&self, wall_mm: f64, cell_mm: f64) -> Vec<bool> {
        let reach_mm = |rim: &CavityRim| rim.radius_mm.hypot(DEEPEST_WALLS * wall_mm) + 2.0 * cell_mm;
        let near: Vec<(Vec3, f64)> = self
            .rims()
            .iter()
            .map(|rim| (rim.center, reach_mm(rim)))
            .collect();
        let is_near = |face: usize| {
            let corners = self.mesh.corners(face);
            near.iter()
                .any(|&(center, mm)| corners.iter().all(|p| p.distance(center) <= mm))
        };
        (0..self.is_cavity.len()).map(is_near).collect()
    }

    /// Length of an edge, mm, reduced if it is a crease.
    fn length(&self, h: HalfEdge) -> f64 {
        let [a, b] = self.ends(h);
        let other = self.topology.opposite(h);
        let [normal, next] = [h, other].map(|h| self.mesh.face_normal(h as usize / 3));
        let tip = self.ends(Topology::next(other))[1];
        let is_crease = normal.dot(next) < COS_CREASE && normal.dot(tip - a) < 0.0;
        a.distance(b) * if is_crease { CREASE_SHARE } else { 1.0 }
    }

    /// Distance along the surface of each free triangle from the fixed ones outside, mm; 0 for fixed
    /// triangles.
    fn depths(&self, is_free: &[bool]) -> Vec<f64> {
        let mut depth_mm = vec![f64::INFINITY; is_free.len()];
        let mut todo = BinaryHeap::new();
        for face in 0..is_free.len() {
            if !is_free[face] {
                depth_mm[face] = 0.0;
                if !self.is_cavity[face] {
                    todo.push(Reverse((0.0_f64.to_bits(), face)));
                }
            }
        }
        while let Some(Reverse((bits, face))) = todo.pop() {
            let here = f64::from_bits(bits);
            if here > depth_mm[face] {
                continue;
            }
            for other in self.topology.neighbours(face as u32).map(|f| f as usize) {
                let way = self.mesh.face_center(face).distance(self.mesh.face_center(other));
                // From a large triangle outside the path begins at its border.
                let there = if is_free[face] { here + way } else { 0.0 };
                if is_free[other] && there < depth_mm[other] {
                    depth_mm[other] = there;
                    todo.push(Reverse((there.to_bits(), other)));
                }
            }
        }
        depth_mm
            .into_iter()
            .map(|mm| if mm.is_finite() { mm } else { 0.0 })
            .collect()
    }
}

/// Region of a node that triangle `face` sees from its outer side.
fn find_room(
    mesh: &TriMesh,
    face: usize,
    tree: &TriangleBvh,
    grid: &Grid,
    rooms: &[Option<Room>],
) -> Option<Room> {
    let normal = mesh.face_normal(face);
    let start = mesh.face_center(face) + START_SHARE * grid.cell_mm * normal;
    let sees = |node: &usize| {
        let way = grid.position(*node) - start;
        way.dot(normal) > 0.0
            && tree
                .first_hit(start, way.normalize_or_zero(), way.length())
                .is_none()
    };
    let looks = LOOKS_CELLS.map(|cells| start + cells * grid.cell_mm * normal);
    let nodes = looks.into_iter().flat_map(|q| grid.corners_around(q));
    nodes
        .filter(|&node| rooms[node].is_some())
        .find(sees)
        .and_then(|node| rooms[node])
}
