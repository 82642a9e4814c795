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

/// How far a piece moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Play {
    /// Greatest displacement of the centroid, mm.
    pub translation_mm: f64,
    /// Greatest turn, degrees.
    pub rotation_deg: f64,
}

/// The play of each piece while no other moves; `None` where it has no end.
pub fn play_alone(
    pieces: &IdVec<PatchId, TriMesh>,
    plan: &InstallationPlan,
    contacts: &[Contact],
) -> IdVec<PatchId, Option<Play>> {
    let (center, length_mm) = frame(pieces);
    let ids: Vec<PatchId> = pieces.ids().collect();
    let play = |&piece: &PatchId| {
        let own = centered(contacts.iter().filter(|c| c.a == piece || c.b == piece), center);
        Moved::new(pieces, plan, piece, center)?.play(&mut Room::new(&own, &[piece], length_mm))
    };
    ids.par_iter().map(play).collect::<Vec<Option<Play>>>().into_iter().collect()
}

/// The play of each piece while key and first piece do not move, and all others do as they may, so that gaps add up;
/// `None` where it has no end, and for the two that are held.
///
/// Slow, and no part of a build: 3 s for 9 pieces with 12 000 contacts, and more than in proportion for more pieces.
pub fn play_together(
    pieces: &IdVec<PatchId, TriMesh>,
    plan: &InstallationPlan,
    contacts: &[Contact],
) -> IdVec<PatchId, Option<Play>> {
    let (center, length_mm) = frame(pieces);
    let ends = [plan.steps.first(), plan.steps.last()].map(|step| step.map(|s| s.piece));
    let free: Vec<PatchId> = pieces.ids().filter(|&p| !ends.contains(&Some(p))).collect();
    let mut room = Room::new(&centered(contacts.iter(), center), &free, length_mm);
    let play = |piece: PatchId| {
        let moved = Moved::new(pieces, plan, piece, center).filter(|_| free.contains(&piece))?;
        moved.play(&mut room)
    };
    pieces.ids().map(play).collect()
}

fn centered<'a>(contacts: impl Iterator<Item = &'a Contact>, center: Vec3) -> Vec<Contact> {
    contacts.map(|c| Contact { point: c.point - center, ..*c }).collect()
}

/// What contacts leave free pieces.
struct Room {
    system: System,
    free: Vec<PatchId>,
    gaps_mm: Vec<f64>,
    length_mm: f64,
    corner: Corner,
}

impl Room {
    fn new(contacts: &[Contact], free: &[PatchId], length_mm: f64) -> Self {
        let system = System::new(contacts, free, length_mm, Freedom::Rigid);
        let gaps_mm = system.rows.iter().map(|row| contacts[row.contact].gap_mm.max(0.0)).collect();
        let corner = Corner::at_rest(&system);
        Self { system, free: free.to_vec(), gaps_mm, length_mm, corner }
    }
}

/// A piece whose play is asked for; places are about the center of the kit.
struct Moved {
    piece: PatchId,
    centroid: Vec3,
    separation: Vec3,
}

impl Moved {
    /// `None` where the plan does not name the piece.
    fn new(pieces: &IdVec<PatchId, TriMesh>, plan: &InstallationPlan, piece: PatchId, center: Vec3) -> Option<Self> {
        let step = plan.steps.iter().find(|s| s.piece == piece)?;
        Some(Self { piece, centroid: centroid(&pieces[piece]) - center, separation: step.separation.unit() })
    }

    fn play(&self, room: &mut Room) -> Option<Play> {
        let Room { system, free, gaps_mm, length_mm, corner } = room;
        let at = system.column(free.binary_search(&self.piece).ok()?);
        let mut farthest = |velocity: Vec3, spin: Vec3| {
            let mut objective = DVector::zeros(system.n);
            for k in 0..3 {
                (objective[at + k], objective[at + 3 + k]) = (velocity[k], spin[k]);
            }
            system.farthest(&objective, gaps_mm, corner)
        };
        let (mut translation_mm, mut rotation) = (0.0f64, 0.0f64);
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, self.separation] {
            for d in [axis, -axis] {
                translation_mm = translation_mm.max(farthest(d, self.centroid.cross(d) / *length_mm)?);
            }
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for d in [axis, -axis] {
                rotation = rotation.max(farthest(Vec3::ZERO, d)?);
            }
        }
        Some(Play { translation_mm, rotation_deg: (rotation / *length_mm).to_degrees() })
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
