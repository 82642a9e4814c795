//! The report page: a template, a JSON header, and all arrays as one block of base64.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;
use serde::{Serialize, Serializer};
use shellock_geom::decimate::decimate_for_display;
use shellock_geom::{Aabb, TriMesh, Vec3};
use shellock_report::{PatchId, Warning};

use super::loads::LoadsHeader;
use super::packed::{self, PackedMesh};
use super::{ReportCheck, ReportData, ReportMotion, ReportPiece, ReportQuantity, ReportTab, exploded_shifts};

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("../viewer/viewer.css");
const VIEWER: &str = include_str!("../viewer/viewer.js");

/// Tolerance of the coarse meshes for motions on slow machines, as a share of the pieces' diagonal: 0.3 mm on
/// 240 mm.
const DRAFT: f64 = 1.2e-3;

/// Writes the report as one self-contained HTML page. Deterministic: equal data give equal bytes.
///
/// Positions are rounded to 1/65 535 of each piece's box, some micrometres. About 6 bytes per triangle, and
/// 0.6 MB for the viewer.
pub fn html(data: &ReportData<'_>) -> String {
    let mut arrays = Vec::new();
    let shifts = exploded_shifts(&data.pieces);
    let drafts = drafts(&data.pieces);
    let looks = data
        .looks
        .iter()
        .copied()
        .map(Some)
        .chain(std::iter::repeat(None));
    let meshes = data.pieces.iter().zip(&drafts).zip(shifts).zip(looks);
    let header = Header {
        title: &data.title,
        meshes_title: "Pieces",
        meshes: meshes
            .map(|(((p, draft), shift), look)| MeshHeader::new(p, draft, shift, look, &mut arrays))
            .collect(),
        facts: &data.facts,
        checks: &data.checks,
        notes: Warning::rank(data.warnings)
            .iter()
            .map(|w| note(w, &data.pieces))
            .collect(),
        figures: data.figures.iter().map(Figure::new).collect(),
        quantities: &data.quantities,
        motions: &data.motions,
        loads: LoadsHeader::new(&data.loads, &mut arrays),
        tabs: &data.tabs,
    };
    let json = serde_json::to_string(&header).expect("text and finite numbers always become JSON");
    // "<" occurs only inside strings, where the escape means the same, so no text can end the script element.
    let json = json.replace('<', "\\u003c");
    fill(
        TEMPLATE,
        &[
            ("title", &escape(&data.title)),
            ("style", STYLE),
            ("header", &json),
            ("arrays", &STANDARD.encode(deflate(&arrays))),
            ("viewer", VIEWER),
        ],
    )
}

/// Simplified meshes of the pieces, for display in motion on slow machines.
fn drafts(pieces: &[ReportPiece<'_>]) -> Vec<TriMesh> {
    let all = pieces
        .iter()
        .fold(Aabb::EMPTY, |b, piece| b.union(piece.mesh.bounds()));
    let tolerance_mm = DRAFT * all.diagonal();
    pieces
        .par_iter()
        .map(|piece| decimate_for_display(piece.mesh, tolerance_mm))
        .collect()
}

/// Header that the viewer reads. Its terms are those of any scene, not of shells.
#[derive(Serialize)]
struct Header<'a> {
    title: &'a str,
    meshes_title: &'a str,
    meshes: Vec<MeshHeader<'a>>,
    facts: &'a [(String, String)],
    checks: &'a [ReportCheck],
    notes: Vec<Note>,
    figures: Vec<Figure<'a>>,
    /// One value per mesh.
    quantities: &'a [ReportQuantity],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    motions: &'a [ReportMotion],
    #[serde(skip_serializing_if = "Option::is_none")]
    loads: Option<LoadsHeader<'a>>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    tabs: &'a [ReportTab],
}

/// A picture with its title.
#[derive(Serialize)]
struct Figure<'a> {
    title: &'a str,
    /// Picture as a `data:` URL.
    source: String,
}

impl<'a> Figure<'a> {
    fn new((title, svg): &'a (String, String)) -> Self {
        Self {
            title,
            source: format!("data:image/svg+xml,{}", percent_encode(svg)),
        }
    }
}

#[derive(Serialize)]
struct MeshHeader<'a> {
    name: &'a str,
    badge: Option<&'a str>,
    color: [u8; 3],
    /// Position in the order of arrival.
    step: usize,
    /// Unit vector along which the mesh arrives.
    travel: [f64; 3],
    /// Displacement in the exploded view, mm.
    shift: [f64; 3],
    facts: &'a [(String, String)],
    /// Viewing direction during arrival, from the viewer to the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    look: Option<[f64; 3]>,
    packed: PackedMesh,
    /// Coarser mesh, for motions on slow machines.
    draft: PackedMesh,
}

