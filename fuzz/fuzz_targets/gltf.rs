//! Fuzzes the reader with nearly valid glTF, which reaches skins, morph targets, instances and sparse data:
//! `cargo +nightly fuzz run gltf`.
//!
//! The bytes choose the contents of a document: meshes, nodes, skins, and the accessors that each of them
//! names. Rare choices are faults: a wrong index, count, offset or number type. The remaining bytes are the
//! data of all accessors. The second half of them, which is meant for indices, holds only values below four.

#![no_main]

use libfuzzer_sys::arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use serde_json::{Map, Value, json};
use shellock_formats::read_mesh;

const POINTS: u64 = 5;
const COMPONENTS: [u64; 7] = [5120, 5121, 5122, 5123, 5125, 5126, 5130];
const EXTENSIONS: [&str; 4] =
    ["KHR_mesh_quantization", "KHR_draco_mesh_compression", "KHR_materials_unlit", "ACME_x"];

/// Choices of the fuzzer for one document, and the accessors so far.
struct Maker<'a, 'b> {
    u: &'a mut Unstructured<'b>,
    accessors: Vec<Value>,
}

impl Maker<'_, '_> {
    /// Returns `usual`, or rarely another number: near, far, or beyond all bounds.
    fn number(&mut self, usual: u64) -> Result<u64> {
        Ok(match self.u.arbitrary::<u8>()? {
            0..=247 => usual,
            248..=252 => self.u.int_in_range(0..=40)?,
            253 => usual.wrapping_sub(1),
            254 => u64::from(u32::MAX),
            _ => u64::MAX,
        })
    }

    fn is_so(&mut self, of_256: u8) -> Result<bool> {
        Ok(self.u.arbitrary::<u8>()? < of_256)
    }

    /// Chooses a number that a transform may have.
    fn float(&mut self) -> Result<Value> {
        Ok(match self.u.arbitrary::<u8>()? {
            0 => json!(1e300),
            1 => json!(-1.5),
            2 => json!(0),
            small => json!(f64::from(small) / 64.0 - 2.0),
        })
    }

    fn floats(&mut self, n: usize) -> Result<Value> {
        (0..n).map(|_| self.float()).collect()
    }

    /// Adds an accessor of `count` rows, usually dense and with this component type; returns its index.
    fn accessor(&mut self, shape: &str, component: u64, count: u64) -> Result<Value> {
        let component = if self.is_so(30)? { *self.u.choose(&COMPONENTS)? } else { component };
        let offset = 4 * self.u.int_in_range(0..=8)?;
        let mut accessor = json!({
            "type": shape, "componentType": self.number(component)?, "count": self.number(count)?,
            "byteOffset": self.number(offset)?,
        });
        let is_bare = self.is_so(40)?;
        if !is_bare {
            accessor["bufferView"] = json!(self.number(u64::from(component == 5121))?);
        }
        if is_bare || self.is_so(30)? {
            let n = self.u.int_in_range(0..=3)?;
            accessor["sparse"] = json!({
                "count": self.number(n)?,
                "indices": { "bufferView": self.number(1)?, "componentType": self.number(5121)? },
                "values": { "bufferView": self.number(0)?, "byteOffset": self.number(8)? },
            });
        }
        if self.is_so(60)? {
            accessor["normalized"] = json!(true);
        }
        self.accessors.push(accessor);
        Ok(json!(self.number(self.accessors.len() as u64 - 1)?))
    }

    fn primitive(&mut self) -> Result<Value> {
        let mut attributes = Map::new();
        attributes.insert("POSITION".to_owned(), self.accessor("VEC3", 5126, POINTS)?);
        if self.is_so(60)? {
            let shape = *self.u.choose(&["VEC3", "VEC4"])?;
            attributes.insert("COLOR_0".to_owned(), self.accessor(shape, 5121, POINTS)?);
        }
        for set in 0..self.u.int_in_range(0..=2)? {
            attributes.insert(format!("JOINTS_{set}"), self.accessor("VEC4", 5121, POINTS)?);
            attributes.insert(format!("WEIGHTS_{set}"), self.accessor("VEC4", 5126, POINTS)?);
        }
        let mut primitive = json!({ "attributes": attributes, "material": self.number(0)? });
        if self.is_so(200)? {
            primitive["indices"] = self.accessor("SCALAR", 5121, 12)?;
        }
        if self.is_so(80)? {
            primitive["mode"] = json!(self.u.int_in_range(0..=7)?);
        }
        let n_targets = self.u.int_in_range(0..=2)?;
        let target = |_| Ok(json!({ "POSITION": self.accessor("VEC3", 5126, POINTS)? }));
        primitive["targets"] = (0..n_targets).map(target).collect::<Result<_>>()?;
        if self.is_so(8)? {
            primitive["extensions"] = json!({ "KHR_draco_mesh_compression": {} });
        }
        Ok(primitive)
    }

