//! The divisions that kits are made of in turn: cut where a person would, finer or coarser, or of similar size; and
//! what is asked of each.

use std::borrow::Cow;

use shellock_geom::Solid;

use super::budget::Pace;
use super::budget::{RESERVE, THICKER_WALLS};
use super::outcome::{report_lateness, time_up};
use super::wall::Wall;
use super::{DesignError, DesignOutcome, Effort, Job, KeySource, Params, Rounds, Walled, with_wall};
use crate::Ctx;
use crate::segmentation::{Method, usual_n_pieces};

/// How a model is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Way {
    pub method: Method,
    pub n_pieces: Option<usize>,
    pub walls: Walls,
}

/// How thick walls are: that a kit locks comes before what it bears.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Walls {
    /// As a fall asks for; thicker for the sake of use, where such a kit passes.
    ForUse,
    /// As a fall asks for.
    ForFalls,
    /// As thin as they are made, so that connectors have the most room.
    Thin,
}

/// Pieces of coarser divisions where none are asked for, as shares of the usual, since thin bars hold by few seams;
/// with their walls.
const COARSER: [(f64, Walls); 2] = [(0.7, Walls::ForFalls), (0.35, Walls::Thin)];

impl Way {
    /// What is asked of its kits, of which so many may be made.
    pub fn ask(self, rounds: Rounds) -> Ask {
        Ask {
            factor: RESERVE,
            rounds,
            n_thicker: match self.walls {
                Walls::ForUse => THICKER_WALLS,
                Walls::ForFalls | Walls::Thin => 0,
            },
        }
    }

    /// In words, for people.
    pub fn words(self) -> String {
        let n = self.n_pieces.map_or_else(String::new, |n| format!("about {n} "));
        let walls = if self.walls == Walls::Thin {
            ", thin walls"
        } else {
            ""
        };
        match self.method {
            Method::Creases => format!("{n}pieces of similar size{walls}"),
            _ => format!("{n}pieces cut where a person would{walls}"),
        }
    }
}

/// Ways to divide in the order in which kits are made of them: one where the user says how.
pub(super) fn ways(input: &Input<'_>) -> Vec<Way> {
    let params = input.params;
    let own = Way {
        method: params.method,
        n_pieces: params.n_pieces,
        walls: Walls::ForUse,
    };
    // A piece that is named as the key has its number in this division alone.
    let has_named_key = matches!(params.key, KeySource::Piece(_));
    if params.method != Method::Auto || input.labels.is_some() || has_named_key {
        return vec![own];
    }
    let usual = usual_n_pieces(input.model.mesh().area()) as f64;
    let coarser = COARSER.map(|(share, walls)| Way {
        n_pieces: Some(((share * usual).round() as usize).max(2)),
        walls,
        ..own
    });
    let similar = Way {
        method: Method::Creases,
        walls: Walls::Thin,
        ..own
    };
    let coarser = coarser.into_iter().filter(|_| params.n_pieces.is_none());
    [own].into_iter().chain(coarser).chain([similar]).collect()
}

/// How much of `total_s` the ways after the `i`-th of `n` shall have: the first has twice as much as each other.
pub(super) fn reserved_s(total_s: f64, i: usize, n: usize) -> f64 {
    if i + 1 == n || total_s.is_infinite() {
        0.0
    } else {
        total_s * (n - 1 - i) as f64 / (n + 1) as f64
    }
}

/// What is asked for.
pub(super) struct Input<'a> {
    pub params: &'a Params,
    pub model: &'a Solid,
    pub labels: Option<&'a [i64]>,
}

/// How a job ended.
pub(super) struct Ended {
    pub outcome: Result<DesignOutcome, DesignError>,
    /// Whether its wall was thicker for the sake of use.
    was_thicker: bool,
    /// The slowest of its kits, s.
    slowest_s: f64,
    /// True where something was left out for want of time.
    is_cut_short: bool,
}

impl Ended {
    /// An end with no figure for the time that a kit takes.
    pub fn new(outcome: Result<DesignOutcome, DesignError>) -> Self {
        Self {
            outcome,
            was_thicker: false,
            slowest_s: 0.0,
            is_cut_short: false,
        }
    }

    /// Whether nothing else is to be tried.
    pub fn is_enough(&self) -> bool {
        match &self.outcome {
            Ok(outcome) => outcome.kit().is_some_and(|kit| kit.verification.passed()),
            Err(e) => matches!(e, DesignError::Cancelled(_)),
        }
    }

