//! Messages for parameters out of range.

/// Returns a message if `value` is outside `low` to `high` or not a number.
pub(crate) fn outside(name: &str, value: f64, low: f64, high: f64) -> Option<String> {
    (!(low..=high).contains(&value)).then(|| format!("{name} is {value}, but must be from {low} to {high}"))
}

/// Returns a message if zero parts are requested.
pub(crate) fn no_parts(n_parts: Option<usize>) -> Option<String> {
    (n_parts == Some(0)).then(|| "n_parts is 0, but must be at least 1".to_owned())
}