/// A point with a label, or a label alone.
#[derive(Serialize)]
struct Note {
    /// Severity: "note", "warning" or "problem".
    severity: String,
    title: String,
    text: String,
    at: Option<[f64; 3]>,
}

fn note(warning: &Warning, pieces: &[ReportPiece<'_>]) -> Note {
    let named = |id: &PatchId| match pieces.iter().find(|p| p.number == id.number()) {
        Some(piece) => piece.name.clone(),
        None => format!("piece {id}"),
    };
    let names: Vec<String> = warning.pieces.iter().map(named).collect();
    let title = if names.is_empty() {
        warning.code().to_owned()
    } else {
        format!("{} · {}", warning.code(), names.join(", "))
    };
    Note {
        severity: warning.severity().to_string(),
        title,
        text: warning.to_string(),
        at: warning.at,
    }
}

impl<'a> MeshHeader<'a> {
    /// Converts a piece and appends its arrays to `arrays`.
    fn new(
        piece: &'a ReportPiece<'_>,
        draft: &TriMesh,
        shift: Vec3,
        look: Option<[f64; 3]>,
        arrays: &mut Vec<u8>,
    ) -> Self {
        Self {
            name: &piece.name,
            badge: piece.is_key.then_some("key"),
            color: piece.color,
            step: piece.order,
            travel: piece.installation_direction,
            shift: shift.to_array(),
            facts: &piece.facts,
            look,
            packed: packed::append(piece.mesh, arrays),
            draft: packed::append(draft, arrays),
        }
    }
}

/// Compresses with zlib. Equal input gives equal bytes.
fn deflate(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder
        .write_all(bytes)
        .and_then(|()| encoder.finish())
        .expect("memory takes all bytes")
}

/// Serialises a picture's title and its `data:` URL.
pub(crate) fn as_address<S: Serializer>(title: &str, png: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
    (title, format!("data:image/png;base64,{}", STANDARD.encode(png))).serialize(serializer)
}

/// Percent-encodes text for a URL. Charts consist mostly of pictures in base64, whose characters are kept:
/// encoding all of them made charts a third larger.
fn percent_encode(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b"-_.~+/=,:;()".contains(&byte) {
            out.push(char::from(byte));
        } else {
            out.push_str(&format!("%{byte:02X}"));
        }
    }
    out
}

