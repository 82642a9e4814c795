//! Generated 3MF packages like those of slicers and modelling programs.

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use shellock_geom::{TriMesh, Vec3};

use super::{Case, Claim, body, scale, shift};
use Claim::{Labels, Note, Refused, Size, Warning};

const PRUSA: &str = "Metadata/Slic3r_PE_model.config";
const BAMBU: &str = "Metadata/model_settings.config";
const ROOT: &str = "3D/3dmodel.model";
const ITEM: &str = "<item objectid=\"1\"/>";
const MICROSOFT: &str = "http://schemas.microsoft.com/3dmanufacturing";

fn package(parts: &[(&str, &str)]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in parts {
        archive
            .start_file(*name, zip::write::SimpleFileOptions::default())
            .expect("names differ");
        archive
            .write_all(text.as_bytes())
            .expect("memory takes all bytes");
    }
    archive.finish().expect("memory takes all bytes").into_inner()
}

/// Writes a model part; `attributes` are those of its root element.
fn model(attributes: &str, resources: &str, build: &str) -> String {
    format!(
        "<model {attributes} \
         xmlns=\"{MICROSOFT}/core/2015/02\"><resources>{resources}</resources><build>{build}</build></model>"
    )
}

fn mesh(mesh: &TriMesh, more: &str) -> String {
    let mut text = "<mesh><vertices>".to_owned();
    for p in &mesh.points {
        write!(text, "<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>", p.x, p.y, p.z).expect("memory takes all");
    }
    text += "</vertices><triangles>";
    for [a, b, c] in &mesh.triangles {
        write!(text, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>").expect("memory takes all");
    }
    format!("{text}</triangles>{more}</mesh>")
}

fn object(id: u32, attributes: &str, content: &str) -> String {
    format!("<object id=\"{id}\" {attributes}>{content}</object>")
}

fn plain(resources: &str, build: &str) -> Vec<u8> {
    package(&[(ROOT, &model("unit=\"millimeter\"", resources, build))])
}

fn with(name: &str, settings: &str, resources: &str, build: &str) -> Vec<u8> {
    package(&[
        (ROOT, &model("unit=\"millimeter\"", resources, build)),
        (name, settings),
    ])
}

/// The body, and a smaller one that sticks out of it along x.
fn two() -> [TriMesh; 2] {
    [
        body(),
        scale(&shift(&body(), Vec3::X * 90.0), Vec3::splat(1.0 / 3.0)),
    ]
}

fn both([mut a, b]: [TriMesh; 2]) -> TriMesh {
    let n = a.points.len() as u32;
    a.points.extend(b.points);
    a.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + n)));
    a
}

const WHOLE: Claim = Size([60.0, 40.0, 30.0]);
/// Size of the body after the smaller one of [`two`] is cut off its end. Both ellipsoids meet at x = 28.3,
/// their facets a little before.
const CUT: Claim = Size([58.22, 40.0, 30.0]);

/// All cases of 3MF files.
pub fn cases() -> Vec<Case> {
    [
        negative(),
        marks(),
        types(),
        extensions(),
        common_parts(),
        packages(),
        plates(),
        attributes(),
        sizes(),
        pitfalls(),
    ]
    .concat()
}

