//! Compliance of the pieces at their contacts: displacements at all contacts by forces at one. Columns are
//! computed when a contact first carries load.

use rayon::prelude::*;
use shellock_geom::Vec3;

use super::body::{Body, Place};

/// Number of loads that one thread solves at once; more gains nothing and takes memory.
const AT_ONCE: usize = 24;

/// End of a contact on a part.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    pub part: u32,
    /// Index among the ends of that part.
    pub index: u32,
}

/// Place on a piece where a contact ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    pub place: Place,
    pub at: Vec3,
}

/// Pieces, the seats of their contacts, and the columns of compliance computed so far.
pub(super) struct Compliance {
    pub bodies: Vec<Body>,
    /// Ends of each contact, first and second; `None` is the ground.
    pub ends: Vec<[Option<End>; 2]>,
    /// Seats of each part, by index.
    pub seats: Vec<Vec<Seat>>,
    /// Displacement at all seats of a part by 1 N along x, y and z, by part and seat.
    columns: Vec<Vec<Option<[Vec<Vec3>; 3]>>>,
}

/// Sign of an end: −1 for the first, 1 for the second.
fn sign(side: usize) -> f64 {
    2.0 * side as f64 - 1.0
}

impl Compliance {
    pub fn new(bodies: Vec<Body>, ends: Vec<[Option<End>; 2]>, seats: Vec<Vec<Seat>>) -> Self {
        let columns = seats.iter().map(|s| vec![None; s.len()]).collect();
        Self {
            bodies,
            ends,
            seats,
            columns,
        }
    }

