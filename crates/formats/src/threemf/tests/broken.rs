//! Settings that cannot be read, and packages that are none: both are refused with what to do.

use super::super::super::Place;
use super::roles::{cube, items, parts_of, with_settings};
use super::*;

const SETTINGS: &str = r#"<config><object id="3"><metadata key="name" value="thing"/><part id="1" subtype="normal_part"/>
 <part id="2" subtype="negative_part" note="?"><metadata key="name" value="hole"/></part></object></config>"#;

fn read_settings(settings: &str) -> Result<Loaded, ReadError> {
    let second = cube(2, "").replace("x=\"0\"", "x=\"5\"");
    with_settings(&parts_of(&second), &items(&[3]), BAMBU, settings)
}

#[test]
fn settings_that_cannot_be_read_are_refused_since_roles_are_unknown() {
    assert!((read_settings(SETTINGS).unwrap().mesh.signed_volume() - 500.0).abs() < 1e-9);
    let cut_off = SETTINGS.find("negative_part").unwrap();
    for broken in [
        &SETTINGS.replacen("<config>", "<config><bad attr=x></worse>", 1),
        &SETTINGS[..cut_off],
        &SETTINGS.replacen(
            "id=\"2\" subtype=\"negative_part\"",
            "id=\"2\" subtype=negative_part",
            1,
        ),
        &SETTINGS.replacen("part id=\"2\"", "part id=\"two\"", 1),
        &SETTINGS.replacen("note=\"?\"", "note=\"&who;\"", 1),
    ] {
        let refused = read_settings(broken).expect_err(broken);
        assert!(
            matches!(&refused, ReadError::Settings { part, .. } if part == BAMBU),
            "{refused}"
        );
        let told = refused.to_string();
        assert!(
            told.contains("the roles of parts are unknown") && told.contains("save the project again"),
            "{told}"
        );
    }
    for sound in [
        SETTINGS.replacen("note=\"?\"", "note=\"a & b\"", 1),
        SETTINGS.replacen("value=\"thing\"", "value=\"Tom & Jerry; R&D\"", 1),
        SETTINGS.replacen("value=\"thing\"", "value=\"\"a: quote\"\"", 1),
        SETTINGS.replacen("subtype=\"normal_part\"", "subtype=\"\"", 1),
    ] {
        let loaded = read_settings(&sound).expect(&sound);
        assert!((loaded.mesh.signed_volume() - 500.0).abs() < 1e-9, "{sound}");
    }
    let named = SETTINGS.replacen("value=\"thing\"", "value=\"Tom & Jerry; R&amp;D\"", 1);
    assert_eq!(
        read_settings(&named).unwrap().objects[0].title(),
        "Tom & Jerry; R&D"
    );
    let at = ReadError::Settings {
        part: "a".to_owned(),
        at: Place::Byte(3),
        reason: "why".to_owned(),
    };
    assert!(at.to_string().starts_with("a, byte 3: why; so the roles"), "{at}");
}

#[test]
fn an_archive_with_a_model_that_nothing_names_says_so() {
    let bytes = package(&[("a.glb", "glTF"), ("x.model", "hm")]);
    assert_eq!(read_mesh(&bytes, None), Err(ReadError::NoRoot));
    assert!(ReadError::NoRoot.to_string().contains("_rels/.rels"));
}
