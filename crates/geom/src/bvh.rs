//! Bounding volume hierarchy over triangles, for nearest points and for nearest distances by group.

use rayon::prelude::*;

use crate::{Aabb, TriMesh, Vec3, work};

/// Largest number of triangles in a leaf. Four was the fastest of 1 … 8 on 200 k triangles (closest-point
/// queries).
const LEAF_SIZE: usize = 4;
/// Number of bins of the surface-area heuristic; more gave under 1 % fewer visits.
const N_BINS: usize = 16;
/// Depth below which nodes are halved, so that no tree gets deeper than the 64 entries of a query's stack.
/// Halving 2³² triangles takes 32 more levels, less the levels that any split saves.
const MAX_UNEVEN_DEPTH: u32 = 28;

#[derive(Clone, Copy)]
pub(crate) struct Node {
    pub(crate) bounds: Aabb,
    /// First triangle of a leaf (in `order`), or index of the left child; the right child follows the left.
    pub(crate) first: u32,
    /// Number of triangles in a leaf; 0 for an inner node.
    pub(crate) count: u32,
    /// Group that all triangles below share, or [`MIXED`].
    group: u32,
}

impl Node {
    /// Triangles of a leaf, as positions in leaf order.
    pub(crate) fn triangles(&self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

const MIXED: u32 = u32::MAX;

/// Hierarchy of bounding boxes over triangles. Built in O(n log n); every answer is exact.
pub struct TriangleBvh {
    pub(crate) nodes: Vec<Node>,
    /// Corners in leaf order, so that a leaf reads memory in sequence.
    pub(crate) corners: Vec<[Vec3; 3]>,
    pub(crate) faces: Vec<u32>,
    groups: Vec<u32>,
    /// Groups below each node, as bits; empty if there is one group, or more than bits.
    groups_below: Vec<u128>,
}

/// Part of a triangle on which its nearest point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// On corner 0, 1 or 2.
    Corner(u8),
    /// On the edge that starts at corner 0, 1 or 2.
    Edge(u8),
    /// Inside the triangle, off its edges.
    Face,
}

/// Point of a mesh nearest to a query point.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Squared distance to the query point, mm².
    pub distance_sq: f64,
    /// Index of the nearest triangle.
    pub face: u32,
    /// Nearest point of that triangle, mm.
    pub point: Vec3,
    /// Part of the triangle on which the point lies.
    pub feature: Feature,
}

impl TriangleBvh {
    /// Builds the hierarchy of all triangles of `mesh`, as a single group.
    pub fn new(mesh: &TriMesh) -> Self {
        Self::with_groups(mesh, &[])
    }

    /// Builds the hierarchy of all triangles of `mesh`. `group_of_face` (one per triangle, or empty for a
    /// single group) is used by [`Self::nearest_by_group`].
    pub fn with_groups(mesh: &TriMesh, group_of_face: &[u32]) -> Self {
        let n = u32::try_from(mesh.triangles.len()).expect("faces are counted in 32 bits");
        work::INDEXED_TRIANGLES.add(mesh.triangles.len());
        let item = |face: u32| Item {
            bounds: Aabb::around(mesh.corners(face as usize)),
            face,
            group: group_of_face.get(face as usize).copied().unwrap_or(0),
        };
        let mut items: Vec<Item> = (0..n).into_par_iter().map(item).collect();
        let nodes = tree(&mut items, 0, 0);
        let groups: Vec<u32> = items.iter().map(|item| item.group).collect();
        Self {
            groups_below: groups_below(&nodes, &groups),
            nodes,
            corners: items
                .par_iter()
                .map(|item| mesh.corners(item.face as usize))
                .collect(),
            groups,
            faces: items.iter().map(|item| item.face).collect(),
        }
    }

