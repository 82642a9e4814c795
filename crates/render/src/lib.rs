//! What people look at: one page with the pieces, their order and the checks, and still pictures.
//!
//! The page is self-contained and needs no network. Its viewer (`viewer/` of the repository) knows meshes,
//! arrows and points with labels; what they mean for shells is said here.

mod loads;
mod packed;
mod page;
pub mod palette;
mod pictures;
pub mod stills;
pub mod svg;

use serde::Serialize;
use shellock_geom::{Aabb, TriMesh, Vec3};

use shellock_assembly::Warning;

pub use loads::{ReportArrow, ReportLoad, ReportLoads, ReportPlace};
pub use page::{escaped, html};
pub use pictures::{from_inside, pieces_picture};

/// Everything the report says, filled by the caller.
#[derive(Clone, Debug, Default)]
pub struct ReportData<'a> {
    /// Heading of the page, usually the name of the input file; any text is safe.
    pub title: String,
    /// Name and value, in the order of reading: size, wall, connector size, clearance, ….
    pub facts: Vec<(String, String)>,
    /// In any order.
    pub pieces: Vec<ReportPiece<'a>>,
    /// What the verification found.
    pub checks: Vec<ReportCheck>,
    /// What the user should know.
    pub warnings: &'a [Warning],
    /// Title and SVG text of what goes below the lists.
    pub figures: Vec<(String, String)>,
    /// What pieces can be coloured by, besides their own colours.
    pub quantities: Vec<ReportQuantity>,
    /// What the page can play, in the order of its buttons; may be empty.
    pub motions: Vec<ReportMotion>,
    /// What loads do to the pieces; may be empty.
    pub loads: ReportLoads,
    /// From where each piece is seen best as it goes in, in the order of `pieces`: unit vectors from the viewer to the
    /// scene. Empty where nobody says.
    pub looks: Vec<[f64; 3]>,
    /// Pages of text and pictures beside the lists.
    pub tabs: Vec<ReportTab>,
}

/// A page beside the lists, such as how to print.
#[derive(Clone, Debug, Serialize)]
pub struct ReportTab {
    /// A word for its button.
    pub name: String,
    /// What is on it.
    pub parts: Vec<ReportPart>,
}

/// Something under a heading.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ReportPart {
    /// Name and value.
    Table(String, Vec<(String, String)>),
    /// Sentences, each a paragraph.
    Text(String, Vec<String>),
    /// A picture: what it shows, and PNG bytes.
    #[serde(serialize_with = "page::as_address")]
    Picture(String, Vec<u8>),
    /// Files beside the page: name, and what each is for.
    Files(String, Vec<(String, String)>),
}

/// One piece in assembled position.
#[derive(Clone, Debug)]
pub struct ReportPiece<'a> {
    /// Its number, from 1: what is engraved on it.
    pub number: u32,
    /// For people, for example `"piece 3"`.
    pub name: String,
    /// sRGB; see [`palette`].
    pub color: [u8; 3],
    /// mm, assembly space.
    pub mesh: &'a TriMesh,
    /// Unit vector along which it moves into its place; zero where the first piece has none.
    pub installation_direction: [f64; 3],
    /// Position in the order of installation, 0 for the first.
    pub order: usize,
    /// Whether it goes in last and locks the rest.
    pub is_key: bool,
    /// Name and value: volume, direction, neighbours, ….
    pub facts: Vec<(String, String)>,
}

/// One verified property.
#[derive(Clone, Debug, Serialize)]
pub struct ReportCheck {
    /// What must hold.
    pub name: String,
    /// Whether it does.
    pub ok: bool,
    /// The figure it was judged by, with unit.
    pub figure: String,
}

/// A figure of every piece.
#[derive(Clone, Debug, Serialize)]
pub struct ReportQuantity {
    /// What it is, for people.
    pub name: String,
    /// Of the values; empty for counts.
    pub unit: String,
    /// One for each piece of the report, in its order; `None` where a piece has none.
    pub values: Vec<Option<f64>>,
}

/// Pieces that move at the same time, for the page to play: how far they rattle, or how one comes out.
#[derive(Clone, Debug, Serialize)]
pub struct ReportMotion {
    /// A word or two for its button.
    pub name: String,
    /// One sentence that says what is to be seen.
    pub title: String,
    /// Whether it goes from its last poses back to its first and on; else it stays at its last.
    pub is_loop: bool,
    /// Of different pieces, each with as many poses; pieces not named here stay.
    pub moves: Vec<ReportMove>,
}

/// How one piece moves from where it is assembled.
#[derive(Clone, Debug, Serialize)]
pub struct ReportMove {
    /// Index into the pieces of the report.
    #[serde(rename = "mesh")]
    pub piece: usize,
    /// The point that poses displace and turn about, mm, assembly space.
    pub about: [f64; 3],
    /// Played evenly in time and with straight ways between them: displacement of `about` in mm, then a
    /// rotation vector in radians, so that `x` goes to `about + t + R(w) (x - about)`. All zeros is the
    /// assembled pose.
    pub poses: Vec<[f64; 6]>,
}

/// How far pieces move outwards in the exploded view, as a share of their distance from the middle.
const EXPLODE_RADIAL: f64 = 0.75;

/// How far they move against their installation direction, as a share of the assembly's diagonal.
const EXPLODE_ALONG: f64 = 0.12;

/// Where each piece goes in the exploded view, mm: away from the middle, and a little back along its way in.
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
