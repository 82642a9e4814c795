//! Checks the certificate of a kit of shell pieces without any of the code that made it.
//!
//! Everything is recomputed from `certificate.json`, `plan.json` and the pieces' STL files. Only the choice
//! of contacts and multipliers is taken from the certificate, and each of these is tested.
//! docs/notes/certificate.md says what each claim means and why its test suffices.

mod barrier;
mod bearing;
mod bounded;
mod claims;
mod gap;
mod lock;
mod mesh;
mod number;
mod pieces;
mod quantity;
mod rays;
mod tree;
mod vector;

use std::fmt;
use std::fs;
use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use bearing::Bearing;
use bounded::{Bounded, Slide};
use claims::Kit;
use mesh::Mesh;
use vector::Vec3;

/// Format of certificates that the program reads.
const FORMAT: &str = "shellock-certificate";
/// Version of certificates that the program reads.
const CERTIFICATE: u64 = 4;
/// Version of plans that the program reads.
const PLAN: u64 = 2;
/// Greatest clearance of a joint, mm.
const MOST_CLEARANCE_MM: f64 = 0.8;
/// Greatest distance of a contact's faces beyond the clearance, mm.
const MOST_REACH_MM: f64 = 0.15;
/// Limits on the number of press fits and on their interference, mm; more is a fault, not a fit.
const MOST_PRESS_FITS: usize = 20;
const MOST_INTERFERENCE_MM: f64 = 0.4;
/// Greatest distance of an overlap or crossing from the place of its press fit, mm.
const AT_FIT_MM: f64 = 4.0;
/// Greatest difference between two numbers that were written from the same one.
const SAME: f64 = 1e-9;

/// Result of testing a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The claim passed its test.
    Confirmed,
    /// The claim failed its test.
    Refuted,
    /// Nothing is claimed, and no kit needs the claim.
    Unproven,
}

/// One claim and the result of its test.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Claim, written as a statement.
    pub claim: String,
    /// Result of the test.
    pub verdict: Verdict,
    /// Figure that decided the result.
    pub figure: String,
}

