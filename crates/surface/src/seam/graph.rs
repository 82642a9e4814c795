//! Contact graph of the patches: which of them hold each other, and is the whole 2-connected?
//!
//! A plan can lock all pieces only if this graph is 2-connected. If one piece separates a set S from the key,
//! every joint between S and the rest slides along that piece's direction, and S leaves as one cluster.

use shellock_report::PatchId;

/// Two patches that share a seam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adjacency {
    /// The patch with the lower id.
    pub a: PatchId,
    /// The patch with the higher id.
    pub b: PatchId,
    /// Length of all stretches between the two, mm.
    pub total_mm: f64,
    /// Length of the longest stretch, mm, on which connectors have room.
    pub longest_mm: f64,
}

/// Patches and the seams between them. A contact counts where its longest stretch has room for a connector.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactGraph {
    n_patches: usize,
    min_contact_mm: f64,
    contacts: Vec<Adjacency>,
}

impl ContactGraph {
    /// Builds the graph of `n_patches` patches from the lengths of the seam stretches between them, in any
    /// order.
    pub fn from_stretches(
        n_patches: usize,
        min_contact_mm: f64,
        stretches: impl IntoIterator<Item = (PatchId, PatchId, f64)>,
    ) -> Self {
        let mut stretches: Vec<_> = stretches
            .into_iter()
            .map(|(a, b, l)| (a.min(b), a.max(b), l))
            .collect();
        stretches.sort_by_key(|s| (s.0, s.1));
        let contacts = stretches
            .chunk_by(|x, y| (x.0, x.1) == (y.0, y.1))
            .map(|same| Adjacency {
                a: same[0].0,
                b: same[0].1,
                total_mm: same.iter().map(|s| s.2).sum(),
                longest_mm: same.iter().map(|s| s.2).fold(0.0, f64::max),
            })
            .collect();
        Self {
            n_patches,
            min_contact_mm,
            contacts,
        }
    }

    /// Number of patches in the graph.
    pub fn n_patches(&self) -> usize {
        self.n_patches
    }

    /// All pairs that share a seam, by ids, including those whose stretches are too short to count.
    pub fn contacts(&self) -> &[Adjacency] {
        &self.contacts
    }

    /// Returns true if the contact has room for a connector.
    pub fn counts(&self, contact: &Adjacency) -> bool {
        contact.longest_mm >= self.min_contact_mm
    }

    /// Patches that hold `patch` by contacts that count, sorted by id.
    pub fn neighbours(&self, patch: PatchId) -> Vec<PatchId> {
        let mut found: Vec<PatchId> = self
            .contacts
            .iter()
            .filter(|c| self.counts(c) && (c.a == patch || c.b == patch))
            .map(|c| if c.a == patch { c.b } else { c.a })
            .collect();
        found.sort_unstable();
        found
    }

    /// Connected components, each sorted by id, in order of their lowest id.
    pub fn parts(&self) -> Vec<Vec<PatchId>> {
        self.components_without(None)
    }

    /// Connected components of the rest without `patch`, in order of their lowest id.
    pub fn parts_without(&self, patch: PatchId) -> Vec<Vec<PatchId>> {
        self.components_without(Some(patch))
    }

    /// Pieces without which the rest falls into more components, sorted by id.
    pub fn articulation_pieces(&self) -> Vec<PatchId> {
        let n_parts = self.parts().len();
        let isolated = |p| self.neighbours(p).is_empty();
        (0..self.n_patches)
            .map(PatchId::from)
            .filter(|&p| self.parts_without(p).len() + usize::from(isolated(p)) > n_parts)
            .collect()
    }

    /// Returns true if all pieces are connected and no single piece alone holds others. Two pieces need one
    /// contact, one piece none.
    pub fn is_two_connected(&self) -> bool {
        self.parts().len() <= 1 && self.articulation_pieces().is_empty()
    }

    /// Distance from 2-connected: three times the surplus components, plus the surplus components after
    /// removal of each single piece; 0 if 2-connected.
    pub fn n_faults(&self) -> usize {
        let hanging =
            (0..self.n_patches).map(|p| self.parts_without(PatchId::from(p)).len().saturating_sub(1));
        3 * self.parts().len().saturating_sub(1) + hanging.sum::<usize>()
    }

    fn components_without(&self, without: Option<PatchId>) -> Vec<Vec<PatchId>> {
        let mut part: Vec<usize> = (0..self.n_patches).collect();
        fn root(part: &mut [usize], mut i: usize) -> usize {
            while part[i] != i {
                part[i] = part[part[i]];
                i = part[i];
            }
            i
        }
        for c in self.contacts.iter().filter(|c| self.counts(c)) {
            if Some(c.a) != without && Some(c.b) != without {
                let (a, b) = (root(&mut part, c.a.into()), root(&mut part, c.b.into()));
                part[a.max(b)] = a.min(b);
            }
        }
        let mut parts: Vec<Vec<PatchId>> = vec![Vec::new(); self.n_patches];
        for p in (0..self.n_patches).filter(|&p| Some(PatchId::from(p)) != without) {
            parts[root(&mut part, p)].push(PatchId::from(p));
        }
        parts.retain(|p| !p.is_empty());
        parts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph(n: usize, pairs: &[(u32, u32, f64)]) -> ContactGraph {
        ContactGraph::from_stretches(n, 9.0, pairs.iter().map(|&(a, b, l)| (PatchId(a), PatchId(b), l)))
    }

    #[test]
    fn a_cycle_is_two_connected_and_a_path_hangs_on_its_middle() {
        assert!(graph(4, &[(0, 1, 9.0), (1, 2, 9.0), (2, 3, 9.0), (3, 0, 9.0)]).is_two_connected());
        let path = graph(3, &[(0, 1, 9.0), (1, 2, 9.0)]);
        assert_eq!(path.articulation_pieces(), [PatchId(1)]);
        assert_eq!(path.parts_without(PatchId(1)), [[PatchId(0)], [PatchId(2)]]);
    }

    #[test]
    fn many_short_stretches_hold_nothing() {
        let g = graph(2, &[(0, 1, 8.0), (1, 0, 8.0)]);
        assert_eq!(
            (g.contacts()[0].total_mm, g.contacts()[0].longest_mm),
            (16.0, 8.0)
        );
        assert!(g.neighbours(PatchId(0)).is_empty() && !g.is_two_connected());
    }
}
