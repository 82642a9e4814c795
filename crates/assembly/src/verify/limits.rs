//! Limits by which finished kits are judged, with their reasons. An outside judge with its own measurements
//! has the limits of the second column. Ours are stricter, to allow for differences between the two
//! measurements.
//!
//! | limit | outside | here | why |
//! | --- | --- | --- | --- |
//! | common volume of two pieces at rest | 0.5 mm³ | 0.5 mm³ | a drop of resin (1) |
//! | outside the model, share of its volume | 1e-4 | 0.5e-4 | nothing may protrude from the skin (2) |
//! | outer surface kept, share | 0.97 | 0.975 | the figure must look unchanged (3) |
//! | widest gap in the skin, to either side | 0.5 mm | 0.45 mm | primer fills a scratch; a hole shows |
//! | overlap on a way out | 0.5 mm³, 0.03 mm thick | a tenth less | thinner than the clearance: it rubs off |
//! | overlap with what stops a push | 0.5 mm³ | a tenth more | less shears off or slips past |
//! | surface of a piece that folds back on itself | 0 | 0.5 mm² | a slit of 2 µm does no harm (5) |
//! | part that hangs on a neck of 0.8 mm | 5 mm³ inside | 4.5 mm³, 0.85 mm | a lug of 2 mm breaks off |
//! | part that hangs on a neck of 1.2 mm | | 10 mm³, 1.22 mm | so does a larger one (6) |
//! | length of a push ([`crate::push`]) | 3 clearances + 0.6 mm | equal | more than all play (4) |
//!
//! (1) Joints cut without any gap share 0.07 mm³ by rounding alone. (2) Measured by rays here. (3) Four sigma
//! of the samples above the outside limit. (4) And more than the roundness of printed
//! edges. (5) Here alone the outside judge is stricter, if it is asked to be (`--strict`).
//! (6) Three lines of a nozzle, and less than any wall that is printed by default. A neck that is long enough
//! to bear a push does not count: the root of a channel's wall is thin, too, and as long as the channel.

/// Greatest common volume of two pieces that counts as rounding, mm³.
pub const OVERLAP_MM3: f64 = 0.5;
/// Greatest volume outside the model, as a share of the model's volume.
pub const OUTSIDE_SHARE: f64 = 0.5e-4;
/// Least share of the outer surface that must be kept.
pub const LEAST_KEPT: f64 = 0.975;
/// Widest half gap allowed in the outer surface, mm; a wider one is a hole.
pub const WIDEST_HALF_GAP_MM: f64 = 0.45;
/// Greatest overlap on the way out that counts as rounding, mm³.
pub const RUB_MM3: f64 = 0.45;
/// Greatest mean thickness `2V/A` of an overlap on the way out that counts as rounding, mm.
pub const RUB_MM: f64 = 0.027;
/// Least overlap with others that holds a pushed piece, mm³.
pub const HOLD_MM3: f64 = 0.55;
/// Necks that break: their width, mm, and the greatest volume that may hang on them, without its outermost
/// layer, mm³. What hangs on a thinner neck may itself be too thin to be seen with the greater width.
pub const NECKS: [(f64, f64); 2] = [(0.85, 4.5), (1.22, 10.0)];
/// Push at the far end of a part that the second neck may bear instead, N: that of a finger.
pub const NECK_PUSH_N: f64 = 20.0;
/// Strength of the neck's material in that, MPa: resin and PLA.
pub const NECK_STRENGTH_MPA: f64 = 40.0;
/// Greatest such width as a share of the mean wall of a piece, for thin walls.
pub const NECK_WALLS: f64 = 0.75;
/// Width below which slots within one piece are reported, mm: resin fuses them, and no nozzle leaves them
/// open.
pub const LEAST_SLOT_MM: f64 = 0.2;
/// Travels, mm, at which doubt about a way is always resolved exactly: those that the outside judge tries.
pub const TRAVELS_MM: [f64; 18] = [
    0.05, 0.15, 0.3, 0.6, 1.0, 1.5, 2.2, 3.0, 4.0, 5.5, 7.5, 10.0, 14.0, 20.0, 28.0, 40.0, 60.0, 90.0,
];
