//! Chips: fragments of a body that broke off it. Seams that meet in a sharp fold of the surface leave some
//! that are smaller than a grid cell.
//!
//! A chip with outer skin is given to the body that it touches most, over a bridge in the gap between them;
//! otherwise the surface would have a hole there. A chip that cannot be joined to any body is dropped.

use crate::causes::Cause;
use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::grown::grown;
use shellock_geom::{Aabb, Vec3, Volume};
use shellock_report::{Ctx, PatchId, Warning};

use super::grid::ShellGrid;

/// Chips up to this volume are dropped, mm³: the loss is no more than a scratch.
const CRUMB_MM3: f64 = 0.2;
/// Least volumes that are reported, mm³: of dropped chips together, and of a chip given to another body.
const TOLD_MM3: f64 = 0.5;
const GIVEN_TOLD_MM3: f64 = 5.0;
/// Reach of a bridge beyond the gaps of both sides, mm; its neck is about as wide.
const BRIDGE_MM: f64 = 0.3;

/// A body in parts: the largest component with its cavities filled, and the chips that broke off.
struct Parts {
    piece: PatchId,
    body: Volume,
    chips: Vec<Volume>,
}

impl Parts {
    fn of((piece, part): (PatchId, Volume)) -> Self {
        let mut parts = part.components().into_iter();
        let body = parts.next().unwrap_or_else(Volume::empty);
        // Cavities inside the solid, as in the knee of a leg, are filled: resin could not drain from them.
        let chips = parts.filter(|c| c.signed_volume() > 0.0).collect();
        Self { piece, body, chips }
    }
}

/// Makes one connected body for each piece. Bodies closer than `gap_mm` to each other stay apart.
pub(super) fn whole_bodies(
    ctx: &Ctx,
    grid: &ShellGrid,
    gap_mm: f64,
    parts: Vec<(PatchId, Volume)>,
) -> Vec<(PatchId, Volume)> {
    let mut parts: Vec<Parts> = parts.into_par_iter().map(Parts::of).collect();
    for from in 0..parts.len() {
        let mut dropped: Vec<Volume> = Vec::new();
        for chip in std::mem::take(&mut parts[from].chips) {
            let is_worth = chip.volume() > CRUMB_MM3 && has_skin(grid, &chip);
            match is_worth.then(|| give(grid, gap_mm, &mut parts, &chip)).flatten() {
                Some(to) if to != from && chip.volume() > GIVEN_TOLD_MM3 => ctx.warn(Warning::new(
                    Cause::PartGiven {
                        given_mm3: chip.volume(),
                    },
                    vec![parts[from].piece, parts[to].piece],
                    Some(chip.bounds().center().to_array()),
                )),
                Some(_) => {}
                None => dropped.push(chip),
            }
        }
        let dropped_mm3: f64 = dropped.iter().map(Volume::volume).sum();
        if dropped_mm3 > TOLD_MM3 {
            ctx.warn(Warning::new(
                Cause::BodyInParts { dropped_mm3 },
                vec![parts[from].piece],
                dropped.first().map(|c| c.bounds().center().to_array()),
            ));
        }
    }
    parts.into_iter().map(|p| (p.piece, p.body)).collect()
}

/// Returns true if a chip reaches the surface of the model.
fn has_skin(grid: &ShellGrid, chip: &Volume) -> bool {
    let skin_mm = 0.5 * grid.band.cell_mm();
    let depth = |p: &Vec3| grid.band.sample(&grid.depth, *p);
    chip.to_mesh()
        .points
        .iter()
        .any(|p| depth(p).is_some_and(|d| d < skin_mm))
}

/// Merges a chip into the body with the largest shared area to which a bridge can be built. Returns the index
/// of that body; `None` where no bridge can be built.
fn give(grid: &ShellGrid, gap_mm: f64, parts: &mut [Parts], chip: &Volume) -> Option<usize> {
    let reach_mm = gap_mm + BRIDGE_MM;
    let around = grown(chip, reach_mm)?.intersect(&grid.solid);
    let room = around.bounds().grown(2.0 * gap_mm);
    let near: Vec<Volume> = parts.iter().map(|p| part_in(&p.body, room)).collect();
    let mut takers: Vec<(usize, f64)> = (0..parts.len())
        .map(|i| (i, contact_mm2(chip, &near[i], reach_mm)))
        .filter(|(_, contact_mm2)| *contact_mm2 > 0.0)
        .collect();
    takers.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (taker, _) in takers {
        let others = near.iter().enumerate().filter(|(i, _)| *i != taker);
        let others = Volume::union_all(others.map(|(_, v)| v.clone()).collect());
        let bridge = match grown(&others, gap_mm) {
            Some(kept_free) => around.subtract(&kept_free),
            None => around.clone(),
        };
        let joined = Volume::union_all(vec![parts[taker].body.clone(), bridge, chip.clone()]);
        let whole = joined
            .components()
            .into_iter()
            .next()
            .unwrap_or_else(Volume::empty);
        if whole.volume() > parts[taker].body.volume() + 0.9 * chip.volume() {
            parts[taker].body = whole;
            return Some(taker);
        }
    }
    None
}

/// The part of `body` that lies in `room`.
fn part_in(body: &Volume, room: Aabb) -> Volume {
    if body.bounds().intersects(room) {
        body.intersect(&Volume::cuboid(room))
    } else {
        Volume::empty()
    }
}

/// Area of the chip's surface no farther than `reach_mm` from `body`, mm².
fn contact_mm2(chip: &Volume, body: &Volume, reach_mm: f64) -> f64 {
    let (chip, body) = (chip.to_mesh(), body.to_mesh());
    if body.triangles.is_empty() {
        return 0.0;
    }
    let bvh = TriangleBvh::new(&body);
    let is_near = |f: &usize| {
        let [a, b, c] = chip.corners(*f);
        bvh.nearest((a + b + c) / 3.0, reach_mm * reach_mm).is_some()
    };
    (0..chip.triangles.len())
        .filter(is_near)
        .map(|f| chip.face_area(f))
        .sum()
}
