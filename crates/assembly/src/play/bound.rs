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

mod round;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

use nalgebra::DVector;
use round::Round;
use serde::{Deserialize, Serialize};
use shellock_geom::Vec3;

use super::bearing::{Bearing, Surfaces};
use super::quantity::{Quantities, Quantity};
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
