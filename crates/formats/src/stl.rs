//! STL, binary and ASCII. Stored normals are ignored: the order of the corners defines the outside.

use super::polygons::{Numbering, Polygons};
use super::text::{Lines, point, syntax_error, words};
use super::{Format, LabelSource, Loaded, Place, ReadError};
use shellock_geom::TriMesh;

/// Size of the header: free text, then the number of triangles.
const HEADER_BYTES: usize = 84;
/// Size of a triangle: normal, three corners, 2 bytes without agreed meaning.
const TRIANGLE_BYTES: usize = 50;
/// Must not begin with "solid", which many programs take for ASCII.
const HEADER_TEXT: &[u8] = b"binary STL by shellock, millimetres";

/// Returns true if the length is exactly that given by the count in a binary header.
pub(super) fn length_fits_binary(bytes: &[u8]) -> bool {
    header_count(bytes)
        .is_some_and(|n| n > 0 && bytes.len() as u64 == HEADER_BYTES as u64 + TRIANGLE_BYTES as u64 * n)
}

/// Reads a binary STL, or several one after the other, as `cat` makes them.
///
/// A count may be 0 or all ones, from programs that write without knowing it, or too low. Further data is
/// read if it looks like triangles, and skipped otherwise. A count that is too high is an error: the file was
/// cut off.
pub(super) fn read_binary(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let mut polygons = Polygons::counted_from(0);
    let (mut colors, mut notes) = (FaceColors::default(), Vec::new());
    let (mut rest, mut n_files) = (bytes, 0);
    while n_files == 0 || begins_a_file(rest) {
        let base = bytes.len() - rest.len();
        let n_triangles = add_binary(rest, base, &mut polygons, &mut colors, &mut notes)?;
        rest = &rest[HEADER_BYTES + TRIANGLE_BYTES * n_triangles..];
        n_files += 1;
    }
    if n_files > 1 {
        notes.push(format!(
            "the file contains {n_files} STL files in sequence; all were read"
        ));
    }
    let mut loaded = polygons.finish(Format::StlBinary, vec![(LabelSource::Color, colors.labels)])?;
    loaded.notes.append(&mut notes);
    Ok(loaded)
}

/// Adds the triangles of the STL with which `bytes` begins, `base` bytes into the file, and returns how many.
fn add_binary(
    bytes: &[u8],
    base: usize,
    polygons: &mut Polygons,
    colors: &mut FaceColors,
    notes: &mut Vec<String>,
) -> Result<usize, ReadError> {
    let Some(promised) = header_count(bytes) else {
        return Err(ReadError::CutOff {
            at: Place::Byte(base + bytes.len()),
            within: "the header",
        });
    };
    let body = &bytes[HEADER_BYTES..];
    let n_triangles = count(body, promised, base, notes)?;
    polygons.reserve(3 * n_triangles, n_triangles);
    colors.begin(&bytes[..HEADER_BYTES - 4]);
    for (face, triangle) in body.chunks_exact(TRIANGLE_BYTES).take(n_triangles).enumerate() {
        let at = base + HEADER_BYTES + TRIANGLE_BYTES * face;
        let mut corners = [0; 3];
        for (k, corner) in corners.iter_mut().enumerate() {
            let from = 12 + 12 * k;
            let coordinates = [0, 4, 8].map(|i| f64::from(float(&triangle[from + i..])));
            *corner = polygons.add_point(coordinates, Place::Byte(at + from))?;
        }
        polygons.add_polygon(&corners, Place::Byte(at))?;
        colors.add(u16::from_le_bytes([triangle[48], triangle[49]]));
    }
    Ok(n_triangles)
}

