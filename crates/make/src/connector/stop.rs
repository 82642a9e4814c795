//! Stops: walls that close the ends of a channel, so that its pin cannot slide along the seam.
//!
//! The pin ends before them by the clearance. All faces contain ŝ, so the pin still leaves along it.
//!
//! ```text
//!   ▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒
//!   ▒▒▒▒┌──────────────────┐▒▒▒▒     channel, seen along ŝ
//!   ▒▒▒▒│       pin        │▒▒▒▒
//!   ▒▒▒▒└──────────────────┘▒▒▒▒
//!   ▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒
//!   stop                     stop
//! ```

use shellock_mechanics::connector::{MOST_LEAN_OF_STOPS, STOP_MM, n_stops};

use super::station::{Run, RunShape, RunStation};

/// Least distance between stations that are kept, mm: sections closer together would make slivers.
const LEAST_STEP_MM: f64 = 0.1;
/// Share of its thickness that a stop must have.
const LEAST_SHARE: f64 = 0.9;

/// Returns the run with stops at its two ends, as far as it is long enough. Former stops are removed. Rails
/// and closed runs stay as they are.
pub(crate) fn with_stops(run: &Run) -> Run {
    let has_ends = |at: &RunStation| matches!(at.shape, RunShape::Seam | RunShape::Stop);
    if run.is_loop() || !run.stations.iter().all(has_ends) {
        return run.clone();
    }
    let distances = Distances::of(run);
    let stops_mm = stop_lengths(run, distances.length_mm());
    let station = |(mm, shape): (f64, RunShape)| RunStation {
        shape,
        ..run.station_at(distances.place(mm))
    };
    Run {
        stations: sections(run, &distances, stops_mm)
            .into_iter()
            .map(station)
            .collect(),
        ..run.clone()
    }
}

/// Lengths of the first and the last stop along the seam, mm; 0 for an end without one.
fn stop_lengths(run: &Run, length_mm: f64) -> [f64; 2] {
    let size_mm = run.stations.iter().map(|at| at.size_mm).fold(0.0, f64::max);
    let mut n_left = n_stops(length_mm, size_mm, run.clearance_mm());
    [0, run.stations.len() - 1].map(|end| {
        let end = &run.stations[end];
        let lean = end.s.dot(end.tangent).abs();
        if n_left == 0 || lean > MOST_LEAN_OF_STOPS {
            return 0.0;
        }
        n_left -= 1;
        STOP_MM / (1.0 - lean * lean).sqrt()
    })
}

/// Sections of a run with stops: distances from its first end, in order, with their shapes. Stations that
/// fall into the gaps at the pin's ends, or close to another section, are left out.
fn sections(run: &Run, distances: &Distances, [front_mm, back_mm]: [f64; 2]) -> Vec<(f64, RunShape)> {
    let length_mm = distances.length_mm();
    let with_gap = |stop_mm: f64| stop_mm * (1.0 + run.clearance_mm() / STOP_MM);
    let pin_mm = [with_gap(front_mm), length_mm - with_gap(back_mm)];
    let mut ends = pin_mm.map(|mm| (mm, RunShape::Seam)).to_vec();
    if front_mm > 0.0 {
        ends.extend([0.0, front_mm].map(|mm| (mm, RunShape::Stop)));
    }
    if back_mm > 0.0 {
        ends.extend([length_mm - back_mm, length_mm].map(|mm| (mm, RunShape::Stop)));
    }
    let is_apart = |mm: f64| ends.iter().all(|end| (end.0 - mm).abs() > LEAST_STEP_MM);
    let shape = |mm: f64| match () {
        () if mm > pin_mm[0] && mm < pin_mm[1] => Some(RunShape::Seam),
        () if mm < front_mm || mm > length_mm - back_mm => Some(RunShape::Stop),
        () => None,
    };
    let inner = distances.mm.iter().filter(|mm| is_apart(**mm));
    let inner: Vec<_> = inner.filter_map(|&mm| Some((mm, shape(mm)?))).collect();
    let mut sections = [ends, inner].concat();
    sections.sort_by(|a, b| a.0.total_cmp(&b.0));
    sections
}

/// Returns the run without stops that are too thin; the channel then ends where the pin does.
pub(crate) fn without_thin_stops(mut run: Run) -> Run {
    let is_stop = |at: &RunStation| at.shape == RunShape::Stop;
    for _ in 0..2 {
        run.stations.reverse();
        let n = run.stations.iter().take_while(|at| is_stop(at)).count();
        let thickness_mm = match n {
            0 => continue,
            n => run.stations[0].point.distance(run.stations[n - 1].point),
        };
        if thickness_mm < LEAST_SHARE * STOP_MM {
            run.stations.drain(..n);
        }
    }
    run
}

/// Distances along a run.
struct Distances {
    /// Distance of each station from the first, mm.
    mm: Vec<f64>,
}

impl Distances {
    fn of(run: &Run) -> Self {
        let steps = run.stations.windows(2).map(|w| w[0].point.distance(w[1].point));
        let sum = |sum: &mut f64, mm: f64| {
            *sum += mm;
            Some(*sum)
        };
        Self {
            mm: std::iter::once(0.0).chain(steps.scan(0.0, sum)).collect(),
        }
    }

    fn length_mm(&self) -> f64 {
        self.mm[self.mm.len() - 1]
    }

