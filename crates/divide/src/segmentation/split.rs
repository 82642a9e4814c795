//! Divides one patch into two connected halves.
//!
//! Candidates are planes through the patch's middle, along and across its principal axes, and geodesic
//! Voronoi cells of two far points. A plane that contains a limb's axis cuts it lengthwise. A plane through
//! several holes of a body makes disks of it at once. The candidate with the fewest faults of topology wins,
//! then the one with the best shape.

use nalgebra::{Matrix3, SymmetricEigen};
use rayon::prelude::*;
use shellock_assembly::LatticeDirection;
use shellock_geom::topology::ends;
use shellock_geom::{HalfEdge, Solid, Topology, TriMesh, Vec3};
use shellock_report::PatchId;
use shellock_segment::whole::Whole;
use shellock_surface::seam::graph::ContactGraph;
use shellock_surface::seam::{seam_half_edges, stretches};

use super::FaceLabels;
use super::dual_graph::DualGraph;
use super::ground::Ground;

/// Cost of one fault of topology relative to shape: more than the worst shape.
const FAULT: f64 = 4.0;
/// Cost of uneven halves: the weight of the squared relative difference of their areas, which is 1 at worst.
const UNEVENNESS: f64 = 1.5;
/// Cost of a new seam as long as the root of the patch's area, such as a square cut along its side.
const SEAM_LENGTH: f64 = 0.3;

/// Greatest number of parts around a patch for which seams through two of them at once are tried, as their
/// number grows with the square.
const MOST_PAIRED: usize = 10;

/// A labelled mesh whose patches can be divided.
pub(super) struct Divider<'a> {
    pub mesh: &'a TriMesh,
    pub topology: &'a Topology,
    pub faces: &'a DualGraph,
    /// Sets of faces that no division may part.
    pub whole: &'a Whole,
    pub min_piece_mm2: f64,
}

/// A possible division of a patch.
pub(super) struct Division {
    pub cost: f64,
    /// Number of faults of the topology after the division.
    pub n_faults: f64,
    pub new_half: Vec<u32>,
}

/// Divides `patch` into two connected halves of similar area by a short seam, mostly across its longest
/// direction. The new half gets the number `labels.n_patches()`. `None` if the patch is a single triangle or
/// does not exist.
pub fn split_piece(solid: &Solid, labels: &FaceLabels, patch: PatchId) -> Option<FaceLabels> {
    split_between_regions(&Ground::new(solid), labels, patch)
}

/// Divides like [`split_piece`], without parting any set that `ground` keeps whole.
pub(super) fn split_between_regions(
    ground: &Ground<'_>,
    labels: &FaceLabels,
    patch: PatchId,
) -> Option<FaceLabels> {
    let divider = Divider {
        mesh: ground.solid.mesh(),
        topology: &ground.topology,
        faces: &ground.faces,
        whole: &ground.whole,
        min_piece_mm2: 0.0,
    };
    let mut label = labels.as_slice().to_vec();
    let division = divider.best(&label, labels.n_patches(), patch.0, &[], |_, _| 0.0)?;
    division
        .new_half
        .iter()
        .for_each(|&f| label[f as usize] = labels.n_patches() as u32);
    Some(FaceLabels {
        patch_of_face: label,
        n_patches: labels.n_patches() + 1,
    })
}

