//! Visual output: an interactive page with the pieces, their order and the checks, and still pictures.
//!
//! The page is self-contained and needs no network. Its viewer (`viewer/` of the repository) knows meshes,
//! arrows and points with labels. This crate translates shells and pieces to those.

mod arrays;
mod loads;
mod packed;
mod page;
pub mod palette;
mod pictures;
pub mod stills;
pub mod svg;

use serde::Serialize;
use shellock_geom::{Aabb, TriMesh, Vec3};

use shellock_report::Warning;

pub use loads::{ReportArrow, ReportLoad, ReportLoads, ReportPlace};
pub use page::{escape, html};
pub use pictures::{from_inside, pieces_picture};

/// Contents of the report page, filled in by the caller.
#[derive(Clone, Debug, Default)]
pub struct ReportData<'a> {
    /// Heading of the page, usually the name of the input file; any text is safe.
    pub title: String,
    /// Names and values in reading order: size, wall, connector size, clearance, ….
    pub facts: Vec<(String, String)>,
    /// Pieces of the kit, in any order.
    pub pieces: Vec<ReportPiece<'a>>,
    /// Results of the verification checks.
    pub checks: Vec<ReportCheck>,
    /// Warnings for the user.
    pub warnings: &'a [Warning],
    /// Title and SVG text of each figure below the lists.
    pub figures: Vec<(String, String)>,
    /// Quantities by which pieces can be coloured, besides their own colours.
    pub quantities: Vec<ReportQuantity>,
    /// Motions that the page can play, in the order of their buttons; may be empty.
    pub motions: Vec<ReportMotion>,
    /// Loads and the deformations that they cause; may be empty.
    pub loads: ReportLoads,
    /// Best viewing direction for the installation of each piece, in the order of `pieces`: unit vectors from
    /// the viewer to the scene. Empty if not known.
    pub looks: Vec<[f64; 3]>,
    /// Pages of text and pictures beside the lists.
    pub tabs: Vec<ReportTab>,
}

/// A page beside the lists, such as printing instructions.
#[derive(Clone, Debug, Serialize)]
pub struct ReportTab {
    /// One word for the page's button.
    pub name: String,
    /// Sections of the page, in order.
    pub parts: Vec<ReportPart>,
}

/// A section of a page, with its heading.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ReportPart {
    /// Heading, and rows of name and value.
    Table(String, Vec<(String, String)>),
    /// Heading, and paragraphs of text.
    Text(String, Vec<String>),
    /// Description of the picture, and PNG bytes.
    #[serde(serialize_with = "page::as_address")]
    Picture(String, Vec<u8>),
    /// Heading, and files beside the page, each with its purpose.
    Files(String, Vec<(String, String)>),
}

/// A piece in its assembled position.
#[derive(Clone, Debug)]
pub struct ReportPiece<'a> {
    /// Number engraved on the piece, from 1.
    pub number: u32,
    /// Display name, for example `"piece 3"`.
    pub name: String,
    /// Colour in sRGB; see [`palette`].
    pub color: [u8; 3],
    /// Mesh in assembly space, mm.
    pub mesh: &'a TriMesh,
    /// Unit vector along which the piece moves into its place; zero for a first piece without one.
    pub installation_direction: [f64; 3],
    /// Position in the order of installation, 0 for the first.
    pub order: usize,
    /// True if the piece is installed last and locks the rest.
    pub is_key: bool,
    /// Names and values: volume, direction, neighbours, ….
    pub facts: Vec<(String, String)>,
}

/// Result of one verification check.
#[derive(Clone, Debug, Serialize)]
pub struct ReportCheck {
    /// Property that must hold.
    pub name: String,
    /// True if the property holds.
    pub ok: bool,
    /// Figure by which the check was decided, with unit.
    pub figure: String,
}

/// A quantity with a value per piece.
#[derive(Clone, Debug, Serialize)]
pub struct ReportQuantity {
    /// Display name of the quantity.
    pub name: String,
    /// Unit of the values; empty for counts.
    pub unit: String,
    /// One value per piece, in the report's order; `None` for a piece without one.
    pub values: Vec<Option<f64>>,
}

/// Simultaneous motion of pieces for the page to play, such as play within the gaps or the removal of a
/// piece.
#[derive(Clone, Debug, Serialize)]
pub struct ReportMotion {
    /// One or two words for the motion's button.
    pub name: String,
    /// One sentence that describes the motion.
    pub title: String,
    /// True if the motion returns from its last poses to its first and repeats; otherwise it stops at its
    /// last.
    pub is_loop: bool,
    /// Moves of different pieces, all with equally many poses. Pieces not listed stay in place.
    pub moves: Vec<ReportMove>,
}

/// Motion of one piece from its assembled position.
#[derive(Clone, Debug, Serialize)]
pub struct ReportMove {
    /// Index into the pieces of the report.
    #[serde(rename = "mesh")]
    pub piece: usize,
    /// Reference point of displacements and rotations, mm, assembly space.
    pub about: [f64; 3],
    /// Poses at equal time steps, interpolated linearly: displacement of `about` in mm, then a rotation
    /// vector in radians. A point `x` goes to `about + t + R(w) (x - about)`. All zeros is the assembled
    /// pose.
    pub poses: Vec<[f64; 6]>,
}

/// Outward displacement of pieces in the exploded view, as a share of their distance from the centre.
const EXPLODE_RADIAL: f64 = 0.75;

/// Displacement of pieces against their installation direction, as a share of the assembly's diagonal.
const EXPLODE_ALONG: f64 = 0.12;

/// Displacement of each piece in the exploded view, mm: away from the centre, and a little back along its
/// installation direction. Zero for a piece without points.
pub fn exploded_shifts(pieces: &[ReportPiece<'_>]) -> Vec<Vec3> {
    let all = pieces
        .iter()
        .fold(Aabb::EMPTY, |b, piece| b.union(piece.mesh.bounds()));
    let shift = |piece: &ReportPiece<'_>| {
        let outwards = piece.mesh.bounds().center() - all.center();
        EXPLODE_RADIAL * outwards
            - EXPLODE_ALONG * all.diagonal() * Vec3::from_array(piece.installation_direction)
    };
    pieces
        .iter()
        .map(|p| {
            if p.mesh.points.is_empty() {
                Vec3::ZERO
            } else {
                shift(p)
            }
        })
        .collect()
}
