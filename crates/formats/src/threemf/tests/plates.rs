//! Objects and plates that are chosen: numbers count as slicers count them, and refusals say what there is.

use super::super::super::{Selection, read_selection};
use super::roles::{cube, items};
use super::*;

/// A plate with objects, each by its id and the number among its own instances.
fn plate(number: u32, name: &str, instances: &[(u32, u32)]) -> String {
    let instance = |(object, instance): &(u32, u32)| {
        format!(
            "<model_instance><metadata key=\"object_id\" value=\"{object}\"/><metadata key=\"instance_id\" \
             value=\"{instance}\"/></model_instance>"
        )
    };
    let instances: String = instances.iter().map(instance).collect();
    format!(
        "<plate><metadata key=\"plater_id\" value=\"{number}\"/><metadata key=\"plater_name\" \
         value=\"{name}\"/>{instances}</plate>"
    )
}

/// A figure with an instance that is switched off, and a base; figures are 10 long, the base lies at 100.
fn figure_and_base(names: [&str; 2]) -> Vec<u8> {
    let at = |x: u32| format!("transform=\"1 0 0 0 1 0 0 0 1 {x} 0 0\"");
    let build = format!(
        "<item objectid=\"1\" printable=\"0\"/><item objectid=\"2\" {}/><item objectid=\"1\" {}/>",
        at(100),
        at(200)
    );
    let resources = cube(1, "name=\"figure\"") + &cube(2, "name=\"base\"");
    let settings = format!(
        "<config>{}{}</config>",
        plate(1, names[0], &[(1, 0)]),
        plate(2, names[1], &[(2, 0), (1, 1)])
    );
    package(&[(USUAL_ROOT, &model(&resources, &build)), (BAMBU, &settings)])
}

fn choose(bytes: &[u8], object: Option<&str>, plate: Option<&str>) -> Result<Loaded, ReadError> {
    let [object, plate] = [object, plate].map(|name| name.map(str::to_owned));
    read_selection(bytes, None, &Selection { object, plate })
}

#[test]
fn instances_that_are_switched_off_count_where_a_plate_names_instances() {
    let bytes = figure_and_base(["", "Big"]);
    let second = choose(&bytes, None, Some("2")).unwrap();
    let names: Vec<String> = second.objects.iter().map(|o| o.title()).collect();
    assert_eq!(names, ["base", "figure"]);
    let bounds = second.mesh.bounds();
    assert_eq!((bounds.min.x, bounds.max.x), (100.0, 210.0));
    assert_note(&second, "excluded from printing in the slicer: 1; left out");
    assert_note(&second, "2 of 2 objects or parts were used");
    let first = choose(&bytes, None, Some("1")).unwrap_err().to_string();
    assert!(
        first.contains("plate 1 has nothing to print") && first.contains("2 \"Big\""),
        "{first}"
    );
    let third = choose(&bytes, None, Some("3")).unwrap_err().to_string();
    assert!(third.contains("the file has no plate \"3\""), "{third}");
}

#[test]
fn the_number_of_a_plate_goes_before_the_name_of_another() {
    let bytes = figure_and_base(["2", "1"]);
    assert_eq!(choose(&bytes, None, Some("2")).unwrap().objects.len(), 2);
    assert!(matches!(
        choose(&bytes, None, Some("1")),
        Err(ReadError::EmptyPlate { .. })
    ));
}

#[test]
fn where_all_is_switched_off_all_is_taken_and_told() {
    let build = items(&[1]).replace("/>", " printable=\"0\"/>");
    let loaded = read_model(&cube(1, ""), &build).unwrap();
    assert_eq!(loaded.mesh.triangles.len(), 12);
    assert_note(&loaded, "every object is excluded from printing");
    assert_note(&loaded, "all were used");
}

#[test]
fn refusals_name_the_plate_and_the_parts_and_notes_count_what_was_taken() {
    let bytes = figure_and_base(["", ""]);
    let refused = choose(&bytes, Some("cat"), Some("2")).unwrap_err().to_string();
    assert!(
        refused.contains("plate 2 has no object \"cat\"; it has \"base\", \"figure\""),
        "{refused}"
    );
    let taken = choose(&bytes, Some("base"), Some("2")).unwrap();
    assert_note(&taken, "1 of 2 objects or parts was used");
    assert!(!taken.notes.iter().any(|note| note.contains("all were read")));
    assert_note(
        &read_mesh(&bytes, None).unwrap(),
        "the file has 2 objects or parts; all were read: base, figure",
    );
    let parts = cube(1, "")
        + &cube(2, "")
        + "<object id=\"9\"><components><component objectid=\"1\"/><component \
           objectid=\"2\"/></components></object>";
    let settings = "<config><object id=\"9\"><metadata key=\"name\" value=\"thing\"/><part id=\"1\" \
                    subtype=\"\"><metadata key=\"name\" value=\"Body\"/></part><part id=\"2\"><metadata \
                    key=\"name\" value=\"Base\"/></part></object></config>";
    let bytes = package(&[(USUAL_ROOT, &model(&parts, &items(&[9]))), (BAMBU, settings)]);
    assert_eq!(choose(&bytes, Some("Body"), None).unwrap().objects.len(), 1);
    let refused = choose(&bytes, Some("Hole"), None).unwrap_err().to_string();
    let titles = "the file has no object \"Hole\"; it has \"thing\" with the parts \"Body\", \"Base\"";
    assert!(refused.contains(titles), "{refused}");
}
