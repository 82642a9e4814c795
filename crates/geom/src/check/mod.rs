//! Diagnosis of a mesh: is it one body? Defects are counted, located, and explained to the mesh's author.
//!
//! [`inspect`] counts, [`into_solid`] decides, and [`crate::repair`] repairs rejected meshes. Not checked
//! here: faces that cross each other, and thin walls.

mod error;
mod groups;

pub use error::InputError;
pub(crate) use error::{Coordinates, Short, plural};

use rayon::slice::ParallelSliceMut;

use crate::weld::{Welded, close};
use crate::{Aabb, NotSolid, Solid, TriMesh, Vec3};
pub(crate) use groups::Groups;

/// Largest coordinate, file units. Beyond it, products of six lengths, which exact unions form, overflow.
const FARTHEST: f64 = 1e30;

/// Result of inspecting a mesh's triangles and their neighbours.
#[derive(Clone, Debug, PartialEq)]
pub struct Inspection {
    /// Defects of the mesh's edges.
    pub edges: Edges,
    /// Points where several fans of triangles touch.
    pub pinches: Spots,
    /// Groups of triangles connected over edges, largest bounding box first.
    pub bodies: Vec<ClosedPart>,
}

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
    fn add(&mut self, at: Vec3) {
        if self.count == 0 {
            self.first = at;
        }
        self.count += 1;
    }
}

/// Group of triangles connected over edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosedPart {
    /// Number of triangles in the group.
    pub n_faces: usize,
    /// Bounding box of the group, file units.
    pub bounds: Aabb,
    /// Enclosed volume, file units cubed; negative if inside out, meaningless if open.
    pub signed_volume: f64,
}

/// Turns a mesh as read into one body. Merges equal points where needed, and rejects anything but one closed
/// surface.
///
/// Also returns the index in `mesh` of each triangle of the solid, ascending. O(n log n).
pub fn into_solid(mesh: &TriMesh) -> Result<(Solid, Vec<u32>), InputError> {
    check_points(mesh)?;
    let Welded {
        mesh,
        kept_face,
        n_collapsed,
    } = close(mesh);
    if mesh.triangles.is_empty() {
        return Err(InputError::Empty);
    }
    refuse(&inspect(&mesh), mesh.triangles.len(), n_collapsed)?;
    match Solid::new(mesh) {
        Ok(solid) => Ok((solid, kept_face)),
        Err(reason) => Err(InputError::NotSolid(reason)),
    }
}

/// Returns the first defect of a mesh, in the order in which a person would repair them.
pub(crate) fn refuse(inspection: &Inspection, n_faces: usize, n_collapsed: usize) -> Result<(), InputError> {
    let Inspection {
        edges,
        pinches,
        bodies,
    } = inspection;
    let at = |spots: &Spots| (spots.count, spots.first);
    // A few collapsed triangles are usual and harmless; one in a hundred on a broken surface is the cause.
    if !edges.is_closed() && 100 * n_collapsed > n_faces {
        return Err(InputError::Collapsed {
            count: n_collapsed,
            n_faces: n_faces + n_collapsed,
        });
    }
    if let (count @ 1.., at) = at(&edges.non_manifold) {
        return Err(InputError::Shared {
            count,
            at,
            n_copies: edges.n_copies,
        });
    }
    if let (count @ 1.., at) = at(&edges.flips) {
        return Err(InputError::Turned { count, at });
    }
    if let (count @ 1.., at) = at(&edges.open) {
        if count > n_faces {
            return Err(InputError::Loose { count, n_faces, at });
        }
        return Err(InputError::Open {
            count,
            n_holes: edges.n_holes,
            at,
        });
    }
    if bodies.len() > 1 {
        return Err(InputError::Bodies(bodies.clone()));
    }
    if let (count @ 1.., at) = at(pinches) {
        return Err(InputError::Pinched { count, at });
    }
    match bodies.first() {
        Some(body) if body.signed_volume < 0.0 => Err(InputError::InsideOut),
        Some(body) if body.signed_volume == 0.0 => Err(InputError::Flat),
        _ => Ok(()),
    }
}

pub(crate) fn check_points(mesh: &TriMesh) -> Result<(), InputError> {
    let n_points = mesh.points.len();
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        if let Some(&vertex) = triangle.iter().find(|&&v| v as usize >= n_points) {
            return Err(InputError::NotSolid(NotSolid::MissingPoint {
                face,
                vertex,
                n_points,
            }));
        }
    }
    let count = |is_bad: fn(Vec3) -> bool| {
        let mut bad = mesh.points.iter().enumerate().filter(|(_, p)| is_bad(**p));
        bad.next().map(|(vertex, _)| (vertex, 1 + bad.count()))
    };
    if let Some((vertex, count)) = count(|p| !p.is_finite()) {
        return Err(InputError::NotFinite { vertex, count });
    }
    match count(|p| p.abs().max_element() > FARTHEST) {
        Some((vertex, count)) => Err(InputError::TooFar { vertex, count }),
        None => Ok(()),
    }
}

