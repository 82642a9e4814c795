//! One round of the iteration: an assumption, and the bounds that follow from it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

use nalgebra::DVector;
use rayon::prelude::*;
use shellock_geom::Vec3;

use super::{Ends, Found, LENGTH_MM, Multipliers, Problem, Proof, WAYS};
use crate::PatchId;
use crate::motion::{Corner, Freedom, Limits, System, farthest_of_piece};
use crate::play::bearing::Bearing;
use crate::play::quantity::{Quantities, Quantity, other_lines};
use crate::verify::contact::Contact;

/// Margin of a bound for rounding, as a share of it and in mm or rad.
const ROUNDING: f64 = 1e-6;

/// Multipliers that end one direction of a quantity, if any, and the motion that goes farthest.
type End = (Option<Multipliers>, DVector<f64>);

/// One assumption, and the linear program that follows from it.
pub(super) struct Round<'a> {
    problem: &'a Problem<'a>,
    bearings: &'a [Bearing],
    quantities: &'a Quantities,
    beds: &'a [OnceLock<bool>],
    center: Vec3,
    system: System,
    errors_mm: Vec<f64>,
    /// Bounds of rows, computed on demand.
    bounds: Vec<OnceLock<f64>>,
}

impl<'a> Round<'a> {
    pub fn new(
        problem: &'a Problem<'a>,
        bearings: &'a [Bearing],
        quantities: &'a Quantities,
        beds: &'a [OnceLock<bool>],
    ) -> Self {
        let centers = problem.centers;
        let center = problem.free.iter().map(|&p| centers[p]).sum::<Vec3>() / problem.free.len() as f64;
        let errors_mm: Vec<f64> = bearings
            .iter()
            .zip(&quantities.places)
            .map(|(b, p)| quantities.error_mm(b, p, centers))
            .collect();
        let contact = |a, b, point: Vec3, normal, gap_mm| Contact {
            a,
            b,
            point: point - center,
            normal,
            gap_mm,
            area_mm2: 0.0,
        };
        let mut contacts: Vec<Contact> = bearings
            .iter()
            .map(|b| contact(b.a, b.b, b.point, b.normal, b.gap_mm))
            .collect();
        let slide = problem.slide;
        if problem.is_free(slide.key) {
            contacts.push(contact(
                slide.key,
                slide.seat,
                slide.at.into(),
                slide.along.into(),
                slide.most_mm,
            ));
        }
        let system = System::new(&contacts, problem.free, LENGTH_MM, Freedom::Rigid);
        let told = system.rows.iter().map(|_| OnceLock::new()).collect();
        Self {
            problem,
            bearings,
            quantities,
            beds,
            center,
            system,
            errors_mm,
            bounds: told,
        }
    }

    /// Least possible bound of a row, mm.
    fn least_mm(&self, row: usize) -> f64 {
        let i = self.system.rows[row].contact;
        self.bearings.get(i).map_or_else(
            || self.slide_mm(),
            |b| b.gap_mm + self.set_back_mm() + self.errors_mm[i],
        )
    }

    /// Amount by which gaps are wider than the meshes show, mm: both faces are set back.
    fn set_back_mm(&self) -> f64 {
        2.0 * self.problem.set_back_mm
    }

    /// Bound of the slide, mm, which is measured like the point of a bearing.
    fn slide_mm(&self) -> f64 {
        let (slide, q) = (self.problem.slide, self.quantities);
        let of = |p: PatchId| {
            q.of_piece
                .get(&p)
                .map(|[w, u]| (q.all[*w].norm(), q.all[*u].norm()))
        };
        let at = Vec3::from(slide.at);
        let far = |p: PatchId| of(p).map_or(0.0, |(w, u)| u + w * at.distance(self.problem.centers[p]));
        let (key, seat) = (
            of(slide.key).map_or(0.0, |k| k.0),
            of(slide.seat).map_or(0.0, |s| s.0),
        );
        slide.most_mm + 0.5 * seat * (far(slide.key) + far(slide.seat)) + 0.5 * (key + seat) * far(slide.key)
    }

