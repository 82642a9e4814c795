//! Conversion of a design to the contents of its file.

use std::collections::BTreeSet;

use shellock::design::{Design, Settings};
use shellock::key::KeySite;
use shellock::strength::Strength;
use shellock_assembly::verify::Play;
use shellock_assembly::verify::clearance::PathGap;
use shellock_geom::repair::{Repair, RepairKind};
use shellock_print::time::{Cost, whole_words};
use shellock_print::{Plates, Printer, Process};
use shellock_report::{PatchId, Warning};

use super::{
    ContactEntry, FORMAT, GapsEntry, InputEntry, JointEntry, KeyEntry, LaidEntry, LoosestEntry,
    PairSizeEntry, PieceEntry, PlanFile, PlayEntry, PrintingEntry, RattleEntry, RepairEntry, SolidEntry,
    StrengthEntry, TimeEntry, TriedEntry, VERSION, VerdictEntry,
};

/// File of the model that a kit was made from.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// Name of the file, without folders.
    pub file: &'a str,
    /// SHA-256 of the file's bytes, in lower-case hexadecimal digits.
    pub sha256: &'a str,
    /// Transform from the file's coordinates to mm: 4 × 4, row by row.
    pub transform: [f64; 16],
    /// Object of the file that was taken, if one was chosen.
    pub object: Option<&'a str>,
    /// Plate of the slicer's project that was taken, if one was chosen.
    pub plate: Option<&'a str>,
    /// Repairs that made one body of it.
    pub repairs: &'a [Repair],
}

/// Facts about a kit that its design does not know.
#[derive(Clone, Debug)]
pub struct Told<'a> {
    /// Version of the program.
    pub program: &'a str,
    /// File of the model.
    pub source: Source<'a>,
    /// Warnings for the user.
    pub warnings: &'a [Warning],
    /// Material of all pieces divided by that of the solid model.
    pub volume_ratio: f64,
    /// Length of connectors made divided by the length that the seams' geometry allows, in [0, 1].
    pub connector_share: f64,
    /// Share of each piece's volume that is thinner than the thinnest wall, in [0, 1].
    pub thin_shares: &'a [f64],
    /// Layout of the pieces on plates.
    pub printing: PrintingEntry,
}

/// Path of a piece's mesh within the kit.
pub fn piece_file(piece: PatchId) -> String {
    format!("pieces/piece-{:02}.stl", piece.number())
}

impl PlanFile {
    /// Collects the contents of the file of a design.
    pub fn of(settings: &Settings, design: &Design, told: &Told<'_>) -> Self {
        let kit = &design.kit;
        Self {
            format: Some(FORMAT.to_owned()),
            version: Some(VERSION),
            units: Some("mm".to_owned()),
            program: Some(told.program.to_owned()),
            input: Some(InputEntry::of(&told.source)),
            seed: settings.plan.seed,
            shell_thickness: Some(kit.thickness_mm),
            strength: design.strength.as_ref().map(|s| StrengthEntry::of(s, settings)),
            clearance: settings
                .connector
                .clearance_mm
                .max(2.0 * settings.body.seam_gap_mm),
            connector_size: Some(kit.sizes.largest_mm()),
            connector_sizes: pair_sizes(design),
            wall_gap: Some(settings.body.seam_gap_mm),
            up: Some(settings.plan.up),
            min_wall: Some(settings.connector.min_wall_mm),
            key_piece: Some(kit.plan.key()),
            key: design.key.as_ref().map(|key| KeyEntry::of(design, key)),
            press_fits: kit.press_fits.clone(),
            pieces: pieces(design, told.thin_shares),
            installation_order: kit.plan.steps.iter().map(|s| s.piece).collect(),
            plan: Some(kit.proof.clone()),
            holding: Some(kit.holding.clone()),
            bears: kit.holding.summary(),
            volume_ratio: Some(told.volume_ratio),
            connector_share: Some(told.connector_share),
            joints: joints(design),
            contacts: contacts(design),
            gaps: Some(GapsEntry::of(design)),
            effort: Some(design.effort.clone()),
            verification: Some(VerdictEntry {
                passed: kit.verification.has_passed(),
                checks: kit.verification.checks.clone(),
                findings: Some(kit.verification.findings.clone()),
            }),
            warnings: told.warnings.iter().cloned().map(Into::into).collect(),
            printing: Some(told.printing.clone()),
        }
    }
}

