//! Clearance: the least signed distance of two solids and its place, at rest or over a whole translation.
//!
//! Nothing is sampled. Over a translation the distance of two triangles is a convex function of the travel.
//! Its minimum is the distance of their shadows along the motion, or is reached at an end of the travels. Two
//! bounding volume hierarchies, one of them extended along the motion, leave few pairs to test.
//!
//! ```text
//!            far ┌ ─ ─ ┐
//!                  a + t·s        shadow of a      shadow of b
//!              ↑ └ ─ ─ ┘           ├──────┤         ├─────┤
//!            s │ ┌─────┐  ┌───┐            ←──────→
//!              │ │  a  │  │ b │       the gap, where heights allow
//!                └─────┘  └───┘
//! ```
//!
//! If the surfaces cross, the gap is negative: minus the *depth*. The depth is the greatest distance to the
//! other's surface of a point that is inside the other and is
//! - a corner of either mesh, at any of the travels, or
//! - a point on an edge of either mesh, at the first travel.
//!
//! Two faceted faces that overlap slightly and are nearly parallel overlap most at such a point. Limits: if
//! faces cross at a large angle, their interiors can lie deeper than their edges. If only edges cross on the
//! way, they touch with a depth of 0. The distance needed to separate the solids is not computed.
//!
//! Parts of a surface can be ignored ([`Scope::WhatCounts`]). Distances are then those of the parts that
//! count. Depths are then tested for points that count if parts that count cross, and are measured to the
//! other's whole surface.

mod depth;
mod pair;
#[cfg(test)]
mod tests;
mod traverse;

use depth::{Deepest, Passage};
use pair::{Approach, sweep_box, swept};
use traverse::for_near_pairs;

use crate::bvh::TriangleBvh;
use crate::signed_distance::SignedDistance;
use crate::{Aabb, Solid, TriMesh, Vec3};

/// Distance below which surfaces count as touching, mm: a hundred times the rounding of coordinates near 100
/// mm.
const TOUCH_MM: f64 = 1e-9;

/// A solid prepared for clearance queries.
pub struct Shape {
    solid: Solid,
    distance: SignedDistance,
    bounds: Aabb,
    counts: Vec<bool>,
}

/// Place where two solids come nearest. All points are positions at the travel of the least gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Least distance, mm; 0 if the surfaces only touch; minus the depth if they cross.
    pub gap_mm: f64,
    /// Midpoint between the two surfaces, mm.
    pub at: Vec3,
    /// Point on the first solid's surface, mm.
    pub on_a: Vec3,
    /// Point on the second solid's surface, mm.
    pub on_b: Vec3,
}

/// Place where a moving solid comes nearest to one at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweptGap {
    /// Least distance over all travels, mm; 0 if the surfaces only touch; minus the depth if they cross.
    pub gap_mm: f64,
    /// A travel at which the distance is least, mm.
    pub travel_mm: f64,
    /// Midpoint between the two surfaces at that travel, mm.
    pub at: Vec3,
}

/// A translation, and its range of travels, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Translation {
    /// Direction, of any length; zero means no motion.
    pub along: Vec3,
    /// First travel, mm; unbounded if not finite.
    pub from_mm: f64,
    /// Last travel, mm; unbounded if not finite.
    pub far_mm: f64,
}

/// Parts of two surfaces that a query considers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// All triangles of both shapes.
    Everything,
    /// Triangles that count, of either shape.
    WhatCounts,
}

impl Shape {
    /// Prepares `solid` for queries; O(n log n).
    pub fn new(solid: &Solid) -> Self {
        Self {
            distance: SignedDistance::new(solid),
            bounds: solid.mesh().bounds(),
            counts: vec![true; solid.mesh().triangles.len()],
            solid: solid.clone(),
        }
    }

    /// Restricts [`Scope::WhatCounts`] to the triangles whose index `counts` accepts.
    #[must_use]
    pub fn count_only(mut self, counts: impl Fn(usize) -> bool) -> Self {
        (0..self.counts.len()).for_each(|f| self.counts[f] = counts(f));
        self
    }
}

