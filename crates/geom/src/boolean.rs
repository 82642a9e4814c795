//! Mesh booleans. No other file names the boolean library.
//!
//! A [`Volume`] is a possibly empty region of space bounded by a manifold mesh. Unions, intersections and
//! differences of volumes are always volumes. The library guarantees the topology of its results, and
//! [`Volume::to_mesh`] passes these on unchanged.

use std::panic::{self, AssertUnwindSafe};
use std::sync::atomic::{AtomicUsize, Ordering};

use manifold_rust::csg_tree::CsgNode;
use manifold_rust::linalg::{Mat3x4, Vec2, Vec3 as V};
use manifold_rust::manifold::Manifold;
use manifold_rust::polygon;
use manifold_rust::types::{Error, MeshGL64, OpType, WindingRule};

use crate::topology::{Topology, components};
use crate::{Aabb, Solid, TriMesh, Vec3, work};

/// Region bounded by a manifold mesh. May be empty, have several bodies, and have cavities.
#[derive(Clone)]
pub struct Volume(Manifold);

/// Error: the boolean library rejected a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the mesh bounds no volume: {reason}")]
pub struct NotAVolume {
    reason: String,
}

fn v(p: Vec3) -> V {
    V::new(p.x, p.y, p.z)
}

/// Triangles of the corners of a counter-clockwise polygon in the plane, by ears. Polygons that cross
/// themselves give triangles that overlap.
pub(crate) fn cut_by_ears(corners: &[[f64; 2]]) -> Vec<[u32; 3]> {
    /// The library's own tolerance, from the size of the polygon.
    const AUTOMATIC: f64 = -1.0;
    let outline = corners.iter().map(|&[x, y]| Vec2::new(x, y)).collect();
    polygon::triangulate(&vec![outline], AUTOMATIC, true)
        .into_iter()
        .map(|t| [t.x, t.y, t.z].map(|i| i as u32))
        .collect()
}

/// Counts a boolean operation on these volumes.
fn count_boolean<'a>(operands: impl IntoIterator<Item = &'a Volume>) {
    work::BOOLEANS.add(1);
    work::BOOLEAN_TRIANGLES.add(operands.into_iter().map(Volume::n_triangles).sum());
}

impl Volume {
    /// Creates the region that contains nothing.
    pub fn empty() -> Self {
        Self(Manifold::empty())
    }

    /// Creates the region inside a solid.
    ///
    /// Fails if the solid's surface is pinched in a way that the library rejects.
    pub fn from_solid(solid: &Solid) -> Result<Self, NotAVolume> {
        Self::from_closed_mesh(solid.mesh())
    }

    /// Creates the region inside a closed, oriented mesh, which may be empty or have cavities.
    pub fn from_closed_mesh(mesh: &TriMesh) -> Result<Self, NotAVolume> {
        if mesh.triangles.is_empty() {
            return Ok(Self::empty());
        }
        work::VOLUME_TRIANGLES.add(mesh.triangles.len());
        let made = Manifold::from_mesh_gl64(&as_gl(mesh));
        match made.status() {
            Error::NoError => Ok(Self(made)),
            other => Err(NotAVolume {
                reason: format!("{other:?}"),
            }),
        }
    }

    /// Convex hull of `points`; empty if they lie in a plane.
    pub fn hull(points: &[Vec3]) -> Self {
        let points: Vec<V> = points.iter().map(|&p| v(p)).collect();
        work::HULLS.add(1);
        let hull = Manifold::hull(&points);
        if hull.status() == Error::NoError && hull.volume() > 0.0 {
            Self(hull)
        } else {
            Self::empty()
        }
    }

    /// Box from `b.min` to `b.max`.
    pub fn cuboid(b: Aabb) -> Self {
        Self(Manifold::cube(v(b.size()), false).translate(v(b.min)))
    }

    /// Union of all `parts`. The cost grows with their mutual overlap. Nearby parts are united first and
    /// halves run in parallel, so that most operations have small operands.
    pub fn union_all(parts: Vec<Self>) -> Self {
        let parts: Vec<(Aabb, Self)> = parts
            .into_iter()
            .filter(|part| !part.is_empty())
            .map(|part| (part.bounds(), part))
            .collect();
        Self::unite(parts)
    }

