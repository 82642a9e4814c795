//! Solids: closed meshes whose type carries the guarantee.

use crate::{TriMesh, Vec3};

/// A closed, consistently oriented triangle mesh of positive volume: each directed edge is used once and has
/// its opposite.
///
/// The only way to get one is [`Solid::new`]. Functions that need a volume take a `Solid`, so none of them
/// checks again. Not promised: faces may cross, vertices may be pinched, and there may be several bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid(TriMesh);

/// Reason why a mesh bounds no volume.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotSolid {
    /// The mesh has no triangles.
    #[error("the mesh has no triangles")]
    Empty,
    /// A triangle names a point that does not exist.
    #[error("triangle {face} names point {vertex}, but there are only {n_points}")]
    MissingPoint {
        /// Index of the triangle.
        face: usize,
        /// Point that the triangle names.
        vertex: u32,
        /// Number of points in the mesh.
        n_points: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("{count} points have a coordinate that is not a number; the first is point {vertex}")]
    NotFinite {
        /// First point with such a coordinate.
        vertex: usize,
        /// Number of such points.
        count: usize,
    },
    /// Some directed edges have no opposite.
    #[error("the surface is open along {count} edges, first at ({:.3}, {:.3}, {:.3})", at.x, at.y, at.z)]
    Open {
        /// Number of such edges.
        count: usize,
        /// Midpoint of the first such edge.
        at: Vec3,
    },
    /// Some directed edges are used more than once: the mesh is not manifold there, or neighbouring faces
    /// disagree.
    #[error(
        "{count} edges are shared by more than two triangles or join triangles that face opposite ways, \
         first at ({:.3}, {:.3}, {:.3})",
        at.x, at.y, at.z
    )]
    SharedEdge {
        /// Number of such edges.
        count: usize,
        /// Midpoint of the first such edge.
        at: Vec3,
    },
    /// The mesh is oriented inwards, or flat.
    #[error("the enclosed volume is {volume_mm3:.3} mm³: the surface is inside out or flat")]
    NoVolume {
        /// Signed volume, mm³, ≤ 0 or not a number.
        volume_mm3: f64,
    },
}

impl Solid {
    /// Checks `mesh` once. The error has the first defect found, with its count and place.
    pub fn new(mesh: TriMesh) -> Result<Self, NotSolid> {
        check_points(&mesh)?;
        check_edges(&mesh)?;
        let volume_mm3 = mesh.signed_volume();
        if volume_mm3 > 0.0 {
            Ok(Self(mesh))
        } else {
            Err(NotSolid::NoVolume { volume_mm3 })
        }
    }

    /// Borrows the mesh of the solid.
    pub fn mesh(&self) -> &TriMesh {
        &self.0
    }

    /// Returns the mesh for changes, which ends the guarantee.
    pub fn into_mesh(self) -> TriMesh {
        self.0
    }

    /// Enclosed volume, mm³, > 0.
    pub fn volume(&self) -> f64 {
        self.0.signed_volume()
    }
}

fn check_points(mesh: &TriMesh) -> Result<(), NotSolid> {
    if mesh.triangles.is_empty() {
        return Err(NotSolid::Empty);
    }
    let n_points = mesh.points.len();
    for (face, t) in mesh.triangles.iter().enumerate() {
        if let Some(&vertex) = t.iter().find(|&&v| v as usize >= n_points) {
            return Err(NotSolid::MissingPoint {
                face,
                vertex,
                n_points,
            });
        }
    }
    let bad = || mesh.points.iter().enumerate().filter(|(_, p)| !p.is_finite());
    match bad().next() {
        Some((vertex, _)) => Err(NotSolid::NotFinite {
            vertex,
            count: bad().count(),
        }),
        None => Ok(()),
    }
}

fn check_edges(mesh: &TriMesh) -> Result<(), NotSolid> {
    // Directed edges become (low, high, forwards) in sorted order: a closed manifold has each pair exactly
    // once each way.
    let mut edges: Vec<(u32, u32, bool)> = Vec::with_capacity(mesh.triangles.len() * 3);
    for &[a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            edges.push((from.min(to), from.max(to), from < to));
        }
    }
    edges.sort_unstable();
    let middle = |e: (u32, u32, bool)| 0.5 * (mesh.points[e.0 as usize] + mesh.points[e.1 as usize]);
    let (mut open, mut shared) = (None, None);
    let (mut n_open, mut n_shared) = (0, 0);
    for group in edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
        let forwards = group.iter().filter(|e| e.2).count();
        if group[0].0 == group[0].1 || forwards > 1 || group.len() - forwards > 1 {
            n_shared += 1;
            shared.get_or_insert(middle(group[0]));
        } else if group.len() == 1 {
            n_open += 1;
            open.get_or_insert(middle(group[0]));
        }
    }
    match (open, shared) {
        (_, Some(at)) => Err(NotSolid::SharedEdge { count: n_shared, at }),
        (Some(at), None) => Err(NotSolid::Open { count: n_open, at }),
        (None, None) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::tetrahedron;

    #[test]
    fn a_tetrahedron_has_its_volume() {
        assert!((Solid::new(tetrahedron()).unwrap().volume() - 1.0 / 6.0).abs() < 1e-15);
    }

    #[test]
    fn each_defect_is_named() {
        let mut open = tetrahedron();
        open.triangles.pop();
        assert!(matches!(Solid::new(open), Err(NotSolid::Open { count: 3, .. })));
        let mut twice = tetrahedron();
        twice.triangles.push([0, 2, 1]);
        assert!(matches!(
            Solid::new(twice),
            Err(NotSolid::SharedEdge { count: 3, .. })
        ));
        let mut inside_out = tetrahedron();
        inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert!(matches!(Solid::new(inside_out), Err(NotSolid::NoVolume { .. })));
        let mut nan = tetrahedron();
        nan.points[2].y = f64::NAN;
        assert_eq!(Solid::new(nan), Err(NotSolid::NotFinite { vertex: 2, count: 1 }));
    }
}
