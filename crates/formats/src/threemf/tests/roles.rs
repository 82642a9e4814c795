//! Parts that are printed, cut out, left out or rejected, according to the file.

use super::super::super::{Selection, read_selection};
use super::*;
use shellock_geom::TriMesh;
use shellock_testkit::shapes::cuboid;

/// An object of a box from `min` to `max`; `more` goes before its mesh.
fn box_of(id: u32, attributes: &str, more: &str, min: [f64; 3], max: [f64; 3]) -> String {
    let mesh = mesh_xml(&cuboid(min, max).to_mesh());
    format!("<object id=\"{id}\" {attributes}>{more}{mesh}</object>")
}

fn mesh_xml(mesh: &TriMesh) -> String {
    let point = |p: &Vec3| format!("<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>", p.x, p.y, p.z);
    let triangle = |[a, b, c]: &[u32; 3]| format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>");
    let points: String = mesh.points.iter().map(point).collect();
    let triangles: String = mesh.triangles.iter().map(triangle).collect();
    format!("<mesh><vertices>{points}</vertices><triangles>{triangles}</triangles></mesh>")
}

pub(super) fn cube(id: u32, attributes: &str) -> String {
    box_of(id, attributes, "", [0.0; 3], [10.0; 3])
}

/// A box that protrudes from [`cube`] along x.
fn bar(id: u32, attributes: &str, more: &str) -> String {
    box_of(id, attributes, more, [8.0, 4.0, 4.0], [20.0, 6.0, 6.0])
}

pub(super) fn items(ids: &[u32]) -> String {
    ids.iter()
        .map(|id| format!("<item objectid=\"{id}\"/>"))
        .collect()
}

pub(super) fn with_settings(
    resources: &str,
    build: &str,
    name: &str,
    settings: &str,
) -> Result<Loaded, ReadError> {
    let root = model(resources, build);
    read_mesh(&package(&[(USUAL_ROOT, &root), (name, settings)]), None)
}

fn volume(loaded: &Loaded) -> f64 {
    loaded.mesh.signed_volume()
}

#[test]
fn objects_of_other_types_and_of_cura_s_marks_are_left_out_and_told() {
    for (kind, word) in [
        ("support", "support"),
        ("solidsupport", "support"),
        ("surface", "surface"),
        ("other", "other"),
    ] {
        let resources = cube(1, "") + &bar(2, &format!("type=\"{kind}\" name=\"extra\""), "");
        let loaded = read_model(&resources, &items(&[1, 2])).unwrap();
        assert_eq!(
            (loaded.mesh.triangles.len(), volume(&loaded)),
            (12, 1000.0),
            "{kind}"
        );
        assert_note(&loaded, word);
        assert_note(&loaded, "\"extra\"");
    }
    let marks = [
        "support_mesh",
        "anti_overhang_mesh",
        "infill_mesh",
        "cutting_mesh",
    ];
    for mark in marks {
        let newer = format!("<metadatagroup><metadata name=\"cura:{mark}\">True</metadata></metadatagroup>");
        let older = format!("<settings><setting key=\"{mark}\"> true </setting></settings>");
        for (of_object, of_item) in [(&newer[..], ""), (&older, ""), ("", &newer[..])] {
            let resources = cube(1, "") + &bar(2, "", of_object);
            let build = format!("<item objectid=\"1\"/><item objectid=\"2\">{of_item}</item>");
            let loaded = read_model(&resources, &build).unwrap();
            assert_eq!(volume(&loaded), 1000.0, "{mark}");
            assert_note(&loaded, "left out as");
            let off = read_model(&resources.replace("rue", "alse"), &build.replace("rue", "alse")).unwrap();
            assert_eq!(off.mesh.triangles.len(), 24, "{mark} is off");
        }
    }
    let nothing = read_model(&cube(1, "type=\"other\""), &items(&[1])).unwrap_err();
    assert!(nothing.to_string().contains("contains only"), "{nothing}");
}

/// A block whose second part is the object 2.
pub(super) fn parts_of(second: &str) -> String {
    cube(1, "")
        + second
        + r#"<object id="3" name="block"><components><component objectid="1"/><component objectid="2"/></components></object>"#
}

