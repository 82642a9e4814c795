//! Solver for the contact forces: bodies are joined two at a time.
//!
//! ```text
//!   (W₁ + W₂ + … + 1) μ = b      Wᵢ: compliance of the contacts due to body i; a contact is between two
//!                                bodies, so its row is complete when they are joined: then it is eliminated
//! ```
//!
//! Contacts that carry load both ways are eliminated once for each plan, whatever the loads. Contacts that
//! only push are kept to the end; their compliance under each other's forces is a small dense matrix.

use std::sync::Arc;

use shellock_geom::sparse::{SparseError, eliminate_first};

use super::contact::Law;

/// Overhead of an entry of a front besides the elimination, for clearing and adding, in multiplications.
const COST_OF_PLACE: usize = 30;

/// Body as the contacts see it.
#[derive(Clone, Debug)]
pub(super) struct ContactBody {
    /// Contacts that the body touches, ascending.
    pub contacts: Vec<u32>,
    /// Opening of each contact under forces in the others, column-major; symmetric.
    pub compliance: Vec<f64>,
}

/// One joining step. Contacts that no other body touches are eliminated, the others are kept.
#[derive(Clone, Debug, Default)]
struct Joining {
    bodies: Vec<usize>,
    /// Indices of earlier joinings.
    earlier: Vec<usize>,
    /// Eliminated contacts, ascending, all before the kept ones.
    inner: Vec<u32>,
    /// Kept contacts, in ascending order.
    outer: Vec<u32>,
}

/// Contacts of a joining and their matrix, its lower triangle column-major; the leading contacts are
/// eliminated.
#[derive(Clone, Debug, Default)]
struct Front {
    contacts: Vec<u32>,
    n_eliminated: usize,
    values: Vec<f64>,
}

/// All joining steps, in order.
#[derive(Debug, Default)]
pub(super) struct Joinings {
    joinings: Vec<Joining>,
}

/// System that remains when the contacts that carry load both ways are eliminated.
#[derive(Debug)]
pub(super) struct Reduced {
    fronts: Vec<Arc<Front>>,
    /// Contacts that only push, ascending.
    pub pushes: Vec<u32>,
    /// Opening of each of them under forces in the others, column-major; symmetric.
    pub compliance: Vec<f64>,
}

impl Joinings {
    /// Plans the joining of bodies with these contacts (ascending), always the cheapest pair next. Also
    /// returns the order in which the contacts are eliminated; joinings number them in that order.
    pub fn new(bodies: Vec<Vec<u32>>, n_contacts: usize) -> (Self, Vec<u32>) {
        let mut n_touching = vec![0; n_contacts];
        bodies.iter().flatten().for_each(|&c| n_touching[c as usize] += 1);
        let mut joinings: Vec<Joining> = Vec::with_capacity(2 * bodies.len());
        let mut live: Vec<Joining> = Vec::with_capacity(bodies.len());
        for (i, body) in bodies.into_iter().enumerate() {
            let (outer, inner): (Vec<u32>, Vec<u32>) =
                body.into_iter().partition(|&c| n_touching[c as usize] > 1);
            live.push(Joining {
                bodies: vec![i],
                earlier: vec![],
                inner,
                outer,
            });
        }
        while let Some([a, b]) = cheapest_pair(&live) {
            let (second, first) = (live.remove(b), live.remove(a));
            let (inner, new): (Vec<u32>, Vec<u32>) = second
                .outer
                .iter()
                .partition(|c| first.outer.binary_search(c).is_ok());
            let others = first
                .outer
                .iter()
                .copied()
                .filter(|c| inner.binary_search(c).is_err());
            let mut outer: Vec<u32> = others.chain(new).collect();
            outer.sort_unstable();
            let mut joint = Joining {
                bodies: vec![],
                earlier: vec![],
                inner,
                outer,
            };
            for piece in [first, second] {
                joint.take(piece, &mut joinings);
            }
            live.push(joint);
        }
        joinings.extend(live);

        let order: Vec<u32> = joinings.iter().flat_map(|j| &j.inner).copied().collect();
        let mut rank = vec![0; n_contacts];
        (0..).zip(&order).for_each(|(i, &c)| rank[c as usize] = i);
        for joining in &mut joinings {
            for contacts in [&mut joining.inner, &mut joining.outer] {
                contacts.iter_mut().for_each(|c| *c = rank[*c as usize]);
                contacts.sort_unstable();
            }
        }
        (Self { joinings }, order)
    }