    /// Finds the point nearest to `q` within `√limit_sq` mm, if there is one. Ties go to the triangle found
    /// first, which depends only on the mesh.
    pub fn nearest(&self, q: Vec3, limit_sq: f64) -> Option<Nearest> {
        let mut best: Option<Nearest> = None;
        let mut limit = limit_sq;
        let mut stack = [(0u32, 0.0f64); 64];
        let mut top = usize::from(!self.faces.is_empty());
        while top > 0 {
            top -= 1;
            let (at, near) = stack[top];
            if near > limit {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for i in node.triangles() {
                    let (point, feature) = nearest_on_triangle(self.corners[i], q);
                    let distance_sq = point.distance_squared(q);
                    if distance_sq < limit || (best.is_none() && distance_sq <= limit) {
                        limit = distance_sq;
                        best = Some(Nearest {
                            distance_sq,
                            face: self.faces[i],
                            point,
                            feature,
                        });
                    }
                }
                continue;
            }
            for child in self.children(node, q) {
                if child.1 <= limit {
                    stack[top] = child;
                    top += 1;
                }
            }
        }
        best
    }

    /// Finds the squared distance, mm², from `q` to each group within `√limit_sq` mm. Writes pairs (group,
    /// distance²) to `found`, sorted by group, each group once. `found` is cleared first and reused.
    pub fn nearest_by_group(&self, q: Vec3, limit_sq: f64, found: &mut Vec<(u32, f64)>) {
        found.clear();
        let mut stack = [(0u32, 0.0f64); 64];
        let mut top = usize::from(!self.faces.is_empty());
        let known = |found: &[(u32, f64)], g: u32| found.iter().find(|e| e.0 == g).map_or(limit_sq, |e| e.1);
        while top > 0 {
            top -= 1;
            let (at, near) = stack[top];
            let node = &self.nodes[at as usize];
            let worth_sq = match node.group {
                MIXED => self.farthest_below(at, found).unwrap_or(limit_sq),
                group => known(found, group),
            };
            if near > worth_sq {
                continue;
            }
            if node.count > 0 {
                for i in node.triangles() {
                    let d = nearest_on_triangle(self.corners[i], q).0.distance_squared(q);
                    match found.iter_mut().find(|e| e.0 == self.groups[i]) {
                        Some(entry) => entry.1 = entry.1.min(d),
                        None if d <= limit_sq => found.push((self.groups[i], d)),
                        None => {}
                    }
                }
                continue;
            }
            for child in self.children(node, q) {
                if child.1 <= limit_sq {
                    stack[top] = child;
                    top += 1;
                }
            }
        }
        found.sort_unstable_by_key(|e| e.0);
    }

    /// Both children of an inner node, with the squared distances of their boxes from `q`: the farther first.
    #[inline]
    fn children(&self, node: &Node, q: Vec3) -> [(u32, f64); 2] {
        let child = |at: u32| (at, self.nodes[at as usize].bounds.distance_sq(q));
        let (a, b) = (child(node.first), child(node.first + 1));
        if a.1 <= b.1 { [b, a] } else { [a, b] }
    }

    /// Greatest squared distance known of the groups below a node, mm²; `None` if one has none yet.
    fn farthest_below(&self, node: u32, found: &[(u32, f64)]) -> Option<f64> {
        let mut unknown = *self.groups_below.get(node as usize)?;
        let mut farthest_sq = 0.0f64;
        for &(group, distance_sq) in found {
            let bit = 1 << group;
            if unknown & bit != 0 {
                unknown &= !bit;
                farthest_sq = farthest_sq.max(distance_sq);
            }
        }
        (unknown == 0).then_some(farthest_sq)
    }

    /// First triangle that a ray meets within `limit_mm`, and the distance to it, mm. The ray starts at
    /// `origin` and follows the unit vector `direction`. Both sides of triangles count; triangles parallel to
    /// the ray do not.
    pub fn first_hit(&self, origin: Vec3, direction: Vec3, limit_mm: f64) -> Option<(u32, f64)> {
        let mut best: Option<(u32, f64)> = None;
        self.visit_hits(origin, direction, limit_mm, |face, t, limit| {
            *limit = t;
            best = Some((face, t));
        });
        best
    }

    /// Number of triangles that a ray meets.
    pub fn n_hits(&self, origin: Vec3, direction: Vec3) -> usize {
        let mut n = 0;
        self.visit_hits(origin, direction, f64::INFINITY, |_, _, _| n += 1);
        n
    }

