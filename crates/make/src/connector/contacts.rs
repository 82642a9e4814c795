//! Places where the halves of a run touch each other, a clearance apart.

use shellock_assembly::motion::Contact;
use shellock_geom::Vec3;

use super::ConnectorParams;
use super::profile::Section;
use super::station::{Run, RunShape, RunStation};

/// Contacts of the male half with the female one at all stations of a run and between them: below the tip of
/// the pin, on both of its sides and at ends with a stop, or on three sides of a rail's tongue.
pub(crate) fn contacts(params: &ConnectorParams, run: &Run) -> Vec<Contact> {
    let middle = |a: Vec3, b: Vec3| a.midpoint(b);
    let between = |w: &[RunStation]| RunStation {
        point: middle(w[0].point, w[1].point),
        tangent: middle(w[0].tangent, w[1].tangent).normalize_or_zero(),
        n: middle(w[0].n, w[1].n).normalize_or_zero(),
        ..w[0]
    };
    // Of the length between two stations, half counts for the middle and a quarter for either end.
    let mut parts: Vec<(RunStation, f64)> = run.stations.iter().map(|station| (*station, 0.0)).collect();
    for (i, w) in run.stations.windows(2).enumerate() {
        if w[0].shape == w[1].shape {
            let mm = w[0].point.distance(w[1].point);
            parts[i].1 += 0.25 * mm;
            parts[i + 1].1 += 0.25 * mm;
            parts.push((between(w), 0.5 * mm));
        }
    }
    parts
        .iter()
        .flat_map(|(station, length_mm)| at_station(params, run, station, *length_mm))
        .chain(at_stops(params, run))
        .collect()
}

/// Contacts of the ends of the pin with the stops of its channel.
fn at_stops(params: &ConnectorParams, run: &Run) -> Vec<Contact> {
    use RunShape::{Seam, Stop};
    let at_end = |w: &[RunStation]| {
        let (end, outwards) = match [w[0].shape, w[1].shape, w[2].shape] {
            [Stop, Stop, Seam] => (w[2], -w[2].tangent),
            [Seam, Stop, Stop] => (w[0], w[0].tangent),
            _ => return Vec::new(),
        };
        let Some(pin) = Section::at(params, &end).male[0] else {
            return Vec::new();
        };
        let face = end.n.cross(end.s).normalize_or_zero();
        let contact = |s: f64| Contact {
            a: run.male,
            b: run.female,
            point: end.place(0.5 * (pin.n0 + pin.n1), s),
            normal: face * face.dot(outwards).signum(),
            gap_mm: end.clearance_mm,
            area_mm2: 0.5 * (pin.n1 - pin.n0) * -pin.s0,
        };
        vec![contact(pin.s0), contact(0.1 * pin.s0)]
    };
    run.stations.windows(3).flat_map(at_end).collect()
}

/// Contacts at a station that stands for `length_mm` of the run.
fn at_station(params: &ConnectorParams, run: &Run, station: &RunStation, length_mm: f64) -> Vec<Contact> {
    let Some(pin) = Section::at(params, station).male[0] else {
        return Vec::new();
    };
    let middle = |from: f64, to: f64| 0.5 * (from + to);
    let up = station
        .s
        .reject_from_normalized(station.tangent)
        .normalize_or_zero();
    // Coordinates along n and ŝ, the direction that the face looks, and its width in the section.
    let faces = match station.shape {
        RunShape::Seam | RunShape::Stop => {
            let half = -0.5 * pin.s0;
            vec![
                ([middle(pin.n0, pin.n1), pin.s0], -up, pin.n1 - pin.n0),
                ([pin.n0, pin.s0], -station.n, half),
                ([pin.n0, 0.1 * pin.s0], -station.n, half),
                ([pin.n1, pin.s0], station.n, half),
                ([pin.n1, 0.1 * pin.s0], station.n, half),
            ]
        }
        RunShape::Rail(_) => vec![
            ([pin.n1, middle(pin.s0, pin.s1)], station.n, pin.s1 - pin.s0),
            ([0.5 * pin.n1, pin.s1], up, pin.n1),
            ([0.5 * pin.n1, pin.s0], -up, pin.n1),
        ],
    };
    let contact = |([n, s], normal, width_mm): ([f64; 2], Vec3, f64)| Contact {
        a: run.male,
        b: run.female,
        point: station.place(n, s),
        normal,
        gap_mm: station.clearance_mm,
        area_mm2: width_mm * length_mm,
    };
    faces.into_iter().map(contact).collect()
}

#[cfg(test)]
mod tests {
    use shellock_mechanics::connector::PIN_DEPTH;
    use shellock_report::PatchId;

    use super::*;

    #[test]
    fn the_pin_of_a_run_leaves_along_one_direction_only() {
        let at = |arc_mm: f64| RunStation {
            point: arc_mm * Vec3::X,
            tangent: Vec3::X,
            n: Vec3::Y,
            s: Vec3::Z,
            theta: 0.0,
            depth: 1.0,
            arc_mm,
            size_mm: 3.0,
            clearance_mm: 0.12,
            shape: RunShape::Seam,
        };
        let run = Run {
            male: PatchId(1),
            female: PatchId(0),
            stations: vec![at(0.0), at(6.0)],
        };
        let found = contacts(&ConnectorParams::default(), &run);
        assert!(
            found
                .iter()
                .all(|c| (c.a, c.b, c.gap_mm) == (PatchId(1), PatchId(0), 0.12))
        );
        let blocks = |way: Vec3| found.iter().any(|c| c.normal.dot(way) > 0.9);
        assert!(!blocks(Vec3::Z));
        assert!(blocks(-Vec3::Z) && blocks(Vec3::Y) && blocks(-Vec3::Y));
        // Both ends and the middle of the run. The sides are as long as the run and as deep as the pin.
        for x in [0.0, 3.0, 6.0] {
            assert_eq!(found.iter().filter(|c| c.point.x == x).count(), 5);
        }
        let area_mm2: f64 = found
            .iter()
            .filter(|c| c.normal.y > 0.9)
            .map(|c| c.area_mm2)
            .sum();
        assert!((area_mm2 - 6.0 * PIN_DEPTH * 3.0).abs() < 1e-9, "{area_mm2}");
    }
}
