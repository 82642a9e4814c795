//! Proportions of a connector, as multiples of its size D. Planning, simulation and manufacture share this
//! one shape. Parts of connectors smaller than 2.4 mm are made thicker than this: [`LEAST_PART_MM`] at least,
//! and [`LEAST_FOOT_MM`] for the foot.
//!
//! ```text
//!       female │ male         ↑ ŝ
//!     ───┐     │  ─────       wall
//!        │ ┌───┤              pin: PIN_DEPTH deep, PIN_WIDTH thick
//!        │ │pin│ ┌──┐
//!        │ └───┘ │ft│         foot: FOOT_WIDTH thick
//!        └───────┘  │         floor: FLOOR thick
//!        └──────────┘
//! ```

/// Depth by which the male's pin reaches into the female's channel. [Yao et al. 2017, Sect. 4.2, gives D
/// alone; chosen by eye]
pub const PIN_DEPTH: f64 = 0.6;
/// Thickness of the pin across the seam.
pub const PIN_WIDTH: f64 = 0.5;
/// Thickness of the channel's foot, under the male piece, with the clearance.
pub const FOOT_WIDTH: f64 = 0.5;
/// Thickness of the channel's floor.
pub const FLOOR: f64 = 0.45;
/// Depth of a straight channel without its clearance: pin and floor.
pub const CHANNEL_DEPTH: f64 = PIN_DEPTH + FLOOR;
/// Least thickness of pins, channel walls and floors, tongues and lips, mm, at any size: two lines of a
/// filament printer, twenty pixels of a resin printer.
pub const LEAST_PART_MM: f64 = 1.0;
/// Least thickness of the foot, mm. The wall that it hangs from begins a gap beside the seam, so the foot's
/// root in it is that much narrower.
pub const LEAST_FOOT_MM: f64 = LEAST_PART_MM + 0.2;

/// Thickness of a stop, which closes an end of a channel, mm.
pub const STOP_MM: f64 = LEAST_PART_MM;
/// Greatest part of the unit vector ŝ along the seam at an end that gets a stop: edges of 45°. Beyond it the
/// stop would have sharper ones.
pub const MOST_LEAN_OF_STOPS: f64 = 0.71;
/// Shortest pin between stops, in sizes D.
const LEAST_PIN_SIZES: f64 = 1.0;

/// Number of stops that a channel has room for, 0 to 2, by its length along the seam.
pub fn n_stops(length_mm: f64, size_mm: f64, clearance_mm: f64) -> usize {
    let room_mm = length_mm - LEAST_PIN_SIZES * size_mm;
    (room_mm / (STOP_MM + clearance_mm)).clamp(0.0, 2.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_between_stops_is_as_long_as_its_size() {
        let reach_mm = STOP_MM + 0.1;
        for size_mm in [2.0, 4.0] {
            for n in 0..=2usize {
                let length_mm = size_mm + n as f64 * reach_mm;
                assert_eq!(n_stops(length_mm + 1e-9, size_mm, 0.1), n);
            }
            assert_eq!((n_stops(0.5, size_mm, 0.1), n_stops(99.0, size_mm, 0.1)), (0, 2));
        }
    }
}
