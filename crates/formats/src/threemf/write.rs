//! Writer of 3MF: a zip archive of three XML files (3MF core specification 1.3, with its base materials).

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, System, ZipWriter};

use super::super::paint::whole_triangle_code;
use shellock_geom::TriMesh;

/// An object of a 3MF model.
#[derive(Clone, Copy, Debug)]
pub struct NamedObject<'a> {
    /// Name shown by slicers; any text is safe.
    pub name: &'a str,
    /// Colour in sRGB: red, green, blue.
    pub color: [u8; 3],
    /// Mesh of the object, mm.
    pub mesh: &'a TriMesh,
    /// Rotation on the plate, as images of the x, y and z axes; none if `None`.
    pub rotation: Option<[[f64; 3]; 3]>,
    /// Translation after the rotation, mm.
    pub moved_mm: [f64; 3],
    /// Settings of PrusaSlicer for this object, by their names in its configuration files.
    pub settings: &'a [(&'static str, &'static str)],
}

const TITLE: &str = "Shellock pieces";
/// Namespace of PrusaSlicer's attributes.
const PAINT_NAMESPACE: &str = r#" xmlns:slic3rpe="http://schemas.slic3r.org/3mf/2017/06""#;
/// Versions of PrusaSlicer's additions and of the paint.
const PAINT_VERSION: &str = "<metadata name=\"slic3rpe:Version3mf\">1</metadata>\n<metadata \
                             name=\"slic3rpe:MmPaintingVersion\">1</metadata>\n";
const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>
"#;
const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>"#;
/// Content type of settings files.
const SETTINGS_TYPE: &str = r#"<Default Extension="config" ContentType="text/xml"/>"#;
/// Place of PrusaSlicer's settings in the archive.
const SETTINGS: &str = "Metadata/Slic3r_PE_model.config";
/// Id of the resource with the colours; objects follow it.
const MATERIALS_ID: usize = 1;

/// Writes a 3MF model with one build item per object, in millimetres. Deterministic: equal objects give equal
/// bytes on every platform.
///
/// Coordinates are rounded to `f32`, as slicers read them. Slicers reject objects without triangles.
pub fn write_3mf(objects: &[NamedObject]) -> Vec<u8> {
    let has_settings = objects.iter().any(|object| !object.settings.is_empty());
    package(&model_xml(objects), has_settings.then(|| settings_xml(objects)))
}

/// Writes a 3MF of one body in millimetres with painted triangles: colour k, from 1 to 16, is the k-th
/// extruder or filament, and 0 is no paint.
///
/// PrusaSlicer, Bambu Studio and OrcaSlicer show the paint, each reading its own attribute, and can change
/// it. [`super::super::read_mesh`] reads it back, with exact points.
///
/// # Panics
///
/// Panics if `colors` and the triangles differ in number.
pub fn write_painted_3mf(name: &str, mesh: &TriMesh, colors: &[u32]) -> Vec<u8> {
    assert_eq!(colors.len(), mesh.triangles.len(), "one colour for each triangle");
    let mut xml = head("Shellock segmentation", PAINT_NAMESPACE, PAINT_VERSION);
    add(
        &mut xml,
        format_args!("<object id=\"1\" type=\"model\" name=\"{}\">\n", Escaped(name)),
    );
    add_mesh(&mut xml, mesh, Some(colors));
    xml.push_str("</object>\n</resources>\n<build>\n<item objectid=\"1\"/>\n</build>\n</model>\n");
    package(&xml, None)
}

/// Packs a model into an archive, with settings of its objects if there are any.
fn package(model: &str, settings: Option<String>) -> Vec<u8> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(1))
        .last_modified_time(DateTime::DEFAULT)
        .unix_permissions(0o644)
        .system(System::Unix)
        .large_file(model.len() >= u32::MAX as usize);
    let settings_type = settings.as_ref().map_or("", |_| SETTINGS_TYPE);
    let types = format!("{CONTENT_TYPES}{settings_type}</Types>\n");
    let entries = [
        ("3D/3dmodel.model", Some(model)),
        ("[Content_Types].xml", Some(&types)),
        ("_rels/.rels", Some(RELATIONS)),
        (SETTINGS, settings.as_deref()),
    ];

    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (path, text) in entries {
        let Some(text) = text else { continue };
        archive
            .start_file(path, options)
            .expect("fixed and distinct paths are accepted");
        archive
            .write_all(text.as_bytes())
            .expect("memory takes all bytes");
    }
    archive.finish().expect("memory takes all bytes").into_inner()
}

