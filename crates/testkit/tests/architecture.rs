//! Order of the crates and of their modules, checked in the sources.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::Visit;

/// Order of a crate's modules; each may name those before it.
const ASSEMBLY: [&str; 9] = [
    "causes",
    "direction",
    "sequence",
    "press_fit",
    "push",
    "motion",
    "verify",
    "play",
    "certificate",
];

/// Crates from the lowest up, each with those that its library or program may depend on.
const FLOORS: [(&str, &[&str]); 23] = [
    ("report", &[]),
    ("geom", &[]),
    ("formats", &["geom"]),
    ("check", &[]),
    ("mechanics", &["geom"]),
    ("segment", &["geom"]),
    ("figures", &["geom"]),
    ("assembly", &["report", "geom"]),
    ("render", &["report", "geom"]),
    ("surface", &["report", "geom", "assembly"]),
    ("divide", &["report", "geom", "segment", "assembly", "surface"]),
    ("plan", &["report", "geom", "mechanics", "assembly", "surface"]),
    (
        "rate",
        &[
            "report",
            "geom",
            "mechanics",
            "assembly",
            "render",
            "surface",
            "plan",
        ],
    ),
    (
        "volume",
        &[
            "report",
            "geom",
            "mechanics",
            "assembly",
            "surface",
            "plan",
            "rate",
        ],
    ),
    (
        "make",
        &["report", "geom", "mechanics", "assembly", "surface", "plan"],
    ),
    (
        "settings",
        &[
            "report",
            "mechanics",
            "assembly",
            "divide",
            "plan",
            "rate",
            "make",
        ],
    ),
    (
        "shellock",
        &[
            "report",
            "geom",
            "mechanics",
            "figures",
            "assembly",
            "surface",
            "divide",
            "plan",
            "rate",
            "make",
            "settings",
        ],
    ),
    ("print", &["report", "geom", "mechanics", "render"]),
    ("kit", &["report", "geom", "assembly", "shellock", "print"]),
    (
        "job",
        &[
            "report",
            "geom",
            "formats",
            "mechanics",
            "render",
            "shellock",
            "print",
            "kit",
        ],
    ),
    ("studio", &["geom", "formats", "shellock", "print", "job"]),
    (
        "cli",
        &[
            "geom",
            "formats",
            "mechanics",
            "render",
            "volume",
            "shellock",
            "print",
            "kit",
            "job",
            "studio",
        ],
    ),
    ("testkit", &["geom"]),
];

fn crates() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// Lists all source files of a crate, sorted.
fn sources(krate: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![crates().join(krate).join("src")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Module path of a file within its crate: `plan/interface/blocking.rs` is `plan::interface::blocking`.
fn module(krate: &str, file: &Path) -> Vec<String> {
    let inside = file
        .strip_prefix(crates().join(krate).join("src"))
        .unwrap()
        .with_extension("");
    let mut path: Vec<String> = inside
        .iter()
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    if matches!(path.last().map(String::as_str), Some("lib" | "main" | "mod")) {
        path.pop();
    }
    path
}

/// Collects the paths that a file names in its own crate, from the crate's root; paths of other crates are
/// ignored.
struct Names {
    at: Vec<String>,
    paths: BTreeSet<Vec<String>>,
}

impl Names {
    fn add(&mut self, path: &[String]) {
        let mut from = match path[0].as_str() {
            "crate" => Vec::new(),
            "self" => self.at.clone(),
            "super" => self.at[..self.at.len().saturating_sub(1)].to_vec(),
            _ => return,
        };
        for word in &path[1..] {
            if word == "super" {
                from.pop();
            } else {
                from.push(word.clone());
            }
        }
        self.paths.insert(from);
    }

    fn tree(&mut self, before: &[String], tree: &syn::UseTree) {
        let with = |word: &syn::Ident| {
            before
                .iter()
                .cloned()
                .chain([word.to_string()])
                .collect::<Vec<_>>()
        };
        match tree {
            syn::UseTree::Path(path) => self.tree(&with(&path.ident), &path.tree),
            syn::UseTree::Name(name) => self.add(&with(&name.ident)),
            syn::UseTree::Rename(name) => self.add(&with(&name.ident)),
            syn::UseTree::Glob(_) => self.add(before),
            syn::UseTree::Group(group) => group.items.iter().for_each(|tree| self.tree(before, tree)),
        }
    }
}

impl<'a> Visit<'a> for Names {
    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        self.tree(&[], &item.tree);
    }

    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        // Tests may name any module.
        let is_test = item.attrs.iter().any(|a| a.path().is_ident("cfg"));
        if !is_test {
            self.at.push(item.ident.to_string());
            syn::visit::visit_item_mod(self, item);
            self.at.pop();
        }
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let words: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if words.len() > 1 {
            self.add(&words);
        }
        syn::visit::visit_path(self, path);
    }
}

