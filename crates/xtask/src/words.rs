//! Rules for comments and lines of the sources, and a list of names that are participles.

mod names;
mod source;

use std::fmt;
use std::fs;
use std::path::PathBuf;

use clap::Args;

use crate::problem::Problem;
use source::{Kind, Token, tokens};

/// Words with which no doc comment begins: it starts with a noun or a verb.
const BAD_STARTS: [&str; 6] = ["What", "Where", "Whether", "The same", "Of", "Its"];
/// Fewest words of a doc comment: fewer repeat the item's name.
const LEAST_WORDS: usize = 4;
/// Most columns of a line, as in rustfmt.toml, which leaves comments and strings alone.
const MOST_COLUMNS: usize = 110;
/// Folders with our sources.
const FOLDERS: [&str; 3] = ["crates", "python/src", "fuzz"];

/// Files to read, and which rules to apply.
#[derive(Args, Default)]
pub struct Options {
    /// Files and folders to read [default: crates, python/src and fuzz]
    paths: Vec<PathBuf>,
    /// List functions and fields that are named by participles, instead of applying the rules
    #[arg(long)]
    names: bool,
}

/// Violation of a rule.
#[derive(Debug, PartialEq, Eq)]
pub struct Finding {
    /// Number of the line, from 1.
    pub line: usize,
    /// Rule and what violates it.
    pub fault: Fault,
}

/// Rule with what violates it.
#[derive(Debug, PartialEq, Eq)]
pub enum Fault {
    /// Doc comment that begins with one of the forbidden words.
    Start(&'static str),
    /// Doc comment with few words, and their number.
    Short(usize),
    /// Line with many columns, and their number.
    Wide(usize),
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start(words) => {
                write!(
                    f,
                    "the doc comment begins with \"{words}\"; begin with a noun or a verb"
                )
            }
            Self::Short(1) => write!(f, "the doc comment has 1 word; say more, {LEAST_WORDS} at least"),
            Self::Short(n) => write!(
                f,
                "the doc comment has {n} words; say more, {LEAST_WORDS} at least"
            ),
            Self::Wide(columns) => write!(f, "the line has {columns} columns; break it at {MOST_COLUMNS}"),
        }
    }
}

/// Applies the rules to all files, or lists names; prints a line for each finding.
pub fn run(options: &Options) -> Result<(), Problem> {
    let paths = match &options.paths[..] {
        [] => &FOLDERS.map(PathBuf::from),
        given => given,
    };
    let mut lines = Vec::new();
    for path in sources(paths)? {
        let text = fs::read_to_string(&path).map_err(Problem::of_file(&path))?;
        let shown = path.display();
        if options.names {
            let names = names::participles(&text).map_err(|problem| Problem::NotRust {
                path: path.clone(),
                problem,
            })?;
            lines.extend(names.iter().map(|name| format!("{shown}: {name}")));
        } else {
            let findings = findings(&text);
            lines.extend(
                findings
                    .iter()
                    .map(|f| format!("{shown}:{}: {}", f.line, f.fault)),
            );
        }
    }
    lines.iter().for_each(|line| println!("{line}"));
    match lines.len() {
        n if options.names => println!("{n} names may be participles"),
        0 => {}
        n => return Err(Problem::Words(n)),
    }
    Ok(())
}

/// Rust files in `paths` and the folders below them, except build folders, sorted.
fn sources(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Problem> {
    let mut left = paths.to_vec();
    let mut files = Vec::new();
    while let Some(path) = left.pop() {
        if path.is_dir() {
            for entry in fs::read_dir(&path).map_err(Problem::of_file(&path))? {
                left.push(entry.map_err(Problem::of_file(&path))?.path());
            }
            left.retain(|path| !path.ends_with("target"));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        } else if !path.exists() {
            return Err(Problem::of_file(&path)(std::io::ErrorKind::NotFound.into()));
        }
    }
    files.sort();
    Ok(files)
}

/// Violations of the rules in a source file, in the order of its lines.
pub fn findings(source: &str) -> Vec<Finding> {
    let tokens: Vec<Token> = tokens(source).collect();
    let mut all: Vec<Finding> = doc_comments(&tokens).iter().flat_map(of_comment).collect();
    all.extend(wide_lines(source, &tokens));
    all.sort_by_key(|finding| finding.line);
    all
}

/// Doc comment: lines that follow each other.
struct Comment<'a> {
    kind: Kind,
    /// Number of the first line, from 1.
    line: usize,
    /// Lines without their marks.
    texts: Vec<&'a str>,
}

fn doc_comments<'a>(tokens: &[Token<'a>]) -> Vec<Comment<'a>> {
    let mut all: Vec<Comment> = Vec::new();
    for token in tokens
        .iter()
        .filter(|t| matches!(t.kind, Kind::Outer | Kind::Inner))
    {
        let text = token.text[3..].trim();
        match all.last_mut() {
            Some(last) if last.kind == token.kind && last.line + last.texts.len() == token.line => {
                last.texts.push(text);
            }
            _ => all.push(Comment {
                kind: token.kind,
                line: token.line,
                texts: vec![text],
            }),
        }
    }
    all
}

