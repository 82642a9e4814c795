//! Triangle meshes as read from files, and bounding boxes.

use crate::Vec3;

/// Points and triangles between them. May be open, inconsistently oriented, and have coordinates that are not
/// finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Positions of the points, mm.
    pub points: Vec<Vec3>,
    /// Corner indices into `points`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// Positions of the three corners of triangle `face`.
    #[inline]
    pub fn corners(&self, face: usize) -> [Vec3; 3] {
        // Not by `map`, which is not always compiled into the caller: this is the innermost read of all.
        let [a, b, c] = self.triangles[face];
        [
            self.points[a as usize],
            self.points[b as usize],
            self.points[c as usize],
        ]
    }

    /// Cross product of two edges of `face`: its normal times twice its area.
    #[inline]
    pub fn double_area_vector(&self, face: usize) -> Vec3 {
        let [a, b, c] = self.corners(face);
        (b - a).cross(c - a)
    }

    /// Area of triangle `face`, mm².
    pub fn face_area(&self, face: usize) -> f64 {
        0.5 * self.double_area_vector(face).length()
    }

    /// Unit normal of `face`; zero for a degenerate triangle.
    pub fn face_normal(&self, face: usize) -> Vec3 {
        self.double_area_vector(face).normalize_or_zero()
    }

    /// Mean of the three corners of `face`.
    pub fn face_center(&self, face: usize) -> Vec3 {
        let [a, b, c] = self.corners(face);
        (a + b + c) / 3.0
    }

    /// Total area of all triangles, mm².
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|f| self.face_area(f)).sum()
    }

    /// Centroid of the volume; centre of the bounding box if the volume is not positive.
    pub fn centroid(&self) -> Vec3 {
        let origin = self.bounds().center();
        let (mut moment, mut volume) = (Vec3::ZERO, 0.0);
        for face in 0..self.triangles.len() {
            let [a, b, c] = self.corners(face).map(|p| p - origin);
            let part = a.dot(b.cross(c)) / 6.0;
            volume += part;
            moment += (a + b + c) * (0.25 * part);
        }
        if volume > 0.0 {
            origin + moment / volume
        } else {
            origin
        }
    }

    /// Signed volume, mm³; positive if a closed mesh is oriented outwards.
    pub fn signed_volume(&self) -> f64 {
        let origin = self.points.first().copied().unwrap_or_default();
        let sixfold: f64 = (0..self.triangles.len())
            .map(|f| {
                let [a, b, c] = self.corners(f).map(|p| p - origin);
                a.dot(b.cross(c))
            })
            .sum();
        sixfold / 6.0
    }

    /// Drops the points that no triangle uses, keeping the order of the others.
    #[must_use]
    pub fn without_unused_points(mut self) -> Self {
        let mut name = vec![u32::MAX; self.points.len()];
        self.triangles
            .iter()
            .flatten()
            .for_each(|&v| name[v as usize] = 0);
        name.iter_mut()
            .filter(|x| **x == 0)
            .zip(0..)
            .for_each(|(slot, n)| *slot = n);
        let mut place = name.iter();
        self.points.retain(|_| place.next() != Some(&u32::MAX));
        self.triangles
            .iter_mut()
            .flatten()
            .for_each(|v| *v = name[*v as usize]);
        self
    }

    /// Bounding box of all points, used or not; empty if there are none.
    pub fn bounds(&self) -> Aabb {
        Aabb::around(self.points.iter().copied())
    }
}

/// Axis-aligned bounding box, mm. Empty if `min > max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Corner with the least coordinates.
    pub min: Vec3,
    /// Corner with the greatest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// Empty box that contains no point.
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Bounding box of `points`; empty if there are none.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self {
            min: b.min.min(p),
            max: b.max.max(p),
        })
    }

    /// Box moved outwards by `by_mm` on all sides.
    pub fn grown(self, by_mm: f64) -> Self {
        Self {
            min: self.min - by_mm,
            max: self.max + by_mm,
        }
    }

    /// Smallest box around both boxes.
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// Returns true if the closed boxes share a point.
    pub fn intersects(self, other: Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Returns true if `p` lies in the closed box.
    pub fn contains(self, p: Vec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }

    /// Edge lengths, mm; zero if the box is empty.
    pub fn size(self) -> Vec3 {
        (self.max - self.min).max(Vec3::ZERO)
    }

    /// Length of the space diagonal, mm.
    pub fn diagonal(self) -> f64 {
        self.size().length()
    }

    /// Centre of the box, mm.
    pub fn center(self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    /// Squared distance from `p` to the closed box, mm²; 0 inside.
    pub fn distance_sq(self, p: Vec3) -> f64 {
        (p - p.clamp(self.min, self.max)).length_squared()
    }
}
