//! Play of pieces within their gaps: the greatest `c · x` with `A x ≤ g`.
//!
//! The allowed motions are a polyhedron. A corner is a point where as many independent limits meet as there
//! are unknowns. With `B` the rows of these limits and `λ = B⁻ᵀ c` their forces, the corner where all forces
//! push is the farthest one. This is the simplex method, with the inverse of `B` at hand.
//!
//! Few of many thousand contacts ever end a motion, and only those are examined in a step:
//! 1. *climb*: drop the limit that pulls most, move along its edge to the next examined one, until all push;
//! 2. find the contacts that the corner violates; if there are none, the search ends;
//! 3. *come back*: exchange a limit for the most violated one so that all keep pushing (the dual method),
//!    until none is violated; repeat from 1.
//!
//! Each part terminates. Gaps are widened by some nanometres, each by its own amount, so that no more limits
//! than necessary meet in a corner and every edge has a length. Step 3 perturbs the forces likewise. And
//! every round examines more contacts.
//!
//! Bounds may be computed late: until a contact is examined, only a lower limit of its bound needs to be
//! known.
//!
//! The next objective begins at the corner of the last one, so similar objectives should follow each other.
//! Box limits [`FAR_MM`] away give the first corner.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use shellock_geom::Vec3;

use super::system::{Row, System};

/// Distance at which motions count as unlimited, mm: any real gap ends them long before.
const FAR_MM: f64 = 1e3;
/// Share of a force or a speed that counts as zero.
const FLAT: f64 = 1e-9;
/// Greatest violation of a limit that is accepted, mm.
const OVERDRAWN_MM: f64 = 1e-9;
/// Greatest widening of gaps to tell them apart, mm; far below the reported accuracy.
const WIDENED_MM: f64 = 1e-6;
/// Perturbation of the forces, as a share of the objective; the next climb removes it.
const STRENGTHENED: f64 = 1e-6;
/// Number of exchanges after which the inverse is recomputed, against rounding.
const REFRESH: usize = 100;

/// One inequality: `wrench` at the unknowns from `plus` on, minus the same from `minus` on, stays below
/// `bound_mm`.
struct Limit {
    wrench: [f64; 6],
    plus: usize,
    minus: usize,
    bound_mm: f64,
}

impl Limit {
    /// Value of the limit's linear form for a motion. Motions are padded by [`PAD`] zeros, which represent
    /// pieces at rest.
    fn along(&self, motion: &[f64]) -> f64 {
        let (plus, minus) = (&motion[self.plus..][..6], &motion[self.minus..][..6]);
        (0..6).map(|k| self.wrench[k] * (plus[k] - minus[k])).sum()
    }
}

/// Number of zeros after each motion.
const PAD: usize = 6;

/// Corner of the allowed motions that the last objective led to.
#[derive(Clone)]
pub(crate) struct Corner<'a> {
    limits: &'a Limits<'a>,
    x: Vec<f64>,
    active: Vec<usize>,
    /// Edges of the corner: columns of the inverse of the matrix whose rows are those of `active`.
    edges: Vec<Vec<f64>>,
    looked_at: Vec<usize>,
    is_looked_at: Vec<bool>,
    /// Bounds of all limits, as far as they are known; mm.
    bounds_mm: Vec<f64>,
    /// True for rows whose bound is known.
    is_settled: Vec<bool>,
    n_exchanges: usize,
}

/// Limits of motions: first the contact rows, then for each unknown an upper and a lower side of the box.
pub(crate) struct Limits<'a> {
    n: usize,
    n_rows: usize,
    all: Vec<Limit>,
    /// Wrenches of the contact rows by coordinate, for the motion of a single piece: all rows are scanned in
    /// each round.
    of_single: Option<[Vec<f64>; 6]>,
    /// Late bound of a row, mm, infinite for none. Without it, bounds are those of `all`.
    late: Option<&'a LateBound<'a>>,
}

/// Bound of a contact row, mm; infinite if the row limits nothing.
pub(crate) type LateBound<'a> = dyn Fn(usize) -> f64 + Sync + 'a;

impl<'a> Limits<'a> {
    /// Limits contact rows by bounds that `late_mm` computes when they are examined. These are at least
    /// `gaps_mm` ≥ 0, one a row.
    pub fn late(system: &System, gaps_mm: &[f64], late_mm: &'a LateBound<'a>) -> Self {
        Self {
            late: Some(late_mm),
            ..Self::new(system, gaps_mm)
        }
    }

