//! Disjoint sets of numbers (union–find).

/// Partition of `0..n` into groups; [`Groups::find`] names a group by its least member.
pub(crate) struct Groups(Vec<u32>);

impl Groups {
    /// Creates `n` groups of one member each.
    pub(crate) fn of(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    pub(crate) fn find(&mut self, mut member: u32) -> u32 {
        while self.0[member as usize] != member {
            // Halving the path during each search keeps all paths short.
            self.0[member as usize] = self.0[self.0[member as usize] as usize];
            member = self.0[member as usize];
        }
        member
    }

    pub(crate) fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
