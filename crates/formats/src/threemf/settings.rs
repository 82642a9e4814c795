//! Slicers' settings beside the model: names, plates, extruders, and volumes that are no part of the model.

use std::collections::BTreeMap;

use quick_xml::events::BytesStart;

use super::super::{FilePlate, ReadError};
use super::package::Package;
use super::role::{Role, Usage};
use super::xml::{Elements, Next, number};

/// Endings of the settings files of PrusaSlicer and SuperSlicer, and of Bambu Studio and OrcaSlicer.
const FILE_ENDS: [&str; 2] = ["_model.config", "model_settings.config"];
/// Largest mean number of volumes per triangle; further ones are hostile and are skipped.
const MAX_OVERLAP: usize = 8;

/// All settings of slicers.
#[derive(Default)]
pub(super) struct Settings {
    /// Settings by the ids of the root part's objects.
    objects: BTreeMap<u32, ObjectSettings>,
    /// Plates in the order of the file.
    plates: Vec<Plate>,
    /// Plate of an object's build item, by the object's id and the item's number among its own.
    plate_of: BTreeMap<(u32, u32), usize>,
}

/// Settings of an object of the root part.
#[derive(Default)]
pub(super) struct ObjectSettings {
    pub(super) name: Option<String>,
    /// Number of the extruder, from 1; `None` if not given.
    pub(super) extruder: Option<u32>,
    volumes: Vec<Volume>,
}

/// A part of an object.
struct Volume {
    of: Of,
    name: Option<String>,
    role: Role,
    extruder: Option<u32>,
}

/// Content of a volume.
#[derive(Clone, Copy)]
enum Of {
    /// Triangles of the object itself, first and last.
    Faces(u32, u32),
    /// The component that refers to the object of this id, or the object itself.
    Part(u32),
}

/// A plate of the slicer's project.
#[derive(Default)]
pub(super) struct Plate {
    pub(super) number: u32,
    pub(super) name: Option<String>,
}

/// Elements that are open at present.
#[derive(Default)]
struct OpenSettings {
    object: Option<u32>,
    in_volume: bool,
    plate: Option<Plate>,
    /// Object and item of a plate's `model_instance`.
    instance: Option<(Option<u32>, u32)>,
}

impl Settings {
    /// Reads the settings in the package; empty if it has none, as a plain 3MF does.
    ///
    /// A settings file that cannot be parsed is an error: the roles after the fault are unknown, so a
    /// negative volume could be read as a part of the model.
    pub(super) fn read(package: &mut Package) -> Result<Self, ReadError> {
        let mut settings = Self::default();
        for name in package.names(|name| FILE_ENDS.iter().any(|end| name.ends_with(end))) {
            let text = package.text(&name)?.unwrap_or_default();
            let part = package.archive_name(&name);
            settings.read_file(&part, &text).map_err(|error| match error {
                ReadError::Xml { part, at, reason } => ReadError::Settings { part, at, reason },
                other => other,
            })?;
        }
        Ok(settings)
    }

    pub(super) fn object(&self, id: u32) -> Option<&ObjectSettings> {
        self.objects.get(&id)
    }

    /// Returns the plate of the `instance`-th item of an object.
    pub(super) fn plate(&self, object: u32, instance: u32) -> Option<&Plate> {
        self.plate_of
            .get(&(object, instance))
            .and_then(|&plate| self.plates.get(plate))
    }

    /// All plates of the project, in the order of the file.
    pub(super) fn plates(&self) -> &[Plate] {
        &self.plates
    }

    fn read_file(&mut self, name: &str, text: &str) -> Result<(), ReadError> {
        let mut elements = Elements::of(name, text);
        let mut open = OpenSettings::default();
        while let Some(next) = elements.next()? {
            match next {
                Next::Begin(element) => self.begin(&elements, &element, &mut open)?,
                Next::Text(_) | Next::Foreign(_) => {}
                Next::End(name) => self.end(&name, &mut open),
            }
        }
        Ok(())
    }

    fn begin(
        &mut self,
        elements: &Elements,
        element: &BytesStart,
        open: &mut OpenSettings,
    ) -> Result<(), ReadError> {
        let attribute = |name| attribute::<u32>(elements, element, name);
        match element.local_name().as_ref() {
            "object" => {
                open.object = attribute("id")?;
                if let Some(id) = open.object {
                    self.objects.entry(id).or_default();
                }
            }
            // A range of the object's triangles.
            "volume" => {
                let first = attribute("firstid")?.unwrap_or(0);
                let last = attribute("lastid")?.unwrap_or(u32::MAX);
                self.begin_volume(Of::Faces(first, last), Role::Body, open);
            }
            // An object of its own, placed in this one.
            "part" => {
                let role = Role::of_volume(&elements.string(element, "subtype")?);
                if let Some(id) = attribute("id")? {
                    self.begin_volume(Of::Part(id), role, open);
                }
            }
            "plate" => open.plate = Some(Plate::default()),
            "model_instance" => open.instance = Some((None, 0)),
            "metadata" => self.note(elements, element, open)?,
            _ => {}
        }
        Ok(())
    }

    fn begin_volume(&mut self, of: Of, role: Role, open: &mut OpenSettings) {
        let Some(object) = open.object.and_then(|id| self.objects.get_mut(&id)) else {
            return;
        };
        object.volumes.push(Volume {
            of,
            name: None,
            role,
            extruder: None,
        });
        open.in_volume = true;
    }

