//! Minimum cut of a graph between two terminals.
//!
//! Two search trees grow from the source and the sink along arcs with residual capacity. Paths are saturated
//! where the trees meet, and nodes behind saturated arcs are adopted by new parents: [Boykov and Kolmogorov,
//! *An Experimental Comparison of Min-Cut/Max-Flow Algorithms*, PAMI 2004]. This is fast if most nodes are
//! tied to a terminal.

use std::collections::VecDeque;

const NONE: u32 = u32::MAX;
const TERMINAL: u32 = u32::MAX - 1;
const ORPHAN: u32 = u32::MAX - 2;
/// Share of the largest capacity below which an arc counts as saturated: what is left is rounding.
const NO_ROOM: f64 = 1e-12;

/// Side of the cut that a node is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terminal {
    /// The side of the source.
    Source,
    /// The side of the sink, and of nodes that neither terminal reaches.
    Sink,
}

#[derive(Clone, Copy)]
struct Arc {
    head: u32,
    next: u32,
    room: f64,
}

/// A graph whose nodes are tied to a source, to a sink and to each other. Capacities are ≥ 0, of any unit.
pub struct FlowGraph {
    first: Vec<u32>,
    arcs: Vec<Arc>,
    /// Residual capacity of the terminal arc: positive from the source, negative to the sink.
    terminal: Vec<f64>,
    flow: f64,
    parent: Vec<u32>,
    is_sink: Vec<bool>,
    is_queued: Vec<bool>,
    /// Time at which each node's distance was last verified; the next field has that distance to the
    /// terminal.
    stamp: Vec<u32>,
    depth: Vec<u32>,
    active: VecDeque<u32>,
    orphans: VecDeque<u32>,
    time: u32,
    least: f64,
}

impl FlowGraph {
    /// Creates a graph of `n_nodes` nodes without arcs.
    pub fn new(n_nodes: usize) -> Self {
        Self {
            first: vec![NONE; n_nodes],
            arcs: Vec::new(),
            terminal: vec![0.0; n_nodes],
            flow: 0.0,
            parent: vec![NONE; n_nodes],
            is_sink: vec![false; n_nodes],
            is_queued: vec![false; n_nodes],
            stamp: vec![0; n_nodes],
            depth: vec![0; n_nodes],
            active: VecDeque::new(),
            orphans: VecDeque::new(),
            time: 0,
            least: 0.0,
        }
    }

    /// Ties `node` to both terminals. Repeated calls add up.
    pub fn tie(&mut self, node: u32, from_source: f64, to_sink: f64) {
        let old = self.terminal[node as usize];
        let (source, sink) = (from_source + old.max(0.0), to_sink + (-old).max(0.0));
        self.flow += source.min(sink);
        self.terminal[node as usize] = source - sink;
    }

    /// Joins two nodes with the capacities `there` from `a` to `b` and `back` from `b` to `a`.
    pub fn join(&mut self, a: u32, b: u32, there: f64, back: f64) {
        for (tail, head, room) in [(a, b, there), (b, a, back)] {
            let next = self.first[tail as usize];
            self.first[tail as usize] = self.arcs.len() as u32;
            self.arcs.push(Arc { head, next, room });
        }
    }

    /// Computes the minimum cut: its value, and the side of each node.
    pub fn least_cut(mut self) -> (f64, Vec<Terminal>) {
        let largest = self
            .arcs
            .iter()
            .map(|a| a.room)
            .chain(self.terminal.iter().map(|t| t.abs()));
        self.least = NO_ROOM * largest.filter(|x| x.is_finite()).fold(0.0, f64::max);
        for node in 0..self.first.len() as u32 {
            if self.terminal[node as usize].abs() > self.least {
                self.is_sink[node as usize] = self.terminal[node as usize] < 0.0;
                self.parent[node as usize] = TERMINAL;
                self.depth[node as usize] = 1;
                self.activate(node);
            }
        }
        while let Some(node) = self.active.pop_front() {
            self.is_queued[node as usize] = false;
            while self.parent[node as usize] != NONE {
                let Some(bridge) = self.grow(node) else { break };
                self.time += 1;
                self.augment(bridge);
                while let Some(orphan) = self.orphans.pop_front() {
                    self.adopt(orphan);
                }
            }
        }
        let sides = (0..self.first.len())
            .map(|n| {
                if self.parent[n] != NONE && !self.is_sink[n] {
                    Terminal::Source
                } else {
                    Terminal::Sink
                }
            })
            .collect();
        (self.flow, sides)
    }

