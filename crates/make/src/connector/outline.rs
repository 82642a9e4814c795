//! Outlines of the two halves of a section, and the solids that they sweep along a run.
//!
//! A half is one outline with a fixed number of corners, so that it sweeps one solid. Several solids side by
//! side would share faces only up to rounding, and their union would keep the seams between them as folds.

use shellock_geom::{Vec3, Volume};

use super::ConnectorParams;
use super::profile::{ProfileRect, Section};
use super::station::{Run, RunShape, RunStation};

/// One half of a run, or the filling of the corner between tongue and wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Half {
    Male,
    Female,
    Corner,
}

/// Corners in the plane of a section, counter-clockwise: coordinates along `n` and ŝ, mm.
type Outline = Vec<[f64; 2]>;

/// Bevel of the pin's tip and of the channel's lower edges, in connector sizes, so that the pin finds its
/// channel and hands find no sharp edge. Chosen by eye.
const BEVEL_SIZES: f64 = 0.1;
/// Distance that stops keep from the faces of the channel or groove that they fill, mm.
const INSIDE_MM: f64 = 0.01;
/// Greatest overhang that an end keeps, mm, and margin of its cut around the end's section, mm: where a run
/// is bent, it overhangs its end beside that section.
const MOST_OVERHANG_MM: f64 = 0.1;
const ASIDE_MM: f64 = 2.0;
/// Greatest angle between the first and the last section of one solid, rad. A solid that turned farther
/// could pass through itself.
const MOST_TURN: f64 = 1.5;

/// One half of a run, before carving.
pub(crate) fn whole_half(params: &ConnectorParams, run: &Run, half: Half) -> Volume {
    let mut stations = run.stations.clone();
    if run.is_loop() {
        // The last solid overlaps the first.
        stations.push(stations[1]);
    }
    let sections: Vec<Vec<Option<Outline>>> = stations
        .iter()
        .map(|station| outlines(&Section::at(params, station), station, half))
        .collect();
    let mut solids = Vec::new();
    for part in 0..sections[0].len() {
        // A part that some sections lack becomes several solids.
        let inside: Vec<RunStation>;
        let along = match part {
            0 => &stations,
            _ => {
                inside = inside_ends(&stations);
                &inside
            }
        };
        let line: Vec<(&RunStation, &Option<Outline>)> =
            along.iter().zip(sections.iter().map(|s| &s[part])).collect();
        for stretch in line.split(|(_, outline)| outline.is_none()) {
            let present = stretch
                .iter()
                .filter_map(|(at, outline)| Some((*at, outline.as_ref()?)));
            solids.extend(sweep(&present.collect::<Vec<_>>()));
        }
    }
    let half = Volume::union_all(solids);
    if run.is_loop() {
        return half;
    }
    let [first, last] = [0, run.stations.len() - 1].map(|i| &run.stations[i]);
    let beyond = [
        overhang(params, first, -first.tangent),
        overhang(params, last, last.tangent),
    ];
    half.subtract(&Volume::union_all(beyond.into_iter().flatten().collect()))
}

/// The stations of an open run with its ends a little nearer together.
fn inside_ends(stations: &[RunStation]) -> Vec<RunStation> {
    let mut moved = stations.to_vec();
    let last = moved.len() - 1;
    let along = moved[0].tangent;
    moved[0].point += INSIDE_MM * along;
    let along = moved[last].tangent;
    moved[last].point -= INSIDE_MM * along;
    moved
}

