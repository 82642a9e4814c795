//! Size of what is made: as asked for, as the file states it, or a guess that the user is warned of.

use shellock::Warning;
use shellock::warning::Cause;
use shellock_formats::{Format, Loaded};
use shellock_geom::Aabb;

use crate::args::Options;
use crate::failure::Failure;

/// Longest side of a model that nobody would ask about, mm. A file of such a size in its own units is taken to
/// be in millimetres.
const USUAL_MM: std::ops::RangeInclusive<f64> = 20.0..=1000.0;
/// Longest side of what is made, mm: a torus of 2000 mm already takes 8 GB and more than three minutes.
const MADE_MM: std::ops::RangeInclusive<f64> = 10.0..=2000.0;
/// Share by which scaling to a length may miss it.
const ROUNDING: f64 = 1e-9;
/// Longest side where the file gives no size, mm.
pub(super) const DEFAULT_SIZE_MM: f64 = 150.0;
/// Longest sides, in file units, of models that programs scale to a box of 1 or of 2 units: generators of
/// meshes write 0.98 and 1.9 as often as 1 and 2.
const NORMALISED: [std::ops::RangeInclusive<f64>; 2] = [0.9..=1.0 + ROUNDING, 1.8..=2.0 + ROUNDING];

/// Millimetres a file unit, and a warning where the size is a guess or unusual.
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
        _ if loaded.unit_is_stated => (own_mm, unusual(own_mm * longest)),
        _ if is_usual(own_mm * longest) && !is_normalised(loaded.format, longest) => (own_mm, None),
        _ => (DEFAULT_SIZE_MM / longest, Some(guess(loaded, longest))),
    };
    check_size(scale * longest)?;
    Ok((scale, warning))
}

/// Whether nobody would ask about a model whose longest side is `longest_mm`.
pub fn is_usual(longest_mm: f64) -> bool {
    USUAL_MM.contains(&longest_mm)
}

/// A number that can be a length, or a scale.
pub fn length(what: &str, mm: f64) -> Result<f64, Failure> {
    if mm.is_finite() && mm > 0.0 {
        Ok(mm)
    } else {
        Err(Failure::Wrong(format!("{what} is {mm}; it must be more than 0")))
    }
}

/// Refuses sizes that are not made.
pub(super) fn check_size(longest_mm: f64) -> Result<(), Failure> {
    let (least, most) = (MADE_MM.start(), MADE_MM.end());
    // A model scaled to an end of the range may miss it by rounding.
    if (least * (1.0 - ROUNDING)..=most * (1.0 + ROUNDING)).contains(&longest_mm) {
        return Ok(());
    }
    let told = if (0.001..1e6).contains(&longest_mm) {
        format!("{}", (1000.0 * longest_mm).round() / 1000.0)
    } else {
        format!("{longest_mm:.4e}")
    };
    Err(Failure::Wrong(format!(
        "the longest side would be {told} mm; it must lie between {least} and {most} mm: choose with --size"
    )))
}

/// Whether a program may have scaled a model that has no size of its own to the unit of the format.
fn is_normalised(format: Format, longest: f64) -> bool {
    matches!(format, Format::Gltf | Format::Glb) && NORMALISED.iter().any(|range| range.contains(&longest))
}

/// A warning of a size that the file states and few people mean.
fn unusual(longest_mm: f64) -> Option<Warning> {
    (!is_usual(longest_mm)).then(|| {
        let how = if longest_mm > *USUAL_MM.end() { "large" } else { "small" };
        warning(
            "size-unusual",
            format!(
                "the file states its unit, by which the longest side is {longest_mm:.1} mm: unusually {how}; it is made so \
                 (choose another with --size)"
            ),
        )
    })
}

/// A warning of a size that the file does not state.
fn guess(loaded: &Loaded, longest: f64) -> Warning {
    let what = match loaded.unit_mm {
        Some(mm) if is_normalised(loaded.format, longest) => format!(
            "the longest side is {longest:.3} of the file's units of {mm} mm, as of models that programs scale to one size"
        ),
        Some(mm) => format!(
            "by the file's unit the longest side is {:.4} mm, which is unusual",
            mm * longest
        ),
        None => format!("the file's longest side is {longest:.4} units, which cannot be millimetres"),
    };
    let units = [("m", 1000.0), ("cm", 10.0), ("inch", 25.4)].map(|(name, mm)| (name, mm * longest));
    let fitting = units.iter().filter(|(_, size)| USUAL_MM.contains(size));
    let others: Vec<String> = fitting
        .map(|(name, size)| format!("{size:.0} mm with --unit {name}"))
        .collect();
    let others = if others.is_empty() {
        String::new()
    } else {
        format!("; it would be {}", others.join(", "))
    };
    warning(
        "size-guessed",
        format!(
            "{what}; it is made {DEFAULT_SIZE_MM} mm long{others} (choose with --unit, --size, --height or --scale)"
        ),
    )
}

fn warning(code: &'static str, sentence: String) -> Warning {
    Warning {
        cause: Cause::Input { code, sentence },
        pieces: Vec::new(),
        at: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2000 mm asked for may come out as 2000.0000000000002.
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
