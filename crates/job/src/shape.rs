//! Obstacles to a kit in a model's shape: an existing cavity, parts that are too thin, slits.

use shellock::strength::StrengthParams;
use shellock::verify::limits::LEAST_SLOT_MM;
use shellock_geom::hollow::{Filled, HollowBody, LEAST_SHARE, Opening, fill, find_hollow};
use shellock_geom::repair::{Repair, RepairKind};
use shellock_geom::slit::{Slit, slits};
use shellock_geom::thin::{ThinPlace, thin_places};
use shellock_geom::{Solid, Vec3};

use crate::failure::Failure;
use crate::model::Model;
use crate::options::{Options, Thickness};

/// Least share of the body's volume of a cavity that `--fill` fills. It is lower than the share at which a
/// model counts as hollow.
const LEAST_FILLED: f64 = 0.02;
/// Wall thickness, in walls of a kit, above which there is room for two walls and connectors between them.
const ROOM_WALLS: f64 = 4.0;
/// Number of openings, slits and thin places that are listed one by one.
const N_TOLD: usize = 3;

/// Handles a model that is already hollow. Fills it if the options ask for that. Otherwise notes that it
/// stays as it is if its wall is thick enough to be made hollow itself, and refuses it if not.
pub fn settle_hollow(model: &mut Model, options: &Options) -> Result<(), Failure> {
    let least_share = if options.fill { LEAST_FILLED } else { LEAST_SHARE };
    let Some(hollow) = find_hollow(&model.solid, least_share) else {
        if options.fill {
            let note = "--fill: the model is not hollow, so nothing was filled";
            model.notes.push(note.to_owned());
        }
        return Ok(());
    };
    if options.fill {
        let filled = fill(&model.solid, &hollow)
            .map_err(|e| Failure::Wrong(format!("{}: --fill: {e}", model.name)))?;
        take(model, filled, &hollow);
        return Ok(());
    }
    let told = format!(
        "the model is already hollow: its wall is {:.1} mm thick, and {} into its cavity of {}",
        hollow.wall_mm,
        leads(&hollow.openings),
        volume(hollow.cavity_mm3)
    );
    if hollow.wall_mm > ROOM_WALLS * wall_mm(options) {
        model.notes.push(format!(
            "{told}; the wall is thick enough to be made hollow itself (--fill closes the opening and uses \
             the solid shape instead)"
        ));
        return Ok(());
    }
    Err(Failure::Wrong(format!(
        "{}: {told}; use a solid model, or close the openings with --fill, which makes this one solid",
        model.name
    )))
}

/// Fills the body again if the kit with these repairs was made from a filled one; else returns it unchanged.
///
/// Fails if no cavity is found or it cannot be filled: a verdict on the hollow body would be on another
/// shape.
pub fn filled_again(solid: Solid, repairs: &[&str]) -> Result<Solid, String> {
    if !repairs.contains(&RepairKind::Drained { volume: 0.0 }.code()) {
        return Ok(solid);
    }
    let hollow = find_hollow(&solid, LEAST_FILLED).ok_or_else(|| {
        "the kit was made from a hollow model that was filled, but this model has no cavity: give the model \
         that the kit was made from"
            .to_owned()
    })?;
    fill(&solid, &hollow)
        .map(|filled| filled.solid)
        .map_err(|e| e.to_string())
}

