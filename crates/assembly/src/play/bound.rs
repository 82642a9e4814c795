//! Bounds of all that some pieces can do, found by iteration and proven by multipliers.
//!
//! An assumption says how far each of a few quantities goes. It says how far each bearing's point goes
//! sideways, so how high its barrier is, so what the linear program over all bearings allows. Where that is
//! within the assumption, no path from rest leaves it (docs/notes/certificate.md). Else the assumption is
//! widened to what was found and a little more, and tried again.
//!
//! Only few bearings end a motion, and only for these it matters how far they go: each round begins with the
//! pieces' own turns and displacements and goes on to the cells of the bearings that end these, until no more
//! are needed.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

use nalgebra::DVector;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::Vec3;

use super::bearing::{Bearing, Surfaces};
use super::quantity::{Quantities, Quantity, other_lines};
use crate::motion::{Corner, Freedom, Limits, System};
use crate::verify::contact::Contact;
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Widenings of an assumption before it is given up.
const ROUNDS: usize = 20;
/// What goes farther is not held, mm and rad.
const MOST_SHIFT_MM: f64 = 6.0;
const MOST_TURN: f64 = 0.3;
/// By how much more an assumption is widened than what was found, as a share, and mm or rad.
const WIDER: f64 = 1.05;
const WIDER_MM: f64 = 0.004;
const WIDER_RAD: f64 = 0.0002;
/// Turns count as displacements at this distance, mm.
const LENGTH_MM: f64 = 50.0;
/// Each quantity goes both ways along three axes.
const WAYS: usize = 6;
/// What rounding may add to a bound, as a share of it and mm or rad.
const ROUNDING: f64 = 1e-6;

/// How far the key may have slid on its way out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Slide {
    /// The key.
    pub key: PatchId,
    /// The piece that it is measured against.
    pub seat: PatchId,
    /// The place of the key that is measured, mm.
    pub at: [f64; 3],
    /// Its way out, a unit vector.
    pub along: [f64; 3],
    /// How far, mm.
    pub most_mm: f64,
}

/// Rows by their places, with multipliers, which are positive.
pub type Multipliers = Vec<(usize, f64)>;

/// The proof that some pieces go no farther than told.
#[derive(Clone, Debug)]
pub struct Proof {
    /// Who moves, in ascending order; all others are held.
    pub free: Vec<PatchId>,
    /// The places of the turn and the displacement of each free piece among the quantities.
    pub of_piece: Vec<[usize; 2]>,
    /// What is bounded.
    pub quantities: Vec<Quantity>,
    /// The bearings that end motions, by their place in the list of all, each with the quantities of its cell
    /// and its turn.
    pub rows: Vec<(usize, [usize; 2])>,
    /// For each quantity and axis, against it and along it: rows with multipliers. The row after the last is
    /// the slide.
    pub multipliers: Vec<Vec<[Multipliers; 2]>>,
}

/// What became of a question.
pub(super) struct Answer {
    /// How far each free piece goes where sideways moves and turns are taken as none: its displacement, mm,
    /// and its turn, rad; empty where something has no end.
    pub linear: Vec<[f64; 2]>,
    /// Motions of the one free piece that go there: displacement of its centre, mm, and turn, rad; empty
    /// where several are free.
    pub swings: Vec<[f64; 6]>,
    /// The bearings that hold, of those that were asked in any round.
    pub asked: BTreeSet<usize>,
    /// The proof, or why there is none.
    pub proof: Result<Proof, Open>,
}

impl Answer {
    /// The same, where the bearings it was found of follow `n_before` others.
    pub fn after(self, n_before: usize) -> Self {
        let proof = self.proof.map(|proof| Proof {
            rows: proof
                .rows
                .into_iter()
                .map(|(bearing, quantities)| (n_before + bearing, quantities))
                .collect(),
            ..proof
        });
        Self {
            asked: self.asked.into_iter().map(|bearing| n_before + bearing).collect(),
            proof,
            ..self
        }
    }
}

