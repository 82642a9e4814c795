//! Files of former versions as they would be written now: until certificates of version 4 and plans of version 2,
//! pieces were numbered from 0.

use serde_json::Value;

/// What is read of certificates: this version as it is, the one before with other numbers.
pub const CERTIFICATE: u64 = 4;
/// What is read of plans: this version and the one before.
pub const PLAN: u64 = 2;

/// Fields that hold the number of a piece.
const NUMBER: [&str; 11] = [
    "a",
    "against",
    "b",
    "id",
    "key",
    "key_piece",
    "leaves",
    "minus",
    "piece",
    "plus",
    "seat",
];
/// Fields that hold a list of such.
const NUMBERS: [&str; 3] = ["free", "held", "installation_order"];

/// The certificate in the form of version 4, or why it is not read.
pub fn certificate(mut certificate: Value) -> Result<Value, String> {
    let version = &certificate["version"];
    match version.as_u64() {
        Some(CERTIFICATE) => Ok(certificate),
        Some(3) => {
            number_from_1(&mut certificate);
            Ok(certificate)
        }
        Some(1 | 2) => Err(format!(
            "the certificate is of version {version}, which claims less than a kit needs; `shellock verify OUT MODEL` writes a new one"
        )),
        Some(CERTIFICATE..) => Err(format!(
            "the certificate is of version {version}, and this program reads 3 and {CERTIFICATE}: use that of a later release"
        )),
        _ => Err(format!("version {version} is not known")),
    }
}

/// The plan with pieces numbered from 1, or why it is not read.
pub fn plan(mut plan: Value) -> Result<Value, String> {
    let version = plan["version"].as_u64().unwrap_or(1);
    if version > PLAN {
        return Err(format!(
            "plan.json is of version {version}, and this program reads 1 to {PLAN}: use that of a later release"
        ));
    }
    if version == 1 && plan["pieces"][0]["id"] == 0 {
        number_from_1(&mut plan);
    }
    Ok(plan)
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

/// Adds 1 to a number; an object has numbers of its own.
fn add_1(value: &mut Value) {
    match value.as_u64() {
        Some(number) => *value = number.saturating_add(1).into(),
        None => number_from_1(value),
    }
}