/// XML up to the resources, with an additional namespace and additional metadata.
fn head(title: &str, namespace: &str, metadata: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <model unit=\"millimeter\" xml:lang=\"en-US\" \
         xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"{namespace}>\n\
         <metadata name=\"Title\">{title}</metadata>\n\
         <metadata name=\"Application\">shellock</metadata>\n{metadata}<resources>\n"
    )
}

fn model_xml(objects: &[NamedObject]) -> String {
    let mut xml = head(TITLE, "", "");
    if !objects.is_empty() {
        add(&mut xml, format_args!("<basematerials id=\"{MATERIALS_ID}\">\n"));
        for NamedObject {
            name,
            color: [r, g, b],
            ..
        } in objects
        {
            let name = Escaped(name);
            add(
                &mut xml,
                format_args!("<base name=\"{name}\" displaycolor=\"#{r:02X}{g:02X}{b:02X}FF\"/>\n"),
            );
        }
        xml.push_str("</basematerials>\n");
    }
    for (i, object) in objects.iter().enumerate() {
        let (id, name) = (object_id(i), Escaped(object.name));
        add(
            &mut xml,
            format_args!(
                "<object id=\"{id}\" type=\"model\" name=\"{name}\" pid=\"{MATERIALS_ID}\" pindex=\"{i}\">\n"
            ),
        );
        add_mesh(&mut xml, object.mesh, None);
        xml.push_str("</object>\n");
    }
    const UNTURNED: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    xml.push_str("</resources>\n<build>\n");
    for (i, object) in objects.iter().enumerate() {
        add(&mut xml, format_args!("<item objectid=\"{}\"", object_id(i)));
        if object.rotation.is_some() || object.moved_mm != [0.0; 3] {
            let [[a, b, c], [d, e, f], [g, h, i]] = object.rotation.unwrap_or(UNTURNED);
            let [x, y, z] = object.moved_mm;
            add(
                &mut xml,
                format_args!(" transform=\"{a} {b} {c} {d} {e} {f} {g} {h} {i} {x} {y} {z}\""),
            );
        }
        xml.push_str("/>\n");
    }
    xml.push_str("</build>\n</model>\n");
    xml
}

fn object_id(i: usize) -> usize {
    MATERIALS_ID + 1 + i
}

/// Settings of all objects. PrusaSlicer drops an object that is listed here without the range of its
/// triangles.
fn settings_xml(objects: &[NamedObject]) -> String {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<config>\n");
    for (i, object) in objects.iter().enumerate() {
        let (id, name) = (object_id(i), Escaped(object.name));
        let last = object.mesh.triangles.len().saturating_sub(1);
        add(
            &mut xml,
            format_args!(
                "<object id=\"{id}\" instances_count=\"1\">\n\
                 <metadata type=\"object\" key=\"name\" value=\"{name}\"/>\n"
            ),
        );
        for (key, value) in object.settings {
            add(
                &mut xml,
                format_args!("<metadata type=\"object\" key=\"{key}\" value=\"{value}\"/>\n"),
            );
        }
        add(
            &mut xml,
            format_args!(
                "<volume firstid=\"0\" lastid=\"{last}\">\n\
                 <metadata type=\"volume\" key=\"name\" value=\"{name}\"/>\n\
                 <metadata type=\"volume\" key=\"volume_type\" value=\"ModelPart\"/>\n</volume>\n</object>\n"
            ),
        );
    }
    xml.push_str("</config>\n");
    xml
}

fn add_mesh(xml: &mut String, mesh: &TriMesh, colors: Option<&[u32]>) {
    xml.push_str("<mesh>\n<vertices>\n");
    for p in &mesh.points {
        let exact = p.to_array();
        let [x, y, z] = exact.map(|x| x as f32);
        match colors {
            // Points at the seams of patches are too close together for 32-bit floats to separate.
            Some(_) => add(
                xml,
                format_args!(
                    "<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>\n",
                    exact[0], exact[1], exact[2]
                ),
            ),
            None => add(xml, format_args!("<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>\n")),
        }
    }
    xml.push_str("</vertices>\n<triangles>\n");
    for (face, [a, b, c]) in mesh.triangles.iter().enumerate() {
        add(xml, format_args!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\""));
        match colors.map(|colors| whole_triangle_code(colors[face])) {
            Some(code) if !code.is_empty() => {
                add(
                    xml,
                    format_args!(" slic3rpe:mmu_segmentation=\"{code}\" paint_color=\"{code}\"/>\n"),
                );
            }
            _ => xml.push_str("/>\n"),
        }
    }
    xml.push_str("</triangles>\n</mesh>\n");
}

fn add(xml: &mut String, text: std::fmt::Arguments) {
    xml.write_fmt(text).expect("a string takes all text");
}

/// Text escaped for an XML attribute; characters that XML 1.0 forbids become "�".
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
