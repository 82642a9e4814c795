//! Mesh files from bytes and to bytes.
//!
//! | format | read | written |
//! |---|---|---|
//! | STL | binary, ASCII | binary |
//! | OBJ | text | |
//! | PLY | ASCII, binary of both byte orders, face labels | binary, face labels |
//! | OFF | text | |
//! | 3MF | refused by name | one object per piece, coloured |
//! | `.seg` | one label a line | the same |
//!
//! Readers take what files in the wild hold and refuse the rest with a place: a line of a text, a byte of a binary file.
//! They never panic and reserve no memory that the bytes at hand do not back. Coordinates are taken as they stand (most
//! formats have no unit) and points are not merged: that is [`crate::weld`]; whether the surface is a body is
//! [`crate::check`].

mod labels;
mod obj;
mod off;
mod ply;
mod polygons;
mod recognise;
mod stl;
mod text;
mod threemf;

use std::fmt;

pub use labels::{read_labels, write_labels};
pub use ply::write_ply;
pub use stl::write_stl_binary;
pub use threemf::{NamedObject, write_3mf};

use crate::TriMesh;
use recognise::recognise;

/// A mesh as its file has it, polygons cut into fans of triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// Points in file units, in file order; an STL has three of its own for each triangle.
    pub mesh: TriMesh,
    /// One label for each triangle, where the file labels its faces (PLY only).
    pub face_labels: Option<Vec<i64>>,
    /// For each triangle the face of the file it came from, counted from 0; ascending.
    pub file_face: Vec<u32>,
    /// What the bytes turned out to be.
    pub format: Format,
}

impl Loaded {
    /// How many faces the file has; polygons count once.
    pub fn n_file_faces(&self) -> usize {
        // No reader drops a face, so the last triangle belongs to the last face.
        self.file_face.last().map_or(0, |&face| face as usize + 1)
    }
}

/// The formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// STL, 50 bytes a triangle.
    StlBinary,
    /// STL as text.
    StlAscii,
    /// Wavefront OBJ.
    Obj,
    /// Polygon file format, ASCII or binary.
    Ply,
    /// Object file format of Geomview.
    Off,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::StlBinary => "binary STL",
            Self::StlAscii => "ASCII STL",
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Off => "OFF",
        })
    }
}

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of a text, counted from 1.
    Line(usize),
    /// Offset in a binary file, counted from 0.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// Why bytes are no mesh (or no list of labels).
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReadError {
    /// No bytes, or nothing but blanks.
    #[error("the file is empty; export it again")]
    Empty,
    /// A 3MF package.
    #[error("3MF is not read yet; export the model as STL, OBJ, PLY or OFF")]
    ThreeMf,
    /// Some other zip archive.
    #[error("the file is a zip archive; unpack it and give the mesh file inside")]
    Zip,
    /// Two bytes a character.
    #[error("the text is stored as UTF-16; save it as UTF-8 or plain ASCII")]
    Utf16,
    /// Neither the content nor the extension says what it is.
    #[error("the content is neither STL, OBJ, PLY nor OFF; export the model in one of these formats")]
    UnknownFormat,
    /// A variant of a known format that is not read.
    #[error("{at}: {what} is not read; export the model as binary STL or PLY")]
    Unsupported {
        /// The variant.
        what: &'static str,
        /// Where it says so.
        at: Place,
    },
    /// Something else stands where a certain word or number should.
    #[error("{at}: expected {expected}, found \"{found}\"; correct it there or export the file again")]
    Malformed {
        /// Where.
        at: Place,
        /// What should stand there.
        expected: &'static str,
        /// What stands there, shortened.
        found: String,
    },
    /// The bytes end too early.
    #[error("{at}: the file ends in the middle of {within}; it was cut off: copy or export it again")]
    CutOff {
        /// The end.
        at: Place,
        /// What is incomplete.
        within: &'static str,
    },
    /// A header's count cannot be true.
    #[error(
        "{at}: the header promises {promised} {what}, but the file has room for {room} only; \
         it was cut off or its header is wrong: copy or export it again"
    )]
    TooFewBytes {
        /// Where the count or what it counts stands.
        at: Place,
        /// What is counted.
        what: &'static str,
        /// The count of the header.
        promised: u64,
        /// What the bytes could hold at most.
        room: u64,
    },
    /// A binary STL goes on after its last triangle.
    #[error(
        "{at}: the header promises {promised} triangles, but the file holds {held}; \
         its header is wrong: export it again"
    )]
    MoreTriangles {
        /// Where the promised triangles end.
        at: Place,
        /// The count of the header.
        promised: u64,
        /// What the bytes hold.
        held: u64,
    },
    /// A coordinate is NaN or infinite, or too large for a float.
    #[error("{at}: a coordinate is not a finite number (NaN or infinite); repair the model where it was made")]
    NotFinite {
        /// Where.
        at: Place,
    },
    /// A face names a point that is not there.
    #[error(
        "{at}: a face uses point {index}, but the file has {n_points} points, counted from {first}; \
         export the model again"
    )]
    MissingPoint {
        /// Where the face stands.
        at: Place,
        /// The index as the file has it.
        index: i64,
        /// How many points there are.
        n_points: usize,
        /// Index of the first point in this format.
        first: u32,
    },
    /// A face of fewer than three corners.
    #[error("{at}: a face has {n_corners} corners, it needs 3 or more; export the model again")]
    TooFewCorners {
        /// Where.
        at: Place,
        /// How many it has.
        n_corners: usize,
    },
    /// Points or nothing at all.
    #[error("the {format} file has no triangles ({n_points} points); export the model as a surface mesh")]
    NoTriangles {
        /// The format.
        format: Format,
        /// How many points there are.
        n_points: usize,
    },
    /// More than indices of 32 bits can tell apart.
    #[error("{at}: more than 4 thousand million points or triangles; simplify the model first")]
    TooLarge {
        /// Where the limit is passed.
        at: Place,
    },
    /// A label below 0.
    #[error("{at}: the label {label} is negative; number the parts from 0")]
    NegativeLabel {
        /// Where.
        at: Place,
        /// The label.
        label: i64,
    },
}

/// Reads a mesh; the content decides what it is, and `extension` ("stl", ".OBJ") only where the content leaves it open.
///
/// Guarantees: at least one triangle, all points finite, all indices in range. Not promised: anything about the surface.
pub fn read_mesh(bytes: &[u8], extension: Option<&str>) -> Result<Loaded, ReadError> {
    match recognise(bytes, extension)? {
        Format::StlBinary => stl::read_binary(bytes),
        Format::StlAscii => stl::read_ascii(bytes),
        Format::Obj => obj::read(bytes),
        Format::Ply => ply::read(bytes),
        Format::Off => off::read(bytes),
    }
}

#[cfg(test)]
mod tests;
