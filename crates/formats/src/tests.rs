use std::fmt::Write as _;
use std::io::{Cursor, Read as _};

use proptest::prelude::*;

use super::*;
use shellock_geom::Vec3;
use shellock_geom::weld::weld;
use shellock_testkit::shapes::tetrahedron;

fn ascii_stl(mesh: &TriMesh, name: &str) -> String {
    let mut text = format!("solid {name}\n");
    for face in 0..mesh.triangles.len() {
        text += "facet normal 0 0 0\n outer loop\n";
        mesh.corners(face)
            .iter()
            .for_each(|p| writeln!(text, "  vertex {} {} {}", p.x, p.y, p.z).unwrap());
        text += " endloop\nendfacet\n";
    }
    text + "endsolid\n"
}

fn obj(mesh: &TriMesh) -> String {
    let mut text = String::new();
    mesh.points
        .iter()
        .for_each(|p| writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap());
    mesh.triangles
        .iter()
        .for_each(|[a, b, c]| writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap());
    text
}

fn off(mesh: &TriMesh) -> String {
    let mut text = format!("OFF\n{} {} 0\n", mesh.points.len(), mesh.triangles.len());
    mesh.points
        .iter()
        .for_each(|p| writeln!(text, "{} {} {}", p.x, p.y, p.z).unwrap());
    mesh.triangles
        .iter()
        .for_each(|[a, b, c]| writeln!(text, "3 {a} {b} {c}").unwrap());
    text
}

fn read(text: impl AsRef<[u8]>) -> Result<Loaded, ReadError> {
    read_mesh(text.as_ref(), None)
}

fn message(text: impl AsRef<[u8]>) -> String {
    read(text).expect_err("the file is broken").to_string()
}

/// Asserts that a note of `loaded` contains `words`.
#[track_caller]
pub(crate) fn assert_note(loaded: &Loaded, words: &str) {
    let is_told = loaded.notes.iter().any(|note| note.contains(words));
    assert!(is_told, "{words:?} is not in {:?}", loaded.notes);
}

#[test]
fn every_format_gives_the_tetrahedron_back() {
    let mesh = tetrahedron();
    for (bytes, format) in [
        (obj(&mesh).into_bytes(), Format::Obj),
        (off(&mesh).into_bytes(), Format::Off),
        (write_ply(&mesh, None), Format::Ply),
    ] {
        let loaded = read(bytes).unwrap();
        let file_face = vec![0, 1, 2, 3];
        let (mesh, labellings, notes) = (mesh.clone(), vec![], vec![]);
        assert_eq!(
            loaded,
            Loaded {
                mesh,
                labellings,
                file_face,
                format,
                unit_mm: None,
                has_unit: false,
                objects: Vec::new(),
                empty_plates: Vec::new(),
                cutters: Vec::new(),
                notes
            }
        );
    }
    for (bytes, format) in [
        (write_stl_binary(&mesh), Format::StlBinary),
        (ascii_stl(&mesh, "x").into_bytes(), Format::StlAscii),
    ] {
        let loaded = read_mesh(&bytes, Some("obj")).unwrap();
        assert_eq!((loaded.format, loaded.mesh.points.len()), (format, 12));
        assert_eq!(weld(&loaded.mesh).mesh.points.len(), 4);
    }
}

#[test]
fn stl_quirks() {
    let text = ascii_stl(&tetrahedron(), "facet Ü");
    let upper = text.to_uppercase().replace('\n', "\r\n");
    assert_eq!(read(upper).unwrap().mesh, read(&text).unwrap().mesh);
    let several = text.clone() + &text;
    assert_eq!(read(several).unwrap().mesh.triangles.len(), 8);
    let mut solid = write_stl_binary(&tetrahedron());
    solid[..6].copy_from_slice(b"solid ");
    assert_eq!(read(&solid).unwrap().format, Format::StlBinary);
    // Padding after the last triangle hides the length rule, but the zero bytes still reveal binary content.
    solid.extend_from_slice(b"\0\0");
    assert_eq!(read(&solid).unwrap().mesh.triangles.len(), 4);
}

