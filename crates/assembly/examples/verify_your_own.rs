//! Verifies two assemblies of boxes. A lid with a tongue and a pin through both locks. The same assembly with
//! a pin that is too short to reach into the base does not. Run with `cargo run --release -p
//! shellock-assembly --example verify_your_own`.

use shellock_assembly::{Assembly, Ctx, Direction, InstallationPlan, VerifyParams, verify};
use shellock_geom::{Aabb, TriMesh, Vec3, Volume};

const CLEARANCE_MM: f64 = 0.1;
const ALL: [f64; 2] = [0.0, 30.0];

fn cuboid(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> Volume {
    let corner = |k: usize| Vec3::new(x[k], y[k], z[k]);
    Volume::cuboid(Aabb {
        min: corner(0),
        max: corner(1),
    })
}

/// Box enlarged by the clearance on all sides.
fn room(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> Volume {
    let wide = |[low, high]: [f64; 2]| [low - CLEARANCE_MM, high + CLEARANCE_MM];
    cuboid(wide(x), wide(y), wide(z))
}

/// A base with a groove, a lid whose tongue slides into it, and a pin from above that ends at `pin_z`.
fn boxes(pin_z: f64) -> Vec<TriMesh> {
    let (stem, foot) = (([11.0, 19.0], [9.0, 16.0]), ([7.0, 23.0], [5.0, 9.0]));
    let pin = cuboid([17.0, 24.0], [13.0, 17.0], [pin_z, 30.0]);
    let hole = room([17.0, 24.0], [13.0, 17.0], [pin_z, 40.0]);
    let groove = [
        room([10.0, 40.0], stem.0, stem.1),
        room([10.0, 40.0], foot.0, foot.1),
    ];
    let tongue = [
        cuboid([10.0, 30.0], stem.0, stem.1),
        cuboid([10.0, 30.0], foot.0, foot.1),
    ];
    let half_gap = 0.5 * CLEARANCE_MM;
    let base = cuboid(ALL, ALL, [0.0, 15.0 - half_gap]);
    let plate = cuboid(ALL, ALL, [15.0 + half_gap, 30.0]);
    let [lid_stem, lid_foot] = tongue;
    let base = base.subtract(&Volume::union_all(groove.to_vec())).subtract(&hole);
    let lid = Volume::union_all(vec![plate, lid_stem, lid_foot]).subtract(&hole);
    [base, lid, pin].iter().map(Volume::to_mesh).collect()
}

fn main() {
    let [along, up] = [Vec3::X, Vec3::Z].map(|way| Direction::of(way).expect("it is no zero"));
    let plan = InstallationPlan::new([(0.into(), along), (1.into(), along), (2.into(), up)]);
    for (name, pin_z) in [("a pin through both", 1.0), ("a pin that is too short", 16.0)] {
        let pieces = boxes(pin_z).into_iter().collect();
        let assembly = Assembly {
            model: None,
            pieces: &pieces,
            plan: &plan,
            press_fits: &[],
        };
        let params = VerifyParams {
            clearance_mm: CLEARANCE_MM,
            seed: 0,
        };
        let verdict = verify(&Ctx::quiet(), &params, &assembly).expect("nobody stops it");
        let is_lock = verdict.verification.has_passed();
        println!(
            "{name}: {}",
            if is_lock { "it locks" } else { "it does not lock" }
        );
        for check in verdict.verification.checks.iter().filter(|check| !check.ok) {
            println!("  {}: {}", check.name, check.figure);
        }
        let claims = verdict
            .certificate(Vec::new(), &params, &assembly)
            .map_or(0, |c| c.claims.len());
        println!("  {claims} claims can be proven of it");
    }
}
