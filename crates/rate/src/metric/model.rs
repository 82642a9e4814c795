//! The segmented surface as parts and stations, and the joints that a plan makes of the stations.

use rayon::prelude::*;
use shellock_assembly::LatticeDirection;
use shellock_geom::remesh::{RemeshParams, Remeshed, remesh};
use shellock_geom::sparse::SparseError;
use shellock_geom::topology::ends;
use shellock_geom::{Topology, TriMesh, Vec3};
use shellock_mechanics::{Material, Meeting, ShellAssembly, Station, SurfaceModel, SurfaceParams};
use shellock_plan::interface::{Leave, Obstructions, Sights, meeting};
use shellock_plan::sizes::ConnectorSizes;
use shellock_plan::{LatticePlan, PieceSet, PlanParams};
use shellock_report::ParamProblem;
use shellock_report::PatchId;
use shellock_surface::SegmentedSurface;
use shellock_surface::seam::rules::end_gap_mm;
use shellock_surface::seam::{seam_half_edges, stretches};

/// Parameters of the mechanical model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetricParams {
    /// Wall thickness, mm. [0.1, 10]; 2.
    pub wall_mm: f64,
    /// Connector size D of local tests, and where walls meet without a connector, mm. [1, 10]; 2.5.
    pub connector_mm: f64,
    /// Floor β of the connector weight (Eq. 4). [0, 1]; 0.1.
    pub beta: f64,
    /// Length of triangle edges, relative to that of about 1000 points. [0.2, 5]; 1.
    ///
    /// With 1 a plan takes some milliseconds. The study shows the effect of finer meshes.
    pub edge_share: f64,
    /// Material that pieces are printed of. E in [1, 10⁶] MPa, ν in [0, 0.45].
    pub material: Material,
    /// The key that slides on rails, and its direction; none by default.
    pub rails: Option<(PatchId, LatticeDirection)>,
}

impl Default for MetricParams {
    fn default() -> Self {
        Self {
            wall_mm: 2.0,
            connector_mm: 2.5,
            beta: 0.1,
            edge_share: 1.0,
            material: Material::default(),
            rails: None,
        }
    }
}

impl MetricParams {
    /// Takes wall, floor β and rails of the plan, and the default of `sizes`. Without a wall the usual one
    /// counts.
    pub fn of_plan(params: &PlanParams, sizes: &ConnectorSizes, material: Material) -> Self {
        let defaults = Self::default();
        let wall_mm = if params.wall_mm > 0.0 {
            params.wall_mm
        } else {
            defaults.wall_mm
        };
        let rails = params.key.zip(params.key_slide);
        Self {
            wall_mm,
            connector_mm: sizes.default_mm(),
            beta: params.beta,
            rails,
            material,
            ..defaults
        }
    }

    /// Lists every value out of range; no model can be made of such.
    pub fn problems(&self) -> Vec<ParamProblem> {
        let Material {
            youngs_modulus_mpa,
            poissons_ratio,
            ..
        } = self.material;
        let checks = [
            ParamProblem::unless_within("wall thickness", "mm", self.wall_mm, 0.1, 10.0),
            ParamProblem::unless_within("connector size", "mm", self.connector_mm, 1.0, 10.0),
            ParamProblem::unless_within("floor of the connector weight", "", self.beta, 0.0, 1.0),
            ParamProblem::unless_within("edge share", "", self.edge_share, 0.2, 5.0),
            ParamProblem::unless_within("Young's modulus", "MPa", youngs_modulus_mpa, 1.0, 1e6),
            ParamProblem::unless_within("Poisson's ratio", "", poissons_ratio, 0.0, 0.45),
        ];
        checks.into_iter().flatten().collect()
    }

    /// Parameters of the surface metric for these values.
    pub fn surface(&self) -> SurfaceParams {
        let (wall_mm, connector_mm, material) = (self.wall_mm, self.connector_mm, self.material);
        SurfaceParams {
            wall_mm,
            connector_mm,
            material,
            ..SurfaceParams::default()
        }
    }
}

/// Mechanical model of a segmented surface; the same for all plans.
#[derive(Clone, Debug)]
pub struct PlanModel {
    /// Parts and stations; parts are pieces, by the same numbers.
    pub assembly: ShellAssembly,
    /// Parameters of the model.
    pub params: MetricParams,
    seams: Vec<StationSeam>,
    /// Pieces in the way of a connector, at three places of each station; none if walls have no thickness, or
    /// if there are too many pieces for a plan.
    sights: Vec<[Sights; 3]>,
}

