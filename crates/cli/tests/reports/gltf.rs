//! Generated glTF files like those of generators and modelling programs.

use serde_json::{Value, json};
use shellock_geom::{TriMesh, Vec3};

use super::{Case, Claim, body, scale};
use Claim::{Labels, Note, Refused, Size, Warning};

/// Identity matrix in column-major order.
const IDENTITY: [f32; 16] = [
    1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0,
];

/// A GLB file under construction.
struct Glb {
    json: Value,
    data: Vec<u8>,
}

impl Glb {
    /// Creates a file with a mesh in metres, shown by node 0.
    fn of(mesh: &TriMesh) -> Self {
        let mut glb = Self {
            json: json!({ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
                "nodes": [{ "mesh": 0 }], "accessors": [], "bufferViews": [] }),
            data: Vec::new(),
        };
        let points: Vec<f32> = mesh
            .points
            .iter()
            .flat_map(|p| p.to_array().map(|x| x as f32))
            .collect();
        let position = glb.floats(&points, "VEC3");
        let corners: Vec<u8> = mesh
            .triangles
            .as_flattened()
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let indices = glb.accessor(&corners, 5125, "SCALAR", 3 * mesh.triangles.len());
        glb.json["meshes"] =
            json!([{ "primitives": [{ "attributes": { "POSITION": position }, "indices": indices }] }]);
        glb
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let views = self.json["bufferViews"].as_array_mut().expect("it is one");
        views.push(json!({ "buffer": 0, "byteOffset": self.data.len(), "byteLength": bytes.len() }));
        let view = views.len() - 1;
        self.data.extend(bytes);
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        let accessors = self.json["accessors"].as_array_mut().expect("it is one");
        accessors
            .push(json!({ "bufferView": view, "componentType": component, "type": kind, "count": count }));
        accessors.len() - 1
    }

    fn floats(&mut self, values: &[f32], kind: &str) -> usize {
        let n_columns = match kind {
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 1,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, kind, values.len() / n_columns)
    }

    fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    fn bytes(mut self) -> Vec<u8> {
        self.json["buffers"] = json!([{ "byteLength": self.data.len() }]);
        let mut text = self.json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + text.len() + 8 + self.data.len();
        let mut bytes = b"glTF".to_vec();
        for word in [2, length as u32, text.len() as u32, 0x4E4F_534A] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend(text);
        bytes.extend((self.data.len() as u32).to_le_bytes());
        bytes.extend(0x004E_4942_u32.to_le_bytes());
        bytes.extend(self.data);
        bytes
    }
}

/// Body in metres: 60 × 40 × 30 mm.
fn metres() -> TriMesh {
    scale(&body(), Vec3::splat(1e-3))
}

fn n_points() -> usize {
    body().points.len()
}

/// All cases of glTF files.
pub fn cases() -> Vec<Case> {
    [skins(), morphs(), copies(), extensions(), sizes(), others()].concat()
}

/// Adds a skin with one joint for all points; the joint is node 1.
fn add_skin(glb: &mut Glb, inverse_bind: [f32; 16]) {
    let n = n_points();
    let joints = glb.accessor(&vec![0; 4 * n], 5121, "VEC4", n);
    let weights: Vec<f32> = (0..n).flat_map(|_| [1.0, 0.0, 0.0, 0.0]).collect();
    let weights = glb.floats(&weights, "VEC4");
    let matrices = glb.floats(&inverse_bind, "MAT4");
    glb.primitive()["attributes"]["JOINTS_0"] = json!(joints);
    glb.primitive()["attributes"]["WEIGHTS_0"] = json!(weights);
    glb.json["skins"] = json!([{ "joints": [1], "inverseBindMatrices": matrices }]);
}

