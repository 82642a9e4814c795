//! Removal of cuts that no seam needs any more.
//!
//! Each change of a division smooths all seams, cuts triangles along them, and halves edges beside them.
//! Without this, the triangles along former seams would stay, and ten changes would make a surface five
//! times as large. So the part of each patch in each triangle of the first surface is drawn anew, with the
//! points on its outline that a neighbour needs.
//!
//! ```text
//!      /|\               /\
//!     / | \             /  \
//!    /--+--\    ──►    /    \      the neighbour on the right is cut by a seam,
//!   / \ | / *         /      *     so the point * on the common edge stays
//!  /___\|/___\       /________\
//! ```

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use shellock_geom::union_find::root;
use shellock_geom::{Topology, TriMesh, Vec3};
use shellock_surface::SegmentedSurface;

/// Least double area of a triangle that is made, as a share of the square of its longest edge: rounding.
const LEAST_SHAPE: f64 = 1e-9;

/// Returns `surface` without the cuts that its seams do not need. `base` and `surface` are divisions of one
/// model in one place, and `surface` was made from `base` by cuts alone. Seams keep their points.
pub fn coarsen(base: &SegmentedSurface, surface: SegmentedSurface) -> SegmentedSurface {
    let Some(mut units) = Units::new(base, &surface) else {
        return surface;
    };
    let drawn = units.draw();
    let mut next = SegmentedSurface {
        mesh: TriMesh::default(),
        patch_of_face: Vec::new(),
        source_face: Vec::new(),
        n_patches: surface.n_patches,
    };
    let mut number = vec![u32::MAX; surface.mesh.points.len()];
    let mut add = |triangle: [u32; 3], face: u32| {
        let corners = triangle.map(|v| {
            if number[v as usize] == u32::MAX {
                number[v as usize] = next.mesh.points.len() as u32;
                next.mesh.points.push(surface.mesh.points[v as usize]);
            }
            number[v as usize]
        });
        next.mesh.triangles.push(corners);
        next.patch_of_face.push(surface.patch_of_face[face as usize]);
        next.source_face.push(surface.source_face[face as usize]);
    };
    for (faces, drawn) in units.faces_of.iter().zip(&drawn) {
        match drawn {
            Some(triangles) => triangles.iter().for_each(|t| add(*t, faces[0])),
            None => faces
                .iter()
                .for_each(|&f| add(surface.mesh.triangles[f as usize], f)),
        }
    }
    next
}

/// Connected parts of patches within triangles of the base.
struct Units<'a> {
    surface: &'a SegmentedSurface,
    topology: Topology,
    unit_of: Vec<u32>,
    /// Triangles of each unit.
    faces_of: Vec<Vec<u32>>,
    /// True for units that are drawn anew.
    is_drawn: Vec<bool>,
    /// True for points of the base.
    is_of_base: Vec<bool>,
}

impl<'a> Units<'a> {
    /// `None` if `surface` is not closed, or was not made from `base`.
    fn new(base: &SegmentedSurface, surface: &'a SegmentedSurface) -> Option<Self> {
        let mesh = &surface.mesh;
        let (topology, base_of) = (Topology::of_mesh(mesh)?, base_of(base, surface)?);
        let n_faces = mesh.triangles.len() as u32;
        let unit = |f: u32| (base_of[f as usize], surface.patch_of_face[f as usize]);
        let mut parent: Vec<u32> = (0..n_faces).collect();
        for f in 0..n_faces {
            for g in topology.neighbours(f).into_iter().filter(|g| unit(*g) == unit(f)) {
                let (x, y) = (root(&mut parent, f), root(&mut parent, g));
                parent[x.max(y) as usize] = x.min(y);
            }
        }
        let mut number = vec![u32::MAX; mesh.triangles.len()];
        let mut faces_of: Vec<Vec<u32>> = Vec::new();
        let mut unit_of = Vec::with_capacity(mesh.triangles.len());
        for f in 0..n_faces {
            let first = root(&mut parent, f) as usize;
            if number[first] == u32::MAX {
                number[first] = faces_of.len() as u32;
                faces_of.push(Vec::new());
            }
            faces_of[number[first] as usize].push(f);
            unit_of.push(number[first]);
        }
        let bits = |p: &Vec3| p.to_array().map(f64::to_bits);
        let of_base: BTreeSet<[u64; 3]> = base.mesh.points.iter().map(bits).collect();
        Some(Self {
            surface,
            topology,
            unit_of,
            is_drawn: vec![true; faces_of.len()],
            faces_of,
            is_of_base: mesh.points.iter().map(|p| of_base.contains(&bits(p))).collect(),
        })
    }

