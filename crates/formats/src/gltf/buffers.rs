//! Buffers: the bytes that accessors read.

use std::borrow::Cow;

use base64::Engine as _;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::super::ReadError;
use super::document::Buffer;
use super::error;

/// Largest number of characters of a file name quoted in a message.
const QUOTED_CHARS: usize = 40;
/// Base64 decoder that accepts data with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Content of a buffer.
pub(super) enum Content<'a> {
    Bytes(Cow<'a, [u8]>),
    /// Neither URI nor binary chunk: mostly the fallback of compressed data.
    Absent,
    /// Data in another file, given by the beginning of its name.
    Elsewhere(String),
    /// A URI that cannot be decoded, with the reason.
    Damaged(String),
}

/// Decodes the contents of all buffers, in order. `chunk` is the binary chunk of a GLB, which is the first
/// buffer.
///
/// A buffer without content is an error only when it is used: animations and images often have their own.
pub(super) fn contents<'a>(buffers: &[Buffer], chunk: Option<&'a [u8]>) -> Vec<Content<'a>> {
    let content = |(index, buffer): (usize, &Buffer)| match (&buffer.uri, chunk) {
        (Some(uri), _) => decode(uri),
        (None, Some(chunk)) if index == 0 => Content::Bytes(Cow::Borrowed(chunk)),
        (None, _) => Content::Absent,
    };
    buffers.iter().enumerate().map(content).collect()
}

impl Content<'_> {
    /// Returns the bytes of buffer `index`; `Ok(None)` if the file has none.
    pub(super) fn bytes(&self, index: usize) -> Result<Option<&[u8]>, ReadError> {
        match self {
            Self::Bytes(bytes) => Ok(Some(bytes)),
            Self::Absent => Ok(None),
            Self::Elsewhere(name) => Err(error(format!("its data lies in another file, \"{name}\""))),
            Self::Damaged(reason) => Err(error(format!("the data of buffer {index} is {reason}"))),
        }
    }
}

/// Decodes a `data:` URI: base64, or characters and percent codes (RFC 2397).
fn decode(uri: &str) -> Content<'static> {
    let head_and_text = uri
        .get(..5)
        .filter(|scheme| scheme.eq_ignore_ascii_case("data:"))
        .and_then(|_| uri[5..].split_once(','));
    let Some((head, text)) = head_and_text else {
        return Content::Elsewhere(uri.chars().take(QUOTED_CHARS).collect());
    };
    let bytes = decode_percent(text);
    let is_base64 = head
        .rsplit(';')
        .next()
        .is_some_and(|last| last.trim().eq_ignore_ascii_case("base64"));
    if !is_base64 {
        return Content::Bytes(Cow::Owned(bytes.into_owned()));
    }
    match BASE64.decode(&bytes) {
        Ok(bytes) => Content::Bytes(Cow::Owned(bytes)),
        Err(e) => Content::Damaged(format!("no base64 ({e})")),
    }
}

/// Decodes each `%` with two hexadecimal digits to a byte; other `%` are kept.
fn decode_percent(text: &str) -> Cow<'_, [u8]> {
    let bytes = text.as_bytes();
    if !bytes.contains(&b'%') {
        return Cow::Borrowed(bytes);
    }
    let (mut decoded, mut at) = (Vec::with_capacity(bytes.len()), 0);
    while let Some(&byte) = bytes.get(at) {
        let code = bytes
            .get(at + 1..at + 3)
            .filter(|_| byte == b'%')
            .and_then(|digits| u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok());
        decoded.push(code.unwrap_or(byte));
        at += if code.is_some() { 3 } else { 1 };
    }
    Cow::Owned(decoded)
}
