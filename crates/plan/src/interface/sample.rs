//! Samples of the inner edge of a seam's wall, in steps of about a millimetre, and the runs of connectors
//! there for one order and direction.
//!
//! The edge is estimated from the outer surface. Points of the seam move inwards by the wall thickness, and
//! further until no other wall is nearer (below a sharp edge of the model). Lines, frames and rules are those
//! of the connector stage.

use shellock_assembly::LatticeDirection;
use shellock_geom::Vec3;
use shellock_mechanics::connector::{MOST_LEAN_OF_STOPS, n_stops};
use shellock_report::PatchId;
use shellock_surface::Seam;
use shellock_surface::seam::rules::{SHARPEST_TURN, SHORTEST_RAIL_SIZES, SHORTEST_RUN_SIZES, end_gap_mm};
use shellock_surface::seam::{FramedLine, later_is_male};

use super::SeamFrame;
use super::obstruction::{Blocked, Obstructions, Sights};
use crate::PlanParams;

/// Distance between the points of a seam that are moved inwards, mm: below the size of any connector.
const STEP_MM: f64 = 1.0;
/// Greatest distance between neighbouring points of one inner edge, in steps. Beyond it the edge is
/// interrupted.
const FARTHEST_STEPS: f64 = 2.5;

/// One place on the inner edge of the wall, in the frame of connectors.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    /// Point on the inner edge.
    pub point: Vec3,
    pub tangent: Vec3,
    pub normal: Vec3,
    /// Unit vector perpendicular to both, from the piece with the lower id to the other.
    pub across: Vec3,
    /// Length of edge that the sample stands for, mm.
    pub length_mm: f64,
    /// Distance to the next sample, mm; 0 at the end of an open line.
    next_mm: f64,
    /// True if the place is far enough from the ends of an open line.
    pub has_room: bool,
    pub obstruction: Blocked,
    /// Pieces in the way of a connector; `None` where there is no room for one.
    pub sights: Option<Sights>,
}

impl Sample {
    /// Frame of the seam. The piece with the lower id is the later one if `side` is 1, else the other.
    pub fn frame(&self, side: f64) -> SeamFrame {
        SeamFrame {
            tangent: self.tangent,
            normal: self.normal,
            across: side * self.across,
        }
    }
}

/// Order of a pair of pieces, and separation direction of the later one.
#[derive(Clone, Copy)]
pub(super) struct Way {
    /// Order of the pair: 1 if the piece with the lower id is later, else −1.
    pub side: f64,
    pub s: LatticeDirection,
    /// True if the later piece is the key and slides on rails.
    is_on_rails: bool,
}

impl Way {
    pub fn new(params: &PlanParams, pair: [PatchId; 2], side: f64, s: LatticeDirection) -> Self {
        let later = pair[usize::from(side < 0.0)];
        Self {
            side,
            s,
            is_on_rails: params.slides_on_rails(later, s),
        }
    }

    /// Returns true if a rail is possible at `x`. Obstructions were checked when the key was cut.
    pub fn has_rail(&self, x: &Sample) -> bool {
        self.is_on_rails && x.has_room && x.frame(self.side).carries_rail(self.s.unit())
    }

    /// Returns true if angles, ends and other walls allow a pin at `x`.
    fn has_pin(&self, x: &Sample) -> bool {
        let is_blocked = || x.obstruction.has(usize::from(self.side < 0.0), self.s);
        x.has_room && !is_blocked() && x.frame(self.side).carries(self.s.unit())
    }

    /// Weight of Eq. 4 at `x`; β on a rail, which is as good as a connector can be.
    pub fn weight(&self, x: &Sample, beta: f64) -> f64 {
        if self.has_rail(x) {
            beta
        } else {
            x.frame(self.side).weight(self.s.unit(), beta)
        }
    }

    /// Direction that the sides of a pin face, perpendicular to the seam and to the separation direction.
    fn side_normal(&self, x: &Sample) -> Vec3 {
        x.tangent.cross(self.s.unit()).normalize_or_zero()
    }
}

/// Kind of connector at one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Rail,
    Pin { later_is_male: bool },
}

impl Kind {
    /// Shortest run of this kind that is made, in connector sizes.
    fn shortest_sizes(self) -> f64 {
        match self {
            Self::Rail => SHORTEST_RAIL_SIZES,
            Self::Pin { .. } => SHORTEST_RUN_SIZES,
        }
    }
}

/// One run of connectors under a line, as long as angles allow.
pub(super) struct Run {
    pub kind: Kind,
    /// Indices of its samples, in order along the line.
    pub samples: Vec<usize>,
    /// Length of edge that its samples stand for, mm.
    pub length_mm: f64,
    /// Distance from the first sample to the last, mm: the length that can be swept.
    swept_mm: f64,
}

