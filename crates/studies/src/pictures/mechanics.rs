//! Effects of forces: on the wall, along the seams, on the finished kit.

use std::collections::BTreeMap;
use std::path::PathBuf;

use shellock::PatchId;
use shellock::key::Turn;
use shellock::metric::MetricParams;
use shellock::strength::chart::{SeamStress, strength_chart};
use shellock::strength::{Strength, StressMap};
use shellock::stress_test::{StressParams, chart, stress_test};
use shellock_geom::{Solid, TriMesh, Vec3};
use shellock_render::stills::{Camera, Painted, render};
use shellock_volume::compare::{CompareError, compare};

use super::draw::{PALE, RED, color_bar, color_of, dots, plain, tube};
use super::kit::Kit;
use super::sheet::{Sheet, WIDTH, pixels, with_small_stills};
use crate::failure::Failure;
use crate::model::with_ctx;

/// Colour of a seam without a value.
const NONE: [u8; 3] = [120; 3];

fn strength_of(kit: &Kit) -> Result<&Strength, Failure> {
    kit.design.strength.as_ref().ok_or_else(|| Failure::Metric {
        metric: "strength".into(),
        problem: "it was not computed".into(),
    })
}

/// Shows the stress in the deciding fall, from the front and from behind.
pub fn stress(kit: &Kit) -> Result<Vec<u8>, Failure> {
    const VIEW: [f64; 2] = [WIDTH / 2.0, 380.0];
    let strength = strength_of(kit)?;
    let most = strength.stress_mpa;
    let mesh = &strength.mesh;
    let colors: Vec<[u8; 3]> = strength
        .deciding_mpa
        .iter()
        .zip(&strength.is_solid)
        .map(|(mpa, is_solid)| if *is_solid { [170; 3] } else { color_of(mpa / most) })
        .collect();
    let scene = [Painted {
        face_colors: Some(&colors),
        ..plain(mesh, PALE)
    }];
    let size = VIEW.map(pixels);
    let mut sheet = Sheet::new(VIEW[1] + 86.0);
    for (i, camera) in [Camera::front(), Camera::back()].into_iter().enumerate() {
        let left = i as f64 * VIEW[0];
        sheet.still([left, 4.0], render(&scene, &camera, size[0], size[1]));
    }
    let words = "von Mises stress; the scale ends where all but 0.5 % of the hollow wall stay below";
    let bar = [0.5 * WIDTH - 150.0, VIEW[1] + 14.0];
    color_bar(&mut sheet, bar, 300.0, &format!("{most:.1} MPa"), words);
    let (number, down) = strength.decisive_fall;
    let note = format!(
        "fall {} of {}, down along ({:.2}, {:.2}, {:.2}); wall of {:.2} mm; the material bears {} MPa; \
         grey: too thin to be hollow",
        number + 1,
        kit.settings.strength.n_cases,
        down.x,
        down.y,
        down.z,
        strength.thickness_mm,
        kit.settings.strength.material.strength_mpa
    )
    .replace('-', "\u{2212}");
    sheet.note([0.5 * WIDTH, VIEW[1] + 68.0], &note);
    Ok(sheet.bytes())
}

/// Draws the chart that every kit has as `strength.svg`.
pub fn strength(kit: &Kit) -> Result<Vec<u8>, Failure> {
    let strength = strength_of(kit)?;
    let map = StressMap::new(strength);
    let seams: Vec<SeamStress> = kit
        .design
        .kit
        .surface
        .seams()
        .into_iter()
        .map(|seam| SeamStress {
            stress_mpa: seam.points.iter().map(|p| map.at(*p)).collect(),
            size_mm: kit.design.kit.sizes.of(seam.a, seam.b),
            points: seam.points,
        })
        .collect();
    let bears = kit.settings.strength.material.strength_mpa;
    let chart = strength_chart(strength, bears, &seams, |v| v);
    Ok(with_small_stills(&chart).into_bytes())
}

/// Shows the opening of each seam by the surface metric, and the weakest place.
pub fn openings(kit: &Kit) -> Vec<u8> {
    const VIEW: [f64; 2] = [WIDTH / 2.0, 380.0];
    let made = &kit.design.kit;
    let weak: BTreeMap<[PatchId; 2], f64> = made
        .holding
        .seams
        .iter()
        .map(|s| ([s.later.min(s.earlier), s.later.max(s.earlier)], s.score_mm))
        .collect();
    let most = weak.values().copied().fold(f64::MIN_POSITIVE, f64::max);
    let lines: Vec<(TriMesh, [u8; 3])> = made
        .surface
        .seams()
        .iter()
        .map(|s| {
            let color = weak.get(&[s.a, s.b]).map_or(NONE, |mm| color_of(mm / most));
            (tube(&s.points, 1.1), color)
        })
        .collect();
    let mesh = &made.surface.mesh;
    let worst = made.holding.seams.iter().take(1);
    let spots = dots(worst.map(|s| Vec3::from_array(s.at)), 3.2);
    let mut scene: Vec<Painted<'_>> = lines.iter().map(|(line, color)| plain(line, *color)).collect();
    scene.push(plain(mesh, PALE));
    scene.push(plain(&spots, RED));
    let size = VIEW.map(pixels);
    let mut sheet = Sheet::new(VIEW[1] + 84.0);
    for (i, camera) in [Camera::front(), Camera::back()].into_iter().enumerate() {
        let left = i as f64 * VIEW[0];
        sheet.still([left, 4.0], render(&scene, &camera, size[0], size[1]));
    }
    let bar = [0.5 * WIDTH - 150.0, VIEW[1] + 14.0];
    let words = "greatest w d along the seams of a pair of pieces, as the surface metric has it";
    color_bar(&mut sheet, bar, 300.0, &format!("{most:.3} mm"), words);
    let note = "red: the weakest place of all; grey: seams without a connector";
    sheet.note([0.5 * WIDTH, VIEW[1] + 66.0], note);
    sheet.bytes()
}

/// Draws the chart of `shellock test --compare` with its defaults.
pub fn comparison(kit: &Kit) -> Result<Vec<u8>, Failure> {
    let made = &kit.design.kit;
    let (mut plan, mut turn) = (kit.settings.plan.clone(), Turn::default());
    if let Some(site) = &kit.design.key {
        plan.key = Some(made.plan.key());
        let (laid, along) = Turn::align(site.prism.normal, site.prism.slide);
        (turn, plan.key_slide) = (laid, Some(along));
    }
    let params = StressParams {
        metric: MetricParams::of_plan(&plan, &made.sizes, kit.settings.strength.material),
        sizes: made.sizes.clone(),
        plan,
        turn,
        ..StressParams::default()
    };
    let solids = made.pieces.iter().map(|(_, piece)| Solid::new(piece.clone()));
    let solids = solids
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| Failure::Model {
            path: PathBuf::from("squirrel"),
            problem: e.to_string(),
        })?;
    let report = with_ctx(|ctx| {
        let compared = compare(ctx, &params, &made.surface, &made.plan)?;
        let compared = Some(compared);
        stress_test(ctx, &params, &made.surface, &made.plan, &solids, compared).map_err(CompareError::Test)
    });
    let report = report.map_err(|e| Failure::Model {
        path: PathBuf::from("squirrel"),
        problem: e.to_string(),
    })?;
    Ok(chart(&report).into_bytes())
}
