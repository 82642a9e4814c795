//! Unwrapping of mesh files from gzip, from a zip with a single mesh, and from UTF-16. The unpacked size is
//! limited.

use std::borrow::Cow;
use std::io::{Cursor, Read};

use flate2::read::MultiGzDecoder;
use zip::ZipArchive;
use zip::result::ZipError;

use super::{ReadError, recognise, stl};

/// Unpacked size that every file may have, bytes.
const FREE_BYTES: u64 = 64 << 20;
/// Beyond `FREE_BYTES`, largest unpacked size per packed byte. Text of meshes is packed 4 to 20 times, and
/// deflate packs at most 1032 times.
const MAX_RATIO: u64 = 100;
/// Unpacked size that no file may exceed, bytes.
const MAX_BYTES: u64 = 2 << 30;
/// Endings of mesh names within archives.
const MESH_NAMES: [&[u8]; 8] = [
    b".stl", b".obj", b".ply", b".off", b".3mf", b".glb", b".gltf", b".gz",
];

/// Returns the mesh file without its wrapping, and its name in a zip archive.
pub(super) fn unpack(bytes: &[u8]) -> Result<(Cow<'_, [u8]>, Option<String>), ReadError> {
    let (mut bytes, mut name) = (Cow::Borrowed(bytes), None);
    // A packed file in an archive is common, more layers are not.
    for _ in 0..2 {
        if bytes.starts_with(b"\x1F\x8B") {
            let limit = limit(bytes.len());
            bytes = Cow::Owned(read_up_to(MultiGzDecoder::new(&bytes[..]), limit)?);
        } else if bytes.starts_with(b"PK\x03\x04") && !is_3mf(&bytes) {
            let (inner, inner_name) = only_mesh(&bytes)?;
            (bytes, name) = (Cow::Owned(inner), Some(inner_name));
        }
    }
    if recognise::is_utf16(&bytes) && !stl::length_fits_binary(&bytes) {
        bytes = Cow::Owned(utf8(&bytes));
    }
    Ok((bytes, name))
}

/// Largest unpacked size allowed for a file of `packed` bytes.
pub(super) fn limit(packed: usize) -> u64 {
    (FREE_BYTES + MAX_RATIO * packed as u64).min(MAX_BYTES)
}

/// Reads `source` to its end; an error beyond `limit` bytes.
pub(super) fn read_up_to(source: impl Read, limit: u64) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    source
        .take(limit + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| opening_error(e.into()))?;
    if bytes.len() as u64 > limit {
        Err(ReadError::Bomb {
            limit_mb: limit >> 20,
        })
    } else {
        Ok(bytes)
    }
}

/// Opens a zip archive in memory.
pub(super) fn archive(bytes: &[u8]) -> Result<ZipArchive<Cursor<&[u8]>>, ReadError> {
    ZipArchive::new(Cursor::new(bytes)).map_err(opening_error)
}

/// Converts an error in opening an archive, or a file in one.
pub(super) fn opening_error(error: ZipError) -> ReadError {
    // Some errors are reported only on reading the file, wrapped in an I/O error.
    let error = match error {
        ZipError::Io(io) => io.downcast().unwrap_or_else(ZipError::Io),
        other => other,
    };
    match error {
        ZipError::UnsupportedArchive(_)
        | ZipError::CompressionMethodNotSupported(_)
        | ZipError::InvalidPassword => ReadError::Packing {
            reason: error.to_string(),
        },
        ZipError::Io(io) => ReadError::Damaged {
            reason: io.to_string(),
        },
        other => ReadError::Damaged {
            reason: other.to_string(),
        },
    }
}

/// Returns true if a zip archive is a 3MF package. A damaged one counts if it contains the name of a 3MF
/// model.
fn is_3mf(bytes: &[u8]) -> bool {
    match archive(bytes) {
        Ok(archive) => archive
            .file_names_raw()
            .any(|name| name.to_ascii_lowercase().ends_with(b".model")),
        Err(_) => bytes.windows(13).any(|window| window == b"3dmodel.model"),
    }
}

fn only_mesh(bytes: &[u8]) -> Result<(Vec<u8>, String), ReadError> {
    let mut archive = archive(bytes)?;
    let is_mesh = |name: &[u8]| {
        let name = name.to_ascii_lowercase();
        !name.starts_with(b"__macosx") && MESH_NAMES.iter().any(|end| name.ends_with(end))
    };
    let meshes: Vec<usize> = archive
        .file_names_raw()
        .enumerate()
        .filter(|(_, name)| is_mesh(name))
        .map(|(i, _)| i)
        .collect();
    let &[only] = &meshes[..] else {
        return Err(ReadError::Archive {
            n_models: meshes.len(),
        });
    };
    let name = archive
        .file_names_raw()
        .nth(only)
        .map_or_else(String::new, |n| String::from_utf8_lossy(n).into_owned());
    let file = archive.by_index(only).map_err(opening_error)?;
    Ok((read_up_to(file, limit(bytes.len()))?, name))
}

/// Converts text that looks like UTF-16 to UTF-8; other bytes are unchanged.
pub(super) fn as_utf8(bytes: Vec<u8>) -> Vec<u8> {
    if recognise::is_utf16(&bytes) {
        utf8(&bytes)
    } else {
        bytes
    }
}

/// Converts UTF-16 of either byte order to UTF-8; invalid characters become "�".
fn utf8(bytes: &[u8]) -> Vec<u8> {
    let is_little_endian =
        !bytes.starts_with(b"\xFE\xFF") && (bytes.starts_with(b"\xFF\xFE") || bytes[0] != 0);
    let join = if is_little_endian {
        u16::from_le_bytes
    } else {
        u16::from_be_bytes
    };
    let units = bytes.chunks_exact(2).map(|pair| join([pair[0], pair[1]]));
    char::decode_utf16(units)
        .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
        .collect::<String>()
        .into_bytes()
}
