//! Fields of a wall that several kits of one model share.

use shellock_geom::Solid;
use shellock_surface::SegmentedSurface;

use super::{BodyParams, GridError, PatchDistances, ShellGrid};

/// Grid of a model's wall, and distances of its nodes to the pieces; made when first needed.
#[derive(Default)]
pub struct WallGrid {
    /// Room for connectors below the wall, mm.
    room_mm: f64,
    grid: Option<ShellGrid>,
    distances: Option<PatchDistances>,
}

impl WallGrid {
    /// Forgets the distances to other pieces.
    pub fn begin_division(&mut self) {
        self.distances = None;
    }

    /// Makes sure that there will be this much room below the wall, mm.
    pub fn reserve(&mut self, room_mm: f64) {
        if room_mm > self.room_mm {
            (self.room_mm, self.grid, self.distances) = (room_mm, None, None);
        }
    }

    /// Returns the grid and the distances, and makes those that are missing.
    pub fn measure(
        &mut self,
        params: &BodyParams,
        model: &Solid,
        surface: &SegmentedSurface,
    ) -> Result<(&ShellGrid, &PatchDistances), GridError> {
        let grid = match &mut self.grid {
            Some(grid) => grid,
            none => none.insert(ShellGrid::new(params, model, self.room_mm)?),
        };
        let distances = self
            .distances
            .get_or_insert_with(|| PatchDistances::measure(grid, surface));
        Ok((grid, distances))
    }
}
