//! Files count pieces from 1; lists count their places from 0.

use serde::de::Error;
use serde::{Deserialize, Deserializer};

/// The place of a piece.
pub fn place<'de, D: Deserializer<'de>>(from: D) -> Result<usize, D::Error> {
    before(usize::deserialize(from)?)
}

/// The places of pieces.
pub fn places<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<usize>, D::Error> {
    Vec::<usize>::deserialize(from)?.into_iter().map(before).collect()
}

/// The place of a piece, if one is named.
pub fn place_if_any<'de, D: Deserializer<'de>>(from: D) -> Result<Option<usize>, D::Error> {
    Option::<usize>::deserialize(from)?.map(before).transpose()
}

fn before<E: Error>(number: usize) -> Result<usize, E> {
    number
        .checked_sub(1)
        .ok_or_else(|| E::custom("pieces are numbered from 1"))
}

/// What people call the piece at a place.
pub fn of(place: usize) -> usize {
    place + 1
}