/// Seam of a station, with its pieces and its room.
#[derive(Clone, Copy, Debug)]
struct StationSeam {
    a: PatchId,
    b: PatchId,
    /// Connector size D, mm.
    size_mm: f64,
    /// True where the station is far enough from the ends of an open seam for a connector.
    has_room: bool,
    /// First and last point of the seam.
    ends: [Vec3; 2],
}

/// A divided surface with even triangles, which all models of the same pieces share.
#[derive(Clone, Debug)]
pub struct EvenSurface {
    mesh: TriMesh,
    labels: Vec<u32>,
    n_parts: usize,
}

impl EvenSurface {
    /// Remeshes `surface` to triangles with edges of about `edge_share` times the usual length, see
    /// [`MetricParams::edge_share`].
    pub fn new(surface: &SegmentedSurface, edge_share: f64) -> Self {
        /// Points of the mesh with `edge_share` 1; equilateral triangles have one for each √3/2 l².
        const POINTS_AT_ONE: f64 = 1000.0;
        let area_mm2 = surface.mesh.area();
        let target_edge_mm = edge_share * (area_mm2 / (POINTS_AT_ONE * 0.75f64.sqrt())).sqrt();
        let labels: Vec<u32> = surface.patch_of_face.iter().map(|p| p.0).collect();
        let mut coarse = remesh(
            &RemeshParams {
                target_edge_mm,
                n_rounds: 5,
            },
            &surface.mesh,
            &labels,
        );
        split_short_seams(&mut coarse);
        Self {
            mesh: relax_folds(coarse.mesh),
            labels: coarse.labels,
            n_parts: surface.n_patches,
        }
    }
}

impl PlanModel {
    /// Remeshes `surface` evenly and builds the model. `params` must have no
    /// [`problems`](MetricParams::problems).
    pub fn new(params: &MetricParams, surface: &SegmentedSurface, sizes: &ConnectorSizes) -> Self {
        Self::of_even(params, &EvenSurface::new(surface, params.edge_share), sizes)
    }

    /// Finds the stations of an even surface: all points inside seams. `params` must have no
    /// [`problems`](MetricParams::problems); their length of edges is that of the surface.
    pub fn of_even(params: &MetricParams, even: &EvenSurface, sizes: &ConnectorSizes) -> Self {
        Self::of_mesh(params, &even.mesh, &even.labels, even.n_parts, sizes)
    }

    /// Builds the model of a closed mesh with these labels, without remeshing.
    fn of_mesh(
        params: &MetricParams,
        mesh: &TriMesh,
        labels: &[u32],
        n_parts: usize,
        sizes: &ConnectorSizes,
    ) -> Self {
        let mut model = Self {
            assembly: parts(mesh, labels, n_parts),
            params: *params,
            seams: Vec::new(),
            sights: Vec::new(),
        };
        let topology = Topology::of_mesh(mesh).expect("a remeshed surface is closed");
        let normals = point_normals(mesh);
        // Index of a mesh point's copy in a part: parts() numbers points by part, then by point.
        let copies = copies(mesh, labels);
        let copy = |part: u32, v: u32| {
            copies
                .binary_search(&(part, v))
                .expect("a seam point is of both parts") as u32
        };
        for s in stretches(
            mesh,
            &topology,
            labels,
            &seam_half_edges(&topology, labels, 0..labels.len() as u32),
        ) {
            let mut chain: Vec<u32> = vec![ends(mesh, s.half_edges[0]).0];
            chain.extend(s.half_edges.iter().map(|&h| ends(mesh, h).1));
            let points: Vec<(Vec3, Vec3, [u32; 2])> = chain
                .iter()
                .map(|&v| {
                    (
                        mesh.points[v as usize],
                        normals[v as usize],
                        [copy(s.a, v), copy(s.b, v)],
                    )
                })
                .collect();
            let [a, b] = [PatchId(s.a), PatchId(s.b)];
            model.add_seam([a, b], sizes.of(a, b), &points);
        }
        let patch_of_face: Vec<PatchId> = labels.iter().map(|&l| PatchId(l)).collect();
        let obstructions = Obstructions::new(params.wall_mm, mesh, &patch_of_face);
        if let Some(obstructions) = obstructions.filter(|_| n_parts <= PieceSet::MAX_PIECES) {
            model.sights = model.look(&obstructions);
        }
        model
    }

