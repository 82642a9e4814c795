//! Preconditioned conjugate directions for many plans at once.

use shellock_geom::Vec3;

use super::terms::Term;
use super::{SurfaceModel, SurfaceSolution};
use crate::assembly::{Joint, Resistance};

/// Stiffness, in `E H`, that ties every point to its place in the preconditioner and in the energy: enough for a factor to
/// exist, 10⁵ times less than what the weakest joint of a plan that holds resists.
pub(super) const GROUND_SHARE: f64 = 1e-8;

/// A gap this large, in connector sizes, has let the pins out: the plan does not hold.
const LOST_SIZES: f64 = 0.6;

/// Newton steps of a line search; the slope is piecewise linear and most searches end after two or three.
const LINE_STEPS: usize = 30;

/// One plan on its way to equilibrium.
struct State<'a> {
    joints: &'a [Option<Joint>],
    two_sided: Vec<Term>,
    one_sided: Vec<Term>,
    moved: Vec<f64>,
    /// What is left of the force.
    residual: Vec<f64>,
    direction: Vec<f64>,
    /// `r · A⁻¹ r` of the last iteration and of the first.
    norm: f64,
    first_norm: f64,
    /// `r · A⁻¹ f` parts for the conjugacy factor.
    last_residual: Vec<f64>,
    n_iterations: usize,
    is_done: bool,
}

/// Solves the plans in step with each other; each solve of the preconditioner serves all that are not done.
pub(super) fn solve(model: &SurfaceModel, plans: &[(&[Option<Joint>], Vec<Vec3>)]) -> Vec<SurfaceSolution> {
    let mut states: Vec<State<'_>> = plans.iter().map(|(joints, pulls)| State::new(model, joints, pulls)).collect();
    let n = model.n_rows;
    let mut sides: Vec<f64> = Vec::with_capacity(n * states.len());
    for _ in 0..model.params.max_iterations {
        sides.clear();
        states.iter().filter(|s| !s.is_done).for_each(|s| sides.extend_from_slice(&s.residual));
        if sides.is_empty() {
            break;
        }
        model.factor.solve_in_place(&mut sides);
        for (state, step) in states.iter_mut().filter(|s| !s.is_done).zip(sides.chunks_exact(n.max(1))) {
            state.advance(model, step);
        }
    }
    states.into_iter().map(|s| s.into_solution(model)).collect()
}

impl<'a> State<'a> {
    fn new(model: &SurfaceModel, joints: &'a [Option<Joint>], pulls: &[Vec3]) -> Self {
        let (one_sided, two_sided) = model.terms_of(joints).into_iter().partition(|t| t.is_one_sided);
        let n = model.n_rows;
        let mut residual = vec![0.0; n];
        for (i, &pull) in pulls.iter().enumerate() {
            for (side, force) in [pull, -pull].into_iter().enumerate() {
                add(&mut residual, model.row[model.tip(i, side)], force);
            }
        }
        let is_done = residual.iter().all(|r| *r == 0.0);
        Self {
            joints,
            two_sided,
            one_sided,
            moved: vec![0.0; n],
            last_residual: vec![0.0; n],
            residual,
            direction: vec![0.0; n],
            norm: 0.0,
            first_norm: 0.0,
            n_iterations: 0,
            is_done,
        }
    }

    /// One step along the direction conjugate to the last one; `step` is the preconditioned residual.
    fn advance(&mut self, model: &SurfaceModel, step: &[f64]) {
        let norm = dot(&self.residual, step);
        if self.n_iterations == 0 {
            self.first_norm = norm;
        }
        // Polak and Ribière's factor: it restarts by itself where contacts switched.
        let conjugate = norm - dot(&self.last_residual, step);
        let beta = if self.norm > 0.0 { (conjugate / self.norm).max(0.0) } else { 0.0 };
        self.norm = norm;
        if !(norm > model.params.tolerance.powi(2) * self.first_norm) {
            self.is_done = true;
            return;
        }
        self.n_iterations += 1;
        self.direction.iter_mut().zip(step).for_each(|(p, z)| *p = z + beta * *p);
        self.last_residual.copy_from_slice(&self.residual);
        self.search_along(model);
    }