    /// Whether the job's time is over for a kit of another division, which takes less time where it is coarser.
    pub fn is_late(&self, ctx: &Ctx, next: Way) -> bool {
        let kit = self.outcome.as_ref().ok().and_then(DesignOutcome::kit);
        let share = match (kit, next.n_pieces) {
            (Some(kit), Some(n)) => (n as f64 / kit.pieces.len() as f64).min(1.0),
            _ => 1.0,
        };
        Pace::is_over(ctx, share * self.slowest_s)
    }

    /// Why something else is to be tried, for people.
    pub fn words(&self) -> String {
        match &self.outcome {
            Ok(_) => "no kit of these pieces passes".into(),
            Err(e) => format!("these pieces cannot be made: {e}"),
        }
    }

    /// The better of this and of a later try, cut short where either was.
    pub fn or(self, later: Self) -> Self {
        let is_cut_short = self.is_cut_short || later.is_cut_short;
        let is_worse = match (&self.outcome, &later.outcome) {
            (_, Err(DesignError::Cancelled(_))) => false,
            (Ok(outcome), Ok(other)) => !other.is_better_than(outcome),
            (Ok(_), Err(_)) => true,
            (Err(_), _) => false,
        };
        let better = if is_worse { self } else { later };
        Self {
            is_cut_short,
            ..better
        }
    }

    /// Concludes the whole job with its `effort`, and reports where it was cut short.
    pub fn conclude(self, effort: Effort) -> Result<DesignOutcome, DesignError> {
        let is_cut_short = self.is_cut_short;
        let lacks_time = |reason: &str, blockers| DesignOutcome::NoPlan {
            reason: report_lateness(reason),
            blockers,
            is_cut_short,
        };
        match self.outcome {
            Ok(DesignOutcome::Made(mut design)) => {
                design.effort = effort;
                if is_cut_short {
                    design.warnings.push(time_up(effort.kits));
                }
                Ok(DesignOutcome::Made(design))
            }
            Ok(DesignOutcome::NoPlan { reason, blockers, .. }) if is_cut_short => {
                Ok(lacks_time(&reason, blockers))
            }
            // Other pieces that were left out might have been made.
            Err(e) if is_cut_short && !matches!(e, DesignError::Cancelled(_)) => {
                Ok(lacks_time(&e.to_string(), Vec::new()))
            }
            ended => ended,
        }
    }
}

/// Tries the ways in turn until one is enough; the best end. Records ways that are left out for want of time.
pub(super) fn try_ways(ctx: &Ctx, ways: &[Way], mut attempt: impl FnMut(usize, Way) -> Ended) -> Ended {
    let mut best: Option<Ended> = None;
    for (i, &way) in ways.iter().enumerate() {
        best = Some(match best {
            None => attempt(i, way),
            Some(before) if before.is_enough() => return before,
            Some(before) if before.is_late(ctx, way) => {
                ctx.note(&format!("no time is left for {}", way.words()));
                Ended {
                    is_cut_short: true,
                    ..before
                }
            }
            Some(before) => {
                ctx.note(&format!("{}; now {}", before.words(), way.words()));
                before.or(attempt(i, way))
            }
        });
    }
    best.expect("there is at least one way")
}

/// The job from the wall `thinnest`, which may grow so that more is borne; where no kit passes then, with that wall.
pub(super) fn with_reserve(
    ctx: &Ctx,
    input: &Input<'_>,
    thinnest: &Wall,
    ask: Ask,
    effort: &mut Effort,
) -> Ended {
    let first = asking(ctx, input, thinnest, ask, effort);
    // One kit with the thinnest wall is made though it is late: a thick one may be all that was wrong.
    if first.is_enough() || !first.was_thicker {
        return first;
    }
    ctx.note("no kit with walls so thick passes: walls as thin as a fall allows");
    let ask = Ask {
        factor: 1.0,
        n_thicker: 0,
        ..ask
    };
    let second = asking(ctx, input, thinnest, ask, effort);
    first.or(second)
}

/// What is asked of a kit, and what it may cost.
#[derive(Clone, Copy)]
pub(super) struct Ask {
    /// How many times it is to bear what people do to it.
    pub factor: f64,
    pub rounds: Rounds,
    /// How often its wall may grow for that.
    pub n_thicker: usize,
}

