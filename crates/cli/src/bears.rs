//! What a kit bears, in a maker's words.

use shellock::handling::Failure;
use shellock::metric::{Bears, Holding};

use crate::place::Standing;

/// Said wherever figures of the simulation stand.
pub const BY_SIMULATION: &str = "by simulation, without a print to compare";

/// Newtons that a kilogram weighs.
const N_PER_KG: f64 = 9.80665;

/// What it bears, one thing each: what is done, and how much of it.
pub fn figures(bears: &Bears) -> Vec<(&'static str, String)> {
    let newtons = |n: f64| format!("{n:.0} N ({:.1} kg)", n / N_PER_KG);
    let metres = |m: f64| {
        if m < 1.0 {
            format!("{:.0} cm", 100.0 * m)
        } else {
            format!("{m:.1} m")
        }
    };
    let mut all = vec![(
        "pressed on its top",
        bears
            .top_n
            .map_or("too narrow there, or it would tip over".to_owned(), newtons),
    )];
    all.extend(bears.middle_n.map(|n| ("pressed on its middle", newtons(n))));
    all.extend(
        bears
            .sides_n
            .map(|n| ("pressed on its sides as it lies", newtons(n))),
    );
    all.extend(bears.grip_n.map(|n| ("gripped by two fingers", newtons(n))));
    all.extend(
        bears
            .fall_upright_m
            .map(|m| ("falls onto its feet from", metres(m))),
    );
    all.extend(bears.fall_m.map(|m| ("falls onto any side from", metres(m))));
    all
}

/// The same in a line, and where it gives way first when it is used.
pub fn lines(holding: &Holding, standing: &Standing) -> Vec<String> {
    let Some(bears) = &holding.summary() else {
        return Vec::new();
    };
    let said: Vec<String> = figures(bears)
        .into_iter()
        .map(|(what, much)| format!("{what} {much}"))
        .collect();
    let mut lines = vec![format!("bears, {BY_SIMULATION}: {}", said.join(", "))];
    lines.extend(weakest(holding, standing).map(|w| format!("gives way first {w}")));
    lines
}

/// What matters most, for the booklet: two lines.
pub fn short(holding: &Holding) -> Vec<String> {
    let Some(bears) = holding.summary() else {
        return Vec::new();
    };
    let said: Vec<String> = figures(&bears)
        .into_iter()
        .filter(|(what, _)| !what.contains("gripped") && !what.contains("any side"))
        .map(|(what, much)| format!("{what} {much}"))
        .collect();
    vec![
        format!("bears: {}", said.join(", ")),
        format!("({BY_SIMULATION})"),
    ]
}

/// Under which use a kit gives way first, how and where.
pub fn weakest(holding: &Holding, standing: &Standing) -> Option<String> {
    let worst = holding.weakest_use()?;
    let first = worst.first?;
    let [a, b] = first.between;
    let how = match first.how {
        Failure::Opens => format!("the seam of pieces {a} and {b} opens"),
        Failure::PinYields => format!("pins between pieces {a} and {b} bend"),
        Failure::WallYields => format!("walls at pieces {a} and {b} yield"),
    };
    Some(format!(
        "where it is {}: {how} ({})",
        worst.deed.done(),
        standing.words(first.at)
    ))
}
