//! Folds: triangles that lie upside down on their neighbours, a few micrometres apart.
//!
//! In a nearly flat region a point lies across an edge of the polygon around it. A triangle there is upside
//! down, and the surface runs back and forth over the triangle's area. Two changes can turn it the right way
//! up: the other diagonal of the triangle and a neighbour, or the collapse of an edge. The one that moves the
//! surface least is made.
//!
//! ```text
//!       u                   u
//!      /│\                 / \
//!     / │ \               /   \
//!    x  │w │  ── flip ─▶ x──w  │     w lies within the triangle vux: the triangle uvw is upside down
//!     \ │ /               \   /
//!      \│/                 \ /
//!       v                   v
//! ```

use super::crossing::crossings;
use super::{Draft, NEAR_SHARE, Repair, RepairKind};
use crate::bvh::TriangleBvh;
use crate::fold::has_material_in_front;
use crate::topology::{HalfEdge, Topology, ends};
use crate::{TriMesh, Vec3};

/// Most rounds of changes. A point that lies across several triangles needs one for each.
const MOST_ROUNDS: usize = 16;
/// Largest movement of the surface, as a share of the model's diagonal: 0.1 mm on a model of 200 mm.
const MOVE_SHARE: f64 = 5e-4;

/// Turns triangles the right way up that lie upside down on their neighbours. Folds stay where that would
/// move the surface too far, and all of them stay where the surface would cross itself.
pub(super) fn turn_folds(draft: &mut Draft) -> Option<Repair> {
    let diagonal = draft.mesh.bounds().diagonal();
    let near = NEAR_SHARE * diagonal;
    let mut next = folds(&draft.mesh, near);
    let at = draft.mesh.face_center(next.as_ref()?.1[0] as usize);
    let (mut unfolded, mut count) = (draft.clone(), 0);
    for _ in 0..MOST_ROUNDS {
        let Some((topology, folded)) = next else { break };
        let n_turned = Turning::new(&mut unfolded, topology, diagonal).turn(&folded);
        if n_turned == 0 {
            break;
        }
        count += n_turned;
        next = folds(&unfolded.mesh, near);
    }
    if count == 0 || crossings(&unfolded.mesh).count > crossings(&draft.mesh).count {
        return None;
    }
    *draft = unfolded;
    let kind = RepairKind::Unfolded;
    Some(Repair { kind, count, at })
}

/// Triangles that lie upside down, in order, with the topology of their surface: turned from a neighbour by
/// more than 90°, with material within `near` in front of them. `None` if there are none.
fn folds(mesh: &TriMesh, near: f64) -> Option<(Topology, Vec<u32>)> {
    let topology = Topology::of_mesh(mesh)?;
    let is_turned = |face: u32| {
        let normal = mesh.double_area_vector(face as usize);
        let from = |other: u32| mesh.double_area_vector(other as usize).dot(normal);
        topology
            .neighbours(face)
            .into_iter()
            .any(|other| from(other) < 0.0)
    };
    let faces = 0..mesh.triangles.len() as u32;
    let mut turned: Vec<u32> = faces.filter(|&face| is_turned(face)).collect();
    if !turned.is_empty() {
        let tree = TriangleBvh::new(mesh);
        turned.retain(|&face| has_material_in_front(mesh, &tree, face, near));
    }
    (!turned.is_empty()).then_some((topology, turned))
}

/// A change of the triangulation.
#[derive(Clone, Copy)]
enum Change {
    /// Replaces an edge by the other diagonal of its two triangles.
    Flip(HalfEdge),
    /// Merges the start of an edge into its end.
    Collapse(HalfEdge),
}

/// One round of changes, each at points that no other one touched.
struct Turning<'a> {
    draft: &'a mut Draft,
    topology: Topology,
    /// Movement of the surface that nobody sees, and the largest one that is allowed.
    near: f64,
    most: f64,
    is_touched: Vec<bool>,
    is_kept: Vec<bool>,
}

impl<'a> Turning<'a> {
    fn new(draft: &'a mut Draft, topology: Topology, diagonal: f64) -> Self {
        Self {
            near: NEAR_SHARE * diagonal,
            most: MOVE_SHARE * diagonal,
            is_touched: vec![false; draft.mesh.points.len()],
            is_kept: vec![true; draft.mesh.triangles.len()],
            draft,
            topology,
        }
    }

    /// Turns as many triangles of `folded` as it can. Returns their number.
    fn turn(mut self, folded: &[u32]) -> usize {
        let mut count = 0;
        for &face in folded {
            if let Some(change) = self.best(face) {
                self.make(change);
                count += 1;
            }
        }
        self.draft.retain(&self.is_kept);
        count
    }

