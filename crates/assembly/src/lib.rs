//! Verification of assemblies that should lock. The input is the pieces as closed meshes, the order of
//! installation and the direction of each. The output is a verdict, the play of the pieces and a certificate
//! of both.
//!
//! Nothing here knows how the pieces were made. [`mod@verify`] judges the pieces at rest and on their ways
//! out, [`motion`] treats contacts as inequalities, [`play`] bounds motions of any size, and [`certificate`]
//! records the proofs. [`verify()`] does all of it.
//!
//! A block that can be lifted freely out of its tray is no lock:
//!
//! ```
//! use shellock_assembly::{Assembly, Ctx, Direction, InstallationPlan, VerifyParams, verify};
//! use shellock_geom::{Aabb, Vec3, Volume};
//!
//! let cuboid = |min, max| {
//!     Volume::cuboid(Aabb { min: Vec3::from_array(min), max: Vec3::from_array(max) })
//! };
//! let hollow = cuboid([4.9, 4.9, 4.9], [25.1, 25.1, 20.0]);
//! let tray = cuboid([0.0; 3], [30.0, 30.0, 10.0]).subtract(&hollow);
//! let block = cuboid([5.0; 3], [25.0, 25.0, 10.0]);
//! let knob = cuboid([10.0, 10.0, 10.1], [20.0, 20.0, 20.0]);
//! let pieces = [tray, block, knob].iter().map(Volume::to_mesh).collect();
//! let up = Direction::of(Vec3::Z).unwrap();
//! let plan = InstallationPlan::new([(0.into(), up), (1.into(), up), (2.into(), up)]);
//! let assembly = Assembly { model: None, pieces: &pieces, plan: &plan, press_fits: &[] };
//! let params = VerifyParams { clearance_mm: 0.1, seed: 0 };
//! let verdict = verify(&Ctx::quiet(), &params, &assembly)?;
//! assert!(!verdict.verification.has_passed());
//! # Ok::<(), shellock_assembly::Cancelled>(())
//! ```

mod causes;
pub mod certificate;
pub mod direction;
pub mod fit;
pub mod motion;
pub mod play;
pub mod press_fit;
pub mod push;
pub mod sequence;
mod verdict;
pub mod verify;

pub use causes::{Cause, EstimatedPlay};
pub use direction::{Direction, LatticeDirection};
pub use fit::PrintedFit;
pub use press_fit::{PressFit, PressFitKind};
pub use sequence::{InstallationPlan, InstallationStep};
pub use shellock_report::{Cancelled, Ctx, IdVec, PatchId};
pub use verdict::{Judgement, Verdict, judge, verify};
pub use verify::{Assembly, VerifyParams};
