//! Generated models that are hard to make kits of: with walls of their own, with holes, with thin limbs.

use std::f64::consts::TAU;

use shellock_geom::{Aabb, TriMesh, Vec3, Volume};

/// Number of corners of a circle.
const N_ROUND: usize = 64;

/// A model and its name.
pub struct Hard {
    /// File name without extension.
    pub name: String,
    /// Closed mesh, about 150 mm large, z up.
    pub mesh: TriMesh,
}

/// Generates all models of the family.
pub fn family() -> Vec<Hard> {
    let mut all = Vec::new();
    let mut add = |name: String, volume: Volume| {
        all.push(Hard {
            name,
            mesh: volume.to_mesh(),
        });
    };
    for wall_mm in [2.0, 4.7, 8.0] {
        add(format!("goblet-{wall_mm}"), goblet(wall_mm));
        add(format!("open-box-{wall_mm}"), open_box(wall_mm));
    }
    for bulge_mm in [0.0, 12.0] {
        add(format!("two-handled-cup-{bulge_mm}"), two_handled_cup(bulge_mm));
    }
    for n_holes in [5, 9, 15] {
        add(format!("pierced-statue-{n_holes}"), pierced_statue(n_holes));
    }
    for radius_mm in [2.0, 4.0, 8.0] {
        add(format!("limbs-{radius_mm}"), limbs(radius_mm));
    }
    add("rods".into(), rods());
    add("plates".into(), plates());
    add("spikes".into(), spikes());
    add("tunnels".into(), tunnels());
    all
}

fn circle(radius_mm: f64, z: f64) -> Vec<Vec3> {
    (0..N_ROUND)
        .map(|i| {
            let (sin, cos) = (TAU * i as f64 / N_ROUND as f64).sin_cos();
            Vec3::new(radius_mm * cos, radius_mm * sin, z)
        })
        .collect()
}

/// Solid of revolution about z; `profile` gives radius and height, mm, from below.
fn revolve(profile: &[[f64; 2]]) -> Volume {
    Volume::loft(&profile.iter().map(|&[r, z]| circle(r, z)).collect::<Vec<_>>())
}

fn block(min: [f64; 3], max: [f64; 3]) -> Volume {
    Volume::cuboid(Aabb {
        min: min.into(),
        max: max.into(),
    })
}

/// Round rod whose radius, mm, changes linearly from one end to the other.
fn rod(from: Vec3, to: Vec3, radii_mm: [f64; 2]) -> Volume {
    let (u, v) = (to - from).normalize().any_orthonormal_pair();
    let ring = |at: Vec3, r: f64| {
        (0..24).map(move |i| {
            let (sin, cos) = (TAU * f64::from(i) / 24.0).sin_cos();
            at + r * (cos * u + sin * v)
        })
    };
    let corners: Vec<Vec3> = ring(from, radii_mm[0]).chain(ring(to, radii_mm[1])).collect();
    Volume::hull(&corners)
}

fn ball(center: Vec3, radius_mm: f64) -> Volume {
    let n = 24;
    let point = |i: usize, j: usize| {
        let (s, c) = (0.5 * TAU * i as f64 / n as f64).sin_cos();
        let (sin, cos) = (TAU * j as f64 / N_ROUND as f64).sin_cos();
        center + radius_mm * Vec3::new(s * cos, s * sin, c)
    };
    let points: Vec<Vec3> = (0..=n)
        .flat_map(|i| (0..N_ROUND).map(move |j| (i, j)))
        .map(|(i, j)| point(i, j))
        .collect();
    Volume::hull(&points)
}

fn goblet(wall_mm: f64) -> Volume {
    let outer = [
        [40.0, 0.0],
        [38.0, 6.0],
        [8.0, 14.0],
        [8.0, 60.0],
        [30.0, 75.0],
        [42.0, 110.0],
        [40.0, 150.0],
    ];
    let bowl = |z: f64, r: f64| [r - wall_mm, z + wall_mm];
    let inner = [
        bowl(66.0, 8.0 + wall_mm),
        bowl(75.0, 30.0),
        bowl(110.0, 42.0),
        [40.0 - wall_mm, 160.0],
    ];
    revolve(&outer).subtract(&revolve(&inner))
}

/// Solid cup with a foot, a belly that bulges over its neck by `bulge_mm`, and two round handles.
fn two_handled_cup(bulge_mm: f64) -> Volume {
    let body = [
        [26.0, 0.0],
        [22.0, 8.0],
        [30.0 - bulge_mm, 14.0],
        [40.0, 60.0],
        [34.0 + bulge_mm, 85.0],
        [40.0, 108.0],
        [36.0 - bulge_mm, 122.0],
        [36.0 - bulge_mm, 138.0],
        [40.0, 150.0],
    ];
    let handles = [-40.0, 40.0].map(|x| ring(Vec3::new(x, 0.0, 98.0), 26.0, 6.5));
    Volume::union_all([revolve(&body)].into_iter().chain(handles).collect())
}

