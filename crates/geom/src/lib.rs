//! Geometry that cannot fail: meshes, solids, fields, contouring, booleans, distances, sparse solves and file formats.
//!
//! This crate knows no patch, piece, plan or printer. Lengths are millimetres unless a name says otherwise; fields are
//! positive inside; triangles are counter-clockwise seen from outside.

pub mod contour;
pub mod mesh;
pub mod solid;

pub use glam::DVec3 as Vec3;
pub use mesh::{Aabb, TriMesh};
pub use solid::{NotSolid, Solid};
