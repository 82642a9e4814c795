//! Wall of one part, condensed onto the points near its seams, which is the same for all plans.

use shellock_geom::Vec3;
use shellock_geom::sparse::{SparseError, SparseSymmetric};
use shellock_mechanics::Material;

use super::element::{EDGES, Order, lame, stiffness};
use super::front::Front;
use super::wall::Wall;

/// Elastic wall of a part as seen by its connectors.
#[derive(Debug)]
pub(super) struct Part {
    /// Wall nodes near the seams, ascending; the unknowns of node `seam_nodes[i]` are `3 i .. 3 i + 3`.
    pub seam_nodes: Vec<u32>,
    /// Stiffness between the unknowns of the kept nodes, N/mm. If the part is free, springs hold its rigid
    /// motions and act on nothing else, so loads in equilibrium deform it as if they were absent.
    pub stiffness: Front,
    /// Rigid motions of the part, unless it is clamped.
    pub rigid: Option<RigidModes>,
}

/// Three translations and three rotations about `center`, scaled to about 1 mm at the part's points.
#[derive(Clone, Copy, Debug)]
pub(super) struct RigidModes {
    center: Vec3,
    radius_mm: f64,
}

impl RigidModes {
    pub fn new(points: &[Vec3]) -> Self {
        let center = points.iter().sum::<Vec3>() / points.len().max(1) as f64;
        let radius_sq =
            points.iter().map(|p| p.distance_squared(center)).sum::<f64>() / points.len().max(1) as f64;
        Self {
            center,
            radius_mm: radius_sq.sqrt().max(f64::MIN_POSITIVE),
        }
    }

    /// Displacement of `point` in each motion.
    pub fn at(&self, point: Vec3) -> [Vec3; 6] {
        let arm = (point - self.center) / self.radius_mm;
        [
            Vec3::X,
            Vec3::Y,
            Vec3::Z,
            Vec3::X.cross(arm),
            Vec3::Y.cross(arm),
            Vec3::Z.cross(arm),
        ]
    }
}

/// Numbering of a part's unknowns: interior nodes first, then the kept ones; none for clamped nodes.
pub(super) struct Numbering {
    pub vertices: Vec<u32>,
    edges: Vec<[u32; 2]>,
    /// First of three unknowns of each vertex, then of each edge's midpoint.
    pub first: Vec<Option<u32>>,
    pub n: usize,
}

impl Numbering {
    pub fn new(
        order: Order,
        tets: &[[u32; 4]],
        seam_nodes: &[u32],
        is_clamped: &impl Fn(u32) -> bool,
    ) -> Self {
        let mut vertices = tets.concat();
        vertices.sort_unstable();
        vertices.dedup();
        let mut edges = Vec::new();
        if order == Order::Quadratic {
            edges = tets
                .iter()
                .flat_map(|t| EDGES.map(|[i, j]| sort_pair([t[i], t[j]])))
                .collect();
            edges.sort_unstable();
            edges.dedup();
        }
        let mut n = 0;
        let mut next = || {
            n += 3;
            Some(n - 3)
        };
        let mut first: Vec<Option<u32>> = (vertices.iter())
            .map(|v| {
                if is_clamped(*v) || seam_nodes.binary_search(v).is_ok() {
                    None
                } else {
                    next()
                }
            })
            .collect();
        first.extend(edges.iter().map(|[a, b]| {
            if is_clamped(*a) && is_clamped(*b) {
                None
            } else {
                next()
            }
        }));
        for (v, first) in vertices.iter().zip(&mut first) {
            if seam_nodes.binary_search(v).is_ok() {
                *first = next();
            }
        }
        Self {
            vertices,
            edges,
            first,
            n: n as usize,
        }
    }

