//! The local neighbourhood of a seam: two half-planes that meet in a straight line (Sect. 5.3).
//!
//! ```text
//!        y = across
//!   ┌──────────▲──────────┐
//!   │   side b │          │      held at the outer ring; the station in the middle represents the seam;
//!   ├──s──s──s─┼─s──s──s──┤ ► x  the others have joints as well, so that no free end is near it;
//!   │   side a            │      z: outward normal
//!   └─────────────────────┘
//! ```

use shellock_geom::Vec3;

use crate::assembly::{ShellAssembly, Station};

/// Builds two rectangles of `n × rows` squares of `edge_mm` each, split into triangles, with side a at y < 0.
///
/// There is a station at every seam point except the two ends. `n` ≥ 2, `rows` ≥ 1.
pub fn two_plates(n: usize, rows: usize, edge_mm: f64) -> ShellAssembly {
    let mut assembly = ShellAssembly {
        n_parts: 2,
        ..ShellAssembly::default()
    };
    let point = |side: usize, i: usize, j: usize| (side * (n + 1) * (rows + 1) + j * (n + 1) + i) as u32;
    for (side, y_sign) in [(0, -1.0), (1, 1.0)] {
        for j in 0..=rows {
            for i in 0..=n {
                let x = i as f64 - 0.5 * n as f64;
                assembly
                    .points
                    .push(edge_mm * Vec3::new(x, y_sign * j as f64, 0.0));
                assembly.normals.push(Vec3::Z);
                assembly.part_of_point.push(side as u32);
            }
        }
        for (j, i) in (0..rows).flat_map(|j| (0..n).map(move |i| (j, i))) {
            let [a, b, c, d] =
                [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| point(side, i, j));
            // Alternating diagonals, so that no direction is preferred.
            let halves = if (i + j) % 2 == 0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            };
            assembly
                .triangles
                .extend(halves.map(|[x, y, z]| if side == 1 { [x, y, z] } else { [x, z, y] }));
        }
    }
    for i in 1..n {
        let points = [point(0, i, 0), point(1, i, 0)];
        let (tangent, normal, across, length_mm) = (Vec3::X, Vec3::Z, Vec3::Y, edge_mm);
        assembly.stations.push(Station {
            points,
            tangent,
            normal,
            across,
            length_mm,
        });
    }
    assembly.steps = (0..n as u32 - 2).map(|i| [i, i + 1]).collect();
    assembly
}

/// Marks the points of [`two_plates`] on the outer ring: all borders except the seam.
pub fn outer_ring(n: usize, rows: usize) -> Vec<bool> {
    let is_ring = |j: usize, i: usize| j == rows || i == 0 || i == n;
    (0..2)
        .flat_map(|_| (0..=rows).flat_map(|j| (0..=n).map(move |i| is_ring(j, i))))
        .collect()
}
