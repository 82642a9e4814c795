//! Divisions with fewer parts, for kits.
//!
//! A division that people would draw seldom locks. A ring around a limb, or a body that limbs hang on, must
//! be divided in two before it can be put on. So parts are merged until the predicted number of pieces is
//! small enough. First come merges that pay for themselves, such as a hand with its forearm, then those that
//! change the division least.

use std::collections::{BTreeMap, BTreeSet};

use shellock_geom::topology::ends;
use shellock_geom::{Solid, Topology, TriMesh};
use shellock_surface::SegmentedSurface;
use shellock_surface::seam::seam_half_edges;

use super::FaceLabels;
use super::split::euler_characteristics;

/// Predicted numbers of pieces of the proposed divisions, as multiples of the number wanted.
const FORESEEN: [f64; 3] = [1.6, 1.3, 1.0];

/// Returns up to three divisions with no more parts than `labels`: finest first, each with another number of
/// parts. Even the first has all merges that pay for themselves.
pub(super) fn with_fewer_parts(solid: &Solid, labels: &FaceLabels, n_wanted: usize) -> Vec<FaceLabels> {
    let topology = Topology::new(solid);
    let mut parts = MergeState::new(solid.mesh(), &topology, labels);
    while parts.merge_cheapest(|loss| loss <= 0.0) {}
    let mut found: Vec<FaceLabels> = Vec::new();
    for share in FORESEEN {
        let most = (share * n_wanted as f64) as usize;
        while parts.n_foreseen() > most && parts.merge_cheapest(|_| true) {}
        let merged = FaceLabels::from_components(&topology, &parts.labels(labels));
        if found.last().is_none_or(|last| last.n_patches != merged.n_patches) {
            found.push(merged);
        }
    }
    found
}

/// Probability that two random points are together in one division and apart in the other, [0, 1]: 1 − Rand
/// index, by area. `labels` belong to the triangles from which `surface` was cut.
pub(super) fn disagreement(labels: &FaceLabels, surface: &SegmentedSurface) -> f64 {
    let (mut both, mut own, mut others) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    let total = surface.mesh.area().max(f64::MIN_POSITIVE);
    for (face, (&source, &patch)) in surface.source_face.iter().zip(&surface.patch_of_face).enumerate() {
        let label = labels.patch(source as usize);
        let share = surface.mesh.face_area(face) / total;
        *both.entry((label, patch)).or_insert(0.0) += share;
        *own.entry(label).or_insert(0.0) += share;
        *others.entry(patch).or_insert(0.0) += share;
    }
    let squares = |shares: &mut dyn Iterator<Item = &f64>| shares.map(|s| s * s).sum::<f64>();
    let (own, others) = (squares(&mut own.values()), squares(&mut others.values()));
    own + others - 2.0 * squares(&mut both.values())
}

/// The seam between two parts.
#[derive(Default)]
struct Border {
    n_edges: i64,
    points: BTreeSet<u32>,
}

impl Border {
    /// Euler characteristic of the seam: 1 for each open stretch between other parts, 0 for each closed one.
    fn euler(&self) -> i64 {
        self.points.len() as i64 - self.n_edges
    }
}

/// State of the parts during merging.
struct MergeState {
    /// For each part, the part that it was merged into.
    into: Vec<u32>,
    /// Share of the area, by part.
    share: Vec<f64>,
    euler: Vec<i64>,
    borders: BTreeMap<[u32; 2], Border>,
}

impl MergeState {
    fn new(mesh: &TriMesh, topology: &Topology, labels: &FaceLabels) -> Self {
        let (label, n) = (labels.as_slice(), labels.n_patches());
        let (mut share, total) = (vec![0.0; n], mesh.area().max(f64::MIN_POSITIVE));
        label
            .iter()
            .enumerate()
            .for_each(|(face, &k)| share[k as usize] += mesh.face_area(face) / total);
        let mut borders: BTreeMap<[u32; 2], Border> = BTreeMap::new();
        for h in seam_half_edges(topology, label, 0..label.len() as u32) {
            let sides = [h, topology.opposite(h)].map(|h| label[h as usize / 3]);
            let border = borders.entry(sort_pair(sides)).or_default();
            let (a, b) = ends(mesh, h);
            border.n_edges += 1;
            border.points.extend([a, b]);
        }
        Self {
            into: (0..n as u32).collect(),
            share,
            euler: euler_characteristics(mesh, topology, label, n),
            borders,
        }
    }

    /// Predicted number of pieces of all parts.
    fn n_foreseen(&self) -> usize {
        let is_left = |&p: &usize| self.into[p] as usize == p;
        (0..self.into.len())
            .filter(is_left)
            .map(|p| pieces_of(self.euler[p]))
            .sum()
    }

