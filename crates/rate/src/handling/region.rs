//! Regions of a standing model on which forces act, and where it is held.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Topology, TriMesh, Vec3};
use shellock_mechanics::ShellAssembly;

/// Height above the lowest point up to which points touch the floor, as a share of the total height.
const FOOT_SHARE: f64 = 0.02;

/// Least number of points by which a part touches the floor; with fewer it could turn.
const LEAST_POINTS: usize = 3;

/// Points (ascending) that touch the floor: the lowest 2 % of the height, or as much more as one part needs
/// to stand firmly.
///
/// Parts that touch the floor with fewer than three points are left out.
pub fn lowest(assembly: &ShellAssembly, up: Vec3) -> Vec<u32> {
    let up = up.normalize_or(Vec3::Z);
    let height = |p: &Vec3| p.dot(up);
    let bottom = assembly.points.iter().map(height).fold(f64::INFINITY, f64::min);
    let total = assembly
        .points
        .iter()
        .map(height)
        .fold(f64::NEG_INFINITY, f64::max)
        - bottom;
    let mut share = FOOT_SHARE;
    while share < 1.0 {
        let mut n_of_part = vec![0; assembly.n_parts];
        let is_low = |i: usize| height(&assembly.points[i]) <= bottom + share * total;
        let low: Vec<usize> = (0..assembly.points.len()).filter(|i| is_low(*i)).collect();
        low.iter()
            .for_each(|&i| n_of_part[assembly.part_of_point[i] as usize] += 1);
        let is_firm = |i: &usize| n_of_part[assembly.part_of_point[*i] as usize] >= LEAST_POINTS;
        let firm: Vec<u32> = low.into_iter().filter(is_firm).map(|i| i as u32).collect();
        if !firm.is_empty() {
            return firm;
        }
        share *= 1.5;
    }
    (0..assembly.points.len() as u32).collect()
}

/// The highest point of the model.
pub fn highest(assembly: &ShellAssembly, up: Vec3) -> Option<usize> {
    highest_of(assembly, up, 0..assembly.points.len())
}

/// The highest point that faces upwards within `radius_mm` of the vertical line through the middle of the
/// surface; the highest of all where there is none, as on a ring.
pub fn highest_in_the_middle(assembly: &ShellAssembly, up: Vec3, radius_mm: f64) -> Option<usize> {
    let areas_mm2 = assembly.point_areas_mm2();
    let weighted: Vec3 = assembly
        .points
        .iter()
        .zip(&areas_mm2)
        .map(|(p, area)| *p * *area)
        .sum();
    let middle = weighted / areas_mm2.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let is_near = |i: &usize| (assembly.points[*i] - middle).reject_from_normalized(up).length() <= radius_mm;
    let near = (0..assembly.points.len()).filter(|i| is_near(i) && assembly.normals[*i].dot(up) > 0.0);
    highest_of(assembly, up, near).or_else(|| highest(assembly, up))
}

/// The highest of `points` along `up`; the first of several, `None` if there are none.
pub fn highest_of(assembly: &ShellAssembly, up: Vec3, points: impl Iterator<Item = usize>) -> Option<usize> {
    let height = |i: usize| assembly.points[i].dot(up);
    points.reduce(|best, i| if height(i) > height(best) { i } else { best })
}

/// Points (ascending) that face upwards around point `hit`, no farther from it sideways or below than
/// `radius_mm`.
pub fn around(assembly: &ShellAssembly, up: Vec3, hit: usize, radius_mm: f64) -> Vec<u32> {
    let is_hit = |i: &usize| {
        let from = assembly.points[*i] - assembly.points[hit];
        let below_mm = -from.dot(up);
        let is_near = (0.0..=radius_mm).contains(&below_mm) && (from + below_mm * up).length() <= radius_mm;
        *i == hit || (is_near && assembly.normals[*i].dot(up) > 0.0)
    };
    (0..assembly.points.len())
        .filter(is_hit)
        .map(|i| i as u32)
        .collect()
}

/// Returns true if a ball of `width_mm` has room below point `i`, but for a fifth of its radius.
pub fn is_wide(assembly: &ShellAssembly, surface: &TriangleBvh, width_mm: f64, i: usize) -> bool {
    /// Share of the ball's radius that may stick out.
    const GIVE: f64 = 0.2;
    let radius_mm = 0.5 * width_mm;
    let middle = assembly.points[i] - radius_mm * assembly.normals[i];
    surface
        .nearest(middle, ((1.0 - GIVE) * radius_mm).powi(2))
        .is_none()
}

