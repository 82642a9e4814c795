//! The best end of a job so far, and the reasons why other trials failed.

use std::sync::Arc;

use super::agenda::{Agenda, Grade};
use super::failure::Failure;
use super::wall::Wall;
use super::{DesignError, NoPlan};
use crate::Ctx;
use crate::key::KeySite;
use crate::verify::words::fault_words;

/// The best end so far, a kit or a plan, and the reasons why other trials failed.
pub(super) struct Best<T> {
    entry: Option<Kept<T>>,
    /// Reasons why keys that were cut with the present wall fail, for people.
    reasons: Vec<String>,
    /// First failure with a piece as the key.
    failure: Option<Failure>,
    /// Last error with a piece as the key, or of a model that could not be divided.
    error: Option<DesignError>,
    /// Failure of the present key so far.
    present: Failure,
    /// Grade of the best end with the present key, and its faults for people.
    of_key: Option<(Grade, Vec<String>)>,
}

/// An end with what it was made of.
pub(super) struct Kept<T> {
    pub end: T,
    grade: Grade,
    pub key: Option<KeySite>,
    pub wall: Arc<Wall>,
    /// Reasons why keys that were cut with its wall fail.
    pub reasons: Vec<String>,
}

impl<T> Best<T> {
    pub fn new() -> Self {
        Self {
            entry: None,
            reasons: Vec::new(),
            failure: None,
            error: None,
            present: Failure::default(),
            of_key: None,
        }
    }

    /// Keeps an end, with these `faults`, if its grade is better than that of the best one so far. Of equals,
    /// the earlier one stays.
    pub fn offer(
        &mut self,
        end: T,
        (grade, faults): (Grade, Vec<String>),
        key: Option<KeySite>,
        wall: &Arc<Wall>,
    ) {
        if self
            .of_key
            .as_ref()
            .is_none_or(|(best, _)| grade.is_better_than(best))
        {
            self.of_key = Some((grade, faults));
        }
        if self
            .entry
            .as_ref()
            .is_none_or(|kept| grade.is_better_than(&kept.grade))
        {
            self.entry = Some(Kept {
                end,
                grade,
                key,
                wall: wall.clone(),
                reasons: self.reasons.clone(),
            });
        }
    }

    /// Keeps the reason why the present trial fails.
    pub fn fail(&mut self, failure: Failure) {
        if !failure.reason.is_empty() {
            self.present = failure;
        }
    }

    /// Closes a key: its failure becomes a reason for people, or the failure of the job.
    pub fn close_key(&mut self, ctx: &Ctx, site: Option<&KeySite>) {
        let failure = std::mem::take(&mut self.present);
        let kit = self.of_key.take().map(|(_, faults)| faults);
        let Some(site) = site else {
            if kit.is_none() && !failure.reason.is_empty() {
                self.failure.get_or_insert(failure);
            }
            return;
        };
        let words = site.words();
        let reason = match kit {
            Some(faults) if faults.is_empty() => return,
            Some(faults) => format!("{words}: {}", fault_words(&faults)),
            None if failure.reason.is_empty() => return,
            None => format!("{words}: no plan, as {}", failure.reason),
        };
        self.reject(ctx, reason);
    }

    /// Closes a key that cannot be made. The error is the job's only if a piece is the key and no kit was
    /// made.
    pub fn close_key_with(&mut self, ctx: &Ctx, site: Option<&KeySite>, error: DesignError) {
        (self.present, self.of_key) = (Failure::default(), None);
        match site {
            Some(site) => self.reject(ctx, format!("{} cannot be made: {error}", site.words())),
            None => {
                if self.has_end() {
                    ctx.note(&format!("with a piece as the key it cannot be made: {error}"));
                }
                self.error = Some(error);
            }
        }
    }

    pub fn has_end(&self) -> bool {
        self.entry.is_some()
    }

    /// Reason to divide in another way, for people.
    pub fn words(&self) -> String {
        match (&self.entry, &self.error) {
            (Some(_), _) => "no kit of these pieces passes".to_owned(),
            (None, Some(error)) => format!("these pieces cannot be made: {error}"),
            (None, None) => "these pieces have no plan".to_owned(),
        }
    }

    /// Begins another wall, whose keys fail for reasons of their own.
    pub fn begin_wall(&mut self) {
        self.reasons.clear();
    }

    /// Returns the best end; fails with the error of the job if there is none.
    pub fn into_end(self) -> Result<Option<T>, DesignError> {
        match (self.entry, self.error) {
            (Some(kept), _) => Ok(Some(kept.end)),
            (None, Some(error)) => Err(error),
            (None, None) => Ok(None),
        }
    }

    fn reject(&mut self, ctx: &Ctx, reason: String) {
        ctx.note(&reason);
        self.reasons.push(reason);
    }

    /// Returns the best end, or the reason why there is none: a failure, else an error, else nothing but a
    /// lack of time. An error is an answer only if nothing was left out for want of time.
    pub fn into_answer(self, ctx: &Ctx, agenda: &Agenda) -> Result<Result<Kept<T>, NoPlan>, DesignError> {
        if let Some(kept) = self.entry {
            return Ok(Ok(kept));
        }
        let is_cut_short = agenda.is_cut_short();
        let Failure { reason, blockers, .. } = match (self.failure, self.error) {
            (Some(failure), _) => failure,
            (None, Some(error)) if is_cut_short => Failure::of(&error.to_string()),
            (None, Some(error)) => return Err(error),
            (None, None) => self.present,
        };
        let needed_s = agenda.needed_s(ctx).filter(|_| is_cut_short);
        Ok(Err(NoPlan {
            reason: match is_cut_short {
                true => report_lateness(&reason, needed_s),
                false => reason,
            },
            blockers,
            is_cut_short,
            needed_s,
        }))
    }
}

/// Reason why there is no kit where the time was over: the time that the first one needs, and what failed so
/// far.
fn report_lateness(reason: &str, needed_s: Option<f64>) -> String {
    /// Step of the time that is told, s.
    const STEP_S: f64 = 10.0;
    let needed = needed_s.map_or_else(String::new, |s| {
        format!("; a kit takes about {:.0} s", (s / STEP_S).ceil() * STEP_S)
    });
    match reason {
        "" => format!("the time was over before a kit was made{needed}"),
        reason => format!("the time was over before a kit was made{needed}; so far {reason}"),
    }
}
