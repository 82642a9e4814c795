use serde_json::{Value, json};
use shellock_assembly::PressFitKind;

use super::*;

/// A plan of two pieces, with a value in every field.
const WHOLE: &str = r#"{
    "format": "shellock-plan", "version": 2, "units": "mm", "program": "0.2.0",
    "input": { "file": "box.stl", "sha256": "ab12", "transform": [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0,
        0.0, 0.0, 0.0, 0.0, 1.0], "largest_only": true,
        "repairs": [{ "kind": "left-out", "count": 1, "at": [0.0, 1.0, 2.0], "message": "1 body was left out" }] },
    "seed": 7, "shell_thickness": 2.5,
    "strength": { "material": { "youngs_modulus_mpa": 2000.0, "poissons_ratio": 0.35, "strength_mpa": 42.0,
        "density_g_cm3": 1.15 }, "drop_m": 1.275, "n_falls": 12, "stress_mpa": 30.5, "is_too_weak": false,
        "at": [1.0, 2.0, 3.0], "deciding_fall": 3, "down": [0.0, 0.0, -1.0],
        "tried": [{ "thickness_mm": 2.5, "stress_mpa": 30.5 }], "solid": [{ "area_mm2": 60.5, "at": [0.0, 0.0, 0.0] }] },
    "clearance": 0.12, "connector_size": 3.0, "connector_sizes": [{ "pieces": [1, 2], "size_mm": 3.0 }],
    "wall_gap": 0.05, "up": [0.0, 0.0, 1.0], "min_wall": 0.4, "key_piece": 2,
    "key": { "rails": 20.5, "area_mm2": 400.5, "flat_share": 0.9, "side_share": 0.8, "slide": [1.0, 0.0, 0.0],
        "plane_normal": [0.0, 0.0, 1.0] },
    "press_fits": [{ "kind": "rib", "piece": 2, "at": [0.0, 0.0, 0.0], "interference_mm": 0.08, "travel_mm": 2.0 }],
    "pieces": [
        { "id": 1, "file": "pieces/piece-01.stl", "neighbors": [2], "volume_mm3": 900.5, "n_triangles": 12,
          "installation_direction": [0.0, 0.0, 1.0], "thin_share": 0.0, "thin_places": [], "rattle": null },
        { "id": 2, "file": "pieces/piece-02.stl", "neighbors": [1], "volume_mm3": 800.5, "n_triangles": 12,
          "installation_direction": [0.0, 0.0, -1.0], "thin_share": 0.1,
          "thin_places": [{ "kind": "slot", "length_mm": 4.5, "thickness_mm": 0.125, "at": [0.0, 0.0, 1.0] }],
          "rattle": { "translation_mm": 0.2, "rotation_deg": 0.3, "is_proven": true, "together": null } }],
    "installation_order": [1, 2],
    "plan": { "cost": 1.5, "lower_bound": 1.5, "gap": 0.0, "optimal": true, "least_cost": 1.5, "key_lower_bound": 1.5,
        "proven_for": { "keys": [2], "key_slides": "within its plane", "lessons": 0 }, "piece_costs": [1.5, 0.5] },
    "holding": { "quality_mm": -0.5, "loose": [], "seams": [{ "later": 2, "earlier": 1, "score_mm": 0.5,
        "opening_mm": 0.25, "weight": 2.0, "at": [0.0, 0.0, 0.0], "reason": "short" }], "n_compared": 3,
        "foreseen_play": [[0.1, 0.2], [0.0, 0.0]], "foreseen_excess": [0.5, 0.0],
        "bears": [{ "deed": { "kind": "hang", "piece": 1 }, "force_n": 1.5, "at": [0.0, 0.0, 0.0], "factor": 2.0,
            "first": { "how": "opens", "between": [2, 1], "at": [0.0, 1.0, 0.0] } }] },
    "bears": { "top_n": 84.5, "middle_n": 70.5, "sides_n": null, "grip_n": 20.5, "fall_upright_m": 2.5,
        "fall_m": 0.5, "basis": "by simulation",
        "weakest": { "deed": { "kind": "press-top" },
            "first": { "how": "opens", "between": [2, 1], "at": [0.0, 1.0, 0.0] } } },
    "volume_ratio": 0.3, "connector_share": 0.75,
    "joints": [{ "male": 1, "female": 2, "length_mm": 20.5, "volume_mm3": [1.5, 2.5], "kept": [1.0, 0.9],
        "at": [0.0, 0.0, 0.0] }],
    "contacts": [{ "later": 2, "earlier": 1, "length_mm": 80.5, "usable_mm": 60.5, "at": [0.0, 0.0, 0.0] }],
    "effort": { "keys": 1, "segmentations": 2, "plans": 3, "kits": 1 },
    "gaps": { "at_rest_mm": 0.1, "at_rest_beneath_rim_mm": 0.12, "on_the_way_mm": 0.05,
        "on_the_way_beneath_rim_mm": null, "key_on_the_way_beneath_rim_mm": 0.1, "fits_within_mm": 0.025,
        "loosest_if_thin": { "piece": 1, "translation_mm": 0.5, "rotation_deg": null } },
    "verification": { "passed": false, "checks": [{ "name": "pieces are closed", "ok": false, "figure": "2 is not" }],
        "findings": [{ "kind": "not-closed", "piece": 2 }] },
    "warnings": [{ "code": "key-ribs", "severity": "warning", "message": "file them", "pieces": [2], "at": null }],
    "printing": { "printer": "sla", "process": "sla", "bed": [192.0, 120.0, 200.0], "layer": 0.05, "plates": 1,
        "laid": [{ "piece": 1, "plate": 1, "size": [20.0, 20.0, 5.0], "turned": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0]], "moved": [4.0, 4.0, 0.0], "support_mm2": 10.5, "outer_support_mm2": 0.5,
            "foothold_mm2": 70.5, "raft": false }],
        "too_large": [2], "time": { "by": "closed form", "pieces_s": 3600.5, "solid_s": 0.0, "ratio": null,
            "pieces_g": 104.5, "solid_g": 84.5, "solid_as": "hollowed to 2 mm walls" } }
}"#;

