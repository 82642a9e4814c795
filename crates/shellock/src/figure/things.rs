//! A vase and a ring.

use std::f64::consts::TAU;

use shellock_geom::Vec3;

use super::form::{Form, Sculpture};

pub(super) fn vase() -> Sculpture {
    let mut vase = Sculpture::default();
    let at = |z: f64| Vec3::new(0.0, 0.0, z);
    vase.add_chain(&[(at(2.0), 30.0), (at(58.0), 46.0), (at(100.0), 24.0), (at(128.0), 20.0)], 16.0)
        .add(Form::Ring { center: at(142.0), radius: 22.0, thickness: 8.0 }, 8.0)
        .add(Form::ellipsoid(at(138.0), Vec3::new(24.0, 24.0, 9.0)), 6.0);
    const N_RIBS: usize = 10;
    for rib in 0..N_RIBS {
        let (sin, cos) = (TAU * rib as f64 / N_RIBS as f64).sin_cos();
        // Ribs lean a tenth of a turn from foot to neck.
        let (sin_top, cos_top) = (TAU * (rib as f64 + 1.5) / N_RIBS as f64).sin_cos();
        let (sin_mid, cos_mid) = (TAU * (rib as f64 + 0.7) / N_RIBS as f64).sin_cos();
        let spine = [
            (Vec3::new(30.0 * cos, 30.0 * sin, 6.0), 5.0),
            (Vec3::new(44.0 * cos_mid, 44.0 * sin_mid, 56.0), 6.0),
            (Vec3::new(24.0 * cos_top, 24.0 * sin_top, 98.0), 4.5),
        ];
        vase.add_chain(&spine, 5.0);
    }
    vase
}

pub(super) fn torus() -> Sculpture {
    let mut torus = Sculpture::default();
    torus.add(Form::Ring { center: Vec3::new(0.0, 0.0, 18.0), radius: 52.0, thickness: 23.0 }, 0.0);
    torus
}