/// Space beyond a run's end, where sections that lean along the seam would overhang it with a sharp edge;
/// `outwards` is the tangent that leads out of the run. `None` where sections stand straight, and at a stop,
/// which would lose its thickness.
fn overhang(params: &ConnectorParams, end: &RunStation, outwards: Vec3) -> Option<Volume> {
    if end.shape == RunShape::Stop {
        return None;
    }
    let around = Section::at(params, end).bounds().grown(ASIDE_MM);
    let (lean, up) = (end.s.dot(outwards), end.s.reject_from_normalized(outwards));
    let far_mm = (around.s0 * lean).max(around.s1 * lean) - ASIDE_MM * lean.abs();
    (far_mm > MOST_OVERHANG_MM).then(|| {
        let across = [around.n0, around.n1].map(|n| n * end.n);
        let upwards = [around.s0, around.s1].map(|s| s * up);
        let along = [0.0, far_mm + ASIDE_MM].map(|mm| mm * outwards);
        let corner = |i: usize| end.point + across[i & 1] + upwards[i >> 1 & 1] + along[i >> 2];
        Volume::hull(&(0..8).map(corner).collect::<Vec<_>>())
    })
}

/// Solids whose union is swept by an outline that moves along stations. Each solid begins with the last two
/// sections of the one before.
fn sweep(line: &[(&RunStation, &Outline)]) -> Vec<Volume> {
    let mut solids = Vec::new();
    let mut from = 0;
    for to in 2..line.len() {
        if line[from].0.tangent.angle_between(line[to].0.tangent) > MOST_TURN {
            solids.push(solid(&line[from..to]));
            from = to - 2;
        }
    }
    solids.push(solid(&line[from..]));
    solids
}

/// Solid through the outlines at successive stations; empty for fewer than two.
fn solid(line: &[(&RunStation, &Outline)]) -> Volume {
    let ring =
        |(at, outline): &(&RunStation, &Outline)| outline.iter().map(|&[n, s]| at.place(n, s)).collect();
    Volume::loft(&line.iter().map(ring).collect::<Vec<Vec<Vec3>>>())
}

/// Outlines of one half of a section; `None` where the section lacks the part.
fn outlines(section: &Section, station: &RunStation, half: Half) -> Vec<Option<Outline>> {
    let bevel = BEVEL_SIZES * station.size_mm;
    match (half, station.shape) {
        (Half::Corner, _) => vec![section.corner.map(rectangle)],
        (Half::Male, RunShape::Seam | RunShape::Stop) => {
            vec![section.male[0].map(|pin| pin_outline(pin, section.male[1], bevel))]
        }
        (Half::Female, RunShape::Seam | RunShape::Stop) => {
            let [bottom, far, near, filling] = section.female;
            vec![
                bottom
                    .zip(far)
                    .zip(near)
                    .map(|((bottom, far), near)| channel_outline(bottom, far, near, bevel)),
                filling.map(|filling| filling_outline(filling.grown(-INSIDE_MM), bevel)),
            ]
        }
        (Half::Male, RunShape::Rail(_)) => {
            let [tongue, root] = section.male;
            vec![
                tongue
                    .zip(root)
                    .map(|(tongue, root)| tongue_outline(tongue, root)),
            ]
        }
        (Half::Female, RunShape::Rail(_)) => {
            let [lip, hanger, _, stop] = section.female;
            let groove = lip.zip(hanger).map(|(lip, hanger)| groove_outline(lip, hanger));
            vec![groove, stop.map(|stop| rectangle(stop.grown(-INSIDE_MM)))]
        }
    }
}

fn rectangle(r: ProfileRect) -> Outline {
    vec![[r.n0, r.s0], [r.n1, r.s0], [r.n1, r.s1], [r.n0, r.s1]]
}

/// Pin with a bevelled tip, and its foot. Where there is no foot, its corners lie on the pin's side.
fn pin_outline(pin: ProfileRect, foot: Option<ProfileRect>, bevel: f64) -> Outline {
    let [low, high] = [0.5, 0.75].map(|share: f64| (1.0 - share) * pin.s0.max(0.0) + share * pin.s1);
    let corners = foot.map_or([[pin.n1, low], [pin.n1, high], [pin.n1, pin.s1]], |foot| {
        [[pin.n1, foot.s0], [foot.n1, foot.s0], [foot.n1, foot.s1]]
    });
    bevelled_bottom(pin, bevel)
        .into_iter()
        .chain(corners)
        .chain([[pin.n0, pin.s1]])
        .collect()
}

