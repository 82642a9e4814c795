//! Broken files, and files that claim more than they contain.

use proptest::prelude::*;

use super::*;
use crate::read_mesh;

/// A file with everything that moves points: a skin, a sparse morph target, colours and instances.
fn all_at_once() -> File {
    let mut file = File::tetrahedron();
    file.skin(&[json!({ "children": [2] }), json!({ "translation": [0, 0, 2] })]);
    let binds = file.floats(&[[1.0; 16]; 2]);
    file.json["skins"][0]["inverseBindMatrices"] = json!(binds);
    let target = file.sparse(None, 4, &[1, 3], &[[1.0; 3], [2.0; 3]]);
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": target }]);
    file.json["meshes"][0]["weights"] = json!([0.5]);
    let colors = file.shares(&[[1, 2, 3], [4, 5, 6], [7, 8, 9], [1, 2, 3]]);
    file.attributes()["COLOR_0"] = json!(colors);
    let by = file.floats(&[[1.0; 3], [2.0; 3]]);
    let attributes = json!({ "TRANSLATION": by });
    let instanced =
        json!({ "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": attributes } } });
    let node = push(&mut file.json["nodes"], instanced);
    file.json["scenes"][0]["nodes"] = json!([0, 1, node]);
    file
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    let file = all_at_once();
    assert_eq!(file.read().unwrap().mesh.triangles.len(), 12);
    let bytes = file.glb();
    for end in 0..bytes.len() {
        assert!(read_mesh(&bytes[..end], Some("glb")).is_err(), "{end} bytes");
    }
    // Files whose data ends early are rejected, too, even if their chunks are whole.
    let mut cut = file;
    while let Some(byte) = cut.data.pop() {
        // The last values are instances, whose view is cut first; padding may make up for a few bytes.
        let is_read = cut.read().is_ok();
        assert!(
            !is_read || !cut.data.len().is_multiple_of(4),
            "without {byte} at {}",
            cut.data.len()
        );
    }
}

#[test]
fn copies_are_counted_before_they_are_made() {
    // An accessor without any bytes behind it, and one with many copies of a row.
    let mut file = File::tetrahedron();
    let by = file.sparse(None, 4_000_000_000, &[0], &[[1.0; 3]]);
    let attributes = json!({ "TRANSLATION": by });
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    assert!(
        matches!(file.read(), Err(ReadError::TooManyCopies { .. })),
        "{:?}",
        file.read()
    );
    let mut file = File::tetrahedron();
    let points = file.sparse(None, usize::MAX, &[0], &[[1.0; 3]]);
    file.attributes()["POSITION"] = json!(points);
    file.json["meshes"][0]["primitives"][0]
        .as_object_mut()
        .unwrap()
        .remove("indices");
    assert!(
        matches!(file.read(), Err(ReadError::TooManyCopies { .. })),
        "{:?}",
        file.read()
    );
}

#[test]
fn a_sparse_accessor_reserves_only_what_triangles_use() {
    let mut file = File::tetrahedron();
    let points = file.sparse(None, 1 << 60, &[1, 2, 3], &POINTS[1..]);
    file.attributes()["POSITION"] = json!(points);
    assert_close(&file.points(), &transform(|p| p));
    file.json["accessors"][points]["sparse"]["count"] = json!(1_u64 << 60);
    assert!(file.message().contains("beyond its data"), "{}", file.message());
    file.json["accessors"][points]["count"] = json!(3);
    file.json["accessors"][points]["sparse"]["count"] = json!(3);
    assert!(
        file.message().contains("replaces row 3 of 3"),
        "{}",
        file.message()
    );
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2000, failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn damaged_files_end_in_an_answer(
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0_usize..4), 1..4),
        bytes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
    ) {
        let mut file = all_at_once();
        for (at, value) in bytes {
            let at = at.index(file.data.len());
            file.data[at] = value;
        }
        let mut document = file.json.to_string().into_bytes();
        // Digits are indices, counts and lengths: most changes of them keep the document valid.
        let digits: Vec<usize> = (0..document.len()).filter(|&i| document[i].is_ascii_digit()).collect();
        for (which, how) in changes {
            let at = digits[which.index(digits.len())];
            document[at] = [b'0', b'1', b'5', b'9'][how];
        }
        if let Ok(loaded) = read_mesh(&glb(&document, &file.data), None) {
            prop_assert!(loaded.mesh.points.iter().all(|p| p.is_finite()));
            let n = loaded.mesh.points.len();
            prop_assert!(loaded.mesh.triangles.as_flattened().iter().all(|&c| (c as usize) < n));
        }
    }
}