    /// Bound of a row, mm: the height that its bearing's point can reach, plus the error.
    fn bound_mm(&self, row: usize) -> f64 {
        *self.bounds[row].get_or_init(|| self.measured_mm(row))
    }

    /// Bearings whose barrier was computed and that hold.
    pub fn bearings_that_hold(&self) -> impl Iterator<Item = usize> + '_ {
        let is_held = |row: &usize| self.bounds[*row].get().is_some_and(|mm| mm.is_finite());
        let contact = |row: usize| self.system.rows[row].contact;
        (0..self.bounds.len())
            .filter(is_held)
            .map(contact)
            .filter(|&i| i < self.bearings.len())
    }

    fn measured_mm(&self, row: usize) -> f64 {
        let i = self.system.rows[row].contact;
        let Some(b) = self.bearings.get(i) else {
            return self.slide_mm();
        };
        let surfaces = self.problem.surfaces;
        if !*self.beds[i].get_or_init(|| surfaces.has_bed(b)) {
            return f64::INFINITY;
        }
        let region = self
            .quantities
            .region(b, &self.quantities.places[i], self.errors_mm[i]);
        surfaces.rise_mm(b, &region).map_or(f64::INFINITY, |rise_mm| {
            rise_mm + self.set_back_mm() + self.errors_mm[i]
        })
    }

    /// Ends of each relevant quantity, and the motions that reach them; `None` if one is unlimited.
    pub fn ends(&self) -> Option<Found> {
        let least: Vec<f64> = (0..self.system.rows.len())
            .map(|row| self.least_mm(row))
            .collect();
        let late = |row: usize| self.bound_mm(row);
        let limits = Limits::late(&self.system, &least, &late);
        let start = Corner::new(&limits);
        // Small problems run in one lane, others in one lane per direction. Each solve begins where the last
        // one of its lane ended.
        let n_lanes = if self.problem.free.len() > 1 { WAYS } else { 1 };
        let mut lanes = vec![start; n_lanes];
        let mut ends: BTreeMap<usize, Ends> = BTreeMap::new();
        let mut wanted: BTreeSet<usize> = self.quantities.of_piece.values().flatten().copied().collect();
        let mut motions = Vec::new();
        while !wanted.is_empty() {
            let of_lane = |(lane, corner): (usize, &mut Corner<'_>)| -> Vec<End> {
                let ways = (lane..WAYS).step_by(n_lanes);
                ways.flat_map(|way| wanted.iter().map(move |&q| (q, way)))
                    .map(|(q, way)| (self.objective(q, way / 2, way % 2), self.is_of_piece(q)))
                    .map(|(towards, is_of_piece)| {
                        let rows = if is_of_piece {
                            corner.maximise(&towards)
                        } else {
                            corner.maximise_from_cache(&towards)
                        };
                        (rows, DVector::from_column_slice(corner.motion()))
                    })
                    .collect()
            };
            let found: Vec<Vec<_>> = lanes.par_iter_mut().enumerate().map(of_lane).collect();
            let mut needed = BTreeSet::new();
            for (lane, found) in found.into_iter().enumerate() {
                let asked = (lane..WAYS)
                    .step_by(n_lanes)
                    .flat_map(|way| wanted.iter().map(move |&q| (q, way)));
                for ((q, way), (rows, motion)) in asked.zip(found) {
                    let rows = rows?;
                    motions.push(motion);
                    let contact = |row: usize| self.system.rows[row].contact;
                    let places = rows
                        .iter()
                        .filter_map(|(row, _)| self.quantities.places.get(contact(*row)));
                    places.for_each(|place| needed.extend([place.cell, place.turn]));
                    let ends = ends.entry(q).or_insert_with(|| vec![[None, None]; 3]);
                    ends[way / 2][way % 2] = Some(rows);
                }
            }
            wanted = needed.into_iter().filter(|q| !ends.contains_key(q)).collect();
            // All lanes learn the rows that one lane examined: the remaining quantities are bounded by known
            // rows.
            let known: BTreeSet<usize> = lanes.iter().flat_map(Corner::looked_at).collect();
            lanes
                .par_iter_mut()
                .for_each(|corner| known.iter().for_each(|&row| corner.look_at(row)));
        }
        Some(Found { ends, motions })
    }

    /// Displacement, mm, and rotation, rad, of the only free piece in the small motions that go farthest;
    /// `None` if several pieces are free, or if nothing limits this one.
    pub fn small_motion(&self) -> Option<[f64; 2]> {
        if self.problem.free.len() != 1 {
            return None;
        }
        let least: Vec<f64> = (0..self.system.rows.len())
            .map(|row| self.least_mm(row))
            .collect();
        let late = |row: usize| self.bound_mm(row);
        let limits = Limits::late(&self.system, &least, &late);
        let mut corner = Corner::new(&limits);
        let [shift_mm, turn] = farthest_of_piece(&mut corner, LENGTH_MM);
        Some([shift_mm?, turn?])
    }

    /// Greatest values in these motions of the quantities that no bearing needed.
    pub fn guesses(
        &self,
        ends: &BTreeMap<usize, Ends>,
        motions: &[DVector<f64>],
    ) -> Vec<(usize, Vec<[f64; 2]>)> {
        let all = 0..self.quantities.all.len();
        let unknown: Vec<usize> = all.filter(|q| !ends.contains_key(q)).collect();
        let farthest = |objective: DVector<f64>| motions.iter().map(|m| objective.dot(m)).fold(0.0, f64::max);
        let guess = |&q: &usize| {
            (
                q,
                (0..3)
                    .map(|axis| [0, 1].map(|side| farthest(self.objective(q, axis, side))))
                    .collect(),
            )
        };
        unknown.par_iter().map(guess).collect()
    }

    /// Returns true if the quantity is a piece's own. For these, all bearings are examined.
    fn is_of_piece(&self, quantity: usize) -> bool {
        self.quantities
            .of_piece
            .values()
            .any(|of_piece| of_piece.contains(&quantity))
    }

    /// Linear form of a quantity along an axis (`side` 1) or against it (0), in the unknowns.
    fn objective(&self, quantity: usize, axis: usize, side: usize) -> DVector<f64> {
        let d = Vec3::from(self.quantities.all[quantity].axes[axis]);
        self.along(quantity, if side == 1 { d } else { -d })
    }

    /// Linear form of a quantity along a direction, in the unknowns.
    fn along(&self, quantity: usize, d: Vec3) -> DVector<f64> {
        let q = &self.quantities.all[quantity];
        let (velocity, spin) = match q.at {
            None => (Vec3::ZERO, d / LENGTH_MM),
            Some(at) => (d, (Vec3::from(at) - self.center).cross(d) / LENGTH_MM),
        };
        let mut objective = DVector::zeros(self.system.n);
        for (piece, sign) in [(q.plus, 1.0), (q.minus, -1.0)] {
            let Some(i) = piece.and_then(|p| self.problem.free.binary_search(&p).ok()) else {
                continue;
            };
            let at = self.system.column(i);
            for k in 0..3 {
                objective[at + k] += sign * velocity[k];
                objective[at + 3 + k] += sign * spin[k];
            }
        }
        objective
    }

    /// Bounds of each quantity, against each axis and along it.
    pub fn collect_bounds(&self, ends: &BTreeMap<usize, Ends>) -> BTreeMap<usize, Vec<[f64; 2]>> {
        ends.iter()
            .map(|(&q, ends)| (q, ends.iter().map(|e| self.values(q, e)).collect()))
            .collect()
    }

    /// Bounds of a quantity that the multipliers prove, against an axis and along it.
    fn values(&self, quantity: usize, ends: &[Option<Multipliers>; 2]) -> [f64; 2] {
        let least = if self.quantities.all[quantity].at.is_some() {
            ROUNDING
        } else {
            ROUNDING / LENGTH_MM
        };
        ends.each_ref().map(|rows| {
            let sum: f64 = rows
                .iter()
                .flatten()
                .map(|&(row, force)| force * self.bound_mm(row))
                .sum();
            sum.max(0.0) * (1.0 + ROUNDING) + least
        })
    }

    /// Builds the proof that all quantities stay within `found`. A piece's own quantities are also bounded
    /// along more lines, by the known rows.
    pub fn proof(
        &self,
        own: &[usize],
        mut ends: BTreeMap<usize, Ends>,
        found: BTreeMap<usize, Vec<[f64; 2]>>,
    ) -> Proof {
        let mut quantities: BTreeMap<usize, Quantity> = BTreeMap::new();
        for (&q, most) in &found {
            quantities.insert(
                q,
                Quantity {
                    most: most.clone(),
                    ..self.quantities.all[q].clone()
                },
            );
        }
        self.add_lines(&mut quantities, &mut ends);
        let rows = rows_of(&ends);
        let name_of: BTreeMap<usize, usize> = ends.keys().copied().zip(0..).collect();
        let contact = |row: usize| self.system.rows[row].contact;
        let of_bearings: Vec<usize> = rows
            .into_iter()
            .filter(|&row| contact(row) < self.bearings.len())
            .collect();
        let place: BTreeMap<usize, usize> = of_bearings.iter().copied().zip(0..).collect();
        let renamed = |rows: Option<Multipliers>| -> Multipliers {
            let name = |row: usize| place.get(&row).copied().unwrap_or(of_bearings.len());
            rows.into_iter()
                .flatten()
                .map(|(row, force)| (name(row), force))
                .collect()
        };
        let named = |row: &usize| {
            let p = &self.quantities.places[contact(*row)];
            (own[contact(*row)], [name_of[&p.cell], name_of[&p.turn]])
        };
        Proof {
            free: self.problem.free.to_vec(),
            of_piece: self
                .quantities
                .of_piece
                .values()
                .map(|of_piece| of_piece.map(|q| name_of[&q]))
                .collect(),
            quantities: quantities.into_values().collect(),
            rows: of_bearings.iter().map(named).collect(),
            multipliers: ends
                .into_values()
                .map(|e| e.into_iter().map(|sides| sides.map(renamed)).collect())
                .collect(),
        }
    }

    /// Bounds the pieces' own quantities along the other lines of the lattice, by rows that the proof already
    /// uses.
    fn add_lines(&self, quantities: &mut BTreeMap<usize, Quantity>, ends: &mut BTreeMap<usize, Ends>) {
        let known = rows_of(ends);
        let late = |row: usize| {
            if known.contains(&row) {
                self.bound_mm(row)
            } else {
                f64::INFINITY
            }
        };
        let gaps: Vec<f64> = (0..self.system.rows.len()).map(late).collect();
        let limits = Limits::new(&self.system, &gaps);
        let mut corner = Corner::new(&limits);
        for q in self.quantities.of_piece.values().flatten() {
            for line in other_lines() {
                let sides = [-line, line].map(|d| corner.maximise(&self.along(*q, d)));
                if sides.iter().any(Option::is_none) {
                    continue;
                }
                let values = self.values(*q, &sides);
                if let (Some(quantity), Some(ends)) = (quantities.get_mut(q), ends.get_mut(q)) {
                    quantity.axes.push(line.to_array());
                    quantity.most.push(values);
                    ends.push(sides);
                }
            }
        }
    }
}

/// Rows that end any direction of any quantity.
fn rows_of(ends: &BTreeMap<usize, Ends>) -> BTreeSet<usize> {
    let of_axes = ends.values().flatten();
    let of_ways = of_axes.flatten().flatten();
    of_ways.flatten().map(|row| row.0).collect()
}
