//! Prints the results of the readers and of the check for mesh files and `.seg` files: `inspect FILE…`.

use std::path::Path;
use std::time::Instant;

use shellock_formats as io;
use shellock_geom::repair;

fn main() {
    for path in std::env::args().skip(1) {
        let start = Instant::now();
        let verdict = verdict(Path::new(&path));
        println!("{path}: {verdict} [{} ms]", start.elapsed().as_millis());
    }
}

fn verdict(path: &Path) -> String {
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) => return format!("cannot be read: {error}"),
    };
    let extension = path.extension().and_then(|e| e.to_str());
    if extension == Some("seg") {
        return match io::read_labels(&bytes) {
            Ok(labels) => format!("{} labels", labels.len()),
            Err(error) => format!("refused: {error}"),
        };
    }
    let loaded = match io::read_mesh(&bytes, extension) {
        Ok(loaded) => loaded,
        Err(error) => return format!("refused: {error}"),
    };
    let labels = if loaded.face_labels().is_some() {
        ", labelled"
    } else {
        ""
    };
    let read = format!(
        "{}, {} triangles{labels}",
        loaded.format,
        loaded.mesh.triangles.len()
    );
    match repair::repair(&loaded.mesh, repair::RepairMode::Repair) {
        Ok(repair::Repaired { solid, repairs, .. }) => {
            let size = solid.mesh().bounds().size();
            let [x, y, z] = size.to_array();
            let mut text = format!(
                "{read}: one body of {x:.4} × {y:.4} × {z:.4}, volume {:.6}",
                solid.volume()
            );
            repairs.iter().for_each(|repair| text += &format!("\n  {repair}"));
            text
        }
        Err(error) => format!("{read}: refused: {error}"),
    }
}
