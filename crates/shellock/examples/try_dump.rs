use shellock::metric::{MetricParams, PlanModel};
use shellock::{Ctx, pipeline::Params, plan, segmentation};
use std::fmt::Write;
use std::sync::atomic::AtomicBool;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&a[1]).unwrap();
    let ext = std::path::Path::new(&a[1]).extension().unwrap().to_str().unwrap();
    let _ = ext;
    let mut mesh = shellock_geom::io::read_mesh(&bytes, Some(ext)).unwrap().mesh;
    // y up, 150 mm
    let size = mesh.bounds().size().max_element();
    let scale = 150.0 / size;
    mesh.points.iter_mut().for_each(|p| *p = scale * shellock_geom::Vec3::new(p.x, -p.z, p.y));
    let solid = shellock_geom::check::into_solid(&mesh).unwrap().0;
    let stop = AtomicBool::new(false);
    let ctx = Ctx::new(&|_| {}, &stop);
    let params = Params::default().agreed();
    let surface = segmentation::segment(&ctx, &params.segmentation, &solid, None).unwrap();
    let survey = plan::survey(&ctx, &params.plan, &surface, &surface.seams()).unwrap();
    let plans = plan::random_plans(&params.plan, &survey, 100);
    eprintln!("{} pieces {} plans", surface.n_patches, plans.len());
    let mut m = MetricParams::of_plan(&params.plan);
    m.edge_share = a[3].parse().unwrap();
    let t = std::time::Instant::now();
    let model = PlanModel::new(&m, &surface);
    eprintln!(
        "remesh {:?}, {} points {} triangles {} stations",
        t.elapsed(),
        model.assembly.points.len(),
        model.assembly.triangles.len(),
        model.assembly.stations.len()
    );
    let s = &model.assembly;
    let mut o = String::new();
    let v = |p: shellock_geom::Vec3| format!("{} {} {}", p.x, p.y, p.z);
    writeln!(
        o,
        "{} {} {} {} {} {}",
        s.points.len(),
        s.triangles.len(),
        s.stations.len(),
        s.steps.len(),
        s.n_parts,
        plans[0].key().0
    )
    .unwrap();
    for i in 0..s.points.len() {
        writeln!(o, "{} {} {}", v(s.points[i]), v(s.normals[i]), s.part_of_point[i]).unwrap();
    }
    for t in &s.triangles {
        writeln!(o, "{} {} {}", t[0], t[1], t[2]).unwrap();
    }
    for t in &s.stations {
        writeln!(o, "{} {} {} {} {} {}", t.points[0], t.points[1], v(t.tangent), v(t.normal), v(t.across), t.length_mm)
            .unwrap();
    }
    for t in &s.steps {
        writeln!(o, "{} {}", t[0], t[1]).unwrap();
    }
    writeln!(o, "{}", plans.len()).unwrap();
    for p in &plans {
        for m in model.meetings(p) {
            write!(o, "{} ", v(m.wall)).unwrap();
            match m.joint {
                None => writeln!(o, "-1 0 0 0 0 0 0 0").unwrap(),
                Some(j) => writeln!(
                    o,
                    "{} {} {} {}",
                    j.male.index() + 2 * usize::from(j.is_fast),
                    v(j.leaves),
                    v(j.pull_on_a),
                    j.weight
                )
                .unwrap(),
            }
        }
    }
    std::fs::write(&a[2], o).unwrap();
}
