//! Parses numbers with units as people write them: "15cm", "6 in", "2m", "70N", "90s".

/// Units of length and their lengths, mm. Longer names come first, because the first matching ending is
/// taken.
const LENGTHS: [(&str, f64); 13] = [
    ("micron", 1e-3),
    ("um", 1e-3),
    ("µm", 1e-3),
    ("mm", 1.0),
    ("cm", 10.0),
    ("inch", 25.4),
    ("in", 25.4),
    ("\"", 25.4),
    ("foot", 304.8),
    ("ft", 304.8),
    ("'", 304.8),
    ("m", 1000.0),
    ("", 1.0),
];

/// Parses a length in mm: "150", "15cm", "6in". Its range is checked later.
pub fn length_mm(text: &str) -> Result<f64, String> {
    with_unit(text, &LENGTHS).ok_or_else(|| {
        format!("\"{text}\" is not a length; write mm, such as 150, or with a unit: 15cm, 6in")
    })
}

/// Parses a height in m, above 0: "2m", "200cm", "2000 mm" or "2".
pub fn metres(text: &str) -> Result<f64, String> {
    let units = [
        ("mm", 0.001),
        ("cm", 0.01),
        ("ft", 0.3048),
        ("in", 0.0254),
        ("m", 1.0),
        ("", 1.0),
    ];
    above_0(with_unit(text, &units))
        .ok_or_else(|| format!("\"{text}\" is not a height above 0; write for example 2m, 150cm or 500mm"))
}

/// Parses a force in N, above 0: "70N", "7kg", "0.07 kN" or "70".
pub fn newtons(text: &str) -> Result<f64, String> {
    let units = [("kn", 1000.0), ("kg", 9.80665), ("n", 1.0), ("", 1.0)];
    above_0(with_unit(text, &units))
        .ok_or_else(|| format!("\"{text}\" is not a force above 0 N; write for example 70N or 7kg"))
}

/// Parses a time in s: "90", "90s", "2min".
pub fn seconds(text: &str) -> Result<f64, String> {
    let units = [("min", 60.0), ("h", 3600.0), ("s", 1.0), ("", 1.0)];
    with_unit(text, &units)
        .ok_or_else(|| format!("\"{text}\" is not a time; write seconds, such as 90, or 2min"))
}

/// Number times the factor of the first unit that the text ends in; `None` if either is missing.
fn with_unit(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let text = text.trim().to_lowercase();
    // "inf" and "nan" are numbers without a unit, although "nan" ends in "n", the newton.
    if let Ok(number) = text.parse::<f64>() {
        return Some(number * units.last()?.1);
    }
    let (number, factor) = units
        .iter()
        .find_map(|(unit, factor)| Some((text.strip_suffix(unit)?.trim(), factor)))?;
    Some(number.parse::<f64>().ok()? * factor)
}

fn above_0(value: Option<f64>) -> Option<f64> {
    value.filter(|v| v.is_finite() && *v > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_mm_unless_they_say_otherwise() {
        for (text, mm) in [
            ("150", 150.0),
            ("5cm", 50.0),
            ("5 CM", 50.0),
            ("1.5mm", 1.5),
            ("6in", 152.4),
            ("6\"", 152.4),
            ("15 micron", 0.015),
            ("0.2m", 200.0),
            ("-3mm", -3.0),
        ] {
            assert!((length_mm(text).unwrap() - mm).abs() < 1e-9, "{text}");
        }
        for wrong in ["", "mm", "5furlong", "1,5", "5 5mm"] {
            assert!(length_mm(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn heights_forces_and_times_have_units_of_their_own() {
        assert_eq!(metres("150cm"), Ok(1.5));
        assert!(metres("0").is_err() && metres("inf").is_err());
        assert!((newtons("7kg").unwrap() - 68.6).abs() < 0.1);
        assert_eq!((newtons("70N"), newtons("0.07kN")), (Ok(70.0), Ok(70.0)));
        assert_eq!(
            (seconds("90"), seconds("2min"), seconds("90s")),
            (Ok(90.0), Ok(120.0), Ok(90.0))
        );
    }
}
