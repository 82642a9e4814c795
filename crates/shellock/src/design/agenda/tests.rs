//! Order of trials in histories that are made up; `order.txt` has all of them.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use super::*;
use crate::design::Rounds;
use crate::segmentation::Method;

const N_PIECES: usize = 8;

/// The ways of a model that is divided automatically.
fn four_ways() -> Vec<Way> {
    let way = |method, n_pieces, walls| Way {
        method,
        n_pieces,
        walls,
    };
    vec![
        way(Method::Auto, None, Walls::ForUse),
        way(Method::Auto, Some(6), Walls::ForFalls),
        way(Method::Auto, Some(3), Walls::Thin),
        way(Method::Creases, None, Walls::Thin),
    ]
}

fn kit(n_failures: usize, rattle: f64) -> Report {
    Report {
        kit: Some(Grade {
            n_pieces: N_PIECES,
            n_failures,
            rattle,
            only_rattles: rattle > SLIGHT,
            others_rattle: rattle > SLIGHT,
        }),
        ..Report::default()
    }
}

fn with_offers(report: Report, offers: &[Step]) -> Report {
    Report {
        offers: offers.to_vec(),
        ..report
    }
}

/// Kit that comes loose; another plan or other pieces may help.
fn loose() -> Report {
    with_offers(kit(1, 0.0), &[Step::Remake, Step::Divide])
}

/// Trial without a plan; other pieces may help.
fn no_plan() -> Report {
    with_offers(Report::default(), &[Step::Divide])
}

/// Kit that passes but rattles.
fn kit_that_rattles() -> Report {
    with_offers(kit(0, 1.5), &[Step::Lengthen, Step::JoinRattling])
}

/// Kit that is given up since its connectors leave too much play, if that is allowed; else it is finished.
fn stopped(allowance: &Allowance) -> Report {
    if !allowance.may_stop_for(Step::JoinRattling) {
        return kit_that_rattles();
    }
    Report {
        is_stopped: true,
        ..with_offers(Report::default(), &[Step::JoinRattling])
    }
}

/// Kit that is given up since its connectors are too short, if that is allowed; else it is finished.
fn too_short(allowance: &Allowance) -> Report {
    if !allowance.may_stop_for(Step::Reconnect) {
        return loose();
    }
    Report {
        is_stopped: true,
        ..with_offers(Report::default(), &[Step::Reconnect, Step::Divide])
    }
}

/// Kit that fails since a piece rattles far too much.
fn rattling_too_much() -> Report {
    with_offers(kit(1, 3.0), &[Step::Lengthen, Step::JoinRattling])
}

/// Job whose trials end as `reply` says from their number and what they are allowed. A trial takes `plan_s`,
/// and a kit `kit_s` on top.
struct Story {
    title: &'static str,
    ways: Vec<Way>,
    forbidden: Vec<Step>,
    n_keys: usize,
    time_s: f64,
    reply: fn(usize, &Agenda, &Allowance) -> Report,
}

impl Story {
    fn new(title: &'static str, reply: fn(usize, &Agenda, &Allowance) -> Report) -> Self {
        Self {
            title,
            ways: four_ways(),
            forbidden: Vec::new(),
            n_keys: 4,
            time_s: f64::INFINITY,
            reply,
        }
    }

