//! Shortening of runs to the stretches on which carving leaves their whole section.

use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{TriMesh, Vec3, Volume};
use shellock_surface::seam::rules::SHORTEST_RUN_SIZES;

use crate::connector::{ConnectorParams, ProfileRect, Run, RunStation, Section, WHOLE, without_thin_stops};

/// Distance between the sections that are looked at, mm.
const STEP_MM: f64 = 0.5;
/// Least share of each part of a section that is left where a run counts at all.
const MOST: f64 = 0.5;
/// Least width to which a half should be rooted in its wall, mm, unless the whole half is narrower there. A
/// tenth less ([`WHOLE`]) is the neck that the verification accepts.
const LEAST_ROOT_MM: f64 = 0.95;
/// Spacing of the points that are asked for a root, and their greatest distance from its middle, mm.
const ROOT_STEP_MM: f64 = 0.2;
const ROOT_BAND_MM: f64 = 0.1;
/// Depth of that middle within the wall, mm.
const ROOT_DEPTH_MM: f64 = 0.2;
/// Number of sections on either side over which the width of a root is averaged, since a gap of 1 mm breaks
/// nothing.
const ROOT_REACH: usize = 2;
/// Direction of the rays that tell inside from outside, along no edge of a connector.
const RAY: Vec3 = Vec3::new(0.482, 0.659, 0.577);

/// A section of one half of a run, after carving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Left {
    /// Place of the section, in stations from the first.
    pub at: f64,
    /// Least share of any of its parts that is left.
    pub share: f64,
    /// Point of the seam at the section.
    pub point: Vec3,
    /// Root in the wall, if it has one.
    pub root: Option<Root>,
}

/// Root of a half in its wall at one section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Root {
    /// Width that carving left, mm.
    pub width_mm: f64,
    /// Width that the whole half would have, mm.
    pub whole_mm: f64,
    /// Middle of the root.
    pub at: Vec3,
}

impl Root {
    /// A root that is wide enough, where a half has no section.
    fn none_needed(at: Vec3) -> Self {
        Self {
            width_mm: LEAST_ROOT_MM,
            whole_mm: LEAST_ROOT_MM,
            at,
        }
    }
}

/// The wall that a half hangs from.
pub(super) struct Wall<'a> {
    /// The body of the half's piece.
    pub body: Body,
    pub thickness_mm: f64,
    /// Depth below the outer surface, mm; `None` far from the wall.
    pub depth_mm: &'a (dyn Fn(Vec3) -> Option<f64> + Sync),
}

impl Wall<'_> {
    /// Root of a half, `whole` and `carved`, in the wall at a station. Its width is the length that half and
    /// wall share of a line shortly above the inner surface.
    fn root(&self, at: &RunStation, bounds: ProfileRect, [whole, carved]: [&Body; 2]) -> Option<Root> {
        let middle_mm = self.thickness_mm - ROOT_DEPTH_MM;
        let is_near = |p: Vec3| {
            let depth_mm = (self.depth_mm)(p);
            depth_mm.is_some_and(|mm| (mm - middle_mm).abs() < ROOT_BAND_MM)
        };
        let steps = |from: f64, to: f64| {
            let n = ((to - from) / ROOT_STEP_MM).ceil().max(0.0) as usize;
            (0..n).map(move |i| from + (i as f64 + 0.5) * ROOT_STEP_MM)
        };
        let points = steps(bounds.n0, bounds.n1)
            .flat_map(|n| steps(bounds.s0, bounds.s1).map(move |s| at.place(n, s)));
        let (mut n_whole, mut n, mut sum) = (0u32, 0u32, Vec3::ZERO);
        for p in points.filter(|p| is_near(*p) && whole.holds(*p)) {
            n_whole += 1;
            if carved.holds(p) && self.body.holds(p) {
                n += 1;
                sum += p;
            }
        }
        let width_mm = |n: u32| f64::from(n) * ROOT_STEP_MM.powi(2) / (2.0 * ROOT_BAND_MM);
        (n > 0).then(|| Root {
            width_mm: width_mm(n),
            whole_mm: width_mm(n_whole),
            at: sum / f64::from(n),
        })
    }
}

/// A solid that can be asked for points.
pub(super) struct Body {
    mesh: TriMesh,
    tree: TriangleBvh,
}

impl Body {
    pub(super) fn of(volume: &Volume) -> Self {
        let mesh = volume.to_mesh();
        Self {
            tree: TriangleBvh::new(&mesh),
            mesh,
        }
    }

    fn holds(&self, point: Vec3) -> bool {
        let hit = self.tree.first_hit(point, RAY, f64::INFINITY);
        hit.is_some_and(|(face, _)| self.mesh.face_normal(face as usize).dot(RAY) > 0.0)
    }
}

