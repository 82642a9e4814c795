//! Decision on the wall of a model, given or sought.

use shellock_geom::Solid;
use shellock_mechanics::ShellError;
use shellock_report::Ctx;

use super::{Cavity, Strength, StrengthError, StrengthParams, stress, thickness};

/// Computes the stress of a wall of `given_mm`, or seeks the least thickness that withstands a fall. Returns
/// the error of the analysis where the equations cannot be solved: a kit can be made all the same.
///
/// # Errors
/// Fails if the model is too thin to be hollow or has no room for connectors, unless `allows_thin`; if it has
/// almost no cavity at all; and if the user stops.
pub fn decide(
    ctx: &Ctx<'_>,
    params: &StrengthParams,
    model: &Solid,
    cavity: &Cavity,
    given_mm: Option<f64>,
    allows_thin: bool,
) -> Result<Result<Strength, ShellError>, StrengthError> {
    if !allows_thin {
        let thinnest_mm = given_mm.unwrap_or(params.thin_mm);
        cavity.is_hollow(model, thinnest_mm)?;
        cavity.has_room(model, thinnest_mm)?;
    }
    let found = match given_mm {
        Some(mm) => stress(ctx, params, model, mm),
        None => thickness(ctx, params, model),
    };
    match found {
        Ok(strength) => {
            if !allows_thin {
                cavity.is_hollow(model, strength.thickness_mm)?;
            }
            Ok(Ok(strength))
        }
        Err(StrengthError::Shell(e)) => Ok(Err(e)),
        Err(e) => Err(e),
    }
}
