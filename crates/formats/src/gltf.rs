//! glTF 2.0: triangles of all nodes of the scene, moved as they say. Lines, points, skins, animations and
//! images are passed over; compressed and external data is refused by name.

mod document;

use std::borrow::Cow;

use base64::Engine as _;
use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::assembly::{Occurrence, Part, occurrences};
use super::polygons::divides;
use super::{Format, LabelSource, Labelling, Loaded, Place, ReadError};
use document::{Accessor, Buffer, Document, Node, Primitive};
use shellock_geom::{TriMesh, Vec3};

/// All lengths of glTF are metres.
const UNIT_MM: f64 = 1000.0;
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BINARY: u32 = 0x004E_4942;
/// Values of `mode` that give triangles.
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// Reads a glTF that is text.
pub(super) fn read_text(bytes: &[u8]) -> Result<Loaded, ReadError> {
    read(super::text::without_bom(bytes), None, Format::Gltf)
}

/// Reads a GLB: a header of 12 bytes, then chunks of length, kind and content; text first, then data.
pub(super) fn read_binary(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let word = |at: usize| {
        bytes
            .get(at..at + 4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    };
    if word(4) != Some(2) {
        return Err(ReadError::Unsupported {
            what: "a GLB file of another version than 2",
            at: Place::Byte(4),
        });
    }
    let (mut json, mut data, mut at) = (None, None, 12);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let end = at + 8 + length as usize;
        let content = bytes.get(at + 8..end);
        let content = content.ok_or(ReadError::CutOff {
            at: Place::Byte(bytes.len()),
            within: "a chunk",
        })?;
        match kind {
            CHUNK_JSON => json = json.or(Some(content)),
            CHUNK_BINARY => data = data.or(Some(content)),
            _ => {}
        }
        at = end;
    }
    let json = json.ok_or(ReadError::CutOff {
        at: Place::Byte(bytes.len()),
        within: "the header",
    })?;
    read(json, data, Format::Glb)
}

fn read(json: &[u8], data: Option<&[u8]>, format: Format) -> Result<Loaded, ReadError> {
    let document: Document = serde_json::from_slice(json).map_err(|e| error(e.to_string()))?;
    if let Some(name) = document
        .extensions_required
        .iter()
        .find(|name| name.contains("compression"))
    {
        return Err(error(format!(
            "its data is compressed ({name}); export it without compression"
        )));
    }
    let buffers = document
        .buffers
        .iter()
        .map(|b| buffer(b, data))
        .collect::<Result<Vec<_>, _>>()?;
    let reader = Reader {
        document: &document,
        buffers,
    };
    let parts = reader.parts()?;
    let found = occurrences(&parts, &reader.roots()?, "node", |(), ()| ())?;

    let mut mesh = TriMesh::default();
    let (mut material, mut object) = (Vec::new(), Vec::new());
    for (number, occurrence) in (0_i64..).zip(&found) {
        let of = document.nodes[occurrence.part].mesh.unwrap_or_default();
        for primitive in &document.meshes[of].primitives {
            reader.add_triangles(primitive, occurrence.placed, &mut mesh)?;
            material.resize(mesh.triangles.len(), primitive.material.map_or(-1, i64::from));
        }
        object.resize(mesh.triangles.len(), number);
    }
    if mesh.triangles.is_empty() {
        return Err(ReadError::NoTriangles {
            format,
            n_points: mesh.points.len(),
        });
    }
    let all = [(LabelSource::Material, material), (LabelSource::Object, object)];
    let labellings = all.into_iter().filter(|(_, labels)| divides(labels));
    Ok(Loaded {
        file_face: (0..mesh.triangles.len() as u32).collect(),
        labellings: labellings
            .map(|(source, labels)| Labelling { source, labels })
            .collect(),
        mesh,
        format,
        unit_mm: Some(UNIT_MM),
        unit_is_stated: false,
        objects: Vec::new(),
        cutters: Vec::new(),
        notes: vec!["in glTF y points up: give --up y".to_owned()],
    })
}

fn error(reason: impl Into<String>) -> ReadError {
    ReadError::Gltf {
        reason: reason.into(),
    }
}

fn missing(kind: &'static str, id: usize) -> ReadError {
    ReadError::MissingPart {
        kind,
        id: id.to_string(),
    }
}