/// Number of triangles to take of `body`, which begins `base` bytes and a header into the file.
fn count(body: &[u8], promised: u64, base: usize, notes: &mut Vec<String>) -> Result<usize, ReadError> {
    let held = body.len() / TRIANGLE_BYTES;
    let is_unknown = promised == 0 || promised == u64::from(u32::MAX);
    if promised > held as u64 && !is_unknown {
        return Err(ReadError::TooFewBytes {
            at: Place::Byte(base + HEADER_BYTES - 4),
            what: "triangles",
            count: promised,
            room: held as u64,
        });
    }
    let n_promised = if is_unknown { 0 } else { promised as usize };
    let trailing = &body[TRIANGLE_BYTES * n_promised..];
    if !is_unknown && begins_a_file(trailing) {
        return Ok(n_promised);
    }
    if !is_unknown && trailing.len() >= TRIANGLE_BYTES && trailing.starts_with(b"solid") {
        let at = Place::Byte(base + HEADER_BYTES + TRIANGLE_BYTES * n_promised);
        return Err(syntax_error(
            at,
            "the end of the file, not a text after the triangles; give each STL as a file of its own",
            trailing,
        ));
    }
    // A rest that is no whole triangle is padding, if what comes before it cannot be.
    let is_like = |bytes: &[u8]| {
        is_like_a_triangle(bytes)
            && (trailing.len().is_multiple_of(TRIANGLE_BYTES) || has_three_corners(bytes))
    };
    if n_promised < held && (is_unknown || trailing.chunks_exact(TRIANGLE_BYTES).all(is_like)) {
        notes.push(format!(
            "the header promises {promised} triangles, the file contains {held}; all were read"
        ));
        return Ok(held);
    }
    // Up to a triangle's length is padding.
    if trailing.len() >= TRIANGLE_BYTES {
        notes.push(format!(
            "{} bytes after the last triangle are not triangles and were skipped",
            trailing.len()
        ));
    }
    Ok(n_promised)
}

/// True if `bytes` start with a header whose count of triangles fits, and triangles follow.
fn begins_a_file(bytes: &[u8]) -> bool {
    let n = header_count(bytes)
        .and_then(|n| usize::try_from(n).ok())
        .filter(|&n| n > 0);
    let length = n.and_then(|n| n.checked_mul(TRIANGLE_BYTES));
    length
        .and_then(|length| bytes[HEADER_BYTES..].get(..length))
        .is_some_and(|body| body.chunks_exact(TRIANGLE_BYTES).all(is_like_a_triangle))
}

/// True if the corners of a triangle are three different points.
fn has_three_corners(bytes: &[u8]) -> bool {
    let corner = |k: usize| &bytes[12 + 12 * k..24 + 12 * k];
    corner(0) != corner(1) && corner(1) != corner(2) && corner(2) != corner(0)
}

/// Returns true if the normal is a unit vector or zero and the corners are finite.
fn is_like_a_triangle(bytes: &[u8]) -> bool {
    let float = |i: usize| float(&bytes[4 * i..]);
    let length_sq: f32 = (0..3).map(|i| float(i) * float(i)).sum();
    (length_sq == 0.0 || (length_sq - 1.0).abs() < 0.1) && (3..12).all(|i| float(i).is_finite())
}

/// Colours in the last two bytes of triangles: 5 bits each of red, green and blue, and a bit that tells if
/// they are valid.
#[derive(Default)]
struct FaceColors {
    /// Value of the highest bit in triangles with a colour of their own: set in most programs, not set in
    /// Magics, whose headers contain "COLOR=".
    valid: u16,
    numbering: Numbering<Option<u16>>,
    labels: Vec<i64>,
}

impl FaceColors {
    /// Starts with the triangles of a file with this header.
    fn begin(&mut self, header: &[u8]) {
        let is_magics = header.windows(6).any(|w| w == b"COLOR=");
        self.valid = u16::from(!is_magics);
    }

    fn add(&mut self, bits: u16) {
        let color = (bits >> 15 == self.valid).then_some(bits & 0x7FFF);
        self.labels.push(self.numbering.number(color));
    }
}