impl Run {
    /// Returns true if the connector stage makes the run with connectors of `size_mm`.
    pub fn is_made(&self, size_mm: f64) -> bool {
        self.swept_mm >= self.kind.shortest_sizes() * size_mm
    }
}

/// One connected inner edge below a seam.
#[derive(Clone, Debug)]
pub(super) struct Line {
    pub samples: Vec<Sample>,
    pub is_loop: bool,
}

impl Line {
    /// Runs of connectors for one order and direction, however short. On a loop, a run may continue from the
    /// last sample to the first.
    pub fn runs(&self, way: Way) -> Vec<Run> {
        self.runs_where(way, &|_| true)
    }

    /// Runs of connectors at samples that are clear, however short, as [`runs`](Self::runs) gives them.
    pub fn runs_where(&self, way: Way, is_clear: &dyn Fn(&Sample) -> bool) -> Vec<Run> {
        let kinds = self.kinds(way, is_clear);
        let n = kinds.len();
        let before = |i: usize| if i == 0 { n - 1 } else { i - 1 };
        // A loop is walked from the start of a run, so that the first sample cuts none.
        let start = (0..n).find(|&i| kinds[i].is_some() && kinds[before(i)] != kinds[i]);
        let first = start.filter(|_| self.is_loop).unwrap_or(0);
        let mut runs: Vec<Run> = Vec::new();
        let mut last = None;
        for i in (first..n).chain(0..first) {
            let Some(kind) = kinds[i] else {
                last = None;
                continue;
            };
            match runs.last_mut().filter(|_| last == Some(kind)) {
                Some(run) => {
                    run.swept_mm += self.samples[before(i)].next_mm;
                    run.length_mm += self.samples[i].length_mm;
                    run.samples.push(i);
                }
                None => runs.push(Run {
                    kind,
                    samples: vec![i],
                    length_mm: self.samples[i].length_mm,
                    swept_mm: 0.0,
                }),
            }
            last = Some(kind);
        }
        runs
    }

    /// Stops of a run of pins with connectors of `size_mm`: the sample at which the pin ends, and the unit
    /// vector out of the run that its end faces. A run all round a loop has none.
    pub fn stops(&self, run: &Run, way: Way, size_mm: f64, clearance_mm: f64) -> Vec<(usize, Vec3)> {
        let is_round = self.is_loop && run.samples.len() == self.samples.len();
        if run.kind == Kind::Rail || is_round {
            return Vec::new();
        }
        let last = run.samples.len() - 1;
        let stop = |(i, outwards): (usize, f64)| {
            let tangent = outwards * self.samples[i].tangent;
            let along = way.s.unit().dot(tangent);
            let face = tangent - along * way.s.unit();
            (along.abs() <= MOST_LEAN_OF_STOPS).then(|| (i, face.normalize_or_zero()))
        };
        [(run.samples[0], -1.0), (run.samples[last], 1.0)]
            .into_iter()
            .filter_map(stop)
            .take(n_stops(run.swept_mm, size_mm, clearance_mm))
            .collect()
    }

    /// Returns the kind of connector possible at each sample. None is possible beside a change of the male
    /// piece or a sharp turn, because no profile can be swept over them.
    fn kinds(&self, way: Way, is_clear: &dyn Fn(&Sample) -> bool) -> Vec<Option<Kind>> {
        let n = self.samples.len();
        let normals: Vec<Vec3> = self.samples.iter().map(|x| x.normal).collect();
        let later_is_male = later_is_male(&normals, way.s.unit(), self.is_loop);
        let facing: Vec<Vec3> = self.samples.iter().map(|x| way.side_normal(x)).collect();
        let fits = |i: usize, j: usize| {
            later_is_male[i] == later_is_male[j] && facing[i].dot(facing[j]) >= SHARPEST_TURN.cos()
        };
        // Nothing turns beyond the ends of an open line.
        let is_end = |i: usize| !self.is_loop && i == 0;
        let goes_on = |i: usize| is_end(i % n) || fits((i + n - 1) % n, i % n);
        let kind = |i: usize| {
            let x = &self.samples[i];
            if way.has_rail(x) {
                return Some(Kind::Rail);
            }
            (goes_on(i) && goes_on(i + 1) && way.has_pin(x) && is_clear(x)).then(|| Kind::Pin {
                later_is_male: later_is_male[i],
            })
        };
        (0..n).map(kind).collect()
    }
}