impl Divider<'_> {
    /// Cheapest division of `patch`. `pairs` are far points for Voronoi halves. `faults` counts the other
    /// faults of a labelling, given with the seams inside the patch; an infinite count forbids it.
    pub fn best(
        &self,
        label: &[u32],
        n_patches: usize,
        patch: u32,
        pairs: &[[u32; 2]],
        faults: impl Fn(&[u32], &[HalfEdge]) -> f64 + Sync,
    ) -> Option<Division> {
        let members: Vec<u32> = (0..label.len() as u32)
            .filter(|&f| label[f as usize] == patch)
            .collect();
        if members.len() < 2 {
            return None;
        }
        let region = Region::new(self.mesh, &members);
        let mut candidates: Vec<Vec<u32>> = self.plane_halves(&members).collect();
        candidates.extend(self.voronoi_halves(label, &members, pairs));
        let divisions: Vec<Option<Division>> = candidates
            .into_par_iter()
            .map_init(
                || label.to_vec(),
                |label, moved| {
                    let division = self.division(label, &region, [patch, n_patches as u32], &moved, &faults);
                    members.iter().for_each(|&f| label[f as usize] = patch);
                    division
                },
            )
            .collect();
        let cheaper = |best: Division, d: Division| if d.cost < best.cost { d } else { best };
        divisions.into_iter().flatten().reduce(cheaper)
    }

    /// Division that gives `moved` to the second of `halves` and then makes both connected; `label` is left
    /// with the new labels. `None` if the result is no division, or one that `faults` forbids.
    fn division(
        &self,
        label: &mut [u32],
        region: &Region<'_>,
        halves: [u32; 2],
        moved: &[u32],
        faults: &(impl Fn(&[u32], &[HalfEdge]) -> f64 + Sync),
    ) -> Option<Division> {
        let area_of = |faces: &[u32]| faces.iter().map(|&f| self.faces.area[f as usize]).sum::<f64>();
        let members = region.faces;
        let area = area_of(members);
        moved.iter().for_each(|&f| label[f as usize] = halves[1]);
        self.whole
            .gather_among(label, &self.faces.area, |k| halves.contains(&k));
        self.join_islands(label, members, halves);
        if self.whole.is_parted(label, halves) {
            return None;
        }
        let second = members
            .iter()
            .copied()
            .filter(|&f| label[f as usize] != halves[0]);
        let moved: Vec<u32> = second.collect();
        let moved_mm2 = area_of(&moved);
        let is_division = !moved.is_empty() && moved.len() < members.len();
        if !is_division || moved_mm2.min(area - moved_mm2) < self.min_piece_mm2 {
            return None;
        }
        let seam = self.seam_beside(label, members, halves[1]);
        let length: f64 = seam.iter().map(|&h| self.edge_length(h)).sum();
        let euler = region.euler_characteristics(self.topology, label, halves);
        let holes: i64 = euler
            .iter()
            .map(|characteristic| (1 - characteristic).abs())
            .sum();
        let n_faults = holes as f64 + faults(label, &seam);
        let cost = FAULT * n_faults
            + UNEVENNESS * ((area - 2.0 * moved_mm2) / area).powi(2)
            + SEAM_LENGTH * length / area.sqrt();
        cost.is_finite().then_some(Division {
            cost,
            n_faults,
            new_half: moved,
        })
    }

    /// Half-edges between `members` and the patch `other`, which has a higher number.
    fn seam_beside(&self, label: &[u32], members: &[u32], other: u32) -> Vec<HalfEdge> {
        let mut seam = seam_half_edges(self.topology, label, members.iter().copied());
        seam.retain(|&h| label[self.topology.opposite(h) as usize / 3] == other);
        seam
    }

    fn edge_length(&self, h: HalfEdge) -> f64 {
        let (a, b) = ends(self.mesh, h);
        self.mesh.points[a as usize].distance(self.mesh.points[b as usize])
    }

    /// Triangles on the positive side of planes through the middle. The planes are normal to the 13 lattice
    /// directions of the principal frame.
    fn plane_halves(&self, members: &[u32]) -> impl Iterator<Item = Vec<u32>> {
        let area: f64 = members.iter().map(|&f| self.faces.area[f as usize]).sum();
        let weighted = |f: u32| self.faces.center[f as usize] * self.faces.area[f as usize];
        let middle = members.iter().map(|&f| weighted(f)).sum::<Vec3>() / area.max(f64::MIN_POSITIVE);
        let mut spread = Matrix3::zeros();
        for &f in members {
            let d = nalgebra::Vector3::from((self.faces.center[f as usize] - middle).to_array());
            spread += d * d.transpose() * self.faces.area[f as usize];
        }
        let axes = SymmetricEigen::new(spread).eigenvectors;
        LatticeDirection::all()
            .take(LatticeDirection::COUNT / 2)
            .map(move |d| {
                let normal = axes * nalgebra::Vector3::from(d.unit().to_array());
                let normal = Vec3::new(normal.x, normal.y, normal.z);
                let is_in_front = |f: &u32| (self.faces.center[*f as usize] - middle).dot(normal) > 0.0;
                members.iter().copied().filter(is_in_front).collect()
            })
    }

    /// Triangles nearer to the second point of each pair, and of the two ends of the patch, than to the
    /// first. Every two pairs also give triangles nearer to one point of each than to the others: a seam
    /// through two limbs at once.
    fn voronoi_halves(&self, label: &[u32], members: &[u32], pairs: &[[u32; 2]]) -> Vec<Vec<u32>> {
        let patch = label[members[0] as usize];
        let inside = |f: u32| label[f as usize] == patch;
        let farthest_from = |f: u32| {
            let (distance, _) = self.faces.grow(&[(f, 1.0)], inside);
            let farther = |a: u32, b: u32| {
                if distance[b as usize] > distance[a as usize] {
                    b
                } else {
                    a
                }
            };
            members
                .iter()
                .copied()
                .filter(|&m| distance[m as usize].is_finite())
                .fold(f, farther)
        };
        let end = farthest_from(members[0]);
        let ends = [end, farthest_from(end)];
        let mut sources: Vec<Vec<u32>> = pairs.iter().chain([&ends]).map(|p| p.to_vec()).collect();
        // With two parts in all, there is only one seam to go through.
        for (i, p) in pairs
            .iter()
            .enumerate()
            .filter(|_| (3..=MOST_PAIRED).contains(&pairs.len()))
        {
            sources.extend(
                pairs[..i]
                    .iter()
                    .flat_map(|q| [[q[0], p[0], q[1], p[1]], [q[0], p[1], q[1], p[0]]].map(Vec::from)),
            );
        }
        sources.retain(|s| s[0] != s[s.len() / 2]);
        // Many candidates share a point, so distances are measured once per point.
        let mut points = sources.concat();
        points.sort_unstable();
        points.dedup();
        let distance_mm: Vec<Vec<f64>> = points
            .par_iter()
            .map(|&point| self.faces.grow(&[(point, 1.0)], inside).0)
            .collect();
        let from = |point: &u32| &distance_mm[points.binary_search(point).expect("it is one of them")];
        let nearer_to_second = |sources: Vec<u32>| {
            let distances: Vec<&Vec<f64>> = sources.iter().map(from).collect();
            let (first, second) = distances.split_at(distances.len() / 2);
            let least = |from: &[&Vec<f64>], f: u32| {
                let all = from.iter().map(|distance_mm| distance_mm[f as usize]);
                all.fold(f64::INFINITY, f64::min)
            };
            let is_second = |f: &u32| least(second, *f) < least(first, *f);
            members.iter().copied().filter(is_second).collect()
        };
        sources.into_par_iter().map(nearer_to_second).collect()
    }

    /// Makes both halves connected: triangles outside the largest part of their half join the other half.
    fn join_islands(&self, label: &mut [u32], members: &[u32], halves: [u32; 2]) {
        for side in 0..2 {
            let (own, other) = (halves[side], halves[1 - side]);
            let mut parts: Vec<(f64, Vec<u32>)> = Vec::new();
            for &start in members {
                if label[start as usize] != own {
                    continue;
                }
                let mut part = vec![start];
                label[start as usize] = u32::MAX;
                let mut next = 0;
                while next < part.len() {
                    for g in self.topology.neighbours(part[next]) {
                        if label[g as usize] == own {
                            label[g as usize] = u32::MAX;
                            part.push(g);
                        }
                    }
                    next += 1;
                }
                parts.push((part.iter().map(|&f| self.faces.area[f as usize]).sum(), part));
            }
            let main = (0..parts.len()).fold(0, |best, i| if parts[i].0 > parts[best].0 { i } else { best });
            for (i, (_, part)) in parts.iter().enumerate() {
                part.iter()
                    .for_each(|&f| label[f as usize] = if i == main { own } else { other });
            }
        }
    }
}

