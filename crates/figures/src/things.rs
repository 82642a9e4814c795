//! A vase, a torus, and a body with arms.

use std::f64::consts::TAU;

use shellock_geom::Vec3;

use super::form::{Form, Sculpture, spline};

/// Turn of a rib from the foot of the vase to its top, in full turns.
const RIB_TWIST: f64 = 0.22;

pub(super) fn vase() -> Sculpture {
    const N_RIBS: usize = 10;
    let mut vase = Sculpture::default();
    let at = |z: f64| Vec3::new(0.0, 0.0, z);
    let profile = [
        (at(2.0), 28.0),
        (at(30.0), 41.0),
        (at(60.0), 44.0),
        (at(88.0), 32.0),
        (at(112.0), 21.0),
        (at(132.0), 20.0),
    ];
    vase.add_chain(&profile, 0.0)
        .add(
            Form::Ring {
                center: at(142.0),
                radius: 22.0,
                thickness: 8.0,
            },
            8.0,
        )
        .add(Form::ellipsoid(at(138.0), Vec3::new(24.0, 24.0, 9.0)), 6.0);
    for rib in 0..N_RIBS {
        let station = |&(p, radius): &(Vec3, f64)| {
            let turn = TAU * (rib as f64 / N_RIBS as f64 + RIB_TWIST * p.z / 112.0);
            (
                Vec3::new((radius - 2.0) * turn.cos(), (radius - 2.0) * turn.sin(), p.z),
                6.0,
            )
        };
        let spine: Vec<(Vec3, f64)> = spline(&profile[..5]).iter().map(station).collect();
        vase.add_chain(&spine, 6.0);
    }
    vase
}

pub(super) fn torus() -> Sculpture {
    let mut torus = Sculpture::default();
    torus.add(
        Form::Ring {
            center: Vec3::new(0.0, 0.0, 18.0),
            radius: 52.0,
            thickness: 23.0,
        },
        0.0,
    );
    torus
}

/// A body with six round arms of 12 to 40 units: a test of the strength of necks of these widths.
pub(super) fn arms() -> Sculpture {
    let mut arms = Sculpture::default();
    arms.add(
        Form::ellipsoid(Vec3::new(0.0, 0.0, 42.0), Vec3::new(40.0, 40.0, 46.0)),
        0.0,
    );
    // Thick arms are placed far from each other.
    for (i, radius) in [20.0, 6.0, 13.0, 10.0, 16.0, 8.0].into_iter().enumerate() {
        let turn = TAU * i as f64 / 6.0;
        let along = |far: f64| Vec3::new(far * turn.cos(), far * turn.sin(), 42.0);
        arms.limb().add(
            Form::RoundCone {
                a: along(30.0),
                b: along(75.0 - radius),
                radius_a: radius,
                radius_b: radius,
            },
            4.0,
        );
    }
    arms
}
