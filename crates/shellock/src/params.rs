//! What is wrong with a parameter.

/// A parameter outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {value} {unit}; it must lie between {min} and {max} {unit}")]
pub struct ParamProblem {
    /// What people call it.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What was given.
    pub value: f64,
    /// Least allowed value.
    pub min: f64,
    /// Greatest allowed value.
    pub max: f64,
}

impl ParamProblem {
    /// The problem, unless `value` lies in [`min`, `max`]. NaN is a problem.
    pub fn unless_within(name: &'static str, unit: &'static str, value: f64, min: f64, max: f64) -> Option<Self> {
        (!(min..=max).contains(&value)).then_some(Self { name, unit, value, min, max })
    }
}