/// Returns true if no part of the model is above point `i`.
pub fn sees_sky(assembly: &ShellAssembly, surface: &TriangleBvh, up: Vec3, i: usize) -> bool {
    /// Height above the surface at which rays begin, mm: clear of the triangles at the point.
    const ABOVE_MM: f64 = 0.5;
    let from = assembly.points[i] + ABOVE_MM * assembly.normals[i];
    surface.first_hit(from, up, f64::INFINITY).is_none()
}

/// Returns true if the vertical line through `p` meets the hull of the `feet`: pressed there, nothing tips
/// over.
pub fn is_over(assembly: &ShellAssembly, feet: &[u32], up: Vec3, p: Vec3) -> bool {
    let (x, y) = up.any_orthonormal_pair();
    let angle = |v: &u32| {
        let to = assembly.points[*v as usize] - p;
        to.dot(y).atan2(to.dot(x))
    };
    let mut angles: Vec<f64> = feet.iter().map(angle).collect();
    angles.sort_by(f64::total_cmp);
    let Some((first, last)) = angles.first().zip(angles.last()) else {
        return false;
    };
    let widest = angles
        .windows(2)
        .map(|w| w[1] - w[0])
        .fold(first + TAU - last, f64::max);
    widest <= PI
}

/// Up direction after the model is laid down with `up` upwards: it rolls over the edges of its convex hull
/// until its `center` is above the face it rests on. `None` if the hull is empty or not closed.
pub fn at_rest(hull: &TriMesh, center: Vec3, up: Vec3) -> Option<Vec3> {
    let topology = Topology::of_mesh(hull)?;
    let normal = |face: usize| hull.double_area_vector(face).normalize_or_zero();
    let lowest = |a: &usize, b: &usize| normal(*a).dot(up).total_cmp(&normal(*b).dot(up));
    let mut face = (0..hull.triangles.len()).min_by(lowest)?;
    // Each step lowers the centre, so no face comes twice.
    for _ in 0..hull.triangles.len() {
        let outside = |k: usize| {
            let [from, to] = [k, (k + 1) % 3].map(|k| hull.points[hull.triangles[face][k] as usize]);
            normal(face).dot((to - from).cross(center - from)) < 0.0
        };
        let Some(edge) = (0..3).find(|k| outside(*k)) else {
            break;
        };
        face = topology.opposite((3 * face + edge) as u32) as usize / 3;
    }
    Some(-normal(face))
}

/// Width of the model between two points of its surface.
#[derive(Clone, Copy, Debug)]
pub struct Width {
    /// The two points, by their numbers.
    pub ends: [usize; 2],
    /// Distance between them, mm.
    pub width_mm: f64,
}

/// Widths straight through the model from each point, where the other side faces away from it.
pub fn widths(assembly: &ShellAssembly, mesh: &TriMesh, surface: &TriangleBvh) -> Vec<Width> {
    /// Greatest cosine between the normals of opposite sides that two fingers do not slip off.
    const OPPOSITE: f64 = -0.8;
    /// Depth below the surface at which rays begin, mm.
    const BELOW_MM: f64 = 0.01;
    let width = |i: usize| {
        let (p, n) = (assembly.points[i], assembly.normals[i]);
        let (face, width_mm) = surface.first_hit(p - BELOW_MM * n, -n, f64::INFINITY)?;
        let opposite = mesh.double_area_vector(face as usize).normalize_or_zero().dot(n) <= OPPOSITE;
        let hit = p - width_mm * n;
        let corners = mesh.triangles[face as usize].map(|v| v as usize);
        let end = corners.into_iter().min_by(|a, b| {
            assembly.points[*a]
                .distance(hit)
                .total_cmp(&assembly.points[*b].distance(hit))
        })?;
        opposite.then_some(Width {
            ends: [i, end],
            width_mm,
        })
    };
    (0..assembly.points.len()).filter_map(width).collect()
}

