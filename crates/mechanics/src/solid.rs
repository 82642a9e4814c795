//! Finished pieces as printed: elastic bodies with gaps between them, contact and friction.
//!
//! The input is closed meshes, one a piece, in their assembled positions. Each piece has its own grid of
//! cubes. A cell counts the share that the piece fills (`voxels`, `element`), and is duplicated for each
//! connected part of the piece in it (`cells`). So neither gaps between pieces nor channels close up, however
//! coarse the cells are. Cells have quadratic displacements. Each piece's stiffness is factorised once
//! (`body`). Pieces can touch where their faces meet (`touch`), with the gap that the meshes have there, and
//! with Coulomb friction (`laws`, `equilibrium`).
//!
//! A load is applied in two steps. First, a hundredth of it takes up the play: pieces move until they touch
//! ([`Moved::settled_mm`]), with friction that counts slip from rest. Then the full load is applied, with
//! friction that counts slip from that state.
//!
//! Sources: finite cells of Parvizian, Düster, Rank 2007; virtual nodes of Molino, Bao, Fedkiw 2004; friction
//! by Haslinger's fixed point. Limits: static, linear material, small rotations. Contacts are found before
//! anything moves. Friction is that of the whole load at once. A piece's own faces do not touch each other.

mod body;
mod cells;
mod compliance;
mod element;
mod equilibrium;
mod laws;
mod stress;
#[cfg(test)]
mod tests;
mod touch;
mod voxels;

use rayon::prelude::*;
use shellock_geom::sparse::SparseError;
use shellock_geom::{Solid, Vec3};

pub use touch::Touch;

use crate::Material;
use crate::stress::StressLevel;
use body::{Body, Place};
use compliance::{Compliance, End, Seat};
use element::Elements;
use equilibrium::{Loads, Problem, State};
use laws::Contact;
use stress::Probe;

/// Share of the load that takes up the play, in the first step.
const SETTLING_SHARE: f64 = 0.01;
/// Displacement of an unrestrained piece under the whole load, mm. It sets the stiffness of the springs on
/// the pieces' frames, which take 0.2 % of the load where a piece has moved by 1 mm.
const ASTRAY_MM: f64 = 500.0;
/// Displacement from which a piece counts as stopped by nothing, mm.
const LOST_MM: f64 = 20.0;
/// Depth below a face at which its material is sought, mm.
const BELOW_MM: f64 = 0.2;
/// Conversion from g/cm³ to t/mm³.
const T_MM3_PER_G_CM3: f64 = 1e-9;

/// Parameters of the model of finished pieces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidParams {
    /// Edge length of the cells, mm. [0.5, 20]; 2.5. Voxels are a fifth of it. Material thinner than a voxel
    /// is lost, and channels narrower than two voxels close up.
    pub cell_mm: f64,
    /// Greatest distance between faces that may touch, mm. (0, 10]; 0.8.
    pub reach_mm: f64,
    /// Distance between contacts, mm. [0.2, 20]; 2.
    pub spacing_mm: f64,
    /// Material of all the pieces.
    pub material: Material,
}

impl Default for SolidParams {
    fn default() -> Self {
        Self {
            cell_mm: 2.5,
            reach_mm: 0.8,
            spacing_mm: 2.0,
            material: Material::default(),
        }
    }
}

impl SolidParams {
    /// Returns all problems of the parameters at once.
    pub fn problems(&self) -> Vec<String> {
        let m = &self.material;
        let checks = [
            ("cell_mm", self.cell_mm, 0.5, 20.0),
            ("reach_mm", self.reach_mm, 1e-3, 10.0),
            ("spacing_mm", self.spacing_mm, 0.2, 20.0),
            ("youngs_modulus_mpa", m.youngs_modulus_mpa, 1e-3, 1e6),
            ("poissons_ratio", m.poissons_ratio, 0.0, 0.45),
            ("density_g_cm3", m.density_g_cm3, 1e-6, 100.0),
        ];
        checks
            .into_iter()
            .filter(|(_, value, least, most)| !(least <= value && value <= most))
            .map(|(name, value, least, most)| format!("{name} is {value}: must be in [{least}, {most}]"))
            .collect()
    }
}

