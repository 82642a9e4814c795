//! What a plan adds to the parts: contacts between the two sides of a station, and the forces that pull them
//! apart.

use shellock_geom::Vec3;

use super::SurfaceModel;
use super::parts::{Motions, N_MOTIONS};
use crate::assembly::{Meeting, Side, Station};

/// Contacts of a station, of which a plan may leave some out: always as many, so that all plans have the same
/// unknowns.
pub(super) const N_CONTACTS: usize = 5;

/// The place of each among a station's contacts: the walls of both sides;
pub(super) const WALL: usize = 0;
/// the pin's tip and a side of the channel;
pub(super) const TIP: usize = 1;
/// the same at the pin's root;
pub(super) const ROOT: usize = 2;
/// the pin's tip and the channel's floor, and what friction holds back besides;
pub(super) const FLOOR: usize = 3;
/// what friction holds along the channel.
pub(super) const SLIDE: usize = 4;

/// When a contact bears something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Law {
    /// Always.
    Both,
    /// Where it is pressed together.
    Push,
    /// Never: there is none.
    Absent,
}

/// One contact: its energy is `(g · r)²/2` in the motions r of side a from side b, where one-sided only for a
/// negative sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contact {
    pub station: usize,
    /// The gap's gradient times the root of the stiffness, N/mm.
    pub gradient: Motions,
    pub law: Law,
}

impl Contact {
    /// What presses: all of `gap`, or what of it is negative.
    pub fn pressed(&self, gap: f64) -> f64 {
        match self.law {
            Law::Both => gap,
            Law::Push => gap.min(0.0),
            Law::Absent => 0.0,
        }
    }

    /// Whether it bears something at `gap`.
    pub fn is_closed(&self, gap: f64) -> bool {
        match self.law {
            Law::Both => true,
            Law::Push => gap <= 0.0,
            Law::Absent => false,
        }
    }
}

/// How side `from` moves from the other one along `g`, both perpendicular to the tangent, at `offset` from
/// the seam point.
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

/// The contacts of station `i`. Where there is a connector, neither the tips nor the seam points may part
/// across the channel, and the male's tip may not go deeper; the walls may not enter each other anywhere.
pub(super) fn contacts_at(model: &SurfaceModel, i: usize, meeting: &Meeting) -> [Contact; N_CONTACTS] {
    let station = &model.assembly.stations[i];
    let size_mm = meeting
        .joint
        .map_or(model.params.connector_mm, |joint| joint.size_mm);
    let root = model.params.contact_n_mm(size_mm, station.length_mm).sqrt();
    let contact = |gap: Motions, law| Contact {
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

/// The pulls on the tips of side a and, the other way, of side b, as forces on the stations' motions.
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
