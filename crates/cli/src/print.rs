//! Printing to the terminal: the report on a finished kit, warnings, checks and failures.

use shellock::design::{Design, Settings};
use shellock::verify::Verification;
use shellock::verify::words::PlaceWords;
use shellock::{Severity, Warning, WarningEntry, play};
use shellock_job::bears_lines;
use shellock_job::input::Model;
use shellock_job::output::{Destination, Summary};
use shellock_job::place::Standing;
use shellock_job::printing::Printing;
use shellock_job::told::{bearing, fits, list_effort, quality, wall_kinds, wall_words, weakest};

use crate::Session;
use crate::progress::Shown;

/// Number of warnings and notes that the short report shows; it shows all problems.
const MOST_TOLD: usize = 5;

/// A finished kit, with everything that its report needs.
pub struct Finished<'a> {
    pub to: &'a Destination,
    pub design: &'a Design,
    pub settings: &'a Settings,
    pub summary: &'a Summary,
    pub warnings: &'a [Warning],
    pub upright: &'a Standing,
    pub printing: &'a Printing,
}

impl Finished<'_> {
    /// Prints the whole report for people: figures, warnings, and one verdict at the end.
    pub fn print(&self, session: &Session) {
        let (made, standing) = (self.design, self.upright);
        let verdict = &made.kit.verification;
        println!(
            "{} pieces, piece {} is the key; walls {:.1} mm; {:.0} % of the solid model's material",
            made.kit.pieces.len(),
            made.kit.plan.key(),
            made.kit.thickness_mm,
            100.0 * self.summary.volume_ratio
        );
        if verdict.has_passed() || session.is_verbose {
            self.print_figures(session);
        }
        print_checks(verdict, session.is_verbose);
        print_warnings(session, self.warnings, standing);
        if verdict.has_passed() {
            println!("{}", self.printing.words());
            println!(
                "written to {}: print plates.3mf; report.html shows how it goes together",
                self.to.folder().display()
            );
        } else {
            println!(
                "written to {}; report.html shows what failed",
                self.to.folder().display()
            );
            print_failures(verdict, standing);
            eprintln!(
                "What may help: another number of pieces (--pieces), a larger model (--size), your own \
                 labels (--labels), or more time (--time)."
            );
        }
    }

    fn print_figures(&self, session: &Session) {
        let (made, standing) = (self.design, self.upright);
        if let Some(words) = wall_words(&wall_kinds(made, self.summary.grams)) {
            println!("walls: {words} (--wall)");
        }
        bears_lines(&made.kit.holding, standing)
            .into_iter()
            .for_each(|line| println!("{line}"));
        println!("play of the pieces: {}", play::words(&made.kit.play));
        if let Some(line) = fits(made) {
            println!("{line}");
        }
        if !session.is_verbose {
            return;
        }
        if let Some(strength) = &made.strength {
            println!("{}", bearing(strength, self.settings, standing));
        }
        println!("{}", quality(&made.kit.proof));
        weakest(&made.kit.holding, standing)
            .into_iter()
            .for_each(|line| println!("{line}"));
        println!(
            "connectors on {:.0} % of the seam length that has room for them",
            100.0 * self.summary.connector_share
        );
        println!("{}", list_effort(&made.effort));
    }
}

/// Lines for `warnings`: the most important ones, each with its place, and the number of those left out.
fn warning_lines(warnings: &[Warning], is_verbose: bool, standing: &Standing) -> Vec<String> {
    let ranked = Warning::rank(warnings);
    let n_problems = ranked.partition_point(|w| w.severity() == Severity::Problem);
    let n_told = if is_verbose {
        ranked.len()
    } else {
        n_problems.max(MOST_TOLD).min(ranked.len())
    };
    let line = |w: &Warning| {
        let place =
            w.at.map_or_else(String::new, |at| format!(" [{}]", standing.words(at)));
        format!("{}: {}{place}", w.severity(), sentence(w))
    };
    let mut lines: Vec<String> = ranked[..n_told].iter().map(line).collect();
    let n_notes = ranked[n_told..]
        .iter()
        .filter(|w| w.severity() == Severity::Note)
        .count();
    let counted = |n: usize, what: &str| match n {
        0 => None,
        1 => Some(format!("1 {what}")),
        n => Some(format!("{n} {what}s")),
    };
    let rest = [
        counted(ranked.len() - n_told - n_notes, "warning"),
        counted(n_notes, "note"),
    ];
    let rest: Vec<String> = rest.into_iter().flatten().collect();
    if !rest.is_empty() {
        lines.push(format!("and {} more (--verbose shows all)", rest.join(" and ")));
    }
    lines
}

/// Sentence of a warning, followed by the options that change it.
pub fn sentence(warning: &Warning) -> String {
    WarningEntry::from(warning.clone()).sentence_with(|name| format!("--{name}"))
}

/// Prints warnings on how the model's file was read, before anything else. They go to standard output, or to
/// standard error in quiet mode. With JSON they are part of the result instead.
pub fn print_input_warnings(session: &Session, model: &Model) {
    for warning in &model.warnings {
        match session.progress_form {
            Shown::ForPeople => println!("{}: {}", warning.severity(), sentence(warning)),
            Shown::Nothing if !session.is_json => {
                eprintln!("{}: {}", warning.severity(), sentence(warning));
            }
            _ => {}
        }
    }
}

/// Prints the [`warning_lines`] on standard output.
pub fn print_warnings(session: &Session, warnings: &[Warning], standing: &Standing) {
    warning_lines(warnings, session.is_verbose, standing)
        .iter()
        .for_each(|line| println!("{line}"));
}

/// Prints every check if `is_verbose`; else those that failed, or a line that says that all passed.
fn print_checks(verdict: &Verification, is_verbose: bool) {
    if verdict.has_passed() && !is_verbose {
        println!("all {} checks passed", verdict.checks.len());
        return;
    }
    for c in verdict.checks.iter().filter(|c| is_verbose || !c.ok) {
        println!(
            "{}  {:52} {}",
            if c.ok { "ok  " } else { "FAIL" },
            c.name,
            c.figure
        );
    }
}

/// Prints every check, and then prominently each failure with its place.
pub fn print_verdict(verdict: &Verification, words: &dyn PlaceWords) {
    print_checks(verdict, true);
    print_failures(verdict, words);
}

/// Prints each failure with its place on standard error, if there is any.
pub fn print_failures(verdict: &Verification, words: &dyn PlaceWords) {
    if !verdict.has_passed() {
        eprintln!(
            "FAILED: this kit does not hold together as it should; do not print it. Failures and their \
             places:"
        );
        for finding in &verdict.findings {
            eprintln!("  {}", finding.describe(words));
        }
    }
}
