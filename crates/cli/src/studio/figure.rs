//! A model that is open in the studio: its surface as the page shows it, and the way from there to the faces of its file.

use std::path::Path;

use rayon::prelude::*;
use shellock::SegmentedSurface;
use shellock_geom::bvh::TriangleBvh;
use shellock_geom::thin::thin_faces;
use shellock_geom::{TriMesh, Vec3};

use crate::Session;
use crate::args::{Axis, Options};
use crate::failure::Failure;
use crate::input::{self, Model};
use crate::output::standing;
use crate::shape::{shape_warnings, wall_mm};
use crate::shares::largest_shares;

/// How a mesh for the page begins: "SHMV", then the version.
const MAGIC: u32 = 0x564d_4853;
const VERSION: u32 = 1;

/// A model that is open.
pub struct Figure {
    /// As it is made: described by fewer triangles where it has very many.
    pub model: Model,
    /// Where the model was given with more triangles: for each of those the nearest that is shown, the face of the
    /// file that it came from, and its area.
    full: Option<Vec<(u32, u32, f64)>>,
    /// Which triangles are too thin to be hollow.
    is_thin: Vec<bool>,
    /// What is said of those.
    pub warnings: Vec<String>,
}

impl Figure {
    /// Opens the file at `path`.
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

    /// How many triangles are shown.
    pub fn n_faces(&self) -> usize {
        self.model.solid.mesh().triangles.len()
    }

    /// Whether all triangles of the model are shown.
    pub fn is_exact(&self) -> bool {
        self.full.is_none()
    }

    /// Share of the surface that is too thin to be hollow, in [0, 1].
    pub fn thin_share(&self) -> f64 {
        let mesh = self.model.solid.mesh();
        let thin = (0..self.n_faces()).filter(|&f| self.is_thin[f]);
        // An empty sum is -0.
        thin.map(|f| mesh.face_area(f)).sum::<f64>() / mesh.area() + 0.0
    }

    /// The surface as the page reads it: header, points (32-bit), corners, a byte a triangle for what is thin.
    pub fn bytes(&self, up: Axis) -> Vec<u8> {
        shown(self.model.solid.mesh(), up, self.is_thin.iter().copied())
    }

    /// For each triangle that is shown, the patch that has most of it.
    pub fn labels_of(&self, surface: &SegmentedSurface) -> Vec<u32> {
        let patches = surface.source_face.iter().zip(&surface.patch_of_face).enumerate();
        let parts = patches.map(|(face, (&source, patch))| (source, patch.0, surface.mesh.face_area(face)));
        let most = largest_shares(self.n_faces(), parts);
        most.into_iter().map(Option::unwrap_or_default).collect()
    }

    /// For each face of the file, the label that most of it has; 0 where nothing is left of a face.
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
        // A face that a triangle shown stands for has that one's label: it is where the program looks.
        let of_face = own.into_iter().zip(most).map(|(own, most)| own.or(most));
        of_face.map(Option::unwrap_or_default).collect()
    }

    /// The labels of the triangles shown, from one a face of the file.
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

/// A mesh as the page reads it, standing.
pub fn shown(mesh: &TriMesh, up: Axis, is_thin: impl Iterator<Item = bool>) -> Vec<u8> {
    let n = [mesh.points.len(), mesh.triangles.len()].map(|n| n as u32);
    let header = [MAGIC, VERSION, n[0], n[1]];
    let mut bytes: Vec<u8> = header.iter().flat_map(|x| x.to_le_bytes()).collect();
    let points = mesh.points.iter().flat_map(|&p| standing(up, p).to_array());
    bytes.extend(points.flat_map(|x| (x as f32).to_le_bytes()));
    bytes.extend(mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()));
    bytes.extend(is_thin.map(u8::from));
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

/// For each triangle of `full`, the one of `shown` that its middle is nearest to, its face and its area.
fn nearest(shown: &TriMesh, full: &TriMesh, file_face: &[u32]) -> Vec<(u32, u32, f64)> {
    let bvh = TriangleBvh::new(shown);
    let of = |face: usize| {
        let middle: Vec3 = full.face_center(face);
        let nearest = bvh.nearest(middle, f64::INFINITY).map_or(0, |n| n.face);
        (nearest, file_face[face], full.face_area(face))
    };
    (0..full.triangles.len()).into_par_iter().map(of).collect()
}
