//! Ids of pieces, and arrays that can only be indexed by them.

use std::marker::PhantomData;
use std::ops::{Index, IndexMut};

use serde::{Deserialize, Serialize};

/// Id of a patch of the outer surface, and of the piece that carries it: its index in a list, from 0.
///
/// People and files count from 1: [`Self::number`] is the number that is printed, and that serde writes and
/// reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(into = "u32", try_from = "u32")]
pub struct PatchId(pub u32);

impl PatchId {
    /// Number of the piece for people, from 1.
    pub fn number(self) -> u32 {
        self.0.saturating_add(1)
    }

    /// Piece with this number for people; `None` for 0.
    pub fn from_number(number: u32) -> Option<Self> {
        number.checked_sub(1).map(Self)
    }
}

impl From<PatchId> for u32 {
    fn from(id: PatchId) -> Self {
        id.number()
    }
}

impl TryFrom<u32> for PatchId {
    type Error = &'static str;

    fn try_from(number: u32) -> Result<Self, Self::Error> {
        Self::from_number(number).ok_or("pieces are numbered from 1")
    }
}

impl From<usize> for PatchId {
    fn from(i: usize) -> Self {
        Self(u32::try_from(i).expect("patches are counted in hundreds"))
    }
}

impl From<PatchId> for usize {
    fn from(id: PatchId) -> Self {
        id.0 as usize
    }
}

impl std::fmt::Display for PatchId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.number().fmt(f)
    }
}

/// A `Vec<T>` with one element per id, indexed by the id alone.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct IdVec<I, T> {
    items: Vec<T>,
    #[serde(skip)]
    id: PhantomData<I>,
}

impl<I: From<usize> + Into<usize>, T> IdVec<I, T> {
    /// Builds a vector of `n` elements, each made from its id.
    pub fn from_fn(n: usize, make: impl FnMut(I) -> T) -> Self {
        (0..n).map(I::from).map(make).collect()
    }

    /// Number of ids in the vector.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Returns true if there are no ids.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// All ids in order.
    pub fn ids(&self) -> impl Iterator<Item = I> + use<I, T> {
        (0..self.items.len()).map(I::from)
    }

    /// Ids and elements in order.
    pub fn iter(&self) -> impl Iterator<Item = (I, &T)> {
        self.items.iter().enumerate().map(|(i, x)| (I::from(i), x))
    }

    /// Elements in order of their ids.
    pub fn as_slice(&self) -> &[T] {
        &self.items
    }
}

impl<I, T> FromIterator<T> for IdVec<I, T> {
    fn from_iter<It: IntoIterator<Item = T>>(iter: It) -> Self {
        Self {
            items: iter.into_iter().collect(),
            id: PhantomData,
        }
    }
}

impl<I: Into<usize>, T> Index<I> for IdVec<I, T> {
    type Output = T;
    fn index(&self, id: I) -> &T {
        &self.items[id.into()]
    }
}

impl<I: Into<usize>, T> IndexMut<I> for IdVec<I, T> {
    fn index_mut(&mut self, id: I) -> &mut T {
        &mut self.items[id.into()]
    }
}
