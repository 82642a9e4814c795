//! A trial: one division of the model with one key, one wall and one set of connectors, and the lessons from
//! it.
//!
//! A change replaces one layer of the trial and all layers that are made from it; the others are kept.

use std::sync::Arc;

use super::DesignError;
use super::agenda::{Agenda, CUT_KEYS, Effort, Step};
use super::candidate::{self, Candidate};
use super::cost::Cost;
use super::division::Division;
use super::failure::Failure;
use super::job::Job;
use super::wall::{Thicker, Wall};
use super::ways::{Input, Walls, Way};
use crate::body::WallGrid;
use crate::key::KeySite;
use crate::metric::EvenSurface;
use crate::plan::lesson::Lesson;
use crate::plan::{self, LatticePlan, PlanConstraints, PlanSurvey};
use crate::segmentation::Plane;
use crate::sizes::ChosenSizes;
use crate::{Ctx, SegmentedSurface, Warning, segmentation};

/// A change of a trial, with the data that it needs.
pub(super) enum Change {
    /// A step that needs no data.
    Step(Step),
    /// Connectors of other sizes in the same pieces.
    Enlarge(ChosenSizes),
    /// Other pieces, which one of the joining steps or [`Step::Divide`] made, and a warning of that.
    Divide(Step, SegmentedSurface, Option<Warning>),
    /// A thicker wall, with its reason.
    Thicken(Thicker),
}

impl Change {
    pub fn step(&self) -> Step {
        match self {
            Self::Step(step) | Self::Divide(step, ..) => *step,
            Self::Enlarge(_) => Step::Enlarge,
            Self::Thicken(_) => Step::Thicken,
        }
    }
}

/// Lessons of the plans and kits of one division.
#[derive(Default)]
pub(super) struct Learned {
    pub constraints: PlanConstraints,
    pub failure: Failure,
    pub n_kits: usize,
}

impl Learned {
    pub fn add(&mut self, lesson: &Lesson) {
        self.failure.suspects.extend(lesson.suspects());
        lesson.teach(&mut self.constraints);
    }
}

/// Pieces of one key, with their survey and lessons.
pub(super) struct Setup<'a> {
    pub candidate: Candidate<'a>,
    pub division: Division,
    /// Surface of the division with even triangles, once it is needed.
    pub even: Option<EvenSurface>,
    pub grid: WallGrid,
    pub survey: Option<PlanSurvey>,
    pub lessons: Learned,
    /// Strongest plan of the present pieces with other connectors.
    pub former: Option<LatticePlan>,
}

/// Layers of a trial that kits are made from.
pub(super) struct Parts<'t, 'a> {
    pub job: &'t Job<'a>,
    pub setup: &'t mut Setup<'a>,
    /// Site of the key; `None` for a piece as it is.
    pub site: Option<KeySite>,
    pub effort: &'t mut Effort,
}

/// All layers of the present trial; those that could not be made are missing.
pub(super) struct Trial<'a> {
    input: Input<'a>,
    /// The wall that a fall asks for, before the model is divided.
    thinnest: Wall,
    /// The thinnest wall that is made, once a way needs it.
    thin: Option<Wall>,
    job: Option<Job<'a>>,
    /// Plane of symmetry of the model, once it was sought.
    mirror: Option<Option<Plane>>,
    /// The first division, if it is known.
    division: Option<SegmentedSurface>,
    /// Sites for a key that is cut, best first.
    sites: Vec<KeySite>,
    setup: Option<Setup<'a>>,
    pub effort: Effort,
}

impl<'a> Trial<'a> {
    /// A trial of `input` with this wall; nothing is divided yet.
    pub fn new(input: Input<'a>, thinnest: Wall) -> Self {
        Self {
            input,
            thinnest,
            thin: None,
            mirror: None,
            job: None,
            division: None,
            sites: Vec::new(),
            setup: None,
            effort: Effort::default(),
        }
    }

    /// Takes the first division, where it is known.
    pub fn take_division(&mut self, divided: Option<SegmentedSurface>) {
        self.division = divided;
    }

