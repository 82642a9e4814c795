//! PLY: points, polygons or strips, with an integer label or a colour per face, and a colour per point.
//! Everything else is skipped.
//!
//! A file is a text header that declares elements (`vertex`, `face`, others) with their properties, then the
//! values of all elements in order, as words or as bytes.

mod header;
mod source;

use super::point_colors::{self, Channels};
use super::polygons::{Numbering, Polygons};
use super::text::whole_of;
use super::{Format, LabelSource, Loaded, ReadError};
use header::{Element, Encoding, Header, Kind, Scalar};
use shellock_geom::TriMesh;
use source::{Binary, Source, Words};

/// Names that programs use for the label of a face. If a file has several, the first in this list counts.
const LABEL_NAMES: [&str; 17] = [
    "label",
    "labels",
    "face_label",
    "segment",
    "segments",
    "segment_id",
    "segmentation",
    "seg",
    "patch",
    "patch_id",
    "region",
    "region_id",
    "part",
    "part_id",
    "object_id",
    "group",
    "group_id",
];

/// Names of colour channels; alpha may be missing. The first row whose red, green and blue all exist counts.
const COLOR_NAMES: [[&str; 4]; 3] = [
    ["red", "green", "blue", "alpha"],
    ["diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"],
    ["r", "g", "b", "a"],
];

/// Reads a PLY of any encoding.
pub(super) fn read(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let (header, lines) = Header::read(bytes)?;
    header.check_counts(lines.rest().len(), lines.place())?;
    let body_at = bytes.len() - lines.rest().len();
    match header.encoding {
        Encoding::Ascii => read_body(&header, Words::of(lines)),
        Encoding::Binary { big_endian } => read_body(
            &header,
            Binary {
                bytes,
                at: body_at,
                big_endian,
            },
        ),
    }
}

fn read_body(header: &Header, mut source: impl Source) -> Result<Loaded, ReadError> {
    let mut polygons = Polygons::counted_from(0);
    let mut labels = FaceLabels::default();
    let mut colors = Channels::default();
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => colors = read_points(element, &mut source, &mut polygons)?,
            "face" => labels = read_faces(element, &mut source, &mut polygons)?,
            "tristrips" => read_strips(element, &mut source, &mut polygons)?,
            // Rows without properties take no bytes, so the file size does not bound their count.
            _ if element.properties.is_empty() => {}
            _ => {
                for _ in 0..element.count {
                    element
                        .properties
                        .iter()
                        .try_for_each(|p| skip(p.kind, &mut source))?;
                }
            }
        }
    }
    // Strips have no labels; combined with labelled faces, they would be labelled by chance.
    let mut found = labels.layers;
    found.retain(|(_, labels)| labels.len() == polygons.n_faces());
    let mut loaded = polygons.finish(Format::Ply, found)?;
    loaded.notes.extend(labels.note);
    if header.has_texture {
        loaded.notes.push("the file's texture is not used".to_owned());
    }
    point_colors::divide(&mut loaded, &colors.colors());
    Ok(loaded)
}

/// Properties of the channels of a colour; `None` if red, green or blue is missing.
fn color_properties(element: &Element) -> Option<[Option<usize>; 4]> {
    let found = COLOR_NAMES.map(|names| names.map(|name| find_scalar(element, name)));
    found
        .into_iter()
        .find(|channels| channels[..3].iter().all(Option::is_some))
}

/// Finds the scalar property called `name`.
fn find_scalar(element: &Element, name: &str) -> Option<usize> {
    let mut properties = element.properties.iter();
    properties.position(|p| p.name == name && matches!(p.kind, Kind::Scalar(_)))
}

/// Labels of the faces, and a note about them for the user.
#[derive(Default)]
struct FaceLabels {
    layers: Vec<(LabelSource, Vec<i64>)>,
    note: Option<String>,
}

