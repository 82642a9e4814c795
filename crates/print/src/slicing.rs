//! Choices of a slicer that decide what a print costs: style of supports and number of perimeters.

use crate::printer::{Printer, Process};

/// Settings of PrusaSlicer for [`Style::Snug`], by their names in its configuration files: supports on,
/// everywhere.
const SNUG: [(&str, &str); 5] = [
    ("support_material", "1"),
    ("support_material_auto", "1"),
    ("support_material_buildplate_only", "0"),
    ("support_material_style", "snug"),
    ("support_material_threshold", "40"),
];
/// Numbers of perimeters that pieces may have, as values of PrusaSlicer's setting. Walls thicker than eight
/// lines have infill between.
const PERIMETERS: [&str; 3] = ["2", "3", "4"];
/// Least number of perimeters of a piece.
const LEAST_PERIMETERS: usize = 2;
/// Perimeters of each side that a wall may lack to be solid: a slicer fills a gap of less than half a line.
const LACKING: f64 = 0.2;

/// Style in which a slicer draws supports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Supports below overhangs by more than half a line, widened by a millimetre on all sides: the style
    /// "grid" of older profiles, and resin.
    Grid,
    /// Supports as wide as the faces that they carry, below slopes of up to 40° from level: the style of
    /// PrusaSlicer's profiles for the MK4.
    Snug,
}

/// Choices of a slicer for one print.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slicing {
    /// Style of the supports.
    pub supports: Style,
    /// Number of perimeters of a filament print.
    pub n_perimeters: usize,
}

impl Slicing {
    /// Choices of widespread profiles, which whole models are printed with.
    pub const USUAL: Self = Self {
        supports: Style::Grid,
        n_perimeters: LEAST_PERIMETERS,
    };

    /// Choices for the pieces of a kit with walls of `wall_mm`. Filament gets snug supports, and so many
    /// perimeters that walls are solid, as strength is computed: two to four.
    pub fn of_pieces(printer: &Printer, wall_mm: f64) -> Self {
        match printer.process {
            Process::Fdm => {
                let line_mm = printer.min_wall_mm;
                let n_lines = 1.0 + (wall_mm - line_mm) / (line_mm - printer.line_overlap_mm());
                let n = (n_lines / 2.0 - LACKING).ceil().max(0.0) as usize;
                Self {
                    supports: Style::Snug,
                    n_perimeters: n.clamp(LEAST_PERIMETERS, LEAST_PERIMETERS + PERIMETERS.len() - 1),
                }
            }
            Process::Sla | Process::Sls => Self::USUAL,
        }
    }

    /// Returns PrusaSlicer's settings for these choices, by their names in its configuration files; none for
    /// the usual ones.
    pub fn settings(self) -> Vec<(&'static str, &'static str)> {
        match self.supports {
            Style::Grid => Vec::new(),
            Style::Snug => {
                let perimeters = PERIMETERS[self.n_perimeters - LEAST_PERIMETERS];
                [&SNUG[..], &[("perimeters", perimeters)]].concat()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_of_filament_have_so_many_perimeters_that_their_walls_are_solid() {
        let fdm = Printer::fdm();
        let pitch_mm = fdm.min_wall_mm - fdm.line_overlap_mm();
        for n in 2..=4 {
            let wall_mm = fdm.min_wall_mm + (2 * n - 1) as f64 * pitch_mm;
            let slicing = Slicing::of_pieces(&fdm, wall_mm);
            assert_eq!(slicing.n_perimeters, n, "{wall_mm} mm");
            assert!(slicing.settings().contains(&("perimeters", PERIMETERS[n - 2])));
        }
        assert_eq!(Slicing::of_pieces(&fdm, 0.4).n_perimeters, 2);
        assert_eq!(Slicing::of_pieces(&fdm, 2.0).n_perimeters, 3);
        assert_eq!(Slicing::of_pieces(&fdm, 10.0).n_perimeters, 4);
        assert!(Slicing::of_pieces(&Printer::sla(), 2.0).settings().is_empty());
    }
}
