//! Skins, morph targets, instances and sparse data: positions of points.

use std::f32::consts::FRAC_1_SQRT_2;

use super::*;
use crate::LabelSource;

/// A quarter turn about z.
const QUARTER: [f32; 4] = [0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2];

fn turn(p: Vec3) -> Vec3 {
    Vec3::new(-p.y, p.x, p.z)
}

/// Inverse of a translation, by columns.
fn shift_back(by: [f32; 3]) -> [f32; 16] {
    let [x, y, z] = by.map(|x| -x);
    [
        1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, y, z, 1.0,
    ]
}

/// A tetrahedron in its bind pose, with two joints at (1, 2, 3) and, as its child, (1, 2, 5).
fn bound() -> File {
    let mut file = File::tetrahedron();
    file.skin(&[
        json!({ "translation": [1, 2, 3], "children": [2] }),
        json!({ "translation": [0, 0, 2] }),
    ]);
    let binds = file.floats(&[shift_back([1.0, 2.0, 3.0]), shift_back([1.0, 2.0, 5.0])]);
    file.json["skins"][0]["inverseBindMatrices"] = json!(binds);
    file
}

#[test]
fn joints_at_rest_leave_the_mesh_as_it_was_bound() {
    assert_close(&bound().points(), &transform(|p| p));
}

#[test]
fn the_node_of_a_skinned_mesh_moves_nothing() {
    let mut file = bound();
    file.json["nodes"][0]["translation"] = json!([10, 20, 30]);
    file.json["nodes"][0]["scale"] = json!([-5, 5, 5]);
    assert_eq!(file.read().unwrap().mesh, bound().read().unwrap().mesh);
    // The transform of its parent has no effect either.
    let mut below = bound();
    push(
        &mut below.json["nodes"],
        json!({ "children": [0], "translation": [7, 0, 0] }),
    );
    below.json["scenes"][0]["nodes"] = json!([3]);
    assert_eq!(below.read().unwrap().mesh, bound().read().unwrap().mesh);
}

#[test]
fn points_follow_their_joints_and_those_above() {
    let mut file = bound();
    file.json["nodes"][1]["rotation"] = json!(QUARTER);
    // Both joints turn about the first.
    let about = |p: Vec3| {
        let center = Vec3::new(1.0, 2.0, 3.0);
        center + turn(p - center)
    };
    assert_close(&file.points(), &transform(about));
    // Joints need not be in the scene, and their scale counts.
    let mut file = File::tetrahedron();
    file.skin(&[json!({ "scale": [2, 3, 4] })]);
    assert_close(&file.points(), &transform(|p| p * Vec3::new(2.0, 3.0, 4.0)));
}

#[test]
fn weights_share_a_point_among_joints_and_need_not_add_up_to_1() {
    for (weights, share) in [
        ([0.25, 0.75, 0.0, 0.0], 0.75),
        ([0.1, 0.1, 0.0, 0.0], 0.5),
        ([0.0; 4], 0.0),
    ] {
        let mut file = File::tetrahedron();
        file.skin(&[json!({}), json!({ "translation": [4, 0, 0] })]);
        let joints = file.add("VEC4", U16, 4, &[0, 0, 1, 0, 0, 0, 0, 0].repeat(4));
        let weights = file.floats(&[weights; 4]);
        file.attributes()["JOINTS_0"] = json!(joints);
        file.attributes()["WEIGHTS_0"] = json!(weights);
        assert_close(
            &file.points(),
            &transform(|p| p + Vec3::new(4.0 * share, 0.0, 0.0)),
        );
    }
}

#[test]
fn a_second_set_of_joints_and_weights_of_bytes_count_too() {
    let mut file = File::tetrahedron();
    file.skin(&[json!({}), json!({ "translation": [5, 0, 0] })]);
    let first = file.add("VEC4", U8, 4, &[0, 7, 7, 7].repeat(4));
    let second = file.add("VEC4", U8, 4, &[1, 0, 0, 0].repeat(4));
    let (most, least) = (
        file.shares(&[[204, 0, 0, 0]; 4]),
        file.shares(&[[51, 0, 0, 0]; 4]),
    );
    for (name, which) in [
        ("JOINTS_0", first),
        ("WEIGHTS_0", most),
        ("JOINTS_1", second),
        ("WEIGHTS_1", least),
    ] {
        file.attributes()[name] = json!(which);
    }
    // Joint 7 does not exist, but no weight refers to it.
    assert_close(&file.points(), &transform(|p| p + Vec3::new(1.0, 0.0, 0.0)));
}

#[test]
fn joints_that_mirror_keep_the_inside_inside() {
    let mut file = File::tetrahedron();
    file.skin(&[json!({ "scale": [-1, 1, 1] })]);
    let mesh = file.read().unwrap().mesh;
    assert!((mesh.signed_volume() - 1.0 / 6.0).abs() < 1e-12);
}

#[test]
fn a_morph_target_of_weight_1_adds_its_differences() {
    let delta = Vec3::new(0.0, 0.5, -2.0);
    let mut file = File::tetrahedron();
    let target = file.floats(&[delta.as_vec3().to_array(); 4]);
    let other = file.floats(&[[9.0; 3]; 4]);
    let primitive = &mut file.json["meshes"][0]["primitives"][0];
    primitive["targets"] = json!([{ "POSITION": target }, { "POSITION": other }, { "NORMAL": 99 }]);
    // Missing weights are all 0.
    assert_close(&file.points(), &transform(|p| p));
    file.json["meshes"][0]["weights"] = json!([1, 0]);
    assert_close(&file.points(), &transform(|p| p + delta));
    // Weights of a node override those of the mesh, and other nodes with the mesh keep its own.
    push(
        &mut file.json["nodes"],
        json!({ "mesh": 0, "weights": [-0.5, 0, 1] }),
    );
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    assert_close(&file.points()[4..], &transform(|p| p - 0.5 * delta));
    assert_close(&file.points()[..4], &transform(|p| p + delta));
}

