//! Wavefront OBJ: `v` and `f`, with the groups, objects and materials of faces and the colours of points.
//! Normals, texture coordinates, lines and curves are skipped.

use std::collections::BTreeMap;

use super::point_colors::{self, Channels};
use super::polygons::{Numbering, Polygons};
use super::text::{Lines, coordinate, point, quote, whole, without_comment, words};
use super::{FileObject, Format, LabelSource, Loaded, Place, ReadError};

/// Statements that divide the faces.
const DIVISIONS: [(&[u8], LabelSource); 3] = [
    (b"usemtl", LabelSource::Material),
    (b"g", LabelSource::Group),
    (b"o", LabelSource::Object),
];

/// Statements that end with a name, which may have any characters.
const TAKES_A_NAME: [&[u8]; 4] = [b"usemtl", b"g", b"o", b"mtllib"];

/// Statements that say nothing of where the surface is, or belong to those of curves, which only `curv`,
/// `curv2` and `surf` begin.
const HARMLESS: [&[u8]; 36] = [
    b"vn",
    b"vt",
    b"vp",
    b"s",
    b"l",
    b"p",
    b"mg",
    b"lod",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"shadow_obj",
    b"trace_obj",
    b"ctech",
    b"stech",
    b"maplib",
    b"usemap",
    b"deg",
    b"bmat",
    b"step",
    b"cstype",
    b"parm",
    b"trim",
    b"hole",
    b"scrv",
    b"sp",
    b"end",
    b"con",
    b"vs",
    b"curv",
    b"curv2",
    b"mtllib",
    b"usemtl",
    b"g",
    b"o",
    b"csh",
];

/// Kinds of statements that the note on those that were passed over quotes at most.
const QUOTED: usize = 4;

/// Index of the division by objects, which have names.
const OBJECTS: usize = 2;

/// Reads an OBJ. Faces may refer to later points; negative indices count backwards from the last point.
pub(super) fn read(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let mut polygons = Polygons::counted_from(1);
    let mut lines = Lines::of(bytes);
    let mut statement = Vec::new();
    let mut corners = Vec::new();
    let mut divisions = DIVISIONS.map(|_| Division::default());
    let mut extras = Extras::default();
    let (mut names_materials, mut has_texture) = (false, false);
    let mut passed_over: BTreeMap<&[u8], usize> = BTreeMap::new();
    while let Some(at) = next_statement(&mut lines, &mut statement) {
        match statement.split_first() {
            Some((&b"v", rest)) => {
                polygons.add_point(point(&mut rest.iter().copied(), at)?, at)?;
                extras.add(&rest[3..]);
            }
            Some((&b"mtllib", _)) => names_materials = true,
            // "fo" is an old name of "f".
            Some((&(b"f" | b"fo"), rest)) => {
                corners.clear();
                for &word in rest {
                    corners.push(corner(&polygons, word, at)?);
                    has_texture = has_texture || names_texture(word);
                }
                polygons.add_polygon(&corners, at)?;
            }
            Some((&word, rest)) => {
                if let Some(which) = DIVISIONS.iter().position(|(name, _)| *name == word) {
                    divisions[which].begin(rest, polygons.n_faces());
                } else if !HARMLESS.contains(&word) {
                    *passed_over.entry(word).or_default() += 1;
                }
            }
            None => {}
        }
    }
    let n_faces = polygons.n_faces();
    let objects = divisions[OBJECTS].objects();
    let labels = DIVISIONS
        .iter()
        .zip(divisions)
        .filter_map(|((_, source), d)| Some((*source, d.labels(n_faces)?)));
    let mut loaded = polygons.finish(Format::Obj, labels.collect())?;
    let labels = loaded.labels(LabelSource::Object);
    if labels.is_some_and(|labels| labels.iter().all(|label| *label >= 0)) {
        loaded.objects = objects;
    }
    loaded.notes.extend(note_of_others(&passed_over));
    if names_materials && has_texture {
        let note = "the file's texture, if it has one, is not used";
        loaded.notes.push(note.to_owned());
    }
    if let Some(channels) = extras.channels() {
        point_colors::divide(&mut loaded, &channels.colors());
    }
    Ok(loaded)
}

/// A note on statements that are not read.
fn note_of_others(passed_over: &BTreeMap<&[u8], usize>) -> Option<String> {
    let n: usize = passed_over.values().sum();
    let shown = passed_over.keys().take(QUOTED).map(|word| quote(word));
    let more = if passed_over.len() > QUOTED { ", …" } else { "" };
    (n > 0).then(|| {
        format!(
            "unsupported statements were skipped: {n}, by {}{more}; any surfaces among them are missing",
            shown.collect::<Vec<_>>().join(", ")
        )
    })
}

/// Numbers after the coordinates of points: a weight, a colour, or both.
#[derive(Default)]
struct Extras {
    rows: Vec<[f32; 4]>,
    /// Length of the rows; `None` before the first.
    n: Option<usize>,
    /// True if some point has no colour, or the points have different counts of numbers.
    is_mixed: bool,
}

