//! Seams as chains of edges between patches.

use shellock_geom::topology::ends;
use shellock_geom::{HalfEdge, Topology, TriMesh, Vec3};
use shellock_report::PatchId;

use crate::seam::graph::ContactGraph;
use crate::{Seam, SegmentedSurface};

/// A chain of half-edges from triple point to triple point or around a loop. Each lies in a triangle of patch
/// `a` and has a triangle of patch `b` > `a` across.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    pub a: u32,
    pub b: u32,
    pub half_edges: Vec<HalfEdge>,
}

impl Stretch {
    /// Length along the edges, mm.
    pub fn length(&self, mesh: &TriMesh) -> f64 {
        let length = |&h: &HalfEdge| {
            let (from, to) = ends(mesh, h);
            mesh.points[from as usize].distance(mesh.points[to as usize])
        };
        self.half_edges.iter().map(length).sum()
    }
}

/// Half-edges of `faces` that separate a patch from one with a higher id, in order.
pub fn seam_half_edges(
    topology: &Topology,
    labels: &[u32],
    faces: impl Iterator<Item = u32>,
) -> Vec<HalfEdge> {
    faces
        .flat_map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
        .filter(|&h| labels[h as usize / 3] < labels[topology.opposite(h) as usize / 3])
        .collect()
}

/// Chains all seam half-edges of a labelled closed mesh, in order of their first half-edge: open stretches,
/// then loops.
pub fn stretches(mesh: &TriMesh, topology: &Topology, labels: &[u32], seam: &[HalfEdge]) -> Vec<Stretch> {
    let mut touched: Vec<u32> = seam
        .iter()
        .flat_map(|&h| <[u32; 2]>::from(ends(mesh, h)))
        .collect();
    touched.sort_unstable();
    // A point with two seam edges continues the seam; with any other number the seam ends there.
    let goes_on = |v: u32| touched.partition_point(|&x| x <= v) - touched.partition_point(|&x| x < v) == 2;
    let sides = |h: HalfEdge| (labels[h as usize / 3], labels[topology.opposite(h) as usize / 3]);
    let following = |h: HalfEdge| {
        let mut next = Topology::next(h);
        while sides(next).0 == sides(next).1 {
            next = Topology::next(topology.opposite(next));
        }
        next
    };
    let mut is_used = vec![false; topology.n_half_edges()];
    let mut found = Vec::new();
    let mut walk = |start: HalfEdge| {
        let mut half_edges = Vec::new();
        let mut h = start;
        while !is_used[h as usize] {
            is_used[h as usize] = true;
            half_edges.push(h);
            if !goes_on(ends(mesh, h).1) {
                break;
            }
            h = following(h);
        }
        if !half_edges.is_empty() {
            found.push(Stretch {
                a: sides(start).0,
                b: sides(start).1,
                half_edges,
            });
        }
    };
    seam.iter()
        .filter(|&&h| !goes_on(ends(mesh, h).0))
        .for_each(|&h| walk(h));
    seam.iter().for_each(|&h| walk(h));
    found
}

impl SegmentedSurface {
    /// All seams, split where three or more patches meet, patch `a` on the left as seen from outside.
    ///
    /// # Panics
    /// Panics if the mesh is not closed, against the guarantee of `SegmentedSurface`.
    pub fn seams(&self) -> Vec<Seam> {
        let topology = Topology::of_mesh(&self.mesh).expect("a segmented surface is closed");
        let labels: Vec<u32> = self.patch_of_face.iter().map(|p| p.0).collect();
        let mut normals = vec![Vec3::ZERO; self.mesh.points.len()];
        for (face, t) in self.mesh.triangles.iter().enumerate() {
            let area_vector = self.mesh.double_area_vector(face);
            t.iter().for_each(|&v| normals[v as usize] += area_vector);
        }
        let seam = seam_half_edges(&topology, &labels, 0..labels.len() as u32);
        stretches(&self.mesh, &topology, &labels, &seam)
            .into_iter()
            .map(|s| {
                let mut chain: Vec<usize> = vec![ends(&self.mesh, s.half_edges[0]).0 as usize];
                chain.extend(s.half_edges.iter().map(|&h| ends(&self.mesh, h).1 as usize));
                Seam {
                    a: PatchId(s.a),
                    b: PatchId(s.b),
                    points: chain.iter().map(|&v| self.mesh.points[v]).collect(),
                    normals: chain.iter().map(|&v| normals[v].normalize_or_zero()).collect(),
                }
            })
            .collect()
    }

    /// Contact graph in which contacts count if their longest stretch is at least `min_contact_mm`.
    ///
    /// # Panics
    /// Panics under the same conditions as [`Self::seams`].
    pub fn contact_graph(&self, min_contact_mm: f64) -> ContactGraph {
        self.contact_graph_below(0.0, min_contact_mm)
    }

    /// Contact graph with lengths measured on the inner side of a wall of `wall_mm`, where connectors are.
    ///
    /// # Panics
    /// Panics under the same conditions as [`Self::seams`].
    pub fn contact_graph_below(&self, wall_mm: f64, min_contact_mm: f64) -> ContactGraph {
        let lengths = self
            .seams()
            .into_iter()
            .map(|s| (s.a, s.b, s.length_below(wall_mm)));
        ContactGraph::from_stretches(self.n_patches, min_contact_mm, lengths)
    }
}
