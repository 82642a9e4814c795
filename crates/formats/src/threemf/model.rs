//! The model of a package: its resources and what is built of them, from all of its model parts.

use std::collections::{BTreeMap, BTreeSet};

use glam::DAffine3;

use super::super::ReadError;
use super::package::Package;
use super::part;
use super::role::Role;
use shellock_geom::TriMesh;

/// Files of one package that are read as model parts at most.
const MAX_PARTS: usize = 1000;

/// All model parts of a package, read into one.
#[derive(Default)]
pub(super) struct Model {
    /// Length of the root's unit, in which all lengths are; mm.
    pub(super) unit_mm: f64,
    /// Whether the root states its unit; else it is the format's default.
    pub(super) unit_is_stated: bool,
    pub(super) objects: Vec<Object>,
    /// What is built.
    pub(super) items: Vec<Item>,
    /// Colours of each colour group, by part and id.
    pub(super) color_groups: BTreeMap<(u32, u32), Vec<String>>,
    /// All that triangles may have as a property, by part and id.
    pub(super) groups: BTreeSet<(u32, u32)>,
    /// Those of them that are coordinates in a picture, by part and id.
    pub(super) textures: BTreeSet<(u32, u32)>,
    /// Names of parts in another unit than the root's.
    pub(super) converted: BTreeSet<String>,
    /// Names of the parts read, in order; the root is the first.
    pub(super) parts: Vec<String>,
}

/// A mesh, or objects put together.
#[derive(Default)]
pub(super) struct Object {
    pub(super) id: u32,
    /// The model part it stands in.
    pub(super) path: String,
    /// What the file calls it; often nothing.
    pub(super) name: String,
    /// What its type and Cura's marks make of it, where that is no body.
    pub(super) role: Option<Role>,
    /// The extruder that Cura prints it with, from 1.
    pub(super) extruder: Option<u32>,
    pub(super) mesh: TriMesh,
    /// Paint by triangle, ascending: where its code begins and ends in `paint_text`.
    pub(super) paint: Vec<(u32, std::ops::Range<usize>)>,
    pub(super) paint_text: String,
    pub(super) components: Vec<Component>,
    /// The property of all triangles without one of their own.
    pub(super) whole: Option<Property>,
    /// By triangle, ascending.
    pub(super) properties: Vec<(u32, Property)>,
    /// Named sets of triangles: first and last triangle, and the set, from 0.
    pub(super) sets: Vec<(u32, u32, u32)>,
    /// The extension that gives it a shape which is not read.
    pub(super) unread: Option<&'static str>,
    /// An element in it that no specification names.
    pub(super) unknown: Option<String>,
}

/// An object in its place.
pub(super) struct Component {
    pub(super) path: String,
    pub(super) id: u32,
    pub(super) placed: DAffine3,
}

/// An object that is built.
pub(super) struct Item {
    pub(super) component: Component,
    /// Whether the slicer is to print it.
    pub(super) is_printed: bool,
    /// What Cura's marks make of it, where that is no body.
    pub(super) role: Option<Role>,
    /// The extruder that Cura prints it with, from 1.
    pub(super) extruder: Option<u32>,
}

/// An entry of a material or colour group.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Property {
    pub(super) part: u32,
    pub(super) group: u32,
    pub(super) index: u32,
}

impl Property {
    /// Part and id of the group.
    pub(super) fn group(self) -> (u32, u32) {
        (self.part, self.group)
    }
}

impl Object {
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
    /// Reads the root part and all parts that it needs.
    pub(super) fn read(root: &str, package: &mut Package) -> Result<Self, ReadError> {
        let mut model = Self {
            unit_mm: 1.0,
            ..Self::default()
        };
        model.read_part(root, package)?;
        while let Some(next) = model.next_part() {
            if model.parts.len() == MAX_PARTS {
                return Err(ReadError::TooManyCopies {
                    what: "a package of so many files",
                    limit: MAX_PARTS as u64,
                });
            }
            let items = std::mem::take(&mut model.items);
            model.read_part(&next, package)?;
            // Only the root says what is built.
            model.items = items;
        }
        Ok(model)
    }

    /// Whether the file has that colour, or the group of that material.
    pub(super) fn has(&self, property: Property) -> bool {
        let group = property.group();
        let n_colors = self.color_groups.get(&group).map(Vec::len);
        self.groups.contains(&group) && n_colors.is_none_or(|n| (property.index as usize) < n)
    }

    /// A part that a component or an item names and that is still to be read.
    fn next_part(&self) -> Option<String> {
        let named: BTreeSet<&String> = self
            .objects
            .iter()
            .flat_map(|o| &o.components)
            .chain(self.items.iter().map(|item| &item.component))
            .map(|c| &c.path)
            .collect();
        named.into_iter().find(|path| !self.parts.contains(path)).cloned()
    }

    fn read_part(&mut self, name: &str, package: &mut Package) -> Result<(), ReadError> {
        let missing = || ReadError::MissingPart {
            kind: "the file",
            id: name.to_owned(),
        };
        let text = package.text(name)?.ok_or_else(missing)?;
        self.parts.push(name.to_owned());
        part::read(name, &text, self)
    }
}
