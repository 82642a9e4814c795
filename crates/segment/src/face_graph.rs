//! Dual graph of a mesh, on which every method runs: triangles are nodes, edges between them are arcs.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use shellock_geom::{TriMesh, Vec3};

/// An edge between two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crease {
    /// Triangles on both sides of the edge, lower number first.
    pub faces: [u32; 2],
    /// Length of the edge, mm.
    pub length_mm: f64,
    /// Angle between the normals, rad, in (−π, π]: positive over a convex edge, negative in a concave one. 0
    /// where flat or where a triangle has no normal.
    pub turning_rad: f64,
    /// Length of the path between the triangles' centres over the edge's midpoint, mm.
    pub step_mm: f64,
}

impl Crease {
    /// Angle by which the surface folds inwards at the edge, rad, in [0, π]; 0 at convex edges.
    pub fn concavity_rad(&self) -> f64 {
        (-self.turning_rad).max(0.0)
    }
}

/// The triangles of a mesh and the edges that join them.
///
/// Accepts any mesh. Triangles at an open edge have no neighbour there. Triangles at an edge of more than two
/// are joined in a row, in the order of their numbers.
#[derive(Clone, Debug)]
pub struct FaceGraph {
    /// Area of each triangle, mm².
    pub area_mm2: Vec<f64>,
    /// Centre of each triangle, mm: the mean of its corners.
    pub center: Vec<Vec3>,
    /// Unit normal of each triangle; zero if it has no area.
    pub normal: Vec<Vec3>,
    /// All edges with a triangle on both sides, sorted by their triangles.
    pub creases: Vec<Crease>,
    start: Vec<u32>,
    arcs: Vec<(u32, u32)>,
}

impl FaceGraph {
    /// Builds the graph of `mesh` in O(n log n).
    pub fn new(mesh: &TriMesh) -> Self {
        let n_faces = mesh.triangles.len();
        let center: Vec<Vec3> = (0..n_faces).map(|f| mesh.face_center(f)).collect();
        let normal: Vec<Vec3> = (0..n_faces).map(|f| mesh.face_normal(f)).collect();
        let mut sides: Vec<([u32; 2], u32)> = (0..n_faces as u32)
            .flat_map(|f| {
                let [a, b, c] = mesh.triangles[f as usize];
                [(a, b), (b, c), (c, a)].map(|(u, v)| ([u.min(v), u.max(v)], f))
            })
            .collect();
        sides.sort_unstable();
        let mut creases = Vec::with_capacity(sides.len() / 2);
        for side in sides.chunk_by(|x, y| x.0 == y.0) {
            let [u, v] = side[0].0.map(|v| mesh.points[v as usize]);
            for pair in side.windows(2) {
                let faces = [pair[0].1, pair[1].1];
                if faces[0] == faces[1] {
                    continue;
                }
                let [f, g] = faces.map(|f| f as usize);
                let turning = normal[f].dot(normal[g]).clamp(-1.0, 1.0).acos();
                let is_flat = normal[f] == Vec3::ZERO || normal[g] == Vec3::ZERO;
                let is_concave = (normal[g] - normal[f]).dot(center[g] - center[f]) < 0.0;
                let middle = 0.5 * (u + v);
                creases.push(Crease {
                    faces,
                    length_mm: u.distance(v),
                    turning_rad: match (is_flat, is_concave) {
                        (true, _) => 0.0,
                        (_, true) => -turning,
                        (_, false) => turning,
                    },
                    step_mm: middle.distance(center[f]) + middle.distance(center[g]),
                });
            }
        }
        creases.sort_unstable_by_key(|c| c.faces);
        let (start, arcs) = arcs_of(n_faces, &creases);
        Self {
            area_mm2: (0..n_faces).map(|f| mesh.face_area(f)).collect(),
            center,
            normal,
            creases,
            start,
            arcs,
        }
    }

    /// Number of triangles of the mesh.
    pub fn n_faces(&self) -> usize {
        self.area_mm2.len()
    }

    /// Neighbours of `face`, each with the index of the edge between.
    pub fn arcs(&self, face: u32) -> &[(u32, u32)] {
        &self.arcs[self.start[face as usize] as usize..self.start[face as usize + 1] as usize]
    }

    /// Sum of all areas, mm².
    pub fn total_area_mm2(&self) -> f64 {
        self.area_mm2.iter().sum()
    }

    /// Shortest distance of each face from `sources`, which are pairs of face and index, and the index of the
    /// nearest source. Paths follow arcs of the lengths `length` (one per edge, ≥ 0) through faces that
    /// `allowed` accepts. Unreachable faces get infinity and `u32::MAX`.
    ///
    /// The region of each source is connected, since a front only advances through faces that it owns.
    pub fn distances(
        &self,
        sources: impl IntoIterator<Item = (u32, u32)>,
        length: &[f64],
        allowed: impl Fn(u32) -> bool,
    ) -> (Vec<f64>, Vec<u32>) {
        let mut distance = vec![f64::INFINITY; self.n_faces()];
        let mut owner = vec![u32::MAX; self.n_faces()];
        // Non-negative floats order like their bits; face and owner break ties the same way on every run.
        let mut front = BinaryHeap::new();
        for (face, source) in sources {
            if owner[face as usize] == u32::MAX {
                distance[face as usize] = 0.0;
                owner[face as usize] = source;
                front.push(Reverse((0, face, source)));
            }
        }
        while let Some(Reverse((bits, face, source))) = front.pop() {
            let so_far = f64::from_bits(bits);
            if so_far > distance[face as usize] || owner[face as usize] != source {
                continue;
            }
            for &(other, crease) in self.arcs(face) {
                let reached = so_far + length[crease as usize];
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

/// Arcs of all faces in compressed rows: the start of each face's row, and pairs of neighbour and edge.
fn arcs_of(n_faces: usize, creases: &[Crease]) -> (Vec<u32>, Vec<(u32, u32)>) {
    let mut start = vec![0_u32; n_faces + 1];
    for face in creases.iter().flat_map(|c| c.faces) {
        start[face as usize + 1] += 1;
    }
    for face in 0..n_faces {
        start[face + 1] += start[face];
    }
    let mut next = start.clone();
    let mut arcs = vec![(0, 0); 2 * creases.len()];
    for (crease, number) in creases.iter().zip(0..) {
        let [f, g] = crease.faces;
        for (here, there) in [(f, g), (g, f)] {
            arcs[next[here as usize] as usize] = (there, number);
            next[here as usize] += 1;
        }
    }
    (start, arcs)
}
