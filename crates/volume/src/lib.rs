//! The volume-based metric (Sect. 5.1): walls and connectors as tetrahedra, linear elasticity, contact
//! without friction.
//!
//! Work that no plan changes is done once, by [`VolumeModel::new`]: the wall of every part, its stiffness,
//! and the condensation onto the points near the part's seams. [`VolumeModel::resist`] attaches a plan's pins
//! and channels (`connector`) to those points. A part's bars and wall are condensed to what the contacts see,
//! and the contact problem is solved in these few unknowns (`contact`). Rigid motions are kept apart, so that
//! parts that come off are found exactly (`mechanism`).
//!
//! Deviations from the paper: contact is exact instead of by penalty, between pairs of nodes that start at
//! the same place; displacements are small. Limits: no friction, no gap; overlapping walls of a thin
//! model are each modelled whole. The floor of the channel is one-sided, and so are the walls' faces,
//! which touch at mid-wall; the channel's other faces hold in both directions.

mod bars;
pub mod compare;
mod connector;
mod contact;
mod element;
mod front;
mod load;
mod mechanism;
mod part;
mod rows;
mod stress;
#[cfg(test)]
mod tests;
mod unknowns;
mod wall;

use connector::{Bar, Section, Sections, Spans};
use contact::{Equilibrium, Response};
pub use element::Order;
use front::Front;
pub use load::Loaded;
use part::Part;
use rayon::prelude::*;
use rows::WALL;
use shellock_geom::Vec3;
use shellock_geom::sparse::SparseError;
use shellock_mechanics::{Material, Meeting, Opening, Resistance, ShellAssembly, Side, Station};
use unknowns::{Labels, ROWS};
pub use wall::{MIN_VOLUME_SHARE, Wall};

/// Parameters of the model of walls and connectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeParams {
    /// Wall thickness, mm. (0, 20]; 2.0, as in the printed parts.
    pub wall_mm: f64,
    /// Number of layers of prisms across the wall. [1, 8]; 1, which is enough for quadratic elements.
    pub n_layers: usize,
    /// Degree of the wall elements. Quadratic: a plan costs the same, and linear elements are several times
    /// too stiff.
    pub order: Order,
    /// Material of all the parts. Default: the paper's resin.
    pub material: Material,
    /// Separation force on each seam, N/mm. (0, 1000]; 0.01, the paper's 10 N/m. Openings are proportional to
    /// it.
    pub force_n_per_mm: f64,
    /// Greatest pull or overlap at a contact that counts as zero, relative to the largest. [10⁻¹², 10⁻²];
    /// 10⁻⁶.
    pub tolerance: f64,
}

impl Default for VolumeParams {
    fn default() -> Self {
        Self {
            wall_mm: 2.0,
            n_layers: 1,
            order: Order::Quadratic,
            material: Material::SLA_RESIN,
            force_n_per_mm: 0.01,
            tolerance: 1e-6,
        }
    }
}

impl VolumeParams {
    /// Returns all problems of the parameters at once.
    pub fn problems(&self) -> Vec<String> {
        let m = &self.material;
        let checks = [
            (
                "wall_mm",
                self.wall_mm,
                0.0 < self.wall_mm && self.wall_mm <= 20.0,
                "(0, 20]",
            ),
            (
                "n_layers",
                self.n_layers as f64,
                (1..=8).contains(&self.n_layers),
                "[1, 8]",
            ),
            (
                "force_n_per_mm",
                self.force_n_per_mm,
                0.0 < self.force_n_per_mm && self.force_n_per_mm <= 1e3,
                "(0, 1000]",
            ),
            (
                "tolerance",
                self.tolerance,
                (1e-12..=1e-2).contains(&self.tolerance),
                "[1e-12, 0.01]",
            ),
            (
                "youngs_modulus_mpa",
                m.youngs_modulus_mpa,
                0.0 < m.youngs_modulus_mpa && m.youngs_modulus_mpa <= 1e6,
                "(0, 1e6]",
            ),
            (
                "poissons_ratio",
                m.poissons_ratio,
                (0.0..=0.45).contains(&m.poissons_ratio),
                "[0, 0.45]",
            ),
        ];
        let wrong = checks.into_iter().filter(|(_, _, is_right, _)| !is_right);
        wrong
            .map(|(name, value, _, range)| format!("{name} is {value}: must be in {range}"))
            .collect()
    }
}

