//! One plan's equilibrium: Newton's method with an exact line search on a convex, piecewise quadratic energy.

use shellock_geom::Vec3;
use shellock_geom::sparse::{Cholesky, SparseError, SparseSymmetric};

use super::parts::{N_MOTIONS, first_row};
use super::{SurfaceModel, SurfaceSolution};
use crate::assembly::{Meeting, Opening, Resistance, Side, Station};

/// A gap this large, in connector sizes, has let the pins out: the plan does not hold.
const LOST_SIZES: f64 = 0.6;

/// Newton steps of a line search; the slope is piecewise linear and most searches end after two or three.
const LINE_STEPS: usize = 30;

/// Stiffness of what is held, in that of a contact a mm long.
const HELD_SHARE: f64 = 1e4;

/// Motions of both sides of a station.
type Motions = [f64; 2 * N_MOTIONS];

/// One contact: `k/2 (g · q)²` in the motions q of a station, where one-sided only for a negative sum.
#[derive(Clone, Copy, Debug)]
struct Contact {
    station: usize,
    gradient: Motions,
    stiffness: f64,
    is_one_sided: bool,
}

impl Contact {
    fn value(&self, moved: &[f64]) -> f64 {
        let start = first_row(self.station, 0);
        self.gradient.iter().zip(&moved[start..]).map(|(g, q)| g * q).sum()
    }

    fn push(&self, size: f64, forces: &mut [f64]) {
        let start = first_row(self.station, 0);
        forces[start..].iter_mut().zip(self.gradient).for_each(|(f, g)| *f += size * g);
    }
}

/// How side `from` moves from the other one along `g`, both perpendicular to the tangent, at `offset` from the seam point.
fn gap(station: &Station, from: Side, offset: Vec3, g: Vec3) -> Motions {
    let mut gradient = [0.0; 2 * N_MOTIONS];
    let motion =
        [g.dot(station.tangent), g.dot(station.normal), g.dot(station.across), station.tangent.cross(offset).dot(g)];
    for (i, m) in motion.into_iter().enumerate() {
        gradient[N_MOTIONS * from.index() + i] = m;
        gradient[N_MOTIONS * from.other().index() + i] = -m;
    }
    gradient
}

/// The contacts of a plan. Where there is a connector, neither the tips nor the seam points may part across the channel,
/// and the male's tip may not go deeper; the walls may not enter each other anywhere.
fn contacts(model: &SurfaceModel, plan: &[Meeting]) -> Vec<Contact> {
    let mut contacts = Vec::with_capacity(4 * plan.len());
    for (i, (station, meeting)) in model.assembly.stations.iter().zip(plan).enumerate() {
        let stiffness = model.params.contact_n_mm(station.length_mm);
        let contact = |gradient, is_one_sided| Contact { station: i, gradient, stiffness, is_one_sided };
        contacts.push(contact(gap(station, Side::B, Vec3::ZERO, meeting.wall), true));
        if let Some(joint) = meeting.joint {
            let n = station.tangent.cross(joint.leaves).normalize_or_zero();
            let tip = -model.params.strip_mm() * joint.leaves;
            contacts.push(contact(gap(station, joint.male, tip, n), false));
            contacts.push(contact(gap(station, joint.male, Vec3::ZERO, n), false));
            contacts.push(contact(gap(station, joint.male, tip, joint.leaves), !joint.is_fast));
            if joint.is_fast {
                contacts.push(contact(gap(station, joint.male, tip, station.tangent), false));
            }
        }
    }
    contacts
}

