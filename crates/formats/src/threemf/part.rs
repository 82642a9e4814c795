//! Reader of one model part of a package, element by element.

use std::collections::BTreeSet;

use glam::{DAffine3, DVec3};
use quick_xml::events::BytesStart;

use super::super::ReadError;
use super::extension;
use super::model::{Component, GroupEntry, Item, Model, Object};
use super::package;
use super::role::{Role, is_yes};
use super::xml::{Elements, Next, local, number};
use shellock_geom::Vec3;

/// Elements whose entries a triangle may have as its property.
const GROUPS: [&str; 5] = [
    "basematerials",
    "colorgroup",
    "texture2dgroup",
    "compositematerials",
    "multiproperties",
];
/// Elements of an object that are supported, or do not describe its shape.
const OBJECT_CHILDREN: [&str; 4] = ["mesh", "components", "metadatagroup", "settings"];

/// Reads the part `name` into `model`.
pub(super) fn read(name: &str, text: &str, model: &mut Model) -> Result<(), ReadError> {
    let number = model.parts.len() as u32 - 1;
    let mut reader = PartReader {
        elements: Elements::of(name, text),
        name,
        number,
        scale: 1.0,
        first_object: model.objects.len(),
        model,
        ids: BTreeSet::new(),
        open: OpenElements::default(),
    };
    let mut has_model = false;
    while let Some(next) = reader.elements.next()? {
        match next {
            Next::Begin(element) => {
                has_model |= reader.is_model(&element);
                reader.begin(&element)?;
            }
            Next::Text(text) => reader.take_text(&text),
            Next::End(name) => reader.end(&name),
            // A foreign shape is noted, and is an error if the object has no other.
            Next::Foreign(name) => reader.note_foreign(name),
        }
    }
    if has_model {
        reader.check_corners()
    } else {
        Err(reader.elements.error("there is no element \"model\""))
    }
}

/// Reader of one part into the model.
struct PartReader<'a, 'm> {
    elements: Elements<'a>,
    name: &'a str,
    number: u32,
    /// Length of the part's unit, in units of the root.
    scale: f64,
    model: &'m mut Model,
    /// Index of the model's first object from this part.
    first_object: usize,
    /// Ids of the objects so far.
    ids: BTreeSet<u32>,
    open: OpenElements,
}

/// Elements that are open at present.
#[derive(Default)]
struct OpenElements {
    /// Local names of all open elements.
    path: Vec<String>,
    color_group: Option<(u32, Vec<String>)>,
    object: Option<Object>,
    item: Option<Item>,
    /// Name of a `metadata` or key of a `setting` whose text is still to come.
    key: Option<String>,
    /// Number of triangle sets in the open object.
    n_sets: u32,
}

impl PartReader<'_, '_> {
    /// Returns true if `element` is the model of the part, its outermost element.
    fn is_model(&self, element: &BytesStart) -> bool {
        self.open.path.is_empty() && element.local_name().as_ref() == "model"
    }

    fn begin(&mut self, element: &BytesStart) -> Result<(), ReadError> {
        let name = element.local_name().as_ref().to_owned();
        if GROUPS.contains(&&name[..]) {
            let key = (self.number, self.id_of(element)?);
            self.model.groups.insert(key);
            if name == "texture2dgroup" {
                self.model.textures.insert(key);
            }
        }
        self.note_shape(&name);
        match &name[..] {
            "model" if self.is_model(element) => self.read_model(element)?,
            "colorgroup" => self.open.color_group = Some((self.id_of(element)?, Vec::new())),
            "color" => {
                let color = self.elements.string(element, "color")?;
                if let Some((_, colors)) = &mut self.open.color_group {
                    colors.push(color);
                }
            }
            "object" => self.open.object = Some(self.read_object(element)?),
            "item" => self.open.item = Some(self.read_item(element)?),
            "metadata" => {
                let key = self.elements.string(element, "name")?;
                self.open.key = Some(key).filter(|key| !self.elements.is_foreign(key));
            }
            "setting" => self.open.key = Some(self.elements.string(element, "key")?),
            _ => self.begin_in_object(&name, element)?,
        }
        self.open.path.push(name);
        Ok(())
    }

    /// Begins an element that is valid only within an object.
    fn begin_in_object(&mut self, name: &str, element: &BytesStart) -> Result<(), ReadError> {
        let Some(mut object) = self.open.object.take() else {
            return Ok(());
        };
        match name {
            "vertex" => object.mesh.points.push(self.read_vertex(element)?),
            "triangle" => self.read_triangle(element, &mut object)?,
            "component" => object.components.push(self.read_component(element)?),
            "triangleset" => self.open.n_sets += 1,
            "ref" | "refrange" if self.open.n_sets > 0 => self.read_reference(element, &mut object)?,
            _ => {}
        }
        self.open.object = Some(object);
        Ok(())
    }

