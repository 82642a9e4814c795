use std::io::{Cursor, Write as _};

use super::super::tests::assert_note;
use super::super::{Format, LabelSource, Loaded, ReadError, read_mesh};
use super::package::USUAL_ROOT;
use super::*;
use shellock_geom::Vec3;
use shellock_geom::check::into_solid;

mod broken;
mod foreign;
mod plates;
mod roles;

/// Settings files of PrusaSlicer and of Bambu Studio.
const PRUSA: &str = "Metadata/Slic3r_PE_model.config";
const BAMBU: &str = "Metadata/model_settings.config";
const HEAD: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<m:model unit="inch" xmlns:m="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"><m:resources>"#;
const TETRAHEDRON: &str = r#"<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1"
 z="0"/><vertex z="1e0" y="0" x="&#48;"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/>
 <triangle v1="1" v2="2" v3="3"></triangle><triangle v1="0" v2="3" v3="2"/></triangles></mesh>"#;

fn package(parts: &[(&str, &str)]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in parts {
        archive
            .start_file(*name, zip::write::SimpleFileOptions::default())
            .unwrap();
        archive.write_all(text.as_bytes()).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

fn model(resources: &str, build: &str) -> String {
    format!("{HEAD}{resources}</m:resources><build>{build}</build></m:model>")
}

fn read_model(resources: &str, build: &str) -> Result<Loaded, ReadError> {
    read_mesh(&package(&[(USUAL_ROOT, &model(resources, build))]), Some("3mf"))
}

fn tetrahedron(id: u32) -> String {
    format!("<object id=\"{id}\" type=\"model\">{TETRAHEDRON}</object>")
}

#[test]
fn units_components_and_transforms_put_parts_where_they_belong() {
    let resources = tetrahedron(1)
        + r#"<object id="2"><components><component objectid="1"/><component objectid="1" transform="2 0 0 0 2 0 0 0 2 10 0 0"/></components></object>"#;
    let item = r#"<item objectid="2" transform="0 1 0 -1 0 0 0 0 1 0 0 100"/>"#;
    let loaded = read_model(&resources, item).unwrap();
    assert_eq!(
        (loaded.format, loaded.unit_mm, loaded.mesh.triangles.len()),
        (Format::ThreeMf, Some(25.4), 8)
    );
    // Maps x to y and y to −x, then moves up.
    assert_eq!(loaded.mesh.points[1], Vec3::new(0.0, 1.0, 100.0));
    assert_eq!(loaded.mesh.points[5], Vec3::new(0.0, 12.0, 100.0));
    assert!((loaded.mesh.signed_volume() - 9.0 / 6.0).abs() < 1e-12);
    assert_eq!(
        loaded.labels(LabelSource::Object),
        Some(&[0, 0, 0, 0, 1, 1, 1, 1][..])
    );
    assert_eq!(loaded.file_face, (0..8).collect::<Vec<_>>());
}

#[test]
fn each_file_of_a_package_has_the_unit_that_it_states() {
    let component =
        |path: &str| format!("<component {path} objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 10 0 0\"/>");
    let read = |root_unit: &str, unit: &str| {
        let root = model(
            &format!(
                "<object id=\"5\"><components>{}</components></object>",
                component("p:path=\"/3D/o.model\"").replace("objectid=\"1\"", "objectid=\"2\"")
            ),
            r#"<item objectid="5" transform="1 0 0 0 1 0 0 0 1 100 0 0"/>"#,
        );
        let inner = tetrahedron(1)
            + &format!(
                "<object id=\"2\"><components>{}</components></object>",
                component("")
            );
        let root = root.replacen("unit=\"inch\"", root_unit, 1);
        let other = model(&inner, "").replacen("unit=\"inch\"", unit, 1);
        let loaded = read_mesh(&package(&[(USUAL_ROOT, &root), ("3D/o.model", &other)]), None).unwrap();
        let bounds = loaded.mesh.bounds();
        let is_told = loaded
            .notes
            .iter()
            .any(|note| note.contains("another unit") && note.contains("3D/o.model"));
        (loaded.unit_mm, bounds.min.x, bounds.size().x, is_told)
    };
    let inch = "unit=\"inch\"";
    assert_eq!(read(inch, inch), (Some(25.4), 120.0, 1.0, false));
    assert_eq!(read("unit=\"millimeter\"", ""), (Some(1.0), 120.0, 1.0, false));
    // The outer transforms are the root's, the inner one and the points are the other file's.
    let (unit, at, size, is_told) = read("unit=\"millimeter\"", inch);
    assert!(unit == Some(1.0) && is_told);
    assert!(
        (at - (110.0 + 254.0)).abs() < 1e-9 && (size - 25.4).abs() < 1e-9,
        "{at} {size}"
    );
    let (unit, at, size, is_told) = read(inch, "");
    assert!(unit == Some(25.4) && is_told);
    assert!(
        (at - (110.0 + 10.0 / 25.4)).abs() < 1e-9 && (size - 1.0 / 25.4).abs() < 1e-9,
        "{at} {size}"
    );
}

#[test]
fn a_mirror_keeps_the_inside_inside() {
    let mirror = r#"<item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>"#;
    let loaded = read_model(&tetrahedron(1), mirror).unwrap();
    assert!((into_solid(&loaded.mesh).unwrap().0.volume() - 1.0 / 6.0).abs() < 1e-15);
}

#[test]
fn parts_in_other_files_are_found_and_the_root_may_have_another_name() {
    let other = model(&tetrahedron(7), "");
    let root = model(
        r#"<object id="7"><components><component p:path="/3D/Objects/a.model" objectid="7"/></components></object>"#,
        r#"<item objectid="7"/>"#,
    );
    let relations = r#"<Relationships><Relationship Target="/else/where.model" Id="r" Type="http://x/3dmodel"/></Relationships>"#;
    let bytes = package(&[
        ("_rels/.rels", relations),
        ("else/where.model", &root),
        ("3D/Objects/a.model", &other),
    ]);
    assert_eq!(read_mesh(&bytes, None).unwrap().mesh.triangles.len(), 4);
    let alone = package(&[(USUAL_ROOT, &root)]);
    let missing = ReadError::MissingPart {
        kind: "the file",
        id: "3D/Objects/a.model".into(),
    };
    assert_eq!(read_mesh(&alone, None), Err(missing));
}

#[test]
fn colours_and_materials_divide_and_supports_are_left_out() {
    let painted = TETRAHEDRON.replace(
        r#"v1="0" v2="1" v3="3""#,
        r#"v1="0" v2="1" v3="3" pid="5" p1="1""#,
    );
    let resources = format!(
        r##"<m:colorgroup id="5"><m:color color="#FF0000"/><m:color color="#00FF00"/></m:colorgroup>
        <object id="1" pid="5" pindex="0">{painted}</object><object id="2" type="support">{TETRAHEDRON}</object>"##
    );
    let loaded = read_model(&resources, r#"<item objectid="1"/><item objectid="2"/>"#).unwrap();
    assert_eq!(loaded.labels(LabelSource::Color), Some(&[0, 1, 0, 0][..]));
    assert_note(&loaded, "support");
    assert!(!loaded.notes.iter().any(|n| n.contains("missing from the file")));
    let none = resources.replace(r#"p1="1""#, r#"p1="2""#);
    let loaded = read_model(&none, r#"<item objectid="1"/>"#).unwrap();
    assert_note(&loaded, "1 triangle(s) refer to a colour");
    let materials = format!(r#"<basematerials id="5"/><object id="1" pid="5" pindex="0">{painted}</object>"#);
    let loaded = read_model(&materials, r#"<item objectid="1"/>"#).unwrap();
    assert_eq!(loaded.labels(LabelSource::Material), Some(&[0, 1, 0, 0][..]));
}

#[test]
fn what_is_not_to_print_is_left_out_unless_nothing_else_is_there() {
    let resources = format!(r#"<object id="1">{TETRAHEDRON}</object><object id="2">{TETRAHEDRON}</object>"#);
    let loaded = read_model(
        &resources,
        r#"<item objectid="1"/><item objectid="2" printable="0"/>"#,
    )
    .unwrap();
    assert_eq!(loaded.mesh.triangles.len(), 4);
    assert_note(&loaded, "excluded from printing");
    let alone = read_model(&resources, r#"<item objectid="2" printable="0"/>"#).unwrap();
    assert_eq!(alone.mesh.triangles.len(), 4);
}

#[test]
fn paint_of_both_kinds_of_slicers_becomes_triangles_with_labels() {
    for attribute in ["slic3rpe:mmu_segmentation", "paint_color"] {
        // Three sides split; the corner at point 0 has colour 2, the rest is unpainted.
        let painted = TETRAHEDRON.replace(
            r#"v1="0" v2="1" v3="3""#,
            &format!(r#"v1="0" v2="1" v3="3" {attribute}="80003""#),
        );
        let loaded = read_model(
            &format!("<object id=\"1\">{painted}</object>"),
            r#"<item objectid="1"/>"#,
        )
        .unwrap();
        let (solid, _) = into_solid(&loaded.mesh).unwrap();
        assert!((solid.volume() - 1.0 / 6.0).abs() < 1e-15);
        let labels = loaded.labels(LabelSource::Paint).unwrap();
        // Unpainted triangles are printed by the first extruder.
        let area = |label: i64| -> f64 {
            (0..labels.len())
                .filter(|&f| labels[f] == label)
                .map(|f| loaded.mesh.face_area(f))
                .sum()
        };
        assert!((area(2) - 0.125).abs() < 1e-15 && (area(1) + area(2) - loaded.mesh.area()).abs() < 1e-12);
        assert_eq!((loaded.n_file_faces(), loaded.file_face.is_sorted()), (4, true));
        assert_eq!(loaded.face_labels(), Some(labels));
    }
    let wrong = TETRAHEDRON.replace(r#"v2="2" v3="3""#, r#"v2="2" v3="3" paint_color="3""#);
    let refused = read_model(
        &format!("<object id=\"1\">{wrong}</object>"),
        r#"<item objectid="1"/>"#,
    );
    assert_eq!(
        refused,
        Err(ReadError::Paint {
            face: 2,
            code: "3".into()
        })
    );
}

#[test]
fn extruders_colour_what_is_unpainted_and_modifiers_are_left_out() {
    let painted = TETRAHEDRON.replace(
        r#"v1="0" v2="1" v3="3""#,
        r#"v1="0" v2="1" v3="3" paint_color="8""#,
    );
    let twice = painted
        .replace("</vertices>", r#"<vertex x="9" y="9" z="9"/></vertices>"#)
        .replace(
            "</triangles>",
            r#"<triangle v1="0" v2="4" v3="1"/><triangle v1="0" v2="1" v3="4"/></triangles>"#,
        );
    let prusa = r#"<config><object id="1" instances_count="1"><metadata type="object" key="extruder" value="3"/>
        <volume firstid="0" lastid="3"><metadata type="volume" key="volume_type" value="ModelPart"/></volume>
        <volume firstid="4" lastid="5"><metadata type="volume" key="volume_type" value="ParameterModifier"/></volume></object></config>"#;
    let root = model(
        &format!("<object id=\"1\">{twice}</object>"),
        r#"<item objectid="1"/>"#,
    );
    let loaded = read_mesh(&package(&[(USUAL_ROOT, &root), (PRUSA, prusa)]), None).unwrap();
    assert_eq!(loaded.face_labels(), Some(&[3, 2, 3, 3][..]));
    assert_note(&loaded, "left out as modifiers of the slicer: a part of object 1");

    let parts = format!(
        r#"{}{}<object id="3"><components><component objectid="1"/><component objectid="2"/></components></object>"#,
        tetrahedron(1),
        tetrahedron(2)
    );
    let bambu = r#"<config><object id="3"><metadata key="extruder" value="4"/><part id="1" subtype="normal_part"/>
        <part id="2" subtype="modifier_part"/></object></config>"#;
    let root = model(&parts, r#"<item objectid="3"/>"#);
    let loaded = read_mesh(&package(&[(USUAL_ROOT, &root), (BAMBU, bambu)]), None).unwrap();
    assert_eq!((loaded.mesh.triangles.len(), loaded.labellings.len()), (4, 0));
}

#[test]
fn what_is_written_with_paint_is_read_with_the_same_labels() {
    let mesh = shellock_geom::TriMesh {
        points: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(0.1, 0.2, 1.0 / 3.0)],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
    };
    let bytes = write_painted_3mf("a & b", &mesh, &[1, 2, 3, 16]);
    assert_eq!(bytes, write_painted_3mf("a & b", &mesh, &[1, 2, 3, 16]));
    let loaded = read_mesh(&bytes, None).unwrap();
    assert_eq!(
        (&loaded.mesh, loaded.face_labels()),
        (&mesh, Some(&[1, 2, 3, 16][..]))
    );
    assert_eq!(loaded.unit_mm, Some(1.0));
}

#[test]
fn broken_packages_are_refused_with_a_reason() {
    let item = r#"<item objectid="1"/>"#;
    let refused = |resources: &str, build: &str| {
        read_model(resources, build)
            .expect_err("it is broken")
            .to_string()
    };
    let broken = |from: &str, to: &str| refused(&tetrahedron(1).replace(from, to), item);
    assert!(broken(r#"v1="1""#, r#"v1="9""#).contains("uses point 9, but it has 4 points"));
    assert!(broken(r#"v1="1""#, r#"v1="-1""#).contains("v1 is \"-1\""));
    assert!(broken(r#"v1="1" v2="2""#, r#"v2="1" v2="2""#).contains("duplicated"));
    assert!(broken(r#"x="1" "#, r#"x="nan" "#).contains("finite"));
    assert!(broken(r#"x="1" "#, "").contains("finite"));
    assert!(broken("</mesh>", "").contains("3dmodel.model, byte"));
    assert!(refused(&tetrahedron(2), item).contains("object 1 is used"));
    assert!(refused(&(tetrahedron(1) + &tetrahedron(1)), item).contains("two objects 1"));
    assert!(refused("", item).contains("object 1"));
    let transform = r#"<item objectid="1" transform="1 0 0 0 1 0 0 0 1 0 0"/>"#;
    assert!(refused(&tetrahedron(1), transform).contains("transform"));
    let cycle = r#"<object id="1"><components><component objectid="2"/></components></object>
        <object id="2"><components><component objectid="1"/></components></object>"#;
    assert!(matches!(read_model(cycle, item), Err(ReadError::Cycle { .. })));
    assert!(matches!(read_model("", ""), Err(ReadError::NoTriangles { .. })));
    let unknown = package(&[(USUAL_ROOT, &model("", "").replace("inch", "mile"))]);
    assert!(
        read_mesh(&unknown, None)
            .unwrap_err()
            .to_string()
            .contains("unit")
    );
    let deep = "<a>".repeat(100);
    assert!(refused(&deep, "").contains("too deep"));
}