/// Reasons why finished pieces could not be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolidError {
    /// Some parameters are out of range.
    #[error("{}", .0.join("; "))]
    Params(Vec<String>),
    /// The piece has no material at voxel resolution.
    #[error("piece {} is thinner than the voxels of the simulation everywhere", .piece + 1)]
    Empty {
        /// Index of the piece, from 0.
        piece: usize,
    },
    /// A piece falls apart at voxel resolution.
    #[error(
        "piece {} is not one body at the size of voxels: {percent:.1} % of it hangs on nothing",
        .piece + 1
    )]
    Apart {
        /// Index of the piece, from 0.
        piece: usize,
        /// Loose share of the piece's volume, %.
        percent: f64,
    },
    /// The piece needs more cells than the memory limit allows.
    #[error("piece {} is too large for the simulation's cells; choose longer ones", .piece + 1)]
    TooLarge {
        /// Index of the piece, from 0.
        piece: usize,
    },
    /// A force acts at a place without material.
    #[error("at {at:?} there is no material of piece {}", .piece + 1)]
    NoMaterial {
        /// Index of the piece, from 0.
        piece: usize,
        /// Point of the force, mm.
        at: [f64; 3],
    },
    /// A load is on a piece that does not exist, or not finite.
    #[error("a load is on piece {} of {n_pieces}, or not finite", .piece + 1)]
    Load {
        /// Index of the piece, from 0.
        piece: usize,
        /// Number of pieces in the model.
        n_pieces: usize,
    },
    /// A stiffness matrix could not be factorised.
    #[error(transparent)]
    Factorisation(#[from] SparseError),
    /// The contact iteration did not converge.
    #[error("the contact problem does not converge")]
    Contact,
    /// The caller requested a stop.
    #[error("stopped")]
    Stopped,
}

/// Point force on a piece's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Index of the piece, from 0.
    pub part: u32,
    /// Point of the force, mm.
    pub at: Vec3,
    /// Force on the piece, N.
    pub force_n: Vec3,
}

/// Region of a piece that is held in place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// Index of the piece, from 0.
    pub part: u32,
    /// Centre of the region, mm.
    pub at: Vec3,
    /// Area of the held surface, mm².
    pub area_mm2: f64,
}

/// Reaction that balances the external forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The holds that the model was built with.
    Held,
    /// Inertia of all pieces, accelerated as one body.
    Inertia,
    /// Weak springs on the pieces, nothing else.
    Springs,
}

/// Finished pieces, their contacts, and the columns of compliance computed so far.
pub struct SolidModel {
    params: SolidParams,
    elements: Elements,
    compliance: Compliance,
    touches: Vec<Touch>,
    contacts: Vec<Contact>,
    probes: Vec<Vec<Probe>>,
}

/// Displacements of the pieces under a load.
pub struct Moved<'a> {
    model: &'a SolidModel,
    displacements: Vec<Vec<f64>>,
    frames: Vec<[f64; 6]>,
    settlements: Vec<Vec<f64>>,
    settled_frames: Vec<[f64; 6]>,
    /// Difference between the friction bounds used and those of the contact pressures, as a share of the
    /// load.
    pub friction_off: f64,
    /// Number of contacts that carry load.
    pub n_bearing: usize,
}

/// Place of a piece for which the displacement can be queried.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    part: usize,
    place: Place,
    at: Vec3,
}

