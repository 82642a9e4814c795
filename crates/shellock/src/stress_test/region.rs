//! Where forces act on a model that stands, and where it is held.

use shellock_geom::Vec3;
use shellock_mechanics::ShellAssembly;

/// What lies within this share of the height above the lowest point touches the floor.
const FOOT_SHARE: f64 = 0.02;

/// Points of a part that hold it: with fewer it could turn.
const LEAST_POINTS: usize = 3;

/// The points (ascending) that touch the floor: the lowest 2 % of the height, or as much more as one part
/// needs to stand firmly.
///
/// Parts that touch it with fewer than three points are left out.
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

/// The highest point.
pub fn highest(assembly: &ShellAssembly, up: Vec3) -> Option<usize> {
    highest_of(assembly, up, 0..assembly.points.len())
}

/// The highest point that faces upwards within `radius_mm` of the vertical line through the middle of the
/// surface; the highest of all where there is none, as on a ring.
pub fn highest_in_the_middle(assembly: &ShellAssembly, up: Vec3, radius_mm: f64) -> Option<usize> {
    let areas_mm2 = point_areas_mm2(assembly);
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

fn highest_of(assembly: &ShellAssembly, up: Vec3, points: impl Iterator<Item = usize>) -> Option<usize> {
    let height = |i: usize| assembly.points[i].dot(up);
    points.reduce(|best, i| if height(i) > height(best) { i } else { best })
}

/// The points (ascending) that face upwards around point `hit`, no farther from it sideways or below than
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

/// A third of its triangles' area for each point.
fn point_areas_mm2(assembly: &ShellAssembly) -> Vec<f64> {
    let mut areas_mm2 = vec![0.0; assembly.points.len()];
    for t in &assembly.triangles {
        let [a, b, c] = t.map(|p| assembly.points[p as usize]);
        let third = (b - a).cross(c - a).length() / 6.0;
        t.iter().for_each(|&p| areas_mm2[p as usize] += third);
    }
    areas_mm2
}

/// `force_n` over `points`, each by its share of their area; evenly where they have none.
pub fn spread(assembly: &ShellAssembly, points: &[u32], force_n: Vec3) -> Vec<Vec3> {
    let area_mm2 = point_areas_mm2(assembly);
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
