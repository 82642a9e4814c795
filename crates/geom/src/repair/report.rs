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
            Self::Filled { .. } => "cavities-filled",
            Self::Drained { .. } => "openings-closed",
            Self::LeftOut => "bodies-left-out",
        }
    }
}

impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = self.count;
        match self.kind {
            RepairKind::Merged { within } => {
                let points = plural(n, "point was", "points were");
                write!(
                    f,
                    "{points} merged with others within {} across cracks",
                    Short(within)
                )?;
            }
            RepairKind::Copies => {
                write!(
                    f,
                    "{} there twice and removed",
                    plural(n, "triangle was", "triangles were")
                )?;
            }
            RepairKind::Joined => {
                write!(
                    f,
                    "{} in the middle of a neighbour's edge and joined to it",
                    plural(n, "corner was", "corners were")
                )?;
            }
            RepairKind::Turned => {
                write!(
                    f,
                    "{} the wrong way and turned",
                    plural(n, "triangle faced", "triangles faced")
                )?;
            }
            RepairKind::Closed { widest } => {
                let holes = plural(n, "small hole was", "small holes were");
                write!(f, "{holes} closed, up to {} wide", Short(widest))?;
            }
            RepairKind::Everted => write!(
                f,
                "{} inside out and turned",
                plural(n, "body was", "bodies were")
            )?,
            RepairKind::CutOut { volume } => {
                let bodies = plural(n, "body that was", "bodies that were");
                let volume = Short(volume);
                write!(
                    f,
                    "{bodies} inside out left a hole of {volume} in what it overlapped"
                )?;
            }
            RepairKind::InnerWalls => write!(
                f,
                "{} to walls inside the body and removed",
                plural(n, "triangle belonged", "triangles belonged")
            )?,
            RepairKind::Specks { longest } => {
                let specks = plural(n, "speck was", "specks were");
                write!(f, "{specks} left out, up to {} long", Short(longest))?;
            }
            RepairKind::United { before, after } => {
                let pairs = plural(n, "pair of triangles", "pairs of triangles");
                write!(
                    f,
                    "the surface crossed itself in {pairs}; overlapping parts were united, "
                )?;
                write!(
                    f,
                    "and the enclosed volume went from {} to {}",
                    Short(before),
                    Short(after)
                )?;
            }
            RepairKind::Fused => write!(f, "{n} bodies, some of which touch with their faces, were united")?,
            RepairKind::Parted => {
                let points = plural(n, "point", "points");
                write!(f, "the surface touched itself in {points}; it was parted there")?;
            }
            RepairKind::Filled { volume } => {
                let cavities = plural(n, "closed surface", "closed surfaces");
                let volume = Short(volume);
                write!(
                    f,
                    "{cavities} inside the body, {volume} in volume, left out: pieces are hollow anyway"
                )?;
            }
            RepairKind::Drained { volume } => {
                let openings = plural(n, "opening was", "openings were");
                let volume = Short(volume);
                write!(
                    f,
                    "{openings} closed, and the cavity behind filled, {volume} in volume"
                )?;
            }
            RepairKind::LeftOut => write!(
                f,
                "{} left out",
                plural(n, "smaller body was", "smaller bodies were")
            )?,
        }
        write!(f, "; first near {}", Coordinates(self.at))
    }
}
