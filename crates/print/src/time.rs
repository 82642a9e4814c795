//! Print time and material by closed forms, as PrusaSlicer tells them, where no slicer is at hand.
//!
//! Resin printers with a display take the same time for every layer, so height alone counts:
//! `T = n (tilt + exposure + lift) + 13 Δ − 56 Δ/11`, with n layers, Δ the longer exposure of the first one,
//! faded over ten. That is PrusaSlicer's own form; a print that was compared differs by 0.02 %. Where something
//! is held up, all is lifted off a pad.
//!
//! Filament: short loops, what is filled densely and what sparsely, what lies on top, and of supports
//! their volume, their outlines and the solid layers on top of them. The reference is
//! PrusaSlicer with its default print settings, two perimeters, 15 % infill and supports wherever it sees fit.
//! `cargo xtask study hours` slices pieces and finds the coefficients. Limits: they are those of curved shells and
//! of whole models in layers of 0.2 mm. Large flat faces take less than is told (a table top of 40 mm on supports
//! by two fifths, a cube by a sixth), and a small piece alone takes more, as the slicer waits for layers to cool.
//!
//! Powder: height, as every layer is spread alike.

use crate::load::Load;
use crate::printer::{Printer, Process};

/// Tilting the vat, hardening a layer, lifting it; how much longer the first layer is hardened: seconds.
const TILT_S: f64 = 5.0;
const EXPOSURE_S: f64 = 7.5;
const LIFT_S: f64 = 0.25;
const LONGER_S: f64 = 27.5;
/// A layer of powder, seconds.
const POWDER_S: f64 = 12.0;
/// By so much supports and a pad lift what is printed of resin, mm: 5 above a pad of 2.
const LIFTED_MM: f64 = 7.0;
/// What the pad and the supports take for a mm² of shadow, and for a mm³ below what hangs over: mm³. Of two pieces
/// that PrusaSlicer sliced, off by 1 % and 5 %: an order of size, no calibration.
const RESIN_MM3: [f64; 2] = [2.9, 0.1];

/// Walls of models of resin that people hollow, mm.
const HOLLOWED_MM: f64 = 2.0;

/// What the time of filament is made of.
pub const TIME_FEATURES: [&str; 7] = [
    "short loops",
    "dense",
    "sparse",
    "top",
    "supports",
    "support sides",
    "support tops",
];
/// Seconds for each: a mm of a short loop; a mm² of a layer that is dense, that is sparse; a mm² as it is seen from
/// above; a mm² of supports in a layer, a mm of their outline; a mm² of their upper ends.
///
/// Least squares over 94 prints in layers of 0.2 mm, 80 of single pieces of seven kits and 14 of their whole
/// models, each sliced with and without supports by PrusaSlicer 2.5: without supports the time is off by 4 % in
/// the median and by 10 % in nine of ten; supports by 2 % and 7 % of the whole time.
const TIME_S: [f64; 7] = [0.107, 0.0664, 0.00586, 0.453, 0.0038, 0.0457, 0.604];

/// What the plastic of filament is made of.
pub const PLASTIC_FEATURES: [&str; 6] = [
    "dense",
    "sparse",
    "top",
    "supports",
    "support sides",
    "support tops",
];
/// mm³ for each: a mm³ of the piece that is dense, that is sparse; a mm² as it is seen from above; a mm³ of
/// supports, a mm² of their sides, of their upper ends. Of the same prints: 2 % in the median and 6 % in nine of
/// ten, with supports and without.
const PLASTIC_MM3: [f64; 6] = [0.836, 0.163, 0.688, 0.121, 0.473, 1.17];

/// The amounts of [`TIME_FEATURES`] in layers of `layer_mm`.
pub fn time_features(load: &Load, layer_mm: f64) -> [f64; 7] {
    [
        load.small_side_mm2 / layer_mm,
        (load.volume_mm3 - load.sparse_mm3).max(0.0) / layer_mm,
        load.sparse_mm3 / layer_mm,
        load.top_mm2,
        load.wide_support_mm3 / layer_mm,
        load.wide_side_mm2 / layer_mm,
        load.wide_top_mm2,
    ]
}

