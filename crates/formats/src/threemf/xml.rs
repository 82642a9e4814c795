//! The little of XML that 3MF needs: elements with their attributes, and where they stand.

use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use super::super::{Place, ReadError, container};

/// A part as text; what is no UTF-8 becomes "�" and fails where it matters.
pub(super) fn text(bytes: Vec<u8>) -> String {
    let bytes = container::as_utf8(bytes);
    String::from_utf8(bytes).unwrap_or_else(|e| String::from_utf8_lossy(e.as_bytes()).into_owned())
}

/// The elements of a part in order.
pub(super) struct Elements<'a> {
    reader: Reader<&'a [u8]>,
    part: &'a str,
    /// How many elements are open.
    depth: usize,
}

/// Elements within elements that are followed; 3MF has some 6.
const MAX_DEPTH: usize = 64;

/// What comes next.
pub(super) enum Next<'a> {
    /// An element begins; one without content ends at once.
    Begin(BytesStart<'a>),
    /// The element of this local name ends.
    End(Vec<u8>),
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

    /// The next begin or end; `None` at the end of the text.
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
                    return Ok(Some(Next::End(end.local_name().as_ref().as_bytes().to_vec())));
                }
                Ok(Event::Eof) if self.depth > 0 => return Err(self.error("it ends within an element")),
                Ok(Event::Eof) => return Ok(None),
                Ok(_) => {}
                Err(e) => return Err(self.error(e)),
            }
        }
    }

    /// Hands each attribute of `element` to `take`, with the name as it stands there, and refuses two of the
    /// same name.
    pub(super) fn attributes(
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

    /// "part, byte: reason".
    pub(super) fn error(&self, reason: impl std::fmt::Display) -> ReadError {
        let at = Place::Byte(self.reader.buffer_position() as usize);
        ReadError::Xml {
            part: self.part.to_owned(),
            at,
            reason: reason.to_string(),
        }
    }
}

/// The value of an attribute as a number.
pub(super) fn number<T: std::str::FromStr>(name: &str, value: &str) -> Result<T, String> {
    value.trim().parse().map_err(|_| {
        let shown: String = value.chars().take(40).collect();
        format!("{name} is \"{shown}\", which is no number of its kind")
    })
}

/// The target of the first relation whose type ends in `kind`.
pub(super) fn relation_target(relations: &str, kind: &str) -> Option<String> {
    let mut elements = Elements::of("_rels/.rels", relations);
    while let Ok(Some(next)) = elements.next() {
        let Next::Begin(element) = next else { continue };
        let (mut is_it, mut target) = (false, None);
        elements
            .attributes(&element, |name, value| {
                match name {
                    "Type" => is_it = value.ends_with(kind),
                    "Target" => target = Some(value.to_owned()),
                    _ => {}
                }
                Ok(())
            })
            .ok()?;
        if is_it {
            return target;
        }
    }
    None
}
