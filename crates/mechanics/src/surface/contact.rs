//! What a plan adds to the parts: contacts between the two sides of a station, and the forces that pull them
//! apart.

use shellock_geom::Vec3;

use super::SurfaceModel;
use super::parts::{Motions, N_MOTIONS};
use crate::assembly::{Meeting, Side, Station};

/// One contact: its energy is `(g · r)²/2` in the motions r of side a from side b, where one-sided only for a
/// negative sum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    pub station: usize,
    /// The gap's gradient times the root of the stiffness, N/mm.
    pub gradient: Motions,
    pub is_one_sided: bool,
}

impl Contact {
    /// What presses: all of `gap`, or what of it is negative.
    pub fn pressed(&self, gap: f64) -> f64 {
        if self.is_one_sided { gap.min(0.0) } else { gap }
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

/// The contacts of a plan, station by station. Where there is a connector, neither the tips nor the seam
/// points may part across the channel, and the male's tip may not go deeper; the walls may not enter each
/// other anywhere.
pub(super) fn contacts(model: &SurfaceModel, plan: &[Meeting]) -> Vec<Contact> {
    let mut contacts = Vec::with_capacity(4 * plan.len());
    for (i, (station, meeting)) in model.assembly.stations.iter().zip(plan).enumerate() {
        let size_mm = meeting
            .joint
            .map_or(model.params.connector_mm, |joint| joint.size_mm);
        let root = model.params.contact_n_mm(size_mm, station.length_mm).sqrt();
        let contact = |gap: Motions, is_one_sided| Contact {
            station: i,
            gradient: gap.map(|g| root * g),
            is_one_sided,
        };
        contacts.push(contact(gap(station, Side::B, Vec3::ZERO, meeting.wall), true));
        if let Some(joint) = meeting.joint {
            let n = station.tangent.cross(joint.leaves).normalize_or_zero();
            let tip = -model.params.strip_mm(&joint) * joint.leaves;
            contacts.push(contact(gap(station, joint.male, tip, n), false));
            contacts.push(contact(gap(station, joint.male, Vec3::ZERO, n), false));
            contacts.push(contact(
                gap(station, joint.male, tip, joint.leaves),
                !joint.is_fast,
            ));
            if joint.is_fast {
                contacts.push(contact(gap(station, joint.male, tip, station.tangent), false));
            }
        }
    }
    contacts
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
