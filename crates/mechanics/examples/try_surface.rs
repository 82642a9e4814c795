use shellock_geom::Vec3;
use shellock_mechanics::*;
pub fn load(path: &str) -> (ShellAssembly, u32, Vec<Vec<Meeting>>) {
    let text = std::fs::read_to_string(path).unwrap();
    let mut w = text.split_ascii_whitespace();
    macro_rules! n {
        ($t:ty) => {
            w.next().unwrap().parse::<$t>().unwrap()
        };
    }
    macro_rules! v {
        () => {
            Vec3::new(n!(f64), n!(f64), n!(f64))
        };
    }
    let (np, nt, ns, nst, parts, key) = (n!(usize), n!(usize), n!(usize), n!(usize), n!(usize), n!(u32));
    let mut a = ShellAssembly { n_parts: parts, ..Default::default() };
    for _ in 0..np {
        a.points.push(v!());
        a.normals.push(v!());
        a.part_of_point.push(n!(u32));
    }
    for _ in 0..nt {
        a.triangles.push([n!(u32), n!(u32), n!(u32)]);
    }
    for _ in 0..ns {
        a.stations.push(Station {
            points: [n!(u32), n!(u32)],
            tangent: v!(),
            normal: v!(),
            across: v!(),
            length_mm: n!(f64),
        });
    }
    for _ in 0..nst {
        a.steps.push([n!(u32), n!(u32)]);
    }
    let npl = n!(usize);
    let plans = (0..npl)
        .map(|_| {
            (0..ns)
                .map(|_| {
                    let wall = v!();
                    let m = n!(i32);
                    let (l, p, w) = (v!(), v!(), n!(f64));
                    let joint = (m >= 0).then(|| Joint {
                        male: SIDES[(m.max(0) & 1) as usize],
                        leaves: l,
                        is_fast: m >= 2,
                        pull_on_a: p,
                        weight: w,
                    });
                    Meeting { wall, joint }
                })
                .collect()
        })
        .collect();
    (a, key, plans)
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let (assembly, key, plans) = load(&a[1]);
    let t = std::time::Instant::now();
    let model = SurfaceModel::new(&SurfaceParams::default(), &assembly).unwrap();
    eprintln!("model {:?} rows {}", t.elapsed(), model.n_rows());
    let t = std::time::Instant::now();
    let s: Vec<_> = plans.iter().take(10).map(|p| model.resist(p, key).unwrap()).collect();
    eprintln!("10 plans {:?}", t.elapsed());
    for s in &s {
        eprintln!(
            "{} {:.2e} {}",
            s.n_iterations,
            s.error,
            match &s.resistance {
                Resistance::Holds(o) => format!("holds {:.5}", o.quality_mm),
                Resistance::Separable(p) => format!("separable {p:?}"),
            }
        );
    }
    let t = std::time::Instant::now();
    let s = model.resist_all(&plans, key).unwrap();
    eprintln!("{} plans {:?}", plans.len(), t.elapsed());
    let mut its: Vec<usize> = s.iter().map(|s| s.n_iterations).collect();
    its.sort();
    eprintln!(
        "iterations min {} med {} max {}; separable {}",
        its[0],
        its[its.len() / 2],
        its[its.len() - 1],
        s.iter().filter(|s| matches!(s.resistance, Resistance::Separable(_))).count()
    );
}