    /// Expands each contact to `n` contacts that touch the same bodies: contact c becomes contacts n c to n
    /// (c + 1) − 1.
    pub fn of_groups(mut self, n: u32) -> Self {
        for joining in &mut self.joinings {
            for contacts in [&mut joining.inner, &mut joining.outer] {
                *contacts = contacts.iter().flat_map(|c| n * c..n * (c + 1)).collect();
            }
        }
        self
    }

    /// Joins all bodies. Fronts of bodies that are unchanged since `before` are reused.
    pub fn reduce(
        &self,
        bodies: &[Arc<ContactBody>],
        laws: &[Law],
        before: Option<(&[Arc<ContactBody>], &Reduced)>,
    ) -> Result<Reduced, SparseError> {
        let mut fronts: Vec<Arc<Front>> = Vec::with_capacity(self.joinings.len());
        let mut place = vec![0; laws.len()];
        let mut is_root = vec![true; self.joinings.len()];
        for (i, joining) in self.joinings.iter().enumerate() {
            joining.earlier.iter().for_each(|j| is_root[*j] = false);
            if let Some((old, reduced)) = before
                && joining.bodies.iter().all(|b| Arc::ptr_eq(&bodies[*b], &old[*b]))
                && (joining.earlier.iter()).all(|j| Arc::ptr_eq(&fronts[*j], &reduced.fronts[*j]))
            {
                fronts.push(reduced.fronts[i].clone());
                continue;
            }
            let mut front = Front::of(joining, bodies, &fronts, laws);
            (0..)
                .zip(&front.contacts)
                .for_each(|(i, c)| place[*c as usize] = i);
            for b in &joining.bodies {
                front.add_body(&bodies[*b], laws, &place);
            }
            for j in &joining.earlier {
                front.add_joint(&fronts[*j], &place);
            }
            if front.n_eliminated > 0 {
                eliminate_first(&mut front.values, front.contacts.len(), front.n_eliminated)?;
            }
            fronts.push(Arc::new(front));
        }
        let pushes: Vec<u32> = (0..laws.len() as u32)
            .filter(|c| laws[*c as usize] == Law::Push)
            .collect();
        (0..).zip(&pushes).for_each(|(i, c)| place[*c as usize] = i);
        let n = pushes.len();
        let mut compliance = vec![0.0; n * n];
        for root in fronts.iter().zip(is_root).filter(|(_, is)| *is).map(|(f, _)| f) {
            let (m, first) = (root.contacts.len(), root.n_eliminated);
            for j in first..m {
                let column = place[root.contacts[j] as usize];
                for i in j..m {
                    let (row, value) = (place[root.contacts[i] as usize], root.values[m * j + i]);
                    compliance[n * column + row] += value;
                    if i > j {
                        compliance[n * row + column] += value;
                    }
                }
            }
        }
        Ok(Reduced {
            fronts,
            pushes,
            compliance,
        })
    }
}

impl Reduced {
    /// Eliminates forwards. On return the gaps of the pushing contacts are those left when the others are
    /// closed. The entries of the others hold intermediate values for [`finish`](Self::finish).
    pub fn begin(&self, gaps: &mut [f64]) {
        for front in &self.fronts {
            let n = front.contacts.len();
            for i in 0..front.n_eliminated {
                let column = &front.values[n * i..n * (i + 1)];
                let at = front.contacts[i] as usize;
                gaps[at] /= column[i];
                let own = gaps[at];
                for (c, l) in front.contacts[i + 1..].iter().zip(&column[i + 1..]) {
                    gaps[*c as usize] -= l * own;
                }
            }
        }
    }

