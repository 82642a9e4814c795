//! Documents, chunks, nodes and modes of triangles.

use base64::Engine as _;

use super::super::super::read_mesh;
use super::super::*;
use shellock_geom::Vec3;

/// Points of a tetrahedron as floats, then its corners as bytes.
fn data() -> Vec<u8> {
    let points = [
        [0.0_f32, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let mut data: Vec<u8> = points
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    data.extend([0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]);
    data
}

fn json(nodes: &str, buffer: &str) -> String {
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": {nodes},
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0, "NORMAL": 7 }}, "indices": 1, "material": 3 }}] }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" }},
                      {{ "bufferView": 0, "byteOffset": 48, "componentType": 5121, "count": 12, "type": "SCALAR" }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 60 }}], "buffers": [{{ "byteLength": 60{buffer} }}] }}"#
    )
}

fn embed(nodes: &str) -> String {
    let text = base64::engine::general_purpose::STANDARD.encode(data());
    json(
        nodes,
        &format!(r#", "uri": "data:application/octet-stream;base64,{text}""#),
    )
}

fn binary(json: &str) -> Vec<u8> {
    let (mut json, mut data) = (json.as_bytes().to_vec(), data());
    json.resize(json.len().next_multiple_of(4), b' ');
    data.resize(data.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + data.len() as u32).to_le_bytes());
    for (kind, chunk) in [(CHUNK_JSON, &json), (CHUNK_BINARY, &data)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(chunk);
    }
    bytes
}

const NESTED: &str = r#"[{ "children": [1, 2], "scale": [2, 2, 2] }, { "mesh": 0, "translation": [5, 0, 0] },
    { "mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] }]"#;

#[test]
fn nodes_move_their_meshes_and_mirrors_keep_the_inside_inside() {
    let text = read_mesh(embed(NESTED).as_bytes(), None).unwrap();
    assert_eq!((text.mesh.triangles.len(), text.unit_mm), (8, Some(1000.0)));
    assert_eq!(text.mesh.points[1], Vec3::new(12.0, 0.0, 0.0));
    assert_eq!(text.mesh.points[5], Vec3::new(-2.0, 0.0, 0.0));
    assert!((text.mesh.signed_volume() - 16.0 / 6.0).abs() < 1e-12);
    assert_eq!(text.labels(LabelSource::Object).unwrap()[3..5], [0, 1]);
    let loaded = read_mesh(&binary(&json(NESTED, "")), Some("stl")).unwrap();
    assert_eq!((loaded.format, &loaded.mesh), (Format::Glb, &text.mesh));
}

#[test]
fn strips_and_fans_are_triangles_too() {
    // Corners 0 2 1 0 1 3 …: in a strip, every other triangle is turned.
    for (mode, second) in [(5, [1, 2, 0]), (6, [0, 1, 0])] {
        let text =
            embed(r#"[{ "mesh": 0 }]"#).replace(r#""indices""#, &format!(r#""mode": {mode}, "indices""#));
        let mesh = read_mesh(text.as_bytes(), None).unwrap().mesh;
        assert_eq!(
            (mesh.triangles.len(), mesh.triangles[0], mesh.triangles[1]),
            (10, [0, 2, 1], second)
        );
    }
}

#[test]
fn what_is_missing_too_long_or_cyclic_is_refused() {
    let plain = embed(r#"[{ "mesh": 0 }]"#);
    let refused = |from: &str, to: &str| {
        read_mesh(plain.replace(from, to).as_bytes(), None)
            .expect_err("it is broken")
            .to_string()
    };
    assert!(refused(r#""count": 4"#, r#""count": 400000000000"#).contains("beyond its data"));
    assert!(refused(r#""count": 12"#, r#""count": 18446744073709551615"#).contains("more than"));
    assert!(refused(r#""byteLength": 60 }]"#, r#""byteLength": 50 }]"#).contains("beyond its data"));
    assert!(refused(r#"[{ "mesh": 0 }]"#, r#"[{ "mesh": 4 }]"#).contains("mesh 4"));
    assert!(
        refused(r#"[{ "mesh": 0 }]"#, r#"[{ "mesh": 0, "children": [0] }]"#)
            .contains("node 0 contains itself")
    );
    assert!(refused("data:application", "model.bin?data:").contains("another file"));
    assert!(
        refused(
            r#""scene": 0"#,
            r#""extensionsRequired": ["KHR_draco_mesh_compression"]"#
        )
        .contains("draco")
    );
    assert!(refused("asset", "as\"set").contains("glTF"));
    let glb = binary(&json(NESTED, ""));
    assert!(matches!(
        read_mesh(&glb[..glb.len() - 5], None),
        Err(ReadError::CutOff { .. })
    ));
    assert!(matches!(
        read_mesh(b"glTF\x01\0\0\0abcd", None),
        Err(ReadError::Unsupported { .. })
    ));
}

#[test]
fn addresses_of_data_come_in_many_spellings() {
    let padded = base64::engine::general_purpose::STANDARD.encode([data(), vec![7]].concat());
    let unpadded = padded.trim_end_matches('=');
    let escaped = unpadded.replace('A', "%41");
    let percents: String = data().iter().map(|byte| format!("%{byte:02x}")).collect();
    let expected = read_mesh(embed(NESTED).as_bytes(), None).unwrap();
    assert_ne!(padded, unpadded);
    for uri in [
        format!("data:application/gltf-buffer;base64,{padded}"),
        format!("data:;base64,{unpadded}"),
        format!("DATA:application/octet-stream;charset=utf-8;BASE64,{escaped}"),
        format!("data:application/octet-stream,{percents}"),
    ] {
        let text = json(NESTED, &format!(r#", "uri": "{uri}""#));
        assert_eq!(read_mesh(text.as_bytes(), None).as_ref(), Ok(&expected), "{uri}");
    }
    let broken = json(NESTED, r#", "uri": "data:;base64,A*B""#);
    let message = read_mesh(broken.as_bytes(), None).unwrap_err().to_string();
    assert!(message.contains("no base64"), "{message}");
}

#[test]
fn a_buffer_that_no_triangle_uses_may_lie_elsewhere() {
    let plain = embed(NESTED);
    let text =
        plain.strip_suffix("] }").unwrap().to_owned() + r#", { "uri": "animation.bin" }, { "uri": "é" }] }"#;
    let expected = read_mesh(embed(NESTED).as_bytes(), None).unwrap();
    assert_eq!(read_mesh(text.as_bytes(), None).as_ref(), Ok(&expected));
}
