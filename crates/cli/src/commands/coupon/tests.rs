use super::*;

fn own(text: &str, name: &str) -> Printer {
    let found = printers_of(text).unwrap().into_iter().find(|p| p.name == name);
    found.unwrap_or_else(|| panic!("{name} is not in\n{text}"))
}

fn five(base: &Printer) -> [Fit; coupon::N_FITS] {
    coupon::fits(base.clearance_mm, base.key_clearance_mm, base.tolerance_mm)
}

fn gaps(printer: &Printer) -> [f64; 3] {
    [
        printer.clearance_mm,
        printer.key_clearance_mm,
        printer.tolerance_mm,
    ]
}

#[test]
fn every_number_saved_gives_back_its_clearances_and_all_else_of_the_printer_it_is_like() {
    for base in Printer::presets() {
        for fit in five(&base) {
            let text = with_printer("", &base, &fit, "workshop").unwrap();
            let made = own(&text, "workshop");
            assert_eq!(
                made,
                Printer {
                    name: "workshop".into(),
                    clearance_mm: fit.clearance_mm,
                    key_clearance_mm: fit.key_clearance_mm,
                    tolerance_mm: fit.tolerance_mm,
                    ..base.clone()
                }
            );
            // Saving the same result again changes nothing.
            assert_eq!(with_printer(&text, &base, &fit, "Workshop").unwrap(), text);
        }
    }
}

#[test]
fn comments_and_all_that_is_not_a_clearance_stay_as_they_are() {
    let text = "# mine\nsize = 180 # mm\n\n[printers.workshop] # upstairs\nlike = \"fdm\"\nbed = [300, 300, \
                340]\nclearance = 0.18 # measured\nwall-gap = 0.07\n\n[printers.other]\nprocess = \"sls\"\n";
    let base = own(text, "workshop");
    let [.., loosest] = five(&base);
    let saved = with_printer(text, &base, &loosest, "workshop").unwrap();
    let expected = text
        .replace("0.18 # measured", &format!("{} # measured", loosest.clearance_mm))
        .replace(
            "wall-gap = 0.07\n",
            &format!(
                "wall-gap = {}\nkey-clearance = {}\n",
                loosest.tolerance_mm, loosest.key_clearance_mm
            ),
        );
    assert_eq!(saved, expected);
    // A printer based on one of the user's own has all its settings.
    let copied = with_printer(text, &base, &loosest, "attic").unwrap();
    assert!(copied.starts_with(text));
    assert_eq!(own(&copied, "attic").bed_mm, base.bed_mm);
    assert_eq!(gaps(&own(&copied, "attic")), gaps(&own(&saved, "workshop")));
    assert_eq!(own(&copied, "workshop"), base);
}

#[test]
fn what_cannot_be_saved_is_told() {
    let base = Printer::sla();
    let fit = five(&base)[1];
    let refusal = |text: &str| with_printer(text, &base, &fit, "workshop").unwrap_err();
    let other = refusal("[printers.workshop]\nlike = \"fdm\"\n");
    assert!(other.contains("is like \"fdm\", not \"sla\""), "{other}");
    assert!(refusal("printers = 3\n").contains("must be a table"));
    assert!(refusal("[printers]\nworkshop = 3\n").contains("workshop"));
    assert!(refusal("size = \n").contains("line 1"));
    // Inline tables work as well.
    let text = with_printer(
        "printers = { workshop = { process = \"sla\" } }\n",
        &base,
        &fit,
        "workshop",
    )
    .unwrap();
    assert_eq!(own(&text, "workshop").clearance_mm, fit.clearance_mm);
}

#[test]
fn the_plate_fits_the_bed_of_every_preset_and_a_small_bed_is_refused_with_the_size() {
    for printer in Printer::presets() {
        let fits = five(&printer);
        let plate = Plate::of(&printer, &fits).ok().unwrap();
        let bounds = plate.whole().bounds();
        let [width, depth, height] = printer.bed_mm;
        assert!(bounds.min.x >= EDGE_MM && bounds.max.x <= width - EDGE_MM);
        assert!(bounds.min.y >= EDGE_MM && bounds.max.y <= depth - EDGE_MM);
        assert!(bounds.min.z == 0.0 && bounds.max.z <= height);
        // A slicer says half an hour; the closed form, made for large parts, says a sixth more for filament.
        let seconds = plate.seconds();
        assert!((300.0..2400.0).contains(&seconds), "{}: {seconds}", printer.name);
    }
    let small = Printer {
        bed_mm: [60.0, 60.0, 60.0],
        ..Printer::sla()
    };
    let fits = five(&small);
    let refusal = Plate::of(&small, &fits).err().unwrap().to_string();
    assert!(refusal.contains("60 × 60 × 60"), "{refusal}");
}