impl Finding {
    fn new(claim: &str, tested: Tested) -> Self {
        let verdict = if tested.is_ok() {
            Verdict::Confirmed
        } else {
            Verdict::Refuted
        };
        Self {
            claim: claim.to_owned(),
            verdict,
            figure: tested.unwrap_or_else(|bad| bad),
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.verdict {
            Verdict::Confirmed => "confirmed",
            Verdict::Refuted => "refuted",
            Verdict::Unproven => "unproven",
        };
        write!(f, "{verdict:9}  {:52}  {}", self.claim, self.figure)
    }
}

/// Result of a test: the figure, confirming or refuting.
type Tested = Result<String, String>;

#[derive(Deserialize)]
struct Certificate {
    clearance_mm: f64,
    reach_mm: f64,
    center: Vec3,
    length_mm: f64,
    #[serde(deserialize_with = "crate::number::place")]
    key: usize,
    #[serde(deserialize_with = "crate::number::places")]
    installation_order: Vec<usize>,
    pieces: Vec<PieceFile>,
    contacts: Vec<Contact>,
    #[serde(default)]
    bearings: Vec<Bearing>,
    slide: Option<Slide>,
    #[serde(default)]
    press_fits: Vec<PressFit>,
    /// Failures that the kit's maker found.
    failed: Vec<String>,
    /// Files besides those of the pieces.
    #[serde(default)]
    files: Vec<OtherFile>,
    claims: Vec<Claim>,
}

#[derive(Deserialize)]
struct OtherFile {
    file: String,
    sha256: String,
}

/// Place on a piece where the key is pressed on purpose.
#[derive(Deserialize)]
struct PressFit {
    #[serde(deserialize_with = "crate::number::place")]
    piece: usize,
    at: Vec3,
    interference_mm: f64,
}

impl PressFit {
    /// Returns true if `p`, mm, is near enough for a crossing there to belong to this fit.
    fn is_near(&self, p: Vec3) -> bool {
        vector::distance(p, self.at) < AT_FIT_MM
    }
}

#[derive(Deserialize)]
struct PieceFile {
    #[serde(deserialize_with = "crate::number::place")]
    id: usize,
    file: String,
    sha256: String,
    play: Option<ToldPlay>,
}

/// Play of a piece while the others are at rest, as stated to users.
#[derive(Deserialize)]
struct ToldPlay {
    translation_mm: f64,
    rotation_deg: f64,
}

/// Point of piece `a`, its normal there, and the piece that it faces.
#[derive(Clone, Deserialize)]
struct Contact {
    #[serde(deserialize_with = "crate::number::place")]
    a: usize,
    #[serde(deserialize_with = "crate::number::place")]
    b: usize,
    point: Vec3,
    normal: Vec3,
    gap_mm: f64,
}

#[derive(Deserialize)]
#[serde(tag = "claim", rename_all = "kebab-case")]
enum Claim {
    Locked {
        #[serde(deserialize_with = "crate::number::places")]
        held: Vec<usize>,
        #[serde(deserialize_with = "crate::number::place")]
        leaves: usize,
        multipliers: Vec<(usize, f64)>,
        hold: f64,
    },
    Bounded(Bounded),
    KeyLeaves {
        #[serde(deserialize_with = "crate::number::place")]
        piece: usize,
        direction: Vec3,
        least: LeastGaps,
    },
    Installs {
        #[serde(deserialize_with = "crate::number::place")]
        piece: usize,
        direction: Vec3,
        least: LeastGaps,
    },
    Apart {
        least: LeastGaps,
    },
}

/// Least gaps of a claim, as far as they are stated.
#[derive(Deserialize)]
struct LeastGaps {
    overall: Option<Gap>,
    beneath_rim: Option<Gap>,
}

/// Least gap between two surfaces, and its place: midway between them, after the moving one has travelled. A
/// negative gap is a depth.
#[derive(Deserialize)]
struct Gap {
    gap_mm: f64,
    travel_mm: f64,
    at: Vec3,
    #[serde(deserialize_with = "crate::number::place")]
    against: usize,
}

/// Tests every claim of the kit in `folder`. An error means that there is no certificate to test.
pub fn check(folder: &Path) -> Result<Vec<Finding>, String> {
    let certificate: Value = read_json(&folder.join("certificate.json"))?;
    let format = &certificate["format"];
    if format != FORMAT {
        return Err(format!("format {format} is not known"));
    }
    check_version("certificate.json", &certificate["version"], CERTIFICATE)?;
    let certificate = serde_json::from_value(certificate).map_err(|e| format!("certificate.json: {e}"))?;
    let plan: Value = read_json(&folder.join("plan.json"))?;
    check_version("plan.json", &plan["version"], PLAN)?;
    Ok(findings(folder, &certificate, &plan))
}

/// Rejects a file of another version than the one that is read.
fn check_version(file: &str, version: &Value, read: u64) -> Result<(), String> {
    if version.as_u64() == Some(read) {
        return Ok(());
    }
    Err(format!(
        "{file} is of version {version}, and this program reads {read}: use the checker of the program that \
         made the kit, or build the kit again"
    ))
}

fn findings(folder: &Path, c: &Certificate, plan: &Value) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut add = |claim: &str, tested: Tested| {
        let is_confirmed = tested.is_ok();
        findings.push(Finding::new(claim, tested));
        is_confirmed
    };
    let is_whole = add("the certificate speaks of this plan", test_plan(c, plan))
        & add("every claim that a kit needs is made", test_completeness(c));
    add("the kit passed the tests of its maker", test_failures(c));
    let (meshes, files) = pieces::read(folder, &c.pieces);
    let is_read = add("the files are those that were certified", files);
    if !is_whole || (!is_read && meshes.len() < c.pieces.len()) {
        return findings;
    }
    if !c.files.is_empty() {
        add(
            "other files are those that were certified",
            pieces::test_files(folder, &c.files),
        );
    }
    if !add(
        "each piece is one closed surface around a volume",
        pieces::test_surfaces(&meshes),
    ) {
        return findings;
    }
    let contacts = locate_contacts(c, &meshes);
    let told = |contacts: &Vec<Contact>| {
        format!(
            "{} contacts, up to {:.3} mm apart",
            contacts.len(),
            largest_gap_mm(contacts)
        )
    };
    add(
        "the contacts lie on both pieces' surfaces",
        contacts.as_ref().map(told).map_err(String::clone),
    );
    let bearings = bearing::locate_all(&meshes, &c.bearings);
    if !c.bearings.is_empty() {
        let told = |bearings: &Vec<Bearing>| format!("{} bearings", bearings.len());
        add(
            "the bearings lie on their pieces' surfaces",
            bearings.as_ref().map(told).map_err(String::clone),
        );
    }
    if !c.press_fits.is_empty() {
        add(
            "the key is pressed on purpose, but not by much",
            test_press_fits(c),
        );
    }
    let kit = Kit {
        c,
        meshes: &meshes,
        contacts: contacts.as_deref().ok(),
        bearings: bearings.as_deref().ok(),
    };
    findings.extend(kit.test_claims());
    findings.extend(unproven(c));
    findings
}

