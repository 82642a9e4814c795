//! The subset of XML that 3MF needs: elements with their attributes, text and place.
//!
//! A prefix is the file's choice: elements and attributes are known by their local names, unless the
//! namespace of their prefix is one that is not read.

use std::collections::{BTreeMap, BTreeSet};

use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use super::super::{Place, ReadError, container};
use super::namespace::{Namespaces, prefix};

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
    namespaces: Namespaces,
}

/// Attributes that only extensions have; one with a prefix goes before one without.
const OF_EXTENSIONS: [&str; 2] = ["path", "slicestackid"];
/// Elements within elements that are followed; 3MF has some 6.
const MAX_DEPTH: usize = 64;

/// Next event of a part.
pub(super) enum Next<'a> {
    /// Begin of an element; one without content ends at once.
    Begin(BytesStart<'a>),
    /// Text within the open element, trimmed.
    Text(String),
    /// End of the element of this local name.
    End(String),
    /// An element of this local name stood here, in a namespace that is not read; its content is passed over.
    Foreign(String),
}

impl<'a> Elements<'a> {
    pub(super) fn of(part: &'a str, text: &'a str) -> Self {
        let mut reader = Reader::from_str(text);
        reader.config_mut().expand_empty_elements = true;
        Self {
            reader,
            part,
            depth: 0,
            namespaces: Namespaces::default(),
        }
    }

    /// Returns the next begin, text or end; `None` at the end of the part.
    pub(super) fn next(&mut self) -> Result<Option<Next<'a>>, ReadError> {
        loop {
            match self.read()? {
                Event::Start(start) => {
                    if !self.namespaces.is_foreign(start.name().as_ref()) {
                        return Ok(Some(Next::Begin(start)));
                    }
                    let name = start.local_name().as_ref().to_owned();
                    self.pass_over()?;
                    return Ok(Some(Next::Foreign(name)));
                }
                Event::End(end) => return Ok(Some(Next::End(end.local_name().as_ref().to_owned()))),
                Event::Text(text) => {
                    let text = text.into_inner();
                    if !text.trim().is_empty() {
                        return Ok(Some(Next::Text(text.trim().to_owned())));
                    }
                }
                Event::Eof => return Ok(None),
                _ => {}
            }
        }
    }

    /// The next event, with the elements that are open and the namespaces in scope kept up to date.
    fn read(&mut self) -> Result<Event<'a>, ReadError> {
        let event = self.reader.read_event().map_err(|e| self.error(e))?;
        match &event {
            Event::Start(start) => {
                self.depth += 1;
                if self.depth > MAX_DEPTH {
                    return Err(self.error("elements lie too deep within each other"));
                }
                // Nearly all elements declare nothing.
                if self.depth == 1 || start.contains("xmlns") {
                    let declared = self.declarations(start)?;
                    let name = start.name();
                    self.namespaces.open(self.depth, prefix(name.as_ref()), declared);
                }
            }
            Event::End(_) => {
                self.namespaces.close(self.depth);
                self.depth -= 1;
            }
            Event::Eof if self.depth > 0 => return Err(self.error("it ends within an element")),
            _ => {}
        }
        Ok(event)
    }

    /// Reads to the end of the element that was begun last.
    fn pass_over(&mut self) -> Result<(), ReadError> {
        let around = self.depth - 1;
        while self.depth > around {
            self.read()?;
        }
        Ok(())
    }

    /// Returns true if a name in an attribute's text has the prefix of a namespace that is not read.
    pub(super) fn is_foreign(&self, name: &str) -> bool {
        name.contains(':') && self.namespaces.is_foreign(name)
    }

    /// The namespaces in scope, by prefix; the default one has the prefix "".
    pub(super) fn namespaces(&self) -> BTreeMap<String, String> {
        self.namespaces.all()
    }

    /// Hands each attribute of `element` to `take` by its local name, and refuses two of the same full name.
    /// Declarations of namespaces are no attributes, and those of namespaces that are not read are passed
    /// over.
    ///
    /// An attribute without a prefix wins over one with the same local name, unless only extensions define
    /// it.
    pub(super) fn attributes(
        &self,
        element: &BytesStart,
        mut take: impl FnMut(&str, &str) -> Result<(), String>,
    ) -> Result<(), ReadError> {
        let rivals = self.rivals(element);
        self.raw_attributes(element, |name, value| {
            if declared_prefix(name).is_some() || self.is_foreign(name) || rivals.contains(name) {
                return Ok(());
            }
            take(local(name), value)
        })
    }

    /// Full names of attributes that do not count, since another of the same local name does.
    fn rivals(&self, element: &BytesStart) -> BTreeSet<String> {
        let mut rivals = BTreeSet::new();
        if !element.contains(':') {
            return rivals;
        }
        let (mut plain, mut prefixed) = (BTreeSet::new(), Vec::new());
        // A fault is found again where they are read for what they say.
        let _ = self.raw_attributes(element, |name, _| {
            if !name.contains(':') {
                plain.insert(name.to_owned());
            } else if declared_prefix(name).is_none() && !self.is_foreign(name) {
                prefixed.push(name.to_owned());
            }
            Ok(())
        });
        for name in prefixed.into_iter().filter(|name| plain.contains(local(name))) {
            let is_of_extension = OF_EXTENSIONS.contains(&local(&name));
            rivals.insert(if is_of_extension {
                local(&name).to_owned()
            } else {
                name
            });
        }
        rivals
    }

    /// The namespaces that `element` declares, by prefix; the default one has the prefix "".
    fn declarations(&self, element: &BytesStart) -> Result<BTreeMap<String, String>, ReadError> {
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
                let value = encode_ampersands(value);
                let value = quick_xml::escape::unescape(&value).map_err(|e| self.error(e))?;
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

/// `value` with a code for each "&" that begins none: writers forget it, and it can mean nothing else.
fn encode_ampersands(value: &str) -> String {
    let mut pieces = value.split('&');
    let mut out = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let is_code = piece.split_once(';').is_some_and(|(code, _)| {
            let word = code.strip_prefix('#').unwrap_or(code);
            !word.is_empty() && word.bytes().all(|b| b.is_ascii_alphanumeric())
        });
        out.push_str(if is_code { "&" } else { "&amp;" });
        out.push_str(piece);
    }
    out
}

/// A name without its prefix.
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
