//! Loads that a kit can take, in words for the person who makes it.

use shellock::handling::{DROP_MM, Deed, Failure};
pub use shellock::metric::BY_SIMULATION;
use shellock::metric::{Bears, GivesWay, Holding, LoadBorne, MOST_TIMES, Told};

use crate::place::Standing;

/// Weight of one kilogram, N.
const N_PER_KG: f64 = 9.80665;

/// Load factors below this share count as none: almost nothing holds.
const HARDLY: f64 = 0.05;

/// Writes a force, N, as the mass in kilograms that weighs as much.
fn newtons(n: f64) -> String {
    let kg = n / N_PER_KG;
    if kg < 9.95 {
        format!("{kg:.1} kg")
    } else {
        format!("{kg:.0} kg")
    }
}

fn metres(m: f64) -> String {
    if m < 1.0 {
        format!("{:.0} cm", 100.0 * m)
    } else {
        format!("{m:.1} m")
    }
}

/// Lists the loads that a kit can take: what is done to it, and the largest figure.
pub fn figures(bears: &Bears) -> Vec<(&'static str, String)> {
    let mut all = vec![(
        "press on the top",
        bears.top_n.map_or("not possible".to_owned(), newtons),
    )];
    all.extend(bears.middle_n.map(|n| ("press on the middle", newtons(n))));
    all.extend(
        bears
            .sides_n
            .map(|n| ("press while lying on its side", newtons(n))),
    );
    all.extend(bears.grip_n.map(|n| ("grip with two fingers", newtons(n))));
    all.extend(
        bears
            .fall_upright_m
            .map(|m| ("fall onto its feet from", metres(m))),
    );
    all.extend(bears.fall_m.map(|m| ("fall onto any side from", metres(m))));
    all
}

/// Writes the same figures in one line, and in a second line where the kit fails first in use.
pub fn lines(holding: &Holding, standing: &Standing) -> Vec<String> {
    let Some(bears) = &holding.summary() else {
        return Vec::new();
    };
    let said: Vec<String> = figures(bears)
        .into_iter()
        .map(|(what, much)| format!("{what} {much}"))
        .collect();
    let mut lines = vec![format!("largest loads ({BY_SIMULATION}): {}", said.join(", "))];
    lines.extend(weakest(holding, standing).map(|w| format!("fails first {w}")));
    lines
}

/// Describes the use under which a kit fails first, how it fails and where. `None` if nothing fails.
pub fn weakest(holding: &Holding, standing: &Standing) -> Option<String> {
    let worst = holding.weakest_use()?;
    let first = worst.first?;
    Some(format!(
        "when {}: {} ({})",
        worst.deed.words(),
        gives_way(&first),
        standing.words(first.at)
    ))
}

/// Describes how a kit fails.
pub fn gives_way(first: &GivesWay) -> String {
    let [a, b] = first.between;
    match first.how {
        Failure::Opens => format!("the seam between pieces {a} and {b} opens"),
        Failure::PinYields => format!("the pins between pieces {a} and {b} bend"),
        Failure::WallYields => format!("the walls of pieces {a} and {b} yield"),
    }
}

/// Name of a load in a list, before its figure.
pub fn load_name(told: Told) -> &'static str {
    match told {
        Told::Top => "press on the top",
        Told::Middle => "press on the middle",
        Told::Side => "press while lying on its side",
        Told::GripNarrow => "grip where narrow",
        Told::GripWide => "grip where wide",
        Told::Feet => "fall onto its feet from",
        Told::AnySide => "fall onto any side from",
        Told::Lifted => "lift by one piece, weight",
    }
}

/// Load factor, capped at [`MOST_TIMES`]; larger ones make no difference to anybody.
pub fn cap_factor(borne: &LoadBorne) -> f64 {
    borne.factor.unwrap_or(MOST_TIMES).min(MOST_TIMES)
}

/// Figure of a load: the mass or the height of fall that the kit can take.
pub fn figure(borne: &LoadBorne) -> String {
    let factor = cap_factor(borne);
    let much = match borne.deed {
        Deed::FallUpright | Deed::Fall { .. } => metres(1e-3 * DROP_MM * factor * factor),
        _ => newtons(factor * borne.force_n),
    };
    if factor < HARDLY {
        "comes apart".to_owned()
    } else if factor < MOST_TIMES {
        much
    } else {
        format!("more than {much}")
    }
}

/// Sentence that says what happens under the largest load that the kit can take.
pub fn sentence(as_told: Told, borne: &LoadBorne) -> String {
    let what = load_name(as_told)
        .trim_end_matches(" from")
        .trim_end_matches(", weight");
    let is_fall = matches!(borne.deed, Deed::FallUpright | Deed::Fall { .. });
    let with = if is_fall { "from" } else { "with" };
    let (figure, factor) = (figure(borne), cap_factor(borne));
    match &borne.first {
        Some(first) if factor < HARDLY => {
            format!(
                "{what}: fails under almost no load: {}; {BY_SIMULATION}",
                gives_way(first)
            )
        }
        Some(first) if factor < MOST_TIMES => {
            format!(
                "{what} {with} {figure}: beyond that, {}; {BY_SIMULATION}",
                gives_way(first)
            )
        }
        None if factor < HARDLY => format!("{what}: the kit comes apart; {BY_SIMULATION}"),
        _ => format!("{what}: nothing fails, it can take {figure}; {BY_SIMULATION}"),
    }
}