/// The job from the wall `thinnest`, which grows where less than what is asked is borne.
pub(super) fn asking(ctx: &Ctx, input: &Input<'_>, thinnest: &Wall, ask: Ask, effort: &mut Effort) -> Ended {
    let mut wall = Cow::Borrowed(thinnest);
    let (mut n_left, mut slowest_s, mut is_cut_short) = (ask.n_thicker, 0.0f64, false);
    let outcome = loop {
        let job = Job::new(ctx, input, &wall, ask, n_left > 0);
        let walled = job.and_then(|job| {
            let walled = with_wall(ctx, &job, effort);
            slowest_s = slowest_s.max(job.pace.slowest_s());
            is_cut_short |= job.pace.is_cut_short();
            walled
        });
        match walled {
            Ok(Walled::Done(outcome)) => break Ok(outcome),
            Ok(Walled::Thicker(thicker)) => {
                n_left -= 1;
                match wall.thicker(ctx, input, &thicker) {
                    Ok(next) => wall = Cow::Owned(next),
                    Err(e) => break Err(e),
                }
            }
            Err(e) => break Err(e),
        }
    };
    Ended {
        outcome,
        was_thicker: wall.is_thicker(),
        slowest_s,
        is_cut_short,
    }
}

#[cfg(test)]
mod tests {
    use shellock_geom::Vec3;

    use super::super::tests::{Ball, codes, good, loose, made, rattling};
    use super::*;
    use crate::design::Kit;
    use crate::testing::sphere;

    fn ways_of(change: impl Fn(&mut Params), labels: Option<&[i64]>) -> Vec<Way> {
        let model = Solid::new(sphere(3, Vec3::splat(50.0))).expect("closed");
        let mut params = Params {
            method: Method::Auto,
            ..Params::default()
        };
        change(&mut params);
        ways(&Input {
            params: &params,
            model: &model,
            labels,
        })
    }

    #[test]
    fn fewer_pieces_come_second_and_third_and_pieces_of_similar_size_last() {
        let ways = ways_of(|_| (), None);
        let methods: Vec<Method> = ways.iter().map(|w| w.method).collect();
        assert_eq!(
            methods,
            [Method::Auto, Method::Auto, Method::Auto, Method::Creases]
        );
        let usual = usual_n_pieces(4.0 * std::f64::consts::PI * 50.0 * 50.0);
        assert_eq!(ways[0].n_pieces, None);
        let n = |i: usize| ways[i].n_pieces.unwrap();
        assert!(n(1) < usual && n(2) < n(1) && n(2) >= 2);
        let may_grow: Vec<bool> = ways
            .iter()
            .map(|w| w.ask(Rounds::default()).n_thicker > 0)
            .collect();
        assert_eq!(may_grow, [true, false, false, false]);
        let is_thin: Vec<bool> = ways.iter().map(|w| w.walls == Walls::Thin).collect();
        assert_eq!(is_thin, [false, false, true, true]);
    }

    #[test]
    fn the_first_way_has_twice_the_time_of_each_other() {
        let ends: Vec<f64> = (0..4).map(|i| 50.0 - reserved_s(50.0, i, 4)).collect();
        assert_eq!(ends, [20.0, 30.0, 40.0, 50.0]);
        assert_eq!(reserved_s(f64::INFINITY, 0, 4), 0.0);
        assert_eq!(reserved_s(50.0, 0, 1), 0.0);
    }

    #[test]
    fn a_number_of_pieces_that_is_asked_for_is_kept_by_every_way() {
        let ways = ways_of(|p| p.n_pieces = Some(7), None);
        assert_eq!(ways.len(), 2);
        assert!(ways.iter().all(|w| w.n_pieces == Some(7)));
    }

    #[test]
    fn what_the_user_says_of_the_division_is_the_only_way() {
        assert_eq!(ways_of(|p| p.method = Method::Creases, None).len(), 1);
        assert_eq!(ways_of(|p| p.key = KeySource::Piece(2), None).len(), 1);
        assert_eq!(ways_of(|_| (), Some(&[0; 1280])).len(), 1);
    }

    #[test]
    fn a_kit_stays_where_what_is_tried_after_it_cannot_be_made() {
        let no_plan = |reason: &str| {
            Ended::new(Ok(DesignOutcome::NoPlan {
                reason: reason.into(),
                blockers: Vec::new(),
                is_cut_short: false,
            }))
        };
        let error = || Ended::new(Err(DesignError::NoLabelOfKey(3)));
        assert!(no_plan("first").or(error()).outcome.is_ok());
        assert!(error().or(no_plan("second")).outcome.is_ok());
        let stopped = Ended::new(Err(DesignError::Cancelled(crate::Cancelled)));
        assert!(no_plan("first").or(stopped).outcome.is_err());
    }
    /// A job that ended with this kit of three pieces, which took 30 s.
    fn of_kit(kit: Kit) -> Ended {
        let (_, design) = Ball::new().outcome(vec![(None, made(kit))]);
        let outcome = DesignOutcome::Made(Box::new(design.expect("a kit was made")));
        Ended {
            slowest_s: 30.0,
            ..Ended::new(Ok(outcome))
        }
    }