impl Extras {
    fn add(&mut self, words: &[&[u8]]) {
        let n = *self.n.get_or_insert(words.len());
        self.is_mixed |= n != words.len() || !(3..=4).contains(&n);
        if self.is_mixed {
            return;
        }
        let mut row = [0.0; 4];
        for (number, word) in row.iter_mut().zip(words) {
            // Negative numbers are those of a normal.
            match coordinate(Some(word), Place::Line(0)) {
                Ok(value) if value >= 0.0 => *number = value as f32,
                _ => self.is_mixed = true,
            }
        }
        self.rows.push(row);
    }

    /// Returns the colours if all points have one. Rows have three numbers, or four with alpha last or the
    /// weight first. The weight is first if the first number is 1 for all points and the last one is not.
    fn channels(mut self) -> Option<Channels> {
        if self.is_mixed || self.rows.is_empty() {
            return None;
        }
        let is_one = |column: usize| self.rows.iter().all(|row| row[column] == 1.0);
        if self.n == Some(4) && is_one(0) && !is_one(3) {
            let unweighted = |[_, red, green, blue]: [f32; 4]| [red, green, blue, 0.0];
            self.rows.iter_mut().for_each(|row| *row = unweighted(*row));
        }
        Some(Channels {
            rows: self.rows,
            are_whole: false,
        })
    }
}

/// Names that apply to the faces after them.
#[derive(Default)]
struct Division<'a> {
    numbering: Numbering<Vec<&'a [u8]>>,
    /// Names, indexed by label.
    names: Vec<Vec<&'a [u8]>>,
    /// First face of each stretch, with the label.
    begins: Vec<(usize, i64)>,
}

impl<'a> Division<'a> {
    fn begin(&mut self, name: &[&'a [u8]], face: usize) {
        let label = self.numbering.number(name.to_vec());
        if label == self.names.len() as i64 {
            self.names.push(name.to_vec());
        }
        self.begins.push((face, label));
    }

    /// Objects with their names, indexed by label.
    fn objects(&self) -> Vec<FileObject> {
        let named = (0..).zip(&self.names).map(|(item, words)| FileObject {
            name: Some(String::from_utf8_lossy(&words.join(&b' ')).into_owned()).filter(|n| !n.is_empty()),
            part: None,
            item,
            plate: None,
        });
        named.collect()
    }

    /// Returns one label for each of `n_faces` faces; `None` if there is no name.
    fn labels(self, n_faces: usize) -> Option<Vec<i64>> {
        // Faces before the first name have none, which counts as a name of its own.
        const NAMELESS: i64 = -1;
        let mut labels = vec![NAMELESS; self.begins.first()?.0.min(n_faces)];
        for (i, &(_, label)) in self.begins.iter().enumerate() {
            labels.resize(self.begins.get(i + 1).map_or(n_faces, |next| next.0), label);
        }
        Some(labels)
    }
}

/// Fills `statement` with the words up to a line end without a backslash. Returns the place of its first
/// line.
fn next_statement<'a>(lines: &mut Lines<'a>, statement: &mut Vec<&'a [u8]>) -> Option<Place> {
    statement.clear();
    let (at, mut line) = lines.next()?;
    loop {
        let is_name = words(line)
            .next()
            .is_some_and(|first| TAKES_A_NAME.contains(&first));
        // Names may have "#" in them.
        let text = if is_name { line } else { without_comment(line) };
        let text = text.trim_ascii_end();
        let Some(continued) = text.strip_suffix(b"\\") else {
            statement.extend(words(text));
            return Some(at);
        };
        statement.extend(words(continued));
        match lines.next() {
            Some((_, next)) => line = next,
            None => return Some(at),
        }
    }
}

/// True if a corner refers to a texture coordinate: `7/1`, `7/1/3`.
fn names_texture(word: &[u8]) -> bool {
    word.split(|&b| b == b'/')
        .nth(1)
        .is_some_and(|texture| !texture.is_empty())
}

/// Returns the point of a corner `7`, `7/1`, `7//3`, `7/1/3` or `-1`, counted from 0.
fn corner(polygons: &Polygons, word: &[u8], at: Place) -> Result<u32, ReadError> {
    let index = whole(word.split(|&b| b == b'/').next(), at, "the number of a point")?;
    let from_0 = if index < 0 {
        index.saturating_add_unsigned(polygons.n_points() as u64)
    } else {
        index - 1
    };
    polygons.corner(from_0, at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_may_have_a_number_sign_and_what_is_not_read_is_noted() {
        let text = "o Part#1\nv 0 0 0 # a corner\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl Mat #1\nf 1 3 2\nf 1 2 \
                    4 # a face\no Part#2\nusemtl Mat #2\nf 2 3 4\nf 1 4 3\nF 1 2 3\nsurf 0 1 0 1 1 2\n";
        let loaded = read(text.as_bytes()).unwrap();
        assert_eq!(loaded.labels(LabelSource::Material), Some(&[0, 0, 1, 1][..]));
        let names: Vec<Option<&str>> = loaded.objects.iter().map(|o| o.name.as_deref()).collect();
        assert_eq!(names, [Some("Part#1"), Some("Part#2")]);
        assert_eq!(loaded.notes.len(), 1);
        assert!(
            loaded.notes[0].contains("2, by \"F\", \"surf\""),
            "{}",
            loaded.notes[0]
        );
    }
}
