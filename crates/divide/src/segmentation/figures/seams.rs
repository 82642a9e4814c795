//! Course of the seams: in creases or not, visible or not.

use std::f64::consts::TAU;

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::topology::ends;
use shellock_geom::{HalfEdge, Topology, TriMesh, Vec3};
use shellock_surface::SegmentedSurface;
use shellock_surface::seam::seam_half_edges;

use super::{SeamFigures, front_of};

/// Longest sample of a seam, mm: edges are divided into shorter ones.
pub(super) const STEP_MM: f64 = 1.0;

/// Distance to each side of a seam at which the surface is measured, mm. This is about the size of a
/// connector, and also the width that the eye takes for one line at arm's length. Single edges are no
/// measure, since a smoothed seam runs within triangles.
const BESIDE_MM: f64 = 3.0;

/// Least bend of a crease, over both sides, degrees. Less is flat: a fillet of 17 mm.
pub(super) const CREASE_DEG: f64 = 10.0;

/// Height of the start of rays above the surface, mm: less than a printer shows, more than rounding.
const LIFT_MM: f64 = 0.02;

/// Least cosine between the surface normal and a view for a seam to be visible: 1° of grazing.
const GRAZING: f64 = 0.02;

/// Number of level views around the model.
const N_VIEWS: usize = 8;

/// Greatest number of triangles that a section crosses, so that it ends on a mesh of tiny triangles.
const MOST_CROSSED: usize = 10_000;

/// One short stretch of seam.
struct Sample {
    length_mm: f64,
    /// Bend of the surface; positive in a hollow.
    bend_deg: f64,
    /// Visibility from each view, the front first.
    is_seen: [bool; N_VIEWS],
}

/// Figures of all seams of `surface`, which stands with `up` upwards.
pub(super) fn seam_figures(
    up: [f64; 3],
    surface: &SegmentedSurface,
    topology: &Topology,
    bvh: &TriangleBvh,
) -> SeamFigures {
    let mesh = &surface.mesh;
    let labels: Vec<u32> = surface.patch_of_face.iter().map(|p| p.0).collect();
    let seam = seam_half_edges(topology, &labels, 0..labels.len() as u32);
    let eye = Eye {
        bvh,
        views: views(up),
        far_mm: 2.0 * mesh.bounds().diagonal(),
    };
    let samples: Vec<Vec<Sample>> = seam
        .par_iter()
        .map(|&h| samples_of(mesh, topology, &eye, h))
        .collect();
    let samples: Vec<Sample> = samples.into_iter().flatten().collect();
    let length_mm: f64 = samples.iter().map(|s| s.length_mm).sum();
    let share = |weight: &dyn Fn(&Sample) -> f64| {
        let of_all: f64 = samples.iter().map(|s| s.length_mm * weight(s)).sum();
        if length_mm > 0.0 { of_all / length_mm } else { 0.0 }
    };
    let when = |is_so: bool| f64::from(u8::from(is_so));
    let n_seen = |s: &Sample| s.is_seen.iter().filter(|seen| **seen).count() as f64;
    SeamFigures {
        length_mm,
        concave_share: share(&|s| when(s.bend_deg > CREASE_DEG)),
        flat_share: share(&|s| when(s.bend_deg.abs() <= CREASE_DEG)),
        convex_share: share(&|s| when(s.bend_deg < -CREASE_DEG)),
        visible_share: share(&|s| n_seen(s) / N_VIEWS as f64),
        front_share: share(&|s| when(s.is_seen[0] && s.bend_deg <= CREASE_DEG)),
        n_triple_points: n_triple_points(mesh, &seam),
    }
}

/// Directions towards the viewers, the front first.
fn views(up: [f64; 3]) -> [Vec3; N_VIEWS] {
    let (up, front) = (Vec3::from(up), Vec3::from(front_of(up)));
    let aside = up.cross(front);
    std::array::from_fn(|i| {
        let (sin, cos) = (TAU * i as f64 / N_VIEWS as f64).sin_cos();
        cos * front + sin * aside
    })
}