    /// Limits contact rows by `gaps_mm`, one a row, ≥ 0.
    pub fn new(system: &System, gaps_mm: &[f64]) -> Self {
        let n = system.n;
        let contact = |(i, (row, gap_mm)): (usize, (&Row, &f64))| Limit {
            wrench: row.wrench,
            plus: row.plus.unwrap_or(n),
            minus: row.minus.unwrap_or(n),
            bound_mm: gap_mm + WIDENED_MM * scatter(i),
        };
        let side = |i: usize| {
            let sign = if i.is_multiple_of(2) { 1.0 } else { -1.0 };
            Limit {
                wrench: [sign, 0.0, 0.0, 0.0, 0.0, 0.0],
                plus: i / 2,
                minus: n,
                bound_mm: FAR_MM,
            }
        };
        let contacts = system.rows.iter().zip(gaps_mm).enumerate().map(contact);
        let all: Vec<Limit> = contacts.chain((0..2 * n).map(side)).collect();
        let n_rows = system.rows.len();
        Self {
            n,
            n_rows,
            of_single: wrenches_of_single(n, &all[..n_rows]),
            all,
            late: None,
        }
    }

    /// Value of each contact row's linear form for a motion.
    fn along_all(&self, motion: &[f64]) -> Vec<f64> {
        let Some([a, b, c, d, e, f]) = &self.of_single else {
            let rows = &self.all[..self.n_rows];
            return rows.iter().map(|limit| limit.along(motion)).collect();
        };
        let x: [f64; 6] = std::array::from_fn(|k| motion[k]);
        // Plain zips, so that several rows are computed at once.
        let first = a
            .iter()
            .zip(b)
            .zip(c)
            .map(|((a, b), c)| a * x[0] + b * x[1] + c * x[2]);
        let then = first.zip(d).map(|(sum, d)| sum + d * x[3]);
        let rows = then.zip(e).zip(f).map(|((sum, e), f)| sum + e * x[4] + f * x[5]);
        rows.collect()
    }
}

/// Wrenches of `rows`, by coordinate, if they all limit a single piece that has six of `n` unknowns. A row
/// that the piece is the second of has the opposite sign.
fn wrenches_of_single(n: usize, rows: &[Limit]) -> Option<[Vec<f64>; 6]> {
    let is_single = |row: &Limit| [(0, n), (n, 0)].contains(&(row.plus, row.minus));
    let signed = |row: &Limit, k: usize| {
        if row.plus == 0 {
            row.wrench[k]
        } else {
            -row.wrench[k]
        }
    };
    (n == 6 && rows.iter().all(is_single))
        .then(|| std::array::from_fn(|k| rows.iter().map(|row| signed(row, k)).collect()))
}

/// Number in [0.5, 1) for each `i`, irregularly distributed: the fractions of multiples of the golden ratio.
fn scatter(i: usize) -> f64 {
    0.5 + 0.5 * ((i + 1) as f64 * 0.618_033_988_749_894_9).fract()
}

/// Lengths of the displacement, mm, and of the rotation, rad, in the motions of a single piece that go
/// farthest; `None` where nothing limits them. Rotations count as displacements at `length_mm`. How they are
/// sought: [`Span::farthest`].
pub(crate) fn farthest_of_piece(corner: &mut Corner<'_>, length_mm: f64) -> [Option<f64>; 2] {
    let n = corner.limits.n;
    [(0, 1.0), (3, 1.0 / length_mm)].map(|(from, scale)| Span { n, from, scale }.farthest(corner))
}

/// Vector of three consecutive unknowns of a motion: a displacement or a rotation.
#[derive(Clone, Copy, Debug)]
struct Span {
    /// Number of unknowns of a motion.
    n: usize,
    /// First of the three unknowns.
    from: usize,
    /// Value of the vector's components per unit of the unknowns.
    scale: f64,
}

impl Span {
    /// Value of the vector for a motion.
    fn of(&self, motion: &[f64]) -> Vec3 {
        self.scale * Vec3::from_slice(&motion[self.from..self.from + 3])
    }

    /// Linear form of the vector's component along `d`.
    fn along(&self, d: Vec3) -> DVector<f64> {
        let mut form = DVector::zeros(self.n);
        (0..3).for_each(|k| form[self.from + k] = self.scale * d[k]);
        form
    }

