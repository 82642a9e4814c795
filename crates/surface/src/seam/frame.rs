//! Smooth lines with a frame at every point: connectors are swept along them, and plans predict from them.

use shellock_geom::Vec3;

use super::rules::ROLE_HYSTERESIS;

/// Distance between the points of a line, mm: half the finest connector, so that smoothing keeps the seam's
/// shape.
const STEP_MM: f64 = 1.0;
/// Rounds of averaging with the neighbours. They remove the grid's ripple (period one to two cells) and
/// little else.
const SMOOTHING_ROUNDS: usize = 6;
/// Shortest line that is resampled, mm.
const SHORTEST_MM: f64 = 4.0 * STEP_MM;

/// A smooth line on the inner side of the wall.
#[derive(Clone, Debug)]
pub struct FramedLine {
    /// Points about 1 mm apart. A loop's last point is its first.
    pub points: Vec<Vec3>,
    /// Unit tangents `u` along the line.
    pub tangents: Vec<Vec3>,
    /// Outward unit normals `N`, perpendicular to `u`.
    pub normals: Vec<Vec3>,
}

impl FramedLine {
    /// Smooths and resamples `polyline`. `outward(at, point)` is the surface's outward normal at the point;
    /// `at` counts vertices of the polyline. `None` where the line is too short, or its normals vanish.
    pub fn along(polyline: &[Vec3], is_loop: bool, outward: impl Fn(f64, Vec3) -> Vec3) -> Option<Self> {
        let length_mm: f64 = polyline.windows(2).map(|w| w[0].distance(w[1])).sum();
        if length_mm < SHORTEST_MM {
            return None;
        }
        let (at, points): (Vec<f64>, Vec<Vec3>) = resample(polyline, STEP_MM).into_iter().unzip();
        let points = smooth(points, is_loop, SMOOTHING_ROUNDS);
        let tangents = tangents(&points, is_loop);
        let raw: Vec<Vec3> = at.iter().zip(&points).map(|(&at, &p)| outward(at, p)).collect();
        let normals: Vec<Vec3> = smooth(raw, is_loop, SMOOTHING_ROUNDS)
            .into_iter()
            .zip(&tangents)
            .map(|(n, u)| (n - n.dot(*u) * *u).normalize_or_zero())
            .collect();
        (!normals.contains(&Vec3::ZERO)).then_some(Self {
            points,
            tangents,
            normals,
        })
    }

    /// Distance of each point from the first along the line, mm.
    pub fn arcs_mm(&self) -> Vec<f64> {
        let mut arcs = vec![0.0];
        for w in self.points.windows(2) {
            arcs.push(arcs[arcs.len() - 1] + w[0].distance(w[1]));
        }
        arcs
    }
}

/// Roles along a line with these outward normals: true where the later piece, which leaves along
/// `separation`, carries the pin, because it leaves outwards there. Unclear places take the role of the
/// nearest clear one, so that roles do not flicker. The answer does not depend on the direction of the line.
/// A loop's first place comes once.
pub fn later_is_male(normals: &[Vec3], separation: Vec3, is_loop: bool) -> Vec<bool> {
    let outwards: Vec<f64> = normals.iter().map(|n| n.dot(separation)).collect();
    let n = outwards.len();
    let in_all = outwards.iter().sum::<f64>();
    let nearest = |ahead: &dyn Fn(usize, usize) -> Option<usize>, i: usize| {
        (1..n)
            .map_while(|k| Some((k, ahead(i, k)?)))
            .find(|&(_, j)| outwards[j].abs() > ROLE_HYSTERESIS)
    };
    let after = |i: usize, k: usize| (is_loop || i + k < n).then(|| (i + k) % n);
    let before = |i: usize, k: usize| (is_loop || i >= k).then(|| (i + n - k) % n);
    let role = |i: usize| {
        if outwards[i].abs() > ROLE_HYSTERESIS {
            return outwards[i] > 0.0;
        }
        let is_out = |(_, j): (usize, usize)| outwards[j] > 0.0;
        match (nearest(&before, i), nearest(&after, i)) {
            (Some(b), Some(a)) if b.0 == a.0 && is_out(a) != is_out(b) => outwards[i] > 0.0,
            (Some(b), Some(a)) => is_out(if a.0 < b.0 { a } else { b }),
            (Some(one), None) | (None, Some(one)) => is_out(one),
            (None, None) => in_all > 0.0,
        }
    };
    (0..n).map(role).collect()
}