    /// Trials in order: what each made, and the step that followed. Panics if the job does not end.
    fn run(&self) -> (Vec<(String, Option<Step>)>, bool) {
        const PLAN_S: f64 = 1.0;
        const KIT_S: f64 = 9.0;
        let gone_s = AtomicU64::new(0);
        let left = || self.time_s - gone_s.load(Relaxed) as f64;
        let ctx = Ctx::quiet().with_deadline(&left);
        let (rounds, forbidden) = (Rounds::default(), self.forbidden.clone());
        let mut agenda = Agenda::with(Clock::of_time(left()), self.ways.clone(), rounds, forbidden);
        agenda.set_keys(self.n_keys);
        let mut trials = Vec::new();
        for i in 0..1000 {
            let allowance = agenda.allowance(&ctx);
            let report = (self.reply)(i, &agenda, &allowance);
            let took_s = if report.kit.is_some() {
                PLAN_S + KIT_S
            } else {
                PLAN_S
            };
            gone_s.fetch_add(took_s as u64, Relaxed);
            let words = self.words(&agenda, &report);
            let next = agenda.next(&ctx, &report);
            trials.push((words, next));
            match next {
                None => return (trials, agenda.is_cut_short()),
                Some(step) if step.begins_wall() => agenda.set_keys(self.n_keys),
                Some(_) => {}
            }
        }
        panic!("{} does not end", self.title)
    }

    fn words(&self, agenda: &Agenda, report: &Report) -> String {
        let result = match report.kit {
            None if report.is_stopped => "kit given up",
            None if report.offers.is_empty() => "error",
            None if report.offers == [Step::Divide] => "no plan",
            None => "change",
            Some(grade) if grade.is_firm() => "firm kit",
            Some(grade) if grade.passes() => "kit that rattles",
            Some(grade) if grade.only_rattles => "kit that rattles too much",
            Some(_) => "loose kit",
        };
        format!(
            "way {}, load {}, wall {}, key {}: {result}",
            agenda.count(Step::NextWay) + 1,
            agenda.least_factor(),
            agenda.count(Step::Thicken),
            agenda.key() + 1
        )
    }
}

/// Offers the steps that make a plan stronger, as far as they are allowed; else the kit.
fn weak(allowance: &Allowance, else_kit: Report) -> Report {
    let steps = [Step::Enlarge, Step::Thicken, Step::JoinWeak];
    let offers: Vec<Step> = steps.into_iter().filter(|s| allowance.is_allowed(*s)).collect();
    if offers.is_empty() {
        else_kit
    } else {
        with_offers(Report::default(), &offers)
    }
}

fn stories() -> Vec<Story> {
    let labels = |story: Story| Story {
        ways: four_ways()[..1].to_vec(),
        forbidden: vec![Step::JoinWeak],
        ..story
    };
    vec![
        Story::new("the first kit is firm", |_, _, _| kit(0, 0.0)),
        Story::new("every kit comes loose", |_, _, _| loose()),
        Story::new("there is never a plan", |_, _, _| no_plan()),
        Story::new("nothing can be made", |_, _, _| Report::default()),
        Story::new("every kit passes and rattles", |_, _, _| kit_that_rattles()),
        Story::new("every kit rattles too much", |_, _, _| rattling_too_much()),
        Story::new(
            "every plan is weak and every kit comes loose",
            |_, _, allowance| weak(allowance, loose()),
        ),
        Story::new(
            "every plan is weak and the first kit is firm",
            |_, _, allowance| weak(allowance, kit(0, 0.0)),
        ),
        Story::new("pieces are always predicted to rattle", |_, _, allowance| {
            let steps = [Step::Lengthen, Step::JoinPredicted];
            let step = steps.into_iter().find(|step| allowance.is_allowed(*step));
            step.map_or(kit(0, 0.0), |step| with_offers(Report::default(), &[step]))
        }),
        Story::new(
            "every kit rattles and is given up where that is allowed",
            |_, _, allowance| stopped(allowance),
        ),
        Story::new(
            "connectors of every plan come out too short",
            |_, _, allowance| too_short(allowance),
        ),
        labels(Story::new(
            "labels are given and every kit comes loose",
            |_, _, _| loose(),
        )),
        Story {
            time_s: 60.0,
            ..Story::new("every kit comes loose, and a minute is given", |_, _, _| loose())
        },
        Story {
            n_keys: 1,
            ..labels(Story::new(
                "a piece is the key, and the third plan is firm",
                |i, _, _| {
                    if i < 2 { loose() } else { kit(0, 0.0) }
                },
            ))
        },
    ]
}

