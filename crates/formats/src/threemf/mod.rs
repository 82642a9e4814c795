//! 3MF: a zip archive of XML files (core specification 1.3, with materials, colours and parts in several
//! files), and what slicers add to it: paint, extruders and volumes that are no part of the model.

mod model;
mod settings;
mod write;
mod xml;

use std::collections::BTreeMap;

use glam::DAffine3;

pub use write::{NamedObject, write_3mf, write_painted_3mf};

use super::assembly::{Occurrence, Part, occurrences};
use super::container::{archive, limit, read_bounded, unopened};
use super::paint::{self, Painted};
use super::polygons::{Numbering, divides};
use super::{Format, LabelSource, Labelling, Loaded, ReadError};
use model::{Model, Object, Property};
use settings::Settings;
use shellock_geom::TriMesh;

/// The part that describes what is built, unless the package says otherwise.
const USUAL_ROOT: &str = "3D/3dmodel.model";

/// Reads a 3MF: all that its build holds, in one mesh.
pub(super) fn read(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let mut package = Package::open(bytes)?;
    let mut root = Model::read(&package.root()?, &mut package)?;
    root.read_other_parts(&mut package)?;
    let mut settings = Settings::default();
    for name in settings::FILES {
        settings.read(name, &mut package);
    }
    let mut notes = root.notes.clone();
    let mut loaded = build(&root, &settings, &mut notes)?;
    loaded.unit_mm = Some(root.unit_mm);
    loaded.notes.extend(notes);
    Ok(loaded)
}

/// The archive, and how much of it may still be unpacked.
struct Package<'a> {
    archive: zip::ZipArchive<std::io::Cursor<&'a [u8]>>,
    bytes_left: u64,
}

impl<'a> Package<'a> {
    fn open(bytes: &'a [u8]) -> Result<Self, ReadError> {
        Ok(Self {
            archive: archive(bytes)?,
            bytes_left: limit(bytes.len()),
        })
    }

    /// The text of a part; `None` where there is none of that name.
    fn text(&mut self, name: &str) -> Result<Option<String>, ReadError> {
        let name = name.trim_start_matches('/');
        // Names in archives differ in case from those that refer to them, rarely.
        let index = self.archive.index_for_name(name).or_else(|| {
            self.archive
                .file_names_raw()
                .position(|other| other.eq_ignore_ascii_case(name.as_bytes()))
        });
        let Some(index) = index else { return Ok(None) };
        let file = self.archive.by_index(index).map_err(unopened)?;
        let bytes = read_bounded(file, self.bytes_left)?;
        self.bytes_left -= bytes.len() as u64;
        Ok(Some(xml::text(bytes)))
    }

    /// The name of the root part.
    fn root(&mut self) -> Result<String, ReadError> {
        if self.archive.index_for_name(USUAL_ROOT).is_none()
            && let Some(relations) = self.text("_rels/.rels")?
            && let Some(target) = xml::relation_target(&relations, "/3dmodel")
        {
            return Ok(target);
        }
        Ok(USUAL_ROOT.to_owned())
    }
}

/// An object ready to be put in place.
struct Body<'a> {
    object: &'a Object,
    painted: Painted,
}

/// Puts the parts of the build together.
fn build(model: &Model, settings: &Settings, notes: &mut Vec<String>) -> Result<Loaded, ReadError> {
    let index: BTreeMap<_, usize> = model
        .objects
        .iter()
        .enumerate()
        .map(|(i, o)| (o.key(), i))
        .collect();
    let find = |path: &str, id: u32| {
        let missing = || ReadError::MissingPart {
            kind: "object",
            id: id.to_string(),
        };
        index.get(&(path, id)).copied().ok_or_else(missing)
    };
    let mut bodies = Vec::new();
    let mut parts = Vec::new();
    for object in &model.objects {
        let body = body(object, settings, notes)?;
        let mut children = Vec::new();
        for component in &object.components {
            children.push((find(&component.path, component.id)?, component.placed));
        }
        parts.push(Part {
            id: object.id.to_string(),
            n_triangles: body.painted.mesh.triangles.len(),
            children,
        });
        bodies.push(body);
    }
    let mut roots = Vec::new();
    for item in &model.items {
        roots.push((find(&item.path, item.id)?, item.placed));
    }
    if model.items.is_empty() {
        let mut is_child = vec![false; parts.len()];
        parts
            .iter()
            .flat_map(|p| &p.children)
            .for_each(|&(child, _)| is_child[child] = true);
        roots.extend(
            (0..parts.len())
                .filter(|&i| !is_child[i])
                .map(|i| (i, DAffine3::IDENTITY)),
        );
        notes.push("nothing is on the build plate; all objects were read".to_owned());
    }
    let found = occurrences(&parts, &roots, "object")?;
    if found.len() > 1 {
        notes.push(format!(
            "the file has {} objects or parts; all were read",
            found.len()
        ));
    }
    flatten(model, &bodies, &found)
}

