//! What a user may set.

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
    /// How pieces are found where there are no labels; where people would divide ([`Method::Auto`]).
    pub method: Method,
    /// Pieces that automatic segmentation begins with. [2, 128]; `None`: what the method finds, and in
    /// creases from the area, 10 for a figure of 150 mm.
    pub n_pieces: Option<usize>,
    /// Regions that no seam is to divide; none.
    pub keep_whole: Vec<KeepWhole>,
    /// Whether [`Method::Auto`] and [`Method::RandomCuts`] divide both sides of a model's plane of symmetry
    /// alike; no.
    pub symmetric: bool,
    /// Which way is up when the model stands; a key underneath is preferred. Any length but 0; +z.
    pub up: [f64; 3],
    /// Where the wall's thickness comes from; 2 mm.
    pub thickness: Thickness,
    /// What pieces are printed of.
    pub material: Material,
    /// Height of the fall that the wall is to bear, m. [0.01, 20]; 1.275.
    pub drop_m: f64,
    /// Where the key comes from.
    pub key: KeySource,
    /// Whether a key that is cut gets a notch for a fingernail.
    pub has_grip: bool,
    /// How the pieces' numbers are engraved; not at all where `None`.
    pub label: Option<LabelParams>,
    /// How connectors are made.
    pub connector: ConnectorParams,
    /// How far each side of a seam stays back, mm. [0, 0.4]; 0.05.
    pub seam_gap_mm: f64,
    /// Spacing of the grid that fields live on, mm. (0, thickness / 2]; `None` takes the thickness over 2.5.
    pub cell_mm: Option<f64>,
    /// Work that the exact search for a plan may do: pieces revised. [0, 10⁹]; 100 000.
    pub proof_budget: usize,
    /// Whether pieces are made though hardly anything of the model can be hollow.
    pub allows_thin: bool,
    /// Whether the play of all pieces together is looked for, too.
    pub is_play_together: bool,
    /// How often a kit that failed its verification is planned and made again.
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
    /// Every problem of every stage, in words; empty where there is none.
    pub fn problems(&self) -> Vec<String> {
        super::settings::problems(self)
    }
}

/// Where the wall's thickness comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Thickness {
    /// It is so much, mm, in [0.8, 10]; the stress in it is reported.
    Mm(f64),
    /// The least that bears a fall.
    Auto,
}

impl Default for Thickness {
    fn default() -> Self {
        Self::Mm(2.0)
    }
}

/// Where the key comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum KeySource {
    /// It is cut out of the surface where it slides best, see [`crate::key`]; where no such kit passes, as
    /// with `Flattest`.
    #[default]
    Cut,
    /// The same as near as can be to a place in the model's space, mm.
    CutNear([f64; 3]),
    /// The flattest piece that works.
    Flattest,
    /// The piece with this label, where labels are given; else the one that has this number, from 1, once the
    /// model is divided (as `shellock segment` numbers them).
    Piece(i64),
}

impl KeySource {
    /// Whether the key is cut out of the surface.
    pub fn is_cut(self) -> bool {
        matches!(self, Self::Cut | Self::CutNear(_))
    }
}

/// Bounds of the feedback loop.
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
    /// No more of anything than `other` allows.
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