    /// The change that turns `face` and moves the surface least: a flip of one of its edges, or a collapse of
    /// an edge at its corners. A collapse costs a point, so a flip that hardly moves anything comes first.
    fn best(&self, face: u32) -> Option<Change> {
        let least = |changes: &mut dyn Iterator<Item = Change>| {
            let moves = changes.filter_map(|change| Some((self.movement(change)?, change)));
            moves.min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let sides = [3 * face, 3 * face + 1, 3 * face + 2];
        let flip = least(&mut sides.into_iter().map(Change::Flip));
        if let Some((_, flip)) = flip.filter(|flip| flip.0 <= self.near) {
            return Some(flip);
        }
        let collapse = least(&mut sides.iter().flat_map(|&h| self.fan(h)).map(Change::Collapse));
        let either = flip.into_iter().chain(collapse);
        let best = either.min_by(|a, b| a.0.total_cmp(&b.0));
        best.filter(|best| best.0 <= self.most).map(|best| best.1)
    }

    /// Half-edges from the start of `h`, counter-clockwise.
    fn fan(&self, h: HalfEdge) -> Vec<HalfEdge> {
        let mut fan = vec![h];
        loop {
            let before = Topology::next(Topology::next(fan[fan.len() - 1]));
            match self.topology.opposite(before) {
                next if next == h => return fan,
                next => fan.push(next),
            }
        }
    }

    fn ends(&self, h: HalfEdge) -> [u32; 2] {
        ends(&self.draft.mesh, h).into()
    }

    /// Points around the start of `h`, counter-clockwise.
    fn ring(&self, h: HalfEdge) -> Vec<u32> {
        self.fan(h).into_iter().map(|h| self.ends(h)[1]).collect()
    }

    /// Ends of an edge, and the corners across it on either side.
    fn diamond(&self, h: HalfEdge) -> [u32; 4] {
        let [u, v] = self.ends(h);
        let across = |h: HalfEdge| self.ends(Topology::next(h))[1];
        [u, v, across(h), across(self.topology.opposite(h))]
    }

    /// Distance by which a change moves the surface; `None` if it is impossible or leaves a triangle upside
    /// down.
    fn movement(&self, change: Change) -> Option<f64> {
        match change {
            Change::Flip(h) => self.movement_of_flip(h),
            Change::Collapse(h) => self.movement_of_collapse(h),
        }
    }

    fn movement_of_flip(&self, h: HalfEdge) -> Option<f64> {
        let corners @ [.., w, x] = self.diamond(h);
        let at_w = Topology::next(Topology::next(h));
        if self.any_touched(&corners) || w == x || self.ring(at_w).contains(&x) {
            return None;
        }
        let [u, v, w, x] = corners.map(|p| self.draft.mesh.points[p as usize]);
        let beyond = doubled(v, u, x);
        let halves = [doubled(w, x, v), doubled(x, w, u)];
        let across = (v - u).cross(x - w);
        let is_upright = halves.iter().all(|half| half.dot(beyond) > 0.0);
        is_upright.then(|| (w - u).dot(across).abs() / across.length())
    }

    fn movement_of_collapse(&self, h: HalfEdge) -> Option<f64> {
        let [from, to] = self.ends(h);
        let ring = self.ring(h);
        let ring_of_end = self.ring(self.topology.opposite(h));
        let n_shared = ring.iter().filter(|p| ring_of_end.contains(p)).count();
        if n_shared != 2 || self.any_touched(&ring) || self.is_touched[from as usize] {
            return None;
        }
        let at = |p: u32| self.draft.mesh.points[p as usize];
        let pairs: Vec<[Vec3; 2]> = ring
            .iter()
            .zip(ring.iter().cycle().skip(1))
            .map(|(&p, &q)| [at(p), at(q)])
            .collect();
        let around: Vec3 = pairs.iter().map(|&[p, q]| doubled(at(from), p, q)).sum();
        // The space between the surface before and after: a tetrahedron over each triangle that is left.
        let mut most: f64 = 0.0;
        for &[p, q] in pairs.iter().filter(|pair| !pair.contains(&at(to))) {
            let left = doubled(at(to), p, q);
            if left.dot(around) <= 0.0 {
                return None;
            }
            most = most.max((at(from) - p).dot(left.normalize()).abs());
        }
        Some(most)
    }

    fn any_touched(&self, points: &[u32]) -> bool {
        points.iter().any(|&p| self.is_touched[p as usize])
    }

    fn make(&mut self, change: Change) {
        let touched = match change {
            Change::Flip(h) => self.flip(h),
            Change::Collapse(h) => self.collapse(h),
        };
        touched.iter().for_each(|&p| self.is_touched[p as usize] = true);
    }

    /// Flips an edge. Returns the points that the change touched.
    fn flip(&mut self, h: HalfEdge) -> Vec<u32> {
        let corners @ [u, v, w, x] = self.diamond(h);
        let [face, other] = [h, self.topology.opposite(h)].map(|h| h as usize / 3);
        self.draft.mesh.triangles[face] = [w, x, v];
        self.draft.mesh.triangles[other] = [x, w, u];
        // The triangle upside down lay on the other, which is the one that is seen.
        self.draft.source[face] = self.draft.source[other];
        corners.to_vec()
    }

    /// Collapses an edge. Returns the points that the change touched.
    fn collapse(&mut self, h: HalfEdge) -> Vec<u32> {
        let [from, to] = self.ends(h);
        let mut touched = self.ring(h);
        touched.push(from);
        for face in self.fan(h).into_iter().map(|h| h as usize / 3) {
            let corners = &mut self.draft.mesh.triangles[face];
            self.is_kept[face] = !corners.contains(&to);
            *corners = corners.map(|p| if p == from { to } else { p });
        }
        touched
    }
}

/// Normal of a triangle, as long as twice its area.
fn doubled(a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    (b - a).cross(c - a)
}