fn pair_sizes(design: &Design) -> Option<Vec<PairSizeEntry>> {
    let pairs = design.kit.sizes.pairs();
    let sizes: Vec<PairSizeEntry> = pairs
        .map(|(pieces, size_mm)| PairSizeEntry { pieces, size_mm })
        .collect();
    (!sizes.is_empty()).then_some(sizes)
}

fn pieces(design: &Design, thin_shares: &[f64]) -> Vec<PieceEntry> {
    let (plan, contacts) = (&design.kit.plan, &design.kit.contacts);
    let neighbours = |p: PatchId| -> BTreeSet<PatchId> {
        let other = |later: PatchId, earlier: PatchId| {
            if later == p {
                Some(earlier)
            } else {
                (earlier == p).then_some(later)
            }
        };
        contacts
            .iter()
            .filter_map(|c| other(c.later, c.earlier))
            .collect()
    };
    let piece = |(p, mesh): (PatchId, &shellock_geom::TriMesh)| PieceEntry {
        id: p,
        file: Some(piece_file(p)),
        neighbors: neighbours(p).into_iter().collect(),
        volume_mm3: Some(mesh.signed_volume()),
        // Adding 0 removes the minus sign of zeros.
        installation_direction: (-plan.separation(p).unit() + 0.0).to_array(),
        n_triangles: Some(mesh.triangles.len()),
        thin_share: thin_shares.get(usize::from(p)).copied(),
        thin_places: design.thin[p].clone(),
        rattle: RattleEntry::of(design, p),
    };
    design.kit.pieces.iter().map(piece).collect()
}

fn joints(design: &Design) -> Vec<JointEntry> {
    let joints = design.kit.joints.iter();
    joints
        .map(|j| JointEntry {
            male: j.male,
            female: j.female,
            length_mm: j.length_mm,
            volume_mm3: j.volume_mm3,
            kept: j.intact_share,
            at: j.at.to_array(),
        })
        .collect()
}

fn contacts(design: &Design) -> Vec<ContactEntry> {
    let contacts = design.kit.contacts.iter();
    contacts
        .map(|c| ContactEntry {
            later: c.later,
            earlier: c.earlier,
            length_mm: c.length_mm,
            usable_mm: c.usable_mm,
            at: c.at.to_array(),
        })
        .collect()
}

impl InputEntry {
    fn of(source: &Source<'_>) -> Self {
        Self {
            file: source.file.to_owned(),
            sha256: source.sha256.to_owned(),
            transform: source.transform,
            largest_only: source.repairs.iter().any(|r| r.kind == RepairKind::LeftOut),
            object: source.object.map(str::to_owned),
            plate: source.plate.map(str::to_owned),
            repairs: source.repairs.iter().map(RepairEntry::of).collect(),
        }
    }
}

impl RepairEntry {
    /// Entry of a repair to a surface, in the file's units.
    pub fn of(repair: &Repair) -> Self {
        Self {
            kind: repair.kind.code().to_owned(),
            count: repair.count,
            at: repair.at.to_array(),
            message: repair.to_string(),
        }
    }
}

impl StrengthEntry {
    fn of(strength: &Strength, settings: &Settings) -> Self {
        let tried = strength.trials.iter().map(|t| TriedEntry {
            thickness_mm: t.thickness_mm,
            stress_mpa: t.stress_mpa,
        });
        let solid = strength.solid.iter().map(|s| SolidEntry {
            area_mm2: s.area_mm2,
            at: s.at,
        });
        Self {
            material: Some(settings.strength.material),
            drop_m: settings.strength.drop_m,
            n_falls: settings.strength.n_cases,
            stress_mpa: strength.stress_mpa,
            is_too_weak: strength.is_too_weak,
            at: strength.at.to_array(),
            deciding_fall: strength.decisive_fall.0 + 1,
            down: strength.decisive_fall.1.to_array(),
            tried: tried.collect(),
            solid: solid.collect(),
        }
    }
}