/// Resamples the polyline at equal distances of about `step_mm`, ends kept: the position, counted in vertices
/// of the polyline, and the point.
fn resample(line: &[Vec3], step_mm: f64) -> Vec<(f64, Vec3)> {
    let mut at = vec![0.0];
    for w in line.windows(2) {
        at.push(at[at.len() - 1] + w[0].distance(w[1]));
    }
    let length = at[at.len() - 1];
    let n = (length / step_mm).round().max(2.0) as usize;
    let mut segment = 0;
    (0..=n)
        .map(|i| {
            let s = length * i as f64 / n as f64;
            while segment + 2 < at.len() && at[segment + 1] < s {
                segment += 1;
            }
            let span = at[segment + 1] - at[segment];
            let t = if span > 0.0 {
                ((s - at[segment]) / span).clamp(0.0, 1.0)
            } else {
                0.0
            };
            (segment as f64 + t, line[segment].lerp(line[segment + 1], t))
        })
        .collect()
}

/// Averages repeatedly by ¼ ½ ¼ along a line; ends stay, a loop's first and last value stay equal.
fn smooth(mut values: Vec<Vec3>, is_loop: bool, rounds: usize) -> Vec<Vec3> {
    let n = values.len();
    for _ in 0..rounds {
        let old = values.clone();
        for i in 1..n - 1 {
            values[i] = 0.5 * old[i] + 0.25 * (old[i - 1] + old[i + 1]);
        }
        if is_loop {
            values[0] = 0.5 * old[0] + 0.25 * (old[n - 2] + old[1]);
            values[n - 1] = values[0];
        }
    }
    values
}

fn tangents(points: &[Vec3], is_loop: bool) -> Vec<Vec3> {
    let n = points.len();
    (0..n)
        .map(|i| {
            let before = if i > 0 {
                i - 1
            } else if is_loop {
                n - 2
            } else {
                0
            };
            let after = if i + 1 < n {
                i + 1
            } else if is_loop {
                1
            } else {
                n - 1
            };
            (points[after] - points[before]).normalize_or_zero()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_change_in_the_middle_of_what_is_not_clear_and_flicker_nowhere() {
        let leans = |out: &[f64]| -> Vec<Vec3> { out.iter().map(|&z| Vec3::new(1.0, 0.0, z)).collect() };
        let roles = |out: &[f64], is_loop| later_is_male(&leans(out), Vec3::Z, is_loop);
        let turned = |out: &[f64]| out.iter().rev().copied().collect::<Vec<f64>>();
        let line = [0.05, 0.5, -0.05, 0.5, -0.02, 0.03, 0.04, -0.5, 0.05];
        assert_eq!(
            roles(&line, false),
            [true, true, true, true, true, true, false, false, false]
        );
        let mut back = roles(&turned(&line), false);
        back.reverse();
        assert_eq!(back, roles(&line, false));
        // On a loop the first place has neighbours on both sides.
        assert_eq!(roles(&[0.05, -0.5, -0.5, -0.5], true), [false; 4]);
        // If no place is clear, all get one role.
        assert_eq!(roles(&[-0.05, 0.06], true), [true; 2]);
    }

    #[test]
    fn resampling_keeps_ends_and_spacing() {
        let line = [Vec3::ZERO, Vec3::X, 1.3 * Vec3::X, Vec3::new(1.3, 5.0, 0.0)];
        let (at, points): (Vec<f64>, Vec<Vec3>) = resample(&line, 1.0).into_iter().unzip();
        assert_eq!((at[0], at[at.len() - 1]), (0.0, 3.0));
        assert_eq!((points[0], points[points.len() - 1]), (line[0], line[3]));
        let arcs: Vec<f64> = points.windows(2).map(|w| w[0].distance(w[1])).collect();
        assert!(arcs.iter().all(|a| *a <= 6.3 / 6.0 + 1e-12 && *a > 0.6));
    }
}
