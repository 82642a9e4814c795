//! Reads a file into a solid in millimetres, with its labels.

mod size;

use std::collections::BTreeSet;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use shellock_formats::{LabelSource, Loaded, Selection, read_labels, read_selection};
use shellock_geom::repair::{InsideOut, RepairMode, Repaired, repair_as};
use shellock_geom::simplify::{Reach, points_between, simplify};
use shellock_geom::{Solid, Vec3};
use size::{DEFAULT_SIZE_MM, check_size, scale};
pub use size::{is_usual, length};

use crate::Session;
use crate::failure::Failure;
pub use crate::model::Model;
use crate::names::no_such;
use crate::options::{LabelsFrom, Options};
use crate::shape::settle_hollow;

/// Size limit of input files, bytes; files are read into memory whole.
const MAX_FILE_BYTES: u64 = 2 << 30;
/// Number of triangles above which a surface is simplified: most take twice the time with twice as many.
pub const MANY_TRIANGLES: usize = 100_000;

/// Reads a file whole; fails if it is larger than 2 GiB.
pub fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    let unreadable = |source| Failure::Unreadable {
        path: path.to_owned(),
        source,
    };
    let size = fs::metadata(path).map_err(unreadable)?.len();
    if size > MAX_FILE_BYTES {
        let gib = size as f64 / f64::from(1 << 30);
        return Err(Failure::Wrong(format!(
            "{}: {gib:.1} GiB is more than the limit of 2 GiB",
            path.display()
        )));
    }
    // A device has no size in its metadata, so the read is limited, too.
    let mut bytes = Vec::new();
    fs::File::open(path)
        .and_then(|file| file.take(MAX_FILE_BYTES).read_to_end(&mut bytes))
        .map_err(unreadable)?;
    Ok(bytes)
}

/// SHA-256 in lower-case hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// Loads the mesh in a file; also returns the file's bytes.
pub fn load(path: &Path) -> Result<(Loaded, Vec<u8>), Failure> {
    load_selection(path, &Selection::default())
}

/// Loads the part of a file's mesh that `selection` names; also returns the file's bytes.
pub fn load_selection(path: &Path, selection: &Selection) -> Result<(Loaded, Vec<u8>), Failure> {
    let bytes = read(path)?;
    let extension = path.extension().and_then(|e| e.to_str());
    let loaded = read_selection(&bytes, extension, selection).map_err(|source| Failure::NotAMesh {
        path: path.to_owned(),
        source,
    })?;
    Ok((loaded, bytes))
}

/// Part of a file that the options ask for.
pub fn selection(options: &Options) -> Selection {
    Selection {
        object: options.object.clone(),
        plate: options.plate.clone(),
    }
}

/// Repair mode that the two options select.
pub fn repair_mode(no_repair: bool, largest: bool) -> RepairMode {
    match (no_repair, largest) {
        (true, _) => RepairMode::Refuse,
        (false, true) => RepairMode::KeepLargest,
        (false, false) => RepairMode::Repair,
    }
}

/// Repairs the mesh that was read from `path` into one body.
pub fn repair_mesh(
    path: &Path,
    loaded: &Loaded,
    mode: RepairMode,
    inside_out: InsideOut,
) -> Result<Repaired, Failure> {
    repair_as(&loaded.mesh, mode, inside_out).map_err(|source| Failure::NotOneBody {
        path: path.to_owned(),
        source,
        objects: objects(loaded),
    })
}

/// Lists the names of the file's objects and parts with their plates; empty if the file is one unnamed body.
pub fn objects(loaded: &Loaded) -> Vec<String> {
    let titles = loaded.titles();
    let plates: BTreeSet<u32> = titles.iter().filter_map(|titles| titles.plate).collect();
    let mut all: Vec<String> = titles
        .iter()
        .map(|titles| match titles.plate {
            Some(plate) if plates.len() > 1 => format!("{titles} (plate {plate})"),
            _ => titles.to_string(),
        })
        .collect();
    all.dedup();
    let has_parts = loaded.objects.len() > 1 && titles.iter().any(|titles| !titles.parts.is_empty());
    if all.len() > 1 || has_parts {
        all
    } else {
        Vec::new()
    }
}

