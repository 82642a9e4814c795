//! Collects points and polygons while a file is read.

use super::{Format, LabelSource, Labelling, Loaded, Place, ReadError};
use shellock_geom::{TriMesh, Vec3, polygon};

/// The mesh so far. Polygons may refer to later points; [`Polygons::finish`] checks that they exist.
pub(super) struct Polygons {
    mesh: TriMesh,
    file_face: Vec<u32>,
    n_faces: u32,
    /// Highest point index so far and its place, as faces may come before their points.
    highest: Option<(u32, Place)>,
    /// Index of the first point in the format: 1 in OBJ, otherwise 0.
    first: u32,
}

impl Polygons {
    /// Creates an empty mesh; the format counts its points from `first`.
    pub(super) fn counted_from(first: u32) -> Self {
        Self {
            mesh: TriMesh::default(),
            file_face: Vec::new(),
            n_faces: 0,
            highest: None,
            first,
        }
    }

    /// Reserves memory. The caller must have checked that the bytes suffice for these counts.
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

    /// Converts an index counted from 0, which may be that of a later point.
    pub(super) fn corner(&self, index: i64, at: Place) -> Result<u32, ReadError> {
        u32::try_from(index).map_err(|_| self.missing_error(index, at))
    }

    /// Adds a polygon, as a fan around its first corner until all points are known.
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

    /// Returns the mesh, with the `labels` of the file's faces transferred to the triangles.
    ///
    /// Errors if there is no triangle or if a face refers to a missing point.
    pub(super) fn finish(
        mut self,
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
            return Err(self.missing_error(i64::from(index), at));
        }
        let n_folded = self.triangulate();
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
            has_unit: false,
            objects: Vec::new(),
            empty_plates: Vec::new(),
            cutters: Vec::new(),
            notes: Vec::from_iter((n_folded > 0).then(|| {
                format!(
                    "{n_folded} of the file's polygons cross themselves or are far from flat; their \
                     triangles may fold over each other, so export triangles instead if the surface is \
                     wrong there"
                )
            })),
        })
    }

    /// Cuts each polygon into triangles that do not fold, in place of its fan. Returns how many have none;
    /// they stay fans.
    fn triangulate(&mut self) -> usize {
        let (points, faces) = (&self.mesh.points, &self.file_face);
        let (mut from, mut n_folded) = (0, 0);
        let mut corners = Vec::new();
        while from < faces.len() {
            let to = from + faces[from..].iter().take_while(|&&f| f == faces[from]).count();
            let fan = &mut self.mesh.triangles[from..to];
            from = to;
            if fan.len() < 2 {
                continue;
            }
            corners.clear();
            corners.extend([fan[0][0], fan[0][1]]);
            corners.extend(fan.iter().map(|t| t[2]));
            let places: Vec<Vec3> = corners.iter().map(|&c| points[c as usize]).collect();
            match polygon::triangulate(&places) {
                Some(triangles) => fan
                    .iter_mut()
                    .zip(triangles)
                    .for_each(|(t, of)| *t = of.map(|i| corners[i as usize])),
                // A polygon without area folds nothing.
                None if polygon::has_area(&places) => n_folded += 1,
                None => {}
            }
        }
        n_folded
    }

    fn missing_error(&self, index: i64, at: Place) -> ReadError {
        let index = index.saturating_add(i64::from(self.first));
        ReadError::MissingPoint {
            at,
            index,
            n_points: self.n_points(),
            first: self.first,
        }
    }
}

/// Returns true if two labels differ.
pub(super) fn divides(labels: &[i64]) -> bool {
    labels.windows(2).any(|pair| pair[0] != pair[1])
}

/// Numbers names or colours from 0 by first occurrence.
#[derive(Default)]
pub(super) struct Numbering<T: Ord>(std::collections::BTreeMap<T, i64>);

impl<T: Ord> Numbering<T> {
    pub(super) fn number(&mut self, name: T) -> i64 {
        let next = self.0.len() as i64;
        *self.0.entry(name).or_insert(next)
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::super::{Format, read_mesh};

    /// A prism over an outline, as polygons: two ends and the sides.
    fn prism(outline: &[[f64; 2]]) -> (Vec<[f64; 3]>, Vec<Vec<usize>>) {
        let n = outline.len();
        let points = [0.0, 5.0]
            .iter()
            .flat_map(|&z| outline.iter().map(move |&[x, y]| [x, y, z]));
        let mut faces = vec![(0..n).rev().collect(), (n..2 * n).collect()];
        faces.extend((0..n).map(|i| vec![i, (i + 1) % n, n + (i + 1) % n, n + i]));
        (points.collect(), faces)
    }

    #[test]
    fn polygons_with_notches_do_not_fold_in_any_format() {
        let u = [[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]].map(|p| p.map(f64::from));
        let (points, faces) = prism(&u);
        let mut obj = String::new();
        let mut off = format!("OFF\n{} {} 0\n", points.len(), faces.len());
        let mut ply = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float \
             z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            points.len(),
            faces.len()
        );
        for [x, y, z] in &points {
            writeln!(obj, "v {x} {y} {z}").unwrap();
            writeln!(off, "{x} {y} {z}").unwrap();
            writeln!(ply, "{x} {y} {z}").unwrap();
        }
        for face in &faces {
            let joined = |first: usize| face.iter().map(|i| format!(" {}", i + first)).collect::<String>();
            writeln!(obj, "f{}", joined(1)).unwrap();
            writeln!(off, "{}{}", face.len(), joined(0)).unwrap();
            writeln!(ply, "{}{}", face.len(), joined(0)).unwrap();
        }
        for (text, format) in [(obj, Format::Obj), (off, Format::Off), (ply, Format::Ply)] {
            let loaded = read_mesh(text.as_bytes(), None).unwrap();
            assert_eq!(loaded.format, format);
            // 2 ends of 7 squares, 16 units of outline 5 high.
            assert!(
                (loaded.mesh.area() - (14.0 + 16.0 * 5.0)).abs() < 1e-9,
                "{format:?}"
            );
            assert_eq!(loaded.notes, Vec::<String>::new());
        }
    }

    #[test]
    fn polygons_that_cross_themselves_are_noted() {
        let crossed = "v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 2 3 4\n";
        assert_eq!(read_mesh(crossed.as_bytes(), Some("obj")).unwrap().notes.len(), 1);
    }
}
