//! Self-intersections: finding pairs of crossing triangles, and making one surface around the enclosed
//! volume.

use rayon::prelude::*;

use super::{Draft, Repair, RepairKind};
use crate::boolean;
use crate::check::{InputError, inspect, inspect_edges};
use crate::{Aabb, TriMesh, Vec3};

/// Number of triangles in a leaf of the boxes; 4 to 16 take about the same time.
const LEAF: usize = 8;
/// Largest number of pairs tested for each leaf. More occur at the tip of a cone of twenty thousand triangles
/// and in hostile files; some crossings are missed then.
const MAX_PAIRS_OF_LEAF: usize = 100_000;
/// Largest number of crossing pairs that are resolved: at 1 to 5 ms each, a minute or two. Meshes with more
/// are beyond repair.
const MAX_RESOLVED: usize = 20_000;
/// Volume of four points that counts as 0, as a share of the product of its edges: 10⁶ roundings. Triangles
/// that touch, or cross by less than this, do not count as crossing.
const FLAT: f64 = 1e-10;

/// Number and place of a surface's self-intersections.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Crossings {
    /// Number of crossing pairs of triangles.
    pub count: usize,
    /// Centre of the lowest-numbered first triangle of the pairs, file units; the origin if `count` is 0.
    pub first: Vec3,
}

/// Counts pairs of triangles of which an edge of one passes through the other. Triangles that only touch or
/// lie in one plane do not count.
///
/// O(n log n), plus the pairs whose boxes meet. The same on any number of threads.
pub fn crossings(mesh: &TriMesh) -> Crossings {
    let tree = Boxes::of(mesh);
    let found: Vec<(usize, Option<u32>)> = (0..tree.order.len().div_ceil(LEAF))
        .into_par_iter()
        .map(|leaf| {
            let (mut count, mut first) = (0, None);
            tree.crossings_of(mesh, leaf, |[face, _]| {
                count += 1;
                first = Some(first.map_or(face, |f: u32| f.min(face)));
            });
            (count, first)
        })
        .collect();
    let first = found.iter().filter_map(|(_, first)| *first).min();
    Crossings {
        count: found.iter().map(|(count, _)| count).sum(),
        first: first.map_or(Vec3::ZERO, |face| mesh.face_center(face as usize)),
    }
}

/// Pairs of triangles that [`crossings`] counts; the same on any number of threads.
pub(super) fn crossing_pairs(mesh: &TriMesh) -> Vec<[u32; 2]> {
    let tree = Boxes::of(mesh);
    let of_leaf = |leaf: usize| {
        let mut pairs = Vec::new();
        tree.crossings_of(mesh, leaf, |pair| pairs.push(pair));
        pairs
    };
    let n_leaves = tree.order.len().div_ceil(LEAF);
    (0..n_leaves).into_par_iter().flat_map_iter(of_leaf).collect()
}

/// Triangles that [`crossings`] counts, each once, in ascending order.
pub(crate) fn crossing_faces(mesh: &TriMesh) -> Vec<u32> {
    let mut faces = crossing_pairs(mesh).into_flattened();
    faces.sort_unstable();
    faces.dedup();
    faces
}

/// Makes one surface around the volume that a closed surface encloses at least once. Returns a copy if the
/// surface neither crosses nor touches itself, and `None` if the union is too much work or fails.
pub(super) fn unite(mesh: &TriMesh) -> Option<TriMesh> {
    let n = crossings(mesh).count;
    if n == 0 && inspect_edges(mesh).non_manifold.count == 0 && matches!(find_touch(mesh), Ok(None)) {
        return Some(mesh.clone());
    }
    (n <= MAX_RESOLVED).then(|| boolean::rebuild(mesh).ok()).flatten()
}