/// Pressures `max(0, a + b x + c y)` times the areas of `soles`, N. Their sums with 1, x and y are `asked`,
/// or as near as such pressures come.
///
/// Newton's method on the convex energy of a bed of springs that cannot pull.
pub fn pressures(soles: &[([f64; 3], f64)], asked: Vector3<f64>) -> Vec<f64> {
    const MOST_STEPS: usize = 60;
    /// Added stiffness, as a share of the whole bed's: keeps a footing on a line from turning about it.
    const LEAST: f64 = 1e-9;
    let total: f64 = soles.iter().map(|s| s.1).sum();
    let press = |bed: &Vector3<f64>, (modes, area): &([f64; 3], f64)| {
        (area * bed.dot(&Vector3::from(*modes))).max(0.0)
    };
    let answer = |bed: &Vector3<f64>| {
        soles.iter().fold(Vector3::zeros(), |sum, s| {
            sum + press(bed, s) * Vector3::from(s.0)
        })
    };
    let energy = |bed: &Vector3<f64>| {
        let springs: f64 = soles.iter().map(|s| press(bed, s).powi(2) / (2.0 * s.1)).sum();
        springs + 0.5 * LEAST * total * bed.norm_squared() - bed.dot(&asked)
    };
    let mut bed = Vector3::new(asked[0] / total.max(f64::MIN_POSITIVE), 0.0, 0.0);
    for _ in 0..MOST_STEPS {
        let left = asked - answer(&bed) - LEAST * total * bed;
        if left.norm() <= 1e-9 * asked.norm() {
            break;
        }
        let mut stiffness = Matrix3::identity() * (LEAST * total);
        for (modes, area) in soles.iter().filter(|s| press(&bed, s) > 0.0) {
            let modes = Vector3::from(*modes);
            stiffness += *area * modes * modes.transpose();
        }
        let Some(step) = stiffness.cholesky().map(|c| c.solve(&left)) else {
            break;
        };
        let mut length = 1.0;
        while length > 1e-6 && energy(&(bed + length * step)) > energy(&bed) {
            length *= 0.5;
        }
        bed += length * step;
    }
    soles.iter().map(|s| press(&bed, s)).collect()
}

/// Adds forces on the points `own` that balance `forces_n`: each is the point's area times a common shift and
/// turn.
pub fn hold(assembly: &ShellAssembly, areas_mm2: &[f64], own: &[usize], forces_n: &mut [Vec3]) {
    let total: f64 = own.iter().map(|v| areas_mm2[*v]).sum();
    let center = own
        .iter()
        .map(|v| areas_mm2[*v] * assembly.points[*v])
        .sum::<Vec3>()
        / total.max(1e-9);
    let modes = |p: Vec3| -> [Vec3; 6] {
        std::array::from_fn(|j| {
            if j < 3 {
                Vec3::AXES[j]
            } else {
                Vec3::AXES[j - 3].cross(p - center)
            }
        })
    };
    let mut asked = SVector::<f64, 6>::zeros();
    for (p, f) in assembly.points.iter().zip(forces_n.iter()) {
        modes(*p)
            .iter()
            .enumerate()
            .for_each(|(a, mode)| asked[a] -= mode.dot(*f));
    }
    let mut grip = SMatrix::<f64, 6, 6>::zeros();
    for &v in own {
        let modes = modes(assembly.points[v]);
        (0..36).for_each(|k| grip[(k / 6, k % 6)] += areas_mm2[v] * modes[k / 6].dot(modes[k % 6]));
    }
    let Some(held) = grip.cholesky().map(|c| c.solve(&asked)) else {
        return;
    };
    for &v in own {
        let modes = modes(assembly.points[v]);
        forces_n[v] += (0..6).map(|a| held[a] * areas_mm2[v] * modes[a]).sum::<Vec3>();
    }
}

/// Spreads `force_n` over `points` in proportion to their area; evenly where they have none.
pub fn spread(assembly: &ShellAssembly, points: &[u32], force_n: Vec3) -> Vec<Vec3> {
    let area_mm2 = assembly.point_areas_mm2();
    let total: f64 = points.iter().map(|&p| area_mm2[p as usize]).sum();
    let mut forces_n = vec![Vec3::ZERO; assembly.points.len()];
    for &p in points {
        let share = if total > 0.0 {
            area_mm2[p as usize] / total
        } else {
            1.0 / points.len() as f64
        };
        forces_n[p as usize] = force_n * share;
    }
    forces_n
}