    /// Place at a distance, in stations from the first.
    fn place(&self, mm: f64) -> f64 {
        let i = self
            .mm
            .partition_point(|at| *at <= mm)
            .clamp(1, self.mm.len() - 1)
            - 1;
        let step_mm = self.mm[i + 1] - self.mm[i];
        i as f64 + ((mm - self.mm[i]) / step_mm).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use shellock_geom::{Vec3, Volume};
    use shellock_report::PatchId;

    use super::*;
    use crate::connector::{ConnectorParams, contacts};
    use crate::piece::whole_halves;

    const CLEARANCE_MM: f64 = 0.12;

    /// A straight run along x of connectors of 3 mm; ŝ leans along it by the angle whose sine is `lean`.
    fn run(length_mm: f64, lean: f64) -> Run {
        let at = |x: f64| RunStation {
            point: x * Vec3::X,
            tangent: Vec3::X,
            n: Vec3::Y,
            s: Vec3::new(lean, 0.0, (1.0 - lean * lean).sqrt()),
            theta: 0.0,
            depth: (1.0 - lean * lean).sqrt(),
            arc_mm: x,
            size_mm: 3.0,
            clearance_mm: CLEARANCE_MM,
            shape: RunShape::Seam,
        };
        Run {
            male: PatchId(1),
            female: PatchId(0),
            stations: [0.0, 0.3, 0.6, 1.0].map(|share| at(share * length_mm)).to_vec(),
        }
    }

    fn overlap_mm3(pin: &Volume, channel: &Volume, moved: Vec3) -> f64 {
        pin.translate(moved).intersect(channel).volume()
    }

    #[test]
    fn a_pin_between_stops_keeps_the_clearance_slides_nowhere_along_the_seam_and_leaves_freely() {
        let params = ConnectorParams::default();
        for lean in [0.0, 0.3, -0.6] {
            let closed = with_stops(&run(14.0, lean));
            let [pin, channel] = whole_halves(&params, &closed);
            assert_eq!((pin.components().len(), channel.components().len()), (1, 1));
            for (end, along) in [(0, -Vec3::X), (1, Vec3::X)] {
                let reach_mm = CLEARANCE_MM / (1.0 - lean * lean).sqrt();
                assert!(
                    overlap_mm3(&pin, &channel, 0.9 * reach_mm * along) < 1e-9,
                    "end {end}, lean {lean}"
                );
                let beyond_mm3 = overlap_mm3(&pin, &channel, (reach_mm + 0.1) * along);
                assert!(beyond_mm3 > 0.1, "end {end}, lean {lean}: {beyond_mm3} mm³");
            }
            for travel_mm in [0.5, 1.0, 4.0, 9.0] {
                let moved = travel_mm * closed.stations[0].s;
                assert!(
                    overlap_mm3(&pin, &channel, moved) < 1e-9,
                    "{travel_mm} mm out, lean {lean}"
                );
            }
        }
    }

    #[test]
    fn contacts_at_stops_look_along_the_seam_and_across_the_way_out() {
        for lean in [0.0, 0.5] {
            let closed = with_stops(&run(14.0, lean));
            let found = contacts(&ConnectorParams::default(), &closed);
            for along in [Vec3::X, -Vec3::X] {
                let blocking = found.iter().filter(|c| c.normal.dot(along) > 0.8);
                assert_eq!(blocking.clone().count(), 2, "lean {lean}");
                assert!(
                    blocking
                        .into_iter()
                        .all(|c| c.normal.dot(closed.stations[0].s).abs() < 1e-12)
                );
            }
        }
    }

    #[test]
    fn stops_come_as_far_as_the_pin_stays_long_enough_and_sections_stand_upright() {
        let n_stops = |run: &Run| {
            let closed = with_stops(run);
            let stations = &closed.stations;
            [0, stations.len() - 1]
                .into_iter()
                .filter(|&i| stations[i].shape == RunShape::Stop)
                .count()
        };
        let least_mm = 3.0 + 2.0 * (STOP_MM + CLEARANCE_MM);
        assert_eq!(n_stops(&run(least_mm + 0.01, 0.0)), 2);
        assert_eq!(n_stops(&run(least_mm - 0.01, 0.0)), 1);
        assert_eq!(n_stops(&run(4.0, 0.0)), 0);
        assert_eq!(n_stops(&run(14.0, 0.8)), 0);
    }

    #[test]
    fn a_shortened_run_gets_stops_at_its_new_ends_and_keeps_none_within() {
        let closed = with_stops(&run(14.0, 0.0));
        for from in 0..4 {
            let mut cut = closed.clone();
            cut.stations.drain(..from);
            let anew = with_stops(&cut);
            let parts: Vec<&[RunStation]> = anew.stations.chunk_by(|a, b| a.shape == b.shape).collect();
            let shapes: Vec<RunShape> = parts.iter().map(|part| part[0].shape).collect();
            assert_eq!(shapes, [RunShape::Stop, RunShape::Seam, RunShape::Stop], "{from}");
            let thickness_mm = |part: &[RunStation]| part[0].point.distance(part[part.len() - 1].point);
            for stop in [parts[0], parts[2]] {
                assert!((thickness_mm(stop) - STOP_MM).abs() < 1e-9, "{from}");
            }
            assert_eq!(anew.stations[0].point, cut.stations[0].point);
        }
    }

    #[test]
    fn a_stop_that_carving_thins_is_given_up() {
        let closed = with_stops(&run(14.0, 0.0));
        let cut = |mm: f64| {
            let mut run = closed.clone();
            run.stations[0].point.x += mm;
            without_thin_stops(run)
        };
        assert_eq!(cut(0.05).stations.len(), closed.stations.len());
        assert_eq!(cut(0.3).stations[0], closed.stations[2]);
        assert_eq!(cut(0.3).stations.last(), closed.stations.last());
    }
}
