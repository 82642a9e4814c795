//! Seams, the lines between labels, as curves measured by arc length.

use super::surface::{NO_SEAM, Place, Surface, prev};
use crate::{HalfEdge, Topology, Vec3};

/// A line of the input along which the same two labels meet, from corner to corner or closed. A place on the
/// line is the distance from its start along it, mm.
pub(super) struct Seam {
    /// Label to the left of the line's direction, seen from outside: the lower of the two.
    pub left_label: u32,
    /// True if no corner lies on the line.
    pub is_closed: bool,
    points: Vec<Vec3>,
    /// Place of each point, mm.
    at_mm: Vec<f64>,
}

impl Seam {
    pub fn length_mm(&self) -> f64 {
        self.at_mm.last().copied().unwrap_or(0.0)
    }

    /// Point at a place. Clamps to the ends of an open line; continues around a closed one.
    pub fn point(&self, at_mm: f64) -> Vec3 {
        let at = self.wrap(at_mm);
        let i = self
            .at_mm
            .partition_point(|&a| a <= at)
            .clamp(1, self.points.len() - 1);
        let (from, to) = (self.at_mm[i - 1], self.at_mm[i]);
        let share = if to > from {
            ((at - from) / (to - from)).clamp(0.0, 1.0)
        } else {
            0.0
        };
        self.points[i - 1].lerp(self.points[i], share)
    }

    /// Equivalent place in `0 .. length` on a closed line; unchanged on an open one.
    pub fn wrap(&self, at_mm: f64) -> f64 {
        if self.is_closed && self.length_mm() > 0.0 {
            at_mm.rem_euclid(self.length_mm())
        } else {
            at_mm
        }
    }
}

/// Finds the seams of `surface` and stores there the seam of each half-edge and the place of each point.
pub(super) fn find_seams(surface: &mut Surface) -> Vec<Seam> {
    let n_half_edges = surface.start.len() as HalfEdge;
    for v in 0..surface.points.len() as u32 {
        let n_borders = surface.around(v).filter(|&h| is_border(surface, h)).count();
        surface.place[v as usize] = match n_borders {
            0 => Place::Inside,
            // The walk below finds which seam it is, and the place on it.
            2 => Place::Seam { at_mm: 0.0 },
            _ => Place::Corner,
        };
    }
    let is_forwards = |s: &Surface, h| is_border(s, h) && s.label_of(h) < s.label_of(s.opposite[h as usize]);
    let mut seams = Vec::new();
    for only_from_corners in [true, false] {
        for h in 0..n_half_edges {
            let is_start =
                !only_from_corners || surface.place[surface.start[h as usize] as usize] == Place::Corner;
            if is_start && is_forwards(surface, h) && surface.seam[h as usize] == NO_SEAM {
                let seam = walk(surface, h, seams.len() as u32);
                seams.push(seam);
            }
        }
    }
    seams
}

fn is_border(surface: &Surface, h: HalfEdge) -> bool {
    surface.label_of(h) != surface.label_of(surface.opposite[h as usize])
}

/// Follows the border from `first`, with the lower label on the left, to a corner or back to the start.
fn walk(surface: &mut Surface, first: HalfEdge, name: u32) -> Seam {
    let begin = surface.start[first as usize];
    let left = surface.label_of(first);
    let is_closed = surface.place[begin as usize] != Place::Corner;
    let mut seam = Seam {
        left_label: left,
        is_closed,
        points: vec![surface.points[begin as usize]],
        at_mm: vec![0.0],
    };
    let mut h = first;
    loop {
        let back = surface.opposite[h as usize];
        surface.seam[h as usize] = name;
        surface.seam[back as usize] = name;
        let [from, to] = surface.ends(h);
        let step = surface.points[from as usize].distance(surface.points[to as usize]);
        seam.at_mm.push(seam.length_mm() + step);
        seam.points.push(surface.points[to as usize]);
        if to == begin || surface.place[to as usize] == Place::Corner {
            return seam;
        }
        surface.place[to as usize] = Place::Seam {
            at_mm: seam.length_mm(),
        };
        // Of the two border edges out of this point, only one has `left` on its left.
        let onwards = surface
            .around(to)
            .find(|&o| surface.label_of(o) == left && is_border(surface, o));
        match onwards {
            Some(o) => h = o,
            None => return seam,
        }
    }
}

impl Surface {
    /// Places of the ends of a seam's half-edge in the seam's direction, start first; `end > start`.
    pub fn span(&self, h: HalfEdge, seams: &[Seam]) -> [f64; 2] {
        let seam = &seams[self.seam[h as usize] as usize];
        let h = if self.label_of(h) == seam.left_label {
            h
        } else {
            self.opposite[h as usize]
        };
        let [from, to] = self.ends(h).map(|v| self.place[v as usize]);
        let start = if let Place::Seam { at_mm } = from {
            at_mm
        } else {
            0.0
        };
        match to {
            Place::Seam { at_mm } if seam.is_closed && at_mm <= start => [start, at_mm + seam.length_mm()],
            Place::Seam { at_mm } => [start, at_mm],
            _ => [start, seam.length_mm()],
        }
    }

    /// Seam through a point of kind [`Place::Seam`], and the new place on it after this share of the step to
    /// the middle of its neighbours there.
    pub fn relaxed_along(&self, v: u32, share: f64, seams: &[Seam]) -> Option<(u32, f64)> {
        let onwards = self.around(v).find(|&h| {
            let seam = self.seam[h as usize];
            seam != NO_SEAM && self.label_of(h) == seams[seam as usize].left_label
        })?;
        let back = self
            .around(v)
            .find(|&h| self.seam[h as usize] != NO_SEAM && h != onwards)?;
        let ([before, here], [at, after]) = (self.span(back, seams), self.span(onwards, seams));
        let name = self.seam[onwards as usize];
        Some((
            name,
            seams[name as usize].wrap(at + 0.5 * share * ((after - at) - (here - before))),
        ))
    }

    /// Third corner of the triangle of `h`.
    pub fn apex(&self, h: HalfEdge) -> u32 {
        self.start[prev(h) as usize]
    }

    /// Returns true if the triangle of `h` has seams on both its other edges.
    pub fn is_between_seams(&self, h: HalfEdge) -> bool {
        [Topology::next(h), prev(h)]
            .iter()
            .all(|&e| self.seam[e as usize] != NO_SEAM)
    }
}