/// The triangles of one patch, with their corners renumbered. The cost of a test of its halves then depends
/// on the patch, not on the model.
struct Region<'a> {
    faces: &'a [u32],
    corners: Vec<[u32; 3]>,
    n_points: usize,
}

impl<'a> Region<'a> {
    fn new(mesh: &TriMesh, faces: &'a [u32]) -> Self {
        let of = |f: u32| mesh.triangles[f as usize];
        let mut points: Vec<u32> = faces.iter().flat_map(|&f| of(f)).collect();
        points.sort_unstable();
        points.dedup();
        let number = |v: u32| points.binary_search(&v).expect("it is a corner") as u32;
        Self {
            faces,
            corners: faces.iter().map(|&f| of(f).map(number)).collect(),
            n_points: points.len(),
        }
    }

    /// Computes the [`euler_characteristics`] of two halves that make up the patch.
    fn euler_characteristics(&self, topology: &Topology, label: &[u32], halves: [u32; 2]) -> [i64; 2] {
        const UNSEEN: u8 = 2;
        const BORDER: u8 = 3;
        let mut of_point = vec![UNSEEN; self.n_points];
        let mut doubled = [0i64; 2];
        for (&face, t) in self.faces.iter().zip(&self.corners) {
            let side = usize::from(label[face as usize] == halves[1]);
            doubled[side] -= 1;
            for corner in 0..3 {
                let beside = topology.opposite(3 * face + corner as u32) as usize / 3;
                let (start, end) = (t[corner] as usize, t[(corner + 1) % 3] as usize);
                if label[beside] != halves[side] {
                    doubled[side] += 1;
                    of_point[start] = BORDER;
                    of_point[end] = BORDER;
                } else if of_point[start] == UNSEEN {
                    of_point[start] = side as u8;
                }
            }
        }
        for inner in of_point.iter().filter(|&&side| side < UNSEEN) {
            doubled[usize::from(*inner)] += 2;
        }
        doubled.map(|d| d / 2)
    }
}

