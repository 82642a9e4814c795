//! Errors of parameters outside their range.

/// A parameter outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {}; it must lie between {min} and {}", with_unit(*value, unit), with_unit(*max, unit))]
pub struct ParamProblem {
    /// Name of the parameter, for people.
    pub name: &'static str,
    /// Unit of the parameter; empty if it has none.
    pub unit: &'static str,
    /// Value that was given.
    pub value: f64,
    /// Least value that is allowed.
    pub min: f64,
    /// Greatest value that is allowed.
    pub max: f64,
}

impl ParamProblem {
    /// Returns the problem, unless `value` lies in [`min`, `max`]. NaN is a problem.
    pub fn unless_within(
        name: &'static str,
        unit: &'static str,
        value: f64,
        min: f64,
        max: f64,
    ) -> Option<Self> {
        (!(min..=max).contains(&value)).then_some(Self {
            name,
            unit,
            value,
            min,
            max,
        })
    }
}

fn with_unit(value: f64, unit: &str) -> String {
    if unit.is_empty() {
        value.to_string()
    } else {
        format!("{value} {unit}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_outside_or_none_is_a_problem_told_with_its_unit_if_it_has_one() {
        assert_eq!(ParamProblem::unless_within("size", "mm", 2.0, 1.0, 2.0), None);
        let said = |unit, value| {
            ParamProblem::unless_within("size", unit, value, 1.0, 2.0)
                .unwrap()
                .to_string()
        };
        assert_eq!(said("mm", 3.0), "size is 3 mm; it must lie between 1 and 2 mm");
        assert_eq!(said("", f64::NAN), "size is NaN; it must lie between 1 and 2");
    }
}
