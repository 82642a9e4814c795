//! Estimates of how much of a model can be hollow, before anything is made of it.

use std::sync::OnceLock;

use rayon::prelude::*;
use shellock_assembly::verify::sample::{Sample, on_surface};
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::{Solid, TriMesh};

use super::ROOM_MM;
use super::thin::LEAST_SHARE;

/// Number of sampled points of the surface: shares are known to 2 % (two sigma at one half).
const N_SAMPLES: usize = 3000;
const SEED: u64 = 0x686f_6c6c;
/// Walls tried at each point: the thinnest, mm, the factor from one to the next, and their number.
const THINNEST_MM: f64 = 0.2;
const STEP: f64 = 1.1;
const N_STEPS: i32 = 60;
/// Least share of the surface with a cavity below for hollowing out to make sense.
const LEAST_HOLLOW: f64 = 1.0 / 3.0;
/// Least hollow share that a proposal leaves.
const PROPOSED_HOLLOW: f64 = 0.5;

/// Least share of the surface with room for a connector behind the thinnest wall; with less, nothing would
/// hold pieces together. At 150 mm a shell of 4.7 mm has none behind walls of 1.2 mm. Of 163 models of a
/// benchmark and figures, the one with the least has 3 %, and its kit passes.
const LEAST_ROOM: f64 = 0.015;
/// Thinnest walls that are proposed, mm: two lines of an ordinary nozzle.
const THINNEST_PROPOSED_MM: f64 = 0.8;

/// Error: the model is too thin for walls of that thickness.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "only {:.0} % of the surface has room for a cavity behind walls of {wall_mm:.2} mm: \
     the model is too thin to be hollow; make it about {size_mm:.0} mm large, \
     or its walls {better_mm:.2} mm thin at most, \
     or print it in one piece (with allow-thin, pieces are made all the same)",
    100.0 * share
)]
pub struct TooThin {
    /// Share of the surface below which there would be a cavity, in [0, 1].
    pub share: f64,
    /// Wall thickness asked for, mm.
    pub wall_mm: f64,
    /// Longest edge of the model at which half of the surface would have a cavity below, mm.
    pub size_mm: f64,
    /// Wall thickness at which half of the surface would have a cavity at the current size, mm.
    pub better_mm: f64,
}

/// Error: connectors have no room behind walls of that thickness.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "half of the model is no thicker than {thickness_mm:.1} mm, and nowhere is room for connectors \
     behind walls of {wall_mm:.2} mm: make it about {size_mm:.0} mm large{}, \
     or print it in one piece (with allow-thin, pieces are made all the same)",
    thinner(*better_mm)
)]
pub struct NoRoom {
    /// Median thickness of the model, mm.
    pub thickness_mm: f64,
    /// Wall thickness asked for, mm.
    pub wall_mm: f64,
    /// Longest edge of the model at which half of the surface would have room behind such walls, mm.
    pub size_mm: f64,
    /// Wall thickness at which half of the surface would have room, mm; `None` where it is too thin to print.
    pub better_mm: Option<f64>,
}

/// Proposal of thinner walls, in words; empty if `None`.
fn thinner(better_mm: Option<f64>) -> String {
    better_mm.map_or_else(String::new, |mm| format!(", make its walls {mm:.2} mm thin"))
}

/// Estimates of one model's cavity with any wall. They rest on one measurement of the surface, made when it
/// is first needed, which takes a few tenths of a second.
#[derive(Debug, Default)]
pub struct Cavity {
    /// Thickest walls with a cavity below at points spread over the surface, mm, the thickest first.
    thickest_mm: OnceLock<Vec<f64>>,
}

impl Cavity {
    /// Checks that connectors have room behind walls of `wall_mm` somewhere; else proposes a size and walls.
    pub fn has_room(&self, model: &Solid, wall_mm: f64) -> Result<(), NoRoom> {
        let needed_mm = wall_mm + ROOM_MM;
        if self.share(model, needed_mm) >= LEAST_ROOM {
            return Ok(());
        }
        let median_mm = self.median_mm(model);
        let better_mm = median_mm - ROOM_MM;
        Err(NoRoom {
            thickness_mm: (1.0 + LEAST_SHARE) * median_mm,
            wall_mm,
            size_mm: self.size_mm(model, needed_mm),
            better_mm: (better_mm >= THINNEST_PROPOSED_MM).then_some(better_mm),
        })
    }

    /// Checks that at least a third of the surface has a cavity below walls of `wall_mm`; else proposes a
    /// size and walls.
    pub fn is_hollow(&self, model: &Solid, wall_mm: f64) -> Result<(), TooThin> {
        let share = self.share(model, wall_mm);
        if share >= LEAST_HOLLOW {
            return Ok(());
        }
        Err(TooThin {
            share,
            wall_mm,
            size_mm: self.size_mm(model, wall_mm),
            better_mm: self.median_mm(model),
        })
    }

    fn thickest_mm(&self, model: &Solid) -> &[f64] {
        self.thickest_mm.get_or_init(|| {
            let mut thickest_mm = thickest_walls(model.mesh());
            thickest_mm.sort_by(|a, b| b.total_cmp(a));
            thickest_mm
        })
    }