/// Estimates the inner edges of the wall below a seam. There are none if the model has no cavity there, and
/// several if it has one in parts.
pub(super) fn lines(
    params: &PlanParams,
    size_mm: f64,
    seam: &Seam,
    obstructions: Option<&Obstructions<'_>>,
) -> Vec<Line> {
    let n = (seam.length() / STEP_MM).ceil().max(1.0) as usize;
    let step_mm = seam.length() / n as f64;
    let normals: Vec<Vec3> = seam.resample(n).into_iter().map(|s| s.1).collect();
    let points: Vec<Option<Vec3>> = seam
        .below(params.wall_mm, n)
        .into_iter()
        .map(|p| obstructions.map_or(Some(p), |o| o.at_depth(p)))
        .collect();
    edges(&points, seam.is_loop(), FARTHEST_STEPS * step_mm)
        .into_iter()
        .filter_map(|(at, is_loop)| {
            let polyline: Vec<Vec3> = at.iter().filter_map(|&i| points[i]).collect();
            let outward = |i: f64, _| {
                let (a, b) = (at[i.floor() as usize], at[i.ceil() as usize]);
                normals[a]
                    .normalize_or_zero()
                    .lerp(normals[b].normalize_or_zero(), i.fract())
            };
            let framed = FramedLine::along(&polyline, is_loop, outward)?;
            Some(line(
                params,
                size_mm,
                [seam.a, seam.b],
                &framed,
                is_loop,
                obstructions,
            ))
        })
        .collect()
}

/// Connected rows of points, as indices, each with true if it is a loop. The first point of a loop is
/// repeated at its end. Neighbours in a row are at most `farthest_mm` apart.
fn edges(points: &[Option<Vec3>], is_loop: bool, farthest_mm: f64) -> Vec<(Vec<usize>, bool)> {
    let n = points.len();
    let is_joined = |i: usize, j: usize| match (points[i], points[j]) {
        (Some(a), Some(b)) => a.distance(b) <= farthest_mm,
        _ => false,
    };
    let gap = (1..n).find(|&i| !is_joined(i - 1, i));
    if is_loop && gap.is_none() {
        return vec![((0..n).collect(), true)];
    }
    // The last point of a loop repeats its first. The loop is walked from a gap on, with that point once.
    let order = match gap.filter(|_| is_loop) {
        Some(gap) => (gap..n - 1).chain(0..gap).collect::<Vec<usize>>(),
        None => (0..n).collect(),
    };
    order
        .chunk_by(|&i, &j| is_joined(i, j))
        .filter(|row| points[row[0]].is_some())
        .map(|row| (row.to_vec(), false))
        .collect()
}

/// Samples one framed line between `pair`.
fn line(
    params: &PlanParams,
    size_mm: f64,
    pair: [PatchId; 2],
    framed: &FramedLine,
    is_loop: bool,
    obstructions: Option<&Obstructions<'_>>,
) -> Line {
    let arcs_mm = framed.arcs_mm();
    let n = arcs_mm.len() - usize::from(is_loop);
    let total_mm = arcs_mm[arcs_mm.len() - 1];
    let end_mm = if is_loop {
        0.0
    } else {
        end_gap_mm(size_mm, total_mm)
    };
    let step = |i: usize| arcs_mm.get(i + 1).map_or(0.0, |next| next - arcs_mm[i]);
    let sample = |i: usize| {
        let (tangent, normal) = (framed.tangents[i], framed.normals[i]);
        // N × u points to the left as seen from outside, which is the side of patch a.
        let across = -normal.cross(tangent);
        let has_room = arcs_mm[i] >= end_mm && arcs_mm[i] <= total_mm - end_mm;
        let outside = framed.points[i] + params.wall_mm * normal;
        let sights = obstructions
            .filter(|_| has_room)
            .map(|o| o.sights(size_mm, outside, normal, across));
        let before = match i {
            0 if is_loop => step(n - 1),
            0 => 0.0,
            i => step(i - 1),
        };
        Sample {
            point: framed.points[i],
            tangent,
            normal,
            across,
            length_mm: 0.5 * (before + step(i)),
            next_mm: step(i),
            has_room,
            obstruction: sights.as_ref().map(|s| s.blocked(pair)).unwrap_or_default(),
            sights,
        }
    };
    Line {
        samples: (0..n).map(sample).collect(),
        is_loop,
    }
}

#[cfg(test)]
mod tests {
    use shellock_test_surfaces::{label, level_seam};
    use shellock_testkit::shapes::brick;

    use super::*;

    const SIZE_MM: f64 = 2.5;

