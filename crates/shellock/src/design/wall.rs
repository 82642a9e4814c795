//! The wall that a kit is made with: as thick as a fall asks for, or thicker for the sake of use.

use std::borrow::Cow;

use shellock_geom::Solid;

use super::strengthen::Thicker;
use super::ways::{Input, Way};
use super::{DesignError, Params, Settings, Thickness};
use crate::strength::{self, Strength, StrengthError};
use crate::{Cause, Ctx, Warning};

/// The wall's thickness in what stages are given, what it bears, and what to tell of it.
#[derive(Clone)]
pub(super) struct Wall {
    pub settings: Settings,
    pub strength: Option<Strength>,
    pub warnings: Vec<Warning>,
}

impl Wall {
    /// Whether it is thicker than a fall asks for, for the sake of use.
    pub fn is_thicker(&self) -> bool {
        let is_told = |w: &Warning| matches!(w.cause, Cause::WallForUse { .. });
        self.warnings.iter().any(is_told)
    }

    /// The same for pieces that are cut in a way; where a person would not cut, though that was asked, it is told.
    pub fn divided(&self, way: Way) -> Self {
        let mut wall = self.clone();
        let segmentation = &mut wall.settings.segmentation;
        let is_other = way.method != segmentation.method;
        (segmentation.method, segmentation.n_pieces) = (way.method, way.n_pieces);
        wall.warnings.extend(is_other.then(|| Warning {
            cause: Cause::DividedOtherwise,
            pieces: Vec::new(),
            at: None,
        }));
        wall
    }

    /// The same model with a wall as thin as is made, where that is ours to say: connectors have the most room.
    pub fn thin(
        &self,
        ctx: &Ctx,
        &Input { params, model, .. }: &Input<'_>,
    ) -> Result<Cow<'_, Self>, DesignError> {
        let thin_mm = self.settings.strength.thin_mm;
        if params.thickness != Thickness::Auto || self.settings.body.thickness_mm <= thin_mm {
            return Ok(Cow::Borrowed(self));
        }
        let thickness = Thickness::Mm(thin_mm);
        let params = Params {
            thickness,
            ..params.clone()
        };
        let mut wall = Self::decide(ctx, &params, model)?;
        let told = wall
            .strength
            .as_ref()
            .map(|s| s.told_thinner(&wall.settings.strength));
        wall.warnings.extend(told.flatten());
        Ok(Cow::Owned(wall))
    }

    /// The same model with a thicker wall, for the sake of what people do to the kit.
    pub fn thicker(
        &self,
        ctx: &Ctx,
        &Input { params, model, .. }: &Input<'_>,
        thicker: &Thicker,
    ) -> Result<Self, DesignError> {
        let thickness = Thickness::Mm(thicker.thickness_mm);
        let mut wall = Self::decide(
            ctx,
            &Params {
                thickness,
                ..params.clone()
            },
            model,
        )?;
        let way = &self.settings.segmentation;
        (
            wall.settings.segmentation.method,
            wall.settings.segmentation.n_pieces,
        ) = (way.method, way.n_pieces);
        wall.settings.strength.most_mm = self.settings.strength.most_mm;
        let is_other = |w: &&Warning| matches!(w.cause, Cause::DividedOtherwise);
        wall.warnings.extend(self.warnings.iter().find(is_other).cloned());
        // The thinnest wall of those before stays the one that a fall asks for.
        let is_told = |w: &&Warning| matches!(w.cause, Cause::WallForUse { .. });
        let from_mm = match self.warnings.iter().find(is_told).map(|w| &w.cause) {
            Some(Cause::WallForUse { from_mm, .. }) => *from_mm,
            _ => self.settings.body.thickness_mm,
        };
        wall.warnings.push(thicker.warning(from_mm));
        Ok(wall)
    }

    pub fn decide(ctx: &Ctx, params: &Params, model: &Solid) -> Result<Self, DesignError> {
        let nominal = Settings::resolve(params);
        if !params.allows_thin {
            let thinnest_mm = match params.thickness {
                Thickness::Mm(mm) => mm,
                Thickness::Auto => nominal.strength.thin_mm,
            };
            strength::is_hollow(model, thinnest_mm)?;
            strength::has_room(model, thinnest_mm)?;
        }
        let ctx = &ctx.fork();
        let found = match params.thickness {
            Thickness::Mm(mm) => strength::stress(ctx, &nominal.strength, model, mm),
            Thickness::Auto => strength::thickness(ctx, &nominal.strength, model),
        };
        match found {
            Ok(strength) => {
                if !params.allows_thin {
                    strength::is_hollow(model, strength.thickness_mm)?;
                }
                let mut settings = Settings::with_thickness(params, strength.thickness_mm);
                settings.strength.most_mm = strength.most_mm;
                let mut warnings = strength.warnings(&nominal.strength);
                let is_ours = params.thickness == Thickness::Auto;
                warnings.extend(
                    is_ours
                        .then(|| strength.told_thinner(&nominal.strength))
                        .flatten(),
                );
                Ok(Self {
                    settings,
                    strength: Some(strength),
                    warnings,
                })
            }
            Err(StrengthError::Shell(e)) => {
                let warning = Warning {
                    cause: Cause::StrengthUnknown {
                        error: e.to_string(),
                        thickness_mm: nominal.body.thickness_mm,
                    },
                    pieces: Vec::new(),
                    at: None,
                };
                Ok(Self {
                    settings: nominal,
                    strength: None,
                    warnings: vec![warning],
                })
            }
            Err(e) => Err(e.into()),
        }
    }
}