/// Reads the model in a file, scaled, with its labels.
pub fn model(session: &Session, path: &Path, options: &Options) -> Result<Model, Failure> {
    session.during("reading", || {
        let (loaded, bytes) = load_selection(path, &selection(options))?;
        model_of(path, &loaded, &bytes, options)
    })
}

/// Reads the model in a file and simplifies it if it has more than [`MANY_TRIANGLES`] triangles.
pub fn simple_model(session: &Session, path: &Path, options: &Options) -> Result<Model, Failure> {
    simple(session, model(session, path, options)?, options)
}

/// Simplifies `model` if it has more than [`MANY_TRIANGLES`] triangles and the options do not forbid it.
pub fn simple(session: &Session, model: Model, options: &Options) -> Result<Model, Failure> {
    let n_triangles = model.solid.mesh().triangles.len();
    if n_triangles <= MANY_TRIANGLES || options.resolution == 0.0 {
        return Ok(model);
    }
    session.during("simplifying", || simplify_model(model, options.resolution))
}

/// Simplifies `model` to triangles within `resolution_mm` of its surface, and adds a note on the result.
fn simplify_model(mut model: Model, resolution_mm: f64) -> Result<Model, Failure> {
    let n_before = model.solid.mesh().triangles.len();
    let between = |labels: &Vec<i64>| points_between(model.solid.mesh(), labels);
    let fixed = model.labels.as_ref().map(between).unwrap_or_default();
    match simplify(&model.solid, &fixed, Reach::everywhere(resolution_mm)) {
        Some(simple) if simple.solid.mesh().triangles.len() < n_before => {
            model.notes.push(format!(
                "the surface was simplified from {n_before} to {} triangles, within {:.3} mm of the original \
                 (--resolution 0 keeps all)",
                simple.solid.mesh().triangles.len(),
                simple.farthest_mm
            ));
            let of = |labels: Vec<i64>| simple.source_face.iter().map(|&f| labels[f as usize]).collect();
            model.labels = model.labels.map(of);
            model.file_face = simple
                .source_face
                .iter()
                .map(|&f| model.file_face[f as usize])
                .collect();
            model.solid = simple.solid;
        }
        _ => model.notes.push(format!(
            "{n_before} triangles could not be simplified within {resolution_mm} mm of the surface: all are \
             kept, which takes longer"
        )),
    }
    Ok(model)
}

/// Makes a model of what was read from `path`: repaired, scaled, with its labels.
pub fn model_of(path: &Path, loaded: &Loaded, bytes: &[u8], options: &Options) -> Result<Model, Failure> {
    let sha256 = sha256(bytes);
    if options.model_sha256.as_ref().is_some_and(|of| *of != sha256) {
        return Err(Failure::Wrong(format!(
            "{} is not the file that the project was made for (its SHA-256 is {sha256}): put that file \
             back, or open this one in `shellock studio`",
            path.display()
        )));
    }
    let Repaired {
        solid,
        source_face,
        repairs,
    } = repair_mesh(
        path,
        loaded,
        repair_mode(options.no_repair, options.largest),
        options.inside_out.value(),
    )?;
    let file_face: Vec<u32> = source_face
        .iter()
        .map(|&k| loaded.file_face[k as usize])
        .collect();
    let mut notes = loaded.notes.clone();
    notes.extend(
        repairs
            .iter()
            .map(|repair| format!("repaired: {repair} (file units)")),
    );
    let labels = match &options.labels {
        Some(file) => Some(labels_of(file, loaded, &file_face)?),
        None => {
            let own = own_labels(path, options.labels_from, loaded, &mut notes)?;
            own.map(|labels| source_face.iter().map(|&k| labels[k as usize]).collect())
        }
    };
    let (scale, doubt) = scale(options, loaded, solid.mesh().bounds())?;
    let mut made = made_of(solid, scale, path)?;
    made.labels = labels;
    made.n_file_faces = loaded.n_file_faces();
    made.file_face = file_face;
    made.sha256 = sha256;
    made.notes = notes;
    made.warnings.extend(doubt);
    made.selection = selection(options);
    made.repairs = repairs;
    settle_hollow(&mut made, options)?;
    Ok(made)
}

