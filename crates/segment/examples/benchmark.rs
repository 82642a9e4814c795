//! Divides all models of a folder and compares with people: `benchmark ROOT METHOD [PARAMS.json|{…}]
//! [people] [out=DIR] [only=N]`.
//!
//! ROOT has `off/<id>.off` and `seg/<id>/<id>_<k>.seg`. Errors are 1 − Rand index by faces. `people` gives each
//! model's median number of people's parts as `n_parts`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};
use shellock_geom::TriMesh;

fn labels_of(text: &str) -> Vec<u32> {
    text.split_whitespace()
        .map(|t| t.parse::<i64>().expect("a label") as u32)
        .collect()
}

/// Share of pairs of faces together in one division and apart in the other.
fn rand_error(a: &[u32], b: &[u32]) -> f64 {
    let (mut both, mut of_a, mut of_b) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    for (&x, &y) in a.iter().zip(b) {
        *both.entry((x, y)).or_insert(0.0) += 1.0;
        *of_a.entry(x).or_insert(0.0) += 1.0;
        *of_b.entry(y).or_insert(0.0) += 1.0;
    }
    let square = |x: &f64| x * x;
    let wrong = of_a.values().map(square).sum::<f64>() + of_b.values().map(square).sum::<f64>()
        - 2.0 * both.values().map(square).sum::<f64>();
    let n = a.len() as f64;
    wrong / (n * n - n)
}

fn people(root: &Path, id: usize) -> Vec<Vec<u32>> {
    let mut paths: Vec<_> = fs::read_dir(root.join(format!("seg/{id}")))
        .expect("a folder of people's divisions")
        .map(|e| e.expect("an entry").path())
        .collect();
    paths.sort();
    paths
        .iter()
        .map(|p| labels_of(&fs::read_to_string(p).expect("a division")))
        .collect()
}

fn n_labels(labels: &[u32]) -> usize {
    labels.iter().collect::<std::collections::BTreeSet<_>>().len()
}

fn divide(method: &str, params: Value, mesh: &TriMesh) -> Vec<u32> {
    use serde_json::from_value as read;
    match method {
        "sdf" => shellock_segment::sdf::divide(&read(params).expect("parameters"), mesh),
        "random_cuts" => shellock_segment::random_cuts::divide(&read(params).expect("parameters"), mesh),
        "kmeans" => shellock_segment::kmeans::divide(&read(params).expect("parameters"), mesh),
        "primitives" => shellock_segment::primitives::divide(&read(params).expect("parameters"), mesh),
        "auto" => shellock_segment::auto::divide(&read(params).expect("parameters"), mesh),
        _ => panic!("no method {method}"),
    }
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (root, method) = (Path::new(&args[0]), &args[1]);
    let is_one = root.is_file();
    let option = |name: &str| args.iter().find_map(|a| a.strip_prefix(name));
    let mut params: Value = args
        .iter()
        .find(|a| a.starts_with('{'))
        .map_or(json!({}), |a| serde_json::from_str(a).expect("JSON"));
    let read = |path: &Path| {
        let bytes = fs::read(path).expect("a model");
        let extension = path.extension().and_then(|e| e.to_str());
        shellock_formats::read_mesh(&bytes, extension)
            .expect("a mesh")
            .mesh
    };
    if is_one {
        let mesh = shellock_geom::weld::close(&read(root)).mesh;
        let start = Instant::now();
        let labels = divide(method, params, &mesh);
        println!(
            "{} faces, {} parts, {:.2} s",
            mesh.triangles.len(),
            n_labels(&labels),
            start.elapsed().as_secs_f64()
        );
        return;
    }
    let mut ids: Vec<usize> = fs::read_dir(root.join("off"))
        .expect("models")
        .filter_map(|e| e.ok()?.path().file_stem()?.to_str()?.parse().ok())
        .collect();
    ids.sort_unstable();
    if let Some(n) = option("only=") {
        let n: usize = n.parse().expect("a number");
        ids = ids.into_iter().step_by(n).collect();
    }
    let mut by_class: BTreeMap<usize, Vec<[f64; 4]>> = BTreeMap::new();
    for id in ids {
        let people = people(root, id);
        if args.iter().any(|a| a == "people") {
            let mut counts: Vec<usize> = people.iter().map(|p| n_labels(p)).collect();
            counts.sort_unstable();
            let place = if method == "auto" {
                &mut params["cuts"]
            } else {
                &mut params
            };
            place["n_parts"] = json!(counts[counts.len() / 2]);
        }
        let mesh = read(&root.join(format!("off/{id}.off")));
        if method == "trace" {
            use shellock_segment::{coarse::Coarse, random_cuts};
            let read: random_cuts::RandomCutsParams =
                serde_json::from_value(params.clone()).expect("parameters");
            let coarse = Coarse::new(&mesh, read.n_faces);
            let found = random_cuts::hierarchy(&read, &coarse.graph, &[]);
            for n in 0..=found.steps.len() {
                let labels = found.labels(&coarse.graph, n);
                let fine: Vec<u32> = coarse.of_face.iter().map(|&f| labels[f as usize]).collect();
                let error = people.iter().map(|p| rand_error(&fine, p)).sum::<f64>() / people.len() as f64;
                let s = found.steps.get(n).map_or([0.0; 6], |s| {
                    [
                        s.score,
                        s.share,
                        s.of_share,
                        s.agreement,
                        s.tightness,
                        s.mean_price,
                    ]
                });
                println!("T {id} {n} {error} {s:?}");
            }
            continue;
        }
        let start = Instant::now();
        let labels = divide(method, params.clone(), &mesh);
        let seconds = start.elapsed().as_secs_f64();
        let error = people.iter().map(|p| rand_error(&labels, p)).sum::<f64>() / people.len() as f64;
        let theirs = people.iter().map(|p| n_labels(p)).sum::<usize>() as f64 / people.len() as f64;
        if let Some(folder) = option("out=") {
            fs::create_dir_all(folder).expect("a folder");
            let lines: String = labels.iter().map(|l| format!("{l}\n")).collect();
            fs::write(format!("{folder}/{id}.seg"), lines).expect("a file");
        }
        if args.iter().any(|a| a == "each") {
            println!("{id} {error:.3} {} {theirs:.1} {seconds:.2}", n_labels(&labels));
        }
        by_class.entry((id - 1) / 20 + 1).or_default().push([
            error,
            n_labels(&labels) as f64,
            theirs,
            seconds,
        ]);
    }
    let mean =
        |rows: &[[f64; 4]]| [0, 1, 2, 3].map(|k| rows.iter().map(|r| r[k]).sum::<f64>() / rows.len() as f64);
    for (class, rows) in &by_class {
        let [e, n, theirs, s] = mean(rows);
        print!("{class}:{e:.3}/{n:.0}/{theirs:.0}/{s:.2} ");
    }
    let all: Vec<[f64; 4]> = by_class.into_values().flatten().collect();
    let [e, n, theirs, s] = mean(&all);
    println!("\nall {e:.4}  parts {n:.1} (people {theirs:.1})  {s:.2} s a model");
}