/// Round ring that stands upright, with its axis along y.
fn ring(center: Vec3, radius_mm: f64, tube_mm: f64) -> Volume {
    let section = |i: usize| {
        let (sin, cos) = (TAU * i as f64 / N_ROUND as f64).sin_cos();
        let out = Vec3::new(cos, 0.0, sin);
        (0..24).map(move |j| {
            let (s, c) = (TAU * f64::from(j) / 24.0).sin_cos();
            center + (radius_mm + tube_mm * c) * out + tube_mm * s * Vec3::Y
        })
    };
    let parts = (0..N_ROUND).map(|i| Volume::hull(&section(i).chain(section(i + 1)).collect::<Vec<_>>()));
    Volume::union_all(parts.collect())
}

fn open_box(wall_mm: f64) -> Volume {
    let inside = block(
        [wall_mm, wall_mm, wall_mm],
        [150.0 - wall_mm, 100.0 - wall_mm, 200.0],
    );
    block([0.0; 3], [150.0, 100.0, 90.0]).subtract(&inside)
}

fn pierced_statue(n_holes: usize) -> Volume {
    let body = revolve(&[
        [24.0, 0.0],
        [18.0, 20.0],
        [22.0, 80.0],
        [16.0, 120.0],
        [20.0, 150.0],
        [6.0, 170.0],
    ]);
    let holes = (0..n_holes).map(|i| {
        let z = 12.0 + 140.0 * i as f64 / n_holes as f64;
        let (sin, cos) = (2.4 * i as f64).sin_cos();
        let across = Vec3::new(cos, sin, 0.0);
        let middle = Vec3::new(0.0, 0.0, z);
        rod(middle - 60.0 * across, middle + 60.0 * across, [4.0, 4.0])
    });
    body.subtract(&Volume::union_all(holes.collect()))
}

fn limbs(radius_mm: f64) -> Volume {
    let limbs = (0..6).map(|i| {
        let (sin, cos) = (TAU * f64::from(i) / 6.0).sin_cos();
        let tip = Vec3::new(75.0 * cos, 75.0 * sin, if i % 2 == 0 { 40.0 } else { -40.0 });
        rod(Vec3::ZERO, tip, [radius_mm, radius_mm])
    });
    ball(Vec3::ZERO, 32.0).union(&Volume::union_all(limbs.collect()))
}

fn rods() -> Volume {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    Volume::union_all(axes.map(|d| rod(-75.0 * d, 75.0 * d, [9.0, 9.0])).to_vec())
}

fn plates() -> Volume {
    Volume::union_all(vec![
        block([-75.0, -75.0, -5.0], [75.0, 75.0, 5.0]),
        block([-75.0, -5.0, -60.0], [75.0, 5.0, 60.0]),
        block([-5.0, -70.0, -50.0], [5.0, 70.0, 50.0]),
    ])
}

fn spikes() -> Volume {
    let golden = 2.399_963;
    let spikes = (0..20).map(|i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 20.0;
        let (sin, cos) = (golden * f64::from(i)).sin_cos();
        let out = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
        rod(20.0 * out, 75.0 * out, [9.0, 0.8])
    });
    ball(Vec3::ZERO, 40.0).union(&Volume::union_all(spikes.collect()))
}

fn tunnels() -> Volume {
    let outer = block([-70.0; 3], [70.0; 3]);
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    let wide = axes.map(|d| rod(-90.0 * d, 90.0 * d, [38.0, 38.0])).to_vec();
    let nested = Volume::union_all(axes.map(|d| rod(-69.0 * d, 69.0 * d, [26.0, 26.0])).to_vec());
    let bores = Volume::union_all(axes.map(|d| rod(-90.0 * d, 90.0 * d, [16.0, 16.0])).to_vec());
    let holders = axes.map(|d| {
        let side = d.any_orthonormal_vector();
        rod(55.0 * d - 60.0 * side, 55.0 * d + 60.0 * side, [6.0, 6.0]).subtract(&rod(
            -90.0 * d,
            90.0 * d,
            [20.0, 20.0],
        ))
    });
    let inner = nested
        .union(&Volume::union_all(holders.to_vec()))
        .subtract(&bores);
    outer.subtract(&Volume::union_all(wide)).union(&inner)
}

#[cfg(test)]
mod tests {
    use shellock_geom::Solid;

    use super::*;

    #[test]
    fn all_of_them_are_one_closed_body() {
        for Hard { name, mesh } in family() {
            let solid = Solid::new(mesh).unwrap_or_else(|e| panic!("{name}: {e}"));
            let volume = Volume::from_solid(&solid).unwrap();
            assert_eq!(volume.components().len(), 1, "{name}");
        }
    }

    #[test]
    fn holes_count() {
        for n in [5, 15] {
            assert!(pierced_statue(n).genus() >= n as i32, "{n}");
        }
    }
}
