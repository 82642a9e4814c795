//! Disjoint sets of numbered elements, as a forest of parents.

/// Root of the set that contains `v`. Paths become shorter on the way.
///
/// `parent[v]` is the parent of element `v`; roots are their own parents. Panics if `v` is no element.
pub fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}