    fn unite(mut parts: Vec<(Aabb, Self)>) -> Self {
        /// Number of parts up to which they are united in one operation.
        const FEW: usize = 16;
        if parts.len() <= FEW {
            return Self::unite_at_once(parts.into_iter().map(|(_, part)| part).collect());
        }
        let middles = Aabb::around(parts.iter().map(|(around, _)| around.center()));
        let axis = middles.size().to_array();
        let axis = (0..3).fold(0, |most, i| if axis[i] > axis[most] { i } else { most });
        parts.sort_by(|(a, _), (b, _)| a.center()[axis].total_cmp(&b.center()[axis]));
        let rest = parts.split_off(parts.len() / 2);
        let (a, b) = rayon::join(|| Self::unite(parts), || Self::unite(rest));
        a.union(&b)
    }

    fn unite_at_once(mut parts: Vec<Self>) -> Self {
        match parts.len() {
            0 => Self::empty(),
            1 => parts.remove(0),
            _ => {
                count_boolean(parts.iter());
                let leaves = parts
                    .into_iter()
                    .map(|p| CsgNode::leaf(p.0.into_impl()))
                    .collect();
                Self(Manifold::from_impl(CsgNode::op_n(OpType::Add, leaves).evaluate()))
            }
        }
    }

    /// Union: the region in either volume.
    pub fn union(&self, other: &Self) -> Self {
        match (self.is_empty(), other.is_empty()) {
            (true, _) => other.clone(),
            (_, true) => self.clone(),
            _ => {
                count_boolean([self, other]);
                Self(self.0.union(&other.0))
            }
        }
    }

    /// Intersection: the region in both volumes.
    pub fn intersect(&self, other: &Self) -> Self {
        if !self.boxes_meet(other) {
            return Self::empty();
        }
        count_boolean([self, other]);
        Self(self.0.intersection(&other.0))
    }

    /// Difference: the region in `self` that is not in `other`.
    pub fn subtract(&self, other: &Self) -> Self {
        if !self.boxes_meet(other) {
            return self.clone();
        }
        count_boolean([self, other]);
        Self(self.0.difference(&other.0))
    }

    /// Splits the region into the part inside `cutter` and the part outside it: an exact partition.
    pub fn split(&self, cutter: &Self) -> (Self, Self) {
        if !self.boxes_meet(cutter) {
            return (Self::empty(), self.clone());
        }
        count_boolean([self, cutter]);
        let (inside, outside) = self.0.split(&cutter.0);
        (Self(inside), Self(outside))
    }

    /// Moves the region by `by` mm.
    pub fn translate(&self, by: Vec3) -> Self {
        Self(self.0.translate(v(by)))
    }

    /// Rotates the region about the origin. The columns are the images of the axes.
    pub fn rotate(&self, columns: [Vec3; 3]) -> Self {
        let [x, y, z] = columns.map(v);
        Self(
            self.0
                .transform(&Mat3x4::from_cols(x, y, z, V::new(0.0, 0.0, 0.0))),
        )
    }

    /// Reduces the number of triangles, keeping the shape within `tolerance_mm`. The result stays manifold.
    pub fn simplify(&self, tolerance_mm: f64) -> Self {
        Self(self.0.simplify(tolerance_mm))
    }

    /// Volume of the region, mm³.
    pub fn volume(&self) -> f64 {
        if self.is_empty() { 0.0 } else { self.0.volume() }
    }

    /// Surface area of the region, mm².
    pub fn area(&self) -> f64 {
        if self.is_empty() {
            0.0
        } else {
            self.0.surface_area()
        }
    }

    /// Returns true if the region is empty.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Number of triangles on the boundary.
    pub fn n_triangles(&self) -> usize {
        self.0.num_tri()
    }

    /// Euler genus of the whole boundary; only meaningful for one body.
    pub fn genus(&self) -> i32 {
        self.0.genus()
    }