    /// New triangles of each unit; `None` for those that stay as they are.
    fn draw(&mut self) -> Vec<Option<Vec<[u32; 3]>>> {
        loop {
            let drawn: Vec<Option<Vec<[u32; 3]>>> = (0..self.faces_of.len() as u32)
                .into_par_iter()
                .map(|unit| self.draw_unit(unit))
                .collect();
            // A unit that cannot be drawn keeps its points, and so do its neighbours then.
            let now: Vec<bool> = drawn.iter().map(Option::is_some).collect();
            if now == self.is_drawn {
                return drawn;
            }
            self.is_drawn = now;
        }
    }

    fn draw_unit(&self, unit: u32) -> Option<Vec<[u32; 3]>> {
        if !self.is_drawn[unit as usize] {
            return None;
        }
        let faces = &self.faces_of[unit as usize];
        let outline = self.outline(faces)?;
        let n = outline.len();
        let beside = |h: u32| self.topology.opposite(h) / 3;
        let is_kept = |i: &usize| {
            let [one, other] = [outline[(*i + n - 1) % n], outline[*i]].map(beside);
            let unit = self.unit_of[one as usize];
            let patch = |f: u32| self.surface.patch_of_face[f as usize];
            self.is_of_base[self.start(outline[*i]) as usize]
                || unit != self.unit_of[other as usize]
                || !self.is_drawn[unit as usize]
                || patch(one) != patch(faces[0])
        };
        let corners: Vec<u32> = (0..n).filter(is_kept).map(|i| self.start(outline[i])).collect();
        let mesh = &self.surface.mesh;
        let normal: Vec3 = faces.iter().map(|&f| mesh.double_area_vector(f as usize)).sum();
        triangles_of(&mesh.points, corners, normal.try_normalize()?)
    }

    fn start(&self, h: u32) -> u32 {
        self.surface.mesh.triangles[h as usize / 3][h as usize % 3]
    }

    /// Half-edges around `faces` of one unit, in order; `None` unless they are one loop without a point
    /// twice.
    fn outline(&self, faces: &[u32]) -> Option<Vec<u32>> {
        let unit = |h: u32| self.unit_of[h as usize / 3];
        let sides = faces.iter().flat_map(|&f| 3 * f..3 * f + 3);
        let around: Vec<u32> = sides
            .filter(|&h| unit(self.topology.opposite(h)) != unit(h))
            .collect();
        let from: BTreeMap<u32, u32> = around.iter().map(|&h| (self.start(h), h)).collect();
        if from.len() != around.len() {
            return None;
        }
        let mut outline = vec![*around.first()?];
        loop {
            let last = *outline.last()?;
            let next = *from.get(&self.start(Topology::next(last)))?;
            if next == outline[0] {
                break;
            }
            if outline.len() == around.len() {
                return None;
            }
            outline.push(next);
        }
        (outline.len() == around.len()).then_some(outline)
    }
}

