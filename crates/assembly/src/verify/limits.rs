//! The standard that finished kits are judged by, with its reasons. An outside judge with measurements of its
//! own has the limits of the second column; ours are stricter by what the two may measure differently.
//!
//! | limit | outside | here | why |
//! | --- | --- | --- | --- |
//! | common volume of two pieces at rest | 0.5 mm³ | 0.5 mm³ | a drop of resin; joints cut without any gap share 0.07 mm³ by rounding alone |
//! | outside the model, share of its volume | 1e-4 | 0.5e-4 | nothing may stand out of the skin; measured by rays here |
//! | outer surface kept, share | 0.97 | 0.975 | the figure must look as it was; four sigma of the samples above |
//! | widest gap in the skin, to either side | 0.5 mm | 0.45 mm | a scratch that primer fills; a hole shows |
//! | overlap on a way out | 0.5 mm³, 0.03 mm thick | a tenth less | thinner than the clearance, it rubs and goes |
//! | what a push meets where it is held | 0.5 mm³ | a tenth more | less shears off or slips past |
//! | length of a push ([`crate::push`]) | 3 clearances + 0.6 mm | the same | beyond all play and the roundness of printed edges |

/// Common volume of two pieces that is still rounding, mm³.
pub const OVERLAP_MM3: f64 = 0.5;
/// Volume outside the model over the model's volume.
pub const OUTSIDE_SHARE: f64 = 0.5e-4;
/// Least share of the outer surface that must be kept.
pub const LEAST_KEPT: f64 = 0.975;
/// Widest half gap allowed in the outer surface, mm: what goes deeper is a hole.
pub const WIDEST_HALF_GAP_MM: f64 = 0.45;
/// Overlap on the way out that is still rounding, mm³.
pub const RUB_MM3: f64 = 0.45;
/// Mean thickness `2V/A` of an overlap on the way out that is still rounding, mm.
pub const RUB_MM: f64 = 0.027;
/// Overlap with others that holds a piece that is pushed, mm³.
pub const HOLD_MM3: f64 = 0.55;
/// Slots within one piece that are narrower are told, mm: resin fuses them, and no nozzle leaves them open.
pub const LEAST_SLOT_MM: f64 = 0.2;
/// Travels, mm, at which doubt about a way is always resolved exactly: those that the outside judge tries.
pub const TRAVELS_MM: [f64; 18] = [
    0.05, 0.15, 0.3, 0.6, 1.0, 1.5, 2.2, 3.0, 4.0, 5.5, 7.5, 10.0, 14.0, 20.0, 28.0, 40.0, 60.0, 90.0,
];
