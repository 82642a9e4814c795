//! The flat triangle with six degrees of freedom a node: Felippa's optimal membrane and the discrete
//! Kirchhoff plate.
//!
//! Both parts are written as strains that are linear in the 18 displacements u of the three nodes, at
//! weighted points of the triangle: K = Σ w Bᵀ C B. Strains are (ε_x, ε_y, γ_xy) in the triangle's frame,
//! with x along the first edge and z along the normal.
//!
//! Membrane (C. Felippa, A study of optimal membrane triangles with drilling freedoms, 2003) has two terms.
//! The mean strains include drilling rotations, which bend the edges as in Allman's triangle. The in-plane
//! bending strains, at the midpoints of the edges, come from the rotations relative to that of the whole
//! triangle. Bending (J.-L. Batoz, K.-J. Bathe, L.-W. Ho, A study of three-node triangular plate bending
//! elements, 1980): the slope β of the normal is linear, plus a bulge along each edge that cancels the shear
//! there. Mid-edge nodes never appear.
//!
//! All rigid motions have zero strain, and constant strains and curvatures are exact, for any values of the
//! two shares below.

use nalgebra::{Matrix3, RowVector3, SMatrix, SVector, Vector3};
use shellock_geom::Vec3;

/// Strain or curvature matrix, one strain a row. Columns: displacement and rotation of the first node, then
/// of the second and the third.
pub(super) type Strains = SMatrix<f64, 3, 18>;

/// Stiffness matrix of the nodes' displacements and rotations.
pub(super) type Stiffness = SMatrix<f64, 18, 18>;

/// Share of the drilling rotations in the mean strain, α_b. 3/2 is that of Allman's triangle and the best for
/// in-plane bending.
const DRILLING_SHARE: f64 = 1.5;

/// Edges by their end nodes; edge i starts at node i.
const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Share of the in-plane bending stiffness, β_0, which restrains the drilling rotations.
///
/// Felippa's (1 − 4ν²) / 2 makes rectangles exact in the plane, but keeps curved shells from bending without
/// stretching. A hemisphere with 8 elements a quarter edge then reaches 0.49 of its displacement; with this
/// value, 0.92. The price is 2 % too much in a beam two elements wide, 10 % in one a single element wide. At
/// 0.001 the hemisphere reaches 0.96.
const IN_PLANE_BENDING_SHARE: f64 = 0.02;

/// Strain matrices that give a triangle's stresses from its displacements.
#[derive(Clone, Debug)]
pub(super) struct Element {
    /// Mean strains of the middle surface, per displacement.
    pub(super) membrane: Strains,
    /// Curvatures at the centre, 1/mm; positive where the outer face is in tension.
    pub(super) curvature: Strains,
}

/// A triangle in its plane.
struct Plane {
    x_axis: Vec3,
    y_axis: Vec3,
    normal: Vec3,
    /// Corners relative to the centroid, mm.
    corners: [[f64; 2]; 3],
    area: f64,
}

impl Plane {
    fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        let doubled = (b - a).cross(c - a);
        let (x_axis, normal) = ((b - a).normalize(), doubled.normalize());
        let y_axis = normal.cross(x_axis);
        let center = (a + b + c) / 3.0;
        let corners = corners.map(|p| [(p - center).dot(x_axis), (p - center).dot(y_axis)]);
        Self {
            x_axis,
            y_axis,
            normal,
            corners,
            area: 0.5 * doubled.length(),
        }
    }

    /// Vector from corner i to corner j.
    fn edge(&self, [i, j]: [usize; 2]) -> [f64; 2] {
        [
            self.corners[j][0] - self.corners[i][0],
            self.corners[j][1] - self.corners[i][1],
        ]
    }

    /// Gradients of the barycentric coordinates, 1/mm.
    fn gradients(&self) -> [[f64; 2]; 3] {
        [0, 1, 2].map(|i| {
            let [x, y] = self.edge([(i + 1) % 3, (i + 2) % 3]);
            [-y / (2.0 * self.area), x / (2.0 * self.area)]
        })
    }

    /// Linear form of the displacements, summed from `parts`: (node, factor of its displacement, factor of
    /// its rotation).
    fn form(parts: &[(usize, Vec3, Vec3)]) -> SVector<f64, 18> {
        let mut form = SVector::zeros();
        for &(node, of_move, of_turn) in parts {
            for axis in 0..3 {
                form[6 * node + axis] += of_move[axis];
                form[6 * node + 3 + axis] += of_turn[axis];
            }
        }
        form
    }
}

/// Plane-stress elasticity matrix (stress over strain, no stress across the wall) for thickness 1, MPa.
pub(super) fn plane_stress(youngs_modulus_mpa: f64, poissons_ratio: f64) -> Matrix3<f64> {
    let nu = poissons_ratio;
    let shear = 0.5 * (1.0 - nu);
    Matrix3::new(1.0, nu, 0.0, nu, 1.0, 0.0, 0.0, 0.0, shear) * (youngs_modulus_mpa / (1.0 - nu * nu))
}

