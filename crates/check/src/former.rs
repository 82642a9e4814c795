//! Conversion of files of former versions to the present form. Before version 4 of certificates and version 2
//! of plans, pieces were numbered from 0.

use serde_json::Value;

/// Version of certificates that is read as it is; the one before is renumbered.
pub const CERTIFICATE: u64 = 4;
/// Newest version of plans that is read; the one before is read, too.
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
/// Fields that hold a list of piece numbers.
const NUMBERS: [&str; 3] = ["free", "held", "installation_order"];

/// Converts a certificate to the form of version 4, or says why it is not read.
pub fn certificate(mut certificate: Value) -> Result<Value, String> {
    let version = &certificate["version"];
    match version.as_u64() {
        Some(CERTIFICATE) => Ok(certificate),
        Some(3) => {
            number_from_1(&mut certificate);
            Ok(certificate)
        }
        Some(1 | 2) => Err(format!(
            "the certificate is of version {version}, which claims less than a kit needs; `shellock verify \
             OUT MODEL` writes a new one"
        )),
        Some(CERTIFICATE..) => Err(format!(
            "the certificate is of version {version}, and this program reads 3 and {CERTIFICATE}: use that \
             of a later release"
        )),
        _ => Err(format!("version {version} is not known")),
    }
}

/// Converts a plan to pieces numbered from 1, or says why it is not read.
pub fn plan(mut plan: Value) -> Result<Value, String> {
    let version = plan["version"].as_u64().unwrap_or(1);
    if version > PLAN {
        return Err(format!(
            "plan.json is of version {version}, and this program reads 1 to {PLAN}: use that of a later \
             release"
        ));
    }
    if version == 1 && plan["pieces"][0]["id"] == 0 {
        number_from_1(&mut plan);
    }
    Ok(plan)
}

/// Adds 1 to all piece numbers.
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

/// Adds 1 to a number; in an object, to the piece numbers in it.
fn add_1(value: &mut Value) {
    match value.as_u64() {
        Some(number) => *value = number.saturating_add(1).into(),
        None => number_from_1(value),
    }
}