/// Makes one surface around the volume that the draft encloses at least once. Acts only if the draft crosses
/// itself, has edges of more than two triangles, or has several bodies whose faces touch.
pub(super) fn resolve(draft: &mut Draft) -> Result<Option<Repair>, InputError> {
    let found = crossings(&draft.mesh);
    let shared = inspect_edges(&draft.mesh).non_manifold;
    let (kind, count, at) = match (found.count, shared.count) {
        (0, 0) => match find_touch(&draft.mesh)? {
            Some((n_bodies, at)) => (RepairKind::Fused, n_bodies, at),
            None => return Ok(None),
        },
        (0, count) => (RepairKind::Parted, count, shared.first),
        (count, _) => (
            RepairKind::United {
                before: 0.0,
                after: 0.0,
            },
            count,
            found.first,
        ),
    };
    let refused = || match kind {
        RepairKind::Parted => InputError::Shared {
            count,
            at,
            n_copies: 0,
        },
        _ => InputError::Crossing { count, at },
    };
    if found.count > MAX_RESOLVED {
        return Err(refused());
    }
    let mesh = boolean::rebuild(&draft.mesh).map_err(|_| refused())?;
    if mesh.triangles.is_empty() {
        return Err(refused());
    }
    let kind = match kind {
        RepairKind::United { .. } => {
            let [before, after] = [&draft.mesh, &mesh].map(TriMesh::signed_volume);
            RepairKind::United { before, after }
        }
        other => other,
    };
    draft.replace(mesh);
    Ok(Some(Repair { kind, count, at }))
}

/// Number of bodies and the centre of the second, if faces of several bodies touch. [`crossings`] does not
/// detect that.
fn find_touch(mesh: &TriMesh) -> Result<Option<(usize, Vec3)>, InputError> {
    /// Largest number of bodies that are compared pairwise.
    const MAX_BODIES: usize = 1000;
    let bounds: Vec<Aabb> = inspect(mesh).bodies.iter().map(|body| body.bounds).collect();
    let n = bounds.len();
    let are_near =
        (2..=MAX_BODIES).contains(&n) && (0..n).any(|i| (0..i).any(|j| bounds[i].intersects(bounds[j])));
    if !are_near {
        return Ok(None);
    }
    let at = bounds[1].center();
    match boolean::touches_itself(mesh) {
        Ok(touches) => Ok(touches.then_some((n, at))),
        Err(_) => Err(InputError::Crossing { count: 1, at }),
    }
}

/// Triangles along a space-filling curve, in a hierarchy of bounding boxes.
struct Boxes {
    order: Vec<u32>,
    /// Bounding box of each triangle, in that order.
    boxes: Vec<Aabb>,
    /// Boxes of each level, from the leaves up; the last level has one box.
    levels: Vec<Vec<Aabb>>,
}

impl Boxes {
    fn of(mesh: &TriMesh) -> Self {
        let bounds = mesh.bounds();
        let scale = bounds.size().max_element().max(f64::MIN_POSITIVE).recip();
        let mut keys: Vec<(u64, u32)> = (0..mesh.triangles.len() as u32)
            .into_par_iter()
            .map(|face| {
                (
                    curve_position((mesh.face_center(face as usize) - bounds.min) * scale),
                    face,
                )
            })
            .collect();
        keys.par_sort_unstable();
        let order: Vec<u32> = keys.into_iter().map(|(_, face)| face).collect();
        let boxes: Vec<Aabb> = order
            .par_iter()
            .map(|&f| Aabb::around(mesh.corners(f as usize)))
            .collect();
        let join = |boxes: &[Aabb]| boxes.iter().fold(Aabb::EMPTY, |b, &c| b.union(c));
        let mut levels: Vec<Vec<Aabb>> = vec![boxes.par_chunks(LEAF).map(join).collect()];
        while let Some(last) = levels.last().filter(|l| l.len() > 1) {
            levels.push(last.chunks(2).map(join).collect());
        }
        Self { order, boxes, levels }
    }

    /// Positions of a leaf's triangles in the order.
    fn places(&self, leaf: usize) -> std::ops::Range<usize> {
        leaf * LEAF..self.order.len().min((leaf + 1) * LEAF)
    }

