//! Extensions of 3MF: the supported ones, and common names of the others.
//!
//! The core specification (1.3, section 2.3) lets a file demand extensions by the prefixes of their
//! namespaces in `requiredextensions`. A reader that does not know one of them must not read the file.

use std::collections::BTreeMap;

use super::super::ReadError;

/// Substrings of namespaces whose content is read or does not change any shape.
const KNOWN: [&str; 10] = [
    "/3dmanufacturing/core/",
    "/3dmanufacturing/material/",
    "/3dmanufacturing/production/",
    "/3dmanufacturing/trianglesets/",
    "/markup-compatibility/",
    "schemas.slic3r.org",
    "schemas.prusa3d.com",
    "schemas.bambulab.com",
    "software.ultimaker.com",
    "www.w3.org",
];

/// Substrings of unsupported namespaces, with their common names.
const UNREAD: [(&str, &str); 9] = [
    ("/beamlattice/", "beam lattice"),
    ("/slice/", "slices"),
    ("/booleanoperations/", "boolean operations"),
    ("/displacement/", "displacement"),
    ("/volumetric/", "volumetric"),
    ("/implicit/", "implicit functions"),
    ("/securecontent/", "encryption"),
    ("/productionalternatives/", "production alternatives"),
    ("/toolpath/", "tool paths"),
];

/// Elements of objects that give an unsupported shape, by local name, and their extensions.
const SHAPES: [(&str, &str); 4] = [
    ("beamlattice", "beam lattice"),
    ("booleanshape", "boolean operations"),
    ("displacementmesh", "displacement"),
    ("levelset", "volumetric"),
];

/// Extension whose slices define an object's shape.
pub(super) const SLICES: &str = "slices";

/// Returns the extension of the unsupported shape that an element of this local name gives.
pub(super) fn of_shape(element: &str) -> Option<&'static str> {
    SHAPES
        .iter()
        .find(|(name, _)| *name == element)
        .map(|(_, extension)| *extension)
}

/// Returns true if a namespace is neither supported nor known, so that its names must not be interpreted.
pub(super) fn is_foreign(namespace: &str) -> bool {
    let folded = namespace.to_ascii_lowercase();
    let is_known = KNOWN.iter().any(|known| folded.contains(known));
    !namespace.is_empty() && !is_known && !folded.contains("/3dmanufacturing/")
}

/// Refuses a part that demands an extension that is not read.
///
/// `required` holds prefixes, and `namespaces` their namespaces.
pub(super) fn check_requirements(
    required: &str,
    namespaces: &BTreeMap<String, String>,
) -> Result<(), ReadError> {
    for prefix in required.split_whitespace() {
        // Some programs give the namespace itself.
        let namespace = namespaces.get(prefix).map_or(prefix, String::as_str);
        let folded = namespace.to_ascii_lowercase();
        if KNOWN.iter().any(|known| folded.contains(known)) {
            continue;
        }
        let name = UNREAD
            .iter()
            .find(|(part, _)| folded.contains(part))
            .map_or_else(|| shorten(namespace), |(_, name)| (*name).to_owned());
        return Err(ReadError::Extension { name });
    }
    Ok(())
}

/// Shortens a namespace for a message.
fn shorten(namespace: &str) -> String {
    const MOST_CHARS: usize = 80;
    namespace.chars().take(MOST_CHARS).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_file_demands_is_known_or_refused_by_its_name_for_people() {
        let namespaces: BTreeMap<String, String> = [
            (
                "p",
                "http://schemas.microsoft.com/3dmanufacturing/production/2015/06",
            ),
            (
                "b",
                "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02",
            ),
            (
                "bo",
                "http://schemas.3mf.io/3dmanufacturing/booleanoperations/2023/07",
            ),
            ("x", "http://example.org/own"),
        ]
        .map(|(prefix, namespace)| (prefix.to_owned(), namespace.to_owned()))
        .into();
        let name = |required: &str| match check_requirements(required, &namespaces) {
            Err(ReadError::Extension { name }) => Some(name),
            _ => None,
        };
        assert_eq!(name(" p  p "), None);
        assert_eq!(name("p b").as_deref(), Some("beam lattice"));
        assert_eq!(name("bo").as_deref(), Some("boolean operations"));
        assert_eq!(name("x").as_deref(), Some("http://example.org/own"));
        assert_eq!(name("undeclared").as_deref(), Some("undeclared"));
        assert_eq!(name(&namespaces["b"]).as_deref(), Some("beam lattice"));
    }
}
