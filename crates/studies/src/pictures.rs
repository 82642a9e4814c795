//! Pictures of the documentation, made by the program from its own kits: `cargo xtask pictures`.
//!
//! All kits are of the squirrel of `shellock demo`. Nothing is drawn by hand: sections come from the
//! functions that make connectors, stills from finished meshes.

mod assembly;
mod closeup;
mod connector;
mod coupon;
mod draw;
mod kit;
mod mechanics;
mod print;
mod repair;
pub mod sheet;

use std::cell::OnceCell;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::failure::Failure;
use kit::Kit;

/// Which pictures, and where they go.
#[derive(Args)]
pub struct Options {
    /// Only pictures whose name has this in it
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Root folder of the repository
    #[arg(long, value_name = "DIR", default_value = ".")]
    root: PathBuf,
}

/// A picture: its file, and the function that makes its bytes.
struct Picture {
    file: &'static str,
    make: fn(&Source) -> Result<Vec<u8>, Failure>,
}

/// Source of the pictures; the kit is made at its first use.
#[derive(Default)]
struct Source(OnceCell<Kit>);

impl Source {
    fn kit(&self) -> Result<&Kit, Failure> {
        if let Some(kit) = self.0.get() {
            return Ok(kit);
        }
        let kit = Kit::squirrel()?;
        Ok(self.0.get_or_init(|| kit))
    }
}

const PICTURES: [Picture; 16] = [
    Picture {
        file: "docs/pictures/connector.svg",
        make: |_| Ok(connector::profiles().into_bytes()),
    },
    Picture {
        file: "docs/pictures/fit-test.svg",
        make: |_| coupon::plate(),
    },
    Picture {
        file: "docs/pictures/repair.svg",
        make: |_| repair::before_and_after(),
    },
    Picture {
        file: "docs/pictures/kit.png",
        make: |_| Ok(assembly::kit(&Kit::of_demo()?)),
    },
    Picture {
        file: "docs/pictures/steps.svg",
        make: |source| Ok(assembly::steps(source.kit()?)),
    },
    Picture {
        file: "docs/pictures/segmentation.svg",
        make: |source| Ok(assembly::segmentation(source.kit()?)),
    },
    Picture {
        file: "docs/pictures/contacts.svg",
        make: |source| Ok(assembly::contacts(source.kit()?)),
    },
    Picture {
        file: "docs/pictures/key.svg",
        make: |source| closeup::key(source.kit()?),
    },
    Picture {
        file: "docs/pictures/seam.svg",
        make: |source| closeup::seams(source.kit()?),
    },
    Picture {
        file: "docs/pictures/stress.svg",
        make: |source| mechanics::stress(source.kit()?),
    },
    Picture {
        file: "docs/pictures/strength.svg",
        make: |source| mechanics::strength(source.kit()?),
    },
    Picture {
        file: "docs/pictures/openings.svg",
        make: |source| Ok(mechanics::openings(source.kit()?)),
    },
    Picture {
        file: "docs/pictures/stress-test.svg",
        make: |source| mechanics::comparison(source.kit()?),
    },
    Picture {
        file: "docs/pictures/plates.svg",
        make: |source| Ok(print::plates(source.kit()?)),
    },
    Picture {
        file: "docs/pictures/booklet.svg",
        make: |source| Ok(print::booklet(source.kit()?)),
    },
    Picture {
        file: "crates/shellock/doc/kit.svg",
        make: |source| Ok(assembly::first_page(source.kit()?)),
    },
];

/// Makes the selected pictures; returns their files.
pub fn run(options: &Options) -> Result<Vec<PathBuf>, Failure> {
    let is_asked = |picture: &&Picture| {
        let words = options.only.as_deref().unwrap_or_default();
        picture.file.contains(words)
    };
    let asked: Vec<&Picture> = PICTURES.iter().filter(is_asked).collect();
    if asked.is_empty() {
        let names: Vec<&str> = PICTURES.iter().map(|p| p.file).collect();
        let problem = format!("--only names none of the pictures: {}", names.join(", "));
        return Err(Failure::Options(vec![problem]));
    }
    let source = Source::default();
    asked
        .into_iter()
        .map(|picture| {
            let bytes = (picture.make)(&source)?;
            eprintln!("{}: {} kB", picture.file, bytes.len() / 1000);
            write(&options.root.join(picture.file), &bytes)
        })
        .collect()
}

fn write(path: &Path, bytes: &[u8]) -> Result<PathBuf, Failure> {
    let fault = |source| Failure::File {
        path: path.to_owned(),
        source,
    };
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(fault)?;
    }
    fs::write(path, bytes).map_err(fault)?;
    Ok(path.to_owned())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Size limits of all pictures together, and of each, bytes.
    const MOST_IN_ALL: u64 = 1_500_000;
    const MOST_EACH: u64 = 150_000;

    fn root() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
    }

    /// Texts that may show pictures, joined.
    fn texts() -> String {
        let in_folder = |folder: &str| {
            fs::read_dir(root().join(folder))
                .unwrap()
                .map(|e| e.unwrap().path())
        };
        let files = in_folder("docs/notes").chain(in_folder("docs/guide"));
        let files = files.chain(["README.md", "ARCHITECTURE.md"].map(|f| root().join(f)));
        files.map(|f| fs::read_to_string(f).unwrap()).collect()
    }

    #[test]
    fn every_picture_is_made_by_the_command_and_shown_somewhere() {
        let made: BTreeSet<String> = PICTURES
            .iter()
            .filter_map(|p| p.file.strip_prefix("docs/pictures/"))
            .map(str::to_owned)
            .collect();
        let there: BTreeSet<String> = fs::read_dir(root().join("docs/pictures"))
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        assert_eq!(made, there);
        let texts = texts();
        let hidden: Vec<&String> = made
            .iter()
            .filter(|name| !texts.contains(&format!("pictures/{name}")))
            .collect();
        assert!(hidden.is_empty(), "in no text: {hidden:?}");
    }

    #[test]
    fn pictures_are_small() {
        let bytes = |p: &Picture| fs::metadata(root().join(p.file)).unwrap().len();
        let large: Vec<&str> = PICTURES
            .iter()
            .filter(|p| bytes(p) > MOST_EACH)
            .map(|p| p.file)
            .collect();
        assert!(large.is_empty(), "{large:?}");
        assert!(PICTURES.iter().map(bytes).sum::<u64>() <= MOST_IN_ALL);
    }
}