    /// Calls `found` for each crossing pair of a triangle of `leaf` and a triangle of this or a later leaf.
    fn crossings_of(&self, mesh: &TriMesh, leaf: usize, mut found: impl FnMut([u32; 2])) {
        let own = self.places(leaf);
        let around = self.levels[0][leaf];
        let mut n_pairs = 0;
        let mut todo = vec![(self.levels.len() - 1, 0)];
        while let Some((level, at)) = todo.pop().filter(|_| n_pairs < MAX_PAIRS_OF_LEAF) {
            // Earlier leaves have already been compared with this one.
            let is_earlier = (at + 1) << level <= leaf;
            if is_earlier || !self.levels[level][at].intersects(around) {
                continue;
            }
            if level > 0 {
                let children = 2 * at..self.levels[level - 1].len().min(2 * at + 2);
                todo.extend(children.map(|child| (level - 1, child)));
                continue;
            }
            n_pairs += own.len() * self.places(at).len();
            for other in self
                .places(at)
                .filter(|&other| self.boxes[other].intersects(around))
            {
                // Within the leaf, each pair is tested once.
                for place in own.clone().take_while(|&place| place < other) {
                    let faces = [place, other].map(|p| self.order[p]);
                    if self.boxes[place].intersects(self.boxes[other]) && cross(mesh, faces) {
                        found(faces);
                    }
                }
            }
        }
    }
}

/// Position on a Morton curve of a point in the unit cube, 21 bits per axis.
fn curve_position(point: Vec3) -> u64 {
    let spread = |x: f64| {
        let mut bits = (x.clamp(0.0, 1.0) * f64::from((1 << 21) - 1)) as u64;
        for (shift, mask) in [
            (32, 0x001F_0000_0000_FFFF),
            (16, 0x001F_0000_FF00_00FF),
            (8, 0x100F_00F0_0F00_F00F),
            (4, 0x10C3_0C30_C30C_30C3),
            (2, 0x1249_2492_4924_9249),
        ] {
            bits = (bits | bits << shift) & mask;
        }
        bits
    };
    spread(point.x) | spread(point.y) << 1 | spread(point.z) << 2
}

/// Returns true if an edge of one triangle passes through the inside of the other. False if they share an
/// edge.
fn cross(mesh: &TriMesh, faces: [u32; 2]) -> bool {
    let [t, u] = faces.map(|face| mesh.triangles[face as usize]);
    let shared = |t: [u32; 3], u: [u32; 3]| [0, 1, 2].map(|k| u.contains(&t[k]));
    let (of_t, of_u) = (shared(t, u), shared(u, t));
    let n_shared = of_t.iter().filter(|s| **s).count();
    if n_shared > 1 {
        return false;
    }
    let [first, second] = faces.map(|face| mesh.corners(face as usize));
    if n_shared == 0 {
        return (0..3).any(|k| goes_through(first, k, second) || goes_through(second, k, first));
    }
    // Edges at the shared point touch the other triangle there and nowhere else.
    let opposite = |s: [bool; 3]| (s.iter().position(|s| *s).unwrap_or_default() + 1) % 3;
    goes_through(first, opposite(of_t), second) || goes_through(second, opposite(of_u), first)
}

/// Returns true if edge `k` of the first triangle passes through the inside of the second.
fn goes_through(edges: [Vec3; 3], k: usize, [a, b, c]: [Vec3; 3]) -> bool {
    let (p, q) = (edges[k], edges[(k + 1) % 3]);
    let sign = |a: Vec3, b: Vec3, c: Vec3, d: Vec3| {
        let [u, v, w] = [a - d, b - d, c - d];
        let volume = u.dot(v.cross(w));
        let flat_sq = FLAT * FLAT * u.length_squared() * v.length_squared() * w.length_squared();
        match volume * volume > flat_sq {
            true if volume > 0.0 => 1,
            true => -1,
            false => 0,
        }
    };
    let below = sign(a, b, c, p);
    if below == 0 || sign(a, b, c, q) != -below {
        return false;
    }
    let around = sign(p, q, a, b);
    around != 0 && sign(p, q, b, c) == around && sign(p, q, c, a) == around
}
