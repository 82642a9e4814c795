//! Constraints of the surface model as rank-one energies: `k/2 (Σ gᵢ · uᵢ)²`.

use shellock_geom::Vec3;

use super::SurfaceParams;
use crate::assembly::ShellAssembly;

/// One constraint, linearised in the displacements.
#[derive(Clone, Debug)]
pub(super) struct Term {
    /// Points that the constraint depends on, each once, with its gradient there.
    pub corners: Vec<(u32, Vec3)>,
    /// Stiffness: N/mm for lengths, N mm for angles.
    pub stiffness: f64,
}

impl Term {
    fn new(corners: impl IntoIterator<Item = (u32, Vec3)>, stiffness: f64) -> Self {
        Self {
            corners: corners.into_iter().collect(),
            stiffness,
        }
    }
}

/// Bending stiffness of a plate of thickness `thickness_mm`, N mm.
pub(super) fn bending_stiffness(params: &SurfaceParams, thickness_mm: f64) -> f64 {
    let m = &params.material;
    m.youngs_modulus_mpa * thickness_mm.powi(3) / (12.0 * (1.0 - m.poissons_ratio.powi(2)))
}

/// Resistance of an edge to stretch; it represents half of the area of the adjacent triangles.
fn edge(
    params: &SurfaceParams,
    points: &[Vec3],
    [i, j]: [usize; 2],
    thickness_mm: f64,
    area_mm2: f64,
) -> Option<Term> {
    let along = points[j] - points[i];
    let unit = along.try_normalize()?;
    let modulus = params.stiffness_ratios[0] * params.material.youngs_modulus_mpa;
    let stiffness = modulus * thickness_mm * area_mm2 / along.length_squared();
    Some(Term::new([(i as u32, -unit), (j as u32, unit)], stiffness))
}

/// Constraint on the dihedral angle at edge `i j` between triangles `i j k` and `j i l`, with the given
/// stiffness, N mm a radian. `None` for a degenerate triangle.
///
/// The gradient is that of the exact angle, so rigid motions cost no energy.
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
    let (k_to, l_to) = (
        |from: usize| (points[k] - points[from]).dot(unit),
        |from: usize| (points[l] - points[from]).dot(unit),
    );
    let corners = [
        (i as u32, k_to(j) * n1 + l_to(j) * n2),
        (j as u32, -k_to(i) * n1 - l_to(i) * n2),
        (k as u32, edge.length() * n1),
        (l as u32, edge.length() * n2),
    ];
    Some(Term::new(corners, stiffness))
}

/// Stretch constraints of all edges and bending constraints of all inner edges of the patches.
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
    let plate = params.stiffness_ratios[1] * bending_stiffness(params, params.wall_mm);
    let mut terms = Vec::with_capacity(edges.len());
    for same in edges.chunk_by(|x, y| x.0 == y.0) {
        let ends = same[0].0;
        let area: f64 = same.iter().map(|e| e.2).sum();
        terms.extend(edge(params, points, ends, params.wall_mm, area));
        if let [x, y] = same {
            let stiffness =
                plate * points[ends[0]].distance_squared(points[ends[1]]) / area.max(f64::MIN_POSITIVE);
            terms.extend(hinge(points, [ends[0], ends[1], x.1, y.1], stiffness));
        }
    }
    terms
}

/// Motion of a point of a rigid strip, linear in the motion of the patch at its seam point: the strip moves
/// with that point and turns with the mean rotation of its triangles.
#[derive(Clone, Debug)]
pub(super) struct Root {
    point: u32,
    /// Vectors `r` and `n` of each corner: the rotation is `Σ −r (n · u) + n (r · u) / 2`, the latter in the
    /// surface.
    turns: Vec<(u32, [Vec3; 2])>,
}

impl Root {
    /// Root at seam point `point`, where these triangles meet.
    pub fn new(points: &[Vec3], point: u32, triangles: impl Iterator<Item = [u32; 3]> + Clone) -> Self {
        let doubled = |t: [u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).cross(c - a)
        };
        let total: f64 = triangles.clone().map(|t| doubled(t).length()).sum();
        let mut turns = Vec::new();
        for t in triangles {
            let (area_vector, share) = (doubled(t), doubled(t).length() / total);
            let Some(n) = area_vector.try_normalize() else {
                continue;
            };
            for i in 0..3 {
                // The gradient of a corner's hat function is n × opposite edge / doubled area; r = n ×
                // gradient.
                let opposite = points[t[(i + 2) % 3] as usize] - points[t[(i + 1) % 3] as usize];
                let r = n.cross(n.cross(opposite)) / area_vector.length();
                turns.push((t[i], [share * r, n]));
            }
        }
        Self { point, turns }
    }

    /// Gradients of the seam point's motion along `g`.
    pub fn shift(&self, g: Vec3) -> Vec<(u32, Vec3)> {
        vec![(self.point, g)]
    }

    /// Gradients of the strip's rotation about `axis`, rad.
    pub fn turn(&self, axis: Vec3) -> Vec<(u32, Vec3)> {
        let turn = |&(p, [r, n]): &(u32, [Vec3; 2])| (p, -n * r.dot(axis) + 0.5 * r * n.dot(axis));
        self.turns.iter().map(turn).collect()
    }
}