    fn activate(&mut self, node: u32) {
        if !self.is_queued[node as usize] {
            self.is_queued[node as usize] = true;
            self.active.push_back(node);
        }
    }

    /// Residual capacity of `arc` in the direction of flow, if its tail belongs to the source's or the sink's
    /// tree.
    fn room(&self, arc: u32, is_sink: bool) -> f64 {
        self.arcs[if is_sink { arc ^ 1 } else { arc } as usize].room
    }

    /// Grows the tree of `node` along arcs with residual capacity. Returns the arc from the source's to the
    /// sink's tree where the two meet.
    fn grow(&mut self, node: u32) -> Option<u32> {
        let is_sink = self.is_sink[node as usize];
        let mut arc = self.first[node as usize];
        while arc != NONE {
            let Arc { head, next, .. } = self.arcs[arc as usize];
            if self.room(arc, is_sink) > self.least {
                let other = head as usize;
                if self.parent[other] == NONE {
                    self.is_sink[other] = is_sink;
                    self.parent[other] = arc ^ 1;
                    self.stamp[other] = self.stamp[node as usize];
                    self.depth[other] = self.depth[node as usize] + 1;
                    self.activate(head);
                } else if self.is_sink[other] != is_sink {
                    return Some(if is_sink { arc ^ 1 } else { arc });
                } else if self.stamp[other] <= self.stamp[node as usize]
                    && self.depth[other] > self.depth[node as usize] + 1
                {
                    self.parent[other] = arc ^ 1;
                    self.stamp[other] = self.stamp[node as usize];
                    self.depth[other] = self.depth[node as usize] + 1;
                }
            }
            arc = next;
        }
        None
    }

    /// Saturates the path through `bridge`. Nodes behind saturated arcs become orphans.
    fn augment(&mut self, bridge: u32) {
        let ends = [
            self.arcs[bridge as usize ^ 1].head,
            self.arcs[bridge as usize].head,
        ];
        let mut amount = self.arcs[bridge as usize].room;
        for (end, is_sink) in ends.into_iter().zip([false, true]) {
            let mut node = end;
            while self.parent[node as usize] != TERMINAL {
                let up = self.parent[node as usize];
                amount = amount.min(self.room(up ^ 1, is_sink));
                node = self.arcs[up as usize].head;
            }
            amount = amount.min(self.terminal[node as usize].abs());
        }
        self.flow += amount;
        self.push(bridge, amount);
        for (end, is_sink) in ends.into_iter().zip([false, true]) {
            let mut node = end;
            while self.parent[node as usize] != TERMINAL {
                let up = self.parent[node as usize];
                let along = if is_sink { up } else { up ^ 1 };
                self.push(along, amount);
                if self.arcs[along as usize].room <= self.least {
                    self.parent[node as usize] = ORPHAN;
                    self.orphans.push_back(node);
                }
                node = self.arcs[up as usize].head;
            }
            let rest = &mut self.terminal[node as usize];
            *rest -= if is_sink { -amount } else { amount };
            if rest.abs() <= self.least {
                self.parent[node as usize] = ORPHAN;
                self.orphans.push_back(node);
            }
        }
    }

    fn push(&mut self, arc: u32, amount: f64) {
        self.arcs[arc as usize].room -= amount;
        self.arcs[arc as usize ^ 1].room += amount;
    }