    /// Pieces in the way of a connector, at three places of each station's stretch.
    fn look(&self, obstructions: &Obstructions<'_>) -> Vec<[Sights; 3]> {
        const PLACES: [f64; 3] = [-1.0 / 3.0, 0.0, 1.0 / 3.0];
        let of_station = |i: usize| {
            let (seam, at) = (&self.seams[i], &self.assembly.stations[i]);
            PLACES.map(|share| {
                let place = self.place_of(i) + share * at.length_mm * at.tangent;
                obstructions.sights(seam.size_mm, place, at.normal, at.across)
            })
        };
        (0..self.seams.len()).into_par_iter().map(of_station).collect()
    }

    /// Adds the stations of a seam, with patch a on its left: all points but the ends; of a loop all points
    /// once.
    ///
    /// Lengths are measured on the inner side of the wall, where connectors are.
    fn add_seam(&mut self, [a, b]: [PatchId; 2], size_mm: f64, points: &[(Vec3, Vec3, [u32; 2])]) {
        /// Least share of a station's stretch that must be far enough from the ends for a connector, against
        /// rounding.
        const LEAST_SHARE: f64 = 1e-6;
        let n = points.len() - 1;
        let is_loop = points[0].2 == points[n].2;
        let inner = |i: usize| points[i].0 - self.params.wall_mm * points[i].1;
        let mut arc_mm = vec![0.0; n + 1];
        (0..n).for_each(|i| arc_mm[i + 1] = arc_mm[i] + inner(i).distance(inner(i + 1)));
        let margin = if is_loop {
            0.0
        } else {
            end_gap_mm(size_mm, arc_mm[n])
        };
        let before_mm = |i: usize| {
            if i > 0 {
                arc_mm[i - 1]
            } else {
                arc_mm[n - 1] - arc_mm[n]
            }
        };
        let first = self.assembly.stations.len() as u32;
        for i in usize::from(!is_loop)..n {
            let (before, after) = (points[if i > 0 { i - 1 } else { n - 1 }], points[i + 1]);
            let (_, normal, copies) = points[i];
            let tangent = (after.0 - before.0)
                .reject_from_normalized(normal)
                .normalize_or(normal.any_orthonormal_vector());
            let across = tangent.cross(normal);
            // A station stands for the seam up to halfway to the next stations, and at the ends of open seams
            // for all that is left.
            let half = |from: f64, to: f64| 0.5 * (from + to);
            let start = if is_loop || i > 1 {
                half(arc_mm[i], before_mm(i))
            } else {
                0.0
            };
            let end = if is_loop || i + 1 < n {
                half(arc_mm[i], arc_mm[i + 1])
            } else {
                arc_mm[n]
            };
            let joined_mm = end.min(arc_mm[n] - margin) - start.max(margin);
            let has_room = is_loop || joined_mm > LEAST_SHARE * (end - start);
            let length_mm = if has_room && !is_loop {
                joined_mm
            } else {
                end - start
            };
            self.assembly.stations.push(Station {
                points: copies,
                tangent,
                normal,
                across,
                length_mm,
            });
            self.seams.push(StationSeam {
                a,
                b,
                size_mm,
                has_room,
                ends: [points[0].0, points[n].0],
            });
        }
        let last = self.assembly.stations.len() as u32;
        self.assembly.steps.extend((first + 1..last).map(|i| [i - 1, i]));
        if is_loop && last > first + 1 {
            self.assembly.steps.push([last - 1, first]);
        }
    }

    /// Walls and joints that `plan` makes of each station.
    pub fn meetings(&self, plan: &LatticePlan) -> Vec<Meeting> {
        let mut position = vec![0; self.assembly.n_parts];
        plan.steps
            .iter()
            .enumerate()
            .for_each(|(i, s)| position[usize::from(s.piece)] = i);
        let leaves = Leave::all(plan);
        let meet = |(i, seam): (usize, &StationSeam)| {
            let a_is_later = position[usize::from(seam.a)] > position[usize::from(seam.b)];
            let later = if a_is_later { seam.a } else { seam.b };
            let s = plan.steps[position[usize::from(later)]].separation;
            let on_rails = self.params.rails == Some((later, s));
            let mut meeting = meeting(
                &self.assembly.stations[i],
                seam.size_mm,
                a_is_later,
                s.unit(),
                self.params.beta,
                false,
                on_rails,
            );
            let is_blocked = || {
                let blocks = |s: &&Sights| s.is_blocked([seam.a, seam.b], a_is_later, &leaves);
                let sights = self.sights.get(i);
                sights.is_some_and(|sights| 2 * sights.iter().filter(blocks).count() > sights.len())
            };
            meeting.joint = meeting
                .joint
                .filter(|_| seam.has_room && (on_rails || !is_blocked()));
            if let Some(joint) = &mut meeting.joint {
                joint.is_fast = later == plan.key();
            }
            meeting
        };
        self.seams.iter().enumerate().map(meet).collect()
    }