/// Reasons why the metric could not be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VolumeError {
    /// Some parameters are out of range.
    #[error("{}", .0.join("; "))]
    Params(Vec<String>),
    /// The assembly refers to a point, part or station that does not exist, or has a number that is not
    /// finite.
    #[error("the assembly is inconsistent: {0}")]
    Assembly(&'static str),
    /// No wall fits below a triangle, however thin, and it cannot be left out.
    #[error("triangle {0} has no area, or its normals point along it: remesh the surface")]
    FlatTriangle(u32),
    /// The number of joints differs from the number of stations.
    #[error("{joints} joints for {stations} stations")]
    Joints {
        /// Number of joints that were given.
        joints: usize,
        /// Number of joints that are needed.
        stations: usize,
    },
    /// The fixed part does not exist.
    #[error("part {0} is to be fixed, but there is none of that number")]
    NoSuchPart(u32),
    /// A stiffness matrix could not be factorised.
    #[error(transparent)]
    Factorisation(#[from] SparseError),
    /// The number of forces differs from the number of points, or a force is not finite.
    #[error("{forces} forces for {points} points, or one of them is not finite")]
    Forces {
        /// Number of forces that were given.
        forces: usize,
        /// Number of forces that are needed.
        points: usize,
    },
    /// No set of contacts was found that neither pull nor overlap.
    #[error("the contact problem does not converge")]
    Contact,
}

/// Displacements at the joints in static equilibrium, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Deflection {
    /// Displacements of sides a and b at each station, each at the root and at the tip of the pin; zero where
    /// there is no joint.
    pub displacement_mm: Vec<[[Vec3; 2]; 2]>,
}

/// Plan-independent data: the walls, and the part of them that connectors see.
#[derive(Debug)]
pub struct VolumeModel {
    params: VolumeParams,
    stations: Vec<Station>,
    steps: Vec<[u32; 2]>,
    part_of_point: Vec<u32>,
    /// True for points whose wall below is held.
    is_clamped: Vec<bool>,
    /// Parts on the two sides of each station.
    station_parts: Vec<[u32; 2]>,
    /// Points on the inner surface below each station's two sides.
    inner_edge: Vec<[Vec3; 2]>,
    wall: Wall,
    /// Tetrahedra around each station's two sides.
    near: Vec<[Vec<u32>; 2]>,
    parts: Vec<Part>,
    /// Index of each wall node among its part's kept nodes.
    kept_index: Vec<Option<u32>>,
}

impl VolumeModel {
    /// Builds and condenses the walls; takes about a second for 18 000 tetrahedra.
    pub fn new(params: &VolumeParams, assembly: &ShellAssembly) -> Result<Self, VolumeError> {
        Self::with_clamp(params, assembly, &[])
    }