/// Results of a query for both scopes, which cost little more than one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByScope<T> {
    /// Result of the query for [`Scope::Everything`].
    pub everything: Option<T>,
    /// Result of the query for [`Scope::WhatCounts`].
    pub what_counts: Option<T>,
}

impl<T> ByScope<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> ByScope<U> {
        ByScope {
            everything: self.everything.map(&f),
            what_counts: self.what_counts.map(&f),
        }
    }

    fn of(self, scope: Scope) -> Option<T> {
        match scope {
            Scope::Everything => self.everything,
            Scope::WhatCounts => self.what_counts,
        }
    }
}

/// Finds the place where `a` and `b` come nearest; `None` if that is farther than `within_mm`. Distances are
/// exact up to rounding, depths to 0.1 µm.
pub fn least_gap(a: &Shape, b: &Shape, scope: Scope, within_mm: f64) -> Option<Gap> {
    Some(
        Encounter::new([a, b], &REST, within_mm)?
            .nearest(&[scope])
            .of(scope)?
            .0,
    )
}

/// Finds the places where `a` and `b` come nearest, for both scopes, as [`least_gap`] does.
pub fn least_gaps(a: &Shape, b: &Shape, within_mm: f64) -> ByScope<Gap> {
    gaps_of([a, b], &REST, within_mm).map(|found| found.0)
}

/// Finds the place where `moving` comes nearest to `fixed` over all travels of `motion`; `None` if that is
/// farther than `within_mm`. Distances are exact up to rounding, depths to 0.1 µm. With the single travel 0,
/// the result equals that of [`least_gap`].
pub fn swept_gap(
    moving: &Shape,
    fixed: &Shape,
    motion: &Translation,
    scope: Scope,
    within_mm: f64,
) -> Option<SweptGap> {
    let encounter = Encounter::new([moving, fixed], motion, within_mm)?;
    encounter.nearest(&[scope]).of(scope).map(SweptGap::from)
}

/// Finds the places where `moving` comes nearest to `fixed`, for both scopes, as [`swept_gap`] does.
pub fn swept_gaps(moving: &Shape, fixed: &Shape, motion: &Translation, within_mm: f64) -> ByScope<SweptGap> {
    gaps_of([moving, fixed], motion, within_mm).map(SweptGap::from)
}

fn gaps_of(shapes: [&Shape; 2], motion: &Translation, within_mm: f64) -> ByScope<(Gap, f64)> {
    let nothing = ByScope {
        everything: None,
        what_counts: None,
    };
    let encounter = Encounter::new(shapes, motion, within_mm);
    encounter.map_or(nothing, |e| e.nearest(&[Scope::Everything, Scope::WhatCounts]))
}

/// Translation of a shape that stays at rest.
const REST: Translation = Translation {
    along: Vec3::ZERO,
    from_mm: 0.0,
    far_mm: 0.0,
};

impl From<(Gap, f64)> for SweptGap {
    fn from((gap, travel_mm): (Gap, f64)) -> Self {
        Self {
            gap_mm: gap.gap_mm,
            travel_mm,
            at: gap.at,
        }
    }
}

/// A triangle that a moving surface passes too closely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passed {
    /// Index of the triangle.
    pub face: u32,
    /// Bounding box, at travel 0, of the triangles of the moving surface that pass too closely.
    pub by: Aabb,
}

/// Finds the triangles of `fixed` within `within_mm` of a triangle of `moving` at any travel of `motion`, in
/// ascending order. The surfaces need not be closed. Distances are exact up to rounding.
pub fn find_passed_faces(
    moving: &TriMesh,
    fixed: &TriMesh,
    motion: &Translation,
    within_mm: f64,
) -> Vec<Passed> {
    let along = motion.along.normalize_or_zero();
    let axes = axes_along(along);
    let meshes = [moving, fixed].map(|mesh| rotate(mesh, axes));
    let travels = travels_of(motion, along, meshes.each_ref().map(TriMesh::bounds));
    let [a, b] = trees(&meshes, travels, within_mm);
    let mut by = vec![Aabb::EMPTY; b.faces.len()];
    let limit_sq = within_mm * within_mm;
    for_near_pairs(&a.bvh, &b.bvh, travels, &mut { limit_sq }, |i, j, _, _| {
        if swept(a.bvh.corners[i], b.bvh.corners[j], travels, limit_sq).is_some() {
            let mover = Aabb::around(moving.corners(a.face(i) as usize));
            let of_face = &mut by[b.bvh.faces[j] as usize];
            *of_face = of_face.union(mover);
        }
    });
    let passed = b.faces.iter().zip(by).filter(|(_, by)| *by != Aabb::EMPTY);
    passed.map(|(&face, by)| Passed { face, by }).collect()
}

