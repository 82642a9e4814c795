//! Values of options: words, sizes and materials, each with the rule that reads it from a text.

use std::fmt::Display;
use std::str::FromStr;

use shellock::design::WallChoice;
use shellock::piece::LabelParams;
use shellock::segmentation::Method;
use shellock::sizes::SizeChoice;
use shellock_geom::repair::InsideOut;
use shellock_mechanics::Material;
use shellock_print::booklet::Paper;

use super::units;
use crate::names::no_such;

/// Words of a choice, each with its help, which may be empty.
pub type Words = Vec<(&'static str, &'static str)>;

/// A value that is one of a few, each with a word of its own.
pub trait Word: Sized + Copy + 'static {
    /// Lists all values, each with its word and help.
    fn all() -> Vec<(Self, &'static str, &'static str)>;

    /// Lists the words of all values, each with its help.
    fn words() -> Words {
        Self::all()
            .into_iter()
            .map(|(_, word, help)| (word, help))
            .collect()
    }
}

/// Reads a value from its word.
pub fn word<T: Word>(text: &str) -> Result<T, String> {
    let all = T::all();
    let found = all.iter().find(|(_, word, _)| *word == text);
    found.map(|(value, ..)| *value).ok_or_else(|| {
        let words: Vec<&str> = all.iter().map(|(_, word, _)| *word).collect();
        format!("choose one of {}", words.join(", "))
    })
}

/// Reads a plain number.
pub fn number<T: FromStr<Err: Display>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|e: T::Err| e.to_string())
}

/// An axis of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The first axis of the file.
    X,
    /// The second axis of the file.
    Y,
    /// The third axis of the file.
    Z,
}

impl Axis {
    /// Index of the axis: 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Returns the axis whose unit vector is `along`, or `None` if there is none.
    pub fn of(along: [f64; 3]) -> Option<Self> {
        [Self::X, Self::Y, Self::Z]
            .into_iter()
            .find(|a| a.unit() == along)
    }

    /// Unit vector along the axis.
    pub fn unit(self) -> [f64; 3] {
        std::array::from_fn(|axis| f64::from(u8::from(axis == self.index())))
    }
}

impl Word for Axis {
    fn all() -> Vec<(Self, &'static str, &'static str)> {
        vec![(Self::X, "x", ""), (Self::Y, "y", ""), (Self::Z, "z", "")]
    }
}

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// A thousandth of a millimetre.
    Micron,
    /// A millimetre, the unit of printers.
    Mm,
    /// A centimetre, 10 mm long.
    Cm,
    /// An inch, 25.4 mm long.
    Inch,
    /// A foot, 304.8 mm long.
    Foot,
    /// A metre, 1000 mm long.
    M,
}

impl Unit {
    /// Length of one unit, mm.
    pub fn mm(self) -> f64 {
        match self {
            Self::Micron => 1e-3,
            Self::Mm => 1.0,
            Self::Cm => 10.0,
            Self::Inch => 25.4,
            Self::Foot => 304.8,
            Self::M => 1000.0,
        }
    }
}

impl Word for Unit {
    fn all() -> Vec<(Self, &'static str, &'static str)> {
        vec![
            (Self::Micron, "micron", ""),
            (Self::Mm, "mm", ""),
            (Self::Cm, "cm", ""),
            (Self::Inch, "inch", ""),
            (Self::Foot, "foot", ""),
            (Self::M, "m", ""),
        ]
    }
}

/// Paper size of the booklet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PaperSize {
    /// Sheets of 210 × 297 mm.
    A4,
    /// Sheets of 8.5 × 11 inches.
    Letter,
}

impl From<PaperSize> for Paper {
    fn from(size: PaperSize) -> Self {
        match size {
            PaperSize::A4 => Self::A4,
            PaperSize::Letter => Self::Letter,
        }
    }
}

impl Word for PaperSize {
    fn all() -> Vec<(Self, &'static str, &'static str)> {
        vec![(Self::A4, "a4", ""), (Self::Letter, "letter", "")]
    }
}

/// Meaning of a body that is inside out and overlaps another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InsideOutMeans {
    /// Nobody knows: the model is refused.
    Ask,
    /// A hole in the body that it overlaps.
    Cut,
    /// A part of the model, united with the body that it overlaps.
    Unite,
}

impl InsideOutMeans {
    /// Returns the library's value for this choice.
    pub fn value(self) -> InsideOut {
        match self {
            Self::Ask => InsideOut::Ask,
            Self::Cut => InsideOut::Cut,
            Self::Unite => InsideOut::Unite,
        }
    }
}

impl Word for InsideOutMeans {
    fn all() -> Vec<(Self, &'static str, &'static str)> {
        vec![
            (Self::Ask, "ask", "Unknown: the model is refused"),
            (Self::Cut, "cut", "A hole in the body that it overlaps"),
            (
                Self::Unite,
                "unite",
                "A part of the model, united with the body that it overlaps",
            ),
        ]
    }
}

