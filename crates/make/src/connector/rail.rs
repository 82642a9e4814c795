//! Rails for a key that slides along its seam (Sect. 6.1, Fig. 6).
//!
//! The neighbour has a straight tongue under the key's wall; the key has a groove around it. All parts of the
//! key thus lie within its own outline, and leave with it through the opening in the rim of its neighbours.
//! The tongue's tip is narrower, and the groove ends just beyond it, so the key stops in its place.

use shellock_geom::Vec3;
use shellock_surface::seam::rules::{MAX_ALONG_SEAM, MAX_OUT_OF_RAIL, SHORTEST_RAIL_SIZES, end_gap_mm};

use super::ConnectorParams;
use super::frame::Curve;
use super::free::{Needed, has_room};
use super::station::{RailPart, Run, RunShape, RunStation};

/// Greatest deviation of the seam from a straight line, across, and of the wall's inner side, up and down, in
/// connector sizes.
const MOST_ASIDE_SIZES: f64 = 0.16;
const MOST_UNEVEN_SIZES: f64 = 0.3;
/// Greatest distance from the seam of points that pass over a tongue, across, in connector sizes.
const REACH_SIZES: f64 = 1.2;
/// Lengths of the narrow tip and of the stop, in connector sizes.
const LEAD_IN_SIZES: f64 = 0.5;
const STOP_SIZES: f64 = 0.45;
/// Number of steps at whose ends a rail is tested for room.
const N_PLACES: usize = 12;

/// Coordinates of a point of the seam: along the slide, towards the key, out of the surface; mm.
type Place = [f64; 3];

/// Axes of a rail, unit vectors.
struct Axes {
    slide: Vec3,
    to_key: Vec3,
    outwards: Vec3,
}

impl Axes {
    fn place(&self, p: &Vec3) -> Place {
        [p.dot(self.slide), p.dot(self.to_key), p.dot(self.outwards)]
    }
}

/// Rails under `curve`, one of `curves`, for a key that leaves along `slide`, and the length of seam that
/// would be usable for rails, mm.
pub(super) fn rails(
    params: &ConnectorParams,
    curves: &[Curve],
    curve: &Curve,
    slide: Vec3,
    size_mm: f64,
    is_free: &dyn Fn(shellock_report::PatchId, Vec3) -> Option<bool>,
) -> (Vec<Run>, f64) {
    let (mut rails, mut usable_mm) = (Vec::new(), 0.0);
    for (from, to) in along_slide(curve, slide, size_mm) {
        let points = &curve.points[from..=to];
        usable_mm += points.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
        let mean = |of: &[Vec3]| of[from..=to].iter().sum::<Vec3>();
        let Some(outwards) = mean(&curve.normals).reject_from_normalized(slide).try_normalize() else {
            continue;
        };
        let across = slide.cross(outwards);
        let to_key = if across.dot(mean(&curve.across)) < 0.0 {
            across
        } else {
            -across
        };
        let axes = Axes {
            slide,
            to_key,
            outwards,
        };
        let all = curves
            .iter()
            .filter(|c| c.later == curve.later)
            .flat_map(|c| &c.points);
        let outline: Vec<Place> = all.map(|p| axes.place(p)).collect();
        let rail = straight(points, &outline, &axes, size_mm)
            .and_then(|line| rail(params, curve, &axes, line, size_mm, is_free));
        rails.extend(rail);
    }
    (rails, usable_mm)
}

/// Stretches of the curve that run along the slide, away from its ends, as inclusive index ranges.
fn along_slide(curve: &Curve, slide: Vec3, size_mm: f64) -> Vec<(usize, usize)> {
    let mut arc_mm = vec![0.0];
    for w in curve.points.windows(2) {
        arc_mm.push(arc_mm[arc_mm.len() - 1] + w[0].distance(w[1]));
    }
    let length_mm = arc_mm[arc_mm.len() - 1];
    let end_mm = if curve.is_loop {
        0.0
    } else {
        end_gap_mm(size_mm, length_mm)
    };
    let is_along = |i: usize| {
        let clear = arc_mm[i] >= end_mm && arc_mm[i] <= length_mm - end_mm;
        clear
            && curve.tangents[i].dot(slide).abs() > MAX_ALONG_SEAM
            && curve.normals[i].dot(slide).abs() < MAX_OUT_OF_RAIL
    };
    let mut found = Vec::new();
    let mut from = 0;
    while from < curve.points.len() {
        let to = from + (from..curve.points.len()).take_while(|&i| is_along(i)).count();
        if to > from + 1 && arc_mm[to - 1] - arc_mm[from] >= SHORTEST_RAIL_SIZES * size_mm {
            found.push((from, to - 1));
        }
        from = to + 1;
    }
    found
}

