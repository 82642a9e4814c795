//! Divides all models of a folder and compares the results with people's divisions: `benchmark ROOT METHOD
//! ['{PARAMS}'] [people] [out=DIR] [only=N] [each]`.
//!
//! ROOT has `off/<id>.off` and `seg/<id>/<id>_<k>.seg`, or is a single model, which is timed. Errors are 1 −
//! Rand index by faces. `people` sets `n_parts` to the median number of people's parts of each model.
//! `only=N` takes each N-th model. `each` reports every model. METHOD `trace` reports every cut of
//! `random_cuts` and the error before it. METHOD `plane` reports the deviation of a single model's best plane
//! of symmetry, as a share of the bounding box's diagonal.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::time::Instant;

use serde_json::{Value, from_value, json};
use shellock_geom::TriMesh;
use shellock_segment::coarse::Coarse;
use shellock_segment::symmetry::nearest_plane;
use shellock_segment::{auto, kmeans, primitives, random_cuts, sdf};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let option = |name: &str| args.iter().find_map(|a| a.strip_prefix(name));
    let has = |name: &str| args.iter().any(|a| a == name);
    let (root, method) = (Path::new(&args[0]), &args[1]);
    let mut params: Value = args
        .iter()
        .find(|a| a.starts_with('{'))
        .map_or(json!({}), |a| serde_json::from_str(a).expect("JSON"));
    if root.is_file() {
        let mesh = read(root);
        if method == "plane" {
            let simple = Coarse::new(&mesh, random_cuts::RandomCutsParams::default().n_faces).mesh;
            let start = Instant::now();
            println!(
                "{:.4?}, {:.2} s",
                nearest_plane(&simple),
                start.elapsed().as_secs_f64()
            );
            return;
        }
        let (labels, seconds) = time(method, params, &mesh);
        println!(
            "{} faces, {} parts, {seconds:.2} s",
            mesh.triangles.len(),
            n_labels(&labels)
        );
        return;
    }
    let step = option("only=").map_or(1, |n| n.parse().expect("a number"));
    let mut by_class: BTreeMap<usize, Vec<[f64; 4]>> = BTreeMap::new();
    for id in ids(root).into_iter().step_by(step) {
        let people = people(root, id);
        let mesh = read(&root.join(format!("off/{id}.off")));
        if has("people") {
            let place = if method == "auto" {
                &mut params["cuts"]
            } else {
                &mut params
            };
            place["n_parts"] = json!(median_number(&people));
        }
        if method == "trace" {
            trace(id, &params, &mesh, &people);
            continue;
        }
        let (labels, seconds) = time(method, params.clone(), &mesh);
        if let Some(folder) = option("out=") {
            fs::create_dir_all(folder).expect("a folder");
            let lines: String = labels.iter().map(|l| format!("{l}\n")).collect();
            fs::write(format!("{folder}/{id}.seg"), lines).expect("a file");
        }
        let theirs = people.iter().map(|p| n_labels(p)).sum::<usize>() as f64 / people.len() as f64;
        let row = [error(&labels, &people), n_labels(&labels) as f64, theirs, seconds];
        if has("each") {
            println!("{id} {row:.3?}");
        }
        by_class.entry((id - 1) / 20 + 1).or_default().push(row);
    }
    for (class, rows) in &by_class {
        println!("{class:3}  {:.3?}", mean(rows));
    }
    let all: Vec<[f64; 4]> = by_class.into_values().flatten().collect();
    println!("all  {:.4?}  (error, parts, people's parts, seconds)", mean(&all));
}

fn divide(method: &str, params: Value, mesh: &TriMesh) -> Vec<u32> {
    let why = "parameters of the method";
    match method {
        "sdf" => sdf::divide(&from_value(params).expect(why), mesh),
        "kmeans" => kmeans::divide(&from_value(params).expect(why), mesh),
        "primitives" => primitives::divide(&from_value(params).expect(why), mesh),
        "random_cuts" => random_cuts::divide(&from_value(params).expect(why), mesh),
        "auto" => auto::divide(&from_value(params).expect(why), mesh),
        _ => panic!("there is no method {method}"),
    }
}

fn time(method: &str, params: Value, mesh: &TriMesh) -> (Vec<u32>, f64) {
    let start = Instant::now();
    let labels = divide(method, params, mesh);
    (labels, start.elapsed().as_secs_f64())
}

/// Prints the error of stopping before each cut.
fn trace(id: usize, params: &Value, mesh: &TriMesh, people: &[Vec<u32>]) {
    let params: random_cuts::RandomCutsParams = from_value(params.clone()).expect("parameters");
    let coarse = Coarse::new(mesh, params.n_faces);
    let found = random_cuts::hierarchy(&params, &coarse.graph, &[]);
    for (n, step) in found.steps.iter().enumerate() {
        let labels = found.labels(&coarse.graph, n);
        let fine: Vec<u32> = coarse.of_face.iter().map(|&f| labels[f as usize]).collect();
        println!("{id} {n} {:.4} {step:?}", error(&fine, people));
    }
}

fn read(path: &Path) -> TriMesh {
    let bytes = fs::read(path).expect("a model");
    let extension = path.extension().and_then(|e| e.to_str());
    let mesh = shellock_formats::read_mesh(&bytes, extension)
        .expect("a mesh")
        .mesh;
    if extension == Some("off") {
        return mesh;
    }
    shellock_geom::weld::close(&mesh).mesh
}

fn ids(root: &Path) -> Vec<usize> {
    let mut ids: Vec<usize> = fs::read_dir(root.join("off"))
        .expect("models")
        .filter_map(|e| e.ok()?.path().file_stem()?.to_str()?.parse().ok())
        .collect();
    ids.sort_unstable();
    ids
}

fn people(root: &Path, id: usize) -> Vec<Vec<u32>> {
    let label = |t: &str| t.parse::<i64>().expect("a label") as u32;
    fs::read_dir(root.join(format!("seg/{id}")))
        .expect("a folder of people's divisions")
        .map(|e| fs::read_to_string(e.expect("an entry").path()).expect("a division"))
        .map(|text| text.split_whitespace().map(label).collect())
        .collect()
}

fn n_labels(labels: &[u32]) -> usize {
    labels.iter().collect::<BTreeSet<_>>().len()
}

fn median_number(people: &[Vec<u32>]) -> usize {
    let mut counts: Vec<usize> = people.iter().map(|p| n_labels(p)).collect();
    counts.sort_unstable();
    counts[counts.len() / 2]
}

fn mean(rows: &[[f64; 4]]) -> [f64; 4] {
    [0, 1, 2, 3].map(|k| rows.iter().map(|r| r[k]).sum::<f64>() / rows.len() as f64)
}

/// Mean over people of the share of face pairs that are together in one division and apart in the other.
fn error(labels: &[u32], people: &[Vec<u32>]) -> f64 {
    people.iter().map(|p| rand_error(labels, p)).sum::<f64>() / people.len() as f64
}

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