/// Channel with bevelled outer edges.
fn channel_outline(bottom: ProfileRect, far: ProfileRect, near: ProfileRect, bevel: f64) -> Outline {
    let walls = [
        [near.n1, near.s1],
        [near.n0, near.s1],
        [near.n0, bottom.s1],
        [far.n1, bottom.s1],
        [far.n1, far.s1],
        [far.n0, far.s1],
    ];
    bevelled_bottom(bottom, bevel).into_iter().chain(walls).collect()
}

/// Filling of a channel, within its bevelled outer edges.
fn filling_outline(filling: ProfileRect, bevel: f64) -> Outline {
    let top = [[filling.n1, filling.s1], [filling.n0, filling.s1]];
    bevelled_bottom(filling, bevel).into_iter().chain(top).collect()
}

/// Lower corners of a rectangle, bevelled, from its side at `n0` to that at `n1`.
fn bevelled_bottom(of: ProfileRect, bevel: f64) -> [[f64; 2]; 4] {
    [
        [of.n0, of.s0 + bevel],
        [of.n0 + bevel, of.s0],
        [of.n1 - bevel, of.s0],
        [of.n1, of.s0 + bevel],
    ]
}

/// Tongue of a rail, and the root that it hangs from.
fn tongue_outline(tongue: ProfileRect, root: ProfileRect) -> Outline {
    vec![
        [tongue.n0, tongue.s0],
        [tongue.n1, tongue.s0],
        [tongue.n1, tongue.s1],
        [root.n1, tongue.s1],
        [root.n1, root.s1],
        [root.n0, root.s1],
    ]
}

