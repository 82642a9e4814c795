//! Whatever the bytes are, reading and mending them ends in an answer: `cargo +nightly fuzz run readers`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use shellock_geom::io::{read_labels, read_mesh};
use shellock_geom::repair::{Mending, mend};

/// Larger meshes cost time and find nothing more.
const MOST_TRIANGLES: usize = 2000;

fuzz_target!(|bytes: &[u8]| {
    let _ = read_labels(bytes);
    for extension in [None, Some("stl"), Some("obj"), Some("ply"), Some("off"), Some("gltf")] {
        let Ok(loaded) = read_mesh(bytes, extension) else { continue };
        let n_triangles = loaded.mesh.triangles.len();
        assert_eq!(loaded.file_face.len(), n_triangles);
        assert!(loaded.file_face.is_sorted());
        assert!(loaded.labellings.iter().all(|labelling| labelling.labels.len() == n_triangles));
        assert!(loaded.mesh.points.iter().all(|p| p.is_finite()));
        assert!(loaded.mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < loaded.mesh.points.len()));
        if n_triangles <= MOST_TRIANGLES
            && let Ok(mended) = mend(&loaded.mesh, Mending::KeepLargest)
        {
            assert_eq!(mended.solid.mesh().triangles.len(), mended.source_face.len());
        }
    }
});