/// Back and front end of the longest straight line that the points follow; `None` where it is too short. The
/// line lies under the lowest point, and under all of the key's `outline` behind the front, which passes over
/// it.
fn straight(points: &[Vec3], outline: &[Place], axes: &Axes, size_mm: f64) -> Option<[Place; 2]> {
    let mut places: Vec<Place> = points.iter().map(|p| axes.place(p)).collect();
    places.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut rest = &places[..];
    loop {
        let length = rest[rest.len() - 1][0] - rest[0][0];
        if rest.len() < 3 || length < SHORTEST_RAIL_SIZES * size_mm {
            return None;
        }
        let (middle, slope) = fit_line(rest);
        let aside = |p: &Place| (p[1] - middle[1] - slope * (p[0] - middle[0])).abs();
        let front = rest[rest.len() - 1][0];
        let near_seam = |p: &&Place| (p[1] - middle_of(rest)).abs() < REACH_SIZES * size_mm;
        let passing = outline
            .iter()
            .filter(|p| p[0] <= front)
            .filter(near_seam)
            .map(|p| p[2]);
        let low = passing.fold(rest.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min), f64::min);
        let high = rest.iter().map(|p| p[2]).fold(f64::NEG_INFINITY, f64::max);
        let uneven = |p: &Place| (p[2] - middle[2]).abs();
        let excess = |p: &Place| aside(p) / MOST_ASIDE_SIZES + uneven(p) / MOST_UNEVEN_SIZES;
        if rest.iter().all(|p| aside(p) <= MOST_ASIDE_SIZES * size_mm)
            && high - low <= MOST_UNEVEN_SIZES * size_mm
        {
            let at = |along: f64| [along, middle[1] + slope * (along - middle[0]), low];
            return Some([at(rest[0][0]), at(rest[rest.len() - 1][0])]);
        }
        // The points deviate most at an end, so the worse end is dropped.
        rest = if excess(&rest[0]) > excess(&rest[rest.len() - 1]) {
            &rest[1..]
        } else {
            &rest[..rest.len() - 1]
        };
    }
}

/// Mean coordinate of the places across the slide, mm.
fn middle_of(places: &[Place]) -> f64 {
    places.iter().map(|p| p[1]).sum::<f64>() / places.len() as f64
}

/// Centre of the places, and slope towards the key of the least-squares line through them.
fn fit_line(places: &[Place]) -> (Place, f64) {
    let n = places.len() as f64;
    let middle: Place = std::array::from_fn(|axis| places.iter().map(|p| p[axis]).sum::<f64>() / n);
    let (mut across, mut along) = (0.0, 0.0);
    for p in places {
        across += (p[0] - middle[0]) * (p[1] - middle[1]);
        along += (p[0] - middle[0]).powi(2);
    }
    (middle, if along > 0.0 { across / along } else { 0.0 })
}

