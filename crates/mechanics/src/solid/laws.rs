//! Contact laws: pressure once the gap is closed, friction up to a bound, and holds in all directions.

use shellock_geom::Vec3;

use super::touch::Touch;

/// Depth of material whose compression gives a contact its compliance, mm: how far a printed face yields
/// before it carries load. A face of 4 mm² under 10 N gives 0.0001 mm.
const SKIN_MM: f64 = 0.1;
/// Remaining share of a contact's stiffness along its direction of slip; it makes the step unique.
const SLIP_SHARE: f64 = 1e-6;

/// Contact between two parts, or between a part and the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// Normal out of the first end's part into the second's.
    pub normal: Vec3,
    pub gap_mm: f64,
    /// True if the contact holds in all directions.
    pub is_fast: bool,
    /// Stiffness of the contact, N/mm.
    pub stiffness: f64,
}

impl Contact {
    pub fn of_touch(touch: &Touch, youngs_modulus_mpa: f64) -> Self {
        Self {
            normal: touch.normal,
            gap_mm: touch.gap_mm,
            is_fast: touch.is_fast,
            stiffness: stiffness(touch.area_mm2, youngs_modulus_mpa),
        }
    }
}

/// Stiffness of a contact with the given area, N/mm.
pub(super) fn stiffness(area_mm2: f64, youngs_modulus_mpa: f64) -> f64 {
    youngs_modulus_mpa * area_mm2.max(0.01) / SKIN_MM
}

/// Friction bound of a contact, N, and the origin of its slip.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Grip {
    pub bound_n: f64,
    pub origin: Vec3,
}

/// Direction along which a contact responds: `force = −stiffness · motion + constant`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response {
    pub along: Vec3,
    pub stiffness: f64,
}

/// Force on the second part, N, after it has moved by `by` relative to the first.
pub(super) fn force(contact: &Contact, grip: &Grip, by: Vec3) -> Vec3 {
    if contact.is_fast {
        return -contact.stiffness * by;
    }
    let gap = contact.gap_mm + contact.normal.dot(by);
    let pressure = contact.normal * (contact.stiffness * (-gap).max(0.0));
    if grip.bound_n <= 0.0 {
        return pressure;
    }
    let slip = (by - grip.origin).reject_from_normalized(contact.normal);
    let most = grip.bound_n / contact.stiffness;
    pressure - contact.stiffness * slip * (most / slip.length().max(most)).min(1.0)
}

/// Directions along which the contact responds, with their stiffness.
pub(super) fn answers(contact: &Contact, grip: &Grip, by: Vec3) -> Vec<Response> {
    let k = contact.stiffness;
    let along = |along: Vec3, stiffness: f64| Response { along, stiffness };
    if contact.is_fast {
        return Vec3::AXES.map(|axis| along(axis, k)).to_vec();
    }
    let n = contact.normal;
    let mut all = Vec::new();
    if contact.gap_mm + n.dot(by) < 0.0 {
        all.push(along(n, k));
    }
    if grip.bound_n > 0.0 {
        let slip = (by - grip.origin).reject_from_normalized(n);
        let first = slip.try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
        let second = n.cross(first);
        let share = grip.bound_n / (k * slip.length()).max(grip.bound_n);
        let forwards = if share < 1.0 { SLIP_SHARE } else { 1.0 };
        all.push(along(first, k * forwards));
        all.push(along(second, k * share.max(SLIP_SHARE)));
    }
    all
}
