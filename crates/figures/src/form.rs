//! Simple bodies and their smooth union, as fields that are positive inside and fall by about 1 per unit.
//!
//! Rounded cone and smooth union follow Quilez, "3D signed distance functions" and "smooth minimum".

use glam::DQuat;
use shellock_geom::{Aabb, Vec3};

/// A simple body of a figure.
#[derive(Clone, Debug)]
pub(super) enum Form {
    Ellipsoid {
        center: Vec3,
        half_axes: Vec3,
        /// Rotation from the axes of the ellipsoid to those of the figure.
        turn: DQuat,
    },
    /// The hull of two balls.
    RoundCone {
        a: Vec3,
        b: Vec3,
        radius_a: f64,
        radius_b: f64,
    },
    /// A tube of varying thickness: rounded cones from each (point, radius) to the next.
    Chain { stations: Vec<(Vec3, f64)> },
    /// A torus around the z axis through `center`.
    Ring {
        center: Vec3,
        radius: f64,
        thickness: f64,
    },
}

/// Forms united one after the other, each with its own blend, and cut off below z = 0.
#[derive(Clone, Debug, Default)]
pub(super) struct Sculpture {
    parts: Vec<Part>,
    /// The limb that forms are currently added to.
    limb: u32,
}

#[derive(Clone, Debug)]
struct Part {
    form: Form,
    blend: f64,
    bounds: Aabb,
    limb: u32,
}

/// Radius of the fillet at the edge of the base, units.
///
/// A sharp edge would come out jagged, as no vertex of a grid edge lies on it.
const FOOT_FILLET: f64 = 2.0;

impl Sculpture {
    /// Adds a form; `blend` is the width, in units, over which the form runs into those before.
    pub fn add(&mut self, form: Form, blend: f64) -> &mut Self {
        let bounds = form.bounds();
        self.parts.push(Part {
            form,
            blend,
            bounds,
            limb: self.limb,
        });
        self
    }

    /// Adds a form and its mirror image across x = 0.
    pub fn add_pair(&mut self, form: Form, blend: f64) -> &mut Self {
        let mirrored = form.mirror();
        self.add(form, blend).add(mirrored, blend)
    }

    /// Adds a tube through `stations` of (point, radius), bent smoothly.
    pub fn add_chain(&mut self, stations: &[(Vec3, f64)], blend: f64) -> &mut Self {
        self.add(
            Form::Chain {
                stations: spline(stations),
            },
            blend,
        )
    }

    /// Begins another limb, to which later forms are added.
    pub fn limb(&mut self) -> &mut Self {
        self.limb += 1;
        self
    }

    /// Number of limbs, the trunk included.
    pub fn n_limbs(&self) -> u32 {
        self.limb + 1
    }

    /// The limb at a place of the surface: 0 is the trunk.
    pub fn limb_at(&self, p: Vec3) -> u32 {
        let value = |part: &Part| part.form.value(p, f64::NEG_INFINITY);
        self.parts
            .iter()
            .max_by(|a, b| value(a).total_cmp(&value(b)))
            .map_or(0, |part| part.limb)
    }

    /// Field of the sculpture, positive inside.
    pub fn value(&self, p: Vec3) -> f64 {
        let mut value = f64::NEG_INFINITY;
        for part in &self.parts {
            // A form that far behind the nearest one has no part in the blend.
            if part.bounds.distance_sq(p).sqrt() < part.blend - value {
                value = smooth_max(value, part.form.value(p, value - part.blend), part.blend);
            }
        }
        -smooth_max(-value, -p.z, FOOT_FILLET)
    }

    /// A box that contains the figure.
    pub fn bounds(&self) -> Aabb {
        let all = self
            .parts
            .iter()
            .fold(Aabb::EMPTY, |b, part| b.union(part.bounds));
        let widest_blend = self.parts.iter().map(|part| part.blend).fold(0.0, f64::max);
        let grown = all.grown(0.25 * widest_blend);
        Aabb {
            min: grown.min.with_z(0.0),
            max: grown.max,
        }
    }
}

