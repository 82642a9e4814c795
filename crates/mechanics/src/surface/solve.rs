//! Equilibrium of one plan: Newton's method with an exact line search on a convex, piecewise quadratic
//! energy.
//!
//! The unknowns are the contact forces μ. `r = D s` are the motions caused by forces s at the stations. With
//! `s = f − Gᵀ μ` the parts are in balance for any μ. The solution is the μ that matches the gaps: `μ = (G
//! r)⁻`.

use std::ops::Range;
use std::sync::Arc;

use shellock_geom::Vec3;
use shellock_geom::sparse::{SparseError, eliminate_first};
use shellock_geom::work::Count;

use super::contact::{ContactSpring, Law, N_CONTACTS, contacts_at, forces, gap};
use super::join::{ContactBody, Joinings, Reduced};
use super::parts::{Motions, N_MOTIONS, Part};
use super::{SurfaceModel, SurfaceParams, SurfaceSolution};
use crate::assembly::{Meeting, Opening, Side, Station};

/// Loads that were solved for joined parts.
pub static SOLVES: Count = Count::new("load_solves");

/// Newton steps of a line search. The slope is piecewise linear, and most searches end after two or three.
const LINE_STEPS: usize = 30;

/// Stiffness of held parts, relative to that of a contact one mm long.
const HELD_SHARE: f64 = 1e4;

/// Solves for `pulls`, N, on the tips of side a and, reversed, of side b.
pub(super) fn solve(
    model: &SurfaceModel,
    plan: &[Meeting],
    is_held: &[bool],
    pulls: &[Vec3],
) -> Result<SurfaceSolution, SparseError> {
    let layout = model.layout(is_held);
    let load = Load::of_pulls(model, plan, pulls);
    let balance = Jointed::new(model, &layout, plan)?.balance(&load, None)?;
    let opening = Opening::rate(plan, openings(model, plan, &balance.motions));
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
        n_iterations: balance.n_iterations,
        error: balance.error,
    })
}

/// Loads on the parts, without the contact forces.
#[derive(Clone, Debug)]
pub(super) struct Load {
    /// Forces between the sides of each station.
    pub sent: Vec<Motions>,
    /// Motion of side a relative to side b at each station by other forces if nothing joined the parts, mm.
    pub drift: Vec<Motions>,
    /// Force to which the residual is compared, N.
    pub scale_n: f64,
}

impl Load {
    /// Load of pulls on the tips of side a and, reversed, of side b, N.
    pub fn of_pulls(model: &SurfaceModel, plan: &[Meeting], pulls: &[Vec3]) -> Self {
        let sent = forces(model, plan, pulls);
        Self {
            scale_n: norm(&sent),
            drift: vec![[0.0; N_MOTIONS]; sent.len()],
            sent,
        }
    }
}

/// Data shared by all plans that hold the same parts: the stations of each part, and the order in which
/// contacts are eliminated.
#[derive(Debug)]
pub(super) struct Layout {
    is_held: Vec<bool>,
    bodies: Vec<Touched>,
    joinings: Joinings,
    /// Rank of each station in the elimination order; its N_CONTACTS contacts follow each other.
    rank: Vec<usize>,
    /// Compliance that the held parts add at each station, mm/N.
    held_compliance: Vec<f64>,
}

impl Layout {
    pub fn new(parts: &[Part], n_stations: usize, is_held: &[bool], held_mm_n: f64) -> Self {
        let touched = find_bodies(parts, n_stations, is_held);
        let (joinings, order) =
            Joinings::new(touched.iter().map(|t| t.stations.clone()).collect(), n_stations);
        let mut rank = vec![0; n_stations];
        order.iter().enumerate().for_each(|(i, s)| rank[*s as usize] = i);
        Self {
            is_held: is_held.to_vec(),
            joinings: joinings.of_groups(N_CONTACTS as u32),
            held_compliance: station_compliance(parts, n_stations, is_held, held_mm_n),
            bodies: touched,
            rank,
        }
    }
}

/// Contacts of one plan, and the parts as seen by them: shared by all loads.
#[derive(Clone)]
pub(super) struct Jointed<'a> {
    pub model: &'a SurfaceModel,
    layout: &'a Layout,
    /// Contacts, in the order in which they are eliminated.
    pub contacts: Vec<ContactSpring>,
    bodies: Vec<Arc<ContactBody>>,
    reduction: Arc<Reduced>,
}