impl SolidModel {
    /// Discretises and factorises `pieces`, and finds where they touch.
    ///
    /// `held` are the holds of [`Answer::Held`]; those without material are skipped. `is_connector` marks the
    /// material whose stress is reported separately. Takes about a second a piece of 5000 mm² of wall on one
    /// core; about 100 MB each.
    pub fn new(
        params: &SolidParams,
        pieces: &[Solid],
        held: &[Hold],
        is_connector: &(dyn Fn(Vec3) -> bool + Sync),
        is_stopped: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, SolidError> {
        let problems = params.problems();
        if !problems.is_empty() {
            return Err(SolidError::Params(problems));
        }
        let elements = Elements::new(&params.material, params.cell_mm);
        let bodies: Vec<Body> = pieces
            .par_iter()
            .enumerate()
            .map(|(piece, solid)| {
                if is_stopped() {
                    return Err(SolidError::Stopped);
                }
                Body::new(params, &elements, piece, solid)
            })
            .collect::<Result<_, _>>()?;
        let touches = touch::touches(pieces, params.reach_mm, params.spacing_mm);
        let probes = bodies
            .par_iter()
            .map(|body| stress::probes(body, &elements, is_connector))
            .collect();
        Self::assemble(params, elements, bodies, touches, held, probes)
    }

    fn assemble(
        params: &SolidParams,
        elements: Elements,
        bodies: Vec<Body>,
        touches: Vec<Touch>,
        held: &[Hold],
        probes: Vec<Vec<Probe>>,
    ) -> Result<Self, SolidError> {
        let mut seats: Vec<Vec<Seat>> = vec![Vec::new(); bodies.len()];
        let mut seat = |part: u32, at: Vec3, inside: Vec3| -> Option<End> {
            let place = bodies.get(part as usize)?.place(at, inside)?;
            let all = &mut seats[part as usize];
            all.push(Seat { place, at });
            Some(End {
                part,
                index: all.len() as u32 - 1,
            })
        };
        let youngs_modulus_mpa = params.material.youngs_modulus_mpa;
        let (mut ends, mut contacts, mut kept) = (Vec::new(), Vec::new(), Vec::new());
        for touch in touches {
            let inside = BELOW_MM * touch.normal;
            let first = seat(touch.parts[0], touch.at[0], -inside);
            let second = seat(touch.parts[1], touch.at[1], inside);
            // Material thinner than a voxel has nothing to press on.
            if first.is_some() && second.is_some() {
                ends.push([first, second]);
                contacts.push(Contact::of_touch(&touch, youngs_modulus_mpa));
                kept.push(touch);
            }
        }
        for hold in held {
            let Some(end) = seat(hold.part, hold.at, Vec3::ZERO) else {
                continue;
            };
            ends.push([None, Some(end)]);
            contacts.push(Contact {
                normal: Vec3::Z,
                gap_mm: 0.0,
                is_fast: true,
                stiffness: laws::stiffness(hold.area_mm2, youngs_modulus_mpa),
            });
        }
        Ok(Self {
            params: *params,
            elements,
            compliance: Compliance::new(bodies, ends, seats),
            touches: kept,
            contacts,
            probes,
        })
    }

    /// Places where the pieces may touch.
    pub fn touches(&self) -> &[Touch] {
        &self.touches
    }

    /// Number of unknown displacements of all pieces.
    pub fn n_unknowns(&self) -> usize {
        self.compliance.bodies.iter().map(Body::n_rows).sum()
    }

    /// Total mass of all pieces, t.
    pub fn mass_t(&self) -> f64 {
        let volume_mm3: f64 = self.compliance.bodies.iter().map(|b| b.volume_mm3).sum();
        volume_mm3 * self.density()
    }

    /// Volume of each piece at voxel resolution, mm³.
    pub fn volumes_mm3(&self) -> Vec<f64> {
        self.compliance.bodies.iter().map(|b| b.volume_mm3).collect()
    }

    fn density(&self) -> f64 {
        self.params.material.density_g_cm3 * T_MM3_PER_G_CM3
    }

    /// Finds the material of piece `part` that is nearest to `at`. `None` if there is none within reach.
    pub fn spot(&self, part: u32, at: Vec3) -> Option<Spot> {
        let place = self.compliance.bodies.get(part as usize)?.place(at, Vec3::ZERO)?;
        Some(Spot {
            part: part as usize,
            place,
            at,
        })
    }

    /// Computes how the pieces move under `pushes`, with friction of the given coefficient between them.
    pub fn under_load(
        &mut self,
        pushes: &[Push],
        answer: Answer,
        friction: f64,
        is_stopped: &dyn Fn() -> bool,
    ) -> Result<Moved<'_>, SolidError> {
        let sides = self.sides(pushes, answer)?;
        let loads = self.loads(pushes, &sides, 1.0);
        let little = self.loads(pushes, &sides, SETTLING_SHARE);
        let mut contacts = self.contacts.clone();
        if answer != Answer::Held {
            // The ground is absent: the ends of holds are kept, but carry no load.
            contacts[self.touches.len()..].iter_mut().for_each(|c| {
                c.is_fast = false;
                c.gap_mm = f64::INFINITY;
            });
        }
        let rest = State::rest(&little);
        let (settled, _) =
            self.find_equilibrium(&contacts, &little, &rest.clone(), rest, friction, is_stopped)?;
        let start = settled.under(&loads, &self.compliance);
        let (state, friction_off) =
            self.find_equilibrium(&contacts, &loads, &settled, start, friction, is_stopped)?;
        let n_bearing = state.force.iter().filter(|f| **f != Vec3::ZERO).count();
        Ok(Moved {
            displacements: self.displacements(&sides, 1.0, &state.force),
            frames: state.frames,
            settlements: self.displacements(&sides, SETTLING_SHARE, &settled.force),
            settled_frames: settled.frames,
            friction_off,
            n_bearing,
            model: self,
        })
    }

