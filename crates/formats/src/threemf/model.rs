//! A model part of a package: its resources and what is built of them.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DVec3};
use quick_xml::events::BytesStart;

use super::super::ReadError;
use super::Package;
use super::xml::{Elements, Next, number};
use shellock_geom::{TriMesh, Vec3};

/// Files of one package that are read as model parts at most.
const MAX_PARTS: usize = 1000;

/// Elements whose entries a triangle may have as its property.
const GROUPS: [&[u8]; 5] = [
    b"basematerials",
    b"colorgroup",
    b"texture2dgroup",
    b"compositematerials",
    b"multiproperties",
];

/// All model parts of a package, read into one.
pub(super) struct Model {
    /// mm.
    pub(super) unit_mm: f64,
    pub(super) objects: Vec<Object>,
    /// What is built.
    pub(super) items: Vec<Component>,
    /// What the slicer was told not to print.
    switched_off: Vec<Component>,
    /// Colours of each colour group, by part and id.
    pub(super) color_groups: BTreeMap<(u32, u32), Vec<String>>,
    /// All that triangles may have as a property, by part and id.
    groups: BTreeSet<(u32, u32)>,
    pub(super) notes: Vec<String>,
    /// Names of the parts read, in order; the root is the first.
    parts: Vec<String>,
}

/// A mesh, or objects put together.
#[derive(Default)]
pub(super) struct Object {
    pub(super) id: u32,
    /// The model part it stands in.
    path: String,
    pub(super) mesh: TriMesh,
    /// Paint by triangle, ascending: where its code begins and ends in `paint_text`.
    paint: Vec<(u32, std::ops::Range<usize>)>,
    paint_text: String,
    pub(super) components: Vec<Component>,
    /// That of all triangles without one of their own.
    whole: Option<Property>,
    /// By triangle, ascending.
    properties: Vec<(u32, Property)>,
}

/// An object in its place.
pub(super) struct Component {
    pub(super) path: String,
    pub(super) id: u32,
    pub(super) placed: DAffine3,
}

/// An entry of a material or colour group.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Property {
    part: u32,
    group: u32,
    pub(super) index: u32,
}

impl Property {
    /// Part and id of the group.
    pub(super) fn group(self) -> (u32, u32) {
        (self.part, self.group)
    }
}

impl Object {
    /// What components and items name it by.
    pub(super) fn key(&self) -> (&str, u32) {
        (&self.path, self.id)
    }

    pub(super) fn paint_codes(&self) -> Vec<(u32, &str)> {
        self.paint
            .iter()
            .map(|(face, range)| (*face, &self.paint_text[range.clone()]))
            .collect()
    }

    /// The material or colour of a triangle.
    pub(super) fn property(&self, face: u32) -> Option<Property> {
        let own = self.properties.binary_search_by_key(&face, |(f, _)| *f);
        own.map_or(self.whole, |at| Some(self.properties[at].1))
    }
}

impl Model {
    /// Reads the root part.
    pub(super) fn read(name: &str, package: &mut Package) -> Result<Self, ReadError> {
        let mut model = Self {
            unit_mm: 1.0,
            objects: Vec::new(),
            items: Vec::new(),
            switched_off: Vec::new(),
            color_groups: BTreeMap::new(),
            groups: BTreeSet::new(),
            notes: Vec::new(),
            parts: Vec::new(),
        };
        model.read_part(name.trim_start_matches('/'), package)?;
        let off = std::mem::take(&mut model.switched_off);
        if model.items.is_empty() {
            model.items = off;
        } else if !off.is_empty() {
            model.notes.push(format!(
                "objects that the slicer is not to print: {}; left out",
                off.len()
            ));
        }
        Ok(model)
    }

    /// Whether the file has that colour, or the group of that material.
    pub(super) fn has(&self, property: Property) -> bool {
        let group = property.group();
        let n_colors = self.color_groups.get(&group).map(Vec::len);
        self.groups.contains(&group) && n_colors.is_none_or(|n| (property.index as usize) < n)
    }