    /// Builds the model with the wall below the points `clamped` held in place.
    pub fn with_clamp(
        params: &VolumeParams,
        assembly: &ShellAssembly,
        clamped: &[u32],
    ) -> Result<Self, VolumeError> {
        let problems = params.problems();
        if !problems.is_empty() {
            return Err(VolumeError::Params(problems));
        }
        check(assembly, clamped)?;
        let wall = Wall::new(assembly, params.wall_mm, params.n_layers)
            .map_err(|flat| VolumeError::FlatTriangle(flat.0))?;

        let n_points = assembly.points.len();
        let mut is_clamped = vec![false; n_points];
        for &point in clamped {
            is_clamped[point as usize] = true;
        }
        let near = near_stations(assembly, &wall);
        let mut is_kept = vec![false; wall.nodes.len()];
        for &tet in near.iter().flatten().flatten() {
            for node in wall.tets[tet as usize] {
                is_kept[node as usize] = !is_clamped[node as usize % n_points];
            }
        }
        let part_of = |node: u32| assembly.part_of_point[node as usize % n_points];
        let parts: Vec<Part> = (0..assembly.n_parts as u32)
            .into_par_iter()
            .map(|part| {
                let tets: Vec<[u32; 4]> = wall
                    .tets
                    .iter()
                    .copied()
                    .filter(|t| part_of(t[0]) == part)
                    .collect();
                let kept =
                    (0..wall.nodes.len() as u32).filter(|v| is_kept[*v as usize] && part_of(*v) == part);
                let clamp = |node: u32| is_clamped[node as usize % n_points];
                Part::new(
                    params.order,
                    &params.material,
                    &wall,
                    &tets,
                    kept.collect(),
                    clamp,
                )
            })
            .collect::<Result<_, _>>()?;
        let mut kept_index = vec![None; wall.nodes.len()];
        for part in &parts {
            for (place, &node) in (0..).zip(&part.seam_nodes) {
                kept_index[node as usize] = Some(place);
            }
        }
        let below =
            |p: u32| assembly.points[p as usize] - assembly.normals[p as usize] * wall.depth_mm[p as usize];
        Ok(Self {
            params: *params,
            stations: assembly.stations.clone(),
            steps: assembly.steps.clone(),
            station_parts: assembly.stations.iter().map(|s| s.points.map(&part_of)).collect(),
            inner_edge: assembly.stations.iter().map(|s| s.points.map(below)).collect(),
            part_of_point: assembly.part_of_point.clone(),
            is_clamped,
            near,
            parts,
            kept_index,
            wall,
        })
    }

    /// Number of tetrahedra of all walls.
    pub fn n_tets(&self) -> usize {
        self.wall.tets.len()
    }

    /// Walls of all the parts.
    pub fn wall(&self) -> &Wall {
        &self.wall
    }

    /// Solves for the openings of the seams when `plan` joins the stations and `fixed_part` is held, or for
    /// the parts that come off. An opening is the larger of the distances between male and female at the root
    /// and at the tip of the pin.
    ///
    /// May be called from several threads at once.
    pub fn resist(&self, plan: &[Meeting], fixed_part: u32) -> Result<Resistance, VolumeError> {
        if fixed_part as usize >= self.parts.len() {
            return Err(VolumeError::NoSuchPart(fixed_part));
        }
        Ok(match self.equilibrium(plan, Some(fixed_part))? {
            Ok(deflection) => {
                let widest = |[a, b]: &[[Vec3; 2]; 2]| a[0].distance(b[0]).max(a[1].distance(b[1]));
                let openings = deflection.displacement_mm.iter().map(widest).collect();
                Opening::rate(plan, openings).resistance(plan, |station| {
                    self.station_parts[station]
                        .into_iter()
                        .filter(|part| *part != fixed_part)
                })
            }
            Err(parts) => Resistance::Separable(parts),
        })
    }

    /// Displacements of the parts when `fixed_part`, or only the clamped points, are held; or the parts that
    /// come off.
    pub fn equilibrium(
        &self,
        plan: &[Meeting],
        fixed_part: Option<u32>,
    ) -> Result<Result<Deflection, Vec<u32>>, VolumeError> {
        if plan.len() != self.stations.len() {
            return Err(VolumeError::Joints {
                joints: plan.len(),
                stations: self.stations.len(),
            });
        }
        let sections = bars::sections(self, plan);
        let bars = bars::bars(self, plan, &sections);
        let is_free = |i: usize| self.parts[i].rigid.is_some() && Some(i as u32) != fixed_part;
        let n_motions = 6 * (0..self.parts.len()).filter(|i| is_free(*i)).count();
        let mut responses = (0..self.parts.len())
            .into_par_iter()
            .map(|i| self.response(i as u32, Some(i as u32) == fixed_part, plan, &sections, &bars))
            .collect::<Result<Vec<_>, _>>()?;
        let free = (0..self.parts.len()).filter(|i| is_free(*i));
        for (i, first) in free.zip((0..).step_by(6)) {
            responses[i].first_motion = Some(first);
        }

        let laws = rows::laws(plan);
        let loose = mechanism::loose_parts(&responses, &laws, n_motions);
        if !loose.is_empty() {
            return Ok(Err(loose));
        }
        let equilibrium = contact::solve(&responses, &laws, n_motions, self.params.tolerance)?
            .ok_or(VolumeError::Contact)?;

        Ok(Ok(self.deflection(&responses, &equilibrium, &sections)))
    }

