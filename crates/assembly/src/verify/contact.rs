//! Contacts: places where the finished pieces face each other closely enough to hold each other.

use rayon::prelude::*;
use shellock_geom::Aabb;
use shellock_geom::bvh::TriangleBvh;

use super::body::Body;
use super::sample;
pub use crate::motion::Contact;
use crate::{Cancelled, Ctx, IdVec, PatchId};

/// Distance between neighbouring samples, mm: several on every side of a 2 mm connector.
const SPACING_MM: f64 = 0.7;
/// Least and greatest number of samples on one piece.
const N_SAMPLES: (f64, f64) = (2_000.0, 60_000.0);
/// Greatest distance beyond the clearance between faces that still count as touching, mm: a printer's error.
pub const REACH_MM: f64 = 0.15;
/// Greatest dot product of the normals of two faces that face each other (26° from opposite).
const FACING: f64 = -0.9;
/// Greatest number of contacts that are kept; every k-th of a longer list.
const MOST_CONTACTS: usize = 20_000;

/// Finds all contacts, in order of `a`, then along its surface, then of `b`.
pub fn find(
    ctx: &Ctx,
    bodies: &IdVec<PatchId, Body>,
    clearance_mm: f64,
    seed: u64,
) -> Result<Vec<Contact>, Cancelled> {
    let reach_mm = clearance_mm + REACH_MM;
    let ids: Vec<PatchId> = bodies.ids().collect();
    let trees: Vec<(TriangleBvh, Aabb)> = ids
        .par_iter()
        .map(|&id| {
            (
                TriangleBvh::new(&bodies[id].mesh),
                bodies[id].mesh.bounds().grown(reach_mm),
            )
        })
        .collect();
    let found: Vec<Vec<Contact>> = ids
        .par_iter()
        .map(|&a| {
            ctx.check()?;
            let mesh = &bodies[a].mesh;
            let n = (mesh.area() / (SPACING_MM * SPACING_MM)).clamp(N_SAMPLES.0, N_SAMPLES.1) as usize;
            let samples = sample::on_surface(mesh, n, seed.wrapping_add(u64::from(a.0)));
            let area_mm2 = mesh.area() / n as f64;
            let mut contacts = Vec::new();
            for s in samples {
                for &b in ids
                    .iter()
                    .filter(|&&b| b != a && trees[usize::from(b)].1.contains(s.point))
                {
                    if let Some(near) = trees[usize::from(b)].0.nearest(s.point, reach_mm * reach_mm)
                        && s.normal.dot(bodies[b].mesh.face_normal(near.face as usize)) < FACING
                    {
                        let gap_mm = near.distance_sq.sqrt();
                        contacts.push(Contact {
                            a,
                            b,
                            point: s.point,
                            normal: s.normal,
                            gap_mm,
                            area_mm2,
                        });
                    }
                }
            }
            Ok(contacts)
        })
        .collect::<Result<_, Cancelled>>()?;
    let all: Vec<Contact> = found.into_iter().flatten().collect();
    let keep_every = all.len().div_ceil(MOST_CONTACTS).max(1);
    let standing_for_more = |c: Contact| Contact {
        area_mm2: c.area_mm2 * keep_every as f64,
        ..c
    };
    Ok(all
        .into_iter()
        .step_by(keep_every)
        .map(standing_for_more)
        .collect())
}
