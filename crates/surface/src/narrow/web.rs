//! Points of a finely divided surface, linked within patches.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use shellock_geom::subdivide::halve_edges;
use shellock_geom::{HalfEdge, Solid, Topology, TriMesh, Vec3};
use shellock_report::PatchId;

use crate::SegmentedSurface;

/// Greatest number of halvings of edges.
const MOST_HALVINGS: usize = 8;

/// Points of a divided surface, linked along edges and across pairs of triangles within a patch. A point on
/// the border of patches occurs once for each of them.
pub(super) struct Web {
    mesh: TriMesh,
    /// Patch of each triangle.
    patch_of_face: Vec<PatchId>,
    /// Triangle of the surface that contains each one of `mesh`.
    source: Vec<u32>,
    /// Points of each triangle.
    corners: Vec<[u32; 3]>,
    /// Point of `mesh` at each point.
    at: Vec<u32>,
    /// Patch of each point.
    pub patch: Vec<PatchId>,
    /// True for each point on the border of its patch.
    pub is_border: Vec<bool>,
    /// Neighbours of each point, with their distances, mm.
    pub links: Vec<Vec<(u32, f64)>>,
    /// Area around each point, mm².
    pub area_mm2: Vec<f64>,
}

impl Web {
    /// Divides a surface until no edge is longer than `edge_mm`. `None` if the surface is not closed.
    pub(super) fn of(surface: &SegmentedSurface, edge_mm: f64) -> Option<Self> {
        let (fine, source) = refine(surface, edge_mm)?;
        let topology = Topology::new(&fine);
        let mut web = Self {
            patch_of_face: source
                .iter()
                .map(|&f| surface.patch_of_face[f as usize])
                .collect(),
            mesh: fine.into_mesh(),
            source,
            corners: Vec::new(),
            at: Vec::new(),
            patch: Vec::new(),
            is_border: Vec::new(),
            links: Vec::new(),
            area_mm2: Vec::new(),
        };
        web.add_points();
        web.link(&topology);
        Some(web)
    }

    fn add_points(&mut self) {
        // A point of the mesh has few patches; their points form a list.
        let mut first = vec![u32::MAX; self.mesh.points.len()];
        let mut next: Vec<u32> = Vec::new();
        for (face, t) in self.mesh.triangles.iter().enumerate() {
            let (patch, area_mm2) = (self.patch_of_face[face], self.mesh.face_area(face) / 3.0);
            let point = t.map(|v| {
                let mut i = first[v as usize];
                while i != u32::MAX && self.patch[i as usize] != patch {
                    i = next[i as usize];
                }
                if i == u32::MAX {
                    i = self.at.len() as u32;
                    self.at.push(v);
                    self.patch.push(patch);
                    self.area_mm2.push(0.0);
                    next.push(std::mem::replace(&mut first[v as usize], i));
                }
                self.area_mm2[i as usize] += area_mm2;
                i
            });
            self.corners.push(point);
        }
    }

    fn link(&mut self, topology: &Topology) {
        self.links = vec![Vec::new(); self.at.len()];
        self.is_border = vec![false; self.at.len()];
        let place = |i: u32| self.mesh.points[self.at[i as usize] as usize];
        // Corners of a half-edge's triangle, from its start.
        let corner = |h: HalfEdge, k: usize| self.corners[h as usize / 3][(h as usize % 3 + k) % 3];
        for h in 0..topology.n_half_edges() as HalfEdge {
            let o = topology.opposite(h);
            let (a, b) = (corner(h, 0), corner(h, 1));
            if self.patch_of_face[h as usize / 3] != self.patch_of_face[o as usize / 3] {
                self.is_border[a as usize] = true;
                self.is_border[b as usize] = true;
            } else if h < o {
                for (x, y) in [(a, b), (corner(h, 2), corner(o, 2))] {
                    let mm = place(x).distance(place(y));
                    self.links[x as usize].push((y, mm));
                    self.links[y as usize].push((x, mm));
                }
            }
        }
    }

    /// Place of a point.
    pub(super) fn place(&self, point: u32) -> Vec3 {
        self.mesh.points[self.at[point as usize] as usize]
    }

    /// Distance of every point from the nearest source, mm, within its patch.
    pub(super) fn distances(&self, is_source: impl Fn(usize) -> bool) -> Vec<f64> {
        let mut distance = vec![f64::INFINITY; self.links.len()];
        let mut front = BinaryHeap::new();
        for v in (0..distance.len()).filter(|&v| is_source(v)) {
            distance[v] = 0.0;
            front.push(Reverse((0u64, v as u32)));
        }
        while let Some(Reverse((bits, v))) = front.pop() {
            let d = f64::from_bits(bits);
            if d > distance[v as usize] {
                continue;
            }
            for &(w, length) in &self.links[v as usize] {
                if d + length < distance[w as usize] {
                    distance[w as usize] = d + length;
                    front.push(Reverse(((d + length).to_bits(), w)));
                }
            }
        }
        distance
    }

    /// Points that are linked to `first` by points that `belongs` accepts.
    pub(super) fn reach(&self, first: u32, belongs: impl Fn(usize) -> bool) -> Vec<bool> {
        let mut is_reached = vec![false; self.links.len()];
        let mut front = vec![first];
        is_reached[first as usize] = true;
        while let Some(v) = front.pop() {
            for &(w, _) in &self.links[v as usize] {
                if !is_reached[w as usize] && belongs(w as usize) {
                    is_reached[w as usize] = true;
                    front.push(w);
                }
            }
        }
        is_reached
    }

    /// Triangles of the surface of which most of the area, within a patch, is of triangles that `belongs`
    /// accepts.
    pub(super) fn sources_with(&self, patch: PatchId, belongs: impl Fn([u32; 3]) -> bool) -> Vec<u32> {
        let mut share = BTreeMap::<u32, [f64; 2]>::new();
        for (face, &t) in self.corners.iter().enumerate() {
            if self.patch_of_face[face] == patch {
                share.entry(self.source[face]).or_default()[usize::from(belongs(t))] +=
                    self.mesh.face_area(face);
            }
        }
        let most = share.into_iter().filter(|(_, s)| s[1] > s[0]);
        most.map(|(face, _)| face).collect()
    }
}

/// Halves edges until none is longer than `edge_mm`; with the triangle of the surface that contains each new
/// one.
fn refine(surface: &SegmentedSurface, edge_mm: f64) -> Option<(Solid, Vec<u32>)> {
    let mut fine = Solid::new(surface.mesh.clone()).ok()?;
    let mut source: Vec<u32> = (0..surface.mesh.triangles.len() as u32).collect();
    for _ in 0..MOST_HALVINGS {
        let mesh = fine.mesh();
        let is_long = |a: u32, b: u32| mesh.points[a as usize].distance(mesh.points[b as usize]) > edge_mm;
        let (next, parent) = halve_edges(&fine, &Topology::new(&fine), is_long);
        if next.mesh().triangles.len() == mesh.triangles.len() {
            break;
        }
        source = parent.iter().map(|&f| source[f as usize]).collect();
        fine = next;
    }
    Some((fine, source))
}