/// Triangle of the base that contains each triangle of `surface`: of those with the same source, the one in
/// which its middle lies deepest. `None` if one has none.
fn base_of(base: &SegmentedSurface, surface: &SegmentedSurface) -> Option<Vec<u32>> {
    let mut of_source: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (b, source) in (0..).zip(&base.source_face) {
        of_source.entry(*source).or_default().push(b);
    }
    let of_face = |f: usize| {
        let center = surface.mesh.face_center(f);
        let depth = |b: &u32| least_coordinate(base.mesh.corners(*b as usize), center);
        let candidates = of_source.get(&surface.source_face[f])?.iter().copied();
        candidates.max_by(|a, b| depth(a).total_cmp(&depth(b)))
    };
    (0..surface.mesh.triangles.len())
        .into_par_iter()
        .map(of_face)
        .collect()
}

/// Triangles of a flat outline, which may have points within its sides; the roundest ears are cut off first.
/// `None` if that ends early, as rounding may have it where an outline touches itself.
fn triangles_of(points: &[Vec3], mut corners: Vec<u32>, normal: Vec3) -> Option<Vec<[u32; 3]>> {
    let shape = |t: [u32; 3]| {
        let [a, b, c] = t.map(|v| points[v as usize]);
        let longest_mm2 = a
            .distance_squared(b)
            .max(b.distance_squared(c))
            .max(c.distance_squared(a));
        (b - a).cross(c - a).dot(normal) / longest_mm2.max(f64::MIN_POSITIVE)
    };
    let mut made = Vec::with_capacity(corners.len().saturating_sub(2));
    while corners.len() > 3 {
        let n = corners.len();
        let ear = |i: usize| [corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n]];
        let is_clear = |i: &usize| {
            let t = ear(*i);
            let corner = t.map(|v| points[v as usize]);
            corners
                .iter()
                .filter(|v| !t.contains(v))
                .all(|&v| least_coordinate(corner, points[v as usize]) < -LEAST_SHAPE)
        };
        let best = (0..n)
            .filter(|i| shape(ear(*i)) > LEAST_SHAPE)
            .filter(is_clear)
            .max_by(|i, k| shape(ear(*i)).total_cmp(&shape(ear(*k))))?;
        made.push(ear(best));
        corners.remove(best);
    }
    let last: [u32; 3] = corners.try_into().ok()?;
    made.push(last);
    (shape(last) > LEAST_SHAPE).then_some(made)
}

/// Least barycentric coordinate of a point in a triangle: 0 on its sides, negative outside.
fn least_coordinate([a, b, c]: [Vec3; 3], p: Vec3) -> f64 {
    let normal = (b - a).cross(c - a);
    let doubled = normal.length_squared().max(f64::MIN_POSITIVE);
    let of = |x: Vec3, y: Vec3| (x - p).cross(y - p).dot(normal) / doubled;
    of(b, c).min(of(c, a)).min(of(a, b))
}

#[cfg(test)]
mod tests {
    use shellock_report::{Ctx, PatchId};
    use shellock_test_surfaces::{label, sphere};

    use super::*;
    use crate::segmentation::{SegmentationParams, refined_again};

    /// A ball in three sectors around the z axis, turned by `degrees`.
    fn sectors(surface: &TriMesh, degrees: f64) -> SegmentedSurface {
        label(surface.clone(), 3, |p| {
            let turn = (p.y.atan2(p.x).to_degrees() + degrees + 720.0) % 360.0;
            (turn / 120.0) as u32
        })
    }

    fn cut(surface: &SegmentedSurface) -> SegmentedSurface {
        let params = SegmentationParams::default();
        refined_again(&Ctx::quiet(), &params, surface).unwrap().unwrap()
    }

