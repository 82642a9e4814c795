//! The archive of a 3MF: its parts by name, and the limit on its unpacked size.

use std::collections::BTreeMap;
use std::io::Cursor;

use super::super::ReadError;
use super::super::container::{archive, limit, opening_error, read_up_to};
use super::xml;

/// Root part, which describes the build, unless the package names another.
pub(super) const USUAL_ROOT: &str = "3D/3dmodel.model";
/// Part that names the root part.
const RELATIONS: &str = "_rels/.rels";
/// Ending of the relation type for the root part.
const ROOT_KIND: &str = "/3dmodel";
/// Endings of parts with tool paths for a printer, as slicers export them.
const TOOL_PATHS: [&str; 2] = [".gcode", ".gcode.md5"];

/// A 3MF archive and its remaining budget.
pub(super) struct Package<'a> {
    archive: zip::ZipArchive<Cursor<&'a [u8]>>,
    /// Index in the archive by [`key`], below the common folder.
    places: BTreeMap<String, usize>,
    byte_budget: u64,
}

impl<'a> Package<'a> {
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, ReadError> {
        let archive = archive(bytes)?;
        let keys: Vec<String> = archive
            .file_names_raw()
            .map(|name| key(&String::from_utf8_lossy(name)))
            .collect();
        let folder = common_folder(&keys);
        let mut places = BTreeMap::new();
        for (place, name) in keys.iter().enumerate() {
            if let Some(name) = name.strip_prefix(&folder) {
                // Of names that differ only in case, the first counts, as on most disks.
                places.entry(name.to_owned()).or_insert(place);
            }
        }
        Ok(Self {
            archive,
            places,
            byte_budget: limit(bytes.len()),
        })
    }

    /// Reads the text of a part; `None` if there is no such part.
    pub(super) fn text(&mut self, name: &str) -> Result<Option<String>, ReadError> {
        let Some(&place) = self.places.get(&key(name)) else {
            return Ok(None);
        };
        let file = self.archive.by_index(place).map_err(opening_error)?;
        let bytes = read_up_to(file, self.byte_budget)?;
        self.byte_budget -= bytes.len() as u64;
        Ok(Some(xml::text(bytes)))
    }

    /// Returns the name of the root part: the one that the package's relations name, else the usual one.
    pub(super) fn root(&mut self) -> Result<String, ReadError> {
        let relations = self.text(RELATIONS)?;
        let target = relations.and_then(|relations| xml::relation_target(&relations, ROOT_KIND));
        match target {
            Some(target) => Ok(path(&target)),
            None if self.places.contains_key(&key(USUAL_ROOT)) => Ok(USUAL_ROOT.to_owned()),
            None => Err(ReadError::NoRoot),
        }
    }

    /// The name of a part as the archive has it.
    pub(super) fn archive_name(&self, name: &str) -> String {
        let place = self.places.get(&key(name));
        let shown = place.and_then(|&place| self.archive.name_for_index(place)?.ok());
        shown.map_or_else(|| name.to_owned(), std::borrow::Cow::into_owned)
    }

    /// Lists the parts for which `is_wanted` holds, as keys in order: in lower case, below the common folder.
    pub(super) fn names(&self, is_wanted: impl Fn(&str) -> bool) -> Vec<String> {
        self.places
            .keys()
            .filter(|name| is_wanted(name))
            .cloned()
            .collect()
    }

    /// Returns true if the package holds a slicer's output for a printer.
    pub(super) fn has_tool_paths(&self) -> bool {
        !self
            .names(|name| TOOL_PATHS.iter().any(|end| name.ends_with(end)))
            .is_empty()
    }
}

/// Normalises a reference to a part: without %XX, with "/" between folders, from the root.
pub(super) fn path(name: &str) -> String {
    decode(name).replace('\\', "/").trim_start_matches('/').to_owned()
}

/// Key of a part's name: equal for names of the same part, which may differ in case.
fn key(name: &str) -> String {
    path(name).to_ascii_lowercase()
}

/// Replaces each %XX in `name` by its byte.
fn decode(name: &str) -> String {
    let hex = |b: u8| char::from(b).to_digit(16);
    let (bytes, mut out) = (name.as_bytes(), Vec::with_capacity(name.len()));
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let code = bytes
            .get(at + 1..at + 3)
            .filter(|_| byte == b'%')
            .and_then(|pair| Some(16 * hex(pair[0])? + hex(pair[1])?));
        match code {
            Some(code) => {
                out.push(code as u8);
                at += 3;
            }
            None => {
                out.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8(out).unwrap_or_else(|e| String::from_utf8_lossy(e.as_bytes()).into_owned())
}

/// Finds the folder, with its "/", that contains the whole package. Archives that were unpacked and packed
/// again often have one.
fn common_folder(keys: &[String]) -> String {
    let usual_root = USUAL_ROOT.to_ascii_lowercase();
    let is_own = |name: &&String| !name.starts_with("__macosx/");
    let folder_above = |end: &str| {
        keys.iter()
            .filter(is_own)
            .filter_map(|name| name.strip_suffix(end))
            .filter(|folder| folder.is_empty() || folder.ends_with('/'))
            .min_by_key(|folder| folder.len())
    };
    folder_above(RELATIONS)
        .or_else(|| folder_above(&usual_root))
        .unwrap_or_default()
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_same_part_whatever_their_slashes_codes_case_and_common_folder() {
        let names = [
            "3D/3dmodel.model",
            "/3D/3dmodel.model",
            "3D\\3Dmodel.model",
            "3d%2F3dmodel%2Emodel",
        ];
        assert!(names.iter().all(|name| key(name) == "3d/3dmodel.model"));
        assert_eq!(path("/3D/Objekt%20%C3%A4.model"), "3D/Objekt ä.model");
        assert_eq!(path("100%.model"), "100%.model");
        assert_eq!(path("%zz%4"), "%zz%4");
        let keys = |names: &[&str]| names.iter().map(|n| key(n)).collect::<Vec<_>>();
        let packed = keys(&[
            "__MACOSX/a/_rels/.rels",
            "a/b/3D/_rels/.rels",
            "a/b/_rels/.rels",
            "a/b/3D/x.model",
        ]);
        assert_eq!(common_folder(&packed), "a/b/");
        assert_eq!(common_folder(&keys(&["x/3D/3dmodel.model"])), "x/");
        assert_eq!(
            common_folder(&keys(&["3D/3dmodel.model", "x/3D/3dmodel.model"])),
            ""
        );
        assert_eq!(common_folder(&keys(&["my_rels/.rels", "_rels/.rels"])), "");
    }
}
