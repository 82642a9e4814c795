//! Parameters of each stage, resolved once from the user's parameters and the wall thickness.

use shellock_assembly::LatticeDirection;
use shellock_assembly::play::{self, PlayParams};
use shellock_assembly::verify::VerifyParams;
use shellock_divide::segmentation::SegmentationParams;
use shellock_make::body::BodyParams;
use shellock_make::connector::ConnectorParams;
use shellock_make::piece::Relief;
use shellock_plan::PlanParams;
use shellock_plan::sizes::{CONTACT_SIZES, LEAST_CONTACT_SIZES, SizeParams};
use shellock_rate::strength::StrengthParams;
use shellock_report::PatchId;

use crate::params::{Params, Thickness};

/// Parameters of each stage. The stages do not change them. A kit whose key is cut overrides some of them,
/// see [`with_key`](Self::with_key).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// Parameters of the stress analysis of the wall.
    pub strength: StrengthParams,
    /// Parameters of the division into pieces.
    pub segmentation: SegmentationParams,
    /// Parameters of the choice of connector sizes.
    pub sizes: SizeParams,
    /// Parameters of the search for a plan.
    pub plan: PlanParams,
    /// Parameters of the wall and its split into shell bodies.
    pub body: BodyParams,
    /// Parameters of the connectors' shape and fit.
    pub connector: ConnectorParams,
    /// Parameters of the verification of finished pieces.
    pub verify: VerifyParams,
    /// Parameters of the measurement of play.
    pub play: PlayParams,
}

impl Settings {
    /// Resolves the settings for `params`. A thickness that is still to be found counts as 2 mm.
    pub fn resolve(params: &Params) -> Self {
        let thickness_mm = match params.thickness {
            Thickness::Mm(mm) => mm,
            Thickness::Auto => BodyParams::default().thickness_mm,
        };
        Self::with_thickness(params, thickness_mm)
    }

    /// Resolves the settings for a wall of this thickness, mm, whatever `params` say of it.
    pub fn with_thickness(params: &Params, thickness_mm: f64) -> Self {
        let Params {
            seed,
            seam_gap_mm,
            cell_mm,
            ..
        } = *params;
        let connector = params.connector.clone();
        let clearance_mm = connector.clearance_mm;
        let smallest_mm = connector.size.smallest_mm();
        let verify = VerifyParams {
            clearance_mm: clearance_mm.max(2.0 * seam_gap_mm),
            seed,
        };
        Self {
            strength: strength(params),
            segmentation: SegmentationParams {
                min_contact_mm: CONTACT_SIZES * smallest_mm,
                least_contact_mm: LEAST_CONTACT_SIZES * smallest_mm,
                wall_mm: thickness_mm,
                ..segmentation(params)
            },
            sizes: SizeParams {
                choice: connector.size,
                wall_mm: thickness_mm,
                clearance_mm,
                strength_mpa: params.material.strength_mpa,
            },
            plan: PlanParams {
                wall_mm: thickness_mm,
                clearance_mm,
                wall_gap_mm: 2.0 * seam_gap_mm,
                key_gap_mm: 2.0 * seam_gap_mm,
                ..plan(params)
            },
            body: BodyParams {
                thickness_mm,
                cell_mm,
                seam_gap_mm,
                ..BodyParams::default()
            },
            connector,
            verify,
            play: PlayParams {
                clearance_mm: verify.clearance_mm,
                slide_mm: play::SLIDE_MM,
                is_together: params.is_play_together,
                seed,
            },
        }
    }

    /// Returns these settings for pieces of which `key` was cut so that it leaves along `slide` alone.
    pub fn with_key(&self, key: PatchId, slide: LatticeDirection) -> Self {
        let key_gap_mm = self.body.seam_gap_mm.max(0.5 * self.connector.key_clearance_mm);
        Self {
            plan: PlanParams {
                key: Some(key),
                key_slide: Some(slide),
                key_gap_mm: 2.0 * key_gap_mm,
                ..self.plan.clone()
            },
            body: BodyParams {
                key_gap_mm: Some(key_gap_mm),
                ..self.body.clone()
            },
            ..self.clone()
        }
    }