fn of_comment(comment: &Comment) -> Vec<Finding> {
    let first = comment
        .texts
        .iter()
        .position(|text| !text.is_empty())
        .unwrap_or(0);
    let start = BAD_STARTS
        .into_iter()
        .find(|words| begins_with(comment.texts[first], words));
    let n_words: usize = comment.texts.iter().map(|text| n_words(text)).sum();
    let is_short = n_words < LEAST_WORDS;
    let faults = start
        .map(Fault::Start)
        .into_iter()
        .chain(is_short.then_some(Fault::Short(n_words)));
    faults
        .map(|fault| Finding {
            line: comment.line + first,
            fault,
        })
        .collect()
}

fn begins_with(text: &str, words: &str) -> bool {
    text.strip_prefix(words)
        .is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '-'))
}

/// Number of words: signs alone, such as dashes, do not count.
fn n_words(text: &str) -> usize {
    text.split_whitespace()
        .filter(|word| word.contains(char::is_alphanumeric))
        .count()
}

/// Finds wide lines. Lines in raw strings are left out: they cannot be broken.
fn wide_lines(source: &str, tokens: &[Token]) -> Vec<Finding> {
    let raw = tokens.iter().filter(|t| t.kind == Kind::RawText);
    let raw: Vec<_> = raw
        .map(|t| t.line..=t.line + t.text.matches('\n').count())
        .collect();
    let numbered = source
        .lines()
        .enumerate()
        .map(|(i, text)| (i + 1, text.chars().count()));
    numbered
        .filter(|(line, columns)| *columns > MOST_COLUMNS && !raw.iter().any(|lines| lines.contains(line)))
        .map(|(line, columns)| Finding {
            line,
            fault: Fault::Wide(columns),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(source: &str) -> Vec<(usize, Fault)> {
        findings(source).into_iter().map(|f| (f.line, f.fault)).collect()
    }

    #[test]
    fn doc_comments_begin_with_a_noun_or_a_verb() {
        for words in BAD_STARTS {
            for mark in ["///", "//!"] {
                let source = format!("{mark} {words} is at the start of it.\n");
                assert_eq!(faults(&source), [(1, Fault::Start(words))], "{source}");
            }
        }
        for right in [
            "Whatever comes first is right",
            "Offset from the place, mm",
            "Itself and all others, in order",
            "Of-the-shelf parts of it",
            "Angle that is what it was",
        ] {
            assert_eq!(faults(&format!("/// {right}.\n")), [], "{right}");
        }
    }

    #[test]
    fn only_the_first_line_of_a_doc_comment_begins_it() {
        assert_eq!(faults("/// A long sentence\n/// Of two lines.\n"), []);
        let source = "/// A comment of some words.\nfn f() {}\n    /// Of another item, it is.\n";
        assert_eq!(faults(source), [(3, Fault::Start("Of"))]);
        assert_eq!(
            faults("//! A module of some words.\n/// Of an item, it is.\n"),
            [(2, Fault::Start("Of"))]
        );
        assert_eq!(
            faults("///\n/// Where a blank line comes first.\n"),
            [(2, Fault::Start("Where"))]
        );
    }

    #[test]
    fn a_doc_comment_has_four_words_in_all_its_lines() {
        assert_eq!(faults("/// Three words, only.\n"), [(1, Fault::Short(3))]);
        assert_eq!(faults("/// Three words — only.\n"), [(1, Fault::Short(3))]);
        assert_eq!(faults("///\n"), [(1, Fault::Short(0))]);
        assert_eq!(faults("/// Three words, only.\n///\n/// And more.\n"), []);
        assert_eq!(faults("/// Number of the line.\n"), []);
    }

    #[test]
    fn no_line_is_wider_than_110_columns() {
        let line = |n: usize, mark: &str| format!("{mark}{}\n", "ü".repeat(n - mark.len()));
        for mark in ["", "// ", "\""] {
            assert_eq!(faults(&line(110, mark)), [], "{mark}");
            assert_eq!(faults(&line(111, mark)), [(1, Fault::Wide(111))], "{mark}");
        }
        assert_eq!(faults(&format!("r\"{}\n{}\"", line(111, ""), line(111, ""))), []);
    }

    #[test]
    fn rules_are_for_doc_comments_alone() {
        for source in [
            "// What of it?\n",
            "//// What of it?\n",
            "/* What of it? */\n",
            "let a = \"\n/// What\n\";\n",
            "let a = r#\"\n/// What\n\"#;\n",
        ] {
            assert_eq!(faults(source), [], "{source}");
        }
    }
}
