//! Error messages for rejected meshes.

use std::fmt;

use super::ClosedPart;
use crate::{NotSolid, Vec3};

/// Reason why a mesh is not one solid body: the defect, its count, a place (file units), and a remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InputError {
    /// No triangles, or none that has an area.
    #[error("the model has no triangles; export it again as a surface mesh")]
    Empty,
    /// Coordinates that are NaN or infinite.
    #[error(
        "{count} points have a coordinate that is not a number, the first is point {vertex} (from 0); repair \
         the model in the program that made it"
    )]
    NotFinite {
        /// First point with such a coordinate.
        vertex: usize,
        /// Number of such points.
        count: usize,
    },
    /// Coordinates so large that no volume can be computed.
    #[error(
        "{count} points lie farther than 1e30 from the origin, the first is point {vertex} (from 0); the \
         file is damaged: export the model again"
    )]
    TooFar {
        /// First point that is too far away.
        vertex: usize,
        /// Number of such points.
        count: usize,
    },
    /// Edges with more than two triangles.
    #[error(
        "{} more than two triangles, first near {}{}; \
         the surface touches or doubles itself there: remove doubled faces and merge the parts \
         in a modelling program",
        plural(*count, "edge has", "edges have"), Coordinates(*at), copies(*n_copies)
    )]
    Shared {
        /// Number of such edges.
        count: usize,
        /// Midpoint of the first such edge.
        at: Vec3,
        /// Number of triangles that duplicate another.
        n_copies: usize,
    },
    /// Neighbouring triangles of opposite orientation.
    #[error(
        "{} two triangles that face opposite ways, first near {}; \
         one of them is inside out: let a modelling program recalculate the normals (outside)",
        plural(*count, "edge joins", "edges join"), Coordinates(*at)
    )]
    Turned {
        /// Number of edges between them.
        count: usize,
        /// Midpoint of the first such edge.
        at: Vec3,
    },
    /// Holes in the surface.
    #[error(
        "the surface is not closed: {} ({}), first near {}; fill the holes in a modelling program",
        plural(*n_holes, "hole", "holes"), plural(*count, "open edge", "open edges"), Coordinates(*at)
    )]
    Open {
        /// Number of edges with one triangle.
        count: usize,
        /// Number of connected groups of open edges.
        n_holes: usize,
        /// Midpoint of the first open edge.
        at: Vec3,
    },
    /// More than one closed surface; the largest comes first.
    #[error("{}", Several(.0))]
    Bodies(Vec<ClosedPart>),
    /// More open edges than triangles: unconnected triangles, or cracks everywhere.
    #[error(
        "the triangles are not connected: {} on {}, first near {}; their corners do not meet exactly: merge \
         points by distance in a modelling program",
        plural(*count, "open edge", "open edges"), plural(*n_faces, "triangle", "triangles"), Coordinates(*at)
    )]
    Loose {
        /// Number of edges with one triangle.
        count: usize,
        /// Number of triangles in the mesh.
        n_faces: usize,
        /// Midpoint of the first open edge.
        at: Vec3,
    },
    /// Surface broken by points that were rounded to the same place.
    #[error(
        "{count} of {n_faces} triangles have no size, since their corners are in the same place; the \
         coordinates were rounded too coarsely: move the model near the origin in the program that made it \
         and export it with more digits"
    )]
    Collapsed {
        /// Number of triangles with two equal corners.
        count: usize,
        /// Number of triangles in the file.
        n_faces: usize,
    },
    /// Points in which the surface touches itself.
    #[error(
        "the surface touches itself in {}, first at {}; \
         move the touching parts a little apart or into each other and merge them in a modelling program",
        plural(*count, "single point", "single points"), Coordinates(*at)
    )]
    Pinched {
        /// Number of such points.
        count: usize,
        /// Position of the first point.
        at: Vec3,
    },
    /// Triangles that cross other triangles.
    #[error(
        "the surface crosses itself in {}, first near {}; \
         unite the parts that overlap in a modelling program (boolean union)",
        plural(*count, "pair of triangles", "pairs of triangles"), Coordinates(*at)
    )]
    Crossing {
        /// Number of crossing pairs of triangles.
        count: usize,
        /// Place of the first crossing.
        at: Vec3,
    },
    /// Bodies that are inside out and overlap another.
    #[error(
        "{} inside out and {} another, first near {}: \
         it is a hole or a part; export the model without it, cut it out \
         or unite it in a modelling program",
        plural(*count, "body is", "bodies are"), if *count == 1 { "overlaps" } else { "overlap" },
        Coordinates(*at)
    )]
    Cutter {
        /// Number of such bodies.
        count: usize,
        /// Centre of the first such body.
        at: Vec3,
    },
    /// One-sided surface: no orientation of its triangles makes all neighbours agree.
    #[error(
        "the surface has one side only, like a Möbius band: {} triangles that face opposite ways \
         however they are turned, first near {}; it bounds no body: model it with a thickness",
        plural(*count, "edge joins", "edges join"), Coordinates(*at)
    )]
    OneSided {
        /// Number of edges between opposite triangles.
        count: usize,
        /// Midpoint of the first such edge.
        at: Vec3,
    },
    /// All triangles face inwards.
    #[error(
        "the model is inside out: all its triangles face inwards; flip the normals (flip the faces) and \
         export it again"
    )]
    InsideOut,
    /// Closed surface that encloses no volume.
    #[error("the model is flat: its surface encloses no volume; give it a thickness")]
    Flat,
    /// Defect that only [`crate::Solid::new`] detects.
    #[error("{0}; export the model again")]
    NotSolid(NotSolid),
}

