//! Files that are rejected, and the messages.

use super::*;

fn with_extension(list: &str, name: &str) -> File {
    let mut file = File::tetrahedron();
    file.json[list] = json!([name]);
    file
}

#[test]
fn a_required_extension_that_is_not_known_is_refused_by_name() {
    for name in ["ACME_twist", "KHR_mesh_subdivision", "KHR_gaussian_splatting"] {
        let message = with_extension("extensionsRequired", name).message();
        assert!(message.contains(&format!("\"{name}\"")), "{message}");
        assert!(with_extension("extensionsUsed", name).read().is_ok());
    }
}

#[test]
fn a_required_extension_that_changes_no_triangle_is_none_to_refuse() {
    for name in [
        "KHR_materials_unlit",
        "KHR_materials_variants",
        "KHR_texture_transform",
        "KHR_texture_basisu",
        "EXT_texture_webp",
        "KHR_lights_punctual",
        "KHR_xmp_json_ld",
        "KHR_mesh_quantization",
        "EXT_mesh_gpu_instancing",
        "KHR_node_visibility",
    ] {
        let loaded = with_extension("extensionsRequired", name).read();
        assert_eq!(loaded, File::tetrahedron().read(), "{name}");
    }
}

#[track_caller]
fn assert_compression(file: &File, name: &str) {
    let message = file.message();
    for words in ["compressed", name, "export it without compression"] {
        assert!(message.contains(words), "{words:?} is not in {message:?}");
    }
}

#[test]
fn data_that_is_only_compressed_is_refused_as_such() {
    const DRACO: &str = "KHR_draco_mesh_compression";
    assert_compression(&with_extension("extensionsRequired", DRACO), DRACO);
    let mut file = with_extension("extensionsUsed", DRACO);
    let packed = json!({ DRACO: { "bufferView": 0, "attributes": { "POSITION": 0 } } });
    file.json["meshes"][0]["primitives"][0]["extensions"] = packed;
    assert_eq!(
        file.read(),
        File::tetrahedron().read(),
        "the plain data is there, too"
    );
    for which in [0, 1] {
        let mut file = file.clone();
        file.json["accessors"][which]
            .as_object_mut()
            .unwrap()
            .remove("bufferView");
        assert_compression(&file, DRACO);
    }
}

#[test]
fn a_fallback_buffer_without_data_is_refused_as_compressed() {
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let mut file = with_extension("extensionsUsed", name);
        file.json["bufferViews"][0]["extensions"] = json!({ name: { "buffer": 0, "byteLength": 20 } });
        assert_eq!(
            file.read(),
            File::tetrahedron().read(),
            "the plain data is there, too"
        );
        push(&mut file.json["buffers"], json!({ "byteLength": 48 }));
        file.json["bufferViews"][0]["buffer"] = json!(1);
        assert_compression(&file, name);
    }
}

#[test]
fn lines_or_points_alone_are_refused_as_no_surface() {
    for mode in 0..4 {
        let mut file = File::tetrahedron();
        file.json["meshes"][0]["primitives"][0]["mode"] = json!(mode);
        assert!(
            file.message().contains("only lines or points"),
            "{}",
            file.message()
        );
    }
}

#[test]
fn joints_that_are_not_there_are_refused_by_number() {
    let mut file = File::tetrahedron();
    file.skin(&[json!({})]);
    let joints = file.add("VEC4", U8, 4, &[3, 0, 0, 0].repeat(4));
    file.attributes()["JOINTS_0"] = json!(joints);
    assert!(
        file.message().contains("joint 3 of skin 0, which has 1"),
        "{}",
        file.message()
    );

    let mut file = File::tetrahedron();
    file.skin(&[json!({})]);
    file.json["skins"][0]["joints"] = json!([8]);
    assert!(file.message().contains("node 8"), "{}", file.message());
    file.json["nodes"][0]["skin"] = json!(5);
    assert!(file.message().contains("skin 5"), "{}", file.message());
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    let mut weights = File::tetrahedron();
    weights.skin(&[json!({})]);
    let which = weights.floats(&[[f32::NAN, 0.0, 0.0, 0.0]; 4]);
    weights.attributes()["WEIGHTS_0"] = json!(which);
    let mut binds = File::tetrahedron();
    binds.skin(&[json!({})]);
    let which = binds.floats(&[[f32::INFINITY; 16]]);
    binds.json["skins"][0]["inverseBindMatrices"] = json!(which);
    let mut points = File::tetrahedron();
    let which = points.floats(&[[f32::NAN; 3]; 4]);
    points.attributes()["POSITION"] = json!(which);
    let mut far = File::tetrahedron();
    far.json["nodes"][0]["scale"] = json!([1e308, 1e308, 1e308]);
    far.json["nodes"][0]["translation"] = json!([1.7e308, 0, 0]);
    for file in [weights, binds, points, far] {
        assert!(file.message().contains("finite"), "{}", file.message());
    }
}

#[test]
fn a_node_has_one_parent_and_is_shown_once() {
    let mut file = File::tetrahedron();
    push(&mut file.json["nodes"], json!({ "children": [0] }));
    push(&mut file.json["nodes"], json!({ "children": [0] }));
    let message = file.message();
    assert!(
        message.contains("child of node 1 and again of node 2"),
        "{message}"
    );
    // A scene that lists a node and its parent.
    file.json["nodes"][1] = json!({ "children": [0], "translation": [5, 0, 0] });
    file.json["nodes"][2] = json!({});
    for roots in [json!([0, 1]), json!([1, 0]), json!([1])] {
        file.json["scenes"][0]["nodes"] = roots;
        assert_close(&file.points(), &transform(|p| p + Vec3::new(5.0, 0.0, 0.0)));
    }
}

#[test]
fn instances_and_targets_of_different_lengths_are_refused() {
    let mut file = File::tetrahedron();
    let (two, three) = (file.floats(&[[0.0; 3]; 2]), file.floats(&[[1.0; 3]; 3]));
    let attributes = json!({ "TRANSLATION": two, "SCALE": three });
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    file.json["nodes"][0]["extensions"] = instancing.clone();
    assert!(file.message().contains("[2, 3]"), "{}", file.message());

    let mut file = File::tetrahedron();
    let target = file.floats(&[[0.0; 3]; 3]);
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": target }]);
    file.json["meshes"][0]["weights"] = json!([1]);
    assert!(
        file.message().contains("3 points instead of 4"),
        "{}",
        file.message()
    );

    let mut file = File::tetrahedron();
    file.skin(&[json!({})]);
    file.json["nodes"][0]["extensions"] = instancing;
    assert!(
        file.message().contains("instances of a mesh with a skin"),
        "{}",
        file.message()
    );
}
