//! Static mechanics of thin-walled parts that are joined along seams.
//!
//! [`ShellAssembly`] describes the geometry: the parts, and the stations of the seams between them.
//! [`Meeting`] describes how a plan joins the two sides of each station. From both, the solvers compute how
//! far the seams open under a uniform separation force or under external loads. This crate knows parts and
//! stations, but neither patches nor plans.

pub mod assembly;
pub mod connector;
pub mod material;
pub mod neighbourhood;
pub mod sample;
pub mod shell;
pub mod solid;
pub mod stress;
pub mod surface;

pub use assembly::{Joint, Meeting, Opening, Resistance, SIDES, ShellAssembly, Side, Station};
pub use material::Material;
pub use shell::{
    Displacements, FaceStress, LoadCase, ShellError, ShellModel, ShellSolver, ShellStress, Support,
};
pub use solid::{SolidError, SolidModel, SolidParams};
pub use stress::{StressLevel, StressSample};
pub use surface::{Bearing, Closed, Drift, JoinedParts, SurfaceModel, SurfaceParams, SurfaceSolution};
