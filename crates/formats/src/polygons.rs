//! Collects points and polygons while a file is read.

use super::{Format, LabelSource, Labelling, Loaded, Place, ReadError};
use shellock_geom::{TriMesh, Vec3};

/// The mesh so far. Polygons may name points that come later; [`Polygons::finish`] settles that.
pub(super) struct Polygons {
    mesh: TriMesh,
    file_face: Vec<u32>,
    n_faces: u32,
    /// The highest point named so far and where, as faces may come before their points.
    highest: Option<(u32, Place)>,
    /// Index of the first point in the format: 1 in OBJ, otherwise 0.
    first: u32,
}

impl Polygons {
    /// Nothing yet; the format counts its points from `first`.
    pub(super) fn counted_from(first: u32) -> Self {
        Self {
            mesh: TriMesh::default(),
            file_face: Vec::new(),
            n_faces: 0,
            highest: None,
            first,
        }
    }

    /// Reserves; the caller has checked that the bytes back these counts.
    pub(super) fn reserve(&mut self, n_points: usize, n_triangles: usize) {
        self.mesh.points.reserve(n_points);
        self.mesh.triangles.reserve(n_triangles);
        self.file_face.reserve(n_triangles);
    }

    pub(super) fn n_points(&self) -> usize {
        self.mesh.points.len()
    }

    pub(super) fn n_faces(&self) -> usize {
        self.n_faces as usize
    }

    /// Adds a point and returns its index.
    pub(super) fn add_point(&mut self, coordinates: [f64; 3], at: Place) -> Result<u32, ReadError> {
        let point = Vec3::from_array(coordinates);
        if !point.is_finite() {
            return Err(ReadError::NotFinite { at });
        }
        let index = u32::try_from(self.n_points()).map_err(|_| ReadError::TooLarge { at })?;
        self.mesh.points.push(point);
        Ok(index)
    }

    /// An index counted from 0, which may be that of a later point.
    pub(super) fn corner(&self, index: i64, at: Place) -> Result<u32, ReadError> {
        u32::try_from(index).map_err(|_| self.missing(index, at))
    }

    /// Adds a polygon as a fan around its first corner.
    pub(super) fn add_polygon(&mut self, corners: &[u32], at: Place) -> Result<(), ReadError> {
        let [first, rest @ ..] = corners else {
            return Err(ReadError::TooFewCorners { at, n_corners: 0 });
        };
        if rest.len() < 2 {
            return Err(ReadError::TooFewCorners {
                at,
                n_corners: corners.len(),
            });
        }
        let highest = rest.iter().fold(*first, |a, &b| a.max(b));
        if self.highest.is_none_or(|(index, _)| highest > index) {
            self.highest = Some((highest, at));
        }
        for pair in rest.windows(2) {
            self.mesh.triangles.push([*first, pair[0], pair[1]]);
            self.file_face.push(self.n_faces);
        }
        self.n_faces = self.n_faces.checked_add(1).ok_or(ReadError::TooLarge { at })?;
        Ok(())
    }

    /// The mesh, with `labels` of the file's faces handed on to the triangles.
    pub(super) fn finish(
        self,
        format: Format,
        labels: Vec<(LabelSource, Vec<i64>)>,
    ) -> Result<Loaded, ReadError> {
        let n_points = self.n_points();
        if self.mesh.triangles.is_empty() {
            return Err(ReadError::NoTriangles { format, n_points });
        }
        if let Some((index, at)) = self.highest
            && index as usize >= n_points
        {
            return Err(self.missing(i64::from(index), at));
        }
        let mut labellings: Vec<Labelling> = labels
            .into_iter()
            .filter(|(source, labels)| *source == LabelSource::Property || divides(labels))
            .map(|(source, labels)| Labelling {
                source,
                labels: self.file_face.iter().map(|&face| labels[face as usize]).collect(),
            })
            .collect();
        labellings.sort_by_key(|l| l.source);
        let (mesh, file_face) = (self.mesh, self.file_face);
        Ok(Loaded {
            mesh,
            labellings,
            file_face,
            format,
            unit_mm: None,
            unit_is_stated: false,
            objects: Vec::new(),
            empty_plates: Vec::new(),
            cutters: Vec::new(),
            notes: Vec::new(),
        })
    }

    fn missing(&self, index: i64, at: Place) -> ReadError {
        let index = index.saturating_add(i64::from(self.first));
        ReadError::MissingPoint {
            at,
            index,
            n_points: self.n_points(),
            first: self.first,
        }
    }
}

/// Whether there are two different labels.
pub(super) fn divides(labels: &[i64]) -> bool {
    labels.windows(2).any(|pair| pair[0] != pair[1])
}

/// Numbers names or colours from 0 as they first occur.
#[derive(Default)]
pub(super) struct Numbering<T: Ord>(std::collections::BTreeMap<T, i64>);

impl<T: Ord> Numbering<T> {
    pub(super) fn number(&mut self, name: T) -> i64 {
        let next = self.0.len() as i64;
        *self.0.entry(name).or_insert(next)
    }
}