/// Compares one half of a run, `whole` and `carved`, section by section, and measures its root. `parts` gives
/// the half's parts of a section. Only points below the floor of the wall, `clearance_mm` below its inner
/// surface, are compared.
pub(super) fn sections_left(
    params: &ConnectorParams,
    run: &Run,
    parts: &dyn Fn(&Section) -> Vec<Option<ProfileRect>>,
    [whole, carved]: [&Volume; 2],
    wall: &Wall<'_>,
    clearance_mm: f64,
) -> Vec<Left> {
    let floor_mm = wall.thickness_mm + clearance_mm;
    let counts = |p: Vec3| (wall.depth_mm)(p).is_some_and(|mm| mm > floor_mm);
    let [whole, carved] = [whole, carved].map(Body::of);
    let share = |points: Vec<Vec3>| {
        let points = points.into_iter().filter(|p| counts(*p) && whole.holds(*p));
        let (n_left, n) = points.fold((0, 0), |(n_left, n), p| {
            (n_left + u32::from(carved.holds(p)), n + 1)
        });
        if n > 0 {
            f64::from(n_left) / f64::from(n)
        } else {
            1.0
        }
    };
    let mut all = Vec::new();
    for (i, pair) in run.stations.windows(2).enumerate() {
        let [a, b] = [&pair[0], &pair[1]];
        let sections = [a, b].map(|at| parts(&Section::at(params, at)));
        let n_steps = (a.point.distance(b.point) / STEP_MM).ceil().max(1.0) as usize;
        for step in 0..n_steps {
            let t = (step as f64 + 0.5) / n_steps as f64;
            let both =
                |(at_a, at_b): (&Option<ProfileRect>, &Option<ProfileRect>)| Some(((*at_a)?, (*at_b)?));
            let of_both: Vec<_> = sections[0].iter().zip(&sections[1]).filter_map(both).collect();
            let shares = of_both
                .iter()
                .map(|&(at_a, at_b)| share(points_between((a, at_a), (b, at_b), t)));
            let station = run.station_at(i as f64 + t);
            let bounds = Section::bounds_of(sections.iter().flatten().flatten());
            // Beyond its end a pin loses nothing.
            let root = match of_both.is_empty() {
                true => Some(Root::none_needed(station.point)),
                false => wall.root(&station, bounds, [&whole, &carved]),
            };
            all.push(Left {
                at: i as f64 + t,
                share: shares.fold(1.0, f64::min),
                point: station.point,
                root,
            });
        }
    }
    all
}

/// Points of a part between two stations, at the share `t` of the way.
fn points_between(
    (a, at_a): (&RunStation, ProfileRect),
    (b, at_b): (&RunStation, ProfileRect),
    t: f64,
) -> Vec<Vec3> {
    let pairs = at_a.points().zip(at_b.points());
    let place = |at: &RunStation, [n, s]: [f64; 2]| at.place(n, s);
    pairs
        .map(|(in_a, in_b)| place(a, in_a).lerp(place(b, in_b), t))
        .collect()
}

/// The stretches of `run` on which both halves are `left` whole; `None` where that is all of it. Where there
/// is none long enough, the stretches on which most is left; a run without any is given up.
pub(super) fn trimmed(run: &Run, left: [&[Left]; 2]) -> Option<Vec<Run>> {
    let [male, female] = left.map(shares);
    let both = left[0].iter().zip(male.into_iter().zip(female));
    let shares: Vec<(f64, f64)> = both
        .map(|(at, (male, female))| (at.at, male.min(female)))
        .collect();
    let all_have = |least: f64| shares.iter().all(|(_, share)| *share >= least);
    if all_have(WHOLE) {
        return None;
    }
    let whole = stretches(run, &shares, WHOLE);
    if !whole.is_empty() {
        return Some(whole);
    }
    (!all_have(MOST)).then(|| stretches(run, &shares, MOST))
}

/// Share of each section that is left, and at most the share of the least root that its neighbourhood has.
fn shares(left: &[Left]) -> Vec<f64> {
    let roots: Vec<f64> = (0..left.len()).map(|i| root_share(left, i)).collect();
    let mean = |i: usize| {
        let around = &roots[i.saturating_sub(ROOT_REACH)..(i + ROOT_REACH + 1).min(left.len())];
        around.iter().sum::<f64>() / around.len() as f64
    };
    let share = |(i, left): (usize, &Left)| left.share.min(mean(i));
    left.iter().enumerate().map(share).collect()
}

