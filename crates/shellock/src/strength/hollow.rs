//! How much of a model can be hollow, before anything is made of it.

use rayon::prelude::*;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Solid, TriMesh};

use super::thin::LEAST_SHARE;
use crate::verify::sample::{Sample, on_surface};

/// Points of the surface that are looked at: shares are known to 2 % (two sigma at one half).
const N_SAMPLES: usize = 3000;
const SEED: u64 = 0x686f_6c6c;
/// Walls that are tried at each point: from the thinnest on, each thicker by this factor.
const THINNEST_MM: f64 = 0.2;
const STEP: f64 = 1.1;
const N_STEPS: i32 = 60;
/// Where less of the surface has a cavity below, there is nothing to hollow out.
const LEAST_HOLLOW: f64 = 1.0 / 3.0;
/// What is proposed leaves this share hollow, at least.
const PROPOSED_HOLLOW: f64 = 0.5;

/// A model that is too thin for walls so thick.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "only {:.0} % of the surface has room for a cavity behind walls of {wall_mm:.2} mm: the model is too thin to be hollow; make it about {size_mm:.0} mm large (--size) or its walls {better_mm:.2} mm thin (--thickness) at most, or print it as it is (--allow-thin makes pieces all the same)",
    100.0 * share
)]
pub struct TooThin {
    /// Of the surface, below which there would be a cavity, in [0, 1].
    pub share: f64,
    /// The walls, mm.
    pub wall_mm: f64,
    /// The longest edge at which half of the surface has a cavity below, mm.
    pub size_mm: f64,
    /// Walls with which it has as the model is, mm.
    pub better_mm: f64,
}

/// Whether at least a third of the surface has a cavity below walls of `wall_mm`, and what would do where it
/// has not. Takes a tenth of a second.
pub fn is_hollow(model: &Solid, wall_mm: f64) -> Result<(), TooThin> {
    let mesh = model.mesh();
    let mut thickest_mm = thickest_walls(mesh);
    if thickest_mm.is_empty() {
        return Ok(());
    }
    let n = thickest_mm.len() as f64;
    let share = thickest_mm.iter().filter(|mm| **mm >= wall_mm).count() as f64 / n;
    if share >= LEAST_HOLLOW {
        return Ok(());
    }
    thickest_mm.sort_by(|a, b| b.total_cmp(a));
    let better_mm = thickest_mm[(PROPOSED_HOLLOW * n) as usize].max(THINNEST_MM);
    Err(TooThin {
        share,
        wall_mm,
        // Walls are tried in steps.
        size_mm: mesh.bounds().size().max_element() * STEP * wall_mm / better_mm,
        better_mm,
    })
}

/// At points all over the surface: the thickest wall with a cavity below, mm.
fn thickest_walls(mesh: &TriMesh) -> Vec<f64> {
    let bvh = TriangleBvh::new(mesh);
    let thickest = |s: &Sample| {
        let is_free = |mm: f64| {
            let below = s.point - mm * s.normal;
            bvh.nearest(below, (LEAST_SHARE * mm).powi(2)).is_none()
        };
        let walls = (0..N_STEPS).map(|k| THINNEST_MM * STEP.powi(k));
        walls.take_while(|mm| is_free(*mm)).last().unwrap_or(0.0)
    };
    on_surface(mesh, N_SAMPLES, SEED)
        .par_iter()
        .map(thickest)
        .collect()
}

#[cfg(test)]
mod tests {
    use shellock_testkit::shapes::brick;

    use super::*;

    fn plate(thick_mm: f64) -> Solid {
        Solid::new(brick([0.0, 100.0], [0.0, 80.0], [0.0, thick_mm]).to_mesh()).unwrap()
    }

    #[test]
    fn a_plate_is_hollow_where_it_is_thicker_than_two_walls() {
        assert_eq!(is_hollow(&plate(6.0), 2.0), Ok(()));
        let thin = is_hollow(&plate(3.0), 2.0).unwrap_err();
        assert!(thin.share < 0.1, "{thin}");
        // Half of 3 mm is left to each of its walls, and less for what is between.
        assert!((1.2..1.6).contains(&thin.better_mm), "{thin}");
        assert!((135.0..185.0).contains(&thin.size_mm), "{thin}");
    }

    #[test]
    fn what_is_proposed_will_do() {
        let thin = is_hollow(&plate(3.0), 2.0).unwrap_err();
        assert_eq!(is_hollow(&plate(3.0), thin.better_mm), Ok(()));
        let mut larger = plate(3.0).into_mesh();
        larger.points.iter_mut().for_each(|p| *p *= thin.size_mm / 100.0);
        assert_eq!(is_hollow(&Solid::new(larger).unwrap(), 2.0), Ok(()));
    }
}