fn negative() -> Vec<Case> {
    let [a, b] = two();
    let n = a.triangles.len();
    let range = format!(
        "<config><object id=\"1\"><volume firstid=\"0\" lastid=\"{}\"/><volume firstid=\"{n}\" \
         lastid=\"9999\"><metadata type=\"volume\" key=\"volume_type\" \
         value=\"NegativeVolume\"/></volume></object></config>",
        n - 1
    );
    let joined = object(1, "", &mesh(&both([a.clone(), b.clone()]), ""));
    let parts = object(1, "", &mesh(&a, ""))
        + &object(2, "name=\"hole\"", &mesh(&b, ""))
        + &object(
            3,
            "",
            "<components><component objectid=\"1\"/><component objectid=\"2\"/></components>",
        );
    let part = "<config><object id=\"3\"><part id=\"1\" subtype=\"normal_part\"/><part id=\"2\" \
                subtype=\"negative_part\"/></object></config>";
    let open = object(2, "", &mesh(&b, "")).replacen("<triangle v1=\"0\"", "<triangle v1=\"1\"", 1);
    let broken = object(1, "", &mesh(&a, ""))
        + &open
        + &object(
            3,
            "",
            "<components><component objectid=\"1\"/><component objectid=\"2\"/></components>",
        );
    vec![
        Case::new("negative_range.3mf", with(PRUSA, &range, &joined, ITEM))
            .says(&[CUT, Note("cut out as a negative volume")]),
        Case::new(
            "negative_part.3mf",
            with(BAMBU, part, &parts, "<item objectid=\"3\"/>"),
        )
        .says(&[CUT, Note("cut out as a negative volume: \"hole\"")])
        .proves("3MF", "read", "negative volumes"),
        Case::new(
            "negative_open.3mf",
            with(BAMBU, part, &broken, "<item objectid=\"3\"/>"),
        )
        .says(&[Refused("cannot be cut out")])
        .proves("3MF", "refused", "negative volumes that bound nothing"),
    ]
}

/// Cases in which a wrong part, size or role could be taken silently.
fn pitfalls() -> Vec<Case> {
    let [a, b] = two();
    let part = object(1, "", &mesh(&a, ""));
    let vendor = "unit=\"millimeter\" x:unit=\"inch\" xmlns:x=\"urn:vendor\"";
    let added = part.replace(
        "</mesh>",
        "<x:vertices><vertex x=\"99\" y=\"0\" z=\"0\"/></x:vertices></mesh>",
    );
    let build = "<item objectid=\"1\" x:transform=\"2 0 0 0 2 0 0 0 2 0 0 0\"/><x:alt><x:item \
                 objectid=\"7\"/></x:alt>";
    let parts = part.clone()
        + &object(2, "", &mesh(&b, ""))
        + &object(
            3,
            "",
            "<components><component objectid=\"1\"/><component objectid=\"2\"/></components>",
        );
    let cut_off = "<config><object id=\"3\"><part id=\"1\" subtype=\"normal_part\"/><part id=\"2\" subtype=";
    let from = object(
        1,
        "",
        "<components><component p:path=\"/3D/o.model\" objectid=\"1\"/></components>",
    );
    let small = object(1, "", &mesh(&scale(&a, Vec3::splat(0.1)), ""));
    let off = plain(&part, "<item objectid=\"1\" printable=\"0\"/>");
    vec![
        Case::new("vendor.3mf", package(&[(ROOT, &model(vendor, &added, build))]))
            .says(&[WHOLE])
            .proves("3MF", "left out", "what others add in namespaces of their own"),
        Case::new(
            "settings_cut_off.3mf",
            with(BAMBU, cut_off, &parts, "<item objectid=\"3\"/>"),
        )
        .says(&[Refused("the roles of parts are unknown")])
        .proves("3MF", "refused", "settings of slicers that cannot be read"),
        Case::new(
            "unit_of_its_own.3mf",
            package(&[
                (ROOT, &model("unit=\"millimeter\"", &from, ITEM)),
                ("3D/o.model", &model("unit=\"centimeter\"", &small, "")),
            ]),
        )
        .says(&[WHOLE, Note("another unit than its root")])
        .proves("3MF", "read", "files with units of their own"),
        Case::new("all_switched_off.3mf", off).says(&[WHOLE, Note("every object is excluded from printing")]),
    ]
}

