//! The XML within a 3MF, past the checksums of its archive: `cargo +nightly fuzz run packages`.
//!
//! The bytes up to the first zero are the model, those after it the settings of a slicer.

#![no_main]

use std::io::{Cursor, Write as _};

use libfuzzer_sys::fuzz_target;
use shellock_formats::read_mesh;
use zip::write::SimpleFileOptions;

const MODEL: &str = "3D/3dmodel.model";
const SETTINGS: [&str; 2] = ["Metadata/Slic3r_PE_model.config", "Metadata/model_settings.config"];

// Panics that are caught and become an error are none: without this the first one would end the process.
fuzz_target!(init: std::panic::take_hook(), |bytes: &[u8]| {
    let (model, settings) = bytes.split_at(bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len()));
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, content) in [(MODEL, model), (SETTINGS[0], settings), (SETTINGS[1], settings)] {
        archive.start_file(name, options).expect("the names differ");
        archive.write_all(content).expect("memory takes all bytes");
    }
    let package = archive.finish().expect("memory takes all bytes").into_inner();
    if let Ok(loaded) = read_mesh(&package, None) {
        let n_triangles = loaded.mesh.triangles.len();
        assert_eq!(loaded.file_face.len(), n_triangles);
        assert!(loaded.labellings.iter().all(|labelling| labelling.labels.len() == n_triangles));
        assert!(loaded.mesh.points.iter().all(|p| p.is_finite()));
        assert!(loaded.mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < loaded.mesh.points.len()));
    }
});
