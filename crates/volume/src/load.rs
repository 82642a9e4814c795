//! External loads: openings of the seams, and stresses in walls and connectors.
//!
//! Each part with its connectors is one sparse system `K u = f + Jᵀ λ`, where J are its contact rows. A free
//! part is held at six unknowns; these supports suffice and carry no force, since all forces on the part
//! balance in the end. Solving for each row and for the load gives the compliance and drift that `contact`
//! needs. With the contact forces, it gives the stresses.
//! asks for; with the contact's forces, the stresses.
//!
//! Clamped points carry the load. If nothing is clamped, as in a fall, the forces accelerate the whole as a
//! rigid body, and the inertia of the walls balances them (inertia relief). Connectors have no mass.

use std::collections::BTreeMap;

use rayon::prelude::*;
use shellock_geom::Vec3;
use shellock_geom::sparse::{Cholesky, SparseError, SparseSymmetric};
use shellock_mechanics::assembly::is_lost;
use shellock_mechanics::{Meeting, StressLevel, StressSample};

use super::bars;
use super::connector::{self, Bar, Sections};
use super::contact::{self, Equilibrium, Response};
use super::element::volume_6;
use super::front::Front;
use super::part::{Numbering, RigidModes, assemble};
use super::rows::{self, WALL};
use super::stress::samples;
use super::unknowns::{Labels, ROWS};
use super::{VolumeError, VolumeModel, mechanism};

/// Conversion from g/cm³ to t/mm³, so that t · mm/s² = N.
const T_MM3_PER_G_CM3: f64 = 1e-9;

/// Response of an assembly to external loads.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// Opening of each station, mm: the larger distance between male and female at the root and at the tip of
    /// the pin. Where there is no joint, the distance between the walls' faces.
    pub opening_mm: Vec<f64>,
    /// Joints (ascending) whose pins have left their channels.
    pub lost: Vec<u32>,
    /// Stress in the walls of all parts.
    pub walls: StressLevel,
    /// Stress in pins and channels.
    pub connectors: StressLevel,
    /// Largest stress in the wall below each triangle, MPa.
    pub triangle_mpa: Vec<f64>,
    /// Unbalanced forces and torques on the parts' six rigid motions, N, relative to the largest force:
    /// rounding errors.
    pub imbalance: f64,
}

impl VolumeModel {
    /// Total mass of all walls, t.
    pub fn mass_t(&self) -> f64 {
        self.node_masses_t().iter().sum()
    }

    /// Node masses: a quarter of each tetrahedron's mass at each of its corners.
    fn node_masses_t(&self) -> Vec<f64> {
        let mut mass_t = vec![0.0; self.wall.nodes.len()];
        let density_t_mm3 = self.params.material.density_g_cm3 * T_MM3_PER_G_CM3;
        for (i, tet) in self.wall.tets.iter().enumerate() {
            let share = density_t_mm3 * volume_6(self.wall.corners(i)) / 24.0;
            tet.iter().for_each(|&node| mass_t[node as usize] += share);
        }
        mass_t
    }

    /// Solves for the response of the parts joined by `plan` to `forces_n`, one at each point of the outer
    /// surface; or for the parts that come off.
    ///
    /// Clamped points carry the forces; if there are none, the walls' inertia does. The separation force does
    /// not act.
    pub fn under_load(
        &self,
        plan: &[Meeting],
        forces_n: &[Vec3],
    ) -> Result<Result<Loaded, Vec<u32>>, VolumeError> {
        let mut all = self.under_loads(plan, &[forces_n.to_vec()])?;
        Ok(all.remove(0))
    }

    /// Solves for each of `loads_n` separately, like [`under_load`](Self::under_load), but faster.
    pub fn under_loads(
        &self,
        plan: &[Meeting],
        loads_n: &[Vec<Vec3>],
    ) -> Result<Vec<Result<Loaded, Vec<u32>>>, VolumeError> {
        if plan.len() != self.stations.len() {
            return Err(VolumeError::Joints {
                joints: plan.len(),
                stations: self.stations.len(),
            });
        }
        let n_points = self.part_of_point.len();
        if let Some(wrong) =
            (loads_n.iter()).find(|f| f.len() != n_points || !f.iter().all(|f| f.is_finite()))
        {
            return Err(VolumeError::Forces {
                forces: wrong.len(),
                points: n_points,
            });
        }
        let sections = bars::sections(self, plan);
        let bars = bars::bars(self, plan, &sections);
        let mut bodies: Vec<Body> = (0..self.parts.len() as u32)
            .into_par_iter()
            .map(|part| Body::new(self, part, plan, &sections, &bars))
            .collect::<Result<Vec<_>, _>>()?;
        loads_n
            .iter()
            .map(|forces_n| self.apply_load(plan, &sections, &mut bodies, forces_n))
            .collect()
    }