/// Labels in the model's own file, one a triangle as read; `None` if the surface is to be divided
/// automatically.
fn own_labels<'a>(
    path: &Path,
    from: LabelsFrom,
    loaded: &'a Loaded,
    notes: &mut Vec<String>,
) -> Result<Option<&'a [i64]>, Failure> {
    let source = match from {
        LabelsFrom::None => return Ok(None),
        LabelsFrom::Auto => {
            match loaded
                .labellings
                .iter()
                .find(|l| matches!(l.source, LabelSource::Property | LabelSource::Paint))
            {
                Some(own) if own.source == LabelSource::Paint => {
                    notes.push("the paint in the file defines the pieces".to_owned())
                }
                Some(_) => {
                    notes.push("the file has a label for each face; the labels define the pieces".to_owned())
                }
                None => notes.extend(loaded.labellings.iter().map(|other| {
                    let source = other.source;
                    format!("the file has {source}; with --labels-from {source} they define the pieces")
                })),
            }
            return Ok(loaded.face_labels());
        }
        LabelsFrom::Labels => LabelSource::Property,
        LabelsFrom::Paint => LabelSource::Paint,
        LabelsFrom::Colors => LabelSource::Color,
        LabelsFrom::Materials => LabelSource::Material,
        LabelsFrom::Groups => LabelSource::Group,
        LabelsFrom::Sets => LabelSource::Set,
        LabelsFrom::Objects => LabelSource::Object,
    };
    let has: Vec<String> = loaded.labellings.iter().map(|l| l.source.to_string()).collect();
    let has = if has.is_empty() {
        "nothing".to_owned()
    } else {
        has.join(", ")
    };
    let wrong = || {
        Failure::Wrong(format!(
            "{}: it has no {source} to divide it by; it has {has}",
            path.display()
        ))
    };
    loaded.labels(source).map(Some).ok_or_else(wrong)
}

/// Scales a solid in file units and makes a model of it, without labels or notes.
fn made_of(solid: Solid, scale: f64, path: &Path) -> Result<Model, Failure> {
    let mut mesh = solid.into_mesh();
    // Far from the origin, 32-bit files would lose the detail: such models are moved to it.
    let bounds = mesh.bounds();
    let far = (bounds.center() * scale).abs().max_element() > 1000.0 + (bounds.size() * scale).max_element();
    let shift = if far { -bounds.center() } else { Vec3::ZERO };
    mesh.points.iter_mut().for_each(|p| *p = (*p + shift) * scale);
    let t = shift * scale;
    let transform = [
        scale, 0.0, 0.0, t.x, 0.0, scale, 0.0, t.y, 0.0, 0.0, scale, t.z, 0.0, 0.0, 0.0, 1.0,
    ]
    .map(|x: f64| x + 0.0);
    let solid =
        Solid::new(mesh).map_err(|e| Failure::Wrong(format!("{}: after scaling, {e}", path.display())))?;
    let name = path
        .file_name()
        .map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    Ok(Model {
        solid,
        labels: None,
        file_face: Vec::new(),
        n_file_faces: 0,
        transform,
        name,
        sha256: String::new(),
        notes: Vec::new(),
        warnings: Vec::new(),
        selection: Selection::default(),
        repairs: Vec::new(),
    })
}

/// Makes one of the program's own figures as if it had been read from a file.
pub fn figure(name: &str, options: &Options) -> Result<Model, Failure> {
    let (solid, _) = shellock_figure(name, options.size.or(options.height).unwrap_or(DEFAULT_SIZE_MM))?;
    let bytes = shellock_formats::write_stl_binary(solid.mesh());
    let mut model = made_of(solid, 1.0, &PathBuf::from(format!("{name}.stl")))?;
    model.sha256 = sha256(&bytes);
    Ok(model)
}