impl Element {
    /// Computes the element and its membrane and bending stiffness for thickness 1 mm.
    pub(super) fn new(corners: [Vec3; 3], elasticity: &Matrix3<f64>) -> (Self, [Stiffness; 2]) {
        let plane = Plane::new(corners);
        let membrane = mean_strains(&plane);
        let mut of_membrane = quadratic(&membrane, elasticity, plane.area);
        for strains in in_plane_bending_strains(&plane) {
            of_membrane += quadratic(&strains, elasticity, 0.75 * IN_PLANE_BENDING_SHARE * plane.area);
        }
        let mut of_bending = Stiffness::zeros();
        for [i, j] in EDGES {
            let mut middle = [0.0; 3];
            (middle[i], middle[j]) = (0.5, 0.5);
            of_bending += quadratic(&curvatures(&plane, middle), elasticity, plane.area / 36.0);
        }
        (
            Self {
                membrane,
                curvature: curvatures(&plane, [1.0 / 3.0; 3]),
            },
            [of_membrane, of_bending],
        )
    }
}

fn quadratic(strains: &Strains, elasticity: &Matrix3<f64>, weight: f64) -> Stiffness {
    strains.tr_mul(&(elasticity * strains * weight))
}

/// Mean strains from the corners' displacements, and from the edges, which the drilling rotations bend
/// outwards or inwards.
fn mean_strains(plane: &Plane) -> Strains {
    let mut strains = Strains::zeros();
    for (i, g) in plane.gradients().into_iter().enumerate() {
        strains += outer(g, [1.0, 0.0]) * Plane::form(&[(i, plane.x_axis, Vec3::ZERO)]).transpose();
        strains += outer(g, [0.0, 1.0]) * Plane::form(&[(i, plane.y_axis, Vec3::ZERO)]).transpose();
    }
    for [i, j] in EDGES {
        let [x, y] = plane.edge([i, j]);
        let turned = Plane::form(&[(i, Vec3::ZERO, -plane.normal), (j, Vec3::ZERO, plane.normal)]);
        strains += outer([y, -x], [y, -x]) * turned.transpose() * (DRILLING_SHARE / (12.0 * plane.area));
    }
    strains
}

/// Strains at the midpoints of the edges from the corners' rotations relative to that of the triangle.
fn in_plane_bending_strains(plane: &Plane) -> [Strains; 3] {
    let whole = plane
        .gradients()
        .into_iter()
        .enumerate()
        .fold(SVector::zeros(), |sum, (i, [x, y])| {
            sum + Plane::form(&[(i, (plane.y_axis * x - plane.x_axis * y) * 0.5, Vec3::ZERO)])
        });
    let relative = [0, 1, 2].map(|i| Plane::form(&[(i, Vec3::ZERO, plane.normal)]) - whole);
    let sum = relative[0] + relative[1] + relative[2];
    // Transforms strains along the edges to strains along the axes.
    let lengths_sq = EDGES.map(|edge| plane.edge(edge).map(|x| x * x).iter().sum::<f64>());
    let along = Matrix3::from_rows(&[0, 1, 2].map(|e| {
        let [x, y] = plane.edge(EDGES[e]);
        RowVector3::new(x * x, y * y, x * y) / lengths_sq[e]
    }));
    let from_edges = along.try_inverse().unwrap_or_else(Matrix3::zeros);
    [0, 1, 2].map(|middle| {
        let [i, j] = EDGES[middle];
        let mut strains = Strains::zeros();
        // Felippa's matrices Q of the optimal element, at the middle of edge ij.
        let along_edges = [relative[j] - relative[i], sum + relative[j], -sum - relative[i]];
        for (step, form) in along_edges.into_iter().enumerate() {
            let edge = (middle + step) % 3;
            strains += from_edges.column(edge) * form.transpose() * (plane.area / (3.0 * lengths_sq[edge]));
        }
        strains
    })
}

/// Curvatures at the barycentric coordinates `at`, 1/mm.
fn curvatures(plane: &Plane, at: [f64; 3]) -> Strains {
    let gradients = plane.gradients();
    // β turns the normal: its components are those of θ × n.
    let mut strains = Strains::zeros();
    for (i, g) in gradients.into_iter().enumerate() {
        strains += outer(g, [1.0, 0.0]) * Plane::form(&[(i, Vec3::ZERO, plane.y_axis)]).transpose();
        strains += outer(g, [0.0, 1.0]) * Plane::form(&[(i, Vec3::ZERO, -plane.x_axis)]).transpose();
    }
    for [i, j] in EDGES {
        let [x, y] = plane.edge([i, j]);
        let length = x.hypot(y);
        let along = [x / length, y / length];
        let of_turn = (plane.y_axis * along[0] - plane.x_axis * along[1]) * -0.75;
        let of_move = plane.normal * (1.5 / length);
        let bulge = Plane::form(&[(i, of_move, of_turn), (j, -of_move, of_turn)]);
        let slope = [0, 1].map(|axis| 4.0 * (at[i] * gradients[j][axis] + at[j] * gradients[i][axis]));
        strains += outer(slope, along) * bulge.transpose();
    }
    strains
}

/// Strain of a displacement along `direction` whose magnitude has gradient `g`.
fn outer(g: [f64; 2], direction: [f64; 2]) -> Vector3<f64> {
    Vector3::new(
        g[0] * direction[0],
        g[1] * direction[1],
        g[0] * direction[1] + g[1] * direction[0],
    )
}
