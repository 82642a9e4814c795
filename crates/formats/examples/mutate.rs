//! Damages files at random, reads and repairs the result, for the given number of rounds: `mutate ROUNDS SEED
//! FILE…`.
//!
//! Equal arguments give equal damage; a panic names the round. Models within 3MF packages are damaged before
//! they are packed again, so that checksums do not hide all of it. Coverage-guided fuzzing is in `fuzz/`.

use std::io::{Cursor, Read as _, Write as _};
use std::path::Path;
use std::time::{Duration, Instant};

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shellock_formats::{read_labels, read_mesh};
use shellock_geom::repair::{RepairMode, repair};

/// Limit on mesh size: larger meshes take longer and find nothing more.
const MOST_TRIANGLES: usize = 3000;
/// Time after which a round is reported.
const SLOW: Duration = Duration::from_secs(3);

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut number = || arguments.next().and_then(|n| n.parse::<u64>().ok());
    let (Some(n_rounds), Some(seed)) = (number(), number()) else {
        eprintln!("mutate ROUNDS SEED FILE…");
        return;
    };
    let files: Vec<(String, Vec<u8>)> = arguments
        .filter_map(|path| std::fs::read(&path).ok().map(|bytes| (path, bytes)))
        .collect();
    let (mut n_read, mut n_mended) = (0, 0);
    for round in 0..n_rounds {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(round);
        let (path, bytes) = &files[rng.random_range(0..files.len())];
        let bytes = damage(bytes, &mut rng);
        let extension = Path::new(path).extension().and_then(|e| e.to_str());
        let start = Instant::now();
        let outcome = std::panic::catch_unwind(|| {
            let _ = read_labels(&bytes);
            let Ok(loaded) = read_mesh(&bytes, extension) else {
                return (0, 0);
            };
            assert_eq!(loaded.file_face.len(), loaded.mesh.triangles.len());
            if loaded.mesh.triangles.len() > MOST_TRIANGLES {
                return (1, 0);
            }
            (
                1,
                u32::from(repair(&loaded.mesh, RepairMode::KeepLargest).is_ok()),
            )
        });
        match outcome {
            Ok((read, repaired)) => (n_read, n_mended) = (n_read + read, n_mended + repaired),
            Err(_) => keep(&format!("round {round} panicked: {path}"), round, &bytes),
        }
        if start.elapsed() > SLOW {
            keep(
                &format!(
                    "round {round} took {:.1} s: {path}",
                    start.elapsed().as_secs_f64()
                ),
                round,
                &bytes,
            );
        }
    }
    println!("{n_rounds} rounds: {n_read} read, {n_mended} of them repaired to a body");
}

/// Reports a file and writes it for inspection.
fn keep(what: &str, round: u64, bytes: &[u8]) {
    let name = format!("damaged-{round}");
    println!("{what}, written to {name}: {:?}", std::fs::write(&name, bytes));
}

/// Returns the file with a few bytes changed, copied, cut out or cut off.
fn damage(bytes: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    match unpack(bytes) {
        Some((name, model)) if rng.random_bool(0.8) => pack(&name, &scratch(&model, rng)),
        _ => scratch(bytes, rng),
    }
}

fn scratch(bytes: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    /// Words that make numbers and lists invalid.
    const WORDS: [&[u8]; 10] = [
        b"-1",
        b"0",
        b"4294967295",
        b"1e999",
        b"nan",
        b"1e300",
        b"999999999999999999999",
        b"\n",
        b"\"",
        b"\xFF\xFF\xFF\xFF",
    ];
    let mut bytes = bytes.to_vec();
    for _ in 0..rng.random_range(1..6) {
        if bytes.is_empty() {
            return bytes;
        }
        let at = rng.random_range(0..bytes.len());
        let to = rng.random_range(at..bytes.len().min(at + 64) + 1);
        match rng.random_range(0..6) {
            0 => bytes[at] = rng.next_u32() as u8,
            1 => bytes[at] ^= 1 << rng.random_range(0..8),
            2 => drop(bytes.drain(at..to)),
            3 => {
                let word = WORDS[rng.random_range(0..WORDS.len())];
                bytes.splice(at..to.min(at + word.len()), word.iter().copied());
            }
            4 => {
                let from = rng.random_range(0..bytes.len());
                let piece = bytes[from..bytes.len().min(from + 64)].to_vec();
                bytes.splice(at..at, piece);
            }
            _ if rng.random_bool(0.1) => bytes.truncate(at),
            _ => {}
        }
    }
    bytes
}

/// Unpacks the model of a 3MF package.
fn unpack(bytes: &[u8]) -> Option<(String, Vec<u8>)> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).ok()?;
    let name = "3D/3dmodel.model".to_owned();
    let mut model = Vec::new();
    archive.by_name(&name).ok()?.read_to_end(&mut model).ok()?;
    Some((name, model))
}

fn pack(name: &str, model: &[u8]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    archive
        .start_file(name, zip::write::SimpleFileOptions::default())
        .expect("the name is a name");
    archive.write_all(model).expect("memory takes all bytes");
    archive.finish().expect("memory takes all bytes").into_inner()
}
