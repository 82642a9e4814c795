//! `.seg` files: one whole number per line, the label of a face in file order (Princeton Segmentation
//! Benchmark).

use super::text::{Lines, whole, words};
use super::{Place, ReadError, container};

/// Reads one label ≥ 0 per line, in the order of the file's faces. Blank lines are skipped, and `3.0` counts
/// as 3.
pub fn read_labels(bytes: &[u8]) -> Result<Vec<i64>, ReadError> {
    let (bytes, _) = container::unpack(bytes)?;
    let mut labels = Vec::new();
    for (at, line) in Lines::of(&bytes) {
        if let Some(label) = label(line, at)? {
            labels.push(label);
        }
    }
    if labels.is_empty() {
        Err(ReadError::Empty)
    } else {
        Ok(labels)
    }
}

/// Writes one label per line, in the format of [`read_labels`].
pub fn write_labels(labels: &[u32]) -> Vec<u8> {
    labels
        .iter()
        .flat_map(|label| format!("{label}\n").into_bytes())
        .collect()
}

/// Parses the label of a line; `None` for a blank line.
fn label(line: &[u8], at: Place) -> Result<Option<i64>, ReadError> {
    const EXPECTED: &str = "one whole number a line";
    let mut words = words(line);
    let Some(first) = words.next() else {
        return Ok(None);
    };
    let label = whole(Some(first), at, EXPECTED)?;
    if words.next().is_some() {
        return Err(super::text::syntax_error(at, EXPECTED, line));
    }
    if label < 0 {
        Err(ReadError::NegativeLabel { at, label })
    } else {
        Ok(Some(label))
    }
}
