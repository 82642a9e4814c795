//! Report of repairs, in words.

use std::fmt;

use crate::Vec3;
use crate::check::{Coordinates, Short, plural};

/// A kind of change, with its count and first place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repair {
    /// Kind of the change.
    pub kind: RepairKind,
    /// Number of changes, at least one.
    pub count: usize,
    /// Place of the first change, file units.
    pub at: Vec3,
}

/// Kinds of changes that need no guessing. Lengths and volumes are in file units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RepairKind {
    /// Merged points along open edges that were closer together than `within`.
    Merged {
        /// Distance within which points were merged.
        within: f64,
    },
    /// Removed duplicate triangles, and pairs of triangles back to back.
    Copies,
    /// Joined corners to the edges of neighbours on which they lay.
    Joined,
    /// Flipped triangles that faced against their neighbours.
    Turned,
    /// Closed small holes in the surface.
    Closed {
        /// Width of the largest hole.
        widest: f64,
    },
    /// Turned bodies that were inside out.
    Everted,
    /// Cut bodies that were inside out from the bodies that they overlapped.
    CutOut {
        /// Loss of enclosed volume.
        volume: f64,
    },
    /// Removed walls inside the body; the count is of triangles.
    InnerWalls,
    /// Left out bodies much smaller than the model.
    Specks {
        /// Length of the largest speck.
        longest: f64,
    },
    /// United overlapping parts, or a surface that crossed itself; the count is of pairs of triangles.
    United {
        /// Enclosed volume before; regions enclosed twice count twice.
        before: f64,
        /// Enclosed volume after the union.
        after: f64,
    },
    /// United bodies that touched each other with their faces.
    Fused,
    /// Separated the surface at points and edges in which it touched itself.
    Parted,
    /// Turned triangles the right way up that lay upside down on their neighbours.
    Unfolded,
    /// Left out closed surfaces within the body.
    Filled {
        /// Total volume of these surfaces.
        volume: f64,
    },
    /// Closed the openings of a cavity, which made the body solid. Only on request, by
    /// [`crate::hollow::fill`].
    Drained {
        /// Volume of the cavity.
        volume: f64,
    },
    /// Left out all bodies except the largest.
    LeftOut,
}

impl RepairKind {
    /// Short name for machine-readable output.
    pub fn code(self) -> &'static str {
        match self {
            Self::Merged { .. } => "points-merged",
            Self::Copies => "copies-removed",
            Self::Joined => "edges-joined",
            Self::Turned => "triangles-turned",
            Self::Closed { .. } => "holes-closed",
            Self::Everted => "body-turned",
            Self::CutOut { .. } => "bodies-cut-out",
            Self::InnerWalls => "inner-walls-removed",
            Self::Specks { .. } => "specks-removed",
            Self::United { .. } => "parts-united",
            Self::Fused => "bodies-united",
            Self::Parted => "points-parted",
            Self::Unfolded => "folds-removed",
            Self::Filled { .. } => "cavities-filled",
            Self::Drained { .. } => "openings-closed",
            Self::LeftOut => "bodies-left-out",
        }
    }
}

impl RepairKind {
    /// Subject of the sentence that reports `n` of these repairs.
    fn subject(self, n: usize) -> String {
        let (one, many) = match self {
            Self::Merged { .. } => ("point was", "points were"),
            Self::Copies => ("triangle was", "triangles were"),
            Self::Joined => ("corner was", "corners were"),
            Self::Turned => ("triangle faced", "triangles faced"),
            Self::Closed { .. } => ("small hole was", "small holes were"),
            Self::Everted => ("body was", "bodies were"),
            Self::CutOut { .. } => ("body that was", "bodies that were"),
            Self::InnerWalls => ("triangle belonged", "triangles belonged"),
            Self::Specks { .. } => ("speck was", "specks were"),
            Self::United { .. } => ("pair of triangles", "pairs of triangles"),
            Self::Fused => ("bodies", "bodies"),
            Self::Parted => ("point", "points"),
            Self::Unfolded => ("triangle lay", "triangles lay"),
            Self::Filled { .. } => ("closed surface", "closed surfaces"),
            Self::Drained { .. } => ("opening was", "openings were"),
            Self::LeftOut => ("smaller body was", "smaller bodies were"),
        };
        plural(n, one, many)
    }

    /// Sentence that reports repairs with this `subject`.
    fn sentence(self, subject: &str) -> String {
        match self {
            Self::Merged { within } => {
                let within = Short(within);
                format!("{subject} merged with others within {within} across cracks")
            }
            Self::Copies => format!("{subject} duplicated and removed"),
            Self::Joined => format!("{subject} in the middle of a neighbour's edge and joined to it"),
            Self::Turned => format!("{subject} the wrong way and flipped"),
            Self::Closed { widest } => format!("{subject} closed, up to {} wide", Short(widest)),
            Self::Everted => format!("{subject} inside out and flipped"),
            Self::CutOut { volume } => {
                let volume = Short(volume);
                format!("{subject} inside out left a hole of {volume} in what it overlapped")
            }
            Self::InnerWalls => format!("{subject} to walls inside the body and removed"),
            Self::Specks { longest } => format!("{subject} left out, up to {} long", Short(longest)),
            Self::United { before, after } => {
                let (before, after) = (Short(before), Short(after));
                format!(
                    "the surface crossed itself in {subject}; overlapping parts were united, and the \
                     enclosed volume went from {before} to {after}"
                )
            }
            Self::Fused => format!("{subject}, some of which touch with their faces, were united"),
            Self::Parted => format!("the surface touched itself in {subject}; it was separated there"),
            Self::Unfolded => format!("{subject} upside down on a neighbour and turned the right way up"),
            Self::Filled { volume } => {
                let volume = Short(volume);
                format!("{subject} inside the body, {volume} in volume, left out: pieces are hollow anyway")
            }
            Self::Drained { volume } => {
                let volume = Short(volume);
                format!("{subject} closed, and the cavity behind filled, {volume} in volume")
            }
            Self::LeftOut => format!("{subject} left out"),
        }
    }
}

impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sentence = self.kind.sentence(&self.kind.subject(self.count));
        write!(f, "{sentence}; first near {}", Coordinates(self.at))
    }
}