/// The longest rail on the line that has room; `None` where none is long enough.
fn rail(
    params: &ConnectorParams,
    curve: &Curve,
    axes: &Axes,
    [back, front]: [Place; 2],
    size_mm: f64,
    is_free: &dyn Fn(shellock_report::PatchId, Vec3) -> Option<bool>,
) -> Option<Run> {
    let (male, female) = (curve.earlier, curve.later);
    let clearance_mm = params.clearance_of(true);
    let point = |p: Place| p[0] * axes.slide + p[1] * axes.to_key + p[2] * axes.outwards;
    let tangent = (point(front) - point(back)).normalize();
    let n = axes.outwards.cross(tangent);
    let n = if n.dot(axes.to_key) < 0.0 { -n } else { n };
    let length_mm = point(front).distance(point(back));
    let station = |arc_mm: f64, part: RailPart| RunStation {
        point: point(back) + arc_mm * tangent,
        tangent,
        n,
        s: axes.outwards,
        theta: 0.0,
        depth: 1.0,
        arc_mm,
        size_mm,
        clearance_mm,
        shape: RunShape::Rail(part),
    };
    let arc = |i: usize| length_mm * i as f64 / N_PLACES as f64;
    let free: Vec<bool> = (0..=N_PLACES)
        .map(|i| {
            has_room(
                params,
                &station(arc(i), RailPart::Full),
                male,
                female,
                Needed::Most,
                is_free,
            )
        })
        .collect();
    let (from, to) = longest(&free)?;
    let (start, end) = (arc(from), arc(to));
    if end - start < SHORTEST_RAIL_SIZES * size_mm {
        return None;
    }
    let places = rail_places([start, end], size_mm, clearance_mm);
    let (stop_mm, stop) = places[4];
    let has_stop = has_room(
        params,
        &station(stop_mm, stop),
        male,
        female,
        Needed::Most,
        is_free,
    );
    let made = places.into_iter().take(if has_stop { 5 } else { 3 });
    let stations = made.map(|(arc_mm, part)| station(arc_mm, part)).collect();
    Some(Run {
        male,
        female,
        stations,
    })
}

/// Positions and parts of the sections of a rail whose tongue reaches from `start_mm` to `end_mm` of its
/// line: the tongue, its tip, and beyond them the groove's end.
pub(crate) fn rail_places(
    [start_mm, end_mm]: [f64; 2],
    size_mm: f64,
    clearance_mm: f64,
) -> [(f64, RailPart); 5] {
    [
        (start_mm, RailPart::Full),
        (end_mm - LEAD_IN_SIZES * size_mm, RailPart::Full),
        (end_mm, RailPart::LeadIn),
        (end_mm + clearance_mm, RailPart::Stop),
        (end_mm + stop_mm(size_mm, clearance_mm), RailPart::Stop),
    ]
}

/// Length by which a key's groove reaches beyond the tongue's tip, mm.
pub(crate) fn stop_mm(size_mm: f64, clearance_mm: f64) -> f64 {
    clearance_mm + STOP_SIZES * size_mm
}

/// The longest row of `true`, as an inclusive index range.
fn longest(row: &[bool]) -> Option<(usize, usize)> {
    let mut best: Option<(usize, usize)> = None;
    let mut from = 0;
    for i in 0..=row.len() {
        if i < row.len() && row[i] {
            continue;
        }
        if i > from && best.is_none_or(|(a, b)| i - 1 - from > b - a) {
            best = Some((from, i - 1));
        }
        from = i + 1;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_with_a_bent_end_gives_the_straight_part_under_its_lowest_point() {
        let axes = Axes {
            slide: Vec3::X,
            to_key: Vec3::Y,
            outwards: Vec3::Z,
        };
        let points: Vec<Vec3> = (0..40)
            .map(f64::from)
            .map(|x| Vec3::new(x, 0.05 * x + (x - 30.0).max(0.0).powi(2), 0.1 * (x * 0.4).sin()))
            .collect();
        let [back, front] = straight(&points, &[], &axes, 2.5).unwrap();
        assert!(
            back[0] < 3.0 && front[0] > 27.0 && front[0] < 33.0,
            "{back:?} {front:?}"
        );
        assert!((back[2] + 0.1).abs() < 0.02 && back[2] == front[2]);
        let slope = (front[1] - back[1]) / (front[0] - back[0]);
        assert!((slope - 0.05).abs() < 0.03, "{slope}");
        // Outline points behind the front pass over the rail; those ahead of it or far aside do not.
        let [behind, ahead, aside] = [[-4.0, 1.0, -0.5], [39.0, 1.0, -3.0], [-4.0, 9.0, -3.0]];
        let lower = straight(&points, &[behind, ahead, aside], &axes, 2.5).unwrap();
        assert_eq!(lower[0][2], -0.5);
        assert_eq!(straight(&points, &[[-4.0, 1.0, -2.0]], &axes, 2.5), None);
    }

    #[test]
    fn the_longest_row_is_found_anywhere() {
        assert_eq!(longest(&[true, false, true, true, false]), Some((2, 3)));
        assert_eq!(longest(&[false, true, true]), Some((1, 2)));
        assert_eq!(longest(&[false]), None);
    }
}
