//! Handmade files: a tetrahedron in many variants.

mod hostile;
mod looks;
mod pose;
mod reading;
mod refusals;

use serde_json::{Value, json};

use super::super::{Loaded, ReadError, read_mesh};
use super::{CHUNK_BINARY, CHUNK_JSON};
use shellock_geom::Vec3;

/// Codes of `componentType` in accessors.
const U8: u32 = 5121;
const U16: u32 = 5123;
const F32: u32 = 5126;

/// Corners of the tetrahedron.
const POINTS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const TRIANGLES: [[u8; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// A document under construction, and its data.
#[derive(Clone)]
struct File {
    json: Value,
    data: Vec<u8>,
}

impl File {
    /// Node 0 is visible and has mesh 0, a tetrahedron: accessor 0 has its points, accessor 1 its corners.
    fn tetrahedron() -> Self {
        let mut file = Self {
            json: json!({
                "asset": { "version": "2.0" },
                "scenes": [{ "nodes": [0] }],
                "nodes": [{ "mesh": 0 }],
                "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
                "accessors": [], "bufferViews": [], "buffers": [{ "byteLength": 0 }],
            }),
            data: Vec::new(),
        };
        file.floats(&POINTS);
        file.add("SCALAR", U8, 12, TRIANGLES.as_flattened());
        file
    }

    /// Puts `bytes` into a buffer view of its own. Returns its index.
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": self.data.len(), "byteLength": bytes.len() });
        self.data.extend(bytes);
        push(&mut self.json["bufferViews"], view)
    }

    /// Adds an accessor of `bytes`. Returns its index.
    fn add(&mut self, shape: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let accessor =
            json!({ "bufferView": view, "componentType": component, "count": count, "type": shape });
        push(&mut self.json["accessors"], accessor)
    }

    /// Adds an accessor of rows of `N` floats.
    fn floats<const N: usize>(&mut self, rows: &[[f32; N]]) -> usize {
        let shape = match N {
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        self.add(shape, F32, rows.len(), &bytes_of(rows))
    }

    /// Adds an accessor of rows of normalised bytes, fractions of 255.
    fn shares<const N: usize>(&mut self, rows: &[[u8; N]]) -> usize {
        let shape = if N == 3 { "VEC3" } else { "VEC4" };
        let which = self.add(shape, U8, rows.len(), rows.as_flattened());
        self.json["accessors"][which]["normalized"] = json!(true);
        which
    }

    /// Adds a sparse accessor of `count` rows of three, without other data unless `base` is a buffer view.
    fn sparse(&mut self, base: Option<usize>, count: usize, places: &[u16], rows: &[[f32; 3]]) -> usize {
        let indices: Vec<u8> = places.iter().flat_map(|place| place.to_le_bytes()).collect();
        let (indices, values) = (self.view(&indices), self.view(&bytes_of(rows)));
        let mut accessor = json!({
            "componentType": F32, "count": count, "type": "VEC3",
            "sparse": {
                "count": places.len(),
                "indices": { "bufferView": indices, "componentType": U16 },
                "values": { "bufferView": values },
            },
        });
        if let Some(base) = base {
            accessor["bufferView"] = json!(base);
        }
        push(&mut self.json["accessors"], accessor)
    }

    /// Makes node 0 follow joints: node k + 1 for each of `joints`, all of them roots of the scene. The point
    /// in row i follows joint i modulo their number.
    fn skin(&mut self, joints: &[Value]) {
        let names: Vec<usize> = (1..=joints.len()).collect();
        for joint in joints {
            push(&mut self.json["nodes"], joint.clone());
        }
        let rows: Vec<[u8; 4]> = (0..POINTS.len())
            .map(|i| [(i % joints.len()) as u8, 0, 0, 0])
            .collect();
        let followed = self.add("VEC4", U8, rows.len(), rows.as_flattened());
        let weights = self.floats(&[[1.0, 0.0, 0.0, 0.0]; POINTS.len()]);
        self.json["skins"] = json!([{ "joints": names }]);
        self.json["nodes"][0]["skin"] = json!(0);
        let attributes = self.attributes();
        attributes["JOINTS_0"] = json!(followed);
        attributes["WEIGHTS_0"] = json!(weights);
    }

    /// Attributes of the tetrahedron's primitive.
    fn attributes(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]["attributes"]
    }

    fn glb(&self) -> Vec<u8> {
        let mut document = self.json.clone();
        document["buffers"][0]["byteLength"] = json!(self.data.len());
        glb(document.to_string().as_bytes(), &self.data)
    }

    fn read(&self) -> Result<Loaded, ReadError> {
        read_mesh(&self.glb(), None)
    }

    fn points(&self) -> Vec<Vec3> {
        self.read().unwrap().mesh.points
    }

    fn message(&self) -> String {
        self.read().expect_err("it is refused").to_string()
    }
}

/// Appends `item` to `list`. Returns its index.
fn push(list: &mut Value, item: Value) -> usize {
    let list = list.as_array_mut().unwrap();
    list.push(item);
    list.len() - 1
}

fn bytes_of<const N: usize>(rows: &[[f32; N]]) -> Vec<u8> {
    rows.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A GLB file of two chunks.
fn glb(json: &[u8], data: &[u8]) -> Vec<u8> {
    let (mut json, mut data) = (json.to_vec(), data.to_vec());
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

/// Points of the tetrahedron, each moved by `f`.
fn transform(f: impl Fn(Vec3) -> Vec3) -> Vec<Vec3> {
    POINTS.map(|p| f(Vec3::from_array(p.map(f64::from)))).to_vec()
}

#[track_caller]
fn assert_close(found: &[Vec3], expected: &[Vec3]) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!((*a - *b).length() < 1e-6, "{found:?} instead of {expected:?}");
    }
}