    /// Calls `hit` with each triangle that a ray meets within the limit, mm, its distance, and the limit,
    /// which it may lower.
    fn visit_hits(
        &self,
        origin: Vec3,
        direction: Vec3,
        mut limit_mm: f64,
        mut hit: impl FnMut(u32, f64, &mut f64),
    ) {
        let ray = Ray::new(origin, direction);
        let mut stack = [0u32; 64];
        let mut top = usize::from(!self.faces.is_empty());
        while top > 0 {
            top -= 1;
            let node = &self.nodes[stack[top] as usize];
            if !ray.meets(node.bounds, limit_mm) {
                continue;
            }
            if node.count == 0 {
                stack[top] = node.first;
                stack[top + 1] = node.first + 1;
                top += 2;
                continue;
            }
            for i in node.triangles() {
                if let Some(t) = ray_meets_triangle(self.corners[i], origin, direction)
                    && t <= limit_mm
                {
                    hit(self.faces[i], t, &mut limit_mm);
                }
            }
        }
    }
}

/// Groups below each node, as bits; empty if there is one group, or more than bits. Children come after their
/// parents.
fn groups_below(nodes: &[Node], groups: &[u32]) -> Vec<u128> {
    let is_mixed = nodes.first().is_some_and(|root| root.group == MIXED);
    if !is_mixed || groups.iter().any(|&group| group >= u128::BITS) {
        return Vec::new();
    }
    let mut below = vec![0; nodes.len()];
    for (at, node) in nodes.iter().enumerate().rev() {
        below[at] = if node.count > 0 {
            node.triangles().fold(0, |bits, i| bits | 1 << groups[i])
        } else {
            below[node.first as usize] | below[node.first as usize + 1]
        };
    }
    below
}

/// A ray, prepared for tests against many boxes.
struct Ray {
    origin: Vec3,
    /// Reciprocals of the direction's components; 0 for an axis that it is perpendicular to.
    inverse: Vec3,
    /// True for axes that the direction is perpendicular to.
    is_across: [bool; 3],
}

impl Ray {
    fn new(origin: Vec3, direction: Vec3) -> Self {
        let is_across = direction.to_array().map(|d| d == 0.0);
        let inverse = direction.to_array().map(|d| if d == 0.0 { 0.0 } else { 1.0 / d });
        Self {
            origin,
            inverse: Vec3::from_array(inverse),
            is_across,
        }
    }

    /// Returns true if the ray meets a box within `limit` mm.
    fn meets(&self, b: Aabb, limit: f64) -> bool {
        let (mut p, mut q) = (
            (b.min - self.origin) * self.inverse,
            (b.max - self.origin) * self.inverse,
        );
        for axis in 0..3 {
            if self.is_across[axis] {
                if self.origin[axis] < b.min[axis] || self.origin[axis] > b.max[axis] {
                    return false;
                }
                (p[axis], q[axis]) = (0.0, limit);
            }
        }
        let from = p.min(q).max_element().max(0.0);
        let to = p.max(q).min_element().min(limit);
        // The slack covers rounding of the products, so that a flat box is not missed.
        from <= to + 1e-9 * (1.0 + to.abs())
    }
}

/// Distance along the ray, ≥ 0; `None` if the ray misses the triangle. [MollerTrumbore1997]
fn ray_meets_triangle([a, b, c]: [Vec3; 3], origin: Vec3, direction: Vec3) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let det = ab.dot(p);
    if det == 0.0 {
        return None;
    }
    let from_a = origin - a;
    let u = from_a.dot(p) / det;
    let q = from_a.cross(ab);
    let v = direction.dot(q) / det;
    let t = ac.dot(q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
}

/// Smallest number of triangles for which a subtree is built on its own thread.
const LEAST_APART: usize = 1 << 13;

/// A triangle while the tree is built. Items move together with their boxes, so that each pass reads memory
/// in sequence.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    face: u32,
    group: u32,
}

