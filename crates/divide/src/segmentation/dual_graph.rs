//! Dual graph of triangles, or of cells of many triangles. Its shortest paths are the geodesics along which
//! patches grow.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use shellock_geom::{Topology, TriMesh, Vec3};

/// An undirected weighted graph in compressed rows; lengths in mm.
pub(crate) struct DualGraph {
    start: Vec<u32>,
    arcs: Vec<(u32, f64)>,
    /// Middle of each node.
    pub center: Vec<Vec3>,
    /// Surface area of each node, mm².
    pub area: Vec<f64>,
}

/// Cost of crossing a crease, in mm of detour for each radian of turning. It makes seams lie in creases
/// rather than patches reach over them.
///
/// The turning is not squared, so the cost of a fold does not depend on how finely it is triangulated.
#[derive(Clone, Copy)]
pub(crate) struct CreaseCost {
    pub concave_mm: f64,
    pub convex_mm: f64,
}

impl CreaseCost {
    /// Zero cost of creases: only distances count.
    pub const NONE: Self = Self {
        concave_mm: 0.0,
        convex_mm: 0.0,
    };

    fn length(self, (c1, n1): (Vec3, Vec3), (c2, n2): (Vec3, Vec3)) -> f64 {
        let turning_rad = n1.dot(n2).clamp(-1.0, 1.0).acos();
        let is_concave = (n2 - n1).dot(c2 - c1) < 0.0;
        c1.distance(c2)
            + turning_rad
                * if is_concave {
                    self.concave_mm
                } else {
                    self.convex_mm
                }
    }
}

impl DualGraph {
    /// Builds the graph with one node for each triangle.
    pub fn of_faces(mesh: &TriMesh, topology: &Topology, cost: CreaseCost) -> Self {
        let cell: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        Self::of_cells(mesh, topology, &cell, cell.len(), cost)
    }

    /// Builds the graph with one node for each of `n_cells` connected sets of triangles.
    pub fn of_cells(
        mesh: &TriMesh,
        topology: &Topology,
        cell: &[u32],
        n_cells: usize,
        cost: CreaseCost,
    ) -> Self {
        let mut area = vec![0.0; n_cells];
        let mut center = vec![Vec3::ZERO; n_cells];
        let mut normal = vec![Vec3::ZERO; n_cells];
        for (face, &c) in cell.iter().enumerate() {
            let face_area = mesh.face_area(face);
            area[c as usize] += face_area;
            center[c as usize] += mesh.face_center(face) * face_area;
            normal[c as usize] += mesh.double_area_vector(face);
        }
        for (face, &c) in cell.iter().enumerate() {
            if area[c as usize] == 0.0 {
                center[c as usize] = mesh.face_center(face);
            }
        }
        for c in 0..n_cells {
            center[c] = if area[c] > 0.0 {
                center[c] / area[c]
            } else {
                center[c]
            };
            normal[c] = normal[c].normalize_or_zero();
        }
        let mut pairs: Vec<(u32, u32)> = (0..topology.n_half_edges() as u32)
            .map(|h| (cell[h as usize / 3], cell[topology.opposite(h) as usize / 3]))
            .filter(|(a, b)| a != b)
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut start = vec![0; n_cells + 1];
        for &(a, _) in &pairs {
            start[a as usize + 1] += 1;
        }
        for c in 0..n_cells {
            start[c + 1] += start[c];
        }
        let node = |c: u32| (center[c as usize], normal[c as usize]);
        let arcs = pairs
            .iter()
            .map(|&(a, b)| (b, cost.length(node(a), node(b))))
            .collect();
        Self {
            start,
            arcs,
            center,
            area,
        }
    }

    /// Number of nodes in the graph.
    pub fn len(&self) -> usize {
        self.area.len()
    }

    /// Neighbours of `node`, with the lengths of the arcs to them, mm.
    pub fn arcs(&self, node: u32) -> &[(u32, f64)] {
        &self.arcs[self.start[node as usize] as usize..self.start[node as usize + 1] as usize]
    }

    /// Distance from the nearest source and that source's index, for each node that is reachable through
    /// `allowed` nodes.
    ///
    /// Distances from source i are multiplied by `sources[i].1` > 0. The nodes that a source wins are
    /// connected, as a front only advances through nodes it has won. Unreached nodes have infinite distance
    /// and index `u32::MAX`.
    pub fn grow(&self, sources: &[(u32, f64)], allowed: impl Fn(u32) -> bool) -> (Vec<f64>, Vec<u32>) {
        let mut distance = vec![f64::INFINITY; self.len()];
        let mut owner = vec![u32::MAX; self.len()];
        // Non-negative floats order like their bits. Node and owner break ties the same way on every run.
        let mut front = BinaryHeap::new();
        for (i, &(node, _)) in sources.iter().enumerate() {
            if owner[node as usize] == u32::MAX {
                distance[node as usize] = 0.0;
                owner[node as usize] = i as u32;
                front.push(Reverse((0.0f64.to_bits(), node, i as u32)));
            }
        }
        while let Some(Reverse((bits, node, source))) = front.pop() {
            let d = f64::from_bits(bits);
            if d > distance[node as usize] || owner[node as usize] != source {
                continue;
            }
            for &(other, length) in self.arcs(node) {
                let reached = d + length * sources[source as usize].1;
                if reached < distance[other as usize] && allowed(other) {
                    distance[other as usize] = reached;
                    owner[other as usize] = source;
                    front.push(Reverse((reached.to_bits(), other, source)));
                }
            }
        }
        (distance, owner)
    }
}
