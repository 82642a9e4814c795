//! glTF 2.0: triangles of all nodes of the scene as a viewer shows them at rest, with skins, morph targets
//! and instances. Lines, points, animations and images are left out, with a note. Compressed and external
//! data, and unknown extensions that are required, are rejected by name.
//!
//! The document is read into types of this crate, since files in practice contain more and less than the
//! specification demands. All work is bounded: the node tree by `nodes`, numbers by `values`, copies by the
//! limits of `assembly`, point transforms by `effort`.

mod buffers;
mod document;
mod effort;
mod extensions;
mod instances;
mod morph;
mod nodes;
mod primitives;
mod skin;
mod surface;
mod values;

#[cfg(test)]
mod tests;

use super::polygons::divides;
use super::{Format, LabelSource, Labelling, Loaded, Place, ReadError, assembly, point_colors};
use document::{Document, Names};
use nodes::Nodes;
use primitives::Counts;
use surface::{Figure, Surface};
use values::Accessors;

/// Length of a glTF unit, mm: all lengths are in metres.
const UNIT_MM: f64 = 1000.0;
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BINARY: u32 = 0x004E_4942;

/// Reads a glTF in text form.
pub(super) fn read_text(bytes: &[u8]) -> Result<Loaded, ReadError> {
    read(super::text::without_bom(bytes), None, Format::Gltf)
}

/// Reads a GLB: a header of 12 bytes, then chunks of length, kind and content. The text comes first, then the
/// data.
pub(super) fn read_binary(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let word = |at: usize| {
        bytes
            .get(at..at.checked_add(4)?)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    };
    if word(4) != Some(2) {
        return Err(ReadError::Unsupported {
            what: "a GLB file of another version than 2",
            at: Place::Byte(4),
        });
    }
    let (mut json, mut data, mut at) = (None, None, 12);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let end = (at + 8).saturating_add(length as usize);
        let content = bytes.get(at + 8..end);
        let content = content.ok_or(ReadError::CutOff {
            at: Place::Byte(bytes.len()),
            within: "a chunk",
        })?;
        match kind {
            CHUNK_JSON => json = json.or(Some(content)),
            CHUNK_BINARY => data = data.or(Some(content)),
            _ => {}
        }
        at = end;
    }
    let json = json.ok_or(ReadError::CutOff {
        at: Place::Byte(bytes.len()),
        within: "the header",
    })?;
    read(super::text::without_bom(json), data, Format::Glb)
}

fn read(json: &[u8], data: Option<&[u8]>, format: Format) -> Result<Loaded, ReadError> {
    let document: Document = serde_json::from_slice(json).map_err(|e| error(e.to_string()))?;
    extensions::check(&document.extensions_required)?;
    let accessors = Accessors {
        document: &document,
        contents: buffers::contents(&document.buffers, data),
        effort: effort::Effort::default(),
    };
    let nodes = Nodes::of(&document)?;
    let scene = VisibleScene::of(&accessors, &nodes)?;
    let mut surface = Surface::default();
    for figure in &scene.figures {
        let counts = scene.meshes[figure.mesh].as_ref();
        let counts = counts.ok_or_else(|| missing_error("mesh", figure.mesh))?;
        surface.add(&accessors, &nodes, figure, counts)?;
    }
    if surface.mesh.triangles.is_empty() {
        return Err(scene.without_triangles(format));
    }
    let mut notes = notes(&document, &nodes);
    notes.extend(scene.note());
    Ok(load_surface(surface, notes, format))
}

/// Visible part of a document, counted before any triangle is made.
struct VisibleScene {
    figures: Vec<Figure>,
    /// Counts of the visible meshes; `None` for others.
    meshes: Vec<Option<Counts>>,
    /// Number of primitives of lines or points.
    n_without_triangles: usize,
}