    fn apply_load(
        &self,
        plan: &[Meeting],
        sections: &Sections,
        bodies: &mut [Body<'_>],
        forces_n: &[Vec3],
    ) -> Result<Result<Loaded, Vec<u32>>, VolumeError> {
        let balanced_n = self.balance_forces(forces_n)?;
        let mut responses: Vec<Response> = bodies
            .par_iter_mut()
            .map(|body| body.load(self, plan, sections, &balanced_n))
            .collect();
        // If all parts float, the first one is the reference frame of the others; its forces balance with the
        // whole's.
        let n_motions = number_motions(&mut responses, |i| {
            self.parts[i].rigid.is_some() && (i > 0 || self.is_held())
        });
        let laws = rows::laws(plan);
        let Some(equilibrium) = contact::solve(&responses, &laws, n_motions, self.params.tolerance)? else {
            let loose = mechanism::loose_parts(&responses, &laws, n_motions);
            return if loose.is_empty() {
                Err(VolumeError::Contact)
            } else {
                Ok(Err(loose))
            };
        };
        bodies.par_iter_mut().for_each(|body| body.move_by(&equilibrium));
        let opening_mm = self.openings(plan, &responses, &equilibrium, sections);
        let (triangle_mpa, walls) = self.wall_stress(bodies);
        let connectors: Vec<StressSample> = bodies
            .par_iter()
            .flat_map_iter(|b| b.bar_samples(self, sections))
            .collect();
        Ok(Ok(Loaded {
            lost: (0..)
                .zip(plan)
                .filter(|(i, m)| is_lost(m, opening_mm[*i as usize]))
                .map(|(i, _)| i)
                .collect(),
            walls,
            connectors: StressLevel::of(connectors),
            triangle_mpa,
            imbalance: imbalance(&responses, &equilibrium, forces_n),
            opening_mm,
        }))
    }

    fn is_held(&self) -> bool {
        self.is_clamped.iter().any(|is| *is)
    }

    /// Forces at the wall nodes, plus inertia forces if nothing holds the assembly.
    pub(super) fn balance_forces(&self, forces_n: &[Vec3]) -> Result<Vec<Vec3>, SparseError> {
        let nodes = &self.wall.nodes;
        let mut loads_n = forces_n.to_vec();
        loads_n.resize(nodes.len(), Vec3::ZERO);
        if self.is_held() {
            return Ok(loads_n);
        }
        let rigid = RigidModes::new(nodes);
        let mass_t = self.node_masses_t();
        let mut inertia = nalgebra::SMatrix::<f64, 6, 6>::zeros();
        let mut work = nalgebra::SVector::<f64, 6>::zeros();
        for ((x, m), f) in nodes.iter().zip(&mass_t).zip(&loads_n) {
            let modes = rigid.at(*x);
            for a in 0..6 {
                work[a] += modes[a].dot(*f);
                (0..6).for_each(|b| inertia[(a, b)] += m * modes[a].dot(modes[b]));
            }
        }
        let inverse = inertia
            .try_inverse()
            .ok_or(SparseError::NotPositiveDefinite { n: 6 })?;
        let acceleration = inverse * work;
        for ((x, m), f) in nodes.iter().zip(&mass_t).zip(&mut loads_n) {
            rigid
                .at(*x)
                .iter()
                .zip(acceleration.iter())
                .for_each(|(mode, a)| *f -= *mode * (m * a));
        }
        Ok(loads_n)
    }

    fn openings(
        &self,
        plan: &[Meeting],
        responses: &[Response],
        equilibrium: &Equilibrium,
        sections: &Sections,
    ) -> Vec<f64> {
        let mut gap_mm = vec![0.0; plan.len()];
        for response in responses {
            for (&row, moved) in response.rows.iter().zip(response.displacement_mm(equilibrium)) {
                if row % ROWS == WALL {
                    gap_mm[row / ROWS] += moved;
                }
            }
        }
        let moved = self.deflection(responses, equilibrium, sections).displacement_mm;
        let opening = |((meeting, [a, b]), gap): ((&Meeting, [[Vec3; 2]; 2]), f64)| match meeting.joint {
            Some(_) => a[0].distance(b[0]).max(a[1].distance(b[1])),
            None => gap.max(0.0),
        };
        plan.iter().zip(moved).zip(gap_mm).map(opening).collect()
    }

    /// Largest stress below each triangle, and the stress level of all walls.
    fn wall_stress(&self, bodies: &[Body]) -> (Vec<f64>, StressLevel) {
        let samples: Vec<(u32, [StressSample; 4])> = bodies
            .par_iter()
            .flat_map_iter(|b| b.wall_samples(self))
            .collect();
        let mut largest = vec![0.0_f64; self.wall.tets.len() / (3 * self.params.n_layers)];
        for (tet, corners) in &samples {
            let triangle = &mut largest[*tet as usize / (3 * self.params.n_layers)];
            *triangle = corners.iter().map(|s| s.stress_mpa).fold(*triangle, f64::max);
        }
        (
            largest,
            StressLevel::of(samples.into_iter().flat_map(|s| s.1).collect()),
        )
    }
}

/// Numbers the motions of the free parts and returns their count.
fn number_motions(responses: &mut [Response], is_free: impl Fn(usize) -> bool) -> usize {
    let mut n_motions = 0;
    for (_, response) in responses.iter_mut().enumerate().filter(|(i, _)| is_free(*i)) {
        response.first_motion = Some(n_motions);
        n_motions += 6;
    }
    n_motions
}

/// Unbalanced contact and load forces on the rigid motions of the free parts, relative to the largest force.
fn imbalance(responses: &[Response], equilibrium: &Equilibrium, forces_n: &[Vec3]) -> f64 {
    let largest_n = forces_n
        .iter()
        .map(|f| f.length())
        .fold(f64::MIN_POSITIVE, f64::max);
    let mut worst = 0.0_f64;
    for response in responses.iter().filter(|r| r.first_motion.is_some()) {
        for m in 0..6 {
            let by_contact = response
                .rows
                .iter()
                .zip(&response.rigid)
                .map(|(row, r)| equilibrium.force_n[*row] * r[m]);
            worst = worst.max((by_contact.sum::<f64>() + response.rigid_load_n[m]).abs());
        }
    }
    worst / largest_n
}

/// One part with its connectors.
pub(super) struct Body<'a> {
    part: u32,
    /// Tetrahedra of the part's wall.
    tets: Vec<u32>,
    numbering: Numbering,
    bars: Vec<&'a Bar>,
    labels: Labels,
    /// Labels of the bars' own unknowns, ascending; they come after the wall's.
    own: Vec<u32>,
    /// Wall nodes that the labels number.
    seam_nodes: &'a [u32],
    stiffness: Cholesky,
    is_pinned: Vec<bool>,
    /// Unknowns that each contact row acts on, with their weights.
    rows: BTreeMap<u32, Vec<(u32, f64)>>,
    /// Front as the contacts see it: minus the displacement along each row by each row's force and, last, by
    /// the load.
    front: Front,
    /// Force on each unknown, N.
    load_n: Vec<f64>,
    /// Displacement of each unknown, mm; for a free part, up to a rigid motion.
    moved_mm: Vec<f64>,
}