/// Area of the root of section `i` for each mm of the run, as a share of the least one. Where sections fan
/// out over a convex corner, their roots lie closer together than their stations.
fn root_share(left: &[Left], i: usize) -> f64 {
    let Some(root) = left[i].root else { return 0.0 };
    let share = root.width_mm / LEAST_ROOT_MM.min(root.whole_mm);
    let around = &left[i.saturating_sub(1)..(i + 2).min(left.len())];
    let rooted: Vec<(Vec3, Vec3)> = around
        .iter()
        .filter_map(|l| Some((l.point, l.root?.at)))
        .collect();
    let ((from, root_from), (to, root_to)) = (rooted[0], rooted[rooted.len() - 1]);
    let spacing_mm = from.distance(to);
    if spacing_mm == 0.0 {
        return share;
    }
    share * (root_from.distance(root_to) / spacing_mm).min(1.0)
}

/// The stretches of `run` on which at least `least` of each section is left.
fn stretches(run: &Run, shares: &[(f64, f64)], least: f64) -> Vec<Run> {
    let last = (run.stations.len() - 1) as f64;
    let is_left = |share: &(f64, f64)| share.1 >= least;
    // A closed run is opened where it is not left.
    let opening = shares
        .iter()
        .position(|share| !is_left(share))
        .filter(|_| run.is_loop());
    let (after, before) = shares.split_at(opening.unwrap_or(0));
    let wrapped = after.iter().map(|(at, share)| (at + last, *share));
    let shares: Vec<(f64, f64)> = before.iter().copied().chain(wrapped).collect();
    let mut runs = Vec::new();
    let mut from = 0;
    for stretch in shares.chunk_by(|a, b| is_left(a) == is_left(b)) {
        let to = from + stretch.len();
        if is_left(&stretch[0]) {
            let is_end = |at: usize, end: usize| opening.is_none() && at == end;
            let begin = if is_end(from, 0) { 0.0 } else { shares[from].0 };
            let end = if is_end(to, shares.len()) {
                last
            } else {
                shares[to - 1].0
            };
            runs.extend(part_of(run, begin, end));
        }
        from = to;
    }
    runs
}

/// The part of a run between two places, beyond the last station of a closed one too; `None` where it is too
/// short.
fn part_of(run: &Run, begin: f64, end: f64) -> Option<Run> {
    let inner = (begin.floor() as usize + 1)..(end.ceil() as usize);
    let places = std::iter::once(begin).chain(inner.map(|i| i as f64)).chain([end]);
    let part = without_thin_stops(Run {
        stations: places.map(|at| run.station_at(at)).collect(),
        ..run.clone()
    });
    let least_mm = part
        .stations
        .iter()
        .map(|at| at.size_mm)
        .fold(f64::INFINITY, f64::min);
    (part.length() >= SHORTEST_RUN_SIZES * least_mm).then_some(part)
}

#[cfg(test)]
mod tests {
    use shellock_report::PatchId;

    use super::*;
    use crate::connector::RunShape;
    use crate::piece::whole_halves;

    fn station(point: Vec3, tangent: Vec3, arc_mm: f64) -> RunStation {
        RunStation {
            point,
            tangent,
            n: Vec3::Z.cross(tangent),
            s: Vec3::Z,
            theta: 0.0,
            depth: 1.0,
            arc_mm,
            size_mm: 2.5,
            clearance_mm: 0.12,
            shape: RunShape::Seam,
        }
    }

    fn run(stations: Vec<RunStation>) -> Run {
        Run {
            male: PatchId(0),
            female: PatchId(1),
            stations,
        }
    }

    /// A run of 20 mm along x, with a station every 5 mm.
    fn straight() -> Run {
        run((0..5)
            .map(|i| 5.0 * f64::from(i))
            .map(|x| station(x * Vec3::X, Vec3::X, x))
            .collect())
    }

    /// A run round a circle of 10 mm radius.
    fn round() -> Run {
        let at = |i: u32| {
            let angle = f64::from(i % 24) * std::f64::consts::TAU / 24.0;
            let out = Vec3::new(angle.cos(), angle.sin(), 0.0);
            station(
                10.0 * out,
                Vec3::Z.cross(out),
                10.0 * f64::from(i) * std::f64::consts::TAU / 24.0,
            )
        };
        run((0..=24).map(at).collect())
    }

    fn left(run: &Run, share: impl Fn(f64) -> f64) -> Vec<Left> {
        let n = 8 * (run.stations.len() - 1);
        let at = (0..n).map(|i| (f64::from(i as u32) + 0.5) / 8.0);
        at.map(|at| Left {
            at,
            share: share(at),
            point: run.station_at(at).point,
            root: Some(Root {
                width_mm: 1.0,
                whole_mm: 1.0,
                at: run.station_at(at).point,
            }),
        })
        .collect()
    }

