//! Parts as seen by their seams: each mesh is condensed onto four motions of every station.
//!
//! With `Q` the gradients of those motions and `K` the stiffness of the part's mesh, the compliance is `C = Q
//! K⁻¹ Qᵀ`. This is exact, whatever happens at the seams, and the same for all plans. A part that floats on
//! springs `G` also has its rigid motions `R`, and then the compliance is `C + R G⁻¹ Rᵀ`.

use nalgebra::DMatrix;
use rayon::prelude::*;
use shellock_geom::Vec3;
use shellock_geom::sparse::{Cholesky, SparseError, SparseSymmetric};

use super::SurfaceParams;
use super::terms::{Root, Term, patch_terms};
use crate::assembly::{SIDES, ShellAssembly};

/// Number of motions of a station: along the tangent, along the normal, across, and rotation about the
/// tangent.
pub(super) const N_MOTIONS: usize = 4;

/// Motion of side a of a station relative to side b, or the forces that pull them apart.
pub(super) type Motions = [f64; N_MOTIONS];

/// Stiffness, in `E H`, of the springs that tie every point of a floating part to its place. It is 10⁵ times
/// less than the resistance of the weakest joint of a plan that holds.
const GROUND_SHARE: f64 = 1e-8;

/// Stiffness of the six supports of a floating part, in `E H`. They are statically determinate, so they add
/// only rigid motions, which are negligible beside those of the ground springs.
const SUPPORT_SHARE: f64 = 0.1;

/// Length that makes rotations comparable with translations, mm: about a piece's radius.
const RADIUS_MM: f64 = 30.0;

/// Least compliance of every motion, added to the mesh's, as a share of that of a contact one mm long. Parts
/// of a few triangles have fewer motions than their stations need.
const LEAST_COMPLIANCE: f64 = 1e-3;

/// Gradient of a motion at the part's points.
type Gradient = Vec<(u32, Vec3)>;

/// Part as its seams see it.
#[derive(Debug)]
pub(super) struct Part {
    /// Stations at which the part is a side, ascending.
    pub stations: Vec<u32>,
    /// Motion of side a relative to side b at each station, in [`N_MOTIONS`], under forces that pull them
    /// apart: mm/N (1/N for one rotation, 1/N mm for two). The parts on the other sides add their own.
    pub compliance: DMatrix<f64>,
    inside: Inside,
}

/// Interior of a part, which is condensed away.
#[derive(Debug)]
struct Inside {
    /// Factorised stiffness of the mesh on its supports.
    factor: Cholesky,
    /// Points of the part that may move, ascending, with the row of their x displacement.
    rows: Vec<(u32, u32)>,
    /// Gradients of the stations' motions at the part's points.
    gradients: Vec<Gradient>,
    ground: Option<Floating>,
}

/// Part without held points, on ground springs.
#[derive(Debug)]
struct Floating {
    /// Motions of the stations when the part moves as a rigid body.
    rigid: DMatrix<f64>,
    /// Stiffness of the ground springs, N/mm.
    ground_n_mm: f64,
}

/// Least compliance of every motion, mm/N, added to the mesh's.
pub(super) fn least_compliance(params: &SurfaceParams) -> f64 {
    LEAST_COMPLIANCE / params.contact_n_mm(params.connector_mm, 1.0)
}

/// Points of the outer surface, moved to mid-wall.
pub(super) fn mid_wall(params: &SurfaceParams, assembly: &ShellAssembly) -> Vec<Vec3> {
    let points = assembly.points.iter().zip(&assembly.normals);
    points.map(|(p, n)| *p - 0.5 * params.wall_mm * *n).collect()
}

/// Builds all parts; points with `is_held` do not move.
pub(super) fn parts(
    params: &SurfaceParams,
    assembly: &ShellAssembly,
    is_held: &[bool],
) -> Result<Vec<Part>, SparseError> {
    let points = mid_wall(params, assembly);
    let mut terms: Vec<Vec<Term>> = vec![Vec::new(); assembly.n_parts];
    for term in patch_terms(params, assembly, &points) {
        terms[assembly.part_of_point[term.corners[0].0 as usize] as usize].push(term);
    }
    let mut triangles_at = vec![Vec::new(); points.len()];
    assembly
        .triangles
        .iter()
        .for_each(|t| t.iter().for_each(|&v| triangles_at[v as usize].push(*t)));
    let mut motions: Vec<Vec<(u32, [Gradient; N_MOTIONS])>> = vec![Vec::new(); assembly.n_parts];
    for (i, station) in (0..).zip(&assembly.stations) {
        for (side, sign) in SIDES.into_iter().zip([1.0, -1.0]) {
            let point = station.points[side.index()];
            let root = Root::new(&points, point, triangles_at[point as usize].iter().copied());
            let [t, n, across] =
                [station.tangent, station.normal, station.across].map(|g| root.shift(sign * g));
            let own = [t, n, across, root.turn(sign * station.tangent)];
            let of_part = &mut motions[assembly.part_of_point[point as usize] as usize];
            match of_part.last_mut() {
                // A seam of a part with itself.
                Some((last, all)) if *last == i => all.iter_mut().zip(own).for_each(|(a, o)| a.extend(o)),
                _ => of_part.push((i, own)),
            }
        }
    }
    let row = rows_by_part(assembly, is_held);
    let mut own: Vec<Vec<u32>> = vec![Vec::new(); assembly.n_parts];
    (0..)
        .zip(&assembly.part_of_point)
        .for_each(|(v, &part)| own[part as usize].push(v));
    let all = terms.par_iter().zip(motions).zip(own);
    all.map(|((terms, motions), own)| part(params, &row, &points, terms, motions, &own))
        .collect()
}

