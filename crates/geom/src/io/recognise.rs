//! What a file is, by its first bytes.

use super::text::{Lines, without_bom, without_comment, words};
use super::{Format, ReadError, stl};

/// Bytes looked at to tell text from binary.
const SAMPLE_BYTES: usize = 1024;

/// The format of `bytes`; `extension` decides only where the content fits none.
pub(super) fn recognise(bytes: &[u8], extension: Option<&str>) -> Result<Format, ReadError> {
    let extension = extension.unwrap_or_default().trim_start_matches('.').to_ascii_lowercase();
    if without_bom(bytes).iter().all(u8::is_ascii_whitespace) {
        return Err(ReadError::Empty);
    }
    if bytes.starts_with(b"PK\x03\x04") {
        return Ok(Format::ThreeMf);
    }
    // Before all words: binary files may begin with any of them, most often with "solid".
    if stl::length_fits_binary(bytes) {
        return Ok(Format::StlBinary);
    }
    if bytes.starts_with(b"glTF") {
        return Ok(Format::Glb);
    }
    let is_text = !bytes[..bytes.len().min(SAMPLE_BYTES)].contains(&0);
    match (by_first_word(bytes), extension.as_str()) {
        (Some(Format::StlAscii), _) if !is_text => Ok(Format::StlBinary),
        (Some(format), _) => Ok(format),
        (None, "stl") => Ok(if is_text { Format::StlAscii } else { Format::StlBinary }),
        (None, "obj") if is_text => Ok(Format::Obj),
        (None, "off") if is_text => Ok(Format::Off),
        (None, "gltf") if is_text => Ok(Format::Gltf),
        (None, "ply") => Ok(Format::Ply),
        (None, _) => Err(ReadError::UnknownFormat),
    }
}

fn by_first_word(bytes: &[u8]) -> Option<Format> {
    let first = Lines::of(bytes).find_map(|(_, line)| words(without_comment(line)).next())?;
    match first.to_ascii_lowercase().as_slice() {
        b"ply" => Some(Format::Ply),
        b"solid" => Some(Format::StlAscii),
        b"v" | b"vn" | b"vt" | b"vp" | b"f" | b"o" | b"g" | b"s" | b"l" | b"p" | b"mtllib" | b"usemtl" => {
            Some(Format::Obj)
        }
        // JSON, and glTF is the only mesh format in it that is read.
        word if word.starts_with(b"{") => Some(Format::Gltf),
        word if word.len() <= 8 && word.ends_with(b"off") => Some(Format::Off),
        _ => None,
    }
}

/// A byte order mark, or Latin letters with a zero byte each.
pub(super) fn is_utf16(bytes: &[u8]) -> bool {
    /// Characters that must agree; a binary header that does so by chance is unheard of.
    const CHARS: usize = 8;
    let by_pattern = |zero: usize| {
        bytes.len() >= 2 * CHARS
            && bytes.chunks_exact(2).take(CHARS).all(|pair| pair[zero] == 0 && is_printed(pair[1 - zero]))
    };
    bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") || by_pattern(0) || by_pattern(1)
}

fn is_printed(byte: u8) -> bool {
    byte.is_ascii_graphic() || byte.is_ascii_whitespace()
}
