//! Print time and material by closed forms, fitted to PrusaSlicer's figures, for use without a slicer.
//!
//! Resin: printers with a display take equally long for every layer, so height alone counts:
//! `T = n (tilt + exposure + lift) + 13 Δ − 56 Δ/11`, with n layers and Δ the extra exposure of the first
//! one, faded over ten. This is PrusaSlicer's own formula; a print that was compared differs by 0.02 %. A
//! print that needs supports is lifted off a pad as a whole.
//!
//! Filament: the features are all outlines, perimeters beyond two, short loops, solid and sparse fill, and
//! for supports their volume, outlines and solid top layers. The references are PrusaSlicer's profile "0.20mm
//! SPEED" for the MK3S and a plain profile with the speeds of fast printers ([`Pace`]). Both have 15 %
//! infill; perimeters and supports are those of [`Slicing`](crate::slicing::Slicing). `cargo xtask study
//! hours` slices pieces and fits the coefficients.
//! Limits: layers of 0.2 mm, curved shells and whole models. Boxes take less than estimated (a cube of 40 mm
//! by six tenths), since long straight lines reach their full speed. A small piece alone takes more, as the
//! slicer waits for layers to cool.
//!
//! Powder: height alone counts, as every layer is spread alike.

use crate::load::{Load, SOLID_LAYERS};
use crate::printer::{Pace, Printer, Process};

/// Times of the steps of a resin layer, and extra exposure of the first layer, seconds.
const TILT_S: f64 = 5.0;
const EXPOSURE_S: f64 = 7.5;
const LIFT_S: f64 = 0.25;
const LONGER_S: f64 = 27.5;
/// Time of a powder layer, seconds.
const POWDER_S: f64 = 12.0;
/// Height by which supports and a pad lift a resin print, mm: 5 above a pad of 2.
const LIFTED_MM: f64 = 7.0;
/// Resin for the pad and the supports, mm³ per mm² of shadow and mm³ per mm³ below overhangs. From two pieces
/// that PrusaSlicer sliced, off by 1 % and 5 %: an order of magnitude, not a calibration.
const RESIN_MM3: [f64; 2] = [2.9, 0.1];

/// Wall thickness to which people hollow resin models, mm.
const HOLLOWED_MM: f64 = 2.0;

/// Names of the features that filament print time is linear in.
pub const TIME_FEATURES: [&str; 9] = [
    "outlines",
    "more perimeters",
    "short loops",
    "fill",
    "floors",
    "sparse",
    "supports",
    "support sides",
    "support tops",
];
/// Width of an outline with two perimeters, and of each perimeter more, mm.
const OUTLINE_MM: f64 = 0.9;
const PERIMETER_MM: f64 = 0.41;
/// Seconds per unit of each feature, at the usual and at a fast pace: mm of all outlines with two perimeters;
/// mm of a third and fourth perimeter; mm of a short loop; mm² of a solid layer within the perimeters of
/// walls, of floors; mm² of a sparse layer; mm² of supports in a layer, mm of their outline; mm² of their
/// upper ends. Narrow fill within walls takes far longer than a floor. Floors were not fitted: their price is
/// that of a line's width and speed.
///
/// Least squares over 180 prints by PrusaSlicer 2.5: 82 pieces of seven kits on snug supports, half of them
/// with two perimeters and half as kits are sliced, and whole models, each in the pose on the plate and in a
/// slanted one. A single print is off by 6 % in the median at the usual pace and by 5 % at the fast one; nine
/// of ten are within 18 and 15 %.
const TIME_S: [[f64; 9]; 2] = [
    [
        0.0903, 0.0300, 0.0560, 0.1058, 0.0111, 0.0115, 0.0009, 0.0459, 0.6710,
    ],
    [
        0.0300, 0.0114, 0.0137, 0.0455, 0.0095, 0.0072, 0.0, 0.0206, 0.3605,
    ],
];

/// Names of the features that filament material is linear in.
pub const PLASTIC_FEATURES: [&str; 6] = [
    "dense",
    "sparse",
    "top",
    "supports",
    "support sides",
    "support tops",
];
/// Plastic in mm³ per unit of each feature, by the profiles of the usual and of a fast pace: mm³ of dense
/// fill, of sparse fill; mm² of top surface as seen from above; mm³ of supports, mm² of their sides, of their
/// upper ends. Fitted to the prints of `TIME_S`: off by 3 % in the median and 8 % in nine of ten.
const PLASTIC_MM3: [[f64; 6]; 2] = [
    [0.8584, 0.2142, 0.8392, 0.1327, 0.1973, 0.0],
    [0.9092, 0.2118, 0.7558, 0.1434, 0.3512, 0.3332],
];