    /// Share of the surface with a cavity below walls of this thickness, in [0, 1]; 1 without a surface.
    fn share(&self, model: &Solid, wall_mm: f64) -> f64 {
        let thickest_mm = self.thickest_mm(model);
        if thickest_mm.is_empty() {
            return 1.0;
        }
        thickest_mm.partition_point(|mm| *mm >= wall_mm) as f64 / thickest_mm.len() as f64
    }

    /// Thickness of walls with a cavity below half of the surface, mm.
    fn median_mm(&self, model: &Solid) -> f64 {
        let thickest_mm = self.thickest_mm(model);
        thickest_mm[(PROPOSED_HOLLOW * thickest_mm.len() as f64) as usize].max(THINNEST_MM)
    }

    /// Longest edge at which half of the surface would have a cavity below walls of `wall_mm`, mm. Walls are
    /// tried in steps, so the size is a step too small.
    fn size_mm(&self, model: &Solid, wall_mm: f64) -> f64 {
        let longest_mm = model.mesh().bounds().size().max_element();
        longest_mm * STEP * wall_mm / self.median_mm(model)
    }
}

/// Thickest wall with a cavity below, mm, at points spread over the surface.
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

    fn is_hollow(model: &Solid, wall_mm: f64) -> Result<(), TooThin> {
        Cavity::default().is_hollow(model, wall_mm)
    }

    fn has_room(model: &Solid, wall_mm: f64) -> Result<(), NoRoom> {
        Cavity::default().has_room(model, wall_mm)
    }

    fn plate(thick_mm: f64) -> Solid {
        Solid::new(brick([0.0, 100.0], [0.0, 80.0], [0.0, thick_mm]).to_mesh()).unwrap()
    }

    #[test]
    fn a_plate_is_hollow_where_it_is_thicker_than_two_walls() {
        assert_eq!(is_hollow(&plate(6.0), 2.0), Ok(()));
        let thin = is_hollow(&plate(3.0), 2.0).unwrap_err();
        assert!(thin.share < 0.1, "{thin}");
        // Half of 3 mm is left to each of its walls, and less for the cavity between.
        assert!((1.2..1.6).contains(&thin.better_mm), "{thin}");
        assert!((135.0..185.0).contains(&thin.size_mm), "{thin}");
    }

    /// A goblet of one thickness everywhere, 150 mm high: a shell on a foot, as if turned.
    fn goblet(thick_mm: f64) -> Solid {
        let line = [
            [38.0, 2.0],
            [14.0, 10.0],
            [10.0, 45.0],
            [14.0, 60.0],
            [36.0, 80.0],
            [42.0, 115.0],
            [41.0, 148.0],
        ];
        let normal = |i: usize| {
            let (a, b) = (line[i.saturating_sub(1)], line[(i + 1).min(line.len() - 1)]);
            let [x, z] = [b[0] - a[0], b[1] - a[1]];
            let length = f64::hypot(x, z);
            [-z / length, x / length]
        };
        let beside = |i: usize, by: f64| {
            let [x, z] = normal(i);
            [line[i][0] + by * x, line[i][1] + by * z]
        };
        let one_side = (0..line.len()).map(|i| beside(i, -0.5 * thick_mm));
        let other_side = (0..line.len()).rev().map(|i| beside(i, 0.5 * thick_mm));
        revolve(&one_side.chain(other_side).collect::<Vec<[f64; 2]>>())
    }

    /// The body that a closed outline of points (distance from the z axis, z) sweeps in a full turn.
    fn revolve(outline: &[[f64; 2]]) -> Solid {
        const N_STEPS: u32 = 48;
        let n = outline.len() as u32;
        let mut mesh = TriMesh::default();
        for step in 0..N_STEPS {
            let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / f64::from(N_STEPS)).sin_cos();
            let points = outline
                .iter()
                .map(|[r, z]| shellock_geom::Vec3::new(r * cos, r * sin, *z));
            mesh.points.extend(points);
            for i in 0..n {
                let at = |step: u32, i: u32| (step % N_STEPS) * n + i % n;
                let (a, b) = (at(step, i), at(step, i + 1));
                let (c, d) = (at(step + 1, i), at(step + 1, i + 1));
                mesh.triangles.extend([[a, c, d], [a, d, b]]);
            }
        }
        Solid::new(mesh.clone()).unwrap_or_else(|_| {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            Solid::new(mesh).expect("one of both ways faces outwards")
        })
    }

    #[test]
    fn a_goblet_thinner_than_two_walls_and_connectors_is_refused_and_a_thicker_one_is_not() {
        let refused = has_room(&goblet(4.7), 1.2).unwrap_err();
        assert!((4.2..5.0).contains(&refused.thickness_mm), "{refused}");
        assert!((155.0..200.0).contains(&refused.size_mm), "{refused}");
        let mm = refused.better_mm.expect("walls of 0.8 mm leave room");
        assert_eq!(has_room(&goblet(4.7), mm), Ok(()));
        assert_eq!(has_room(&goblet(8.0), 1.2), Ok(()));
        // There would be cavities, so the other check passes.
        assert_eq!(is_hollow(&goblet(4.7), 1.2), Ok(()));
        assert_eq!(has_room(&plate(3.0), 1.2).unwrap_err().better_mm, None);
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
