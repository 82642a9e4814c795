//! Thin sheets that carving leaves of pins and of the wall's inner side, and that no printer can make. They
//! are shaved off where nobody sees it.
//!
//! ```text
//!      ┌──┐ ┌┐            ┌──┐
//!      │  │ ││    ─────►  │  │
//!   ───┘  └─┘└───      ───┘  └──────
//! ```
//!
//! Sheets are found by rays from points of the surface straight to the other side, and cut with boxes as
//! thick as the sheet there. Shaving never reduces the freedom of any piece.

use std::collections::BTreeSet;

use rayon::prelude::*;
use shellock_assembly::verify::{ThinPoint, thin_points};
use shellock_geom::{Aabb, TriMesh, Vec3, Volume};
use shellock_report::{Cancelled, Ctx, IdVec, PatchId};

/// Greatest thickness of sheets that are shaved, mm, also where the printer's least wall is thicker: the
/// connectors' own walls are no thinner.
const MOST_SHEET_MM: f64 = 0.5;
/// Half the width of a box, mm: rays are about as far apart.
const HALF_MM: f64 = 0.4;
/// Least thickness of a box, mm, so that it cuts no slot into the material that a sheet hangs on, and its
/// reach beyond either side.
const LEAST_CUT_MM: f64 = 0.35;
const BEYOND_MM: f64 = 0.05;
/// Side of the cubes, mm, in each of which one point is worked on.
const SPACING_MM: f64 = 0.3;
/// Depth below the outer surface down to which material is kept, mm.
const SKIN_MM: f64 = 0.6;
/// Rounds of shaving; sheets that remain after them are reported.
const MOST_ROUNDS: usize = 2;

/// Depth below the outer surface, mm; `None` away from the wall, where it is unknown.
pub(super) type Depth<'a> = dyn Fn(Vec3) -> Option<f64> + Sync + 'a;

/// Shaves the sheets thinner than `least_wall_mm` off each piece.
pub(super) fn shave(
    ctx: &Ctx,
    least_wall_mm: f64,
    depth: &Depth<'_>,
    pieces: &mut IdVec<PatchId, Volume>,
) -> Result<(), Cancelled> {
    let shaved: Vec<Option<Volume>> = pieces
        .as_slice()
        .par_iter()
        .map(|piece| {
            ctx.check()?;
            Ok(without_thin_sheets(
                piece,
                least_wall_mm.min(MOST_SHEET_MM),
                depth,
            ))
        })
        .collect::<Result<_, Cancelled>>()?;
    for (i, volume) in shaved.into_iter().enumerate() {
        if let Some(volume) = volume {
            pieces[PatchId::from(i)] = volume;
        }
    }
    Ok(())
}

/// The piece without its thin sheets; `None` where nothing is thin.
fn without_thin_sheets(piece: &Volume, limit_mm: f64, depth: &Depth<'_>) -> Option<Volume> {
    let mut shaved = None;
    for _ in 0..MOST_ROUNDS {
        let body: &Volume = shaved.as_ref().unwrap_or(piece);
        let sheets = points(&body.to_mesh(), limit_mm, depth);
        if sheets.is_empty() {
            break;
        }
        let thick = |p: &ThinPoint| (p.thickness_mm + 2.0 * BEYOND_MM).max(LEAST_CUT_MM);
        let boxes = sheets.iter().map(|p| slab(p, thick(p))).collect();
        match less(body, boxes, depth) {
            Some(rest) => shaved = Some(rest),
            None => break,
        }
    }
    shaved
}

/// The largest part of `body` after the boxes are cut. A part with some of the outer surface must not break
/// off: the boxes around it stay uncut, and the sheet by which it hangs is reported. `None` if none may be
/// cut.
fn less(body: &Volume, mut boxes: Vec<Volume>, depth: &Depth<'_>) -> Option<Volume> {
    while !boxes.is_empty() {
        let mut parts = body
            .subtract(&Volume::union_all(boxes.clone()))
            .components()
            .into_iter();
        let rest = parts.next()?;
        let with_skin: Vec<Aabb> = parts
            .filter(|part| has_skin(part, depth))
            .map(|part| part.bounds().grown(BEYOND_MM))
            .collect();
        if with_skin.is_empty() {
            return Some(rest);
        }
        let n_boxes = boxes.len();
        boxes.retain(|b| !with_skin.iter().any(|part| part.intersects(b.bounds())));
        if boxes.len() == n_boxes {
            break;
        }
    }
    None
}

