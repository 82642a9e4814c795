//! The subset of XML that 3MF needs: elements with their attributes, text and place.
//!
//! Elements and attributes are known by their local names: a prefix is the file's choice.

use std::collections::BTreeMap;

use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use super::super::{Place, ReadError, container};

/// Decodes a part as text. Invalid UTF-8 becomes "�" and fails where it matters.
pub(super) fn text(bytes: Vec<u8>) -> String {
    let bytes = container::as_utf8(bytes);
    String::from_utf8(bytes).unwrap_or_else(|e| String::from_utf8_lossy(e.as_bytes()).into_owned())
}

/// Elements of a part, in order.
pub(super) struct Elements<'a> {
    reader: Reader<&'a [u8]>,
    part: &'a str,
    /// Number of open elements.
    depth: usize,
}

/// Largest depth of nested elements; 3MF has about 6.
const MAX_DEPTH: usize = 64;

/// Next event of a part.
pub(super) enum Next<'a> {
    /// Begin of an element; one without content ends at once.
    Begin(BytesStart<'a>),
    /// Text within the open element, trimmed.
    Text(String),
    /// End of the element of this local name.
    End(String),
}

impl<'a> Elements<'a> {
    pub(super) fn of(part: &'a str, text: &'a str) -> Self {
        let mut reader = Reader::from_str(text);
        reader.config_mut().expand_empty_elements = true;
        Self {
            reader,
            part,
            depth: 0,
        }
    }

    /// Returns the next begin, text or end; `None` at the end of the part.
    pub(super) fn next(&mut self) -> Result<Option<Next<'a>>, ReadError> {
        loop {
            match self.reader.read_event() {
                Ok(Event::Start(start)) => {
                    self.depth += 1;
                    if self.depth > MAX_DEPTH {
                        return Err(self.error("elements lie too deep within each other"));
                    }
                    return Ok(Some(Next::Begin(start)));
                }
                Ok(Event::End(end)) => {
                    self.depth -= 1;
                    return Ok(Some(Next::End(end.local_name().as_ref().to_owned())));
                }
                Ok(Event::Text(text)) => {
                    let text = text.into_inner();
                    if !text.trim().is_empty() {
                        return Ok(Some(Next::Text(text.trim().to_owned())));
                    }
                }
                Ok(Event::Eof) if self.depth > 0 => return Err(self.error("it ends within an element")),
                Ok(Event::Eof) => return Ok(None),
                Ok(_) => {}
                Err(e) => return Err(self.error(e)),
            }
        }
    }

    /// Calls `take` with each attribute of `element` by its local name; an error if two have the same full
    /// name. Declarations of namespaces are no attributes.
    pub(super) fn attributes(
        &self,
        element: &BytesStart,
        mut take: impl FnMut(&str, &str) -> Result<(), String>,
    ) -> Result<(), ReadError> {
        self.raw_attributes(element, |name, value| match declared_prefix(name) {
            Some(_) => Ok(()),
            None => take(local(name), value),
        })
    }

    /// Returns the namespaces that `element` declares, by prefix; the default one has the prefix "".
    pub(super) fn namespaces(&self, element: &BytesStart) -> Result<BTreeMap<String, String>, ReadError> {
        let mut found = BTreeMap::new();
        self.raw_attributes(element, |name, value| {
            if let Some(prefix) = declared_prefix(name) {
                found.insert(prefix.to_owned(), value.trim().to_owned());
            }
            Ok(())
        })?;
        Ok(found)
    }

    /// Returns the attribute of this local name as text; empty if missing.
    pub(super) fn string(&self, element: &BytesStart, wanted: &str) -> Result<String, ReadError> {
        let mut found = String::new();
        self.attributes(element, |name, value| {
            if name == wanted {
                value.clone_into(&mut found);
            }
            Ok(())
        })?;
        Ok(found)
    }

    fn raw_attributes(
        &self,
        element: &BytesStart,
        mut take: impl FnMut(&str, &str) -> Result<(), String>,
    ) -> Result<(), ReadError> {
        for attribute in element.attributes() {
            let attribute = attribute.map_err(|e| self.error(e))?;
            let value = attribute.value.as_ref();
            let name = attribute.key.into_inner();
            if value.contains('&') {
                let value = quick_xml::escape::unescape(value).map_err(|e| self.error(e))?;
                take(name, &value).map_err(|e| self.error(e))?;
            } else {
                take(name, value).map_err(|e| self.error(e))?;
            }
        }
        Ok(())
    }

    /// Creates the error "part, byte: reason".
    pub(super) fn error(&self, reason: impl std::fmt::Display) -> ReadError {
        let at = Place::Byte(self.reader.buffer_position() as usize);
        ReadError::Xml {
            part: self.part.to_owned(),
            at,
            reason: reason.to_string(),
        }
    }
}

/// Removes the prefix of a name.
pub(super) fn local(name: &str) -> &str {
    name.rsplit_once(':').map_or(name, |(_, local)| local)
}

/// Returns the prefix that an attribute declares, if it declares a namespace.
fn declared_prefix(name: &str) -> Option<&str> {
    match name.strip_prefix("xmlns")? {
        "" => Some(""),
        rest => rest.strip_prefix(':'),
    }
}

/// Parses the value of an attribute as a number.
pub(super) fn number<T: std::str::FromStr>(name: &str, value: &str) -> Result<T, String> {
    value.trim().parse().map_err(|_| {
        let shown: String = value.chars().take(40).collect();
        format!("{name} is \"{shown}\", which is no number of its kind")
    })
}

/// Returns the target of the first relation whose type ends in `kind`.
pub(super) fn relation_target(relations: &str, kind: &str) -> Option<String> {
    let mut elements = Elements::of("_rels/.rels", relations);
    while let Ok(Some(next)) = elements.next() {
        let Next::Begin(element) = next else { continue };
        let (mut is_wanted, mut target) = (false, None);
        elements
            .attributes(&element, |name, value| {
                match name {
                    "Type" => is_wanted = value.ends_with(kind),
                    "Target" => target = Some(value.to_owned()),
                    _ => {}
                }
                Ok(())
            })
            .ok()?;
        if is_wanted {
            return target;
        }
    }
    None
}
