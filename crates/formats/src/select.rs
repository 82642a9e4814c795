//! Selection of one object, or one plate, of a file that has several.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::polygons::divides;
use super::{FileObject, FilePlate, Format, LabelSource, Loaded, ReadError};

/// Selected part of a file; the default selects all of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Name of an object, or of a part of one, in upper or lower case.
    pub object: Option<String>,
    /// Number of a plate of a slicer's project, from 1, or its name.
    pub plate: Option<String>,
}

impl FileObject {
    /// Title for messages: its name, else its number from 1.
    pub fn title(&self) -> String {
        self.name
            .clone()
            .unwrap_or_else(|| format!("object {}", self.item + 1))
    }

    fn is_called(&self, wanted: &str) -> bool {
        let is_same = |name: &str| name.to_lowercase() == wanted.trim().to_lowercase();
        is_same(&self.title()) || self.part.as_deref().is_some_and(is_same)
    }
}

/// Names of an object and its parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Titles {
    /// Name of the object, or "object 2".
    pub object: String,
    /// Names of its parts that differ from the object's name, each once.
    pub parts: Vec<String>,
    /// Number of the plate on which the object lies, from 1.
    pub plate: Option<u32>,
}

impl fmt::Display for Titles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{}\"", self.object)?;
        if self.parts.is_empty() {
            return Ok(());
        }
        let parts = self.parts.iter().map(|part| format!("\"{part}\""));
        write!(f, " with the parts {}", list_names(parts))
    }
}

/// Returns the names of objects and their parts, in order.
fn titles(objects: &[FileObject]) -> Vec<Titles> {
    let mut all: Vec<Titles> = Vec::new();
    let (mut last_item, mut known) = (None, BTreeSet::new());
    for object in objects {
        if last_item.replace(object.item) != Some(object.item) {
            known = BTreeSet::from([object.title()]);
            all.push(Titles {
                object: object.title(),
                parts: Vec::new(),
                plate: object.plate.as_ref().map(|plate| plate.number),
            });
        }
        let part = object.part.clone().filter(|part| known.insert(part.clone()));
        if let Some(titles) = all.last_mut() {
            titles.parts.extend(part);
        }
    }
    all
}

/// The part of `loaded` that is wanted.
pub(super) fn select(mut loaded: Loaded, selection: &Selection) -> Result<Loaded, ReadError> {
    let n = loaded.objects.len();
    let mut is_wanted = vec![true; n];
    if let Some(wanted) = &selection.plate {
        is_wanted = on_plate(&loaded, wanted)?;
    }
    if let Some(wanted) = &selection.object {
        let within = loaded.objects.iter().zip(&is_wanted).filter(|(_, is_in)| **is_in);
        let there: Vec<FileObject> = within.map(|(object, _)| object.clone()).collect();
        for (object, is_wanted) in loaded.objects.iter().zip(&mut is_wanted) {
            *is_wanted &= object.is_called(wanted);
        }
        if !is_wanted.contains(&true) {
            let plate = selection.plate.as_ref();
            return Err(ReadError::NoSuchPart {
                within: plate.map_or_else(
                    || "the file".to_owned(),
                    |plate| format!("plate {}", plate.trim()),
                ),
                what: "object",
                name: wanted.clone(),
                has: object_names(&there),
            });
        }
    }
    let n_wanted = is_wanted.iter().filter(|wanted| **wanted).count();
    let is_chosen = *selection != Selection::default();
    if is_chosen && n > 1 {
        let were = if n_wanted == 1 { "was" } else { "were" };
        let note = format!("{n_wanted} of {n} objects or parts {were} used");
        if n_wanted < n {
            loaded = keep(loaded, &is_wanted);
        }
        loaded.notes.push(note);
    } else if n > 1 && loaded.format == Format::ThreeMf {
        let names: BTreeSet<&String> = loaded.objects.iter().filter_map(|o| o.name.as_ref()).collect();
        let named = if names.is_empty() {
            String::new()
        } else {
            format!(": {}", list_names(names))
        };
        loaded
            .notes
            .push(format!("the file has {n} objects or parts; all were read{named}"));
    }
    Ok(loaded)
}

/// Marks the objects on the plate with this number, or with this name if no plate has the number.
fn on_plate(loaded: &Loaded, wanted: &str) -> Result<Vec<bool>, ReadError> {
    let folded = wanted.trim().to_lowercase();
    let has_number = |plate: &FilePlate| plate.number.to_string() == folded;
    let has_name = |plate: &FilePlate| plate.name.as_ref().is_some_and(|n| n.to_lowercase() == folded);
    let plates = || loaded.objects.iter().filter_map(|object| object.plate.as_ref());
    let is_number = plates().chain(&loaded.empty_plates).any(has_number);
    let fits = |plate: &FilePlate| {
        if is_number {
            has_number(plate)
        } else {
            has_name(plate)
        }
    };
    let of_object = |object: &FileObject| object.plate.as_ref().is_some_and(fits);
    let is_on: Vec<bool> = loaded.objects.iter().map(of_object).collect();
    if is_on.contains(&true) {
        return Ok(is_on);
    }
    let names: BTreeSet<String> = plates().map(plate_name).collect();
    let has = if names.is_empty() {
        "no plates".to_owned()
    } else {
        list_names(names)
    };
    if loaded.empty_plates.iter().any(fits) {
        return Err(ReadError::EmptyPlate {
            plate: wanted.trim().to_owned(),
            has,
        });
    }
    Err(ReadError::NoSuchPart {
        within: "the file".to_owned(),
        what: "plate",
        name: wanted.to_owned(),
        has,
    })
}