/// Counts bodies, holes and defects of a mesh whose equal points are merged. O(n log n).
///
/// # Panics
/// Panics if a triangle names a missing point.
pub fn inspect(mesh: &TriMesh) -> Inspection {
    let sides = sides(mesh);
    let mut faces = connected_faces(mesh, &sides);
    let mut corners = connected_corners(mesh, &sides);
    Inspection {
        edges: count_edges(mesh, &sides),
        pinches: find_pinches(mesh, &mut corners),
        bodies: bodies(mesh, &mut faces),
    }
}

/// Groups of triangles connected over edges.
fn connected_faces(mesh: &TriMesh, sides: &[TriangleSide]) -> Groups {
    let mut faces = Groups::of(mesh.triangles.len());
    for edge in sides.chunk_by(TriangleSide::same_edge) {
        edge[1..]
            .iter()
            .for_each(|side| faces.unite(edge[0].face(), side.face()));
    }
    faces
}

/// Groups of corners at the same point whose triangles are connected over edges: the fans.
fn connected_corners(mesh: &TriMesh, sides: &[TriangleSide]) -> Groups {
    let mut corners = Groups::of(3 * mesh.triangles.len());
    for edge in sides.chunk_by(TriangleSide::same_edge) {
        for side in &edge[1..] {
            for end in [edge[0].low, edge[0].high] {
                corners.unite(edge[0].corner_at(mesh, end), side.corner_at(mesh, end));
            }
        }
    }
    corners
}

/// Fans of triangles, as groups of corners. A corner's number is three times the triangle, plus 0, 1 or 2.
pub(crate) fn fans(mesh: &TriMesh) -> Groups {
    connected_corners(mesh, &sides(mesh))
}

/// Connected part of each triangle, and the number of parts. Parts are numbered by their first triangle.
pub(crate) fn components(mesh: &TriMesh) -> (Vec<u32>, usize) {
    let mut faces = connected_faces(mesh, &sides(mesh));
    let mut number = vec![None; mesh.triangles.len()];
    let mut n_parts = 0;
    let part_of_face = (0..mesh.triangles.len() as u32)
        .map(|face| {
            *number[faces.find(face) as usize].get_or_insert_with(|| {
                n_parts += 1;
                n_parts - 1
            })
        })
        .collect();
    (part_of_face, n_parts as usize)
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

/// Runs the part of [`inspect`] that counts edges.
pub(crate) fn inspect_edges(mesh: &TriMesh) -> Edges {
    count_edges(mesh, &sides(mesh))
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
    fn corner_at(&self, mesh: &TriMesh, end: u32) -> u32 {
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

fn count_edges(mesh: &TriMesh, sides: &[TriangleSide]) -> Edges {
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

fn find_pinches(mesh: &TriMesh, corners: &mut Groups) -> Spots {
    let mut fan_of = vec![None; mesh.points.len()];
    let mut is_pinched = vec![false; mesh.points.len()];
    for (&point, corner) in mesh.triangles.as_flattened().iter().zip(0_u32..) {
        let fan = corners.find(corner);
        is_pinched[point as usize] |= *fan_of[point as usize].get_or_insert(fan) != fan;
    }
    let mut spots = Spots::default();
    mesh.points
        .iter()
        .zip(is_pinched)
        .filter(|(_, pinched)| *pinched)
        .for_each(|(p, _)| spots.add(*p));
    spots
}

fn bodies(mesh: &TriMesh, faces: &mut Groups) -> Vec<ClosedPart> {
    /// Marks a group that has no body yet.
    const NEW: u32 = u32::MAX;
    let mut body_of = vec![NEW; mesh.triangles.len()];
    let mut bodies: Vec<ClosedPart> = Vec::new();
    // A local origin keeps the volume exact far away from 0.
    let mut origins = Vec::new();
    for face in 0..mesh.triangles.len() {
        let root = faces.find(face as u32) as usize;
        let corners = mesh.corners(face);
        if body_of[root] == NEW {
            body_of[root] = bodies.len() as u32;
            bodies.push(ClosedPart {
                n_faces: 0,
                bounds: Aabb::EMPTY,
                signed_volume: 0.0,
            });
            origins.push(corners[0]);
        }
        let body = &mut bodies[body_of[root] as usize];
        let [a, b, c] = corners.map(|p| p - origins[body_of[root] as usize]);
        body.n_faces += 1;
        body.bounds = body.bounds.union(Aabb::around(corners));
        body.signed_volume += a.dot(b.cross(c));
    }
    bodies.iter_mut().for_each(|body| body.signed_volume /= 6.0);
    bodies.sort_by(|a, b| b.bounds.diagonal().total_cmp(&a.bounds.diagonal()));
    bodies
}

#[cfg(test)]
mod tests;
