//! Extensions that a document declares as required.

use super::super::ReadError;
use super::is_compressed;

/// Prefixes of extension names that do not change any triangle.
const KNOWN_KINDS: [&str; 8] = [
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "EXT_materials_",
    "EXT_texture_",
    "EXT_lights_",
    "ADOBE_materials_",
    "VRMC_",
];
/// Names of extensions that do not change any triangle, or that are supported.
const KNOWN: [&str; 18] = [
    "EXT_mesh_gpu_instancing",
    "KHR_accessor_float64",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "AGI_articulations",
    "CESIUM_primitive_outline",
    "EXT_feature_metadata",
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_structural_metadata",
    "KHR_animation_pointer",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MSFT_texture_dds",
    "VRM",
];
/// Largest number of characters of a name quoted in a message.
const QUOTED_CHARS: usize = 40;

/// Returns an error for compressed data and for the first of `required` that is not known, by its name.
pub(super) fn check(required: &[String]) -> Result<(), ReadError> {
    for name in required {
        if name.contains("compression") {
            return Err(is_compressed(name));
        }
        let is_known =
            KNOWN.contains(&name.as_str()) || KNOWN_KINDS.iter().any(|kind| name.starts_with(kind));
        if !is_known {
            let name: String = name
                .chars()
                .filter(|c| !c.is_control())
                .take(QUOTED_CHARS)
                .collect();
            return Err(ReadError::GltfUnsupported {
                what: format!("needs the extension \"{name}\", which is not supported"),
                remedy: "export it without that extension",
            });
        }
    }
    Ok(())
}