fn skins() -> Vec<Case> {
    // The joint doubles the size; the node's own scale is ignored.
    let mut posed = Glb::of(&metres());
    add_skin(&mut posed, IDENTITY);
    posed.json["nodes"] = json!([{ "mesh": 0, "skin": 0, "scale": [9, 9, 9] }, { "scale": [2, 2, 2] }]);
    posed.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    // Joint and inverse bind matrix cancel out: a model in centimetres is shown in metres.
    let mut bound = Glb::of(&scale(&metres(), Vec3::splat(100.0)));
    let mut inverse = IDENTITY;
    [0, 5, 10].into_iter().for_each(|k| inverse[k] = 0.01);
    add_skin(&mut bound, inverse);
    bound.json["nodes"] = json!([{ "mesh": 0, "skin": 0 }, {}]);
    vec![
        Case::new("skin_posed.glb", posed.bytes())
            .says(&[Size([120.0, 80.0, 60.0])])
            .proves("glTF, GLB", "read", "skins"),
        Case::new("skin_scaled.glb", bound.bytes()).says(&[Size([60.0, 40.0, 30.0])]),
    ]
}

fn morphs() -> Vec<Case> {
    let morphed = |name: &'static str, of_mesh: Option<f32>, of_node: Option<f32>| {
        let mut glb = Glb::of(&metres());
        // The morph target doubles the height.
        let deltas: Vec<f32> = metres()
            .points
            .iter()
            .flat_map(|p| [0.0, 0.0, p.z as f32])
            .collect();
        let target = glb.floats(&deltas, "VEC3");
        glb.primitive()["targets"] = json!([{ "POSITION": target }]);
        if let Some(weight) = of_mesh {
            glb.json["meshes"][0]["weights"] = json!([weight]);
        }
        if let Some(weight) = of_node {
            glb.json["nodes"][0]["weights"] = json!([weight]);
        }
        Case::new(name, glb.bytes())
    };
    vec![
        morphed("morph_on.glb", Some(1.0), None)
            .says(&[Size([60.0, 40.0, 60.0])])
            .proves("glTF, GLB", "read", "morph targets"),
        morphed("morph_of_node.glb", Some(1.0), Some(0.5)).says(&[Size([60.0, 40.0, 45.0])]),
        morphed("morph_off.glb", None, None).says(&[Size([60.0, 40.0, 30.0])]),
    ]
}

fn copies() -> Vec<Case> {
    let mut instanced = Glb::of(&metres());
    let moves = instanced.floats(&[0.0, 0.0, 0.0, 0.05, 0.0, 0.0], "VEC3");
    instanced.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": moves } } });
    instanced.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let mut nodes = Glb::of(&metres());
    nodes.json["nodes"] =
        json!([{ "children": [1, 2] }, { "mesh": 0 }, { "mesh": 0, "translation": [0.05, 0, 0] }]);
    let mut named = Glb::of(&metres());
    named.json["nodes"] = json!([{ "children": [1, 2] }, { "mesh": 0, "name": "left" },
        { "mesh": 0, "name": "right", "translation": [0.5, 0, 0] }]);
    let named = named.bytes();
    vec![
        Case::new("instances.glb", instanced.bytes())
            .says(&[Size([110.0, 40.0, 30.0]), Labels("objects")])
            .proves("glTF, GLB", "read", "instances"),
        Case::new("nodes.glb", nodes.bytes())
            .says(&[Size([110.0, 40.0, 30.0])])
            .proves("glTF, GLB", "read", "nodes with their transforms"),
        Case::new("named.glb", named.clone()).says(&[Refused("\"left\", \"right\"")]),
        Case::new("named_right.glb", named)
            .with(&["--object", "right"])
            .says(&[Size([60.0, 40.0, 30.0])])
            .proves("glTF, GLB", "read", "one object of several"),
    ]
}