/// Findings for pieces whose play is not claimed to be bounded.
fn unproven(c: &Certificate) -> impl Iterator<Item = Finding> {
    let is_claimed = |id: usize| {
        c.claims
            .iter()
            .any(|claim| matches!(claim, Claim::Bounded(b) if b.free == [id]))
    };
    (0..c.pieces.len())
        .filter(move |&id| !is_claimed(id))
        .map(|id| match c.pieces[id].play {
            Some(_) => Finding {
                claim: within_play(id),
                verdict: Verdict::Refuted,
                figure: "told, but not claimed".into(),
            },
            None => Finding {
                claim: within_play(id),
                verdict: Verdict::Unproven,
                figure: "not claimed".into(),
            },
        })
}

fn within_play(piece: usize) -> String {
    format!("piece {} stays within its play", number::of(piece))
}

fn read_json<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<T, String> {
    let bytes = fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    serde_json::from_slice(&bytes).map_err(|e| format!("{}: {e}", path.display()))
}

/// Checks that key, order, directions, files and clearance match the plan, and that all ids name pieces.
fn test_plan(c: &Certificate, plan: &Value) -> Tested {
    let n = c.pieces.len();
    let mut order = c.installation_order.clone();
    order.sort_unstable();
    if n < 2 || !order.into_iter().eq(0..n) || !c.pieces.iter().map(|p| p.id).eq(0..n) {
        return Err(format!("{n} pieces, not each once in the order"));
    }
    if c.contacts.iter().any(|c| c.a.max(c.b) >= n || c.a == c.b) {
        return Err("a contact is not one of two pieces".into());
    }
    let order: Vec<Value> = c
        .installation_order
        .iter()
        .map(|&id| number::of(id).into())
        .collect();
    let is_near = |value: &Value, x: f64| value.as_f64().is_some_and(|y| (x - y).abs() <= SAME);
    if plan["installation_order"] != Value::Array(order) || plan["key_piece"] != number::of(c.key) {
        return Err("the plan has another order or key".into());
    }
    if c.installation_order.last() != Some(&c.key) || !is_near(&plan["clearance"], c.clearance_mm) {
        return Err("the key is not the last piece, or the plan has another clearance".into());
    }
    if !(0.0..=MOST_CLEARANCE_MM).contains(&c.clearance_mm) {
        return Err(format!(
            "a clearance of {} mm; up to {MOST_CLEARANCE_MM} mm are believed",
            c.clearance_mm
        ));
    }
    if plan["pieces"].as_array().map(Vec::len) != Some(n) {
        return Err("the plan has another number of pieces".into());
    }
    for claim in &c.claims {
        let Claim::Installs { piece, direction, .. } = claim else {
            continue;
        };
        let planned = &plan["pieces"][*piece]["installation_direction"];
        if !(0..3).all(|k| is_near(&planned[k], direction[k])) {
            return Err(format!(
                "the plan installs piece {} along another direction",
                number::of(*piece)
            ));
        }
    }
    for (piece, rattle) in c.pieces.iter().map(|p| (p, &plan["pieces"][p.id]["rattle"])) {
        let is_no_less = |play: &ToldPlay| {
            let told = |name: &str| rattle[name].as_f64().unwrap_or(f64::NEG_INFINITY) + SAME;
            told("translation_mm") >= play.translation_mm && told("rotation_deg") >= play.rotation_deg
        };
        if rattle["is_proven"] == true && !piece.play.as_ref().is_some_and(is_no_less) {
            return Err(format!(
                "the plan calls a play of piece {} proven that is not the certificate's",
                number::of(piece.id)
            ));
        }
    }
    match c
        .pieces
        .iter()
        .find(|p| plan["pieces"][p.id]["file"] != p.file.as_str())
    {
        Some(p) => Err(format!(
            "the plan has another file for piece {}",
            number::of(p.id)
        )),
        None => Ok(format!("{n} pieces, key {}", number::of(c.key))),
    }
}

/// Checks that the maker's own tests found nothing wrong.
fn test_failures(c: &Certificate) -> Tested {
    if c.failed.is_empty() {
        Ok("nothing failed".into())
    } else {
        Err(format!("failed: {}", c.failed.join("; ")))
    }
}