/// Replaces the model's body by the filled one and adds a note.
fn take(model: &mut Model, filled: Filled, hollow: &HollowBody) {
    let source = &filled.source_face;
    model.file_face = source.iter().map(|&f| model.file_face[f as usize]).collect();
    let labels = model.labels.take();
    model.labels = labels.map(|labels| source.iter().map(|&f| labels[f as usize]).collect());
    model.solid = filled.solid;
    let openings = &hollow.openings;
    let n = match openings.len() {
        1 => "1 opening was".to_owned(),
        n => format!("{n} openings were"),
    };
    model.notes.push(format!(
        "{n} closed, {}, and the cavity of {} inside was filled (--fill)",
        places(openings, |o| format!(
            "{:.1} mm wide near {}",
            o.width_mm,
            place(o.at)
        )),
        volume(hollow.cavity_mm3)
    ));
    // Repairs are reported in the file's own units and coordinates.
    let scale = model.transform[0];
    let shift = Vec3::new(model.transform[3], model.transform[7], model.transform[11]);
    model.repairs.push(Repair {
        kind: RepairKind::Drained {
            volume: hollow.cavity_mm3 / scale.powi(3),
        },
        count: openings.len(),
        at: openings.first().map_or(Vec3::ZERO, |o| (o.at - shift) / scale),
    });
}

/// Warnings before a kit is made: thin parts and slits.
pub fn shape_warnings(model: &Model, options: &Options) -> Vec<String> {
    let mut warnings = thin_warnings(model, options);
    warnings.extend(slit_warning(model, options));
    warnings
}

/// Warns where a model is too thin for a cavity between two walls; empty if it is thick enough.
fn thin_warnings(model: &Model, options: &Options) -> Vec<String> {
    let wall_mm = wall_mm(options);
    let places = thin_places(&model.solid, 2.0 * wall_mm);
    let area_mm2: f64 = places.iter().map(|p| p.area_mm2).sum();
    let percent = 100.0 * area_mm2 / model.solid.mesh().area();
    // A share that rounds to 0 % is just a thin edge somewhere.
    if percent < 0.5 {
        return Vec::new();
    }
    let told = |p: &ThinPlace| {
        let [x, y, z] = p.at.to_array();
        format!("{:.2} mm at ({x:.1}, {y:.1}, {z:.1}) mm", p.thickness_mm)
    };
    let largest: Vec<String> = places.iter().take(N_TOLD).map(told).collect();
    let others = if places.len() > N_TOLD {
        format!(" and {} smaller places", places.len() - N_TOLD)
    } else {
        String::new()
    };
    vec![format!(
        "{percent:.1} % of the surface is thinner than two walls of {wall_mm} mm: {}{others}; it stays solid \
         there, without connectors: make the model larger or the wall thinner",
        largest.join(", ")
    )]
}

/// Warns of slits that are narrower than a seam needs, or than printers leave open.
fn slit_warning(model: &Model, options: &Options) -> Option<String> {
    let tolerance_mm = options
        .chosen_printer()
        .map_or(0.0, |printer| printer.tolerance_mm);
    let seam_mm = 2.0 * options.seam_gap.unwrap_or(tolerance_mm);
    let below_mm = seam_mm.max(LEAST_SLOT_MM);
    let found = slits(&model.solid, below_mm);
    let n = match found.len() {
        0 => return None,
        1 => "1 slit in the surface is".to_owned(),
        n => format!("{n} slits in the surface are"),
    };
    let told = |s: &Slit| {
        format!(
            "{:.2} mm wide near {}, {:.0} mm² large",
            s.width_mm,
            place(s.at),
            s.area_mm2
        )
    };
    Some(format!(
        "{n} narrower than {below_mm:.2} mm: {}; pieces on both sides have less room than a seam needs, and \
         may fuse in the print: close or widen it in a modelling program",
        places(&found, told)
    ))
}

/// Least wall thickness of the kit, mm.
pub fn wall_mm(options: &Options) -> f64 {
    match options.thickness {
        Thickness::Mm(mm) => mm,
        Thickness::Auto => StrengthParams::default().least_mm,
    }
}

/// Describes the openings as the subject of "leads into".
fn leads(openings: &[Opening]) -> String {
    let told = places(openings, |o| {
        format!("near {} ({:.1} mm wide)", place(o.at), o.width_mm)
    });
    match openings.len() {
        1 => format!("an opening {told} leads"),
        n => format!("{n} openings {told} lead"),
    }
}