/// Entries of a stiffness matrix: row, column, N/mm.
type Entries = Vec<(u32, u32, f64)>;

impl<'a> Body<'a> {
    /// Builds the part without load.
    pub fn new(
        model: &'a VolumeModel,
        part: u32,
        plan: &[Meeting],
        sections: &Sections,
        bars: &'a [Bar],
    ) -> Result<Self, SparseError> {
        let (order, material) = (model.params.order, &model.params.material);
        let n_points = model.part_of_point.len();
        let is_own =
            |tet: &u32| model.part_of_point[model.wall.tets[*tet as usize][0] as usize % n_points] == part;
        let tets: Vec<u32> = (0..model.wall.tets.len() as u32).filter(is_own).collect();
        let corners: Vec<[u32; 4]> = tets.iter().map(|tet| model.wall.tets[*tet as usize]).collect();
        let numbering = Numbering::new(order, &corners, &[], &|node| {
            model.is_clamped[node as usize % n_points]
        });
        let mut entries = assemble(order, material, &model.wall, &corners, &numbering);

        let labels = model.labels(part);
        let (bars, _, mut fronts) = model.bar_fronts(part, sections, bars, labels);
        let mut own: Vec<u32> = fronts
            .iter()
            .flat_map(|f| &f.ids)
            .copied()
            .filter(|id| *id > labels.load())
            .collect();
        own.sort_unstable();
        own.dedup();
        fronts.extend(model.wall_fronts(part, plan, labels));
        let n = numbering.n + own.len();
        let load_n = vec![0.0; n];
        let seam_nodes = &model.parts[part as usize].seam_nodes;
        let rows = BTreeMap::new();
        let (is_pinned, moved_mm) = (vec![false; n], Vec::new());
        let stiffness = Cholesky::new(&SparseSymmetric::from_entries(0, Vec::new()))?;
        let mut body = Self {
            part,
            front: Front::default(),
            tets,
            numbering,
            bars,
            labels,
            own,
            seam_nodes,
            stiffness,
            is_pinned,
            rows,
            load_n,
            moved_mm,
        };
        body.add_fronts(&fronts, &mut entries);
        if model.parts[part as usize].rigid.is_some() {
            body.pin(model);
        }
        let is_pinned = &body.is_pinned;
        entries.retain(|(p, q, _)| p == q || !(is_pinned[*p as usize] || is_pinned[*q as usize]));
        body.stiffness = Cholesky::new(&SparseSymmetric::from_entries(n, entries))?;
        body.front = body.front();
        Ok(body)
    }

