//! Runs of connectors, and the places where connectors can be.

use shellock_geom::Vec3;
use shellock_plan::LatticePlan;
use shellock_plan::sizes::ConnectorSizes;
use shellock_report::PatchId;
use shellock_surface::seam::later_is_male;
use shellock_surface::seam::rules::{
    MAX_ALONG_SEAM, MAX_BACKWARD_RAD, SHARPEST_TURN, SHORTEST_RUN_SIZES, end_gap_mm,
};

use super::ConnectorParams;
use super::frame::Curve;
use super::free::{Needed, has_room};
use super::profile::Section;
use super::rail::rails;
use super::station::{Run, RunShape, RunStation};
use super::taken::Taken;

/// Limits of a run's cell: deviation from the curve, mm, turn, rad, and length, mm.
const CELL_SAG_MM: f64 = 0.03;
const CELL_TURN: f64 = 0.12;
const CELL_LENGTH_MM: f64 = 6.0;

/// Sizes to which a section may shrink where its full size has no room: least share of the full size, least
/// size, mm, and number of sizes that are tried.
const LEAST_SHARE: f64 = 0.5;
const LEAST_SIZE_MM: f64 = 2.0;
const N_SIZES: usize = 6;
/// Least advance of a section's corners, as a share of the seam's. Where the inner side of a bend stood
/// still, sections between two stations would cross, and the wall there would fold by some micrometres.
const LEAST_ADVANCE: f64 = 0.05;
/// Greatest change of the size along the seam, mm per mm.
const MOST_WIDENING: f64 = 0.25;

/// Room for connectors on a seam between two pieces.
#[derive(Clone, Debug, PartialEq)]
pub struct SeamRoom {
    /// The piece installed later.
    pub later: PatchId,
    /// The piece installed earlier.
    pub earlier: PatchId,
    /// Length of the seam on the inner surface, mm.
    pub length_mm: f64,
    /// Length on which angles, ends and turns allow a connector, mm.
    pub usable_mm: f64,
    /// A point in the middle of the seam.
    pub at: Vec3,
}

/// Runs along all curves, and the room of each curve. `is_free(piece, point)` is true where `piece` may have
/// material at a point below the wall; `None` where the point lies in or above the wall and does not count.
/// `slide` is the key's direction where it slides on rails.
///
/// Seams of pieces that leave first come first. Later ones keep out of the way of their connectors.
pub fn runs(
    params: &ConnectorParams,
    sizes: &ConnectorSizes,
    plan: &LatticePlan,
    curves: &[Curve],
    slide: Option<Vec3>,
    is_free: &dyn Fn(PatchId, Vec3) -> Option<bool>,
) -> (Vec<Run>, Vec<SeamRoom>) {
    let mut order: Vec<&Curve> = curves.iter().collect();
    order.sort_by_key(|curve| std::cmp::Reverse(plan.position(curve.later)));
    let mut taken = Taken::none(plan);
    let (mut runs, mut rooms) = (Vec::new(), Vec::new());
    for curve in order {
        let is_clear = |piece: PatchId, point: Vec3| {
            is_free(piece, point).map(|is_free| is_free && taken.leaves_free(piece, point))
        };
        let size_mm = sizes.of(curve.later, curve.earlier);
        let slides = slide.is_some() && curve.later == plan.key();
        let line = Line::along(curve, plan, size_mm, params.clearance_of(slides));
        let mut room = line.room();
        let mut made = Vec::new();
        if let Some(slide) = slide.filter(|_| slides) {
            let (rails, usable_mm) = rails(params, curves, curve, slide, size_mm, is_free);
            made.extend(rails);
            room.usable_mm += usable_mm;
        }
        made.extend(line.runs(params, &is_clear, is_free));
        made.iter().for_each(|run| taken.add(params, run));
        runs.extend(made);
        rooms.push(room);
    }
    (runs, rooms)
}

/// A curve with the section that a connector would have at each of its points.
struct Line<'a> {
    curve: &'a Curve,
    stations: Vec<RunStation>,
    /// True where the later piece carries the pin.
    later_is_male: Vec<bool>,
    /// True where ends, roles, angles and turns allow a connector.
    allowed: Vec<bool>,
}

impl<'a> Line<'a> {
    fn along(curve: &'a Curve, plan: &LatticePlan, size_mm: f64, clearance_mm: f64) -> Self {
        let separation = plan.separation(curve.later).unit();
        let later_is_male = roles(curve, separation);
        let at = |i: usize| RunStation {
            clearance_mm,
            ..station(curve, i, separation, later_is_male[i], size_mm)
        };
        let stations: Vec<RunStation> = (0..curve.points.len()).map(at).collect();
        let allowed = connector_mask(size_mm, curve, &stations, &later_is_male);
        Self {
            curve,
            stations,
            later_is_male,
            allowed,
        }
    }