/// State of least energy under a load.
#[derive(Clone, Debug)]
pub(super) struct Balance {
    /// Motion of side a relative to side b at each station.
    pub motions: Vec<Motions>,
    /// Force of each contact, in the square root of its stiffness times mm.
    pub forces: Vec<f64>,
    /// Forces between the sides of each station, including those of the contacts.
    pub sent: Vec<Motions>,
    /// Number of Newton steps taken.
    pub n_iterations: usize,
    /// Residual force, as a share of the force.
    pub error: f64,
}

impl<'a> Jointed<'a> {
    pub fn new(model: &'a SurfaceModel, layout: &'a Layout, plan: &[Meeting]) -> Result<Self, SparseError> {
        let contacts = contacts(model, layout, plan);
        let bodies = (layout.bodies.iter())
            .map(|t| Arc::new(body(model, layout, t, &contacts)))
            .collect();
        Self::of(model, layout, contacts, bodies, None)
    }

    /// Joins by another plan; parts whose contacts are unchanged are not computed again.
    pub fn rejoin(&self, plan: &[Meeting]) -> Result<Self, SparseError> {
        let contacts = contacts(self.model, self.layout, plan);
        let is_same = |s: &u32| {
            let own = own_contacts(self.layout, *s);
            contacts[own.clone()] == self.contacts[own]
        };
        let again = |(t, old): (&Touched, &Arc<ContactBody>)| {
            if t.stations.iter().all(is_same) {
                old.clone()
            } else {
                Arc::new(body(self.model, self.layout, t, &contacts))
            }
        };
        let bodies = self.layout.bodies.iter().zip(&self.bodies).map(again).collect();
        let before = Some((&self.bodies[..], &*self.reduction));
        Self::of(self.model, self.layout, contacts, bodies, before)
    }

    fn of(
        model: &'a SurfaceModel,
        layout: &'a Layout,
        contacts: Vec<ContactSpring>,
        bodies: Vec<Arc<ContactBody>>,
        before: Option<(&[Arc<ContactBody>], &Reduced)>,
    ) -> Result<Self, SparseError> {
        let laws: Vec<Law> = contacts.iter().map(|c| c.law).collect();
        let reduced = Arc::new(layout.joinings.reduce(&bodies, &laws, before)?);
        Ok(Self {
            model,
            layout,
            contacts,
            bodies,
            reduction: reduced,
        })
    }

    /// Solves for the balance under `load`, starting from the contacts in `closed`. Without `closed`, all
    /// contacts that only push start by the sign of their gap, which takes three steps fewer than starting
    /// with all closed.
    pub fn balance(&self, load: &Load, closed: Option<&[bool]>) -> Result<Balance, SparseError> {
        SOLVES.add(1);
        let Self {
            model,
            layout: Layout { is_held, .. },
            contacts,
            reduction: reduced,
            ..
        } = self;
        let mut all = gaps(
            contacts,
            &add_motions(&load.drift, answer(model, is_held, &load.sent)),
        );
        reduced.begin(&mut all);
        let pushing: Vec<ContactSpring> = reduced.pushes.iter().map(|c| contacts[*c as usize]).collect();
        let mut gaps: Vec<f64> = reduced.pushes.iter().map(|c| all[*c as usize]).collect();
        let mut borne = vec![0.0; gaps.len()];
        let mut is_closed: Vec<bool> = match closed {
            Some(closed) => reduced.pushes.iter().map(|c| closed[*c as usize]).collect(),
            None => gaps.iter().map(|g| *g <= 0.0).collect(),
        };
        let (mut n_iterations, mut error) = (0, if load.scale_n > 0.0 { 1.0 } else { 0.0 });
        while error > model.params.tolerance && n_iterations < model.params.max_iterations {
            let step = step(&reduced.compliance, &is_closed, &borne, &gaps)?;
            let opened = open_gaps(&reduced.compliance, &step);
            let length = if n_iterations == 0 {
                1.0
            } else {
                length(&pushing, [&borne, &step], [&gaps, &opened])
            };
            borne.iter_mut().zip(&step).for_each(|(b, s)| *b += length * s);
            gaps.iter_mut().zip(&opened).for_each(|(g, o)| *g += length * o);
            let pressed = pushing.iter().zip(&gaps).map(|(c, g)| c.active_gap(*g));
            let left: Vec<f64> = borne.iter().zip(pressed).map(|(b, p)| b - p).collect();
            error = norm(&less(&pushing, vec![[0.0; N_MOTIONS]; load.sent.len()], &left)) / load.scale_n;
            is_closed = pushing.iter().zip(&gaps).map(|(c, g)| c.is_closed(*g)).collect();
            n_iterations += 1;
        }
        reduced
            .pushes
            .iter()
            .zip(&borne)
            .for_each(|(c, b)| all[*c as usize] = *b);
        reduced.finish(&mut all);
        let sent = less(contacts, load.sent.clone(), &all);
        Ok(Balance {
            motions: add_motions(&load.drift, answer(model, is_held, &sent)),
            forces: all,
            sent,
            n_iterations,
            error,
        })
    }
}

