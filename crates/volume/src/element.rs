//! Stiffness of straight-sided tetrahedra with 4 or 10 nodes.

use shellock_geom::Vec3;
use shellock_mechanics::Material;

/// End corners of the edge on which each node beyond the fourth lies.
pub(super) const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// Degree of the displacement inside a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// 4 nodes, constant strain: cheap, and several times too stiff where thin walls bend.
    Linear,
    /// 10 nodes, linear strain: right in bending with one layer across the wall.
    Quadratic,
}

impl Order {
    /// Number of nodes of a tetrahedron.
    pub(super) fn n_nodes(self) -> usize {
        match self {
            Self::Linear => 4,
            Self::Quadratic => 10,
        }
    }
}

/// Lamé's constants λ and μ, MPa.
pub(super) fn lame(material: &Material) -> (f64, f64) {
    let (e, nu) = (material.youngs_modulus_mpa, material.poissons_ratio);
    (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
}

/// Six times the signed volume, positive where `d` sees `abc` clockwise.
pub(super) fn volume_6(c: [Vec3; 4]) -> f64 {
    (c[1] - c[0]).cross(c[2] - c[0]).dot(c[3] - c[0])
}

/// Gradients of the four barycentric coordinates, 1/mm.
pub(super) fn gradients(c: [Vec3; 4]) -> [Vec3; 4] {
    let [a, b, d] = [c[1] - c[0], c[2] - c[0], c[3] - c[0]];
    let volume = volume_6(c);
    let [ga, gb, gd] = [b.cross(d) / volume, d.cross(a) / volume, a.cross(b) / volume];
    [-(ga + gb + gd), ga, gb, gd]
}

/// Gradients of the shape functions at barycentric coordinates `l`; only the first `order.n_nodes()` are
/// valid.
fn shape_gradients(order: Order, g: &[Vec3; 4], l: [f64; 4]) -> [Vec3; 10] {
    let mut shape = [Vec3::ZERO; 10];
    for i in 0..4 {
        shape[i] = match order {
            Order::Linear => g[i],
            Order::Quadratic => g[i] * (4.0 * l[i] - 1.0),
        };
    }
    for (node, [i, j]) in (4..).zip(EDGES) {
        shape[node] = (g[i] * l[j] + g[j] * l[i]) * 4.0;
    }
    shape
}

/// Calls `add(a, b, k)` for all nodes a ≤ b with their 3 × 3 stiffness `k[row][column]`, N/mm.
///
/// Four points integrate the products of linear strains exactly.
pub(super) fn stiffness(
    order: Order,
    corners: [Vec3; 4],
    (lambda, mu): (f64, f64),
    mut add: impl FnMut(usize, usize, [[f64; 3]; 3]),
) {
    const NEAR: f64 = 0.585_410_196_624_968_5;
    const FAR: f64 = 0.138_196_601_125_010_5;
    let g = gradients(corners);
    let weight = volume_6(corners).abs() / 24.0;
    let points: [[Vec3; 10]; 4] = std::array::from_fn(|p| {
        let mut l = [FAR; 4];
        l[p] = NEAR;
        shape_gradients(order, &g, l)
    });
    for a in 0..order.n_nodes() {
        for b in a..order.n_nodes() {
            let mut k = [[0.0; 3]; 3];
            for point in &points {
                let (ga, gb) = (point[a] * weight, point[b]);
                let shear = mu * ga.dot(gb);
                let (ga, gb) = (ga.to_array(), gb.to_array());
                for i in 0..3 {
                    for j in 0..3 {
                        k[i][j] += lambda * ga[i] * gb[j] + mu * ga[j] * gb[i];
                    }
                    k[i][i] += shear;
                }
            }
            add(a, b, k);
        }
    }
}

/// Von Mises stress at barycentric coordinates `l`, MPa. Only the first `order.n_nodes()` of
/// `displacement_mm` are used.
pub(super) fn von_mises_mpa(
    order: Order,
    corners: [Vec3; 4],
    (lambda, mu): (f64, f64),
    displacement_mm: &[Vec3; 10],
    l: [f64; 4],
) -> f64 {
    let shape = shape_gradients(order, &gradients(corners), l);
    let mut gradient = [[0.0; 3]; 3];
    for (u, g) in displacement_mm.iter().zip(&shape).take(order.n_nodes()) {
        let (u, g) = (u.to_array(), g.to_array());
        for i in 0..3 {
            for j in 0..3 {
                gradient[i][j] += u[i] * g[j];
            }
        }
    }
    let trace = gradient[0][0] + gradient[1][1] + gradient[2][2];
    let stress = |i: usize, j: usize| {
        mu * (gradient[i][j] + gradient[j][i]) + if i == j { lambda * trace } else { 0.0 }
    };
    let [x, y, z] = [0, 1, 2].map(|i| stress(i, i));
    let shear_sq = stress(0, 1).powi(2) + stress(1, 2).powi(2) + stress(2, 0).powi(2);
    (0.5 * ((x - y).powi(2) + (y - z).powi(2) + (z - x).powi(2)) + 3.0 * shear_sq).sqrt()
}