    #[test]
    fn a_run_that_loses_its_middle_becomes_two_and_one_that_loses_nothing_stays() {
        let run = straight();
        let all = left(&run, |_| 0.96);
        assert!(trimmed(&run, [&all, &all]).is_none());
        let holed = left(&run, |at| if (1.6..2.0).contains(&at) { 0.3 } else { 1.0 });
        let parts = trimmed(&run, [&all, &holed]).unwrap();
        let ends: Vec<[f64; 2]> = parts
            .iter()
            .map(|part| [0, part.stations.len() - 1].map(|i| part.stations[i].point.x))
            .collect();
        assert_eq!(ends.len(), 2);
        assert!(ends[0][0] == 0.0 && ends[0][1] < 8.0 && ends[1][0] >= 10.0 && ends[1][1] == 20.0);
    }

    #[test]
    fn a_run_that_nowhere_stays_whole_keeps_where_most_is_left_and_one_without_goes() {
        let run = straight();
        let half = left(&run, |at| if at < 2.0 { 0.7 } else { 0.2 });
        let parts = trimmed(&run, [&half, &half]).unwrap();
        assert!(parts.len() == 1 && (parts[0].length() - 10.0).abs() < 1.0);
        let most = left(&run, |_| 0.7);
        assert!(trimmed(&run, [&most, &most]).is_none());
        let gone = left(&run, |_| 0.1);
        assert_eq!(trimmed(&run, [&gone, &gone]).unwrap().len(), 0);
    }

    /// Sections that fan out around the end of an edge: roots of the least width, 0.5 mm from it, under
    /// stations 3 mm from it.
    #[test]
    fn sections_that_fan_out_share_a_root() {
        let at = |i: u32, radius_mm: f64| radius_mm * Vec3::X.rotate_z(f64::from(i) * 0.17);
        let left: Vec<Left> = (0..10)
            .map(|i| Left {
                at: f64::from(i),
                share: 1.0,
                point: at(i, 3.0),
                root: Some(Root {
                    width_mm: 0.95,
                    whole_mm: 2.0,
                    at: at(i, 0.5),
                }),
            })
            .collect();
        assert!((0..10).all(|i| (root_share(&left, i) - 0.5 / 3.0).abs() < 0.01));
        assert!(shares(&left).iter().all(|share| *share < MOST));
    }

    #[test]
    fn a_closed_run_opens_where_it_is_lost() {
        let run = round();
        let all = left(&run, |_| 1.0);
        let open = left(&run, |at| if (5.0..7.0).contains(&at) { 0.0 } else { 1.0 });
        let parts = trimmed(&run, [&open, &all]).unwrap();
        assert!(parts.len() == 1 && !parts[0].is_loop());
        let expected = run.length() * 22.0 / 24.0;
        assert!(
            (parts[0].length() - expected).abs() < 1.0,
            "{}",
            parts[0].length()
        );
        let arcs: Vec<f64> = parts[0].stations.iter().map(|at| at.arc_mm).collect();
        assert!(arcs.windows(2).all(|w| w[1] > w[0]), "{arcs:?}");
        let [pin, channel] = whole_halves(&ConnectorParams::default(), &parts[0]);
        assert!(pin.volume() > 0.0 && channel.volume() > 0.0);
    }

    #[test]
    fn sections_tell_what_is_left_of_each_part() {
        let (run, params) = (straight(), ConnectorParams::default());
        let [pin, _] = whole_halves(&params, &run);
        let cut = shellock_testkit::shapes::cuboid([8.0, -9.0, -9.0], [20.5, 9.0, -0.75]);
        let parts = |section: &Section| section.male.to_vec();
        let wall = Wall {
            body: Body::of(&shellock_testkit::shapes::cuboid(
                [-1.0, -9.0, 0.0],
                [15.0, 9.0, 2.0],
            )),
            thickness_mm: 2.0,
            depth_mm: &|p| Some(2.0 - p.z),
        };
        let found = sections_left(&params, &run, &parts, [&pin, &pin.subtract(&cut)], &wall, 0.12);
        let x = |left: &Left| 5.0 * left.at;
        assert!(found.iter().filter(|l| x(l) < 7.8).all(|l| l.share == 1.0));
        // The pin is 1.5 mm deep, and half of that is gone: two of three rows of points.
        assert!(
            found
                .iter()
                .filter(|l| x(l) > 8.2)
                .all(|l| (0.3..0.6).contains(&l.share))
        );
        // The pin is 1 mm wide where it enters the wall, which ends at 15 mm.
        assert!(
            found
                .iter()
                .filter(|l| x(l) < 14.5)
                .all(|l| (l.root.unwrap().width_mm - 1.0).abs() < 0.25)
        );
        assert!(found.iter().filter(|l| x(l) > 15.5).all(|l| l.root.is_none()));
        let rooted = trimmed(&run, [&found, &found]).unwrap();
        assert!(rooted.len() == 1 && rooted[0].length() < 8.5);
    }
}
