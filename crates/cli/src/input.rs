//! From a file to a solid in millimetres, with its labels.

use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use shellock_geom::check::into_solid;
use shellock_geom::io::{Loaded, read_labels, read_mesh};
use shellock_geom::{Aabb, Solid, Vec3};

use crate::args::Options;
use crate::failure::Failure;

/// Larger files are refused, bytes: everything is read into memory.
const MAX_FILE_BYTES: u64 = 2 << 30;
/// A file whose longest side lies in this range, in its own units, is taken to be in millimetres.
const PLAUSIBLE_MM: std::ops::RangeInclusive<f64> = 20.0..=1000.0;
/// Longest side of everything else, mm.
const DEFAULT_SIZE_MM: f64 = 150.0;

/// A model ready to be made.
pub struct Model {
    /// In assembly space, mm.
    pub solid: Solid,
    /// One label a triangle of `solid`, where there are labels.
    pub labels: Option<Vec<i64>>,
    /// For each triangle of `solid`, the face of the file it came from.
    pub file_face: Vec<u32>,
    /// How many faces the file has.
    pub n_file_faces: usize,
    /// Assembly from file coordinates, 4 × 4, row-major.
    pub transform: [f64; 16],
    /// File name without folders.
    pub name: String,
    /// Of the file's bytes.
    pub sha256: String,
    /// What a person should know about how the file was taken.
    pub notes: Vec<String>,
}

/// Reads a file whole.
pub fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    let unreadable = |source| Failure::Unreadable { path: path.to_owned(), source };
    let size = fs::metadata(path).map_err(unreadable)?.len();
    if size > MAX_FILE_BYTES {
        let gib = size as f64 / f64::from(1 << 30);
        return Err(Failure::Wrong(format!("{}: {gib:.1} GiB are more than the 2 GiB that are read", path.display())));
    }
    fs::read(path).map_err(unreadable)
}

/// SHA-256 in lower-case hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// The mesh in a file.
pub fn load(path: &Path) -> Result<(Loaded, Vec<u8>), Failure> {
    let bytes = read(path)?;
    let extension = path.extension().and_then(|e| e.to_str());
    let loaded = read_mesh(&bytes, extension).map_err(|source| Failure::NotAMesh { path: path.to_owned(), source })?;
    Ok((loaded, bytes))
}

/// The model in a file, scaled, with the labels that go with it.
pub fn model(path: &Path, options: &Options) -> Result<Model, Failure> {
    let (loaded, bytes) = load(path)?;
    let (solid, kept) =
        into_solid(&loaded.mesh).map_err(|source| Failure::NotOneBody { path: path.to_owned(), source })?;
    let file_face: Vec<u32> = kept.iter().map(|&k| loaded.file_face[k as usize]).collect();
    let mut notes = Vec::new();
    let labels = match (&options.labels, &loaded.face_labels) {
        (Some(file), _) => Some(labels_of(file, &loaded, &file_face)?),
        (None, Some(labels)) => {
            notes.push("the file has a label for each face; they are used as pieces".to_owned());
            Some(kept.iter().map(|&k| labels[k as usize]).collect())
        }
        (None, None) => None,
    };
    let scale = scale(options, solid.mesh().bounds(), &mut notes)?;
    let mut made = made_of(solid, scale, path)?;
    made.labels = labels;
    made.n_file_faces = loaded.n_file_faces();
    made.file_face = file_face;
    made.sha256 = sha256(&bytes);
    made.notes = notes;
    Ok(made)
}

/// A solid in file units as a model of its own.
fn made_of(solid: Solid, scale: f64, path: &Path) -> Result<Model, Failure> {
    let mut mesh = solid.into_mesh();
    // Far from the origin, 32-bit files would lose the detail: such models are moved to it.
    let bounds = mesh.bounds();
    let far = (bounds.center() * scale).abs().max_element() > 1000.0 + (bounds.size() * scale).max_element();
    let shift = if far { -bounds.center() } else { Vec3::ZERO };
    mesh.points.iter_mut().for_each(|p| *p = (*p + shift) * scale);
    let t = shift * scale;
    let transform =
        [scale, 0.0, 0.0, t.x, 0.0, scale, 0.0, t.y, 0.0, 0.0, scale, t.z, 0.0, 0.0, 0.0, 1.0].map(|x: f64| x + 0.0);
    let solid = Solid::new(mesh).map_err(|e| Failure::Wrong(format!("{}: after scaling, {e}", path.display())))?;
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    Ok(Model {
        solid,
        labels: None,
        file_face: Vec::new(),
        n_file_faces: 0,
        transform,
        name,
        sha256: String::new(),
        notes: Vec::new(),
    })
}

