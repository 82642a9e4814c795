//! Small holes, closed by the triangles of least area between their edges.

use super::{Draft, HOLE_SHARE, Repair, RepairKind};
use crate::check::{TriangleSide, sides};
use crate::{Aabb, TriMesh, Vec3};

/// Largest number of edges of a hole that is closed. Larger ones that are as narrow are cracks of another
/// kind.
const MAX_EDGES: usize = 64;
/// Largest number of point triples that are tested: some thousands of holes of usual size.
const MAX_WORK: usize = 300_000_000;

/// Closes holes of three edges, which have only one filling, and holes narrower than [`HOLE_SHARE`] of the
/// diagonal.
pub(super) fn close(draft: &mut Draft) -> Option<Repair> {
    let widest_allowed = HOLE_SHARE * draft.mesh.bounds().diagonal();
    let rims = Rims::of(&draft.mesh);
    let mut caps = Vec::new();
    let (mut count, mut widest, mut at) = (0, 0.0_f64, Vec3::ZERO);
    let mut work = 0;
    for rim in rims.loops() {
        let points: Vec<Vec3> = rim
            .points
            .iter()
            .map(|&p| draft.mesh.points[p as usize])
            .collect();
        let bounds = Aabb::around(points.iter().copied());
        let width = bounds.size().max_element();
        work += points.len().pow(3) / 6;
        let is_small = points.len() == 3 || (points.len() <= MAX_EDGES && width <= widest_allowed);
        // A single triangle has a rim of three edges, too.
        let is_alone = points.len() == 3
            && rim
                .points
                .iter()
                .all(|p| draft.mesh.triangles[rim.face as usize].contains(p));
        if !is_small || is_alone || work > MAX_WORK || !is_simple(&rim.points) {
            continue;
        }
        let Some(cap) = cap(&rim.points, &points, |a, b| rims.has_edge(a, b)) else {
            continue;
        };
        caps.push((cap, draft.source[rim.face as usize]));
        if count == 0 {
            at = bounds.center();
        }
        (count, widest) = (count + 1, widest.max(width));
    }
    for (cap, source) in caps {
        draft.mesh.triangles.extend(cap);
        draft.source.resize(draft.mesh.triangles.len(), source);
    }
    (count > 0).then_some(Repair {
        kind: RepairKind::Closed { widest },
        count,
        at,
    })
}

/// Triangles that close all holes of `mesh`, hole by hole, each with an adjacent triangle. `None` if a hole
/// has too many edges or touches itself.
pub(crate) fn cap_all(mesh: &TriMesh) -> Option<Vec<(Vec<[u32; 3]>, u32)>> {
    /// Largest number of edges of a hole. Time is cubic in it, and this many edges take a second.
    const MAX_EDGES: usize = 1000;
    let rims = Rims::of(mesh);
    let loops = rims.loops();
    let n_open = rims.opposite.iter().filter(|o| o.is_none()).count();
    if loops.iter().map(|rim| rim.points.len()).sum::<usize>() != n_open {
        return None;
    }
    let close = |rim: Rim| {
        if rim.points.len() > MAX_EDGES || !is_simple(&rim.points) {
            return None;
        }
        let points: Vec<Vec3> = rim.points.iter().map(|&p| mesh.points[p as usize]).collect();
        let cap = cap(&rim.points, &points, |a, b| rims.has_edge(a, b))?;
        Some((cap, rim.face))
    };
    loops.into_iter().map(close).collect()
}

fn is_simple(points: &[u32]) -> bool {
    let mut sorted = points.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).all(|pair| pair[0] != pair[1])
}

/// Rim of a hole, in the direction of the triangles that close it.
struct Rim {
    points: Vec<u32>,
    /// A triangle next to the rim.
    face: u32,
}

/// All open edges of a mesh, with their surroundings.
struct Rims<'a> {
    mesh: &'a TriMesh,
    sides: Vec<TriangleSide>,
    /// Corner at which the neighbour's side along the same edge begins, for each corner; `None` if the edge
    /// is open.
    opposite: Vec<Option<u32>>,
}

