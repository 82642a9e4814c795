use shellock::*;
use shellock_geom::*;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let (model, size, out) = (&a[1], a[2].parse::<f64>().unwrap(), &a[3]);
    let n: Option<usize> = a.get(4).and_then(|s| s.parse().ok());
    let labels = a.get(5).map(|f| io::read_labels(&std::fs::read(f).unwrap()).unwrap());
    let stop = AtomicBool::new(false);
    let t0 = Instant::now();
    let rep = |p: context::Progress<'_>| {
        if let context::Progress::Stage { name, .. } = p {
            eprintln!("{:6.2} {name}", t0.elapsed().as_secs_f64())
        }
    };
    let ctx = Ctx::new(&rep, &stop);
    let bytes = std::fs::read(model).unwrap();
    let loaded = io::read_mesh(&bytes, std::path::Path::new(model).extension().and_then(|e| e.to_str())).unwrap();
    let (solid, _kept) = check::into_solid(&loaded.mesh).unwrap();
    let b = solid.mesh().bounds();
    let k = size / b.size().max_element();
    let mut m = solid.into_mesh();
    m.points.iter_mut().for_each(|p| *p = *p * k);
    let solid = Solid::new(m).unwrap();
    eprintln!("{:6.2} loaded {} tris", t0.elapsed().as_secs_f64(), solid.mesh().triangles.len());
    let sp = segmentation::SegmentationParams { n_pieces: n, ..Default::default() };
    let surface = segmentation::segment(&ctx, &sp, &solid, labels.as_deref()).unwrap();
    eprintln!("{:6.2} segmented {} patches", t0.elapsed().as_secs_f64(), surface.n_patches);
    let pp = plan::PlanParams { up: [0.0, 1.0, 0.0], ..Default::default() };
    let seams = surface.seams();
    let survey = plan::survey(&ctx, &pp, &surface, &seams).unwrap();
    let plan = match plan::search(&ctx, &pp, &survey, &Default::default()).unwrap() {
        plan::PlanOutcome::Found(p) => p,
        x => panic!("{x:?}"),
    };
    eprintln!("{:6.2} planned", t0.elapsed().as_secs_f64());
    let bp = body::BodyParams::default();
    let cp = connector::ConnectorParams::default();
    let grid = body::ShellGrid::new(&bp, &solid, cp.room_mm()).unwrap();
    eprintln!("{:6.2} grid {} nodes", t0.elapsed().as_secs_f64(), grid.band.len());
    let dist = body::PatchDistances::measure(&grid, &surface);
    eprintln!("{:6.2} distances", t0.elapsed().as_secs_f64());
    let mut rooms: IdVec<PatchId, Aabb> = IdVec::from_fn(surface.n_patches, |_| Aabb::EMPTY);
    for (f, &p) in surface.patch_of_face.iter().enumerate() {
        rooms[p] = rooms[p].union(Aabb::around(surface.mesh.corners(f)));
    }
    let rooms: IdVec<PatchId, Aabb> =
        rooms.as_slice().iter().map(|r| r.grown(bp.thickness_mm + cp.room_mm() + 2.0)).collect();
    let shell = body::build(&ctx, &bp, &solid, &grid, &dist, &plan, &rooms).unwrap();
    eprintln!("{:6.2} bodies", t0.elapsed().as_secs_f64());
    let curves = connector::curves(&grid, shell.inner.as_ref().unwrap(), &plan);
    let barred: Vec<Vec<f32>> = shell.barred.as_slice().iter().map(|l| l.spread(&grid.band, -9.0)).collect();
    let is_free = |p: PatchId, x: Vec3| -> Option<bool> {
        let d = grid.band.sample(&grid.depth, x)?;
        if d < grid.thickness_mm {
            return None;
        }
        Some(grid.band.sample(&barred[p.0 as usize], x)? + cp.clearance_mm < 0.0)
    };
    let (runs, contacts) = connector::runs(&cp, &plan, &curves, &is_free);
    eprintln!("{:6.2} runs {} ", t0.elapsed().as_secs_f64(), runs.len());
    let total: f64 = contacts.iter().map(|c| c.length_mm).sum();
    let usable: f64 = contacts.iter().map(|c| c.usable_mm).sum();
    let fin = piece::make(&ctx, &cp, &grid, &shell, &plan, &runs, &rooms).unwrap();
    let made: f64 = fin.joints.iter().map(|j| j.length_mm).sum();
    eprintln!(
        "{:6.2} pieces; seam {total:.0} usable {usable:.0} runs {:.0} made {made:.0} kept {:?}",
        t0.elapsed().as_secs_f64(),
        runs.iter().map(|r| r.length()).sum::<f64>(),
        fin.joints.iter().map(|j| format!("{:.2}/{:.2}", j.kept[0], j.kept[1])).collect::<Vec<_>>().join(" ")
    );
    for w in ctx.take_warnings() {
        eprintln!("warn {} {}", w.code, w.message);
    }
    std::fs::create_dir_all(format!("{out}/pieces")).unwrap();
    let mut pieces = vec![];
    for (p, m) in fin.meshes.iter() {
        std::fs::write(format!("{out}/pieces/piece-{:02}.stl", p.0), io::write_stl_binary(m)).unwrap();
        let s = -plan.separation(p).unit();
        pieces.push(serde_json::json!({"id": p.0, "file": format!("pieces/piece-{:02}.stl", p.0), "installation_direction": s.to_array(), "neighbors": [], "volume_mm3": m.signed_volume()}));
    }
    let j = serde_json::json!({"format":"shellock-plan","version":1,"units":"mm","input":{"file":model,"sha256":"","transform":[k,0.0,0.0,0.0,0.0,k,0.0,0.0,0.0,0.0,k,0.0,0.0,0.0,0.0,1.0]},"seed":0,"shell_thickness":bp.thickness_mm,"clearance":cp.clearance_mm,"key_piece":plan.key().0,"installation_order":plan.steps.iter().map(|s| s.piece.0).collect::<Vec<_>>(),"pieces":pieces,"warnings":[]});
    std::fs::write(format!("{out}/plan.json"), j.to_string()).unwrap();
    eprintln!(
        "{:6.2} done; tris {}",
        t0.elapsed().as_secs_f64(),
        fin.meshes.as_slice().iter().map(|m| m.triangles.len()).sum::<usize>()
    );
}
