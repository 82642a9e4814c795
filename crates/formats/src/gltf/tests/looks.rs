//! Colours of points, and content that is left out with a note.

use super::*;
use crate::LabelSource;
use crate::tests::assert_note;

#[test]
fn colours_of_points_divide_by_most_corners() {
    let red = [255, 0, 0];
    let rows = [red, red, red, [0, 0, 255]];
    let mut file = File::tetrahedron();
    let bytes = file.shares(&rows);
    let floats = file.floats(&rows.map(|row| row.map(|c| f32::from(c) / 255.0)));
    let with_alpha = file.shares(&rows.map(|[r, g, b]| [r, g, b, 255]));
    for which in [bytes, floats, with_alpha] {
        file.attributes()["COLOR_0"] = json!(which);
        let loaded = file.read().unwrap();
        assert_eq!(
            loaded.labels(LabelSource::Color),
            None,
            "no triangle is mostly blue"
        );
    }
    let mut rows = rows;
    rows[1] = rows[3];
    let colors = file.shares(&rows);
    file.attributes()["COLOR_0"] = json!(colors);
    let loaded = file.read().unwrap();
    assert_eq!(loaded.labels(LabelSource::Color), Some(&[0, 1, 1, 0][..]));
}

#[test]
fn colours_of_points_are_those_of_the_material_too() {
    let mut file = File::tetrahedron();
    let white = file.shares(&[[255; 3]; 4]);
    file.json["materials"] = json!([
        { "pbrMetallicRoughness": { "baseColorFactor": [1, 0, 0, 1] } },
        { "pbrMetallicRoughness": { "baseColorFactor": [1, 0, 0, 1] } },
        {},
    ]);
    let primitive =
        |material: usize| json!({ "attributes": { "POSITION": 0 }, "indices": 1, "material": material });
    file.json["meshes"][0]["primitives"] = json!([primitive(0), primitive(1), primitive(2)]);
    assert_eq!(file.read().unwrap().labels(LabelSource::Color), None);
    file.attributes()["COLOR_0"] = json!(white);
    let loaded = file.read().unwrap();
    let colors = loaded.labels(LabelSource::Color).unwrap();
    assert_eq!(colors, [0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1]);
}

#[test]
fn colours_that_cannot_be_read_are_noted_and_the_shape_is_read() {
    let mut file = File::tetrahedron();
    let few = file.shares(&[[255, 0, 0]; 3]);
    file.attributes()["COLOR_0"] = json!(few);
    let loaded = file.read().unwrap();
    assert_note(&loaded, "colours of points cannot be read");
    assert_eq!(loaded.mesh, File::tetrahedron().read().unwrap().mesh);
}

#[test]
fn faults_of_materials_are_no_reason_to_refuse_a_shape() {
    let mut file = File::tetrahedron();
    let white = file.shares(&[[255; 3]; 4]);
    file.attributes()["COLOR_0"] = json!(white);
    file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let colored = file.read().unwrap();
    for materials in [
        json!([3]),
        json!([{ "pbrMetallicRoughness": { "baseColorFactor": ["red"] } }]),
    ] {
        file.json["materials"] = materials;
        assert_eq!(file.read().as_ref(), Ok(&colored));
    }
}

#[test]
fn each_thing_left_out_is_noted_once() {
    let plain = File::tetrahedron().read().unwrap();
    assert_eq!(plain.notes.len(), 1);
    let mut file = File::tetrahedron();
    let lines = json!({ "attributes": { "POSITION": 0 }, "indices": 1, "mode": 1 });
    let dots = json!({ "attributes": { "POSITION": 0 }, "mode": 0 });
    let textured = json!({ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 });
    file.json["meshes"][0]["primitives"] = json!([textured, lines, dots]);
    file.json["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
    file.json["animations"] = json!([{ "channels": [], "samplers": [] }, {}]);
    push(&mut file.json["scenes"], json!({ "nodes": [] }));
    file.json["extensions"] = json!({ "KHR_materials_variants": { "variants": [{ "name": "blue" }] } });
    let loaded = file.read().unwrap();
    assert_eq!(loaded.mesh, plain.mesh);
    let noted = [
        "2 sets of lines or points are left out",
        "1 other scene is left out",
        "animated",
        "texture",
        "variants",
    ];
    noted.iter().for_each(|words| assert_note(&loaded, words));
    assert_eq!(loaded.notes.len(), 1 + noted.len(), "{:?}", loaded.notes);
}

#[test]
fn hidden_nodes_and_those_below_are_left_out() {
    let mut file = File::tetrahedron();
    let hidden = json!({ "KHR_node_visibility": { "visible": false } });
    let shown = json!({ "KHR_node_visibility": { "visible": true } });
    push(
        &mut file.json["nodes"],
        json!({ "extensions": hidden, "children": [2] }),
    );
    push(&mut file.json["nodes"], json!({ "mesh": 0, "extensions": shown }));
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    file.json["extensionsRequired"] = json!(["KHR_node_visibility"]);
    let loaded = file.read().unwrap();
    assert_eq!(loaded.mesh, File::tetrahedron().read().unwrap().mesh);
    assert_note(&loaded, "1 hidden mesh is left out");
}

#[test]
fn points_that_no_triangle_uses_are_left_out() {
    let mut file = File::tetrahedron();
    let mut many = vec![[f32::NAN; 3]; 1000];
    many[500..504].copy_from_slice(&POINTS);
    let position = file.floats(&many);
    file.attributes()["POSITION"] = json!(position);
    let corners: Vec<u8> = TRIANGLES
        .as_flattened()
        .iter()
        .flat_map(|&c| (500 + u16::from(c)).to_le_bytes())
        .collect();
    let corners = file.add("SCALAR", U16, 12, &corners);
    file.json["meshes"][0]["primitives"][0]["indices"] = json!(corners);
    assert_eq!(
        file.read().unwrap().mesh,
        File::tetrahedron().read().unwrap().mesh
    );
}