    /// Bounding box of the region; [`Aabb::EMPTY`] if the region is empty.
    pub fn bounds(&self) -> Aabb {
        if self.is_empty() {
            return Aabb::EMPTY;
        }
        let b = self.0.bounding_box();
        Aabb {
            min: Vec3::new(b.min.x, b.min.y, b.min.z),
            max: Vec3::new(b.max.x, b.max.y, b.max.z),
        }
    }

    /// Connected boundary surfaces, largest volume first. A cavity appears as a component that faces inwards
    /// ([`signed_volume`](Self::signed_volume)).
    pub fn components(&self) -> Vec<Self> {
        let mut parts: Vec<Self> = self.0.decompose().into_iter().map(Self).collect();
        parts.sort_by(|a, b| b.volume().total_cmp(&a.volume()));
        parts
    }

    /// Enclosed volume, mm³, negative if the surface faces inwards, as a cavity's surface on its own does.
    /// [`volume`](Self::volume) has no sign.
    pub fn signed_volume(&self) -> f64 {
        self.to_mesh().signed_volume()
    }

    /// Region bounded by those connected boundary surfaces whose points `keep` accepts.
    pub fn retain(&self, keep: impl Fn(&mut dyn Iterator<Item = Vec3>) -> bool) -> Self {
        let mesh = self.to_mesh();
        // The library's own decomposition copies all points for every part, which takes gigabytes if a cut
        // leaves many fragments. It is needed only if parts share an edge, since half-edges cannot separate
        // these.
        let Some(topology) = Topology::of_mesh(&mesh) else {
            return self.retain_components(keep);
        };
        let (component, n) = components(&topology, |_, _| true);
        let mut points: Vec<Vec<u32>> = vec![Vec::new(); n];
        let mut is_told = vec![false; mesh.points.len()];
        for (triangle, &c) in mesh.triangles.iter().zip(&component) {
            let new = triangle
                .iter()
                .filter(|v| !std::mem::replace(&mut is_told[**v as usize], true));
            points[c as usize].extend(new);
        }
        let is_kept: Vec<bool> = points
            .iter()
            .map(|p| keep(&mut p.iter().map(|&v| mesh.points[v as usize])))
            .collect();
        if is_kept.iter().all(|k| *k) {
            return self.clone();
        }
        let kept = mesh
            .triangles
            .iter()
            .zip(&component)
            .filter(|(_, c)| is_kept[**c as usize])
            .map(|(t, _)| *t);
        let part = TriMesh {
            triangles: kept.collect(),
            points: mesh.points,
        }
        .without_unused_points();
        Self::from_closed_mesh(&part).expect("a closed part of a manifold is a manifold")
    }

    fn retain_components(&self, keep: impl Fn(&mut dyn Iterator<Item = Vec3>) -> bool) -> Self {
        let parts = self.0.decompose();
        let n_parts = parts.len();
        let is_kept = |part: &Manifold| {
            let gl = part.get_mesh_gl64(-1);
            let step = usize::try_from(gl.num_prop).expect("three properties a point");
            keep(
                &mut gl
                    .vert_properties
                    .chunks_exact(step)
                    .map(|c| Vec3::new(c[0], c[1], c[2])),
            )
        };
        let kept: Vec<Manifold> = parts.into_iter().filter(is_kept).collect();
        if kept.len() == n_parts {
            self.clone()
        } else {
            Self(Manifold::compose(&kept))
        }
    }

    /// Boundary of the region as a mesh; no points if empty. The order depends only on how the region was
    /// made. The library's own export instead sorts triangles by the time at which their sources were made,
    /// which varies if several threads make them.
    pub fn to_mesh(&self) -> TriMesh {
        let made = self.0.as_impl();
        let index = |i: i32| u32::try_from(i).expect("edges of a made body have points");
        TriMesh {
            points: made.vert_pos.iter().map(|p| Vec3::new(p.x, p.y, p.z)).collect(),
            triangles: made
                .halfedge
                .as_chunks::<3>()
                .0
                .iter()
                .map(|edges| edges.each_ref().map(|e| index(e.start_vert)))
                .collect(),
        }
    }