/// Steps between two stations of a tube; more steps only cost time at the bends that figures have.
const SPLINE_STEPS: usize = 4;

/// Points and radii along the Catmull-Rom spline through `stations`.
pub(super) fn spline(stations: &[(Vec3, f64)]) -> Vec<(Vec3, f64)> {
    let last = stations.len() - 1;
    if last < 2 {
        return stations.to_vec();
    }
    let at = |i: usize| stations[i.min(last)].0.extend(stations[i.min(last)].1);
    let mut curve = vec![stations[0]];
    for i in 0..last {
        let [before, a, b, after] = [at(i.saturating_sub(1)), at(i), at(i + 1), at(i + 2)];
        for step in 1..=SPLINE_STEPS {
            let t = step as f64 / SPLINE_STEPS as f64;
            let [rise, bend, twist] = [
                b - before,
                2.0 * before - 5.0 * a + 4.0 * b - after,
                3.0 * (a - b) + after - before,
            ];
            let q = a + 0.5 * t * (rise + t * (bend + t * twist));
            curve.push((q.truncate(), q.w));
        }
    }
    curve
}

/// Maximum of both, raised by up to `width / 4` where they are equal; exact where they differ by `width` or
/// more.
fn smooth_max(a: f64, b: f64, width: f64) -> f64 {
    let overlap = (width - (a - b).abs()).max(0.0) / width.max(1e-9);
    a.max(b) + 0.25 * width * overlap * overlap
}

impl Form {
    /// A ball around `center`.
    pub fn ball(center: Vec3, radius: f64) -> Self {
        Self::ellipsoid(center, Vec3::splat(radius))
    }

    /// An ellipsoid along the axes.
    pub fn ellipsoid(center: Vec3, half_axes: Vec3) -> Self {
        Self::Ellipsoid {
            center,
            half_axes,
            turn: DQuat::IDENTITY,
        }
    }

    /// An ellipsoid turned about its centre, first about x, then y, then z, in degrees.
    pub fn turned_ellipsoid(center: Vec3, half_axes: Vec3, [x, y, z]: [f64; 3]) -> Self {
        let about = |axis: Vec3, degrees: f64| DQuat::from_axis_angle(axis, degrees.to_radians());
        Self::Ellipsoid {
            center,
            half_axes,
            turn: about(Vec3::Z, z) * about(Vec3::Y, y) * about(Vec3::X, x),
        }
    }

    fn mirror(&self) -> Self {
        let flip = |p: Vec3| p.with_x(-p.x);
        match *self {
            Self::Ellipsoid {
                center,
                half_axes,
                turn,
            } => Self::Ellipsoid {
                center: flip(center),
                half_axes,
                turn: DQuat::from_xyzw(turn.x, -turn.y, -turn.z, turn.w),
            },
            Self::RoundCone {
                a,
                b,
                radius_a,
                radius_b,
            } => Self::RoundCone {
                a: flip(a),
                b: flip(b),
                radius_a,
                radius_b,
            },
            Self::Chain { ref stations } => Self::Chain {
                stations: stations.iter().map(|&(p, radius)| (flip(p), radius)).collect(),
            },
            Self::Ring {
                center,
                radius,
                thickness,
            } => Self::Ring {
                center: flip(center),
                radius,
                thickness,
            },
        }
    }

    /// Field of the form, positive inside. Below `floor` any value up to `floor` may be returned, which
    /// spares a chain most of its work.
    fn value(&self, p: Vec3, floor: f64) -> f64 {
        match *self {
            Self::Ellipsoid {
                center,
                half_axes,
                turn,
            } => {
                let q = turn.inverse() * (p - center);
                let k = (q / half_axes).length();
                // First-order distance near the surface; the least half axis at the centre, where the formula
                // is 0/0.
                let slope = (q / (half_axes * half_axes)).length();
                if slope < 1e-9 {
                    half_axes.min_element()
                } else {
                    k * (1.0 - k) / slope
                }
            }
            Self::RoundCone {
                a,
                b,
                radius_a,
                radius_b,
            } => round_cone(p, a, b, radius_a, radius_b),
            Self::Chain { ref stations } => stations.windows(2).fold(floor, |value, w| {
                let [(a, radius_a), (b, radius_b)] = [w[0], w[1]];
                // The segment is no closer than the ball around both ends: this test spares most of the work.
                let reach = 0.5 * a.distance(b) + radius_a.max(radius_b);
                if reach - p.distance(0.5 * (a + b)) <= value {
                    return value;
                }
                value.max(round_cone(p, a, b, radius_a, radius_b))
            }),
            Self::Ring {
                center,
                radius,
                thickness,
            } => {
                let q = p - center;
                thickness - (q.truncate().length() - radius).hypot(q.z)
            }
        }
    }

