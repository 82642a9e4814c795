//! Scores of one metric for all plans, and its run time.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use rayon::prelude::*;
use shellock::PatchId;
use shellock::metric::{data_driven, pieces_alone};
use shellock::plan::local_tests::LocalTests;
use shellock::plan::{PlanConstraints, PlanScore, score};
use shellock_geom::sparse::SparseError;
use shellock_mechanics::{Opening, Resistance, SurfaceModel, SurfaceParams, SurfaceSolution};
use shellock_volume::{VolumeError, VolumeModel, VolumeParams};

use super::Subject;
use crate::failure::Failure;

/// Number of plans that are timed one by one before all are evaluated on all cores.
const N_TIMED: usize = 5;

/// Score of a plan by one metric.
#[derive(Clone, Debug)]
pub enum Score {
    /// The plan was simulated as a whole and holds.
    Holds(Opening),
    /// The metric gives only a number; higher is better.
    Rated(f64),
    Separable,
    /// The solver failed for this plan.
    Unsolved,
}

impl Score {
    fn of(resistance: Resistance) -> Self {
        match resistance {
            Resistance::Holds(opening) => Self::Holds(opening),
            Resistance::Separable(_) => Self::Separable,
        }
    }

    fn of_surface(solution: Result<SurfaceSolution, SparseError>, subject: &Subject) -> Self {
        match solution {
            Ok(solution) if solution.error <= subject.model.params.surface().tolerance => {
                Self::of(solution.resistance)
            }
            Ok(solution) => Self::give_up(&format!("{:.1e} of the force is left", solution.error)),
            Err(e) => Self::give_up(&e.to_string()),
        }
    }

    /// Warns why a plan has no score, and returns that score.
    fn give_up(why: &str) -> Self {
        eprintln!("warning: a plan was not solved: {why}");
        Self::Unsolved
    }

    /// Opening of the seams if the plan was simulated as a whole and holds; else `None`.
    pub fn opening(&self) -> Option<&Opening> {
        if let Self::Holds(opening) = self {
            Some(opening)
        } else {
            None
        }
    }

    /// Quality of the plan, higher is better; NaN if it has none.
    fn quality(&self) -> f64 {
        match self {
            Self::Holds(opening) => opening.quality_mm,
            Self::Rated(quality) => *quality,
            Self::Separable | Self::Unsolved => f64::NAN,
        }
    }
}

/// Scores of one metric for all plans.
pub struct Column {
    /// Name of the metric, with the unit in brackets if it has one.
    pub name: String,
    /// Scores in order of the plans.
    pub scores: Vec<Score>,
    pub times: Times,
}

/// Wall-clock times of a metric, s.
pub struct Times {
    /// Time to prepare what all plans share.
    pub setup: f64,
    /// Time for a plan, one at a time: median of the first ones.
    pub alone: f64,
    /// Time for a plan when all are evaluated in parallel.
    pub together: f64,
}

impl Column {
    /// Computes the `score` of plans 0 to `n` − 1 with the result of `prepare`, and measures the times.
    fn new<T: Sync>(
        name: &str,
        n: usize,
        prepare: impl FnOnce() -> Result<T, Failure>,
        score: impl Fn(&T, usize) -> Score + Sync,
    ) -> Result<Self, Failure> {
        eprintln!("{name}: {n} plans");
        let start = Instant::now();
        let metric = prepare()?;
        let setup = start.elapsed().as_secs_f64();
        let timed = |i: usize| {
            let start = Instant::now();
            let _ = score(&metric, i);
            start.elapsed().as_secs_f64()
        };
        let mut alone: Vec<f64> = (0..n.min(N_TIMED)).map(timed).collect();
        alone.sort_by(f64::total_cmp);
        let start = Instant::now();
        let n_done = AtomicUsize::new(0);
        let told = |i: usize| {
            let found = score(&metric, i);
            let done = n_done.fetch_add(1, Ordering::Relaxed) + 1;
            if done.is_multiple_of(10) {
                eprintln!("  {done} of {n} after {:.1} s", start.elapsed().as_secs_f64());
            }
            found
        };
        let scores: Vec<Score> = (0..n).into_par_iter().map(told).collect();
        let together = start.elapsed().as_secs_f64() / n.max(1) as f64;
        let alone = alone.get(alone.len() / 2).copied().unwrap_or(0.0);
        Ok(Self {
            name: name.to_owned(),
            scores,
            times: Times {
                setup,
                alone,
                together,
            },
        })
    }