    fn boxes_meet(&self, other: &Self) -> bool {
        !self.is_empty() && !other.is_empty() && self.bounds().intersects(other.bounds())
    }
}

/// Boundary of the region that a closed mesh winds around at least once. Overlapping parts become one and
/// surfaces inside others vanish. The result does not cross itself and has no edge with more than two
/// triangles.
///
/// Uses exact arithmetic; the cost grows with the number of crossing pairs of triangles. Fails if the mesh is
/// open or not oriented.
pub fn rebuild(mesh: &TriMesh) -> Result<TriMesh, NotAVolume> {
    try_rotations(mesh, |mesh| {
        let soup = Manifold::from_mesh_gl64_robust(&as_gl(mesh));
        let refused = |made: &Manifold| NotAVolume {
            reason: format!("{:?}", made.status()),
        };
        if soup.status() != Error::NoError {
            return Err(refused(&soup));
        }
        let rebuilt = soup.rebuild_solid(WindingRule::Positive);
        if rebuilt.status() == Error::NoError {
            Ok(Volume(rebuilt).to_mesh())
        } else {
            Err(refused(&rebuilt))
        }
    })
    .and_then(|(rebuilt, turn)| Ok(turn.back(rebuilt?)))
}

/// Returns true if triangles of a closed mesh cross or overlap in a plane, decided exactly. Crossing in an
/// edge counts, too.
///
/// Fails if the library cannot decide.
pub fn touches_itself(mesh: &TriMesh) -> Result<bool, NotAVolume> {
    try_rotations(mesh, |mesh| {
        Manifold::from_mesh_gl64_robust(&as_gl(mesh)).has_self_intersections()
    })
    .map(|(touches, _)| touches)
}

/// Number of threads inside [`try_rotations`].
static N_GUARDED: AtomicUsize = AtomicUsize::new(0);

/// Returns true if a panic now may come from the library and become an error. A panic hook need not report
/// such a panic.
pub fn is_guarded() -> bool {
    N_GUARDED.load(Ordering::Relaxed) > 0
}

/// Rotation that rounds no coordinate: a cyclic permutation of the axes, then half a turn about z or none.
#[derive(Clone, Copy)]
struct Turn {
    n_places: usize,
    is_half: bool,
}

impl Turn {
    fn all() -> impl Iterator<Item = Self> {
        [false, true]
            .into_iter()
            .flat_map(|is_half| (0..3).map(move |n_places| Self { n_places, is_half }))
    }

    fn half(self, p: Vec3) -> Vec3 {
        if self.is_half {
            Vec3::new(-p.x, -p.y, p.z)
        } else {
            p
        }
    }

    fn forth(self, mut mesh: TriMesh) -> TriMesh {
        for p in &mut mesh.points {
            let mut axes = p.to_array();
            axes.rotate_left(self.n_places);
            *p = self.half(Vec3::from_array(axes));
        }
        mesh
    }

    fn back(self, mut mesh: TriMesh) -> TriMesh {
        for p in &mut mesh.points {
            let mut axes = self.half(*p).to_array();
            axes.rotate_right(self.n_places);
            *p = Vec3::from_array(axes);
        }
        mesh
    }
}

/// Runs `work` on the rotated mesh, trying one rotation after the other until `work` does not panic. Returns
/// the result and the rotation.
///
/// The library casts rays in a dozen directions, and panics if every ray meets an edge, as happens for meshes
/// with integer coordinates. In a rotated mesh the rays take other paths.
fn try_rotations<T>(mesh: &TriMesh, work: impl Fn(&TriMesh) -> T) -> Result<(T, Turn), NotAVolume> {
    N_GUARDED.fetch_add(1, Ordering::Relaxed);
    let tried = |turn: Turn| {
        let turned = turn.forth(mesh.clone());
        panic::catch_unwind(AssertUnwindSafe(|| work(&turned)))
            .ok()
            .map(|made| (made, turn))
    };
    let done = Turn::all().find_map(tried);
    N_GUARDED.fetch_sub(1, Ordering::Relaxed);
    done.ok_or_else(|| NotAVolume {
        reason: "the exact union gave up".into(),
    })
}

