//! EXT_mesh_gpu_instancing: several copies of the mesh of a node.

use glam::DAffine3;

use super::super::ReadError;
use super::document::{Instancing, Node};
use super::error;
use super::nodes::compose;
use super::values::{Accessors, Shape, Values};

impl Accessors<'_> {
    /// Number of visible copies of the mesh of node `id`.
    pub(super) fn n_instances(&self, id: usize) -> Result<usize, ReadError> {
        let node = &self.document.nodes[id];
        let Some(instancing) = &node.extensions.instancing else {
            return Ok(1);
        };
        if node.skin.is_some() {
            return Err(ReadError::GltfUnsupported {
                what: format!("has instances of a mesh with a skin (node {id}), which have no defined place"),
                remedy: "apply the skin or the instances in the program that made it",
            });
        }
        let mut counts = Vec::new();
        for name in ["TRANSLATION", "ROTATION", "SCALE"] {
            if let Some(&which) = instancing.attributes.get(name) {
                counts.push(self.accessor(which)?.count);
            }
        }
        match counts.as_slice() {
            [] => Ok(1),
            [first, rest @ ..] if rest.iter().all(|count| count == first) => Ok(*first),
            _ => Err(error(format!(
                "the instances of node {id} have different numbers of places: {counts:?}"
            ))),
        }
    }

    /// Transforms to the scene of all copies of the mesh of `node`, whose own transform is `placed`.
    ///
    /// The caller must have checked the number of copies.
    pub(super) fn places(
        &self,
        node: &Node,
        n_instances: usize,
        placed: DAffine3,
    ) -> Result<Vec<DAffine3>, ReadError> {
        let Some(instancing) = &node.extensions.instancing else {
            return Ok(vec![placed]);
        };
        let values = |name, shape| self.instance_values(instancing, name, shape);
        let translations = values("TRANSLATION", Shape::Vec3)?;
        let rotations = values("ROTATION", Shape::Vec4)?;
        let scales = values("SCALE", Shape::Vec3)?;
        let place = |row| {
            let of = |values: &Option<Values>, default| values.as_ref().map_or(default, |v| v.row(row));
            let rotation = rotations.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |v| v.row(row));
            placed * compose(of(&translations, [0.0; 3]), rotation, of(&scales, [1.0; 3]))
        };
        Ok((0..n_instances).map(place).collect())
    }

    fn instance_values(
        &self,
        instancing: &Instancing,
        name: &str,
        shape: Shape,
    ) -> Result<Option<Values<'_>>, ReadError> {
        let which = instancing.attributes.get(name);
        which.map(|&which| self.values_or_zeros(which, shape)).transpose()
    }
}