impl KeyEntry {
    fn of(design: &Design, key: &KeySite) -> Self {
        Self {
            rails: design.kit.rails_mm(),
            area_mm2: key.area_mm2,
            flat_share: key.flat_share,
            side_share: key.side_share,
            slide: key.prism.slide.to_array(),
            plane_normal: key.prism.normal.to_array(),
        }
    }
}

impl From<Play> for PlayEntry {
    fn from(play: Play) -> Self {
        Self {
            translation_mm: play.translation_mm,
            rotation_deg: play.rotation_deg,
            is_proven: play.is_proven,
        }
    }
}

impl RattleEntry {
    fn of(design: &Design, piece: PatchId) -> Option<Self> {
        let play = &design.kit.play;
        let alone = play.alone[piece]?;
        let together = play.together.as_ref();
        Some(Self {
            translation_mm: alone.translation_mm,
            rotation_deg: alone.rotation_deg,
            is_proven: alone.is_proven,
            together: together.map(|all| all[piece].map(PlayEntry::from)),
        })
    }
}

impl GapsEntry {
    fn of(design: &Design) -> Self {
        fn least(gaps: impl Iterator<Item = f64>) -> Option<f64> {
            gaps.min_by(f64::total_cmp)
        }
        let (pairs, paths) = (&design.gaps.pairs, &design.gaps.paths);
        let key = design.kit.plan.key();
        let beneath = |p: &PathGap| p.beneath_rim.map(|place| place.gap_mm);
        let at_rest_beneath = pairs.iter().filter_map(|p| p.beneath_rim);
        let of_key = paths.iter().filter(|p| p.piece == key);
        Self {
            at_rest_mm: least(pairs.iter().map(|p| p.overall.gap_mm)),
            at_rest_beneath_rim_mm: least(at_rest_beneath.map(|place| place.gap_mm)),
            on_the_way_mm: least(paths.iter().map(|p| p.overall.gap_mm)),
            on_the_way_beneath_rim_mm: least(paths.iter().filter_map(beneath)),
            key_on_the_way_beneath_rim_mm: least(of_key.filter_map(beneath)),
            fits_within_mm: design.fit.within_mm,
            loosest_if_thin: design.fit.loosest.map(|(piece, play)| LoosestEntry {
                piece,
                translation_mm: Some(play.translation_mm).filter(|mm| mm.is_finite()),
                rotation_deg: Some(play.rotation_deg).filter(|deg| deg.is_finite()),
            }),
        }
    }
}

impl PrintingEntry {
    /// Entry of the pieces on `plates` of `printer`. `cost` is the estimate for all plates and `whole` that
    /// for the whole model, if the printer can make it.
    pub fn of(printer: &Printer, plates: &Plates, cost: Cost, whole: Option<Cost>) -> Self {
        let process = Process::ALL.iter().find(|(_, p)| *p == printer.process);
        let laid = plates.poses.iter().map(|l| LaidEntry {
            piece: l.piece.into(),
            plate: l.plate + 1,
            size: l.size_mm,
            turned: l.axes,
            moved: l.moved_mm,
            support_mm2: l.support_mm2,
            outer_support_mm2: l.outer_support_mm2,
            foothold_mm2: l.foothold_mm2,
            raft: l.needs_raft,
        });
        let (pieces_s, solid_s) = (cost.seconds, whole.map_or(0.0, |w| w.seconds));
        let ratio = pieces_s / solid_s.max(f64::MIN_POSITIVE);
        Self {
            printer: printer.name.clone(),
            process: process.map(|(name, _)| (*name).to_owned()),
            bed: printer.bed_mm,
            layer: printer.layer_mm,
            plates: plates.n_plates,
            laid: laid.collect(),
            too_large: plates.too_large.iter().map(|&i| i.into()).collect(),
            time: Some(TimeEntry {
                by: "closed form".to_owned(),
                pieces_s,
                solid_s,
                ratio: ratio.is_finite().then_some(ratio),
                pieces_g: Some(cost.grams),
                solid_g: whole.map(|w| w.grams),
                solid_as: whole.map(|_| whole_words(printer.process).to_owned()),
            }),
        }
    }
}