/// Why a proof does not close.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Open {
    /// Something goes too far, or has no end.
    Far,
    /// Widening came to no end.
    Rounds,
}

/// Which bearings are looked at.
#[derive(Clone, Copy)]
pub(super) enum Candidates<'a> {
    /// All of the free pieces.
    All,
    /// Of these, the free pieces' own.
    Some(&'a BTreeSet<usize>),
}

/// The question: who is free, and what is known of bearings.
pub(super) struct Problem<'a> {
    pub surfaces: &'a Surfaces,
    /// All there are.
    pub bearings: &'a [Bearing],
    /// Those that are looked at.
    pub candidates: Candidates<'a>,
    pub centers: &'a IdVec<PatchId, Vec3>,
    pub slide: &'a Slide,
    /// In ascending order.
    pub free: &'a [PatchId],
    /// How far every face stands back, mm: printed thin. Proofs are of faces as they are, 0.
    pub set_back_mm: f64,
}

/// What one round found of a quantity: for each axis, against it and along it, the multipliers; or that it
/// has no end.
type Ends = Vec<[Option<Multipliers>; 2]>;

/// What ends one way of a quantity, if anything does, and the motion that goes there.
type End = (Option<Multipliers>, DVector<f64>);

/// What a round found: what ends each quantity that matters, and all motions that go there.
struct Found {
    ends: BTreeMap<usize, Ends>,
    motions: Vec<DVector<f64>>,
}

impl Problem<'_> {
    fn is_free(&self, p: PatchId) -> bool {
        self.free.binary_search(&p).is_ok()
    }

    /// The bearings of the free pieces that are looked at, by their place among all.
    fn own(&self) -> Vec<usize> {
        let is_candidate = |i: usize| match self.candidates {
            Candidates::All => true,
            Candidates::Some(some) => some.contains(&i),
        };
        let is_own = |i: usize| self.is_free(self.bearings[i].a) || self.is_free(self.bearings[i].b);
        (0..self.bearings.len())
            .filter(|&i| is_own(i) && is_candidate(i))
            .collect()
    }

    /// How far each free piece goes where sideways moves and turns are taken as none, as in [`Answer::linear`].
    pub fn small_motions(&self) -> Vec<[f64; 2]> {
        let bearings: Vec<Bearing> = self.own().iter().map(|&i| self.bearings[i]).collect();
        let quantities = Quantities::new(self.free, self.centers, &bearings);
        let beds: Vec<OnceLock<bool>> = bearings.iter().map(|_| OnceLock::new()).collect();
        let round = Round::new(self, &bearings, &quantities, &beds);
        round
            .ends()
            .map_or_else(Vec::new, |found| quantities.linear(&round.found(&found.ends)))
    }

    /// Looks for the proof. The answer is a function of the question alone, on any number of threads.
    pub fn solve(&self, ctx: &Ctx) -> Result<Answer, Cancelled> {
        let own = self.own();
        let bearings: Vec<Bearing> = own.iter().map(|&i| self.bearings[i]).collect();
        let mut quantities = Quantities::new(self.free, self.centers, &bearings);
        let beds: Vec<OnceLock<bool>> = bearings.iter().map(|_| OnceLock::new()).collect();
        let mut answer = Answer {
            linear: Vec::new(),
            swings: Vec::new(),
            asked: BTreeSet::new(),
            proof: Err(Open::Rounds),
        };
        let open = |answer: Answer, why: Open| {
            Ok(Answer {
                proof: Err(why),
                ..answer
            })
        };
        for n_before in 0..ROUNDS {
            ctx.check()?;
            let round = Round::new(self, &bearings, &quantities, &beds);
            let Some(Found { ends, motions }) = round.ends() else {
                return open(answer, Open::Far);
            };
            let guesses = round.guesses(&ends, &motions);
            let found = round.found(&ends);
            let is_within = |(&q, found): (&usize, &Vec<[f64; 2]>)| {
                found
                    .iter()
                    .zip(&quantities.all[q].most)
                    .all(|(f, a)| f[0] <= a[0] && f[1] <= a[1])
            };
            if n_before == 0 {
                answer.linear = quantities.linear(&found);
                answer.swings = self.swings(&motions);
            }
            answer.asked.extend(round.holding().map(|i| own[i]));
            if found.iter().all(is_within) {
                let proof = Ok(round.proof(&own, ends, found));
                return Ok(Answer { proof, ..answer });
            }
            // What no bearing needed yet is assumed to go as far as in the motions that were found.
            for (q, found) in found.into_iter().chain(guesses) {
                let quantity = &mut quantities.all[q];
                let (most, least) = if quantity.at.is_some() {
                    (MOST_SHIFT_MM, WIDER_MM)
                } else {
                    (MOST_TURN, WIDER_RAD)
                };
                for (assumed, found) in quantity.most.iter_mut().flatten().zip(found.iter().flatten()) {
                    if *found > *assumed {
                        *assumed = found * WIDER + least;
                    }
                    if *assumed > most {
                        return open(answer, Open::Far);
                    }
                }
            }
        }
        Ok(answer)
    }
}