#[test]
fn trials_come_in_the_order_that_is_on_record() {
    let mut text = String::new();
    for story in stories() {
        let (trials, is_cut_short) = story.run();
        writeln!(text, "{}", story.title).expect("a string takes all");
        for (i, (words, step)) in trials.iter().enumerate() {
            let then = match step {
                Some(step) => step.words(),
                None if is_cut_short => "end, as the time is over",
                None => "end",
            };
            writeln!(text, "{:4}  {words}; {then}", i + 1).expect("a string takes all");
        }
        text.push('\n');
    }
    let on_record = include_str!("order.txt").replace('\r', "");
    assert!(
        text == on_record,
        "the order differs from agenda/order.txt; if that is meant, this is the new text:\n{text}"
    );
}

#[test]
fn no_step_is_taken_more_often_than_the_table_allows() {
    for story in stories() {
        let (trials, _) = story.run();
        // A kit that is given up costs half as much as one that is finished.
        let n_given_up = trials.iter().filter(|t| t.0.ends_with("given up")).count();
        let n_finished = trials.iter().filter(|t| t.0.contains("kit")).count() - n_given_up;
        assert!(n_finished <= 60, "{}: {n_finished} kits", story.title);
        let n_kits = 0.5 * n_given_up as f64 + n_finished as f64;
        assert!(n_kits <= 75.0, "{}: work of {n_kits} kits", story.title);
        for row in &TABLE {
            let mut n = 0;
            for step in trials.iter().filter_map(|trial| trial.1) {
                n += usize::from(step == row.step);
                if step != row.step && TABLE[step as usize].begins >= row.within {
                    n = 0;
                }
                let most = row.most[1].min(8);
                assert!(n <= most, "{}: {:?} {n} times", story.title, row.step);
            }
        }
    }
}

#[test]
fn nothing_follows_a_firm_kit() {
    for story in stories() {
        let (trials, _) = story.run();
        for (words, step) in &trials {
            assert!(
                !words.ends_with("firm kit") || step.is_none(),
                "{}: {words}",
                story.title
            );
        }
    }
}

#[test]
fn rows_of_the_table_stand_in_the_order_of_their_steps() {
    for (i, row) in TABLE.iter().enumerate() {
        assert_eq!(row.step as usize, i);
        assert!(
            row.within > row.begins,
            "{:?} would begin its own count anew",
            row.step
        );
    }
}

#[test]
fn of_two_kits_the_one_with_fewer_failures_is_better_then_the_one_that_rattles_less() {
    let grade = |n_failures, rattle| kit(n_failures, rattle).kit.expect("it is a kit");
    let inorder = [
        grade(0, 0.0),
        grade(0, 1.5),
        grade(1, 0.0),
        grade(1, 2.0),
        grade(2, 0.0),
    ];
    for (i, a) in inorder.iter().enumerate() {
        for (j, b) in inorder.iter().enumerate() {
            assert_eq!(a.is_better_than(b), i < j, "{i} {j}");
        }
    }
}

#[test]
fn the_first_way_has_twice_the_time_of_each_other() {
    let mut agenda = Agenda::with(Clock::of_time(50.0), four_ways(), Rounds::default(), Vec::new());
    let mut ends = Vec::new();
    for _ in 0..4 {
        ends.push(50.0 - agenda.reserved_s());
        agenda.counts[Step::NextWay as usize] += 1;
        if agenda.count(Step::NextWay) == 4 {
            break;
        }
    }
    assert_eq!(ends, [20.0, 30.0, 40.0, 50.0]);
}

