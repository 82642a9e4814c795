//! Contacts that a plan adds between the two sides of a station, and the forces that pull them apart.

use shellock_geom::Vec3;

use super::SurfaceModel;
use super::parts::{Motions, N_MOTIONS};
use crate::assembly::{Meeting, Side, Station};

/// Number of contacts of a station. It is fixed, although a plan may leave some absent, so that all plans
/// have the same unknowns.
pub(super) const N_CONTACTS: usize = 5;

/// Index of the contact between the walls of both sides.
pub(super) const WALL: usize = 0;
/// Index of the contact between the pin's tip and a side of the channel.
pub(super) const TIP: usize = 1;
/// Index of the contact between the pin's root and a side of the channel.
pub(super) const ROOT: usize = 2;
/// Index of the contact between the pin's tip and the channel's floor; friction on a fast joint also acts
/// here.
pub(super) const FLOOR: usize = 3;
/// Index of the friction contact along the channel.
pub(super) const SLIDE: usize = 4;

/// Condition under which a contact carries load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Law {
    /// Carries load in both directions.
    Both,
    /// Carries load only when pressed together.
    Push,
    /// Never carries load: the contact is absent.
    Absent,
}

/// One contact. Its energy is `(g · r)²/2` in the motions r of side a relative to side b; if one-sided, only
/// for a negative `g · r`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ContactSpring {
    pub station: usize,
    /// Gradient of the gap times the square root of the stiffness, N/mm.
    pub gradient: Motions,
    pub law: Law,
}

impl ContactSpring {
    /// Share of `gap` that stores energy: all of it, or its negative part.
    pub fn active_gap(&self, gap: f64) -> f64 {
        match self.law {
            Law::Both => gap,
            Law::Push => gap.min(0.0),
            Law::Absent => 0.0,
        }
    }

    /// Returns true if the contact carries load at `gap`.
    pub fn is_closed(&self, gap: f64) -> bool {
        match self.law {
            Law::Both => true,
            Law::Push => gap <= 0.0,
            Law::Absent => false,
        }
    }
}

/// Gap along `g` at `offset` from the seam point, as a linear form of the station's motions: the motion of
/// side `from` relative to the other side. `g` and `offset` are perpendicular to the tangent.
pub(super) fn gap(station: &Station, from: Side, offset: Vec3, g: Vec3) -> Motions {
    let turned = station.tangent.cross(offset).dot(g);
    let motions = [
        g.dot(station.tangent),
        g.dot(station.normal),
        g.dot(station.across),
        turned,
    ];
    motions.map(|m| if from == Side::A { m } else { -m })
}

/// Contacts of station `i`.
///
/// A connector keeps the tips and the seam points together across the channel, and keeps the male's tip from
/// going deeper. The walls may not enter each other at any station.
pub(super) fn contacts_at(model: &SurfaceModel, i: usize, meeting: &Meeting) -> [ContactSpring; N_CONTACTS] {
    let station = &model.assembly.stations[i];
    let size_mm = meeting
        .joint
        .map_or(model.params.connector_mm, |joint| joint.size_mm);
    let root = model.params.contact_n_mm(size_mm, station.length_mm).sqrt();
    let contact = |gap: Motions, law| ContactSpring {
        station: i,
        gradient: gap.map(|g| root * g),
        law,
    };
    let mut found = [contact([0.0; N_MOTIONS], Law::Absent); N_CONTACTS];
    found[WALL] = contact(gap(station, Side::B, Vec3::ZERO, meeting.wall), Law::Push);
    if let Some(joint) = meeting.joint {
        let n = station.tangent.cross(joint.leaves).normalize_or_zero();
        let tip = -model.params.strip_mm(&joint) * joint.leaves;
        let floor = if joint.is_fast { Law::Both } else { Law::Push };
        found[TIP] = contact(gap(station, joint.male, tip, n), Law::Both);
        found[ROOT] = contact(gap(station, joint.male, Vec3::ZERO, n), Law::Both);
        found[FLOOR] = contact(gap(station, joint.male, tip, joint.leaves), floor);
        if joint.is_fast {
            found[SLIDE] = contact(gap(station, joint.male, tip, station.tangent), Law::Both);
        }
    }
    found
}

/// Pulls on the tips of side a and, reversed, of side b, as forces on the stations' motions.
pub(super) fn forces(model: &SurfaceModel, plan: &[Meeting], pulls: &[Vec3]) -> Vec<Motions> {
    let mut forces = vec![[0.0; N_MOTIONS]; model.assembly.stations.len()];
    for (((force, station), meeting), pull) in forces
        .iter_mut()
        .zip(&model.assembly.stations)
        .zip(plan)
        .zip(pulls)
    {
        if let Some(joint) = meeting.joint {
            *force = gap(
                station,
                Side::A,
                -model.params.strip_mm(&joint) * joint.leaves,
                *pull,
            );
        }
    }
    forces
}
