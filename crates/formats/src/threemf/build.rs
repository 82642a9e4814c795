//! The build of a model: its objects in their places, each part by its role.

use std::collections::{BTreeMap, BTreeSet};

use glam::DAffine3;

use super::super::assembly::{Occurrence, Part, occurrences};
use super::super::paint::{self, Painted};
use super::super::polygons::{Numbering, divides};
use super::super::select::list_names;
use super::super::{Cutter, FileObject, FilePlate, Format, LabelSource, Labelling, Loaded, Place, ReadError};
use super::model::{GroupEntry, Item, Model, Object};
use super::role::{Role, Usage};
use super::settings::{ObjectSettings, Settings};
use shellock_geom::{TriMesh, Vec3};

/// Extruder used by default.
const FIRST_EXTRUDER: u32 = 1;

/// Puts the parts of the build together.
pub(super) fn read(model: &Model, settings: &Settings) -> Result<Loaded, ReadError> {
    let build = Build::new(model, settings)?;
    let (roots, mut notes) = build.roots()?;
    let found = occurrences(&build.parts()?, &roots, "object", Usage::with)?;
    let mut flat = Flat::default();
    for occurrence in &found {
        flat.add(&build, occurrence)?;
    }
    if !model.other_units.is_empty() {
        notes.push(format!(
            "parts of the file in another unit than its root were converted to the root's unit: {}",
            list_names(&model.other_units)
        ));
    }
    notes.extend(flat.notes(&build));
    flat.finish(&build, notes)
}

/// Objects ready to be placed.
struct Build<'a> {
    model: &'a Model,
    bodies: Vec<Body<'a>>,
    /// Index of an object in the model, by its model part and id.
    place_of: BTreeMap<(&'a str, u32), usize>,
    settings: &'a Settings,
    /// Plate of each item of the build; `None` if there is none.
    plates: Vec<Option<FilePlate>>,
    /// True for each item that is read.
    is_made: Vec<bool>,
}

/// An object divided along its paint, with the slicer's settings for it.
struct Body<'a> {
    object: &'a Object,
    settings: Option<&'a ObjectSettings>,
    surface: Painted,
    /// Volume of each triangle of the object.
    volume_of: Vec<u16>,
    /// Set of each triangle of the object, −1 for none; empty if there are no sets.
    set_of: Vec<i64>,
}

impl<'a> Build<'a> {
    fn new(model: &'a Model, settings: &'a Settings) -> Result<Self, ReadError> {
        let root = model.parts.first().map_or("", String::as_str);
        let bodies = model.objects.iter().map(|object| {
            // Slicers refer to ids of the root part alone.
            let of_root = (object.path == root).then(|| settings.object(object.id));
            Body::new(object, of_root.flatten())
        });
        let place_of = model.objects.iter().enumerate();
        let mut n_items: BTreeMap<(&str, u32), u32> = BTreeMap::new();
        let plates = model.items.iter().map(|item| {
            let (path, id) = (&item.component.path[..], item.component.id);
            let instance = n_items.entry((path, id)).or_default();
            *instance += 1;
            let plate = settings.plate(id, *instance - 1).filter(|_| path == root)?;
            Some(plate.of_file())
        });
        Ok(Self {
            model,
            settings,
            plates: plates.collect(),
            is_made: is_made(&model.items),
            bodies: bodies.collect::<Result<_, _>>()?,
            place_of: place_of.map(|(i, o)| ((&o.path[..], o.id), i)).collect(),
        })
    }

    fn find(&self, path: &str, id: u32) -> Result<usize, ReadError> {
        let missing = || ReadError::MissingPart {
            kind: "object",
            id: id.to_string(),
        };
        self.place_of.get(&(path, id)).copied().ok_or_else(missing)
    }