impl Problem<'_> {
    /// The motions that go farthest along the axes of a piece's own quantities, which are asked first.
    fn swings(&self, motions: &[DVector<f64>]) -> Vec<[f64; 6]> {
        let n_own = if self.free.len() == 1 { 2 * WAYS } else { 0 };
        let swing = |m: &DVector<f64>| std::array::from_fn(|k| if k < 3 { m[k] } else { m[k] / LENGTH_MM });
        motions.iter().take(n_own).map(swing).collect()
    }
}

/// One assumption, and the linear program that it makes.
struct Round<'a> {
    problem: &'a Problem<'a>,
    bearings: &'a [Bearing],
    quantities: &'a Quantities,
    beds: &'a [OnceLock<bool>],
    center: Vec3,
    system: System,
    errors_mm: Vec<f64>,
    /// Bounds of rows, as far as they were asked for.
    told: Vec<OnceLock<f64>>,
}

impl<'a> Round<'a> {
    fn new(
        problem: &'a Problem<'a>,
        bearings: &'a [Bearing],
        quantities: &'a Quantities,
        beds: &'a [OnceLock<bool>],
    ) -> Self {
        let centers = problem.centers;
        let center = problem.free.iter().map(|&p| centers[p]).sum::<Vec3>() / problem.free.len() as f64;
        let errors_mm: Vec<f64> = bearings
            .iter()
            .zip(&quantities.places)
            .map(|(b, p)| quantities.error_mm(b, p, centers))
            .collect();
        let contact = |a, b, point: Vec3, normal, gap_mm| Contact {
            a,
            b,
            point: point - center,
            normal,
            gap_mm,
            area_mm2: 0.0,
        };
        let mut contacts: Vec<Contact> = bearings
            .iter()
            .map(|b| contact(b.a, b.b, b.point, b.normal, b.gap_mm))
            .collect();
        let slide = problem.slide;
        if problem.is_free(slide.key) {
            contacts.push(contact(
                slide.key,
                slide.seat,
                slide.at.into(),
                slide.along.into(),
                slide.most_mm,
            ));
        }
        let system = System::new(&contacts, problem.free, LENGTH_MM, Freedom::Rigid);
        let told = system.rows.iter().map(|_| OnceLock::new()).collect();
        Self {
            problem,
            bearings,
            quantities,
            beds,
            center,
            system,
            errors_mm,
            told,
        }
    }

    /// The least that a row's bound can be.
    fn least_mm(&self, row: usize) -> f64 {
        let i = self.system.rows[row].contact;
        self.bearings.get(i).map_or_else(
            || self.slide_mm(),
            |b| b.gap_mm + self.set_back_mm() + self.errors_mm[i],
        )
    }