/// Amounts of [`TIME_FEATURES`] in layers of `layer_mm`.
pub fn time_features(load: &Load, layer_mm: f64) -> [f64; 9] {
    let (outlines_mm, dense_mm3) = (load.side_mm2 / layer_mm, load.volume_mm3 - load.sparse_mm3);
    let within_mm2 = (dense_mm3 / layer_mm - OUTLINE_MM * outlines_mm).max(0.0);
    // Walls have no room for more perimeters than fill them.
    let more_mm = load.n_perimeters.saturating_sub(2) as f64 * outlines_mm;
    let more_mm = more_mm.min(within_mm2 / PERIMETER_MM);
    let fill_mm2 = within_mm2 - PERIMETER_MM * more_mm;
    // Each level top has a level bottom below it.
    let floors_mm2 = fill_mm2.min(2.0 * SOLID_LAYERS * load.level_mm2);
    [
        outlines_mm,
        more_mm,
        load.small_side_mm2 / layer_mm,
        fill_mm2 - floors_mm2,
        floors_mm2,
        load.sparse_mm3 / layer_mm,
        load.drawn.volume_mm3 / layer_mm,
        load.drawn.side_mm2 / layer_mm,
        load.drawn.top_mm2,
    ]
}

/// Amounts of [`PLASTIC_FEATURES`] in a load.
pub fn plastic_features(load: &Load) -> [f64; 6] {
    [
        (load.volume_mm3 - load.sparse_mm3).max(0.0),
        load.sparse_mm3,
        load.top_mm2,
        load.drawn.volume_mm3,
        load.drawn.side_mm2,
        load.drawn.top_mm2,
    ]
}

fn product<const N: usize>(amounts: [f64; N], prices: [f64; N]) -> f64 {
    amounts
        .iter()
        .zip(prices)
        .map(|(amount, price)| amount * price)
        .sum()
}

/// Print time and material of a print.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Print time in seconds, s.
    pub seconds: f64,
    /// Material including supports, g.
    pub grams: f64,
}

impl Cost {
    /// Estimates the cost of one plate.
    pub fn of(printer: &Printer, load: &Load) -> Self {
        Self {
            seconds: seconds(printer, load),
            grams: grams(printer, load),
        }
    }

    /// Estimates the cost of one plate on a fast printer; `None` unless the printer's pace is open.
    pub fn of_fast(printer: &Printer, load: &Load) -> Option<Self> {
        (printer.process == Process::Fdm && printer.pace.is_none()).then(|| Self {
            seconds: filament_seconds(printer, load, Pace::Fast),
            grams: in_grams(printer, filament_mm3(load, Pace::Fast)),
        })
    }

    /// Cost of two prints, one after the other.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            seconds: self.seconds + other.seconds,
            grams: self.grams + other.grams,
        }
    }

    /// Formats the cost as in "13 h 50 min and 104 g".
    pub fn words(self) -> String {
        // The estimate is no more exact than five minutes.
        let minutes = 5 * (self.seconds / 300.0).round() as u64;
        let time = match (minutes / 60, minutes % 60) {
            (0, minutes) => format!("{minutes} min"),
            (hours, 0) => format!("{hours} h"),
            (hours, minutes) => format!("{hours} h {minutes} min"),
        };
        format!("{time} and {:.0} g", self.grams)
    }
}

/// Load of the whole model as people print it: filament with equal settings, resin hollowed to walls of 2 mm,
/// powder solid. `load` is that of the solid model with `area_mm2` of surface.
pub fn whole(process: Process, load: Load, area_mm2: f64) -> Load {
    let volume_mm3 = match process {
        Process::Sla => load.volume_mm3.min(HOLLOWED_MM * area_mm2),
        Process::Fdm | Process::Sls => load.volume_mm3,
    };
    Load { volume_mm3, ..load }
}

/// Words for the usual way to print whole models by `process`.
pub fn whole_words(process: Process) -> &'static str {
    match process {
        Process::Sla => "hollowed to 2 mm walls",
        Process::Fdm => "at 15 % infill",
        Process::Sls => "solid",
    }
}

/// Estimated time that `printer` takes for one plate, s; 0 for an empty load.
pub fn seconds(printer: &Printer, load: &Load) -> f64 {
    let lifted_mm = match printer.process {
        Process::Sla if load.height_mm > 0.0 => LIFTED_MM,
        _ => 0.0,
    };
    seconds_above(printer, load, lifted_mm)
}

