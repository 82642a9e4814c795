//! Proportions of a connector, as multiples of its size D. Planning, simulation and manufacture share this
//! one shape. Parts of connectors smaller than 2.3 mm are made thicker than this, 1 mm at least.
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