/// Views of the model, and the triangles that may hide a point.
struct Eye<'a> {
    bvh: &'a TriangleBvh,
    views: [Vec3; N_VIEWS],
    far_mm: f64,
}

impl Eye<'_> {
    /// Tells for each view if it sees `at`, where the surface faces `outward`.
    fn sees(&self, at: Vec3, outward: Vec3) -> [bool; N_VIEWS] {
        let above = at + LIFT_MM * outward;
        self.views
            .map(|view| outward.dot(view) > GRAZING && self.bvh.first_hit(above, view, self.far_mm).is_none())
    }
}

fn samples_of(mesh: &TriMesh, topology: &Topology, eye: &Eye<'_>, seam: HalfEdge) -> Vec<Sample> {
    let (from, to) = ends(mesh, seam);
    let (from, to) = (mesh.points[from as usize], mesh.points[to as usize]);
    let length_mm = from.distance(to);
    let Some(along) = (to - from).try_normalize() else {
        return Vec::new();
    };
    let sides = [seam, topology.opposite(seam)];
    let [left, right] = sides.map(|h| mesh.face_normal(h as usize / 3));
    let outward = (left + right).normalize_or(left);
    let n = (length_mm / STEP_MM).ceil().max(1.0) as usize;
    let sample = |i: usize| {
        let at = from.lerp(to, (i as f64 + 0.5) / n as f64);
        let ends = sides.map(|h| walk(mesh, topology, h, at, along));
        Sample {
            length_mm: length_mm / n as f64,
            bend_deg: bend_rad(at, along, outward, ends).to_degrees(),
            is_seen: eye.sees(at, outward),
        }
    };
    (0..n).map(sample).collect()
}

/// End of a walk of [`BESIDE_MM`] over the surface. The walk starts from `at` on edge `start` into its
/// triangle. It stays within the plane through `at` across `along`.
fn walk(mesh: &TriMesh, topology: &Topology, start: HalfEdge, at: Vec3, along: Vec3) -> Vec3 {
    let height = |v: u32| (mesh.points[v as usize] - at).dot(along);
    let (mut edge, mut here, mut left_mm) = (start, at, BESIDE_MM);
    for _ in 0..MOST_CROSSED {
        // The third corner lies on one side of the plane, so the section leaves through one of the other two
        // edges.
        let mut next = Topology::next(edge);
        let is_crossed = |(u, v): (u32, u32)| (height(u) >= 0.0) != (height(v) >= 0.0);
        if !is_crossed(ends(mesh, next)) {
            next = Topology::next(next);
        }
        let (u, v) = ends(mesh, next);
        let share = height(u) / (height(u) - height(v));
        let there = mesh.points[u as usize].lerp(mesh.points[v as usize], share);
        let step_mm = here.distance(there);
        if step_mm >= left_mm {
            return here.lerp(there, left_mm / step_mm);
        }
        left_mm -= step_mm;
        here = there;
        edge = topology.opposite(next);
    }
    here
}

/// Bend of the section through `at` across `along`, rad, in (−2π, 2π]. It sums the angles by which the two
/// `ends`, left and right of `along`, rise above the plane that faces `outward`. The choice of that plane
/// matters little: if it is tilted, one angle gains what the other loses.
fn bend_rad(at: Vec3, along: Vec3, outward: Vec3, ends: [Vec3; 2]) -> f64 {
    let up = (outward - outward.dot(along) * along).normalize_or_zero();
    let to_left = up.cross(along);
    let rise = |end: Vec3, aside: Vec3| (end - at).dot(up).atan2((end - at).dot(aside));
    rise(ends[0], to_left) + rise(ends[1], -to_left)
}

/// Number of points with more than two seam edges.
fn n_triple_points(mesh: &TriMesh, seam: &[HalfEdge]) -> usize {
    let mut touched: Vec<u32> = seam
        .iter()
        .flat_map(|&h| <[u32; 2]>::from(ends(mesh, h)))
        .collect();
    touched.sort_unstable();
    touched
        .chunk_by(|u, v| u == v)
        .filter(|same| same.len() > 2)
        .count()
}