    /// True where the outcome reports that the time was over.
    fn tells_time_up(ended: Ended) -> bool {
        match ended.conclude(Effort::default()).expect("no error is left") {
            DesignOutcome::Made(design) => codes(&design).contains(&"time-up"),
            DesignOutcome::NoPlan {
                reason, is_cut_short, ..
            } => {
                assert_eq!(reason.contains("(--time)"), is_cut_short, "{reason}");
                is_cut_short
            }
        }
    }

    fn way(n_pieces: Option<usize>) -> Way {
        Way {
            method: Method::Auto,
            n_pieces,
            walls: Walls::ForFalls,
        }
    }

    /// Tries ways of so many pieces, all of which fail, with so many seconds left: the ways that were tried, and whether
    /// the outcome reports that the time was over.
    fn tried(seconds_left: f64, pieces: &[Option<usize>]) -> (Vec<Option<usize>>, bool) {
        let left = || seconds_left;
        let ctx = Ctx::quiet().with_deadline(&left);
        let ways: Vec<Way> = pieces.iter().map(|n| way(*n)).collect();
        let mut tried = Vec::new();
        let ended = try_ways(&ctx, &ways, |_, way| {
            tried.push(way.n_pieces);
            of_kit(loose(1))
        });
        (tried, tells_time_up(ended))
    }

    #[test]
    fn ways_that_are_left_out_for_want_of_time_are_reported() {
        // A kit of three pieces takes 30 s, and half as much again must be left; of one piece a third of that.
        let all = [None, Some(6), Some(1)];
        assert_eq!(tried(60.0, &all), (all.to_vec(), false));
        assert_eq!(tried(20.0, &all), (vec![None, Some(1)], true));
        assert_eq!(tried(10.0, &all), (vec![None], true));
        assert_eq!(tried(10.0, &all[..1]), (vec![None], false), "none was left");
    }

    #[test]
    fn nothing_is_left_out_after_a_kit_that_passes() {
        let none = || 0.0;
        let (ctx, ways) = (Ctx::quiet().with_deadline(&none), [way(None), way(None)]);
        let ended = try_ways(&ctx, &ways, |i, _| {
            assert_eq!(i, 0);
            of_kit(good())
        });
        assert!(!tells_time_up(ended));
    }

    #[test]
    fn that_one_way_was_cut_short_is_reported_with_the_kit_of_another() {
        let no_plan = || {
            Ended::new(Ok(DesignOutcome::NoPlan {
                reason: "first".into(),
                blockers: Vec::new(),
                is_cut_short: false,
            }))
        };
        let error = || Ended::new(Err(DesignError::NoLabelOfKey(3)));
        let kit = || of_kit(loose(1));
        let cut_short = |ended: Ended| Ended {
            is_cut_short: true,
            ..ended
        };
        for (first, second) in [
            (&kit as &dyn Fn() -> Ended, &no_plan as &dyn Fn() -> Ended),
            (&kit, &error),
            (&no_plan, &kit),
            (&error, &kit),
            (&no_plan, &no_plan),
        ] {
            assert!(!tells_time_up(first().or(second())));
            assert!(tells_time_up(first().or(cut_short(second()))));
            assert!(tells_time_up(cut_short(first()).or(second())));
        }
    }

    #[test]
    fn a_kit_that_passes_reports_what_was_left_out() {
        for kit in [good, || rattling(1, 1.5)] {
            assert!(kit().verification.passed() && !tells_time_up(of_kit(kit())));
            assert!(tells_time_up(Ended {
                is_cut_short: true,
                ..of_kit(kit())
            }));
        }
    }

    #[test]
    fn an_error_is_the_last_word_only_where_nothing_was_left_out() {
        let error = || Ended::new(Err(DesignError::NoLabelOfKey(3)));
        assert!(error().conclude(Effort::default()).is_err());
        let cut_short = Ended {
            is_cut_short: true,
            ..error()
        };
        assert!(tells_time_up(cut_short));
        let stopped = Ended {
            is_cut_short: true,
            ..Ended::new(Err(DesignError::Cancelled(crate::Cancelled)))
        };
        assert!(stopped.conclude(Effort::default()).is_err());
    }
}
