//! Small assemblies of boxes, for tests.

use shellock_geom::{Solid, TriMesh, Vec3, Volume};
pub use shellock_testkit::shapes::{ALL, brick};
use shellock_testkit::shapes::{PinnedLid, room, rounded_mesh};

use super::contact::Contact;
use super::{Assembly, Verification, VerifyParams, examine};
use crate::sequence::{InstallationPlan, InstallationStep};
use crate::{Ctx, IdVec, LatticeDirection, PatchId};

/// Half of the gap between faces, mm.
pub const HALF_GAP_MM: f64 = 0.05;

pub fn grown(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> Volume {
    room([x, y, z], 2.0 * HALF_GAP_MM)
}

pub struct Kit {
    pub model: Solid,
    pub pieces: IdVec<PatchId, TriMesh>,
    pub plan: InstallationPlan,
}

impl Kit {
    /// Builds a kit; `directions` are the ways out in order of installation, which is the order of the
    /// pieces.
    pub fn new(model: Volume, pieces: &[Volume], directions: &[Vec3]) -> Self {
        let steps = directions.iter().enumerate();
        let steps = steps
            .map(|(i, &d)| InstallationStep {
                piece: PatchId(i as u32),
                separation: LatticeDirection::nearest(d).into(),
            })
            .collect();
        Self {
            model: Solid::new(model.to_mesh()).unwrap(),
            pieces: pieces.iter().map(rounded_mesh).collect(),
            plan: InstallationPlan { steps },
        }
    }

    pub fn verdict(&self) -> Verification {
        self.examine().0
    }

    pub fn examine(&self) -> (Verification, Vec<Contact>) {
        let params = VerifyParams {
            clearance_mm: 2.0 * HALF_GAP_MM,
            seed: 0,
        };
        let assembly = Assembly {
            model: Some(&self.model),
            pieces: &self.pieces,
            plan: &self.plan,
            press_fits: &[],
        };
        examine(&Ctx::quiet(), &params, &assembly).unwrap()
    }
}

/// Cube in three parts that lock, with this pin.
pub fn pinned_lid(pin: [[f64; 2]; 3]) -> [Volume; 3] {
    let lid = PinnedLid {
        gap_mm: 2.0 * HALF_GAP_MM,
        pin,
        ..PinnedLid::default()
    };
    lid.parts()
}

pub const PIN: [[f64; 2]; 3] = [[17.0, 24.0], [13.0, 17.0], [1.0, 30.0]];

pub fn pinned_kit(change: impl FnOnce(&mut [Volume; 3])) -> Kit {
    let mut pieces = pinned_lid(PIN);
    change(&mut pieces);
    Kit::new(brick(ALL, ALL, ALL), &pieces, &[Vec3::X, Vec3::X, Vec3::Z])
}