/// The answer to `pulls`, N, on the tips of side a and, the other way, of side b.
pub(super) fn solve(
    model: &SurfaceModel,
    plan: &[Meeting],
    is_held: &[bool],
    pulls: &[Vec3],
) -> Result<SurfaceSolution, SparseError> {
    let (contacts, force) = (contacts(model, plan), forces(model, plan, pulls));
    let rigid = stiffness_of_parts(model, is_held);
    let (moved, n_iterations, error) = minimise(model, &rigid, &contacts, &force)?;
    let opening = rated(model, plan, &moved);
    let lost = lost_parts(model, is_held, &opening);
    let resistance = if lost.is_empty() { Resistance::Holds(opening) } else { Resistance::Separable(lost) };
    Ok(SurfaceSolution { resistance, n_iterations, error })
}

/// The motions that `solve` finds.
#[cfg(test)]
pub(super) fn moved(
    model: &SurfaceModel,
    plan: &[Meeting],
    is_held: &[bool],
    pulls: &[Vec3],
) -> Result<Vec<f64>, SparseError> {
    let (contacts, force) = (contacts(model, plan), forces(model, plan, pulls));
    Ok(minimise(model, &stiffness_of_parts(model, is_held), &contacts, &force)?.0)
}

/// Energy of motions with nothing but held points fixed, N mm.
#[cfg(test)]
pub(super) fn energy(model: &SurfaceModel, plan: &[Meeting], pulls: &[Vec3], moved: &[f64]) -> f64 {
    let parts = 0.5 * dot(&stiffness_of_parts(model, &[]).times(moved), moved);
    let of_contact = |c: &Contact| {
        let value = if c.is_one_sided { c.value(moved).min(0.0) } else { c.value(moved) };
        0.5 * c.stiffness * value * value
    };
    parts + contacts(model, plan).iter().map(of_contact).sum::<f64>() - dot(&forces(model, plan, pulls), moved)
}

/// The pulls as forces on the motions.
fn forces(model: &SurfaceModel, plan: &[Meeting], pulls: &[Vec3]) -> Vec<f64> {
    let mut force = vec![0.0; model.n_rows];
    for (i, (station, meeting)) in model.assembly.stations.iter().zip(plan).enumerate() {
        if let Some(joint) = meeting.joint {
            let gradient = gap(station, Side::A, -model.params.strip_mm() * joint.leaves, pulls[i]);
            force[first_row(i, 0)..].iter_mut().zip(gradient).for_each(|(f, g)| *f += g);
        }
    }
    force
}

/// The parts' own stiffness; those of parts that are held tie their motions to their place.
fn stiffness_of_parts(model: &SurfaceModel, is_held: &[bool]) -> SparseSymmetric {
    let mut matrix = model.pattern.clone();
    let values = matrix.values_mut();
    for (i, (part, places)) in model.parts.iter().zip(&model.places).enumerate() {
        let m = part.rows.len();
        if is_held.get(i).is_some_and(|h| *h) {
            let tie = HELD_SHARE * model.params.contact_n_mm(1.0);
            (0..m).for_each(|j| values[places[j * (j + 3) / 2] as usize] += tie);
        } else {
            let upper = (0..m).flat_map(|column| (0..=column).map(move |row| (row, column)));
            upper.zip(places).for_each(|((r, c), &place)| values[place as usize] += part.stiffness[(r, c)]);
        }
    }
    matrix
}

/// Motions with the least energy, steps taken, and what is left of the force as a share of it.
fn minimise(
    model: &SurfaceModel,
    rigid: &SparseSymmetric,
    contacts: &[Contact],
    force: &[f64],
) -> Result<(Vec<f64>, usize, f64), SparseError> {
    let mut moved = vec![0.0; force.len()];
    let mut residual = force.to_vec();
    let size = dot(force, force).sqrt();
    let mut n_iterations = 0;
    let mut error = if size > 0.0 { 1.0 } else { 0.0 };
    while error > model.params.tolerance && n_iterations < model.params.max_iterations {
        let mut tangent = rigid.clone();
        for c in contacts.iter().filter(|c| !c.is_one_sided || c.value(&moved) <= 0.0) {
            add_contact(model, &mut tangent, c);
        }
        let mut step = residual.clone();
        Cholesky::in_order(&model.order, &tangent)?.solve_in_place(&mut step);
        go_along(rigid, contacts, &step, &mut moved, &mut residual);
        error = dot(&residual, &residual).sqrt() / size;
        n_iterations += 1;
    }
    Ok((moved, n_iterations, error))
}

