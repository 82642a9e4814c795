//! The header of a PLY file, which declares the values after it.

use super::super::text::{Lines, syntax_error, words};
use super::super::{Place, ReadError};

/// Encoding of the values after the header.
#[derive(Clone, Copy)]
pub(super) enum Encoding {
    Ascii,
    Binary { big_endian: bool },
}

/// Declaration of all values.
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// True if a comment names an image, as MeshLab writes it.
    pub(super) has_texture: bool,
}

/// A table of `count` rows with the same properties.
pub(super) struct Element {
    /// Name in lower case.
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
    /// Place of the declaration.
    pub(super) at: Place,
}

/// A column of an element.
pub(super) struct Property {
    /// Name in lower case.
    pub(super) name: String,
    pub(super) kind: Kind,
}

/// A number, or a counted list of numbers.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

/// Types of numbers in a PLY.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn from_name(name: &[u8]) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_slice() {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    pub(super) fn n_bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

impl Header {
    /// Reads up to `end_header`. The returned lines continue with the values.
    pub(super) fn read(bytes: &[u8]) -> Result<(Self, Lines<'_>), ReadError> {
        let mut lines = Lines::of(bytes);
        let (at, magic) = lines.next().unwrap_or((Place::Line(1), b""));
        if !magic.trim_ascii().eq_ignore_ascii_case(b"ply") {
            return Err(syntax_error(at, "\"ply\"", magic));
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut has_texture = false;
        while let Some((at, line)) = lines.next() {
            let mut words = words(line);
            match words.next() {
                None | Some(b"obj_info") => {}
                Some(b"comment") => {
                    let first = words.next().unwrap_or_default();
                    has_texture |= first.eq_ignore_ascii_case(b"TextureFile");
                }
                Some(b"format") => encoding = Some(read_encoding(words.next(), at)?),
                Some(b"element") => {
                    let element = read_element(words, at)?;
                    if elements.iter().any(|e| e.name == element.name) {
                        return Err(syntax_error(at, "each element once", line));
                    }
                    elements.push(element);
                }
                Some(b"property") => {
                    let element = elements
                        .last_mut()
                        .ok_or_else(|| syntax_error(at, "\"element\" first", line))?;
                    element.properties.push(read_property(words, at)?);
                }
                Some(b"end_header") => {
                    let encoding =
                        encoding.ok_or_else(|| syntax_error(at, "a \"format\" line before", line))?;
                    let header = Self {
                        encoding,
                        elements,
                        has_texture,
                    };
                    return Ok((header, lines));
                }
                Some(_) => return Err(syntax_error(at, "a line of a PLY header", line)),
            }
        }
        Err(ReadError::CutOff {
            at: lines.place(),
            within: "the header",
        })
    }

    /// Returns an error for counts that `n_bytes` of values cannot hold.
    pub(super) fn check_counts(&self, n_bytes: usize, at: Place) -> Result<(), ReadError> {
        let mut room = n_bytes as u64;
        for element in &self.elements {
            let row_bytes = self.row_bytes(element);
            if row_bytes == 0 {
                continue;
            }
            // The last word of a text may lack the white space after it.
            let fit = (room + u64::from(matches!(self.encoding, Encoding::Ascii))) / row_bytes;
            let promised = element.count as u64;
            if promised > fit {
                let what = match element.name.as_str() {
                    "vertex" => "points",
                    "face" => "faces",
                    _ => "other rows",
                };
                return Err(ReadError::TooFewBytes {
                    at,
                    what,
                    count: promised,
                    room: fit,
                });
            }
            room = room.saturating_sub(promised * row_bytes);
        }
        Ok(())
    }

    /// Fewest bytes of a row: empty lists, words of one digit.
    fn row_bytes(&self, element: &Element) -> u64 {
        let bytes = |p: &Property| match (self.encoding, p.kind) {
            (Encoding::Ascii, _) => 2,
            (Encoding::Binary { .. }, Kind::Scalar(scalar) | Kind::List { count: scalar, .. }) => {
                scalar.n_bytes() as u64
            }
        };
        element.properties.iter().map(bytes).sum()
    }
}

fn read_encoding(word: Option<&[u8]>, at: Place) -> Result<Encoding, ReadError> {
    match word.unwrap_or_default() {
        b"ascii" => Ok(Encoding::Ascii),
        b"binary_little_endian" => Ok(Encoding::Binary { big_endian: false }),
        b"binary_big_endian" => Ok(Encoding::Binary { big_endian: true }),
        other => Err(syntax_error(
            at,
            "\"ascii\", \"binary_little_endian\" or \"binary_big_endian\"",
            other,
        )),
    }
}

fn read_element<'a>(mut words: impl Iterator<Item = &'a [u8]>, at: Place) -> Result<Element, ReadError> {
    let name = name(words.next());
    let count = words.next().unwrap_or_default();
    let parsed = std::str::from_utf8(count).ok().and_then(|text| text.parse().ok());
    let count = parsed.ok_or_else(|| syntax_error(at, "the name of an element and its count", count))?;
    Ok(Element {
        name,
        count,
        properties: Vec::new(),
        at,
    })
}

fn read_property<'a>(mut words: impl Iterator<Item = &'a [u8]>, at: Place) -> Result<Property, ReadError> {
    let scalar = |word: Option<&[u8]>| {
        let word = word.unwrap_or_default();
        Scalar::from_name(word)
            .ok_or_else(|| syntax_error(at, "a type like \"int\", \"uchar\" or \"float\"", word))
    };
    let first = words.next();
    let kind = if first == Some(b"list") {
        Kind::List {
            count: scalar(words.next())?,
            item: scalar(words.next())?,
        }
    } else {
        Kind::Scalar(scalar(first)?)
    };
    Ok(Property {
        name: name(words.next()),
        kind,
    })
}

fn name(word: Option<&[u8]>) -> String {
    String::from_utf8_lossy(word.unwrap_or_default()).to_ascii_lowercase()
}
