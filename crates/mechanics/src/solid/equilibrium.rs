//! Static equilibrium of elastic pieces in contact: Newton's method on a convex energy.
//!
//! The unknowns are the forces of the active contacts, and six motions of each piece's frame. C is the
//! compliance of the pieces at the contacts, G the motion of the contacts with the frames, D the contacts'
//! stiffness and S the springs of the frames:
//!
//! ```text
//!   ⎡ C + D⁻¹   G ⎤ ⎡ f ⎤   ⎡ u* + D⁻¹ f* − u₀ ⎤      u₀: displacement at the contacts by loads alone
//!   ⎣ Gᵀ       −S ⎦ ⎣ q ⎦ = ⎣ − load on frames ⎦      u*, f*: point at which the law is linearised
//! ```
//!
//! Each step goes to the minimum of the energy along it (exact line search), so pieces that start apart find
//! each other. Without friction, or with friction of given bounds, the energy is convex and the solution
//! unique. The bounds follow the pressures (Haslinger's fixed point).

use shellock_geom::Vec3;
use shellock_geom::sparse::eliminate_first;

use nalgebra::{DMatrix, DVector};

use super::SolidError;
use super::compliance::Compliance;
use super::laws::{Contact, Grip, answers, force};

/// Greatest number of Newton steps before the contacts count as not converged.
const MOST_STEPS: usize = 200;
/// Factors by which contacts are softened at first. Then pieces that start apart find all contacts that stop
/// them at once; stiff contacts are found one by one, in hundreds of steps.
const SOFTER: [f64; 4] = [1e-4, 1e-3, 1e-2, 1e-1];
/// Greatest number of steps with softened contacts, and the force tolerance to go on.
const SOFT_STEPS: usize = 40;
const SOFT_SETTLED: f64 = 1e-2;
/// Greatest number of steps in each round of friction bounds, after which the next round begins.
const STEPS_A_ROUND: usize = 30;
/// Force tolerance: greatest deviation of the contact forces from their law, as a share of the load.
const SETTLED: f64 = 1e-6;
/// Greatest number of rounds of friction bounds.
const MOST_ROUNDS: usize = 30;
/// Tolerance with friction: greatest deviation of bounds and forces from their law, as a share of the load.
const FRICTION_SETTLED: f64 = 2e-3;
/// Friction bound that no force reaches, N, so that contacts stick.
const STUCK_N: f64 = 1e12;

/// Loads that act on the pieces.
pub(super) struct Loads {
    /// Relative displacement at each contact by loads alone, with frames at rest, second end minus first, mm.
    pub free: Vec<Vec3>,
    /// Forces and moments (over its radius) on each piece's frame, N.
    pub on_frames: Vec<[f64; 6]>,
    /// Sum of the magnitudes of all forces, N.
    pub size_n: f64,
    /// Stiffness of the springs on each piece's frame, N/mm.
    pub spring: f64,
}

/// Contact forces and motions of all pieces.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// Force on the second part of each contact, N.
    pub force: Vec<Vec3>,
    /// Motions of the frames, mm.
    pub frames: Vec<[f64; 6]>,
    /// Relative motion at each contact, and below the part of it due to the contact forces, mm.
    pub by: Vec<Vec3>,
    elastic: Vec<Vec3>,
}

/// Row of the system: the response of a contact along a direction.
struct Row {
    contact: usize,
    along: Vec3,
    compliance: f64,
    constant: f64,
}

impl State {
    /// State at rest, without contact forces.
    pub fn rest(loads: &Loads) -> Self {
        Self {
            force: vec![Vec3::ZERO; loads.free.len()],
            frames: vec![[0.0; 6]; loads.on_frames.len()],
            by: loads.free.clone(),
            elastic: vec![Vec3::ZERO; loads.free.len()],
        }
    }

    /// Difference from state `from` to this one.
    fn less(&self, from: &Self) -> Self {
        let less = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| *a - *b).collect();
        let frames = self.frames.iter().zip(&from.frames);
        Self {
            force: less(&self.force, &from.force),
            frames: frames
                .map(|(a, b)| std::array::from_fn(|k| a[k] - b[k]))
                .collect(),
            by: less(&self.by, &from.by),
            elastic: less(&self.elastic, &from.elastic),
        }
    }

    /// Adds `share` times a step.
    fn add(&mut self, step: &Self, share: f64) {
        let add =
            |to: &mut [Vec3], step: &[Vec3]| to.iter_mut().zip(step).for_each(|(x, d)| *x += share * *d);
        add(&mut self.force, &step.force);
        add(&mut self.by, &step.by);
        add(&mut self.elastic, &step.elastic);
        for (to, step) in self.frames.iter_mut().zip(&step.frames) {
            (0..6).for_each(|k| to[k] += share * step[k]);
        }
    }

    /// Keeps the contact forces and frames, and recomputes the motions for other loads.
    pub fn under(&self, loads: &Loads, compliance: &Compliance) -> Self {
        let by = |i: usize| loads.free[i] + self.elastic[i] + compliance.by_frames(i, &self.frames);
        Self {
            by: (0..self.force.len()).map(by).collect(),
            ..self.clone()
        }
    }
}

