//! Parameters that a user may set.

use shellock_divide::segmentation::{KeepWhole, Method};
use shellock_make::connector::ConnectorParams;
use shellock_make::piece::LabelParams;
use shellock_mechanics::Material;

/// Parameters that a user may set, each once. [`Settings`](crate::Settings) derives the parameters of
/// each stage from them.
///
/// ```
/// let mut params = shellock_settings::Params::default();
/// params.n_pieces = Some(8);
/// assert!(params.problems().is_empty());
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Params {
    /// Seed of all random choices: the same seed gives the same kit. 0.
    pub seed: u64,
    /// Method that divides a model without labels; [`Method::Auto`], which cuts where people would.
    pub method: Method,
    /// Number of pieces that automatic segmentation begins with. [2, 128]; `None`: as many as the method
    /// finds. [`Method::Creases`] then takes the number from the area, 10 for a figure of 150 mm.
    pub n_pieces: Option<usize>,
    /// Regions that no seam may divide; none.
    pub keep_whole: Vec<KeepWhole>,
    /// True to divide both sides of a model's plane of symmetry alike; false. Only for [`Method::Auto`] and
    /// [`Method::RandomCuts`].
    pub symmetric: bool,
    /// Up direction of the standing model, of any length but 0; +z. A key underneath is preferred.
    pub up: [f64; 3],
    /// Choice of the wall thickness; 2 mm.
    pub thickness: Thickness,
    /// Choice of the wall where the thickness is [`Thickness::Auto`]; standard.
    pub wall: WallChoice,
    /// Material of the printed pieces.
    pub material: Material,
    /// Height of the fall that the wall must withstand, m. [0.01, 20]; 1.275.
    pub drop_m: f64,
    /// Choice of the key; cut out of the surface.
    pub key: KeySource,
    /// True to give a cut key a notch for a fingernail; false.
    pub has_grip: bool,
    /// Strokes of the engraved piece numbers; `None` engraves none.
    pub label: Option<LabelParams>,
    /// Shape and fit of the connectors.
    pub connector: ConnectorParams,
    /// Distance by which each side of a seam stays back from the cut, mm. [0, 0.4]; 0.05.
    pub seam_gap_mm: f64,
    /// Overlap of neighbouring printed lines, mm, by which a wall of several lines is thinner than their sum.
    /// [0, 0.3]; 0, for printers that lay no lines.
    pub line_overlap_mm: f64,
    /// Spacing of the grid on which fields are sampled, mm. (0, thickness / 2]; `None`: thickness / 2.5.
    pub cell_mm: Option<f64>,
    /// Budget of the exact search for a plan, in pieces revised. [0, 10⁹]; 100 000.
    pub proof_budget: usize,
    /// True to make pieces even if the model is too thin for a cavity or for connectors; false.
    pub allows_thin: bool,
    /// True to measure the play of all pieces together, too; false.
    pub is_play_together: bool,
    /// Limits on planning and making another kit after one failed its verification.
    pub rounds: Rounds,
    /// Work after which nothing else is tried, s on a reference machine of two cores; > 0. Unlike a limit of
    /// time, it gives the same kit on any machine. None.
    pub effort_s: Option<f64>,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            seed: 0,
            method: Method::default(),
            n_pieces: None,
            keep_whole: Vec::new(),
            symmetric: false,
            up: [0.0, 0.0, 1.0],
            thickness: Thickness::default(),
            wall: WallChoice::default(),
            material: Material::default(),
            drop_m: 1.275,
            key: KeySource::default(),
            has_grip: false,
            label: None,
            connector: ConnectorParams::default(),
            seam_gap_mm: 0.05,
            line_overlap_mm: 0.0,
            cell_mm: None,
            proof_budget: 100_000,
            allows_thin: false,
            is_play_together: false,
            rounds: Rounds::default(),
            effort_s: None,
        }
    }
}

/// Choice of the wall thickness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Thickness {
    /// Thickness that the user gives, mm, in [0.8, 10]. The stress in the wall is reported.
    Mm(f64),
    /// Thinnest wall that withstands the fall.
    Auto,
}

impl Default for Thickness {
    fn default() -> Self {
        Self::Mm(2.0)
    }
}

/// Choice of the wall, if its thickness is not given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WallChoice {
    /// As thin as seams allow, whatever it withstands.
    Light,
    /// The thinnest wall that survives a fall. It is thicker only if the kit would otherwise not withstand
    /// what people do with it by hand.
    #[default]
    Standard,
    /// At least half as thick again as a light wall, and so thick that the kit withstands
    /// [`RESERVE`](shellock_rate::metric::RESERVE) times what people do with it by hand.
    Sturdy,
}

/// Choice of the key, the piece installed last.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum KeySource {
    /// Cut out of the surface where it slides best, see [`shellock_divide::key`]. If no such kit passes, the
    /// key is chosen as with `Flattest`.
    #[default]
    Cut,
    /// Cut out of the surface as near as possible to this point of the model, mm.
    CutNear([f64; 3]),
    /// Flattest piece that works as a key.
    Flattest,
    /// Piece with this label, if labels are given. Otherwise the piece with this number, from 1, in the
    /// divided model (as `shellock segment` numbers them).
    Piece(i64),
}

impl KeySource {
    /// Returns true if the key is cut out of the surface.
    pub fn is_cut(self) -> bool {
        matches!(self, Self::Cut | Self::CutNear(_))
    }
}

/// Limits of the feedback loop: kits made, and segmentations revised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rounds {
    /// Most kits made for one segmentation. ≥ 1; 3.
    pub kits: usize,
    /// Most segmentations revised after the first; 4.
    pub refinements: usize,
    /// Most kits made of all segmentations. ≥ 1; 8.
    pub kits_in_all: usize,
}

impl Rounds {
    /// Returns the smaller of each pair of limits.
    pub fn least(&self, other: &Self) -> Self {
        Self {
            kits: self.kits.min(other.kits),
            refinements: self.refinements.min(other.refinements),
            kits_in_all: self.kits_in_all.min(other.kits_in_all),
        }
    }
}

impl Default for Rounds {
    fn default() -> Self {
        Self {
            kits: 3,
            refinements: 4,
            kits_in_all: 8,
        }
    }
}
