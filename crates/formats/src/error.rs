//! Refusals of bytes, in words.

use super::{Format, Place};

/// Why bytes are no mesh (or no list of labels).
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReadError {
    /// No bytes, or nothing but blanks.
    #[error("the file is empty; export it again")]
    Empty,
    /// An archive without a model, or with several.
    #[error(
        "the file is a zip archive with {n_models} mesh files in it; unpack it and give the one you want"
    )]
    Archive {
        /// Files in it whose names are those of meshes.
        n_models: usize,
    },
    /// A zip or gzip that cannot be unpacked.
    #[error("the archive is damaged ({reason}); download or export the file again")]
    Damaged {
        /// What the unpacker says.
        reason: String,
    },
    /// An archive that is packed, or locked, in a way that is not read.
    #[error(
        "the archive cannot be opened ({reason}); pack it again as an ordinary zip, or give the plain mesh file"
    )]
    Packing {
        /// What the unpacker says.
        reason: String,
    },
    /// Unpacking would take more memory than an honest file needs.
    #[error(
        "unpacked, the file has more than {limit_mb} MB; it is broken or hostile: export a plain mesh file"
    )]
    Bomb {
        /// The limit for a file of this size.
        limit_mb: u64,
    },
    /// Parts put together from parts have too many triangles.
    #[error("{what} gives more than {limit} triangles; simplify the model first")]
    TooManyCopies {
        /// What multiplies.
        what: &'static str,
        /// The limit.
        limit: u64,
    },
    /// A part is made of parts that contain it.
    #[error("{kind} {id} contains itself, directly or through others; export the model again")]
    Cycle {
        /// "object" or "node".
        kind: &'static str,
        /// Its id in the file.
        id: String,
    },
    /// A part names another that is not there.
    #[error("{kind} {id} is used, but is not in the file; export the model again")]
    MissingPart {
        /// "object", "mesh", "buffer", ….
        kind: &'static str,
        /// Its id in the file.
        id: String,
    },
    /// Something else that people have lying beside their models.
    #[error("this is {what}, not a model; give the model itself as STL, OBJ, PLY, OFF, 3MF or glTF")]
    NotAModel {
        /// What it is.
        what: &'static str,
    },
    /// Neither the content nor the extension says what it is.
    #[error(
        "the content is neither STL, OBJ, PLY, OFF, 3MF nor glTF; export the model in one of these formats"
    )]
    UnknownFormat,
    /// A variant of a known format that is not read.
    #[error("{at}: {what} is not read; export the model as 3MF, binary STL or PLY")]
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
    /// A 3MF that requires an extension which is not read: its shape would be wrong without.
    #[error(
        "the file requires the 3MF extension \"{name}\", which is not read; export it as a plain mesh: 3MF without \
         extensions, or STL"
    )]
    Extension {
        /// Its name for people, or its namespace.
        name: String,
    },
    /// An object whose shape is given in a way that is not read.
    #[error(
        "{object} is not given by a mesh alone, but by \"{shape}\", which is not read; export it as a plain mesh: 3MF \
         without extensions, or STL"
    )]
    Shape {
        /// The object, with its name or number.
        object: String,
        /// The extension, or the element.
        shape: String,
    },
    /// Tool paths for a printer instead of a model.
    #[error(
        "this is a sliced file: it holds G-code for a printer and no model; give the project that it was sliced from (.3mf)"
    )]
    Sliced,
    /// A file of which nothing is to be printed.
    #[error(
        "the file has nothing but {what} ({names}), which are left out; give a file with the model itself"
    )]
    NothingPrinted {
        /// What there is.
        what: &'static str,
        /// Its names.
        names: String,
    },
    /// A part that is to be cut out, and cannot be.
    #[error("the negative volume {name} cannot be cut out: {reason}")]
    Cut {
        /// The part.
        name: String,
        /// Why.
        reason: String,
    },
    /// A plate of which nothing is printed.
    #[error("plate {plate} holds nothing that the slicer is to print; what is printed lies on: {has}")]
    EmptyPlate {
        /// The number or name asked for.
        plate: String,
        /// Plates of which something is printed.
        has: String,
    },
    /// An object out of which nothing can be cut.
    #[error("negative volumes cannot be cut out of \"{object}\": {reason}")]
    CutBody {
        /// The object.
        object: String,
        /// Why.
        reason: String,
    },
    /// An object of which a cut leaves nothing.
    #[error("nothing is left of \"{object}\" after {cutters} is cut out; make what is cut out smaller")]
    NothingLeft {
        /// The object.
        object: String,
        /// What is cut out.
        cutters: String,
    },
    /// No object, or no plate, of the name asked for.
    #[error("{within} has no {what} \"{wanted}\"; it has {has}")]
    NoSuchPart {
        /// "the file" or "plate 1".
        within: String,
        /// "object" or "plate".
        what: &'static str,
        /// The name asked for.
        wanted: String,
        /// The names that there are.
        has: String,
    },
    /// A zip archive with a file of a 3MF in it that no relation names.
    #[error(
        "the file is a zip archive with a .model file in it, but no 3MF: neither does _rels/.rels name a model nor is there \
         3D/3dmodel.model; export it again as 3MF, or unpack it and give the mesh in it"
    )]
    NoRoot,
    /// Settings of a slicer that cannot be read.
    #[error(
        "{part}, {at}: {reason}; so the roles of parts are unknown, such as which are cut out: save the project again in the \
         slicer, or export plain 3MF or STL"
    )]
    Settings {
        /// The file within the package.
        part: String,
        /// Where in it.
        at: Place,
        /// What is wrong.
        reason: String,
    },
    /// A part of a 3MF package that is not what it should be.
    #[error("{part}, {at}: {reason}; export the model again")]
    Xml {
        /// The file within the package.
        part: String,
        /// Where in it.
        at: Place,
        /// What is wrong.
        reason: String,
    },
    /// glTF whose description is not what it should be.
    #[error("the glTF cannot be read: {reason}; export the model again, with its data inside (.glb)")]
    Gltf {
        /// What is wrong.
        reason: String,
    },
    /// glTF that has or needs something that is not read.
    #[error("the glTF {what}; {remedy}")]
    GltfUnsupported {
        /// The feature that it has or needs.
        what: String,
        /// Advice.
        remedy: &'static str,
    },
    /// Paint of a triangle that is no code of PrusaSlicer or Bambu Studio.
    #[error(
        "the paint \"{code}\" of a triangle cannot be read; paint the model again in the slicer, or remove the paint"
    )]
    Paint {
        /// The triangle within its object.
        face: u32,
        /// The code, shortened.
        code: String,
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
    /// A coordinate is NaN or infinite, or too large for a float.
    #[error(
        "{at}: a coordinate is not a finite number (NaN or infinite); repair the model where it was made"
    )]
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
