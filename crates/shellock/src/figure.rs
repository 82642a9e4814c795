//! Closed models made by code, for the demo, the tests and the measurements: nothing has to be downloaded.
//!
//! Each figure is a smooth union of ellipsoids, rounded cones and rings (module `form`), stands on z = 0 and
//! looks along −y. All are drawn 150 units high or wide with nothing thinner than 9 units, so that at 150 mm
//! there is room for a wall of 2 mm with connectors.

mod animals;
mod form;
mod things;

use shellock_geom::contour::contour;
use shellock_geom::{Solid, Vec3};

use form::Sculpture;

/// A model that [`make`] can make.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Figure {
    /// A squirrel with an acorn and a large curled tail: the demo.
    Squirrel,
    /// A sitting cat.
    Cat,
    /// A teddy bear that sits with its arms open.
    Teddy,
    /// An octopus on eight curled arms.
    Octopus,
    /// A small long-necked dinosaur on four legs.
    Dinosaur,
    /// A ribbed vase, solid.
    Vase,
    /// A torus that lies on its side, cut flat: genus 1.
    Torus,
    /// A fish whose tail hangs on a narrow neck.
    Fish,
    /// A body with six round arms of 12 to 40 units: a test of what narrow necks hold.
    Arms,
}

impl Figure {
    /// All of them, the demo first.
    pub const ALL: [Self; 9] = [
        Self::Squirrel,
        Self::Cat,
        Self::Teddy,
        Self::Octopus,
        Self::Dinosaur,
        Self::Vase,
        Self::Torus,
        Self::Fish,
        Self::Arms,
    ];

    /// Lower-case name, as a file would have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Squirrel => "squirrel",
            Self::Cat => "cat",
            Self::Teddy => "teddy",
            Self::Octopus => "octopus",
            Self::Dinosaur => "dinosaur",
            Self::Vase => "vase",
            Self::Torus => "torus",
            Self::Fish => "fish",
            Self::Arms => "arms",
        }
    }

    /// The figure with this [`name`](Self::name).
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.name() == name)
    }

    fn sculpture(self) -> Sculpture {
        match self {
            Self::Squirrel => animals::squirrel(),
            Self::Cat => animals::cat(),
            Self::Teddy => animals::teddy(),
            Self::Octopus => animals::octopus(),
            Self::Dinosaur => animals::dinosaur(),
            Self::Vase => things::vase(),
            Self::Torus => things::torus(),
            Self::Fish => animals::fish(),
            Self::Arms => things::arms(),
        }
    }
}

/// `figure` with its longest side `size_mm` long, standing on z = 0, with triangles of about `cell_mm`.
///
/// The same bytes each time. At 150 mm a cell of 1.5 mm gives about 50 000 triangles; time grows with `(size
/// / cell)³`.
///
/// # Panics
///
/// Where the cell is larger than about a tenth of the size, so that nothing is left of the figure.
pub fn make(figure: Figure, size_mm: f64, cell_mm: f64) -> Solid {
    make_with_limbs(figure, size_mm, cell_mm).0
}

/// As [`make`], with the limb that each triangle is on: 0 is the trunk. All are 0 where a figure is not made
/// of limbs.
///
/// # Panics
///
/// As [`make`].
pub fn make_with_limbs(figure: Figure, size_mm: f64, cell_mm: f64) -> (Solid, Vec<u32>) {
    let sculpture = figure.sculpture();
    let bounds = sculpture.bounds();
    let units_from_mm = bounds.size().max_element() / size_mm;
    let mut mesh = contour(bounds, cell_mm * units_from_mm, |p| sculpture.value(p));
    let middle = |f: usize| mesh.corners(f).into_iter().sum::<Vec3>() / 3.0;
    let limbs = match sculpture.n_limbs() {
        1 => vec![0; mesh.triangles.len()],
        _ => (0..mesh.triangles.len())
            .map(|f| sculpture.limb_at(middle(f)))
            .collect(),
    };
    // Boxes of ellipsoids are not tight: scale by what came out.
    let made = mesh.bounds();
    let mm_from_units = size_mm / made.size().max_element();
    let foot = Vec3::new(made.center().x, made.center().y, 0.0);
    for p in &mut mesh.points {
        *p = (*p - foot) * mm_from_units;
        // Newton steps end a rounding error beside the plane.
        if p.z.abs() < 1e-6 * size_mm {
            p.z = 0.0;
        }
    }
    (
        Solid::new(mesh).expect("contours are closed; the cell is small against the figure"),
        limbs,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_single_solids_that_stand_flat() {
        for figure in Figure::ALL {
            let solid = make(figure, 150.0, 4.0);
            let mesh = solid.mesh();
            assert_eq!(n_components(mesh), 1, "{figure:?}");
            assert!((mesh.bounds().size().max_element() - 150.0).abs() < 1e-9);
            assert_eq!(mesh.bounds().min.z, 0.0, "{figure:?}");
            let on_floor = |f: &usize| mesh.corners(*f).iter().all(|p| p.z == 0.0);
            let flat_mm2: f64 = (0..mesh.triangles.len())
                .filter(on_floor)
                .map(|f| mesh.face_area(f))
                .sum();
            assert!(flat_mm2 > 300.0, "{figure:?} stands on {flat_mm2} mm²");
            assert_eq!(Figure::named(figure.name()), Some(figure));
        }
    }

    #[test]
    fn each_limb_of_a_figure_hangs_on_its_trunk() {
        for (figure, n_limbs) in [(Figure::Fish, 3), (Figure::Arms, 7), (Figure::Teddy, 1)] {
            let (solid, limbs) = make_with_limbs(figure, 150.0, 3.0);
            assert_eq!(limbs.len(), solid.mesh().triangles.len());
            let names: std::collections::BTreeSet<u32> = limbs.iter().copied().collect();
            assert_eq!(
                names.into_iter().collect::<Vec<_>>(),
                (0..n_limbs).collect::<Vec<_>>(),
                "{figure:?}"
            );
        }
    }

    #[test]
    fn the_same_figure_comes_out_each_time() {
        assert_eq!(
            make(Figure::Squirrel, 150.0, 6.0),
            make(Figure::Squirrel, 150.0, 6.0)
        );
    }

    fn n_components(mesh: &shellock_geom::TriMesh) -> usize {
        let mut parent: Vec<u32> = (0..mesh.points.len() as u32).collect();
        fn root(parent: &mut [u32], mut v: u32) -> u32 {
            while parent[v as usize] != v {
                parent[v as usize] = parent[parent[v as usize] as usize];
                v = parent[v as usize];
            }
            v
        }
        for t in &mesh.triangles {
            for &v in &t[1..] {
                let (a, b) = (root(&mut parent, t[0]), root(&mut parent, v));
                parent[a as usize] = b;
            }
        }
        (0..parent.len() as u32)
            .filter(|&v| parent[v as usize] == v)
            .count()
    }
}