    #[test]
    fn former_seams_vanish_and_the_present_ones_stay_as_they_are() {
        let base = cut(&sectors(&sphere(4, Vec3::splat(30.0)), 0.0));
        let mut moved = base.clone();
        let mut turned = base.clone();
        for degrees in [15.0, 30.0, 45.0, 60.0] {
            let again = sectors(&moved.mesh, degrees).patch_of_face;
            turned = cut(&SegmentedSurface {
                patch_of_face: again,
                ..moved.clone()
            });
            moved = turned.clone();
        }
        let coarse = coarsen(&base, turned.clone());
        assert!(
            turned.mesh.triangles.len() > coarse.mesh.triangles.len() * 3 / 2,
            "{} {}",
            turned.mesh.triangles.len(),
            coarse.mesh.triangles.len()
        );
        assert!(Topology::of_mesh(&coarse.mesh).is_some(), "closed");
        assert!((coarse.mesh.area() - turned.mesh.area()).abs() < 1e-9 * turned.mesh.area());
        let area = |s: &SegmentedSurface, patch: u32| -> f64 {
            let own = (0..s.mesh.triangles.len()).filter(|&f| s.patch_of_face[f] == PatchId(patch));
            own.map(|f| s.mesh.face_area(f)).sum()
        };
        for patch in 0..3 {
            assert!((area(&coarse, patch) / area(&turned, patch) - 1.0).abs() < 1e-9);
        }
        let seams = |s: &SegmentedSurface| -> Vec<f64> {
            let graph = s.contact_graph(0.0);
            graph.contacts().iter().map(|c| c.total_mm).collect()
        };
        for (a, b) in seams(&coarse).iter().zip(seams(&turned)) {
            assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
        }
        // Every triangle lies in the triangle of the model that it names.
        for f in 0..coarse.mesh.triangles.len() {
            let of_model = coarse.source_face[f];
            assert!(base.source_face.contains(&of_model));
        }
        assert!((0..coarse.mesh.triangles.len()).all(|f| coarse.mesh.face_area(f) > 0.0));
    }

    #[test]
    fn nothing_is_left_of_cuts_that_no_seam_needs() {
        let base = sectors(&sphere(3, Vec3::splat(30.0)), 0.0);
        let turned = cut(&sectors(&base.mesh, 60.0));
        assert!(turned.mesh.triangles.len() > base.mesh.triangles.len());
        let patch = |f: &u32| base.patch_of_face[*f as usize];
        let back = SegmentedSurface {
            patch_of_face: turned.source_face.iter().map(patch).collect(),
            ..turned
        };
        // The seams of the base lie along its edges, so they cross no triangle of it. They keep their points.
        let coarse = coarsen(&base, back);
        let topology = Topology::of_mesh(&base.mesh).unwrap();
        for f in 0..base.mesh.triangles.len() as u32 {
            let n = coarse.source_face.iter().filter(|s| **s == f).count();
            let is_at_seam = topology.neighbours(f).iter().any(|g| patch(g) != patch(&f));
            assert!(n == 1 || is_at_seam && n > 1, "{n} triangles in {f}");
        }
    }

    #[test]
    fn a_triangle_with_points_on_all_its_sides_is_cut_without_slivers_of_no_area() {
        let points = [
            [0.0, 0.0],
            [1.0, 0.0],
            [3.0, 0.0],
            [4.0, 0.0],
            [2.0, 2.0],
            [0.0, 4.0],
            [0.0, 3.0],
            [0.0, 1.0],
        ]
        .map(|[x, y]| Vec3::new(x, y, 5.0));
        let made = triangles_of(&points, (0..8).collect(), Vec3::Z).unwrap();
        assert_eq!(made.len(), 6);
        let areas = made.iter().map(|t| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            0.5 * (b - a).cross(c - a).z
        });
        let areas: Vec<f64> = areas.collect();
        assert!(areas.iter().all(|&area| area > 0.1), "{areas:?}");
        assert!((areas.iter().sum::<f64>() - 8.0).abs() < 1e-12);
        assert!(triangles_of(&points[..4], (0..4).collect(), Vec3::Z).is_none());
        // The reflex corner is no ear, nor is any that contains it.
        let arrow = [[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]].map(|[x, y]| Vec3::new(x, y, 5.0));
        let made = triangles_of(&arrow, (0..4).collect(), Vec3::Z).unwrap();
        assert!(made.iter().all(|t| t.contains(&0) && t.contains(&2)), "{made:?}");
    }
}