/// Adds the points. Returns their colours, empty if they have none.
fn read_points(
    element: &Element,
    source: &mut impl Source,
    polygons: &mut Polygons,
) -> Result<Channels, ReadError> {
    for name in ["x", "y", "z"] {
        if find_scalar(element, name).is_none() {
            return Err(ReadError::Unsupported {
                what: "a PLY file whose points lack x, y or z",
                at: element.at,
            });
        }
    }
    let axis_of = |name: &str| ["x", "y", "z"].iter().position(|&axis| axis == name);
    let channels = color_properties(element);
    let channel_of = |i: usize| channels?.iter().position(|&property| property == Some(i));
    let columns: Vec<_> = (0..)
        .zip(&element.properties)
        .map(|(i, p)| (p.kind, axis_of(&p.name), channel_of(i)))
        .collect();
    let mut colors = Channels {
        rows: Vec::new(),
        are_whole: columns.iter().any(|(kind, _, channel)| {
            channel.is_some() && !matches!(kind, Kind::Scalar(Scalar::F32 | Scalar::F64))
        }),
    };
    polygons.reserve(element.count, 0);
    for _ in 0..element.count {
        let at = source.place();
        let (mut coordinates, mut color) = ([0.0; 3], [0.0; 4]);
        for &(kind, axis, channel) in &columns {
            match (kind, axis, channel) {
                (Kind::Scalar(scalar), Some(axis), _) => coordinates[axis] = source.next(scalar)?,
                (Kind::Scalar(scalar), _, Some(channel)) => color[channel] = source.next(scalar)? as f32,
                _ => skip(kind, source)?,
            }
        }
        polygons.add_point(coordinates, at)?;
        if channels.is_some() {
            colors.rows.push(color);
        }
    }
    Ok(colors)
}

/// Adds the polygons. Returns their labels from a property with a known name, and a number for each colour.
fn read_faces(
    element: &Element,
    source: &mut impl Source,
    polygons: &mut Polygons,
) -> Result<FaceLabels, ReadError> {
    let corners_property = corners_property(element, "a PLY file whose faces lack vertex_indices")?;
    let label_property = LABEL_NAMES.iter().find_map(|name| find_scalar(element, name));
    let channels = color_properties(element);
    let channel_of = |i: usize| channels?.iter().position(|&property| property == Some(i));

    polygons.reserve(0, element.count);
    let (mut labels, mut colors, mut numbering) = (Vec::new(), Vec::new(), Numbering::default());
    let mut corners = Vec::new();
    for _ in 0..element.count {
        let at = source.place();
        corners.clear();
        let mut color = [0_u64; 4];
        for (i, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::List { count, item } if i == corners_property => {
                    for _ in 0..whole(source, count)? {
                        corners.push(polygons.corner(whole(source, item)?, at)?);
                    }
                }
                Kind::Scalar(scalar) if Some(i) == label_property => {
                    labels.push(whole_of(source.next(scalar)?));
                }
                kind @ Kind::Scalar(scalar) => match channel_of(i) {
                    Some(channel) => color[channel] = source.next(scalar)?.to_bits(),
                    None => skip(kind, source)?,
                },
                kind => skip(kind, source)?,
            }
        }
        polygons.add_polygon(&corners, at)?;
        if channels.is_some() {
            colors.push(numbering.number(color));
        }
    }
    let (mut found, mut note) = (Vec::new(), None);
    if let Some(property) = label_property {
        let whole: Option<Vec<i64>> = labels.into_iter().collect();
        note = label_note(&element.properties[property].name, whole.as_deref());
        found.extend(whole.map(|labels| (LabelSource::Property, labels)));
    }
    found.extend(channels.map(|_| (LabelSource::Color, colors)));
    Ok(FaceLabels { layers: found, note })
}

/// Note on unusual labels of a property. `labels` is `None` if some are no whole numbers.
fn label_note(name: &str, labels: Option<&[i64]>) -> Option<String> {
    let Some(labels) = labels else {
        return Some(format!(
            "the faces have a {name:?}, but not all are whole numbers; it cannot define pieces"
        ));
    };
    let n_below = labels.iter().filter(|label| **label < 0).count();
    (n_below > 0).then(|| {
        format!(
            "{n_below} of {} faces have a {name:?} below 0, which means no label in some programs; these \
             faces become a separate piece, or one piece for each place",
            labels.len()
        )
    })
}

