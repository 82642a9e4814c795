//! Fonts of the user's system, for letters of a model's name that the booklet's own fonts lack.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use fontdb::{Database, FaceInfo, Style, Weight};
use shellock::Warning;
use shellock_print::fonts::{ExtraFont, available_characters, missing_characters};

use crate::causes::Cause;
use crate::input::Model;
use crate::options::Options;

/// Fonts that the booklet needs for the model's name. The system is looked at only if the booklet's own fonts
/// lack letters of it, so no other kit depends on the machine.
pub fn of_name(model: &Model, options: &Options) -> Vec<ExtraFont> {
    if options.no_booklet {
        return Vec::new();
    }
    of_system(missing_characters(&model.name, &[]))
}

/// Warns of letters of the model's name that no font has.
pub fn warning(model: &Model, options: &Options) -> Option<Warning> {
    let letters: String = missing_characters(&model.name, &of_name(model, options))
        .into_iter()
        .collect();
    let is_printed = !options.no_booklet;
    (is_printed && !letters.is_empty())
        .then(|| Warning::new(Cause::LettersNotPrinted { letters }, Vec::new(), None))
}

/// Finds fonts of the system that have `characters`, as few as possible. Empty if nothing is sought: then the
/// system is not looked at. A character that no font has is passed over.
fn of_system(characters: BTreeSet<char>) -> Vec<ExtraFont> {
    if characters.is_empty() {
        return Vec::new();
    }
    let mut database = Database::new();
    database.load_system_fonts();
    let mut faces: Vec<&FaceInfo> = database.faces().filter(|face| !is_stand_in(face)).collect();
    faces.sort_by_cached_key(|face| preference(face));
    let read = |face: &&FaceInfo| {
        let found = |bytes: &[u8], index| available_characters(bytes, index, &characters);
        database.with_face_data(face.id, found).unwrap_or_default()
    };
    let has: Vec<BTreeSet<char>> = faces.iter().map(read).collect();
    let mut sought = characters;
    let mut fonts = Vec::new();
    // Sorting is stable, so of fonts that have as many characters the first is taken. A font that cannot be
    // embedded is passed over.
    let mut order: Vec<usize> = (0..faces.len()).collect();
    while !sought.is_empty() {
        let n_found = |&i: &usize| has[i].intersection(&sought).count();
        order.retain(|i| n_found(i) > 0);
        order.sort_by_key(|i| Reverse(n_found(i)));
        if order.is_empty() {
            break;
        }
        let i = order.remove(0);
        if let Some(font) = load_font(&database, faces[i]) {
            fonts.push(font);
            sought = &sought - &has[i];
        }
    }
    fonts
}

/// Copies a font out of its file.
fn load_font(database: &Database, face: &FaceInfo) -> Option<ExtraFont> {
    let (bytes, index) = database.with_face_data(face.id, |bytes, index| (bytes.to_vec(), index))?;
    ExtraFont::new(bytes, index)
}

/// Tells fonts that claim every character and draw a box or nothing for it.
fn is_stand_in(face: &FaceInfo) -> bool {
    const FAMILIES: [&str; 3] = ["LastResort", "Last Resort", "Adobe Blank"];
    let mut families = face.families.iter().map(|family| &family.0);
    families.any(|name| FAMILIES.iter().any(|stand_in| name.contains(stand_in)))
}

/// Order of preference: upright, without serifs, of usual weight; then by name, so that the order of files on
/// the disk decides nothing.
fn preference(face: &FaceInfo) -> impl Ord + use<> {
    let family = face.families.first().map_or("", |family| &family.0);
    (
        face.style != Style::Normal,
        face.monospaced,
        !family.contains("Sans"),
        face.weight.0.abs_diff(Weight::NORMAL.0),
        family.to_owned(),
        face.post_script_name.clone(),
        face.index,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fonts_are_sought_for_what_is_lacking_alone_and_none_twice() {
        assert!(of_system(BTreeSet::new()).is_empty());
        // No font has a character that Unicode will never have.
        assert!(of_system(['\u{FFFFF}'].into()).is_empty());
        let fonts = of_system("兔子".chars().collect());
        assert!(fonts.len() <= 2, "at most one font a character");
    }
}