/// Reads an ASCII STL of any number of solids, in upper or lower case. A missing `endsolid` is accepted.
pub(super) fn read_ascii(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let mut polygons = Polygons::counted_from(0);
    let mut lines = Lines::of(bytes);
    let mut corners = Vec::new();
    let mut in_facet = false;
    let (mut solid, mut solids) = (0_i64, Vec::new());
    while let Some((at, line)) = lines.next() {
        let mut words = words(line);
        let Some(first) = words.next() else { continue };
        match (keyword(first), in_facet) {
            (b"facet", false) => in_facet = true,
            (b"vertex", true) => corners.push(polygons.add_point(point(&mut words, at)?, at)?),
            (b"outer" | b"endloop", true) => {}
            (b"endfacet", true) => {
                polygons.add_polygon(&corners, at)?;
                solids.push(solid);
                corners.clear();
                in_facet = false;
            }
            (b"solid", false) => solid += 1,
            (b"endsolid" | b"color", false) => {}
            // The file ends in the middle of a word.
            (_, true) if lines.rest().is_empty() => break,
            (_, true) => return Err(syntax_error(at, "\"vertex\" or \"endfacet\"", first)),
            (_, false) => return Err(syntax_error(at, "\"facet\" or \"endsolid\"", first)),
        }
    }
    if in_facet {
        return Err(ReadError::CutOff {
            at: lines.place(),
            within: "a facet",
        });
    }
    polygons.finish(Format::StlAscii, vec![(LabelSource::Object, solids)])
}

/// Returns `word` as a lower-case keyword; unchanged if it is none.
fn keyword(word: &[u8]) -> &[u8] {
    const ALL: [&[u8]; 8] = [
        b"vertex",
        b"facet",
        b"outer",
        b"endloop",
        b"endfacet",
        b"solid",
        b"endsolid",
        b"color",
    ];
    ALL.into_iter()
        .find(|k| k.eq_ignore_ascii_case(word))
        .unwrap_or(word)
}

/// Writes a binary STL with computed normals (zero for degenerate triangles) and coordinates rounded to
/// `f32`.
///
/// # Panics
///
/// Panics if a triangle refers to a missing point.
pub fn write_stl_binary(mesh: &TriMesh) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_BYTES + TRIANGLE_BYTES * mesh.triangles.len());
    bytes.extend_from_slice(HEADER_TEXT);
    bytes.resize(HEADER_BYTES - 4, 0);
    bytes.extend_from_slice(&(mesh.triangles.len() as u32).to_le_bytes());
    for face in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(face);
        for vector in [mesh.face_normal(face), a, b, c] {
            vector
                .to_array()
                .iter()
                .for_each(|&x| bytes.extend_from_slice(&(x as f32).to_le_bytes()));
        }
        bytes.extend_from_slice(&[0; 2]);
    }
    bytes
}

/// Number of triangles given in a binary header.
fn header_count(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(HEADER_BYTES - 4..HEADER_BYTES)?;
    Some(u64::from(u32::from_le_bytes([
        count[0], count[1], count[2], count[3],
    ])))
}

fn float(bytes: &[u8]) -> f32 {
    f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

#[cfg(test)]
mod tests {
    use super::super::write_stl_binary;
    use super::*;
    use shellock_testkit::shapes::tetrahedron;

    #[test]
    fn files_one_after_the_other_are_all_read_and_text_after_triangles_is_refused() {
        let one = write_stl_binary(&tetrahedron());
        let three = read_binary(&one.repeat(3)).unwrap();
        assert_eq!((three.mesh.triangles.len(), three.notes.len()), (12, 1));
        let mixed = [
            &one[..],
            b"solid x\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n",
        ]
        .concat();
        assert!(matches!(
            read_binary(&mixed),
            Err(ReadError::Malformed {
                at: Place::Byte(284),
                ..
            })
        ));
    }

    #[test]
    fn triangles_beyond_a_count_that_is_too_low_are_read_before_padding_too() {
        let mut bytes = write_stl_binary(&tetrahedron());
        bytes[80..84].copy_from_slice(&2_u32.to_le_bytes());
        bytes.extend([0; 7]);
        let loaded = read_binary(&bytes).unwrap();
        assert_eq!((loaded.mesh.triangles.len(), loaded.notes.len()), (4, 1));
        // Zeros are no triangles.
        let mut padded = write_stl_binary(&tetrahedron());
        padded.extend([0; 120]);
        assert_eq!(read_binary(&padded).unwrap().mesh.triangles.len(), 4);
    }
}