    /// Displacements at the joints, from those along the contact rows.
    fn deflection(
        &self,
        responses: &[Response],
        equilibrium: &Equilibrium,
        sections: &Sections,
    ) -> Deflection {
        let mut displacement_mm = vec![[[Vec3::ZERO; 2]; 2]; sections.len()];
        for (part, response) in (0..).zip(responses) {
            for (&row, moved) in response.rows.iter().zip(response.displacement_mm(equilibrium)) {
                let (station, row) = (row / ROWS, row % ROWS);
                let side = if self.station_parts[station][0] == part {
                    Side::A
                } else {
                    Side::B
                };
                let Some(section) = &sections[station][side.index()] else {
                    continue;
                };
                for (own, direction, _) in section.rows() {
                    if own == row {
                        displacement_mm[station][side.index()][own / 3] += direction * moved;
                    }
                }
            }
        }
        Deflection { displacement_mm }
    }

    fn response(
        &self,
        part: u32,
        is_fixed: bool,
        plan: &[Meeting],
        sections: &Sections,
        bars: &[Bar],
    ) -> Result<Response, SparseError> {
        let labels = self.labels(part);
        let (own, spans, mut fronts) = self.bar_fronts(part, sections, bars, labels);
        if is_fixed {
            fronts = fronts
                .iter()
                .map(|front| front.without(|id| labels.is_wall(id)))
                .collect();
        }
        let mut fronts = connector::condense(&fronts, &own, labels, &spans)?;
        if !is_fixed {
            fronts.extend(self.wall_fronts(part, plan, labels));
        }
        let wall = (!is_fixed).then_some(&self.parts[part as usize].stiffness);
        let all: Vec<&Front> = wall.into_iter().chain(&fronts).collect();
        Ok(self.read(
            part,
            &Front::condense(&all, |id| labels.is_inner(id))?,
            labels,
            plan,
            sections,
        ))
    }

    fn labels(&self, part: u32) -> Labels {
        Labels::new(
            3 * self.parts[part as usize].seam_nodes.len(),
            self.stations.len(),
        )
    }

