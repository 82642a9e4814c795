//! Kit that the pictures show.

use std::path::PathBuf;

use rayon::prelude::*;
use shellock::design::{Params, Settings};
use shellock::figure::{self, Figure};
use shellock::segmentation::Method;
use shellock::{Design, DesignOutcome, PatchId, design};
use shellock_geom::{Solid, TriMesh, Vec3};
use shellock_render::stills::{Painted, crease_normals};
use shellock_render::{ReportPiece, palette};

use crate::failure::Failure;
use crate::model::{made_params, with_ctx};

/// Size of the figure, mm, and number of triangles along it, as in `shellock demo`.
const SIZE_MM: f64 = 150.0;
const CELLS: f64 = 94.0;

/// Number of pieces in `shellock demo`.
const OF_DEMO: usize = 7;

/// A finished kit with its pieces in place.
pub struct Kit {
    pub design: Design,
    /// Settings of the kit, including the thickness of its wall.
    pub settings: Settings,
    /// Model as it was given.
    pub model: Solid,
    /// Meshes of the pieces in place, z up.
    pub meshes: Vec<TriMesh>,
    normals: Vec<Vec<[Vec3; 3]>>,
}

impl Kit {
    /// Makes the squirrel of `shellock demo`: cut where a person would cut, into few pieces.
    pub fn of_demo() -> Result<Self, Failure> {
        let mut params = made_params();
        params.method = Method::Auto;
        params.n_pieces = Some(OF_DEMO);
        Self::make(&params)
    }

    /// Makes a squirrel with pieces of similar size and joints of all kinds, for close-ups.
    pub fn squirrel() -> Result<Self, Failure> {
        Self::make(&made_params())
    }

    fn make(params: &Params) -> Result<Self, Failure> {
        let fault = |problem: String| Failure::Model {
            path: PathBuf::from("squirrel"),
            problem,
        };
        let model = figure::make(Figure::Squirrel, SIZE_MM, SIZE_MM / CELLS);
        let outcome = with_ctx(|ctx| design(ctx, params, &model, None)).map_err(|e| fault(e.to_string()))?;
        let design = match outcome {
            DesignOutcome::Made(design) if design.kit.verification.has_passed() => *design,
            DesignOutcome::Made(_) => return Err(fault("its kit fails a check".into())),
            DesignOutcome::NoPlan(none) => return Err(fault(none.reason)),
        };
        let settings = Settings::with_thickness(params, design.kit.thickness_mm);
        let meshes: Vec<TriMesh> = design.kit.pieces.as_slice().to_vec();
        let normals = meshes.par_iter().map(crease_normals).collect();
        Ok(Self {
            design,
            settings,
            model,
            meshes,
            normals,
        })
    }

    pub fn ids(&self) -> impl Iterator<Item = PatchId> {
        self.design.kit.pieces.ids()
    }

    /// Pieces in order of installation.
    pub fn in_order(&self) -> Vec<PatchId> {
        self.design.kit.plan.steps.iter().map(|s| s.piece).collect()
    }

    pub fn color(&self, piece: PatchId) -> [u8; 3] {
        palette::color(self.design.kit.plan.position(piece))
    }

    /// Direction in which a piece leaves, a unit vector.
    pub fn way_out(&self, piece: PatchId) -> Vec3 {
        self.design.kit.plan.separation(piece).unit()
    }

    /// Paints a piece in place, moved by `shift`.
    pub fn paint(&self, piece: PatchId, shift: Vec3) -> Painted<'_> {
        let i = usize::from(piece);
        Painted {
            mesh: &self.meshes[i],
            color: self.color(piece),
            face_colors: None,
            normals: Some(&self.normals[i]),
            shift,
        }
    }

    /// Pieces in the form that the page and the booklet need.
    pub fn report_pieces(&self) -> Vec<ReportPiece<'_>> {
        let plan = &self.design.kit.plan;
        self.ids()
            .map(|p| ReportPiece {
                number: p.number(),
                name: format!("piece {p}"),
                color: self.color(p),
                mesh: &self.meshes[usize::from(p)],
                installation_direction: (-self.way_out(p)).to_array(),
                order: plan.position(p),
                is_key: plan.key() == p,
                facts: Vec::new(),
            })
            .collect()
    }
}