    /// Converts the objects to parts, with the usage of their components.
    fn parts(&self) -> Result<Vec<Part<Usage<'_>>>, ReadError> {
        self.bodies.iter().map(|body| self.part(body)).collect()
    }

    fn part<'b>(&'b self, body: &'b Body<'a>) -> Result<Part<Usage<'b>>, ReadError> {
        let components = &body.object.components;
        let ids: Vec<u32> = components.iter().map(|c| c.id).collect();
        let usages = body.settings.map_or_else(
            || vec![Usage::PLAIN; ids.len()],
            |settings| settings.of_components(&ids),
        );
        let child = |(component, usage): (&super::model::Component, Usage<'b>)| {
            let part = self.find(&component.path, component.id)?;
            Ok(Occurrence {
                part,
                transform: component.transform,
                // A name shown by a slicer takes precedence over that of the object.
                attribute: self.bodies[part].usage().with(usage),
            })
        };
        let children = components.iter().zip(usages).map(child);
        Ok(Part {
            id: body.object.id.to_string(),
            n_triangles: body.n_triangles(),
            children: children.collect::<Result<_, ReadError>>()?,
        })
    }

    /// A note on items that the slicer is not to print.
    fn off_note(&self) -> Option<String> {
        let n_off = self.model.items.iter().filter(|item| !item.is_printed).count();
        if n_off == 0 {
            None
        } else if n_off == self.model.items.len() {
            Some("every object is excluded from printing in the slicer; all were used".to_owned())
        } else {
            Some(format!(
                "objects excluded from printing in the slicer: {n_off}; left out"
            ))
        }
    }

    /// The objects that are built, and a note where the file does not say which.
    fn roots(&self) -> Result<(Vec<Occurrence<Usage<'_>>>, Vec<String>), ReadError> {
        let root = |part: usize, transform: DAffine3, item: usize| Occurrence {
            part,
            transform,
            attribute: Usage {
                item: item as u32,
                ..self.bodies[part].usage()
            },
        };
        let mut roots = Vec::new();
        for (number, item) in self.model.items.iter().enumerate() {
            if !self.is_made[number] {
                continue;
            }
            let part = self.find(&item.component.path, item.component.id)?;
            let mut of_item = root(part, item.component.transform, number);
            of_item.attribute = of_item.attribute.with(Usage {
                role: item.role.unwrap_or(Role::Body),
                extruder: item.extruder,
                ..Usage::PLAIN
            });
            roots.push(of_item);
        }
        if !roots.is_empty() {
            return Ok((roots, self.off_note().into_iter().collect()));
        }
        let mut is_child = vec![false; self.bodies.len()];
        for component in self.model.objects.iter().flat_map(|o| &o.components) {
            is_child[self.find(&component.path, component.id)?] = true;
        }
        let tops = (0..self.bodies.len()).filter(|&i| !is_child[i]);
        let roots = tops
            .enumerate()
            .map(|(number, part)| root(part, DAffine3::IDENTITY, number));
        let note = "nothing is on the build plate; all objects were read".to_owned();
        Ok((roots.collect(), vec![note]))
    }
}

impl<'a> Body<'a> {
    fn new(object: &'a Object, settings: Option<&'a ObjectSettings>) -> Result<Self, ReadError> {
        let n_triangles = object.mesh.triangles.len();
        let mut painted = paint::apply(&object.mesh, &object.paint_codes())?;
        // Each occurrence copies its points, so unused points would make multiplication free.
        painted.mesh = painted.mesh.without_unused_points();
        Ok(Self {
            object,
            settings,
            surface: painted,
            volume_of: settings.map_or_else(Vec::new, |s| s.of_triangles(object.id, n_triangles)),
            set_of: sets(object),
        })
    }

    /// Usage of the object wherever it occurs.
    fn usage(&self) -> Usage<'_> {
        let of_slicer = self.settings.and_then(|s| s.name.as_deref());
        let own = Some(&self.object.name[..]).filter(|name| !name.is_empty());
        Usage {
            role: self.object.role.unwrap_or(Role::Body),
            extruder: self.settings.and_then(|s| s.extruder).or(self.object.extruder),
            item: 0,
            name: of_slicer.or(own),
        }
    }

    /// Usage of a triangle of the object within it.
    fn usage_of(&self, source: u32) -> Usage<'_> {
        match (self.settings, self.volume_of.get(source as usize)) {
            (Some(settings), Some(&volume)) => settings.usage(volume),
            _ => Usage::PLAIN,
        }
    }

    /// Name of the part that a triangle belongs to, if the object is used as `said`.
    fn name_of(&self, said: Usage, source: u32) -> String {
        let is_range = self
            .volume_of
            .get(source as usize)
            .is_some_and(|&volume| volume > 0);
        match self.usage_of(source).name {
            Some(name) => format!("\"{name}\""),
            None if is_range => format!("a part of {}", name_of(said, self.object)),
            None => name_of(said, self.object),
        }
    }

    /// Number of triangles. An object with an unsupported shape counts as at least one, so that it is
    /// visited.
    fn n_triangles(&self) -> usize {
        let is_met = self.unread_shape().is_some();
        self.surface.mesh.triangles.len().max(usize::from(is_met))
    }

    /// Name of an unsupported shape in the object.
    fn unread_shape(&self) -> Option<&str> {
        let object = self.object;
        let is_bare = object.mesh.triangles.is_empty() && object.components.is_empty();
        let unknown = object.unknown.as_deref().filter(|_| is_bare);
        object.unread.or(unknown)
    }
}

/// Marks the items to read: the printable ones, or all if none is printable. The others stay in the list,
/// because slicers number instances with them.
fn is_made(items: &[Item]) -> Vec<bool> {
    let prints = items.iter().any(|item| item.is_printed);
    items.iter().map(|item| item.is_printed || !prints).collect()
}

