//! Accessors that check the file's parts against each other before others work with them.

use std::ops::RangeInclusive;

use shellock::ConnectorSizes;
use shellock_assembly::{Direction, InstallationPlan, InstallationStep, PressFit};
use shellock_geom::Vec3;
use shellock_report::PatchId;

use super::{PlanFile, PlanFileError};

/// Range of connector sizes D that pairs can have, mm.
const SIZES_MM: RangeInclusive<f64> = 0.1..=20.0;
/// Tolerance on the squared length of a unit vector: some files have been rounded by hand.
const UNIT_SLACK: f64 = 0.01;

fn wrong(what: String) -> PlanFileError {
    PlanFileError::Contradiction(what)
}

fn no_direction(piece: PatchId) -> PlanFileError {
    wrong(format!(
        "the installation_direction of piece {piece} is not a unit vector"
    ))
}

impl PlanFile {
    /// Returns the order and the directions.
    ///
    /// Errors if a piece is not at the index of its id, if a direction is no unit vector, or if the order
    /// does not name every piece exactly once.
    pub fn order(&self) -> Result<InstallationPlan, PlanFileError> {
        let mut directions = Vec::new();
        for (i, piece) in self.pieces.iter().enumerate() {
            let number = i + 1;
            if usize::from(piece.id) != i {
                return Err(wrong(format!(
                    "the piece at position {number} does not have the id {number}"
                )));
            }
            let out = Direction::of(-Vec3::from(piece.installation_direction));
            directions.push(out.ok_or_else(|| no_direction(piece.id))?);
        }
        let mut is_named = vec![false; directions.len()];
        let mut steps = Vec::new();
        for &piece in &self.installation_order {
            let Some(is_named) = is_named.get_mut(usize::from(piece)) else {
                return Err(wrong(format!(
                    "the installation order names {piece}, which is not a piece"
                )));
            };
            if std::mem::replace(is_named, true) {
                return Err(wrong(format!("the installation order names piece {piece} twice")));
            }
            steps.push(InstallationStep {
                piece,
                separation: directions[usize::from(piece)],
            });
        }
        match is_named.iter().position(|is_named| !is_named) {
            Some(place) => Err(wrong(format!(
                "the installation order leaves out piece {}",
                PatchId::from(place)
            ))),
            None => Ok(InstallationPlan { steps }),
        }
    }

    /// Returns an error unless the direction of every piece is a unit vector.
    pub fn check_directions(&self) -> Result<(), PlanFileError> {
        let is_unit = |d: [f64; 3]| (Vec3::from(d).length_squared() - 1.0).abs() <= UNIT_SLACK;
        match self.pieces.iter().find(|p| !is_unit(p.installation_direction)) {
            Some(piece) => Err(no_direction(piece.id)),
            None => Ok(()),
        }
    }

    /// Returns an error unless the clearance is within 0 to 1 mm. Everything would touch at larger ones.
    pub fn check_clearance(&self) -> Result<(), PlanFileError> {
        const MOST_MM: f64 = 1.0;
        if (0.0..=MOST_MM).contains(&self.clearance) {
            return Ok(());
        }
        Err(wrong(format!(
            "a clearance of {} mm is not possible; it must be 0 to {MOST_MM} mm",
            self.clearance
        )))
    }

    /// Returns the press fits of the key.
    ///
    /// Errors if the interference of one is negative or larger than any that is made.
    pub fn checked_press_fits(&self) -> Result<&[PressFit], PlanFileError> {
        let range_mm = 0.0..=PressFit::MOST_INTERFERENCE_MM;
        match self
            .press_fits
            .iter()
            .find(|fit| !range_mm.contains(&fit.interference_mm))
        {
            Some(fit) => Err(wrong(format!(
                "a press fit of {} mm is not possible; it must be at most {} mm",
                fit.interference_mm,
                PressFit::MOST_INTERFERENCE_MM
            ))),
            None => Ok(&self.press_fits),
        }
    }

    /// Returns the wall thickness, mm; an error if the file lacks it.
    pub fn thickness_mm(&self) -> Result<f64, PlanFileError> {
        self.shell_thickness
            .ok_or_else(|| PlanFileError::missing_field("shell_thickness"))
    }

    /// Returns the connector sizes: one for all pairs, or those of each pair.
    ///
    /// Errors if the sizes are missing, empty, out of range, or name a piece that does not exist.
    pub fn sizes(&self) -> Result<ConnectorSizes, PlanFileError> {
        let default_mm = self
            .connector_size
            .ok_or_else(|| PlanFileError::missing_field("connector_size"))?;
        let Some(sizes) = &self.connector_sizes else {
            return Ok(ConnectorSizes::uniform(default_mm));
        };
        if sizes.is_empty() {
            return Err(wrong(
                "\"connector_sizes\" is empty; leave it out if all seams have the same size".into(),
            ));
        }
        for size in sizes {
            let [a, b] = size.pieces;
            if !SIZES_MM.contains(&size.size_mm) {
                return Err(wrong(format!(
                    "\"connector_sizes\" says {} mm between pieces {a} and {b}; 0.1 to 20 mm can be made",
                    size.size_mm
                )));
            }
            if size.pieces.iter().any(|p| usize::from(*p) >= self.pieces.len()) {
                return Err(wrong(format!(
                    "\"connector_sizes\" names pieces {a} and {b}, which are not both there"
                )));
            }
        }
        let pairs = sizes.iter().map(|size| (size.pieces, size.size_mm));
        Ok(ConnectorSizes::with_pairs(default_mm, pairs))
    }
}