/// The bytes of a buffer: in the file's binary chunk, or as base64 in its address.
fn buffer<'a>(buffer: &Buffer, data: Option<&'a [u8]>) -> Result<Cow<'a, [u8]>, ReadError> {
    let Some(uri) = &buffer.uri else {
        return Ok(Cow::Borrowed(data.unwrap_or_default()));
    };
    let Some((_, text)) = uri
        .strip_prefix("data:")
        .and_then(|rest| rest.split_once(";base64,"))
    else {
        let name: String = uri.chars().take(40).collect();
        return Err(error(format!("its data lies in another file, \"{name}\"")));
    };
    let decoded = base64::engine::general_purpose::STANDARD.decode(text);
    decoded
        .map(Cow::Owned)
        .map_err(|e| error(format!("its data is no base64 ({e})")))
}

struct Reader<'a> {
    document: &'a Document,
    buffers: Vec<Cow<'a, [u8]>>,
}

/// Numbers within a buffer.
struct Values<'a> {
    bytes: &'a [u8],
    stride: usize,
    component: Component,
    is_normalized: bool,
    count: usize,
}

#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn n_bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number at the beginning of `b`, and the greatest of its type.
    fn read(self, b: &[u8]) -> (f64, f64) {
        match self {
            Self::I8 => (f64::from(b[0] as i8), 127.0),
            Self::U8 => (f64::from(b[0]), 255.0),
            Self::I16 => (f64::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
            Self::U16 => (f64::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
            Self::U32 => (
                f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
                f64::from(u32::MAX),
            ),
            Self::F32 => (f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])), 1.0),
        }
    }
}

impl Values<'_> {
    fn get(&self, row: usize, column: usize) -> f64 {
        let at = row * self.stride + column * self.component.n_bytes();
        let (value, greatest) = self.component.read(&self.bytes[at..]);
        if self.is_normalized {
            (value / greatest).max(-1.0)
        } else {
            value
        }
    }
}