    /// The two pieces at a station.
    pub fn pieces_at(&self, station: usize) -> [PatchId; 2] {
        [self.seams[station].a, self.seams[station].b]
    }

    /// Ends of the station's seam, mm; the same point twice for a loop.
    pub fn seam_ends(&self, station: usize) -> [Vec3; 2] {
        self.seams[station].ends
    }

    /// Position of a station on the outer surface, mm.
    pub fn place_of(&self, station: usize) -> Vec3 {
        self.assembly.points[self.assembly.stations[station].points[0] as usize]
    }

    /// Solver of the surface metric.
    pub fn surface_model(&self) -> Result<SurfaceModel, SparseError> {
        SurfaceModel::new(&self.params.surface(), &self.assembly)
    }
}

/// Splits edges of seams that have fewer than three, the longest first: a seam needs at least two stations to
/// resist a turn.
fn split_short_seams(coarse: &mut Remeshed) {
    const LEAST_EDGES: usize = 3;
    let topology = Topology::of_mesh(&coarse.mesh).expect("a remeshed surface is closed");
    let seam = seam_half_edges(&topology, &coarse.labels, 0..coarse.labels.len() as u32);
    let mut edges: Vec<(u32, u32, usize)> = Vec::new();
    for s in stretches(&coarse.mesh, &topology, &coarse.labels, &seam) {
        if s.half_edges.len() < LEAST_EDGES {
            let n_parts = LEAST_EDGES.div_ceil(s.half_edges.len());
            edges.extend(
                s.half_edges
                    .iter()
                    .map(|&h| ends(&coarse.mesh, h))
                    .map(|(u, v)| (u, v, n_parts)),
            );
        }
    }
    for (u, v, n_parts) in edges {
        let [from, to] = [u, v].map(|x| coarse.mesh.points[x as usize]);
        let mut last = u;
        for k in 1..n_parts {
            let middle = coarse.mesh.points.len() as u32;
            coarse.mesh.points.push(from.lerp(to, k as f64 / n_parts as f64));
            split_edge(coarse, last, v, middle);
            last = middle;
        }
    }
}

/// Inserts point `middle` into the edge between `u` and `v`: each triangle at the edge becomes two.
fn split_edge(coarse: &mut Remeshed, u: u32, v: u32, middle: u32) {
    for i in 0..coarse.mesh.triangles.len() {
        let triangle = coarse.mesh.triangles[i];
        let Some(at) = (0..3).find(|&k| [(u, v), (v, u)].contains(&(triangle[k], triangle[(k + 1) % 3])))
        else {
            continue;
        };
        let [x, y, z] = [0, 1, 2].map(|k| triangle[(at + k) % 3]);
        coarse.mesh.triangles[i] = [x, middle, z];
        coarse.mesh.triangles.push([middle, y, z]);
        coarse.labels.push(coarse.labels[i]);
    }
}

/// Pairs of part and point of `mesh`, in the order in which parts number their own points.
fn copies(mesh: &TriMesh, labels: &[u32]) -> Vec<(u32, u32)> {
    let mut copies: Vec<(u32, u32)> = mesh
        .triangles
        .iter()
        .zip(labels)
        .flat_map(|(t, &part)| t.map(|v| (part, v)))
        .collect();
    copies.sort_unstable();
    copies.dedup();
    copies
}

fn parts(mesh: &TriMesh, labels: &[u32], n_parts: usize) -> ShellAssembly {
    let copies = copies(mesh, labels);
    let normals = point_normals(mesh);
    let copy = |part: u32, v: u32| copies.binary_search(&(part, v)).expect("all corners are copied") as u32;
    ShellAssembly {
        points: copies.iter().map(|c| mesh.points[c.1 as usize]).collect(),
        normals: copies.iter().map(|c| normals[c.1 as usize]).collect(),
        part_of_point: copies.iter().map(|c| c.0).collect(),
        triangles: mesh
            .triangles
            .iter()
            .zip(labels)
            .map(|(t, &part)| t.map(|v| copy(part, v)))
            .collect(),
        n_parts,
        ..ShellAssembly::default()
    }
}

/// Least cosine between a point's normal and those of its triangles, so that a wall can be built on each.
const LEAST_COSINE: f64 = 0.2;