/// Two shapes, one of which moves, in axes whose z is the direction of motion.
struct Encounter<'a> {
    passage: Passage<'a>,
    axes: [Vec3; 3],
    limit_mm: f64,
    /// Triangles that may come within the limit: of the moving shape, and of the fixed one.
    trees: [Tree; 2],
}

/// Some triangles of a shape, in the encounter's axes.
struct Tree {
    bvh: TriangleBvh,
    /// Index in the shape of each triangle of the hierarchy; ascending.
    faces: Vec<u32>,
}

impl<'a> Encounter<'a> {
    /// Prepares the triangles that may come within the limit; `None` if the shapes' boxes do not.
    fn new(shapes: [&'a Shape; 2], motion: &Translation, limit_mm: f64) -> Option<Self> {
        let along = motion.along.normalize_or_zero();
        let axes = axes_along(along);
        if are_apart(
            shapes.map(|shape| rotate_box(shape.bounds, axes)),
            along,
            motion,
            limit_mm,
        ) {
            return None;
        }
        let meshes = shapes.map(|shape| rotate(shape.solid.mesh(), axes));
        let travels = travels_of(motion, along, meshes.each_ref().map(TriMesh::bounds));
        let trees = trees(&meshes, travels, limit_mm);
        let [moving, fixed] = shapes;
        Some(Self {
            passage: Passage {
                mover: moving,
                obstacle: fixed,
                along,
                travels,
            },
            axes,
            limit_mm,
            trees,
        })
    }

    /// Finds the least gap, and the travel at which it occurs, for each of `scopes`.
    fn nearest(&self, scopes: &[Scope]) -> ByScope<(Gap, f64)> {
        let approaches = self.approaches(scopes);
        let touches = |a: Option<Approach>| a.is_some_and(|a| a.distance_sq <= TOUCH_MM * TOUCH_MM);
        // Parts that count touch only where something touches.
        let is_met = touches(approaches.everything) || touches(approaches.what_counts);
        let crossings = if is_met { self.crossings() } else { Vec::new() };
        let of = |scope: Scope| {
            let approach = approaches.of(scope);
            let deepest = self.deepest(scope, touches(approach), &crossings);
            if deepest.depth_mm > TOUCH_MM {
                return Some((
                    gap_between(-deepest.depth_mm, deepest.point, deepest.surface),
                    deepest.travel_mm,
                ));
            }
            let [x, y, z] = self.axes;
            let approach = approach?;
            let [on_a, on_b] = [approach.on_a, approach.on_b].map(|p| p.x * x + p.y * y + p.z * z);
            let gap_mm = if touches(Some(approach)) {
                0.0
            } else {
                approach.distance_sq.sqrt()
            };
            Some((gap_between(gap_mm, on_a, on_b), approach.travel_mm))
        };
        let asked = |scope| scopes.contains(&scope).then(|| of(scope)).flatten();
        ByScope {
            everything: asked(Scope::Everything),
            what_counts: asked(Scope::WhatCounts),
        }
    }

    /// Finds the nearest approach of the surfaces within the limit, for each of `scopes`, in one traversal.
    /// If the surfaces meet, it is the first meeting found.
    fn approaches(&self, scopes: &[Scope]) -> ByScope<Approach> {
        let ([a, b], travels) = (&self.trees, self.passage.travels);
        let mut best: [Option<Approach>; 2] = [None; 2];
        // Nothing is nearer than touching, so a negative limit ends the search of a scope.
        let mut limits_sq = [Scope::Everything, Scope::WhatCounts].map(|scope| {
            if scopes.contains(&scope) && self.has_any(scope) {
                self.limit_mm * self.limit_mm
            } else {
                -1.0
            }
        });
        let mut limit_sq = limits_sq[0].max(limits_sq[1]);
        for_near_pairs(
            &a.bvh,
            &b.bvh,
            travels,
            &mut limit_sq,
            |i, j, apart_sq, limit_sq| {
                let counts = self.counts(0, a.face(i)) && self.counts(1, b.face(j));
                let within_sq = if counts { *limit_sq } else { limits_sq[0] };
                if apart_sq > within_sq {
                    return;
                }
                let Some(found) = swept(a.bvh.corners[i], b.bvh.corners[j], travels, within_sq) else {
                    return;
                };
                for scope in 0..=usize::from(counts) {
                    if found.distance_sq <= limits_sq[scope]
                        && best[scope].is_none_or(|b| found.distance_sq < b.distance_sq)
                    {
                        best[scope] = Some(found);
                        limits_sq[scope] = if found.distance_sq <= TOUCH_MM * TOUCH_MM {
                            -1.0
                        } else {
                            found.distance_sq
                        };
                    }
                }
                *limit_sq = limits_sq[0].max(limits_sq[1]);
            },
        );
        ByScope {
            everything: best[0],
            what_counts: best[1],
        }
    }

    /// Pairs of triangles that touch at any travel, sorted.
    fn crossings(&self) -> Vec<(u32, u32)> {
        let ([a, b], travels) = (&self.trees, self.passage.travels);
        let mut crossings = Vec::new();
        let touch_sq = TOUCH_MM * TOUCH_MM;
        for_near_pairs(&a.bvh, &b.bvh, travels, &mut { touch_sq }, |i, j, _, _| {
            if swept(a.bvh.corners[i], b.bvh.corners[j], travels, touch_sq).is_some() {
                crossings.push((a.face(i), b.face(j)));
            }
        });
        crossings.sort_unstable();
        crossings
    }

    /// Finds the deepest point of either shape in the other, of the triangles in scope.
    fn deepest(&self, scope: Scope, touches: bool, crossings: &[(u32, u32)]) -> Deepest {
        let Passage {
            mover: moving,
            obstacle: fixed,
            along,
            travels,
        } = self.passage;
        let start = travels[0] * along;
        let mut best = Deepest::default();
        let moved = Aabb {
            min: moving.bounds.min + start,
            max: moving.bounds.max + start,
        };
        if !touches && !moved.intersects(fixed.bounds) {
            return best;
        }
        let in_scope = |which: usize, face: u32| scope == Scope::Everything || self.counts(which, face);
        let is_crossing = |c: &&(u32, u32)| touches && in_scope(0, c.0) && in_scope(1, c.1);
        let crossings: Vec<(u32, u32)> = crossings.iter().filter(is_crossing).copied().collect();
        let near = |which: usize| -> Vec<u32> {
            let faces = self.trees[which].faces.iter().copied();
            faces.filter(|f| in_scope(which, *f)).collect()
        };
        self.passage.deepen(&near(0), &crossings, &mut best);

        // Now with exchanged roles: the fixed shape moves backwards past the moving one.
        let mut flipped: Vec<(u32, u32)> = crossings.into_iter().map(|(a, b)| (b, a)).collect();
        flipped.sort_unstable();
        let backwards = Passage {
            mover: fixed,
            obstacle: moving,
            along: -along,
            travels,
        };
        let mut theirs = Deepest {
            depth_mm: best.depth_mm,
            ..Deepest::default()
        };
        backwards.deepen(&near(1), &flipped, &mut theirs);
        if theirs.depth_mm > best.depth_mm {
            let shift = theirs.travel_mm * along;
            best = Deepest {
                point: theirs.point + shift,
                surface: theirs.surface + shift,
                ..theirs
            };
        }
        best
    }

    fn counts(&self, which: usize, face: u32) -> bool {
        let shape = [self.passage.mover, self.passage.obstacle][which];
        shape.counts[face as usize]
    }

    /// Returns true if both shapes have a triangle in scope that may come within the limit.
    fn has_any(&self, scope: Scope) -> bool {
        let has = |which: usize| {
            let mut faces = self.trees[which].faces.iter();
            faces.any(|&f| scope == Scope::Everything || self.counts(which, f))
        };
        has(0) && has(1)
    }
}

impl Tree {
    /// Builds the hierarchy of the triangles of `mesh` that meet `room`.
    fn of(mesh: &TriMesh, room: Aabb) -> Self {
        let is_near = |&f: &u32| Aabb::around(mesh.corners(f as usize)).intersects(room);
        let faces: Vec<u32> = (0..mesh.triangles.len() as u32).filter(is_near).collect();
        let triangles = faces.iter().map(|&f| mesh.triangles[f as usize]).collect();
        Self {
            bvh: TriangleBvh::new(&TriMesh {
                points: mesh.points.clone(),
                triangles,
            }),
            faces,
        }
    }

