//! Work that the process has done, for tests that limit it where they cannot limit time.

use std::collections::BTreeMap;

use shellock::plan::REVISIONS;
use shellock_geom::work;
use shellock_mechanics::surface::SOLVES;

/// Returns the counts of all kinds of work so far, by name.
pub fn counts() -> BTreeMap<&'static str, u64> {
    let others = [&SOLVES, &REVISIONS].map(work::Count::read);
    work::counts().into_iter().chain(others).collect()
}
