//! A mutable closed triangle surface, with splitting, merging and flipping of edges.

use crate::{HalfEdge, Topology, TriMesh, Vec3};

/// Marks a half-edge without a seam.
pub(super) const NO_SEAM: u32 = u32::MAX;

/// Freedom of a point to move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// Anywhere on the surface: only one label around the point.
    Inside,
    /// Along the only seam through the point.
    Seam {
        /// Distance from the seam's start, mm.
        at_mm: f64,
    },
    /// Nowhere, since seams end or cross here.
    Corner,
}

/// Surface of half-edges: `3 · face + corner` starts at that corner of the triangle. Dead triangles remain as
/// gaps.
pub(super) struct Surface {
    pub points: Vec<Vec3>,
    pub place: Vec<Place>,
    /// One half-edge out of each point; [`HalfEdge::MAX`] for points that are gone.
    pub out: Vec<HalfEdge>,
    pub start: Vec<u32>,
    pub opposite: Vec<HalfEdge>,
    /// Seam along each half-edge, or [`NO_SEAM`].
    pub seam: Vec<u32>,
    pub label: Vec<u32>,
    pub is_dead: Vec<bool>,
}

pub(super) fn prev(h: HalfEdge) -> HalfEdge {
    Topology::next(Topology::next(h))
}

impl Surface {
    /// Builds the surface; `None` if `mesh` is not closed. Where fans of triangles meet in one point only,
    /// each fan gets its own point.
    pub fn new(mesh: &TriMesh, labels: &[u32]) -> Option<Self> {
        let topology = Topology::of_mesh(mesh)?;
        let n_half_edges = topology.n_half_edges();
        let mut surface = Self {
            points: Vec::with_capacity(mesh.points.len()),
            place: Vec::new(),
            out: Vec::with_capacity(mesh.points.len()),
            start: vec![u32::MAX; n_half_edges],
            opposite: (0..n_half_edges as u32).map(|h| topology.opposite(h)).collect(),
            seam: vec![NO_SEAM; n_half_edges],
            label: labels.to_vec(),
            is_dead: vec![false; mesh.triangles.len()],
        };
        for first in 0..n_half_edges as u32 {
            if surface.start[first as usize] != u32::MAX {
                continue;
            }
            let v = surface.points.len() as u32;
            surface
                .points
                .push(mesh.points[mesh.triangles[first as usize / 3][first as usize % 3] as usize]);
            surface.out.push(first);
            let mut h = first;
            while surface.start[h as usize] == u32::MAX {
                surface.start[h as usize] = v;
                h = surface.opposite[prev(h) as usize];
            }
        }
        surface.place = vec![Place::Inside; surface.points.len()];
        Some(surface)
    }

    pub fn ends(&self, h: HalfEdge) -> [u32; 2] {
        [self.start[h as usize], self.start[Topology::next(h) as usize]]
    }

    pub fn corners(&self, h: HalfEdge) -> [Vec3; 3] {
        [h, Topology::next(h), prev(h)].map(|h| self.points[self.start[h as usize] as usize])
    }

    pub fn length_sq(&self, h: HalfEdge) -> f64 {
        let [u, v] = self.ends(h).map(|v| self.points[v as usize]);
        u.distance_squared(v)
    }

    pub fn label_of(&self, h: HalfEdge) -> u32 {
        self.label[h as usize / 3]
    }

    pub fn is_inside(&self, v: u32) -> bool {
        self.place[v as usize] == Place::Inside
    }

    pub fn is_alive(&self, v: u32) -> bool {
        self.out[v as usize] != HalfEdge::MAX
    }

