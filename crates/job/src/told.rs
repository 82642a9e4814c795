//! Sentences on a finished kit for people.

use serde::Serialize;
use shellock::design::{Design, Effort, Settings, WallChoice};
use shellock::metric::Holding;
use shellock::plan::key::KeyDirections;
use shellock::plan::{PlanProof, ProofScope};
use shellock::strength::{Strength, StrengthParams};

use crate::options::Word;
use crate::place::Standing;

/// Lists what was tried, in order.
pub fn list_effort(effort: &Effort) -> String {
    let mut text = format!(
        "tried: {} keys, {} divisions, {} plans, {} kits",
        effort.keys, effort.segmentations, effort.plans, effort.kits
    );
    for (i, step) in effort.steps.iter().enumerate() {
        text += &format!("\n  {}. {step}", i + 1);
    }
    text
}

/// A kind of wall, with the mass that the kit has with it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WallKind {
    /// Word of the option `wall`.
    pub kind: &'static str,
    /// Thickness of the wall, mm.
    pub mm: f64,
    /// Mass of the pieces without supports, g. With another wall than the kit's it is estimated from the same
    /// pieces.
    pub grams: f64,
    /// True for the wall of the kit.
    pub is_own: bool,
}

/// Lists the three kinds of wall for a kit of `grams`; none if the user gave the thickness. A wall that was
/// made thicker for the sake of use is the least sturdy one, too.
pub fn wall_kinds(design: &Design, grams: f64) -> Vec<WallKind> {
    let (Some(walls), Some(strength)) = (design.walls, design.strength.as_ref()) else {
        return Vec::new();
    };
    let own_mm = design.kit.thickness_mm;
    let g_per_mm = strength.hollow_mm2() * design.settings.strength.material.density_g_cm3 / 1000.0;
    let kind = |(wall, kind, _): (WallChoice, &'static str, &str)| {
        let mm = match wall {
            WallChoice::Light => walls.light_mm.min(own_mm),
            WallChoice::Standard => walls.standard_mm,
            WallChoice::Sturdy => walls.sturdy_mm.max(own_mm),
        };
        let is_own = wall == walls.wanted;
        let mm = if is_own { own_mm } else { mm };
        WallKind {
            kind,
            mm,
            grams: grams + g_per_mm * (mm - own_mm),
            is_own,
        }
    };
    WallChoice::all().into_iter().map(kind).collect()
}

/// Describes the kinds of wall in one line for people.
pub fn wall_words(kinds: &[WallKind]) -> Option<String> {
    let words = kinds.iter().map(|wall| {
        let WallKind { kind, mm, grams, .. } = wall;
        match wall.is_own {
            true => format!("{kind} {mm:.1} mm, {grams:.0} g (this kit)"),
            false => format!("{kind} {mm:.1} mm, about {grams:.0} g"),
        }
    });
    let words: Vec<String> = words.collect();
    (!words.is_empty()).then(|| words.join("; "))
}

/// Describes the wall's stress in a fall.
pub fn bearing(strength: &Strength, settings: &Settings, standing: &Standing) -> String {
    let StrengthParams { drop_m, material, .. } = &settings.strength;
    let hollow = 100.0 * (1.0 - strength.solid_share());
    // Where little is hollow, the stress was computed on little of the surface.
    let judged = if hollow < 80.0 {
        format!(" (judged on the {hollow:.0} % of the surface that is hollow)")
    } else {
        String::new()
    };
    format!(
        "in a fall from {drop_m} m, the stress in the wall{judged} reaches {:.0} MPa; the material's \
         strength is {:.0} MPa ({})",
        strength.stress_mpa,
        material.strength_mpa,
        standing.words(strength.at.to_array())
    )
}

/// Describes the quality of a plan: its cost, and the bounds that are proven.
pub fn quality(proof: &PlanProof) -> String {
    let PlanProof {
        cost,
        lower_bound,
        gap,
        least_cost,
        key_lower_bound,
        ..
    } = proof;
    let scope = scope(proof);
    // A bound that reaches the least known cost is a proof; any remaining difference is rounding.
    let is_met = |bound: &f64| *bound >= least_cost * (1.0 - 1e-9);
    let chosen = match least_cost < cost {
        true => {
            format!("{cost:.3}; this plan holds better than the one of least cost, {least_cost:.3}, which is")
        }
        false => format!("{cost:.3},"),
    };
    if is_met(lower_bound) {
        return format!("plan: its worst piece costs {chosen} proven to be the least with {scope}");
    }
    let of_key = if is_met(key_lower_bound) {
        " the least with its key;"
    } else {
        " not proven to be the least;"
    };
    let percent = 100.0 * gap;
    format!(
        "plan: its worst piece costs {chosen}{of_key} no plan with {scope} costs less than {lower_bound:.3} \
         ({percent:.1} % below)"
    )
}

/// Describes the set of plans that a proof covers.
pub fn scope(proof: &PlanProof) -> String {
    let ProofScope {
        keys,
        slides,
        n_lessons,
    } = &proof.proven_for;
    let who = match &keys[..] {
        [key] => format!("piece {key} as the key"),
        all if all.len() == proof.piece_costs.len() => "any piece as the key".into(),
        some => {
            let mut names: Vec<String> = some.iter().map(ToString::to_string).collect();
            let last = names.pop().unwrap_or_default();
            format!("piece {} or {last} as the key", names.join(", "))
        }
    };
    let how = match slides {
        KeyDirections::WithinPlane => "within its plane",
        KeyDirections::OutOfPlane => "out of its plane",
    };
    let lessons = match n_lessons {
        0 => String::new(),
        1 => ", under one constraint learned from failed kits".into(),
        n => format!(", under {n} constraints learned from failed kits"),
    };
    format!("{who}, sliding {how}{lessons}")
}

/// Describes the weakest places of a plan: its weakest seam, and each piece that comes apart.
pub fn weakest(holding: &Holding, standing: &Standing) -> Vec<String> {
    let seam = holding.seams.first().map(|s| {
        let (later, earlier, opening_mm) = (s.later, s.earlier, s.opening_mm);
        let at = standing.words(s.at);
        format!(
            "weakest seam ({at}): pieces {later} and {earlier} open by {opening_mm:.2} mm at 10 N/m: {}",
            s.reason
        )
    });
    let loose = holding.loose.iter().map(|l| {
        format!(
            "comes apart at 10 N/m: piece {}, {}",
            l.piece,
            standing.words(l.at)
        )
    });
    seam.into_iter().chain(loose).collect()
}

/// Describes the precision that a printer needs; `None` if surfaces cross, which has its own warning.
pub fn fits(made: &Design) -> Option<String> {
    let within_mm = made.fit.within_mm.filter(|mm| *mm > 0.0)?;
    let least_mm = 2.0 * within_mm;
    let as_drawn = |piece| made.kit.play.estimates[piece].map_or(f64::INFINITY, |play| play.translation_mm);
    let thin = match made.fit.loosest {
        Some((piece, play)) if play.translation_mm.is_finite() => format!(
            "; if all are undersize by as much, piece {piece} has about {:.1} mm of play instead of {:.1} \
             mm",
            play.translation_mm,
            as_drawn(piece)
        ),
        Some((piece, _)) => format!("; if all are undersize by as much, piece {piece} comes loose"),
        None => String::new(),
    };
    Some(format!(
        "fits together if printed faces are oversize by {within_mm:.2} mm at most (the smallest gap is \
         {least_mm:.2} mm){thin}"
    ))
}
