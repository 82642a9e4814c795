//! Readers and writers of mesh files, from bytes and to bytes.
//!
//! | format | read | written |
//! |---|---|---|
//! | STL | binary, ASCII, colours of both dialects | binary |
//! | OBJ | text; groups, objects, materials, colours of points | |
//! | PLY | ASCII, binary of both byte orders, strips, face labels | binary, face labels |
//! | | colours of faces and points | |
//! | OFF | text, colours of faces and points | |
//! | 3MF | units, components, transforms, several files, materials, paint | coloured pieces; a painted body |
//! | | roles of parts, negative volumes, named sets | |
//! | glTF, GLB | nodes, skins, morph targets, instances, all modes of triangles | |
//! | | materials, colours of points | |
//! | `.seg` | one label per line | one label per line |
//!
//! Each of them may be packed by gzip, be the only mesh in a zip archive, be stored as UTF-16, or have a
//! wrong extension.
//!
//! Readers accept the variants found in practice and reject the rest with a place: a line of a text, a byte
//! of a file. They never panic, and reserve no memory that the given bytes do not justify. Coordinates are
//! kept as they are ([`Loaded::unit_mm`] gives the file's unit, if it has one). Points are not merged: that
//! is [`shellock_geom::weld`]. Surfaces are not checked: that is [`shellock_geom::check`].

mod assembly;
mod carve;
mod container;
mod error;
mod gltf;
mod labels;
mod obj;
mod off;
mod paint;
mod ply;
mod point_colors;
mod polygons;
mod recognise;
mod select;
mod stl;
mod text;
mod threemf;

use std::fmt;

pub use error::ReadError;
pub use labels::{read_labels, write_labels};
pub use ply::write_ply;
pub use select::{Selection, Titles};
pub use stl::write_stl_binary;
pub use threemf::{NamedObject, write_3mf, write_painted_3mf};

use recognise::recognise;
use shellock_geom::{Aabb, TriMesh};

/// A mesh as stored in its file, with polygons divided into triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// Points in file units, in file order; an STL has three points of its own per triangle.
    pub mesh: TriMesh,
    /// Ways in which the file divides its surface, each at most once, in the order of [`LabelSource`].
    pub labellings: Vec<Labelling>,
    /// Index of the file's face that each triangle came from, from 0; ascending.
    pub file_face: Vec<u32>,
    /// Format found in the content.
    pub format: Format,
    /// Length of a file unit, mm, if the format has one.
    pub unit_mm: Option<f64>,
    /// True if the file states the unit itself. Otherwise the unit is the one that the format prescribes,
    /// which many programs ignore.
    pub has_unit: bool,
    /// Objects of the file, indexed by the labels of [`LabelSource::Object`]. Empty if the format has no
    /// names, or if an OBJ is not wholly divided into named objects.
    pub objects: Vec<FileObject>,
    /// Plates of the slicer's project on which nothing is to be printed.
    pub empty_plates: Vec<FilePlate>,
    /// Parts that are still to be cut out of others; [`read_mesh`] has done it.
    pub cutters: Vec<Cutter>,
    /// Notes for the user about how the bytes were read.
    pub notes: Vec<String>,
}

impl Loaded {
    /// Number of faces in the file; a polygon counts once.
    pub fn n_file_faces(&self) -> usize {
        // No reader drops a face, so the last triangle belongs to the last face.
        self.file_face.last().map_or(0, |&face| face as usize + 1)
    }

    /// Bounding box of the triangles, file units; unused points do not count.
    pub fn bounds(&self) -> Aabb {
        (0..self.mesh.triangles.len()).fold(Aabb::EMPTY, |bounds, face| {
            bounds.union(Aabb::around(self.mesh.corners(face)))
        })
    }

    /// Returns one label per triangle for `source`; `None` if the file has none.
    pub fn labels(&self, source: LabelSource) -> Option<&[i64]> {
        self.labellings
            .iter()
            .find(|l| l.source == source)
            .map(|l| &l.labels[..])
    }

    /// Returns labels that were assigned on purpose: a property of the faces, or paint.
    pub fn face_labels(&self) -> Option<&[i64]> {
        self.labels(LabelSource::Property)
            .or_else(|| self.labels(LabelSource::Paint))
    }
}

/// An object of a file, or a part of one.
#[derive(Clone, Debug, PartialEq)]
pub struct FileObject {
    /// Name of the object in the file.
    pub name: Option<String>,
    /// Name of the part in the file, if the object consists of several.
    pub part: Option<String>,
    /// Number of the object, from 0; shared by its parts.
    pub item: u32,
    /// Plate of the object in the slicer's project.
    pub plate: Option<FilePlate>,
}