    fn room(&self) -> SeamRoom {
        let step = |i: usize| self.stations[i].point.distance(self.stations[i + 1].point);
        let steps = 0..self.stations.len() - 1;
        SeamRoom {
            later: self.curve.later,
            earlier: self.curve.earlier,
            length_mm: steps.clone().map(step).sum(),
            usable_mm: steps
                .filter(|&i| self.allowed[i] && self.allowed[i + 1])
                .map(step)
                .sum(),
            at: self.curve.points[self.curve.points.len() / 2],
        }
    }

    /// Runs on the stretches where the whole section is clear of walls and of other connectors. A seam that
    /// has none such gets runs where most of the section is free of walls; carving removes the rest of them.
    fn runs(
        &self,
        params: &ConnectorParams,
        is_clear: &dyn Fn(PatchId, Vec3) -> Option<bool>,
        is_free: &dyn Fn(PatchId, Vec3) -> Option<bool>,
    ) -> Vec<Run> {
        let whole = self.runs_with(params, Needed::Whole, is_clear);
        if whole.is_empty() {
            return self.runs_with(params, Needed::Most, is_free);
        }
        whole
    }

    fn runs_with(
        &self,
        params: &ConnectorParams,
        needed: Needed,
        is_free: &dyn Fn(PatchId, Vec3) -> Option<bool>,
    ) -> Vec<Run> {
        let at = |i: usize, size_mm: f64| RunStation {
            size_mm,
            ..self.stations[i]
        };
        let has_room = |i: usize, station: &RunStation| {
            let (male, female) = sides(self.curve, self.later_is_male[i]);
            let crosses_before = i > 0 && cross(params, &at(i - 1, station.size_mm), station);
            let last = self.stations.len() - 1;
            let crosses_after = i < last && cross(params, station, &at(i + 1, station.size_mm));
            !crosses_before && !crosses_after && has_room(params, station, male, female, needed, is_free)
        };
        let (mut stations, mut allowed) = (self.stations.clone(), self.allowed.clone());
        fit_sizes(&mut stations, &mut allowed, &has_room);
        // Where sizes differ, neighbours can still cross.
        for i in 1..stations.len() {
            if cross(params, &stations[i - 1], &stations[i]) {
                allowed[i - 1] = false;
                allowed[i] = false;
            }
        }
        let mut runs = Vec::new();
        for (from, to) in stretches(&allowed, &self.later_is_male) {
            let stretch = &stations[from..=to];
            let (male, female) = sides(self.curve, self.later_is_male[from]);
            let least_mm = stretch.iter().map(|at| at.size_mm).fold(f64::INFINITY, f64::min);
            if stretch[stretch.len() - 1].arc_mm - stretch[0].arc_mm >= SHORTEST_RUN_SIZES * least_mm {
                runs.push(Run {
                    male,
                    female,
                    stations: thin_out(params, stretch),
                });
            }
        }
        runs
    }
}

fn sides(curve: &Curve, later_is_male: bool) -> (PatchId, PatchId) {
    if later_is_male {
        (curve.later, curve.earlier)
    } else {
        (curve.earlier, curve.later)
    }
}

/// Roles along a curve: true where the later piece carries the pin.
fn roles(curve: &Curve, separation: Vec3) -> Vec<bool> {
    let n = curve.normals.len() - usize::from(curve.is_loop);
    let mut roles = later_is_male(&curve.normals[..n], separation, curve.is_loop);
    if curve.is_loop {
        roles.push(roles[0]);
    }
    roles
}

fn station(curve: &Curve, i: usize, separation: Vec3, later_is_male: bool, size_mm: f64) -> RunStation {
    let (u, normal) = (curve.tangents[i], curve.normals[i]);
    let (s, to_female) = if later_is_male {
        (separation, curve.across[i])
    } else {
        (-separation, -curve.across[i])
    };
    let across = s - s.dot(u) * u;
    let depth = across.length();
    let flat = across.normalize_or_zero();
    let theta = flat.dot(to_female).atan2(flat.dot(normal));
    let n = (theta.cos() * to_female - theta.sin() * normal).normalize_or_zero();
    let arc_mm = curve.points[..=i].windows(2).map(|w| w[0].distance(w[1])).sum();
    RunStation {
        point: curve.points[i],
        tangent: u,
        n,
        s,
        theta,
        depth,
        arc_mm,
        size_mm,
        clearance_mm: 0.0,
        shape: RunShape::Seam,
    }
}