#[test]
fn wrong_counts_trailing_bytes_and_colours_of_stl() {
    let bytes = write_stl_binary(&tetrahedron());
    let stl = |bytes: &[u8]| read_mesh(bytes, Some(".STL")).unwrap();
    // Counts by programs that do not know them, or get them wrong.
    for count in [0_u32, 2, u32::MAX] {
        let mut other = bytes.clone();
        other[80..84].copy_from_slice(&count.to_le_bytes());
        let loaded = stl(&other);
        assert_eq!(
            (loaded.mesh.triangles.len(), loaded.notes.len()),
            (4, 1),
            "{count}"
        );
    }
    let mut trailing = bytes.clone();
    trailing.extend([b'x'; 70]);
    assert_eq!(
        (stl(&trailing).mesh.triangles.len(), stl(&trailing).notes.len()),
        (4, 1)
    );
    // Colours: the highest bit says that there is one; in files of Magics, that there is none.
    let mut colored = bytes;
    colored[84 + 48..84 + 50].copy_from_slice(&0x8003_u16.to_le_bytes());
    colored[84 + 98..84 + 100].copy_from_slice(&0x8003_u16.to_le_bytes());
    colored[84 + 148..84 + 150].copy_from_slice(&0x0004_u16.to_le_bytes());
    assert_eq!(stl(&colored).labels(LabelSource::Color), Some(&[0, 0, 1, 1][..]));
    colored[..6].copy_from_slice(b"COLOR=");
    assert_eq!(stl(&colored).labels(LabelSource::Color), Some(&[0, 0, 1, 2][..]));
    let text = ascii_stl(&tetrahedron(), "x");
    assert_eq!(read(&text).unwrap().labellings, []);
    assert_eq!(
        read(text.clone() + &text)
            .unwrap()
            .labels(LabelSource::Object)
            .unwrap()[3..5],
        [1, 2]
    );
}

#[test]
fn groups_materials_and_colours_divide_and_a_single_one_does_not() {
    let grouped = "o thing\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\ng a b\nusemtl red\nf 1 2 4\ng c\nf \
                   2 3 4\ng a b\nf 1 4 3\n";
    let loaded = read(grouped).unwrap();
    assert_eq!(loaded.labels(LabelSource::Group), Some(&[-1, 0, 1, 0][..]));
    assert_eq!(loaded.labels(LabelSource::Material), Some(&[-1, 0, 0, 0][..]));
    assert_eq!(
        (loaded.labels(LabelSource::Object), loaded.face_labels()),
        (None, None)
    );
    let colored = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty \
                   float z\nelement face 3\nproperty list uchar int vertex_indices\nproperty uchar \
                   red\nproperty uchar green\nproperty uchar blue\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 \
                   1\n3 0 1 2 255 0 0\n3 0 1 3 0 0 255\n4 0 1 2 3 255 0 0\n";
    assert_eq!(
        read(colored).unwrap().labels(LabelSource::Color),
        Some(&[0, 1, 0, 0][..])
    );
    let off = "OFF 3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 1 0 0\n3 0 2 1 0 1 0\n";
    assert_eq!(read(off).unwrap().labels(LabelSource::Color), Some(&[0, 1][..]));
}

#[test]
fn strips_of_ply_turn_every_other_triangle_and_begin_anew() {
    let text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float \
                z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 \
                0\n1 1 0\n2 1 0\n9 0 1 2 3 3 -1 1 4 3\n";
    assert_eq!(
        read(text).unwrap().mesh.triangles,
        [[0, 1, 2], [2, 1, 3], [1, 4, 3]]
    );
}