/// Estimated time, s, for parts that lie flat on the plate without supports, of which `load` must have none.
pub fn seconds_flat(printer: &Printer, load: &Load) -> f64 {
    seconds_above(printer, load, 0.0)
}

fn seconds_above(printer: &Printer, load: &Load, lifted_mm: f64) -> f64 {
    let n_layers = ((load.height_mm + lifted_mm) / printer.layer_mm).ceil();
    if n_layers <= 0.0 {
        return 0.0;
    }
    match printer.process {
        Process::Sla => n_layers * (TILT_S + EXPOSURE_S + LIFT_S) + 13.0 * LONGER_S - 56.0 * LONGER_S / 11.0,
        Process::Fdm => filament_seconds(printer, load, printer.pace.unwrap_or(Pace::Usual)),
        Process::Sls => n_layers * POWDER_S,
    }
}

/// Estimated time that a filament printer takes for a load at a pace, s.
fn filament_seconds(printer: &Printer, load: &Load, pace: Pace) -> f64 {
    product(time_features(load, printer.layer_mm), TIME_S[pace as usize])
}

/// Estimated material that `printer` uses for a load, including supports, g. Powder that is not sintered is
/// not counted.
pub fn grams(printer: &Printer, load: &Load) -> f64 {
    let mm3 = match printer.process {
        Process::Sla => load.volume_mm3 + product([load.shadow_mm2, load.support_mm3], RESIN_MM3),
        Process::Fdm => filament_mm3(load, printer.pace.unwrap_or(Pace::Usual)),
        Process::Sls => load.volume_mm3,
    };
    in_grams(printer, mm3)
}

/// Estimated plastic of a filament print by the profile of a pace, mm³.
fn filament_mm3(load: &Load, pace: Pace) -> f64 {
    product(plastic_features(load), PLASTIC_MM3[pace as usize])
}

fn in_grams(printer: &Printer, mm3: f64) -> f64 {
    mm3 * printer.material.density_g_cm3 / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::Drawn;

    #[test]
    fn resin_and_powder_ask_for_height_alone_and_filament_for_material() {
        let load = Load {
            height_mm: 50.0,
            volume_mm3: 2e4,
            drawn: Drawn {
                volume_mm3: 1e3,
                side_mm2: 500.0,
                top_mm2: 0.0,
            },
            ..Load::default()
        };
        for printer in [Printer::sla(), Printer::sls()] {
            assert_eq!(seconds(&printer, &load), seconds(&printer, &load.and(load)));
        }
        let fdm = Printer::fdm();
        assert!((seconds(&fdm, &load.and(load)) / seconds(&fdm, &load) - 2.0).abs() < 1e-12);
        assert_eq!(seconds(&fdm, &Load::default()), 0.0);
        assert!((grams(&fdm, &load.and(load)) / grams(&fdm, &load) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_fast_printer_is_faster_and_only_filament_of_open_pace_has_two_figures() {
        let load = Load {
            height_mm: 20.0,
            volume_mm3: 2e4,
            side_mm2: 1e4,
            ..Load::default()
        };
        let fdm = Printer::fdm();
        let fast = Cost::of_fast(&fdm, &load).unwrap();
        assert!(fast.seconds < 0.6 * seconds(&fdm, &load));
        assert_eq!(Cost::of_fast(&Printer::sla(), &load), None);
        let known = Printer {
            pace: Some(Pace::Fast),
            ..Printer::fdm()
        };
        assert_eq!(Cost::of(&known, &load), fast);
        assert_eq!(Cost::of_fast(&known, &load), None);
    }

    #[test]
    fn supports_take_time_and_plastic_and_sparse_infill_saves_both() {
        let block = Load {
            height_mm: 20.0,
            volume_mm3: 2e4,
            ..Load::default()
        };
        let held = Load {
            drawn: Drawn {
                volume_mm3: 1e3,
                side_mm2: 400.0,
                top_mm2: 100.0,
            },
            ..block
        };
        let sparse = Load {
            sparse_mm3: 1e4,
            ..block
        };
        let fdm = Printer::fdm();
        for measure in [seconds, grams] {
            assert!(measure(&fdm, &held) > measure(&fdm, &block));
            assert!(measure(&fdm, &sparse) < measure(&fdm, &block));
        }
    }

    #[test]
    fn the_longer_exposure_of_the_first_layers_is_that_of_ten_faded_ones() {
        let height_mm = 10.0;
        let load = Load {
            height_mm,
            ..Load::default()
        };
        let s = seconds(&Printer::sla(), &load);
        assert!((s - (340.0 * 12.75 + 27.5 * (13.0 - 56.0 / 11.0))).abs() < 1e-9);
    }
}
