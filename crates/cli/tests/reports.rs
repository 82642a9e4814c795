//! Tests with generated files after public bug reports, each with the one answer that a user would expect.
//!
//! One test writes all files into a folder and reads that folder. The table of docs/guide/inputs.md says for
//! each format what is read, left out and refused. A case here proves every entry, and every proof is listed
//! there.

#[path = "reports/gltf.rs"]
mod gltf;
#[path = "reports/plain.rs"]
mod plain;
#[path = "reports/threemf.rs"]
mod threemf;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;
use shellock_geom::{TriMesh, Vec3};
use shellock_testkit::shapes;

/// Largest allowed error of a size, mm.
const TOLERANCE_MM: f64 = 0.05;

/// Claim about the answer of `inspect` for a file.
#[derive(Clone, Copy, Debug)]
enum Claim {
    /// Size of the kit that would be made, mm.
    Size([f64; 3]),
    /// Source of the file's division.
    Labels(&'static str),
    /// Words that a note contains.
    Note(&'static str),
    /// Words that a warning contains.
    Warning(&'static str),
    /// Words with which the file is refused.
    Refused(&'static str),
}

/// A file with its expected answer.
#[derive(Clone)]
struct Case {
    name: &'static str,
    bytes: Vec<u8>,
    options: Vec<&'static str>,
    claims: Vec<Claim>,
    /// Format, column and entry in the guide's table that the case proves.
    proof: Option<[&'static str; 3]>,
}

impl Case {
    fn new(name: &'static str, bytes: Vec<u8>) -> Self {
        Self {
            name,
            bytes,
            options: Vec::new(),
            claims: Vec::new(),
            proof: None,
        }
    }

    fn with(mut self, options: &[&'static str]) -> Self {
        self.options.extend(options);
        self
    }

    fn says(mut self, claims: &[Claim]) -> Self {
        self.claims.extend(claims);
        self
    }

    fn proves(mut self, format: &'static str, column: &'static str, entry: &'static str) -> Self {
        self.proof = Some([format, column, entry]);
        self
    }
}

/// Body of 512 triangles, 60 × 40 × 30 mm.
fn body() -> TriMesh {
    scale(&shapes::ball(3, Vec3::ZERO, 1.0), Vec3::new(30.0, 20.0, 15.0))
}

fn scale(mesh: &TriMesh, by: Vec3) -> TriMesh {
    let mut mesh = mesh.clone();
    mesh.points.iter_mut().for_each(|p| *p *= by);
    mesh
}

fn shift(mesh: &TriMesh, by: Vec3) -> TriMesh {
    let mut mesh = mesh.clone();
    mesh.points.iter_mut().for_each(|p| *p += by);
    mesh
}

fn cases() -> Vec<Case> {
    [threemf::cases(), gltf::cases(), plain::cases()].concat()
}

/// Lists the differences between the claims of `case` and the answer of `inspect` for its file in `folder`.
fn faults(folder: &Path, case: &Case) -> Vec<String> {
    let output = Command::new(env!("CARGO_BIN_EXE_shellock"))
        .current_dir(folder)
        .args(["inspect", case.name, "--json"])
        .args(&case.options)
        .output()
        .expect("the program runs");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let texts = |key: &str| report[key].to_string();
    let mut refusal = String::from_utf8_lossy(&output.stderr).into_owned();
    refusal.push_str(report["error"].as_str().unwrap_or_default());
    let is_refused = output.status.code() == Some(2);
    let should_be = case.claims.iter().any(|claim| matches!(claim, Claim::Refused(_)));
    let mut faults = Vec::new();
    if is_refused != should_be {
        faults.push(format!(
            "{}: exit {:?}: {refusal}{report}",
            case.name,
            output.status.code()
        ));
    }
    for claim in &case.claims {
        let holds = match *claim {
            Claim::Size(mm) => (0..3).all(|axis| {
                let made = report["size_mm"][axis].as_f64().unwrap_or(f64::NAN);
                (made - mm[axis]).abs() <= TOLERANCE_MM
            }),
            // The file's labels may be inside a JSON text, where quotes have a backslash.
            Claim::Labels(source) => texts("divided_by").contains(source),
            Claim::Note(words) => texts("notes").replace("\\\"", "\"").contains(words),
            Claim::Warning(words) => texts("warnings").replace("\\\"", "\"").contains(words),
            Claim::Refused(words) => refusal.contains(words),
        };
        if !holds {
            faults.push(format!("{}: not {claim:?}: {refusal}{report}", case.name));
        }
    }
    faults
}

#[test]
fn every_file_of_the_folder_ends_in_its_one_right_answer() {
    let folder = tempfile::tempdir().expect("there is room");
    let cases = cases();
    for case in &cases {
        fs::write(folder.path().join(case.name), &case.bytes).expect("there is room");
    }
    let n_files = fs::read_dir(folder.path()).expect("it is a folder").count();
    assert_eq!(n_files, cases.len(), "two cases have the same name");
    let faults: Vec<String> = cases
        .iter()
        .flat_map(|case| faults(folder.path(), case))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Entries of the guide's table: format, column and entry.
fn entries(guide: &str) -> BTreeSet<[String; 3]> {
    const COLUMNS: [&str; 3] = ["read", "left out", "refused"];
    let rows = guide
        .lines()
        .skip_while(|line| !line.starts_with("| format | read | left out | refused |"))
        .skip(2)
        .take_while(|line| line.starts_with('|'));
    rows.flat_map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let format = cells[0].to_owned();
        let of_cell = move |(column, cell): (&str, &str)| {
            let entries = cell.split("; ").filter(|entry| !entry.is_empty());
            let entry = |entry: &str| [format.clone(), column.to_owned(), entry.to_owned()];
            entries.map(entry).collect::<Vec<_>>()
        };
        COLUMNS
            .into_iter()
            .zip(cells[1..].to_vec())
            .flat_map(of_cell)
            .collect::<Vec<_>>()
    })
    .collect()
}

#[test]
fn the_guide_s_table_says_what_the_cases_prove_and_nothing_else() {
    let guide = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/guide/inputs.md");
    let written = entries(&fs::read_to_string(guide).expect("the guide is there"));
    let proven: BTreeSet<[String; 3]> = cases()
        .into_iter()
        .filter_map(|case| case.proof)
        .map(|proof| proof.map(str::to_owned))
        .collect();
    let unproven: Vec<_> = written.difference(&proven).collect();
    let unwritten: Vec<_> = proven.difference(&written).collect();
    assert!(
        !written.is_empty() && unproven.is_empty(),
        "no case proves {unproven:?}"
    );
    assert!(unwritten.is_empty(), "the guide lacks {unwritten:?}");
}
