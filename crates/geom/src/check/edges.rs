//! Sides of triangles, the edges at which they meet, and the defects of those edges.

use rayon::slice::ParallelSliceMut;

use super::groups::Groups;
use crate::{TriMesh, Vec3};

/// Edges that do not join exactly two consistently oriented triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Edges {
    /// Edges with one triangle.
    pub open: Spots,
    /// Number of groups of open edges connected over points. Equals the number of holes if no two holes
    /// touch.
    pub n_holes: usize,
    /// Edges with more than two triangles.
    pub non_manifold: Spots,
    /// Edges whose two triangles face opposite ways.
    pub flips: Spots,
    /// Number of triangles over the same three points as an earlier triangle.
    pub n_copies: usize,
}

impl Edges {
    /// Returns true if each edge joins two triangles of the same orientation.
    pub fn is_closed(&self) -> bool {
        self.open.count == 0 && self.non_manifold.count == 0 && self.flips.count == 0
    }
}

/// Number of occurrences of a defect, and one place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spots {
    /// Number of occurrences found.
    pub count: usize,
    /// Place of the first occurrence, file units; the origin if `count` is 0.
    pub first: Vec3,
}

impl Spots {
    pub(super) fn add(&mut self, at: Vec3) {
        if self.count == 0 {
            self.first = at;
        }
        self.count += 1;
    }
}

/// Runs the part of [`inspect`](super::inspect) that counts edges.
pub(crate) fn inspect_edges(mesh: &TriMesh) -> Edges {
    count_edges(mesh, &sides(mesh))
}

/// Edge with one triangle, in the direction in which the triangle traverses it.
pub(crate) struct OpenEdge {
    pub(crate) from: u32,
    pub(crate) to: u32,
    pub(crate) face: u32,
    /// Side of the triangle: 0, 1 or 2.
    pub(crate) side: u8,
}

impl OpenEdge {
    pub(crate) fn length(&self, mesh: &TriMesh) -> f64 {
        mesh.points[self.from as usize].distance(mesh.points[self.to as usize])
    }
}

/// All edges with one triangle, sorted by their points.
pub(crate) fn open_edges(mesh: &TriMesh) -> Vec<OpenEdge> {
    let sides = sides(mesh);
    let single = sides
        .chunk_by(TriangleSide::same_edge)
        .filter(|edge| edge.len() == 1);
    single
        .map(|edge| {
            let (face, side) = (edge[0].face(), (edge[0].corner % 3) as u8);
            let triangle = mesh.triangles[face as usize];
            OpenEdge {
                from: triangle[side as usize],
                to: triangle[(side as usize + 1) % 3],
                face,
                side,
            }
        })
        .collect()
}

/// Side of a triangle, from corner `corner` (three times the face, plus 0, 1 or 2) to the next one.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct TriangleSide {
    pub(crate) low: u32,
    pub(crate) high: u32,
    pub(crate) corner: u32,
}

impl TriangleSide {
    pub(crate) fn same_edge(&self, other: &Self) -> bool {
        (self.low, self.high) == (other.low, other.high)
    }

    /// Corner of this side that is at point `end`; there are two.
    pub(super) fn corner_at(&self, mesh: &TriMesh, end: u32) -> u32 {
        let (face, k) = (self.corner / 3, self.corner % 3);
        if mesh.triangles[face as usize][k as usize] == end {
            self.corner
        } else {
            3 * face + (k + 1) % 3
        }
    }

    pub(crate) fn runs_up(&self, mesh: &TriMesh) -> bool {
        self.corner_at(mesh, self.low) == self.corner
    }

    pub(crate) fn face(&self) -> u32 {
        self.corner / 3
    }
}

/// All sides of all triangles, with sides of the same edge next to each other.
pub(crate) fn sides(mesh: &TriMesh) -> Vec<TriangleSide> {
    let all = || {
        mesh.triangles.iter().zip(0_u32..).flat_map(|(&[a, b, c], face)| {
            [(a, b, 0), (b, c, 1), (c, a, 2)].map(|(from, to, k)| TriangleSide {
                low: from.min(to),
                high: from.max(to),
                corner: 3 * face + k,
            })
        })
    };
    // A counting sort groups the sides by their lower point. Sorting the few sides of each point afterwards
    // makes this several times faster than sorting all sides at once.
    let mut begin = vec![0_u32; mesh.points.len() + 1];
    all().for_each(|side| begin[side.low as usize + 1] += 1);
    for point in 0..mesh.points.len() {
        begin[point + 1] += begin[point];
    }
    let mut next = begin.clone();
    let mut sides = vec![
        TriangleSide {
            low: 0,
            high: 0,
            corner: 0
        };
        3 * mesh.triangles.len()
    ];
    for side in all() {
        sides[next[side.low as usize] as usize] = side;
        next[side.low as usize] += 1;
    }
    begin
        .windows(2)
        .for_each(|range| sides[range[0] as usize..range[1] as usize].sort_unstable());
    sides
}

pub(super) fn count_edges(mesh: &TriMesh, sides: &[TriangleSide]) -> Edges {
    let mut edges = Edges::default();
    let mut open_ends = Vec::new();
    let mut has_shared = false;
    for edge in sides.chunk_by(TriangleSide::same_edge) {
        let [low, high] = [edge[0].low, edge[0].high];
        let middle = || 0.5 * (mesh.points[low as usize] + mesh.points[high as usize]);
        match edge {
            [one] => {
                edges.open.add(middle());
                open_ends.push((one.low, one.high));
            }
            [one, other] if low != high && one.runs_up(mesh) != other.runs_up(mesh) => {}
            [_, _] if low != high => edges.flips.add(middle()),
            _ => {
                edges.non_manifold.add(middle());
                has_shared = true;
            }
        }
    }
    edges.n_holes = count_holes(mesh.points.len(), &open_ends);
    edges.n_copies = if has_shared { count_copies(mesh) } else { 0 };
    edges
}

fn count_holes(n_points: usize, open_ends: &[(u32, u32)]) -> usize {
    if open_ends.is_empty() {
        return 0;
    }
    let mut points = Groups::of(n_points);
    open_ends.iter().for_each(|&(a, b)| points.unite(a, b));
    let mut holes: Vec<u32> = open_ends.iter().map(|&(a, _)| points.find(a)).collect();
    holes.sort_unstable();
    holes.dedup();
    holes.len()
}

fn count_copies(mesh: &TriMesh) -> usize {
    let mut corner_sets = mesh.triangles.clone();
    corner_sets.iter_mut().for_each(|t| t.sort_unstable());
    corner_sets.par_sort_unstable();
    corner_sets.windows(2).filter(|pair| pair[0] == pair[1]).count()
}
