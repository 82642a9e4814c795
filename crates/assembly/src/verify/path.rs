//! Checks that each piece can travel along its separation direction past everything installed before it.
//!
//! Take any ray along the direction `s` and any interval `[a₀, a₁]` of the travelling piece. An interval
//! `[b₀, b₁]` of an earlier piece is in the way for travels `b₀ − a₁ < t < b₁ − a₀`. The overlapping length
//! rises, stays constant and falls with slope one:
//!
//! ```text
//!  length |     ______
//!         |    /      \
//!         |___/________\____ t
//!        b₀−a₁         b₁−a₀
//! ```
//!
//! The sum over all rays is the overlap volume for every travel at once. A body's area is at least twice its
//! shadow, so the mean length of the intervals bounds the mean thickness `2V/A` from above. Only travels that
//! exceed a bound in both are decided by an exact boolean.

use rayon::prelude::*;
use shellock_geom::{Aabb, Vec3, Volume};

use super::body::Body;
use super::columns::{Columns, Frame, Grid};
use super::limits::{RUB_MM, RUB_MM3, TRAVELS_MM};
use super::{Check, Finding, round};
use crate::InstallationStep;
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Share of the two limits at which the rays call for an exact result. It is a margin for the sampling error
/// of the rays, not a bound: an overlap thinner than a pixel is met in proportion to its area only on
/// average.
const IN_DOUBT: f64 = 0.5;
/// Distance between neighbouring rays, mm.
const PIXEL_MM: f64 = 0.25;
/// Greatest number of rays across the longer side of a piece's shadow; larger prints get wider pixels.
const MOST_PIXELS: f64 = 1200.0;
/// Greatest overlap of two intervals that counts as rounding, mm.
const ROUNDING_MM: f64 = 1e-3;

/// Change of the overlap's length as the piece travels.
#[derive(Clone, Copy)]
struct Event {
    travel_mm: f64,
    /// Change of the number of intervals whose overlap grows, minus those whose overlap shrinks.
    slope: i32,
    /// Change of the number of overlapping intervals.
    count: i32,
}

/// Checks every path of the plan. `length_mm` is the farthest travel, the diagonal of the model's box.
pub fn check(
    ctx: &Ctx,
    bodies: &IdVec<PatchId, Body>,
    steps: &[InstallationStep],
    length_mm: f64,
) -> Result<(Check, Vec<Finding>), Cancelled> {
    let rubs: Vec<Option<Finding>> = (1..steps.len())
        .into_par_iter()
        .map(|at| {
            ctx.check()?;
            Ok(check_path(
                bodies,
                steps[at].piece,
                steps[at].separation.unit(),
                &steps[..at],
                length_mm,
            ))
        })
        .collect::<Result<_, Cancelled>>()?;
    let findings: Vec<Finding> = rubs.into_iter().flatten().collect();
    let figure = format!(
        "{} of {} paths rub",
        findings.len(),
        steps.len().saturating_sub(1)
    );
    Ok((
        Check::new("every installation path is free", findings.is_empty(), figure),
        findings,
    ))
}

fn check_path(
    bodies: &IdVec<PatchId, Body>,
    piece: PatchId,
    separation: Vec3,
    earlier: &[InstallationStep],
    length_mm: f64,
) -> Option<Finding> {
    let moving = bodies[piece].volume.as_ref()?;
    let partners: Vec<(PatchId, &Volume)> = earlier
        .iter()
        .filter_map(|s| Some((s.piece, bodies[s.piece].volume.as_ref()?)))
        .collect();
    let frame = Frame::along(separation);
    let project =
        |id: PatchId| -> Vec<Vec3> { bodies[id].mesh.points.iter().map(|&p| frame.project(p)).collect() };
    let points = project(piece);
    let shadow = Aabb::around(points.iter().copied());
    let grid = Grid::cover(
        shadow,
        PIXEL_MM.max(shadow.size().truncate().max_element() / MOST_PIXELS),
    );
    let own = Columns::of(&grid, &points, &bodies[piece].mesh.triangles, Vec3::ZERO);

    let mut all = Vec::new();
    let mut in_doubt = Vec::new();
    for &(partner, _) in &partners {
        let points = project(partner);
        let bounds = Aabb::around(points.iter().copied());
        if bounds.max.z < shadow.min.z {
            continue;
        }
        let theirs = Columns::of(&grid, &points, &bodies[partner].mesh.triangles, Vec3::ZERO);
        let mut events = events_between(&own, &theirs);
        in_doubt.extend(travels_in_doubt(&mut events, grid.cell_mm2(), length_mm));
        all.extend(events);
    }
    in_doubt.extend(travels_in_doubt(&mut all, grid.cell_mm2(), length_mm));
    in_doubt.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.total_cmp(&b.0)));
    in_doubt.dedup();
    in_doubt
        .iter()
        .find_map(|&(travel_mm, _)| rub_at(piece, moving, separation * travel_mm, travel_mm, &partners))
}

/// Changes of the overlap of `own`, moved along the rays, with `theirs` over the travel.
fn events_between(own: &Columns, theirs: &Columns) -> Vec<Event> {
    let mut events = Vec::new();
    for ray in 0..own.n_rays() {
        for &[a0, a1] in own.on_ray(ray) {
            for &[b0, b1] in theirs.on_ray(ray) {
                if b1 - a0 > ROUNDING_MM {
                    let (full, wanes) = ((b0 - a0).min(b1 - a1), (b0 - a0).max(b1 - a1));
                    events.push(Event {
                        travel_mm: b0 - a1,
                        slope: 1,
                        count: 1,
                    });
                    events.push(Event {
                        travel_mm: full,
                        slope: -1,
                        count: 0,
                    });
                    events.push(Event {
                        travel_mm: wanes,
                        slope: -1,
                        count: 0,
                    });
                    events.push(Event {
                        travel_mm: b1 - a0,
                        slope: 1,
                        count: -1,
                    });
                }
            }
        }
    }
    events
}

