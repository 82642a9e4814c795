//! Figures with limbs. Coordinates in units (1/150 of the size), x to the figure's left, y backwards, z up.

use std::f64::consts::TAU;

use shellock_geom::Vec3;

use super::form::{Form, Sculpture};

fn at(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z)
}

pub(super) fn squirrel() -> Sculpture {
    let mut squirrel = Sculpture::default();
    // Body: a pear that leans a little forwards.
    squirrel
        .add(Form::ellipsoid(at(0.0, 4.0, 30.0), at(31.0, 31.0, 37.0)), 0.0)
        .add_chain(
            &[
                (at(0.0, 2.0, 40.0), 27.0),
                (at(0.0, -8.0, 78.0), 19.0),
                (at(0.0, -12.0, 96.0), 15.0),
            ],
            14.0,
        )
        .add(Form::ellipsoid(at(0.0, -14.0, 52.0), at(19.0, 16.0, 26.0)), 8.0);
    squirrel_head(&mut squirrel);
    squirrel_limbs(&mut squirrel);
    // The tail rises behind the back, wider upwards, and curls away from it.
    let tail = [
        (at(0.0, 26.0, 14.0), 14.0),
        (at(0.0, 46.0, 17.0), 16.0),
        (at(0.0, 60.0, 33.0), 18.0),
        (at(0.0, 62.0, 54.0), 20.0),
        (at(0.0, 56.0, 76.0), 22.0),
        (at(0.0, 50.0, 98.0), 23.0),
        (at(0.0, 53.0, 117.0), 21.0),
        (at(0.0, 65.0, 128.0), 18.0),
        (at(0.0, 79.0, 127.0), 15.0),
        (at(0.0, 88.0, 116.0), 12.0),
        (at(0.0, 86.0, 105.0), 9.0),
    ];
    squirrel.add_chain(&tail, 9.0);
    squirrel
}

fn squirrel_head(squirrel: &mut Sculpture) {
    squirrel
        .add(Form::ellipsoid(at(0.0, -16.0, 108.0), at(23.0, 24.0, 20.5)), 9.0)
        .add_pair(Form::ball(at(11.0, -28.0, 100.0), 12.5), 8.0)
        .add(Form::ellipsoid(at(0.0, -36.0, 102.0), at(10.5, 13.0, 9.0)), 8.0)
        .add(Form::ellipsoid(at(0.0, -48.0, 106.0), at(5.0, 4.0, 4.0)), 1.5)
        .add_pair(Form::ball(at(15.5, -31.5, 113.0), 5.0), 0.8);
    // Ears: flattened drops that lean outwards.
    squirrel
        .add_chain(
            &[
                (at(13.0, -9.0, 120.0), 9.5),
                (at(18.5, -7.0, 136.0), 7.0),
                (at(20.0, -6.0, 146.0), 4.8),
            ],
            5.0,
        )
        .add_chain(
            &[
                (at(-13.0, -9.0, 120.0), 9.5),
                (at(-18.5, -7.0, 136.0), 7.0),
                (at(-20.0, -6.0, 146.0), 4.8),
            ],
            5.0,
        );
}

fn squirrel_limbs(squirrel: &mut Sculpture) {
    squirrel
        .add_pair(
            Form::turned_ellipsoid(at(26.0, -2.0, 25.0), at(14.0, 24.0, 25.0), [-15.0, 0.0, 0.0]),
            5.0,
        )
        .add_pair(
            Form::RoundCone {
                a: at(25.0, -12.0, 6.0),
                b: at(27.0, -38.0, 5.5),
                radius_a: 10.0,
                radius_b: 9.5,
            },
            4.0,
        );
    for side in [1.0, -1.0] {
        let arm = [
            (at(19.0 * side, -10.0, 78.0), 9.5),
            (at(26.0 * side, -24.0, 61.0), 8.5),
            (at(13.0 * side, -42.0, 60.0), 7.5),
        ];
        squirrel.add_chain(&arm, 4.0);
    }
    // The acorn between the paws: nut, cup, stalk.
    squirrel
        .add(
            Form::RoundCone {
                a: at(0.0, -45.0, 60.0),
                b: at(0.0, -47.0, 50.0),
                radius_a: 11.0,
                radius_b: 7.0,
            },
            2.0,
        )
        .add(Form::ellipsoid(at(0.0, -44.5, 66.5), at(13.5, 13.5, 7.5)), 1.0)
        .add(
            Form::RoundCone {
                a: at(0.0, -44.0, 72.0),
                b: at(0.0, -43.5, 77.0),
                radius_a: 5.0,
                radius_b: 4.6,
            },
            2.0,
        );
}

