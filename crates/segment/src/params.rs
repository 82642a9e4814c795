//! What is wrong with a parameter, in words.

/// A sentence where `value` is outside of its range, or no number.
pub(crate) fn outside(name: &str, value: f64, low: f64, high: f64) -> Option<String> {
    (!(low..=high).contains(&value)).then(|| format!("{name} is {value}, but must be from {low} to {high}"))
}

/// A sentence where no parts are asked for.
pub(crate) fn no_parts(n_parts: Option<usize>) -> Option<String> {
    (n_parts == Some(0)).then(|| "n_parts is 0, but must be at least 1".to_owned())
}