/// A plate of a slicer's project.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilePlate {
    /// Number of the plate, from 1.
    pub number: u32,
    /// Name of the plate in the project.
    pub name: Option<String>,
}

/// A part that is cut out of an object ("negative volume").
#[derive(Clone, Debug, PartialEq)]
pub struct Cutter {
    /// Name of the part, for messages.
    pub name: String,
    /// [`FileObject::item`] of the object that it is cut out of.
    pub item: u32,
    /// Mesh of the part in the coordinates of the object, file units.
    pub mesh: TriMesh,
}

/// A division of the surface: one label per triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Labelling {
    /// Feature of the file that the labels come from.
    pub source: LabelSource,
    /// One label per triangle. Labels of [`LabelSource::Property`] are the file's own values, those of
    /// [`LabelSource::Paint`] the numbers of colours. Others only tell classes apart; most are numbered from
    /// 0 by first occurrence.
    pub labels: Vec<i64>,
}

/// Features of a file that can divide a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LabelSource {
    /// Integer property of faces called "label", "segment" or the like (PLY).
    Property,
    /// Multi-material paint of PrusaSlicer, Bambu Studio and OrcaSlicer (3MF).
    Paint,
    /// Colours of faces (STL, PLY, OFF, 3MF). If those do not divide the surface, colours of points (PLY,
    /// OBJ, OFF, glTF).
    Color,
    /// Materials of faces (OBJ, 3MF, glTF).
    Material,
    /// Named groups of faces (OBJ).
    Group,
    /// Named sets of triangles (3MF).
    Set,
    /// Objects, solids or nodes (OBJ, STL, 3MF, glTF).
    Object,
}

impl fmt::Display for LabelSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Property => "labels",
            Self::Paint => "paint",
            Self::Color => "colors",
            Self::Material => "materials",
            Self::Group => "groups",
            Self::Set => "sets",
            Self::Object => "objects",
        })
    }
}

/// File formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Binary STL, 50 bytes per triangle.
    StlBinary,
    /// ASCII STL, as text.
    StlAscii,
    /// Wavefront OBJ, as text.
    Obj,
    /// Polygon file format, ASCII or binary.
    Ply,
    /// Object file format of Geomview.
    Off,
    /// 3D Manufacturing Format, a zip archive.
    ThreeMf,
    /// glTF as text, with its data inside.
    Gltf,
    /// GLB, the binary form of glTF.
    Glb,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::StlBinary => "binary STL",
            Self::StlAscii => "ASCII STL",
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Off => "OFF",
            Self::ThreeMf => "3MF",
            Self::Gltf => "glTF",
            Self::Glb => "GLB",
        })
    }
}

/// Position in a file, for messages.
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

/// Reads a mesh. The content decides the format; `extension` ("stl", ".OBJ") counts only if the content
/// leaves it open.
///
/// Guarantees: at least one triangle, all points finite, all indices in range, and negative volumes cut out.
/// Not promised: anything about the surface.
pub fn read_mesh(bytes: &[u8], extension: Option<&str>) -> Result<Loaded, ReadError> {
    read_selection(bytes, extension, &Selection::default())
}

/// Reads the part of a mesh file that `selection` names; otherwise like [`read_mesh`].
pub fn read_selection(
    bytes: &[u8],
    extension: Option<&str>,
    selection: &Selection,
) -> Result<Loaded, ReadError> {
    let loaded = read_whole(bytes, extension)?;
    carve::carve(select::select(loaded, selection)?)
}

/// Reads all contents of a file, unchanged.
fn read_whole(bytes: &[u8], extension: Option<&str>) -> Result<Loaded, ReadError> {
    let (bytes, name) = container::unpack(bytes)?;
    let inner = name
        .as_deref()
        .and_then(|n| n.rsplit_once('.'))
        .map(|(_, extension)| extension);
    let mut loaded = match recognise(&bytes, inner.or(extension))? {
        Format::StlBinary => stl::read_binary(&bytes),
        Format::StlAscii => stl::read_ascii(&bytes),
        Format::Obj => obj::read(&bytes),
        Format::Ply => ply::read(&bytes),
        Format::Off => off::read(&bytes),
        Format::ThreeMf => threemf::read(&bytes),
        Format::Gltf => gltf::read_text(&bytes),
        Format::Glb => gltf::read_binary(&bytes),
    }?;
    loaded
        .notes
        .extend(name.map(|name| format!("the archive's only mesh was read: {name}")));
    Ok(loaded)
}

#[cfg(test)]
mod tests;