    /// Index in the shape of a triangle in leaf order.
    fn face(&self, leaf: usize) -> u32 {
        self.faces[self.bvh.faces[leaf] as usize]
    }
}

/// Axes in which a motion runs along z.
fn axes_along(along: Vec3) -> [Vec3; 3] {
    if along == Vec3::ZERO {
        return Vec3::AXES;
    }
    let (x, y) = along.any_orthonormal_pair();
    [x, y, along]
}

/// Box, in these axes, around a turned box.
fn rotate_box(bounds: Aabb, axes: [Vec3; 3]) -> Aabb {
    let (middle, half) = (bounds.center(), 0.5 * bounds.size());
    let middle = Vec3::from(axes.map(|axis| axis.dot(middle)));
    let half = Vec3::from(axes.map(|axis| axis.abs().dot(half)));
    Aabb {
        min: middle - half,
        max: middle + half,
    }
}

/// Returns true if a moving and a fixed shape within these boxes, whose z is along the motion, stay farther
/// than `limit_mm` apart at all travels.
fn are_apart(bounds: [Aabb; 2], along: Vec3, motion: &Translation, limit_mm: f64) -> bool {
    let [moving, fixed] = bounds;
    let travels = travels_of(motion, along, bounds);
    !sweep_box(moving, travels).grown(limit_mm).intersects(fixed)
}

fn rotate(mesh: &TriMesh, axes: [Vec3; 3]) -> TriMesh {
    let seen = |p: Vec3| Vec3::from(axes.map(|axis| axis.dot(p)));
    TriMesh {
        points: mesh.points.iter().map(|&p| seen(p)).collect(),
        triangles: mesh.triangles.clone(),
    }
}

/// Hierarchies of the triangles of a moving and a fixed mesh that can come within `limit_mm` of the other
/// mesh.
fn trees(meshes: &[TriMesh; 2], travels: [f64; 2], limit_mm: f64) -> [Tree; 2] {
    let [a, b] = meshes.each_ref().map(TriMesh::bounds);
    let room_of_a = sweep_box(b, [-travels[1], -travels[0]]).grown(limit_mm);
    let room_of_b = sweep_box(a, travels).grown(limit_mm);
    [Tree::of(&meshes[0], room_of_a), Tree::of(&meshes[1], room_of_b)]
}

/// Travels of `motion` that matter for two boxes in its axes; only 0 if it has no direction.
fn travels_of(motion: &Translation, along: Vec3, bounds: [Aabb; 2]) -> [f64; 2] {
    if along == Vec3::ZERO {
        [0.0; 2]
    } else {
        travels_that_matter(bounds, [motion.from_mm, motion.far_mm])
    }
}

/// Range of travels that contains the least distance. Before and after it, the two boxes are past each other
/// along the motion.
fn travels_that_matter([moving, fixed]: [Aabb; 2], [from, far]: [f64; 2]) -> [f64; 2] {
    let (reached, passed) = (fixed.min.z - moving.max.z, fixed.max.z - moving.min.z);
    let far = if far.is_finite() { far } else { passed };
    let from = if from.is_finite() {
        from.min(far)
    } else {
        reached.min(far)
    };
    [from.max(reached).min(far), far.min(passed).max(from)]
}

fn gap_between(gap_mm: f64, on_a: Vec3, on_b: Vec3) -> Gap {
    Gap {
        gap_mm,
        at: 0.5 * (on_a + on_b),
        on_a,
        on_b,
    }
}