#[test]
fn negative_volumes_are_cut_out_of_their_own_object_alone() {
    let beside = box_of(4, "", "", [30.0, 0.0, 0.0], [40.0, 10.0, 10.0]);
    let parts = cube(1, "")
        + &bar(2, "", "")
        + &beside
        + r#"<object id="3" name="block"><components><component objectid="1"/><component objectid="2"/></components></object>"#;
    let bambu = r#"<config><object id="3"><part id="1" subtype="normal_part"/><part id="2" subtype="negative_part">
        <metadata key="name" value="hole"/></part></object></config>"#;
    let loaded = with_settings(&parts, &items(&[3, 4]), BAMBU, bambu).unwrap();
    assert!(
        (volume(&loaded) - (1000.0 - 8.0 + 1000.0)).abs() < 1e-9,
        "{}",
        volume(&loaded)
    );
    assert_note(&loaded, "cut out as a negative volume: \"hole\"");
    assert!(loaded.file_face.is_sorted() && loaded.n_file_faces() > 24);
    assert_eq!(loaded.file_face.len(), loaded.mesh.triangles.len());
    // A range of an object's triangles, as in PrusaSlicer.
    let both = cuboid([0.0; 3], [10.0; 3]).to_mesh();
    let inner = cuboid([4.0, 4.0, 4.0], [6.0, 6.0, 20.0]).to_mesh();
    let n = both.points.len() as u32;
    let mut mesh = both;
    mesh.points.extend(inner.points);
    mesh.triangles
        .extend(inner.triangles.iter().map(|t| t.map(|v| v + n)));
    let object = format!("<object id=\"1\">{}</object>", mesh_xml(&mesh));
    let prusa = r#"<config><object id="1"><volume firstid="0" lastid="11"/><volume firstid="12" lastid="23">
        <metadata type="volume" key="volume_type" value="NegativeVolume"/></volume></object></config>"#;
    let loaded = with_settings(&object, &items(&[1]), PRUSA, prusa).unwrap();
    assert!(
        (volume(&loaded) - (1000.0 - 4.0 * 6.0)).abs() < 1e-9,
        "{}",
        volume(&loaded)
    );
    let away = bambu.replace("hole", "far");
    let parts = parts.replace(
        "component objectid=\"2\"",
        "component objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 500 0 0\"",
    );
    let loaded = with_settings(&parts, &items(&[3, 4]), BAMBU, &away).unwrap();
    assert_note(&loaded, "does not meet");
    // A cutter that lacks a triangle, and one that takes all away.
    let lacking = parts_of(&bar(2, "", "").replacen("<triangle v1", "<lost v1", 1));
    let loaded = with_settings(&lacking, &items(&[3]), BAMBU, bambu).unwrap();
    assert!((volume(&loaded) - 992.0).abs() < 1e-9, "{}", volume(&loaded));
    assert_note(&loaded, "holes in its surface were closed");
    let all = parts_of(&box_of(2, "", "", [-1.0; 3], [11.0; 3]));
    let refused = with_settings(&all, &items(&[3]), BAMBU, bambu)
        .unwrap_err()
        .to_string();
    assert!(
        refused.contains("nothing is left of \"block\" after \"hole\" is cut out"),
        "{refused}"
    );
    let loaded = with_settings(&parts, &items(&[3, 4]), BAMBU, &away).unwrap();
    assert_eq!(loaded.mesh.bounds().max.x, 40.0);
}

