//! 3MF: a zip archive of XML files. Reads core specification 1.3, with materials, colours, sets of triangles
//! and parts in several files, and the additions of slicers: paint, extruders, plates, and volumes that are
//! no part of the model or are cut out of it.

mod build;
mod extension;
mod model;
mod namespace;
mod package;
mod part;
mod parts;
mod role;
mod settings;
mod write;
mod xml;

pub use write::{NamedObject, write_3mf, write_painted_3mf};

use super::{Loaded, ReadError};
use model::Model;
use package::Package;
use settings::Settings;

/// Reads a 3MF: all objects of its build, in one mesh.
pub(super) fn read(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let mut package = Package::open(bytes)?;
    let root = package.root()?;
    let model = Model::read(&root, &mut package)?;
    if model.objects.is_empty() && package.has_tool_paths() {
        return Err(ReadError::Sliced);
    }
    let settings = Settings::read(&mut package)?;
    build::read(&model, &settings)
}

#[cfg(test)]
mod tests;