    /// Records an unsupported shape of the open object, if `name` is the element of one.
    fn note_shape(&mut self, name: &str) {
        let is_child = self.open.path.last().is_some_and(|parent| parent == "object");
        let Some(object) = &mut self.open.object else {
            return;
        };
        match extension::of_shape(name) {
            Some(shape) => object.unread = object.unread.or(Some(shape)),
            None if is_child && !OBJECT_CHILDREN.contains(&name) => object.unknown = Some(name.to_owned()),
            None => {}
        }
    }

    /// Remembers an element of a namespace that is not read, where it stands in the open object itself.
    fn note_foreign(&mut self, name: String) {
        let is_child = self.open.path.last().is_some_and(|parent| parent == "object");
        if let Some(object) = self.open.object.as_mut().filter(|_| is_child) {
            object.unknown = Some(name);
        }
    }

    fn take_text(&mut self, text: &str) {
        let Some(key) = self.open.key.take() else {
            return;
        };
        let (role, extruder) = match (&mut self.open.object, &mut self.open.item) {
            (Some(object), _) => (&mut object.role, &mut object.extruder),
            (None, Some(item)) => (&mut item.role, &mut item.extruder),
            (None, None) => return,
        };
        match local(&key) {
            "extruder_nr" => *extruder = text.parse().ok().and_then(|n: u32| n.checked_add(1)),
            mark if is_yes(text) => *role = role.or(Role::of_cura(mark)),
            _ => {}
        }
    }

    fn end(&mut self, name: &str) {
        self.open.path.pop();
        match name {
            "colorgroup" => {
                let group = self.open.color_group.take();
                self.model
                    .color_groups
                    .extend(group.map(|(id, colors)| ((self.number, id), colors)));
            }
            "object" => {
                self.model.objects.extend(self.open.object.take());
                self.open.n_sets = 0;
            }
            "item" => self.model.items.extend(self.open.item.take()),
            "metadata" | "setting" => self.open.key = None,
            _ => {}
        }
    }

    fn read_model(&mut self, element: &BytesStart) -> Result<(), ReadError> {
        let namespaces = self.elements.namespaces();
        extension::check_requirements(&self.elements.string(element, "requiredextensions")?, &namespaces)?;
        let unit = self.elements.string(element, "unit")?;
        let unit_mm = match unit.as_str() {
            "micron" => 1e-3,
            "" | "millimeter" => 1.0,
            "centimeter" => 10.0,
            "inch" => 25.4,
            "foot" => 304.8,
            "meter" => 1000.0,
            _ => return Err(self.elements.error("the unit is none of those that 3MF has")),
        };
        if self.number == 0 {
            (self.model.unit_mm, self.model.has_unit) = (unit_mm, !unit.is_empty());
        } else if unit_mm != self.model.unit_mm {
            // The unit is an attribute of a part's own `model` and holds for all vertices and measurements in
            // it (core specification 1.3, section 3.4); no part takes over that of another, and without one
            // it is the millimetre.
            self.scale = unit_mm / self.model.unit_mm;
            self.model.other_units.insert(self.name.to_owned());
        }
        Ok(())
    }

    fn id_of(&self, element: &BytesStart) -> Result<u32, ReadError> {
        number("id", &self.elements.string(element, "id")?).map_err(|e| self.elements.error(e))
    }

    fn read_object(&mut self, element: &BytesStart) -> Result<Object, ReadError> {
        let mut object = Object {
            path: self.name.to_owned(),
            ..Object::default()
        };
        let (mut kind, mut is_sliced) = (String::new(), false);
        let (mut group, mut index) = (None, 0);
        self.elements.attributes(element, |name, value| {
            match name {
                "id" => object.id = number(name, value)?,
                "name" => value.clone_into(&mut object.name),
                "type" => kind = value.to_ascii_lowercase(),
                "pid" => group = Some(number(name, value)?),
                "pindex" => index = number(name, value)?,
                // The slices define the shape then. The mesh should be a stand-in only if `meshresolution`
                // says so, but files of the format's own authors have a box for a sphere and do not say so.
                "slicestackid" => is_sliced = true,
                _ => {}
            }
            Ok(())
        })?;
        let id = object.id;
        if !self.ids.insert(id) {
            return Err(self.elements.error(format!("there are two objects {id}")));
        }
        let role = Role::of_type(&kind);
        let role = role.ok_or_else(|| {
            self.elements
                .error(format!("object {id} is of the unknown type {kind:?}"))
        })?;
        object.role = Some(role).filter(|role| *role != Role::Body);
        object.unread = is_sliced.then_some(extension::SLICES);
        object.whole = group.map(|group| self.property(group, index));
        Ok(object)
    }

    fn property(&self, group: u32, index: u32) -> GroupEntry {
        let part = self.number;
        // The index is a texture coordinate, not a material.
        let is_texture = self.model.textures.contains(&(part, group));
        let index = if is_texture { 0 } else { index };
        GroupEntry { part, group, index }
    }