fn marks() -> Vec<Case> {
    let [a, b] = two();
    let marked = |name: &'static str, of_object: &str, of_item: &str| {
        let resources =
            object(1, "", &mesh(&a, "")) + &object(2, "", &(of_object.to_owned() + &mesh(&b, "")));
        let build = format!("{ITEM}<item objectid=\"2\">{of_item}</item>");
        Case::new(name, plain(&resources, &build)).says(&[WHOLE, Note("left out as")])
    };
    let group =
        |mark: &str| format!("<metadatagroup><metadata name=\"cura:{mark}\">True</metadata></metadatagroup>");
    let modifier = "<config><object id=\"1\"><volume firstid=\"0\" lastid=\"511\"/><volume firstid=\"512\" \
                    lastid=\"9999\"><metadata key=\"modifier\" value=\"1\"/></volume></object></config>";
    let joined = object(1, "", &mesh(&both([a.clone(), b.clone()]), ""));
    vec![
        marked("cura_support.3mf", &group("support_mesh"), "").proves(
            "3MF",
            "left out",
            "supports and support blockers",
        ),
        marked("cura_infill.3mf", "", &group("infill_mesh")).proves("3MF", "left out", "modifiers"),
        marked("cura_cutting.3mf", &group("cutting_mesh"), ""),
        marked(
            "cura_older.3mf",
            "<settings xmlns=\"http://software.ultimaker.com/xml/cura/3mf/2015/10\"><setting \
             key=\"anti_overhang_mesh\">true</setting></settings>",
            "",
        ),
        Case::new("modifier_of_old.3mf", with(PRUSA, modifier, &joined, ITEM))
            .says(&[WHOLE, Note("left out as modifiers")]),
    ]
}

fn types() -> Vec<Case> {
    let [a, b] = two();
    let typed = |name: &'static str, kind: &str| {
        let resources = object(1, "", &mesh(&a, "")) + &object(2, &format!("type=\"{kind}\""), &mesh(&b, ""));
        Case::new(name, plain(&resources, &format!("{ITEM}<item objectid=\"2\"/>")))
            .says(&[WHOLE, Note("left out as")])
    };
    let only = plain(&object(1, "type=\"other\"", &mesh(&a, "")), ITEM);
    let off = object(1, "", &mesh(&a, "")) + &object(2, "", &mesh(&b, ""));
    vec![
        typed("type_surface.3mf", "surface").proves(
            "3MF",
            "left out",
            "objects of the types surface and other",
        ),
        typed("type_solidsupport.3mf", "solidsupport"),
        Case::new("only_other.3mf", only)
            .says(&[Refused("contains only")])
            .proves("3MF", "refused", "files with nothing to print"),
        Case::new(
            "switched_off.3mf",
            plain(&off, &format!("{ITEM}<item objectid=\"2\" printable=\"0\"/>")),
        )
        .says(&[WHOLE, Note("excluded from printing")])
        .proves("3MF", "left out", "what is switched off"),
    ]
}

fn extensions() -> Vec<Case> {
    let of_body = |more: &str| object(1, "", &mesh(&body(), more));
    let beams = "<b:beamlattice radius=\"2\"><b:beams><b:beam v1=\"0\" v2=\"9\"/></b:beams></b:beamlattice>";
    let demands = |prefix: &str, namespace: &str, resources: &str| {
        let attributes =
            format!("unit=\"millimeter\" requiredextensions=\"{prefix}\" xmlns:{prefix}=\"{namespace}\"");
        package(&[(ROOT, &model(&attributes, resources, ITEM))])
    };
    let slices = object(
        1,
        "s:slicestackid=\"7\" s:meshresolution=\"lowres\"",
        &mesh(&body(), ""),
    );
    let difference = object(
        1,
        "",
        "<bo:booleanshape objectid=\"2\" operation=\"difference\"/>",
    ) + &object(2, "", &mesh(&body(), ""));
    let displaced = object(1, "", "<d:displacementmesh/>");
    let level = object(1, "", "<v:levelset functionid=\"3\"/>");
    let sets = "<t:trianglesets><t:triangleset name=\"lower\"><t:refrange startindex=\"0\" \
                endindex=\"255\"/></t:triangleset></t:trianglesets>";
    vec![
        Case::new(
            "beams.3mf",
            demands("b", &format!("{MICROSOFT}/beamlattice/2017/02"), &of_body(beams)),
        )
        .says(&[Refused("beam lattice")])
        .proves("3MF", "refused", "beam lattices"),
        Case::new("beams_not_demanded.3mf", plain(&of_body(beams), ITEM)).says(&[Refused("beam lattice")]),
        Case::new(
            "slices.3mf",
            demands("s", &format!("{MICROSOFT}/slice/2015/07"), &slices),
        )
        .says(&[Refused("slices")])
        .proves("3MF", "refused", "slices"),
        Case::new("slices_not_demanded.3mf", plain(&slices, ITEM)).says(&[Refused("slices")]),
        Case::new(
            "slices_without_resolution.3mf",
            plain(&slices.replace(" s:meshresolution=\"lowres\"", ""), ITEM),
        )
        .says(&[Refused("slices")]),
        Case::new("difference.3mf", plain(&difference, ITEM))
            .says(&[Refused("boolean operations")])
            .proves("3MF", "refused", "boolean operations"),
        Case::new("displaced.3mf", plain(&displaced, ITEM))
            .says(&[Refused("displacement")])
            .proves("3MF", "refused", "displacement"),
        Case::new("level_set.3mf", plain(&level, ITEM))
            .says(&[Refused("volumetric")])
            .proves("3MF", "refused", "volumetric shapes"),
        Case::new("unheard_of.3mf", demands("q", "urn:unheard-of", &of_body("")))
            .says(&[Refused("urn:unheard-of")])
            .proves("3MF", "refused", "any other extension that the file requires"),
        Case::new("sets.3mf", plain(&of_body(sets), ITEM))
            .says(&[WHOLE, Labels("sets"), Note("--labels-from sets")])
            .proves("3MF", "read", "named sets of triangles"),
    ]
}

