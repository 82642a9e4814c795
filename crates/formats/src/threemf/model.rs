//! The model of a package: its resources and its build, from all of its model parts.

use std::collections::{BTreeMap, BTreeSet};

use glam::DAffine3;

use super::role::Role;
use shellock_geom::TriMesh;

/// All model parts of a package, combined.
#[derive(Default)]
pub(super) struct Model {
    /// Length of the root's unit, in which all lengths are; mm.
    pub(super) unit_mm: f64,
    /// True if the root states its unit. Otherwise the unit is the format's default.
    pub(super) has_unit: bool,
    pub(super) objects: Vec<Object>,
    /// Items of the build.
    pub(super) items: Vec<Item>,
    /// Colours of each colour group, by part and id.
    pub(super) color_groups: BTreeMap<(u32, u32), Vec<String>>,
    /// Groups whose entries triangles may have as a property, by part and id.
    pub(super) groups: BTreeSet<(u32, u32)>,
    /// Groups that are texture coordinates, by part and id.
    pub(super) textures: BTreeSet<(u32, u32)>,
    /// Names of parts in another unit than the root's.
    pub(super) other_units: BTreeSet<String>,
    /// Names of the parts read, in order; the root is the first.
    pub(super) parts: Vec<String>,
}

/// A mesh, or an object composed of others.
#[derive(Default)]
pub(super) struct Object {
    pub(super) id: u32,
    /// Model part that contains the object.
    pub(super) path: String,
    /// Name in the file, often empty.
    pub(super) name: String,
    /// Role given by its type and Cura's marks; `None` for a body.
    pub(super) role: Option<Role>,
    /// Extruder that Cura assigns to it, from 1.
    pub(super) extruder: Option<u32>,
    pub(super) mesh: TriMesh,
    /// Paint by triangle, ascending: range of its code in `paint_text`.
    pub(super) paint: Vec<(u32, std::ops::Range<usize>)>,
    pub(super) paint_text: String,
    pub(super) components: Vec<Component>,
    /// Property of all triangles without one of their own.
    pub(super) whole: Option<GroupEntry>,
    /// Property by triangle, ascending.
    pub(super) properties: Vec<(u32, GroupEntry)>,
    /// Named sets of triangles: first and last triangle, and the set, from 0.
    pub(super) sets: Vec<(u32, u32, u32)>,
    /// Extension that gives the object an unsupported shape.
    pub(super) unread: Option<&'static str>,
    /// An element of the object that no specification names.
    pub(super) unknown: Option<String>,
}

/// An object with its transform.
pub(super) struct Component {
    pub(super) path: String,
    pub(super) id: u32,
    pub(super) transform: DAffine3,
}

/// An object of the build.
pub(super) struct Item {
    pub(super) component: Component,
    /// True if the slicer is to print it.
    pub(super) is_printed: bool,
    /// Role given by Cura's marks; `None` for a body.
    pub(super) role: Option<Role>,
    /// Extruder that Cura assigns to it, from 1.
    pub(super) extruder: Option<u32>,
}

/// An entry of a material or colour group.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct GroupEntry {
    pub(super) part: u32,
    pub(super) group: u32,
    pub(super) index: u32,
}

impl GroupEntry {
    /// Returns the part and the id of the group.
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

    /// Returns the material or colour of a triangle.
    pub(super) fn property(&self, face: u32) -> Option<GroupEntry> {
        let own = self.properties.binary_search_by_key(&face, |(f, _)| *f);
        own.map_or(self.whole, |at| Some(self.properties[at].1))
    }
}

impl Model {
    /// Returns true if the file has the colour, or the group of the material.
    pub(super) fn has(&self, property: GroupEntry) -> bool {
        let group = property.group();
        let n_colors = self.color_groups.get(&group).map(Vec::len);
        self.groups.contains(&group) && n_colors.is_none_or(|n| (property.index as usize) < n)
    }
}
