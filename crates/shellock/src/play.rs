//! The play of a finished kit, proven for motions of any size: docs/certificate.md has the theorem.

mod barrier;
mod bearing;
mod bound;
mod quantity;

use shellock_geom::{TriMesh, Vec3};

use crate::plan::InstallationPlan;
use crate::{Ctx, IdVec, PatchId};
use bearing::Surfaces;

pub fn trial(ctx: &Ctx, pieces: &IdVec<PatchId, TriMesh>, plan: &InstallationPlan, clearance_mm: f64) {
    let t = std::time::Instant::now();
    let surfaces = Surfaces::new(pieces);
    let bearings = surfaces.bearings(ctx, clearance_mm, 0).unwrap();
    eprintln!("{} bearings, {:?}", bearings.len(), t.elapsed());
    let centers: IdVec<PatchId, Vec3> = pieces.as_slice().iter().map(crate::certificate::centroid).collect();
    let mut count = vec![0; pieces.len()];
    bearings.iter().for_each(|b| { count[usize::from(b.a)] += 1; count[usize::from(b.b)] += 1; });
    let key = plan.key();
    let seat = {
        let mut n = vec![0; pieces.len()];
        for b in &bearings { if b.a == key { n[usize::from(b.b)] += 1; } if b.b == key { n[usize::from(b.a)] += 1; } }
        (0..pieces.len()).max_by_key(|&i| n[i]).unwrap()
    };
    let slide = bound::Slide { key, seat: seat.into(), at: centers[key].to_array(), along: plan.separation(key).unit().to_array(), most_mm: std::env::var("SLIDE").map_or(0.5, |s| s.parse().unwrap()) };
    let show = |name: String, free: &[PatchId]| {
        let t = std::time::Instant::now();
        let problem = bound::Problem { surfaces: &surfaces, bearings: &bearings, centers: &centers, slide: &slide, free };
        match problem.solve(ctx).unwrap() {
            Ok(p) => {
                let worst = p.quantities.iter().filter(|q| q.minus.is_none() && true).fold([0.0f64; 2], |m, q| if q.at.is_some() { [m[0].max(q.norm()), m[1]] } else { [m[0], m[1].max(q.norm().to_degrees())] });
                let n: usize = p.multipliers.iter().flatten().flatten().map(Vec::len).sum();
                eprintln!("{name}: {:.3} mm {:.3} deg; {} quantities {} rows {} multipliers {:?}", worst[0], worst[1], p.quantities.len(), p.rows.len(), n, t.elapsed());
            }
            Err(e) => eprintln!("{name}: {e:?} {:?}", t.elapsed()),
        }
    };
    for id in pieces.ids() { show(format!("piece {id}"), &[id]); }
    if std::env::var("TOGETHER").is_err() { return; }
    let held = (0..pieces.len()).max_by_key(|&i| count[i]).unwrap();
    let free: Vec<PatchId> = pieces.ids().filter(|p| usize::from(*p) != held).collect();
    show(format!("all but {held}"), &free);
}
