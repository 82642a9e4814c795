//! Robust geometry: meshes, solids, fields, contouring, booleans, distances and sparse solves.
//!
//! This crate does not know patches, pieces, plans or printers. Lengths are millimetres unless a name says
//! otherwise. Fields are positive inside. Triangles are counter-clockwise seen from outside.

pub mod band;
pub mod boolean;
pub mod bvh;
pub mod check;
pub mod clearance;
pub mod contour;
pub mod decimate;
pub mod fold;
pub mod grown;
pub mod hollow;
pub mod laplacian;
pub mod level_cut;
mod loft;
pub mod marching_cubes;
pub mod mesh;
pub mod opening;
pub mod polygon;
pub mod remesh;
pub mod repair;
pub mod rounding;
#[cfg(test)]
mod samples;
pub mod signed_distance;
pub mod simplify;
pub mod slit;
pub mod solid;
pub mod sparse;
pub mod subdivide;
pub mod sweep;
pub mod thin;
pub mod topology;
pub mod union_find;
pub mod weld;
pub mod work;

pub use band::Band;
pub use boolean::Volume;
pub use glam::{DQuat as Quat, DVec3 as Vec3};
pub use mesh::{Aabb, TriMesh};
pub use solid::{NotSolid, Solid};
pub use topology::{HalfEdge, Topology};