    /// Bars of `part`, the range of them that meets at each section, and the front of each bar.
    fn bar_fronts<'a>(
        &self,
        part: u32,
        sections: &Sections,
        bars: &'a [Bar],
        labels: Labels,
    ) -> (Vec<&'a Bar>, Spans, Vec<Front>) {
        let is_own = |bar: &&Bar| self.station_parts[bar.from][bar.side.index()] == part;
        let own: Vec<&Bar> = bars.iter().filter(is_own).collect();
        let spans = bars::spans(&own, self.stations.len());
        let front = |(i, bar): (usize, &&Bar)| {
            let carries = |station: usize| spans[station][bar.side.index()].is_some_and(|span| span[0] == i);
            bar.front(self, sections, carries, labels)
        };
        let fronts = own.iter().enumerate().map(front).collect();
        (own, spans, fronts)
    }

    /// Reads compliance and drift from the condensed front of a part: its contact rows, and its load, if it
    /// has one.
    fn read(
        &self,
        part: u32,
        left: &Front,
        labels: Labels,
        plan: &[Meeting],
        sections: &Sections,
    ) -> Response {
        let n = left.ids.len();
        let n_rows = left.ids.partition_point(|id| *id < labels.load());
        let rows: Vec<usize> = left.ids[..n_rows].iter().map(|id| labels.row_of(*id)).collect();
        let mut response = Response {
            compliance: (0..n_rows)
                .flat_map(|j| left.values[n * j..n * j + n_rows].iter().map(|v| -v))
                .collect(),
            drift_mm: (0..n_rows)
                .map(|j| {
                    if n_rows < n {
                        -left.values[n_rows + n * j]
                    } else {
                        0.0
                    }
                })
                .collect(),
            rigid: vec![[0.0; 6]; n_rows],
            rows,
            ..Response::default()
        };
        let Some(rigid) = self.parts[part as usize].rigid else {
            return response;
        };
        let mut see = |station: usize, row: usize, direction: Vec3, place: Vec3| {
            let Ok(at) = response.rows.binary_search(&(station * ROWS + row)) else {
                return;
            };
            let moved = rigid.at(place).map(|v| v.dot(direction));
            (0..6).for_each(|m| response.rigid[at][m] += moved[m]);
        };
        for (station, side) in self.sides_of_part(part) {
            see(
                station,
                WALL,
                rows::off_the_wall(&plan[station], side),
                self.mid_wall(station, side),
            );
            for (row, direction, place) in sections[station][side.index()].iter().flat_map(Section::rows) {
                see(station, row, direction, place);
            }
        }
        for (station, side) in self.sides_of_part(part) {
            let Some(section) = &sections[station][side.index()] else {
                continue;
            };
            // A station without rows is in no bar and has no connector.
            if response.rows.binary_search(&(station * ROWS)).is_ok() {
                let (force, places) = section.load();
                for place in places {
                    let work = rigid.at(place).map(|v| v.dot(force) / 4.0);
                    (0..6).for_each(|m| response.rigid_load_n[m] += work[m]);
                }
            }
        }
        response
    }

    /// Weights of wall nodes that move a point of a connector with the wall of its side.
    fn hold(&self, station: usize, side: Side, x: Vec3) -> Vec<(u32, f64)> {
        let tets = self.near[station][side.index()].iter().map(|&t| {
            let t = t as usize;
            (self.wall.tets[t], self.wall.corners(t))
        });
        let weights = connector::interpolation(tets, x).into_iter();
        weights
            .filter_map(|(node, w)| Some((self.kept_index[node as usize]?, w)))
            .collect()
    }
}

fn check(assembly: &ShellAssembly, clamped: &[u32]) -> Result<(), VolumeError> {
    let n = assembly.points.len();
    let has = |p: &u32| (*p as usize) < n;
    let problem = if assembly.normals.len() != n || assembly.part_of_point.len() != n {
        "points, normals and parts of points differ in number"
    } else if !assembly
        .points
        .iter()
        .chain(&assembly.normals)
        .all(|p| p.is_finite())
    {
        "a point or normal is not finite"
    } else if !assembly
        .part_of_point
        .iter()
        .all(|p| (*p as usize) < assembly.n_parts)
    {
        "a point has a part that there is not"
    } else if !(assembly.triangles.iter().flatten().chain(clamped)).all(has) {
        "a triangle or clamp names a point that there is not"
    } else if !assembly.triangles.iter().all(|t| {
        let part = |i: usize| assembly.part_of_point[t[i] as usize];
        part(0) == part(1) && part(0) == part(2)
    }) {
        "a triangle has points of several parts"
    } else if !assembly.stations.iter().flat_map(|s| &s.points).all(has) {
        "a station names a point that there is not"
    } else if !assembly
        .steps
        .iter()
        .flatten()
        .all(|s| (*s as usize) < assembly.stations.len())
    {
        "a step names a station that there is not"
    } else {
        return Ok(());
    };
    Err(VolumeError::Assembly(problem))
}

/// Tetrahedra below the triangles around each station's points.
fn near_stations(assembly: &ShellAssembly, wall: &Wall) -> Vec<[Vec<u32>; 2]> {
    let mut about: Vec<Vec<u32>> = vec![Vec::new(); assembly.points.len()];
    for (i, t) in (0..).zip(&assembly.triangles) {
        for point in t {
            about[*point as usize].push(i);
        }
    }
    let below = |point: u32| {
        let triangles = about[point as usize].iter();
        triangles.flat_map(|t| wall.tets_below(*t)).collect()
    };
    assembly.stations.iter().map(|s| s.points.map(below)).collect()
}