fn corners_property(element: &Element, lacking: &'static str) -> Result<usize, ReadError> {
    let is_corners = |name: &str| name == "vertex_indices" || name == "vertex_index";
    let found = element
        .properties
        .iter()
        .position(|p| is_corners(&p.name) && matches!(p.kind, Kind::List { .. }));
    found.ok_or(ReadError::Unsupported {
        what: lacking,
        at: element.at,
    })
}

/// Adds strips of triangles, as in scans. Each point makes a triangle with the two before it, with
/// alternating orientation; −1 starts a new strip.
fn read_strips(
    element: &Element,
    source: &mut impl Source,
    polygons: &mut Polygons,
) -> Result<(), ReadError> {
    let corners_property = corners_property(element, "a PLY file whose strips lack vertex_indices")?;
    for _ in 0..element.count {
        for (i, property) in element.properties.iter().enumerate() {
            let Kind::List { count, item } = property.kind else {
                skip(property.kind, source)?;
                continue;
            };
            if i != corners_property {
                skip(property.kind, source)?;
                continue;
            }
            let (mut strip, mut n_before) = ([0; 2], 0_usize);
            for _ in 0..whole(source, count)? {
                let at = source.place();
                let index = whole(source, item)?;
                if index == -1 {
                    n_before = 0;
                    continue;
                }
                let corner = polygons.corner(index, at)?;
                let [a, b] = strip;
                // Strips repeat a point to turn a corner, so triangles without area do not count.
                if n_before >= 2 && a != b && b != corner && corner != a {
                    let triangle = if n_before.is_multiple_of(2) {
                        [a, b, corner]
                    } else {
                        [b, a, corner]
                    };
                    polygons.add_polygon(&triangle, at)?;
                }
                (strip, n_before) = ([b, corner], n_before + 1);
            }
        }
    }
    Ok(())
}

fn skip(kind: Kind, source: &mut impl Source) -> Result<(), ReadError> {
    match kind {
        Kind::Scalar(scalar) => source.next(scalar).map(|_| ()),
        Kind::List { count, item } => {
            // The source ends before a wrong count does harm: each item takes bytes.
            (0..whole(source, count)?).try_for_each(|_| source.next(item).map(|_| ()))
        }
    }
}

fn whole(source: &mut impl Source, scalar: Scalar) -> Result<i64, ReadError> {
    let at = source.place();
    let value = source.next(scalar)?;
    whole_of(value).ok_or_else(|| ReadError::Malformed {
        at,
        syntax: "a whole number",
        text: value.to_string(),
    })
}

/// Writes a binary little-endian PLY with coordinates as `double` and, if given, one `label` per triangle.
///
/// # Panics
///
/// Panics if `face_labels` and the triangles differ in number.
pub fn write_ply(mesh: &TriMesh, face_labels: Option<&[i32]>) -> Vec<u8> {
    assert!(
        face_labels.is_none_or(|labels| labels.len() == mesh.triangles.len()),
        "one label for each triangle"
    );
    let label_line = if face_labels.is_some() {
        "property int label\n"
    } else {
        ""
    };
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment written by shellock\nelement vertex {}\nproperty \
         double x\nproperty double y\nproperty double z\nelement face {}\nproperty list uchar uint \
         vertex_indices\n{label_line}end_header\n",
        mesh.points.len(),
        mesh.triangles.len(),
    );
    let mut bytes = header.into_bytes();
    bytes.reserve(24 * mesh.points.len() + 17 * mesh.triangles.len());
    for point in &mesh.points {
        point
            .to_array()
            .iter()
            .for_each(|x| bytes.extend_from_slice(&x.to_le_bytes()));
    }
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        bytes.push(3);
        triangle
            .iter()
            .for_each(|corner| bytes.extend_from_slice(&corner.to_le_bytes()));
        if let Some(labels) = face_labels {
            bytes.extend_from_slice(&labels[face].to_le_bytes());
        }
    }
    bytes
}
