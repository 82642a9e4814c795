//! Minimum cut of a graph between a source and a sink, which gives the shortest loops around openings.

use std::collections::VecDeque;

/// A graph of nodes and undirected edges with capacities. [Dinic1970]
pub(super) struct Network {
    /// Arcs that leave each node.
    out_arcs: Vec<Vec<u32>>,
    /// Head and residual capacity of each arc; arc `a ^ 1` is its reverse.
    arcs: Vec<(u32, u64)>,
}

impl Network {
    pub(super) fn new(n_nodes: usize) -> Self {
        Self {
            out_arcs: vec![Vec::new(); n_nodes],
            arcs: Vec::new(),
        }
    }

    pub(super) fn join(&mut self, a: u32, b: u32, capacity: u64) {
        let arc = self.arcs.len() as u32;
        self.arcs.extend([(b, capacity), (a, capacity)]);
        self.out_arcs[a as usize].push(arc);
        self.out_arcs[b as usize].push(arc + 1);
    }

    /// Marks the nodes on the source's side of the minimum cut. Of several minimum cuts, takes the one
    /// nearest to the source.
    pub(super) fn near_source(mut self, source: u32, sink: u32) -> Vec<bool> {
        loop {
            let steps = self.steps_from(source);
            if steps[sink as usize].is_none() {
                return steps.iter().map(Option::is_some).collect();
            }
            let mut tried = vec![0; self.out_arcs.len()];
            while self.push(source, sink, &steps, &mut tried) {}
        }
    }

    /// Distance of each node from the source, in arcs with residual capacity.
    fn steps_from(&self, source: u32) -> Vec<Option<u32>> {
        let mut steps = vec![None; self.out_arcs.len()];
        steps[source as usize] = Some(0);
        let mut todo = VecDeque::from([source]);
        while let Some(node) = todo.pop_front() {
            for &arc in &self.out_arcs[node as usize] {
                let (to, room) = self.arcs[arc as usize];
                if room > 0 && steps[to as usize].is_none() {
                    steps[to as usize] = steps[node as usize].map(|n| n + 1);
                    todo.push_back(to);
                }
            }
        }
        steps
    }

    /// Sends flow along one of the shortest paths. Returns false if no path is left.
    fn push(&mut self, source: u32, sink: u32, steps: &[Option<u32>], tried: &mut [usize]) -> bool {
        let mut way: Vec<u32> = Vec::new();
        let mut node = source;
        while node != sink {
            let at = node as usize;
            match self.out_arcs[at].get(tried[at]) {
                Some(&arc) => {
                    let (to, room) = self.arcs[arc as usize];
                    if room > 0 && steps[to as usize] == steps[at].map(|n| n + 1) {
                        way.push(arc);
                        node = to;
                    } else {
                        tried[at] += 1;
                    }
                }
                None => {
                    // A dead end: go back one step and take another arc.
                    let Some(arc) = way.pop() else { return false };
                    node = self.arcs[(arc ^ 1) as usize].0;
                    tried[node as usize] += 1;
                }
            }
        }
        let most = way
            .iter()
            .map(|&arc| self.arcs[arc as usize].1)
            .min()
            .unwrap_or(0);
        for arc in way {
            self.arcs[arc as usize].1 -= most;
            self.arcs[(arc ^ 1) as usize].1 += most;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cheapest_of_equal_cuts_lies_nearest_to_the_source() {
        // A row of nodes with one wide, two narrow and one wide edge.
        let mut row = Network::new(5);
        for (a, capacity) in [9, 2, 2, 9].into_iter().enumerate() {
            row.join(a as u32, a as u32 + 1, capacity);
        }
        assert_eq!(row.near_source(0, 4), [true, true, false, false, false]);
    }

    #[test]
    fn parallel_ways_are_all_cut() {
        let mut two = Network::new(4);
        [(0, 1, 3), (1, 3, 1), (0, 2, 1), (2, 3, 3), (1, 2, 1)]
            .into_iter()
            .for_each(|(a, b, capacity)| two.join(a, b, capacity));
        assert_eq!(two.near_source(0, 3), [true, true, false, false]);
    }
}
