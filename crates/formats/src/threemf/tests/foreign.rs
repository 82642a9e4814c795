//! Content of namespaces that are not read is passed over, whatever its names are.

use super::*;

const HEAD_OF_OTHERS: &str = r#"<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
 xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06" xmlns:x="urn:vendor">"#;

fn part(resources: &str, build: &str) -> String {
    format!("{HEAD_OF_OTHERS}<resources>{resources}</resources><build>{build}</build></model>")
}

fn read_part(text: &str) -> Loaded {
    read_mesh(&package(&[(USUAL_ROOT, text)]), Some("3mf")).unwrap()
}

#[test]
fn attributes_of_others_change_nothing() {
    let plain = part(&tetrahedron(1), r#"<item objectid="1"/>"#);
    let expected = read_part(&plain);
    for (from, to) in [
        (r#"unit="millimeter""#, r#"unit="millimeter" x:unit="inch""#),
        (r#"unit="millimeter""#, r#"x:unit="inch" unit="millimeter""#),
        (
            r#"<item objectid="1""#,
            r#"<item objectid="1" x:transform="2 0 0 0 1 0 0 0 1 0 0 0""#,
        ),
        (r#"<item objectid="1""#, r#"<item objectid="1" x:printable="0""#),
        (r#"x="1" y="0" z="0""#, r#"x="1" y="0" z="0" x:z="9""#),
        (
            r#"id="1" type="model""#,
            r#"id="1" x:id="2" type="model" x:type="support""#,
        ),
        // Where nobody declares the prefix, the name without one goes before.
        (r#"x="1" y="0" z="0""#, r#"x="1" y="0" z="0" q:z="9""#),
        (r#"x="1" y="0" z="0""#, r#"q:z="9" x="1" y="0" z="0""#),
    ] {
        let text = plain.replacen(from, to, 1);
        assert_ne!(text, plain);
        let loaded = read_part(&text);
        assert_eq!(
            (loaded.unit_mm, &loaded.mesh),
            (expected.unit_mm, &expected.mesh),
            "{to}"
        );
    }
    let undeclared = plain.replacen(r#"z="0""#, r#"q:z="0""#, 1);
    assert_eq!(
        read_part(&undeclared).mesh,
        expected.mesh,
        "a name alone counts whatever its prefix"
    );
}

#[test]
fn elements_of_others_are_passed_over_with_all_that_is_in_them() {
    let plain = part(&tetrahedron(1), r#"<item objectid="1"/>"#);
    let expected = read_part(&plain);
    let other = tetrahedron(2);
    let within = r#"<x:lattice><x:vertices><vertex x="5" y="5" z="5"/></x:vertices><triangle v1="0" v2="1" v3="4"/></x:lattice></mesh>"#;
    for (from, to) in [
        ("</mesh>", within),
        ("</mesh>", r#"<x:vertex x="0"/></mesh>"#),
        ("</resources>", &format!("<x:alt>{other}</x:alt></resources>")),
        ("</build>", r#"<x:alt><x:item objectid="7"/></x:alt></build>"#),
        (
            "</build>",
            r#"<alt xmlns="urn:vendor"><item objectid="7"/></alt></build>"#,
        ),
        ("</build>", r#"</build><x:model/>"#),
        ("</build>", r#"</build><q:model unit="inch"/>"#),
    ] {
        let loaded = read_part(&plain.replacen(from, to, 1));
        assert_eq!(
            (loaded.unit_mm, &loaded.mesh),
            (Some(1.0), &expected.mesh),
            "{to}"
        );
    }
    let proxy = plain.replacen(
        "</object>",
        &format!("<x:proxy>{TETRAHEDRON}</x:proxy></object>"),
        1,
    );
    let loaded = read_part(&proxy);
    assert_eq!(loaded.mesh, expected.mesh);
    assert_note(&loaded, "unsupported elements: proxy");
    let bare = part(
        r#"<object id="1"><x:newshape/></object>"#,
        r#"<item objectid="1"/>"#,
    );
    let refused = read_mesh(&package(&[(USUAL_ROOT, &bare)]), None)
        .unwrap_err()
        .to_string();
    assert!(refused.contains("newshape"), "{refused}");
}

#[test]
fn declarations_hold_within_their_element_alone() {
    let inner =
        r#"<x:item xmlns:x="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" objectid="1"/>"#;
    let text = part(
        &tetrahedron(1),
        &format!("{inner}<x:item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 9 0 0\"/>"),
    );
    assert_eq!(read_part(&text).mesh.triangles.len(), 4);
    // The path of a component is an extension's: the one with a prefix counts.
    let root = part(
        r#"<object id="5"><components><component path="/3D/no.model" p:path="/3D/o.model" objectid="1"/></components></object>"#,
        r#"<item objectid="5"/>"#,
    );
    let other = part(&tetrahedron(1), "");
    let bytes = package(&[(USUAL_ROOT, &root), ("3D/o.model", &other)]);
    assert_eq!(read_mesh(&bytes, None).unwrap().mesh.triangles.len(), 4);
}
