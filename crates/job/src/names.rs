//! Error message for an unknown name.

/// Writes a message such as "there is no printer "fmd": did you mean fdm? Choose one of sla, fdm".
pub fn no_such(what: &str, name: &str, known: &[&str]) -> String {
    let slips = |k: &&&str| strsim::damerau_levenshtein(&name.to_lowercase(), &k.to_lowercase());
    // Near names differ by at most a third of the letters, or one letter.
    let is_near = |k: &&&str| slips(k) <= (k.chars().count() / 3).max(1);
    let nearest = known.iter().filter(is_near).min_by_key(slips);
    let all = known.join(", ");
    match nearest {
        Some(nearest) => {
            format!("there is no {what} \"{name}\": did you mean {nearest}? Choose one of {all}")
        }
        None => format!("there is no {what} \"{name}\"; choose one of {all}"),
    }
}

#[cfg(test)]
mod tests {
    use super::no_such;

    #[test]
    fn a_slip_of_the_finger_is_told_what_was_meant() {
        let known = ["sla", "fdm", "fdm-petg"];
        assert!(no_such("printer", "fmd", &known).contains("did you mean fdm?"));
        assert!(!no_such("printer", "laser", &["sls-x9"]).contains("did you mean"));
    }
}