fn whole() -> Value {
    serde_json::from_str(WHOLE).unwrap()
}

fn read(value: &Value) -> Result<PlanFile, String> {
    PlanFile::read(value.to_string().as_bytes()).map_err(|e| e.to_string())
}

/// Error message if the value at `pointer` is `wrong`, or removed.
fn complaint(pointer: &str, wrong: Option<Value>) -> String {
    let mut plan = whole();
    match wrong {
        Some(wrong) => *plan.pointer_mut(pointer).unwrap() = wrong,
        None => {
            let (parent, name) = pointer.rsplit_once('/').unwrap();
            let parent = plan.pointer_mut(parent).unwrap().as_object_mut().unwrap();
            parent.remove(name).unwrap();
        }
    }
    read(&plan).unwrap_err()
}

#[test]
fn what_is_read_is_written_again_byte_for_byte() {
    let mut text = serde_json::to_string_pretty(&whole()).unwrap();
    text.push('\n');
    let plan = PlanFile::read(text.as_bytes()).unwrap();
    assert_eq!(String::from_utf8(plan.to_bytes()).unwrap(), text);
    assert_eq!(PlanFile::read(&plan.to_bytes()).unwrap(), plan);
    assert_eq!(plan.press_fits[0].kind, PressFitKind::Rib);
    assert!(plan.plan.is_some() && plan.holding.is_some() && plan.bears.is_some());
    assert!(plan.verification.unwrap().findings.is_some());
}

#[test]
fn what_a_kit_bears_is_read_where_it_does_not_say_of_what_gives_way() {
    let mut older = whole();
    let bears = older["bears"].as_object_mut().unwrap();
    bears.remove("basis");
    bears.remove("weakest");
    let bears = read(&older).unwrap().bears.unwrap();
    assert_eq!(
        (bears.top_n, bears.weakest, bears.basis),
        (Some(84.5), None, String::new())
    );
}

#[test]
fn play_with_others_is_told_only_where_it_was_asked_for() {
    let mut plan = read(&whole()).unwrap();
    let rattle = plan.pieces[1].rattle.as_mut().unwrap();
    assert_eq!(rattle.together, Some(None));
    rattle.together = None;
    let written: Value = serde_json::from_slice(&plan.to_bytes()).unwrap();
    assert!(written["pieces"][1]["rattle"].get("together").is_none());
}

#[test]
fn fields_that_are_missing_are_named() {
    for (pointer, field, name) in [
        ("/pieces", ".", "pieces"),
        ("/installation_order", ".", "installation_order"),
        ("/pieces/1/id", "pieces[1]", "id"),
        ("/input/transform", "input", "transform"),
        ("/printing/laid/0/size", "printing.laid[0]", "size"),
    ] {
        assert_eq!(
            complaint(pointer, None),
            format!("\"{field}\": missing field `{name}`")
        );
    }
}

#[test]
fn fields_of_the_wrong_kind_are_named() {
    for (pointer, wrong, field) in [
        ("/shell_thickness", json!("2"), "shell_thickness"),
        ("/pieces/0/id", json!(-1), "pieces[0].id"),
        ("/up", json!([0, 1]), "up"),
        ("/up", json!([0, 1, 0, 0]), "up"),
        (
            "/pieces/1/installation_direction/2",
            json!(null),
            "pieces[1].installation_direction[2]",
        ),
        ("/joints", json!({}), "joints"),
        ("/input/largest_only", json!(1), "input.largest_only"),
        ("/input/file", json!([]), "input.file"),
        ("/gaps", json!(true), "gaps"),
        ("/press_fits/0/kind", json!("nail"), "press_fits[0].kind"),
    ] {
        let said = complaint(pointer, Some(wrong));
        assert!(said.starts_with(&format!("\"{field}\": ")), "{said}");
    }
}

