//! What slicers note beside the model: which extruder prints what, and which volumes are no part of it.

use quick_xml::events::BytesStart;

use super::Package;
use super::xml::{Elements, Next, number};

/// Where PrusaSlicer and SuperSlicer, and where Bambu Studio and OrcaSlicer have it.
pub(super) const FILES: [&str; 2] = [
    "Metadata/Slic3r_PE_model.config",
    "Metadata/model_settings.config",
];
/// Volumes that are material; all others change or hold up what is printed.
const BODY_KINDS: [&str; 2] = ["ModelPart", "normal_part"];
/// Volumes that have the same triangle at most; further ones are hostile and are passed over.
const MAX_OVERLAP: usize = 8;
/// What prints where nothing else is said.
const FIRST_EXTRUDER: u32 = 1;

/// Extruders and volumes.
#[derive(Default)]
pub(super) struct Settings {
    volumes: Vec<Volume>,
}

/// An object, or a part of one.
struct Volume {
    /// The object of the model file that has the triangles.
    object: u32,
    /// Which of its triangles, first and last; all where the file does not say.
    faces: (u32, u32),
    is_body: bool,
    extruder: Option<u32>,
}

impl Settings {
    /// Adds what `name` holds; a file that cannot be read adds nothing, since models come without it as well.
    pub(super) fn read(&mut self, name: &str, package: &mut Package) {
        let Ok(Some(text)) = package.text(name) else {
            return;
        };
        let mut elements = Elements::of(name, &text);
        // The object that is open, its entry, and whether a part of it is open.
        let (mut object, mut entry, mut in_part) = (None, 0, false);
        while let Ok(Some(next)) = elements.next() {
            match next {
                Next::Begin(element) => match element.local_name().as_ref().as_bytes() {
                    b"object" => {
                        object = attribute(&elements, &element, "id");
                        entry = self.volumes.len();
                        self.begin(object, (0, u32::MAX), true);
                    }
                    // A range of the object's triangles.
                    b"volume" => {
                        let of = |name| attribute(&elements, &element, name);
                        self.begin(
                            object,
                            (of("firstid").unwrap_or(0), of("lastid").unwrap_or(u32::MAX)),
                            true,
                        );
                        in_part = true;
                    }
                    // An object of its own, put into this one.
                    b"part" => {
                        let kind: Option<String> = attribute(&elements, &element, "subtype");
                        let is_body = kind.is_none_or(|kind| BODY_KINDS.contains(&kind.as_str()));
                        let inherited = self.volumes.get(entry).and_then(|v| v.extruder);
                        self.begin(attribute(&elements, &element, "id"), (0, u32::MAX), is_body);
                        self.set_extruder(inherited);
                        in_part = true;
                    }
                    b"metadata" if object.is_some() => self.note(&elements, &element, in_part),
                    _ => {}
                },
                Next::End(name) => match &name[..] {
                    b"object" => (object, in_part) = (None, false),
                    b"volume" | b"part" => in_part = false,
                    _ => {}
                },
            }
        }
        // Stable, so that later entries stay after what they are about.
        self.volumes.sort_by_key(|v| v.object);
    }

    fn begin(&mut self, object: Option<u32>, faces: (u32, u32), is_body: bool) {
        self.volumes.extend(object.map(|object| Volume {
            object,
            faces,
            is_body,
            extruder: None,
        }));
    }

    fn set_extruder(&mut self, extruder: Option<u32>) {
        if let Some(volume) = self.volumes.last_mut() {
            // 0 means: as the object.
            volume.extruder = extruder.filter(|&e| e > 0).or(volume.extruder);
        }
    }

    fn note(&mut self, elements: &Elements, element: &BytesStart, in_part: bool) {
        let key: String = attribute(elements, element, "key").unwrap_or_default();
        let value: String = attribute(elements, element, "value").unwrap_or_default();
        match key.as_str() {
            "extruder" => self.set_extruder(value.parse().ok()),
            "volume_type" if in_part => self.set_body(BODY_KINDS.contains(&value.as_str())),
            // Before volumes had types.
            "modifier" if in_part && value == "1" => self.set_body(false),
            _ => {}
        }
    }

    fn set_body(&mut self, is_body: bool) {
        if let Some(volume) = self.volumes.last_mut() {
            volume.is_body = is_body;
        }
    }

    /// The extruder of each of `n_triangles` triangles of an object where they have no paint; `None` for what
    /// is no part of the model.
    pub(super) fn extruders(&self, object: u32, n_triangles: usize) -> Vec<Option<u32>> {
        let mut extruders = vec![Some(FIRST_EXTRUDER); n_triangles];
        let from = self.volumes.partition_point(|v| v.object < object);
        // Volumes of an object share no triangles, but for the one that is the object itself.
        let mut work_left = MAX_OVERLAP * n_triangles;
        // Later entries are about parts of what earlier ones are about.
        for volume in self.volumes[from..].iter().take_while(|v| v.object == object) {
            let end = (volume.faces.1 as usize).saturating_add(1).min(n_triangles);
            let begin = (volume.faces.0 as usize).min(end);
            let Some(left) = work_left.checked_sub(end - begin) else {
                break;
            };
            work_left = left;
            for extruder in &mut extruders[begin..end] {
                *extruder = if volume.is_body {
                    volume.extruder.or(*extruder)
                } else {
                    None
                };
            }
        }
        extruders
    }
}

fn attribute<T: std::str::FromStr>(elements: &Elements, element: &BytesStart, wanted: &str) -> Option<T> {
    let mut found = None;
    let all = elements.attributes(element, |name, value| {
        if name == wanted {
            found = number(name, value).ok();
        }
        Ok(())
    });
    all.ok().and(found)
}
