//! Bounds on all motions of some pieces, found by iteration and proven by multipliers.
//!
//! An assumption bounds a few quantities. From it follow the region of each bearing's point, hence the height
//! of its barrier, hence the motions that the linear program over all bearings allows. If these are within
//! the assumption, no path from rest leaves it (docs/notes/certificate.md). Otherwise the assumption is
//! widened slightly beyond the result, and tried again.
//!
//! Only a few bearings end a motion, and only their regions matter. So each round begins with the pieces' own
//! rotations and displacements. It continues with the cells of the bearings that end these, until no more are
//! needed.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

use nalgebra::DVector;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::Vec3;

use super::bearing::{Bearing, Surfaces};
use super::quantity::{Quantities, Quantity, other_lines};
use crate::motion::{Corner, Freedom, Limits, System, farthest_of_piece};
use crate::verify::contact::Contact;
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Number of widenings of an assumption before it is given up.
const ROUNDS: usize = 20;
/// Limits above which a piece counts as not held, mm and rad.
const MOST_SHIFT_MM: f64 = 6.0;
const MOST_TURN: f64 = 0.3;
/// Margin of a widened assumption beyond the result, as a share, and in mm or rad.
const WIDER: f64 = 1.05;
const WIDER_MM: f64 = 0.004;
const WIDER_RAD: f64 = 0.0002;
/// Distance at which rotations count as displacements, mm.
const LENGTH_MM: f64 = 50.0;
/// Number of directions of a quantity: both ways along three axes.
const WAYS: usize = 6;
/// Margin of a bound for rounding, as a share of it and in mm or rad.
const ROUNDING: f64 = 1e-6;

/// Distance that the key may have slid on its way out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Slide {
    /// Key of the kit.
    pub key: PatchId,
    /// Piece against which the slide is measured.
    pub seat: PatchId,
    /// Point of the key that is measured, mm.
    pub at: [f64; 3],
    /// Way out of the key, a unit vector.
    pub along: [f64; 3],
    /// Greatest slide of the key, mm.
    pub most_mm: f64,
}

/// Rows by their indices, with positive multipliers.
pub type Multipliers = Vec<(usize, f64)>;

/// Proof that some pieces stay within stated bounds.
#[derive(Clone, Debug)]
pub struct Proof {
    /// Moving pieces, in ascending order; all others are held.
    pub free: Vec<PatchId>,
    /// Indices of the rotation and the displacement of each free piece among the quantities.
    pub of_piece: Vec<[usize; 2]>,
    /// Bounded rotations and displacements.
    pub quantities: Vec<Quantity>,
    /// Bearings that end motions, by their index in the list of all, each with the quantities of its cell and
    /// its rotation.
    pub rows: Vec<(usize, [usize; 2])>,
    /// Multipliers of the rows for each quantity and axis, against it and along it. The row after the last is
    /// the slide.
    pub multipliers: Vec<Vec<[Multipliers; 2]>>,
}

/// Answer to a question about play.
pub(super) struct Answer {
    /// Play of each free piece, neglecting the effects of sideways motions and rotations: displacement, mm,
    /// and rotation, rad. Empty if something is unlimited.
    pub linear: Vec<[f64; 2]>,
    /// Motions of the only free piece that go farthest along the axes: displacement of its centre, mm, and
    /// rotation, rad. Empty if several pieces are free.
    pub swings: Vec<[f64; 6]>,
    /// Bearings that hold, of those whose barrier was computed in any round.
    pub bearings: BTreeSet<usize>,
    /// Proof, or the reason why there is none.
    pub proof: Result<Proof, Open>,
}

impl Answer {
    /// Renumbers the answer for a list in which `n_before` other bearings come first.
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
            bearings: self
                .bearings
                .into_iter()
                .map(|bearing| n_before + bearing)
                .collect(),
            proof,
            ..self
        }
    }
}

/// Reasons why a proof does not close.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Open {
    /// A quantity is too large, or unlimited.
    Far,
    /// The widening did not converge.
    Rounds,
}

/// Set of bearings that are considered.
#[derive(Clone, Copy)]
pub(super) enum Candidates<'a> {
    /// All bearings of the free pieces.
    All,
    /// Bearings of the free pieces in this set.
    Some(&'a BTreeSet<usize>),
}

