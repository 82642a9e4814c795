//! Size of the kit: as the options say, as the file states it, or a guess that the user is warned of.

use shellock::Warning;
use shellock_formats::{Format, Loaded};
use shellock_geom::Aabb;

use crate::causes::Cause;
use crate::failure::Failure;
use crate::options::Options;

/// Range of longest sides that nobody would question, mm. A file with such a size in its own units is taken
/// to be in millimetres.
const USUAL_MM: std::ops::RangeInclusive<f64> = 20.0..=1000.0;
/// Range of longest sides that can be made, mm: a torus of 2000 mm already takes 8 GB and more than three
/// minutes.
const MADE_MM: std::ops::RangeInclusive<f64> = 10.0..=2000.0;
/// Relative error that scaling to a length may have.
const ROUNDING: f64 = 1e-9;
/// Longest side if the file gives no size, mm.
pub(super) const DEFAULT_SIZE_MM: f64 = 150.0;
/// Longest sides, in file units, of models that programs scale to a box of 1 or of 2 units. Mesh generators
/// write 0.98 and 1.9 as often as 1 and 2.
const NORMALISED: [std::ops::RangeInclusive<f64>; 2] = [0.9..=1.0 + ROUNDING, 1.8..=2.0 + ROUNDING];

/// Millimetres per file unit, with a warning if the size is a guess or unusual. Fails if it cannot be made.
pub(super) fn scale(
    options: &Options,
    loaded: &Loaded,
    bounds: Aabb,
) -> Result<(f64, Option<Warning>), Failure> {
    let longest = bounds.size().max_element();
    let along_up = bounds.size()[options.up.index()];
    let own_mm = loaded.unit_mm.unwrap_or(1.0);
    let (scale, warning) = match (options.size, options.height, options.scale, options.unit) {
        (Some(size), ..) => (length("size", size)? / longest, None),
        (_, Some(height), ..) => (length("height", height)? / along_up, None),
        (_, _, Some(scale), _) => (length("scale", scale)?, None),
        (.., Some(unit)) => (unit.mm(), None),
        _ if loaded.has_unit => (own_mm, unusual(own_mm * longest)),
        _ if is_usual(own_mm * longest) && !is_normalised(loaded.format, longest) => (own_mm, None),
        _ => (DEFAULT_SIZE_MM / longest, Some(guess(loaded, longest))),
    };
    check_size(scale * longest)?;
    Ok((scale, warning))
}

/// Returns true if a longest side of `longest_mm` needs no question.
pub fn is_usual(longest_mm: f64) -> bool {
    USUAL_MM.contains(&longest_mm)
}

/// Returns `mm` if it can be a length or a scale: finite and above 0.
pub fn length(what: &str, mm: f64) -> Result<f64, Failure> {
    if mm.is_finite() && mm > 0.0 {
        Ok(mm)
    } else {
        Err(Failure::Wrong(format!("{what} is {mm}; it must be more than 0")))
    }
}

/// Fails if a longest side is outside the range that can be made.
pub(super) fn check_size(longest_mm: f64) -> Result<(), Failure> {
    let (least, most) = (MADE_MM.start(), MADE_MM.end());
    // A model scaled to an end of the range may miss it by rounding.
    if (least * (1.0 - ROUNDING)..=most * (1.0 + ROUNDING)).contains(&longest_mm) {
        return Ok(());
    }
    Err(Failure::Wrong(format!(
        "the longest side would be {} mm; it must lie between {least} and {most} mm: set it with --size",
        round_length(longest_mm)
    )))
}

/// Writes a length with at most three decimals, or in powers of ten if decimals say nothing.
fn round_length(length: f64) -> String {
    if (0.001..1e6).contains(&length) {
        format!("{}", (1000.0 * length).round() / 1000.0)
    } else {
        format!("{length:.4e}")
    }
}

/// Returns true if a program may have scaled a model that has no size of its own to the unit of the format.
fn is_normalised(format: Format, longest: f64) -> bool {
    matches!(format, Format::Gltf | Format::Glb) && NORMALISED.iter().any(|range| range.contains(&longest))
}