    fn read_vertex(&self, element: &BytesStart) -> Result<Vec3, ReadError> {
        let mut point = [f64::NAN; 3];
        self.elements.attributes(element, |name, value| {
            if let Some(axis) = ["x", "y", "z"].iter().position(|&axis| axis == name) {
                point[axis] = number(name, value)?;
            }
            Ok(())
        })?;
        let point = Vec3::from_array(point) * self.scale;
        if point.is_finite() {
            Ok(point)
        } else {
            Err(self.elements.error("a point lacks a finite x, y or z"))
        }
    }

    fn read_triangle(&self, element: &BytesStart, object: &mut Object) -> Result<(), ReadError> {
        let face = u32::try_from(object.mesh.triangles.len())
            .map_err(|_| self.elements.error("too many triangles"))?;
        let (mut corners, mut indices) = ([None; 3], [None; 3]);
        let mut group = None;
        self.elements.attributes(element, |name, value| {
            match name {
                "v1" => corners[0] = Some(number(name, value)?),
                "v2" => corners[1] = Some(number(name, value)?),
                "v3" => corners[2] = Some(number(name, value)?),
                "pid" => group = Some(number(name, value)?),
                "p1" => indices[0] = Some(number(name, value)?),
                "p2" => indices[1] = Some(number(name, value)?),
                "p3" => indices[2] = Some(number(name, value)?),
                "paint_color" | "mmu_segmentation" if !value.is_empty() => {
                    let from = object.paint_text.len();
                    object.paint_text.push_str(value);
                    object.paint.push((face, from..object.paint_text.len()));
                }
                _ => {}
            }
            Ok(())
        })?;
        let [Some(a), Some(b), Some(c)] = corners else {
            return Err(self.elements.error("a triangle lacks v1, v2 or v3"));
        };
        object.mesh.triangles.push([a, b, c]);
        // A file may have the same paint in both dialects.
        object.paint.dedup_by_key(|(face, _)| *face);
        let group = group.or(object.whole.map(|whole| whole.group));
        if let (Some(group), Some(index)) = (group, commonest(indices)) {
            object.properties.push((face, self.property(group, index)));
        }
        Ok(())
    }

    /// Adds the triangles of a `ref` or `refrange` to the open set.
    fn read_reference(&self, element: &BytesStart, object: &mut Object) -> Result<(), ReadError> {
        let (mut first, mut last) = (None, None);
        self.elements.attributes(element, |name, value| {
            match name {
                "index" => (first, last) = (Some(number(name, value)?), Some(number(name, value)?)),
                "startindex" => first = Some(number(name, value)?),
                "endindex" => last = Some(number(name, value)?),
                _ => {}
            }
            Ok(())
        })?;
        if let (Some(first), Some(last)) = (first, last) {
            object.sets.push((first, last, self.open.n_sets - 1));
        }
        Ok(())
    }

    fn read_component(&self, element: &BytesStart) -> Result<Component, ReadError> {
        let mut component = Component {
            path: self.name.to_owned(),
            id: 0,
            transform: DAffine3::IDENTITY,
        };
        self.elements.attributes(element, |name, value| {
            match name {
                "objectid" => component.id = number(name, value)?,
                "transform" => component.transform = transform(value)?,
                "path" => component.path = package::path(value),
                _ => {}
            }
            Ok(())
        })?;
        // What it moves is in the root's unit, too: its axes turn and stretch, which has no unit.
        component.transform.translation *= self.scale;
        Ok(component)
    }

    fn read_item(&self, element: &BytesStart) -> Result<Item, ReadError> {
        let printable = self.elements.string(element, "printable")?;
        Ok(Item {
            component: self.read_component(element)?,
            is_printed: printable.is_empty() || is_yes(&printable),
            role: None,
            extruder: None,
        })
    }

    /// Checks corners at the end of the part, as points may come after the triangles that use them.
    fn check_corners(&self) -> Result<(), ReadError> {
        for object in &self.model.objects[self.first_object..] {
            let n_points = object.mesh.points.len();
            let corners = object.mesh.triangles.as_flattened();
            if let Some(&corner) = corners.iter().find(|&&v| v as usize >= n_points) {
                let id = object.id;
                let reason =
                    format!("a triangle of object {id} uses point {corner}, but it has {n_points} points");
                return Err(self.elements.error(reason));
            }
        }
        Ok(())
    }
}

/// Index shared by two corners of a triangle. If all differ, or only the first corner has one, that of the
/// first.
fn commonest([a, b, c]: [Option<u32>; 3]) -> Option<u32> {
    if b.is_some() && b == c { b } else { a }
}

/// Parses twelve numbers: the images of the axes and of the origin.
fn transform(text: &str) -> Result<DAffine3, String> {
    let mut m = [0.0; 12];
    let mut words = text.split_ascii_whitespace();
    for entry in &mut m {
        *entry = number::<f64>("transform", words.next().unwrap_or_default())?;
    }
    if words.next().is_some() || !m.iter().all(|x| x.is_finite()) {
        return Err("transform is not twelve finite numbers".to_owned());
    }
    let axis = |i: usize| DVec3::new(m[i], m[i + 1], m[i + 2]);
    Ok(DAffine3::from_cols(axis(0), axis(3), axis(6), axis(9)))
}
