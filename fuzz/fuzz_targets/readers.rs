//! Fuzzes the readers and the repair, which must end in an answer for any bytes: `cargo +nightly fuzz run
//! readers`.
//!
//! `READER=stl` (obj, ply, off, gltf, labels) gives the bytes to that reader alone; without it, every reader
//! gets them.

#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use shellock_formats::{read_labels, read_mesh};
use shellock_geom::repair::{RepairMode, repair};

const READERS: [&str; 6] = ["stl", "obj", "ply", "off", "gltf", ""];

/// Size limit of repaired meshes, triangles: larger ones cost time and find nothing more.
const MOST_TRIANGLES: usize = 2000;

// The fuzzer's panic hook is removed: it would end the process even at panics that are caught and become
// errors.
fuzz_target!(init: std::panic::take_hook(), |bytes: &[u8]| {
    static CHOSEN: LazyLock<Option<String>> = LazyLock::new(|| std::env::var("READER").ok());
    let is_chosen = |reader: &str| CHOSEN.as_deref().is_none_or(|chosen| chosen == reader);
    if is_chosen("labels") {
        let _ = read_labels(bytes);
    }
    for reader in READERS.into_iter().filter(|reader| is_chosen(reader)) {
        let Ok(loaded) = read_mesh(bytes, Some(reader).filter(|reader| !reader.is_empty())) else { continue };
        let n_triangles = loaded.mesh.triangles.len();
        assert_eq!(loaded.file_face.len(), n_triangles);
        assert!(loaded.file_face.is_sorted());
        assert!(loaded.labellings.iter().all(|labelling| labelling.labels.len() == n_triangles));
        assert!(loaded.mesh.points.iter().all(|p| p.is_finite()));
        let n_points = loaded.mesh.points.len();
        assert!(loaded.mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < n_points));
        if n_triangles <= MOST_TRIANGLES
            && let Ok(repaired) = repair(&loaded.mesh, RepairMode::KeepLargest)
        {
            assert_eq!(repaired.solid.mesh().triangles.len(), repaired.source_face.len());
        }
    }
});