#[test]
fn broken_stl_is_refused_with_its_place() {
    let bytes = write_stl_binary(&tetrahedron());
    let stl = |bytes: &[u8]| read_mesh(bytes, Some(".STL")).unwrap_err();
    let too_few = ReadError::TooFewBytes {
        at: Place::Byte(80),
        what: "triangles",
        count: 4,
        room: 3,
    };
    assert_eq!(stl(&bytes[..270]), too_few);
    assert_eq!(
        stl(&bytes[..50]),
        ReadError::CutOff {
            at: Place::Byte(50),
            within: "the header"
        }
    );
    let mut nan = bytes;
    nan[84 + 50 + 24..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(
        stl(&nan),
        ReadError::NotFinite {
            at: Place::Byte(84 + 50 + 24)
        }
    );

    let text = ascii_stl(&tetrahedron(), "x");
    assert!(matches!(
        read(&text[..text.len() - 20]),
        Err(ReadError::CutOff { .. })
    ));
    assert_eq!(
        message(text.replacen("vertex 0", "vertex O", 1)),
        "line 4: expected a number, found \"O\"; correct it there or export the file again"
    );
    assert_eq!(
        read("solid\nendsolid"),
        Err(ReadError::NoTriangles {
            format: Format::StlAscii,
            n_points: 0
        })
    );
}

#[test]
fn obj_quirks() {
    let text = "\u{FEFF}# BOM\r\nmtllib a.mtl\r\nv 0 0 0 1 0 0\r\nv 1 0 0\r\nv 1 1 0 # corner\r\nv 0 1 \
                0\r\nvt 0 0\r\nf 1/1/1 2//1 \\\r\n  3/1 4\r\nl 1 2\r\nf -4 -3 -2\r\nf 5 1 2\r\nv 0 0 1";
    let loaded = read(text).unwrap();
    assert_eq!(
        loaded.mesh.triangles,
        [[0, 1, 2], [0, 2, 3], [0, 1, 2], [4, 0, 1]]
    );
    assert_eq!(
        (loaded.file_face.clone(), loaded.n_file_faces()),
        (vec![0, 0, 1, 2], 3)
    );
    assert_eq!(
        message("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
        "line 4: a face uses point 4, but the file has 3 points, counted from 1; export the model again"
    );
    assert_eq!(
        read("v 0 0 0\nf 1 0 1").unwrap_err(),
        ReadError::MissingPoint {
            at: Place::Line(2),
            index: 0,
            n_points: 1,
            first: 1
        }
    );
    assert!(matches!(
        read("v 0 0 0\nf -2 1 1"),
        Err(ReadError::MissingPoint { .. })
    ));
    assert_eq!(
        read("v 0 0 -nan(ind)"),
        Err(ReadError::NotFinite { at: Place::Line(1) })
    );
    assert_eq!(
        read("v 0 0 1e999"),
        Err(ReadError::NotFinite { at: Place::Line(1) })
    );
    assert!(message("v 0,5 0 0").contains("found \"0,5\""));
}

#[test]
fn what_a_file_is_wrapped_in_makes_no_difference() {
    let plain = obj(&tetrahedron());
    let expected = read(&plain).unwrap().mesh;
    for (bom, is_big) in [("\u{FEFF}", true), ("\u{FEFF}", false), ("", true), ("", false)] {
        let text = format!("{bom}{plain}");
        let bytes: Vec<u8> = text
            .encode_utf16()
            .flat_map(|c| if is_big { c.to_be_bytes() } else { c.to_le_bytes() })
            .collect();
        assert_eq!(read(bytes).unwrap().mesh, expected);
    }
    let packed = gzip(plain.as_bytes());
    assert_eq!(read(&packed).unwrap().mesh, expected);
    let archive = zip_of(&[("readme.txt", b"hello"), ("a/model.obj", plain.as_bytes())]);
    let loaded = read(&archive).unwrap();
    assert_eq!((loaded.mesh, loaded.notes.len()), (expected.clone(), 1));
    assert_eq!(read(zip_of(&[("model.obj.gz", &packed)])).unwrap().mesh, expected);
    // The extension within the archive counts.
    let bare = b"3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2";
    assert_eq!(
        read_mesh(&zip_of(&[("x.OFF", bare)]), Some("zip"))
            .unwrap()
            .format,
        Format::Off
    );

    let two = zip_of(&[("a.stl", b""), ("b.stl", b"")]);
    assert_eq!(read(two), Err(ReadError::Archive { n_models: 2 }));
    assert!(matches!(
        read(b"PK\x03\x04something"),
        Err(ReadError::Damaged { .. })
    ));
    assert!(matches!(
        read(&packed[..packed.len() - 9]),
        Err(ReadError::Damaged { .. })
    ));
    assert_eq!(read(" \r\n"), Err(ReadError::Empty));
    assert_eq!(read("hello"), Err(ReadError::UnknownFormat));
    for (text, what) in [
        (" <!DOCTYPE html><html>", "a web page"),
        ("%PDF-1.7", "a PDF document"),
        ("G28\nG1 X1", "G-code for a printer"),
    ] {
        assert_eq!(read(text), Err(ReadError::NotAModel { what }));
    }
}

#[test]
fn bombs_are_refused_before_they_fill_the_memory() {
    // Blanks are compressed to a thousandth.
    let blanks = vec![b' '; 100 << 20];
    assert_eq!(read(gzip(&blanks)), Err(ReadError::Bomb { limit_mb: 73 }));
    let limit = read(zip_of(&[("3D/3dmodel.model", &blanks)]));
    assert!(matches!(limit, Err(ReadError::Bomb { .. })), "{limit:?}");
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    std::io::Write::write_all(&mut packer, bytes).unwrap();
    packer.finish().unwrap()
}

fn zip_of(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        archive
            .start_file(*name, zip::write::SimpleFileOptions::default())
            .unwrap();
        std::io::Write::write_all(&mut archive, bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

#[test]
fn ply_skips_what_it_does_not_know_and_keeps_labels() {
    let header = |format: &str| {
        format!(
            "ply\r\nformat {format} 1.0\r\ncomment made by hand\r\nelement camera 1\r\nproperty list uchar \
             short k\r\nelement vertex 4\r\nproperty uchar red\r\nproperty double x\r\nproperty float \
             y\r\nproperty int z\r\nproperty list uint8 float extra\r\nelement face 2\r\nproperty char \
             flag\r\nproperty int Label\r\nproperty list ushort uint vertex_indices\r\nend_header\r\n"
        )
    };
    let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, -2]];
    let mut ascii = header("ascii").into_bytes();
    ascii.extend_from_slice(b"2 7 8\r\n");
    let mut binary = header("binary_big_endian").into_bytes();
    binary.extend_from_slice(&[2, 0, 7, 0, 8]);
    for [x, y, z] in corners {
        ascii.extend_from_slice(format!("9 {x} {y} {z} 1 0.5\r\n").as_bytes());
        binary.push(9);
        binary.extend_from_slice(&f64::from(x).to_be_bytes());
        binary.extend_from_slice(&(y as f32).to_be_bytes());
        binary.extend_from_slice(&i32::to_be_bytes(z));
        binary.extend_from_slice(&[1, 0, 0, 0, 0]);
    }
    for (label, polygon) in [(5_i32, &[0_u32, 1, 2, 3][..]), (-1, &[0, 3, 1])] {
        ascii.extend_from_slice(format!("0 {label} {}", polygon.len()).as_bytes());
        binary.push(0);
        binary.extend_from_slice(&label.to_be_bytes());
        binary.extend_from_slice(&(polygon.len() as u16).to_be_bytes());
        for corner in polygon {
            ascii.extend_from_slice(format!(" {corner}").as_bytes());
            binary.extend_from_slice(&corner.to_be_bytes());
        }
        ascii.extend_from_slice(b"\r\n");
    }
    let loaded = read(&ascii).unwrap();
    assert_eq!(loaded, read(&binary).unwrap());
    assert_eq!(loaded.face_labels(), Some(&[5, 5, -1][..]));
    assert_note(&loaded, "1 of 2 faces have a \"label\" below 0");
    assert_eq!(loaded.file_face, [0, 0, 1]);
    assert_eq!(loaded.mesh.points[3], Vec3::new(0.0, 1.0, -2.0));
    assert!(matches!(
        read(&binary[..binary.len() - 1]),
        Err(ReadError::CutOff { .. })
    ));
}

#[test]
fn labels_of_a_float_property_divide_where_they_are_whole() {
    let ply = |label: &str| {
        read(format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float \
             z\nelement face 2\nproperty list uchar int vertex_indices\nproperty float label\nend_header\n0 \
             0 0\n1 0 0\n0 1 0\n3 0 1 2 1.0\n3 0 2 1 {label}\n"
        ))
        .unwrap()
    };
    assert_eq!(ply("4.0").face_labels(), Some(&[1, 4][..]));
    let odd = ply("0.5");
    assert_eq!(odd.face_labels(), None);
    assert_note(&odd, "not all are whole numbers");
}

#[test]
fn a_packing_that_is_not_read_is_no_damage() {
    const METHOD_IN_FILE: usize = 8;
    const METHOD_IN_DIRECTORY: usize = 10;
    let mut bytes = zip_of(&[("a.stl", b"solid a\nendsolid a\n")]);
    let directory = bytes.windows(4).position(|w| w == b"PK\x01\x02").unwrap();
    for at in [METHOD_IN_FILE, directory + METHOD_IN_DIRECTORY] {
        bytes[at..at + 2].copy_from_slice(&12_u16.to_le_bytes());
    }
    assert!(
        matches!(read(&bytes), Err(ReadError::Packing { .. })),
        "{:?}",
        read(&bytes)
    );
}

#[test]
fn written_labels_are_read_again() {
    let labels = [3, -7, 0, i32::MAX];
    let loaded = read(write_ply(&tetrahedron(), Some(&labels))).unwrap();
    assert_eq!(loaded.face_labels().unwrap(), labels.map(i64::from));
    assert_eq!(read_labels(&write_labels(&[4, 0, 17])), Ok(vec![4, 0, 17]));
}

#[test]
fn counts_that_lie_reserve_nothing() {
    let ply = |count: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty \
             float z\nend_header\n0 0 0\n"
        )
    };
    assert!(matches!(
        read(ply("18446744073709551615")),
        Err(ReadError::TooFewBytes { room: 1, .. })
    ));
    assert!(matches!(
        read(ply("-1")),
        Err(ReadError::Malformed {
            at: Place::Line(3),
            ..
        })
    ));
    assert!(matches!(
        read("OFF 353535235358 6 0\n0 0 0\n"),
        Err(ReadError::TooFewBytes { what: "points", .. })
    ));
    let empty_rows = "ply\nformat ascii 1.0\nelement ghost 18446744073709551615\nend_header\n";
    assert!(matches!(read(empty_rows), Err(ReadError::NoTriangles { .. })));
}

