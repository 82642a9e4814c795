//! Adjacency of triangles across the edges of a closed mesh, and walks over it.

use rayon::prelude::*;

use crate::{Solid, TriMesh};

/// A half-edge: edge `corner` of a triangle, from that corner to the next, numbered `3 · face + corner`.
pub type HalfEdge = u32;

/// Opposite of each half-edge of a closed mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Topology {
    opposite: Vec<HalfEdge>,
}

impl Topology {
    /// Pairs the half-edges of `solid`; O(n log n).
    pub fn new(solid: &Solid) -> Self {
        Self::of_mesh(solid.mesh()).expect("a solid is closed")
    }

    /// Pairs the half-edges of `mesh`; `None` if some have no opposite or several.
    pub fn of_mesh(mesh: &TriMesh) -> Option<Self> {
        let mut edges: Vec<(u64, HalfEdge)> = (0..mesh.triangles.len() as u32 * 3)
            .into_par_iter()
            .map(|h| {
                let (from, to) = ends(mesh, h);
                ((u64::from(from.min(to)) << 32) | u64::from(from.max(to)), h)
            })
            .collect();
        edges.par_sort_unstable();
        let mut opposite = vec![0; edges.len()];
        for pair in edges.chunk_by(|x, y| x.0 == y.0) {
            let &[(_, g), (_, h)] = pair else { return None };
            if ends(mesh, g).0 == ends(mesh, h).0 {
                return None;
            }
            opposite[g as usize] = h;
            opposite[h as usize] = g;
        }
        Some(Self { opposite })
    }

    /// Half-edge of the same edge in the triangle on the other side.
    #[inline]
    pub fn opposite(&self, half_edge: HalfEdge) -> HalfEdge {
        self.opposite[half_edge as usize]
    }

    /// Number of half-edges: three per triangle.
    pub fn n_half_edges(&self) -> usize {
        self.opposite.len()
    }

    /// Triangles across the three edges of `face`; one may occur twice.
    #[inline]
    pub fn neighbours(&self, face: u32) -> [u32; 3] {
        let first = 3 * face;
        [
            self.opposite(first) / 3,
            self.opposite(first + 1) / 3,
            self.opposite(first + 2) / 3,
        ]
    }

    /// Next half-edge, counter-clockwise around the same triangle.
    pub fn next(half_edge: HalfEdge) -> HalfEdge {
        if half_edge % 3 == 2 {
            half_edge - 2
        } else {
            half_edge + 1
        }
    }
}

/// Start and end point of a half-edge of `mesh`.
pub fn ends(mesh: &TriMesh, half_edge: HalfEdge) -> (u32, u32) {
    let t = mesh.triangles[half_edge as usize / 3];
    let corner = half_edge as usize % 3;
    (t[corner], t[(corner + 1) % 3])
}

/// Connected component of each triangle, and the number of components. Neighbours are connected if `joined`
/// accepts the pair.
///
/// Components are numbered by their lowest triangle.
pub fn components(topology: &Topology, joined: impl Fn(u32, u32) -> bool) -> (Vec<u32>, usize) {
    let n_faces = topology.n_half_edges() / 3;
    let mut component = vec![u32::MAX; n_faces];
    let mut n_components = 0;
    let mut stack = Vec::new();
    for start in 0..n_faces as u32 {
        if component[start as usize] != u32::MAX {
            continue;
        }
        component[start as usize] = n_components;
        stack.push(start);
        while let Some(face) = stack.pop() {
            for other in topology.neighbours(face) {
                if component[other as usize] == u32::MAX && joined(face, other) {
                    component[other as usize] = n_components;
                    stack.push(other);
                }
            }
        }
        n_components += 1;
    }
    (component, n_components as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::tetrahedron;

    #[test]
    fn every_edge_has_two_sides_that_run_opposite_ways() {
        let solid = Solid::new(tetrahedron()).unwrap();
        let topology = Topology::new(&solid);
        for h in 0..12 {
            assert_eq!(topology.opposite(topology.opposite(h)), h);
            let (from, to) = ends(solid.mesh(), h);
            assert_eq!(ends(solid.mesh(), topology.opposite(h)), (to, from));
        }
        assert_eq!(components(&topology, |_, _| true), (vec![0; 4], 1));
        assert_eq!(components(&topology, |_, _| false), (vec![0, 1, 2, 3], 4));
    }
}
