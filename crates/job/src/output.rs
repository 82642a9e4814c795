//! Writes a finished kit as files.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use shellock::certificate::{Certificate, Evidence, OtherFile, PieceFile, certify};
use shellock::design::{Design, Settings};
use shellock::strength::chart::{SeamStress, strength_chart};
use shellock::strength::{Strength, StressMap};
use shellock::verify::thin_share;
use shellock::{SegmentedSurface, Warning};
use shellock_formats::{NamedObject, write_3mf, write_ply, write_stl_binary};
use shellock_geom::TriMesh;
use shellock_kit::plan_file::{PlanFile, Source, Told, piece_file};
use shellock_render::palette;

use crate::failure::Failure;
use crate::files::Writing;
use crate::files::with_slashes;
use crate::input::{Model, sha256};
use crate::options::Options;
use crate::page;
use crate::paint::paint_patches;
use crate::printing::Printing;
pub use crate::summary::{Summary, connector_sizes};
pub use crate::upright::{turn_back, turn_upright};

/// Name of the plan within a kit.
pub const PLAN: &str = "plan.json";
/// Name of the certificate within a kit.
pub const CERTIFICATE: &str = "certificate.json";

/// Names of the files that commands write into a kit, besides pieces and plates.
const KIT_FILES: [&str; 13] = [
    PLAN,
    CERTIFICATE,
    "assembly.3mf",
    "plates.3mf",
    "segmentation.ply",
    "segmentation.3mf",
    "report.html",
    "pieces.png",
    "instructions.pdf",
    "strength.svg",
    "savings.json",
    "stress.json",
    "stress.svg",
];

/// Folder of a kit to be written. All files are first written to a folder beside it, which is moved into
/// place at the end.
pub struct Destination {
    folder: PathBuf,
    may_replace: bool,
}

impl Destination {
    /// Refuses a folder with content, unless it holds an earlier kit and `force` is set.
    pub fn new(folder: PathBuf, force: bool) -> Result<Self, Failure> {
        let has_content = fs::read_dir(&folder).is_ok_and(|mut d| d.next().is_some());
        let is_kit = folder.join(PLAN).is_file();
        let refuse = |why: &str| Err(Failure::Wrong(format!("{} {why}", folder.display())));
        if folder.exists() && !folder.is_dir() {
            return refuse("is a file; choose a folder with -o");
        }
        if has_content && !is_kit {
            return refuse("contains files that are not a kit; choose another folder with -o");
        }
        if has_content && !force {
            return refuse("already contains a kit; choose another folder with -o, or --force to replace it");
        }
        if let Some(foreign) = foreign_file(&folder) {
            return refuse(&format!(
                "contains {foreign}, which is not part of the kit and would be lost; move it, or choose \
                 another folder with -o"
            ));
        }
        let made = Self {
            folder,
            may_replace: force,
        };
        // Fails now rather than after a minute's work.
        made.temporary()?;
        Ok(made)
    }

    /// Creates a folder beside the kit's; it is deleted when dropped.
    fn temporary(&self) -> Result<tempfile::TempDir, Failure> {
        let parent = match self.folder.parent() {
            Some(p) if !p.as_os_str().is_empty() => p.to_owned(),
            _ => PathBuf::from("."),
        };
        let unwritable = |source: std::io::Error| Failure::Unwritable {
            path: parent.clone(),
            source: std::io::Error::new(source.kind(), source.kind().to_string()),
        };
        fs::create_dir_all(&parent).map_err(unwritable)?;
        tempfile::Builder::new()
            .prefix(".shellock-")
            .tempdir_in(&parent)
            .map_err(unwritable)
    }

    /// Path of the kit's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Writes all files; the folder appears whole or not at all.
    ///
    /// If the new kit cannot be moved into place, an earlier kit stays as it was.
    pub fn write(&self, files: &[(String, Vec<u8>)]) -> Result<(), Failure> {
        let _writing = Writing::begin();
        let temporary = self.temporary()?;
        let made = temporary.path().join("kit");
        for (name, bytes) in files {
            let path = made.join(name);
            if let Some(folder) = path.parent() {
                fs::create_dir_all(folder).map_err(Failure::unwritable(folder))?;
            }
            fs::write(&path, bytes).map_err(Failure::unwritable(&path))?;
        }
        if !self.folder.exists() {
            return fs::rename(&made, &self.folder).map_err(Failure::unwritable(&self.folder));
        }
        let earlier = temporary.path().join("earlier");
        self.set_aside(&earlier)
            .map_err(Failure::unwritable(&self.folder))?;
        match replace(&made, &self.folder, &earlier) {
            Ok(()) => Ok(()),
            Err(NotReplaced::Back(source)) => Err(Failure::unwritable(&self.folder)(source)),
            Err(NotReplaced::Lost(source)) => {
                // Otherwise the earlier kit would be deleted with the temporary folder.
                let kept = temporary.keep().join("earlier");
                let words = format!("{source}; the kit that was there is now in {}", kept.display());
                Err(Failure::unwritable(&self.folder)(io::Error::new(
                    source.kind(),
                    words,
                )))
            }
        }
    }