fn add_contact(model: &SurfaceModel, matrix: &mut SparseSymmetric, contact: &Contact) {
    let mut places = model.station_places[contact.station].iter();
    let values = matrix.values_mut();
    for (column, gc) in contact.gradient.into_iter().enumerate() {
        for gr in &contact.gradient[..=column] {
            let place = *places.next().expect("a place for each pair of motions") as usize;
            values[place] += contact.stiffness * gc * gr;
        }
    }
}

/// Goes along `step` to the least energy and updates what is left of the force.
fn go_along(rigid: &SparseSymmetric, contacts: &[Contact], step: &[f64], moved: &mut [f64], residual: &mut [f64]) {
    let stiff = rigid.times(step);
    let lines: Vec<[f64; 2]> = contacts.iter().map(|c| [c.value(moved), c.value(step)]).collect();
    let push = |c: &Contact, [a, b]: [f64; 2], length: f64| {
        let x = a + length * b;
        c.stiffness * if c.is_one_sided { x.min(0.0) } else { x }
    };
    let (linear, curved) = (-dot(residual, step), dot(&stiff, step));
    let mut length = 0.0;
    for _ in 0..LINE_STEPS {
        let (mut slope, mut curve) = (linear + curved * length, curved);
        for (c, &line) in contacts.iter().zip(&lines) {
            slope += line[1] * (push(c, line, length) - push(c, line, 0.0));
            let touches = !c.is_one_sided || line[0] + length * line[1] < 0.0;
            curve += if touches { c.stiffness * line[1] * line[1] } else { 0.0 };
        }
        if slope.abs() <= 1e-12 * linear.abs() || curve <= 0.0 {
            break;
        }
        length -= slope / curve;
    }
    moved.iter_mut().zip(step).for_each(|(q, p)| *q += length * p);
    residual.iter_mut().zip(&stiff).for_each(|(r, f)| *r -= length * f);
    for (c, &line) in contacts.iter().zip(&lines) {
        c.push(push(c, line, 0.0) - push(c, line, length), residual);
    }
}

/// The distances between the tips of both sides.
fn rated(model: &SurfaceModel, plan: &[Meeting], moved: &[f64]) -> Opening {
    let opening = |(i, (station, m)): (usize, (&Station, &Meeting))| {
        let Some(joint) = m.joint else { return 0.0 };
        let q = &moved[first_row(i, 0)..];
        let along = |g| {
            let gradient = gap(station, Side::A, -model.params.strip_mm() * joint.leaves, g);
            gradient.iter().zip(q).map(|(g, q)| g * q).sum::<f64>()
        };
        Vec3::from_array([station.tangent, station.normal, station.across].map(along)).length()
    };
    Opening::rated(plan, model.assembly.stations.iter().zip(plan).enumerate().map(opening).collect())
}

/// The parts at stations that opened too far, held ones left out, ascending.
fn lost_parts(model: &SurfaceModel, is_held: &[bool], opening: &Opening) -> Vec<u32> {
    let lost_mm = LOST_SIZES * model.params.connector_mm;
    let lost = |(station, d): (&Station, &f64)| (d.is_nan() || *d >= lost_mm).then_some(station.points);
    let points = model.assembly.stations.iter().zip(&opening.opening_mm).filter_map(lost).flatten();
    let mut parts: Vec<u32> = points.map(|p| model.assembly.part_of_point[p as usize]).collect();
    parts.retain(|p| !is_held.get(*p as usize).is_some_and(|h| *h));
    parts.sort_unstable();
    parts.dedup();
    parts
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}