/// Data of a file that are taken as labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LabelsFrom {
    /// Labels of faces, or paint of a slicer.
    Auto,
    /// A property of the faces.
    Labels,
    /// Paint of a slicer.
    Paint,
    /// Colours of faces or of points.
    Colors,
    /// Materials of the file.
    Materials,
    /// Groups of faces of the file.
    Groups,
    /// Named sets of triangles.
    Sets,
    /// Objects, solids or nodes.
    Objects,
    /// No data: pieces are found automatically.
    None,
}

impl Word for LabelsFrom {
    fn all() -> Vec<(Self, &'static str, &'static str)> {
        vec![
            (Self::Auto, "auto", "Labels of faces, or paint of a slicer"),
            (Self::Labels, "labels", "A property of the faces (PLY)"),
            (Self::Paint, "paint", "Multi-material paint of a slicer (3MF)"),
            (
                Self::Colors,
                "colors",
                "Colours of faces (STL, PLY, OFF, 3MF) or of points (PLY, OBJ, OFF, glTF)",
            ),
            (Self::Materials, "materials", "Materials (OBJ, 3MF, glTF)"),
            (Self::Groups, "groups", "Groups of faces (OBJ)"),
            (Self::Sets, "sets", "Named sets of triangles (3MF)"),
            (Self::Objects, "objects", "Objects, solids or nodes"),
            (Self::None, "none", "Nothing: pieces are found automatically"),
        ]
    }
}

impl Word for Method {
    fn all() -> Vec<(Self, &'static str, &'static str)> {
        Self::ALL.map(|method| (method, method.name(), "")).to_vec()
    }
}

/// A choice between on and off.
impl Word for bool {
    fn all() -> Vec<(Self, &'static str, &'static str)> {
        vec![(true, "on", ""), (false, "off", "")]
    }
}

impl Word for WallChoice {
    fn all() -> Vec<(Self, &'static str, &'static str)> {
        vec![
            (Self::Light, "light", ""),
            (Self::Standard, "standard", ""),
            (Self::Sturdy, "sturdy", ""),
        ]
    }
}

/// Wall thickness: chosen automatically, or given in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Thickness {
    /// The least thickness that bears a fall.
    Auto,
    /// A thickness in mm.
    Mm(f64),
}

impl FromStr for Thickness {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.eq_ignore_ascii_case("auto") {
            return Ok(Self::Auto);
        }
        units::length_mm(text)
            .map(Self::Mm)
            .map_err(|_| "give millimetres, such as 2.4, or auto".to_owned())
    }
}

/// Parses the size of all connectors: a length, or `auto`.
pub fn connector_size(text: &str) -> Result<SizeChoice, String> {
    let length = |_| units::length_mm(text).map(SizeChoice::Fixed);
    let size = text.to_ascii_lowercase().parse().or_else(length);
    size.map_err(|_: String| "give millimetres, such as 2.5, or auto".to_owned())
}

/// Finds the material preset of that name, in any case.
pub fn material(name: &str) -> Result<Material, String> {
    let found = Material::PRESETS
        .into_iter()
        .find(|(preset, _)| preset.eq_ignore_ascii_case(name))
        .map(|(_, material)| material);
    found.ok_or_else(|| no_such("material", name, &Material::PRESETS.map(|(preset, _)| preset)))
}

/// Parameters for engraved numbers: strokes two lines wide, and a wall behind them that the printer can make.
pub(super) fn label(min_wall_mm: f64) -> LabelParams {
    let usual = LabelParams::default();
    let two_lines_mm = 2.0 * min_wall_mm;
    // A wrong wall is reported as a wrong wall, not as a wrong stroke.
    let within = |usual: f64, most: f64| {
        if two_lines_mm.is_finite() {
            usual.max(two_lines_mm).min(most)
        } else {
            usual
        }
    };
    LabelParams {
        stroke_mm: within(usual.stroke_mm, 2.0),
        least_wall_mm: within(usual.least_wall_mm, 5.0),
        ..usual
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connectors_have_a_length_or_a_size_by_stress() {
        for (text, mm) in [("4", 4.0), ("4mm", 4.0), ("0.3 cm", 3.0)] {
            assert_eq!(connector_size(text), Ok(SizeChoice::Fixed(mm)), "{text}");
        }
        assert!(matches!(connector_size("Auto"), Ok(SizeChoice::Auto(_))));
        assert!(connector_size("large").is_err_and(|why| why.contains("2.5, or auto")));
    }

    #[test]
    fn materials_have_names() {
        assert!(material("pla").is_ok() && material("wood").is_err());
    }
}
