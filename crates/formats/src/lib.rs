//! Mesh files from bytes and to bytes.
//!
//! | format | read | written |
//! |---|---|---|
//! | STL | binary, ASCII, colours of both dialects | binary |
//! | OBJ | text; groups, objects, materials, colours of points | |
//! | PLY | ASCII, binary of both byte orders, strips, face labels, colours of faces and points | binary, face labels |
//! | OFF | text, colours of faces and points | |
//! | 3MF | units, components, transforms, several files, materials, paint, roles of parts, negative volumes, named sets | pieces, coloured; one body, painted |
//! | glTF, GLB | nodes, skins, morph targets, instances, all modes of triangles, materials, colours of points | |
//! | `.seg` | one label a line | the same |
//!
//! Any of them may be packed by gzip, lie alone in a zip archive, be stored as UTF-16 or have a wrong name.
//!
//! Readers take what files in the wild hold and refuse the rest with a place: a line of a text, a byte of a
//! file. They never panic and reserve no memory that the bytes at hand do not back. Coordinates are taken as
//! they stand ([`Loaded::unit_mm`] says where the file has a unit) and points are not merged: that is
//! [`shellock_geom::weld`]; whether the surface is a body is [`shellock_geom::check`].

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

/// A mesh as its file has it, polygons cut into triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// Points in file units, in file order; an STL has three of its own for each triangle.
    pub mesh: TriMesh,
    /// The ways in which the file divides its surface, each at most once, in the order of [`LabelSource`].
    pub labellings: Vec<Labelling>,
    /// For each triangle the face of the file it came from, counted from 0; ascending.
    pub file_face: Vec<u32>,
    /// What the bytes turned out to be.
    pub format: Format,
    /// Length of a file unit, mm, where the format has one.
    pub unit_mm: Option<f64>,
    /// Whether the file states that unit itself; else it is what the format prescribes, which many programs
    /// ignore.
    pub unit_is_stated: bool,
    /// Objects of the file, by the labels of [`LabelSource::Object`]; empty where the format has no names.
    pub objects: Vec<FileObject>,
    /// Plates of the slicer's project on which nothing is to be printed.
    pub empty_plates: Vec<FilePlate>,
    /// Parts that are still to be cut out of others; [`read_mesh`] has done it.
    pub cutters: Vec<Cutter>,
    /// What a person should know about how the bytes were taken.
    pub notes: Vec<String>,
}

impl Loaded {
    /// How many faces the file has; polygons count once.
    pub fn n_file_faces(&self) -> usize {
        // No reader drops a face, so the last triangle belongs to the last face.
        self.file_face.last().map_or(0, |&face| face as usize + 1)
    }

    /// The box around the triangles, file units; points that none of them uses do not count.
    pub fn bounds(&self) -> Aabb {
        (0..self.mesh.triangles.len()).fold(Aabb::EMPTY, |bounds, face| {
            bounds.union(Aabb::around(self.mesh.corners(face)))
        })
    }

    /// One label for each triangle as `source` has them; `None` where the file has none.
    pub fn labels(&self, source: LabelSource) -> Option<&[i64]> {
        self.labellings
            .iter()
            .find(|l| l.source == source)
            .map(|l| &l.labels[..])
    }

    /// Labels that somebody gave on purpose: a property of the faces, or paint.
    pub fn face_labels(&self) -> Option<&[i64]> {
        self.labels(LabelSource::Property)
            .or_else(|| self.labels(LabelSource::Paint))
    }
}

/// An object of a file, or a part of one.
#[derive(Clone, Debug, PartialEq)]
pub struct FileObject {
    /// What the file calls the object.
    pub name: Option<String>,
    /// What the file calls the part, where the object is made of several.
    pub part: Option<String>,
    /// Number of the object, from 0; its parts share it.
    pub item: u32,
    /// Where the object lies in the slicer's project.
    pub plate: Option<FilePlate>,
}

/// A plate of a slicer's project.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilePlate {
    /// From 1.
    pub number: u32,
    /// What the project calls it.
    pub name: Option<String>,
}

/// A part that is cut out of an object ("negative volume").
#[derive(Clone, Debug, PartialEq)]
pub struct Cutter {
    /// For messages.
    pub name: String,
    /// [`FileObject::item`] of what it is cut out of.
    pub item: u32,
    /// In the same place as the object, file units.
    pub mesh: TriMesh,
}

/// One label for each triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Labelling {
    /// What of the file tells them apart.
    pub source: LabelSource,
    /// As many as triangles. Those of [`LabelSource::Property`] stand in the file; others are numbered from 0
    /// as they first occur, paint by its colour.
    pub labels: Vec<i64>,
}

/// What can divide a surface in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LabelSource {
    /// A whole number called "label", "segment" or the like (PLY).
    Property,
    /// Multi-material paint of PrusaSlicer, Bambu Studio and OrcaSlicer (3MF).
    Paint,
    /// Colours of faces (STL, PLY, OFF, 3MF) or, where those do not divide it, of points (PLY, OBJ, OFF, glTF).
    Color,
    /// Materials (OBJ, 3MF, glTF).
    Material,
    /// Groups (OBJ).
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
    /// 3D Manufacturing Format.
    ThreeMf,
    /// glTF as text, its data within.
    Gltf,
    /// glTF, binary.
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

/// Reads a mesh; the content decides what it is, and `extension` ("stl", ".OBJ") only where the content
/// leaves it open.
///
/// Guarantees: at least one triangle, all points finite, all indices in range; what the file says is cut out
/// is cut out. Not promised: anything about the surface.
pub fn read_mesh(bytes: &[u8], extension: Option<&str>) -> Result<Loaded, ReadError> {
    read_selected(bytes, extension, &Selection::default())
}

/// Reads the part of a mesh file that `selection` names; otherwise as [`read_mesh`].
pub fn read_selected(
    bytes: &[u8],
    extension: Option<&str>,
    selection: &Selection,
) -> Result<Loaded, ReadError> {
    let loaded = read_whole(bytes, extension)?;
    carve::carve(select::select(loaded, selection)?)
}

/// All that a file holds, as it stands there.
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