    /// Reads the parts that components and items name, and those that they name.
    pub(super) fn read_other_parts(&mut self, package: &mut Package) -> Result<(), ReadError> {
        loop {
            let named: BTreeSet<&String> = self
                .objects
                .iter()
                .flat_map(|o| &o.components)
                .chain(&self.items)
                .map(|c| &c.path)
                .collect();
            let Some(next) = named.into_iter().find(|path| !self.parts.contains(path)).cloned() else {
                return Ok(());
            };
            if self.parts.len() == MAX_PARTS {
                return Err(ReadError::TooManyCopies {
                    what: "a package of so many files",
                    limit: MAX_PARTS as u64,
                });
            }
            let (items, unit_mm) = (std::mem::take(&mut self.items), self.unit_mm);
            self.read_part(&next, package)?;
            // Only the root says what is built, and in which unit.
            (self.items, self.unit_mm) = (items, unit_mm);
        }
    }

    fn read_part(&mut self, name: &str, package: &mut Package) -> Result<(), ReadError> {
        let missing = || ReadError::MissingPart {
            kind: "the file",
            id: name.to_owned(),
        };
        let text = package.text(name)?.ok_or_else(missing)?;
        self.parts.push(name.to_owned());
        let (elements, number) = (Elements::of(name, &text), self.parts.len() as u32 - 1);
        PartReader {
            elements,
            name,
            number,
            model: self,
            ids: BTreeSet::new(),
        }
        .read()
    }
}

/// Reads one part into the model.
struct PartReader<'a, 'm> {
    elements: Elements<'a>,
    name: &'a str,
    number: u32,
    model: &'m mut Model,
    /// Of the objects so far.
    ids: BTreeSet<u32>,
}

impl PartReader<'_, '_> {
    fn read(&mut self) -> Result<(), ReadError> {
        let mut has_model = false;
        // The colour group and the object that are open.
        let (mut group, mut object): (Option<(u32, Vec<String>)>, Option<Object>) = (None, None);
        while let Some(next) = self.elements.next()? {
            let element = match next {
                Next::Begin(element) => element,
                Next::End(name) => {
                    match &name[..] {
                        b"colorgroup" => {
                            self.model
                                .color_groups
                                .extend(group.take().map(|(id, c)| ((self.number, id), c)));
                        }
                        b"object" => self.model.objects.extend(object.take()),
                        _ => {}
                    }
                    continue;
                }
            };
            if GROUPS.contains(&element.local_name().as_ref().as_bytes()) {
                let id = self.id_of(&element)?;
                self.model.groups.insert((self.number, id));
            }
            match (element.local_name().as_ref().as_bytes(), &mut object, &mut group) {
                (b"model", ..) => {
                    has_model = true;
                    self.read_unit(&element)?;
                }
                (b"colorgroup", ..) => group = Some((self.id_of(&element)?, Vec::new())),
                (b"color", _, Some((_, colors))) => colors.push(self.string(&element, "color")?),
                (b"object", ..) => object = self.read_object(&element)?,
                (b"vertex", Some(object), _) => object.mesh.points.push(self.read_vertex(&element)?),
                (b"triangle", Some(object), _) => self.read_triangle(&element, object)?,
                (b"component", Some(object), _) => object.components.push(self.read_component(&element)?),
                (b"item", None, _) => {
                    let item = self.read_component(&element)?;
                    let is_off = self.string(&element, "printable")? == "0";
                    if is_off {
                        &mut self.model.switched_off
                    } else {
                        &mut self.model.items
                    }
                    .push(item);
                }
                _ => {}
            }
        }
        if has_model {
            self.check_corners()
        } else {
            Err(self.elements.error("there is no element \"model\""))
        }
    }

    fn read_unit(&mut self, element: &BytesStart) -> Result<(), ReadError> {
        let unit = self.string(element, "unit")?;
        self.model.unit_mm = match unit.as_str() {
            "micron" => 1e-3,
            "" | "millimeter" => 1.0,
            "centimeter" => 10.0,
            "inch" => 25.4,
            "foot" => 304.8,
            "meter" => 1000.0,
            _ => return Err(self.elements.error("the unit is none of those that 3MF has")),
        };
        Ok(())
    }

    /// An attribute as text; nothing where it is not there.
    fn string(&self, element: &BytesStart, wanted: &str) -> Result<String, ReadError> {
        let mut found = String::new();
        self.elements.attributes(element, |name, value| {
            if name == wanted {
                value.clone_into(&mut found);
            }
            Ok(())
        })?;
        Ok(found)
    }