/// A figure that the program makes itself, as if it came from a file.
pub fn figure(name: &str, options: &Options) -> Result<Model, Failure> {
    let solid = shellock_figure(name, options.size.or(options.height).unwrap_or(DEFAULT_SIZE_MM))?;
    let bytes = shellock_geom::io::write_stl_binary(solid.mesh());
    let mut model = made_of(solid, 1.0, &PathBuf::from(format!("{name}.stl")))?;
    model.sha256 = sha256(&bytes);
    Ok(model)
}

/// The figure called `name`, its longest side `size_mm`.
pub fn shellock_figure(name: &str, size_mm: f64) -> Result<Solid, Failure> {
    /// Polygons of about 1/95 of the size: smooth to the eye, some 55 000 triangles.
    const CELLS: f64 = 94.0;
    let figure = shellock::figure::Figure::named(name).ok_or_else(|| {
        let all: Vec<&str> = shellock::figure::Figure::ALL.iter().map(|f| f.name()).collect();
        Failure::Wrong(format!("there is no figure \"{name}\"; choose one of {}", all.join(", ")))
    })?;
    if !(10.0..=2000.0).contains(&size_mm) {
        return Err(Failure::Wrong(format!("size is {size_mm} mm; it must lie between 10 and 2000 mm")));
    }
    Ok(shellock::figure::make(figure, size_mm, size_mm / CELLS))
}

fn scale(options: &Options, bounds: Aabb, notes: &mut Vec<String>) -> Result<f64, Failure> {
    let longest = bounds.size().max_element();
    let along_up = bounds.size()[options.up.index()];
    let positive = |what: &str, mm: f64| {
        if mm.is_finite() && mm > 0.0 {
            Ok(mm)
        } else {
            Err(Failure::Wrong(format!("{what} is {mm}; it must be more than 0")))
        }
    };
    Ok(match (options.size, options.height, options.scale) {
        (Some(size), _, _) => positive("size", size)? / longest,
        (_, Some(height), _) => positive("height", height)? / along_up,
        (_, _, Some(scale)) => positive("scale", scale)?,
        _ if PLAUSIBLE_MM.contains(&longest) => 1.0,
        _ => {
            notes.push(format!(
                "the file's longest side is {longest:.4} units, which cannot be millimetres; it is made \
                 {DEFAULT_SIZE_MM} mm long (choose with --size, --height or --scale)"
            ));
            DEFAULT_SIZE_MM / longest
        }
    })
}

/// The labels in `file`, one a triangle of the solid.
fn labels_of(file: &Path, loaded: &Loaded, file_face: &[u32]) -> Result<Vec<i64>, Failure> {
    let n = loaded.n_file_faces();
    let is_ply = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply"));
    let a_file_face: Vec<i64> = if is_ply {
        let (with, _) = load(file)?;
        let labels = with.face_labels.as_ref().ok_or_else(|| {
            Failure::Wrong(format!("{}: its faces have no property named label, segment or the like", file.display()))
        })?;
        let mut by_face = vec![0; with.n_file_faces()];
        for (triangle, &face) in with.file_face.iter().enumerate() {
            by_face[face as usize] = labels[triangle];
        }
        by_face
    } else {
        let bytes = read(file)?;
        read_labels(&bytes).map_err(|source| Failure::NotAMesh { path: file.to_owned(), source })?
    };
    if a_file_face.len() != n {
        return Err(Failure::Wrong(format!(
            "{}: {} labels for a model of {n} faces; give one label a face, in the order of the model's file",
            file.display(),
            a_file_face.len()
        )));
    }
    Ok(file_face.iter().map(|&f| a_file_face[f as usize]).collect())
}