    /// Merges the two parts with the least loss for each piece predicted to be saved, if `is_cheap` accepts
    /// that loss. Returns false if there are none.
    fn merge_cheapest(&mut self, is_cheap: impl Fn(f64) -> bool) -> bool {
        let mut best: Option<(f64, [u32; 2])> = None;
        for (&pair, border) in &self.borders {
            if self.borders.len() > 1
                && let Some(loss) = self.loss(pair, border)
                && best.is_none_or(|(least, _)| loss < least)
            {
                best = Some((loss, pair));
            }
        }
        let Some((_, pair)) = best.filter(|(loss, _)| is_cheap(*loss)) else {
            return false;
        };
        self.merge(pair);
        true
    }

    /// Disagreement with the original division that a merge adds, less what halving would have added, for
    /// each piece saved. `None` if the merge saves no piece.
    fn loss(&self, [a, b]: [u32; 2], border: &Border) -> Option<f64> {
        let halving = |share: f64, euler: i64| {
            if pieces_of(euler) > 1 {
                0.5 * share * share
            } else {
                0.0
            }
        };
        let [(one, e1), (other, e2)] = [a, b].map(|p| (self.share[p as usize], self.euler[p as usize]));
        let merged = e1 + e2 - border.euler();
        let n_before = pieces_of(e1) + pieces_of(e2);
        let n_saved = n_before.saturating_sub(pieces_of(merged));
        let added = 2.0 * one * other + halving(one + other, merged) - halving(one, e1) - halving(other, e2);
        (n_saved > 0).then(|| added / n_saved as f64)
    }

    fn merge(&mut self, [a, b]: [u32; 2]) {
        let border = self.borders.remove(&[a, b]).unwrap_or_default();
        self.euler[a as usize] += self.euler[b as usize] - border.euler();
        self.share[a as usize] += self.share[b as usize];
        self.into[b as usize] = a;
        let of_b: Vec<[u32; 2]> = self.borders.keys().copied().filter(|k| k.contains(&b)).collect();
        for pair in of_b {
            let moved = self.borders.remove(&pair).unwrap_or_default();
            let other = if pair[0] == b { pair[1] } else { pair[0] };
            let kept = self.borders.entry(sort_pair([a, other])).or_default();
            kept.n_edges += moved.n_edges;
            kept.points.extend(moved.points);
        }
    }

    fn labels(&self, labels: &FaceLabels) -> Vec<u32> {
        let root = |mut p: u32| {
            while self.into[p as usize] != p {
                p = self.into[p as usize];
            }
            p
        };
        labels.as_slice().iter().map(|&p| root(p)).collect()
    }
}

fn sort_pair([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Predicted number of pieces of a part: a disk is one, any other shape is halved.
fn pieces_of(euler: i64) -> usize {
    if euler == 1 { 1 } else { 2 }
}

#[cfg(test)]
mod tests {
    use shellock_geom::Vec3;
    use shellock_test_surfaces::sphere;

    use super::*;

    /// A ball in three slices: two caps and a ring between them.
    fn slices() -> (Solid, FaceLabels) {
        let ball = Solid::new(sphere(3, Vec3::splat(10.0))).expect("closed");
        let slice = |f: usize| {
            let z = ball.mesh().face_center(f).z;
            if z > 8.0 { 0 } else { u32::from(z < 0.0) + 1 }
        };
        let label: Vec<u32> = (0..ball.mesh().triangles.len()).map(slice).collect();
        let labels = FaceLabels::from_components(&Topology::new(&ball), &label);
        (ball, labels)
    }

    #[test]
    fn a_ring_joins_the_smaller_cap_that_it_bears() {
        let (ball, labels) = slices();
        assert_eq!(labels.n_patches(), 3);
        let mesh = ball.mesh();
        let found = with_fewer_parts(&ball, &labels, 2);
        let last = found.last().expect("at least one");
        assert_eq!(last.n_patches(), 2);
        let of = |z: f64| (0..mesh.triangles.len()).find(|&f| (mesh.face_center(f).z - z).abs() < 0.5);
        let patch = |z: f64| last.patch(of(z).expect("there is one"));
        assert_eq!(patch(9.5), patch(4.0));
        assert_ne!(patch(4.0), patch(-5.0));
    }

    #[test]
    fn what_is_merged_disagrees_by_twice_the_product_of_areas() {
        let (ball, labels) = slices();
        let mesh = ball.mesh();
        let share = |k: u32| -> f64 {
            let faces = (0..mesh.triangles.len()).filter(|&f| labels.patch(f).0 == k);
            faces.map(|f| mesh.face_area(f)).sum::<f64>() / mesh.area()
        };
        let merged = SegmentedSurface {
            mesh: mesh.clone(),
            patch_of_face: labels
                .as_slice()
                .iter()
                .map(|&k| shellock_report::PatchId(k.min(1)))
                .collect(),
            source_face: (0..mesh.triangles.len() as u32).collect(),
            n_patches: 2,
        };
        let expected = 2.0 * share(1) * share(2);
        assert!((disagreement(&labels, &merged) - expected).abs() < 1e-12);
    }
}