#[test]
fn a_role_belongs_to_a_component_of_an_object_and_not_to_the_mesh_that_others_share() {
    let component = |ids: [u32; 2]| {
        format!(
            "<components><component p:path=\"/3D/o.model\" objectid=\"{}\"/><component \
             p:path=\"/3D/o.model\" objectid=\"{}\"/></components>",
            ids[0], ids[1]
        )
    };
    let root = model(
        &format!(
            "<object id=\"3\">{}</object><object id=\"4\">{}</object>",
            component([1, 2]),
            component([1, 2])
        ),
        "<item objectid=\"3\"/><item objectid=\"4\" transform=\"1 0 0 0 1 0 0 0 1 100 0 0\"/>",
    );
    let other = model(&(cube(1, "") + &bar(2, "", "")), "");
    let settings = r#"<config><object id="3"><metadata key="extruder" value="2"/><part id="1" subtype="normal_part"/>
        <part id="2" subtype="normal_part"><metadata key="extruder" value="4"/></part></object>
        <object id="4"><part id="1" subtype="normal_part"/><part id="2" subtype="support_blocker"/></object></config>"#;
    let loaded = read_mesh(
        &package(&[(USUAL_ROOT, &root), ("3D/o.model", &other), (BAMBU, settings)]),
        None,
    )
    .unwrap();
    assert_eq!(loaded.mesh.triangles.len(), 12 + 12 + 12);
    assert_eq!(loaded.mesh.bounds().max.x, 110.0);
    let extruders: Vec<i64> = loaded
        .labels(LabelSource::Paint)
        .unwrap()
        .iter()
        .step_by(12)
        .copied()
        .collect();
    assert_eq!(extruders, [2, 4, 1]);
    // Two files may use the same ids.
    let root = model(
        "<object id=\"3\"><components><component p:path=\"/3D/o.model\" objectid=\"1\"/><component \
         p:path=\"/3D/q.model\" objectid=\"1\"/></components></object>",
        &items(&[3]),
    );
    let second = model(&box_of(1, "", "", [0.0, 0.0, 10.0], [10.0, 10.0, 30.0]), "");
    let settings = r#"<config><object id="3"><part id="1"><metadata key="extruder" value="1"/></part>
        <part id="1"><metadata key="extruder" value="5"/></part></object></config>"#;
    let parts = [
        (USUAL_ROOT, &root[..]),
        ("3D/o.model", &other),
        ("3D/q.model", &second),
        (BAMBU, settings),
    ];
    let loaded = read_mesh(&package(&parts), None).unwrap();
    let of = |label: i64| {
        let labels = loaded.labels(LabelSource::Paint).unwrap();
        (0..labels.len())
            .filter(|&f| labels[f] == label)
            .map(|f| loaded.mesh.face_center(f).z)
            .fold(0.0, f64::max)
    };
    assert!(of(1) <= 10.0 && of(5) > 20.0);
}

#[test]
fn extensions_that_are_not_read_are_refused_by_name_whether_or_not_the_file_demands_them() {
    let beams = r#"<b:beamlattice minlength="1" radius="2"><b:beams><b:beam v1="0" v2="1"/></b:beams></b:beamlattice></mesh>"#;
    let with_beams = cube(1, "").replace("</mesh>", beams);
    let told = |resources: &str| read_model(resources, &items(&[1])).unwrap_err().to_string();
    assert!(told(&with_beams).contains("beam lattice"));
    let shape = "<object id=\"1\"><bo:booleanshape objectid=\"2\"/></object>".to_owned() + &cube(2, "");
    assert!(told(&shape).contains("boolean operations"));
    assert!(told("<object id=\"1\"><x:newshape/></object>").contains("newshape"));
    assert!(told(&cube(1, "s:slicestackid=\"7\"")).contains("slices"));
    // Objects outside the build do not matter.
    let unused = with_beams.replace("object id=\"1\"", "object id=\"9\"") + &cube(1, "");
    assert_eq!(volume(&read_model(&unused, &items(&[1])).unwrap()), 1000.0);
    let demands = |uri: &str| {
        let root = model(&cube(1, ""), &items(&[1])).replacen(
            "unit=\"inch\"",
            &format!("unit=\"inch\" requiredextensions=\"q\" xmlns:q=\"{uri}\""),
            1,
        );
        read_mesh(&package(&[(USUAL_ROOT, &root)]), None)
    };
    let base = "http://schemas.microsoft.com/3dmanufacturing";
    for (uri, name) in [
        (format!("{base}/beamlattice/2017/02"), "beam lattice"),
        (format!("{base}/slice/2015/07"), "slices"),
        (format!("{base}/displacement/2022/07"), "displacement"),
        (
            "http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01".to_owned(),
            "volumetric",
        ),
        ("urn:unheard-of".to_owned(), "urn:unheard-of"),
    ] {
        assert!(demands(&uri).unwrap_err().to_string().contains(name), "{uri}");
    }
    assert!(demands(&format!("{base}/production/2015/06")).is_ok());
}

#[test]
fn the_root_is_what_the_relations_name_and_packages_in_a_folder_open() {
    let relations = r#"<Relationships><Relationship Target="3D\main%20part.model" Type="http://x/3dmodel"/></Relationships>"#;
    let root = model(
        r#"<object id="5"><components><component p:path="/3D/3dmodel.model" objectid="1" transform="2 0 0 0 2 0 0 0 2 0 0 0"/></components></object>"#,
        &items(&[5]),
    );
    let usual = model(&cube(1, ""), "");
    for folder in ["", "figure/", "a/b c/"] {
        let name = |name: &str| format!("{folder}{name}");
        let bytes = package(&[
            (&name("3D/3dmodel.model"), &usual),
            (&name("3D/main part.model"), &root),
            (&name("_rels/.rels"), relations),
        ]);
        assert_eq!(volume(&read_mesh(&bytes, None).unwrap()), 8000.0, "{folder}");
    }
}