    /// How much wider a gap is than it looks: both faces stand back.
    fn set_back_mm(&self) -> f64 {
        2.0 * self.problem.set_back_mm
    }

    /// What bounds the slide, which is measured like the point of a bearing.
    fn slide_mm(&self) -> f64 {
        let (slide, q) = (self.problem.slide, self.quantities);
        let of = |p: PatchId| {
            q.of_piece
                .get(&p)
                .map(|[w, u]| (q.all[*w].norm(), q.all[*u].norm()))
        };
        let at = Vec3::from(slide.at);
        let far = |p: PatchId| of(p).map_or(0.0, |(w, u)| u + w * at.distance(self.problem.centers[p]));
        let (key, seat) = (
            of(slide.key).map_or(0.0, |k| k.0),
            of(slide.seat).map_or(0.0, |s| s.0),
        );
        slide.most_mm + 0.5 * seat * (far(slide.key) + far(slide.seat)) + 0.5 * (key + seat) * far(slide.key)
    }

    /// A row's bound: how far its bearing's point rises, and the error.
    fn bound_mm(&self, row: usize) -> f64 {
        *self.told[row].get_or_init(|| self.measured_mm(row))
    }

    /// The bearings that were asked and hold.
    fn holding(&self) -> impl Iterator<Item = usize> + '_ {
        let is_held = |row: &usize| self.told[*row].get().is_some_and(|mm| mm.is_finite());
        let contact = |row: usize| self.system.rows[row].contact;
        (0..self.told.len())
            .filter(is_held)
            .map(contact)
            .filter(|&i| i < self.bearings.len())
    }

    fn measured_mm(&self, row: usize) -> f64 {
        let i = self.system.rows[row].contact;
        let Some(b) = self.bearings.get(i) else {
            return self.slide_mm();
        };
        let surfaces = self.problem.surfaces;
        if !*self.beds[i].get_or_init(|| surfaces.has_bed(b)) {
            return f64::INFINITY;
        }
        let region = self
            .quantities
            .region(b, &self.quantities.places[i], self.errors_mm[i]);
        surfaces.rise_mm(b, &region).map_or(f64::INFINITY, |rise_mm| {
            rise_mm + self.set_back_mm() + self.errors_mm[i]
        })
    }

    /// What ends each quantity that matters, and the motions that go there; `None` where one has no end.
    fn ends(&self) -> Option<Found> {
        let least: Vec<f64> = (0..self.system.rows.len())
            .map(|row| self.least_mm(row))
            .collect();
        let late = |row: usize| self.bound_mm(row);
        let limits = Limits::late(&self.system, &least, &late);
        let start = Corner::new(&limits);
        // One after the other where they are small, else one lane a way: each begins where its last one
        // ended.
        let n_lanes = if self.problem.free.len() > 1 { WAYS } else { 1 };
        let mut lanes = vec![start; n_lanes];
        let mut ends: BTreeMap<usize, Ends> = BTreeMap::new();
        let mut wanted: BTreeSet<usize> = self.quantities.of_piece.values().flatten().copied().collect();
        let mut motions = Vec::new();
        while !wanted.is_empty() {
            let of_lane = |(lane, corner): (usize, &mut Corner<'_>)| -> Vec<End> {
                let ways = (lane..WAYS).step_by(n_lanes);
                ways.flat_map(|way| wanted.iter().map(move |&q| (q, way)))
                    .map(|(q, way)| (self.objective(q, way / 2, way % 2), self.is_of_piece(q)))
                    .map(|(towards, is_of_piece)| {
                        let rows = if is_of_piece {
                            corner.ended(&towards)
                        } else {
                            corner.ended_by_known(&towards)
                        };
                        (rows, DVector::from_column_slice(corner.motion()))
                    })
                    .collect()
            };
            let found: Vec<Vec<_>> = lanes.par_iter_mut().enumerate().map(of_lane).collect();
            let mut needed = BTreeSet::new();
            for (lane, found) in found.into_iter().enumerate() {
                let asked = (lane..WAYS)
                    .step_by(n_lanes)
                    .flat_map(|way| wanted.iter().map(move |&q| (q, way)));
                for ((q, way), (rows, motion)) in asked.zip(found) {
                    let rows = rows?;
                    motions.push(motion);
                    let contact = |row: usize| self.system.rows[row].contact;
                    let places = rows
                        .iter()
                        .filter_map(|(row, _)| self.quantities.places.get(contact(*row)));
                    places.for_each(|place| needed.extend([place.cell, place.turn]));
                    let ends = ends.entry(q).or_insert_with(|| vec![[None, None]; 3]);
                    ends[way / 2][way % 2] = Some(rows);
                }
            }
            wanted = needed.into_iter().filter(|q| !ends.contains_key(q)).collect();
            // What one lane looked at, all know: the rest is bounded by known rows.
            let known: BTreeSet<usize> = lanes.iter().flat_map(Corner::looked_at).collect();
            lanes
                .par_iter_mut()
                .for_each(|corner| known.iter().for_each(|&row| corner.look_at(row)));
        }
        Some(Found { ends, motions })
    }

    /// How far the quantities that no bearing needed go in these motions.
    fn guesses(&self, ends: &BTreeMap<usize, Ends>, motions: &[DVector<f64>]) -> Vec<(usize, Vec<[f64; 2]>)> {
        let all = 0..self.quantities.all.len();
        let unknown: Vec<usize> = all.filter(|q| !ends.contains_key(q)).collect();
        let farthest = |objective: DVector<f64>| motions.iter().map(|m| objective.dot(m)).fold(0.0, f64::max);
        let guess = |&q: &usize| {
            (
                q,
                (0..3)
                    .map(|axis| [0, 1].map(|side| farthest(self.objective(q, axis, side))))
                    .collect(),
            )
        };
        unknown.par_iter().map(guess).collect()
    }

    /// Whether the quantity is a piece's own: for these, all bearings are looked through.
    fn is_of_piece(&self, quantity: usize) -> bool {
        self.quantities
            .of_piece
            .values()
            .any(|of_piece| of_piece.contains(&quantity))
    }

    /// How far a quantity goes along an axis (`side` 1) or against it (0), as a function of the unknowns.
    fn objective(&self, quantity: usize, axis: usize, side: usize) -> DVector<f64> {
        let d = Vec3::from(self.quantities.all[quantity].axes[axis]);
        self.along(quantity, if side == 1 { d } else { -d })
    }

    /// How far a quantity goes along a direction, as a function of the unknowns.
    fn along(&self, quantity: usize, d: Vec3) -> DVector<f64> {
        let q = &self.quantities.all[quantity];
        let (velocity, spin) = match q.at {
            None => (Vec3::ZERO, d / LENGTH_MM),
            Some(at) => (d, (Vec3::from(at) - self.center).cross(d) / LENGTH_MM),
        };
        let mut objective = DVector::zeros(self.system.n);
        for (piece, sign) in [(q.plus, 1.0), (q.minus, -1.0)] {
            let Some(i) = piece.and_then(|p| self.problem.free.binary_search(&p).ok()) else {
                continue;
            };
            let at = self.system.column(i);
            for k in 0..3 {
                objective[at + k] += sign * velocity[k];
                objective[at + 3 + k] += sign * spin[k];
            }
        }
        objective
    }

    /// How far each quantity goes, for each axis against it and along it.
    fn found(&self, ends: &BTreeMap<usize, Ends>) -> BTreeMap<usize, Vec<[f64; 2]>> {
        ends.iter()
            .map(|(&q, ends)| (q, ends.iter().map(|e| self.values(q, e)).collect()))
            .collect()
    }

    /// How far the multipliers show that a quantity goes, against an axis and along it.
    fn values(&self, quantity: usize, ends: &[Option<Multipliers>; 2]) -> [f64; 2] {
        let least = if self.quantities.all[quantity].at.is_some() {
            ROUNDING
        } else {
            ROUNDING / LENGTH_MM
        };
        ends.each_ref().map(|rows| {
            let sum: f64 = rows
                .iter()
                .flatten()
                .map(|&(row, force)| force * self.bound_mm(row))
                .sum();
            sum.max(0.0) * (1.0 + ROUNDING) + least
        })
    }

    /// The proof that all quantities stay within what was `found`. A piece's own are bounded along more
    /// lines, by the rows that are known.
    fn proof(
        &self,
        own: &[usize],
        mut ends: BTreeMap<usize, Ends>,
        found: BTreeMap<usize, Vec<[f64; 2]>>,
    ) -> Proof {
        let mut quantities: BTreeMap<usize, Quantity> = BTreeMap::new();
        for (&q, most) in &found {
            quantities.insert(
                q,
                Quantity {
                    most: most.clone(),
                    ..self.quantities.all[q].clone()
                },
            );
        }
        self.add_lines(&mut quantities, &mut ends);
        let rows: BTreeSet<usize> = ends
            .values()
            .flatten()
            .flatten()
            .flatten()
            .flatten()
            .map(|r| r.0)
            .collect();
        let name_of: BTreeMap<usize, usize> = ends.keys().copied().zip(0..).collect();
        let contact = |row: usize| self.system.rows[row].contact;
        let of_bearings: Vec<usize> = rows
            .into_iter()
            .filter(|&row| contact(row) < self.bearings.len())
            .collect();
        let place: BTreeMap<usize, usize> = of_bearings.iter().copied().zip(0..).collect();
        let renamed = |rows: Option<Multipliers>| -> Multipliers {
            let name = |row: usize| place.get(&row).copied().unwrap_or(of_bearings.len());
            rows.into_iter()
                .flatten()
                .map(|(row, force)| (name(row), force))
                .collect()
        };
        let named = |row: &usize| {
            let p = &self.quantities.places[contact(*row)];
            (own[contact(*row)], [name_of[&p.cell], name_of[&p.turn]])
        };
        Proof {
            free: self.problem.free.to_vec(),
            of_piece: self
                .quantities
                .of_piece
                .values()
                .map(|of_piece| of_piece.map(|q| name_of[&q]))
                .collect(),
            quantities: quantities.into_values().collect(),
            rows: of_bearings.iter().map(named).collect(),
            multipliers: ends
                .into_values()
                .map(|e| e.into_iter().map(|sides| sides.map(renamed)).collect())
                .collect(),
        }
    }

    /// Bounds the pieces' own quantities along the lattice's other lines, by rows that have a part in the
    /// proof already.
    fn add_lines(&self, quantities: &mut BTreeMap<usize, Quantity>, ends: &mut BTreeMap<usize, Ends>) {
        let known: BTreeSet<usize> = ends
            .values()
            .flatten()
            .flatten()
            .flatten()
            .flatten()
            .map(|r| r.0)
            .collect();
        let late = |row: usize| {
            if known.contains(&row) {
                self.bound_mm(row)
            } else {
                f64::INFINITY
            }
        };
        let gaps: Vec<f64> = (0..self.system.rows.len()).map(late).collect();
        let limits = Limits::new(&self.system, &gaps);
        let mut corner = Corner::new(&limits);
        for q in self.quantities.of_piece.values().flatten() {
            for line in other_lines() {
                let sides = [-line, line].map(|d| corner.ended(&self.along(*q, d)));
                if sides.iter().any(Option::is_none) {
                    continue;
                }
                let values = self.values(*q, &sides);
                if let (Some(quantity), Some(ends)) = (quantities.get_mut(q), ends.get_mut(q)) {
                    quantity.axes.push(line.to_array());
                    quantity.most.push(values);
                    ends.push(sides);
                }
            }
        }
    }
}