/// Moves points towards their neighbours where triangles fold so sharply that no wall can be built on them.
///
/// At ears and in ditches narrower than an edge a coarse mesh has a few such points in two thousand.
fn relax_folds(mut mesh: TriMesh) -> TriMesh {
    /// Greatest number of rounds; most folds are gone after two. Where a fold stays, as on a limb thinner
    /// than an edge, more rounds would shrink the limb to a thread, whose triangles are too small to compute
    /// with.
    const MOST_ROUNDS: usize = 5;
    for _ in 0..MOST_ROUNDS {
        let normals = point_normals(&mesh);
        let is_folded = |face: &usize| {
            let across = mesh.double_area_vector(*face).normalize_or_zero();
            mesh.triangles[*face]
                .iter()
                .any(|&v| normals[v as usize].dot(across) < LEAST_COSINE)
        };
        let folded: Vec<usize> = (0..mesh.triangles.len()).filter(is_folded).collect();
        if folded.is_empty() {
            break;
        }
        let mut is_moved = vec![false; mesh.points.len()];
        folded
            .iter()
            .flat_map(|&f| mesh.triangles[f])
            .for_each(|v| is_moved[v as usize] = true);
        // For each point the sum of itself and its neighbours, which the triangles around name twice, and
        // their number.
        let mut sums: Vec<(Vec3, f64)> = mesh.points.iter().map(|p| (2.0 * *p, 2.0)).collect();
        for t in &mesh.triangles {
            for (v, w) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                for (at, from) in [(v, w), (w, v)] {
                    let sum = &mut sums[at as usize];
                    *sum = (sum.0 + mesh.points[from as usize], sum.1 + 1.0);
                }
            }
        }
        let places = mesh
            .points
            .iter_mut()
            .zip(sums)
            .zip(is_moved)
            .filter(|(_, is_moved)| *is_moved);
        places.for_each(|((p, sum), _)| *p = sum.0 / sum.1);
    }
    mesh
}

/// Outward unit normals: the mean of the triangles by area, turned until every triangle at the point is seen
/// from outside.
///
/// At ears and folds the mean may lie along a triangle, and no wall could be built on it. Where no direction
/// sees all of a point's triangles, the last one tried is kept.
fn point_normals(mesh: &TriMesh) -> Vec<Vec3> {
    /// Greatest number of turns. Each adds the worst triangle's normal: the perceptron's rule, which ends if
    /// a solution exists.
    const MOST_TURNS: usize = 100;
    let mut normals = vec![Vec3::ZERO; mesh.points.len()];
    let mut around: Vec<Vec<Vec3>> = vec![Vec::new(); mesh.points.len()];
    for (face, t) in mesh.triangles.iter().enumerate() {
        let area_vector = mesh.double_area_vector(face);
        for &v in t {
            normals[v as usize] += area_vector;
            around[v as usize].extend(area_vector.try_normalize());
        }
    }
    let turned = |(mean, around): (Vec3, Vec<Vec3>)| {
        let mut normal = mean.normalize_or(Vec3::Z);
        for _ in 0..MOST_TURNS {
            let worst = around
                .iter()
                .min_by(|a, b| a.dot(normal).total_cmp(&b.dot(normal)));
            let Some(worst) = worst.filter(|w| w.dot(normal) < 1.5 * LEAST_COSINE) else {
                break;
            };
            normal = (normal + 0.2 * *worst).normalize_or(normal);
        }
        normal
    };
    normals.into_iter().zip(around).map(turned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A leaf without thickness stays folded at all its points, so every round shrinks it.
    #[test]
    fn relaxing_a_limb_that_stays_folded_leaves_triangles_that_can_be_computed_with() {
        const ROWS: u32 = 20;
        let at = |row: u32| [-1.0, 1.0].map(|x| Vec3::new(x, 0.0, f64::from(row)));
        let front = |row: u32| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| 2 * row + k);
            [[a, b, d], [a, d, c]]
        };
        let front: Vec<[u32; 3]> = (0..ROWS).flat_map(front).collect();
        let back = front.iter().map(|&[a, b, c]| [a, c, b]);
        let leaf = TriMesh {
            points: (0..=ROWS).flat_map(at).collect(),
            triangles: front.iter().copied().chain(back).collect(),
        };
        let relaxed = relax_folds(leaf.clone());
        assert!(relaxed.points != leaf.points, "the leaf is folded");
        let least_mm2 = |mesh: &TriMesh| {
            let areas = (0..mesh.triangles.len()).map(|f| mesh.face_area(f));
            areas.fold(f64::INFINITY, f64::min)
        };
        assert!(
            least_mm2(&relaxed) > 1e-6 * least_mm2(&leaf),
            "{}",
            least_mm2(&relaxed)
        );
    }
}
