//! Cuts triangles along the lines where two soft labels tie.
//!
//! ```text
//!  two patches         three patches
//!       a                    a
//!      / \                 /   \
//!     x---y               x--m--z       x, y, z: ties on edges, shared with the triangle across
//!    /  \  \             /   |   \      m: where all three tie
//!   b-------c           b----y----c
//! ```

use shellock_geom::topology::ends;
use shellock_geom::{Solid, Topology, TriMesh, Vec3};

/// Least distance of a cut from an edge's ends, in edge lengths.
///
/// Ties nearer to an end are moved here. This shifts a seam by a fiftieth of an edge at most and keeps
/// slivers measurable. Every triangle keeps its combinatorial case, so the result is closed and patches stay
/// connected by construction.
const MIN_CUT: f64 = 0.02;
/// Least barycentric coordinate of a triple point, for the same reason.
const MIN_INSIDE: f64 = 0.05;
const NO_POINT: u32 = u32::MAX;

/// A mesh with one owner for each triangle.
pub(super) struct Cut {
    pub mesh: TriMesh,
    pub owner: Vec<u32>,
    pub source_face: Vec<u32>,
}

/// Cuts between points of different `owner`, at the tie of their linearly interpolated `soft` labels.
pub(super) fn cut_along_ties(solid: &Solid, soft: &[f64], owner: &[u32]) -> Cut {
    let (mesh, topology) = (solid.mesh(), Topology::new(solid));
    let n_points = mesh.points.len();
    let value = |k: u32, v: u32| soft[k as usize * n_points + v as usize];
    let mut points = mesh.points.clone();
    let mut tie = vec![NO_POINT; topology.n_half_edges()];
    for h in 0..topology.n_half_edges() as u32 {
        let (a, b) = ends(mesh, h);
        let (i, j) = (owner[a as usize], owner[b as usize]);
        if i == j || h > topology.opposite(h) {
            continue;
        }
        let (lead_at_a, lead_at_b) = (value(i, a) - value(j, a), value(j, b) - value(i, b));
        // A point that changed its owner as part of an island may not lead.
        let s = if lead_at_a > 0.0 && lead_at_b > 0.0 {
            lead_at_a / (lead_at_a + lead_at_b)
        } else {
            0.5
        };
        tie[h as usize] = points.len() as u32;
        tie[topology.opposite(h) as usize] = points.len() as u32;
        points.push(mesh.points[a as usize].lerp(mesh.points[b as usize], s.clamp(MIN_CUT, 1.0 - MIN_CUT)));
    }
    let mut cut = Cut {
        mesh: TriMesh {
            points,
            triangles: Vec::new(),
        },
        owner: Vec::new(),
        source_face: Vec::new(),
    };
    for (face, &t) in mesh.triangles.iter().enumerate() {
        let x = [0, 1, 2].map(|corner| tie[3 * face + corner]);
        let k = t.map(|v| owner[v as usize]);
        match x.iter().filter(|&&p| p != NO_POINT).count() {
            0 => cut.push(face, k[0], t),
            2 => cut.cut_in_two(face, t, k, x),
            _ => {
                let lead =
                    |from: usize, to: usize| [0, 1, 2].map(|c| value(k[from], t[c]) - value(k[to], t[c]));
                let inside = triple_point(Vec3::from(lead(0, 1)), Vec3::from(lead(0, 2)));
                cut.cut_in_three(face, t, k, x, inside);
            }
        }
    }
    cut
}

/// Barycentric coordinates of the common zero of two linear functions, given by their values at the corners;
/// the middle if that zero is not well inside.
fn triple_point(lead_1: Vec3, lead_2: Vec3) -> Vec3 {
    let w = lead_1.cross(lead_2);
    let w = w / w.element_sum();
    if w.is_finite() && w.min_element() >= MIN_INSIDE {
        w
    } else {
        Vec3::splat(1.0 / 3.0)
    }
}

impl Cut {
    fn push(&mut self, face: usize, owner: u32, t: [u32; 3]) {
        self.mesh.triangles.push(t);
        self.owner.push(owner);
        self.source_face.push(face as u32);
    }

    /// Cuts a triangle with one corner whose owner differs from that of the two others.
    fn cut_in_two(&mut self, face: usize, t: [u32; 3], k: [u32; 3], x: [u32; 3]) {
        // The lone corner a lies across the edge without a tie.
        let lone = (0..3)
            .find(|&c| x[(c + 1) % 3] == NO_POINT)
            .expect("one of three edges has no tie");
        let [a, b, c] = [0, 1, 2].map(|i| t[(lone + i) % 3]);
        let (ab, ca) = (x[lone], x[(lone + 2) % 3]);
        let others = k[(lone + 1) % 3];
        self.push(face, k[lone], [a, ab, ca]);
        let length =
            |p: u32, q: u32| self.mesh.points[p as usize].distance_squared(self.mesh.points[q as usize]);
        if length(ab, c) <= length(b, ca) {
            self.push(face, others, [ab, b, c]);
            self.push(face, others, [ab, c, ca]);
        } else {
            self.push(face, others, [ab, b, ca]);
            self.push(face, others, [b, c, ca]);
        }
    }

    /// Cuts a triangle whose corners all have different owners; `inside` are the barycentric coordinates of
    /// the triple point.
    fn cut_in_three(&mut self, face: usize, t: [u32; 3], k: [u32; 3], x: [u32; 3], inside: Vec3) {
        let [p, q, r] = t.map(|v| self.mesh.points[v as usize]);
        let middle = self.mesh.points.len() as u32;
        self.mesh.points.push(p * inside.x + q * inside.y + r * inside.z);
        for c in 0..3 {
            self.push(face, k[c], [t[c], x[c], middle]);
            self.push(face, k[c], [t[c], middle, x[(c + 2) % 3]]);
        }
    }
}