/// Returns true if a corner of `part` is so near to the outer surface that a hole would show there.
fn has_skin(part: &Volume, depth: &Depth<'_>) -> bool {
    let is_near = |p: &Vec3| depth(*p).is_some_and(|mm| mm < SKIN_MM);
    part.to_mesh().points.iter().any(is_near)
}

/// Points below the skin where a piece is thin, one per cube.
fn points(mesh: &TriMesh, limit_mm: f64, depth: &Depth<'_>) -> Vec<ThinPoint> {
    let is_deep = |p: Vec3| depth(p).is_none_or(|mm| mm > SKIN_MM);
    let mut taken = BTreeSet::new();
    let mut found = thin_points(mesh, [limit_mm, 0.0], &is_deep).concat();
    found.retain(|p| {
        is_deep(p.at + p.thickness_mm * p.across)
            && taken.insert((p.at / SPACING_MM).floor().to_array().map(|x| x as i64))
    });
    found
}

/// A box around the midpoint between both sides.
fn slab(p: &ThinPoint, thick_mm: f64) -> Volume {
    let (u, v) = p.across.any_orthonormal_pair();
    let middle = p.at + 0.5 * p.thickness_mm * p.across;
    let half = [HALF_MM * u, HALF_MM * v, 0.5 * thick_mm * p.across];
    let sign = |bits: u8, axis: u8| if bits >> axis & 1 == 1 { 1.0 } else { -1.0 };
    let corner =
        |bits: u8| middle + sign(bits, 0) * half[0] + sign(bits, 1) * half[1] + sign(bits, 2) * half[2];
    Volume::hull(&(0..8).map(corner).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use shellock_assembly::verify::thin_places;
    use shellock_testkit::shapes::cuboid;

    use super::*;

    /// A block with a fin of 0.3 mm.
    fn block() -> Volume {
        cuboid([0.0; 3], [12.0, 10.0, 6.0]).union(&cuboid([2.0, 1.0, 6.0], [10.0, 1.3, 8.0]))
    }

    #[test]
    fn a_fin_is_shaved_and_the_block_stays() {
        let mut pieces: IdVec<PatchId, Volume> = std::iter::once(block()).collect();
        shave(&Ctx::quiet(), 0.4, &|_| None, &mut pieces).unwrap();
        let made = &pieces[PatchId(0)];
        assert_eq!(thin_places(&made.to_mesh(), 0.4, 0.2), []);
        // The root of the fin keeps a step or a groove.
        assert!((made.volume() - 720.0).abs() < 2.0, "{}", made.volume());
        assert_eq!(made.components().len(), 1);
    }

    /// Two blocks joined by a sheet, the smaller with some of the outer surface: the sheet stays.
    #[test]
    fn what_has_outer_surface_does_not_come_off_with_a_sheet() {
        let tip = cuboid([2.0, 0.0, 8.0], [10.0, 4.0, 11.0]);
        let piece = block().union(&tip);
        let depth = |p: Vec3| Some(11.0 - p.z);
        let mut pieces: IdVec<PatchId, Volume> = std::iter::once(piece.clone()).collect();
        shave(&Ctx::quiet(), 0.4, &depth, &mut pieces).unwrap();
        let made = &pieces[PatchId(0)];
        assert_eq!(made.components().len(), 1);
        assert!(made.intersect(&tip).volume() > tip.volume() - 1.0);
        let mut pieces: IdVec<PatchId, Volume> = std::iter::once(piece).collect();
        shave(&Ctx::quiet(), 0.4, &|_| None, &mut pieces).unwrap();
        assert!(pieces[PatchId(0)].bounds().max.z < 8.0 + 1e-9);
    }

    #[test]
    fn what_is_near_the_skin_stays() {
        let mut pieces: IdVec<PatchId, Volume> = std::iter::once(block()).collect();
        shave(&Ctx::quiet(), 0.4, &|_| Some(0.1), &mut pieces).unwrap();
        assert!((pieces[PatchId(0)].volume() - block().volume()).abs() < 1e-9);
    }
}