    /// Finds a new parent for `orphan`, the one nearest to the terminal. Without any, `orphan` becomes free
    /// and its children become orphans.
    fn adopt(&mut self, orphan: u32) {
        let is_sink = self.is_sink[orphan as usize];
        let mut best = (u32::MAX, NONE);
        let mut arc = self.first[orphan as usize];
        while arc != NONE {
            let Arc { head, next, .. } = self.arcs[arc as usize];
            if self.room(arc ^ 1, is_sink) > self.least
                && self.is_sink[head as usize] == is_sink
                && self.parent[head as usize] != NONE
                && let Some(depth) = self.depth_to_terminal(head)
                && depth < best.0
            {
                best = (depth, arc);
            }
            arc = next;
        }
        if best.1 != NONE {
            self.parent[orphan as usize] = best.1;
            self.stamp[orphan as usize] = self.time;
            self.depth[orphan as usize] = best.0 + 1;
            return;
        }
        self.parent[orphan as usize] = NONE;
        let mut arc = self.first[orphan as usize];
        while arc != NONE {
            let Arc { head, next, .. } = self.arcs[arc as usize];
            let parent = self.parent[head as usize];
            if parent != NONE && self.is_sink[head as usize] == is_sink {
                if self.room(arc ^ 1, is_sink) > self.least {
                    self.activate(head);
                }
                if parent < ORPHAN && self.arcs[parent as usize].head == orphan {
                    self.parent[head as usize] = ORPHAN;
                    self.orphans.push_back(head);
                }
            }
            arc = next;
        }
    }

    /// Number of arcs from `node` to its terminal; `None` if its path ends at an orphan.
    fn depth_to_terminal(&mut self, node: u32) -> Option<u32> {
        let (mut at, mut steps) = (node as usize, 0);
        let depth = loop {
            if self.stamp[at] == self.time {
                break steps + self.depth[at];
            }
            match self.parent[at] {
                TERMINAL => {
                    self.stamp[at] = self.time;
                    self.depth[at] = 1;
                    break steps + 1;
                }
                ORPHAN | NONE => return None,
                up => {
                    steps += 1;
                    at = self.arcs[up as usize].head as usize;
                }
            }
        };
        let (mut at, mut left) = (node as usize, depth);
        while self.stamp[at] != self.time {
            self.stamp[at] = self.time;
            self.depth[at] = left;
            left -= 1;
            at = self.arcs[self.parent[at] as usize].head as usize;
        }
        Some(depth)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn a_cut_is_the_least_of_all_and_its_value_what_its_arcs_hold() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for _ in 0..300 {
            let n = rng.random_range(2..9_u32);
            let ties: Vec<[f64; 2]> = (0..n)
                .map(|_| [0, 1].map(|_| f64::from(rng.random_range(0..6_u32))))
                .collect();
            let arcs: Vec<(u32, u32, f64, f64)> = (0..rng.random_range(0..20))
                .map(|_| {
                    let a = rng.random_range(0..n);
                    let b = (a + rng.random_range(1..n)) % n;
                    (a, b, rng.random_range(0.0..4.0), rng.random_range(0.0..4.0))
                })
                .collect();
            let value = |with_source: &dyn Fn(u32) -> bool| -> f64 {
                let terminals = (0..n).map(|v| ties[v as usize][usize::from(with_source(v))]);
                let sum: f64 = terminals.sum();
                sum + arcs
                    .iter()
                    .map(|&(a, b, there, back)| match (with_source(a), with_source(b)) {
                        (true, false) => there,
                        (false, true) => back,
                        _ => 0.0,
                    })
                    .sum::<f64>()
            };
            let mut graph = FlowGraph::new(n as usize);
            (0..n).for_each(|v| graph.tie(v, ties[v as usize][0], ties[v as usize][1]));
            arcs.iter()
                .for_each(|&(a, b, there, back)| graph.join(a, b, there, back));
            let (least, sides) = graph.least_cut();
            let brute = (0..1_u32 << n)
                .map(|set| value(&|v| set >> v & 1 == 1))
                .fold(f64::INFINITY, f64::min);
            assert!((least - brute).abs() < 1e-9, "{least} is not {brute}");
            let found = value(&|v| sides[v as usize] == Terminal::Source);
            assert!((found - brute).abs() < 1e-9, "{found} is not {brute}");
        }
    }
}
