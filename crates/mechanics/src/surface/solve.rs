//! One plan's equilibrium: Newton's method with an exact line search on a convex, piecewise quadratic energy.
//!
//! The unknowns are the forces in the contacts. With `r = D s` the motions that forces s at the stations
//! cause, the parts are in balance whatever the contacts bear, `s = f − Gᵀ μ`; what is sought are μ that are
//! those of the gaps, `μ = (G r)⁻`.

use std::ops::Range;

use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;

use super::contact::{Contact, contacts, forces, gap};
use super::join::{Body, Joinings};
use super::parts::{Motions, N_MOTIONS, Part};
use super::{SurfaceModel, SurfaceSolution};
use crate::assembly::{Meeting, Opening, Side, Station};

/// Newton steps of a line search; the slope is piecewise linear and most searches end after two or three.
const LINE_STEPS: usize = 30;

/// Stiffness of what is held, in that of a contact a mm long.
const HELD_SHARE: f64 = 1e4;

/// The answer to `pulls`, N, on the tips of side a and, the other way, of side b.
pub(super) fn solve(
    model: &SurfaceModel,
    plan: &[Meeting],
    is_held: &[bool],
    pulls: &[Vec3],
) -> Result<SurfaceSolution, SparseError> {
    let (sent, n_iterations, error) = minimise(model, plan, is_held, pulls)?;
    let opening = rated(model, plan, &answer(model, is_held, &sent));
    let part_of = |p: u32| model.assembly.part_of_point[p as usize];
    let is_free = |part: &u32| !is_held.get(*part as usize).is_some_and(|h| *h);
    let resistance = opening.resistance(plan, |station| {
        model.assembly.stations[station]
            .points
            .map(part_of)
            .into_iter()
            .filter(is_free)
    });
    Ok(SurfaceSolution {
        resistance,
        n_iterations,
        error,
    })
}

/// What the pulls and the contacts send through the stations at the least energy, steps taken, and what is
/// left of the force as a share of it.
pub(super) fn minimise(
    model: &SurfaceModel,
    plan: &[Meeting],
    is_held: &[bool],
    pulls: &[Vec3],
) -> Result<(Vec<Motions>, usize, f64), SparseError> {
    let force = forces(model, plan, pulls);
    let (contacts, bodies, mut joinings) = system(model, plan, is_held);
    // The first step leaves all one-sided contacts open, which takes three steps fewer than all closed.
    let mut is_closed: Vec<bool> = contacts.iter().map(|c| !c.is_one_sided).collect();
    let (mut borne, mut gaps) = (
        vec![0.0; contacts.len()],
        gaps(&contacts, &answer(model, is_held, &force)),
    );
    let (mut n_iterations, mut error) = (0, if norm(&force) > 0.0 { 1.0 } else { 0.0 });
    while error > model.params.tolerance && n_iterations < model.params.max_iterations {
        let step = step(&mut joinings, &bodies, &is_closed, &borne, &gaps)?;
        let opened = opened(&bodies, &step);
        let length = if n_iterations == 0 {
            1.0
        } else {
            length(&contacts, [&borne, &step], [&gaps, &opened])
        };
        borne.iter_mut().zip(&step).for_each(|(b, s)| *b += length * s);
        gaps.iter_mut().zip(&opened).for_each(|(g, o)| *g += length * o);
        let pressed = contacts.iter().zip(&gaps).map(|(c, g)| c.pressed(*g));
        let left: Vec<f64> = borne.iter().zip(pressed).map(|(b, p)| b - p).collect();
        error = norm(&less(&contacts, vec![[0.0; N_MOTIONS]; force.len()], &left)) / norm(&force);
        is_closed = contacts
            .iter()
            .zip(&gaps)
            .map(|(c, g)| !c.is_one_sided || *g <= 0.0)
            .collect();
        n_iterations += 1;
    }
    Ok((less(&contacts, force, &borne), n_iterations, error))
}

/// The contacts of a plan in the order in which they are eliminated, and the bodies that are joined by them.
fn system(model: &SurfaceModel, plan: &[Meeting], is_held: &[bool]) -> (Vec<Contact>, Vec<Body>, Joinings) {
    let (touched, n_stations) = (touched(model, is_held), model.assembly.stations.len());
    let contacts = contacts(model, plan);
    let of_station = ranges(&contacts, n_stations);
    let of_body = |t: &Touched| {
        t.stations
            .iter()
            .flat_map(|s| of_station[*s as usize].clone())
            .map(|c| c as u32)
            .collect()
    };
    let (joinings, order) = Joinings::new(touched.iter().map(of_body).collect(), contacts.len());

    let contacts: Vec<Contact> = order.iter().map(|c| contacts[*c as usize]).collect();
    let (of_station, given) = (ranges(&contacts, n_stations), given(model, is_held));
    let bodies = touched
        .iter()
        .map(|t| body(t, &contacts, &of_station, &given))
        .collect();
    (contacts, bodies, joinings)
}

