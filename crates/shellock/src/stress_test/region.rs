//! Where forces act on a model that stands, and where it is held.

use shellock_geom::Vec3;
use shellock_mechanics::ShellAssembly;

/// What lies within this share of the height above the lowest point touches the floor.
const FOOT_SHARE: f64 = 0.02;

/// Points of a part that hold it: with fewer it could turn.
const LEAST_POINTS: usize = 3;

/// The points (ascending) that touch the floor: the lowest 2 % of the height, or as much more as one part needs to stand firmly.
///
/// Parts that touch it with fewer than three points are left out.
pub fn lowest(assembly: &ShellAssembly, up: Vec3) -> Vec<u32> {
    let up = up.normalize_or(Vec3::Z);
    let height = |p: &Vec3| p.dot(up);
    let bottom = assembly.points.iter().map(height).fold(f64::INFINITY, f64::min);
    let total = assembly.points.iter().map(height).fold(f64::NEG_INFINITY, f64::max) - bottom;
    let mut share = FOOT_SHARE;
    while share < 1.0 {
        let mut n_of_part = vec![0; assembly.n_parts];
        let is_low = |i: usize| height(&assembly.points[i]) <= bottom + share * total;
        let low: Vec<usize> = (0..assembly.points.len()).filter(|i| is_low(*i)).collect();
        low.iter().for_each(|&i| n_of_part[assembly.part_of_point[i] as usize] += 1);
        let is_firm = |i: &usize| n_of_part[assembly.part_of_point[*i] as usize] >= LEAST_POINTS;
        let firm: Vec<u32> = low.into_iter().filter(is_firm).map(|i| i as u32).collect();
        if !firm.is_empty() {
            return firm;
        }
        share *= 1.5;
    }
    (0..assembly.points.len() as u32).collect()
}

/// The points (ascending) around the highest one, no farther from it sideways or below than `radius_mm`, that face upwards.
pub fn top(assembly: &ShellAssembly, up: Vec3, radius_mm: f64) -> Vec<u32> {
    let highest = (0..assembly.points.len()).reduce(|best, i| {
        if assembly.points[i].dot(up) > assembly.points[best].dot(up) { i } else { best }
    });
    let Some(highest) = highest else { return Vec::new() };
    let is_hit = |i: &usize| {
        let from = assembly.points[*i] - assembly.points[highest];
        let below_mm = -from.dot(up);
        let is_near = below_mm <= radius_mm && (from + below_mm * up).length() <= radius_mm;
        *i == highest || (is_near && assembly.normals[*i].dot(up) > 0.0)
    };
    (0..assembly.points.len()).filter(is_hit).map(|i| i as u32).collect()
}

/// `force_n` over `points`, each by its share of their area; evenly where they have none.
pub fn spread(assembly: &ShellAssembly, points: &[u32], force_n: Vec3) -> Vec<Vec3> {
    let mut area_mm2 = vec![0.0; assembly.points.len()];
    for t in &assembly.triangles {
        let [a, b, c] = t.map(|p| assembly.points[p as usize]);
        let third = (b - a).cross(c - a).length() / 6.0;
        t.iter().for_each(|&p| area_mm2[p as usize] += third);
    }
    let total: f64 = points.iter().map(|&p| area_mm2[p as usize]).sum();
    let mut forces_n = vec![Vec3::ZERO; assembly.points.len()];
    for &p in points {
        let share = if total > 0.0 { area_mm2[p as usize] / total } else { 1.0 / points.len() as f64 };
        forces_n[p as usize] = force_n * share;
    }
    forces_n
}