    /// Applies the forces at the wall nodes, and returns the response that the contacts see.
    pub fn load(
        &mut self,
        model: &VolumeModel,
        plan: &[Meeting],
        sections: &Sections,
        loads_n: &[Vec3],
    ) -> Response {
        self.load_n.fill(0.0);
        for (node, first) in self.numbering.vertices.iter().zip(&self.numbering.first) {
            let Some(first) = first else { continue };
            self.load_n[*first as usize..][..3].copy_from_slice(&loads_n[*node as usize].to_array());
        }
        let mut side = self.load_n.clone();
        self.release_pins(&mut side);
        self.stiffness.solve_in_place(&mut side);
        // The load is the last row of the front.
        let m = self.front.ids.len();
        for (j, row) in self.rows.values().enumerate() {
            let along: f64 = row.iter().map(|(of, value)| side[*of as usize] * value).sum();
            self.front.values[m - 1 + m * j] = -along;
        }
        let mut response = model.read(self.part, &self.front, self.labels, plan, sections);
        response.rigid_load_n = [0.0; 6];
        if let Some(rigid) = model.parts[self.part as usize].rigid {
            for node in &self.numbering.vertices {
                let modes = rigid.at(model.wall.nodes[*node as usize]);
                (0..6).for_each(|m| response.rigid_load_n[m] += modes[m].dot(loads_n[*node as usize]));
            }
        }
        response
    }

    /// Unknown of a label; `None` for contact rows and the load.
    fn unknown(&self, id: u32) -> Option<u32> {
        if self.labels.is_wall(id) {
            let at = self
                .numbering
                .vertices
                .binary_search(&self.seam_nodes[id as usize / 3])
                .ok()?;
            return self.numbering.first[at].map(|first| first + id % 3);
        }
        self.own
            .binary_search(&id)
            .ok()
            .map(|at| (self.numbering.n + at) as u32)
    }

    /// Adds stiffness to `entries`, and records the contact rows.
    fn add_fronts(&mut self, fronts: &[Front], entries: &mut Entries) {
        for front in fronts {
            let n = front.ids.len();
            let unknowns: Vec<Option<u32>> = front.ids.iter().map(|id| self.unknown(*id)).collect();
            for j in 0..n {
                for i in j..n {
                    let value = front.values[i + n * j];
                    let (row, of) = match (unknowns[i], unknowns[j]) {
                        (Some(p), Some(q)) => {
                            entries.push((p, q, value));
                            continue;
                        }
                        (None, Some(of)) => (front.ids[i], of),
                        (Some(of), None) => (front.ids[j], of),
                        (None, None) => continue,
                    };
                    // Most entries of a row are zero, and the separation force does not act.
                    if value != 0.0 && row != self.labels.load() {
                        self.rows.entry(row).or_default().push((of, value));
                    }
                }
            }
        }
    }

