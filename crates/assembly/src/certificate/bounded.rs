//! Proofs of play in the form of the certificate.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::PatchId;
use crate::play::{KitPlay, Multipliers, Quantity};

/// Contact with an area: a point of `a` that cannot rise past `b` while it moves sideways within a region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BearingPoint {
    /// Piece that the point lies on.
    pub a: PatchId,
    /// Piece above the point.
    pub b: PatchId,
    /// Position of the point, mm.
    pub point: [f64; 3],
    /// Unit vector from `a` to `b`.
    pub normal: [f64; 3],
    /// Unit vector across the normal. Regions are octagons, whose first side lies in this direction.
    pub across: [f64; 3],
}

/// Claim that some pieces stay within bounds, with the proof. docs/notes/certificate.md has the theorem.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounded {
    /// Moving pieces, in ascending order; all others are held.
    pub free: Vec<PatchId>,
    /// Indices of the rotation and the displacement of each free piece among the quantities.
    pub of_piece: Vec<[usize; 2]>,
    /// Bounded rotations and displacements.
    pub quantities: Vec<Quantity>,
    /// Rows: a bearing, by its index in the certificate's list, and the quantities of its displacement and
    /// rotation.
    pub rows: Vec<[usize; 3]>,
    /// Multipliers of each quantity and each of its axes, against the axis and along it. They refer to rows
    /// by index in [`Bounded::rows`]; the row after the last is the key's slide.
    pub multipliers: Vec<Vec<[Multipliers; 2]>>,
}

/// Bearings that a kit's proofs use, each once, and the proofs.
pub(super) fn list_bounds(play: &KitPlay) -> (Vec<BearingPoint>, Vec<Bounded>) {
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
