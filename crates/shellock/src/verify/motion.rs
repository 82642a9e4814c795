//! Whether any pieces can move at all, alone or together, by however little.
//!
//! A motion gives each free piece a velocity (and a spin). A contact with normal `n` from `a` to `b` allows it where
//! `n · (v_a − v_b) ≤ 0`; over all contacts, `A x ≤ 0`. Nothing moves iff `x = 0` is the only solution.
//!
//! With `b = Aᵀ1 / m`, the least-norm point `r = b + Aᵀμ`, `μ ≥ 0`, decides everything (the alternatives of Stiemke):
//! where `r = 0` the contacts are in equilibrium with positive forces, so `A x ≤ 0` implies `A x = 0` and only a null
//! space of `A` can move; otherwise `x = −r` is a motion that opens contacts. For every motion with `|x| ≤ 1`,
//! `−1ᵀA x ≤ m ‖r‖₁`, which bounds the linear program of the acceptance test. `r` is found by non-negative least squares
//! [LawsonHanson1974, ch. 23] on a Cholesky factor of the active contacts, never more of them than unknowns.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use shellock_geom::Vec3;

use super::contact::Contact;
use crate::PatchId;

/// Mean opening speed of the contacts that counts as none. The acceptance test's bound is 1e-6 for the program's
/// optimum, which ours is an upper bound of.
const OPENING: f64 = 5e-7;
/// Least over greatest eigenvalue of `AᵀA` below which pieces can slide without opening a contact; the acceptance
/// test has 1e-7.
const SLIDING: f64 = 1.5e-7;
/// Part of the fastest component from which a piece counts as moving.
const MOVES: f64 = 0.05;
/// By how much a contact may be violated, relative to the motion, when the search for contacts to add ends.
const VIOLATION: f64 = 1e-6;
/// A contact whose part outside the span of the active ones is a smaller share of it adds nothing but rounding.
const INDEPENDENT: f64 = 1e-9;
/// Rounds for each unknown before the search ends undecided, which counts as a motion. A guard against endless rounds
/// by rounding; how many real assemblies need has not been measured.
const ROUNDS: usize = 30;

/// Which motions of a piece are considered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// Three components of velocity.
    Translations,
    /// Velocity and spin.
    Rigid,
}

/// The motion of one piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// The piece.
    pub piece: PatchId,
    /// Velocity of the piece at the origin, the fastest component of the whole motion being 1.
    pub velocity: Vec3,
    /// Spin times the scale given to [`free_motion`].
    pub spin: Vec3,
}

/// How the pieces not in `held` (of `n_pieces`) can move; empty where they cannot.
///
/// `scale_mm` makes spins comparable to velocities: half the model's diagonal. All free pieces count as moving where
/// there is no contact.
pub fn free_motion(
    contacts: &[Contact],
    n_pieces: usize,
    held: &[PatchId],
    scale_mm: f64,
    freedom: Freedom,
) -> Vec<Twist> {
    let free: Vec<PatchId> = (0..n_pieces).map(PatchId::from).filter(|id| !held.contains(id)).collect();
    if free.is_empty() {
        return Vec::new();
    }
    let system = System::new(contacts, &free, scale_mm, freedom);
    let motion = system.opening_motion().or_else(|| system.sliding_motion());
    motion.map_or_else(Vec::new, |x| system.twists(&x, &free))
}

/// One contact as a row of `A`: `wrench` at the columns of `plus`, its opposite at those of `minus`.
struct Row {
    plus: Option<usize>,
    minus: Option<usize>,
    wrench: [f64; 6],
}

struct System {
    /// Unknowns of a piece: 3 or 6.
    dof: usize,
    n: usize,
    rows: Vec<Row>,
}

impl System {
    fn new(contacts: &[Contact], free: &[PatchId], scale_mm: f64, freedom: Freedom) -> Self {
        let dof = if freedom == Freedom::Rigid { 6 } else { 3 };
        let column = |id: PatchId| free.binary_search(&id).ok().map(|i| i * dof);
        let rows = contacts.iter().map(|c| {
            let spin = if freedom == Freedom::Rigid { c.point.cross(c.normal) / scale_mm } else { Vec3::ZERO };
            let ([x, y, z], [u, v, w]) = (c.normal.to_array(), spin.to_array());
            Row { plus: column(c.a), minus: column(c.b), wrench: [x, y, z, u, v, w] }
        });
        let rows = rows.filter(|r| r.plus.is_some() || r.minus.is_some()).collect();
        Self { dof, n: free.len() * dof, rows }
    }

