//! The wall of a kit: as thick as a fall asks for, thicker for the sake of use, or as thin as walls are made.

use std::sync::Arc;

use super::causes::Cause;
use super::ways::{Input, Way};
use super::{DesignError, Params, Settings, Thickness, WallChoice};
use crate::strength::{self, Cavity, Strength, StrengthError};
use crate::{Ctx, Warning};

/// Thickness of the wall in the stages' settings, and the facts that led to it.
#[derive(Clone)]
pub(super) struct Wall {
    pub settings: Settings,
    pub strength: Option<Strength>,
    /// Error of the stress analysis, if it could not be done.
    pub error: Option<String>,
    /// Estimates of the model's cavity.
    pub cavity: Arc<Cavity>,
    /// Thickness of a wall of each kind before it is made thicker for the sake of use, if it is ours to
    /// choose.
    pub choices: Option<WallChoices>,
    /// True if the thickness is ours to choose.
    is_free: bool,
    /// True if the model is not divided by the method that was asked for.
    is_divided_otherwise: bool,
    /// Thickness that a fall asks for, and the reason for a thicker wall.
    thicker: Option<(f64, Thicker)>,
}

/// Thickness of a wall of each kind, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallChoices {
    /// The kind that the user wants.
    pub wanted: WallChoice,
    /// As thin as seams allow.
    pub light_mm: f64,
    /// The thinnest that survives a fall.
    pub standard_mm: f64,
    /// At least half as thick again as a light one.
    pub sturdy_mm: f64,
}

impl WallChoices {
    /// Ratio of the least sturdy wall to a light one.
    const STURDY: f64 = 1.5;

    /// Walls of a model. The thinnest that survives a fall has `standard_mm`; the usual thinnest wall has
    /// `least_mm`, and there is room for `most_mm`.
    fn of(wanted: WallChoice, standard_mm: f64, most_mm: f64, least_mm: f64) -> Self {
        // A model with little room has thinner walls than usual.
        let light_mm = least_mm.min(standard_mm);
        let sturdy_mm = (Self::STURDY * light_mm).min(most_mm).max(standard_mm);
        Self {
            wanted,
            light_mm,
            standard_mm,
            sturdy_mm,
        }
    }

    /// Thickness of the wall that the user wants, mm.
    fn wanted_mm(&self) -> f64 {
        match self.wanted {
            WallChoice::Light => self.light_mm,
            WallChoice::Standard => self.standard_mm,
            WallChoice::Sturdy => self.sturdy_mm,
        }
    }
}

/// Wall that is thicker for the sake of a use.
#[derive(Clone, Debug)]
pub(super) struct Thicker {
    pub thickness_mm: f64,
    /// The use that asks for it, as in "pressed on its top".
    pub load: String,
}

impl Wall {
    /// A wall as thick as `params` say, without an analysis of its stress.
    pub fn nominal(params: &Params) -> Self {
        Self {
            settings: Settings::resolve(params),
            strength: None,
            error: None,
            cavity: Arc::default(),
            choices: None,
            is_free: params.thickness == Thickness::Auto,
            is_divided_otherwise: false,
            thicker: None,
        }
    }

    /// Decides the thickness by the stress in a fall. Fails if the model is too thin for hollow pieces and
    /// connectors, unless the user allows that.
    pub fn decide(ctx: &Ctx, input: &Input<'_>) -> Result<Self, DesignError> {
        Self::nominal(input.params).with_strength(ctx, input)
    }

    /// Decides the thickness of this nominal wall.
    fn with_strength(self, ctx: &Ctx, &Input { params, model, .. }: &Input<'_>) -> Result<Self, DesignError> {
        let given_mm = match params.thickness {
            Thickness::Mm(mm) => Some(mm),
            Thickness::Auto => None,
        };
        let (limits, cavity) = (&self.settings.strength, &self.cavity);
        let decide = |mm| strength::decide(&ctx.fork(), limits, model, cavity, mm, params.allows_thin);
        let mut decided = decide(given_mm)?;
        let mut choices = self.choices;
        if let (Ok(thinnest), None) = (&decided, given_mm) {
            let found = WallChoices::of(
                params.wall,
                thinnest.thickness_mm,
                thinnest.most_mm,
                limits.least_mm,
            );
            let (mm, most_mm) = (found.wanted_mm(), thinnest.most_mm);
            let no_wall_bears = thinnest.no_wall_bears;
            choices = Some(found);
            if mm != thinnest.thickness_mm {
                decided = decide(Some(mm))?.map(|chosen| Strength {
                    most_mm,
                    no_wall_bears,
                    ..chosen
                });
            }
        }
        Ok(match decided {
            Ok(strength) => {
                let mut settings = Settings::with_thickness(params, strength.thickness_mm);
                settings.strength.most_mm = strength.most_mm;
                Self {
                    settings,
                    strength: Some(strength),
                    choices,
                    ..self
                }
            }
            Err(error) => Self {
                error: Some(StrengthError::from(error).to_string()),
                ..self
            },
        })
    }