    fn end(&mut self, name: &str, open: &mut OpenSettings) {
        match name {
            "object" => (open.object, open.in_volume) = (None, false),
            "volume" | "part" => open.in_volume = false,
            "plate" => self.plates.extend(open.plate.take()),
            "model_instance" => {
                if let (Some(_), Some((Some(object), instance))) = (&open.plate, open.instance.take()) {
                    self.plate_of.insert((object, instance), self.plates.len());
                }
            }
            _ => {}
        }
    }

    fn note(
        &mut self,
        elements: &Elements,
        element: &BytesStart,
        open: &mut OpenSettings,
    ) -> Result<(), ReadError> {
        let (key, value) = key_and_value(elements, element)?;
        if let Some(plate) = &mut open.plate {
            plate.note(&key, &value, &mut open.instance);
            return Ok(());
        }
        let Some(object) = open.object.and_then(|id| self.objects.get_mut(&id)) else {
            return Ok(());
        };
        // 0 stands for the extruder of the object.
        let extruder = || value.parse().ok().filter(|&e: &u32| e > 0);
        let name = || Some(value.clone()).filter(|name| !name.is_empty());
        match (key.as_str(), object.volumes.last_mut().filter(|_| open.in_volume)) {
            ("extruder", Some(volume)) => volume.extruder = extruder(),
            ("extruder", None) => object.extruder = extruder(),
            ("name", Some(volume)) => volume.name = name(),
            ("name", None) => object.name = name(),
            ("volume_type", Some(volume)) => volume.role = Role::of_volume(&value),
            // Used before volumes had types.
            ("modifier", Some(volume)) if value == "1" => volume.role = Role::Modifier,
            _ => {}
        }
        Ok(())
    }
}

impl Plate {
    /// The plate as those who choose one know it.
    pub(super) fn of_file(&self) -> FilePlate {
        FilePlate {
            number: self.number,
            name: self.name.clone(),
        }
    }

    fn note(&mut self, key: &str, value: &str, instance: &mut Option<(Option<u32>, u32)>) {
        match (key, instance) {
            ("plater_id", _) => self.number = value.parse().unwrap_or(0),
            ("plater_name", _) => self.name = Some(value.to_owned()).filter(|name| !name.is_empty()),
            ("object_id", Some((object, _))) => *object = value.parse().ok(),
            ("instance_id", Some((_, instance))) => *instance = value.parse().unwrap_or(0),
            _ => {}
        }
    }
}

impl ObjectSettings {
    /// Returns the usage of each of an object's components; `ids` are those of the objects that they refer
    /// to.
    ///
    /// Ids start anew in each file of a package, so several components may have the same one. Volumes of that
    /// id belong to them in order.
    pub(super) fn of_components(&self, ids: &[u32]) -> Vec<Usage<'_>> {
        let mut usages = vec![Usage::PLAIN; ids.len()];
        let mut places: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (place, &id) in ids.iter().enumerate().rev() {
            places.entry(id).or_default().push(place);
        }
        for volume in &self.volumes {
            let Of::Part(id) = volume.of else { continue };
            if let Some(place) = places.get_mut(&id).and_then(Vec::pop) {
                usages[place] = volume.usage();
            }
        }
        usages
    }

    /// Returns the volume of each of the object's own `n_triangles` triangles, for [`Self::usage`]; empty if
    /// no volume has any.
    pub(super) fn of_triangles(&self, id: u32, n_triangles: usize) -> Vec<u16> {
        let mut volume_of = Vec::new();
        // Volumes of an object share no triangles, except with one that is the object itself.
        let mut work_left = MAX_OVERLAP * n_triangles;
        for (number, volume) in (1_u16..=u16::MAX).zip(&self.volumes) {
            let (first, last) = match volume.of {
                Of::Faces(first, last) => (first, last),
                Of::Part(part) if part == id => (0, u32::MAX),
                Of::Part(_) => continue,
            };
            let end = (last as usize).saturating_add(1).min(n_triangles);
            let begin = (first as usize).min(end);
            let Some(left) = work_left.checked_sub(end - begin) else {
                break;
            };
            work_left = left;
            volume_of.resize(n_triangles, 0);
            volume_of[begin..end].fill(number);
        }
        volume_of
    }

    /// Returns the usage of a volume of [`Self::of_triangles`].
    pub(super) fn usage(&self, volume: u16) -> Usage<'_> {
        let place = usize::from(volume).checked_sub(1);
        place
            .and_then(|place| self.volumes.get(place))
            .map_or(Usage::PLAIN, Volume::usage)
    }
}

impl Volume {
    fn usage(&self) -> Usage<'_> {
        Usage {
            role: self.role,
            extruder: self.extruder,
            name: self.name.as_deref(),
            ..Usage::PLAIN
        }
    }
}

/// The attribute of this name as a number; `None` where it is not there.
fn attribute<T: std::str::FromStr>(
    elements: &Elements,
    element: &BytesStart,
    wanted: &str,
) -> Result<Option<T>, ReadError> {
    let text = elements.string(element, wanted)?;
    if text.is_empty() {
        return Ok(None);
    }
    number(wanted, &text).map(Some).map_err(|e| elements.error(e))
}

/// Key and value of a `metadata`.
fn key_and_value(elements: &Elements, element: &BytesStart) -> Result<(String, String), ReadError> {
    let (mut key, mut value) = (String::new(), String::new());
    let all = elements.attributes(element, |name, text| {
        match name {
            "key" => text.clone_into(&mut key),
            "value" => text.clone_into(&mut value),
            _ => {}
        }
        Ok(())
    });
    // Some writers forget that quotes in a name need a code. A name is no loss, anything else may be a role.
    if !matches!(key.as_str(), "name" | "plater_name") {
        all?;
    }
    Ok((key, value))
}