    fn id_of(&self, element: &BytesStart) -> Result<u32, ReadError> {
        number("id", &self.string(element, "id")?).map_err(|e| self.elements.error(e))
    }

    /// The object that begins; `None` for supports, which are no part of the model.
    fn read_object(&mut self, element: &BytesStart) -> Result<Option<Object>, ReadError> {
        let (mut object, mut kind) = (
            Object {
                path: self.name.to_owned(),
                ..Object::default()
            },
            String::new(),
        );
        let (mut group, mut index) = (None, 0);
        self.elements.attributes(element, |name, value| {
            match name {
                "id" => object.id = number(name, value)?,
                "type" => value.clone_into(&mut kind),
                "pid" => group = Some(number(name, value)?),
                "pindex" => index = number(name, value)?,
                _ => {}
            }
            Ok(())
        })?;
        if !self.ids.insert(object.id) {
            return Err(self
                .elements
                .error(format!("there are two objects {}", object.id)));
        }
        object.whole = group.map(|group| Property {
            part: self.number,
            group,
            index,
        });
        if kind == "support" || kind == "solidsupport" {
            self.model
                .notes
                .push(format!("object {} is a support; left out", object.id));
            // It stays as an object without triangles, since the build may name it.
            self.model.objects.push(object);
            return Ok(None);
        }
        Ok(Some(object))
    }

    fn read_vertex(&self, element: &BytesStart) -> Result<Vec3, ReadError> {
        let mut point = [f64::NAN; 3];
        self.elements.attributes(element, |name, value| {
            if let Some(axis) = ["x", "y", "z"].iter().position(|&axis| axis == name) {
                point[axis] = number(name, value)?;
            }
            Ok(())
        })?;
        let point = Vec3::from_array(point);
        if point.is_finite() {
            Ok(point)
        } else {
            Err(self.elements.error("a point lacks a finite x, y or z"))
        }
    }

    fn read_triangle(&self, element: &BytesStart, object: &mut Object) -> Result<(), ReadError> {
        let face = u32::try_from(object.mesh.triangles.len())
            .map_err(|_| self.elements.error("too many triangles"))?;
        let mut corners = [None; 3];
        let (mut group, mut index) = (None, None);
        self.elements.attributes(element, |name, value| {
            match name {
                "v1" => corners[0] = Some(number(name, value)?),
                "v2" => corners[1] = Some(number(name, value)?),
                "v3" => corners[2] = Some(number(name, value)?),
                "pid" => group = Some(number(name, value)?),
                "p1" => index = Some(number(name, value)?),
                "paint_color" | "slic3rpe:mmu_segmentation" if !value.is_empty() => {
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
        if let (Some(group), Some(index)) = (group, index) {
            object.properties.push((
                face,
                Property {
                    part: self.number,
                    group,
                    index,
                },
            ));
        }
        Ok(())
    }

    fn read_component(&self, element: &BytesStart) -> Result<Component, ReadError> {
        let mut component = Component {
            path: self.name.to_owned(),
            id: 0,
            placed: DAffine3::IDENTITY,
        };
        self.elements.attributes(element, |name, value| {
            match name {
                "objectid" => component.id = number(name, value)?,
                "transform" => component.placed = transform(value)?,
                // The prefix of the production extension is the file's choice.
                _ if name.ends_with(":path") => value.trim_start_matches('/').clone_into(&mut component.path),
                _ => {}
            }
            Ok(())
        })?;
        Ok(component)
    }

    /// Points may come after the triangles that name them.
    fn check_corners(&self) -> Result<(), ReadError> {
        for object in self.model.objects.iter().filter(|o| o.path == self.name) {
            let n_points = object.mesh.points.len();
            if let Some(&corner) = object
                .mesh
                .triangles
                .as_flattened()
                .iter()
                .find(|&&v| v as usize >= n_points)
            {
                let id = object.id;
                let reason =
                    format!("a triangle of object {id} uses point {corner}, but it has {n_points} points");
                return Err(self.elements.error(reason));
            }
        }
        Ok(())
    }
}

/// Twelve numbers: the images of the axes and of the origin.
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