    /// This wall for pieces that are cut in another way.
    pub fn with_way(&self, way: Way) -> Self {
        let mut wall = self.clone();
        let segmentation = &mut wall.settings.segmentation;
        wall.is_divided_otherwise |= way.method != segmentation.method;
        (segmentation.method, segmentation.n_pieces) = (way.method, way.n_pieces);
        wall
    }

    /// A wall of the same model as thin as walls are made, if the thickness is ours to choose.
    pub fn thin(&self, ctx: &Ctx, input: &Input<'_>) -> Result<Self, DesignError> {
        let thin_mm = self.settings.strength.thin_mm;
        if !self.is_free || self.settings.body.thickness_mm <= thin_mm {
            return Ok(self.clone());
        }
        self.with_thickness(ctx, input, thin_mm)
    }

    /// A thicker wall of the same model and the same division.
    pub fn thicken(&self, ctx: &Ctx, input: &Input<'_>, thicker: Thicker) -> Result<Self, DesignError> {
        let mut wall = self.with_thickness(ctx, input, thicker.thickness_mm)?;
        let way = &self.settings.segmentation;
        let segmentation = &mut wall.settings.segmentation;
        (segmentation.method, segmentation.n_pieces) = (way.method, way.n_pieces);
        wall.settings.strength.most_mm = self.settings.strength.most_mm;
        wall.is_divided_otherwise = self.is_divided_otherwise;
        // The thinnest wall so far remains the one that a fall asks for.
        let from_mm = self
            .thicker
            .as_ref()
            .map_or(self.settings.body.thickness_mm, |t| t.0);
        wall.thicker = Some((from_mm, thicker));
        Ok(wall)
    }

    fn with_thickness(&self, ctx: &Ctx, input: &Input<'_>, mm: f64) -> Result<Self, DesignError> {
        let mut params = input.params.clone();
        params.thickness = Thickness::Mm(mm);
        let params = &params;
        let nominal = Self {
            is_free: self.is_free,
            cavity: self.cavity.clone(),
            choices: self.choices,
            ..Self::nominal(params)
        };
        nominal.with_strength(ctx, &Input { params, ..*input })
    }

    /// Warnings that follow from the facts.
    pub fn warnings(&self) -> Vec<Warning> {
        let params = &self.settings.strength;
        let strength = self.strength.as_ref();
        let is_thin = self.is_free && self.thicker.is_none();
        let thinner = strength.filter(|_| is_thin).and_then(|s| s.told_thinner(params));
        let thickness_mm = self.settings.body.thickness_mm;
        let unknown = |error| Cause::StrengthUnknown { error, thickness_mm };
        let thicker = |(from_mm, thicker): (f64, Thicker)| Cause::WallForUse {
            from_mm,
            to_mm: thicker.thickness_mm,
            load: thicker.load,
        };
        let of_choice = [
            self.error.clone().map(unknown),
            self.is_divided_otherwise.then_some(Cause::DividedOtherwise),
            self.thicker.clone().map(thicker),
        ];
        let of_choice = of_choice.into_iter().flatten();
        let of_strength = strength
            .into_iter()
            .flat_map(|s| s.warnings(params))
            .chain(thinner);
        of_strength
            .chain(of_choice.map(|cause| Warning::new(cause, Vec::new(), None)))
            .collect()
    }
}

impl Thicker {
    /// Describes the change for people.
    pub fn words(&self) -> String {
        format!(
            "it would give way where it is {}: walls of {:.1} mm",
            self.load, self.thickness_mm
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_wall_is_the_thinnest_and_a_sturdy_one_the_thickest_that_has_room() {
        for [standard_mm, most_mm] in [[1.6, 6.0], [2.0, 6.0], [3.4, 6.0], [1.6, 2.0], [1.1, 1.1]] {
            let walls = WallChoices::of(WallChoice::Sturdy, standard_mm, most_mm, 1.6);
            assert!(walls.light_mm <= walls.standard_mm && walls.standard_mm <= walls.sturdy_mm);
            assert!(walls.light_mm <= 1.6 && walls.sturdy_mm <= most_mm.max(standard_mm));
            let half_again_mm = 1.5 * walls.light_mm;
            assert!(walls.sturdy_mm >= half_again_mm.min(most_mm) - 1e-9, "{walls:?}");
            assert_eq!(walls.wanted_mm(), walls.sturdy_mm);
        }
    }
}