/// Cases of objects that have parts in common.
fn common_parts() -> Vec<Case> {
    let [a, b] = two();
    let component = |id: u32| format!("<component p:path=\"/3D/o.model\" objectid=\"{id}\"/>");
    let pair = format!("<components>{}{}</components>", component(1), component(2));
    let root = model(
        "unit=\"millimeter\"",
        &(object(3, "", &pair) + &object(4, "", &pair)),
        "<item objectid=\"3\"/><item objectid=\"4\" printable=\"0\"/>",
    );
    let other = model(
        "",
        &(object(1, "", &mesh(&a, "")) + &object(2, "", &mesh(&b, ""))),
        "",
    );
    let blocked = "<config><object id=\"4\"><part id=\"1\"/><part id=\"2\" \
                   subtype=\"support_blocker\"/></object></config>";
    let lost = package(&[(ROOT, &root), ("3D/o.model", &other), (BAMBU, blocked)]);
    let single = format!("<components>{}</components>", component(1));
    let two_roles = model(
        "unit=\"millimeter\"",
        &(object(3, "", &single) + &object(4, "", &single)),
        "<item objectid=\"3\"/><item objectid=\"4\" transform=\"1 0 0 0 1 0 0 0 1 90 0 0\"/>",
    );
    let modifier = "<config><object id=\"3\"><part id=\"1\" subtype=\"normal_part\"/></object><object \
                    id=\"4\"><part id=\"1\" subtype=\"modifier_part\"/></object></config>";
    let from = |path: &str| {
        format!("<components><component p:path=\"/3D/{path}.model\" objectid=\"1\"/></components>")
    };
    let restart = model(
        "unit=\"millimeter\"",
        &(object(3, "", &from("o")) + &object(4, "", &from("q"))),
        "<item objectid=\"3\"/><item objectid=\"4\"/>",
    );
    let second = model("", &object(1, "", &mesh(&b, "")), "");
    let filaments = "<config><object id=\"3\"><part id=\"1\"><metadata key=\"extruder\" \
                     value=\"1\"/></part></object><object id=\"4\"><part id=\"1\"><metadata \
                     key=\"extruder\" value=\"2\"/></part></object></config>";
    vec![
        Case::new("shared_part.3mf", lost).says(&[Size([70.0, 40.0, 30.0]), Note("excluded from printing")]),
        Case::new(
            "shared_two_roles.3mf",
            package(&[(ROOT, &two_roles), ("3D/o.model", &other), (BAMBU, modifier)]),
        )
        .says(&[WHOLE, Note("left out as modifiers")])
        .proves("3MF", "read", "roles and filaments of parts"),
        Case::new(
            "ids_restart.3mf",
            package(&[
                (ROOT, &restart),
                ("3D/o.model", &other),
                ("3D/q.model", &second),
                (BAMBU, filaments),
            ]),
        )
        .says(&[Size([70.0, 40.0, 30.0]), Labels("paint")])
        .proves("3MF", "read", "parts in several files"),
    ]
}

