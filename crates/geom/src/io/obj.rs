//! Wavefront OBJ: `v` and `f`; normals, texture, groups, materials, lines and curves are passed over.

use super::polygons::Polygons;
use super::text::{Lines, point, whole, without_comment, words};
use super::{Format, Loaded, Place, ReadError};

/// Reads an OBJ; faces may name points that come later, and count backwards from the last one with negative indices.
pub(super) fn read(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let mut polygons = Polygons::counted_from(1);
    let mut lines = Lines::of(bytes);
    let mut statement = Vec::new();
    let mut corners = Vec::new();
    while let Some(at) = next_statement(&mut lines, &mut statement) {
        match statement.split_first() {
            Some((&b"v", rest)) => {
                polygons.add_point(point(&mut rest.iter().copied(), at)?, at)?;
            }
            // "fo" is an old name of "f".
            Some((&(b"f" | b"fo"), rest)) => {
                corners.clear();
                for &word in rest {
                    corners.push(corner(&polygons, word, at)?);
                }
                polygons.add_polygon(&corners, at)?;
            }
            _ => {}
        }
    }
    polygons.finish(Format::Obj, None)
}

/// Fills `statement` with the words up to a line end without a backslash; the place is that of its first line.
fn next_statement<'a>(lines: &mut Lines<'a>, statement: &mut Vec<&'a [u8]>) -> Option<Place> {
    statement.clear();
    let (at, mut line) = lines.next()?;
    loop {
        let text = without_comment(line).trim_ascii_end();
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

/// The point of a corner `7`, `7/1`, `7//3`, `7/1/3` or `-1`, counted from 0.
fn corner(polygons: &Polygons, word: &[u8], at: Place) -> Result<u32, ReadError> {
    let index = whole(word.split(|&b| b == b'/').next(), at, "the number of a point")?;
    let from_0 = if index < 0 { index.saturating_add_unsigned(polygons.n_points() as u64) } else { index - 1 };
    polygons.corner(from_0, at)
}
