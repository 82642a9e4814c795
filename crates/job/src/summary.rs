//! Figures of a finished kit, for people and machines.

use shellock::design::Design;

/// Figures of a kit, for people and machines.
pub struct Summary {
    /// Volume of all pieces over the volume of the solid model.
    pub volume_ratio: f64,
    /// Mass of the pieces without supports, g.
    pub grams: f64,
    /// Length of connectors made over the length that the seams' geometry allows, in [0, 1].
    pub connector_share: f64,
    /// Largest share of a piece's volume that is thinner than the thinnest printable wall, in [0, 1].
    pub thin_share: f64,
}

/// Range of the sizes of connectors that were made, mm, as in "2.5" or "2.0–3.4".
pub fn connector_sizes(design: &Design) -> String {
    if design.kit.sizes.pairs().next().is_none() {
        return design.kit.sizes.default_mm().to_string();
    }
    let made = design
        .kit
        .joints
        .iter()
        .map(|j| [design.kit.sizes.of(j.male, j.female); 2]);
    let ends = made
        .reduce(|x, y| [x[0].min(y[0]), x[1].max(y[1])])
        .unwrap_or([design.kit.sizes.default_mm(); 2]);
    let [least, most] = ends.map(|d| format!("{d:.1}"));
    if least == most {
        most
    } else {
        format!("{least}–{most}")
    }
}
