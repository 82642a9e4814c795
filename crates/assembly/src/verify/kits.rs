//! Small assemblies of boxes, for tests.

use shellock_geom::{Aabb, Solid, TriMesh, Vec3, Volume};

use super::contact::Contact;
use super::{Assembly, Verification, VerifyParams, examine};
use crate::sequence::{InstallationPlan, InstallationStep};
use crate::{Ctx, IdVec, LatticeDirection, PatchId};

/// Half the gap between faces, mm.
pub const HALF_GAP_MM: f64 = 0.05;

pub fn cuboid(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> Volume {
    Volume::cuboid(Aabb {
        min: Vec3::new(x[0], y[0], z[0]),
        max: Vec3::new(x[1], y[1], z[1]),
    })
}

pub fn grown(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> Volume {
    let gap = 2.0 * HALF_GAP_MM;
    let wide = |[low, high]: [f64; 2]| [low - gap, high + gap];
    cuboid(wide(x), wide(y), wide(z))
}

pub fn as_written(v: &Volume) -> TriMesh {
    let mut mesh = v.to_mesh();
    mesh.points.iter_mut().for_each(|p| *p = p.as_vec3().as_dvec3());
    mesh
}

pub struct Kit {
    pub model: Solid,
    pub pieces: IdVec<PatchId, TriMesh>,
    pub plan: InstallationPlan,
}

impl Kit {
    /// `directions`: the way out of each piece, in order of installation, which is the order of the pieces.
    pub fn new(model: Volume, pieces: &[Volume], directions: &[Vec3]) -> Self {
        let steps = directions.iter().enumerate();
        let steps = steps
            .map(|(i, &d)| InstallationStep {
                piece: PatchId(i as u32),
                separation: LatticeDirection::nearest(d),
            })
            .collect();
        Self {
            model: Solid::new(model.to_mesh()).unwrap(),
            pieces: pieces.iter().map(as_written).collect(),
            plan: InstallationPlan { steps },
        }
    }

    pub fn verdict(&self) -> Verification {
        self.examined().0
    }

    pub fn examined(&self) -> (Verification, Vec<Contact>) {
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

pub const ALL: [f64; 2] = [0.0, 30.0];

/// A cube in three parts: a base with a T-shaped groove that ends blind at x = 10, a lid whose T-shaped
/// tongue slides in along −x, and a pin through both, pushed in along −z.
pub fn pinned_lid(pin: [[f64; 2]; 3]) -> [Volume; 3] {
    let (stem, foot) = (
        ([10.0, 30.0], [11.0, 19.0], [9.0, 16.0]),
        ([10.0, 30.0], [7.0, 23.0], [5.0, 9.0]),
    );
    let hole = grown(pin[0], pin[1], [pin[2][0], 40.0]);
    let open = |p: ([f64; 2], [f64; 2], [f64; 2])| grown([p.0[0], 40.0], p.1, p.2);
    let base = cuboid(ALL, ALL, [0.0, 15.0 - HALF_GAP_MM])
        .subtract(&open(stem))
        .subtract(&open(foot))
        .subtract(&hole);
    let lid = Volume::union_all(vec![
        cuboid(ALL, ALL, [15.0 + HALF_GAP_MM, 30.0]),
        cuboid(stem.0, stem.1, stem.2),
        cuboid(foot.0, foot.1, foot.2),
    ])
    .subtract(&hole);
    [base, lid, cuboid(pin[0], pin[1], pin[2])]
}

pub const PIN: [[f64; 2]; 3] = [[17.0, 24.0], [13.0, 17.0], [1.0, 30.0]];

pub fn pinned_kit(change: impl FnOnce(&mut [Volume; 3])) -> Kit {
    let mut pieces = pinned_lid(PIN);
    change(&mut pieces);
    Kit::new(cuboid(ALL, ALL, ALL), &pieces, &[Vec3::X, Vec3::X, Vec3::Z])
}