/// Escapes `text` for HTML, in attributes too.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// Replaces each `{{name}}` by its value. Values are not searched again.
fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut out = String::with_capacity(template.len() + values.iter().map(|v| v.1.len()).sum::<usize>());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").expect("the template closes its braces");
        out.push_str(before);
        out.push_str(
            values
                .iter()
                .find(|v| v.0 == name)
                .expect("the template names what there is")
                .1,
        );
        rest = after;
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use shellock_report::{Diagnostic, Told};

    use super::*;
    use crate::{ReportLoad, ReportLoads, ReportMove, ReportPart, ReportPlace};

    const HOSTILE: &str = "</script><script>alert('x')</script>{{arrays}}<!--";

    /// A cause whose sentence comes from a stranger.
    #[derive(Debug)]
    struct Hostile;

    impl Diagnostic for Hostile {
        fn tell(&self, _pieces: &[PatchId]) -> Told {
            Told::problem("failed", HOSTILE.into())
        }
    }

    fn page() -> String {
        page_with(Vec::new())
    }

    fn page_with(motions: Vec<ReportMotion>) -> String {
        let mesh = TriMesh {
            points: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
        };
        let hostile = || (HOSTILE.to_owned(), HOSTILE.to_owned());
        let piece = ReportPiece {
            number: 1,
            name: HOSTILE.into(),
            color: [1, 2, 3],
            mesh: &mesh,
            installation_direction: [0.0, 0.0, 1.0],
            order: 0,
            is_key: true,
            facts: vec![hostile()],
        };
        let warning = Warning::new(Hostile, vec![PatchId(0)], None);
        html(&ReportData {
            title: HOSTILE.into(),
            facts: vec![hostile()],
            pieces: vec![piece],
            checks: vec![ReportCheck {
                name: HOSTILE.into(),
                ok: true,
                figure: HOSTILE.into(),
            }],
            warnings: &[warning],
            figures: vec![hostile()],
            quantities: vec![ReportQuantity {
                name: HOSTILE.into(),
                unit: HOSTILE.into(),
                values: vec![None],
            }],
            motions,
            loads: loads(&mesh),
            looks: vec![[0.0, 1.0, 0.0]],
            tabs: vec![ReportTab {
                name: HOSTILE.into(),
                parts: vec![
                    ReportPart::Text(HOSTILE.into(), vec![HOSTILE.into()]),
                    ReportPart::Picture(HOSTILE.into(), vec![1, 2]),
                    ReportPart::Files(HOSTILE.into(), vec![hostile()]),
                ],
            }],
        })
    }

    fn loads(mesh: &TriMesh) -> ReportLoads {
        let place = ReportPlace {
            name: HOSTILE.into(),
            at: [0.0; 3],
            lines: Vec::new(),
            piece: 0,
        };
        let load = ReportLoad {
            name: HOSTILE.into(),
            figure: HOSTILE.into(),
            title: HOSTILE.into(),
            place: Some(place.clone()),
            moved_mm: vec![vec![Vec3::ZERO, Vec3::X, Vec3::Y]],
            ..ReportLoad::default()
        };
        ReportLoads {
            title: HOSTILE.into(),
            note: HOSTILE.into(),
            carriers: vec![mesh.clone()],
            loads: vec![load],
            weakest: Some((HOSTILE.into(), place)),
        }
    }

    fn header(page: &str) -> serde_json::Value {
        let (_, header) = page.split_once("id=\"header\">").unwrap();
        let (header, _) = header.split_once("</script>").unwrap();
        serde_json::from_str(header).unwrap()
    }

    #[test]
    fn no_text_leaves_its_place() {
        let page = page();
        assert!(!page.contains("<script>alert"));
        // The template has three script elements; the viewer itself never contains the tag.
        assert_eq!(page.matches("</script").count(), 3);
        let header = header(&page);
        assert_eq!(header["title"], HOSTILE);
        let note = header["notes"][0]["text"].as_str().unwrap();
        assert!(note.ends_with(HOSTILE), "{note}");
        assert_eq!(header["loads"]["loads"][0]["title"], HOSTILE);
        assert_eq!(header["loads"]["weakest"]["place"]["mesh"], 0);
    }

    #[test]
    fn motions_are_told_in_the_words_of_any_scene() {
        let poses = vec![[0.0; 6], [0.1, 0.0, -0.2, 0.0, 0.01, 0.0]];
        let moves = vec![ReportMove {
            piece: 0,
            about: [1.0, 2.0, 3.0],
            poses,
        }];
        let page = page_with(vec![ReportMotion {
            name: HOSTILE.into(),
            title: HOSTILE.into(),
            is_loop: true,
            moves,
        }]);
        assert!(!page.contains("<script>alert"));
        let told = serde_json::json!([{
            "name": HOSTILE,
            "title": HOSTILE,
            "is_loop": true,
            "moves": [{
                "mesh": 0,
                "about": [1.0, 2.0, 3.0],
                "poses": [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.1, 0.0, -0.2, 0.0, 0.01, 0.0]],
            }],
        }]);
        assert_eq!(header(&page)["motions"], told);
        assert!(
            header(&self::page()).get("motions").is_none(),
            "a page without motions says nothing of them"
        );
    }

    #[test]
    fn figures_are_addresses_that_say_all_of_them() {
        let address = header(&page())["figures"][0]["source"]
            .as_str()
            .unwrap()
            .to_owned();
        let told = address.strip_prefix("data:image/svg+xml,").unwrap();
        assert!(
            told.bytes()
                .all(|b| b.is_ascii_graphic() && !b"<>\"'#".contains(&b))
        );
        let mut parts = told.split('%');
        let mut text = parts.next().unwrap().to_owned();
        for part in parts {
            text.push(char::from(u8::from_str_radix(&part[..2], 16).unwrap()));
            text.push_str(&part[2..]);
        }
        assert_eq!(text, HOSTILE);
    }

    #[test]
    fn the_same_data_give_the_same_bytes() {
        assert_eq!(page(), page());
    }

    #[test]
    fn the_page_asks_for_nothing_from_outside() {
        assert!(!TEMPLATE.contains("http://") && !TEMPLATE.contains("https://"));
        assert!(TEMPLATE.contains("default-src 'none'"));
        assert!(
            VIEWER.contains("Permission is hereby granted"),
            "three's notice goes with its code"
        );
    }
}
