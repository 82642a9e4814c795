//! Proofs of play as they are written.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::PatchId;
use crate::play::{KitPlay, Multipliers, Quantity};

/// A contact with an area: a point of `a` that cannot rise past `b` while it moves sideways within a region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BearingPoint {
    /// The piece the point lies on.
    pub a: PatchId,
    /// The piece above it.
    pub b: PatchId,
    /// The point, mm.
    pub point: [f64; 3],
    /// Unit vector from `a` to `b`.
    pub normal: [f64; 3],
    /// Unit vector across it: regions are octagons whose first side is there.
    pub across: [f64; 3],
}

/// That some pieces stay within bounds, with the proof. docs/notes/certificate.md has the theorem.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounded {
    /// Who moves, in ascending order; all others are held.
    pub free: Vec<PatchId>,
    /// The places of the turn and the displacement of each free piece among the quantities.
    pub of_piece: Vec<[usize; 2]>,
    /// What is bounded.
    pub quantities: Vec<Quantity>,
    /// A bearing, by its place in the certificate's list, and the quantities that say how far it goes:
    /// displacement and turn.
    pub rows: Vec<[usize; 3]>,
    /// For each quantity and each of its axes: what bounds it against the axis, and along it, by places in
    /// [`Bounded::rows`]; the row after the last is the key's slide.
    pub multipliers: Vec<Vec<[Multipliers; 2]>>,
}

/// The bearings that a kit's proofs name, each once, and the proofs.
pub(super) fn bounded(play: &KitPlay) -> (Vec<BearingPoint>, Vec<Bounded>) {
    let mut place: BTreeMap<usize, usize> = BTreeMap::new();
    for (bearing, _) in play.proofs.iter().flat_map(|proof| &proof.rows) {
        place.entry(*bearing).or_default();
    }
    place.values_mut().zip(0..).for_each(|(place, i)| *place = i);
    let points = place.keys().map(|&i| {
        let b = &play.bearings[i];
        let [point, normal, across] = [b.point, b.normal, b.across()].map(|v| v.to_array());
        BearingPoint {
            a: b.a,
            b: b.b,
            point,
            normal,
            across,
        }
    });
    let claim = |proof: &crate::play::Proof| Bounded {
        free: proof.free.clone(),
        of_piece: proof.of_piece.clone(),
        quantities: proof.quantities.clone(),
        rows: proof
            .rows
            .iter()
            .map(|(bearing, [cell, turn])| [place[bearing], *cell, *turn])
            .collect(),
        multipliers: proof.multipliers.clone(),
    };
    (points.collect(), play.proofs.iter().map(claim).collect())
}