impl Reader<'_> {
    /// The nodes, with the triangles that their meshes have.
    fn parts(&self) -> Result<Vec<Part<()>>, ReadError> {
        let n_triangles = self.document.meshes.iter().map(|mesh| {
            mesh.primitives
                .iter()
                .try_fold(0_usize, |sum, p| Ok(sum.saturating_add(self.n_triangles(p)?)))
        });
        let n_triangles = n_triangles.collect::<Result<Vec<usize>, ReadError>>()?;
        let part = |(id, node): (usize, &Node)| {
            let own = node
                .mesh
                .map_or(Ok(&0), |m| n_triangles.get(m).ok_or_else(|| missing("mesh", m)))?;
            let children = node.children.iter().map(|&child| {
                let to = self
                    .document
                    .nodes
                    .get(child)
                    .ok_or_else(|| missing("node", child))?;
                Ok(in_place(child, to))
            });
            let children = children.collect::<Result<_, ReadError>>()?;
            Ok(Part {
                id: id.to_string(),
                n_triangles: *own,
                children,
            })
        };
        self.document.nodes.iter().enumerate().map(part).collect()
    }

    /// The nodes of the scene that is shown; all that are no child where there is none.
    fn roots(&self) -> Result<Vec<Occurrence<()>>, ReadError> {
        let nodes = &self.document.nodes;
        let shown = self.document.scenes.get(self.document.scene.unwrap_or_default());
        let roots = shown.map_or_else(
            || {
                let mut is_child = vec![false; nodes.len()];
                nodes
                    .iter()
                    .flat_map(|n| &n.children)
                    .for_each(|&c| is_child[c] = true);
                (0..nodes.len()).filter(|&n| !is_child[n]).collect()
            },
            |scene| scene.nodes.clone(),
        );
        let root = |n: usize| {
            nodes
                .get(n)
                .map(|node| in_place(n, node))
                .ok_or_else(|| missing("node", n))
        };
        roots.into_iter().map(root).collect()
    }

    /// How many triangles a primitive has, by its counts alone.
    fn n_triangles(&self, primitive: &Primitive) -> Result<usize, ReadError> {
        let accessor = |i: usize| {
            self.document
                .accessors
                .get(i)
                .ok_or_else(|| missing("accessor", i))
        };
        let Some(which) = primitive.indices.or(primitive.attributes.position) else {
            return Ok(0);
        };
        let n_corners = accessor(which)?.count;
        Ok(match primitive.mode.unwrap_or(TRIANGLES) {
            TRIANGLES => n_corners / 3,
            STRIP | FAN => n_corners.saturating_sub(2),
            _ => 0,
        })
    }

    /// Rows of `n_columns` numbers, all within their buffer.
    fn values(&self, which: usize, n_columns: usize, kind: &str) -> Result<Values<'_>, ReadError> {
        let accessor = self
            .document
            .accessors
            .get(which)
            .ok_or_else(|| missing("accessor", which))?;
        let Accessor {
            byte_offset,
            component_type,
            normalized,
            count,
            ..
        } = *accessor;
        if accessor.sparse.is_some() {
            return Err(error("its data is sparse"));
        }
        if accessor.kind != kind {
            return Err(error(format!("accessor {which} is not of type {kind}")));
        }
        let view = accessor
            .buffer_view
            .ok_or_else(|| error(format!("accessor {which} has no data")))?;
        let view = self
            .document
            .buffer_views
            .get(view)
            .ok_or_else(|| missing("buffer view", view))?;
        let buffer = self
            .buffers
            .get(view.buffer)
            .ok_or_else(|| missing("buffer", view.buffer))?;
        let component = Component::of(component_type).ok_or_else(|| error("a type of number is unknown"))?;
        let row_bytes = n_columns * component.n_bytes();
        let stride = view.byte_stride.unwrap_or(row_bytes).max(row_bytes);
        let needed = count
            .checked_sub(1)
            .map_or(Some(0), |n| n.checked_mul(stride)?.checked_add(row_bytes));
        let end = view.byte_offset.checked_add(view.byte_length);
        let bytes = end
            .and_then(|end| buffer.get(view.byte_offset..end))
            .and_then(|b| b.get(byte_offset..));
        match (bytes, needed) {
            (Some(bytes), Some(needed)) if bytes.len() >= needed => Ok(Values {
                bytes,
                stride,
                component,
                is_normalized: normalized,
                count,
            }),
            _ => Err(error(format!(
                "accessor {which} reaches beyond its data; the file was cut off"
            ))),
        }
    }

    fn add_triangles(
        &self,
        primitive: &Primitive,
        placed: DAffine3,
        mesh: &mut TriMesh,
    ) -> Result<(), ReadError> {
        let (Some(position), 1..) = (primitive.attributes.position, self.n_triangles(primitive)?) else {
            return Ok(());
        };
        let points = self.values(position, 3, "VEC3")?;
        let too_large = || ReadError::TooLarge { at: Place::Byte(0) };
        let first = u32::try_from(mesh.points.len()).map_err(|_| too_large())?;
        for row in 0..points.count {
            let point =
                placed.transform_point3(Vec3::from_array([0, 1, 2].map(|axis| points.get(row, axis))));
            if !point.is_finite() {
                return Err(error(format!(
                    "point {row} of accessor {position} is not a finite number"
                )));
            }
            mesh.points.push(point);
        }
        u32::try_from(mesh.points.len()).map_err(|_| too_large())?;
        let indices = primitive
            .indices
            .map(|i| self.values(i, 1, "SCALAR"))
            .transpose()?;
        let n_corners = indices.as_ref().map_or(points.count, |i| i.count);
        let corner = |i: usize| {
            let index = indices.as_ref().map_or(i, |values| values.get(i, 0) as usize);
            if index < points.count {
                Ok(first + index as u32)
            } else {
                Err(error(format!(
                    "a triangle uses point {index} of {}",
                    points.count
                )))
            }
        };
        let is_mirror = placed.matrix3.determinant() < 0.0;
        let mut add = |corners: [usize; 3]| -> Result<(), ReadError> {
            let [a, b, c] = corners.map(corner);
            let (a, b, c) = (a?, b?, c?);
            mesh.triangles.push(if is_mirror { [a, c, b] } else { [a, b, c] });
            Ok(())
        };
        match primitive.mode.unwrap_or(TRIANGLES) {
            STRIP => (2..n_corners).try_for_each(|i| {
                add(if i % 2 == 0 {
                    [i - 2, i - 1, i]
                } else {
                    [i - 1, i - 2, i]
                })
            }),
            FAN => (2..n_corners).try_for_each(|i| add([0, i - 1, i])),
            _ => (0..n_corners / 3).try_for_each(|i| add([3 * i, 3 * i + 1, 3 * i + 2])),
        }
    }
}

/// A node in its place within its parent.
fn in_place(part: usize, node: &Node) -> Occurrence<()> {
    Occurrence {
        part,
        placed: placed(node),
        said: (),
    }
}