/// True at the points where ends, roles, angles and turns allow a connector.
fn connector_mask(size_mm: f64, curve: &Curve, stations: &[RunStation], later_is_male: &[bool]) -> Vec<bool> {
    let n = stations.len();
    let length = stations[n - 1].arc_mm;
    let end = end_gap_mm(size_mm, length);
    let turns = |i: usize, j: usize| stations[i].n.dot(stations[j].n) < SHARPEST_TURN.cos();
    (0..n)
        .map(|i| {
            let s = &stations[i];
            let clear_of_ends = curve.is_loop || (s.arc_mm >= end && s.arc_mm <= length - end);
            let near = i.saturating_sub(1)..=(i + 1).min(n - 1);
            let same_role = near.clone().all(|j| later_is_male[j] == later_is_male[i]);
            let gentle = near.clone().all(|j| !turns(i, j));
            // An angle just below −90° is a tongue that hysteresis kept; beyond that the other side has the
            // pin.
            let sound = s.theta <= MAX_BACKWARD_RAD && s.theta >= -1.75;
            clear_of_ends && same_role && gentle && sound && s.s.dot(s.tangent).abs() <= MAX_ALONG_SEAM
        })
        .collect()
}

/// Maximal stretches of allowed points with one role, as inclusive index ranges.
fn stretches(allowed: &[bool], role: &[bool]) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut from = 0;
    while from < allowed.len() {
        let mut to = from;
        while to + 1 < allowed.len() && allowed[to] && allowed[to + 1] && role[to + 1] == role[from] {
            to += 1;
        }
        if allowed[from] && to > from {
            found.push((from, to));
        }
        from = to + 1;
    }
    found
}

/// Gives each allowed station the greatest size, up to its own, with which its section has room. Sizes change
/// gently along the seam: a run narrows past an obstacle and in a tight bend. Where no size has room, the
/// station is no longer allowed.
fn fit_sizes(
    stations: &mut [RunStation],
    allowed: &mut [bool],
    has_room: &dyn Fn(usize, &RunStation) -> bool,
) {
    let sized = |at: &RunStation, size_mm: f64| RunStation { size_mm, ..*at };
    for i in 0..stations.len() {
        let full_mm = stations[i].size_mm;
        let least_mm = (LEAST_SHARE * full_mm).max(LEAST_SIZE_MM).min(full_mm);
        let step_mm = (full_mm - least_mm) / (N_SIZES - 1) as f64;
        let fits = |k: usize| {
            let station = sized(&stations[i], full_mm - k as f64 * step_mm);
            has_room(i, &station).then_some(station)
        };
        let n_sizes = if step_mm > 0.0 { N_SIZES } else { 1 };
        let fit = if allowed[i] {
            (0..n_sizes).find_map(fits)
        } else {
            None
        };
        match fit {
            Some(station) => stations[i] = station,
            None => allowed[i] = false,
        }
    }
    let wide = stations.to_vec();
    for i in (0..stations.len()).filter(|&i| allowed[i]) {
        let limit_mm = |j: usize| wide[j].size_mm + MOST_WIDENING * (wide[j].arc_mm - wide[i].arc_mm).abs();
        let onwards = (i..wide.len()).take_while(|&j| allowed[j]);
        let backwards = (0..i).rev().take_while(|&j| allowed[j]);
        let size_mm = onwards
            .chain(backwards)
            .map(limit_mm)
            .fold(f64::INFINITY, f64::min);
        stations[i] = sized(&stations[i], size_mm);
    }
    for i in 0..stations.len() {
        allowed[i] = allowed[i] && (stations[i] == wide[i] || has_room(i, &stations[i]));
    }
}

/// Returns true if the sections at two successive stations meet or nearly do: on the inner side of a bend, a
/// corner advances by less than [`LEAST_ADVANCE`] of the seam's way between the planes of the two.
fn cross(params: &ConnectorParams, a: &RunStation, b: &RunStation) -> bool {
    let outer = |at: &RunStation| Section::at(params, at).bounds().corners(at);
    let forward = |at: &RunStation| {
        let normal = at.n.cross(at.s);
        normal * normal.dot(at.tangent).signum()
    };
    let advances = |from: &RunStation, corners: [Vec3; 4], of: Vec3, along: Vec3| {
        let least_mm = LEAST_ADVANCE * (of - from.point).dot(along).max(0.0);
        corners.iter().all(|p| (*p - from.point).dot(along) > least_mm)
    };
    let is_ahead = advances(a, outer(b), b.point, forward(a));
    let is_behind = advances(b, outer(a), a.point, -forward(b));
    !(is_ahead && is_behind)
}

