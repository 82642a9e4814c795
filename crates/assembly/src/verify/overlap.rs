//! Checks that no two pieces overlap, and that none leaves the model.

use rayon::prelude::*;
use shellock_geom::{Aabb, Solid, Vec3, Volume};
use shellock_report::Warning;

use super::body::Body;
use super::columns::{Columns, Frame, Grid};
use super::limits::{OUTSIDE_SHARE, OVERLAP_MM3};
use super::{Check, Finding, round};
use crate::PressFit;
use crate::causes::Cause;
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Greatest common volume of a detent or a rib with its counterpart, mm³: 2.8 × 0.6 × 0.4 mm, and rounding.
const PRESSED_MM3: f64 = 0.8;
/// Common volume worth a warning, mm³: a tenth of the limit. Joints cut without any gap reached 0.07 by
/// rounding alone (140 mm sphere shell in ten parts).
const WARN_MM3: f64 = 0.05;
/// Ray spacing across the model's box, as a share of its diagonal, and its bounds in mm. 0.25 mm on a 150 mm
/// print.
const RAY_SPACING: f64 = 0.001;
const RAY_SPACING_MM: (f64, f64) = (0.02, 0.3);
/// Direction of the rays, parallel to no face of a common model.
const RAYS: Vec3 = Vec3::new(0.2631, 0.4517, 0.8525);

/// Checks the exact common volume of every pair whose boxes meet, without intended press fits.
pub fn check_pairs(
    ctx: &Ctx,
    bodies: &IdVec<PatchId, Body>,
    press_fits: &[PressFit],
) -> Result<(Check, Vec<Finding>), Cancelled> {
    let solid: Vec<(PatchId, &Volume)> = bodies
        .iter()
        .filter_map(|(id, b)| b.volume.as_ref().map(|v| (id, v)))
        .collect();
    let bounds: Vec<Aabb> = solid.iter().map(|(_, v)| v.bounds()).collect();
    let pairs: Vec<(usize, usize)> = (0..solid.len())
        .flat_map(|a| (a + 1..solid.len()).map(move |b| (a, b)))
        .filter(|&(a, b)| bounds[a].intersects(bounds[b]))
        .collect();
    let common: Vec<(f64, Vec3)> = pairs
        .par_iter()
        .map(|&(a, b)| {
            ctx.check()?;
            let fits: Vec<_> = press_fits
                .iter()
                .filter(|fit| [solid[a].0, solid[b].0].contains(&fit.piece))
                .collect();
            let common = common_volume(solid[a].1, solid[b].1, &fits);
            Ok((round(common.volume()), common.bounds().center()))
        })
        .collect::<Result<_, Cancelled>>()?;
    let (mut worst, mut findings) = (0.0f64, Vec::new());
    for (&(a, b), &(volume_mm3, at)) in pairs.iter().zip(&common) {
        let (a, b, at) = (solid[a].0, solid[b].0, at.to_array());
        worst = worst.max(volume_mm3);
        if volume_mm3 > OVERLAP_MM3 {
            findings.push(Finding::Overlap { a, b, volume_mm3, at });
        } else if volume_mm3 > WARN_MM3 {
            ctx.warn(Warning::new(
                Cause::SmallOverlap { volume_mm3 },
                vec![a, b],
                Some(at),
            ));
        }
    }
    let figure = format!("worst {worst:.4} mm³ in {} pairs", pairs.len());
    Ok((
        Check::new("assembled pieces do not overlap", findings.is_empty(), figure),
        findings,
    ))
}

/// Common volume of both, without parts that are near a press fit and no larger than it needs.
fn common_volume(a: &Volume, b: &Volume, fits: &[&PressFit]) -> Volume {
    let common = a.intersect(b);
    if fits.is_empty() {
        return common;
    }
    let is_pressed = |part: &Volume| {
        let bounds = part.bounds();
        let is_near = |fit: &&&PressFit| fit.reaches(bounds.min) && fit.reaches(bounds.max);
        part.volume() <= PRESSED_MM3 && fits.iter().any(|fit| is_near(&fit))
    };
    Volume::union_all(
        common
            .components()
            .into_iter()
            .filter(|part| !is_pressed(part))
            .collect(),
    )
}

/// Checks the volume of all pieces outside the model, measured along parallel rays.
pub fn check_outside(model: &Solid, bodies: &IdVec<PatchId, Body>) -> (Check, Option<Finding>) {
    let frame = Frame::along(RAYS.normalize());
    let project = |points: &[Vec3]| -> Vec<Vec3> { points.iter().map(|&p| frame.project(p)).collect() };
    let model_points = project(&model.mesh().points);
    let piece_points: Vec<Vec<Vec3>> = bodies.iter().map(|(_, b)| project(&b.mesh.points)).collect();
    let bounds = Aabb::around(model_points.iter().chain(piece_points.iter().flatten()).copied());
    let spacing_mm = (RAY_SPACING * bounds.diagonal()).clamp(RAY_SPACING_MM.0, RAY_SPACING_MM.1);
    // A piece far away must not make the grid larger than memory.
    let spacing_mm = spacing_mm.max(bounds.diagonal() / 4000.0);
    let grid = Grid::cover(bounds, spacing_mm);
    let whole = Columns::of(&grid, &model_points, &model.mesh().triangles, Vec3::ZERO);
    let ids: Vec<PatchId> = bodies.ids().collect();
    let outside: Vec<f64> = ids
        .into_par_iter()
        .map(|id| {
            let piece = Columns::of(
                &grid,
                &piece_points[usize::from(id)],
                &bodies[id].mesh.triangles,
                Vec3::ZERO,
            );
            (piece.length_mm() - piece.common_length_mm(&whole)) * grid.cell_mm2()
        })
        .collect();
    let volume_mm3 = round(outside.iter().sum());
    let ok = volume_mm3 <= OUTSIDE_SHARE * model.volume();
    let check = Check::new("nothing outside the model", ok, format!("{volume_mm3:.3} mm³"));
    (check, (!ok).then_some(Finding::Outside { volume_mm3 }))
}

#[cfg(test)]
mod tests {
    use shellock_testkit::shapes::cuboid;

    use super::*;
    use crate::PressFitKind;

    #[test]
    fn a_press_fit_explains_what_it_takes_and_nothing_larger_or_elsewhere() {
        let piece = PatchId(1);
        let fit = PressFit {
            kind: PressFitKind::Rib,
            piece,
            at: [0.0; 3],
            interference_mm: 0.2,
            travel_mm: 2.0,
        };
        let floor = cuboid([-9.0, -9.0, -9.0], [9.0, 9.0, 0.0]);
        let shared_with = |bump: Volume| common_volume(&floor, &bump, &[&fit]).volume();
        assert_eq!(shared_with(cuboid([-0.5, -0.5, -0.2], [0.5, 0.5, 3.0])), 0.0);
        let large = shared_with(cuboid([-1.0, -1.0, -0.4], [1.0, 1.0, 3.0]));
        assert!((large - 1.6).abs() < 1e-9, "{large}");
        let elsewhere = shared_with(cuboid([7.0, 7.0, -0.2], [8.0, 8.0, 3.0]));
        assert!((elsewhere - 0.2).abs() < 1e-9, "{elsewhere}");
    }
}