#[test]
fn off_quirks() {
    let text =
        "# by hand\nCOFF 4 2 0 # counts\n\n0 0 0 255 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 9 9 9\n3 0 3 1\n";
    let loaded = read(text).unwrap();
    assert_eq!(loaded.mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 1]]);
    assert_eq!(loaded.file_face, [0, 0, 1]);
    assert!(matches!(
        read("OFF BINARY\n1 1 1"),
        Err(ReadError::Unsupported {
            at: Place::Line(1),
            ..
        })
    ));
    assert!(matches!(read("4OFF\n1 1 1"), Err(ReadError::Unsupported { .. })));
    assert!(matches!(
        read_mesh(b"3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2", Some("off")),
        Ok(loaded) if loaded.format == Format::Off
    ));
    assert!(matches!(
        read("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1    \n"),
        Err(ReadError::TooFewCorners { n_corners: 2, .. })
    ));
    assert!(matches!(
        read("OFF 2 1 0\n0 0 0\n1 0 0 # long enough\n"),
        Err(ReadError::CutOff { .. })
    ));
}

#[test]
fn labels_are_whole_numbers_from_0() {
    assert_eq!(read_labels(b"3\r\n\r\n 0 \r\n12.0"), Ok(vec![3, 0, 12]));
    assert_eq!(
        read_labels(b"1\n-1\n"),
        Err(ReadError::NegativeLabel {
            at: Place::Line(2),
            label: -1
        })
    );
    for bad in ["1\nfoo\n", "1\n2.5\n", "1\n2 3\n", "1\n1e40\n", "1\nnan\n"] {
        assert!(
            matches!(
                read_labels(bad.as_bytes()),
                Err(ReadError::Malformed {
                    at: Place::Line(2),
                    ..
                })
            ),
            "{bad}"
        );
    }
    assert_eq!(read_labels(b"\n \n"), Err(ReadError::Empty));
}

