//! Negative volumes: parts that the file declares to be cut out of an object are cut out.

use std::collections::BTreeMap;

use super::select::list_names;
use super::{Cutter, Loaded, ReadError};
use shellock_geom::TriMesh;
use shellock_geom::repair::{CutError, CutFace, cut_out};

/// Cuts all of `loaded.cutters` out of their objects.
///
/// New surfaces of a cut count as faces of the file, as they come from the cutter's faces, and follow all
/// others. Their labels are those of the nearest face of the object.
pub(super) fn carve(mut loaded: Loaded) -> Result<Loaded, ReadError> {
    let mut cutters: BTreeMap<u32, Vec<Cutter>> = BTreeMap::new();
    for cutter in std::mem::take(&mut loaded.cutters) {
        cutters.entry(cutter.item).or_default().push(cutter);
    }
    for (item, cutters) in cutters {
        loaded = carve_item(loaded, item, &cutters)?;
    }
    Ok(loaded)
}

/// A triangle after a cut.
struct Made {
    corners: [u32; 3],
    file_face: u32,
    /// Index of the triangle before the cut from which it takes its labels.
    like: usize,
}

fn carve_item(mut loaded: Loaded, item: u32, cutters: &[Cutter]) -> Result<Loaded, ReadError> {
    let object_of = loaded.object_of_triangle();
    let is_own = |face: usize| loaded.objects[object_of[face]].item == item;
    let (own, others): (Vec<usize>, Vec<usize>) =
        (0..loaded.mesh.triangles.len()).partition(|&face| is_own(face));
    let Some(&first) = own.first() else {
        return Ok(loaded);
    };
    let body = TriMesh {
        points: loaded.mesh.points.clone(),
        triangles: own.iter().map(|&face| loaded.mesh.triangles[face]).collect(),
    }
    .without_unused_points();
    let meshes: Vec<&TriMesh> = cutters.iter().map(|cutter| &cutter.mesh).collect();
    let title = loaded.objects[object_of[first]].title();
    let cut = cut_out(&body, &meshes).map_err(|error| refusal(&error, &title, cutters))?;
    for (place, cutter) in cutters.iter().enumerate() {
        let name = &cutter.name;
        loaded.notes.push(match (cut.is_met[place], cut.was_open[place]) {
            (true, false) => format!("cut out as a negative volume: {name}"),
            (true, true) => {
                format!("cut out as a negative volume: {name}; holes in its surface were closed first")
            }
            (false, _) => format!("the negative volume {name} does not meet {title}: nothing is cut out"),
        });
    }
    let n_faces = loaded.n_file_faces() as u32;
    let n_points = loaded.mesh.points.len() as u32;
    let begins = first_faces(n_faces, &meshes);
    let kept = others.iter().map(|&face| Made {
        corners: loaded.mesh.triangles[face],
        file_face: loaded.file_face[face],
        like: face,
    });
    let cut_faces = cut
        .mesh
        .triangles
        .iter()
        .zip(&cut.faces)
        .map(|(corners, face)| Made {
            corners: corners.map(|v| v + n_points),
            file_face: match face {
                CutFace::Body(_) => loaded.file_face[own[face.nearest()]],
                CutFace::Cutter { cutter, face, .. } => begins[*cutter] + *face as u32,
            },
            like: own[face.nearest()],
        });
    let mut made: Vec<Made> = kept.chain(cut_faces).collect();
    made.sort_by_key(|m| m.file_face);
    for labelling in &mut loaded.labellings {
        labelling.labels = made.iter().map(|m| labelling.labels[m.like]).collect();
    }
    loaded.mesh.points.extend(cut.mesh.points);
    loaded.mesh.triangles = made.iter().map(|m| m.corners).collect();
    loaded.mesh = loaded.mesh.without_unused_points();
    loaded.file_face = made.iter().map(|m| m.file_face).collect();
    Ok(loaded)
}

/// Why nothing can be cut out of the object called `title`.
fn refusal(error: &CutError, title: &str, cutters: &[Cutter]) -> ReadError {
    let reason = error.to_string();
    match *error {
        CutError::Cutter(place, _) => ReadError::Cut {
            name: cutters[place].name.clone(),
            reason,
        },
        CutError::Body(_) => ReadError::CutBody {
            object: title.to_owned(),
            reason,
        },
        CutError::NothingLeft => ReadError::NothingLeft {
            object: title.to_owned(),
            cutters: list_names(cutters.iter().map(|cutter| &cutter.name)),
        },
    }
}

/// The number of each cutter's first face among those of the file, of which there are `n_faces` so far.
fn first_faces(n_faces: u32, cutters: &[&TriMesh]) -> Vec<u32> {
    cutters
        .iter()
        .scan(n_faces, |next, cutter| {
            let first = *next;
            *next += cutter.triangles.len() as u32;
            Some(first)
        })
        .collect()
}
