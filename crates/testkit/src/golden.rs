//! Golden results: digests of the program's files and messages, recorded when they were last reviewed.
//!
//! Kits are a function of input, options and seed, on any number of threads. A change that is not meant to
//! change results must therefore keep every byte. `cargo xtask golden` compares and `--update` records anew.
//! A test compares the figures that come with the program.
//!
//! Limits: sine, cosine and the sums of the sparse solver depend on the processor's vector units and on the C
//! library. Digests are therefore compared only on a machine of the same kind ([`machine`]).

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// A run of the program with a recorded result.
pub struct Case {
    /// Name of the case in the file of digests.
    pub name: &'static str,
    /// Command and options, without the output folder.
    pub args: &'static [&'static str],
}

/// Jobs on figures that come with the program, run by tests: each takes some seconds.
pub const QUICK: [Case; 3] = [
    Case {
        name: "vase",
        args: &["demo", "--figure", "vase", "--size", "60", "--pieces", "5"],
    },
    Case {
        name: "dinosaur, a piece is the key, filament, failed",
        args: &[
            "demo",
            "--figure",
            "dinosaur",
            "--size",
            "36",
            "--pieces",
            "3",
            "--key",
            "piece",
            "--printer",
            "fdm",
        ],
    },
    Case {
        name: "vase, no such key",
        args: &[
            "demo", "--figure", "vase", "--size", "40", "--pieces", "3", "--key", "40",
        ],
    },
];

/// More jobs on figures, of up to a minute: pieces with play, keys and divisions that fail, labels.
pub const FIGURES: [Case; 5] = [
    Case {
        name: "torus, a piece is the key",
        args: &[
            "demo", "--figure", "torus", "--size", "60", "--pieces", "3", "--key", "piece",
        ],
    },
    Case {
        name: "torus",
        args: &["demo", "--figure", "torus", "--size", "60", "--pieces", "2"],
    },
    Case {
        name: "squirrel, filament",
        args: &[
            "demo",
            "--figure",
            "squirrel",
            "--size",
            "100",
            "--pieces",
            "4",
            "--printer",
            "fdm",
        ],
    },
    Case {
        name: "arms, labels",
        args: &[
            "build",
            "figures/arms.stl",
            "--labels",
            "figures/arms.seg",
            "--size",
            "120",
        ],
    },
    Case {
        name: "cat, many pieces asked",
        args: &[
            "demo", "--figure", "cat", "--size", "40", "--pieces", "40", "--method", "creases",
        ],
    },
];

/// Jobs on external models, in the folder `models`: each takes up to two minutes.
pub const MODELS: [Case; 9] = [
    Case {
        name: "teddy",
        args: &["build", "models/teddy_psb179.off", "--size", "150", "--up", "y"],
    },
    Case {
        name: "koala",
        args: &["build", "models/koala.obj", "--size", "150", "--up", "y"],
    },
    Case {
        name: "vase, two keys",
        args: &["build", "models/vase_amphora.obj", "--size", "150", "--up", "y"],
    },
    Case {
        name: "octopus, labels, rounds",
        args: &[
            "build",
            "models/octopus_psb135.off",
            "--size",
            "150",
            "--up",
            "y",
            "--labels",
            "models/octopus_psb135.s10.seg",
        ],
    },
    Case {
        name: "hand, labels, rounds",
        args: &[
            "build",
            "models/hand_psb186.off",
            "--size",
            "180",
            "--labels",
            "models/hand_psb186.s8.seg",
        ],
    },
    Case {
        name: "cat, a piece is the key",
        args: &["build", "models/cat.obj", "--size", "150", "--key", "piece"],
    },
    Case {
        name: "gargoyle, a piece is the key",
        args: &[
            "build",
            "models/gargoyle.obj",
            "--size",
            "150",
            "--up",
            "y",
            "--key",
            "piece",
        ],
    },
    Case {
        name: "teddy, filament",
        args: &[
            "build",
            "models/teddy_psb179.off",
            "--size",
            "150",
            "--up",
            "y",
            "--printer",
            "fdm",
        ],
    },
    Case {
        name: "bunny, filament",
        args: &[
            "build",
            "models/bunny.obj",
            "--size",
            "150",
            "--up",
            "y",
            "--printer",
            "fdm",
        ],
    },
];

/// Result of a run: exit code and digests.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ending {
    /// Exit code; −1 if a signal ended the run.
    pub exit_code: i32,
    /// Digest of standard output and standard error.
    pub said: String,
    /// Digests of the files written, by name.
    pub files: BTreeMap<String, String>,
}

