//! Fuzzes the XML within a 3MF, past the checksums of its archive: `cargo +nightly fuzz run packages`.
//!
//! Zero bytes divide the input into the root model, the settings of slicers, a second model that the root may
//! name as `/3D/o.model`, and the relationships of the package.

#![no_main]

use std::io::{Cursor, Write as _};

use libfuzzer_sys::fuzz_target;
use shellock_formats::read_mesh;
use zip::write::SimpleFileOptions;

/// Names of the parts, each with the index of its section of the input.
const PARTS: [(&str, usize); 5] = [
    ("3D/3dmodel.model", 0),
    ("Metadata/Slic3r_PE_model.config", 1),
    ("Metadata/model_settings.config", 1),
    ("3D/o.model", 2),
    ("_rels/.rels", 3),
];

// The fuzzer's panic hook is removed: it would end the process even at panics that are caught and become
// errors.
fuzz_target!(init: std::panic::take_hook(), |bytes: &[u8]| {
    let stretches: Vec<&[u8]> = bytes.splitn(4, |&b| b == 0).collect();
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, stretch) in PARTS {
        let Some(content) = stretches.get(stretch) else { continue };
        archive.start_file(name, options).expect("the names differ");
        archive.write_all(content).expect("memory takes all bytes");
    }
    let package = archive.finish().expect("memory takes all bytes").into_inner();
    if let Ok(loaded) = read_mesh(&package, None) {
        let n_triangles = loaded.mesh.triangles.len();
        assert_eq!(loaded.file_face.len(), n_triangles);
        assert!(loaded.file_face.is_sorted());
        assert!(loaded.labellings.iter().all(|labelling| labelling.labels.len() == n_triangles));
        assert!(loaded.mesh.points.iter().all(|p| p.is_finite()));
        let n_points = loaded.mesh.points.len();
        assert!(loaded.mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < n_points));
        assert!(!loaded.objects.is_empty() && loaded.cutters.is_empty());
    }
});