/// The named set of each triangle of an object; none where it is −1, the first where there are several.
fn sets(object: &Object) -> Vec<i64> {
    /// Largest mean number of sets per triangle; further ones are hostile and are skipped.
    const MAX_OVERLAP: usize = 8;
    if object.sets.is_empty() {
        return Vec::new();
    }
    let n_triangles = object.mesh.triangles.len();
    let mut set_of = vec![-1; n_triangles];
    let mut work_left = MAX_OVERLAP * n_triangles;
    for &(first, last, set) in &object.sets {
        let end = (last as usize).saturating_add(1).min(n_triangles);
        let begin = (first as usize).min(end);
        let Some(left) = work_left.checked_sub(end - begin) else {
            break;
        };
        work_left = left;
        for of in set_of[begin..end].iter_mut().filter(|of| **of < 0) {
            *of = i64::from(set);
        }
    }
    set_of
}

/// Triangles of all occurrences so far, with every division that the file gives.
#[derive(Default)]
struct Flat {
    mesh: TriMesh,
    file_face: Vec<u32>,
    n_faces: u32,
    paint: Vec<i64>,
    color: Vec<i64>,
    material: Vec<i64>,
    set: Vec<i64>,
    object: Vec<i64>,
    colors: Numbering<Option<Option<String>>>,
    materials: Numbering<Option<GroupEntry>>,
    set_numbers: Numbering<Option<(usize, i64)>>,
    objects: Vec<FileObject>,
    cutters: Vec<Cutter>,
    /// Names of parts that do not belong to the model, by role.
    left_out: BTreeMap<Role, BTreeSet<String>>,
    /// Number of triangles with missing colours or materials.
    n_unnamed: usize,
    has_textures: bool,
    /// Elements of objects that no specification names.
    unknown: BTreeSet<String>,
}

impl Flat {
    /// Adds the triangles of an occurrence.
    fn add(&mut self, build: &Build, occurrence: &Occurrence<Usage>) -> Result<(), ReadError> {
        let Occurrence {
            part,
            transform,
            attribute: said,
        } = *occurrence;
        let body = &build.bodies[part];
        let is_solid = matches!(said.role, Role::Body | Role::Negative);
        if let Some(shape) = body.unread_shape().filter(|_| is_solid) {
            return Err(ReadError::Shape {
                object: name_of(said, body.object),
                shape: shape.to_owned(),
            });
        }
        self.unknown
            .extend(body.object.unknown.clone().filter(|_| is_solid));
        let points = transform_points(build.model, &body.surface.mesh, transform)?;
        let is_mirror = transform.matrix3.determinant() < 0.0;
        let (mut of_body, mut last_source) = (Vec::new(), None);
        let mut of_cutters: BTreeMap<String, Vec<[u32; 3]>> = BTreeMap::new();
        for (place, &[a, b, c]) in body.surface.mesh.triangles.iter().enumerate() {
            let source = body.surface.source[place];
            let usage = said.with(body.usage_of(source));
            let triangle = if is_mirror { [a, c, b] } else { [a, b, c] };
            match usage.role {
                Role::Body => {
                    self.n_faces += u32::from(last_source.replace(source) != Some(source));
                    of_body.push(triangle);
                    self.divide(build, part, place, usage);
                }
                Role::Negative => {
                    let name = body.name_of(said, source);
                    of_cutters.entry(name).or_default().push(triangle);
                }
                role => {
                    let names = self.left_out.entry(role).or_default();
                    names.insert(body.name_of(said, source));
                }
            }
        }
        if !of_body.is_empty() {
            append(&mut self.mesh, part_of(&points, of_body));
            self.objects.push(FileObject {
                name: build.item_name(said.item),
                part: said.name.map(str::to_owned),
                item: said.item,
                plate: build.plates.get(said.item as usize).cloned().flatten(),
            });
        }
        self.cutters
            .extend(of_cutters.into_iter().map(|(name, triangles)| Cutter {
                name,
                item: said.item,
                mesh: part_of(&points, triangles),
            }));
        Ok(())
    }

    /// Records the labels of the triangle at `place` of a body, which was just added.
    fn divide(&mut self, build: &Build, part: usize, place: usize, usage: Usage) {
        let (model, body) = (build.model, &build.bodies[part]);
        let source = body.surface.source[place];
        self.file_face.push(self.n_faces - 1);
        let property = body.object.property(source);
        self.n_unnamed += usize::from(property.is_some_and(|p| !model.has(p)));
        self.has_textures |= property.is_some_and(|p| model.textures.contains(&p.group()));
        let (of_color, of_material) = match property {
            Some(property) if model.color_groups.contains_key(&property.group()) => (Some(property), None),
            other => (None, other),
        };
        let value = |p: GroupEntry| model.color_groups[&p.group()].get(p.index as usize).cloned();
        let extruder = match body.surface.colors[place] {
            0 => usage.extruder.unwrap_or(FIRST_EXTRUDER),
            color => color,
        };
        let set = body.set_of.get(source as usize).filter(|set| **set >= 0);
        self.paint.push(i64::from(extruder));
        self.color.push(self.colors.number(of_color.map(value)));
        self.material.push(self.materials.number(of_material));
        self.set
            .push(self.set_numbers.number(set.map(|&set| (part, set))));
        self.object.push(self.objects.len() as i64);
    }

