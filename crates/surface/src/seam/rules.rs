//! Requirements of connectors on their seam. Plans rely on them and the connector stage keeps them: one
//! constant for both.
//!
//! The proportions of the connector itself are in `shellock_mechanics::connector`.

/// Greatest `|s · u|` of a connector, where `u` runs along the seam; beyond it the connector is too shallow
/// to hold.
pub const MAX_ALONG_SEAM: f64 = 0.9;

/// Greatest backward angle T of a connector, rad (60°); beyond it the shape degenerates.
pub const MAX_BACKWARD_RAD: f64 = std::f64::consts::FRAC_PI_3;

/// Greatest `|s · N|` at which a rail can run under the seam.
pub const MAX_OUT_OF_RAIL: f64 = 0.25;

/// Least `|s · N|` at which a place decides its own male piece. Below it, the place follows the nearest clear
/// place; otherwise roles flicker.
pub const ROLE_HYSTERESIS: f64 = 0.1;

/// Shortest runs of connectors that count as holding, in connector sizes D, in order of preference: the first
/// is required as long as plans exist with it.
///
/// With the gaps at its ends an open seam must be 5.5, 4.1 or 3 D long. A cat's piece whose connectors were
/// too short came loose. Seams of thin limbs are long enough only for the last, the shortest run that is
/// made. The finished kit must show what turns and carving leave of such a run.
pub const COUNTED_RUN_SIZES: [f64; 3] = [2.5, 1.85, SHORTEST_RUN_SIZES];

/// Shortest run that is made, in connector sizes D. On the models tried, the joints that came loose were
/// those shorter than this in total.
pub const SHORTEST_RUN_SIZES: f64 = 1.2;

/// Shortest rail that is made, in connector sizes D.
pub const SHORTEST_RAIL_SIZES: f64 = 2.0;

/// Greatest turn of the frame between neighbouring points of a line, rad; beyond it the profile cannot be
/// swept.
pub const SHARPEST_TURN: f64 = 0.42;

/// Room kept free at both ends of an open seam, where three pieces meet, in connector sizes D: least,
/// greatest, and in between the share of the seam. With the greatest, the connectors of three seams fit side
/// by side; with the least, each takes a part of another.
const END_GAP_SIZES: [f64; 2] = [0.9, 1.5];
const END_GAP_SHARE: f64 = 0.27;

/// Length kept free of connectors of `size_mm` at both ends of an open seam of `length_mm` on the inner side
/// of the wall, mm.
pub fn end_gap_mm(size_mm: f64, length_mm: f64) -> f64 {
    (END_GAP_SHARE * length_mm).clamp(END_GAP_SIZES[0] * size_mm, END_GAP_SIZES[1] * size_mm)
}