#[test]
fn objects_and_plates_are_known_by_their_names_and_can_be_chosen() {
    let resources = cube(1, "") + &cube(2, "name=\"own\"") + &bar(3, "", "");
    let build = r#"<item objectid="1"/><item objectid="2" transform="1 0 0 0 1 0 0 0 1 100 0 0"/><item objectid="3"/>"#;
    let settings = r#"<config><object id="1"><metadata key="name" value="cat"/></object>
        <plate><metadata key="plater_id" value="1"/><model_instance><metadata key="object_id" value="1"/><metadata key="instance_id" value="0"/></model_instance></plate>
        <plate><metadata key="plater_id" value="2"/><metadata key="plater_name" value="Right"/><model_instance><metadata key="object_id" value="2"/></model_instance>
        <model_instance><metadata key="object_id" value="3"/></model_instance></plate></config>"#;
    let bytes = package(&[(USUAL_ROOT, &model(&resources, build)), (BAMBU, settings)]);
    let whole = read_mesh(&bytes, None).unwrap();
    let titles: Vec<String> = whole.objects.iter().map(|o| o.title()).collect();
    assert_eq!(titles, ["cat", "own", "object 3"]);
    let select = |object: Option<&str>, plate: Option<&str>| {
        let [object, plate] = [object, plate].map(|name| name.map(str::to_owned));
        read_selection(&bytes, None, &Selection { object, plate })
    };
    let cat = select(Some("CAT"), None).unwrap();
    assert_eq!(
        (cat.mesh.bounds().max.x, cat.n_file_faces(), cat.objects.len()),
        (10.0, 12, 1)
    );
    let right = select(None, Some("right")).unwrap();
    assert_eq!(right.objects.len(), 2);
    assert_eq!(select(None, Some("2")).unwrap(), right);
    let of_right = right.labels(LabelSource::Object).unwrap();
    assert_eq!([of_right[0], of_right[23]], [0, 1]);
    let none = select(Some("dog"), None).unwrap_err().to_string();
    assert!(none.contains("\"cat\", \"object 3\", \"own\""), "{none}");
    assert!(select(Some("cat"), Some("2")).is_err());
}

#[test]
fn sliced_files_and_named_sets_are_known_for_what_they_are() {
    let empty = model("", "");
    let sliced = package(&[(USUAL_ROOT, &empty), ("Metadata/plate_1.gcode", "G28")]);
    assert_eq!(read_mesh(&sliced, None), Err(ReadError::Sliced));
    let sets = r#"<t:trianglesets><t:triangleset name="a"><t:ref index="0"/><t:refrange startindex="1" endindex="5"/></t:triangleset>
        <t:triangleset name="b"><t:refrange startindex="5" endindex="99"/></t:triangleset></t:trianglesets></mesh>"#;
    let loaded = read_model(&cube(1, "").replace("</mesh>", sets), &items(&[1])).unwrap();
    let labels = loaded.labels(LabelSource::Set).unwrap();
    assert_eq!(labels, [0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1]);
}

#[test]
fn attributes_are_known_whatever_their_prefix() {
    let painted = cube(1, "").replacen("v1=", "any:mmu_segmentation=\"8\" v1=", 1);
    let loaded = read_model(&painted, &items(&[1])).unwrap();
    assert!(loaded.labels(LabelSource::Paint).unwrap().contains(&2));
}

#[test]
fn a_unit_is_stated_or_the_default() {
    let with = |text: &str| {
        let root = model(&cube(1, ""), &items(&[1])).replacen("unit=\"inch\"", text, 1);
        let loaded = read_mesh(&package(&[(USUAL_ROOT, &root)]), None).unwrap();
        (loaded.unit_mm, loaded.has_unit)
    };
    assert_eq!(with("unit=\"millimeter\""), (Some(1.0), true));
    assert_eq!(with("xmlns:unit=\"urn:x\""), (Some(1.0), false));
}