/// Contacts and loads whose equilibrium is sought.
pub(super) struct Problem<'a> {
    pub contacts: &'a [Contact],
    pub loads: &'a Loads,
    pub is_stopped: &'a dyn Fn() -> bool,
}

impl Problem<'_> {
    /// Solves with friction, starting from a solution without friction. Returns the state, and the deviation
    /// of bounds and forces from the law, as a share of the load.
    ///
    /// At first every loaded contact sticks, then it slips as far as it must. From that side Newton's method
    /// finds the slipping contacts in a few steps.
    pub fn with_friction(
        &self,
        compliance: &mut Compliance,
        origin: &State,
        start: State,
        friction: f64,
    ) -> Result<(State, f64), SolidError> {
        let mut grips: Vec<Grip> = origin
            .by
            .iter()
            .map(|&origin| Grip { bound_n: 0.0, origin })
            .collect();
        for (grip, bound_n) in grips.iter_mut().zip(self.bounds(&start, friction)) {
            grip.bound_n = if bound_n > 0.0 { STUCK_N } else { 0.0 };
        }
        let (mut state, _) = self.step(compliance, &grips, start, STEPS_A_ROUND, SETTLED)?;
        let mut off = f64::INFINITY;
        for _ in 0..MOST_ROUNDS {
            for (grip, bound_n) in grips.iter_mut().zip(self.bounds(&state, friction)) {
                grip.bound_n = bound_n;
            }
            let unlawful;
            (state, unlawful) =
                self.step(compliance, &grips, state, STEPS_A_ROUND, 0.1 * FRICTION_SETTLED)?;
            let bounds = self.bounds(&state, friction);
            let change: f64 = grips.iter().zip(bounds).map(|(g, b)| (g.bound_n - b).abs()).sum();
            off = unlawful + change / self.loads.size_n;
            if off <= FRICTION_SETTLED {
                break;
            }
        }
        Ok((state, off))
    }

    /// Friction bound of each contact, N: pressure times the coefficient.
    fn bounds<'s>(&'s self, state: &'s State, friction: f64) -> impl Iterator<Item = f64> + 's {
        self.contacts.iter().zip(&state.by).map(move |(contact, by)| {
            let gap = contact.gap_mm + contact.normal.dot(*by);
            if contact.is_fast {
                0.0
            } else {
                friction * contact.stiffness * (-gap).max(0.0)
            }
        })
    }

    /// Solves for the equilibrium without friction.
    pub fn settle(&self, compliance: &mut Compliance, start: State) -> Result<State, SolidError> {
        let free = vec![Grip::default(); self.contacts.len()];
        let mut start = start;
        for share in SOFTER {
            let softened = |c: &Contact| Contact {
                stiffness: share * c.stiffness,
                ..*c
            };
            let contacts: Vec<Contact> = self.contacts.iter().map(softened).collect();
            let softer = Problem {
                contacts: &contacts,
                ..*self
            };
            (start, _) = softer.step(compliance, &free, start, SOFT_STEPS, SOFT_SETTLED)?;
        }
        let (state, off) = self.step(compliance, &free, start, MOST_STEPS, SETTLED)?;
        if off > SETTLED {
            return Err(SolidError::Contact);
        }
        Ok(state)
    }

    /// Takes at most `most` Newton steps towards the minimum of the energy for given friction bounds. Also
    /// returns the remaining deviation of the forces from their law, as a share of the load.
    fn step(
        &self,
        compliance: &mut Compliance,
        grips: &[Grip],
        mut state: State,
        most: usize,
        settled: f64,
    ) -> Result<(State, f64), SolidError> {
        let (contacts, loads) = (self.contacts, self.loads);
        let mut off = f64::INFINITY;
        for _ in 0..most {
            if (self.is_stopped)() {
                return Err(SolidError::Stopped);
            }
            let rows = rows(contacts, grips, &state);
            compliance.prepare(rows.iter().map(|row| row.contact));
            let next = solve(compliance, loads, &rows, contacts.len())?;
            let step = next.less(&state);
            let slope = Slope {
                contacts,
                grips,
                loads,
                state: &state,
                step: &step,
            };
            let length = slope.length();
            state.add(&step, length);
            let unlawful: f64 = (0..contacts.len())
                .map(|i| force(&contacts[i], &grips[i], state.by[i]).distance(state.force[i]))
                .sum();
            off = unlawful / loads.size_n;
            if off <= settled {
                break;
            }
        }
        Ok((state, off))
    }
}