    /// Evaluates the volume metric on the first `n` plans.
    pub fn by_volume(
        name: &str,
        subject: &Subject,
        youngs_modulus_mpa: f64,
        n: usize,
    ) -> Result<Self, Failure> {
        let volume = || volume_model(subject, youngs_modulus_mpa).map_err(|e| failure_of(name, &e));
        Self::new(name, n, volume, |volume, i| {
            match volume.resist(&subject.meetings[i], subject.key) {
                Ok(resistance) => Score::of(resistance),
                Err(e) => Score::give_up(&e.to_string()),
            }
        })
    }

    /// Evaluates the surface metric with these factors on stretch, bending and position.
    pub fn by_surface(name: &str, subject: &Subject, stiffness_ratios: [f64; 3]) -> Result<Self, Failure> {
        let params = SurfaceParams {
            stiffness_ratios,
            ..subject.model.params.surface()
        };
        let surface =
            || SurfaceModel::new(&params, &subject.model.assembly).map_err(|e| failure_of(name, &e));
        Self::new(name, subject.plans.len(), surface, |surface, i| {
            Score::of_surface(surface.resist(&subject.meetings[i], subject.key), subject)
        })
    }

    /// Evaluates each piece alone, with its neighbours held.
    pub fn by_pieces_alone(name: &str, subject: &Subject) -> Result<Self, Failure> {
        let surface = || subject.model.surface_model().map_err(|e| failure_of(name, &e));
        Self::new(
            name,
            subject.plans.len(),
            surface,
            |surface, i| match pieces_alone(
                &subject.model,
                surface,
                &subject.meetings[i],
                PatchId(subject.key),
            ) {
                Ok(quality_mm) => quality_mm.map_or(Score::Separable, Score::Rated),
                Err(e) => Score::give_up(&e.to_string()),
            },
        )
    }

    /// Evaluates Eq. 6 as published.
    pub fn by_eq_6(name: &str, subject: &Subject) -> Result<Self, Failure> {
        let tests =
            || LocalTests::simulate(&subject.model.params.surface()).map_err(|e| failure_of(name, &e));
        Self::new(name, subject.plans.len(), tests, |tests, i| {
            Score::Rated(data_driven(&subject.model, tests, &subject.meetings[i]))
        })
    }

    /// Evaluates the negated cost that the search minimises; `of` selects it from the costs of a plan.
    pub fn by_cost(name: &str, subject: &Subject, of: fn(&PlanScore) -> f64) -> Result<Self, Failure> {
        let nothing_shared = || Ok(PlanConstraints::default());
        Self::new(name, subject.plans.len(), nothing_shared, |constraints, i| {
            Score::Rated(-of(&score(&subject.survey, constraints, &subject.plans[i])))
        })
    }

    /// Returns true if the metric can find that a plan comes apart.
    pub fn knows_separable(&self) -> bool {
        self.scores.iter().any(|s| !matches!(s, Score::Rated(_)))
    }

    /// Qualities of the plans, higher is better; NaN where there is none.
    pub fn qualities(&self) -> Vec<f64> {
        self.scores.iter().map(Score::quality).collect()
    }
}

fn volume_model(subject: &Subject, youngs_modulus_mpa: f64) -> Result<VolumeModel, VolumeError> {
    let mut params = VolumeParams {
        wall_mm: subject.model.params.wall_mm,
        material: subject.model.params.material,
        ..VolumeParams::default()
    };
    params.material.youngs_modulus_mpa = youngs_modulus_mpa;
    VolumeModel::new(&params, &subject.model.assembly)
}

/// Creates the failure of a metric that could not be computed.
pub fn failure_of(metric: &str, problem: &dyn std::fmt::Display) -> Failure {
    Failure::Metric {
        metric: metric.to_owned(),
        problem: problem.to_string(),
    }
}
