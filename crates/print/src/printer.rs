//! Printers: build volumes, clearances, tolerances and materials.

use shellock_mechanics::Material;
use shellock_report::ParamProblem;

/// Printing process, by the material that it hardens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Process {
    /// Stereolithography: resin, hardened layer by layer. Supports leave marks.
    Sla,
    /// Fused deposition: filament, laid in lines. Supports leave marks, and unstable pieces fall over.
    Fdm,
    /// Laser sintering: powder, fused layer by layer. Needs no supports.
    Sls,
}

impl Process {
    /// All processes by their common names.
    pub const ALL: [(&'static str, Self); 3] = [("sla", Self::Sla), ("fdm", Self::Fdm), ("sls", Self::Sls)];

    /// Returns the process called `name`, in upper or lower case.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL
            .iter()
            .find(|(n, _)| n.eq_ignore_ascii_case(name))
            .map(|(_, p)| *p)
    }
}

/// Speed of a filament printer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Prints outlines at 35 and 60 mm/s, as a Prusa MK3S does.
    Usual,
    /// Prints outlines at 200 and 300 mm/s and accelerates by 10 m/s².
    Fast,
}

/// Properties of a printer. Lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Printer {
    /// Short name, by which people choose it.
    pub name: String,
    /// Full name, with that of the maker.
    pub title: String,
    /// Process by which it prints.
    pub process: Process,
    /// Width, depth and height of the build volume. [10, 5000] each.
    pub bed_mm: [f64; 3],
    /// Gap between mating faces of connectors. [0.03, 0.6].
    pub clearance_mm: f64,
    /// Gap between mating faces on the rails of the key. [0.03, 0.8].
    pub key_clearance_mm: f64,
    /// Largest deviation of a printed face outwards; each side of a seam is set back by as much. [0, 0.4].
    pub tolerance_mm: f64,
    /// Thinnest wall that can be printed. [0.1, 2].
    pub min_wall_mm: f64,
    /// Height of a layer. [0.01, 1].
    pub layer_mm: f64,
    /// Material that it prints with.
    pub material: Material,
    /// Speed of a filament printer; `None` if it is not known.
    pub pace: Option<Pace>,
}

impl Printer {
    /// Returns a resin printer with a ten-inch display. Clearances follow others' prints, 0.05 to 0.15 a
    /// side.
    pub fn sla() -> Self {
        Self {
            name: "sla".into(),
            title: "Resin printer with a ten-inch display".into(),
            process: Process::Sla,
            bed_mm: [192.0, 120.0, 200.0],
            clearance_mm: 0.12,
            key_clearance_mm: 0.15,
            tolerance_mm: 0.05,
            min_wall_mm: 0.4,
            layer_mm: 0.05,
            material: Material::SLA_RESIN,
            pace: None,
        }
    }

    /// Returns a filament printer with a nozzle of 0.4 mm and PLA; clearances 0.15 to 0.25 a side.
    pub fn fdm() -> Self {
        Self {
            name: "fdm".into(),
            title: "Filament printer, nozzle of 0.4 mm".into(),
            process: Process::Fdm,
            bed_mm: [220.0, 220.0, 250.0],
            clearance_mm: 0.2,
            key_clearance_mm: 0.22,
            tolerance_mm: 0.1,
            min_wall_mm: 0.45,
            layer_mm: 0.2,
            material: Material::PLA,
            pace: None,
        }
    }

    /// Returns the filament printer with PETG, which oozes more: 0.25 to 0.35 a side.
    pub fn fdm_petg() -> Self {
        Self {
            name: "fdm-petg".into(),
            title: "Filament printer with PETG, nozzle of 0.4 mm".into(),
            clearance_mm: 0.3,
            key_clearance_mm: 0.32,
            tolerance_mm: 0.14,
            material: Material::PETG,
            ..Self::fdm()
        }
    }

    /// Returns a sintering printer with polyamide: about 0.25 a side.
    pub fn sls() -> Self {
        Self {
            name: "sls".into(),
            title: "Sintering printer".into(),
            process: Process::Sls,
            bed_mm: [165.0, 165.0, 300.0],
            clearance_mm: 0.25,
            key_clearance_mm: 0.28,
            tolerance_mm: 0.12,
            min_wall_mm: 0.6,
            layer_mm: 0.11,
            material: Material::PA12,
            pace: None,
        }
    }

    /// Overlap of neighbouring lines of a wall, mm; 0 for printers that lay no lines.
    ///
    /// Slicers take a line as a rectangle with round ends and lay lines so close that their area fills the
    /// layer: the overlap is (1 − π/4) of the layer's height (Slic3r manual, "Flow math").
    pub fn line_overlap_mm(&self) -> f64 {
        match self.process {
            Process::Fdm => (1.0 - std::f64::consts::FRAC_PI_4) * self.layer_mm,
            Process::Sla | Process::Sls => 0.0,
        }
    }

    /// Presets of widespread printers, one per process and material.
    pub fn presets() -> Vec<Self> {
        vec![Self::sla(), Self::fdm(), Self::fdm_petg(), Self::sls()]
    }

    /// Returns every property out of range.
    pub fn problems(&self) -> Vec<ParamProblem> {
        let side = |name, mm| ParamProblem::unless_within(name, "mm", mm, 10.0, 5000.0);
        let [width, depth, height] = self.bed_mm;
        let checks = [
            side("width of the bed", width),
            side("depth of the bed", depth),
            side("height of the printer", height),
            ParamProblem::unless_within("clearance of the printer", "mm", self.clearance_mm, 0.03, 0.6),
            ParamProblem::unless_within(
                "key clearance of the printer",
                "mm",
                self.key_clearance_mm,
                0.03,
                0.8,
            ),
            ParamProblem::unless_within("tolerance of the printer", "mm", self.tolerance_mm, 0.0, 0.4),
            ParamProblem::unless_within("minimum wall of the printer", "mm", self.min_wall_mm, 0.1, 2.0),
            ParamProblem::unless_within("layer of the printer", "mm", self.layer_mm, 0.01, 1.0),
        ];
        checks.into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_in_range_and_have_names_of_their_own() {
        let presets = Printer::presets();
        assert!(presets.iter().all(|p| p.problems().is_empty()));
        let names: std::collections::BTreeSet<&str> = presets.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names.len(), presets.len());
        let bad = Printer {
            bed_mm: [f64::NAN, 5.0, 1e9],
            layer_mm: 0.0,
            ..Printer::sla()
        };
        assert_eq!(bad.problems().len(), 4);
    }
}