/// Builds the tree over `items`, whose first triangle has position `first` in leaf order. The root is node 0.
/// The tree's shape is the same on any number of threads.
fn tree(items: &mut [Item], first: usize, depth: u32) -> Vec<Node> {
    if items.len() < LEAST_APART {
        let mut nodes = vec![leaf(items, first)];
        let mut moved = Vec::with_capacity(items.len());
        split(&mut nodes, 0, items, &mut moved, depth);
        return nodes;
    }
    let mut root = leaf(items, first);
    let middle = partition(items, &mut Vec::new(), depth > MAX_UNEVEN_DEPTH);
    let (left, right) = items.split_at_mut(middle);
    let (left, right) = rayon::join(
        || tree(left, first, depth + 1),
        || tree(right, first + middle, depth + 1),
    );
    (root.first, root.count) = (1, 0);
    // Both roots come first, then the nodes below the left root, then those below the right root.
    let moved = |node: &Node, by: usize| Node {
        first: if node.count == 0 {
            node.first + by as u32
        } else {
            node.first
        },
        ..*node
    };
    let (by_left, by_right) = (2, 1 + left.len());
    let mut nodes = vec![root, moved(&left[0], by_left), moved(&right[0], by_right)];
    nodes.extend(left[1..].iter().map(|n| moved(n, by_left)));
    nodes.extend(right[1..].iter().map(|n| moved(n, by_right)));
    nodes
}

/// Makes a leaf of `items`.
fn leaf(items: &[Item], first: usize) -> Node {
    let shared = items.first().map_or(0, |item| item.group);
    Node {
        bounds: items.iter().fold(Aabb::EMPTY, |b, item| b.union(item.bounds)),
        first: first as u32,
        count: items.len() as u32,
        group: if items.iter().all(|item| item.group == shared) {
            shared
        } else {
            MIXED
        },
    }
}

/// Splits leaf `at` of `nodes`, which has the triangles of `items`, until leaves are small. `moved` is memory
/// for items on their way.
fn split(nodes: &mut Vec<Node>, at: usize, items: &mut [Item], moved: &mut Vec<Item>, depth: u32) {
    if items.len() <= LEAF_SIZE {
        return;
    }
    let first = nodes[at].first as usize;
    let middle = partition(items, moved, depth > MAX_UNEVEN_DEPTH);
    let (left, right) = items.split_at_mut(middle);
    let child = nodes.len();
    nodes.extend([leaf(left, first), leaf(right, first + middle)]);
    (nodes[at].first, nodes[at].count) = (child as u32, 0);
    split(nodes, child, left, moved, depth + 1);
    split(nodes, child + 1, right, moved, depth + 1);
}

/// Splits `items` in place where the surface-area heuristic is least. Returns the number of items that go
/// left, never 0 or all.
fn partition(items: &mut [Item], moved: &mut Vec<Item>, must_halve: bool) -> usize {
    let span = Aabb::around(items.iter().map(|item| item.bounds.center()));
    let size = span.size();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else {
        1 + usize::from(size.z > size.y)
    };
    let width = size[axis];
    if must_halve || width <= 0.0 || items.len() < 16 {
        return halve(items, axis);
    }
    let bin_of = |item: &Item| {
        let share = (item.bounds.center()[axis] - span.min[axis]) / width;
        ((share * N_BINS as f64) as usize).min(N_BINS - 1)
    };
    let mut bins = [(Aabb::EMPTY, 0usize); N_BINS];
    for item in items.iter() {
        let bin = &mut bins[bin_of(item)];
        *bin = (bin.0.union(item.bounds), bin.1 + 1);
    }
    let Some(cut) = cheapest_cut(&bins) else {
        return halve(items, axis);
    };
    // A stable partition keeps the order, and with it the tree, a function of the mesh alone.
    moved.clear();
    let mut n_left = 0;
    for i in 0..items.len() {
        let item = items[i];
        if bin_of(&item) < cut {
            items[n_left] = item;
            n_left += 1;
        } else {
            moved.push(item);
        }
    }
    items[n_left..].copy_from_slice(moved);
    n_left
}

/// Moves the half of `items` with the smaller centres along `axis` to the front. Returns its length.
fn halve(items: &mut [Item], axis: usize) -> usize {
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| {
        let [a_at, b_at] = [a, b].map(|item| item.bounds.center()[axis]);
        a_at.total_cmp(&b_at).then(a.face.cmp(&b.face))
    });
    half
}

