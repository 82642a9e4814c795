//! The tree of nodes: where each one is, and which are shown.

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::super::ReadError;
use super::document::{Document, Node};
use super::{error, missing};

/// The nodes of a document, all placed.
pub(super) struct Nodes {
    /// Transform from each node to the scene, shown or not.
    pub(super) placed: Vec<DAffine3>,
    /// The nodes that are shown, each once, parents before children in the order of the file.
    pub(super) shown: Vec<usize>,
    /// Nodes of the scene that have a mesh and are hidden, themselves or with a node above.
    pub(super) n_hidden: usize,
}

impl Nodes {
    /// Places all nodes of `document`; refuses nodes of two parents and nodes below themselves.
    pub(super) fn of(document: &Document) -> Result<Self, ReadError> {
        let nodes = &document.nodes;
        let parents = parents(nodes)?;
        let mut placed = vec![DAffine3::IDENTITY; nodes.len()];
        let mut is_hidden = vec![false; nodes.len()];
        let order = parents_first(nodes, &parents)?;
        for &id in &order {
            let (above, is_hidden_above) = match parents[id] {
                Some(parent) => (placed[parent], is_hidden[parent]),
                None => (DAffine3::IDENTITY, false),
            };
            placed[id] = above * local(&nodes[id]);
            is_hidden[id] = is_hidden_above || hides(&nodes[id]);
        }
        let (mut shown, mut n_hidden) = (Vec::new(), 0);
        for id in in_scene(document, &parents)? {
            if !is_hidden[id] {
                shown.push(id);
            } else if nodes[id].mesh.is_some() {
                n_hidden += 1;
            }
        }
        Ok(Self {
            placed,
            shown,
            n_hidden,
        })
    }
}

/// The parent of each node.
fn parents(nodes: &[Node]) -> Result<Vec<Option<usize>>, ReadError> {
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (id, node) in nodes.iter().enumerate() {
        for &child in &node.children {
            let parent = parents.get_mut(child).ok_or_else(|| missing("node", child))?;
            if let Some(other) = parent.replace(id) {
                return Err(error(format!(
                    "node {child} is a child of node {other} and again of node {id}"
                )));
            }
        }
    }
    Ok(parents)
}

/// All nodes, each after its parent.
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
    // Each node has one parent at most, so the nodes that no root leads to are cycles and what is below them.
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

/// The nodes of the scene that is shown; all where there is none. A node that the scene lists beside its
/// parent comes once.
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
        let is_found = is_found.get_mut(id).ok_or_else(|| missing("node", id))?;
        if !std::mem::replace(is_found, true) {
            found.push(id);
            todo.extend(nodes[id].children.iter().rev());
        }
    }
    Ok(found)
}

/// True if KHR_node_visibility hides a node and all below it.
fn hides(node: &Node) -> bool {
    node.extensions.visibility.as_ref().and_then(|v| v.visible) == Some(false)
}

/// Transform from a node to its parent.
fn local(node: &Node) -> DAffine3 {
    match node.matrix {
        Some(columns) => DAffine3::from_mat4(DMat4::from_cols_array(&columns)),
        None => moved(
            node.translation.unwrap_or([0.0; 3]),
            node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            node.scale.unwrap_or([1.0; 3]),
        ),
    }
}

/// A scaling, then a rotation by a quaternion (x, y, z, w), then a translation. The quaternion is made one of
/// unit length; of length 0 it turns nothing.
pub(super) fn moved(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> DAffine3 {
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
