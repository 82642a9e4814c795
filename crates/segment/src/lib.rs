//! Where people would divide a closed triangle mesh.
//!
//! Each method is a plain function from parameters and a mesh to one label a face; parts are connected, numbered
//! by their lowest face, and the same on any number of threads. Lengths are millimetres, though only their
//! proportions count. This crate knows no patch, piece or plan.

pub mod auto;
pub mod border;
pub mod coarse;
pub mod face_graph;
pub mod kmeans;
pub mod labelling;
pub mod max_flow;
pub mod mixture;
pub mod parts;
pub mod primitives;
pub mod random_cuts;
pub mod sdf;
pub mod shape_diameter;
