//! The forces in closed contacts: bodies are joined two at a time.
//!
//! ```text
//!   (W₁ + W₂ + … + 1) μ = b      Wᵢ: how contacts give way because body i does; a contact is between two bodies, so when
//!                                they are joined its row is complete: it is eliminated, and the two have become one
//! ```
//!
//! Fronts are small and dense, and hold the closed contacts alone.

use shellock_geom::sparse::{SparseError, eliminate_leading};

/// What a place of a front costs besides the elimination, for clearing and adding up, in multiplications.
const COST_OF_PLACE: usize = 30;

/// A body as the contacts feel it.
#[derive(Clone, Debug)]
pub(super) struct Body {
    /// The contacts that it touches, ascending.
    pub contacts: Vec<u32>,
    /// How each of them opens under forces in the others, by columns; symmetric.
    pub compliance: Vec<f64>,
}

/// One joining: contacts that nothing else touches are eliminated, the others are kept.
#[derive(Clone, Debug, Default)]
struct Joining {
    bodies: Vec<usize>,
    /// Earlier joinings.
    joined: Vec<usize>,
    /// Ascending, and all before those kept.
    eliminated: Vec<u32>,
    /// Ascending.
    kept: Vec<u32>,
}

/// The closed contacts of a joining, ascending, and their matrix: the lower triangle by columns, with the
/// right-hand side as the last row.
#[derive(Clone, Debug, Default)]
struct Front {
    contacts: Vec<u32>,
    n_eliminated: usize,
    values: Vec<f64>,
}

/// All joinings in order.
#[derive(Debug, Default)]
pub(super) struct Joinings {
    joinings: Vec<Joining>,
}

/// The memory that joinings need.
#[derive(Clone, Debug, Default)]
pub(super) struct Fronts {
    fronts: Vec<Front>,
    /// Place of each contact in the front at hand.
    place: Vec<usize>,
}

impl Joinings {
    /// How bodies with these contacts (ascending) are joined, always the two that take the least work next;
    /// and the order in which the contacts are eliminated. Joinings number them in that order.
    pub fn new(bodies: Vec<Vec<u32>>, n_contacts: usize) -> (Self, Vec<u32>) {
        let mut n_touching = vec![0; n_contacts];
        bodies.iter().flatten().for_each(|&c| n_touching[c as usize] += 1);
        let mut joinings: Vec<Joining> = Vec::with_capacity(2 * bodies.len());
        let mut live: Vec<Joining> = Vec::with_capacity(bodies.len());
        for (i, body) in bodies.into_iter().enumerate() {
            let (kept, eliminated): (Vec<u32>, Vec<u32>) =
                body.into_iter().partition(|&c| n_touching[c as usize] > 1);
            live.push(Joining {
                bodies: vec![i],
                joined: vec![],
                eliminated,
                kept,
            });
        }
        while let Some([a, b]) = cheapest_pair(&live) {
            let (second, first) = (live.remove(b), live.remove(a));
            let (eliminated, new): (Vec<u32>, Vec<u32>) = second
                .kept
                .iter()
                .partition(|c| first.kept.binary_search(c).is_ok());
            let others = first
                .kept
                .iter()
                .copied()
                .filter(|c| eliminated.binary_search(c).is_err());
            let mut kept: Vec<u32> = others.chain(new).collect();
            kept.sort_unstable();
            let mut joint = Joining {
                bodies: vec![],
                joined: vec![],
                eliminated,
                kept,
            };
            for piece in [first, second] {
                joint.take(piece, &mut joinings);
            }
            live.push(joint);
        }
        joinings.extend(live);

        let order: Vec<u32> = joinings.iter().flat_map(|j| &j.eliminated).copied().collect();
        let mut rank = vec![0; n_contacts];
        (0..).zip(&order).for_each(|(i, &c)| rank[c as usize] = i);
        for joining in &mut joinings {
            for contacts in [&mut joining.eliminated, &mut joining.kept] {
                contacts.iter_mut().for_each(|c| *c = rank[*c as usize]);
                contacts.sort_unstable();
            }
        }
        (Self { joinings }, order)
    }

    /// The same where each contact is `n` that touch the same bodies: contact c becomes those from n c on.
    pub fn of_groups(mut self, n: u32) -> Self {
        for joining in &mut self.joinings {
            for contacts in [&mut joining.eliminated, &mut joining.kept] {
                *contacts = contacts.iter().flat_map(|c| n * c..n * (c + 1)).collect();
            }
        }
        self
    }

