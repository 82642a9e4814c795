//! Printers by name: those that come with the program, and the user's own.

use std::sync::LazyLock;

use shellock_print::Printer;

use crate::config;
use crate::names::no_such;

/// Printers that people own, in the form of a configuration file's printers.
const OWNED: &str = include_str!("printers.toml");

static SHIPPED: LazyLock<Vec<Printer>> = LazyLock::new(|| {
    let presets = Printer::presets();
    let owned = config::table_of_printers(OWNED, &presets).expect("the file is tested");
    presets.into_iter().chain(owned).collect()
});

/// Printers that come with the program: one for each process and material, then those that people own.
pub fn shipped() -> &'static [Printer] {
    &SHIPPED
}

/// Finds a printer by name, in any case: one of the user's `own`, or one that comes with the program.
pub fn find_printer(name: &str, own: &[Printer]) -> Result<Printer, String> {
    let known = || own.iter().chain(shipped());
    let found = known().find(|p| p.name.eq_ignore_ascii_case(name)).cloned();
    let names: Vec<&str> = known().map(|p| p.name.as_str()).collect();
    found.ok_or_else(|| no_such("printer", name, &names))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use shellock_print::printer::Pace;

    use super::*;

    #[test]
    fn shipped_printers_are_in_range_and_found_by_names_of_their_own() {
        let names: BTreeSet<&str> = shipped().iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names.len(), shipped().len());
        for printer in shipped() {
            assert!(
                printer.problems().is_empty() && !printer.title.is_empty(),
                "{printer:?}"
            );
            assert_eq!(
                find_printer(&printer.name.to_uppercase(), &[]).as_ref(),
                Ok(printer)
            );
        }
        assert!(
            find_printer("bambu-a1mini", &[])
                .unwrap_err()
                .contains("did you mean bambu-a1-mini?")
        );
    }

    #[test]
    fn a_printer_of_the_user_goes_before_one_that_comes_with_the_program() {
        let own = Printer {
            name: "Bambu-A1".into(),
            layer_mm: 0.12,
            ..Printer::fdm()
        };
        assert_eq!(find_printer("bambu-a1", std::slice::from_ref(&own)), Ok(own));
    }

    #[test]
    fn a_printer_of_the_user_may_be_like_one_that_comes_with_the_program() {
        let text = "[printers.workshop]\nlike = \"bambu-a1\"\nclearance = 0.18\nfast = false";
        let own = config::printers_of(text).unwrap();
        let like = find_printer("bambu-a1", &[]).unwrap();
        let expected = Printer {
            name: "workshop".into(),
            clearance_mm: 0.18,
            pace: Some(Pace::Usual),
            ..like
        };
        assert_eq!(own, [expected]);
    }
}
