//! Conversion of plans of earlier versions to the present form.
//!
//! Version 1 was written by program 0.1. It numbered pieces from 0, in its last builds from 1. Fields that no
//! command reads ([`PlanFile::plan`], [`PlanFile::holding`], [`PlanFile::bears`], the material) had other
//! forms then and are dropped.

use serde::de::DeserializeOwned;
use serde_json::Value;
use shellock::metric::{Bears, Holding};
use shellock::plan::PlanProof;
use shellock::strength::Material;

#[cfg(doc)]
use super::PlanFile;
use super::{FORMAT, PlanFileError, VERSION};

/// Names of fields that hold the number of a piece.
const NUMBER: [&str; 10] = [
    "a",
    "against",
    "b",
    "earlier",
    "female",
    "id",
    "key_piece",
    "later",
    "male",
    "piece",
];
/// Names of fields that hold a list of piece numbers.
const NUMBERS: [&str; 7] = [
    "between",
    "installation_order",
    "keys",
    "loose",
    "neighbors",
    "pieces",
    "too_large",
];

/// Converts a plan to the present version's form.
///
/// A plan of another format or of a later version is rejected. One without these fields is of version 1.
pub(super) fn converted(mut plan: Value) -> Result<Value, PlanFileError> {
    if plan.get("format").is_some_and(|format| *format != FORMAT) {
        return Err(PlanFileError::OtherFormat);
    }
    let version = plan.get("version").map_or(Some(1), Value::as_u64);
    match version.ok_or(PlanFileError::OtherFormat)? {
        VERSION => Ok(plan),
        1 => {
            convert_first(&mut plan);
            Ok(plan)
        }
        0 => Err(PlanFileError::OtherFormat),
        later => Err(PlanFileError::Later { version: later }),
    }
}

fn convert_first(plan: &mut Value) {
    if plan.pointer("/pieces/0/id") == Some(&Value::from(0)) {
        number_from_1(plan);
    }
    keep_if::<PlanProof>(plan, "plan");
    keep_if::<Holding>(plan, "holding");
    keep_if::<Bears>(plan, "bears");
    if let Some(strength) = plan.get_mut("strength") {
        keep_if::<Material>(strength, "material");
    }
    plan["version"] = VERSION.into();
}

/// Adds 1 to all numbers of pieces.
fn number_from_1(value: &mut Value) {
    match value {
        Value::Object(fields) => fields.iter_mut().for_each(|(name, value)| match value {
            Value::Number(_) if NUMBER.contains(&&name[..]) => add_1(value),
            Value::Array(list) if NUMBERS.contains(&&name[..]) => list.iter_mut().for_each(add_1),
            _ => number_from_1(value),
        }),
        Value::Array(list) => list.iter_mut().for_each(number_from_1),
        _ => {}
    }
}

/// Adds 1 to a number. In an object, adds 1 to the numbers within.
fn add_1(value: &mut Value) {
    match value.as_u64() {
        Some(number) => *value = number.saturating_add(1).into(),
        None => number_from_1(value),
    }
}

/// Removes a field whose value is of another form than `T`.
fn keep_if<T: DeserializeOwned>(object: &mut Value, field: &str) {
    let Some(fields) = object.as_object_mut() else {
        return;
    };
    let is_other = |value: &Value| serde_json::from_value::<T>(value.clone()).is_err();
    if fields.get(field).is_some_and(is_other) {
        fields.remove(field);
    }
}