/// Range of a station's contacts in the elimination order.
fn own_contacts(layout: &Layout, station: u32) -> Range<usize> {
    let first = N_CONTACTS * layout.rank[station as usize];
    first..first + N_CONTACTS
}

/// Contacts of a plan, in the order in which they are eliminated.
fn contacts(model: &SurfaceModel, layout: &Layout, plan: &[Meeting]) -> Vec<ContactSpring> {
    let mut contacts: Vec<Option<ContactSpring>> = vec![None; N_CONTACTS * plan.len()];
    for (i, meeting) in plan.iter().enumerate() {
        let own = contacts[own_contacts(layout, i as u32)].iter_mut();
        own.zip(contacts_at(model, i, meeting))
            .for_each(|(place, c)| *place = Some(c));
    }
    contacts.into_iter().flatten().collect()
}

fn add_motions(to: &[Motions], mut motions: Vec<Motions>) -> Vec<Motions> {
    motions.iter_mut().zip(to).for_each(|(m, t)| add(m, 1.0, t));
    motions
}

/// Changes of the contact forces that balance the closed contacts; `compliance` relates the contacts to each
/// other. It solves for differences only, since rounding errors are in proportion to the force that the soft
/// ground springs take.
fn step(
    compliance: &[f64],
    is_closed: &[bool],
    borne: &[f64],
    gaps: &[f64],
) -> Result<Vec<f64>, SparseError> {
    let n = borne.len();
    let mut step: Vec<f64> = borne
        .iter()
        .zip(is_closed)
        .map(|(b, closed)| if *closed { 0.0 } else { -b })
        .collect();
    let opened = open_gaps(compliance, &step);
    let closed: Vec<usize> = (0..n).filter(|i| is_closed[*i]).collect();
    // The lower triangle is column-major, with the right-hand side as the last row.
    let m = closed.len() + 1;
    let mut values = vec![0.0; m * m];
    for (j, &column) in closed.iter().enumerate() {
        let (source, target) = (
            &compliance[n * column..n * (column + 1)],
            &mut values[m * j..m * (j + 1)],
        );
        closed[j..]
            .iter()
            .zip(&mut target[j..])
            .for_each(|(i, t)| *t = source[*i]);
        target[j] += 1.0;
        target[m - 1] = opened[column] + gaps[column] - borne[column];
    }
    eliminate_first(&mut values, m, m - 1)?;
    for j in (0..m - 1).rev() {
        let column = &values[m * j..m * (j + 1)];
        let known: f64 = (closed[j + 1..].iter().zip(&column[j + 1..]))
            .map(|(i, l)| l * step[*i])
            .sum();
        step[closed[j]] = (column[m - 1] - known) / column[j];
    }
    Ok(step)
}

/// Step length with the least energy, from the contact forces and gaps, and the changes of both by the step.
fn length(contacts: &[ContactSpring], [borne, step]: [&[f64]; 2], [gaps, opened]: [&[f64]; 2]) -> f64 {
    let (mut length, mut first) = (0.0, None);
    for _ in 0..LINE_STEPS {
        let (mut slope, mut curve) = (0.0, 0.0);
        for (i, contact) in contacts.iter().enumerate() {
            let gap = gaps[i] + length * opened[i];
            let pressed = contact.active_gap(gap);
            slope += (pressed - borne[i] - length * step[i]) * opened[i];
            let is_pressed = contact.law == Law::Both || (contact.law == Law::Push && gap < 0.0);
            let stiffness = if is_pressed { opened[i] } else { 0.0 };
            curve += (stiffness - step[i]) * opened[i];
        }
        if slope.abs() <= 1e-12 * first.get_or_insert(slope).abs() || curve <= 0.0 {
            break;
        }
        length -= slope / curve;
    }
    length
}

/// Compliance of a held part, mm/N.
pub(super) fn held_compliance(params: &SurfaceParams) -> f64 {
    1.0 / (HELD_SHARE * params.contact_n_mm(params.connector_mm, 1.0))
}