fn as_gl(mesh: &TriMesh) -> MeshGL64 {
    MeshGL64 {
        num_prop: 3,
        vert_properties: mesh.points.iter().flat_map(|p| p.to_array()).collect(),
        tri_verts: mesh.triangles.iter().flatten().map(|&i| u64::from(i)).collect(),
        ..MeshGL64::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::cuboid;

    fn cube(min: Vec3, size: f64) -> Volume {
        cuboid(min, min + size)
    }

    #[test]
    fn volumes_add_up() {
        let (a, b) = (cube(Vec3::ZERO, 2.0), cube(Vec3::splat(0.7), 2.0));
        let (union, common) = (a.union(&b).volume(), a.intersect(&b).volume());
        assert!((union + common - a.volume() - b.volume()).abs() < 1e-12);
        let (inside, outside) = a.split(&b);
        assert!((inside.volume() + outside.volume() - 8.0).abs() < 1e-12);
        assert!((Volume::union_all(vec![a, b, Volume::empty()]).volume() - union).abs() < 1e-12);
    }

    #[test]
    fn a_cavity_is_a_component_of_negative_volume() {
        let (block, hole) = (cube(Vec3::ZERO, 4.0), cube(Vec3::splat(1.0), 1.0));
        let parts = block.subtract(&hole).components();
        let signed: Vec<f64> = parts.iter().map(Volume::signed_volume).collect();
        assert_eq!(signed, [64.0, -1.0]);
    }

    #[test]
    fn disjoint_and_empty_operands_are_answers() {
        let (a, b) = (cube(Vec3::ZERO, 1.0), cube(Vec3::splat(5.0), 1.0));
        assert!(a.intersect(&b).is_empty());
        assert_eq!(a.subtract(&Volume::empty()).volume(), a.volume());
        assert_eq!(a.union(&b).components().len(), 2);
        assert!(Volume::hull(&[Vec3::ZERO, Vec3::X, Vec3::Y]).is_empty());
    }

    #[test]
    fn retaining_is_choosing_among_bodies() {
        let both = cube(Vec3::ZERO, 1.0).union(&cube(Vec3::splat(5.0), 2.0));
        assert!((both.retain(|mut p| Iterator::all(&mut p, |p| p.x < 3.0)).volume() - 1.0).abs() < 1e-12);
        assert!((both.retain(|_| true).volume() - 9.0).abs() < 1e-12);
        assert!(both.retain(|_| false).is_empty());
    }

    /// Threads make volumes in any order, which must not show in the mesh.
    #[test]
    fn a_mesh_does_not_depend_on_which_part_was_made_first() {
        let slab = |x: f64| {
            let to = Vec3::new(x + 0.7, 1.0 + 0.1 * x, 1.0);
            Volume::cuboid(Aabb {
                min: Vec3::new(x, 0.1 * x, 0.0),
                max: to,
            })
        };
        let made = |order: [usize; 3]| {
            let mut slabs = vec![Volume::empty(); 3];
            for i in order {
                slabs[i] = slab(0.5 * i as f64);
            }
            Volume::union_all(slabs).to_mesh()
        };
        let first = made([0, 1, 2]);
        assert!(first.triangles.len() > 30);
        for order in [[2, 1, 0], [1, 0, 2], [0, 2, 1]] {
            assert_eq!(made(order), first);
        }
    }

    #[test]
    fn hulls_that_share_a_face_become_one_body() {
        let slab = |x0: f64, x1: f64| {
            let corners: Vec<Vec3> = [x0, x1]
                .into_iter()
                .flat_map(|x| {
                    [(0.0, 0.0), (1.1, 0.1), (0.3, 0.9), (1.3, 1.2)].map(|(y, z)| Vec3::new(x, y, z))
                })
                .collect();
            Volume::hull(&corners)
        };
        let joined = Volume::union_all(
            (0..5)
                .map(|i| slab(f64::from(i) * 0.7, f64::from(i + 1) * 0.7))
                .collect(),
        );
        assert_eq!(joined.components().len(), 1);
        assert!((joined.volume() - 5.0 * slab(0.0, 0.7).volume()).abs() < 1e-9);
    }
}