    fn dot(&self, row: &Row, x: &DVector<f64>) -> f64 {
        let part = |at: Option<usize>| at.map_or(0.0, |at| (0..self.dof).map(|k| row.wrench[k] * x[at + k]).sum());
        part(row.plus) - part(row.minus)
    }

    fn add(&self, row: &Row, factor: f64, x: &mut DVector<f64>) {
        for (at, sign) in [(row.plus, 1.0), (row.minus, -1.0)] {
            if let Some(at) = at {
                (0..self.dof).for_each(|k| x[at + k] += sign * factor * row.wrench[k]);
            }
        }
    }

    fn dot_rows(&self, a: &Row, b: &Row) -> f64 {
        let product: f64 = (0..self.dof).map(|k| a.wrench[k] * b.wrench[k]).sum();
        let meets = |x: Option<usize>, y: Option<usize>| f64::from(u8::from(x.is_some() && x == y));
        product * (meets(a.plus, b.plus) + meets(a.minus, b.minus) - meets(a.plus, b.minus) - meets(a.minus, b.plus))
    }

    /// A motion that opens contacts and closes none, or `None` where there is none.
    fn opening_motion(&self) -> Option<DVector<f64>> {
        let mut base = DVector::zeros(self.n);
        self.rows.iter().for_each(|row| self.add(row, 1.0 / self.rows.len() as f64, &mut base));
        let mut active = Active::default();
        let mut rest = base.clone();
        let mut is_refused = vec![false; self.rows.len()];
        for _ in 0..ROUNDS * self.n {
            if rest.lp_norm(1) <= OPENING {
                return None;
            }
            let Some(entering) = self.most_violated(&rest, &is_refused) else { break };
            if !active.push(self, entering) {
                is_refused[entering] = true;
                continue;
            }
            is_refused.fill(false);
            let left_at_once = active.solve(self, &base, entering);
            if left_at_once {
                // Rounding: the contact that should have gained a force lost it. The next one may do better.
                is_refused[entering] = true;
            }
            rest.copy_from(&base);
            for (&row, &force) in active.rows.iter().zip(&active.forces) {
                self.add(&self.rows[row], force, &mut rest);
            }
        }
        Some(-rest)
    }

    /// The row along which `−rest` violates its contact most, per length of the row.
    fn most_violated(&self, rest: &DVector<f64>, is_refused: &[bool]) -> Option<usize> {
        let limit = -VIOLATION * rest.norm();
        let violation = |row: &Row| self.dot(row, rest) / self.dot_rows(row, row).sqrt();
        let open = self.rows.iter().enumerate().filter(|(i, _)| !is_refused[*i]);
        let worst = open.map(|(i, row)| (i, violation(row))).min_by(|a, b| a.1.total_cmp(&b.1))?;
        (worst.1 < limit).then_some(worst.0)
    }

    /// A motion along which all contacts slide, or `None` where there is none.
    fn sliding_motion(&self) -> Option<DVector<f64>> {
        let mut gram = DMatrix::<f64>::zeros(self.n, self.n);
        for row in &self.rows {
            let blocks = [(row.plus, 1.0), (row.minus, -1.0)];
            for (at, sign) in blocks.iter().filter_map(|&(at, sign)| Some((at?, sign))) {
                for (to, other) in blocks.iter().filter_map(|&(to, other)| Some((to?, other))) {
                    for (i, wi) in row.wrench.iter().take(self.dof).enumerate() {
                        for (k, wk) in row.wrench.iter().take(self.dof).enumerate() {
                            gram[(at + i, to + k)] += sign * other * wi * wk;
                        }
                    }
                }
            }
        }
        let eigen = SymmetricEigen::new(gram);
        let least = eigen.eigenvalues.imin();
        (eigen.eigenvalues[least] <= SLIDING * eigen.eigenvalues.max())
            .then(|| eigen.eigenvectors.column(least).into_owned())
    }

    fn twists(&self, x: &DVector<f64>, free: &[PatchId]) -> Vec<Twist> {
        let scale = 1.0 / x.amax().max(f64::MIN_POSITIVE);
        let part = |at: usize| Vec3::new(x[at], x[at + 1], x[at + 2]) * scale;
        let twist = |(i, &piece): (usize, &PatchId)| {
            let spin = if self.dof == 6 { part(i * self.dof + 3) } else { Vec3::ZERO };
            Twist { piece, velocity: part(i * self.dof), spin }
        };
        let speed = |t: &Twist| t.velocity.abs().max_element().max(t.spin.abs().max_element());
        free.iter().enumerate().map(twist).filter(|t| speed(t) > MOVES).collect()
    }
}