fn extensions() -> Vec<Case> {
    let mut unknown = Glb::of(&metres());
    unknown.json["extensionsRequired"] = json!(["KHR_materials_unlit", "VENDOR_new_geometry"]);
    let mut draco = Glb::of(&metres());
    draco.primitive()["extensions"] = json!({ "KHR_draco_mesh_compression": { "bufferView": 0 } });
    draco.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    for accessor in draco.json["accessors"].as_array_mut().expect("it is one") {
        accessor.as_object_mut().expect("it is one").remove("bufferView");
    }
    let mut meshopt = Glb::of(&metres());
    meshopt.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    let mut elsewhere = Glb::of(&metres());
    elsewhere.json["accessors"][0]["bufferView"] = json!(0);
    let elsewhere = {
        let mut bytes = elsewhere.bytes();
        let at = bytes
            .windows(9)
            .position(|w| w == b"\"buffers\"")
            .expect("it is there");
        let text = b"\"buffers\":[{\"byteLength\":9,\"uri\":\"a.bin\"}]";
        let end = at + bytes[at..].iter().position(|&b| b == b']').expect("it ends") + 1;
        let length_before = bytes.len();
        bytes.splice(at..end, text.iter().copied());
        // The stated length of the JSON chunk grows with its text, so that the chunks stay readable.
        let json_length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes"));
        let grown = (bytes.len() - length_before) as u32;
        bytes[12..16].copy_from_slice(&(json_length + grown).to_le_bytes());
        bytes
    };
    vec![
        Case::new("unknown_required.glb", unknown.bytes())
            .says(&[Refused("VENDOR_new_geometry")])
            .proves(
                "glTF, GLB",
                "refused",
                "any other extension that the file requires",
            ),
        Case::new("draco_used.glb", draco.bytes())
            .says(&[Refused("compressed")])
            .proves("glTF, GLB", "refused", "compressed data"),
        Case::new("meshopt_required.glb", meshopt.bytes()).says(&[Refused("compressed")]),
        Case::new("data_elsewhere.glb", elsewhere)
            .says(&[Refused("a.bin")])
            .proves("glTF, GLB", "refused", "data in other files"),
    ]
}

fn sizes() -> Vec<Case> {
    let longest = |name: &'static str, longest: f64| {
        Case::new(
            name,
            Glb::of(&scale(&body(), Vec3::splat(longest / 60.0))).bytes(),
        )
    };
    let guess = [Size([150.0, 100.0, 75.0]), Warning("the model is made 150 mm")];
    vec![
        longest("one_metre.glb", 0.98).says(&guess),
        longest("two_metres.glb", 1.9).says(&guess),
        longest("unit_box.glb", 1.0)
            .with(&["--unit", "m"])
            .says(&[Size([1000.0, 2000.0 / 3.0, 500.0])])
            .proves(
                "glTF, GLB",
                "read",
                "lengths in metres, but for models of 1 or 2 units",
            ),
    ]
}

fn others() -> Vec<Case> {
    let mut coloured = Glb::of(&metres());
    let colors: Vec<f32> = metres()
        .points
        .iter()
        .flat_map(|p| {
            if p.x > 0.0 {
                [1.0, 0.0, 0.0]
            } else {
                [0.0, 0.0, 1.0]
            }
        })
        .collect();
    let colors = coloured.floats(&colors, "VEC3");
    coloured.primitive()["attributes"]["COLOR_0"] = json!(colors);
    let mut lines = Glb::of(&metres());
    let primitive = lines.primitive().clone();
    lines.json["meshes"][0]["primitives"] =
        json!([primitive, { "mode": 1, "attributes": primitive["attributes"] }]);
    let mut only = Glb::of(&metres());
    only.primitive()["mode"] = json!(0);
    let mut hidden = Glb::of(&metres());
    hidden.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "scale": [9, 9, 9],
        "extensions": { "KHR_node_visibility": { "visible": false } } }]);
    hidden.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    let whole = Size([60.0, 40.0, 30.0]);
    vec![
        Case::new("colours_of_points.glb", coloured.bytes())
            .says(&[whole, Labels("colors"), Note("--labels-from colors")])
            .proves("glTF, GLB", "read", "colours of points"),
        Case::new("with_lines.glb", lines.bytes())
            .says(&[whole, Note("lines or points")])
            .proves("glTF, GLB", "left out", "lines and points"),
        Case::new("only_points.glb", only.bytes())
            .says(&[Refused("only lines or points")])
            .proves("glTF, GLB", "refused", "files of lines or points alone"),
        Case::new("hidden.glb", hidden.bytes())
            .says(&[whole, Note("hidden")])
            .proves("glTF, GLB", "left out", "hidden nodes"),
    ]
}