    /// Moves the existing folder to `earlier`: a kit, or an empty folder. Fails for anything else.
    fn set_aside(&self, earlier: &Path) -> io::Result<()> {
        let is_kit = self.folder.join(PLAN).is_file();
        if self.may_replace && is_kit {
            fs::rename(&self.folder, earlier)
        } else {
            // Fails if the folder is not empty.
            fs::remove_dir(&self.folder)?;
            fs::create_dir(earlier)
        }
    }
}

/// Reason why a new kit could not be moved into place.
#[derive(Debug)]
enum NotReplaced {
    /// Failed, and the earlier kit is back in its place.
    Back(io::Error),
    /// Failed, and the earlier kit could not be put back.
    Lost(io::Error),
}

/// Moves the folder `made` to `place`. If that fails, moves `earlier` back, which was there before.
fn replace(made: &Path, place: &Path, earlier: &Path) -> Result<(), NotReplaced> {
    let Err(source) = fs::rename(made, place) else {
        return Ok(());
    };
    Err(match fs::rename(earlier, place) {
        Ok(()) => NotReplaced::Back(source),
        Err(_) => NotReplaced::Lost(source),
    })
}

/// Name of a file in a kit's folder that no command of this program writes; the first by name.
fn foreign_file(folder: &Path) -> Option<String> {
    let mut names: Vec<String> = Vec::new();
    let mut left = vec![PathBuf::new()];
    while let Some(within) = left.pop() {
        for entry in fs::read_dir(folder.join(&within)).into_iter().flatten().flatten() {
            let path = within.join(entry.file_name());
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                left.push(path);
            } else {
                names.push(with_slashes(&path));
            }
        }
    }
    names.sort();
    names.into_iter().find(|name| !is_of_kits(name))
}

