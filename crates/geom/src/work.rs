//! Counts of the work that the process has done, so that a test can limit work where it cannot limit time.
//!
//! Counts are those of the whole process. With one job at a time they follow from its input alone, on any
//! number of threads and any machine, except where rounding decides.

use std::sync::atomic::{AtomicU64, Ordering};

/// Count of one kind of work.
pub struct Count {
    name: &'static str,
    n: AtomicU64,
}

impl Count {
    /// Creates a count of nothing yet. `name` says what is counted, in words.
    pub const fn new(name: &'static str) -> Self {
        Self {
            name,
            n: AtomicU64::new(0),
        }
    }

    /// Adds `n` to the count.
    pub fn add(&self, n: usize) {
        self.n.fetch_add(n as u64, Ordering::Relaxed);
    }

    /// Returns the name and the count so far.
    pub fn read(&self) -> (&'static str, u64) {
        (self.name, self.n.load(Ordering::Relaxed))
    }
}

/// Unions, intersections, differences and splits of two or more volumes.
pub static BOOLEANS: Count = Count::new("booleans");
/// Triangles of their operands.
pub static BOOLEAN_TRIANGLES: Count = Count::new("boolean_triangles");
/// Convex hulls of points.
pub static HULLS: Count = Count::new("hulls");
/// Triangles of meshes that became volumes.
pub static VOLUME_TRIANGLES: Count = Count::new("volume_triangles");
/// Triangles that hierarchies of boxes were built over.
pub static INDEXED_TRIANGLES: Count = Count::new("indexed_triangles");

/// Returns the counts of this crate.
pub fn counts() -> [(&'static str, u64); 5] {
    [
        &BOOLEANS,
        &BOOLEAN_TRIANGLES,
        &HULLS,
        &VOLUME_TRIANGLES,
        &INDEXED_TRIANGLES,
    ]
    .map(Count::read)
}