    fn mesh(&mut self) -> Result<Value> {
        let n = self.u.int_in_range(1..=2)?;
        let primitives: Vec<Value> = (0..n).map(|_| self.primitive()).collect::<Result<_>>()?;
        Ok(json!({ "primitives": primitives, "weights": self.floats(2)? }))
    }

    /// Makes node `id` of `n`. Its children come after it, except in rare faults.
    fn node(&mut self, id: u64, n: u64) -> Result<Value> {
        let mut node = json!({ "children": [] });
        if self.is_so(180)? {
            node["mesh"] = json!(self.number(0)?);
        }
        if self.is_so(100)? {
            node["skin"] = json!(self.number(0)?);
        }
        if id + 1 < n && self.is_so(120)? {
            node["children"] = json!([self.number(id + 1)?]);
        }
        match self.u.arbitrary::<u8>()? % 8 {
            0 => node["matrix"] = self.floats(16)?,
            1 => node["translation"] = self.floats(3)?,
            2 => node["rotation"] = self.floats(4)?,
            3 => node["scale"] = self.floats(3)?,
            4 => node["weights"] = self.floats(2)?,
            5 => node["extensions"] = json!({ "KHR_node_visibility": { "visible": self.is_so(128)? } }),
            6 => {
                let attributes = json!({
                    "TRANSLATION": self.accessor("VEC3", 5126, 3)?,
                    "ROTATION": self.accessor("VEC4", 5122, 3)?,
                    "SCALE": self.accessor("VEC3", 5126, 3)?,
                });
                node["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
            }
            _ => {}
        }
        Ok(node)
    }

    fn document(&mut self) -> Result<Value> {
        let n = self.u.int_in_range(1..=5)?;
        let nodes: Vec<Value> = (0..n).map(|id| self.node(id, n)).collect::<Result<_>>()?;
        let joints: Vec<u64> = (0..4).map(|_| self.u.int_in_range(0..=n - 1)).collect::<Result<_>>()?;
        let mut skin = json!({ "joints": joints });
        if self.is_so(200)? {
            skin["inverseBindMatrices"] = self.accessor("MAT4", 5126, 4)?;
        }
        let mut document = json!({
            "scenes": [{ "nodes": [0, self.number(n / 2)?] }], "nodes": nodes, "skins": [skin],
            "meshes": [self.mesh()?],
            "materials": [{ "pbrMetallicRoughness": { "baseColorFactor": self.floats(4)? } }],
            "buffers": [{}],
        });
        if self.is_so(16)? {
            document["extensionsRequired"] = json!([*self.u.choose(&EXTENSIONS)?]);
        }
        document["accessors"] = json!(self.accessors);
        Ok(document)
    }
}

// The fuzzer's panic hook is removed: it would end the process even at panics that are caught and become
// errors.
fuzz_target!(init: drop(std::panic::take_hook()), |bytes: &[u8]| {
    let mut u = Unstructured::new(bytes);
    let mut maker = Maker { u: &mut u, accessors: Vec::new() };
    let Ok(mut document) = maker.document() else { return };
    let mut data = u.take_rest().to_vec();
    let half = data.len() / 2;
    data[half..].iter_mut().for_each(|byte| *byte %= 4);
    document["bufferViews"] = json!([
        { "buffer": 0, "byteLength": data.len() },
        { "buffer": 0, "byteLength": data.len() - half, "byteOffset": half },
    ]);
    let mut file = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, chunk) in [(b"JSON", document.to_string().as_bytes()), (b"BIN\0", &data)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    if let Ok(loaded) = read_mesh(&file, None) {
        let n_triangles = loaded.mesh.triangles.len();
        assert_eq!(loaded.file_face.len(), n_triangles);
        assert!(loaded.labellings.iter().all(|labelling| labelling.labels.len() == n_triangles));
        assert!(loaded.mesh.points.iter().all(|p| p.is_finite()));
        let n_points = loaded.mesh.points.len();
        assert!(loaded.mesh.triangles.as_flattened().iter().all(|&v| (v as usize) < n_points));
    }
});