    /// Half-edges that leave `v`, counter-clockwise seen from outside.
    pub fn around(&self, v: u32) -> impl Iterator<Item = HalfEdge> + '_ {
        let first = self.out[v as usize];
        let mut next = (first != HalfEdge::MAX).then_some(first);
        std::iter::from_fn(move || {
            let h = next?;
            let turned = self.opposite[prev(h) as usize];
            next = (turned != first).then_some(turned);
            Some(h)
        })
    }

    pub fn are_neighbours(&self, u: u32, v: u32) -> bool {
        self.around(u).any(|h| self.ends(h)[1] == v)
    }

    /// Each edge that exists now once, as its lower half-edge.
    pub fn edges(&self) -> Vec<HalfEdge> {
        (0..self.start.len() as HalfEdge)
            .filter(|&h| !self.is_dead[h as usize / 3] && h < self.opposite[h as usize])
            .collect()
    }

    fn join(&mut self, g: HalfEdge, h: HalfEdge) {
        self.opposite[g as usize] = h;
        self.opposite[h as usize] = g;
    }

    /// Adds a triangle; its half-edges have no opposites yet.
    fn add_triangle(&mut self, corners: [u32; 3], seam: [u32; 3], label: u32) -> HalfEdge {
        let h = self.start.len() as HalfEdge;
        self.start.extend(corners);
        self.seam.extend(seam);
        self.opposite.extend([HalfEdge::MAX; 3]);
        self.label.push(label);
        self.is_dead.push(false);
        h
    }

    fn add_point(&mut self, point: Vec3, place: Place, out: HalfEdge) -> u32 {
        self.points.push(point);
        self.place.push(place);
        self.out.push(out);
        self.points.len() as u32 - 1
    }

    /// Puts a new point on the edge `u → v`:
    /// ```text
    ///        w                w
    ///      /   \            / | \
    ///     u ─h→ v   =>     u h→m─ v     and the same below
    ///      \   /            \ | /
    ///        x                x
    /// ```
    pub fn split(&mut self, h: HalfEdge, point: Vec3, place: Place) -> u32 {
        let g = self.opposite[h as usize];
        let [u, v] = self.ends(h);
        let along = self.seam[h as usize];
        let m = self.add_point(point, place, Topology::next(h));
        for (side, far) in [(h, v), (g, u)] {
            let (next, apex) = (Topology::next(side), self.apex(side));
            let beyond = self.opposite[next as usize];
            let new = self.add_triangle(
                [m, far, apex],
                [along, self.seam[next as usize], NO_SEAM],
                self.label_of(side),
            );
            self.join(new + 1, beyond);
            self.join(new + 2, next);
            self.start[next as usize] = m;
            self.seam[next as usize] = NO_SEAM;
        }
        // The new triangles are the last two. The one beside h starts with m → v, the one beside g with m →
        // u.
        let last = self.start.len() as HalfEdge;
        self.join(g, last - 6);
        self.join(h, last - 3);
        self.out[u as usize] = h;
        self.out[v as usize] = g;
        m
    }

    /// Inserts a new point into the triangle of `h`.
    pub fn insert(&mut self, h: HalfEdge, point: Vec3) {
        let edges = [h, Topology::next(h), prev(h)];
        let [a, b, c] = edges.map(|e| self.start[e as usize]);
        let [_, on_bc, on_ca] = edges.map(|e| self.opposite[e as usize]);
        let [_, seam_bc, seam_ca] = edges.map(|e| self.seam[e as usize]);
        let m = self.add_point(point, Place::Inside, edges[2]);
        let p = self.add_triangle([b, c, m], [seam_bc, NO_SEAM, NO_SEAM], self.label_of(h));
        let q = self.add_triangle([c, a, m], [seam_ca, NO_SEAM, NO_SEAM], self.label_of(h));
        self.join(p, on_bc);
        self.join(q, on_ca);
        self.join(p + 1, q + 2);
        self.join(p + 2, edges[1]);
        self.join(q + 1, edges[2]);
        self.start[edges[2] as usize] = m;
        self.seam[edges[1] as usize] = NO_SEAM;
        self.seam[edges[2] as usize] = NO_SEAM;
        self.out[a as usize] = h;
        self.out[b as usize] = p;
        self.out[c as usize] = q;
    }

    /// Flips edge `h`, so that it joins the two opposite corners.
    pub fn turn(&mut self, h: HalfEdge) {
        let g = self.opposite[h as usize];
        let outer = [Topology::next(h), prev(h), Topology::next(g), prev(g)];
        let [v, w, u, x] = outer.map(|e| self.start[e as usize]);
        let [vw, wu, ux, xv] = outer.map(|e| (self.opposite[e as usize], self.seam[e as usize]));
        // Triangles (u, v, w) and (v, u, x) become (x, w, u) and (w, x, v).
        for (slot, start, (beyond, seam)) in [
            (outer[0], w, wu),
            (outer[1], u, ux),
            (outer[2], x, xv),
            (outer[3], v, vw),
        ] {
            self.start[slot as usize] = start;
            self.seam[slot as usize] = seam;
            self.join(slot, beyond);
            self.out[start as usize] = slot;
        }
        self.start[h as usize] = x;
        self.start[g as usize] = w;
    }

    /// Merges the end of `h` into its start, which stays in place.
    pub fn merge(&mut self, h: HalfEdge) {
        let [u, v] = self.ends(h);
        let fan: Vec<HalfEdge> = self.around(v).collect();
        for a in fan {
            self.start[a as usize] = u;
        }
        for side in [h, self.opposite[h as usize]] {
            let (next, prev) = (Topology::next(side), prev(side));
            let seam = self.seam[next as usize].min(self.seam[prev as usize]);
            let (a, b) = (self.opposite[next as usize], self.opposite[prev as usize]);
            self.join(a, b);
            self.is_dead[side as usize / 3] = true;
            for kept in [a, b] {
                self.seam[kept as usize] = seam;
                self.out[self.start[kept as usize] as usize] = kept;
            }
        }
        self.out[v as usize] = HalfEdge::MAX;
    }

    /// Returns true if merging the end of `h` into its start keeps the surface manifold, and keeps the
    /// regions, the seams and the corners.
    pub fn may_merge(&self, h: HalfEdge) -> bool {
        let g = self.opposite[h as usize];
        let [u, v] = self.ends(h);
        let is_on_seam = self.seam[h as usize] != NO_SEAM;
        let moves = match self.place[v as usize] {
            Place::Inside => true,
            Place::Seam { .. } => is_on_seam,
            Place::Corner => false,
        };
        let sides = [h, g].map(|h| self.apex(h));
        let makes_bridge = || {
            !self.is_inside(u)
                && self.is_inside(v)
                && self
                    .around(v)
                    .map(|a| self.ends(a)[1])
                    .any(|w| w != u && !sides.contains(&w) && !self.is_inside(w))
        };
        moves
            && sides[0] != sides[1]
            && !self.is_between_seams(h)
            && !self.is_between_seams(g)
            && !makes_bridge()
            && sides.iter().all(|&w| self.around(w).nth(3).is_some())
            && self
                .around(u)
                .filter(|&a| self.are_neighbours(self.ends(a)[1], v))
                .count()
                == 2
    }

    /// Returns true if flipping `h` keeps the surface manifold and the seams.
    pub fn may_turn(&self, h: HalfEdge) -> bool {
        let [w, x] = [h, self.opposite[h as usize]].map(|h| self.apex(h));
        self.seam[h as usize] == NO_SEAM
            && w != x
            && self.ends(h).iter().all(|&v| self.around(v).nth(3).is_some())
            && !self.are_neighbours(w, x)
    }

    /// Returns true if `h` joins two points of seams through the inside of a region.
    pub fn is_bridge(&self, h: HalfEdge) -> bool {
        self.seam[h as usize] == NO_SEAM && self.ends(h).iter().all(|&v| !self.is_inside(v))
    }

    /// Mesh and labels of the living triangles, with points numbered by first use.
    pub fn finish(&self) -> (TriMesh, Vec<u32>) {
        let mut name = vec![u32::MAX; self.points.len()];
        let (mut mesh, mut labels) = (TriMesh::default(), Vec::new());
        for (face, corners) in self
            .start
            .chunks_exact(3)
            .enumerate()
            .filter(|(face, _)| !self.is_dead[*face])
        {
            let triangle = [corners[0], corners[1], corners[2]].map(|v| {
                let name = &mut name[v as usize];
                if *name == u32::MAX {
                    *name = mesh.points.len() as u32;
                    mesh.points.push(self.points[v as usize]);
                }
                *name
            });
            mesh.triangles.push(triangle);
            labels.push(self.label[face]);
        }
        (mesh, labels)
    }
}
