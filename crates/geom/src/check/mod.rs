//! Diagnosis of a mesh: is it one body? Defects are counted, located, and explained to the mesh's author.
//!
//! [`inspect`] counts, [`into_solid`] decides, and [`crate::repair`] repairs rejected meshes. Not checked
//! here: faces that cross each other, and thin walls.

pub(crate) mod edges;
mod error;
mod groups;

use edges::count_edges;
pub use edges::{Edges, Spots};
pub(crate) use edges::{OpenEdge, TriangleSide, inspect_edges, open_edges, sides};
pub use error::InputError;
pub(crate) use error::{Coordinates, Short, plural};

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