/// Checks that all needed claims are made: one lock, with the first piece held, that only the key leaves; the
/// key's way out, a way in for every other piece, and no overlap.
fn test_completeness(c: &Certificate) -> Tested {
    let count = |is_it: &dyn Fn(&Claim) -> bool| c.claims.iter().filter(|claim| is_it(claim)).count();
    // Each piece is installed, bounded alone, and at rest while all others are bounded.
    let most = 3 + 3 * c.pieces.len();
    if c.claims.len() > most {
        return Err(format!(
            "{} claims are more than the {most} that a kit needs",
            c.claims.len()
        ));
    }
    let first = c.installation_order.first().copied().unwrap_or_default();
    let is_lock = |claim: &Claim| matches!(claim, Claim::Locked { .. });
    let is_needed_lock = |claim: &Claim| {
        matches!(claim, Claim::Locked { held, leaves, .. }
            if *held == [first] && *leaves == c.key)
    };
    if first == c.key || count(&is_lock) != 1 || count(&is_needed_lock) != 1 {
        return Err(format!(
            "it is not claimed, once, that nothing but the key moves while piece {} is held",
            number::of(first)
        ));
    }
    if count(&|claim| matches!(claim, Claim::KeyLeaves { piece, .. } if *piece == c.key)) != 1 {
        return Err("it is not claimed that the key can leave".into());
    }
    if count(&|claim| matches!(claim, Claim::Apart { .. })) != 1 {
        return Err("it is not claimed that pieces do not overlap".into());
    }
    for &id in c.installation_order.iter().skip(1) {
        if count(&|claim| matches!(claim, Claim::Installs { piece, .. } if *piece == id)) != 1 {
            return Err(format!(
                "it is not claimed that piece {} can be installed",
                number::of(id)
            ));
        }
    }
    Ok(format!("{} claims", c.claims.len()))
}

/// Returns the contacts with the points and normals of the triangles that they really lie on.
fn locate_contacts(c: &Certificate, meshes: &[Mesh]) -> Result<Vec<Contact>, String> {
    if c.reach_mm > c.clearance_mm + MOST_REACH_MM + SAME {
        return Err(format!("contacts {} mm apart hold nothing", c.reach_mm));
    }
    let locate = |(i, contact): (usize, &Contact)| {
        let Contact {
            a,
            b,
            point,
            normal,
            gap_mm,
        } = contact;
        let on_a = meshes[*a].triangle_at(*point, *normal);
        let (point, normal) =
            on_a.ok_or_else(|| format!("contact {i} is not on piece {}", number::of(*a)))?;
        let is_near = *gap_mm <= c.reach_mm && meshes[*b].is_faced(point, normal, *gap_mm);
        if !is_near {
            return Err(format!(
                "contact {i} does not face piece {} at {gap_mm:.3} mm",
                number::of(*b)
            ));
        }
        Ok(Contact {
            point,
            normal,
            ..contact.clone()
        })
    };
    c.contacts.iter().enumerate().map(locate).collect()
}

fn test_press_fits(c: &Certificate) -> Tested {
    let most_mm = c.press_fits.iter().map(|f| f.interference_mm).fold(0.0, f64::max);
    let figure = format!("{} places, by up to {most_mm:.2} mm", c.press_fits.len());
    if c.press_fits.len() <= MOST_PRESS_FITS && most_mm <= MOST_INTERFERENCE_MM {
        Ok(figure)
    } else {
        Err(figure)
    }
}

fn largest_gap_mm(contacts: &[Contact]) -> f64 {
    contacts.iter().map(|c| c.gap_mm).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_versions_and_formats_are_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let why = |text: &str| {
            fs::write(folder.path().join("certificate.json"), text).unwrap();
            check(folder.path()).unwrap_err()
        };
        let version = |version: &str| {
            why(&format!(
                r#"{{ "format": "shellock-certificate", "version": {version} }}"#
            ))
        };
        for other in ["2", "3", "5", "0", "\"4\""] {
            let why = version(other);
            assert!(
                why.contains(&format!("of version {other}, and this program reads 4")),
                "{why}"
            );
        }
        assert!(why(r#"{ "format": "another", "version": 4 }"#).ends_with("is not known"));
        let empty = why(r#"{ "format": "shellock-certificate", "version": 4 }"#);
        assert!(
            empty.starts_with("certificate.json"),
            "no certificate of this version, nor a plan: {empty}"
        );
    }
}