impl Ending {
    /// Describes all differences from `earlier`, in words.
    pub fn changes_since(&self, earlier: &Self) -> Vec<String> {
        let mut changes = Vec::new();
        if self.exit_code != earlier.exit_code {
            changes.push(format!(
                "exit code {} instead of {}",
                self.exit_code, earlier.exit_code
            ));
        }
        if self.said != earlier.said {
            changes.push("what it says".to_owned());
        }
        let gone = earlier
            .files
            .keys()
            .filter(|name| !self.files.contains_key(*name));
        changes.extend(gone.map(|name| format!("{name} is missing")));
        for (name, digest) in &self.files {
            match earlier.files.get(name) {
                Some(before) if before == digest => {}
                Some(_) => changes.push(name.clone()),
                None => changes.push(format!("{name} is new")),
            }
        }
        changes
    }
}

/// Results by the names of their cases, and the kind of machine that made them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Goldens {
    /// Kind of machine at recording time, from [`machine`].
    pub machine: String,
    /// One result per case, by name.
    pub endings: BTreeMap<String, Ending>,
}

impl Goldens {
    /// Reads results from a file; empty if there is no such file.
    pub fn read(path: &Path) -> io::Result<Self> {
        match fs::read(path) {
            Ok(bytes) => Ok(serde_json::from_slice(&bytes)?),
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(Self::default()),
            Err(e) => Err(e),
        }
    }

    /// Writes the file, replacing an existing one. Creates its folder if necessary.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        fs::write(path, serde_json::to_string_pretty(self)? + "\n")
    }
}

/// Path of the digests of [`QUICK`] and [`FIGURES`], in this repository.
pub fn of_figures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/figures.json")
}

/// Describes everything that results may depend on besides input, options and seed: the processor's vector
/// units and the C library.
pub fn machine() -> String {
    let mut words = vec![std::env::consts::OS, std::env::consts::ARCH];
    #[cfg(target_arch = "x86_64")]
    {
        let has = [
            ("avx2", is_x86_feature_detected!("avx2")),
            ("fma", is_x86_feature_detected!("fma")),
            ("avx512f", is_x86_feature_detected!("avx512f")),
        ];
        words.extend(has.into_iter().filter(|(_, has)| *has).map(|(name, _)| name));
    }
    let libc = Command::new("getconf").arg("GNU_LIBC_VERSION").output().ok();
    let libc = libc
        .map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned())
        .unwrap_or_default();
    format!("{} {libc}", words.join(" ")).trim().to_owned()
}

/// Runs `program` on a case with `n_threads` threads, in a temporary folder. `models` is the folder of
/// external models.
pub fn run(program: &Path, case: &Case, n_threads: usize, models: Option<&Path>) -> io::Result<Ending> {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    if let Some(models) = models {
        link(&models.canonicalize()?, &at.join("models"))?;
    }
    if case.args.iter().any(|arg| arg.starts_with("figures/")) {
        figures(program, at)?;
    }
    let run = Command::new(program)
        .current_dir(at)
        .args(case.args)
        .args(["--threads", &n_threads.to_string(), "--time", "0", "-o", "kit"])
        .output()?;
    let mut said = run.stdout;
    said.extend(run.stderr);
    let kit = at.join("kit");
    let files = if kit.is_dir() {
        digests(&kit)?
    } else {
        BTreeMap::new()
    };
    Ok(Ending {
        exit_code: run.status.code().unwrap_or(-1),
        said: digest(&said),
        files,
    })
}

/// Writes a figure with the labels of its limbs.
fn figures(program: &Path, at: &Path) -> io::Result<()> {
    fs::create_dir(at.join("figures"))?;
    let args = [
        "figure",
        "arms",
        "-o",
        "figures/arms.stl",
        "--labels",
        "figures/arms.seg",
    ];
    let made = Command::new(program).current_dir(at).args(args).output()?;
    if made.status.success() {
        Ok(())
    } else {
        Err(io::Error::other(
            String::from_utf8_lossy(&made.stderr).into_owned(),
        ))
    }
}

#[cfg(unix)]
fn link(to: &Path, at: &Path) -> io::Result<()> {
    std::os::unix::fs::symlink(to, at)
}

#[cfg(not(unix))]
fn link(to: &Path, at: &Path) -> io::Result<()> {
    fs::create_dir(at)?;
    fs::read_dir(to)?.try_for_each(|entry| {
        let path = entry?.path();
        if path.is_file() {
            fs::copy(&path, at.join(path.file_name().unwrap_or_default())).map(drop)
        } else {
            Ok(())
        }
    })
}

fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

/// Digests of all files below a folder, by their paths within it.
fn digests(folder: &Path) -> io::Result<BTreeMap<String, String>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        for entry in fs::read_dir(at)? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path
                .strip_prefix(folder)
                .unwrap_or(&path)
                .to_string_lossy()
                .replace('\\', "/");
            found.insert(name, digest(&fs::read(&path)?));
        }
    }
    Ok(found)
}