/// Motion of side a relative to side b at each station under forces that pull them apart.
pub(super) fn answer(model: &SurfaceModel, is_held: &[bool], forces: &[Motions]) -> Vec<Motions> {
    let mut moved = vec![[0.0; N_MOTIONS]; forces.len()];
    for (i, part) in model.parts.iter().enumerate() {
        if is_held.get(i).is_some_and(|h| *h) {
            for &s in &part.stations {
                add(
                    &mut moved[s as usize],
                    held_compliance(&model.params),
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
            .filter(|(_, force)| *force != 0.0)
        {
            add(&mut own, force, column);
        }
        for (&s, own) in part.stations.iter().zip(own.chunks_exact(N_MOTIONS)) {
            add(&mut moved[s as usize], 1.0, own);
        }
    }
    moved
}

/// Body that a plan's contacts touch: a free part, or a station between held parts only.
#[derive(Debug)]
struct Touched {
    stations: Vec<u32>,
    part: Option<usize>,
}

fn find_bodies(parts: &[Part], n_stations: usize, is_held: &[bool]) -> Vec<Touched> {
    let is_held = |part: usize| is_held.get(part).is_some_and(|h| *h);
    let mut touched: Vec<_> = (parts.iter().enumerate())
        .filter(|(i, _)| !is_held(*i))
        .map(|(i, part)| Touched {
            stations: part.stations.clone(),
            part: Some(i),
        })
        .collect();
    let mut is_free = vec![false; n_stations];
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

/// Compliance that the held parts add at each station, mm/N.
fn station_compliance(parts: &[Part], n_stations: usize, is_held: &[bool], held_mm_n: f64) -> Vec<f64> {
    let mut given = vec![0.0; n_stations];
    for (part, _) in parts.iter().zip(is_held).filter(|(_, is_held)| **is_held) {
        part.stations.iter().for_each(|s| given[*s as usize] += held_mm_n);
    }
    given
}

/// Body as seen by the contacts, with the compliance that held parts add.
fn body(model: &SurfaceModel, layout: &Layout, touched: &Touched, contacts: &[ContactSpring]) -> ContactBody {
    let n = N_MOTIONS * touched.stations.len();
    // Stations in the order of the contacts, with the offset of each station in the part.
    let mut stations: Vec<(Range<usize>, usize)> = touched
        .stations
        .iter()
        .map(|s| own_contacts(layout, *s))
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
            if contact.law == Law::Absent {
                compliance.resize(compliance.len() + ids.len(), 0.0);
                continue;
            }
            moved.fill(0.0);
            let columns = touched
                .part
                .map_or(&[][..], |p| &model.parts[p].compliance.as_slice()[n * place..]);
            columns
                .chunks_exact(n)
                .zip(&contact.gradient)
                .for_each(|(column, g)| add(&mut moved, *g, column));
            add(
                &mut moved[*place..],
                layout.held_compliance[contact.station],
                &contact.gradient,
            );
            for (range, place) in &stations {
                let moved = &moved[*place..*place + N_MOTIONS];
                compliance.extend(contacts[range.clone()].iter().map(|c| dot(&c.gradient, moved)));
            }
        }
    }
    ContactBody {
        contacts: ids,
        compliance,
    }
}

/// Changes of the gaps when the contact forces grow by `borne`.
fn open_gaps(compliance: &[f64], borne: &[f64]) -> Vec<f64> {
    let n = borne.len();
    let mut opened = vec![0.0; n];
    for (column, b) in compliance.chunks_exact(n.max(1)).zip(borne) {
        if *b != 0.0 {
            add(&mut opened, -b, column);
        }
    }
    opened
}

fn gaps(contacts: &[ContactSpring], motions: &[Motions]) -> Vec<f64> {
    contacts
        .iter()
        .map(|c| dot(&c.gradient, &motions[c.station]))
        .collect()
}

/// Subtracts the contact forces from `force`.
fn less(contacts: &[ContactSpring], mut force: Vec<Motions>, borne: &[f64]) -> Vec<Motions> {
    contacts
        .iter()
        .zip(borne)
        .for_each(|(c, b)| add(&mut force[c.station], -b, &c.gradient));
    force
}

/// Distances between the tips of both sides, mm; 0 where there is no joint.
pub(super) fn openings(model: &SurfaceModel, plan: &[Meeting], motions: &[Motions]) -> Vec<f64> {
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
    let stations = model.assembly.stations.iter();
    stations.zip(plan).zip(motions).map(opening).collect()
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
