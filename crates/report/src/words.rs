//! Phrases that several sentences share.

use crate::PatchId;

/// Names pieces, as in "piece 3" or "pieces 3, 5".
pub fn pieces(pieces: &[PatchId]) -> String {
    let is_one = pieces.len() == 1;
    format!("piece{} {}", if is_one { "" } else { "s" }, numbers(pieces))
}

/// Lists the numbers of pieces, as in "3, 5".
pub fn numbers(pieces: &[PatchId]) -> String {
    let numbers: Vec<String> = pieces.iter().map(ToString::to_string).collect();
    numbers.join(", ")
}

/// Writes the number of the piece at index `i`; "?" if there is none.
pub fn number(pieces: &[PatchId], i: usize) -> String {
    pieces.get(i).map_or_else(|| "?".into(), ToString::to_string)
}

/// Chooses the word for one thing or for several.
pub fn plural<'a>(n: usize, one: &'a str, several: &'a str) -> &'a str {
    if n == 1 { one } else { several }
}