    /// Greatest length of the vector within the limits of `corner`, sought from the ends of the coordinate
    /// axes; `None` if it is unlimited.
    ///
    /// The length belongs to a motion that is allowed, so it is no more than the greatest one. In random
    /// contacts it is nine tenths of the greatest one at least (tests).
    fn farthest(&self, corner: &mut Corner<'_>) -> Option<f64> {
        let mut longest: f64 = 0.0;
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for towards in [axis, -axis] {
                corner.farthest(&self.along(towards))?;
                let end = self.of(corner.motion());
                longest = longest.max(corner.longest(self, end)?);
            }
        }
        Some(longest)
    }
}

impl<'a> Corner<'a> {
    /// Creates a corner to start from.
    pub fn new(limits: &'a Limits<'a>) -> Self {
        let Limits { n, n_rows, .. } = *limits;
        let edge = |i: usize| (0..n + PAD).map(|k| f64::from(u8::from(i == k))).collect();
        let mut corner = Self {
            limits,
            x: [vec![FAR_MM; n], vec![0.0; PAD]].concat(),
            active: (0..n).map(|i| n_rows + 2 * i).collect(),
            edges: (0..n).map(edge).collect(),
            looked_at: (n_rows..n_rows + 2 * n).collect(),
            is_looked_at: vec![false; n_rows],
            bounds_mm: limits.all.iter().map(|limit| limit.bound_mm).collect(),
            is_settled: vec![limits.late.is_none(); n_rows],
            n_exchanges: 0,
        };
        // All sides that meet here push against this objective.
        corner.go_farthest(&vec![1.0; n]);
        corner
    }

    /// Greatest `objective · x`; `None` if it is unlimited.
    pub fn farthest(&mut self, objective: &DVector<f64>) -> Option<f64> {
        self.maximise(objective)
            .map(|_| dot(objective.as_slice(), &self.x))
    }

    /// Lengthens a vector that is linear in the motion, [`Span::of`], as far as the limits allow. Each step
    /// goes farthest along the vector that the last one reached, beginning with `start`. `None` if it is
    /// unlimited.
    ///
    /// The result is the length for a motion that is allowed, and no other motion along it goes farther. A
    /// longer one may exist in another direction.
    fn longest(&mut self, span: &Span, start: Vec3) -> Option<f64> {
        /// Steps after which the length hardly grows.
        const MOST_STEPS: usize = 12;
        /// Growth of the length, as a share, below which steps end.
        const LEAST_GROWTH: f64 = 1e-3;
        let mut reached = start;
        for _ in 0..MOST_STEPS {
            let before = reached.length();
            if before == 0.0 {
                break;
            }
            self.farthest(&span.along(reached / before))?;
            let next = span.of(self.motion());
            if next.length() <= before * (1.0 + LEAST_GROWTH) {
                break;
            }
            reached = next;
        }
        Some(reached.length())
    }

    /// Rows with the forces that prove the greatest `objective · x`: they add up to the objective, except for
    /// rounding. `None` if it is unlimited.
    pub fn maximise(&mut self, objective: &DVector<f64>) -> Option<Vec<(usize, f64)>> {
        self.go_farthest(objective.as_slice());
        self.corner_forces(objective)
    }

    /// Like [`Corner::maximise`], but only with rows that were examined before: the bound is no tighter, and
    /// faster to find.
    pub fn maximise_from_cache(&mut self, objective: &DVector<f64>) -> Option<Vec<(usize, f64)>> {
        self.climb(objective.as_slice());
        self.come_back(objective.as_slice());
        self.climb(objective.as_slice());
        self.corner_forces(objective)
    }