/// What contacts must bear more for the balance of the closed ones. Only differences from it are solved for,
/// since rounding is in proportion to what the ground bears, and that is soft.
fn step(
    joinings: &mut Joinings,
    bodies: &[Body],
    is_closed: &[bool],
    borne: &[f64],
    gaps: &[f64],
) -> Result<Vec<f64>, SparseError> {
    let mut step: Vec<f64> = borne
        .iter()
        .zip(is_closed)
        .map(|(b, closed)| if *closed { 0.0 } else { -b })
        .collect();
    let mut side = opened(bodies, &step);
    side.iter_mut()
        .zip(gaps)
        .zip(borne)
        .for_each(|((s, g), b)| *s += g - b);
    let closed = joinings.solve(bodies, is_closed, &side)?;
    step.iter_mut().zip(closed).for_each(|(s, c)| *s += c);
    Ok(step)
}

/// The length of step with the least energy, from what contacts bear and their gaps, and what the step
/// changes in both.
fn length(contacts: &[Contact], [borne, step]: [&[f64]; 2], [gaps, opened]: [&[f64]; 2]) -> f64 {
    let (mut length, mut first) = (0.0, None);
    for _ in 0..LINE_STEPS {
        let (mut slope, mut curve) = (0.0, 0.0);
        for (i, contact) in contacts.iter().enumerate() {
            let gap = gaps[i] + length * opened[i];
            let pressed = contact.pressed(gap);
            slope += (pressed - borne[i] - length * step[i]) * opened[i];
            let stiffness = if !contact.is_one_sided || gap < 0.0 {
                opened[i]
            } else {
                0.0
            };
            curve += (stiffness - step[i]) * opened[i];
        }
        if slope.abs() <= 1e-12 * first.get_or_insert(slope).abs() || curve <= 0.0 {
            break;
        }
        length -= slope / curve;
    }
    length
}

/// Compliance of what is held, mm/N.
fn held_compliance(model: &SurfaceModel) -> f64 {
    1.0 / (HELD_SHARE * model.params.contact_n_mm(model.params.connector_mm, 1.0))
}

/// How side a moves from side b at each station under forces that pull them apart.
pub(super) fn answer(model: &SurfaceModel, is_held: &[bool], forces: &[Motions]) -> Vec<Motions> {
    let mut moved = vec![[0.0; N_MOTIONS]; forces.len()];
    for (i, part) in model.parts.iter().enumerate() {
        if is_held.get(i).is_some_and(|h| *h) {
            for &s in &part.stations {
                add(
                    &mut moved[s as usize],
                    held_compliance(model),
                    &forces[s as usize],
                );
            }
            continue;
        }
        let mut own = vec![0.0; N_MOTIONS * part.stations.len()];
        let sent = part.stations.iter().flat_map(|s| forces[*s as usize]);
        for (column, force) in part
            .compliance
            .as_slice()
            .chunks_exact(own.len().max(1))
            .zip(sent)
        {
            add(&mut own, force, column);
        }
        for (&s, own) in part.stations.iter().zip(own.chunks_exact(N_MOTIONS)) {
            add(&mut moved[s as usize], 1.0, own);
        }
    }
    moved
}

/// What a plan's contacts touch: a free part, or a station between held parts alone.
struct Touched<'a> {
    stations: Vec<u32>,
    part: Option<&'a Part>,
}

fn touched<'a>(model: &'a SurfaceModel, is_held: &[bool]) -> Vec<Touched<'a>> {
    let is_held = |part: usize| is_held.get(part).is_some_and(|h| *h);
    let free = model
        .parts
        .iter()
        .enumerate()
        .filter(|(i, _)| !is_held(*i))
        .map(|(_, part)| part);
    let mut touched: Vec<_> = free
        .map(|p| Touched {
            stations: p.stations.clone(),
            part: Some(p),
        })
        .collect();
    let mut is_free = vec![false; model.assembly.stations.len()];
    touched
        .iter()
        .flat_map(|t| &t.stations)
        .for_each(|s| is_free[*s as usize] = true);
    let between_held = (0..).zip(is_free).filter(|(_, is_free)| !is_free);
    touched.extend(between_held.map(|(s, _)| Touched {
        stations: vec![s],
        part: None,
    }));
    touched
}