/// Number and name of a plate.
fn plate_name(plate: &FilePlate) -> String {
    match &plate.name {
        Some(name) => format!("{} \"{name}\"", plate.number),
        None => plate.number.to_string(),
    }
}

/// Names of objects and their parts, as they can be asked for.
fn object_names(objects: &[FileObject]) -> String {
    let all: BTreeSet<String> = titles(objects).iter().map(Titles::to_string).collect();
    if all.is_empty() {
        return "no objects with names".to_owned();
    }
    list_names(all)
}

/// Joins the first names of a list, and tells how many more there are.
pub(super) fn list_names<T: AsRef<str>>(names: impl IntoIterator<Item = T>) -> String {
    /// Names that a message lists.
    const N_LISTED: usize = 12;
    let names: Vec<T> = names.into_iter().collect();
    let first: Vec<&str> = names.iter().take(N_LISTED).map(AsRef::as_ref).collect();
    match names.len().saturating_sub(N_LISTED) {
        0 => first.join(", "),
        n => format!("{} and {n} more", first.join(", ")),
    }
}

/// Keeps the selected objects and renumbers their faces.
fn keep(mut loaded: Loaded, is_wanted: &[bool]) -> Loaded {
    let object_of = loaded.object_of_triangle();
    let is_kept: Vec<bool> = object_of.iter().map(|&object| is_wanted[object]).collect();
    retain(&mut loaded.mesh.triangles, &is_kept);
    retain(&mut loaded.file_face, &is_kept);
    let mut number = BTreeMap::new();
    for face in &mut loaded.file_face {
        let next = number.len() as u32;
        *face = *number.entry(*face).or_insert(next);
    }
    let new_label: Vec<i64> = is_wanted
        .iter()
        .scan(0, |next, &wanted| {
            *next += i64::from(wanted);
            Some(*next - 1)
        })
        .collect();
    for labelling in &mut loaded.labellings {
        retain(&mut labelling.labels, &is_kept);
        if labelling.source == LabelSource::Object {
            for label in &mut labelling.labels {
                *label = new_label[*label as usize];
            }
        }
    }
    loaded
        .labellings
        .retain(|l| l.source == LabelSource::Property || divides(&l.labels));
    retain(&mut loaded.objects, is_wanted);
    let items: BTreeSet<u32> = loaded.objects.iter().map(|object| object.item).collect();
    loaded.cutters.retain(|cutter| items.contains(&cutter.item));
    loaded.mesh = loaded.mesh.without_unused_points();
    loaded
}

fn retain<T>(all: &mut Vec<T>, is_kept: &[bool]) {
    let mut kept = is_kept.iter();
    all.retain(|_| kept.next() == Some(&true));
}

impl Loaded {
    /// Returns the names of the file's objects and their parts, in order.
    pub fn titles(&self) -> Vec<Titles> {
        titles(&self.objects)
    }

    /// For each triangle the object that it belongs to, a place in [`Loaded::objects`].
    pub(super) fn object_of_triangle(&self) -> Vec<usize> {
        self.labels(LabelSource::Object).map_or_else(
            || vec![0; self.mesh.triangles.len()],
            |labels| labels.iter().map(|&label| label as usize).collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::{read_mesh, read_selection};
    use super::*;

    const TWO: &[u8] =
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\no left hand\nf 1 2 3\nf 1 2 4\no right\nf 2 3 4\n";

    fn select(bytes: &[u8], object: &str) -> Result<Loaded, ReadError> {
        let selection = Selection {
            object: Some(object.to_owned()),
            plate: None,
        };
        read_selection(bytes, None, &selection)
    }

    #[test]
    fn an_object_is_chosen_by_its_name_and_its_faces_count_from_0() {
        let right = select(TWO, " RIGHT").unwrap();
        assert_eq!((right.mesh.triangles.len(), right.file_face), (1, vec![0]));
        assert_eq!(right.mesh.points.len(), 3);
        assert_eq!(select(TWO, "left hand").unwrap().file_face, [0, 1]);
        let refused = select(TWO, "foot").unwrap_err().to_string();
        assert!(
            refused.contains("no object \"foot\"; it has \"left hand\", \"right\""),
            "{refused}"
        );
    }

    #[test]
    fn a_file_without_names_says_so_and_nothing_is_chosen_where_nothing_is_asked() {
        let nameless = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert!(
            select(nameless, "left")
                .unwrap_err()
                .to_string()
                .contains("no objects with names")
        );
        let whole = read_mesh(TWO, None).unwrap();
        assert_eq!((whole.mesh.triangles.len(), whole.objects.len()), (3, 2));
    }
}
