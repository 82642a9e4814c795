//! Command-line arguments of `test`.

use clap::Args;
use shellock_job::options::{Axis, material, units};
use shellock_job::stress::{self, Place};
use shellock_mechanics::Material;

use super::options::words;

/// Loads that a finished kit is tested with, and settings of the simulation.
#[derive(Args)]
pub struct Blows {
    /// Force of the punch
    #[arg(long, value_name = "FORCE", default_value = "70N", allow_hyphen_values = true,
          value_parser = units::newtons)]
    pub punch: f64,
    /// Place that the punch presses on: the highest place 15 mm wide or wider (top), or the highest place
    /// above the middle (middle)
    #[arg(long, value_parser = words::<Place>(), default_value = "top", value_name = "WHERE")]
    pub at: Place,
    /// Height of the fall: m, cm or mm
    #[arg(long, value_name = "HEIGHT", default_value = "2m", allow_hyphen_values = true,
          value_parser = units::metres)]
    pub drop: f64,
    /// Material of the pieces: sla-resin, pla, petg or pa12 [default: as the kit was built]
    #[arg(long, value_name = "NAME", value_parser = material)]
    pub material: Option<Material>,
    /// Edge length of the cells that finished pieces are cut into, mm, 0.5 to 20; smaller cells take more
    /// time and memory
    #[arg(long, value_name = "MM", default_value_t = 2.5)]
    pub cell: f64,
    /// Compare the kit's plan with connectors of half the size and with a plan of half the score, as walls
    /// and connectors without gaps
    #[arg(long)]
    pub compare: bool,
    /// Edge length of the meshes for the forces and for the comparison, as a multiple of the default, 0.2 to
    /// 5
    #[arg(long, value_name = "SHARE", default_value_t = 1.0)]
    pub edges: f64,
    /// Axis that points up [default: as the kit was built]
    #[arg(long, value_parser = words::<Axis>())]
    pub up: Option<Axis>,
}

impl From<&Blows> for stress::Blows {
    fn from(blows: &Blows) -> Self {
        Self {
            punch_n: blows.punch,
            at: blows.at,
            drop_m: blows.drop,
            material: blows.material,
            cell_mm: blows.cell,
            edge_share: blows.edges,
            up: blows.up,
        }
    }
}