/// Compliance that held parts add at each station, mm/N.
fn given(model: &SurfaceModel, is_held: &[bool]) -> Vec<f64> {
    let mut given = vec![0.0; model.assembly.stations.len()];
    for (part, _) in model.parts.iter().zip(is_held).filter(|(_, is_held)| **is_held) {
        part.stations
            .iter()
            .for_each(|s| given[*s as usize] += held_compliance(model));
    }
    given
}

/// The contacts of each station, which follow each other.
fn ranges(contacts: &[Contact], n_stations: usize) -> Vec<Range<usize>> {
    let mut ranges = vec![0..0; n_stations];
    let mut first = 0;
    for same in contacts.chunk_by(|a, b| a.station == b.station) {
        ranges[same[0].station] = first..first + same.len();
        first += same.len();
    }
    ranges
}

/// How the contacts feel a body, with what held parts add.
fn body(touched: &Touched, contacts: &[Contact], ranges: &[Range<usize>], given: &[f64]) -> Body {
    let n = N_MOTIONS * touched.stations.len();
    // In the order of the contacts, with the place of each station in the part.
    let mut stations: Vec<(Range<usize>, usize)> = touched
        .stations
        .iter()
        .map(|s| ranges[*s as usize].clone())
        .zip((0..).step_by(N_MOTIONS))
        .collect();
    stations.sort_unstable_by_key(|(range, _)| range.start);
    let ids: Vec<u32> = stations
        .iter()
        .flat_map(|(range, _)| range.start as u32..range.end as u32)
        .collect();
    let mut compliance = Vec::with_capacity(ids.len() * ids.len());
    let mut moved = vec![0.0; n];
    for (range, place) in &stations {
        for contact in &contacts[range.clone()] {
            moved.fill(0.0);
            let columns = touched
                .part
                .map_or(&[][..], |p| &p.compliance.as_slice()[n * place..]);
            columns
                .chunks_exact(n)
                .zip(&contact.gradient)
                .for_each(|(column, g)| add(&mut moved, *g, column));
            add(&mut moved[*place..], given[contact.station], &contact.gradient);
            for (range, place) in &stations {
                let moved = &moved[*place..*place + N_MOTIONS];
                compliance.extend(contacts[range.clone()].iter().map(|c| dot(&c.gradient, moved)));
            }
        }
    }
    Body {
        contacts: ids,
        compliance,
    }
}

/// How gaps change when contacts bear `borne` more.
fn opened(bodies: &[Body], borne: &[f64]) -> Vec<f64> {
    let mut opened = vec![0.0; borne.len()];
    let mut own = Vec::new();
    for body in bodies {
        own.clear();
        own.resize(body.contacts.len(), 0.0);
        for (column, &c) in body.compliance.chunks_exact(own.len().max(1)).zip(&body.contacts) {
            if borne[c as usize] != 0.0 {
                add(&mut own, -borne[c as usize], column);
            }
        }
        own.iter()
            .zip(&body.contacts)
            .for_each(|(o, &c)| opened[c as usize] += o);
    }
    opened
}

fn gaps(contacts: &[Contact], moved: &[Motions]) -> Vec<f64> {
    contacts
        .iter()
        .map(|c| dot(&c.gradient, &moved[c.station]))
        .collect()
}

/// `force` without what the contacts bear.
fn less(contacts: &[Contact], mut force: Vec<Motions>, borne: &[f64]) -> Vec<Motions> {
    contacts
        .iter()
        .zip(borne)
        .for_each(|(c, b)| add(&mut force[c.station], -b, &c.gradient));
    force
}

/// The distances between the tips of both sides.
fn rated(model: &SurfaceModel, plan: &[Meeting], moved: &[Motions]) -> Opening {
    let opening = |((station, m), moved): ((&Station, &Meeting), &Motions)| {
        let Some(joint) = m.joint else { return 0.0 };
        let along = |g| {
            dot(
                &gap(station, Side::A, -model.params.strip_mm(&joint) * joint.leaves, g),
                moved,
            )
        };
        Vec3::from_array([station.tangent, station.normal, station.across].map(along)).length()
    };
    Opening::rated(
        plan,
        model
            .assembly
            .stations
            .iter()
            .zip(plan)
            .zip(moved)
            .map(opening)
            .collect(),
    )
}

fn add(to: &mut [f64], factor: f64, x: &[f64]) {
    to.iter_mut().zip(x).for_each(|(t, x)| *t += factor * x);
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

fn norm(forces: &[Motions]) -> f64 {
    forces.iter().map(|f| dot(f, f)).sum::<f64>().sqrt()
}
