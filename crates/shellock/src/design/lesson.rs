//! Lessons for the next round from a finished kit that failed its verification.

use shellock_geom::Vec3;
use shellock_geom::bvh::TriangleBvh;
use shellock_make::{SeamLengths, short_connectors};

use super::Kit;
use crate::PatchId;
use crate::plan::lesson::{Lesson, WeakJoint};
use crate::verify::Finding;

/// Returns the lessons of a kit, in patches of its division. The last one always rejects the kit's plan.
/// Empty if the kit passed.
pub fn lessons(kit: &Kit) -> Vec<Lesson> {
    if kit.verification.has_passed() {
        return Vec::new();
    }
    let (patch, found) = (|piece| kit.handover.patch(piece), kit.handover.found_plan());
    let mut loose = Vec::new();
    let mut learned = Vec::new();
    for finding in &kit.verification.findings {
        match finding {
            &Finding::PathRubs {
                piece,
                against,
                travel_mm,
                thickness_mm,
                volume_mm3,
                ..
            } => {
                let piece = patch(piece);
                learned.push(Lesson::RubbingPath {
                    piece,
                    separation: found.separation(piece),
                    against: patch(against),
                    travel_mm,
                    thickness_mm,
                    volume_mm3,
                });
            }
            Finding::Loose { piece, .. }
            | Finding::PlayTooWide { piece, .. }
            | Finding::ComesOut { piece, .. } => {
                loose.push(patch(*piece));
            }
            &Finding::SurfaceLost { at, .. } => {
                let (at, stays) = (at.into(), kit.plan.steps[0].piece);
                let piece = patch_at(kit, at);
                // The piece installed first never moves out, so it has no direction to forbid.
                if piece != stays {
                    let piece = patch(piece);
                    let separation = found.separation(piece);
                    learned.push(Lesson::SkinLost {
                        piece,
                        separation,
                        at,
                    });
                }
            }
            Finding::ClusterMoves { motions } => loose.extend(motions.iter().map(|m| patch(m.piece))),
            _ => {}
        }
    }
    loose.sort_unstable();
    loose.dedup();
    learned.extend(weak_joints(kit).filter(|_| !loose.is_empty()));
    learned.push(Lesson::FailedPlan {
        plan: found.clone(),
        loose,
    });
    learned
}

/// Returns the piece whose outer surface is nearest to a point.
fn patch_at(kit: &Kit, at: Vec3) -> PatchId {
    let nearest = TriangleBvh::new(&kit.surface.mesh).nearest(at, f64::INFINITY);
    kit.surface.patch_of_face[nearest.expect("a surface has triangles").face as usize]
}

/// Finds pairs whose connectors are too short. Later plans must not rely on them along the same direction.
fn weak_joints(kit: &Kit) -> Option<Lesson> {
    let weak = short_connectors(&kit.plan, &kit.sizes, &kit.contacts, &kit.joints);
    let joint = |((later, earlier), [length_mm, seam_mm]): SeamLengths| {
        let [later, earlier] = [later, earlier].map(|piece| kit.handover.patch(piece));
        WeakJoint {
            later,
            earlier,
            separation: kit.handover.found_plan().separation(later),
            length_mm,
            seam_mm,
        }
    };
    let joints: Vec<WeakJoint> = weak.into_iter().map(joint).collect();
    (!joints.is_empty()).then_some(Lesson::WeakJoints(joints))
}