/// The amounts of [`PLASTIC_FEATURES`].
pub fn plastic_features(load: &Load) -> [f64; 6] {
    [
        (load.volume_mm3 - load.sparse_mm3).max(0.0),
        load.sparse_mm3,
        load.top_mm2,
        load.wide_support_mm3,
        load.wide_side_mm2,
        load.wide_top_mm2,
    ]
}

fn product<const N: usize>(amounts: [f64; N], prices: [f64; N]) -> f64 {
    amounts
        .iter()
        .zip(prices)
        .map(|(amount, price)| amount * price)
        .sum()
}

/// What a print takes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Time, s.
    pub seconds: f64,
    /// Material with supports, g.
    pub grams: f64,
}

impl Cost {
    /// Of one plate, about.
    pub fn of(printer: &Printer, load: &Load) -> Self {
        Self {
            seconds: seconds(printer, load),
            grams: grams(printer, load),
        }
    }

    /// Both, one after the other.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            seconds: self.seconds + other.seconds,
            grams: self.grams + other.grams,
        }
    }

    /// "13 h 50 min and 104 g".
    pub fn words(self) -> String {
        // By five minutes: it is no more exact.
        let minutes = 5 * (self.seconds / 300.0).round() as u64;
        let time = match (minutes / 60, minutes % 60) {
            (0, minutes) => format!("{minutes} min"),
            (hours, 0) => format!("{hours} h"),
            (hours, minutes) => format!("{hours} h {minutes} min"),
        };
        format!("{time} and {:.0} g", self.grams)
    }
}

/// The whole model as people print it: filament with the same settings, resin hollowed to walls of 2 mm, powder
/// solid. `load` is that of the solid model with `area_mm2` of surface.
pub fn whole(process: Process, load: Load, area_mm2: f64) -> Load {
    let volume_mm3 = match process {
        Process::Sla => load.volume_mm3.min(HOLLOWED_MM * area_mm2),
        Process::Fdm | Process::Sls => load.volume_mm3,
    };
    Load { volume_mm3, ..load }
}

/// How people print whole models by `process`.
pub fn whole_words(process: Process) -> &'static str {
    match process {
        Process::Sla => "hollowed to 2 mm walls",
        Process::Fdm => "at 15 % infill",
        Process::Sls => "solid",
    }
}

/// Time that `printer` takes for one plate, about, s; 0 for nothing.
pub fn seconds(printer: &Printer, load: &Load) -> f64 {
    let lifted_mm = match printer.process {
        Process::Sla if load.height_mm > 0.0 => LIFTED_MM,
        _ => 0.0,
    };
    seconds_above(printer, load, lifted_mm)
}

/// The same for what lies flat on the plate and needs no supports, which `load` has none of.
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
        Process::Fdm => product(time_features(load, printer.layer_mm), TIME_S),
        Process::Sls => n_layers * POWDER_S,
    }
}

/// What `printer` uses of its material for it with supports, about, g. Powder that is not sintered is not
/// counted.
pub fn grams(printer: &Printer, load: &Load) -> f64 {
    let mm3 = match printer.process {
        Process::Sla => load.volume_mm3 + product([load.shadow_mm2, load.support_mm3], RESIN_MM3),
        Process::Fdm => product(plastic_features(load), PLASTIC_MM3),
        Process::Sls => load.volume_mm3,
    };
    mm3 * printer.material.density_g_cm3 / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resin_and_powder_ask_for_height_alone_and_filament_for_material() {
        let load = Load {
            height_mm: 50.0,
            volume_mm3: 2e4,
            wide_support_mm3: 1e3,
            wide_side_mm2: 500.0,
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
    fn supports_take_time_and_plastic_and_sparse_infill_saves_both() {
        let block = Load {
            height_mm: 20.0,
            volume_mm3: 2e4,
            ..Load::default()
        };
        let held = Load {
            wide_top_mm2: 100.0,
            wide_support_mm3: 1e3,
            wide_side_mm2: 400.0,
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
