//! Selection of one object, or one plate, of a file that has several.

use std::collections::{BTreeMap, BTreeSet};

use super::polygons::divides;
use super::{FileObject, LabelSource, Loaded, ReadError};

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

    fn is_on(&self, wanted: &str) -> bool {
        self.plate.as_ref().is_some_and(|plate| {
            plate.number.to_string() == wanted.trim()
                || plate
                    .name
                    .as_ref()
                    .is_some_and(|name| name.to_lowercase() == wanted.trim().to_lowercase())
        })
    }
}

/// Returns the selected part of `loaded`; an error that lists the alternatives if there is none.
pub(super) fn select(loaded: Loaded, selection: &Selection) -> Result<Loaded, ReadError> {
    let mut is_wanted = vec![true; loaded.objects.len()];
    for (what, wanted, fits) in [
        (
            "plate",
            &selection.plate,
            FileObject::is_on as fn(&FileObject, &str) -> bool,
        ),
        ("object", &selection.object, FileObject::is_called),
    ] {
        let Some(wanted) = wanted else { continue };
        for (object, is_wanted) in loaded.objects.iter().zip(&mut is_wanted) {
            *is_wanted &= fits(object, wanted);
        }
        if !is_wanted.contains(&true) {
            return Err(ReadError::NoSuchPart {
                what,
                wanted: wanted.clone(),
                has: titles(&loaded.objects, what),
            });
        }
    }
    if is_wanted.contains(&false) {
        Ok(keep(loaded, &is_wanted))
    } else {
        Ok(loaded)
    }
}

/// Names of all objects, or of all plates, in the form that can be asked for.
fn titles(objects: &[FileObject], what: &str) -> String {
    let title = |object: &FileObject| match what {
        "plate" => object.plate.as_ref().map(|plate| match &plate.name {
            Some(name) => format!("{} \"{name}\"", plate.number),
            None => plate.number.to_string(),
        }),
        _ => Some(format!("\"{}\"", object.title())),
    };
    let all: BTreeSet<String> = objects.iter().filter_map(title).collect();
    if all.is_empty() {
        return format!("no {what}s with names");
    }
    all.into_iter().collect::<Vec<_>>().join(", ")
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
    /// Returns the object of each triangle, as an index into [`Loaded::objects`].
    pub(super) fn object_of_triangle(&self) -> Vec<usize> {
        self.labels(LabelSource::Object).map_or_else(
            || vec![0; self.mesh.triangles.len()],
            |labels| labels.iter().map(|&label| label as usize).collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::{read_mesh, read_selected};
    use super::*;

    const TWO: &[u8] =
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\no left hand\nf 1 2 3\nf 1 2 4\no right\nf 2 3 4\n";

    fn select(bytes: &[u8], object: &str) -> Result<Loaded, ReadError> {
        let selection = Selection {
            object: Some(object.to_owned()),
            plate: None,
        };
        read_selected(bytes, None, &selection)
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