    /// Computes the equilibrium with friction that counts slip from `origin`. Also returns the deviation of
    /// the friction bounds from the pressures.
    fn find_equilibrium(
        &mut self,
        contacts: &[Contact],
        loads: &Loads,
        origin: &State,
        start: State,
        friction: f64,
        is_stopped: &dyn Fn() -> bool,
    ) -> Result<(State, f64), SolidError> {
        let problem = Problem {
            contacts,
            loads,
            is_stopped,
        };
        let state = problem.settle(&mut self.compliance, start)?;
        if friction > 0.0 {
            problem.with_friction(&mut self.compliance, origin, state, friction)
        } else {
            Ok((state, 0.0))
        }
    }

    /// Forces on the unknowns of each piece, N.
    fn sides(&self, pushes: &[Push], answer: Answer) -> Result<Vec<Vec<f64>>, SolidError> {
        let bodies = &self.compliance.bodies;
        let mut sides: Vec<Vec<f64>> = bodies.iter().map(|b| vec![0.0; b.n_rows()]).collect();
        for push in pushes {
            let piece = push.part as usize;
            if piece >= bodies.len() || !push.force_n.is_finite() || !push.at.is_finite() {
                return Err(SolidError::Load {
                    piece,
                    n_pieces: bodies.len(),
                });
            }
            let place = bodies[piece]
                .place(push.at, Vec3::ZERO)
                .ok_or(SolidError::NoMaterial {
                    piece,
                    at: push.at.to_array(),
                })?;
            bodies[piece].push(&mut sides[piece], &place, push.force_n);
        }
        if answer == Answer::Inertia {
            self.add_inertia(pushes, &mut sides);
        }
        Ok(sides)
    }

    /// Adds the inertia forces of all pieces, accelerated as one body.
    fn add_inertia(&self, pushes: &[Push], sides: &mut [Vec<f64>]) {
        let bodies = &self.compliance.bodies;
        let points = || bodies.iter().flat_map(Body::points);
        let volume: f64 = points().map(|p| p.3).sum();
        let center = points().map(|p| p.3 * p.2).sum::<Vec3>() / volume;
        let mut inertia = nalgebra::Matrix3::<f64>::zeros();
        for (_, _, p, v) in points() {
            let r = nalgebra::Vector3::from((p - center).to_array());
            inertia += (nalgebra::Matrix3::identity() * r.norm_squared() - r * r.transpose()) * v;
        }
        let total: Vec3 = pushes.iter().map(|p| p.force_n).sum();
        let moment: Vec3 = pushes.iter().map(|p| (p.at - center).cross(p.force_n)).sum();
        let turn = inertia.try_inverse().map_or(Vec3::ZERO, |i| {
            Vec3::from_slice((i * nalgebra::Vector3::from(moment.to_array())).as_slice())
        });
        for (body, side) in bodies.iter().zip(sides) {
            for (copy, voxel, p, v) in body.points() {
                let force_n = -v * (total / volume + turn.cross(p - center));
                let weights = element::shapes(element::centre(voxel, &copy.fills[voxel]));
                for (node, weight) in copy.nodes.iter().zip(weights) {
                    let at = 3 * *node as usize;
                    (0..3).for_each(|k| side[at + k] += weight * force_n[k]);
                }
            }
        }
    }