impl VisibleScene {
    /// Collects the visible nodes with triangles; an error for more triangles or copies than the limits.
    fn of(accessors: &Accessors, nodes: &Nodes) -> Result<Self, ReadError> {
        let document = accessors.document;
        let mut scene = Self {
            figures: Vec::new(),
            meshes: document.meshes.iter().map(|_| None).collect(),
            n_without_triangles: 0,
        };
        let (mut n_occurrences, mut n_triangles) = (0_u64, 0_u64);
        for &node in &nodes.visible {
            let Some(mesh) = document.nodes[node].mesh else {
                continue;
            };
            let counts = scene
                .meshes
                .get_mut(mesh)
                .ok_or_else(|| missing_error("mesh", mesh))?;
            let counts = match counts {
                Some(counts) => counts,
                new => new.insert(accessors.count(&document.meshes[mesh])?),
            };
            scene.n_without_triangles += counts.n_without_triangles;
            if counts.n_triangles == 0 {
                continue;
            }
            let n_instances = accessors.n_instances(node)?;
            // Without a copy to count, the work on a mesh would have no limit.
            if n_instances == 0 {
                continue;
            }
            let n = n_instances as u64;
            n_occurrences = n_occurrences.saturating_add(n);
            n_triangles = n_triangles.saturating_add(counts.n_triangles.saturating_mul(n));
            scene.figures.push(Figure {
                node,
                mesh,
                n_instances,
            });
        }
        assembly::check_limits(n_occurrences, n_triangles)?;
        Ok(scene)
    }

    /// Error for a scene without triangles.
    fn without_triangles(&self, format: Format) -> ReadError {
        if self.n_without_triangles == 0 {
            return ReadError::NoTriangles { format, n_points: 0 };
        }
        ReadError::GltfUnsupported {
            what: "has only lines or points, no triangles".to_owned(),
            remedy: "export the model as a surface mesh",
        }
    }

    fn note(&self) -> Option<String> {
        let (one, several) = ("set of lines or points is", "sets of lines or points are");
        left_out(self.n_without_triangles, one, several)
    }
}

fn load_surface(surface: Surface, notes: Vec<String>, format: Format) -> Loaded {
    let all = [
        (LabelSource::Material, surface.material),
        (LabelSource::Object, surface.object),
    ];
    let labellings = all.into_iter().filter(|(_, labels)| divides(labels));
    let mut loaded = Loaded {
        file_face: (0..surface.mesh.triangles.len() as u32).collect(),
        labellings: labellings
            .map(|(source, labels)| Labelling { source, labels })
            .collect(),
        mesh: surface.mesh,
        format,
        unit_mm: Some(UNIT_MM),
        has_unit: false,
        objects: surface.objects,
        empty_plates: Vec::new(),
        cutters: Vec::new(),
        notes,
    };
    if surface.has_texture {
        loaded.notes.push("the file's texture is not used".to_owned());
    }
    if surface.has_bad_colors {
        loaded
            .notes
            .push("the colours of points cannot be read".to_owned());
    }
    if surface.has_colors {
        point_colors::divide(&mut loaded, &surface.colors);
    }
    loaded
}

/// Notes on what the document contains beyond the visible triangles.
fn notes(document: &Document, nodes: &Nodes) -> Vec<String> {
    let mut notes = vec!["in glTF y points up: choose y as the axis that points up".to_owned()];
    notes.extend(left_out(nodes.n_hidden, "hidden mesh is", "hidden meshes are"));
    let n_others = document.scenes.len().saturating_sub(1);
    notes.extend(left_out(n_others, "other scene is", "other scenes are"));
    if !document.animations.is_empty() {
        notes.push("the file is animated; its rest pose is used".to_owned());
    } else if !document.skins.is_empty() {
        notes.push("the file has a skeleton; its rest pose is used".to_owned());
    }
    if document.extensions.variants.is_some() {
        notes.push("the file has variants of its materials; the default ones are used".to_owned());
    }
    notes
}

/// Note on `n` things left out; `one` and `several` are their names. `None` for 0.
fn left_out(n: usize, one: &str, several: &str) -> Option<String> {
    let what = if n == 1 { one } else { several };
    (n > 0).then(|| format!("{n} {what} left out"))
}

/// Returns the first of `extensions` that compresses data.
fn compression(extensions: &Names) -> Option<&str> {
    let mut names = extensions.keys().map(String::as_str);
    names.find(|name| name.contains("compression"))
}

/// Error for data that only extension `name` can unpack.
fn is_compressed(name: &str) -> ReadError {
    const QUOTED_CHARS: usize = 40;
    let name: String = name
        .chars()
        .filter(|c| !c.is_control())
        .take(QUOTED_CHARS)
        .collect();
    ReadError::GltfUnsupported {
        what: format!("has compressed data ({name})"),
        remedy: "export it without compression",
    }
}

fn error(reason: impl Into<String>) -> ReadError {
    ReadError::Gltf {
        reason: reason.into(),
    }
}

fn missing_error(kind: &'static str, id: usize) -> ReadError {
    ReadError::MissingPart {
        kind,
        id: id.to_string(),
    }
}