    /// Returns the model as it is divided, and all sites for a key that is cut.
    pub fn into_division(self) -> (Option<Job<'a>>, Vec<KeySite>) {
        (self.job, self.sites)
    }

    /// Site of the present key; `None` for a piece as it is.
    pub fn site(&self, agenda: &Agenda) -> Option<KeySite> {
        self.sites[..self.sites.len().min(CUT_KEYS)]
            .get(agenda.key())
            .copied()
    }

    /// Layers that kits are made from. The last change must have been possible.
    pub fn parts(&mut self, agenda: &Agenda) -> Parts<'_, 'a> {
        Parts {
            site: self.site(agenda),
            job: self.job.as_ref().expect("the model is divided"),
            setup: self.setup.as_mut().expect("the key is cut"),
            effort: &mut self.effort,
        }
    }

    /// Divides the model in the present way and cuts the first key.
    pub fn begin(&mut self, ctx: &Ctx, agenda: &mut Agenda) -> Result<Option<Failure>, DesignError> {
        self.forget();
        let wall = Arc::new(self.wall_of(ctx, agenda.way())?);
        let job = match self.division.take() {
            Some(surface) => Job::of(self.input, wall, surface)?,
            None => Job::new(ctx, self.input, wall)?,
        };
        self.use_job(ctx, agenda, job)
    }

    fn forget(&mut self) {
        (self.job, self.setup) = (None, None);
        self.sites.clear();
    }

    /// Makes a change. Returns a failure if nothing can be tried with it.
    pub fn apply(
        &mut self,
        ctx: &Ctx,
        agenda: &mut Agenda,
        change: Change,
    ) -> Result<Option<Failure>, DesignError> {
        match change {
            Change::Step(Step::NextWay) => self.begin(ctx, agenda),
            Change::Step(Step::LowerLoad) => {
                ctx.note("no kit with walls so thick passes: walls as thin as a fall allows");
                self.begin(ctx, agenda)
            }
            Change::Step(Step::NextKey) => self.use_key(ctx, agenda),
            Change::Step(_) => Ok(None),
            Change::Enlarge(sizes) => {
                ctx.note("seams would open where it is used: larger connectors there");
                if let Some(setup) = &mut self.setup {
                    setup.division.sizes = sizes;
                    setup.begin_sizes();
                }
                Ok(None)
            }
            Change::Divide(step, surface, warning) => self.use_pieces(ctx, agenda, step, surface, warning),
            Change::Thicken(thicker) => {
                let job = self
                    .job
                    .take()
                    .expect("a thicker wall is sought for a model that is divided");
                ctx.note(&thicker.words());
                self.forget();
                let wall = job.wall.thicken(ctx, &self.input, thicker)?;
                let job = Job::new(ctx, self.input, Arc::new(wall))?;
                self.use_job(ctx, agenda, job)
            }
        }
    }

    fn wall_of(&mut self, ctx: &Ctx, way: Way) -> Result<Wall, DesignError> {
        if way.walls != Walls::Thin {
            return Ok(self.thinnest.with_way(way));
        }
        if self.thin.is_none() {
            self.thin = Some(self.thinnest.thin(ctx, &self.input)?);
        }
        Ok(self.thin.as_ref().unwrap_or(&self.thinnest).with_way(way))
    }

    fn use_job(
        &mut self,
        ctx: &Ctx,
        agenda: &mut Agenda,
        job: Job<'a>,
    ) -> Result<Option<Failure>, DesignError> {
        self.sites = candidate::sites(ctx, &job)?;
        let mirror = self.mirror_of(&job);
        self.job = Some(job.with_mirror(mirror));
        agenda.set_keys(self.sites.len().min(CUT_KEYS) + 1);
        self.use_key(ctx, agenda)
    }

    /// Plane about which both sides are divided alike. Labels that are given stay as they are.
    fn mirror_of(&mut self, job: &Job<'_>) -> Option<Plane> {
        let (params, input) = (&job.settings().segmentation, &self.input);
        if !params.symmetric || !params.method.knows_symmetry() || input.labels.is_some() {
            return None;
        }
        let sought = || segmentation::symmetry_plane(params, input.model);
        *self.mirror.get_or_insert_with(sought)
    }