    fn ends_of(&self, contact: usize) -> impl Iterator<Item = (f64, End)> + '_ {
        let ends = &self.ends[contact];
        (0..2).filter_map(|side| ends[side].map(|end| (sign(side), end)))
    }

    /// Computes the missing columns for the ends of these contacts.
    pub fn prepare(&mut self, contacts: impl Iterator<Item = usize>) {
        let mut missing: Vec<Vec<u32>> = vec![Vec::new(); self.bodies.len()];
        for contact in contacts {
            for (_, end) in self.ends_of(contact) {
                if self.columns[end.part as usize][end.index as usize].is_none() {
                    missing[end.part as usize].push(end.index);
                }
            }
        }
        let mut jobs = Vec::new();
        for (part, mut seats) in missing.into_iter().enumerate() {
            seats.sort_unstable();
            seats.dedup();
            jobs.extend(seats.chunks(AT_ONCE / 3).map(|chunk| (part, chunk.to_vec())));
        }
        let this = &*self;
        let found: Vec<_> = jobs
            .par_iter()
            .map(|(part, seats)| this.columns_of(*part, seats))
            .collect();
        for ((part, seats), columns) in jobs.into_iter().zip(found) {
            for (seat, column) in seats.into_iter().zip(columns) {
                self.columns[part][seat as usize] = Some(column);
            }
        }
    }

    fn columns_of(&self, part: usize, seats: &[u32]) -> Vec<[Vec<Vec3>; 3]> {
        let body = &self.bodies[part];
        let n = body.n_rows();
        let mut sides = vec![0.0; 3 * n * seats.len()];
        for (side, at) in sides.chunks_exact_mut(n).zip(0..) {
            let seat = &self.seats[part][seats[at / 3] as usize];
            body.push(side, &seat.place, Vec3::AXES[at % 3]);
        }
        body.solve(&mut sides);
        let moved = |side: &[f64]| self.at_seats(part, side);
        sides
            .chunks_exact(3 * n)
            .map(|three| [0, 1, 2].map(|axis| moved(&three[axis * n..(axis + 1) * n])))
            .collect()
    }

    /// Displacements at all seats of a part, mm.
    fn at_seats(&self, part: usize, displaced: &[f64]) -> Vec<Vec3> {
        let body = &self.bodies[part];
        self.seats[part]
            .iter()
            .map(|seat| body.displacement(displaced, &seat.place))
            .collect()
    }

    /// Relative displacement at each contact, second end minus first, from the displacements of the parts'
    /// unknowns.
    pub fn between(&self, displaced: &[Vec<f64>]) -> Vec<Vec3> {
        let at: Vec<Vec<Vec3>> = (0..self.bodies.len())
            .map(|part| self.at_seats(part, &displaced[part]))
            .collect();
        self.differences(&at)
    }

    fn differences(&self, at: &[Vec<Vec3>]) -> Vec<Vec3> {
        let of = |contact: usize| {
            self.ends_of(contact)
                .map(|(sign, end)| sign * at[end.part as usize][end.index as usize])
                .sum()
        };
        (0..self.ends.len()).map(of).collect()
    }

    /// Relative displacement at all contacts by forces on the contacts' second parts, with frames at rest,
    /// mm.
    pub fn moved_by(&self, force_n: &[Vec3]) -> Vec<Vec3> {
        let on_seats = self.on_seats(force_n);
        let at: Vec<Vec<Vec3>> = (0..self.bodies.len())
            .into_par_iter()
            .map(|part| {
                let mut sum = vec![Vec3::ZERO; self.seats[part].len()];
                for (force, columns) in on_seats[part].iter().zip(&self.columns[part]) {
                    let Some(columns) = columns.as_ref().filter(|_| *force != Vec3::ZERO) else {
                        continue;
                    };
                    for (axis, column) in columns.iter().enumerate() {
                        sum.iter_mut()
                            .zip(column)
                            .for_each(|(s, c)| *s += force[axis] * *c);
                    }
                }
                sum
            })
            .collect();
        self.differences(&at)
    }

    /// Forces of the contacts on each seat of each part, N.
    pub fn on_seats(&self, force_n: &[Vec3]) -> Vec<Vec<Vec3>> {
        let mut on: Vec<Vec<Vec3>> = self.seats.iter().map(|s| vec![Vec3::ZERO; s.len()]).collect();
        for (contact, force) in force_n.iter().enumerate() {
            for (sign, end) in self.ends_of(contact) {
                on[end.part as usize][end.index as usize] += sign * *force;
            }
        }
        on
    }

    /// Relative displacement at a contact by motions of the frames, mm.
    pub fn by_frames(&self, contact: usize, frames: &[[f64; 6]]) -> Vec3 {
        self.ends_of(contact)
            .map(|(sign, end)| {
                let motions = self.motions(end);
                let moved: Vec3 = (0..6).map(|k| frames[end.part as usize][k] * motions[k]).sum();
                sign * moved
            })
            .sum()
    }

    fn motions(&self, end: End) -> [Vec3; 6] {
        let at = self.seats[end.part as usize][end.index as usize].at;
        self.bodies[end.part as usize].frame.motions(at)
    }

    /// Writes `C` and, below it, `Gᵀ` for these contacts and directions into the lower triangle of an `n × n`
    /// column-major matrix.
    pub fn fill(&self, rows: &[(usize, Vec3)], n: usize, values: &mut [f64]) {
        let m = rows.len();
        let ends: Vec<Vec<(f64, End)>> = rows.iter().map(|r| self.ends_of(r.0).collect()).collect();
        values
            .par_chunks_mut(n)
            .take(m)
            .enumerate()
            .for_each(|(s, column)| {
                for (sign, end) in &ends[s] {
                    let direction = *sign * rows[s].1;
                    let columns = self.columns[end.part as usize][end.index as usize]
                        .as_ref()
                        .expect("columns are prepared before they are used");
                    for r in s..m {
                        for (other_sign, other) in &ends[r] {
                            if other.part == end.part {
                                let at = other.index as usize;
                                let moved: Vec3 = (0..3).map(|k| direction[k] * columns[k][at]).sum();
                                column[r] += other_sign * moved.dot(rows[r].1);
                            }
                        }
                    }
                    let first = m + 6 * end.part as usize;
                    for (k, motion) in self.motions(*end).iter().enumerate() {
                        column[first + k] += motion.dot(direction);
                    }
                }
            });
    }
}
