//! Reader of all model parts of a package that its root part needs.

use std::collections::BTreeSet;

use super::super::ReadError;
use super::model::Model;
use super::package::Package;
use super::part;

/// Largest number of files of a package that are read as model parts.
const MAX_PARTS: usize = 1000;

impl Model {
    /// Reads the root part and all parts that it needs.
    pub(super) fn read(root: &str, package: &mut Package) -> Result<Self, ReadError> {
        let mut model = Self {
            unit_mm: 1.0,
            ..Self::default()
        };
        model.read_part(root, package)?;
        while let Some(next) = model.next_part() {
            if model.parts.len() == MAX_PARTS {
                return Err(ReadError::TooManyCopies {
                    what: "a package of so many files",
                    limit: MAX_PARTS as u64,
                });
            }
            let items = std::mem::take(&mut model.items);
            model.read_part(&next, package)?;
            // Only the root says what is built.
            model.items = items;
        }
        Ok(model)
    }

    /// Returns a part that a component or an item refers to and that has not been read yet.
    fn next_part(&self) -> Option<String> {
        let named: BTreeSet<&String> = self
            .objects
            .iter()
            .flat_map(|o| &o.components)
            .chain(self.items.iter().map(|item| &item.component))
            .map(|c| &c.path)
            .collect();
        named.into_iter().find(|path| !self.parts.contains(path)).cloned()
    }

    fn read_part(&mut self, name: &str, package: &mut Package) -> Result<(), ReadError> {
        let missing = || ReadError::MissingPart {
            kind: "the file",
            id: name.to_owned(),
        };
        let text = package.text(name)?.ok_or_else(missing)?;
        self.parts.push(name.to_owned());
        part::read(name, &text, self)
    }
}
