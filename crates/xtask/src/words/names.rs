//! Names of functions and fields that may be participles, such as `fitted`: a function is named by a verb, a
//! field by a noun.

use syn::visit::Visit;

/// Words that end like a participle and are none, or are nouns of the field.
const NOUNS: [&str; 34] = [
    "bed", "speed", "seed", "need", "feed", "shed", "red", "embed", "proceed", "succeed", "exceed", "ring",
    "string", "spring", "thing", "king", "wing", "bearing", "spacing", "heading", "padding", "setting",
    "building", "packing", "opening", "rounding", "bounding", "warning", "meaning", "finding", "loading",
    "printing", "meeting", "sling",
];
/// Participles of irregular verbs that have occurred as names.
const IRREGULAR: [&str; 25] = [
    "borne", "bought", "built", "chosen", "done", "drawn", "driven", "found", "given", "held", "kept",
    "known", "laid", "left", "made", "meant", "said", "seen", "shown", "sought", "spoken", "taken", "told",
    "torn", "written",
];

/// Names of functions, except tests, and fields that may be participles. Fails if the text is no Rust.
pub fn participles(source: &str) -> Result<Vec<String>, String> {
    let file = syn::parse_file(source).map_err(|e| e.to_string())?;
    let mut names = Names(Vec::new());
    names.visit_file(&file);
    Ok(names.0)
}

struct Names(Vec<String>);

impl Names {
    fn add(&mut self, kind: &str, name: &syn::Ident) {
        if is_participle(&name.to_string()) {
            self.0.push(format!("{kind} {name}"));
        }
    }
}

impl<'a> Visit<'a> for Names {
    fn visit_item_fn(&mut self, item: &'a syn::ItemFn) {
        if !item.attrs.iter().any(|a| a.path().is_ident("test")) {
            self.add("fn", &item.sig.ident);
        }
        syn::visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'a syn::ImplItemFn) {
        self.add("fn", &item.sig.ident);
        syn::visit::visit_impl_item_fn(self, item);
    }

    fn visit_trait_item_fn(&mut self, item: &'a syn::TraitItemFn) {
        self.add("fn", &item.sig.ident);
        syn::visit::visit_trait_item_fn(self, item);
    }

    fn visit_field(&mut self, field: &'a syn::Field) {
        if let Some(name) = &field.ident {
            self.add("field", name);
        }
        syn::visit::visit_field(self, field);
    }
}

/// Returns true if the last word of a name looks like a participle. Names that state a
/// fact, such as `is_closed`, are right.
fn is_participle(name: &str) -> bool {
    let states_fact = ["is_", "has_", "was_", "are_", "n_"]
        .iter()
        .any(|start| name.starts_with(start));
    let word = name.rsplit('_').next().unwrap_or(name);
    let has_ending = word.len() > 4 && (word.ends_with("ed") || word.ends_with("ing"));
    !states_fact && !NOUNS.contains(&word) && (has_ending || IRREGULAR.contains(&word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn participles_are_functions_and_fields_that_end_like_one() {
        let source = "fn fitted() {}
            struct A { told: u8, seed: u8, is_closed: bool }
            impl A { fn bearing(&self) {} fn going(&self) {} }
            trait B { fn piece_made(&self); }";
        let found = participles(source).unwrap();
        assert_eq!(found, ["fn fitted", "field told", "fn going", "fn piece_made"]);
    }

    #[test]
    fn tests_may_end_in_participles() {
        assert_eq!(participles("#[test] fn no_kit_is_made() {}"), Ok(Vec::new()));
        assert!(participles("fn {").is_err());
    }
}