/// Makes the figure called `name` with its longest side `size_mm`; also returns the limb of each triangle.
pub fn shellock_figure(name: &str, size_mm: f64) -> Result<(Solid, Vec<u32>), Failure> {
    /// Cells along the longest side: polygons of about 1/95 of the size, smooth to the eye, some 55 000
    /// triangles.
    const CELLS: f64 = 94.0;
    let figure = shellock::figure::Figure::from_name(name).ok_or_else(|| {
        let all: Vec<&str> = shellock::figure::Figure::ALL.iter().map(|f| f.name()).collect();
        Failure::Wrong(no_such("figure", name, &all))
    })?;
    check_size(size_mm)?;
    Ok(shellock::figure::make_with_limbs(
        figure,
        size_mm,
        size_mm / CELLS,
    ))
}

/// Reads the labels in `file`, one a triangle of the solid.
fn labels_of(file: &Path, loaded: &Loaded, file_face: &[u32]) -> Result<Vec<i64>, Failure> {
    let n = loaded.n_file_faces();
    let is_ply = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply"));
    let a_file_face: Vec<i64> = if is_ply {
        let (with, _) = load(file)?;
        let labels = with.face_labels().ok_or_else(|| {
            Failure::Wrong(format!(
                "{}: its faces have no property named label, segment or similar",
                file.display()
            ))
        })?;
        let mut by_face = vec![0; with.n_file_faces()];
        for (triangle, &face) in with.file_face.iter().enumerate() {
            by_face[face as usize] = labels[triangle];
        }
        by_face
    } else {
        let bytes = read(file)?;
        read_labels(&bytes).map_err(|source| Failure::NotAMesh {
            path: file.to_owned(),
            source,
        })?
    };
    if a_file_face.len() != n {
        return Err(Failure::Wrong(format!(
            "{}: {} labels for a model of {n} faces; give one label per face, in the order of the model's \
             file",
            file.display(),
            a_file_face.len()
        )));
    }
    Ok(file_face.iter().map(|&f| a_file_face[f as usize]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A figure of the program, labelled in two halves, as if it came from a file with the same faces.
    fn vase_in_halves() -> Model {
        let (solid, _) = shellock_figure("vase", 40.0).expect("there is such a figure");
        let mut model = made_of(solid, 1.0, Path::new("vase.stl")).expect("it is small");
        let mesh = model.solid.mesh();
        let n_faces = mesh.triangles.len();
        model.labels = Some(
            (0..n_faces)
                .map(|f| i64::from(mesh.face_center(f).z > 20.0))
                .collect(),
        );
        model.file_face = (0..n_faces as u32).collect();
        model
    }

    #[test]
    fn a_simplified_model_keeps_its_labels_and_says_what_was_done() {
        let model = vase_in_halves();
        let n_before = model.solid.mesh().triangles.len();
        let few = simplify_model(model, 0.05).unwrap();
        let mesh = few.solid.mesh();
        assert!(mesh.triangles.len() < n_before);
        let labels = few.labels.expect("labels stay");
        assert!(labels.contains(&0) && labels.contains(&1));
        assert_eq!(
            (labels.len(), few.file_face.len()),
            (mesh.triangles.len(), mesh.triangles.len())
        );
        // The border between the labels follows edges, so it is as ragged as the triangles are large.
        for (f, label) in labels.iter().enumerate() {
            let z = mesh.face_center(f).z;
            assert!(*label == i64::from(z > 20.0) || (z - 20.0).abs() < 0.1, "{z}");
        }
        assert!(
            few.notes[0].contains(&format!("from {n_before} to ")),
            "{:?}",
            few.notes
        );
    }

    #[test]
    fn what_cannot_be_simplified_stays_and_is_told() {
        let solid = Solid::new(shellock_testkit::shapes::tetrahedron()).expect("closed");
        let model = made_of(solid.clone(), 1.0, Path::new("tetrahedron.stl")).expect("it is small");
        let same = simplify_model(model, 0.01).unwrap();
        assert!(same.solid == solid);
        assert!(same.notes[0].contains("all are kept"), "{:?}", same.notes);
    }
}
