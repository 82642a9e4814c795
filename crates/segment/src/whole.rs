//! Sets of faces that no border may divide, such as a figure's face.

use std::collections::BTreeMap;

/// Disjoint sets of faces, each of which must belong to one part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Whole {
    sets: Vec<Vec<u32>>,
    /// Set of each face, or [`FREE`] if it belongs to none; empty if there are no sets.
    set_of_face: Vec<u32>,
}

const FREE: u32 = u32::MAX;

impl Whole {
    /// Creates sets for a mesh of `n_faces` faces. Sets that share a face are joined, and empty ones are left
    /// out.
    pub fn new(n_faces: usize, sets: impl IntoIterator<Item = Vec<u32>>) -> Self {
        let mut joined: Vec<Vec<u32>> = Vec::new();
        let mut set_of_face = vec![FREE; n_faces];
        for set in sets {
            let mut met: Vec<u32> = set.iter().map(|&f| set_of_face[f as usize]).collect();
            met.retain(|&s| s != FREE);
            let mut faces = set;
            met.sort_unstable();
            met.dedup();
            met.iter().for_each(|&s| faces.append(&mut joined[s as usize]));
            faces.sort_unstable();
            faces.dedup();
            faces
                .iter()
                .for_each(|&f| set_of_face[f as usize] = joined.len() as u32);
            joined.push(faces);
        }
        joined.retain(|faces| !faces.is_empty());
        if joined.is_empty() {
            return Self::default();
        }
        for (faces, number) in joined.iter().zip(0..) {
            faces.iter().for_each(|&f| set_of_face[f as usize] = number);
        }
        Self {
            sets: joined,
            set_of_face,
        }
    }

    /// Returns true if there are no sets.
    pub fn is_empty(&self) -> bool {
        self.sets.is_empty()
    }

    /// All sets, each in ascending order.
    pub fn sets(&self) -> &[Vec<u32>] {
        &self.sets
    }

    /// Returns true if both faces belong to one set.
    pub fn has_both(&self, [f, g]: [u32; 2]) -> bool {
        let set = |face: u32| self.set_of_face.get(face as usize).copied().unwrap_or(FREE);
        set(f) != FREE && set(f) == set(g)
    }

    /// Transfers the sets to a simplified mesh of `n_coarse` faces. `of_face` is the simplified face on which
    /// each face lies. A simplified face joins the set that has more than half of the area lying on it.
    pub fn on_coarse(&self, of_face: &[u32], area_mm2: &[f64], n_coarse: usize) -> Self {
        if self.is_empty() {
            return Self::default();
        }
        let mut all = vec![0.0; n_coarse];
        of_face
            .iter()
            .zip(area_mm2)
            .for_each(|(&c, area)| all[c as usize] += area);
        let on = |faces: &Vec<u32>| {
            let mut own: BTreeMap<u32, f64> = BTreeMap::new();
            for &f in faces {
                *own.entry(of_face[f as usize]).or_default() += area_mm2[f as usize];
            }
            let most = own.into_iter().filter(|&(c, area)| area > 0.5 * all[c as usize]);
            most.map(|(c, _)| c).collect()
        };
        Self::new(n_coarse, self.sets.iter().map(on))
    }

    /// Gives all faces of each set the label with the most area in it. Returns the number of faces that
    /// changed.
    pub fn gather(&self, labels: &mut [u32], area_mm2: &[f64]) -> usize {
        self.gather_among(labels, area_mm2, |_| true)
    }

    /// Gathers like [`Self::gather`], but considers and changes only faces with labels that `among` accepts.
    pub fn gather_among(&self, labels: &mut [u32], area_mm2: &[f64], among: impl Fn(u32) -> bool) -> usize {
        let mut n_changed = 0;
        for faces in &self.sets {
            let mut area: BTreeMap<u32, f64> = BTreeMap::new();
            for &f in faces.iter().filter(|&&f| among(labels[f as usize])) {
                *area.entry(labels[f as usize]).or_default() += area_mm2[f as usize];
            }
            let Some((&most, _)) = area.iter().max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(a.0))) else {
                continue;
            };
            for &f in faces {
                let label = &mut labels[f as usize];
                if among(*label) && *label != most {
                    *label = most;
                    n_changed += 1;
                }
            }
        }
        n_changed
    }

    /// Returns true if a set has faces of both labels.
    pub fn is_parted(&self, labels: &[u32], [a, b]: [u32; 2]) -> bool {
        self.sets.iter().any(|faces| {
            let has = |label: u32| faces.iter().any(|&f| labels[f as usize] == label);
            has(a) && has(b)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_that_share_a_face_are_one() {
        let whole = Whole::new(9, [vec![1, 2], vec![4], vec![], vec![2, 3], vec![8]]);
        assert_eq!(whole.sets(), [vec![4], vec![1, 2, 3], vec![8]]);
        assert!(whole.has_both([1, 3]) && !whole.has_both([1, 4]) && !whole.has_both([0, 5]));
    }

    #[test]
    fn a_set_gets_the_label_of_most_of_its_area_and_no_other_face_changes() {
        let whole = Whole::new(5, [vec![0, 1, 2]]);
        let mut labels = [7, 8, 8, 7, 8];
        assert_eq!(whole.gather(&mut labels, &[5.0, 1.0, 1.0, 1.0, 1.0]), 2);
        assert_eq!(labels, [7, 7, 7, 7, 8]);
        assert!(!whole.is_parted(&labels, [7, 8]));
    }
}
