//! Numbering of the unknowns of a part.

use shellock_mechanics::{SIDES, Side};

/// Number of contact rows of a station.
pub(super) const ROWS: usize = 7;

/// Number of places along s in a cross-section, and across it. Even ones are corners, odd ones lie halfway.
pub(super) const N_ALONG_S: usize = 5;
pub(super) const N_ACROSS: usize = 3;
pub(super) const N_SECTION: usize = N_ALONG_S * N_ACROSS;

/// Labels of a part's unknowns, in this order: wall, contact rows, load, nodes of the sections, nodes
/// halfway.
#[derive(Clone, Copy)]
pub(super) struct Labels {
    n_wall: u32,
    n_stations: u32,
}

impl Labels {
    pub fn new(n_wall: usize, n_stations: usize) -> Self {
        Self {
            n_wall: n_wall as u32,
            n_stations: n_stations as u32,
        }
    }
    pub fn is_wall(self, id: u32) -> bool {
        id < self.n_wall
    }
    pub fn row(self, station: usize, row: usize) -> u32 {
        self.n_wall + (station * ROWS + row) as u32
    }
    /// Returns true if `id` is neither a contact row nor the load.
    pub fn is_inner(self, id: u32) -> bool {
        self.is_wall(id) || id > self.load()
    }
    /// Contact row that label `id` stands for.
    pub fn row_of(self, id: u32) -> usize {
        (id - self.n_wall) as usize
    }
    pub fn load(self) -> u32 {
        self.n_wall + self.n_stations * ROWS as u32
    }
    pub fn section(self, station: usize, side: Side) -> u32 {
        self.load() + 1 + ((2 * station + side.index()) * 3 * N_SECTION) as u32
    }
    /// First labels of the bar's cross-section halfway and of the one at its free end.
    pub fn within(self, bar: usize) -> [u32; 2] {
        let first = self.section(self.n_stations as usize, Side::A) + (2 * bar * 3 * N_SECTION) as u32;
        [first, first + 3 * N_SECTION as u32]
    }

    pub fn owner(self, id: u32) -> Owner {
        let first = self.section(0, Side::A);
        if id < first {
            Owner::Part
        } else if id < self.within(0)[0] {
            let at = (id - first) as usize / (3 * N_SECTION);
            Owner::Section(at / 2, SIDES[at % 2])
        } else {
            Owner::Bar
        }
    }
}

/// Owner of an unknown.
pub(super) enum Owner {
    /// The wall, a contact row or the load.
    Part,
    /// A cross-section at a station.
    Section(usize, Side),
    /// The nodes halfway along a bar or at its free end.
    Bar,
}