#[test]
fn settings_of_objects_are_written_for_prusaslicer_and_change_no_mesh() {
    let mesh = tetrahedron();
    let object = |name, settings| NamedObject {
        name,
        color: [0; 3],
        mesh: &mesh,
        rotation: None,
        moved_mm: [0.0; 3],
        settings,
    };
    let bytes = write_3mf(&[object("a", &[]), object("b & c", &[("raft_layers", "2")])]);
    let mut text = String::new();
    zip::ZipArchive::new(Cursor::new(&bytes))
        .unwrap()
        .by_name("Metadata/Slic3r_PE_model.config")
        .unwrap()
        .read_to_string(&mut text)
        .unwrap();
    let (first, second) = text.split_once("<object id=\"3\"").unwrap();
    assert!(!first.contains("raft_layers") && first.contains("<object id=\"2\""));
    assert!(second.contains("key=\"raft_layers\" value=\"2\"") && second.contains("b &amp; c"));
    // The slicer makes nothing of triangles outside the range.
    assert_eq!(text.matches("firstid=\"0\" lastid=\"3\"").count(), 2);
    let read = |bytes: &[u8]| read_mesh(bytes, None).unwrap().mesh;
    let plain = write_3mf(&[object("a", &[]), object("b & c", &[])]);
    assert_eq!(read(&bytes), read(&plain));
}