fn packages() -> Vec<Case> {
    let usual = model("unit=\"millimeter\"", &object(1, "", &mesh(&body(), "")), ITEM);
    let doubled = model(
        "unit=\"millimeter\"",
        &object(
            5,
            "",
            "<components><component p:path=\"/3D/3dmodel.model\" objectid=\"1\" transform=\"2 0 0 0 2 0 0 0 \
             2 0 0 0\"/></components>",
        ),
        "<item objectid=\"5\"/>",
    );
    let relations = |target: &str| {
        format!(
            "<Relationships><Relationship Target=\"{target}\" \
             Type=\"{MICROSOFT}/2013/01/3dmodel\"/></Relationships>"
        )
    };
    let twice = Size([120.0, 80.0, 60.0]);
    let empty = model("", "", "");
    vec![
        Case::new(
            "root_by_relations.3mf",
            package(&[
                (ROOT, &usual),
                ("3D/main.model", &doubled),
                ("_rels/.rels", &relations("/3D/main.model")),
            ]),
        )
        .says(&[twice])
        .proves("3MF", "read", "the root part that the package names"),
        Case::new(
            "root_in_codes.3mf",
            package(&[
                (ROOT, &usual),
                ("3D/main part.model", &doubled),
                ("_rels/.rels", &relations("3D\\main%20part.model")),
            ]),
        )
        .says(&[twice]),
        Case::new(
            "in_a_folder.3mf",
            package(&[
                ("figure/3D/3dmodel.model", &usual),
                ("figure/_rels/.rels", &relations("/3D/3dmodel.model")),
            ]),
        )
        .says(&[WHOLE])
        .proves("3MF", "read", "packages packed again in a folder"),
        Case::new(
            "with_backslashes.3mf",
            package(&[("a\\b\\3D\\3dmodel.model", &usual)]),
        )
        .says(&[WHOLE]),
        Case::new(
            "sliced.gcode.3mf",
            package(&[(ROOT, &empty), ("Metadata/plate_1.gcode", "G28")]),
        )
        .says(&[Refused("sliced file")])
        .proves("3MF", "refused", "sliced files"),
        Case::new(
            "sliced_of_two.gcode.3mf",
            package(&[
                (ROOT, &empty),
                ("Metadata/plate_1.gcode", ";"),
                ("Metadata/plate_2.gcode", ";"),
            ]),
        )
        .says(&[Refused("sliced file")]),
    ]
}