    /// Runs that are made on the inner edges below a level seam through `points`, if one piece leaves
    /// upwards.
    fn made_along(points: Vec<Vec3>) -> Vec<Run> {
        let seam = level_seam(points);
        let params = PlanParams::default();
        let up = Way::new(&params, [seam.a, seam.b], 1.0, LatticeDirection::nearest(Vec3::Z));
        let lines = lines(&params, SIZE_MM, &seam, None);
        let runs = lines.iter().flat_map(|l| l.runs(up));
        runs.filter(|run| run.is_made(SIZE_MM)).collect()
    }

    #[test]
    fn a_seam_with_no_room_for_the_shortest_run_carries_none() {
        // Two ends of 2.25 mm and 3 mm of connector are 7.5 mm.
        assert_eq!(made_along(vec![Vec3::ZERO, 7.0 * Vec3::X]).len(), 0);
        assert_eq!(made_along(vec![Vec3::ZERO, 9.0 * Vec3::X]).len(), 1);
    }

    #[test]
    fn a_sharp_turn_parts_runs_and_what_is_short_beyond_it_is_not_made() {
        let hook = |leg_mm: f64| {
            let tip = Vec3::new(40.0 - 0.9 * leg_mm, 0.44 * leg_mm, 0.0);
            made_along(vec![Vec3::ZERO, 40.0 * Vec3::X, tip])
        };
        let lengths = |leg_mm: f64| hook(leg_mm).iter().map(|r| r.length_mm).collect::<Vec<f64>>();
        assert_eq!(lengths(7.0).len(), 1, "{:?}", lengths(7.0));
        assert_eq!(lengths(20.0).len(), 2, "{:?}", lengths(20.0));
        assert!((hook(7.0)[0].length_mm - hook(20.0)[0].length_mm).abs() < 0.5);
    }

    #[test]
    fn a_loop_is_one_run_wherever_it_starts() {
        let circle = |start: f64| -> Vec<Vec3> {
            let at = |i: u32| (f64::from(i % 60) / 60.0 + start) * std::f64::consts::TAU;
            (0..=60)
                .map(|i| 20.0 * Vec3::new(at(i).cos(), at(i).sin(), 0.0))
                .collect()
        };
        for start in [0.0, 0.3] {
            let runs = made_along(circle(start));
            assert_eq!(runs.len(), 1);
            assert!((runs[0].length_mm / (std::f64::consts::TAU * 20.0) - 1.0).abs() < 0.02);
        }
    }

    #[test]
    fn below_an_edge_of_the_model_the_inner_edge_is_the_corner_of_the_walls() {
        let block = label(brick([0.0, 40.0], [0.0, 40.0], [0.0, 40.0]).to_mesh(), 1, |_| 0);
        let params = PlanParams {
            wall_mm: 2.0,
            ..PlanParams::default()
        };
        let walls = Obstructions::new(params.wall_mm, &block.mesh, &block.patch_of_face).unwrap();
        let depth = params.wall_mm;
        let corner = Vec3::new(20.0, depth, depth);
        // Below the side, nearer to the floor; and below the edge itself.
        for start in [
            Vec3::new(20.0, depth, 0.4 * depth),
            Vec3::new(20.0, 0.7 * depth, 0.7 * depth),
        ] {
            assert!(walls.at_depth(start).unwrap().distance(corner) < 0.1 * depth);
        }
        let inside = Vec3::new(20.0, 3.0 * depth, 2.0 * depth);
        assert_eq!(walls.at_depth(inside), Some(inside));
        // A plate has no inside.
        let plate = label(
            brick([0.0, 40.0], [0.0, 40.0], [0.0, 1.6 * depth]).to_mesh(),
            1,
            |_| 0,
        );
        let walls = Obstructions::new(params.wall_mm, &plate.mesh, &plate.patch_of_face).unwrap();
        assert_eq!(walls.at_depth(Vec3::new(20.0, 20.0, 0.6 * depth)), None);
    }

    #[test]
    fn where_the_walls_leave_no_room_the_edge_is_parted() {
        let at = |x: f64| Some(x * Vec3::X);
        let row = [at(0.0), at(1.0), None, at(3.0), at(4.0), at(9.0)];
        let rows = |is_loop| edges(&row, is_loop, 2.5);
        assert_eq!(
            rows(false),
            [(vec![0, 1], false), (vec![3, 4], false), (vec![5], false)]
        );
        // A loop without a gap stays a loop; with a gap, it is walked from there on.
        let ring = [at(0.0), at(1.0), at(0.5), at(0.0)];
        assert_eq!(edges(&ring, true, 2.5), [(vec![0, 1, 2, 3], true)]);
        let parted = [at(0.0), at(1.0), None, at(0.5), at(0.0)];
        assert_eq!(edges(&parted, true, 2.5), [(vec![3, 0, 1], false)]);
    }
}