/// Lists the first few places in words, and the number of those left out.
fn places<T>(all: &[T], told: impl Fn(&T) -> String) -> String {
    let first: Vec<String> = all.iter().take(N_TOLD).map(told).collect();
    let rest = match all.len().saturating_sub(N_TOLD) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    format!("{}{rest}", first.join(", "))
}

fn place(at: Vec3) -> String {
    // Adding 0 makes −0 a plain 0.
    let [x, y, z] = at.to_array().map(|mm| (10.0 * mm).round() / 10.0 + 0.0);
    format!("({x:.1}, {y:.1}, {z:.1}) mm")
}

/// Writes a volume in cm³, or in mm³ if it is below 1 cm³.
fn volume(mm3: f64) -> String {
    if mm3 >= 1000.0 {
        format!("{:.1} cm³", mm3 / 1000.0)
    } else {
        format!("{mm3:.0} mm³")
    }
}

#[cfg(test)]
mod tests {
    use shellock_geom::Volume;
    use shellock_testkit::shapes::{ball, brick};

    use super::*;

    /// A hollow ball with a square hole of 4 mm underneath, labelled in two halves, at twice the file's size.
    fn ball_with_drain() -> Model {
        let [outer, inner] = [30.0, 27.0].map(|r| Volume::from_closed_mesh(&ball(4, Vec3::ZERO, r)).unwrap());
        let hole = brick([-2.0, 2.0], [-2.0, 2.0], [-40.0, 0.0]);
        let solid = Solid::new(outer.subtract(&inner).subtract(&hole).to_mesh()).unwrap();
        let n_faces = solid.mesh().triangles.len();
        let labels = (0..n_faces).map(|f| i64::from(solid.mesh().face_center(f).z > 0.0));
        let mut transform = [0.0; 16];
        [0, 5, 10].into_iter().for_each(|i| transform[i] = 2.0);
        (transform[11], transform[15]) = (6.0, 1.0);
        Model {
            labels: Some(labels.collect()),
            file_face: (0..n_faces as u32).collect(),
            n_file_faces: n_faces,
            transform,
            name: "drained.stl".to_owned(),
            sha256: String::new(),
            notes: Vec::new(),
            warnings: Vec::new(),
            selection: shellock_formats::Selection::default(),
            repairs: Vec::new(),
            solid,
        }
    }

    #[test]
    fn a_filled_model_keeps_labels_and_faces_and_tells_of_it_in_both_units() {
        let mut model = ball_with_drain();
        let before = model.solid.clone();
        let hollow = find_hollow(&model.solid, LEAST_SHARE).unwrap();
        let filled = fill(&model.solid, &hollow).unwrap();
        take(&mut model, filled, &hollow);
        let mesh = model.solid.mesh();
        let labels = model.labels.unwrap();
        assert_eq!(
            (labels.len(), model.file_face.len()),
            (mesh.triangles.len(), mesh.triangles.len())
        );
        for (face, &label) in labels.iter().enumerate() {
            assert_eq!(label, i64::from(mesh.face_center(face).z > 0.0));
            let of = before.mesh().face_center(model.file_face[face] as usize);
            assert!(of.distance(mesh.face_center(face)) < 5.0);
        }
        let [repair] = model.repairs[..] else {
            panic!("one repair")
        };
        assert!((repair.at.z - (-30.0 - 6.0) / 2.0).abs() < 0.2, "{repair}");
        assert!(
            model.notes[0].contains("1 opening was closed, 4.5 mm wide near"),
            "{:?}",
            model.notes
        );
        // A model that was filled once is filled again in the same way.
        let kinds = [repair.kind.code()];
        assert!(filled_again(before.clone(), &kinds).as_ref() == Ok(&model.solid));
        assert!(filled_again(before.clone(), &[]).as_ref() == Ok(&before));
        // A body that cannot be filled again is refused.
        assert!(filled_again(model.solid, &kinds).is_err());
    }
}