    /// The solution for the contacts that are closed, 0 for the others.
    pub fn solve(
        &self,
        Fronts { fronts, place }: &mut Fronts,
        bodies: &[impl AsRef<Body>],
        is_closed: &[bool],
        side: &[f64],
    ) -> Result<Vec<f64>, SparseError> {
        fronts.resize_with(self.joinings.len(), Front::default);
        place.resize(side.len(), 0);
        for (i, joining) in self.joinings.iter().enumerate() {
            let (done, rest) = fronts.split_at_mut(i);
            let front = &mut rest[0];
            front.gather(joining, is_closed, side);
            front
                .contacts
                .iter()
                .enumerate()
                .for_each(|(i, &c)| place[c as usize] = i);
            joining
                .bodies
                .iter()
                .for_each(|b| front.add_body(bodies[*b].as_ref(), is_closed, place));
            joining
                .joined
                .iter()
                .for_each(|j| front.add_joint(&done[*j], place));
            if front.n_eliminated > 0 {
                eliminate_leading(&mut front.values, front.contacts.len() + 1, front.n_eliminated)?;
            }
        }
        let mut solution = vec![0.0; side.len()];
        fronts.iter().rev().for_each(|f| f.substitute(&mut solution));
        Ok(solution)
    }
}

/// Work of a joining with a front of `n` contacts of which `n_kept` are kept, in multiplications.
fn work(n: usize, n_kept: usize) -> usize {
    (n.pow(3) - n_kept.pow(3)) / 3 + COST_OF_PLACE * n.pow(2)
}

/// Which two bodies that share contacts are joined with the least work.
fn cheapest_pair(live: &[Joining]) -> Option<[usize; 2]> {
    let n_shared = |x: &[u32], y: &[u32]| x.iter().filter(|c| y.binary_search(c).is_ok()).count();
    let mut best: Option<(usize, [usize; 2])> = None;
    for (a, Joining { kept: x, .. }) in live.iter().enumerate() {
        for (b, Joining { kept: y, .. }) in live.iter().enumerate().skip(a + 1) {
            let shared = n_shared(x, y);
            let front = x.len() + y.len() - shared;
            let work = work(front, front - shared);
            if shared > 0 && best.is_none_or(|(least, _)| work < least) {
                best = Some((work, [a, b]));
            }
        }
    }
    best.map(|b| b.1)
}

impl Joining {
    fn n_contacts(&self) -> usize {
        self.eliminated.len() + self.kept.len()
    }

    /// Makes `piece` a part of this joining: after it, or together with it where that is less work.
    fn take(&mut self, piece: Self, joinings: &mut Vec<Self>) {
        let (n, n_kept, n_more) = (self.n_contacts(), self.kept.len(), piece.eliminated.len());
        let apart = work(piece.n_contacts(), piece.kept.len()) + work(n, n_kept);
        if work(n + n_more, n_kept) <= apart {
            self.bodies.extend(piece.bodies);
            self.joined.extend(piece.joined);
            self.eliminated.extend(piece.eliminated);
        } else {
            joinings.push(piece);
            self.joined.push(joinings.len() - 1);
        }
    }
}

impl Front {
    /// Empties the front and takes the closed contacts of `joining`, with the 1 and the right-hand side of
    /// those that it eliminates.
    fn gather(&mut self, joining: &Joining, is_closed: &[bool], side: &[f64]) {
        let closed = |of: &[u32]| {
            of.iter()
                .copied()
                .filter(|&c| is_closed[c as usize])
                .collect::<Vec<u32>>()
        };
        self.contacts = closed(&joining.eliminated);
        self.n_eliminated = self.contacts.len();
        self.contacts.extend(closed(&joining.kept));
        let n = self.contacts.len();
        self.values.clear();
        self.values.resize((n + 1) * (n + 1), 0.0);
        for (i, &c) in self.contacts[..self.n_eliminated].iter().enumerate() {
            self.values[(n + 1) * i + i] = 1.0;
            self.values[(n + 1) * i + n] = side[c as usize];
        }
    }

