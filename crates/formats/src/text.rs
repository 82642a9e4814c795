//! Lines, words and numbers of text formats, with their places for messages.

use super::{Place, ReadError};

/// Largest number of characters of a wrong word quoted in a message.
const QUOTED_CHARS: usize = 40;

/// Lines of a text with their numbers from 1; LF, CRLF and CR each end a line.
#[derive(Clone)]
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    n_done: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn of(bytes: &'a [u8]) -> Self {
        Self {
            rest: without_bom(bytes),
            n_done: 0,
        }
    }

    /// Returns the text after the last line returned.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// Place of the last line returned.
    pub(super) fn place(&self) -> Place {
        Place::Line(self.n_done)
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (Place, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self
            .rest
            .iter()
            .position(|&b| b == b'\n' || b == b'\r')
            .unwrap_or(self.rest.len());
        let (line, after) = self.rest.split_at(end);
        self.rest = after
            .strip_prefix(b"\r\n")
            .unwrap_or_else(|| after.get(1..).unwrap_or_default());
        self.n_done += 1;
        Some((self.place(), line))
    }
}

/// Returns the bytes after the UTF-8 byte order mark, if there is one.
pub(super) fn without_bom(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// Splits a line into words.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// Returns the part of a line before `#`.
pub(super) fn without_comment(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or_default()
}

/// Returns the start of `text`, made printable.
fn excerpt(text: &[u8]) -> String {
    String::from_utf8_lossy(&text[..text.len().min(4 * QUOTED_CHARS)])
        .chars()
        .take(QUOTED_CHARS)
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

/// Returns the start of a word in quotes, made printable.
pub(super) fn quote(word: &[u8]) -> String {
    format!("\"{}\"", excerpt(word))
}

/// Creates the error "expected … found …", with `text` shortened and made printable.
pub(super) fn syntax_error(at: Place, syntax: &'static str, text: &[u8]) -> ReadError {
    let shown = excerpt(text);
    let ellipsis = if text.len() > shown.len() { "…" } else { "" };
    ReadError::Malformed {
        at,
        syntax,
        text: shown + ellipsis,
    }
}

/// Parses a word as a finite coordinate.
pub(super) fn coordinate(word: Option<&[u8]>, at: Place) -> Result<f64, ReadError> {
    let word = word.unwrap_or_default();
    match parse::<f64>(word) {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(ReadError::NotFinite { at }),
        // C libraries write "1.#QNAN" and "-nan(ind)", which are no Rust floats.
        None if word.contains(&b'#')
            || word
                .to_ascii_lowercase()
                .windows(3)
                .any(|w| w == b"nan" || w == b"inf") =>
        {
            Err(ReadError::NotFinite { at })
        }
        None => Err(syntax_error(at, "a number", word)),
    }
}

/// Parses three coordinates from the next three words.
pub(super) fn point<'a>(
    words: &mut impl Iterator<Item = &'a [u8]>,
    at: Place,
) -> Result<[f64; 3], ReadError> {
    Ok([
        coordinate(words.next(), at)?,
        coordinate(words.next(), at)?,
        coordinate(words.next(), at)?,
    ])
}

/// Parses a word as a whole number; `3.0` is accepted.
pub(super) fn whole(word: Option<&[u8]>, at: Place, expected: &'static str) -> Result<i64, ReadError> {
    let word = word.unwrap_or_default();
    parse::<i64>(word)
        .or_else(|| parse::<f64>(word).and_then(whole_of))
        .ok_or_else(|| syntax_error(at, expected, word))
}

/// Converts `value` to an integer, if it is one that a float holds exactly.
pub(super) fn whole_of(value: f64) -> Option<i64> {
    /// Limit up to which floats represent all integers, 2⁵³.
    const EXACT: f64 = 9_007_199_254_740_992.0;
    (value.fract() == 0.0 && value.abs() <= EXACT).then_some(value as i64)
}

fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}