fn names(krate: &str, file: &Path) -> BTreeSet<Vec<String>> {
    let parsed = syn::parse_file(&fs::read_to_string(file).unwrap()).unwrap();
    let mut names = Names {
        at: module(krate, file),
        paths: BTreeSet::new(),
    };
    names.visit_file(&parsed);
    names.paths
}

/// Finds names of later modules in files of earlier ones.
fn upward(krate: &str, order: &[&str]) -> Vec<String> {
    let place = |path: &[String]| {
        path.first()
            .and_then(|first| order.iter().position(|m| m == first))
    };
    let mut found = Vec::new();
    for file in sources(krate) {
        let path = module(krate, &file);
        let is_test = path
            .last()
            .is_some_and(|name| name.ends_with("tests") || name == "kits" || name == "testing");
        let Some(own) = place(&path).filter(|_| !is_test) else {
            continue;
        };
        for name in names(krate, &file) {
            if place(&name).is_some_and(|named| named > own) {
                found.push(format!("{} names {}", file.display(), name.join("::")));
            }
        }
    }
    found
}

#[test]
fn modules_depend_only_on_earlier_modules() {
    let found = upward("assembly", &ASSEMBLY);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn grouped_and_relative_imports_are_seen() {
    let text =
        "use crate::{plan::{self, Way}, body}; use super::super::report; fn f() { crate::verify::go() }";
    let mut names = Names {
        at: vec!["plan".into(), "contact".into()],
        paths: BTreeSet::new(),
    };
    names.visit_file(&syn::parse_file(text).unwrap());
    let found: Vec<String> = names.paths.iter().map(|name| name.join("::")).collect();
    assert_eq!(
        found,
        ["body", "plan::Way", "plan::self", "report", "verify::go"].map(String::from)
    );
}

#[test]
fn crates_depend_only_on_lower_floors() {
    let mut found = Vec::new();
    for (krate, lower) in FLOORS {
        let manifest = fs::read_to_string(crates().join(krate).join("Cargo.toml")).unwrap();
        let product = manifest.split("[dev-dependencies]").next().unwrap();
        let named = product
            .lines()
            .filter_map(|line| line.strip_suffix(".workspace = true"));
        for name in named.filter(|name| name.starts_with("shellock")) {
            let short = if name == "shellock" {
                name
            } else {
                &name["shellock-".len()..]
            };
            if !lower.contains(&short) {
                found.push(format!("{krate} depends on {short}"));
            }
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}

/// Finds files of `crates` whose text has one of the `forbidden` words.
fn find_uses(crates: &[&str], forbidden: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    for file in crates.iter().flat_map(|krate| sources(krate)) {
        let text = fs::read_to_string(&file).unwrap();
        let used = forbidden.iter().filter(|word| text.contains(**word));
        found.extend(used.map(|word| format!("{} uses {word}", file.display())));
    }
    found
}

#[test]
fn library_crates_touch_no_file_clock_or_stdout() {
    let crates = [
        "geom",
        "formats",
        "mechanics",
        "segment",
        "figures",
        "assembly",
        "render",
        "surface",
        "divide",
        "plan",
        "rate",
        "volume",
        "make",
        "shellock",
        "print",
        "kit",
    ];
    let forbidden = [
        "std::fs",
        "Instant::now",
        "SystemTime",
        "println!",
        "eprintln!",
        "std::env",
    ];
    let found = find_uses(&crates, &forbidden);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn a_job_reads_no_arguments_prints_nothing_and_does_not_end_the_process() {
    let forbidden = [
        "println!",
        "eprintln!",
        "std::io::stdin",
        "std::io::stdout",
        "std::io::stderr",
        "env::args",
        "env::var",
        "process::exit",
        "ExitCode",
        "clap",
    ];
    let found = find_uses(&["job"], &forbidden);
    assert!(found.is_empty(), "{found:#?}");
}
