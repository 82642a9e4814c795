//! Assemblies made by code, for tests, examples and benches.

use shellock_geom::Vec3;

use crate::{ShellAssembly, Station};

/// Two plates `length` (y) by `width` (x) mm, outer face up, side a at x < 0, joined along x = 0 by a station
/// at each inner point.
///
/// `cells` is how many squares each has along its length and across its width.
pub fn plates(length_mm: f64, width_mm: f64, cells: [u32; 2]) -> ShellAssembly {
    let [n_along, n_across] = cells;
    let mut assembly = ShellAssembly {
        n_parts: 2,
        ..ShellAssembly::default()
    };
    for part in 0..2 {
        let first = assembly.points.len() as u32;
        let x_of = |j: u32| {
            let share = f64::from(j) / f64::from(n_across);
            width_mm * if part == 0 { share - 1.0 } else { share }
        };
        for i in 0..=n_along {
            for j in 0..=n_across {
                let y = length_mm * f64::from(i) / f64::from(n_along);
                assembly.points.push(Vec3::new(x_of(j), y, 0.0));
                assembly.normals.push(Vec3::Z);
                assembly.part_of_point.push(part);
            }
        }
        let at = |i: u32, j: u32| first + i * (n_across + 1) + j;
        for i in 0..n_along {
            for j in 0..n_across {
                let [p, q, r, s] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                assembly.triangles.extend([[p, q, r], [p, r, s]]);
            }
        }
    }
    let first_of_b = (n_along + 1) * (n_across + 1);
    for i in 1..n_along {
        assembly.stations.push(Station {
            points: [i * (n_across + 1) + n_across, first_of_b + i * (n_across + 1)],
            tangent: Vec3::Y,
            normal: Vec3::Z,
            across: Vec3::X,
            length_mm: length_mm / f64::from(n_along),
        });
    }
    assembly.steps = (1..n_along - 1).map(|i| [i - 1, i]).collect();
    assembly
}

/// A ball of eight octants, each of `frequency²` triangles, with stations along the twelve seams.
pub fn ball(radius_mm: f64, frequency: u32) -> ShellAssembly {
    let mut assembly = ShellAssembly {
        n_parts: 8,
        ..ShellAssembly::default()
    };
    let row_start = |i: u32| i * (2 * frequency + 3 - i) / 2;
    let n_own = row_start(frequency + 1);
    for part in 0..8_u32 {
        let axes = octant_axes(part);
        for i in 0..=frequency {
            for j in 0..=frequency - i {
                let weight = [i, j, frequency - i - j].map(f64::from);
                let normal = (axes[0] * weight[0] + axes[1] * weight[1] + axes[2] * weight[2]).normalize();
                assembly.points.push(normal * radius_mm);
                assembly.normals.push(normal);
                assembly.part_of_point.push(part);
            }
        }
        let at = |i: u32, j: u32| part * n_own + row_start(i) + j;
        // An odd number of mirrorings turns triangles over.
        let turned = |t: [u32; 3]| {
            if part.count_ones() % 2 == 0 {
                t
            } else {
                [t[0], t[2], t[1]]
            }
        };
        for i in 0..frequency {
            for j in 0..frequency - i {
                assembly
                    .triangles
                    .push(turned([at(i, j), at(i + 1, j), at(i, j + 1)]));
                if i + j + 1 < frequency {
                    assembly
                        .triangles
                        .push(turned([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
                }
            }
        }
    }
    for part in 0..8 {
        for axis in (0..3).filter(|axis| part & 1 << axis == 0) {
            add_seam(
                &mut assembly,
                frequency,
                [part, part | 1 << axis],
                axis,
                |i, j| row_start(i) + j,
            );
        }
    }
    assembly
}

/// The three axes at the corners of octant `part`: bit k set means that axis k points backwards.
fn octant_axes(part: u32) -> [Vec3; 3] {
    let sign = |k: u32| if part & 1 << k == 0 { 1.0 } else { -1.0 };
    [Vec3::X * sign(0), Vec3::Y * sign(1), Vec3::Z * sign(2)]
}

/// The seam where the weight of `axis` is zero.
fn add_seam(
    assembly: &mut ShellAssembly,
    frequency: u32,
    parts: [u32; 2],
    axis: usize,
    own: impl Fn(u32, u32) -> u32,
) {
    let n_own = assembly.points.len() as u32 / 8;
    let at = |part: u32, k: u32| {
        let rest = frequency - k;
        let [i, j] = [[0, k], [k, 0], [k, rest]][axis];
        part * n_own + own(i, j)
    };
    let across = -octant_axes(parts[0])[axis];
    for k in 1..frequency {
        let points = parts.map(|part| at(part, k));
        let place = |k: u32| assembly.points[at(parts[0], k) as usize];
        let normal = assembly.normals[points[0] as usize];
        let chord = place(k + 1) - place(k - 1);
        let tangent = across.cross(normal) * across.cross(normal).dot(chord).signum();
        let n = assembly.stations.len() as u32;
        if k > 1 {
            assembly.steps.push([n - 1, n]);
        }
        assembly.stations.push(Station {
            points,
            tangent,
            normal,
            across,
            length_mm: chord.length() / 2.0,
        });
    }
}