/// Warns of a size that the file states but that few people intend.
fn unusual(longest_mm: f64) -> Option<Warning> {
    (!is_usual(longest_mm)).then(|| {
        let how = if longest_mm > *USUAL_MM.end() {
            "large"
        } else {
            "small"
        };
        warning(
            "size-unusual",
            format!(
                "by the file's own unit the longest side is {longest_mm:.1} mm, which is unusually {how}; \
                 the model is made at that size"
            ),
            &["size"],
        )
    })
}

/// Warns of a size that the file does not state.
fn guess(loaded: &Loaded, longest: f64) -> Warning {
    let what = match loaded.unit_mm {
        Some(mm) if is_normalised(loaded.format, longest) => format!(
            "the longest side is {longest:.3} units of {mm} mm, as in models that a program scaled to a \
             standard size"
        ),
        Some(mm) => format!(
            "by the file's unit the longest side is {} mm, which is unusual",
            round_length(mm * longest)
        ),
        None => format!(
            "the file's longest side is {} units, which is unusual for millimetres",
            round_length(longest)
        ),
    };
    let units = [
        ("mm", 1.0),
        ("cm", 10.0),
        ("m", 1000.0),
        ("inch", 25.4),
        ("micron", 0.001),
    ];
    // Most programs mean millimetres, so these are offered wherever a kit could be made.
    let fits = |name: &str, size: f64| {
        let range = if name == "mm" { MADE_MM } else { USUAL_MM };
        range.contains(&size)
    };
    let others: Vec<String> = units
        .into_iter()
        .map(|(name, mm)| (name, mm * longest))
        .filter(|&(name, size)| fits(name, size))
        .map(|(name, size)| format!("{size:.0} mm if the unit is {name}"))
        .collect();
    let others = if others.is_empty() {
        String::new()
    } else {
        format!("; its size would be {}", others.join(", "))
    };
    warning(
        "size-guessed",
        format!("{what}; the model is made {DEFAULT_SIZE_MM} mm long{others}"),
        &["unit", "size", "height", "scale"],
    )
}

fn warning(code: &'static str, sentence: String, settings: &'static [&'static str]) -> Warning {
    let cause = Cause::Input {
        code,
        sentence,
        settings,
    };
    Warning::new(cause, Vec::new(), None)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A size of 2000 mm may come out as 2000.0000000000002 after scaling.
    #[test]
    fn both_ends_of_the_range_of_sizes_are_made_whatever_rounding_does() {
        for mm in [10.0_f64, 2000.0] {
            for made in [mm.next_down(), mm, mm.next_up()] {
                assert!(check_size(made).is_ok(), "{made:e}");
            }
        }
        let told = |mm: f64| check_size(mm).unwrap_err().to_string();
        assert!(told(2000.04).contains("2000.04 mm"), "{}", told(2000.04));
        assert!(told(9.0).contains("be 9 mm"), "{}", told(9.0));
        assert!(told(1e30).contains("1.0000e30 mm"), "{}", told(1e30));
    }

    #[test]
    fn a_guess_offers_each_unit_that_fits_and_millimetres_wherever_a_kit_can_be_made() {
        let read = |text: String| shellock_formats::read_mesh(text.as_bytes(), Some("obj")).unwrap();
        let loaded = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_owned());
        let told = |longest: f64| match guess(&loaded, longest).cause() {
            Some(Cause::Input { sentence, .. }) => sentence.clone(),
            other => panic!("{other:?}"),
        };
        assert!(told(1500.0).contains("1500 units") && told(1500.0).contains("1500 mm if the unit is mm"));
        assert!(
            told(15.0)
                .contains("15 mm if the unit is mm, 150 mm if the unit is cm, 381 mm if the unit is inch")
        );
        assert!(
            told(150_000.0).contains("150 mm if the unit is micron"),
            "{}",
            told(150_000.0)
        );
        assert!(!told(1.5).contains("the unit is mm"), "{}", told(1.5));
    }

    #[test]
    fn boxes_of_one_and_of_two_units_are_doubted_in_gltf_alone() {
        for longest in [0.9, 0.98, 1.0, 1.8, 2.0] {
            assert!(is_normalised(Format::Glb, longest) && !is_normalised(Format::ThreeMf, longest));
        }
        assert!(
            [0.15, 0.85, 1.2, 1.7, 2.1]
                .iter()
                .all(|&x| !is_normalised(Format::Gltf, x))
        );
    }
}