/// Selects as few stations as possible whose cells keep the limits of sag, turn and length, and whose
/// sections do not meet.
fn thin_out(params: &ConnectorParams, stations: &[RunStation]) -> Vec<RunStation> {
    let mut kept = vec![stations[0]];
    let mut from = 0;
    for to in 2..stations.len() {
        let (a, b) = (&stations[from], &stations[to]);
        let chord = (b.point - a.point).normalize_or_zero();
        let sags = stations[from + 1..to].iter().any(|s| {
            let off = s.point - a.point;
            (off - off.dot(chord) * chord).length() > CELL_SAG_MM
        });
        let turns = a.n.dot(b.n) < CELL_TURN.cos() || (a.theta - b.theta).abs() > CELL_TURN;
        let is_long = b.arc_mm - a.arc_mm > CELL_LENGTH_MM;
        let narrows = stations[from + 1..to].iter().any(|s| {
            let share = (s.arc_mm - a.arc_mm) / (b.arc_mm - a.arc_mm);
            (s.size_mm - a.size_mm - share * (b.size_mm - a.size_mm)).abs() > CELL_SAG_MM
        });
        if sags || turns || narrows || is_long || cross(params, a, b) {
            from = to - 1;
            kept.push(stations[from]);
        }
    }
    kept.push(stations[stations.len() - 1]);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A station whose piece leaves along z.
    fn station(point: Vec3, tangent: Vec3, n: Vec3, [arc_mm, size_mm]: [f64; 2]) -> RunStation {
        RunStation {
            point,
            tangent,
            n,
            s: Vec3::Z,
            theta: 0.0,
            depth: 1.0,
            arc_mm,
            size_mm,
            clearance_mm: 0.12,
            shape: RunShape::Seam,
        }
    }

    #[test]
    fn a_run_narrows_gently_past_an_obstacle_and_breaks_off_where_no_size_has_room() {
        let at = |i: i32| station(f64::from(i) * Vec3::X, Vec3::X, Vec3::Y, [f64::from(i), 4.0]);
        let mut stations: Vec<RunStation> = (0..=30).map(at).collect();
        let mut allowed = vec![true; 31];
        // Sizes up to 2.5 mm pass the obstacle at 10, none the one at 25.
        let has_room = |i: usize, station: &RunStation| match i {
            10 => station.size_mm <= 2.5,
            25 => false,
            _ => true,
        };
        fit_sizes(&mut stations, &mut allowed, &has_room);
        let broken: Vec<usize> = (0..=30).filter(|&i| !allowed[i]).collect();
        assert_eq!(broken, [25]);
        let size = |i: usize| stations[i].size_mm;
        assert!(size(10) <= 2.5 && size(10) >= LEAST_SIZE_MM);
        assert!((0..24).all(|i| (size(i + 1) - size(i)).abs() <= MOST_WIDENING + 1e-12));
        assert_eq!((size(0), size(20), size(30)), (4.0, 4.0, 4.0));
    }

    /// Stops and trimming put stations between those that were chosen.
    #[test]
    fn stations_between_two_that_do_not_cross_advance_on_all_sides() {
        let params = ConnectorParams::default();
        let mut n_accepted = 0;
        for radius_mm in (240..320).map(|i| 0.01 * f64::from(i)) {
            // Clockwise, so that the deep side of the section lies on the inner side of the bend.
            let at = |arc_mm: f64| {
                let (sin, cos) = (-arc_mm / radius_mm).sin_cos();
                let outwards = Vec3::new(cos, sin, 0.0);
                let tangent = Vec3::new(sin, -cos, 0.0);
                station(radius_mm * outwards, tangent, outwards, [arc_mm, 2.5])
            };
            let run = Run {
                male: PatchId(0),
                female: PatchId(1),
                stations: vec![at(0.0), at(0.5)],
            };
            if cross(&params, &run.stations[0], &run.stations[1]) {
                continue;
            }
            n_accepted += 1;
            let corners = |t: f64| {
                let at = run.station_at(t);
                Section::at(&params, &at).bounds().corners(&at)
            };
            let chord = run.stations[1].point - run.stations[0].point;
            for i in 0..10 {
                let [from, to] = [i, i + 1].map(|i| corners(0.1 * f64::from(i)));
                let advances = from.iter().zip(to).all(|(a, b)| (b - *a).dot(chord) > 0.0);
                assert!(advances, "radius {radius_mm} mm, step {i}");
            }
        }
        assert!(n_accepted > 30 && n_accepted < 80, "{n_accepted}");
    }
}
