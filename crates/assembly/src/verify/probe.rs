//! Checks that each piece except the key is held in every direction by the others.
//!
//! Each piece is pushed a small step in 66 directions and must collide with the rest. Where its contacts face
//! the push, they give the overlap. Elsewhere, rays through the piece do, and an exact boolean decides near
//! the limit.

use std::cell::LazyCell;

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Aabb, Vec3, Volume};

use super::body::Body;
use super::columns::{Columns, Frame, Grid};
use super::contact::Contact;
use super::limits::HOLD_MM3;
use super::{Check, Finding, round};
use crate::{Cancelled, Ctx, IdVec, PatchId, push};

/// Ray spacings, mm, each with the estimated overlap, mm³, from which a piece counts as held: at a depth of
/// 0.9 mm some thirty rays meet the overlap then. A margin for the sampling error, not a bound.
const LEVELS: [(f64, f64); 2] = [(0.5, 6.0), (0.2, 1.2)];
/// Estimated overlap below which a piece counts as loose, mm³: on the strict side of the limit, whatever the
/// error.
const SURELY_LOOSE_MM3: f64 = 0.1;
/// Overlap derived from contacts above which a piece counts as held, mm³: ten times the limit. Each contact
/// counts with its area and the depth of the overlap of both sides there, up to the depth below, mm.
const CONTACTS_HOLD_MM3: f64 = 5.5;
const CONTACT_DEPTH_MM: f64 = 0.4;
/// Start of rays below the surface of a side, mm, plus a share of the gap, because the nearest place may be
/// nearer than the one ahead.
const START_MM: f64 = 0.005;
const START_SHARE: f64 = 0.12;
/// Greatest number of rays across the longer side of a piece's shadow; larger prints get wider spacings.
const MOST_PIXELS: f64 = 1200.0;
/// Direction of the rays, parallel to no face of a common model.
const RAYS: Vec3 = Vec3::new(0.3713, 0.5219, 0.7680);

/// Pushes every piece except `key` by three clearances and 0.6 mm.
pub fn check(
    ctx: &Ctx,
    bodies: &IdVec<PatchId, Body>,
    contacts: &[Contact],
    key: PatchId,
    clearance_mm: f64,
) -> Result<(Check, Vec<Finding>), Cancelled> {
    let step_mm = push::length_mm(clearance_mm);
    let directions = push::directions();
    let frame = Frame::along(RAYS.normalize());
    let projected: Vec<Vec<Vec3>> = bodies
        .iter()
        .map(|(_, b)| b.mesh.points.iter().map(|&p| frame.project(p)).collect())
        .collect();
    let all: Vec<&Body> = bodies.iter().map(|(_, body)| body).collect();
    let trees: Vec<TriangleBvh> = all.into_par_iter().map(|b| TriangleBvh::new(&b.mesh)).collect();
    let trees: IdVec<PatchId, TriangleBvh> = trees.into_iter().collect();
    let ids: Vec<PatchId> = bodies.ids().filter(|&id| id != key).collect();
    let loose: Vec<Option<Finding>> = ids
        .into_par_iter()
        .map(|piece| {
            ctx.check()?;
            let own: Vec<TwoSides> = contacts
                .iter()
                .filter(|c| c.a == piece)
                .map(|c| TwoSides::new(c, &trees, step_mm))
                .collect();
            let doubtful: Vec<Vec3> = directions
                .iter()
                .copied()
                .filter(|d| !contacts_hold(&own, *d * step_mm))
                .collect();
            let free = free_directions(bodies, &projected, &frame, piece, step_mm, &doubtful);
            Ok((!free.is_empty()).then_some(Finding::Loose {
                piece,
                directions: free,
            }))
        })
        .collect::<Result<_, Cancelled>>()?;
    let findings: Vec<Finding> = loose.into_iter().flatten().collect();
    let figure = format!(
        "{} pieces loose in some of {} directions",
        findings.len(),
        directions.len()
    );
    Ok((
        Check::new("every piece but the key is blocked", findings.is_empty(), figure),
        findings,
    ))
}

/// Contact with the thickness of both sides.
struct TwoSides {
    normal: Vec3,
    area_mm2: f64,
    gap_mm: f64,
    own_mm: f64,
    other_mm: f64,
}

impl TwoSides {
    /// Measures both sides; thicknesses are capped at the length of a push.
    fn new(contact: &Contact, trees: &IdVec<PatchId, TriangleBvh>, push_mm: f64) -> Self {
        let Contact {
            a,
            b,
            point,
            normal,
            gap_mm,
            area_mm2,
        } = *contact;
        let thickness_mm = |piece: PatchId, surface: Vec3, inwards: Vec3, start_mm: f64| {
            let hit = trees[piece].first_hit(surface + start_mm * inwards, inwards, push_mm);
            hit.map_or(push_mm, |(_, mm)| mm)
        };
        Self {
            normal,
            area_mm2,
            gap_mm,
            own_mm: thickness_mm(a, point, -normal, START_MM),
            other_mm: thickness_mm(
                b,
                point + gap_mm * normal,
                normal,
                START_MM + START_SHARE * gap_mm,
            ),
        }
    }

