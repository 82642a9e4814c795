//! Search for places where a key can be, and cutting it (Sect. 6.1), without any help of the user.
//!
//! A key is the part of the surface inside a half-infinite prism. The prism lies on a plane that the surface
//! follows and is open towards the slide `s`. It therefore takes the rim along, and everything in it can
//! leave along `s`: the way out is free by construction.
//!
//! ```text
//!        side               plane, seen from outside          section along s
//!    ┌──────────┐                                             ____________________
//!    │          │ \ flare                                  b |████████████████████\
//!  b │   key    │  ) 3°            s ──►                   a |                  ███|  rim
//!    │          │ /                                        c |                  ███|──── depth
//!    └──────────┘                                          k                     ▒▒ ┘
//! ```
//!
//! [`sites`] finds such prisms: planes by random sampling, 16 slides in each, places along the rim, four
//! sizes. [`imprint`] makes the surface inside a patch of its own, with straight seams. Later stages know
//! only 26 directions; [`Turn`] rotates the model so that the slide is one of them.
//!
//! Deviation from the paper: there the user draws the key.

mod conditions;
mod faces;
mod imprint;
mod prism;
mod site;
#[cfg(test)]
mod tests;

pub use conditions::{KeyConditions, conditions, warn_of_conditions};
pub use faces::FaceSet;
pub use imprint::{imprint, imprint_and_refine, patch_in};
pub use prism::KeyPrism;
use serde::{Deserialize, Serialize};
pub use shellock_surface::Turn;
pub use site::{KeySite, sites};

use crate::segmentation::KeepWhole;

/// Requirements of a key. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeyParams {
    /// Seed of the planes that are tried; any number.
    pub seed: u64,
    /// Thickness of the wall. [0.8, 10]; 2.
    pub wall_mm: f64,
    /// Size D of the connectors the key is made for. [1.5, 6]; 2.5.
    pub size_mm: f64,
    /// Area of an ordinary piece, mm². > 0; 4000. A key takes a third of that or less.
    pub piece_mm2: f64,
    /// Direction that is up when the model stands; a key underneath is preferred. Any length but 0; +z.
    pub up: [f64; 3],
    /// Resolved regions from which no key is cut; none.
    pub keep_whole: Vec<KeepWhole>,
    /// Wanted position of the middle of the key's outer side; anywhere if `None`.
    pub near: Option<[f64; 3]>,
}

impl Default for KeyParams {
    fn default() -> Self {
        Self {
            seed: 0,
            wall_mm: 2.0,
            size_mm: 2.5,
            piece_mm2: 4000.0,
            up: [0.0, 0.0, 1.0],
            keep_whole: Vec::new(),
            near: None,
        }
    }
}

impl KeyParams {
    /// Depth of the key's rim below the plane, mm: past its grooves, with room for the connectors of the seam
    /// there.
    pub fn depth_mm(&self) -> f64 {
        self.wall_mm + 2.2 * self.size_mm + 1.0
    }

    /// Width of the narrowest key, mm: two grooves, and a connector at the back between the gaps at its
    /// corners.
    pub fn least_width_mm(&self) -> f64 {
        5.5 * self.size_mm
    }
}
