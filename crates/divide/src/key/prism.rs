//! The half-infinite prism by which a key is cut.

use shellock_geom::Vec3;
use shellock_surface::Turn;

/// Lean of each side away from the slide, as a tangent: 3°, so that the key is loose as soon as it moves.
const FLARE: f64 = 0.0524;

/// A convex region, open towards `slide`: everything in it can leave along `slide` without meeting anything
/// outside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyPrism {
    /// A point of the plane, in the middle of the back edge.
    pub origin: Vec3,
    /// Unit vector along which the key leaves; perpendicular to `normal`.
    pub slide: Vec3,
    /// Outward unit normal of the plane.
    pub normal: Vec3,
    /// Half the width at the back, mm.
    pub half_width_mm: f64,
    /// Depth of the prism below the plane, mm.
    pub depth_mm: f64,
    /// Radius of the edges where two sides meet, mm.
    pub corner_mm: f64,
}

impl KeyPrism {
    /// Returns the prism, rotated by `turn`.
    pub fn rotate(&self, turn: &Turn) -> Self {
        Self {
            origin: turn.apply(self.origin),
            slide: turn.apply(self.slide),
            normal: turn.apply(self.normal),
            ..*self
        }
    }

    /// Unit vector across the slide, within the plane.
    pub fn across(&self) -> Vec3 {
        self.normal.cross(self.slide)
    }

    /// Coordinates along the slide from the back edge, across it from the middle, and below the plane, mm.
    pub fn coordinates(&self, p: Vec3) -> [f64; 3] {
        let d = p - self.origin;
        [d.dot(self.slide), d.dot(self.across()), -d.dot(self.normal)]
    }

    /// Length of the key along the slide, on the plane, mm; equal to its width at the back.
    pub fn length_mm(&self) -> f64 {
        2.0 * self.half_width_mm
    }

    /// Middle of the key's area on the plane.
    pub fn middle(&self) -> Vec3 {
        self.origin + 0.5 * self.length_mm() * self.slide
    }

    /// Half the width of the prism at `along_mm` from the back edge, mm.
    pub fn half_width_at(&self, along_mm: f64) -> f64 {
        self.half_width_mm + FLARE * along_mm
    }

    /// Signed distance of `p` from the prism's surface, mm. Inside it is positive, exact up to the corner
    /// radius and capped there. Outside it is negative, exact but for the cosine of the flare.
    pub fn inside_mm(&self, p: Vec3) -> f64 {
        let [along, across, below] = self.coordinates(p);
        let inside = [
            along,
            self.half_width_at(along) - across.abs(),
            self.depth_mm - below,
        ];
        let lacks = inside.map(|mm| (self.corner_mm - mm).max(0.0));
        self.corner_mm - Vec3::from(lacks).length()
    }

    /// Returns true if `p` is inside the prism.
    pub fn contains(&self, p: Vec3) -> bool {
        self.inside_mm(p) > 0.0
    }
}
