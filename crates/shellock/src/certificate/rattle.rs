//! How far each piece of a locked assembly moves within its gaps.
//!
//! The lock's proof is about faces that touch; printed ones are a clearance apart. Contacts then allow the motions with
//! `A x ≤ g`, `g` their gaps. A piece's play is the farthest its centroid gets along the axes and along its separation
//! direction, both ways, and the farthest that it turns about the axes: linear programs, one each.
//!
//! Limits: linearised about the place of rest; faces farther apart than contacts reach stop nothing here; and the greatest
//! of a few directions is told, which is at least 1/√3 of the greatest of all. Real play is less where pieces bear on each
//! other by more faces than were sampled.

use nalgebra::DVector;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shellock_geom::{TriMesh, Vec3};

use super::frame;
use crate::plan::InstallationPlan;
use crate::verify::contact::Contact;
use crate::verify::motion::{Corner, Freedom, System};
use crate::{IdVec, PatchId};

/// Contacts of all pieces together that play is computed from; every k-th of a longer list.
///
/// On kits of 9 to 20 pieces three times as many change the greatest play by less than 0.02 mm.
const MOST_CONTACTS: usize = 4_000;

/// How far a piece moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Play {
    /// Greatest displacement of the centroid, mm.
    pub translation_mm: f64,
    /// Greatest turn, degrees.
    pub rotation_deg: f64,
}

/// How far a piece moves within its gaps. `None`: as far as it likes, or it is held by definition.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rattle {
    /// While no other piece moves.
    pub alone: Option<Play>,
    /// While the key and the first piece do not move, and all others do as they may: gaps add up.
    pub together: Option<Play>,
}

/// The play of each piece. Takes about 0.5 s for 13 pieces on two cores, most of it for `together`.
pub fn rattle(
    pieces: &IdVec<PatchId, TriMesh>,
    plan: &InstallationPlan,
    contacts: &[Contact],
) -> IdVec<PatchId, Rattle> {
    let none = Rattle { alone: None, together: None };
    let (Some(first), Some(key)) = (plan.steps.first(), plan.steps.last()) else {
        return IdVec::from_fn(pieces.len(), |_| none);
    };
    let (center, length_mm) = frame(pieces);
    let centered: Vec<Contact> = contacts.iter().map(|c| Contact { point: c.point - center, ..*c }).collect();
    let keep_every = centered.len().div_ceil(MOST_CONTACTS).max(1);
    let kept: Vec<Contact> = centered.iter().copied().step_by(keep_every).collect();
    let free: Vec<PatchId> = pieces.ids().filter(|&p| p != key.piece && p != first.piece).collect();
    let ids: Vec<PatchId> = pieces.ids().collect();
    let play_of = |piece: PatchId, contacts: &[Contact], free: &[PatchId]| {
        let step = plan.steps.iter().find(|s| s.piece == piece)?;
        let moved = Moved { piece, centroid: centroid(&pieces[piece]) - center, separation: step.separation.unit() };
        moved.play(contacts, free, length_mm)
    };
    let rattles = ids.into_par_iter().map(|piece| {
        let own: Vec<Contact> = centered.iter().copied().filter(|c| c.a == piece || c.b == piece).collect();
        let together = free.contains(&piece).then(|| play_of(piece, &kept, &free)).flatten();
        Rattle { alone: play_of(piece, &own, &[piece]), together }
    });
    rattles.collect::<Vec<Rattle>>().into_iter().collect()
}

/// A piece whose play is asked for; places are about the center of the kit.
struct Moved {
    piece: PatchId,
    centroid: Vec3,
    separation: Vec3,
}

impl Moved {
    fn play(&self, contacts: &[Contact], free: &[PatchId], length_mm: f64) -> Option<Play> {
        let system = System::new(contacts, free, length_mm, Freedom::Rigid);
        let gaps_mm: Vec<f64> = system.rows.iter().map(|row| contacts[row.contact].gap_mm.max(0.0)).collect();
        let at = system.column(free.binary_search(&self.piece).ok()?);
        let mut corner = Corner::at_rest(&system);
        let mut farthest = |velocity: Vec3, spin: Vec3| {
            let mut objective = DVector::zeros(system.n);
            for k in 0..3 {
                (objective[at + k], objective[at + 3 + k]) = (velocity[k], spin[k]);
            }
            system.farthest(&objective, &gaps_mm, &mut corner)
        };
        let (mut translation_mm, mut rotation) = (0.0f64, 0.0f64);
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, self.separation] {
            for d in [axis, -axis] {
                translation_mm = translation_mm.max(farthest(d, self.centroid.cross(d) / length_mm)?);
            }
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for d in [axis, -axis] {
                rotation = rotation.max(farthest(Vec3::ZERO, d)?);
            }
        }
        Some(Play { translation_mm, rotation_deg: (rotation / length_mm).to_degrees() })
    }
}

/// Centre of the volume; that of the box where there is none.
fn centroid(mesh: &TriMesh) -> Vec3 {
    let origin = mesh.bounds().center();
    let (mut moment, mut volume) = (Vec3::ZERO, 0.0);
    for face in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(face).map(|p| p - origin);
        let part = a.dot(b.cross(c)) / 6.0;
        volume += part;
        moment += (a + b + c) * (0.25 * part);
    }
    if volume > 0.0 { origin + moment / volume } else { origin }
}