/// Travels at which an overlap may exceed both limits, each with its volume, mm³: the worst by volume, the
/// worst by thickness, and the fixed travels of [`TRAVELS_MM`].
fn travels_in_doubt(events: &mut Vec<Event>, cell_mm2: f64, length_mm: f64) -> Vec<(f64, f64)> {
    if events.is_empty() {
        return Vec::new();
    }
    let n_real = events.len();
    let fixed = TRAVELS_MM.into_iter().filter(|&t| t < length_mm);
    events.extend(fixed.clone().map(|travel_mm| Event {
        travel_mm,
        slope: 0,
        count: 0,
    }));
    events.sort_by(|a, b| a.travel_mm.total_cmp(&b.travel_mm));
    let (mut length, mut slope, mut count, mut last) = (0.0f64, 0i32, 0i32, events[0].travel_mm);
    let mut found = Vec::new();
    let (mut largest, mut thickest) = ((0.0, 0.0), (0.0, 0.0, 0.0));
    for e in events.iter() {
        length += f64::from(slope) * (e.travel_mm - last);
        last = e.travel_mm;
        let (volume, mean_mm) = (length * cell_mm2, length / f64::from(count.max(1)));
        if last > 0.0 && volume > IN_DOUBT * RUB_MM3 && mean_mm > IN_DOUBT * RUB_MM {
            if volume > largest.1 {
                largest = (last, volume);
            }
            if mean_mm > thickest.2 {
                thickest = (last, volume, mean_mm);
            }
            if (e.slope, e.count) == (0, 0) {
                found.push((last, volume));
            }
        }
        slope += e.slope;
        count += e.count;
    }
    events.retain(|e| (e.slope, e.count) != (0, 0));
    debug_assert_eq!(events.len(), n_real);
    if largest.1 > 0.0 {
        found.extend([largest, (thickest.0, thickest.1)]);
    }
    found
}

/// Exact overlap of `piece` moved by `travel`, if it exceeds rounding with one partner or with all together.
fn rub_at(
    piece: PatchId,
    moving: &Volume,
    travel: Vec3,
    travel_mm: f64,
    partners: &[(PatchId, &Volume)],
) -> Option<Finding> {
    let moved = moving.translate(travel);
    let measured = |hit: Volume| (round(hit.volume()), round(hit.area()), hit.bounds().center());
    let hits: Vec<(PatchId, (f64, f64, Vec3))> = partners
        .iter()
        .map(|&(id, v)| (id, measured(moved.intersect(v))))
        .collect();
    let exceeds = |volume: f64, area: f64| volume > RUB_MM3 && 2.0 * volume / area > RUB_MM;
    let total = hits
        .iter()
        .fold((0.0, 0.0), |sum, (_, h)| (sum.0 + h.0, sum.1 + h.1));
    if !exceeds(total.0, total.1) && !hits.iter().any(|(_, h)| exceeds(h.0, h.1)) {
        return None;
    }
    let &(against, (volume_mm3, area, at)) = hits.iter().max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    let thickness_mm = round(2.0 * volume_mm3 / area);
    Some(Finding::PathRubs {
        piece,
        against,
        travel_mm,
        thickness_mm,
        volume_mm3,
        at: at.to_array(),
    })
}

#[cfg(test)]
mod tests {
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use shellock_testkit::shapes::cuboid;

    use super::*;

    fn random_boxes(rng: &mut ChaCha8Rng, shift: Vec3) -> Volume {
        let mut corner = || Vec3::new(rng.random(), rng.random(), rng.random()) * 6.0;
        let parts = (0..3)
            .map(|_| (corner(), corner()))
            .map(|(a, b)| (a.min(b) + shift, a.max(b) + shift + 1.0));
        Volume::union_all(parts.map(|(min, max)| cuboid(min, max)).collect())
    }

    /// Overlap volume at `travel_mm` according to the sweep of events.
    fn swept_volume(events: &[Event], travel_mm: f64) -> f64 {
        let passed = events.iter().filter(|e| e.travel_mm < travel_mm);
        passed
            .map(|e| f64::from(e.slope) * (travel_mm - e.travel_mm))
            .sum()
    }

    #[test]
    fn swept_overlaps_are_those_of_booleans_at_every_travel() {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        for s in [
            Vec3::X,
            Vec3::new(1.0, -1.0, 0.0).normalize(),
            Vec3::new(1.0, 1.0, 1.0).normalize(),
        ] {
            let (p, q) = (
                random_boxes(&mut rng, Vec3::ZERO),
                random_boxes(&mut rng, s * 4.0),
            );
            let frame = Frame::along(s);
            let project =
                |m: &Volume| -> Vec<Vec3> { m.to_mesh().points.iter().map(|&x| frame.project(x)).collect() };
            let points = project(&p);
            let grid = Grid::cover(Aabb::around(points.iter().copied()), 0.1);
            let own = Columns::of(&grid, &points, &p.to_mesh().triangles, Vec3::ZERO);
            let theirs = Columns::of(&grid, &project(&q), &q.to_mesh().triangles, Vec3::ZERO);
            let events = events_between(&own, &theirs);
            for travel_mm in [0.3, 1.7, 4.0, 6.5, 9.0] {
                let exact = p.translate(s * travel_mm).intersect(&q).volume();
                let swept = swept_volume(&events, travel_mm) * grid.cell_mm2();
                assert!(
                    (exact - swept).abs() < 0.02 * exact + 0.1,
                    "at {travel_mm}: {swept} for {exact}"
                );
            }
        }
    }
}