    /// Scales the forces by `share` and projects them onto contacts and frames.
    fn loads(&self, pushes: &[Push], sides: &[Vec<f64>], share: f64) -> Loads {
        let free = self.displacements(sides, share, &vec![Vec3::ZERO; self.contacts.len()]);
        let size_n = share * pushes.iter().map(|p| p.force_n.length()).sum::<f64>().max(1e-9);
        let on_frames = (0..sides.len()).map(|part| self.on_frame(part, &sides[part]).map(|f| share * f));
        Loads {
            free: self.compliance.between(&free),
            on_frames: on_frames.collect(),
            size_n,
            spring: size_n / ASTRAY_MM,
        }
    }

    /// Force and moment resultants of the forces on a piece's unknowns.
    fn on_frame(&self, part: usize, side: &[f64]) -> [f64; 6] {
        let body = &self.compliance.bodies[part];
        let mut sums = [0.0; 6];
        let mut is_seen = vec![false; body.cells.n_nodes];
        for copy in &body.cells.copies {
            for (i, &node) in copy.nodes.iter().enumerate() {
                if std::mem::replace(&mut is_seen[node as usize], true) {
                    continue;
                }
                let force = Vec3::from_slice(&side[3 * node as usize..][..3]);
                let motions = body.frame.motions(body.node(copy, i));
                (0..6).for_each(|k| sums[k] += motions[k].dot(force));
            }
        }
        sums
    }

    /// Displacements of each piece relative to its frame, under a share of the loads and the contact forces.
    fn displacements(&self, sides: &[Vec<f64>], share: f64, force_n: &[Vec3]) -> Vec<Vec<f64>> {
        let on_seats = self.compliance.on_seats(force_n);
        (0..sides.len())
            .into_par_iter()
            .map(|part| {
                let body = &self.compliance.bodies[part];
                let mut side: Vec<f64> = sides[part].iter().map(|f| share * f).collect();
                for (seat, force) in self.compliance.seats[part].iter().zip(&on_seats[part]) {
                    if *force != Vec3::ZERO {
                        body.push(&mut side, &seat.place, *force);
                    }
                }
                body.solve(&mut side);
                side
            })
            .collect()
    }
}

impl Moved<'_> {
    /// Displacement of a place, mm.
    pub fn moved_mm(&self, spot: &Spot) -> Vec3 {
        self.at(spot, &self.displacements, &self.frames)
    }

    /// Displacement of a place when the play had been taken up, mm.
    pub fn settled_mm(&self, spot: &Spot) -> Vec3 {
        self.at(spot, &self.settlements, &self.settled_frames)
    }

    fn at(&self, spot: &Spot, displacements: &[Vec<f64>], frames: &[[f64; 6]]) -> Vec3 {
        let body = &self.model.compliance.bodies[spot.part];
        let motions = body.frame.motions(spot.at);
        let by_frame: Vec3 = (0..6).map(|k| frames[spot.part][k] * motions[k]).sum();
        by_frame + body.displacement(&displacements[spot.part], &spot.place)
    }

    /// Pieces (from 0) that nothing stops, ascending.
    pub fn lost(&self) -> Vec<u32> {
        let most = |q: &[f64; 6]| q.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        (0..)
            .zip(&self.frames)
            .filter(|(_, q)| most(q) > LOST_MM)
            .map(|(part, _)| part)
            .collect()
    }

    /// Stress level of the walls and of the connectors.
    pub fn stress(&self) -> [StressLevel; 2] {
        let model = self.model;
        let found: Vec<_> = (0..self.displacements.len())
            .into_par_iter()
            .map(|part| {
                stress::samples(
                    &model.compliance.bodies[part],
                    &model.elements,
                    &model.probes[part],
                    &self.displacements[part],
                )
            })
            .collect();
        [0, 1].map(|which| StressLevel::of(found.iter().flat_map(|f| f[which].iter().copied()).collect()))
    }
}