pub(super) fn cat() -> Sculpture {
    let mut cat = Sculpture::default();
    cat.add(Form::ellipsoid(at(0.0, 12.0, 34.0), at(32.0, 34.0, 40.0)), 0.0)
        .add_chain(
            &[
                (at(0.0, 4.0, 46.0), 26.0),
                (at(0.0, -10.0, 78.0), 20.0),
                (at(0.0, -14.0, 96.0), 15.0),
            ],
            14.0,
        )
        .add(Form::ellipsoid(at(0.0, -18.0, 112.0), at(27.0, 23.0, 21.0)), 8.0)
        .add_pair(Form::ellipsoid(at(7.5, -37.0, 104.0), at(9.0, 7.0, 7.0)), 3.0)
        .add(Form::ellipsoid(at(0.0, -42.0, 109.0), at(4.0, 4.0, 3.0)), 1.5)
        .add_pair(Form::ball(at(11.5, -37.0, 116.0), 4.8), 0.8);
    for side in [1.0, -1.0] {
        let ear = [
            (at(15.0 * side, -14.0, 126.0), 10.0),
            (at(21.0 * side, -12.0, 145.0), 4.8),
        ];
        let foreleg = [
            (at(13.0 * side, -18.0, 62.0), 11.0),
            (at(12.0 * side, -27.0, 8.0), 9.5),
        ];
        cat.add_chain(&ear, 5.0).add_chain(&foreleg, 6.0);
        cat.add(
            Form::ellipsoid(at(12.5 * side, -33.0, 4.0), at(10.0, 13.0, 9.0)),
            4.0,
        )
        .add(
            Form::ellipsoid(at(27.0 * side, 10.0, 24.0), at(14.0, 26.0, 24.0)),
            5.0,
        )
        .add(
            Form::RoundCone {
                a: at(29.0 * side, 4.0, 5.0),
                b: at(30.0 * side, -20.0, 5.0),
                radius_a: 9.0,
                radius_b: 8.5,
            },
            4.0,
        );
    }
    // The tail lies around the left side.
    let tail: Vec<(Vec3, f64)> = (0..8)
        .map(|i| {
            let turn = (95.0 - 17.0 * f64::from(i)).to_radians();
            (
                at(53.0 * turn.cos(), 6.0 + 50.0 * turn.sin(), 9.0),
                10.5 - 0.4 * f64::from(i),
            )
        })
        .collect();
    cat.add_chain(&[(at(0.0, 36.0, 14.0), 11.0), tail[0]], 5.0)
        .add_chain(&tail, 4.0);
    cat
}

pub(super) fn teddy() -> Sculpture {
    let mut teddy = Sculpture::default();
    teddy
        .add(Form::ellipsoid(at(0.0, 4.0, 42.0), at(36.0, 31.0, 45.0)), 0.0)
        .add(Form::ellipsoid(at(0.0, 0.0, 106.0), at(34.0, 29.0, 29.0)), 6.0)
        .add(Form::ellipsoid(at(0.0, -25.0, 98.0), at(15.0, 12.0, 12.0)), 4.0)
        .add(Form::ellipsoid(at(0.0, -37.0, 102.0), at(6.5, 4.0, 4.5)), 1.0)
        .add_pair(Form::ball(at(12.5, -24.5, 113.0), 5.0), 0.8)
        .add_pair(Form::ellipsoid(at(27.0, 4.0, 134.0), at(14.0, 8.0, 14.0)), 4.0);
    for side in [1.0, -1.0] {
        let arm = [
            (at(30.0 * side, 0.0, 70.0), 13.0),
            (at(50.0 * side, -18.0, 54.0), 12.0),
        ];
        let leg = [
            (at(22.0 * side, -8.0, 14.0), 17.0),
            (at(34.0 * side, -46.0, 15.0), 15.0),
        ];
        teddy.add_chain(&arm, 6.0).add_chain(&leg, 6.0);
        teddy
            .add(Form::ball(at(52.0 * side, -20.0, 52.0), 13.0), 3.0)
            .add(
                Form::turned_ellipsoid(
                    at(36.0 * side, -53.0, 19.0),
                    at(16.0, 9.0, 20.0),
                    [-10.0, 0.0, -10.0 * side],
                ),
                3.0,
            );
    }
    teddy
}