/// The triangles of `object` that are part of the model, with their paint made real.
fn body<'a>(object: &'a Object, settings: &Settings, notes: &mut Vec<String>) -> Result<Body<'a>, ReadError> {
    let n_triangles = object.mesh.triangles.len();
    let extruder = settings.extruders(object.id, n_triangles);
    let n_left_out = extruder.iter().filter(|e| e.is_none()).count();
    let mut painted = paint::apply(&object.mesh, &object.paint_codes())?;
    for (color, &source) in painted.colors.iter_mut().zip(&painted.source) {
        if *color == 0 {
            *color = extruder[source as usize].unwrap_or_default();
        }
    }
    if n_left_out > 0 {
        let id = object.id;
        notes.push(format!(
            "{n_left_out} triangles of object {id} are modifiers or supports of the slicer; left out"
        ));
        let Painted { mesh, colors, source } = &mut painted;
        let is_kept: Vec<bool> = source.iter().map(|&s| extruder[s as usize].is_some()).collect();
        retain(&mut mesh.triangles, &is_kept);
        retain(colors, &is_kept);
        retain(source, &is_kept);
    }
    Ok(Body { object, painted })
}

fn retain<T>(all: &mut Vec<T>, is_kept: &[bool]) {
    let mut kept = is_kept.iter();
    all.retain(|_| kept.next() == Some(&true));
}

/// A word on triangles of colours that are not there.
fn unnamed_note(n_triangles: usize) -> Option<String> {
    (n_triangles > 0).then(|| {
        format!(
            "{n_triangles} triangle(s) have a colour or material that the file does not have; those of the same \
             missing one are taken as one"
        )
    })
}

/// One mesh of all occurrences, with every way in which the file divides it.
fn flatten(model: &Model, bodies: &[Body], found: &[Occurrence]) -> Result<Loaded, ReadError> {
    let mut mesh = TriMesh::default();
    let mut file_face = Vec::new();
    let [mut paint, mut color, mut material, mut object] = [const { Vec::new() }; 4];
    let (mut colors, mut materials) = (Numbering::default(), Numbering::default());
    let (mut n_faces, mut n_unnamed) = (0, 0_usize);
    for (number, occurrence) in (0_i64..).zip(found) {
        let Body { object: of, painted } = &bodies[occurrence.part];
        let first = u32::try_from(mesh.points.len()).unwrap_or(u32::MAX);
        let placed = occurrence.placed;
        mesh.points
            .extend(painted.mesh.points.iter().map(|&p| placed.transform_point3(p)));
        let is_mirror = placed.matrix3.determinant() < 0.0;
        let mut last_source = None;
        for ((triangle, &extruder), &source) in painted
            .mesh
            .triangles
            .iter()
            .zip(&painted.colors)
            .zip(&painted.source)
        {
            let [a, b, c] = triangle.map(|v| v.saturating_add(first));
            mesh.triangles.push(if is_mirror { [a, c, b] } else { [a, b, c] });
            if last_source.replace(source) != Some(source) {
                n_faces += 1;
            }
            file_face.push(n_faces - 1);
            n_unnamed += usize::from(of.property(source).is_some_and(|p| !model.has(p)));
            let (of_color, of_material) = match of.property(source) {
                Some(property) if model.color_groups.contains_key(&property.group()) => {
                    (Some(property), None)
                }
                other => (None, other),
            };
            let value = |p: Property| model.color_groups[&p.group()].get(p.index as usize).cloned();
            paint.push(i64::from(extruder));
            color.push(colors.number(of_color.map(value)));
            material.push(materials.number(of_material));
            object.push(number);
        }
    }
    if mesh.triangles.is_empty() {
        return Err(ReadError::NoTriangles {
            format: Format::ThreeMf,
            n_points: mesh.points.len(),
        });
    }
    if mesh.points.iter().any(|p| !p.is_finite()) {
        let reason = "moving an object takes its points out of all numbers".to_owned();
        return Err(ReadError::Xml {
            part: USUAL_ROOT.to_owned(),
            at: super::Place::Byte(0),
            reason,
        });
    }
    let all = [
        (LabelSource::Paint, paint),
        (LabelSource::Color, color),
        (LabelSource::Material, material),
        (LabelSource::Object, object),
    ];
    let labellings = all.into_iter().filter(|(_, labels)| divides(labels));
    let labellings = labellings
        .map(|(source, labels)| Labelling { source, labels })
        .collect();
    Ok(Loaded {
        mesh,
        labellings,
        file_face,
        format: Format::ThreeMf,
        unit_mm: None,
        notes: unnamed_note(n_unnamed).into_iter().collect(),
    })
}

#[cfg(test)]
mod tests;