#[test]
fn a_trial_that_no_time_is_left_for_is_reported_and_without_a_clock_nothing_is_late() {
    let with_time = |time_s| {
        let story = Story {
            time_s,
            ..Story::new("every kit comes loose", |_, _, _| loose())
        };
        let (trials, is_cut_short) = story.run();
        (trials.len(), is_cut_short)
    };
    let (n_all, is_cut_short) = with_time(f64::INFINITY);
    assert!(!is_cut_short);
    let mut n_before = 1;
    for time_s in [1.0, 30.0, 60.0, 120.0] {
        let (n, is_cut_short) = with_time(time_s);
        assert!(
            is_cut_short && (n_before..n_all).contains(&n),
            "{time_s} s: {n} of {n_all}"
        );
        n_before = n;
    }
}

#[test]
fn a_thicker_wall_is_tried_only_if_as_much_time_is_left_as_the_present_one_has_taken() {
    for (left_s, permit) in [(60.0, Permit::Yes), (40.0, Permit::Late)] {
        let left = || left_s;
        let ctx = Ctx::quiet().with_deadline(&left);
        let mut agenda = Agenda::with(
            Clock::of_time(100.0),
            four_ways()[..1].to_vec(),
            Rounds::default(),
            Vec::new(),
        );
        agenda.set_keys(4);
        assert_eq!(agenda.allowance(&ctx).permit(Step::Thicken), permit);
        let late = Report {
            late: agenda.allowance(&ctx).late(Step::Thicken),
            ..kit(0, 0.0)
        };
        agenda.next(&ctx, &late);
        assert_eq!(agenda.is_cut_short(), permit == Permit::Late);
    }
}

#[test]
fn a_change_before_a_kit_is_made_though_the_time_ends_and_then_no_more_are_allowed() {
    let gone_s = AtomicU64::new(0);
    let left = || 10.0 - gone_s.load(Relaxed) as f64;
    let ctx = Ctx::quiet().with_deadline(&left);
    let mut agenda = Agenda::with(
        Clock::of_time(left()),
        four_ways()[..1].to_vec(),
        Rounds::default(),
        Vec::new(),
    );
    agenda.set_keys(1);
    for step in [Step::Enlarge, Step::Lengthen, Step::JoinPredicted, Step::JoinWeak] {
        gone_s.store(0, Relaxed);
        assert!(agenda.allowance(&ctx).is_allowed(step));
        gone_s.store(20, Relaxed);
        let offer = with_offers(Report::default(), &[step]);
        assert_eq!(agenda.next(&ctx, &offer), Some(step));
    }
    let late = agenda.allowance(&ctx);
    assert!(!late.is_allowed(Step::Enlarge) && !late.is_allowed(Step::JoinPredicted));
    assert!(!agenda.is_cut_short(), "nothing was left out so far");
}

#[test]
fn a_kit_is_given_up_only_if_another_one_may_follow() {
    let (rounds, ways) = (Rounds::default(), four_ways());
    let agenda = || Agenda::with(Clock::of_time(f64::INFINITY), ways.clone(), rounds, Vec::new());
    let ctx = Ctx::quiet();
    let mut open = agenda();
    open.set_keys(4);
    // Two kits are allowed with the first key of the first way.
    for may_stop in [true, false] {
        let allowance = open.allowance(&ctx);
        assert_eq!(allowance.may_stop_for(Step::JoinRattling), may_stop);
        open.next(&ctx, &stopped(&allowance));
    }
    assert!(open.has_stopped_kits());
    let steps = [Step::JoinRattling, Step::Reconnect];
    let unstopped = agenda().without_stops().allowance(&ctx);
    assert!(steps.iter().all(|step| !unstopped.may_stop_for(*step)));
    let forbidden = vec![Step::JoinRattling];
    let mut labelled = Agenda::with(Clock::of_time(f64::INFINITY), ways.clone(), rounds, forbidden);
    assert!(!labelled.allowance(&ctx).may_stop_for(Step::JoinRattling));
}

#[test]
fn a_job_ends_with_a_kit_that_rattles_slightly() {
    let (trials, is_cut_short) = Story::new("slight rattle", |_, _, _| kit(0, 1.1)).run();
    assert_eq!((trials.len(), trials[0].1, is_cut_short), (1, None, false));
}
