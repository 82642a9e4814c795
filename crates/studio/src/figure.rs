//! A model that is open in the studio: the surface that the page shows, and its relation to the faces of the
//! file.

use std::path::Path;

use rayon::prelude::*;
use shellock::SegmentedSurface;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::thin::thin_faces;
use shellock_geom::{TriMesh, Vec3};
use shellock_job::input::{self, Model};
use shellock_job::options::Axis;
use shellock_job::output::turn_upright;
use shellock_job::shape::{shape_warnings, wall_mm};
use shellock_job::shares::largest_shares;
use shellock_job::{Failure, Options, Session};

use crate::messages;

/// First bytes of a mesh for the page: "SHMV", then the version.
const MAGIC: u32 = 0x564d_4853;
const VERSION: u32 = 1;

/// An open model with the data that the page shows.
pub struct Figure {
    /// Model as it is made: simplified if it has very many triangles.
    pub model: Model,
    /// Original triangles if the model was simplified: for each, the nearest shown triangle, its face of the
    /// file, and its area.
    full: Option<Vec<(u32, u32, f64)>>,
    /// True for triangles that are too thin to be hollow.
    is_thin: Vec<bool>,
    /// Warnings about the file and the shape, such as thin parts.
    pub warnings: Vec<String>,
}

impl Figure {
    /// Opens the model in the file at `path`.
    pub fn open(session: &Session, path: &Path, options: &Options) -> Result<Self, Failure> {
        let given = input::model(session, path, options)?;
        let before = (given.solid.mesh().clone(), given.file_face.clone());
        let model = input::simple(session, given, options)?;
        let is_same = model.solid.mesh().triangles.len() == before.0.triangles.len();
        let full = (!is_same).then(|| nearest(model.solid.mesh(), &before.0, &before.1));
        let is_thin = thin_faces(&model.solid, 2.0 * wall_mm(options))
            .into_iter()
            .map(|mm| mm.is_some())
            .collect();
        Ok(Self {
            warnings: model
                .warnings
                .iter()
                .map(ToString::to_string)
                .chain(shape_warnings(&model, options))
                .collect(),
            model,
            full,
            is_thin,
        })
    }

    /// Describes the model for the page; `finer` is a note on triangles that were divided.
    pub fn describe(&self, finer: Option<String>, up: Axis) -> messages::Model {
        let model = &self.model;
        let size = turn_upright(up, model.solid.mesh().bounds().size()).abs();
        messages::Model {
            name: model.name.clone(),
            n_triangles: self.n_faces(),
            size_mm: size.to_array(),
            notes: finer.into_iter().chain(model.notes.clone()).collect(),
            warnings: self.warnings.clone(),
            thin_share: self.thin_share(),
            view_triangles: self.n_faces(),
            is_exact: self.is_exact(),
        }
    }

    /// Number of triangles that are shown.
    pub fn n_faces(&self) -> usize {
        self.model.solid.mesh().triangles.len()
    }

    /// Returns true if all triangles of the model are shown.
    pub fn is_exact(&self) -> bool {
        self.full.is_none()
    }

    /// Share of the surface that is too thin to be hollow, in [0, 1].
    pub fn thin_share(&self) -> f64 {
        let mesh = self.model.solid.mesh();
        let thin = (0..self.n_faces()).filter(|&f| self.is_thin[f]);
        // An empty sum is −0; adding 0 makes it 0.
        thin.map(|f| mesh.face_area(f)).sum::<f64>() / mesh.area() + 0.0
    }

    /// Surface in the page's format: header, points (32-bit), corners, and a byte for each triangle that is 1
    /// if thin.
    pub fn bytes(&self, up: Axis) -> Vec<u8> {
        encode_upright(self.model.solid.mesh(), up, self.is_thin.iter().copied())
    }

    /// Patch with the largest share of each triangle that is shown.
    pub fn labels_of(&self, surface: &SegmentedSurface) -> Vec<u32> {
        let patches = surface.source_face.iter().zip(&surface.patch_of_face).enumerate();
        let parts = patches.map(|(face, (&source, patch))| (source, patch.0, surface.mesh.face_area(face)));
        let most = largest_shares(self.n_faces(), parts);
        most.into_iter().map(Option::unwrap_or_default).collect()
    }

    /// Label with the largest share of each face of the file; 0 for faces of which nothing is left.
    pub fn file_labels(&self, labels: &[u32]) -> Vec<u32> {
        let n = self.model.n_file_faces;
        let full = self.full.iter().flatten();
        let most = largest_shares(
            n,
            full.map(|&(shown, face, area)| (face, labels[shown as usize], area)),
        );
        let mesh = self.model.solid.mesh();
        let own = self.model.file_face.iter().enumerate();
        let own = largest_shares(n, own.map(|(f, &face)| (face, labels[f], mesh.face_area(f))));
        // If a shown triangle stems from the face, its label counts, because that is where the program looks.
        let of_face = own.into_iter().zip(most).map(|(own, most)| own.or(most));
        of_face.map(Option::unwrap_or_default).collect()
    }

    /// Labels of the shown triangles, from one label a face of the file; `None` if the number of faces
    /// differs.
    pub fn shown_labels(&self, of_file: &[u32]) -> Option<Vec<u32>> {
        let is_fitting = of_file.len() == self.model.n_file_faces;
        is_fitting.then(|| {
            self.model
                .file_face
                .iter()
                .map(|&f| of_file[f as usize])
                .collect()
        })
    }
}

/// Turns a mesh upright and writes it in the page's format.
pub fn encode_upright(mesh: &TriMesh, up: Axis, is_thin: impl Iterator<Item = bool>) -> Vec<u8> {
    let n = [mesh.points.len(), mesh.triangles.len()].map(|n| n as u32);
    let header = [MAGIC, VERSION, n[0], n[1]];
    let mut bytes: Vec<u8> = header.iter().flat_map(|x| x.to_le_bytes()).collect();
    let points = mesh.points.iter().flat_map(|&p| turn_upright(up, p).to_array());
    bytes.extend(points.flat_map(|x| (x as f32).to_le_bytes()));
    bytes.extend(mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()));
    bytes.extend(is_thin.map(u8::from));
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

/// For each triangle of `full`: the triangle of `shown` nearest to its centre, its face of the file, and its
/// area.
fn nearest(shown: &TriMesh, full: &TriMesh, file_face: &[u32]) -> Vec<(u32, u32, f64)> {
    let bvh = TriangleBvh::new(shown);
    let of = |face: usize| {
        let middle: Vec3 = full.face_center(face);
        let nearest = bvh.nearest(middle, f64::INFINITY).map_or(0, |n| n.face);
        (nearest, file_face[face], full.face_area(face))
    };
    (0..full.triangles.len()).into_par_iter().map(of).collect()
}
