//! Errors of the readers, with messages for users.

use super::{Format, Place};

/// Reasons why bytes are no mesh (or no list of labels).
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReadError {
    /// No bytes, or nothing but white space.
    #[error("the file is empty; export it again")]
    Empty,
    /// An archive without a mesh, or with several.
    #[error(
        "the file is a zip archive with {n_models} mesh files in it; unpack it and give the one you want"
    )]
    Archive {
        /// Number of files with names of meshes.
        n_models: usize,
    },
    /// A zip or gzip that cannot be unpacked.
    #[error("the archive is damaged ({reason}); download or export the file again")]
    Damaged {
        /// Message of the unpacking library.
        reason: String,
    },
    /// An archive with an unsupported compression, or with a password.
    #[error(
        "the archive cannot be opened ({reason}); pack it again as an ordinary zip, or give the plain mesh \
         file"
    )]
    Packing {
        /// Message of the unpacking library.
        reason: String,
    },
    /// An archive that unpacks to more memory than an honest file needs.
    #[error(
        "unpacked, the file has more than {limit_mb} MB; it is broken or hostile: export a plain mesh file"
    )]
    Bomb {
        /// Limit for a file of this size, MB.
        limit_mb: u64,
    },
    /// Too many triangles after repeated parts are put together.
    #[error("{what} gives more than {limit} triangles; simplify the model first")]
    TooManyCopies {
        /// Cause of the multiplication.
        what: &'static str,
        /// Largest number that is accepted.
        limit: u64,
    },
    /// A part that contains itself, directly or through others.
    #[error("{kind} {id} contains itself, directly or through others; export the model again")]
    Cycle {
        /// Kind of part: "object" or "node".
        kind: &'static str,
        /// Id of the part in the file.
        id: String,
    },
    /// A reference to a part that does not exist.
    #[error("{kind} {id} is used, but is not in the file; export the model again")]
    MissingPart {
        /// Kind of part: "object", "mesh", "buffer", ….
        kind: &'static str,
        /// Id of the part in the file.
        id: String,
    },
    /// A file of another kind, as people have beside their models.
    #[error("this is {what}, not a model; give the model itself as STL, OBJ, PLY, OFF, 3MF or glTF")]
    NotAModel {
        /// Description of the file's kind.
        what: &'static str,
    },
    /// A file whose format neither content nor extension reveals.
    #[error(
        "the content is neither STL, OBJ, PLY, OFF, 3MF nor glTF; export the model in one of these formats"
    )]
    UnknownFormat,
    /// An unsupported variant of a known format.
    #[error("{at}: {what} is not supported; export the model as 3MF, binary STL or PLY")]
    Unsupported {
        /// Description of the unsupported variant.
        what: &'static str,
        /// Place that declares the variant.
        at: Place,
    },
    /// A wrong word or number in place of an expected one.
    #[error("{at}: expected {syntax}, found \"{text}\"; correct it there or export the file again")]
    Malformed {
        /// Place of the wrong text.
        at: Place,
        /// Description of the expected text.
        syntax: &'static str,
        /// Text found there, shortened.
        text: String,
    },
    /// A 3MF that requires an unsupported extension: its shape would be wrong without.
    #[error(
        "the file requires the 3MF extension \"{name}\", which is not supported; export it as a plain mesh: \
         3MF without extensions, or STL"
    )]
    Extension {
        /// Common name of the extension, or its namespace.
        name: String,
    },
    /// An object whose shape is given in an unsupported way.
    #[error(
        "{object} is not given by a mesh alone, but by \"{shape}\", which is not supported; export it as a \
         plain mesh: 3MF without extensions, or STL"
    )]
    Shape {
        /// Object, by its name or number.
        object: String,
        /// Name of the extension, or of the element.
        shape: String,
    },
    /// Tool paths for a printer instead of a model.
    #[error(
        "this is a sliced file: it contains G-code for a printer and no model; give the project that it was \
         sliced from (.3mf)"
    )]
    Sliced,
    /// A file in which nothing is to be printed.
    #[error("the file contains only {what} ({names}), which are left out; give a file with the model itself")]
    NothingPrinted {
        /// Kind of the parts present.
        what: &'static str,
        /// Names of the parts present.
        names: String,
    },
    /// A negative volume that cannot be cut out.
    #[error("the negative volume {name} cannot be cut out: {reason}")]
    Cut {
        /// Name of the part.
        name: String,
        /// Reason why it failed.
        reason: String,
    },
    /// A plate of which nothing is printed.
    #[error("plate {plate} has nothing to print; plates with something to print: {has}")]
    EmptyPlate {
        /// The number or name asked for.
        plate: String,
        /// Plates of which something is printed.
        has: String,
    },
    /// An object out of which nothing can be cut.
    #[error("negative volumes cannot be cut out of \"{object}\": {reason}")]
    CutBody {
        /// Name of the object.
        object: String,
        /// Reason, as the end of the message.
        reason: String,
    },
    /// An object of which a cut leaves nothing.
    #[error("nothing is left of \"{object}\" after {cutters} is cut out; make the negative volume smaller")]
    NothingLeft {
        /// Name of the object.
        object: String,
        /// Names of the parts that are cut out.
        cutters: String,
    },
    /// No object, or no plate, of the name asked for.
    #[error("{within} has no {what} \"{name}\"; it has {has}")]
    NoSuchPart {
        /// Place that was searched: "the file" or "plate 1".
        within: String,
        /// Kind of thing that is missing: "object" or "plate".
        what: &'static str,
        /// Name that was asked for.
        name: String,
        /// Names that the file has.
        has: String,
    },
    /// A zip archive with a file of a 3MF in it that no relation names.
    #[error(
        "the file is a zip archive with a .model file in it, but no 3MF: neither does _rels/.rels name a \
         model nor is there 3D/3dmodel.model; export it again as 3MF, or unpack it and give the mesh in it"
    )]
    NoRoot,
    /// Settings of a slicer that cannot be read.
    #[error(
        "{part}, {at}: {reason}; so the roles of parts are unknown, such as which are cut out: save the \
         project again in the slicer, or export plain 3MF or STL"
    )]
    Settings {
        /// The file within the package.
        part: String,
        /// Place in that file.
        at: Place,
        /// Description of the problem.
        reason: String,
    },
    /// A part of a 3MF package that is not what it should be.
    #[error("{part}, {at}: {reason}; export the model again")]
    Xml {
        /// File within the package.
        part: String,
        /// Place in that file.
        at: Place,
        /// Description of the problem.
        reason: String,
    },
    /// glTF with an invalid description.
    #[error("the glTF cannot be read: {reason}; export the model again, with its data inside (.glb)")]
    Gltf {
        /// Description of the problem.
        reason: String,
    },
    /// glTF that has or needs an unsupported feature.
    #[error("the glTF {what}; {remedy}")]
    GltfUnsupported {
        /// Feature that it has or needs.
        what: String,
        /// Advice for the user.
        remedy: &'static str,
    },
    /// Paint of a triangle that is no code of PrusaSlicer or Bambu Studio.
    #[error(
        "the paint \"{code}\" of a triangle cannot be read; paint the model again in the slicer, or remove \
         the paint"
    )]
    Paint {
        /// Index of the triangle within its object.
        face: u32,
        /// Code of the paint, shortened.
        code: String,
    },
    /// A file that ends too early.
    #[error("{at}: the file ends in the middle of {within}; it was cut off: copy or export it again")]
    CutOff {
        /// End of the file.
        at: Place,
        /// Name of the incomplete part.
        within: &'static str,
    },
    /// A count in a header that cannot be true.
    #[error(
        "{at}: the header promises {count} {what}, but the file has room for {room} only; it was cut off \
         or its header is wrong: copy or export it again"
    )]
    TooFewBytes {
        /// Place of the count, or of the items counted.
        at: Place,
        /// Name of the items counted.
        what: &'static str,
        /// Count given in the header.
        count: u64,
        /// Largest count for which the bytes suffice.
        room: u64,
    },
    /// A coordinate that is NaN, infinite, or too large for a float.
    #[error(
        "{at}: a coordinate is not a finite number (NaN or infinite); repair the model in the program that \
         made it"
    )]
    NotFinite {
        /// Place of the coordinate.
        at: Place,
    },
    /// A face that refers to a missing point.
    #[error(
        "{at}: a face uses point {index}, but the file has {n_points} points, counted from {first}; export \
         the model again"
    )]
    MissingPoint {
        /// Place of the face.
        at: Place,
        /// Index as given in the file.
        index: i64,
        /// Number of points in the file.
        n_points: usize,
        /// Index of the first point in this format.
        first: u32,
    },
    /// A face of fewer than three corners.
    #[error("{at}: a face has {n_corners} corners, it needs 3 or more; export the model again")]
    TooFewCorners {
        /// Place of the face.
        at: Place,
        /// Number of its corners.
        n_corners: usize,
    },
    /// A file with only points, or without any content.
    #[error("the {format} file has no triangles ({n_points} points); export the model as a surface mesh")]
    NoTriangles {
        /// Format of the file.
        format: Format,
        /// Number of points in the file.
        n_points: usize,
    },
    /// More points or triangles than 32-bit indices can address.
    #[error("{at}: more than 4 thousand million points or triangles; simplify the model first")]
    TooLarge {
        /// Place where the limit is passed.
        at: Place,
    },
    /// A label below 0.
    #[error("{at}: the label {label} is negative; number the parts from 0")]
    NegativeLabel {
        /// Place of the label.
        at: Place,
        /// Value of the label.
        label: i64,
    },
}
