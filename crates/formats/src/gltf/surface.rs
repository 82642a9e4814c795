//! The combined surface of all visible nodes.

use glam::{DAffine3, DVec3};

use super::super::point_colors::Color;
use super::super::{FileObject, Place, ReadError};
use super::document::Primitive;
use super::error;
use super::nodes::Nodes;
use super::primitives::{Counts, Piece};
use super::skin::Posed;
use super::values::Accessors;
use shellock_geom::TriMesh;

/// A visible node with triangles.
pub(super) struct Figure {
    pub(super) node: usize,
    pub(super) mesh: usize,
    pub(super) n_instances: usize,
}

/// All triangles so far, with the labels that divide them.
#[derive(Default)]
pub(super) struct Surface {
    pub(super) mesh: TriMesh,
    /// Material of each triangle, −1 for none.
    pub(super) material: Vec<i64>,
    /// Index into `objects` for each triangle: the copy of a node's mesh that it belongs to.
    pub(super) object: Vec<i64>,
    /// Names of those copies.
    pub(super) objects: Vec<FileObject>,
    /// Colour of each point.
    pub(super) colors: Vec<Color>,
    /// True if some primitive has colours of points.
    pub(super) has_colors: bool,
    /// True if some primitive has unreadable colours of points.
    pub(super) has_bad_colors: bool,
    /// True if an image colours some primitive.
    pub(super) has_texture: bool,
}

/// A copy of a primitive, with labels that hold for all its triangles.
struct Copy<'a> {
    piece: &'a Piece,
    colors: &'a [Color],
    material: i64,
    object: i64,
}

impl Surface {
    /// Adds all copies of the mesh of a node, whose primitives are counted in `counts`.
    pub(super) fn add(
        &mut self,
        accessors: &Accessors,
        nodes: &Nodes,
        figure: &Figure,
        counts: &Counts,
    ) -> Result<(), ReadError> {
        let node = &accessors.document.nodes[figure.node];
        let mesh = &accessors.document.meshes[figure.mesh];
        let places = accessors.places(node, figure.n_instances, nodes.transforms[figure.node])?;
        let pose = node.skin.map(|skin| accessors.pose(skin, nodes)).transpose()?;
        let weights = node.weights.as_ref().unwrap_or(&mesh.weights);
        for &number in &counts.with_triangles {
            let primitive = &mesh.primitives[number];
            let mut piece = accessors.piece(primitive)?;
            accessors.morph(primitive, weights, &mut piece)?;
            self.has_texture |= accessors.has_texture(primitive);
            let colors = self.colors_of(accessors, primitive, &piece);
            let mut copy = Copy {
                piece: &piece,
                colors: &colors,
                material: primitive.material.map_or(-1, |m| m as i64),
                object: self.objects.len() as i64,
            };
            let posed = match &pose {
                Some(pose) => accessors.apply_pose(primitive, pose, &piece)?,
                None => None,
            };
            if let Some(posed) = posed {
                self.add_skin(&copy, &posed)?;
                continue;
            }
            for &placed in &places {
                self.add_copy(&copy, placed)?;
                copy.object += 1;
            }
        }
        let first = self.objects.len() as u32;
        let named = (first..).zip(&places).map(|(item, _)| FileObject {
            name: node.name.clone(),
            part: None,
            item,
            plate: None,
        });
        self.objects.extend(named);
        Ok(())
    }

    /// Colours of the points of `piece`. Unreadable ones are no reason to reject the shape and become white.
    fn colors_of(&mut self, accessors: &Accessors, primitive: &Primitive, piece: &Piece) -> Vec<Color> {
        const WHITE: Color = [u8::MAX; 4];
        match accessors.colors(primitive, piece) {
            Ok(colors) => {
                self.has_colors |= colors.are_own;
                colors.colors
            }
            Err(_) => {
                self.has_bad_colors = true;
                vec![WHITE; piece.used.len()]
            }
        }
    }

    /// Adds a copy with one transform for all points.
    fn add_copy(&mut self, copy: &Copy, placed: DAffine3) -> Result<(), ReadError> {
        let points = copy.piece.points.iter().map(|&p| placed.transform_point3(p));
        let first = self.add_points(copy, points)?;
        let is_mirrored = placed.matrix3.determinant() < 0.0;
        self.add_triangles(copy, first, |_| is_mirrored);
        Ok(())
    }

    /// Adds a copy whose points are moved by joints. A triangle is mirrored if the determinants at its
    /// corners have a negative sum.
    fn add_skin(&mut self, copy: &Copy, posed: &Posed) -> Result<(), ReadError> {
        let first = self.add_points(copy, posed.points.iter().copied())?;
        let determinant = |corner: u32| posed.determinants[corner as usize];
        self.add_triangles(copy, first, |corners| {
            corners.map(determinant).iter().sum::<f64>() < 0.0
        });
        Ok(())
    }

    /// Adds points and their colours. Returns the index of the first.
    fn add_points(&mut self, copy: &Copy, points: impl Iterator<Item = DVec3>) -> Result<u32, ReadError> {
        let too_large = |_| ReadError::TooLarge { at: Place::Byte(0) };
        let first = u32::try_from(self.mesh.points.len()).map_err(too_large)?;
        for (point, row) in points.zip(&copy.piece.used) {
            if !point.is_finite() {
                return Err(error(format!(
                    "point {row} of accessor {} is not a finite number",
                    copy.piece.position
                )));
            }
            self.mesh.points.push(point);
        }
        u32::try_from(self.mesh.points.len()).map_err(too_large)?;
        self.colors.extend(copy.colors);
        Ok(first)
    }

    fn add_triangles(&mut self, copy: &Copy, first: u32, is_mirrored: impl Fn([u32; 3]) -> bool) {
        for &corners in &copy.piece.triangles {
            let [a, b, c] = corners.map(|corner| first + corner);
            let is_mirrored = is_mirrored(corners);
            self.mesh
                .triangles
                .push(if is_mirrored { [a, c, b] } else { [a, b, c] });
        }
        self.material.resize(self.mesh.triangles.len(), copy.material);
        self.object.resize(self.mesh.triangles.len(), copy.object);
    }
}