    fn bounds(&self) -> Aabb {
        let around = |center: Vec3, reach: f64| Aabb {
            min: center - reach,
            max: center + reach,
        };
        match *self {
            Self::Ellipsoid {
                center,
                half_axes,
                turn,
            } => {
                let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| half_axes.dot(axis) * (turn * axis));
                let reach =
                    Vec3::from_array([0, 1, 2].map(|i| axes.iter().map(|a| a[i] * a[i]).sum::<f64>().sqrt()));
                Aabb {
                    min: center - reach,
                    max: center + reach,
                }
            }
            Self::RoundCone {
                a,
                b,
                radius_a,
                radius_b,
            } => around(a, radius_a).union(around(b, radius_b)),
            Self::Chain { ref stations } => stations
                .iter()
                .fold(Aabb::EMPTY, |b, &(p, radius)| b.union(around(p, radius))),
            Self::Ring {
                center,
                radius,
                thickness,
            } => {
                let reach = Vec3::new(radius + thickness, radius + thickness, thickness);
                Aabb {
                    min: center - reach,
                    max: center + reach,
                }
            }
        }
    }
}

/// Signed distance to a rounded cone, positive inside; to one ball where it contains the other.
fn round_cone(p: Vec3, a: Vec3, b: Vec3, radius_a: f64, radius_b: f64) -> f64 {
    let along = b - a;
    let (length, taper) = (along.length(), radius_a - radius_b);
    if length <= taper.abs() {
        return (radius_a - p.distance(a)).max(radius_b - p.distance(b));
    }
    let axis = along / length;
    let x = (p - a).dot(axis);
    let y = (p - a - x * axis).length();
    // Where the normal of the cone through p meets the axis, it leaves the axis at a fixed slope.
    let (sin, cos) = (taper / length, (1.0 - (taper / length).powi(2)).sqrt());
    let foot = x - y * sin / cos;
    if foot <= 0.0 {
        radius_a - x.hypot(y)
    } else if foot >= length {
        radius_b - (x - length).hypot(y)
    } else {
        radius_a - (y * cos + x * sin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_cone_touches_both_balls_and_falls_by_one_a_unit() {
        let cone = |p| round_cone(p, Vec3::ZERO, Vec3::X * 10.0, 4.0, 2.0);
        assert!((cone(Vec3::X * -4.0)).abs() < 1e-12 && cone(Vec3::X * 12.0).abs() < 1e-12);
        for p in [
            Vec3::new(3.0, 5.0, 1.0),
            Vec3::new(-2.0, 3.0, 0.0),
            Vec3::new(11.0, 1.0, -3.0),
        ] {
            let slope = |axis: Vec3| (cone(p + 1e-5 * axis) - cone(p - 1e-5 * axis)) / 2e-5;
            let gradient = Vec3::new(slope(Vec3::X), slope(Vec3::Y), slope(Vec3::Z));
            assert!((gradient.length() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_mirrored_form_has_mirrored_values() {
        let form = Form::turned_ellipsoid(
            Vec3::new(3.0, 1.0, 2.0),
            Vec3::new(1.0, 2.0, 3.0),
            [20.0, 30.0, 40.0],
        );
        for p in [Vec3::new(3.5, 0.0, 1.0), Vec3::new(-1.0, 2.0, 3.0)] {
            assert!((form.value(p, -99.0) - form.mirror().value(p.with_x(-p.x), -99.0)).abs() < 1e-12);
        }
    }
}
