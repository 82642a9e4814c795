//! What was repaired, in words.

use std::fmt;

use crate::Vec3;
use crate::check::{Coordinates, Short, plural};

/// A kind of change, how often it was made and where first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repair {
    /// What was done.
    pub kind: RepairKind,
    /// How often; at least once.
    pub count: usize,
    /// The first place, file units.
    pub at: Vec3,
}

/// What can be done to a surface without guessing. Lengths and volumes are in file units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RepairKind {
    /// Points along open edges that lay closer together than `within` became one.
    Merged {
        /// The distance.
        within: f64,
    },
    /// Triangles that stood there twice, or back to back, were removed.
    Copies,
    /// Corners in the middle of a neighbour's edge were joined to it.
    Joined,
    /// Triangles that faced the other way than their neighbours were turned.
    Turned,
    /// Small holes were closed.
    Closed {
        /// Width of the largest.
        widest: f64,
    },
    /// Bodies that were inside out were turned.
    Everted,
    /// Bodies that were inside out were cut out of those that they overlapped.
    CutOut {
        /// The volume that is enclosed no more.
        volume: f64,
    },
    /// Walls inside the body were removed; the count is of triangles.
    InnerWalls,
    /// Bodies much smaller than the model were left out.
    Specks {
        /// Length of the largest.
        longest: f64,
    },
    /// Parts that overlap, or a surface that crosses itself, became one; the count is of pairs of triangles.
    United {
        /// Enclosed volume before; what was enclosed twice counts twice.
        before: f64,
        /// Enclosed volume after.
        after: f64,
    },
    /// Bodies that touch each other with their faces became one.
    Fused,
    /// Points and edges in which the surface touched itself were parted.
    Parted,
    /// Closed surfaces within the body were left out.
    Filled {
        /// Their volume.
        volume: f64,
    },
    /// Openings of a cavity were closed, which made the body solid: [`crate::hollow::fill`], where it is asked for.
    Drained {
        /// The cavity's volume.
        volume: f64,
    },
    /// Bodies apart from the largest were left out.
    LeftOut,
}

impl RepairKind {
    /// A short name for machines.
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