/// The contacts that carry force, and the Cholesky factor of their products `A_P A_Pᵀ`.
#[derive(Default)]
struct Active {
    rows: Vec<usize>,
    forces: Vec<f64>,
    /// Row `i` has `i + 1` entries.
    lower: Vec<Vec<f64>>,
}

impl Active {
    /// Adds a row with no force; `false`, and nothing is added, where it depends on the others.
    fn push(&mut self, system: &System, entering: usize) -> bool {
        let row = &system.rows[entering];
        let products: Vec<f64> = self.rows.iter().map(|&p| system.dot_rows(row, &system.rows[p])).collect();
        let mut line = self.forward(&products);
        let whole = system.dot_rows(row, row);
        let rest = whole - line.iter().map(|x| x * x).sum::<f64>();
        if rest <= INDEPENDENT * whole {
            return false;
        }
        line.push(rest.sqrt());
        self.lower.push(line);
        self.rows.push(entering);
        self.forces.push(0.0);
        true
    }

    /// Moves the forces to the least-squares solution, dropping rows whose force would become negative. Whether
    /// `entering` was the first to go.
    fn solve(&mut self, system: &System, base: &DVector<f64>, entering: usize) -> bool {
        let mut entering_left = false;
        let mut is_first = true;
        while !self.rows.is_empty() {
            let against: Vec<f64> = self.rows.iter().map(|&p| -system.dot(&system.rows[p], base)).collect();
            let target = self.backward(&self.forward(&against));
            let share = |i: usize| self.forces[i] / (self.forces[i] - target[i]);
            let leaving = (0..target.len()).filter(|&i| target[i] <= 0.0).map(|i| (i, share(i)));
            let Some((leaving, share)) = leaving.min_by(|a, b| a.1.total_cmp(&b.1)) else {
                self.forces = target;
                break;
            };
            let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
            self.forces.iter_mut().zip(&target).for_each(|(force, to)| *force += share * (to - *force));
            entering_left |= is_first && self.rows[leaving] == entering;
            is_first = false;
            self.remove(leaving);
        }
        entering_left
    }

    fn forward(&self, right: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = Vec::with_capacity(right.len() + 1);
        for (line, b) in self.lower.iter().zip(right) {
            let known: f64 = line.iter().zip(&y).map(|(l, y)| l * y).sum();
            y.push((b - known) / line[line.len() - 1]);
        }
        y
    }

    fn backward(&self, right: &[f64]) -> Vec<f64> {
        let mut x = right.to_vec();
        for i in (0..x.len()).rev() {
            x[i] /= self.lower[i][i];
            let known = x[i];
            x[..i].iter_mut().zip(&self.lower[i]).for_each(|(x, l)| *x -= l * known);
        }
        x
    }

