//! The JSON of a glTF file, as the records of the `gltf` crate ([`::gltf::json`]).
//!
//! Only the records are used. The crate's own import and validation are not: they panic where a `POSITION` names an
//! accessor that does not exist, and refuse files whose only fault is a missing `min`. So indices here are as the file
//! has them, and whoever follows one checks it. (But for their lowest 32 bits: the records drop the others.)

pub(super) use ::gltf::json::accessor::{ComponentType, Type};
pub(super) use ::gltf::json::extensions::material::{Material as MaterialExtensions, PbrSpecularGlossiness};
pub(super) use ::gltf::json::extensions::scene::khr_lights_punctual::{Light, Type as LightType};
pub(super) use ::gltf::json::extensions::texture::TextureTransform;
pub(super) use ::gltf::json::material::{AlphaMode, NormalTexture};
pub(super) use ::gltf::json::mesh::{Mode, Primitive, Semantic};
pub(super) use ::gltf::json::scene::UnitQuaternion;
pub(super) use ::gltf::json::texture::{Info, MagFilter, WrappingMode};
pub(super) use ::gltf::json::validation::Checked;
pub(super) use ::gltf::json::{Accessor, Camera, Index, Material, Mesh, Node, Root, Texture, buffer::View};

use serde::Deserialize;
use serde_json::{Error, Value, json};
use std::collections::BTreeMap;

/// Parses the JSON of a file. One that the records are too strict for is relaxed and tried again.
pub(super) fn parse(text: &[u8]) -> Result<Root, Error> {
    Root::from_slice(text).or_else(|error| {
        let mut file: Value = serde_json::from_slice(text)?;
        relax(&mut file);
        serde_json::from_value(file).map_err(|other| {
            // The first error knows its line, but what it misses may have been added since.
            let first = error.to_string();
            let added = first.starts_with("missing field") && !first.starts_with(&other.to_string());
            if added { other } else { error }
        })
    })
}

/// Adds the members that the records require and glTF does not (nodes of a scene), or that nothing here depends on;
/// empties what is only counted, but may have members that the records do not know (targets of
/// `KHR_animation_pointer`).
fn relax(file: &mut Value) {
    for (list, whole) in [
        ("animations", json!({ "channels": [], "samplers": [] })),
        ("skins", json!({ "joints": [] })),
    ] {
        objects(file, list).for_each(|object| *object = whole.clone());
    }
    for (list, member, value) in [
        ("scenes", "nodes", json!([])),
        ("meshes", "primitives", json!([])),
        ("cameras", "type", json!("perspective")),
    ] {
        objects(file, list).for_each(|object| add(object, member, &value));
    }
    for mesh in objects(file, "meshes") {
        objects(mesh, "primitives").for_each(|primitive| add(primitive, "attributes", &json!({})));
    }
    if let Some(lights) = file.pointer_mut("/extensions/KHR_lights_punctual") {
        add(lights, "lights", &json!([]));
    }
    for camera in objects(file, "cameras") {
        for member in ["xmag", "znear", "zfar"] {
            for projection in ["perspective", "orthographic"] {
                camera
                    .get_mut(projection)
                    .into_iter()
                    .for_each(|p| add(p, member, &json!(0)));
            }
        }
    }
}

fn objects<'a>(file: &'a mut Value, list: &str) -> impl Iterator<Item = &'a mut Value> {
    file.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten()
}

fn add(object: &mut Value, member: &str, value: &Value) {
    if let Some(object) = object.as_object_mut() {
        object.entry(member).or_insert_with(|| value.clone());
    }
}

/// `EXT_mesh_gpu_instancing`, which the records do not know.
#[derive(Debug, Deserialize)]
pub(super) struct Instancing {
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, Index<Accessor>>,
}

impl Instancing {
    /// That of `node`, if it has any.
    pub(super) fn of(node: &Node) -> Option<Result<Self, Error>> {
        let others = &node.extensions.as_ref()?.others;
        others.get("EXT_mesh_gpu_instancing").map(Self::deserialize)
    }
}

/// A normal map as any other texture: the records do not know its `KHR_texture_transform`.
pub(super) fn normal_map(json: &NormalTexture) -> Result<Info, Error> {
    let extensions = json.extensions.as_ref().map(|e| Value::Object(e.others.clone()));
    Ok(Info {
        index: json.index,
        tex_coord: json.tex_coord,
        extensions: extensions.map(serde_json::from_value).transpose()?,
        extras: None,
    })
}
