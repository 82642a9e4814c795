//! Hold of a contact against the pushes of the verification, estimated before anything is built.
//!
//! The verification pushes every piece of the finished kit a small step in 66 directions. Each push must run
//! into the other pieces. Here the overlap is estimated from the seam samples that carry connectors. In the
//! cross-section of a connector, let ŝ be the direction in which the male leaves and `n` the perpendicular to
//! it. A motion `m` of the male then meets
//!
//! ```text
//!   along ±n:  a side of the channel   (|m·n| − c) · pin depth
//!   along −ŝ:  the floor               (−m·ŝ − c) · pin width
//!   along +ŝ:  nothing
//! ```
//!
//! A rail under a seam along s holds along ±N alone. Walls resist as well if the later piece is pushed at the
//! earlier one across a seam that does not lean.
//!
//! Limits: carving and obstructions shorten runs, which a single factor accounts for. Stops at the ends of
//! channels resist nothing here, since carving decides where they stand: plans that counted on them came out
//! loose.

use rayon::prelude::*;
use shellock_assembly::LatticeDirection;
use shellock_assembly::push::{self, N_PUSHES};
use shellock_geom::Vec3;
use shellock_mechanics::connector::{PIN_DEPTH, PIN_WIDTH};
use shellock_report::PatchId;

use super::sample::{Line, Sample, Way};
use crate::PlanParams;

/// Gap between walls, mm, and height of the wall that counts, mm: half of the usual 2 mm, since walls are
/// rounded and carved.
const WALL_GAP_MM: f64 = 0.1;
const WALL_HEIGHT_MM: f64 = 1.0;

/// Share of the estimated hold that counts: about four fifths of the length that a plan predicts are left,
/// and stops shorten the pins (docs/notes/metrics.md).
pub(super) const LEFT_SHARE: f64 = 0.6;

/// Hold of a contact in one order and direction, mm³ for each push: first of the later piece, then of the
/// earlier one.
pub type Pushes = [[f32; N_PUSHES]; 2];

/// Hold estimates of one contact for both orders and all directions.
#[derive(Clone, Debug, Default)]
pub struct BlockingTable(Vec<Pushes>);

impl BlockingTable {
    /// Builds the table of a contact between `pair` with these seams and connectors of `size_mm`.
    /// `holds(order, s)` tells if its runs are long enough there.
    pub(super) fn new(
        params: &PlanParams,
        size_mm: f64,
        pair: [PatchId; 2],
        lines: &[&Line],
        holds: impl Fn(usize, LatticeDirection) -> bool + Sync,
    ) -> Self {
        let pushes = push::directions();
        let cases: Vec<(usize, LatticeDirection)> = [0, 1]
            .into_iter()
            .flat_map(|order| LatticeDirection::all().map(move |s| (order, s)))
            .collect();
        let table = cases.into_par_iter().map(|(order, s)| {
            let mut held = [[0.0; N_PUSHES]; 2];
            let side = if order == 0 { 1.0 } else { -1.0 };
            let way = Way::new(params, pair, side, s);
            if holds(order, s) {
                for line in lines {
                    let runs = line.runs(way).into_iter().filter(|run| run.is_made(size_mm));
                    for i in runs.flat_map(|run| run.samples) {
                        add(params, size_mm, &line.samples[i], way, &pushes, &mut held);
                    }
                }
            }
            held.map(|pushes| pushes.map(|mm3| mm3 as f32))
        });
        Self(table.collect())
    }

    /// A made-up table for tests; `held` gives mm³.
    #[cfg(test)]
    pub fn made_up(mut held: impl FnMut() -> f32) -> Self {
        Self(
            (0..2 * LatticeDirection::COUNT)
                .map(|_| [[(); N_PUSHES]; 2].map(|x| x.map(|()| held())))
                .collect(),
        )
    }

    /// Hold of the contact; `order` is 0 if the piece with the lower id is later. `None` if nothing was
    /// measured.
    pub fn pushes(&self, order: usize, s: LatticeDirection) -> Option<&Pushes> {
        self.0.get(order * LatticeDirection::COUNT + s.index())
    }
}

/// Adds the hold of the connector at `x`, mm³.
fn add(
    params: &PlanParams,
    size_mm: f64,
    x: &Sample,
    way: Way,
    pushes: &[Vec3; N_PUSHES],
    held: &mut [[f64; N_PUSHES]; 2],
) {
    let (side, s) = (way.side, way.s.unit());
    let (gap, step) = (params.clearance_mm, push::length_mm(params.clearance_mm));
    // The male leaves along +s if it is the later piece, else along −s. Its motion changes sign likewise.
    let role = if s.dot(x.normal) >= 0.0 { 1.0 } else { -1.0 };
    let leaves = (role * s).reject_from_normalized(x.tangent).normalize_or_zero();
    let n = leaves.cross(x.tangent);
    let across = side * x.across;
    let (depth, width) = (PIN_DEPTH * size_mm, PIN_WIDTH * size_mm - gap);
    let is_forward = s.dot(across) <= 0.0;
    for (held, sign) in held.iter_mut().zip([1.0, -1.0]) {
        for (held, &push) in held.iter_mut().zip(pushes) {
            let later = sign * step * push;
            let male = role * later;
            let sides = (male.dot(n).abs() - gap).max(0.0) * depth;
            let floor = (-male.dot(leaves) - gap).max(0.0) * width;
            let on_rail = || (later.dot(x.normal).abs() - gap).max(0.0) * width;
            let sides = if way.has_rail(x) { on_rail() } else { sides + floor };
            let walls = if is_forward {
                (later.dot(across) - WALL_GAP_MM).max(0.0) * WALL_HEIGHT_MM
            } else {
                0.0
            };
            *held += LEFT_SHARE * (sides + walls) * x.length_mm;
        }
    }
}