    /// Holds six unknowns of the wall that leave it no rigid motion: each time the one that moves farthest.
    fn pin(&mut self, model: &VolumeModel) {
        let points: Vec<Vec3> = self
            .numbering
            .vertices
            .iter()
            .map(|v| model.wall.nodes[*v as usize])
            .collect();
        let rigid = RigidModes::new(&points);
        let mut left: Vec<(u32, nalgebra::SVector<f64, 6>)> = Vec::new();
        for (point, first) in points.iter().zip(&self.numbering.first) {
            let modes = rigid.at(*point);
            let Some(first) = first else { continue };
            left.extend((0..3).map(|c| (first + c as u32, modes.map(|m| m[c]).into())));
        }
        for _ in 0..6 {
            let farthest = left
                .iter()
                .max_by(|a, b| a.1.norm_squared().total_cmp(&b.1.norm_squared()));
            let Some(&(unknown, motion)) = farthest else {
                return;
            };
            self.is_pinned[unknown as usize] = true;
            let along = motion.normalize();
            left.iter_mut()
                .for_each(|(_, motion)| *motion -= along * along.dot(motion));
        }
    }

    /// Minus the displacement along each row by each row's force, mm/N; the load's row is empty.
    fn front(&self) -> Front {
        let n = self.load_n.len();
        let m = self.rows.len() + 1;
        let mut sides = vec![0.0; n * (m - 1)];
        for (side, row) in sides.chunks_exact_mut(n.max(1)).zip(self.rows.values()) {
            row.iter().for_each(|(of, value)| side[*of as usize] += value);
            self.release_pins(side);
        }
        self.stiffness.solve_in_place(&mut sides);
        let mut values = vec![0.0; m * m];
        for (j, side) in sides.chunks_exact(n.max(1)).enumerate() {
            for (i, row) in self.rows.values().enumerate().skip(j) {
                let along: f64 = row.iter().map(|(of, value)| side[*of as usize] * value).sum();
                values[i + m * j] = -along;
            }
        }
        Front {
            ids: self.rows.keys().copied().chain([self.labels.load()]).collect(),
            values,
        }
    }

    fn release_pins(&self, side: &mut [f64]) {
        side.iter_mut()
            .zip(&self.is_pinned)
            .filter(|(_, is_pinned)| **is_pinned)
            .for_each(|(f, _)| *f = 0.0);
    }

    /// Displaces the part by the load and the contact forces.
    fn move_by(&mut self, equilibrium: &Equilibrium) {
        let mut side = self.load_n.clone();
        for (id, row) in &self.rows {
            let force_n = equilibrium.force_n[self.labels.row_of(*id)];
            row.iter()
                .for_each(|(of, value)| side[*of as usize] += force_n * value);
        }
        self.release_pins(&mut side);
        self.stiffness.solve_in_place(&mut side);
        self.moved_mm = side;
    }

    fn displacement_mm(&self, first: Option<u32>) -> Vec3 {
        let at = |first: u32| Vec3::from_slice(&self.moved_mm[first as usize..first as usize + 3]);
        first.map_or(Vec3::ZERO, at)
    }

    fn wall_samples<'b>(
        &'b self,
        model: &'b VolumeModel,
    ) -> impl Iterator<Item = (u32, [StressSample; 4])> + 'b {
        let order = model.params.order;
        self.tets.iter().map(move |&tet| {
            let unknowns = self.numbering.of_tet(order, &model.wall.tets[tet as usize]);
            let moved = unknowns.map(|first| self.displacement_mm(first));
            (
                tet,
                samples(
                    order,
                    model.wall.corners(tet as usize),
                    &model.params.material,
                    &moved,
                ),
            )
        })
    }

    fn bar_samples(&self, model: &VolumeModel, sections: &Sections) -> Vec<StressSample> {
        let mut all = Vec::new();
        for bar in &self.bars {
            let Some((ends, movers)) = bar.movers(sections, self.labels) else {
                continue;
            };
            for tet in &bar.tets {
                let moved = connector::with_middles(*tet).map(|node| {
                    let by =
                        |(first, weight): &(u32, f64)| self.displacement_mm(self.unknown(*first)) * *weight;
                    movers[node].iter().map(by).sum()
                });
                let corners = tet.map(|node| connector::corner(ends, node));
                all.extend(samples(
                    super::Order::Quadratic,
                    corners,
                    &model.params.material,
                    &moved,
                ));
            }
        }
        all
    }
}