    /// Notes for the user on what was read and what was not.
    fn notes(&self, build: &Build) -> Vec<String> {
        let mut notes = Vec::new();
        for (role, names) in &self.left_out {
            notes.push(format!("left out as {}: {}", role.words(), list_names(names)));
        }
        if self.n_unnamed > 0 {
            notes.push(format!(
                "{} triangle(s) refer to a colour or material that is missing from the file; triangles with \
                 the same missing one are treated alike",
                self.n_unnamed
            ));
        }
        if self.has_textures {
            notes.push("the file's texture is not used".to_owned());
        }
        if !self.unknown.is_empty() {
            notes.push(format!("unsupported elements: {}", list_names(&self.unknown)));
        }
        if build.model.objects.is_empty() {
            notes.push("the file has no objects".to_owned());
        }
        notes
    }

    fn finish(self, build: &Build, notes: Vec<String>) -> Result<Loaded, ReadError> {
        let model = build.model;
        if self.mesh.triangles.is_empty() {
            if let Some((role, names)) = self.left_out.first_key_value() {
                return Err(ReadError::NothingPrinted {
                    what: role.words(),
                    names: list_names(names),
                });
            }
            return Err(ReadError::NoTriangles {
                format: Format::ThreeMf,
                n_points: model.objects.iter().map(|o| o.mesh.points.len()).sum(),
            });
        }
        let all = [
            (LabelSource::Paint, self.paint),
            (LabelSource::Color, self.color),
            (LabelSource::Material, self.material),
            (LabelSource::Set, self.set),
            (LabelSource::Object, self.object),
        ];
        let labellings = all.into_iter().filter(|(_, labels)| divides(labels));
        let empty_plates = build.empty_plates(&self.objects);
        Ok(Loaded {
            mesh: self.mesh,
            labellings: labellings
                .map(|(source, labels)| Labelling { source, labels })
                .collect(),
            file_face: self.file_face,
            format: Format::ThreeMf,
            unit_mm: Some(model.unit_mm),
            has_unit: model.has_unit,
            objects: self.objects,
            empty_plates,
            cutters: self.cutters,
            notes,
        })
    }
}

impl Build<'_> {
    /// Plates on which none of `objects` lies.
    fn empty_plates(&self, objects: &[FileObject]) -> Vec<FilePlate> {
        let taken: BTreeSet<u32> = objects
            .iter()
            .filter_map(|o| Some(o.plate.as_ref()?.number))
            .collect();
        let plates = self.settings.plates().iter();
        plates
            .filter(|plate| !taken.contains(&plate.number))
            .map(|plate| plate.of_file())
            .collect()
    }

    /// Returns the name of an item's object.
    fn item_name(&self, item: u32) -> Option<String> {
        let component = &self.model.items.get(item as usize)?.component;
        let part = self.find(&component.path, component.id).ok()?;
        self.bodies[part].usage().name.map(str::to_owned)
    }
}

/// Transforms the points of an object; an error if some are not finite.
fn transform_points(model: &Model, mesh: &TriMesh, transform: DAffine3) -> Result<Vec<Vec3>, ReadError> {
    let points: Vec<Vec3> = mesh
        .points
        .iter()
        .map(|&p| transform.transform_point3(p))
        .collect();
    if points.iter().all(|p| p.is_finite()) {
        return Ok(points);
    }
    Err(ReadError::Xml {
        part: model.parts.first().cloned().unwrap_or_default(),
        at: Place::Byte(0),
        reason: "moving an object takes its points out of all numbers".to_owned(),
    })
}

/// Mesh of some triangles, with only the points that they use.
fn part_of(points: &[Vec3], triangles: Vec<[u32; 3]>) -> TriMesh {
    TriMesh {
        points: points.to_vec(),
        triangles,
    }
    .without_unused_points()
}

fn append(mesh: &mut TriMesh, more: TriMesh) {
    let first = mesh.points.len() as u32;
    mesh.points.extend(more.points);
    mesh.triangles
        .extend(more.triangles.iter().map(|t| t.map(|v| v + first)));
}

/// Name of a part where it is used.
fn name_of(usage: Usage, object: &Object) -> String {
    usage
        .name
        .map_or_else(|| format!("object {}", object.id), |name| format!("\"{name}\""))
}