    fn add_body(&mut self, body: &Body, is_closed: &[bool], place: &[usize]) {
        let (n, m) = (self.contacts.len() + 1, body.contacts.len());
        let closed: Vec<(usize, usize)> = (body.contacts.iter().enumerate())
            .filter(|(_, c)| is_closed[**c as usize])
            .map(|(i, c)| (i, place[*c as usize]))
            .collect();
        for (j, &(from, column)) in closed.iter().enumerate() {
            let source = &body.compliance[m * from..m * (from + 1)];
            let target = &mut self.values[n * column..n * (column + 1)];
            closed[j..].iter().for_each(|&(i, row)| target[row] += source[i]);
        }
    }

    fn add_joint(&mut self, joint: &Self, place: &[usize]) {
        let (n, m, first) = (
            self.contacts.len() + 1,
            joint.contacts.len() + 1,
            joint.n_eliminated,
        );
        let mut rows: Vec<usize> = joint.contacts[first..]
            .iter()
            .map(|c| place[*c as usize])
            .collect();
        rows.push(n - 1);
        for (j, &column) in rows[..rows.len() - 1].iter().enumerate() {
            let source = &joint.values[m * (first + j) + first + j..m * (first + j + 1)];
            let target = &mut self.values[n * column..n * (column + 1)];
            rows[j..]
                .iter()
                .zip(source)
                .for_each(|(row, value)| target[*row] += value);
        }
    }

    /// Solves for the eliminated contacts; those kept are solved already.
    fn substitute(&self, solution: &mut [f64]) {
        let n = self.contacts.len();
        let mut x: Vec<f64> = self.contacts.iter().map(|c| solution[*c as usize]).collect();
        for i in (0..self.n_eliminated).rev() {
            let column = &self.values[(n + 1) * i..(n + 1) * (i + 1)];
            let known: f64 = column[i + 1..n].iter().zip(&x[i + 1..]).map(|(l, x)| l * x).sum();
            x[i] = (column[n] - known) / column[i];
            solution[self.contacts[i] as usize] = x[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use std::sync::Arc;

    use super::*;

    /// Seven bodies in a ring with a chord, 31 contacts between them and 5 that touch one body alone.
    fn ring() -> (Vec<Vec<u32>>, u32) {
        let mut touched = vec![Vec::new(); 7];
        let pairs = (0..7).map(|i| [i, (i + 1) % 7]).chain([[0, 3]]);
        let mut n = 0;
        for (i, pair) in pairs.enumerate() {
            for _ in 0..3 + i % 3 {
                pair.iter().for_each(|&b: &usize| touched[b].push(n));
                n += 1;
            }
        }
        (0..5).for_each(|i| touched[6 - i].push(n + i as u32));
        (touched, n + 5)
    }

    #[test]
    fn joined_bodies_bear_what_the_whole_system_does_whatever_is_closed() {
        let (touched, n) = ring();
        let (joinings, order) = Joinings::new(touched.clone(), n as usize);
        let mut fronts = Fronts::default();
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..n).collect::<Vec<_>>());
        let wave = |i: usize, j: usize| ((7 * i + 13 * j + i * j) as f64).sin();
        let bodies: Vec<Arc<Body>> = (touched.iter())
            .map(|own| {
                let contacts: Vec<u32> = (0..n).filter(|i| own.contains(&order[*i as usize])).collect();
                let root = DMatrix::from_fn(contacts.len(), contacts.len(), wave);
                Arc::new(Body {
                    contacts,
                    compliance: (&root * root.transpose()).as_slice().to_vec(),
                })
            })
            .collect();
        let side: Vec<f64> = (0..n as usize).map(|i| wave(i, 2)).collect();
        for modulus in [1, 2, 3, 100] {
            let is_closed: Vec<bool> = (0..n).map(|i| i % modulus == 0).collect();
            let found = joinings.solve(&mut fronts, &bodies, &is_closed, &side).unwrap();
            let mut whole = DMatrix::<f64>::identity(n as usize, n as usize);
            for body in &bodies {
                let m = body.contacts.len();
                for (k, value) in body.compliance.iter().enumerate() {
                    let [row, column] = [k % m, k / m].map(|i| body.contacts[i] as usize);
                    whole[(row, column)] += if is_closed[row] && is_closed[column] {
                        *value
                    } else {
                        0.0
                    };
                }
            }
            let masked = DVector::from_fn(n as usize, |i, _| if is_closed[i] { side[i] } else { 0.0 });
            let expected = whole.cholesky().unwrap().solve(&masked);
            assert!((expected - DVector::from_vec(found)).amax() < 1e-12);
        }
    }
}
