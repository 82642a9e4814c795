//! The tree of nodes, with their transforms and visibility.

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::super::ReadError;
use super::document::{Document, Node};
use super::{error, missing_error};

/// The nodes of a document with their transforms.
pub(super) struct Nodes {
    /// Transform from each node to the scene, visible or not.
    pub(super) transforms: Vec<DAffine3>,
    /// Visible nodes, each once, parents before children in file order.
    pub(super) visible: Vec<usize>,
    /// Number of nodes in the scene that have a mesh and are hidden, by themselves or by an ancestor.
    pub(super) n_hidden: usize,
}

impl Nodes {
    /// Computes the transforms of all nodes of `document`. Errors for nodes with two parents and for cycles.
    pub(super) fn of(document: &Document) -> Result<Self, ReadError> {
        let nodes = &document.nodes;
        let parents = parents(nodes)?;
        let mut transforms = vec![DAffine3::IDENTITY; nodes.len()];
        let mut is_hidden = vec![false; nodes.len()];
        let order = parents_first(nodes, &parents)?;
        for &id in &order {
            let (above, is_hidden_above) = match parents[id] {
                Some(parent) => (transforms[parent], is_hidden[parent]),
                None => (DAffine3::IDENTITY, false),
            };
            transforms[id] = above * local(&nodes[id]);
            is_hidden[id] = is_hidden_above || hides(&nodes[id]);
        }
        let (mut visible, mut n_hidden) = (Vec::new(), 0);
        for id in in_scene(document, &parents)? {
            if !is_hidden[id] {
                visible.push(id);
            } else if nodes[id].mesh.is_some() {
                n_hidden += 1;
            }
        }
        Ok(Self {
            transforms,
            visible,
            n_hidden,
        })
    }
}

/// Returns the parent of each node.
fn parents(nodes: &[Node]) -> Result<Vec<Option<usize>>, ReadError> {
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (id, node) in nodes.iter().enumerate() {
        for &child in &node.children {
            let parent = parents
                .get_mut(child)
                .ok_or_else(|| missing_error("node", child))?;
            if let Some(other) = parent.replace(id) {
                return Err(error(format!(
                    "node {child} is a child of node {other} and again of node {id}"
                )));
            }
        }
    }
    Ok(parents)
}

/// Returns all nodes, each after its parent.
fn parents_first(nodes: &[Node], parents: &[Option<usize>]) -> Result<Vec<usize>, ReadError> {
    let mut order: Vec<usize> = (0..nodes.len()).filter(|&id| parents[id].is_none()).collect();
    let mut next = 0;
    while let Some(&id) = order.get(next) {
        order.extend(&nodes[id].children);
        next += 1;
    }
    if order.len() == nodes.len() {
        return Ok(order);
    }
    // Each node has at most one parent, so nodes unreachable from a root are cycles and their descendants.
    let mut is_reached = vec![false; nodes.len()];
    order.iter().for_each(|&id| is_reached[id] = true);
    let mut id = is_reached.iter().position(|reached| !reached).unwrap_or_default();
    for _ in 0..nodes.len() {
        id = parents[id].unwrap_or(id);
    }
    Err(ReadError::Cycle {
        kind: "node",
        id: id.to_string(),
    })
}

/// Lists the nodes of the default scene; all nodes if there is no scene. A node that the scene lists beside
/// its parent comes once.
fn in_scene(document: &Document, parents: &[Option<usize>]) -> Result<Vec<usize>, ReadError> {
    let nodes = &document.nodes;
    let scene = document.scenes.get(document.scene.unwrap_or_default());
    let roots = match scene {
        Some(scene) => scene.nodes.clone(),
        None => (0..nodes.len()).filter(|&id| parents[id].is_none()).collect(),
    };
    let mut is_found = vec![false; nodes.len()];
    let mut found = Vec::new();
    let mut todo: Vec<usize> = roots.into_iter().rev().collect();
    while let Some(id) = todo.pop() {
        let is_found = is_found.get_mut(id).ok_or_else(|| missing_error("node", id))?;
        if !std::mem::replace(is_found, true) {
            found.push(id);
            todo.extend(nodes[id].children.iter().rev());
        }
    }
    Ok(found)
}

/// True if KHR_node_visibility hides a node and its descendants.
fn hides(node: &Node) -> bool {
    node.extensions.visibility.as_ref().and_then(|v| v.visible) == Some(false)
}

/// Transform from a node to its parent.
fn local(node: &Node) -> DAffine3 {
    match node.matrix {
        Some(columns) => DAffine3::from_mat4(DMat4::from_cols_array(&columns)),
        None => compose(
            node.translation.unwrap_or([0.0; 3]),
            node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            node.scale.unwrap_or([1.0; 3]),
        ),
    }
}

/// Composes a scaling, then a rotation by a quaternion (x, y, z, w), then a translation. The quaternion is
/// normalised; one of length 0 gives no rotation.
pub(super) fn compose(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> DAffine3 {
    let rotation = DQuat::from_array(rotation);
    let length = rotation.length();
    let rotation = if length > 0.0 {
        rotation / length
    } else {
        DQuat::IDENTITY
    };
    DAffine3::from_scale_rotation_translation(
        DVec3::from_array(scale),
        rotation,
        DVec3::from_array(translation),
    )
}