/// Euler characteristic of each patch, corners − edges + triangles with its border: 1 for a disk, 0 for a
/// ring, 2 for a closed surface.
pub(super) fn euler_characteristics(
    mesh: &TriMesh,
    topology: &Topology,
    label: &[u32],
    n_patches: usize,
) -> Vec<i64> {
    const UNSEEN: u32 = u32::MAX;
    const MIXED: u32 = u32::MAX - 1;
    let mut of_point = vec![UNSEEN; mesh.points.len()];
    // Twice the characteristic: 2 F − (3 F + B) + 2 (inner corners + B), as each of B border edges has one
    // border corner.
    let mut doubled = vec![0i64; n_patches];
    for (face, t) in mesh.triangles.iter().enumerate() {
        let k = label[face];
        doubled[k as usize] -= 1;
        for (corner, &v) in t.iter().enumerate() {
            let seen = &mut of_point[v as usize];
            *seen = if *seen == UNSEEN || *seen == k { k } else { MIXED };
            if label[topology.opposite((3 * face + corner) as u32) as usize / 3] != k {
                doubled[k as usize] += 1;
            }
        }
    }
    of_point
        .iter()
        .filter(|&&k| k < MIXED)
        .for_each(|&k| doubled[k as usize] += 2);
    doubled.into_iter().map(|d| d / 2).collect()
}

/// Contact graph of a labelling whose seams zigzag along triangle edges.
pub(super) fn raw_contact_graph(
    divider: &Divider<'_>,
    label: &[u32],
    n_patches: usize,
    seam: &[HalfEdge],
    min_contact_mm: f64,
) -> ContactGraph {
    let found = stretches(divider.mesh, divider.topology, label, seam);
    let lengths = found
        .iter()
        .map(|s| (PatchId(s.a), PatchId(s.b), s.length(divider.mesh)));
    ContactGraph::from_stretches(n_patches, min_contact_mm, lengths)
}

#[cfg(test)]
mod tests {
    use shellock_test_surfaces::sphere;

    use super::*;

    /// Halves of a patch, by any labelling of its triangles, have the same characteristics as in the whole
    /// surface.
    #[test]
    fn halves_have_the_characteristics_that_all_patches_have() {
        let ball = Solid::new(sphere(3, Vec3::ONE)).expect("closed");
        let (mesh, topology) = (ball.mesh(), Topology::new(&ball));
        let n_faces = mesh.triangles.len() as u32;
        for step in [2u32, 3, 5, 7, 11] {
            // The stride marks islands, pinched points and rings within a cap.
            let in_cap = |f: u32| mesh.face_center(f as usize).z > -0.3;
            let members: Vec<u32> = (0..n_faces).filter(|&f| in_cap(f)).collect();
            let half = |f: u32| u32::from((f / step).is_multiple_of(3)) * 2;
            let label: Vec<u32> = (0..n_faces)
                .map(|f| if in_cap(f) { half(f) } else { 1 })
                .collect();
            let all = euler_characteristics(mesh, &topology, &label, 3);
            let own = Region::new(mesh, &members).euler_characteristics(&topology, &label, [0, 2]);
            assert_eq!(own, [all[0], all[2]], "{step}");
        }
    }
}
