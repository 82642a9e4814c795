//! What a connector asks of a seam. Plans count on it and the connector stage keeps it: one constant for
//! both.
//!
//! The proportions of the connector itself are in [`shellock_mechanics::connector`].

/// Most `|s · u|` that a connector bears, where `u` runs along the seam; beyond, it is too shallow to hold.
pub const MAX_ALONG_SEAM: f64 = 0.9;

/// Most backward angle T that a connector bears, rad (60°); beyond, it is ill-shaped.
pub const MAX_BACKWARD_RAD: f64 = std::f64::consts::FRAC_PI_3;

/// Most `|s · N|` at which a rail can run under the seam.
pub const MAX_OUT_OF_RAIL: f64 = 0.25;

/// How clearly, as `|s · N|`, a place must ask for the other male piece before a run of connectors ends
/// there: else roles flicker.
pub const ROLE_HYSTERESIS: f64 = 0.1;

/// Shortest runs of connectors that count as holding, in connector sizes D: the first is asked for as long as
/// plans exist with it.
///
/// With the gaps at its ends an open seam must be 5.5, 4.1 or 3 D long. A cat's piece whose connectors were
/// too short came loose. Thin limbs have no longer seams than for the last, the shortest run that is made;
/// what turns and carving leave of it, a kit must show.
pub const COUNTED_RUN_SIZES: [f64; 3] = [2.5, 1.85, SHORTEST_RUN_SIZES];

/// Shortest run that is made, in connector sizes D. On the models tried, joints under this in all were the
/// ones that came loose.
pub const SHORTEST_RUN_SIZES: f64 = 1.2;

/// Shortest rail that is made, in connector sizes D.
pub const SHORTEST_RAIL_SIZES: f64 = 2.0;

/// Frames that turn by more than this between neighbouring points of a line, rad, cannot be swept.
pub const SHARPEST_TURN: f64 = 0.42;

/// Room kept free at both ends of an open seam, where three pieces meet, in connector sizes D: least, most,
/// and in between the share of the seam. The connectors of three seams have room side by side with the most;
/// with the least they take a part of each other.
const END_GAP_SIZES: [f64; 2] = [0.9, 1.5];
const END_GAP_SHARE: f64 = 0.27;

/// Room kept free of connectors of `size_mm` at both ends of an open seam of `length_mm` on the inner side of
/// the wall, mm.
pub fn end_gap_mm(size_mm: f64, length_mm: f64) -> f64 {
    (END_GAP_SHARE * length_mm).clamp(END_GAP_SIZES[0] * size_mm, END_GAP_SIZES[1] * size_mm)
}
