//! Parameters that a user may set.

use shellock_mechanics::Material;

use crate::connector::ConnectorParams;
use crate::piece::LabelParams;
use crate::segmentation::{KeepWhole, Method};

/// Everything that a user may set, each once; what stages are given follows from it, see
/// [`Settings`](super::Settings).
///
/// ```
/// let mut params = shellock::Params::default();
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
    /// Number of pieces that automatic segmentation begins with. [2, 128]; `None`: the method's choice, or by
    /// the area with [`Method::Creases`], 10 for a figure of 150 mm.
    pub n_pieces: Option<usize>,
    /// Regions that no seam is to divide; none.
    pub keep_whole: Vec<KeepWhole>,
    /// True to divide both sides of a model's plane of symmetry alike, by [`Method::Auto`] and
    /// [`Method::RandomCuts`]; false.
    pub symmetric: bool,
    /// Upward direction of the standing model; a key underneath is preferred. Any length but 0; +z.
    pub up: [f64; 3],
    /// Source of the wall's thickness; 2 mm.
    pub thickness: Thickness,
    /// Material that pieces are printed of.
    pub material: Material,
    /// Height of the fall that the wall is to bear, m. [0.01, 20]; 1.275.
    pub drop_m: f64,
    /// Source of the key; cut out of the surface.
    pub key: KeySource,
    /// True to cut a notch for a fingernail into a key that is cut; false.
    pub has_grip: bool,
    /// Engraving of the pieces' numbers; `None` for no numbers.
    pub label: Option<LabelParams>,
    /// Shape and clearance of connectors.
    pub connector: ConnectorParams,
    /// Distance by which each side of a seam is set back, mm. [0, 0.4]; 0.05.
    pub seam_gap_mm: f64,
    /// Spacing of the grid that fields live on, mm. (0, thickness / 2]; `None` takes the thickness over 2.5.
    pub cell_mm: Option<f64>,
    /// Work that the exact search for a plan may do: pieces revised. [0, 10⁹]; 100 000.
    pub proof_budget: usize,
    /// True to make pieces even if little of the model can be hollow; false.
    pub allows_thin: bool,
    /// True to search for the play of all pieces together, too; false.
    pub is_play_together: bool,
    /// Bounds on the kits that are made after one fails its verification.
    pub rounds: Rounds,
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
            material: Material::default(),
            drop_m: 1.275,
            key: KeySource::default(),
            has_grip: false,
            label: None,
            connector: ConnectorParams::default(),
            seam_gap_mm: 0.05,
            cell_mm: None,
            proof_budget: 100_000,
            allows_thin: false,
            is_play_together: false,
            rounds: Rounds::default(),
        }
    }
}

impl Params {
    /// Lists the problems of all stages, in words; empty if there are none.
    pub fn problems(&self) -> Vec<String> {
        super::settings::problems(self)
    }
}

/// Source of the wall's thickness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Thickness {
    /// Thickness given by the user, mm, in [0.8, 10]; its stress is reported.
    Mm(f64),
    /// Least thickness that withstands a fall.
    Auto,
}

impl Default for Thickness {
    fn default() -> Self {
        Self::Mm(2.0)
    }
}

/// Source of the key.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum KeySource {
    /// Cut out of the surface where the key slides best, see [`crate::key`]; if no such kit passes, as with
    /// `Flattest`.
    #[default]
    Cut,
    /// Cut as near as possible to a place in the model's space, mm.
    CutNear([f64; 3]),
    /// Flattest of the pieces that work as the key.
    Flattest,
    /// The piece with this label, where labels are given; else the one that has this number, from 1, once the
    /// model is divided (as `shellock segment` numbers them).
    Piece(i64),
}

impl KeySource {
    /// Returns true if the key is cut out of the surface.
    pub fn is_cut(self) -> bool {
        matches!(self, Self::Cut | Self::CutNear(_))
    }
}

/// Bounds on the kits of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rounds {
    /// Kits made for one segmentation, at most. ≥ 1; 3.
    pub kits: usize,
    /// Segmentations revised after the first, at most; 4.
    pub refinements: usize,
    /// Kits made of all segmentations, at most. ≥ 1; 8.
    pub kits_in_all: usize,
}

impl Rounds {
    /// Returns the smaller bound of `self` and `other`, each by itself.
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
