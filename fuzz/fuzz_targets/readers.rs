//! Whatever the bytes are, reading and checking them ends in an answer: `cargo +nightly fuzz run readers`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use shellock_geom::check::into_solid;
use shellock_geom::io::{read_labels, read_mesh};

fuzz_target!(|bytes: &[u8]| {
    let _ = read_labels(bytes);
    for extension in [None, Some("stl"), Some("obj"), Some("ply"), Some("off")] {
        let Ok(loaded) = read_mesh(bytes, extension) else { continue };
        let n_triangles = loaded.mesh.triangles.len();
        assert_eq!(loaded.file_face.len(), n_triangles);
        assert!(loaded.face_labels.is_none_or(|labels| labels.len() == n_triangles));
        assert!(loaded.mesh.points.iter().all(|p| p.is_finite()));
        if let Ok((solid, kept_face)) = into_solid(&loaded.mesh) {
            assert_eq!(solid.mesh().triangles.len(), kept_face.len());
        }
    }
});