/// Six supports that hold a body without straining it: three at its first point, two at the farthest one, and
/// one at the point farthest from the line through both.
fn supports(params: &SurfaceParams, points: &[Vec3], body: &[u32]) -> Vec<Term> {
    let at = |v: u32| points[v as usize];
    let farthest = |distance: &dyn Fn(u32) -> f64| {
        body.iter()
            .copied()
            .max_by(|&x, &y| distance(x).total_cmp(&distance(y)).then(y.cmp(&x)))
    };
    let Some(&a) = body.first() else { return Vec::new() };
    let b = farthest(&|v| at(v).distance_squared(at(a))).unwrap_or(a);
    let along = (at(b) - at(a)).normalize_or(Vec3::X);
    let c = farthest(&|v| (at(v) - at(a)).reject_from_normalized(along).length_squared()).unwrap_or(a);
    let aside = (at(c) - at(a))
        .reject_from_normalized(along)
        .normalize_or(along.any_orthonormal_vector());
    let up = along.cross(aside);
    let held = [(a, along), (a, aside), (a, up), (b, aside), (b, up), (c, up)];
    let stiffness = SUPPORT_SHARE * params.material.youngs_modulus_mpa * params.wall_mm;
    held.map(|corner| Term {
        corners: vec![corner],
        stiffness,
    })
    .to_vec()
}

/// Row of each point's x displacement within its part; `None` for a held point.
fn rows_by_part(assembly: &ShellAssembly, is_held: &[bool]) -> Vec<Option<u32>> {
    let mut n_rows = vec![0; assembly.n_parts];
    let row = |(&part, &is_held): (&u32, &bool)| {
        (!is_held).then(|| {
            n_rows[part as usize] += 3;
            n_rows[part as usize] - 3
        })
    };
    assembly.part_of_point.iter().zip(is_held).map(row).collect()
}

fn part(
    params: &SurfaceParams,
    row: &[Option<u32>],
    points: &[Vec3],
    terms: &[Term],
    motions: Vec<(u32, [Gradient; N_MOTIONS])>,
    own: &[u32],
) -> Result<Part, SparseError> {
    let is_held = own.iter().any(|v| row[*v as usize].is_none());
    let floats = if is_held { &[][..] } else { own };
    let (stations, gradients): (Vec<u32>, Vec<_>) = motions.into_iter().unzip();
    let gradients: Vec<Gradient> = gradients.into_iter().flatten().collect();
    let supports = supports(params, points, floats);
    let corners = terms
        .iter()
        .chain(&supports)
        .flat_map(|t| &t.corners)
        .chain(gradients.iter().flatten());
    let n = corners
        .filter_map(|c| row[c.0 as usize])
        .max()
        .map_or(0, |r| r as usize + 3);
    let factor = Cholesky::new(&mesh_stiffness(n, row, terms.iter().chain(&supports)))?;
    let m = gradients.len();
    let mut sides = vec![0.0; n * m];
    for (side, gradient) in sides.chunks_exact_mut(n.max(1)).zip(&gradients) {
        for &(p, g) in gradient {
            add(side, row[p as usize], g);
        }
    }
    let forces = DMatrix::from_column_slice(n, m, &sides);
    factor.solve_in_place(&mut sides);
    let mut compliance = forces.transpose() * DMatrix::from_column_slice(n, m, &sides);
    for i in 0..m {
        compliance[(i, i)] += least_compliance(params);
    }
    let ground = (!floats.is_empty()).then(|| Floating {
        rigid: DMatrix::from_fn(m, 6, |i, j| rigid_motion(points, &gradients[i], j)),
        ground_n_mm: GROUND_SHARE * params.material.youngs_modulus_mpa * params.wall_mm * floats.len() as f64,
    });
    if let Some(Floating { rigid, ground_n_mm }) = &ground {
        compliance += rigid * rigid.transpose() / *ground_n_mm;
    }
    let rows = own
        .iter()
        .filter_map(|&v| row[v as usize].map(|r| (v, r)))
        .collect();
    Ok(Part {
        stations,
        compliance: 0.5 * (&compliance + compliance.transpose()),
        inside: Inside {
            factor,
            rows,
            gradients,
            ground,
        },
    })
}