    /// Depth of the overlap of both sides after a push by `step`, mm. Negative if they do not overlap, also
    /// where a thin side has passed the other.
    fn depth_mm(&self, step: Vec3) -> f64 {
        let pushed_mm = self.normal.dot(step);
        let front_mm = pushed_mm.min(self.gap_mm + self.other_mm);
        let back_mm = (pushed_mm - self.own_mm).max(self.gap_mm);
        front_mm - back_mm
    }
}

/// Returns true if the contacts of a piece alone prove that a push by `step` is held.
fn contacts_hold(contacts: &[TwoSides], step: Vec3) -> bool {
    let overlap_mm3: f64 = contacts
        .iter()
        .map(|c| c.area_mm2 * c.depth_mm(step).clamp(0.0, CONTACT_DEPTH_MM))
        .sum();
    overlap_mm3 >= CONTACTS_HOLD_MM3
}

fn free_directions(
    bodies: &IdVec<PatchId, Body>,
    projected: &[Vec<Vec3>],
    frame: &Frame,
    piece: PatchId,
    step_mm: f64,
    directions: &[Vec3],
) -> Vec<[f64; 3]> {
    let Some(own) = &bodies[piece].volume else {
        return Vec::new();
    };
    let room = own.bounds().grown(step_mm);
    let others: Vec<(PatchId, &Volume)> = bodies
        .iter()
        .filter_map(|(id, b)| Some((id, b.volume.as_ref()?)))
        .filter(|(id, v)| *id != piece && v.bounds().intersects(room))
        .collect();
    let points = &projected[usize::from(piece)];
    let shadow = Aabb::around(points.iter().copied()).grown(step_mm);
    let levels = LEVELS.map(|(spacing_mm, surely_held_mm3)| {
        let grid = Grid::cover(
            shadow,
            spacing_mm.max(shadow.size().truncate().max_element() / MOST_PIXELS),
        );
        let columns = move |&(id, _): &(PatchId, &Volume)| {
            Columns::of(
                &grid,
                &projected[usize::from(id)],
                &bodies[id].mesh.triangles,
                Vec3::ZERO,
            )
        };
        let others = &others;
        (
            grid,
            surely_held_mm3,
            LazyCell::new(move || others.iter().map(columns).collect::<Vec<Columns>>()),
        )
    });
    let is_held = |direction: Vec3| {
        let step = direction * step_mm;
        for (grid, surely_held_mm3, around) in &levels {
            let moved = Columns::of(grid, points, &bodies[piece].mesh.triangles, frame.project(step));
            let length: f64 = around.iter().map(|other| moved.common_length_mm(other)).sum();
            let estimate_mm3 = length * grid.cell_mm2();
            if estimate_mm3 >= *surely_held_mm3 {
                return true;
            }
            if estimate_mm3 < SURELY_LOOSE_MM3 {
                return false;
            }
        }
        is_held_exactly(&own.translate(step), &others)
    };
    directions
        .iter()
        .filter(|&&d| !is_held(d))
        .map(|d| d.to_array())
        .collect()
}

fn is_held_exactly(moved: &Volume, others: &[(PatchId, &Volume)]) -> bool {
    let mut sum = 0.0;
    others.iter().any(|(_, other)| {
        sum += round(moved.intersect(other).volume());
        sum >= HOLD_MM3
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blades_overlap_until_they_are_past_each_other_and_thick_walls_ever_more() {
        let sides = |thickness_mm: f64| TwoSides {
            normal: Vec3::Z,
            area_mm2: 100.0,
            gap_mm: 0.1,
            own_mm: thickness_mm,
            other_mm: thickness_mm,
        };
        let depth_mm = |thickness_mm: f64, push_mm: f64| sides(thickness_mm).depth_mm(push_mm * Vec3::Z);
        assert!((depth_mm(0.3, 0.4) - 0.3).abs() < 1e-12);
        assert!((depth_mm(2.0, 0.96) - 0.86).abs() < 1e-12);
        assert!(depth_mm(0.3, 0.96) < 0.0 && depth_mm(2.0, -0.5) < 0.0);
        assert!(contacts_hold(&[sides(2.0)], 0.96 * Vec3::Z));
        assert!(!contacts_hold(&[sides(0.3)], 0.96 * Vec3::Z));
    }
}