impl<'a> Rims<'a> {
    fn of(mesh: &'a TriMesh) -> Self {
        let sides = sides(mesh);
        let mut opposite = vec![None; 3 * mesh.triangles.len()];
        for edge in sides.chunk_by(TriangleSide::same_edge) {
            if let [one, other] = edge
                && one.runs_up(mesh) != other.runs_up(mesh)
            {
                opposite[one.corner as usize] = Some(other.corner);
                opposite[other.corner as usize] = Some(one.corner);
            }
        }
        Self {
            mesh,
            sides,
            opposite,
        }
    }

    fn has_edge(&self, a: u32, b: u32) -> bool {
        self.sides
            .binary_search_by_key(&(a.min(b), a.max(b)), |s| (s.low, s.high))
            .is_ok()
    }

    /// Walks around each hole. Open edges next to edges of three and more triangles may lead nowhere; these
    /// give no hole.
    fn loops(&self) -> Vec<Rim> {
        let is_single = |edge: &[TriangleSide]| edge.len() == 1;
        let mut is_open = vec![false; self.opposite.len()];
        let open: Vec<u32> = self
            .sides
            .chunk_by(TriangleSide::same_edge)
            .filter(|e| is_single(e))
            .map(|e| e[0].corner)
            .collect();
        open.iter().for_each(|&corner| is_open[corner as usize] = true);
        let mut is_seen = vec![false; self.opposite.len()];
        let mut found = Vec::new();
        let mut starts = open;
        starts.sort_unstable();
        for start in starts {
            let (mut at, mut points) = (start, Vec::new());
            while !std::mem::replace(&mut is_seen[at as usize], true) {
                points.push(self.head(at));
                match self.next(at, &is_open) {
                    Some(next) => at = next,
                    None => break,
                }
            }
            if at == start && points.len() >= 3 {
                found.push(Rim {
                    points,
                    face: start / 3,
                });
            }
        }
        found
    }

    /// End point of the side that begins at `corner`.
    fn head(&self, corner: u32) -> u32 {
        self.mesh.triangles[corner as usize / 3][(corner as usize % 3 + 1) % 3]
    }

    /// Open side that ends at the point where the side from `corner` begins.
    fn next(&self, corner: u32, is_open: &[bool]) -> Option<u32> {
        let before = |c: u32| if c.is_multiple_of(3) { c + 2 } else { c - 1 };
        let mut at = before(corner);
        // The steps are as many as the triangles around the point, at most all.
        for _ in 0..self.opposite.len() {
            if is_open[at as usize] {
                return Some(at);
            }
            at = before(self.opposite[at as usize]?);
        }
        None
    }
}

/// Triangles of least area that fill a polygon without using an existing edge; `None` if there are none.
fn cap(names: &[u32], points: &[Vec3], has_edge: impl Fn(u32, u32) -> bool) -> Option<Vec<[u32; 3]>> {
    let n = names.len();
    // The least area of the polygon from i to j, and the third corner of its triangle on edge ij.
    let mut least = vec![vec![(0.0_f64, 0_usize); n]; n];
    for span in 2..n {
        for i in 0..n - span {
            let j = i + span;
            let is_rim = i == 0 && j == n - 1;
            least[i][j] = (f64::INFINITY, i + 1);
            if !is_rim && has_edge(names[i], names[j]) {
                continue;
            }
            for k in i + 1..j {
                let area = (points[k] - points[i]).cross(points[j] - points[i]).length();
                let sum = least[i][k].0 + least[k][j].0 + area;
                if sum < least[i][j].0 {
                    least[i][j] = (sum, k);
                }
            }
        }
    }
    if !least[0][n - 1].0.is_finite() {
        return None;
    }
    let (mut todo, mut cap) = (vec![(0, n - 1)], Vec::new());
    while let Some((i, j)) = todo.pop() {
        if j - i >= 2 {
            let k = least[i][j].1;
            cap.push([names[i], names[k], names[j]]);
            todo.extend([(i, k), (k, j)]);
        }
    }
    Some(cap)
}