    /// Goes along the direction to the least energy.
    fn search_along(&mut self, model: &SurfaceModel) {
        let mut stiff = model.patches.times(&self.direction);
        let ground = GROUND_SHARE * model.params.material.youngs_modulus_mpa * model.params.wall_mm;
        stiff.iter_mut().zip(&self.direction).for_each(|(f, p)| *f += ground * p);
        for term in &self.two_sided {
            let pull = term.stiffness * value(model, term, &self.direction);
            push(model, term, pull, &mut stiff);
        }
        let contacts: Vec<[f64; 3]> = self
            .one_sided
            .iter()
            .map(|t| [value(model, t, &self.moved), value(model, t, &self.direction), t.stiffness])
            .collect();
        // The residual has the contacts as they are at length 0; the slope asks for them at every length.
        let push_at = |[a, b, k]: [f64; 3], length: f64| k * (a + length * b).min(0.0);
        let linear = -dot(&self.residual, &self.direction);
        let curved = dot(&stiff, &self.direction);
        let mut length = 0.0;
        for _ in 0..LINE_STEPS {
            let (mut slope, mut curve) = (linear + curved * length, curved);
            for &c in &contacts {
                slope += c[1] * (push_at(c, length) - push_at(c, 0.0));
                curve += if c[0] + length * c[1] < 0.0 { c[2] * c[1] * c[1] } else { 0.0 };
            }
            if slope.abs() <= 1e-10 * linear.abs() || curve <= 0.0 {
                break;
            }
            length -= slope / curve;
        }
        self.moved.iter_mut().zip(&self.direction).for_each(|(u, p)| *u += length * p);
        self.residual.iter_mut().zip(&stiff).for_each(|(r, f)| *r -= length * f);
        for (term, &c) in self.one_sided.iter().zip(&contacts) {
            let change = push_at(c, length) - push_at(c, 0.0);
            if change != 0.0 {
                push(model, term, -change, &mut self.residual);
            }
        }
    }

    fn into_solution(self, model: &SurfaceModel) -> SurfaceSolution {
        let opening = model.rated(self.joints, &self.moved);
        let lost_mm = LOST_SIZES * model.params.connector_mm;
        let lost = |(i, d): (usize, &f64)| (!(*d < lost_mm)).then_some(i);
        let mut parts: Vec<u32> = opening
            .opening_mm
            .iter()
            .enumerate()
            .filter_map(lost)
            .flat_map(|i| model.assembly.stations[i].points)
            .filter(|&p| model.row[p as usize].is_some())
            .map(|p| model.assembly.part_of_point[p as usize])
            .collect();
        parts.sort_unstable();
        parts.dedup();
        let is_lost = !parts.is_empty() || !self.is_done;
        let resistance = if is_lost { Resistance::Separable(parts) } else { Resistance::Holds(opening) };
        let error = if self.first_norm > 0.0 { (self.norm.max(0.0) / self.first_norm).sqrt() } else { 0.0 };
        SurfaceSolution { resistance, n_iterations: self.n_iterations, error }
    }
}

/// `Σ gᵢ · uᵢ` of a term.
fn value(model: &SurfaceModel, term: &Term, moved: &[f64]) -> f64 {
    let at = |(p, g): (usize, Vec3)| model.row[p].map_or(0.0, |r| g.dot(Vec3::from_slice(&moved[r as usize..])));
    term.corners().map(at).sum()
}

/// Adds `size · gᵢ` at every point of a term.
fn push(model: &SurfaceModel, term: &Term, size: f64, forces: &mut [f64]) {
    for (p, g) in term.corners() {
        add(forces, model.row[p], size * g);
    }
}

fn add(forces: &mut [f64], row: Option<u32>, force: Vec3) {
    if let Some(row) = row {
        for (x, f) in (row as usize..).zip(force.to_array()) {
            forces[x] += f;
        }
    }
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}