#[test]
fn morph_targets_come_before_skins() {
    let mut file = File::tetrahedron();
    file.skin(&[json!({ "rotation": QUARTER, "scale": [2, 2, 2] })]);
    let target = file.floats(&[[1.0, 0.0, 0.0]; 4]);
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": target }]);
    file.json["meshes"][0]["weights"] = json!([1]);
    assert_close(&file.points(), &transform(|p| 2.0 * turn(p + Vec3::X)));
}

#[test]
fn instances_are_copies_with_moves_of_their_own() {
    let mut file = File::tetrahedron();
    let by = file.floats(&[[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 8.0]]);
    let turns = file.floats(&[[0.0, 0.0, 0.0, 1.0], QUARTER, QUARTER]);
    let scales = file.floats(&[[1.0; 3], [1.0; 3], [-2.0, 2.0, 2.0]]);
    let attributes = json!({ "TRANSLATION": by, "ROTATION": turns, "SCALE": scales, "_ID": 1 });
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    file.json["nodes"][0]["scale"] = json!([2, 2, 2]);
    let loaded = file.read().unwrap();
    let copies: Vec<Vec3> = [
        transform(|p| 2.0 * p),
        transform(|p| 2.0 * (turn(p) + 3.0 * Vec3::X)),
        transform(|p| 2.0 * (turn(2.0 * p * Vec3::new(-1.0, 1.0, 1.0)) + 8.0 * Vec3::Z)),
    ]
    .concat();
    assert_close(&loaded.mesh.points, &copies);
    let volume = (8.0 + 8.0 + 64.0) / 6.0;
    assert!((loaded.mesh.signed_volume() - volume).abs() < 1e-6);
    let objects = loaded.labels(LabelSource::Object).unwrap();
    assert_eq!(objects, [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2]);
}

#[test]
fn a_mesh_of_no_instances_is_not_shown() {
    let mut file = File::tetrahedron();
    let none = file.floats::<3>(&[]);
    let attributes = json!({ "TRANSLATION": none });
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    assert!(matches!(file.read(), Err(ReadError::NoTriangles { .. })));
}

#[test]
fn instances_do_not_move_the_children_of_their_node() {
    let mut file = File::tetrahedron();
    let by = file.floats(&[[10.0, 0.0, 0.0]; 2]);
    let attributes = json!({ "TRANSLATION": by });
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    file.json["nodes"][0]["children"] = json!([1]);
    push(&mut file.json["nodes"], json!({ "mesh": 0 }));
    let points = file.points();
    assert_eq!(points.len(), 12);
    assert_close(&points[8..], &transform(|p| p));
}

#[test]
fn sparse_data_equals_dense() {
    let rows = [[5.0, 6.0, 7.0], [0.5, 0.0, 0.25]];
    let mut dense = File::tetrahedron();
    let mut all = POINTS;
    (all[3], all[1]) = (rows[0], rows[1]);
    let position = dense.floats(&all);
    dense.attributes()["POSITION"] = json!(position);
    // Replaced rows may come in any order.
    for (places, rows) in [([3, 1], rows), ([1, 3], [rows[1], rows[0]])] {
        let mut sparse = File::tetrahedron();
        let position = sparse.sparse(Some(0), 4, &places, &rows);
        sparse.attributes()["POSITION"] = json!(position);
        assert_eq!(sparse.read().unwrap().mesh, dense.read().unwrap().mesh);
    }
}

#[test]
fn sparse_data_without_a_base_is_zero_elsewhere() {
    let mut file = File::tetrahedron();
    let position = file.sparse(None, 4, &[1, 2, 3], &POINTS[1..]);
    file.attributes()["POSITION"] = json!(position);
    assert_close(&file.points(), &transform(|p| p));
    // Morph targets are sparse most often.
    let target = file.sparse(None, 4, &[2], &[[0.0, 4.0, 0.0]]);
    let nothing = push(
        &mut file.json["accessors"],
        json!({ "componentType": F32, "count": 4, "type": "VEC3" }),
    );
    let targets = json!([{ "POSITION": target }, { "POSITION": nothing }]);
    file.json["meshes"][0]["primitives"][0]["targets"] = targets;
    file.json["meshes"][0]["weights"] = json!([1, 1]);
    assert_close(&file.points(), &transform(|p| p * Vec3::new(1.0, 5.0, 1.0)));
}

#[test]
fn quantised_points_are_whole_numbers_or_shares() {
    let mut file = File::tetrahedron();
    let rows: Vec<u8> = POINTS.as_flattened().iter().map(|&x| x as u8 * 100).collect();
    let whole = file.add("VEC3", U8, 4, &rows);
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    file.attributes()["POSITION"] = json!(whole);
    assert_close(&file.points(), &transform(|p| 100.0 * p));
    file.json["accessors"][whole]["normalized"] = json!(true);
    assert_close(&file.points(), &transform(|p| 100.0 / 255.0 * p));
}