impl InputError {
    /// First place of the defect, in the mesh's units; `None` if the defect has no place.
    pub fn at(&self) -> Option<Vec3> {
        match *self {
            Self::Shared { at, .. }
            | Self::Turned { at, .. }
            | Self::Open { at, .. }
            | Self::Loose { at, .. }
            | Self::Pinched { at, .. }
            | Self::Crossing { at, .. }
            | Self::Cutter { at, .. }
            | Self::OneSided { at, .. } => Some(at),
            _ => None,
        }
    }
}

/// Largest number of bodies that a message lists.
const N_LISTED: usize = 3;

struct Several<'a>(&'a [ClosedPart]);

impl fmt::Display for Several<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(bodies) = self;
        write!(f, "the model consists of {} separate bodies: ", bodies.len())?;
        for (i, body) in bodies.iter().take(N_LISTED).enumerate() {
            let (size, separator) = (body.bounds.size(), if i > 0 { ", " } else { "" });
            write!(
                f,
                "{separator}{} of {} × {} × {} around {}",
                plural(body.n_faces, "triangle", "triangles"),
                Short(size.x),
                Short(size.y),
                Short(size.z),
                Coordinates(body.bounds.center()),
            )?;
            if body.signed_volume < 0.0 {
                let inside =
                    bodies[0].bounds.contains(body.bounds.min) && bodies[0].bounds.contains(body.bounds.max);
                f.write_str(if i > 0 && inside {
                    " (a cavity)"
                } else {
                    " (inside out)"
                })?;
            }
        }
        if bodies.len() > N_LISTED {
            write!(f, " and {} smaller", bodies.len() - N_LISTED)?;
        }
        f.write_str("; keep one of them, or unite those that overlap into one")
    }
}

/// Point, formatted for messages.
pub(crate) struct Coordinates(pub(crate) Vec3);

impl fmt::Display for Coordinates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "({}, {}, {})",
            Short(self.0.x),
            Short(self.0.y),
            Short(self.0.z)
        )
    }
}

/// Length with four significant digits in any file unit, or one decimal if that is more. Drops trailing
/// zeros.
pub(crate) struct Short(pub(crate) f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        if size >= 1e9 || (size > 0.0 && size < 1e-6) {
            return write!(f, "{:.3e}", self.0);
        }
        let decimals = if size == 0.0 {
            0
        } else {
            (3 - size.log10().floor() as i32)
                .clamp(0, 9)
                .max(i32::from(size < 1e4))
        };
        let text = format!("{:.*}", decimals as usize, self.0);
        let trimmed = if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.')
        } else {
            &text
        };
        f.write_str(trimmed)
    }
}

/// Count with its noun, such as "1 hole" or "2 holes".
pub(crate) fn plural(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

fn copies(n_copies: usize) -> String {
    if n_copies == 0 {
        String::new()
    } else {
        format!(
            " ({} there twice)",
            plural(n_copies, "triangle is", "triangles are")
        )
    }
}
