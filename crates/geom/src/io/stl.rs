//! STL, binary and ASCII. Stored normals are ignored: the order of the corners says what is outside.

use super::polygons::Polygons;
use super::text::{Lines, malformed, point, words};
use super::{Format, Loaded, Place, ReadError};
use crate::TriMesh;

/// Free text, then the number of triangles.
const HEADER_BYTES: usize = 84;
/// Normal, three corners, 2 bytes of no agreed meaning.
const TRIANGLE_BYTES: usize = 50;
/// Must not begin with "solid", which many programs take for ASCII.
const HEADER_TEXT: &[u8] = b"binary STL by shellock, millimetres";

/// Whether the length is exactly what the count in a binary header asks for.
pub(super) fn length_fits_binary(bytes: &[u8]) -> bool {
    promised(bytes).is_some_and(|n| n > 0 && bytes.len() as u64 == HEADER_BYTES as u64 + TRIANGLE_BYTES as u64 * n)
}

/// Reads a binary STL. Up to 49 bytes after the last triangle are taken for padding.
pub(super) fn read_binary(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let Some(promised) = promised(bytes) else {
        return Err(ReadError::CutOff { at: Place::Byte(bytes.len()), within: "the header" });
    };
    let body = &bytes[HEADER_BYTES..];
    let held = (body.len() / TRIANGLE_BYTES) as u64;
    let at = Place::Byte(HEADER_BYTES - 4);
    if held < promised {
        return Err(ReadError::TooFewBytes { at, what: "triangles", promised, room: held });
    }
    if held > promised {
        return Err(ReadError::MoreTriangles { at, promised, held });
    }
    let mut polygons = Polygons::counted_from(0);
    polygons.reserve(3 * held as usize, held as usize);
    for (face, triangle) in body.chunks_exact(TRIANGLE_BYTES).enumerate() {
        let at = HEADER_BYTES + TRIANGLE_BYTES * face;
        let mut corners = [0; 3];
        for (k, corner) in corners.iter_mut().enumerate() {
            let from = 12 + 12 * k;
            let coordinates = [0, 4, 8].map(|i| f64::from(float(&triangle[from + i..])));
            *corner = polygons.add_point(coordinates, Place::Byte(at + from))?;
        }
        polygons.add_polygon(&corners, Place::Byte(at))?;
    }
    polygons.finish(Format::StlBinary, None)
}

/// Reads an ASCII STL of any number of solids; upper and lower case are the same, and a missing `endsolid` is forgiven.
pub(super) fn read_ascii(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let mut polygons = Polygons::counted_from(0);
    let mut lines = Lines::of(bytes);
    let mut corners = Vec::new();
    let mut in_facet = false;
    while let Some((at, line)) = lines.next() {
        let mut words = words(line);
        let Some(first) = words.next() else { continue };
        match (first.to_ascii_lowercase().as_slice(), in_facet) {
            (b"facet", false) => in_facet = true,
            (b"vertex", true) => corners.push(polygons.add_point(point(&mut words, at)?, at)?),
            (b"outer" | b"endloop", true) => {}
            (b"endfacet", true) => {
                polygons.add_polygon(&corners, at)?;
                corners.clear();
                in_facet = false;
            }
            (b"solid" | b"endsolid" | b"color", false) => {}
            // Half a word at the very end.
            (_, true) if lines.rest().is_empty() => break,
            (_, true) => return Err(malformed(at, "\"vertex\" or \"endfacet\"", first)),
            (_, false) => return Err(malformed(at, "\"facet\" or \"endsolid\"", first)),
        }
    }
    if in_facet {
        return Err(ReadError::CutOff { at: lines.place(), within: "a facet" });
    }
    polygons.finish(Format::StlAscii, None)
}

/// A binary STL: normals computed (zero for degenerate triangles), coordinates rounded to `f32`.
///
/// # Panics
/// Where a triangle names a missing point.
pub fn write_stl_binary(mesh: &TriMesh) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_BYTES + TRIANGLE_BYTES * mesh.triangles.len());
    bytes.extend_from_slice(HEADER_TEXT);
    bytes.resize(HEADER_BYTES - 4, 0);
    bytes.extend_from_slice(&(mesh.triangles.len() as u32).to_le_bytes());
    for face in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(face);
        for vector in [mesh.face_normal(face), a, b, c] {
            vector.to_array().iter().for_each(|&x| bytes.extend_from_slice(&(x as f32).to_le_bytes()));
        }
        bytes.extend_from_slice(&[0; 2]);
    }
    bytes
}

/// The number of triangles that a binary header promises.
fn promised(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(HEADER_BYTES - 4..HEADER_BYTES)?;
    Some(u64::from(u32::from_le_bytes([count[0], count[1], count[2], count[3]])))
}

fn float(bytes: &[u8]) -> f32 {
    f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}