    /// Takes row `at` out of the factor; Givens rotations make it triangular again.
    fn remove(&mut self, at: usize) {
        self.rows.remove(at);
        self.forces.remove(at);
        self.lower.remove(at);
        for i in at..self.lower.len() {
            let (p, q) = (self.lower[i][i], self.lower[i][i + 1]);
            let length = p.hypot(q);
            let (cos, sin) = (p / length, q / length);
            for line in &mut self.lower[i..] {
                let (x, y) = (line[i], line[i + 1]);
                (line[i], line[i + 1]) = (cos * x + sin * y, cos * y - sin * x);
            }
            self.lower[i].pop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use microlp::{ComparisonOp, OptimizationDirection, Problem, SolveOutcome};
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn random_contacts(rng: &mut ChaCha8Rng, n_pieces: u32, n: usize) -> Vec<Contact> {
        let mut unit = || Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0;
        let mut contacts: Vec<Contact> = (0..n)
            .map(|_| Contact {
                a: PatchId(0),
                b: PatchId(0),
                point: unit(),
                normal: unit().normalize(),
                gap_mm: 0.0,
                area_mm2: 1.0,
            })
            .collect();
        for c in &mut contacts {
            c.a = PatchId(rng.random_range(0..n_pieces));
            c.b = PatchId((c.a.0 + rng.random_range(1..n_pieces)) % n_pieces);
        }
        contacts
    }

    /// The acceptance test's own program: the most that contacts can open, over their number.
    fn opening_by_simplex(system: &System) -> f64 {
        let mut base = DVector::zeros(system.n);
        system.rows.iter().for_each(|row| system.add(row, 1.0, &mut base));
        let mut problem = Problem::new(OptimizationDirection::Minimize);
        let x: Vec<_> = base.iter().map(|&c| problem.add_var(c, (-1.0, 1.0))).collect();
        for row in &system.rows {
            let mut dense = DVector::zeros(system.n);
            system.add(row, 1.0, &mut dense);
            let terms: Vec<_> = x.iter().copied().zip(dense.iter().copied()).filter(|t| t.1 != 0.0).collect();
            problem.add_constraint(&terms, ComparisonOp::Le, 0.0);
        }
        let SolveOutcome::Solution(best) = problem.solve().unwrap() else { panic!("no limit was set") };
        -best.objective() / system.rows.len() as f64
    }

    #[test]
    fn opening_motions_exist_exactly_where_the_linear_program_finds_one() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (mut n_locked, mut n_open) = (0, 0);
        for n in [5, 8, 10, 12, 13, 14, 16, 20, 24, 26, 28, 30, 34, 40, 60] {
            for n_pieces in [2, 3] {
                let contacts = random_contacts(&mut rng, n_pieces, n);
                let free: Vec<PatchId> = (1..n_pieces).map(PatchId).collect();
                let system = System::new(&contacts, &free, 1.0, Freedom::Rigid);
                let motion = system.opening_motion();
                let opening = opening_by_simplex(&system);
                assert_eq!(motion.is_some(), opening > 1e-6, "{n} contacts: {opening}");
                if let Some(x) = &motion {
                    n_open += 1;
                    let worst = system.rows.iter().map(|r| system.dot(r, x)).fold(f64::NEG_INFINITY, f64::max);
                    assert!(worst <= 1e-5 * x.norm(), "violates a contact by {worst}");
                } else {
                    n_locked += 1;
                }
            }
        }
        assert!(n_locked > 5 && n_open > 5, "{n_locked} locked, {n_open} open");
    }

    /// Contacts on the six faces of a box around `center`, normals outwards.
    fn box_contacts(a: u32, b: u32, center: Vec3) -> Vec<Contact> {
        let mut contacts = Vec::new();
        for (n, u, v) in [(Vec3::X, Vec3::Y, Vec3::Z), (Vec3::Y, Vec3::Z, Vec3::X), (Vec3::Z, Vec3::X, Vec3::Y)] {
            for (p, q) in [(0.9, 0.8), (0.9, -0.8), (-0.7, 0.8), (-0.7, -0.8)] {
                for side in [1.0, -1.0] {
                    let point = center + n * side + u * p + v * q;
                    contacts.push(Contact {
                        a: PatchId(a),
                        b: PatchId(b),
                        point,
                        normal: n * side,
                        gap_mm: 0.0,
                        area_mm2: 1.0,
                    });
                }
            }
        }
        contacts
    }

    #[test]
    fn a_caged_box_is_locked_and_without_one_face_it_leaves_there() {
        let mut contacts = box_contacts(1, 0, Vec3::new(3.0, 1.0, 2.0));
        assert!(free_motion(&contacts, 2, &[PatchId(0)], 1.0, Freedom::Rigid).is_empty());
        contacts.retain(|c| c.normal != Vec3::X);
        let moving = free_motion(&contacts, 2, &[PatchId(0)], 1.0, Freedom::Translations);
        assert_eq!(moving.len(), 1);
        assert!((moving[0].velocity - Vec3::X).length() < 1e-6);
        contacts.retain(|c| c.normal != Vec3::NEG_X);
        let sliding = free_motion(&contacts, 2, &[PatchId(0)], 1.0, Freedom::Translations);
        assert!(sliding[0].velocity.x.abs() > 0.999, "{sliding:?}");
    }

    #[test]
    fn forty_caged_pieces_with_twenty_thousand_contacts_are_decided_and_one_loose_pair_is_named() {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let mut contacts = Vec::new();
        for piece in 1..40u32 {
            let center = Vec3::new(rng.random(), rng.random(), rng.random()) * 2.0;
            for _ in 0..22 {
                let mut cage = box_contacts(piece, piece - 1, center);
                for c in &mut cage {
                    c.point += Vec3::new(rng.random(), rng.random(), rng.random()) * 0.05;
                }
                contacts.extend(cage);
            }
        }
        assert!(contacts.len() > 20_000);
        assert!(free_motion(&contacts, 40, &[PatchId(0)], 2.0, Freedom::Rigid).is_empty());
        contacts.retain(|c| c.a.0 != 38 || c.normal != Vec3::X);
        let moving = free_motion(&contacts, 40, &[PatchId(0)], 2.0, Freedom::Rigid);
        assert_eq!(moving.iter().map(|t| t.piece.0).collect::<Vec<_>>(), [38, 39]);
    }
}
