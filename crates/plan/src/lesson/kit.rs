//! Lessons for the next plan from a finished kit that failed its verification.

use shellock_assembly::verify::{Finding, Verification};
use shellock_geom::Vec3;
use shellock_geom::bvh::TriangleBvh;
use shellock_report::PatchId;
use shellock_surface::SegmentedSurface;

use super::Lesson;
use crate::handover::Handover;

/// Returns the lessons of a kit that failed its `verification`, in patches of its division; `surface` is that
/// of the kit, divided into its pieces. The last lesson always rejects the kit's plan. Empty if the kit
/// passed. `weak_joints` are the lesson of connectors that are too short, which counts if pieces are loose.
pub fn of_kit(
    verification: &Verification,
    handover: &Handover,
    surface: &SegmentedSurface,
    weak_joints: impl FnOnce() -> Option<Lesson>,
) -> Vec<Lesson> {
    if verification.has_passed() {
        return Vec::new();
    }
    let findings = &verification.findings;
    let mut loose: Vec<PatchId> = findings.iter().flat_map(loose_pieces).collect();
    loose.iter_mut().for_each(|piece| *piece = handover.patch(*piece));
    loose.sort_unstable();
    loose.dedup();
    let mut lessons: Vec<Lesson> = findings
        .iter()
        .filter_map(|finding| of_finding(finding, handover, surface))
        .collect();
    if !loose.is_empty() {
        lessons.extend(weak_joints());
    }
    lessons.push(Lesson::FailedPlan {
        plan: handover.found_plan().clone(),
        loose,
    });
    lessons
}

/// Returns the lesson of a finding that forbids a direction to a piece.
fn of_finding(finding: &Finding, handover: &Handover, surface: &SegmentedSurface) -> Option<Lesson> {
    match *finding {
        Finding::PathRubs {
            piece,
            against,
            travel_mm,
            thickness_mm,
            volume_mm3,
            ..
        } => {
            let piece = handover.patch(piece);
            Some(Lesson::RubbingPath {
                piece,
                separation: handover.found_plan().separation(piece),
                against: handover.patch(against),
                travel_mm,
                thickness_mm,
                volume_mm3,
            })
        }
        Finding::SurfaceLost { at, .. } => {
            let at = at.into();
            let piece = nearest_piece(surface, at);
            // The piece installed first never moves out, so it has no direction to forbid.
            (piece != PatchId(0)).then(|| {
                let piece = handover.patch(piece);
                Lesson::SkinLost {
                    piece,
                    separation: handover.found_plan().separation(piece),
                    at,
                }
            })
        }
        _ => None,
    }
}

/// Returns the pieces of the kit that a finding calls loose.
fn loose_pieces(finding: &Finding) -> Vec<PatchId> {
    match finding {
        Finding::Loose { piece, .. }
        | Finding::PlayTooWide { piece, .. }
        | Finding::ComesOut { piece, .. } => vec![*piece],
        Finding::ClusterMoves { motions } => motions.iter().map(|m| m.piece).collect(),
        _ => Vec::new(),
    }
}

/// Returns the piece whose outer surface is nearest to a point.
fn nearest_piece(surface: &SegmentedSurface, at: Vec3) -> PatchId {
    let nearest = TriangleBvh::new(&surface.mesh).nearest(at, f64::INFINITY);
    surface.patch_of_face[nearest.expect("a surface has triangles").face as usize]
}