fn plates() -> Vec<Case> {
    let resources: String = (1..=3).map(|id| object(id, "", &mesh(&body(), ""))).collect();
    let build: String = (1..=3)
        .map(|id| {
            format!(
                "<item objectid=\"{id}\" transform=\"1 0 0 0 1 0 0 0 1 {}00 0 0\"/>",
                3 * id
            )
        })
        .collect();
    let named = |id: u32, name: &str| {
        format!("<object id=\"{id}\"><metadata key=\"name\" value=\"{name}\"/></object>")
    };
    let plate = |id: u32| {
        format!(
            "<plate><metadata key=\"plater_id\" value=\"{id}\"/><model_instance><metadata key=\"object_id\" \
             value=\"{id}\"/><metadata key=\"instance_id\" value=\"0\"/></model_instance></plate>"
        )
    };
    let settings = format!(
        "<config>{}{}{}{}{}{}</config>",
        named(1, "cat"),
        named(2, "dog"),
        named(3, "base"),
        plate(1),
        plate(2),
        plate(3)
    );
    let bytes = with(BAMBU, &settings, &resources, &build);
    let by_name =
        object(1, "name=\"left\"", &mesh(&body(), "")) + &object(2, "name=\"right\"", &mesh(&body(), ""));
    let apart = plain(
        &by_name,
        "<item objectid=\"1\"/><item objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 90 0 0\"/>",
    );
    let off = with(
        BAMBU,
        &settings,
        &resources,
        &build.replacen("<item", "<item printable=\"0\"", 1),
    );
    let pair = with(
        BAMBU,
        "<config><object id=\"4\"><metadata key=\"name\" value=\"thing\"/><part id=\"1\"><metadata \
         key=\"name\" value=\"Body\"/></part><part id=\"2\"><metadata key=\"name\" \
         value=\"Base\"/></part></object></config>",
        &(resources.clone()
            + &object(
                4,
                "",
                "<components><component objectid=\"1\"/><component objectid=\"2\" transform=\"1 0 0 0 1 0 0 \
                 0 1 90 0 0\"/></components>",
            )),
        "<item objectid=\"4\"/>",
    );
    vec![
        Case::new("parts_apart.3mf", pair).says(&[Refused("\"thing\" with the parts \"Body\", \"Base\"")]),
        Case::new("plate_off.3mf", off)
            .with(&["--plate", "1"])
            .says(&[Refused("plate 1 has nothing to print")]),
        Case::new("plates.3mf", bytes.clone()).says(&[Refused(
            "\"cat\" (plate 1), \"dog\" (plate 2), \"base\" (plate 3)",
        )]),
        Case::new("plates_dog.3mf", bytes.clone())
            .with(&["--object", "dog"])
            .says(&[WHOLE])
            .proves("3MF", "read", "one object or plate of several"),
        Case::new("plates_third.3mf", bytes.clone())
            .with(&["--plate", "3"])
            .says(&[WHOLE]),
        Case::new("plates_wrong.3mf", bytes)
            .with(&["--object", "cow"])
            .says(&[Refused("\"base\", \"cat\", \"dog\"")]),
        Case::new("objects.3mf", apart).says(&[Refused("\"left\", \"right\"")]),
    ]
}

fn attributes() -> Vec<Case> {
    let painted = |attribute: &str| {
        let with_paint =
            mesh(&body(), "").replacen("<triangle v1", &format!("<triangle {attribute}=\"8\" v1"), 200);
        plain(&object(1, "", &with_paint), ITEM)
    };
    vec![
        Case::new("paint_of_other_prefix.3mf", painted("ns1:mmu_segmentation"))
            .says(&[WHOLE, Labels("paint")])
            .proves("3MF", "read", "paint"),
        Case::new("paint_with_prefix.3mf", painted("any:paint_color")).says(&[WHOLE, Labels("paint")]),
    ]
}

fn sizes() -> Vec<Case> {
    let of = |attributes: &str, factor: f64| {
        let resources = object(1, "", &mesh(&scale(&body(), Vec3::splat(factor)), ""));
        package(&[(ROOT, &model(attributes, &resources, ITEM))])
    };
    let far = both([body(), shift(&body(), Vec3::X * 3000.0)]);
    let modifier = "<config><object id=\"1\"><volume firstid=\"512\" lastid=\"9999\"><metadata \
                    type=\"volume\" key=\"volume_type\" \
                    value=\"ParameterModifier\"/></volume></object></config>";
    vec![
        Case::new("life_size.3mf", of("unit=\"millimeter\"", 20.0))
            .says(&[Size([1200.0, 800.0, 600.0]), Warning("unusually large")])
            .proves("3MF", "read", "the size that the file states"),
        Case::new("tiny.3mf", of("unit=\"centimeter\"", 0.02))
            .says(&[Size([12.0, 8.0, 6.0]), Warning("unusually small")]),
        Case::new("no_unit.3mf", of("", 20.0)).says(&[Size([150.0, 100.0, 75.0]), Warning("is made 150 mm")]),
        Case::new(
            "far_modifier.3mf",
            with(PRUSA, modifier, &object(1, "", &mesh(&far, "")), ITEM),
        )
        .says(&[WHOLE]),
    ]
}
