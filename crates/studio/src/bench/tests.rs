//! Tests of a project that changes.

use super::*;
use shellock_formats::{read_labels, write_ply};
use shellock_testkit::shapes::torus;

/// Saved key of the project, and the labels saved with it.
fn read_project(bench: &Bench) -> (String, Option<Vec<i64>>) {
    let file: toml::Table = std::fs::read_to_string(bench.store.project_file())
        .unwrap()
        .parse()
        .unwrap();
    let labels = file.get("labels").and_then(toml::Value::as_str);
    let labels = labels.map(|name| read_labels(&read(&bench.store.folder().join(name)).unwrap()).unwrap());
    (file["key"].as_str().unwrap().to_owned(), labels)
}

#[test]
fn a_key_that_the_models_own_labels_name_is_the_same_after_painting_and_back() {
    let dir = tempfile::tempdir().unwrap();
    let ring = torus(40.0, 12.0, [120, 48]);
    let side = |f: usize| if ring.face_center(f).y > 0.0 { 10 } else { 20 };
    let own: Vec<i32> = (0..ring.triangles.len()).map(side).collect();
    let model = dir.path().join("ring.ply");
    std::fs::write(&model, write_ply(&ring, Some(&own))).unwrap();
    let bench = Bench::open(dir.path().join("project")).unwrap();
    bench.take(&model).unwrap();
    bench.load();
    bench
        .choose(&Map::from_iter([("key".to_owned(), json!("20"))]))
        .unwrap();
    bench.divide().unwrap();
    assert_eq!(read_project(&bench), ("20".to_owned(), None));
    bench.paint(&bench.labels().unwrap()).unwrap();
    let (key, labels) = read_project(&bench);
    let labels = labels.expect("they were painted");
    let key: i64 = key.parse().unwrap();
    let of_key: Vec<i32> = (0..own.len())
        .filter(|&f| labels[f] == key)
        .map(|f| own[f])
        .collect();
    let n_meant = of_key.iter().filter(|&&label| label == 20).count();
    assert!(
        10 * n_meant > 9 * of_key.len() && n_meant > 0,
        "{n_meant} of {}",
        of_key.len()
    );
    bench.divide().unwrap();
    assert_eq!(read_project(&bench), ("20".to_owned(), None));
}

#[test]
fn messages_for_the_page_name_files_without_their_folder() {
    let folder: PathBuf = ["some", "project"].iter().collect();
    let failure = Failure::Wrong(format!("{}: not closed", folder.join("ring.ply").display()));
    assert_eq!(
        without_folder(&failure.to_string(), &folder),
        "ring.ply: not closed"
    );
}