/// Question about play: the free pieces, and the known bearings.
pub(super) struct Problem<'a> {
    pub surfaces: &'a Surfaces,
    /// All bearings of the kit.
    pub bearings: &'a [Bearing],
    /// Bearings that are considered.
    pub candidates: Candidates<'a>,
    pub centers: &'a IdVec<PatchId, Vec3>,
    pub slide: &'a Slide,
    /// Free pieces, in ascending order.
    pub free: &'a [PatchId],
    /// Distance by which every face is set back, mm, as if printed thin. Proofs are about faces as they are,
    /// 0.
    pub set_back_mm: f64,
}

/// Result of one round for a quantity: the multipliers for each axis, against it and along it, or `None` if
/// it is unlimited.
type Ends = Vec<[Option<Multipliers>; 2]>;

/// Multipliers that end one direction of a quantity, if any, and the motion that goes farthest.
type End = (Option<Multipliers>, DVector<f64>);

/// Results of a round: the ends of each relevant quantity, and the motions that reach them.
struct Found {
    ends: BTreeMap<usize, Ends>,
    motions: Vec<DVector<f64>>,
}

impl Problem<'_> {
    fn is_free(&self, p: PatchId) -> bool {
        self.free.binary_search(&p).is_ok()
    }

    /// Bearings of the free pieces that are considered, by index in the list of all.
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

    /// Play of each free piece, neglecting the effects of sideways motions and rotations, as in
    /// [`Answer::linear`].
    pub fn small_motions(&self) -> Vec<[f64; 2]> {
        let bearings: Vec<Bearing> = self.own().iter().map(|&i| self.bearings[i]).collect();
        let quantities = Quantities::new(self.free, self.centers, &bearings);
        let beds: Vec<OnceLock<bool>> = bearings.iter().map(|_| OnceLock::new()).collect();
        let round = Round::new(self, &bearings, &quantities, &beds);
        round.small_motion().into_iter().collect()
    }

    /// Searches for the proof. The answer depends on the question alone, on any number of threads.
    pub fn solve(&self, ctx: &Ctx) -> Result<Answer, Cancelled> {
        let own = self.own();
        let bearings: Vec<Bearing> = own.iter().map(|&i| self.bearings[i]).collect();
        let mut quantities = Quantities::new(self.free, self.centers, &bearings);
        let beds: Vec<OnceLock<bool>> = bearings.iter().map(|_| OnceLock::new()).collect();
        let mut answer = Answer {
            linear: Vec::new(),
            swings: Vec::new(),
            bearings: BTreeSet::new(),
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
            let found = round.collect_bounds(&ends);
            let is_within = |(&q, found): (&usize, &Vec<[f64; 2]>)| {
                found
                    .iter()
                    .zip(&quantities.all[q].most)
                    .all(|(f, a)| f[0] <= a[0] && f[1] <= a[1])
            };
            if n_before == 0 {
                answer.linear = round.small_motion().into_iter().collect();
                answer.swings = self.swings(&motions);
            }
            answer.bearings.extend(round.bearings_that_hold().map(|i| own[i]));
            if found.iter().all(is_within) {
                let proof = Ok(round.proof(&own, ends, found));
                return Ok(Answer { proof, ..answer });
            }
            // Quantities that no bearing needed yet are assumed to be as large as in the motions that were
            // found.
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
    /// Motions that go farthest along the axes of a piece's own quantities, which are computed first.
    fn swings(&self, motions: &[DVector<f64>]) -> Vec<[f64; 6]> {
        let n_own = if self.free.len() == 1 { 2 * WAYS } else { 0 };
        let swing = |m: &DVector<f64>| std::array::from_fn(|k| if k < 3 { m[k] } else { m[k] / LENGTH_MM });
        motions.iter().take(n_own).map(swing).collect()
    }
}

/// One assumption, and the linear program that follows from it.
struct Round<'a> {
    problem: &'a Problem<'a>,
    bearings: &'a [Bearing],
    quantities: &'a Quantities,
    beds: &'a [OnceLock<bool>],
    center: Vec3,
    system: System,
    errors_mm: Vec<f64>,
    /// Bounds of rows, computed on demand.
    bounds: Vec<OnceLock<f64>>,
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
            bounds: told,
        }
    }

    /// Least possible bound of a row, mm.
    fn least_mm(&self, row: usize) -> f64 {
        let i = self.system.rows[row].contact;
        self.bearings.get(i).map_or_else(
            || self.slide_mm(),
            |b| b.gap_mm + self.set_back_mm() + self.errors_mm[i],
        )
    }

    /// Amount by which gaps are wider than the meshes show, mm: both faces are set back.
    fn set_back_mm(&self) -> f64 {
        2.0 * self.problem.set_back_mm
    }

    /// Bound of the slide, mm, which is measured like the point of a bearing.
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

    /// Bound of a row, mm: the height that its bearing's point can reach, plus the error.
    fn bound_mm(&self, row: usize) -> f64 {
        *self.bounds[row].get_or_init(|| self.measured_mm(row))
    }

    /// Bearings whose barrier was computed and that hold.
    fn bearings_that_hold(&self) -> impl Iterator<Item = usize> + '_ {
        let is_held = |row: &usize| self.bounds[*row].get().is_some_and(|mm| mm.is_finite());
        let contact = |row: usize| self.system.rows[row].contact;
        (0..self.bounds.len())
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

    /// Ends of each relevant quantity, and the motions that reach them; `None` if one is unlimited.
    fn ends(&self) -> Option<Found> {
        let least: Vec<f64> = (0..self.system.rows.len())
            .map(|row| self.least_mm(row))
            .collect();
        let late = |row: usize| self.bound_mm(row);
        let limits = Limits::late(&self.system, &least, &late);
        let start = Corner::new(&limits);
        // Small problems run in one lane, others in one lane per direction. Each solve begins where the last
        // one of its lane ended.
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
                            corner.maximise(&towards)
                        } else {
                            corner.maximise_from_cache(&towards)
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
            // All lanes learn the rows that one lane examined: the remaining quantities are bounded by known
            // rows.
            let known: BTreeSet<usize> = lanes.iter().flat_map(Corner::looked_at).collect();
            lanes
                .par_iter_mut()
                .for_each(|corner| known.iter().for_each(|&row| corner.look_at(row)));
        }
        Some(Found { ends, motions })
    }

    /// Displacement, mm, and rotation, rad, of the only free piece in the small motions that go farthest;
    /// `None` if several pieces are free, or if nothing limits this one.
    fn small_motion(&self) -> Option<[f64; 2]> {
        if self.problem.free.len() != 1 {
            return None;
        }
        let least: Vec<f64> = (0..self.system.rows.len())
            .map(|row| self.least_mm(row))
            .collect();
        let late = |row: usize| self.bound_mm(row);
        let limits = Limits::late(&self.system, &least, &late);
        let mut corner = Corner::new(&limits);
        let [shift_mm, turn] = farthest_of_piece(&mut corner, LENGTH_MM);
        Some([shift_mm?, turn?])
    }

    /// Greatest values in these motions of the quantities that no bearing needed.
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

    /// Returns true if the quantity is a piece's own. For these, all bearings are examined.
    fn is_of_piece(&self, quantity: usize) -> bool {
        self.quantities
            .of_piece
            .values()
            .any(|of_piece| of_piece.contains(&quantity))
    }

    /// Linear form of a quantity along an axis (`side` 1) or against it (0), in the unknowns.
    fn objective(&self, quantity: usize, axis: usize, side: usize) -> DVector<f64> {
        let d = Vec3::from(self.quantities.all[quantity].axes[axis]);
        self.along(quantity, if side == 1 { d } else { -d })
    }

    /// Linear form of a quantity along a direction, in the unknowns.
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

    /// Bounds of each quantity, against each axis and along it.
    fn collect_bounds(&self, ends: &BTreeMap<usize, Ends>) -> BTreeMap<usize, Vec<[f64; 2]>> {
        ends.iter()
            .map(|(&q, ends)| (q, ends.iter().map(|e| self.values(q, e)).collect()))
            .collect()
    }

    /// Bounds of a quantity that the multipliers prove, against an axis and along it.
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

    /// Builds the proof that all quantities stay within `found`. A piece's own quantities are also bounded
    /// along more lines, by the known rows.
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

    /// Bounds the pieces' own quantities along the other lines of the lattice, by rows that the proof already
    /// uses.
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
                let sides = [-line, line].map(|d| corner.maximise(&self.along(*q, d)));
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
