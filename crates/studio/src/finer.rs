//! Refines the triangles of a coarse model so that it can be painted on; the shape stays the same.
//!
//! A kit has one label a triangle of its model's file, so a brush cannot be finer than those triangles.

use shellock_formats::{LabelSource, Loaded, write_ply};
use shellock_geom::repair::{RepairMode, repair};
use shellock_geom::subdivide::halve_edges;
use shellock_geom::{Solid, Topology};
use shellock_job::input::{MANY_TRIANGLES, is_usual};

/// Longest edge after refinement, as a share of the model's diagonal: 3 to 4 mm on a figure of 150 mm.
const LONGEST_SHARE: f64 = 1.0 / 60.0;
/// Multiple of the longest edge above which an edge is too long for painting.
const COARSE: f64 = 2.0;
/// Share of the surface in triangles with such edges from which the model is refined.
const LEAST_COARSE: f64 = 0.15;
/// Number of triangles at which halving ends: with four times as many, a model is still shown unsimplified.
const MANY: usize = MANY_TRIANGLES / 4;
/// Ending of the name of a refined file.
const ENDING: &str = "-fine.ply";

/// Note on a refined model, for the page; `None` for other files.
pub fn note(file: &str) -> Option<String> {
    file.ends_with(ENDING).then(|| {
        "its large triangles were subdivided so that they can be painted on; its shape is unchanged"
            .to_owned()
    })
}

/// Name and bytes of a file with finer triangles. `None` if the triangles of `loaded` are fine enough, if its
/// surface needs repair, or if the new file could not keep its labels or its size.
pub fn finer(name: &str, loaded: &Loaded) -> Option<(String, Vec<u8>)> {
    let keeps_all = loaded
        .labellings
        .iter()
        .all(|l| matches!(l.source, LabelSource::Property | LabelSource::Paint));
    let longest_mm = loaded.unit_mm.unwrap_or(1.0) * loaded.bounds().size().max_element();
    // A size that relies on the file's own unit alone would be lost, too.
    let keeps_size = !loaded.has_unit || is_usual(longest_mm);
    if !keeps_all || !keeps_size || !is_coarse(loaded) {
        return None;
    }
    let sound = repair(&loaded.mesh, RepairMode::Refuse).ok()?;
    let (solid, source) = halve_long_edges(sound.solid);
    let labels = loaded.face_labels().map(|labels| {
        let of = |&face: &u32| i32::try_from(labels[sound.source_face[face as usize] as usize]);
        source.iter().map(of).collect::<Result<Vec<i32>, _>>()
    });
    let labels = labels.transpose().ok()?;
    let mut mesh = solid.into_mesh();
    let scale = loaded.unit_mm.unwrap_or(1.0);
    mesh.points.iter_mut().for_each(|p| *p *= scale);
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    Some((format!("{stem}{ENDING}"), write_ply(&mesh, labels.as_deref())))
}

fn is_coarse(loaded: &Loaded) -> bool {
    let mesh = &loaded.mesh;
    let limit = COARSE * LONGEST_SHARE * mesh.bounds().size().length();
    let longest = |t: &[u32; 3]| {
        let p = t.map(|v| mesh.points[v as usize]);
        p[0].distance(p[1])
            .max(p[1].distance(p[2]))
            .max(p[2].distance(p[0]))
    };
    let coarse = (0..mesh.triangles.len()).filter(|&f| longest(&mesh.triangles[f]) > limit);
    coarse.map(|f| mesh.face_area(f)).sum::<f64>() > LEAST_COARSE * mesh.area()
}

/// Halves long edges until there are none or [`MANY`] triangles; also returns the original triangle of each.
fn halve_long_edges(mut solid: Solid) -> (Solid, Vec<u32>) {
    let longest = LONGEST_SHARE * solid.mesh().bounds().size().length();
    let mut source: Vec<u32> = (0..solid.mesh().triangles.len() as u32).collect();
    while solid.mesh().triangles.len() < MANY {
        let points = solid.mesh().points.clone();
        let is_long = |a: u32, b: u32| points[a as usize].distance(points[b as usize]) > longest;
        let (finer, of) = halve_edges(&solid, &Topology::new(&solid), is_long);
        if finer.mesh().triangles.len() == solid.mesh().triangles.len() {
            break;
        }
        source = of.iter().map(|&f| source[f as usize]).collect();
        solid = finer;
    }
    (solid, source)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shellock_formats::{read_mesh, write_stl_binary};
    use shellock_testkit::shapes::{cuboid, rounded_mesh, torus};

    fn load(bytes: &[u8], extension: &str) -> Loaded {
        read_mesh(bytes, Some(extension)).expect("it is a mesh")
    }

    #[test]
    fn a_box_of_twelve_triangles_can_be_painted_afterwards_and_is_the_same_box() {
        let stl = load(
            &write_stl_binary(&rounded_mesh(&cuboid([0.0; 3], [60.0, 40.0, 30.0]))),
            "stl",
        );
        let (name, bytes) = finer("box.stl", &stl).expect("its triangles are large");
        assert_eq!(name, "box-fine.ply");
        let fine = load(&bytes, "ply");
        assert!(fine.mesh.triangles.len() > 5_000);
        assert!(!is_coarse(&fine), "once is enough");
        let solid = Solid::new(fine.mesh).expect("closed");
        assert!((solid.volume() - 60.0 * 40.0 * 30.0).abs() < 1e-6);
    }

    #[test]
    fn a_model_of_small_triangles_stays_as_it_is() {
        let stl = load(&write_stl_binary(&torus(30.0, 10.0, [120, 60])), "stl");
        assert!(finer("ring.stl", &stl).is_none());
    }
}