    /// Rows that have been examined.
    pub fn looked_at(&self) -> impl Iterator<Item = usize> + '_ {
        self.looked_at
            .iter()
            .copied()
            .filter(|&limit| limit < self.limits.n_rows)
    }

    /// Motion at the present corner.
    pub fn motion(&self) -> &[f64] {
        &self.x[..self.limits.n]
    }

    /// Rows with forces in the corner that was found for an objective.
    fn corner_forces(&self, objective: &DVector<f64>) -> Option<Vec<(usize, f64)>> {
        let forces = self.forces(objective.as_slice());
        let least = STRENGTHENED * objective.norm();
        let pushing = || self.active.iter().copied().zip(forces.iter().copied());
        let has_end = pushing().all(|(limit, force)| limit < self.limits.n_rows || force <= least);
        has_end.then(|| {
            pushing()
                .filter(|(limit, force)| *limit < self.limits.n_rows && *force > 0.0)
                .collect()
        })
    }

    fn go_farthest(&mut self, objective: &[f64]) {
        self.climb(objective);
        while self.look_at_overdrawn() {
            self.come_back(objective);
            self.climb(objective);
        }
    }

    /// Moves from a corner that all examined limits allow to the farthest such corner.
    fn climb(&mut self, objective: &[f64]) {
        while let Some(leaving) = self.steepest_limit(&self.forces(objective)) {
            let way: Vec<f64> = self.edges[leaving].iter().map(|x| -x).collect();
            let Some(entering) = self.first_met(&way) else {
                break;
            };
            self.exchange(leaving, entering);
        }
    }

    /// Moves from a corner whose limits all push to the farthest one that all examined limits allow, or one
    /// near it.
    fn come_back(&mut self, objective: &[f64]) {
        let mut objective = objective.to_vec();
        let more = STRENGTHENED * dot(&objective, &objective).sqrt();
        for (i, &limit) in self.active.iter().enumerate() {
            self.add_row(limit, more * scatter(i), &mut objective);
        }
        while let Some(entering) = self.most_overdrawn() {
            let Some(leaving) = self.first_release(&self.forces(&objective), entering) else {
                break;
            };
            self.exchange(leaving, entering);
        }
    }

    /// Forces of the active limits against the objective.
    fn forces(&self, objective: &[f64]) -> Vec<f64> {
        self.edges.iter().map(|edge| dot(objective, edge)).collect()
    }

    /// Index of the limit along whose edge the objective rises most steeply.
    fn steepest_limit(&self, forces: &[f64]) -> Option<usize> {
        let least = -FLAT * forces.iter().fold(0.0, |most: f64, f| most.max(f.abs()));
        let pulling = (0..forces.len()).filter(|&i| forces[i] < least);
        let steepness = |i: usize| forces[i].powi(2) / dot(&self.edges[i], &self.edges[i]);
        pulling
            .map(|i| (i, steepness(i)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|p| p.0)
    }

    /// First limit that is met along `way`; of those met at the same place, the one met most squarely.
    fn first_met(&self, way: &[f64]) -> Option<usize> {
        let least_speed = FLAT * dot(way, way).sqrt();
        let met = self.looked_at.iter().map(|&i| (i, self.limits.all[i].along(way)));
        let met = met.filter(|&(_, speed)| speed > least_speed);
        let met: Vec<(usize, f64, f64)> = met
            .map(|(i, speed)| (i, speed, self.room_mm(i).max(0.0)))
            .collect();
        let end = met
            .iter()
            .map(|&(_, speed, room)| (room + OVERDRAWN_MM) / speed)
            .fold(f64::INFINITY, f64::min);
        let first = met.into_iter().filter(|&(_, speed, room)| room / speed <= end);
        first.max_by(|a, b| a.1.total_cmp(&b.1)).map(|m| m.0)
    }

    /// Distance from the corner to the limit, mm.
    fn room_mm(&self, limit: usize) -> f64 {
        self.bounds_mm[limit] - self.limits.all[limit].along(&self.x)
    }

    /// Examined limit that the corner violates most.
    fn most_overdrawn(&self) -> Option<usize> {
        let overdrawn = self
            .looked_at
            .iter()
            .map(|&i| (i, self.room_mm(i)))
            .filter(|o| o.1 < -OVERDRAWN_MM);
        overdrawn.min_by(|a, b| a.1.total_cmp(&b.1)).map(|o| o.0)
    }

    /// Index of the limit that loses its force first as `entering` begins to push.
    fn first_release(&self, forces: &[f64], entering: usize) -> Option<usize> {
        let shares = self.shares(entering);
        let least = FLAT * shares.iter().fold(0.0, |most: f64, s| most.max(s.abs()));
        let relieved: Vec<usize> = (0..shares.len()).filter(|&i| shares[i] > least).collect();
        let slack = FLAT * forces.iter().fold(0.0, |most: f64, f| most.max(f.abs()));
        let end = relieved
            .iter()
            .map(|&i| (forces[i].max(0.0) + slack) / shares[i])
            .fold(f64::INFINITY, f64::min);
        let first = relieved
            .into_iter()
            .filter(|&i| forces[i].max(0.0) / shares[i] <= end);
        first.max_by(|&i, &k| shares[i].total_cmp(&shares[k]))
    }

    /// Coefficients of the limit's row as a sum of the active ones.
    fn shares(&self, limit: usize) -> Vec<f64> {
        self.edges
            .iter()
            .map(|edge| self.limits.all[limit].along(edge))
            .collect()
    }

    /// Adds `factor` times the limit's row to `sum`.
    fn add_row(&self, limit: usize, factor: f64, sum: &mut [f64]) {
        let limit = &self.limits.all[limit];
        for (from, sign) in [(limit.plus, factor), (limit.minus, -factor)] {
            sum.iter_mut()
                .skip(from)
                .zip(limit.wrench)
                .for_each(|(sum, w)| *sum += sign * w);
        }
    }

    /// Replaces an active limit by another, and moves to the corner where they all meet.
    fn exchange(&mut self, leaving: usize, entering: usize) {
        let shares = self.shares(entering);
        self.active[leaving] = entering;
        let way: Vec<f64> = self.edges[leaving].iter().map(|x| x / shares[leaving]).collect();
        for (edge, &share) in self
            .edges
            .iter_mut()
            .zip(&shares)
            .filter(|(_, share)| **share != 0.0)
        {
            edge.iter_mut().zip(&way).for_each(|(x, w)| *x -= share * w);
        }
        self.edges[leaving] = way;
        self.n_exchanges += 1;
        if self.n_exchanges.is_multiple_of(REFRESH) {
            self.refresh();
        }
        self.x.fill(0.0);
        for (edge, &limit) in self.edges.iter().zip(&self.active) {
            let bound_mm = self.bounds_mm[limit];
            self.x.iter_mut().zip(edge).for_each(|(x, e)| *x += bound_mm * e);
        }
    }

    /// Recomputes the inverse, unless rounding has made the matrix singular.
    fn refresh(&mut self) {
        let n = self.limits.n;
        let mut rows = DMatrix::zeros(n, n);
        for (i, &limit) in self.active.iter().enumerate() {
            let mut row = vec![0.0; n];
            self.add_row(limit, 1.0, &mut row);
            rows.row_mut(i).copy_from_slice(&row);
        }
        if let Some(inverse) = rows.try_inverse() {
            for (i, edge) in self.edges.iter_mut().enumerate() {
                edge[..n].copy_from_slice(inverse.column(i).as_slice());
            }
        }
    }

    /// Examines, for each pair of pieces, the contact that the corner violates most; its neighbours would
    /// limit the motion equally. Returns true if there was any that had not been examined before.
    fn look_at_overdrawn(&mut self) -> bool {
        let mut overdrawn = BTreeMap::<(usize, usize), Vec<(f64, usize)>>::new();
        for (i, along) in self.limits.along_all(&self.x).into_iter().enumerate() {
            let room_mm = self.bounds_mm[i] - along;
            if room_mm < -OVERDRAWN_MM && !self.is_looked_at[i] {
                let Limit { plus, minus, .. } = self.limits.all[i];
                overdrawn.entry((plus, minus)).or_default().push((room_mm, i));
            }
        }
        let mut has_any = false;
        for mut of_pair in overdrawn.into_values() {
            // A late bound may release a contact; then the next one is tried.
            while let Some(at) = (0..of_pair.len()).min_by(|&i, &k| of_pair[i].0.total_cmp(&of_pair[k].0)) {
                let (room_mm, i) = of_pair[at];
                if room_mm >= -OVERDRAWN_MM {
                    break;
                }
                if self.is_settled[i] {
                    self.look_at(i);
                    has_any = true;
                    break;
                }
                self.settle(i);
                of_pair[at].0 = self.room_mm(i);
            }
        }
        has_any
    }

    /// Adds a row to the examined ones.
    pub fn look_at(&mut self, row: usize) {
        self.settle(row);
        if !self.is_looked_at[row] {
            self.is_looked_at[row] = true;
            self.looked_at.push(row);
        }
    }

    /// Computes the late bound of the row.
    fn settle(&mut self, row: usize) {
        if let Some(late) = self.limits.late.filter(|_| !self.is_settled[row]) {
            self.bounds_mm[row] = late(row) + WIDENED_MM * scatter(row);
            self.is_settled[row] = true;
        }
    }
}

/// Scalar product, up to the end of the shorter vector.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
