//! Constraints of the surface model as rank-one energies: `k/2 (Σ gᵢ · uᵢ)²`.

use shellock_geom::Vec3;

use super::SurfaceParams;
use crate::assembly::{Joint, ShellAssembly, Side, Station};

/// Contact stiffness per mm of seam, in Young's moduli: what a block as high as it is wide resists.
pub(super) const POSITION_SHARE: f64 = 1.0;

/// One constraint, to first order in the displacements.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    points: [u32; 4],
    gradients: [Vec3; 4],
    n: u8,
    /// N/mm for lengths, N mm for angles.
    pub stiffness: f64,
    /// Whether it only resists where the sum is negative.
    pub is_one_sided: bool,
}

impl Term {
    fn new<const N: usize>(corners: [(usize, Vec3); N], stiffness: f64) -> Self {
        let (mut points, mut gradients) = ([0; 4], [Vec3::ZERO; 4]);
        for (i, (p, g)) in corners.into_iter().enumerate() {
            (points[i], gradients[i]) = (p as u32, g);
        }
        Self { points, gradients, n: N as u8, stiffness, is_one_sided: false }
    }

    /// The points it depends on, each with the gradient there.
    pub fn corners(&self) -> impl Iterator<Item = (usize, Vec3)> {
        let n = usize::from(self.n);
        self.points.into_iter().map(|p| p as usize).zip(self.gradients).take(n)
    }
}

/// Bending stiffness of a plate of that thickness, N mm.
pub(super) fn bending(params: &SurfaceParams, thickness_mm: f64) -> f64 {
    let m = &params.material;
    m.youngs_modulus_mpa * thickness_mm.powi(3) / (12.0 * (1.0 - m.poissons_ratio.powi(2)))
}

/// Resistance of an edge against stretch, with half of the area of the triangles beside it.
fn edge(params: &SurfaceParams, points: &[Vec3], [i, j]: [usize; 2], thickness_mm: f64, area_mm2: f64) -> Option<Term> {
    let along = points[j] - points[i];
    let unit = along.try_normalize()?;
    let modulus = params.stiffness_ratios[0] * params.material.youngs_modulus_mpa;
    let stiffness = modulus * thickness_mm * area_mm2 / along.length_squared();
    Some(Term::new([(i, -unit), (j, unit)], stiffness))
}

/// The dihedral angle at the edge `i j` between triangles `i j k` and `j i l`, with the given stiffness, N mm a radian.
///
/// The gradient is that of the exact angle, so rigid motions cost nothing.
pub(super) fn hinge(points: &[Vec3], [i, j, k, l]: [usize; 4], stiffness: f64) -> Option<Term> {
    let edge = points[j] - points[i];
    let unit = edge.try_normalize()?;
    let n1 = edge.cross(points[k] - points[i]);
    let n2 = (points[l] - points[i]).cross(edge);
    let smallest = 1e-9 * edge.length_squared().powi(2);
    if n1.length_squared() <= smallest || n2.length_squared() <= smallest {
        return None;
    }
    let (n1, n2) = (n1 / n1.length_squared(), n2 / n2.length_squared());
    let (k_to, l_to) =
        (|from: usize| (points[k] - points[from]).dot(unit), |from: usize| (points[l] - points[from]).dot(unit));
    let corners = [
        (i, k_to(j) * n1 + l_to(j) * n2),
        (j, -k_to(i) * n1 - l_to(i) * n2),
        (k, edge.length() * n1),
        (l, edge.length() * n2),
    ];
    Some(Term::new(corners, stiffness))
}

/// Stretch of all edges and bending of all inner edges of the patches.
pub(super) fn patch_terms(params: &SurfaceParams, assembly: &ShellAssembly, points: &[Vec3]) -> Vec<Term> {
    let mut edges: Vec<([usize; 2], usize, f64)> = Vec::with_capacity(3 * assembly.triangles.len());
    for t in &assembly.triangles {
        let [a, b, c] = t.map(|v| v as usize);
        let area = 0.5 * (points[b] - points[a]).cross(points[c] - points[a]).length();
        for (x, y, z) in [(a, b, c), (b, c, a), (c, a, b)] {
            edges.push(([x.min(y), x.max(y)], z, area));
        }
    }
    edges.sort_by_key(|e| (e.0, e.1));
    let plate = params.stiffness_ratios[1] * bending(params, params.wall_mm);
    let mut terms = Vec::with_capacity(edges.len());
    for same in edges.chunk_by(|x, y| x.0 == y.0) {
        let ends = same[0].0;
        let area: f64 = same.iter().map(|e| e.2).sum();
        terms.extend(edge(params, points, ends, params.wall_mm, area));
        if let [x, y] = same {
            let stiffness = plate * points[ends[0]].distance_squared(points[ends[1]]) / area.max(f64::MIN_POSITIVE);
            terms.extend(hinge(points, [ends[0], ends[1], x.1, y.1], stiffness));
        }
    }
    terms
}

/// One side's strip between two stations: corners are the seam points, then the tips; `beside` is the patch's point
/// across the seam edge.
pub(super) fn strip_terms(
    params: &SurfaceParams,
    points: &[Vec3],
    [b0, b1, t0, t1]: [usize; 4],
    beside: Option<usize>,
) -> impl Iterator<Item = Term> {
    let thickness = params.pin_mm();
    let area = |i: usize, j: usize, k: usize| 0.5 * (points[j] - points[i]).cross(points[k] - points[i]).length();
    let areas = 0.5 * (area(b0, b1, t0) + area(b1, t1, t0));
    // Both diagonals, each as the edge of both triangles' area, so that neither shear is stiffer.
    let edges =
        [[b0, t0], [b1, t1], [t0, t1], [b0, t1], [b1, t0]].map(|ends| edge(params, points, ends, thickness, areas));
    // Bends at its root as a cantilever of its depth would.
    let length = points[b0].distance(points[b1]);
    let plate = params.stiffness_ratios[1] * bending(params, thickness);
    let root = beside.and_then(|k| hinge(points, [b0, b1, k, t0], 3.0 * plate * length / params.strip_mm()));
    let across = points[b1].distance_squared(points[t0]) / (2.0 * areas).max(f64::MIN_POSITIVE);
    let flat = hinge(points, [b1, t0, b0, t1], plate * across);
    edges.into_iter().chain([root, flat]).flatten()
}

/// The contact of a station: neither the tips nor the seam points may part across the channel, and the male's tip may not
/// go deeper.
pub(super) fn contacts(params: &SurfaceParams, station: &Station, joint: &Joint, tips: [usize; 2]) -> [Term; 3] {
    let modulus = params.stiffness_ratios[2] * params.material.youngs_modulus_mpa;
    let stiffness = POSITION_SHARE * modulus * station.length_mm;
    let (male, female) = (joint.male.index(), joint.male.other().index());
    let across = station.tangent.cross(joint.leaves).normalize_or_zero();
    let pair = |points: [usize; 2], n: Vec3| Term::new([(points[male], n), (points[female], -n)], stiffness);
    let roots = station.points.map(|p| p as usize);
    debug_assert!(male != female && Side::A.index() == 0);
    [pair(tips, across), pair(roots, across), Term { is_one_sided: true, ..pair(tips, joint.leaves) }]
}