#[test]
fn a_3mf_holds_its_objects_and_is_the_same_each_time() {
    let mesh = tetrahedron();
    // Maps x to y, and y to −x.
    let quarter = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let objects = [
        NamedObject {
            name: "leg <\"1\" & 2>\u{1}",
            color: [255, 0, 16],
            mesh: &mesh,
            rotation: None,
            moved_mm: [0.0; 3],
            settings: &[],
        },
        NamedObject {
            name: "Kopf ä",
            color: [1, 2, 3],
            mesh: &mesh,
            rotation: Some(quarter),
            moved_mm: [10.0, 0.5, -3.0],
            settings: &[],
        },
    ];
    let bytes = write_3mf(&objects);
    assert_eq!(bytes, write_3mf(&objects));
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    let names: Vec<_> = archive
        .file_names()
        .map(|name| name.unwrap().into_owned())
        .collect();
    assert_eq!(names, ["3D/3dmodel.model", "[Content_Types].xml", "_rels/.rels"]);
    let mut model = String::new();
    archive
        .by_name("3D/3dmodel.model")
        .unwrap()
        .read_to_string(&mut model)
        .unwrap();
    for part in [
        "unit=\"millimeter\"",
        "<metadata name=\"Title\">",
        "<base name=\"leg &lt;&quot;1&quot; &amp; 2&gt;\u{FFFD}\" displaycolor=\"#FF0010FF\"/>",
        "name=\"Kopf ä\" pid=\"1\" pindex=\"1\"",
        "<item objectid=\"2\"/>",
        "<item objectid=\"3\" transform=\"0 1 0 -1 0 0 0 0 1 10 0.5 -3\"/>",
        "<triangle v1=\"0\" v2=\"2\" v3=\"1\"/>",
    ] {
        assert!(model.contains(part), "{part} in {model}");
    }
    assert_eq!(
        (model.matches("<vertex ").count(), model.matches("<item ").count()),
        (8, 2)
    );
}

/// Returns a valid file of each format.
fn valid_files() -> Vec<Vec<u8>> {
    let mesh = tetrahedron();
    let mut files = vec![
        write_stl_binary(&mesh),
        write_ply(&mesh, Some(&[0, 1, 2, 3])),
        write_ply(&mesh, None),
    ];
    files.extend([ascii_stl(&mesh, "x"), obj(&mesh), off(&mesh)].map(String::into_bytes));
    files.push(write_painted_3mf("x", &mesh, &[0, 1, 2, 3]));
    files.push(
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
          element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
            .to_vec(),
    );
    files
}

/// Calls every reader of external bytes.
fn read_all_ways(bytes: &[u8]) {
    let _ = read_labels(bytes);
    for extension in [
        None,
        Some("stl"),
        Some("obj"),
        Some("ply"),
        Some("off"),
        Some("gltf"),
    ] {
        if let Ok(loaded) = read_mesh(bytes, extension) {
            let _ = shellock_geom::check::into_solid(&loaded.mesh);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2000, failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn no_reader_panics_on_random_bytes(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        read_all_ways(&bytes);
    }

    #[test]
    fn no_reader_panics_on_damaged_files(
        file in 0_usize..8,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
        (from, to) in (any::<prop::sample::Index>(), any::<prop::sample::Index>()),
    ) {
        let mut bytes = valid_files().swap_remove(file);
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        // A byte of a text copied elsewhere keeps more files half valid than random bytes do.
        let (from, to) = (from.index(bytes.len()), to.index(bytes.len()));
        bytes[to] = bytes[from];
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        read_all_ways(&bytes);
    }
}
