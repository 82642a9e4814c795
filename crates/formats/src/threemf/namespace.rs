//! XML namespaces in scope, which tell the prefixes whose content must be skipped.

use std::collections::BTreeMap;

use super::extension;

/// The declarations that are in scope.
#[derive(Default)]
pub(super) struct Namespaces {
    /// For each prefix its declarations, the innermost last; the default namespace has the prefix "".
    declarations: BTreeMap<String, Vec<Declaration>>,
    /// Prefixes in the order in which they were declared, each with the depth of its element.
    order: Vec<(usize, String)>,
    /// The namespace of the part's outermost element, which counts as known: some writers misspell it.
    own: Option<String>,
}

struct Declaration {
    namespace: String,
    is_foreign: bool,
}

impl Namespaces {
    /// Adds the declarations of the element at `depth`. The first element of a part defines the part's own
    /// namespace by its `prefix`.
    pub(super) fn open(&mut self, depth: usize, prefix: &str, declarations: BTreeMap<String, String>) {
        if self.own.is_none() {
            self.own = Some(declarations.get(prefix).cloned().unwrap_or_default());
        }
        for (prefix, namespace) in declarations {
            let is_own = self.own.as_ref() == Some(&namespace);
            let is_foreign = !is_own && extension::is_foreign(&namespace);
            self.order.push((depth, prefix.clone()));
            self.declarations.entry(prefix).or_default().push(Declaration {
                namespace,
                is_foreign,
            });
        }
    }

    /// Removes the declarations of the element at `depth`.
    pub(super) fn close(&mut self, depth: usize) {
        while let Some((_, prefix)) = self.order.pop_if(|(of, _)| *of >= depth) {
            if let Some(declarations) = self.declarations.get_mut(&prefix) {
                declarations.pop();
            }
        }
    }

    /// Returns true if an element, or a prefixed attribute, of this full name is in a foreign namespace.
    /// Undeclared prefixes are not foreign, because some writers forget the declaration.
    pub(super) fn is_foreign(&self, name: &str) -> bool {
        let prefix = prefix(name);
        self.declarations
            .get(prefix)
            .and_then(|declarations| declarations.last())
            .is_some_and(|declaration| declaration.is_foreign)
    }

    /// All prefixes in scope with their namespaces.
    pub(super) fn all(&self) -> BTreeMap<String, String> {
        let innermost = |(prefix, declarations): (&String, &Vec<Declaration>)| {
            let last = declarations.last()?;
            Some((prefix.clone(), last.namespace.clone()))
        };
        self.declarations.iter().filter_map(innermost).collect()
    }
}

/// The prefix of a name; "" where it has none.
pub(super) fn prefix(name: &str) -> &str {
    name.rsplit_once(':').map_or("", |(prefix, _)| prefix)
}