/// Returns true if commands, of this version or an earlier one, write a file of this name into a kit's
/// folder.
pub fn is_of_kits(name: &str) -> bool {
    let numbered = |prefix: &str, end: &str| {
        let number = name.strip_prefix(prefix).and_then(|rest| rest.strip_suffix(end));
        number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    KIT_FILES.contains(&name) || numbered("pieces/piece-", ".stl") || numbered("plates/plate-", ".3mf")
}

/// Builds all files of a kit, and its figures.
pub(crate) fn files(
    model: &Model,
    options: &Options,
    settings: &Settings,
    design: &Design,
    warnings: &[Warning],
    printing: &Printing,
) -> (Vec<(String, Vec<u8>)>, Summary) {
    let thin: Vec<f64> = design
        .kit
        .pieces
        .as_slice()
        .par_iter()
        .map(|m| thin_share(m, settings.connector.min_wall_mm).share)
        .collect();
    let summary = summary(model, design, printing, &thin);
    let plan = plan_file(model, settings, design, warnings, &summary, &thin, printing);
    let mut files = vec![(PLAN.to_owned(), plan.to_bytes())];
    let meshes = design
        .kit
        .pieces
        .iter()
        .map(|(p, mesh)| (piece_file(p), write_stl_binary(mesh)));
    let pieces: Vec<(String, Vec<u8>)> = meshes.collect();
    let chart = design
        .strength
        .as_ref()
        .map(|strength| stress_chart(options, settings, design, strength));
    let figures = chart
        .iter()
        .map(|svg| ("Stress in a fall".to_owned(), svg.clone()))
        .collect();
    let archives = || {
        rayon::join(
            || assembly(design),
            || printing.files(design.kit.pieces.as_slice()),
        )
    };
    let ((archive, plates), (page, picture, booklet)) = rayon::join(archives, || {
        page::report(
            model,
            options,
            settings,
            design,
            warnings,
            &summary,
            (figures, printing),
        )
    });
    let mut archives = vec![("assembly.3mf".to_owned(), archive)];
    archives.extend(plates);
    let claimed = certificate(&pieces, &archives, design, settings.verify.clearance_mm);
    files.extend(claimed.map(|bytes| (CERTIFICATE.to_owned(), bytes)));
    files.extend(pieces);
    files.extend(archives);
    files.extend(chart.map(|svg| ("strength.svg".to_owned(), svg.into_bytes())));
    files.extend(segmentation_files(&model.name, &design.kit.surface));
    files.push(("report.html".into(), page));
    files.push(("pieces.png".into(), picture));
    files.extend(booklet.map(|bytes| ("instructions.pdf".to_owned(), bytes)));
    (files, summary)
}

/// Builds the files of the surface with its pieces, as labels and as colours.
fn segmentation_files(name: &str, surface: &SegmentedSurface) -> [(String, Vec<u8>); 2] {
    let labels: Vec<i32> = surface.patch_of_face.iter().map(|p| p.number() as i32).collect();
    [
        ("segmentation.ply".into(), write_ply(&surface.mesh, Some(&labels))),
        ("segmentation.3mf".into(), paint_patches(name, surface).0),
    ]
}

fn summary(model: &Model, design: &Design, printing: &Printing, thin: &[f64]) -> Summary {
    let pieces = design.kit.pieces.as_slice();
    let volume: f64 = pieces.iter().map(TriMesh::signed_volume).sum();
    let usable: f64 = design.kit.contacts.iter().map(|c| c.usable_mm).sum();
    let made: f64 = design.kit.joints.iter().map(|j| j.length_mm).sum();
    Summary {
        volume_ratio: volume / model.solid.volume(),
        grams: printing.grams(),
        connector_share: if usable > 0.0 {
            (made / usable).min(1.0)
        } else {
            0.0
        },
        thin_share: thin.iter().copied().fold(0.0, f64::max),
    }
}

fn plan_file(
    model: &Model,
    settings: &Settings,
    design: &Design,
    warnings: &[Warning],
    summary: &Summary,
    thin: &[f64],
    printing: &Printing,
) -> PlanFile {
    let told = Told {
        program: env!("CARGO_PKG_VERSION"),
        source: Source {
            file: &model.name,
            sha256: &model.sha256,
            transform: model.transform,
            object: model.selection.object.as_deref(),
            plate: model.selection.plate.as_deref(),
            repairs: &model.repairs,
        },
        warnings,
        volume_ratio: summary.volume_ratio,
        connector_share: summary.connector_share,
        thin_shares: thin,
        printing: printing.entry(),
    };
    PlanFile::of(settings, design, &told)
}

/// All pieces in place, named and coloured, as a 3MF in the model's own orientation.
fn assembly(design: &Design) -> Vec<u8> {
    let names: Vec<String> = design.kit.pieces.ids().map(|p| format!("piece {p}")).collect();
    let objects: Vec<NamedObject> = design
        .kit
        .pieces
        .iter()
        .zip(&names)
        .map(|((p, mesh), name)| NamedObject {
            name,
            color: palette::color(p.into()),
            mesh,
            rotation: None,
            moved_mm: [0.0; 3],
            settings: &[],
        })
        .collect();
    write_3mf(&objects)
}

/// Builds the certificate of a kit. `files` are the pieces' files in order of their ids; `others` are listed
/// with their hashes. `None` where nothing can be certified.
fn certificate(
    files: &[(String, Vec<u8>)],
    others: &[(String, Vec<u8>)],
    design: &Design,
    clearance_mm: f64,
) -> Option<Vec<u8>> {
    let other = |(file, bytes): &(String, Vec<u8>)| OtherFile {
        file: file.clone(),
        sha256: sha256(bytes),
    };
    let named = files.iter().zip(design.kit.pieces.ids());
    let named = named
        .map(|((file, bytes), id)| PieceFile {
            id,
            file: file.clone(),
            sha256: sha256(bytes),
            play: None,
        })
        .collect();
    let evidence = Evidence {
        contacts: &design.kit.touches,
        verdict: &design.kit.verification,
        gaps: &design.gaps,
        play: Some(&design.kit.play),
    };
    certify(
        named,
        &design.kit.pieces,
        &design.kit.plan,
        &evidence,
        clearance_mm,
    )
    .map(|c| {
        c.with_press_fits(design.kit.press_fits.clone())
            .with_files(others.iter().map(other).collect())
    })
    .map(|c| certificate_bytes(&c))
}

/// Bytes of a certificate as written to [`CERTIFICATE`].
pub fn certificate_bytes(certificate: &Certificate) -> Vec<u8> {
    let mut bytes = serde_json::to_vec(certificate).expect("numbers and strings can be written");
    bytes.push(b'\n');
    bytes
}

/// Chart of the stress in the model and along its seams, as SVG.
fn stress_chart(options: &Options, settings: &Settings, design: &Design, strength: &Strength) -> String {
    let map = StressMap::new(strength);
    let seams: Vec<SeamStress> = design
        .kit
        .surface
        .seams()
        .into_iter()
        .map(|seam| SeamStress {
            stress_mpa: seam.points.par_iter().map(|p| map.at(*p)).collect(),
            size_mm: design.kit.sizes.of(seam.a, seam.b),
            points: seam.points,
        })
        .collect();
    strength_chart(strength, settings.strength.material.strength_mpa, &seams, |v| {
        turn_upright(options.up, v)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An earlier kit of one piece in a folder, and a destination that may replace it.
    fn earlier_kit(dir: &Path) -> Destination {
        let folder = dir.join("kit");
        fs::create_dir_all(folder.join("pieces")).unwrap();
        fs::write(folder.join(PLAN), "earlier").unwrap();
        fs::write(folder.join("pieces/piece-1.stl"), "earlier").unwrap();
        Destination::new(folder, true).unwrap()
    }

    fn files(names: &[&str]) -> Vec<(String, Vec<u8>)> {
        names
            .iter()
            .map(|name| ((*name).to_owned(), b"new".to_vec()))
            .collect()
    }

    #[test]
    fn an_earlier_kit_is_replaced_whole() {
        let dir = tempfile::tempdir().unwrap();
        let to = earlier_kit(dir.path());
        to.write(&files(&[PLAN])).unwrap();
        assert_eq!(fs::read(to.folder().join(PLAN)).unwrap(), b"new");
        assert!(!to.folder().join("pieces").exists());
        assert_eq!(
            fs::read_dir(dir.path()).unwrap().count(),
            1,
            "nothing else is left"
        );
    }

    #[test]
    fn an_earlier_kit_comes_back_where_the_new_one_cannot_take_its_place() {
        let dir = tempfile::tempdir().unwrap();
        let to = earlier_kit(dir.path());
        // Without files no folder is made, so the last rename has nothing to move.
        assert!(matches!(to.write(&[]), Err(Failure::Unwritable { .. })));
        for name in [PLAN, "pieces/piece-1.stl"] {
            assert_eq!(fs::read(to.folder().join(name)).unwrap(), b"earlier", "{name}");
        }
        assert_eq!(
            fs::read_dir(dir.path()).unwrap().count(),
            1,
            "nothing else is left"
        );
    }

    #[test]
    fn an_empty_folder_stays_where_no_kit_can_take_its_place() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("kit");
        fs::create_dir(&folder).unwrap();
        let to = Destination::new(folder, false).unwrap();
        assert!(matches!(to.write(&[]), Err(Failure::Unwritable { .. })));
        assert!(to.folder().is_dir());
        to.write(&files(&[PLAN])).unwrap();
        assert_eq!(fs::read(to.folder().join(PLAN)).unwrap(), b"new");
    }

    #[test]
    fn an_earlier_kit_that_cannot_be_put_back_is_not_deleted() {
        let dir = tempfile::tempdir().unwrap();
        let [made, place, earlier] = ["made", "place", "earlier"].map(|name| dir.path().join(name));
        // A file is in the place, so no folder can be moved there.
        fs::write(&place, "").unwrap();
        for folder in [&made, &earlier] {
            fs::create_dir(folder).unwrap();
        }
        let failed = replace(&made, &place, &earlier);
        assert!(matches!(failed, Err(NotReplaced::Lost(_))));
        assert!(earlier.is_dir() && place.is_file());
    }

    #[test]
    fn every_file_of_a_kit_may_be_replaced_and_no_other() {
        let dir = tempfile::tempdir().unwrap();
        let put = |name: &str| {
            let path = name
                .split('/')
                .fold(dir.path().to_owned(), |path, part| path.join(part));
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        };
        KIT_FILES.into_iter().for_each(put);
        ["pieces/piece-1.stl", "pieces/piece-12.stl", "plates/plate-1.3mf"]
            .into_iter()
            .for_each(put);
        assert_eq!(foreign_file(dir.path()), None);
        put("pieces/more/piece-2.stl");
        assert_eq!(
            foreign_file(dir.path()).as_deref(),
            Some("pieces/more/piece-2.stl")
        );
    }
}