#[test]
fn what_is_no_plan_is_refused() {
    let said = |bytes: &[u8]| PlanFile::read(bytes).unwrap_err().to_string();
    assert!(said(b"{ \"pieces\": [").starts_with("not a plan: "));
    assert!(said(b"[]").starts_with("not a plan: "));
    assert!(said(&[0xff, 0xfe]).starts_with("not a plan: "));
    assert!(complaint("/version", Some(json!(0))).contains("build the kit again"));
    assert!(complaint("/version", Some(json!("2"))).contains("build the kit again"));
    let later = complaint("/version", Some(json!(3)));
    assert!(
        later.starts_with("its version is 3, but this program reads 2"),
        "{later}"
    );
    assert!(complaint("/format", Some(json!("x"))).contains("build the kit again"));
}

#[test]
fn a_plan_needs_pieces_directions_and_an_order_alone() {
    let least = json!({
        "format": "shellock-plan", "version": 2,
        "pieces": [{ "id": 1, "installation_direction": [0, 0, 1] }], "installation_order": [1],
    });
    let plan = read(&least).unwrap();
    assert_eq!(plan.order().unwrap().steps.len(), 1);
    assert!(
        plan.thickness_mm()
            .unwrap_err()
            .to_string()
            .contains("shell_thickness")
    );
    assert!(plan.sizes().unwrap_err().to_string().contains("connector_size"));

    let mut other = whole();
    other["press_fits"] = json!(null);
    other["something_else"] = json!(3);
    assert!(read(&other).unwrap().press_fits.is_empty());
    other["holding"] = json!({ "quality_mm": 1.0 });
    assert!(read(&other).unwrap_err().contains("\"holding"));
}

#[test]
fn faces_that_are_far_apart_hold_nothing() {
    let mut plan = read(&whole()).unwrap();
    assert!(plan.check_clearance().is_ok());
    for clearance in [1000.0, -0.1, f64::NAN] {
        plan.clearance = clearance;
        assert!(plan.check_clearance().is_err(), "{clearance}");
    }
}

#[test]
fn orders_name_every_piece_once() {
    let order = |ids: &[u32]| {
        let mut plan = read(&whole()).unwrap();
        plan.installation_order = ids.iter().map(|id| PatchId(*id)).collect();
        plan.order().map_err(|e| e.to_string())
    };
    assert!(order(&[1, 0]).is_ok_and(|plan| plan.key() == PatchId(0)));
    assert!(order(&[0, 0]).unwrap_err().contains("piece 1 twice"));
    assert!(order(&[0]).unwrap_err().contains("leaves out piece 2"));
    assert!(order(&[0, 1, 2]).unwrap_err().contains("names 3"));
    let mut plan = read(&whole()).unwrap();
    plan.pieces.swap(0, 1);
    assert!(plan.order().is_err() && plan.check_directions().is_ok());
    plan.pieces[0].installation_direction = [0.0, 0.0, 2.0];
    assert!(
        plan.check_directions()
            .unwrap_err()
            .to_string()
            .contains("piece 2")
    );
}

#[test]
fn sizes_belong_to_pieces_that_are_there() {
    let sizes = |pieces: [u32; 2], size_mm: f64| {
        let mut plan = read(&whole()).unwrap();
        let pieces = pieces.map(PatchId);
        plan.connector_sizes = Some(vec![PairSizeEntry { pieces, size_mm }]);
        plan.sizes().map_err(|e| e.to_string())
    };
    assert!(sizes([0, 1], 2.0).is_ok_and(|s| s.of(PatchId(1), PatchId(0)) == 2.0));
    assert!(sizes([0, 2], 2.0).unwrap_err().contains("pieces 1 and 3"));
    assert!(sizes([0, 1], 25.0).unwrap_err().contains("25 mm"));
    let mut plan = read(&whole()).unwrap();
    plan.connector_sizes = Some(Vec::new());
    assert!(plan.sizes().is_err());
    plan.connector_sizes = None;
    assert_eq!(plan.sizes().unwrap().largest_mm(), 3.0);
}

#[test]
fn no_press_fit_is_deeper_than_any_is_made() {
    let with = |interference_mm: f64| {
        let mut plan = read(&whole()).unwrap();
        plan.press_fits[0].interference_mm = interference_mm;
        plan.checked_press_fits()
            .map(<[_]>::len)
            .map_err(|e| e.to_string())
    };
    assert_eq!(with(0.08), Ok(1));
    assert!(with(0.5).unwrap_err().contains("0.5 mm"));
    assert!(with(-0.1).is_err());
}
