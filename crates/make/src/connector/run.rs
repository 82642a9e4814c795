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
use super::free::has_room;
use super::rail::rails;
use super::station::{Run, RunShape, RunStation};

/// Limits of a run's cell: deviation from the curve, mm, turn, rad, and length, mm.
const CELL_SAG_MM: f64 = 0.03;
const CELL_TURN: f64 = 0.12;
const CELL_LENGTH_MM: f64 = 6.0;

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
pub fn runs(
    params: &ConnectorParams,
    sizes: &ConnectorSizes,
    plan: &LatticePlan,
    curves: &[Curve],
    slide: Option<Vec3>,
    is_free: &dyn Fn(PatchId, Vec3) -> Option<bool>,
) -> (Vec<Run>, Vec<SeamRoom>) {
    let (mut runs, mut contacts) = (Vec::new(), Vec::new());
    for curve in curves {
        let separation = plan.separation(curve.later).unit();
        let later_is_male = roles(curve, separation);
        let size_mm = sizes.of(curve.later, curve.earlier);
        let clearance_mm = params.clearance_of(slide.is_some() && curve.later == plan.key());
        let at = |i: usize| RunStation {
            clearance_mm,
            ..station(curve, i, separation, later_is_male[i], size_mm)
        };
        let stations: Vec<RunStation> = (0..curve.points.len()).map(at).collect();
        let mut allowed = connector_mask(size_mm, curve, &stations, &later_is_male);
        let step = |i: usize| stations[i].point.distance(stations[i + 1].point);
        contacts.push(SeamRoom {
            later: curve.later,
            earlier: curve.earlier,
            length_mm: (0..stations.len() - 1).map(step).sum(),
            usable_mm: (0..stations.len() - 1)
                .filter(|&i| allowed[i] && allowed[i + 1])
                .map(step)
                .sum(),
            at: curve.points[curve.points.len() / 2],
        });
        if let Some(slide) = slide.filter(|_| curve.later == plan.key()) {
            let (rails, usable_mm) = rails(params, curves, curve, slide, size_mm, is_free);
            runs.extend(rails);
            contacts
                .iter_mut()
                .last()
                .into_iter()
                .for_each(|c| c.usable_mm += usable_mm);
        }
        for i in 0..stations.len() {
            let (male, female) = sides(curve, later_is_male[i]);
            allowed[i] = allowed[i] && has_room(params, &stations[i], male, female, is_free);
        }
        for (from, to) in stretches(&allowed, &later_is_male) {
            let run = thin_out(&stations[from..=to]);
            let (male, female) = sides(curve, later_is_male[from]);
            if stations[to].arc_mm - stations[from].arc_mm >= SHORTEST_RUN_SIZES * size_mm {
                runs.push(Run {
                    male,
                    female,
                    stations: run,
                });
            }
        }
    }
    (runs, contacts)
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

/// Selects as few stations as possible whose cells keep the limits of sag, turn and length.
fn thin_out(stations: &[RunStation]) -> Vec<RunStation> {
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
        if sags || turns || b.arc_mm - a.arc_mm > CELL_LENGTH_MM {
            from = to - 1;
            kept.push(stations[from]);
        }
    }
    kept.push(stations[stations.len() - 1]);
    kept
}
