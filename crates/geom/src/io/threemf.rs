//! 3MF, written only: a zip archive of three XML files (3MF core specification 1.3, with its base materials).

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, System, ZipWriter};

use crate::TriMesh;

/// An object of a 3MF model.
#[derive(Clone, Copy, Debug)]
pub struct NamedObject<'a> {
    /// Shown by slicers; any text.
    pub name: &'a str,
    /// sRGB.
    pub color: [u8; 3],
    /// mm.
    pub mesh: &'a TriMesh,
    /// How it is turned on the plate: where the x, y and z axes go; as it is where `None`.
    pub turned: Option<[[f64; 3]; 3]>,
    /// Where it is moved after that, mm.
    pub moved_mm: [f64; 3],
}

const TITLE: &str = "Shellock pieces";
const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>
"#;
const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>
"#;

/// A 3MF model with one build item for each object, in millimetres; the same objects give the same bytes everywhere.
///
/// Coordinates are rounded to `f32`, as slicers read them. Slicers refuse objects without triangles.
pub fn write_3mf(objects: &[NamedObject]) -> Vec<u8> {
    let model = model_xml(objects);
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(1))
        .last_modified_time(DateTime::DEFAULT)
        .unix_permissions(0o644)
        .system(System::Unix)
        .large_file(model.len() >= u32::MAX as usize);
    let entries =
        [("3D/3dmodel.model", model.as_str()), ("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", RELATIONS)];

    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (path, text) in entries {
        archive.start_file(path, options).expect("fixed and distinct paths are accepted");
        archive.write_all(text.as_bytes()).expect("memory takes all bytes");
    }
    archive.finish().expect("memory takes all bytes").into_inner()
}

fn model_xml(objects: &[NamedObject]) -> String {
    /// Resource of the colours; objects follow it.
    const MATERIALS_ID: usize = 1;
    let object_id = |i: usize| MATERIALS_ID + 1 + i;

    let mut xml = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <model unit=\"millimeter\" xml:lang=\"en-US\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n\
         <metadata name=\"Title\">{TITLE}</metadata>\n<metadata name=\"Application\">shellock</metadata>\n<resources>\n"
    );
    if !objects.is_empty() {
        add(&mut xml, format_args!("<basematerials id=\"{MATERIALS_ID}\">\n"));
        for NamedObject { name, color: [r, g, b], .. } in objects {
            let name = Escaped(name);
            add(&mut xml, format_args!("<base name=\"{name}\" displaycolor=\"#{r:02X}{g:02X}{b:02X}FF\"/>\n"));
        }
        xml.push_str("</basematerials>\n");
    }
    for (i, object) in objects.iter().enumerate() {
        let (id, name) = (object_id(i), Escaped(object.name));
        add(
            &mut xml,
            format_args!("<object id=\"{id}\" type=\"model\" name=\"{name}\" pid=\"{MATERIALS_ID}\" pindex=\"{i}\">\n"),
        );
        add_mesh(&mut xml, object.mesh);
        xml.push_str("</object>\n");
    }
    const UNTURNED: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    xml.push_str("</resources>\n<build>\n");
    for (i, object) in objects.iter().enumerate() {
        add(&mut xml, format_args!("<item objectid=\"{}\"", object_id(i)));
        if object.turned.is_some() || object.moved_mm != [0.0; 3] {
            let [[a, b, c], [d, e, f], [g, h, i]] = object.turned.unwrap_or(UNTURNED);
            let [x, y, z] = object.moved_mm;
            add(&mut xml, format_args!(" transform=\"{a} {b} {c} {d} {e} {f} {g} {h} {i} {x} {y} {z}\""));
        }
        xml.push_str("/>\n");
    }
    xml.push_str("</build>\n</model>\n");
    xml
}

fn add_mesh(xml: &mut String, mesh: &TriMesh) {
    xml.push_str("<mesh>\n<vertices>\n");
    for p in &mesh.points {
        let [x, y, z] = p.to_array().map(|x| x as f32);
        add(xml, format_args!("<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>\n"));
    }
    xml.push_str("</vertices>\n<triangles>\n");
    for [a, b, c] in &mesh.triangles {
        add(xml, format_args!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>\n"));
    }
    xml.push_str("</triangles>\n</mesh>\n");
}

fn add(xml: &mut String, text: std::fmt::Arguments) {
    xml.write_fmt(text).expect("a string takes all text");
}

/// A text as XML attribute; characters that XML 1.0 forbids become "�".
struct Escaped<'a>(&'a str);

impl std::fmt::Display for Escaped<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.chars().try_for_each(|c| match c {
            '&' => f.write_str("&amp;"),
            '<' => f.write_str("&lt;"),
            '>' => f.write_str("&gt;"),
            '"' => f.write_str("&quot;"),
            '\u{0}'..='\u{1F}' | '\u{FFFE}' | '\u{FFFF}' => f.write_char('\u{FFFD}'),
            c => f.write_char(c),
        })
    }
}