    /// Takes the present place for the key, and the pieces as they are divided.
    fn use_key(&mut self, ctx: &Ctx, agenda: &mut Agenda) -> Result<Option<Failure>, DesignError> {
        self.setup = None;
        let site = self.site(agenda);
        if let Some(site) = &site {
            ctx.note(&site.words());
        }
        let job = self
            .job
            .as_ref()
            .expect("keys are sought in a model that is divided");
        let Some(candidate) = Candidate::new(job, site.as_ref()) else {
            return Ok(Some(Failure::default()));
        };
        self.effort.keys += 1;
        let Some(division) = candidate.divide(ctx, job, candidate.surface.clone())? else {
            return Ok(Some(Failure::of("the key falls apart")));
        };
        self.effort.segmentations += 1;
        agenda.foresee(ctx, Cost::of(&division.surface));
        let mut setup = Setup {
            candidate,
            division,
            even: None,
            grid: WallGrid::default(),
            survey: None,
            lessons: Learned::default(),
            former: None,
        };
        setup.begin_division();
        self.setup = Some(setup);
        Ok(None)
    }

    /// Takes other pieces. If no key can be cut out of joined pieces, keeps the present ones and joins no
    /// others for the same reason.
    fn use_pieces(
        &mut self,
        ctx: &Ctx,
        agenda: &mut Agenda,
        step: Step,
        surface: SegmentedSurface,
        warning: Option<Warning>,
    ) -> Result<Option<Failure>, DesignError> {
        let (job, setup) = (self.job.as_ref(), self.setup.as_mut());
        let (job, setup) = job
            .zip(setup)
            .expect("pieces are changed of a model that is divided");
        let surface = segmentation::coarsen(&setup.candidate.surface, surface);
        let Some(next) = setup.candidate.divide(ctx, job, surface)? else {
            if matches!(step, Step::Lengthen | Step::JoinPredicted | Step::JoinWeak) {
                agenda.forgo(step);
                setup.begin_division();
                return Ok(None);
            }
            return Ok(Some(Failure::default()));
        };
        self.effort.segmentations += 1;
        agenda.foresee(ctx, Cost::of(&next.surface));
        let (n, before) = (next.surface.n_patches, setup.division.surface.n_patches);
        ctx.note(&match (&warning, step) {
            (Some(warning), _) => format!("{warning}: {n} pieces"),
            (None, Step::Lengthen) => "pieces would come loose: trying longer seams".to_owned(),
            (None, Step::JoinPredicted) => {
                format!("pieces would come loose: trying {n} pieces instead of {before}")
            }
            (None, _) => format!("trying other pieces: {n} instead of {before}"),
        });
        let mut changes = if warning.is_some() {
            std::mem::take(&mut setup.division.changes)
        } else {
            Vec::new()
        };
        changes.extend(warning);
        setup.division = Division { changes, ..next };
        setup.begin_division();
        Ok(None)
    }
}

impl Setup<'_> {
    /// Surveys the plans of the present pieces, unless that was done.
    pub fn survey_plans(&mut self, ctx: &Ctx) -> Result<(), DesignError> {
        if self.survey.is_none() {
            let (division, surface) = (&self.division, &self.division.surface);
            let (params, sizes) = (&division.settings.plan, &division.sizes.sizes);
            self.survey = Some(plan::survey(
                &ctx.fork(),
                params,
                surface,
                &surface.seams(),
                sizes,
            )?);
        }
        Ok(())
    }

    /// Forgets measurements and lessons of other pieces.
    fn begin_division(&mut self) {
        (self.even, self.former) = (None, None);
        self.grid.begin_division();
        self.begin_sizes();
    }

    /// Forgets lessons of other connectors, and makes sure that the present ones will have room.
    fn begin_sizes(&mut self) {
        (self.survey, self.lessons) = (None, Learned::default());
        let largest_mm = self.division.sizes.sizes.largest_mm();
        let room_mm = self.division.settings.connector.room_mm(largest_mm);
        self.grid.reserve(room_mm);
    }
}
