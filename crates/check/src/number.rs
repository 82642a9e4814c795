//! Conversion of piece numbers: files count from 1, lists from 0.

use serde::de::Error;
use serde::{Deserialize, Deserializer};

/// Reads the index of a piece.
pub fn place<'de, D: Deserializer<'de>>(from: D) -> Result<usize, D::Error> {
    before(usize::deserialize(from)?)
}

/// Reads the indices of pieces.
pub fn places<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<usize>, D::Error> {
    Vec::<usize>::deserialize(from)?.into_iter().map(before).collect()
}

/// Reads the index of a piece, if one is named.
pub fn place_if_any<'de, D: Deserializer<'de>>(from: D) -> Result<Option<usize>, D::Error> {
    Option::<usize>::deserialize(from)?.map(before).transpose()
}

fn before<E: Error>(number: usize) -> Result<usize, E> {
    number
        .checked_sub(1)
        .ok_or_else(|| E::custom("pieces are numbered from 1"))
}

/// Number of the piece at an index, from 1, as people count.
pub fn of(place: usize) -> usize {
    place + 1
}