    /// Substitutes backwards. Takes the intermediate values of [`begin`](Self::begin) and the forces of the
    /// pushing contacts in their entries; leaves the forces of all contacts.
    pub fn finish(&self, borne: &mut [f64]) {
        for front in self.fronts.iter().rev() {
            let n = front.contacts.len();
            for i in (0..front.n_eliminated).rev() {
                let column = &front.values[n * i..n * (i + 1)];
                let known: f64 = (front.contacts[i + 1..].iter().zip(&column[i + 1..]))
                    .map(|(c, l)| l * borne[*c as usize])
                    .sum();
                let at = front.contacts[i] as usize;
                borne[at] = (borne[at] - known) / column[i];
            }
        }
    }
}

/// Cost of a joining with a front of `n` contacts of which `n_kept` are kept, in multiplications.
fn work(n: usize, n_kept: usize) -> usize {
    (n.pow(3) - n_kept.pow(3)) / 3 + COST_OF_PLACE * n.pow(2)
}

/// Finds the two bodies with shared contacts that are cheapest to join.
fn cheapest_pair(live: &[Joining]) -> Option<[usize; 2]> {
    let n_shared = |x: &[u32], y: &[u32]| x.iter().filter(|c| y.binary_search(c).is_ok()).count();
    let mut best: Option<(usize, [usize; 2])> = None;
    for (a, Joining { outer: x, .. }) in live.iter().enumerate() {
        for (b, Joining { outer: y, .. }) in live.iter().enumerate().skip(a + 1) {
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
        self.inner.len() + self.outer.len()
    }

    /// Makes `piece` a part of this joining: merged with it if that is cheaper, or as an earlier step.
    fn take(&mut self, piece: Self, joinings: &mut Vec<Self>) {
        let (n, n_kept, n_more) = (self.n_contacts(), self.outer.len(), piece.inner.len());
        let apart = work(piece.n_contacts(), piece.outer.len()) + work(n, n_kept);
        if work(n + n_more, n_kept) <= apart {
            self.bodies.extend(piece.bodies);
            self.earlier.extend(piece.earlier);
            self.inner.extend(piece.inner);
        } else {
            joinings.push(piece);
            self.earlier.push(joinings.len() - 1);
        }
    }
}

impl Front {
    /// Allocates a front for the eliminated contacts, those that wait for other bodies, and all that push.
    /// Zero except for a 1 on the diagonal of each eliminated contact.
    fn of(joining: &Joining, bodies: &[Arc<ContactBody>], done: &[Arc<Self>], laws: &[Law]) -> Self {
        let both = |of: &[u32]| {
            let is = |c: &u32| laws[*c as usize] == Law::Both;
            of.iter().copied().filter(is).collect::<Vec<u32>>()
        };
        let mut contacts = both(&joining.inner);
        let n_eliminated = contacts.len();
        contacts.extend(both(&joining.outer));
        let own = joining.bodies.iter().flat_map(|b| &bodies[*b].contacts);
        let joined = joining.earlier.iter().flat_map(|j| &done[*j].contacts);
        let mut pushes: Vec<u32> = own
            .chain(joined)
            .copied()
            .filter(|c| laws[*c as usize] == Law::Push)
            .collect();
        pushes.sort_unstable();
        pushes.dedup();
        contacts.extend(pushes);
        let n = contacts.len();
        let mut values = vec![0.0; n * n];
        (0..n_eliminated).for_each(|i| values[n * i + i] = 1.0);
        Self {
            contacts,
            n_eliminated,
            values,
        }
    }

    fn add(&mut self, row: usize, column: usize, value: f64) {
        self.values[self.contacts.len() * row.min(column) + row.max(column)] += value;
    }

    fn add_body(&mut self, body: &ContactBody, laws: &[Law], place: &[usize]) {
        let m = body.contacts.len();
        let there: Vec<(usize, usize)> = (body.contacts.iter().enumerate())
            .filter(|(_, c)| laws[**c as usize] != Law::Absent)
            .map(|(i, c)| (i, place[*c as usize]))
            .collect();
        for (j, &(from, column)) in there.iter().enumerate() {
            let source = &body.compliance[m * from..m * (from + 1)];
            for &(i, row) in &there[j..] {
                self.add(row, column, source[i]);
            }
        }
    }

    fn add_joint(&mut self, joint: &Self, place: &[usize]) {
        let (m, first) = (joint.contacts.len(), joint.n_eliminated);
        let rows: Vec<usize> = joint.contacts[first..]
            .iter()
            .map(|c| place[*c as usize])
            .collect();
        for (j, &column) in rows.iter().enumerate() {
            let source = &joint.values[m * (first + j) + first + j..m * (first + j + 1)];
            for (row, value) in rows[j..].iter().zip(source) {
                self.add(*row, column, *value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// Seven bodies in a ring with a chord, with 31 contacts between them and 5 that touch one body alone.
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
    fn joined_bodies_bear_what_the_whole_system_does_whatever_is_eliminated_first() {
        let (touched, n) = ring();
        let (joinings, order) = Joinings::new(touched.clone(), n as usize);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..n).collect::<Vec<_>>());
        let wave = |i: usize, j: usize| ((7 * i + 13 * j + i * j) as f64).sin();
        let bodies: Vec<Arc<ContactBody>> = (touched.iter())
            .map(|own| {
                let contacts: Vec<u32> = (0..n).filter(|i| own.contains(&order[*i as usize])).collect();
                let root = DMatrix::from_fn(contacts.len(), contacts.len(), wave);
                Arc::new(ContactBody {
                    contacts,
                    compliance: (&root * root.transpose()).as_slice().to_vec(),
                })
            })
            .collect();
        let side: Vec<f64> = (0..n as usize).map(|i| wave(i, 2)).collect();
        for modulus in [1, 2, 3, 100] {
            let law = |i| if i % modulus == 0 { Law::Both } else { Law::Push };
            let laws: Vec<Law> = (0..n).map(law).collect();
            let reduced = joinings.reduce(&bodies, &laws, None).unwrap();
            let mut found = side.clone();
            reduced.begin(&mut found);
            let m = reduced.pushes.len();
            let pushing = DMatrix::from_column_slice(m, m, &reduced.compliance) + DMatrix::identity(m, m);
            let gaps = DVector::from_fn(m, |i, _| found[reduced.pushes[i] as usize]);
            let pressed = pushing.cholesky().unwrap().solve(&gaps);
            (0..m).for_each(|i| found[reduced.pushes[i] as usize] = pressed[i]);
            reduced.finish(&mut found);
            let mut whole = DMatrix::<f64>::identity(n as usize, n as usize);
            for body in &bodies {
                let m = body.contacts.len();
                for (k, value) in body.compliance.iter().enumerate() {
                    let [row, column] = [k % m, k / m].map(|i| body.contacts[i] as usize);
                    whole[(row, column)] += *value;
                }
            }
            let expected = whole.cholesky().unwrap().solve(&DVector::from_vec(side.clone()));
            assert!((expected - DVector::from_vec(found)).amax() < 1e-12);
        }
    }

    #[test]
    fn where_one_body_changes_the_rest_is_kept_and_the_answer_is_that_from_the_start() {
        let (touched, n) = ring();
        let (joinings, order) = Joinings::new(touched.clone(), n as usize);
        let body = |own: &Vec<u32>, soft: f64| {
            let contacts: Vec<u32> = (0..n).filter(|i| own.contains(&order[*i as usize])).collect();
            let root = DMatrix::from_fn(contacts.len(), contacts.len(), |i, j| ((3 * i + j) as f64).cos());
            Arc::new(ContactBody {
                contacts,
                compliance: (soft * &root * root.transpose()).as_slice().to_vec(),
            })
        };
        let laws: Vec<Law> = (0..n)
            .map(|i| if i % 2 == 0 { Law::Both } else { Law::Push })
            .collect();
        let before: Vec<Arc<ContactBody>> = touched.iter().map(|own| body(own, 1.0)).collect();
        let reduced = joinings.reduce(&before, &laws, None).unwrap();
        for changed in 0..before.len() {
            let mut after = before.clone();
            after[changed] = body(&touched[changed], 2.0);
            let again = joinings.reduce(&after, &laws, Some((&before, &reduced))).unwrap();
            let anew = joinings.reduce(&after, &laws, None).unwrap();
            assert_eq!(again.compliance, anew.compliance);
        }
    }
}
