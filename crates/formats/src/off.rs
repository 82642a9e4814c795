//! OFF: points and polygons as text, with the colours of faces and points. Normals are skipped.

use super::point_colors::{self, Channels};
use super::polygons::{Numbering, Polygons};
use super::text::{Lines, coordinate, point, syntax_error, whole, without_bom, without_comment, words};
use super::{Format, LabelSource, Loaded, Place, ReadError};

/// Fewest bytes of a point: `0 0 0` and a line end.
const POINT_BYTES: u64 = 6;
/// Fewest bytes of a face: `3 0 0 0` and a line end.
const FACE_BYTES: u64 = 8;

/// Reads a three-dimensional OFF with one point or face per line; the first word may be missing.
pub(super) fn read(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let mut lines = Lines::of(without_bom(bytes));
    let OffHeader {
        n_points,
        n_faces,
        color_at,
    } = read_header(&mut lines)?;

    let mut polygons = Polygons::counted_from(0);
    polygons.reserve(n_points, n_faces);
    let mut of_points = Vec::new();
    for _ in 0..n_points {
        let (at, line) = next_line(&mut lines).ok_or(ReadError::CutOff {
            at: lines.place(),
            within: "the points",
        })?;
        let mut words = words(line);
        polygons.add_point(point(&mut words, at)?, at)?;
        if let Some(color) = color_at.and_then(|n_before| color(words.skip(n_before))) {
            of_points.push(color);
        }
    }
    let mut corners = Vec::new();
    let (mut numbering, mut colors) = (Numbering::default(), Vec::with_capacity(n_faces));
    for _ in 0..n_faces {
        let (at, line) = next_line(&mut lines).ok_or(ReadError::CutOff {
            at: lines.place(),
            within: "the faces",
        })?;
        let mut words = words(line);
        let n_corners = whole(words.next(), at, "the number of corners of a face")?;
        corners.clear();
        for _ in 0..n_corners {
            let index = whole(words.next(), at, "the number of a point")?;
            corners.push(polygons.corner(index, at)?);
        }
        polygons.add_polygon(&corners, at)?;
        colors.push(numbering.number(words.map(<[u8]>::to_vec).collect::<Vec<_>>()));
    }
    let mut loaded = polygons.finish(Format::Off, vec![(LabelSource::Color, colors)])?;
    let channels = Channels {
        rows: of_points,
        are_whole: false,
    };
    // If some points have no colour, there are fewer colours than points, and they divide nothing.
    point_colors::divide(&mut loaded, &channels.colors());
    Ok(loaded)
}

/// Parses the colour of a point: three or four numbers.
fn color<'a>(words: impl Iterator<Item = &'a [u8]>) -> Option<[f32; 4]> {
    let (mut color, mut n) = ([0.0; 4], 0);
    for (channel, word) in color.iter_mut().zip(words) {
        *channel = coordinate(Some(word), Place::Line(0)).ok()? as f32;
        n += 1;
    }
    (n >= 3).then_some(color)
}

/// Contents of the first lines.
struct OffHeader {
    n_points: usize,
    n_faces: usize,
    /// Count of numbers between the coordinates of a point and its colour; `None` without colours.
    color_at: Option<usize>,
}

/// Reads the header. The counts of points and faces are on the line of the first word or on the next; an
/// error if the bytes do not suffice for them.
fn read_header(lines: &mut Lines) -> Result<OffHeader, ReadError> {
    let cut_off = |lines: &Lines| ReadError::CutOff {
        at: lines.place(),
        within: "the header",
    };
    let (mut at, mut line) = next_line(lines).ok_or_else(|| cut_off(lines))?;
    let first = words(line).next().unwrap_or_default().to_ascii_lowercase();
    let mut color_at = None;
    if let Some(prefix) = first.strip_suffix(b"off") {
        color_at = prefix
            .contains(&b'c')
            .then_some(if prefix.contains(&b'n') { 3 } else { 0 });
        if prefix.contains(&b'4') || prefix.contains(&b'n') && prefix != b"n" && !prefix.ends_with(b"cn") {
            return Err(ReadError::Unsupported {
                what: "an OFF file of more than three dimensions",
                at,
            });
        }
        line = &line.trim_ascii_start()[first.len()..];
        if words(line).next().is_none() {
            (at, line) = next_line(lines).ok_or_else(|| cut_off(lines))?;
        }
    }
    let mut words = words(line);
    let mut count = |what, expected, bytes_each| {
        let word = words.next();
        if word.is_some_and(|word| word.eq_ignore_ascii_case(b"binary")) {
            return Err(ReadError::Unsupported {
                what: "a binary OFF file",
                at,
            });
        }
        let promised = u64::try_from(whole(word, at, expected)?)
            .map_err(|_| syntax_error(at, expected, word.unwrap_or_default()))?;
        // The last line may lack its end.
        let room = (lines.rest().len() as u64 + 1) / bytes_each;
        if promised > room {
            Err(ReadError::TooFewBytes {
                at,
                what,
                count: promised,
                room,
            })
        } else {
            Ok(promised as usize)
        }
    };
    let n_points = count("points", "the number of points", POINT_BYTES)?;
    let n_faces = count("faces", "the number of faces", FACE_BYTES)?;
    Ok(OffHeader {
        n_points,
        n_faces,
        color_at,
    })
}

/// Returns the next line with content.
fn next_line<'a>(lines: &mut Lines<'a>) -> Option<(Place, &'a [u8])> {
    lines
        .map(|(at, line)| (at, without_comment(line)))
        .find(|(_, line)| words(line).next().is_some())
}
