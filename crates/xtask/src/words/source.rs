//! Rust sources as tokens: just enough to tell comments and strings from code.

/// Kind of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Line of a doc comment on the item below it, from `///` to its end.
    Outer,
    /// Line of a doc comment on the enclosing item, from `//!` to its end.
    Inner,
    /// Comment of any other kind.
    Comment,
    /// Literal of a string or a character, with escapes.
    Text,
    /// Raw literal of a string.
    RawText,
    /// Anything else: a word, a space or a sign.
    Code,
}

/// Token of a source file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Token<'a> {
    pub kind: Kind,
    pub text: &'a str,
    /// Number of the line on which the token starts, from 1.
    pub line: usize,
}

/// Tokens of a source file in order. Together they are the whole text, whether it compiles or not.
pub fn tokens(source: &str) -> impl Iterator<Item = Token<'_>> {
    let (mut rest, mut line) = (source, 1);
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let (kind, length) = first_token(rest, first);
        let (text, after) = rest.split_at(length);
        let token = Token { kind, text, line };
        line += text.matches('\n').count();
        rest = after;
        Some(token)
    })
}

/// Kind and length in bytes of the token that `text` starts with; `first` is its first character.
fn first_token(text: &str, first: char) -> (Kind, usize) {
    if text.starts_with("//") {
        let length = text.find('\n').unwrap_or(text.len());
        return (comment_kind(text), length);
    }
    if text.starts_with("/*") {
        return (Kind::Comment, block_length(text));
    }
    if let Some(length) = raw_length(text) {
        return (Kind::RawText, length);
    }
    match first {
        '"' => (Kind::Text, quoted_length(text, '"')),
        '\'' => character_length(text).map_or((Kind::Code, 1), |length| (Kind::Text, length)),
        _ if is_of_word(first) => {
            let length = text.find(|c| !is_of_word(c)).unwrap_or(text.len());
            (Kind::Code, length)
        }
        _ => (Kind::Code, first.len_utf8()),
    }
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn comment_kind(text: &str) -> Kind {
    if text.starts_with("//!") {
        Kind::Inner
    } else if text.starts_with("///") && !text.starts_with("////") {
        Kind::Outer
    } else {
        Kind::Comment
    }
}

/// Length of a block comment, which may contain others; all of the text if it does not end.
fn block_length(text: &str) -> usize {
    let mut depth = 0;
    let mut at = 0;
    while at < text.len() {
        let (step, change) = match text.as_bytes().get(at..at + 2) {
            Some(b"/*") => (2, 1),
            Some(b"*/") => (2, -1),
            _ => (1, 0),
        };
        at += step;
        depth += change;
        if depth == 0 {
            return at;
        }
    }
    text.len()
}

/// Length of a raw string with its prefix, or `None` if `text` does not start with one.
fn raw_length(text: &str) -> Option<usize> {
    let prefix = ["r", "br", "cr"].into_iter().find(|prefix| {
        text.strip_prefix(prefix)
            .is_some_and(|rest| rest.starts_with(['"', '#']))
    })?;
    let rest = &text[prefix.len()..];
    let n_hashes = rest.len() - rest.trim_start_matches('#').len();
    let content = rest[n_hashes..].strip_prefix('"')?;
    let end = format!("\"{}", "#".repeat(n_hashes));
    let after = content.find(&end).map_or("", |at| &content[at + end.len()..]);
    Some(text.len() - after.len())
}

/// Length of a literal with escapes that starts and ends with `quote`; all of the text if it does not end.
fn quoted_length(text: &str, quote: char) -> usize {
    let mut is_escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        if c == quote && !is_escaped {
            return at + 1;
        }
        is_escaped = c == '\\' && !is_escaped;
    }
    text.len()
}

/// Length of a character literal, or `None` for a lifetime.
fn character_length(text: &str) -> Option<usize> {
    let mut chars = text.chars().skip(1);
    let (first, second) = (chars.next()?, chars.next()?);
    (first == '\\' || second == '\'').then(|| quoted_length(text, '\''))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texts of one kind in `source`.
    fn of(kind: Kind, source: &str) -> Vec<&str> {
        tokens(source)
            .filter(|t| t.kind == kind)
            .map(|t| t.text)
            .collect()
    }

    #[test]
    fn tokens_together_are_the_whole_text() {
        for source in [
            "",
            "fn f<'a>() { /* a /* b */ */ 'x'; '\\''; r#\"\"#; \"\\\"\" } // ü\n",
            "\"open",
            "/* open",
            "r#\"open",
            "'",
            "'\\",
        ] {
            let joined: String = tokens(source).map(|t| t.text).collect();
            assert_eq!(joined, source);
        }
    }

    #[test]
    fn code_in_strings_is_no_comment() {
        let strings = "let a = \"// no\"; let b = r#\"/// no \" // no\"#;";
        let source = format!("{strings} let c = '\"'; // yes\nlet d = b\"\\\\\"; // yes");
        assert_eq!(of(Kind::Comment, &source), ["// yes", "// yes"]);
        assert_eq!(of(Kind::RawText, &source), ["r#\"/// no \" // no\"#"]);
    }

    #[test]
    fn lifetimes_are_no_characters_and_raw_names_no_strings() {
        assert_eq!(
            of(Kind::Text, "&'a str, '\\n', 'b', b'\"'"),
            ["'\\n'", "'b'", "'\"'"]
        );
        assert_eq!(of(Kind::RawText, "r#fn(for \"x\", bar\"y\")"), [""; 0]);
    }

    #[test]
    fn doc_comments_are_told_from_comments() {
        let source = "//! a\n/// b\n//// c\n// d\n/* /// e */";
        assert_eq!(of(Kind::Inner, source), ["//! a"]);
        assert_eq!(of(Kind::Outer, source), ["/// b"]);
        assert_eq!(of(Kind::Comment, source), ["//// c", "// d", "/* /// e */"]);
    }

    #[test]
    fn lines_are_counted_through_strings() {
        let last = tokens("\"a\nb\"\n/* c\n*/ // d").last().unwrap();
        assert_eq!((last.line, last.text), (4, "// d"));
    }
}