fn rows(contacts: &[Contact], grips: &[Grip], state: &State) -> Vec<Row> {
    let mut rows = Vec::new();
    for (i, contact) in contacts.iter().enumerate() {
        let by = state.by[i];
        let force_n = force(contact, &grips[i], by);
        for answer in answers(contact, &grips[i], by) {
            let compliance = 1.0 / answer.stiffness;
            rows.push(Row {
                contact: i,
                along: answer.along,
                compliance,
                constant: answer.along.dot(by) + compliance * answer.along.dot(force_n),
            });
        }
    }
    rows
}

/// Solves the linear system of `rows`.
fn solve(
    compliance: &Compliance,
    loads: &Loads,
    rows: &[Row],
    n_contacts: usize,
) -> Result<State, SolidError> {
    let (m, n_frames) = (rows.len(), 6 * loads.on_frames.len());
    let n = m + n_frames;
    let mut values = vec![0.0; n * n];
    let directed: Vec<(usize, Vec3)> = rows.iter().map(|r| (r.contact, r.along)).collect();
    compliance.fill(&directed, n, &mut values);
    let mut side = vec![0.0; n];
    for (r, row) in rows.iter().enumerate() {
        values[r + n * r] += row.compliance;
        side[r] = row.constant - row.along.dot(loads.free[row.contact]);
    }
    for f in 0..n_frames {
        values[(m + f) * (n + 1)] = -loads.spring;
        side[m + f] = -loads.on_frames[f / 6][f % 6];
    }
    eliminate_first(&mut values, n, m)?;
    let x = back_substitute(&values, n, m, side).ok_or(SolidError::Contact)?;

    let mut force_n = vec![Vec3::ZERO; n_contacts];
    for (row, x) in rows.iter().zip(&x) {
        force_n[row.contact] += *x * row.along;
    }
    let frames: Vec<[f64; 6]> = x[m..]
        .chunks_exact(6)
        .map(|q| std::array::from_fn(|k| q[k]))
        .collect();
    let elastic = compliance.moved_by(&force_n);
    let by = (0..n_contacts)
        .map(|i| loads.free[i] + elastic[i] + compliance.by_frames(i, &frames))
        .collect();
    Ok(State {
        force: force_n,
        frames,
        by,
        elastic,
    })
}

/// Solves with the factors that `eliminate_first` left in the matrix.
fn back_substitute(values: &[f64], n: usize, m: usize, mut x: Vec<f64>) -> Option<Vec<f64>> {
    for j in 0..m {
        let column = &values[n * j..n * (j + 1)];
        x[j] /= column[j];
        let own = x[j];
        for i in j + 1..n {
            x[i] -= column[i] * own;
        }
    }
    let at = |i: usize, j: usize| values[m + i.max(j) + n * (m + i.min(j))];
    let rest = DMatrix::from_fn(n - m, n - m, at);
    let q = rest.lu().solve(&DVector::from_column_slice(&x[m..]))?;
    x[m..].copy_from_slice(q.as_slice());
    for j in (0..m).rev() {
        let column = &values[n * j..n * (j + 1)];
        let below: f64 = (j + 1..n).map(|i| column[i] * x[i]).sum();
        x[j] = (x[j] - below) / column[j];
    }
    x.iter().all(|x| x.is_finite()).then_some(x)
}

/// Slope of the energy along a step.
struct Slope<'a> {
    contacts: &'a [Contact],
    grips: &'a [Grip],
    loads: &'a Loads,
    state: &'a State,
    step: &'a State,
}

impl Slope<'_> {
    /// Step length: to the minimum of the energy, or to the step's end.
    fn length(&self) -> f64 {
        const HALVINGS: usize = 60;
        let linear = self.linear();
        let at = |length: f64| linear[0] + length * linear[1] - self.contacts_give(length);
        // A step without a kink ends with zero slope, except for rounding.
        if at(1.0) <= 1e-9 * at(0.0).abs() {
            return 1.0;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if at(middle) > 0.0 {
                high = middle;
            } else {
                low = middle;
            }
        }
        0.5 * (low + high)
    }

    /// Slope from pieces, loads and frame springs: the value at the start, and the increase per unit of
    /// length.
    fn linear(&self) -> [f64; 2] {
        let mut sums = [0.0; 2];
        let way = self.step;
        for ((step, elastic), change) in way.force.iter().zip(&self.state.elastic).zip(&way.elastic) {
            sums[0] += step.dot(*elastic);
            sums[1] += step.dot(*change);
        }
        for ((step, q), load) in way
            .frames
            .iter()
            .zip(&self.state.frames)
            .zip(&self.loads.on_frames)
        {
            for k in 0..6 {
                sums[0] += step[k] * (self.loads.spring * q[k] - load[k]);
                sums[1] += self.loads.spring * step[k] * step[k];
            }
        }
        sums
    }

    fn contacts_give(&self, length: f64) -> f64 {
        (0..self.contacts.len())
            .map(|i| {
                let step = self.step.by[i];
                let by = self.state.by[i] + length * step;
                force(&self.contacts[i], &self.grips[i], by).dot(step)
            })
            .sum()
    }
}