pub(super) fn octopus() -> Sculpture {
    let mut octopus = Sculpture::default();
    octopus
        .add(Form::ellipsoid(at(0.0, 4.0, 84.0), at(36.0, 38.0, 44.0)), 0.0)
        .add(Form::ellipsoid(at(0.0, 0.0, 30.0), at(32.0, 32.0, 36.0)), 12.0)
        .add_pair(Form::ball(at(16.0, -30.0, 66.0), 10.0), 3.0)
        .add_pair(Form::ball(at(17.5, -38.5, 67.0), 5.0), 1.0);
    for arm in 0..8 {
        let turn = TAU * (f64::from(arm) + 0.5) / 8.0;
        // Seen from above an arm runs outwards and bends to one side; its tip lifts off the ground.
        let station = |reach: f64, bend: f64, z: f64, radius: f64| {
            let (sin, cos) = (turn + bend).sin_cos();
            (at(reach * cos, reach * sin, z), radius)
        };
        let stations = [
            station(14.0, 0.0, 26.0, 15.0),
            station(36.0, 0.0, 12.0, 12.5),
            station(54.0, 0.08, 7.0, 10.5),
            station(68.0, 0.26, 10.0, 9.0),
            station(74.0, 0.46, 19.0, 7.5),
            station(67.0, 0.62, 27.0, 6.0),
        ];
        octopus.add_chain(&stations, 4.0);
    }
    octopus
}

pub(super) fn dinosaur() -> Sculpture {
    let mut dinosaur = Sculpture::default();
    dinosaur.add(Form::ellipsoid(at(0.0, 8.0, 48.0), at(28.0, 42.0, 29.0)), 0.0);
    let neck = [
        (at(0.0, -22.0, 56.0), 20.0),
        (at(0.0, -42.0, 82.0), 14.5),
        (at(0.0, -50.0, 108.0), 12.0),
        (at(0.0, -58.0, 122.0), 13.0),
    ];
    let tail = [
        (at(0.0, 40.0, 44.0), 20.0),
        (at(4.0, 66.0, 28.0), 13.5),
        (at(12.0, 88.0, 16.0), 9.5),
        (at(24.0, 100.0, 14.0), 7.0),
        (at(36.0, 100.0, 18.0), 5.2),
    ];
    dinosaur.add_chain(&neck, 12.0).add_chain(&tail, 12.0);
    dinosaur
        .add(
            Form::turned_ellipsoid(at(0.0, -66.0, 126.0), at(16.0, 23.0, 14.0), [12.0, 0.0, 0.0]),
            8.0,
        )
        .add_pair(Form::ball(at(12.5, -70.0, 134.0), 5.0), 0.8);
    for side in [1.0, -1.0] {
        for y in [-20.0, 34.0] {
            dinosaur.add_chain(
                &[
                    (at(18.0 * side, y, 40.0), 15.0),
                    (at(20.0 * side, y - 3.0, 7.0), 11.5),
                ],
                7.0,
            );
            dinosaur.add(
                Form::ellipsoid(at(20.0 * side, y - 7.0, 5.0), at(12.5, 14.0, 9.0)),
                3.0,
            );
        }
    }
    // Plates along the back.
    for (y, z, size) in [
        (-20.0, 78.0, 9.0),
        (2.0, 80.0, 12.0),
        (25.0, 76.0, 11.0),
        (46.0, 62.0, 8.5),
    ] {
        dinosaur.add(Form::ellipsoid(at(0.0, y, z), at(5.0, size, size)), 3.0);
    }
    dinosaur
}

/// A fish on its belly: its tail hangs on a neck of 13 units with two short seams.
pub(super) fn fish() -> Sculpture {
    let mut fish = Sculpture::default();
    fish.add(Form::ellipsoid(at(-14.0, 0.0, 23.0), at(58.0, 18.0, 29.0)), 0.0);
    fish.limb()
        .add_chain(
            &[
                (at(34.0, 0.0, 27.0), 10.0),
                (at(52.0, 0.0, 29.0), 6.5),
                (at(62.0, 0.0, 30.0), 6.5),
            ],
            8.0,
        )
        .add(Form::ellipsoid(at(68.0, 0.0, 32.0), at(12.0, 6.5, 30.0)), 5.0);
    fish.limb().add(
        Form::turned_ellipsoid(at(-8.0, 0.0, 55.0), at(26.0, 6.0, 15.0), [0.0, 12.0, 0.0]),
        4.0,
    );
    fish
}
