//! Files of a kit: checks that they are the certified ones, and that each piece is one body.

use std::fs;
use std::path::{Component, Path};

use sha2::{Digest, Sha256};

use crate::mesh::Mesh;
use crate::number;
use crate::{OtherFile, PieceFile, Tested};

/// Greatest size of a file that is read, bytes.
const MOST_BYTES: u64 = 2 << 30;

/// Reads the pieces' meshes, as far as possible, and checks the hashes of their files.
pub fn read(folder: &Path, pieces: &[PieceFile]) -> (Vec<Mesh>, Tested) {
    let (mut meshes, mut tested) = (Vec::new(), Ok(format!("{} files", pieces.len())));
    for piece in pieces {
        let mesh = bytes_of(folder, &piece.file).and_then(|bytes| {
            if hash(&bytes) != piece.sha256 {
                tested = Err(format!("{} has other bytes", piece.file));
            }
            Mesh::from_stl(&bytes).map_err(|why| format!("{}: {why}", piece.file))
        });
        match mesh {
            Ok(mesh) => meshes.push(mesh),
            Err(why) => tested = Err(why),
        }
    }
    (meshes, tested)
}

/// Checks that other files have the certified hashes.
pub fn test_files(folder: &Path, files: &[OtherFile]) -> Tested {
    for other in files {
        if hash(&bytes_of(folder, &other.file)?) != other.sha256 {
            return Err(format!("{} has other bytes", other.file));
        }
    }
    Ok(files
        .iter()
        .map(|f| f.file.as_str())
        .collect::<Vec<_>>()
        .join(", "))
}

/// Checks that every piece is one closed surface, right side out.
pub fn test_surfaces(meshes: &[Mesh]) -> Tested {
    for (id, mesh) in meshes.iter().enumerate() {
        let (n_open, n_surfaces, volume_mm3) = (mesh.n_open_edges(), mesh.n_surfaces(), mesh.volume_mm3());
        if n_open > 0 || volume_mm3.is_nan() || volume_mm3 <= 0.0 {
            return Err(format!(
                "piece {} has {n_open} open edges and a volume of {volume_mm3:.1} mm³",
                number::of(id)
            ));
        }
        if n_surfaces > 1 {
            return Err(format!(
                "piece {} falls into {n_surfaces} surfaces",
                number::of(id)
            ));
        }
    }
    Ok(format!(
        "{:.1} mm³ in all",
        meshes.iter().map(Mesh::volume_mm3).sum::<f64>()
    ))
}

/// Reads a file, which must lie within the folder whatever its name says.
fn bytes_of(folder: &Path, file: &str) -> Result<Vec<u8>, String> {
    let told = |e: std::io::Error| format!("{file}: {e}");
    let is_plain = !file.is_empty()
        && Path::new(file)
            .components()
            .all(|c| matches!(c, Component::Normal(_)));
    if !is_plain {
        return Err(format!("{file} is no path within the kit"));
    }
    let path = folder.join(file).canonicalize().map_err(told)?;
    let is_within = path.starts_with(folder.canonicalize().map_err(told)?);
    let about = fs::metadata(&path).map_err(told)?;
    if !is_within || !about.is_file() || about.len() > MOST_BYTES {
        return Err(format!("{file} is no file within the kit, or larger than 2 GiB"));
    }
    fs::read(path).map_err(told)
}

fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}