    /// The key, if it is cut out of a piece; `None` if it is a piece as it is.
    pub fn cut_key(&self) -> Option<PatchId> {
        self.plan.key.filter(|_| self.plan.key_slide.is_some())
    }

    /// Returns the least gaps that finished pieces must keep: those of connectors or of walls, whichever are
    /// narrower.
    pub fn relief(&self) -> Relief {
        let gap_mm = self.connector.clearance_mm.min(2.0 * self.body.seam_gap_mm);
        let of_key = |side_mm: f64| self.connector.key_clearance_mm.min(2.0 * side_mm);
        Relief {
            gap_mm,
            key_gap_mm: self.body.key_gap_mm.map_or(gap_mm, of_key),
        }
    }
}

impl Params {
    /// Lists every problem of every stage, in words. Empty if the parameters are valid; values derived from
    /// others are not reported twice.
    pub fn problems(&self) -> Vec<String> {
        let settings = Settings::resolve(self);
        let label = self.label.map_or_else(Vec::new, |l| l.problems());
        let stages = [
            settings.body.problems(),
            settings.connector.problems(),
            settings.strength.problems(),
            label,
        ];
        let mut problems: Vec<String> = stages.into_iter().flatten().map(|p| p.to_string()).collect();
        problems.extend(segmentation(self).problems());
        problems.extend(plan(self).problems());
        problems
    }
}

/// Returns the user's parameters of the division, with defaults for the others.
fn segmentation(params: &Params) -> SegmentationParams {
    SegmentationParams {
        method: params.method,
        n_pieces: params.n_pieces,
        keep_whole: params.keep_whole.clone(),
        symmetric: params.symmetric,
        seed: params.seed,
        ..SegmentationParams::default()
    }
}

/// Returns the user's parameters of the plan, with defaults for the others.
fn plan(params: &Params) -> PlanParams {
    let Params {
        seed,
        up,
        proof_budget,
        ..
    } = *params;
    PlanParams {
        seed,
        up,
        proof_budget,
        ..PlanParams::default()
    }
}

/// Returns the fall that the wall must withstand, and the range of its thickness. The usual least is four
/// printed lines, two on either side of a seam's pin; where the model is thin, three in all. Filament walls
/// that no thickness makes strong enough have these four lines, too: slicers fill what is left between lines
/// with short strokes, which took a fifth of the print time of a cat's kit with walls of 2 mm.
fn strength(params: &Params) -> StrengthParams {
    const LEAST_WALLS: f64 = 4.0;
    const THIN_WALLS: f64 = 3.0;
    let usual = StrengthParams::default();
    let walls_mm = |n: f64| {
        (n * params.connector.min_wall_mm - (n - 1.0) * params.line_overlap_mm)
            .max(0.8)
            .max(2.0 * params.cell_mm.unwrap_or(0.0))
            .min(5.0)
    };
    let least_mm = walls_mm(LEAST_WALLS);
    StrengthParams {
        material: params.material,
        drop_m: params.drop_m,
        seed: params.seed,
        least_mm,
        thin_mm: walls_mm(THIN_WALLS),
        most_mm: usual.most_mm.max(least_mm),
        usual_mm: if params.line_overlap_mm > 0.0 {
            least_mm
        } else {
            usual.usual_mm
        },
        ..usual
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filament_walls_are_four_overlapping_lines_and_others_four_times_the_thinnest_wall() {
        let mut params = Params::default();
        params.connector.min_wall_mm = 0.45;
        let others = strength(&params);
        assert!((others.least_mm - 1.8).abs() < 1e-12 && (others.thin_mm - 1.35).abs() < 1e-12);
        assert!(others.usual_mm > others.least_mm);
        params.line_overlap_mm = 0.043;
        let filament = strength(&params);
        assert!((filament.least_mm - (1.8 - 3.0 * 0.043)).abs() < 1e-12);
        assert!((filament.thin_mm - (1.35 - 2.0 * 0.043)).abs() < 1e-12);
        assert_eq!(filament.usual_mm, filament.least_mm);
    }
}