/// Groove of a key: lip and hanger.
fn groove_outline(lip: ProfileRect, hanger: ProfileRect) -> Outline {
    vec![
        [lip.n0, lip.s0],
        [lip.n1, lip.s0],
        [hanger.n1, hanger.s1],
        [hanger.n0, hanger.s1],
        [hanger.n0, lip.s1],
        [lip.n0, lip.s1],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connector::RailPart;
    use shellock_geom::polygon;
    use shellock_report::PatchId;

    fn station(point: Vec3, tangent: Vec3, theta_degrees: f64) -> RunStation {
        RunStation {
            point,
            tangent,
            n: Vec3::Z.cross(tangent),
            s: Vec3::Z,
            theta: f64::to_radians(theta_degrees),
            depth: 1.0,
            arc_mm: 0.0,
            size_mm: 2.5,
            clearance_mm: 0.12,
            shape: RunShape::Seam,
        }
    }

    fn run(stations: Vec<RunStation>) -> Run {
        Run {
            male: PatchId(1),
            female: PatchId(0),
            stations,
        }
    }

    /// Area of an outline, by the shoelace formula.
    fn area(outline: &Outline) -> f64 {
        let n = outline.len();
        let cross = |i: usize| {
            let [[a, b], [c, d]] = [outline[i], outline[(i + 1) % n]];
            a * d - b * c
        };
        0.5 * (0..n).map(cross).sum::<f64>()
    }

    /// Area of the union of rectangles, by counting the cells between their sides.
    fn united(parts: &[ProfileRect]) -> f64 {
        let sorted = |mut of: Vec<f64>| {
            of.sort_by(f64::total_cmp);
            of
        };
        let ns = sorted(parts.iter().flat_map(|p| [p.n0, p.n1]).collect());
        let ss = sorted(parts.iter().flat_map(|p| [p.s0, p.s1]).collect());
        let mut sum = 0.0;
        for n in ns.windows(2) {
            for s in ss.windows(2) {
                let (x, y) = (0.5 * (n[0] + n[1]), 0.5 * (s[0] + s[1]));
                if parts.iter().any(|p| p.n0 < x && x < p.n1 && p.s0 < y && y < p.s1) {
                    sum += (n[1] - n[0]) * (s[1] - s[0]);
                }
            }
        }
        sum
    }

    #[test]
    fn outlines_bound_the_union_of_the_sections_parts_but_for_bevels() {
        let params = ConnectorParams::default();
        let shapes = [
            RunShape::Seam,
            RunShape::Rail(RailPart::Full),
            RunShape::Rail(RailPart::LeadIn),
        ];
        for (degrees, shape) in (-90..=60)
            .step_by(10)
            .flat_map(|t| shapes.map(|shape| (t, shape)))
        {
            let at = RunStation {
                shape,
                ..station(Vec3::ZERO, Vec3::X, f64::from(degrees))
            };
            let section = Section::at(&params, &at);
            let bevels = if shape == RunShape::Seam {
                (BEVEL_SIZES * at.size_mm).powi(2)
            } else {
                0.0
            };
            let halves: [(Half, Vec<ProfileRect>); 2] = [
                (Half::Male, section.male.into_iter().flatten().collect()),
                (Half::Female, section.female.into_iter().flatten().collect()),
            ];
            for (half, parts) in halves {
                let made = outlines(&section, &at, half);
                let outline = made[0].as_ref().unwrap();
                assert!(
                    (area(outline) + bevels - united(&parts)).abs() < 1e-9,
                    "{half:?} {shape:?} at {degrees}°"
                );
            }
        }
    }

    /// The run turns farther than one solid may, and closes on itself.
    #[test]
    fn a_run_around_a_circle_is_one_solid_of_the_volume_that_its_section_sweeps() {
        let params = ConnectorParams::default();
        let at = |i: i32| {
            let (sin, cos) = (f64::from(i % 60) * std::f64::consts::TAU / 60.0).sin_cos();
            station(20.0 * Vec3::new(cos, sin, 0.0), Vec3::new(-sin, cos, 0.0), 0.0)
        };
        let closed = run((0..=60).map(at).collect());
        assert!(closed.is_loop());
        for half in [Half::Male, Half::Female] {
            let made = whole_half(&params, &closed, half);
            let outline = outlines(&Section::at(&params, &at(0)), &at(0), half)[0]
                .clone()
                .unwrap();
            assert_eq!((made.components().len(), made.genus()), (1, 1));
            // n points to the axis: the outline's centroid lies that much nearer to it (Pappus).
            let flat: Vec<Vec3> = outline.iter().map(|c| Vec3::new(c[0], c[1], 0.0)).collect();
            let triangles = polygon::triangulate(&flat).unwrap();
            let moment: f64 = triangles
                .iter()
                .map(|t| {
                    let corners = t.map(|i| outline[i as usize]);
                    area(&corners.to_vec()) * (20.0 - corners.iter().map(|c| c[0]).sum::<f64>() / 3.0)
                })
                .sum();
            let expected = std::f64::consts::TAU * moment;
            assert!(
                (made.volume() / expected - 1.0).abs() < 0.01,
                "{half:?}: {}",
                made.volume()
            );
        }
    }

    /// Sections that lean along the seam end in a plane across it, not in an edge beyond it.
    #[test]
    fn the_ends_of_a_leaning_run_stand_across_the_seam() {
        let params = ConnectorParams::default();
        let at = |x: f64| RunStation {
            s: Vec3::new(-0.6, 0.0, 0.8),
            depth: 0.8,
            ..station(x * Vec3::X, Vec3::X, 0.0)
        };
        let leaning = run((0..=10).map(|i| at(f64::from(i))).collect());
        for half in [Half::Male, Half::Female] {
            let bounds = whole_half(&params, &leaning, half).bounds();
            // The lower end leans towards x, the upper one away from it.
            assert!(bounds.max.x < 10.0 + 1e-9 && bounds.min.x > -1e-9, "{bounds:?}");
        }
    }
}