/// Number of bins that go left if the sum of box area × number of triangles on both sides is least; `None` if
/// one bin holds all.
fn cheapest_cut(bins: &[(Aabb, usize); N_BINS]) -> Option<usize> {
    let half_area = |b: Aabb| {
        let s = b.size();
        s.x * s.y + s.y * s.z + s.z * s.x
    };
    let grow = |sum: &mut (Aabb, usize), bin: &(Aabb, usize)| {
        *sum = (sum.0.union(bin.0), sum.1 + bin.1);
        Some(*sum)
    };
    let mut right = [(Aabb::EMPTY, 0); N_BINS];
    let sums = bins
        .iter()
        .rev()
        .scan((Aabb::EMPTY, 0), |sum, bin| grow(sum, bin));
    for (at, sum) in right.iter_mut().rev().zip(sums) {
        *at = sum;
    }
    let left = bins.iter().scan((Aabb::EMPTY, 0), |sum, bin| grow(sum, bin));
    let cost = |(b, n): (Aabb, usize)| half_area(b) * n as f64;
    (1..N_BINS)
        .zip(left)
        .filter(|(cut, left)| left.1 > 0 && right[*cut].1 > 0)
        .map(|(cut, left)| (cut, cost(left) + cost(right[cut])))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(cut, _)| cut)
}

/// Point of triangle `abc` nearest to `q`, and the part of the triangle on which it lies. [Ericson2005,
/// 5.1.5]
pub fn nearest_on_triangle([a, b, c]: [Vec3; 3], q: Vec3) -> (Vec3, Feature) {
    let (ab, ac, aq) = (b - a, c - a, q - a);
    let (d1, d2) = (ab.dot(aq), ac.dot(aq));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, Feature::Corner(0));
    }
    let bq = q - b;
    let (d3, d4) = (ab.dot(bq), ac.dot(bq));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, Feature::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), Feature::Edge(0));
    }
    let cq = q - c;
    let (d5, d6) = (ab.dot(cq), ac.dot(cq));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, Feature::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (
            b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))),
            Feature::Edge(1),
        );
    }
    let scale = 1.0 / (va + vb + vc);
    (a + ab * (vb * scale) + ac * (vc * scale), Feature::Face)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn soup(n: usize, rng: &mut ChaCha8Rng) -> TriMesh {
        let mut p = || Vec3::new(rng.random(), rng.random(), rng.random());
        let mut mesh = TriMesh::default();
        for i in 0..n as u32 {
            let a = p();
            mesh.points.extend([a, a + 0.1 * p(), a + 0.1 * p()]);
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        mesh
    }

    #[test]
    fn nearest_agrees_with_brute_force_overall_and_by_group() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mesh = soup(400, &mut rng);
        let groups: Vec<u32> = (0..400).map(|f| f / 90).collect();
        let bvh = TriangleBvh::with_groups(&mesh, &groups);
        let mut found = Vec::new();
        for _ in 0..300 {
            let q = Vec3::new(rng.random(), rng.random(), rng.random()) * 1.6 - 0.3;
            let distance = |f: usize| nearest_on_triangle(mesh.corners(f), q).0.distance_squared(q);
            let all: f64 = (0..400).map(distance).fold(f64::INFINITY, f64::min);
            assert_eq!(bvh.nearest(q, f64::INFINITY).unwrap().distance_sq, all);
            let limit = 0.09;
            bvh.nearest_by_group(q, limit, &mut found);
            let expected: Vec<(u32, f64)> = (0..5u32)
                .map(|g| {
                    let faces = (0..400).filter(|&f| groups[f] == g);
                    (g, faces.map(distance).fold(f64::INFINITY, f64::min))
                })
                .filter(|e| e.1 <= limit)
                .collect();
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn rays_meet_the_same_triangle_as_by_brute_force() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mesh = soup(400, &mut rng);
        let bvh = TriangleBvh::new(&mesh);
        let mut n_hits = 0;
        for _ in 0..300 {
            let mut p = || Vec3::new(rng.random(), rng.random(), rng.random());
            let (origin, direction) = (p(), (p() - 0.5).normalize());
            let all = (0..400u32).filter_map(|f| {
                ray_meets_triangle(mesh.corners(f as usize), origin, direction)
                    .map(|t| (f, t))
                    .filter(|h| h.1 <= 0.7)
            });
            let expected = all.min_by(|a, b| a.1.total_cmp(&b.1));
            n_hits += usize::from(expected.is_some());
            assert_eq!(bvh.first_hit(origin, direction, 0.7), expected);
        }
        assert!(n_hits > 3);
    }
}