    pub fn of_tet(&self, order: Order, tet: &[u32; 4]) -> [Option<u32>; 10] {
        let mut dofs = [None; 10];
        for i in 0..4 {
            dofs[i] = self
                .vertices
                .binary_search(&tet[i])
                .ok()
                .and_then(|at| self.first[at]);
        }
        if order == Order::Quadratic {
            for (node, [i, j]) in (4..).zip(EDGES) {
                let at = self.edges.binary_search(&sort_pair([tet[i], tet[j]])).ok();
                dofs[node] = at.and_then(|at| self.first[self.vertices.len() + at]);
            }
        }
        dofs
    }
}

fn sort_pair([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Part {
    /// Condenses the part made of `tets` onto the nodes `seam_nodes` (ascending, none clamped).
    pub fn new(
        order: Order,
        material: &Material,
        wall: &Wall,
        tets: &[[u32; 4]],
        seam_nodes: Vec<u32>,
        is_clamped: impl Fn(u32) -> bool,
    ) -> Result<Self, SparseError> {
        let numbering = Numbering::new(order, tets, &seam_nodes, &is_clamped);
        let points: Vec<Vec3> = seam_nodes.iter().map(|v| wall.nodes[*v as usize]).collect();
        let is_free = !numbering.vertices.iter().any(|v| is_clamped(*v));
        let rigid = is_free.then(|| RigidModes::new(&points));
        if seam_nodes.is_empty() {
            return Ok(Self {
                seam_nodes,
                stiffness: Front::default(),
                rigid,
            });
        }
        let entries = assemble(order, material, wall, tets, &numbering);
        let mut values =
            SparseSymmetric::from_entries(numbering.n, entries).schur_complement(3 * seam_nodes.len())?;
        if let Some(rigid) = &rigid {
            hold_rigid_motions(&mut values, &points, rigid)?;
        }
        let ids = (0..3 * seam_nodes.len() as u32).collect();
        Ok(Self {
            seam_nodes,
            stiffness: Front { ids, values },
            rigid,
        })
    }
}

/// Stiffness of the wall made of `tets`: row, column, N/mm.
pub(super) fn assemble(
    order: Order,
    material: &Material,
    wall: &Wall,
    tets: &[[u32; 4]],
    numbering: &Numbering,
) -> Vec<(u32, u32, f64)> {
    let lame = lame(material);
    let mut entries = Vec::with_capacity(tets.len() * 9 * order.n_nodes() * (order.n_nodes() + 1) / 2);
    for tet in tets {
        let dofs = numbering.of_tet(order, tet);
        stiffness(order, tet.map(|v| wall.nodes[v as usize]), lame, |a, b, k| {
            let (Some(p), Some(q)) = (dofs[a], dofs[b]) else {
                return;
            };
            for (i, k) in (0..).zip(k) {
                for j in if a == b { i..3 } else { 0..3 } {
                    entries.push((p + i as u32, q + j as u32, k[j]));
                }
            }
        });
    }
    entries
}

/// Adds springs `k Q Qᵀ`, Q an orthonormal basis of the rigid motions at `points` and k the mean stiffness.
fn hold_rigid_motions(values: &mut [f64], points: &[Vec3], rigid: &RigidModes) -> Result<(), SparseError> {
    let n = 3 * points.len();
    let modes: Vec<[f64; 6]> = points
        .iter()
        .flat_map(|p| {
            let m = rigid.at(*p);
            (0..3).map(move |i| m.map(|v| v[i]))
        })
        .collect();
    let gram = nalgebra::SMatrix::<f64, 6, 6>::from_fn(|a, b| modes.iter().map(|m| m[a] * m[b]).sum());
    let inverse = gram.try_inverse().ok_or(SparseError::NotPositiveDefinite { n })?;
    let k = (0..n).map(|i| values[i * (n + 1)]).sum::<f64>() / n as f64;
    for column in 0..n {
        let weighted = inverse * nalgebra::SVector::<f64, 6>::from(modes[column]);
        for row in column..n {
            let along: f64 = modes[row].iter().zip(weighted.iter()).map(|(m, w)| m * w).sum();
            values[row + n * column] += k * along;
        }
    }
    Ok(())
}