impl Part {
    /// Motion of side a relative to side b at each of the part's stations, under `forces_n` on all points of
    /// the assembly at mid-wall. Only the ground springs or the held points hold the part.
    pub fn drift(&self, points: &[Vec3], forces_n: &[Vec3]) -> Vec<f64> {
        let Inside {
            factor,
            rows,
            gradients,
            ground,
        } = &self.inside;
        let mut moved = vec![0.0; factor.n_rows()];
        rows.iter()
            .for_each(|&(v, r)| add(&mut moved, Some(r), forces_n[v as usize]));
        factor.solve_in_place(&mut moved);
        let along = |gradient: &Gradient| {
            let at = |&(v, g): &(u32, Vec3)| {
                let row = self.inside.place_of(v).map(|at| rows[at].1 as usize);
                row.map_or(0.0, |r| g.dot(Vec3::from_slice(&moved[r..r + 3])))
            };
            gradient.iter().map(at).sum::<f64>()
        };
        let mut drift: Vec<f64> = gradients.iter().map(along).collect();
        if let Some(Floating { rigid, ground_n_mm }) = ground {
            let own: Gradient = rows.iter().map(|&(v, _)| (v, forces_n[v as usize])).collect();
            for j in 0..6 {
                let shift = rigid_motion(points, &own, j) / ground_n_mm;
                drift
                    .iter_mut()
                    .zip(rigid.column(j).iter())
                    .for_each(|(d, r)| *d += shift * r);
            }
        }
        drift
    }

    /// Displacement of each free point of the part, mm, under `forces_n` on all points of the assembly at
    /// mid-wall and the forces `sent` between the sides of all stations.
    pub fn displacements(&self, points: &[Vec3], forces_n: &[Vec3], sent: &[Motions]) -> Vec<(u32, Vec3)> {
        let Inside {
            factor,
            rows,
            gradients,
            ground,
        } = &self.inside;
        let mut own: Gradient = rows.iter().map(|&(v, _)| (v, forces_n[v as usize])).collect();
        let sent = self.stations.iter().flat_map(|s| sent[*s as usize]);
        for (gradient, force) in gradients.iter().zip(sent) {
            for &(v, g) in gradient {
                if let Some(at) = self.inside.place_of(v) {
                    own[at].1 += force * g;
                }
            }
        }
        let mut bent = vec![0.0; factor.n_rows()];
        rows.iter()
            .zip(&own)
            .for_each(|(&(_, r), &(_, force))| add(&mut bent, Some(r), force));
        factor.solve_in_place(&mut bent);
        let rigid: [f64; 6] = std::array::from_fn(|j| match ground {
            Some(Floating { ground_n_mm, .. }) => rigid_motion(points, &own, j) / ground_n_mm,
            None => 0.0,
        });
        let moved = |&(v, r): &(u32, u32)| {
            let whole: Vec3 = (0..6).map(|j| rigid[j] * rigid_mode(points[v as usize], j)).sum();
            (v, whole + Vec3::from_slice(&bent[r as usize..r as usize + 3]))
        };
        rows.iter().map(moved).collect()
    }
}

impl Inside {
    /// Index of a point among those that may move.
    fn place_of(&self, point: u32) -> Option<usize> {
        self.rows.binary_search_by_key(&point, |r| r.0).ok()
    }
}

/// Value of a motion's linear form for rigid motion `j`.
fn rigid_motion(points: &[Vec3], gradient: &[(u32, Vec3)], j: usize) -> f64 {
    gradient
        .iter()
        .map(|&(v, g)| g.dot(rigid_mode(points[v as usize], j)))
        .sum()
}

/// Displacement of a point by rigid motion `j`: a translation, or a rotation about an axis through the
/// origin.
fn rigid_mode(point: Vec3, j: usize) -> Vec3 {
    let axis = Vec3::AXES[j % 3];
    if j < 3 {
        axis
    } else {
        axis.cross(point) / RADIUS_MM
    }
}

fn mesh_stiffness<'a>(
    n: usize,
    row: &[Option<u32>],
    terms: impl Iterator<Item = &'a Term>,
) -> SparseSymmetric {
    // A point without triangles, if there is one, has no stiffness of its own.
    let mut entries: Vec<(u32, u32, f64)> = (0..n as u32).map(|r| (r, r, f64::MIN_POSITIVE)).collect();
    for term in terms {
        let free = |&(p, g): &(u32, Vec3)| row[p as usize].map(|r| (r, g));
        let corners: Vec<(u32, Vec3)> = term.corners.iter().filter_map(free).collect();
        for (i, &(r, g)) in corners.iter().enumerate() {
            for &(q, h) in &corners[i..] {
                for (x, gx) in (0..).zip(g.to_array()) {
                    for (y, hy) in (0..).zip(h.to_array()) {
                        if r != q || y >= x {
                            entries.push((r + x, q + y, term.stiffness * gx * hy));
                        }
                    }
                }
            }
        }
    }
    SparseSymmetric::from_entries(n, entries)
}

fn add(forces: &mut [f64], row: Option<u32>, force: Vec3) {
    if let Some(row) = row {
        for (x, f) in (row as usize..).zip(force.to_array()) {
            forces[x] += f;
        }
    }
}
