//! Tree of bounding boxes around triangles, to find those near a place without visiting all.

use crate::vector::Vec3;

/// Greatest number of triangles in a leaf.
const LEAF: usize = 4;

/// Bounding boxes of triangles; each node is followed by its children.
pub struct Tree {
    nodes: Vec<Node>,
    /// Triangle indices; those of each node are adjacent.
    order: Vec<usize>,
}

struct Node {
    low: Vec3,
    high: Vec3,
    /// Index of the first node after this one and all its descendants.
    after: usize,
    /// Range of `order` in this leaf; empty for an inner node.
    from: usize,
    to: usize,
}

impl Tree {
    /// Builds the tree of all `triangles`.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            order: (0..triangles.len()).collect(),
        };
        if !triangles.is_empty() {
            tree.add(triangles, 0, triangles.len());
        }
        tree
    }

    /// Adds the node for a range of the order, and its children.
    fn add(&mut self, triangles: &[[Vec3; 3]], from: usize, to: usize) {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in self.order[from..to].iter().flat_map(|&t| triangles[t]) {
            for k in 0..3 {
                (low[k], high[k]) = (low[k].min(corner[k]), high[k].max(corner[k]));
            }
        }
        let (node, is_leaf) = (self.nodes.len(), to - from <= LEAF);
        self.nodes.push(Node {
            low,
            high,
            after: 0,
            from,
            to: if is_leaf { to } else { from },
        });
        if !is_leaf {
            let width = |k: &usize| high[*k] - low[*k];
            let axis = (0..3).max_by(|i, j| width(i).total_cmp(&width(j))).unwrap_or(0);
            let along = |t: &usize| triangles[*t].iter().map(|p| p[axis]).sum::<f64>();
            let half = (to - from) / 2;
            self.order[from..to].select_nth_unstable_by(half, |s, t| along(s).total_cmp(&along(t)));
            self.add(triangles, from, from + half);
            self.add(triangles, from + half, to);
        }
        self.nodes[node].after = self.nodes.len();
    }

    /// Triangles that may enter a box: all that do, and a few beside it.
    pub fn near(&self, low: Vec3, high: Vec3) -> Vec<usize> {
        let (mut found, mut next) = (Vec::new(), 0);
        while let Some(node) = self.nodes.get(next) {
            let is_met = (0..3).all(|k| node.low[k] <= high[k] && node.high[k] >= low[k]);
            if is_met {
                found.extend(&self.order[node.from..node.to]);
            }
            next = if is_met { next + 1 } else { node.after };
        }
        found
    }

    /// Bounding box of all triangles; `None` if there are none.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        self.nodes.first().map(|n| [n.low, n.high])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_comes_into_a_box_is_found() {
        let place = |i: usize| [1.7, 2.3, 0.9].map(|f| 10.0 * (f * i as f64).sin());
        let triangles: Vec<[Vec3; 3]> = (0..500)
            .map(|i| [place(i), place(i + 500), place(i + 1000)])
            .collect();
        let tree = Tree::new(&triangles);
        for i in 0..50 {
            let low = place(2000 + i);
            let high = low.map(|x| x + 0.5);
            let found = tree.near(low, high);
            for (t, corners) in triangles.iter().enumerate() {
                let is_in = corners
                    .iter()
                    .any(|p| (0..3).all(|k| low[k] <= p[k] && p[k] <= high[k]));
                assert!(
                    !is_in || found.contains(&t),
                    "triangle {t} has a corner in box {i}"
                );
            }
        }
        assert!(Tree::new(&[]).near([0.0; 3], [1.0; 3]).is_empty());
    }
}