/// Where a node stands within its parent.
fn placed(node: &Node) -> DAffine3 {
    match node.matrix {
        Some(columns) => DAffine3::from_mat4(DMat4::from_cols_array(&columns)),
        None => DAffine3::from_scale_rotation_translation(
            node.scale.map_or(DVec3::ONE, DVec3::from_array),
            node.rotation.map_or(DQuat::IDENTITY, DQuat::from_array),
            node.translation.map_or(DVec3::ZERO, DVec3::from_array),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::super::read_mesh;
    use super::*;

    /// Points of a tetrahedron as floats, then its corners as bytes.
    fn data() -> Vec<u8> {
        let points = [
            [0.0_f32, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let mut data: Vec<u8> = points
            .as_flattened()
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        data.extend([0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]);
        data
    }

    fn json(nodes: &str, buffer: &str) -> String {
        format!(
            r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": {nodes},
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0, "NORMAL": 7 }}, "indices": 1, "material": 3 }}] }}],
            "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" }},
                          {{ "bufferView": 0, "byteOffset": 48, "componentType": 5121, "count": 12, "type": "SCALAR" }}],
            "bufferViews": [{{ "buffer": 0, "byteLength": 60 }}], "buffers": [{{ "byteLength": 60{buffer} }}] }}"#
        )
    }

    fn embedded(nodes: &str) -> String {
        let text = base64::engine::general_purpose::STANDARD.encode(data());
        json(
            nodes,
            &format!(r#", "uri": "data:application/octet-stream;base64,{text}""#),
        )
    }

    fn binary(json: &str) -> Vec<u8> {
        let (mut json, mut data) = (json.as_bytes().to_vec(), data());
        json.resize(json.len().next_multiple_of(4), b' ');
        data.resize(data.len().next_multiple_of(4), 0);
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        bytes.extend((28 + json.len() as u32 + data.len() as u32).to_le_bytes());
        for (kind, chunk) in [(CHUNK_JSON, &json), (CHUNK_BINARY, &data)] {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(chunk);
        }
        bytes
    }

    const NESTED: &str = r#"[{ "children": [1, 2], "scale": [2, 2, 2] }, { "mesh": 0, "translation": [5, 0, 0] },
        { "mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] }]"#;

    #[test]
    fn nodes_move_their_meshes_and_mirrors_keep_the_inside_inside() {
        let text = read_mesh(embedded(NESTED).as_bytes(), None).unwrap();
        assert_eq!((text.mesh.triangles.len(), text.unit_mm), (8, Some(1000.0)));
        assert_eq!(text.mesh.points[1], Vec3::new(12.0, 0.0, 0.0));
        assert_eq!(text.mesh.points[5], Vec3::new(-2.0, 0.0, 0.0));
        assert!((text.mesh.signed_volume() - 16.0 / 6.0).abs() < 1e-12);
        assert_eq!(text.labels(LabelSource::Object).unwrap()[3..5], [0, 1]);
        let loaded = read_mesh(&binary(&json(NESTED, "")), Some("stl")).unwrap();
        assert_eq!((loaded.format, &loaded.mesh), (Format::Glb, &text.mesh));
    }

    #[test]
    fn strips_and_fans_are_triangles_too() {
        // Corners 0 2 1 0 1 3 …: as a strip, every other triangle turned.
        for (mode, second) in [(5, [1, 2, 0]), (6, [0, 1, 0])] {
            let text = embedded(r#"[{ "mesh": 0 }]"#)
                .replace(r#""indices""#, &format!(r#""mode": {mode}, "indices""#));
            let mesh = read_mesh(text.as_bytes(), None).unwrap().mesh;
            assert_eq!(
                (mesh.triangles.len(), mesh.triangles[0], mesh.triangles[1]),
                (10, [0, 2, 1], second)
            );
        }
    }

    #[test]
    fn what_is_missing_too_long_or_cyclic_is_refused() {
        let plain = embedded(r#"[{ "mesh": 0 }]"#);
        let refused = |from: &str, to: &str| {
            read_mesh(plain.replace(from, to).as_bytes(), None)
                .expect_err("it is broken")
                .to_string()
        };
        assert!(refused(r#""count": 4"#, r#""count": 400000000000"#).contains("beyond its data"));
        assert!(refused(r#""count": 12"#, r#""count": 18446744073709551615"#).contains("more than"));
        assert!(refused(r#""byteLength": 60 }]"#, r#""byteLength": 50 }]"#).contains("beyond its data"));
        assert!(refused(r#"[{ "mesh": 0 }]"#, r#"[{ "mesh": 4 }]"#).contains("mesh 4"));
        assert!(
            refused(r#"[{ "mesh": 0 }]"#, r#"[{ "mesh": 0, "children": [0] }]"#)
                .contains("node 0 contains itself")
        );
        assert!(refused("data:application", "model.bin?data:").contains("another file"));
        assert!(
            refused(
                r#""scene": 0"#,
                r#""extensionsRequired": ["KHR_draco_mesh_compression"]"#
            )
            .contains("draco")
        );
        assert!(refused("asset", "as\"set").contains("glTF"));
        let glb = binary(&json(NESTED, ""));
        assert!(matches!(
            read_mesh(&glb[..glb.len() - 5], None),
            Err(ReadError::CutOff { .. })
        ));
        assert!(matches!(
            read_mesh(b"glTF\x01\0\0\0abcd", None),
            Err(ReadError::Unsupported { .. })
        ));
    }
}
