//! [`SceneParts`] out to a binary glTF file.
//!
//! Names survive: each origin becomes a node with its own mesh, cut into one primitive per material. Vertex streams are
//! not interleaved and indices are 32 bits wide, so that the simplest readers can read them.

mod document;
mod geometry;
mod material;

use crate::{LightKind, Mesh, SceneError, SceneParts, file};
use document::{BufferView, Document, LightIndex, Node, NodeExtensions};
use geometry::{Geometry, Packed};
use glam::{Affine3A, DVec3, Quat, Vec3};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io;
use std::path::Path;

const EXTENSIONS: [&str; 5] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_texture_transform",
];

/// Writes `parts` as one `.glb`, see [`file::write`].
///
/// The parts must be valid, as those of a [`crate::Scene`] and of [`crate::generate::demo`] are.
///
/// # Errors
/// [`SceneError::Write`] if the system refuses, or for more than the 4 GiB that the format can hold.
pub fn write_glb(parts: &SceneParts, path: &Path) -> Result<(), SceneError> {
    write(parts, path).map_err(|source| SceneError::Write {
        path: path.into(),
        source,
    })
}

fn write(parts: &SceneParts, path: &Path) -> io::Result<()> {
    for mesh in &parts.meshes {
        let _: &Mesh = mesh;
        if let Some(fault) = mesh.fault() {
            return Err(io::Error::other(fault.to_string()));
        }
    }
    let Packed {
        nodes,
        meshes,
        accessors,
        views: mut buffer_views,
        mut buffer,
    } = Geometry::collect(parts).into_buffer();
    let mut document = Document {
        nodes,
        meshes,
        accessors,
        materials: parts.materials.iter().map(material::material).collect(),
        ..Document::default()
    };
    for (index, texture) in parts.textures.iter().enumerate() {
        let bytes = material::png(texture)?;
        if let Some(fault) = texture.texels.fault() {
            return Err(io::Error::other(fault.to_string()));
        }
        document.textures.push(json!({ "source": index, "sampler": index }));
        document.samplers.push(material::sampler(texture));
        document
            .images
            .push(json!({ "name": texture.name, "mimeType": "image/png", "bufferView": buffer_views.len() }));
        buffer_views.push(BufferView {
            buffer: 0,
            byte_offset: buffer.len() as u64,
            byte_length: bytes.len() as u64,
            byte_stride: None,
            target: None,
        });
        buffer.extend_from_slice(&bytes);
        pad(&mut buffer, 0);
    }
    document.buffer_views = buffer_views;
    if !buffer.is_empty() {
        document.buffers = vec![json!({ "byteLength": buffer.len() })];
    }
    cameras(parts, &mut document);
    lights(parts, &mut document);
    document.extensions_used = extensions_used(&document);
    document.scenes[0].name.clone_from(&parts.name);
    let all = 0..document.nodes.len() as u32;
    document.scenes[0].nodes = if parts.origin_ws == DVec3::ZERO {
        all.collect()
    } else {
        // Back to where the scene came from.
        document.nodes.push(Node {
            translation: Some(parts.origin_ws.as_vec3().to_array()),
            children: all.clone().collect(),
            ..Node::default()
        });
        vec![all.end]
    };

    let mut text = serde_json::to_vec(&document)?;
    pad(&mut text, b' ');
    let length = 12 + 8 + text.len() + 8 + buffer.len();
    let length =
        u32::try_from(length).map_err(|_| io::Error::new(io::ErrorKind::FileTooLarge, "a .glb holds at most 4 GiB"))?;
    let chunk = |kind: &[u8; 4], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes(), kind.as_slice()].concat();
    file::write(path, |file| {
        file.write_all(b"glTF")?;
        file.write_all(&2u32.to_le_bytes())?;
        file.write_all(&length.to_le_bytes())?;
        file.write_all(&chunk(b"JSON", &text))?;
        file.write_all(&text)?;
        file.write_all(&chunk(b"BIN\0", &buffer))?;
        file.write_all(&buffer)
    })
}

/// Fills up to a multiple of four bytes, as chunks and buffer views of f32 must start.
fn pad(bytes: &mut Vec<u8>, with: u8) {
    bytes.resize(bytes.len().next_multiple_of(4), with);
}

fn cameras<'a>(parts: &'a SceneParts, document: &mut Document<'a>) {
    for (index, camera) in parts.cameras.iter().enumerate() {
        document.cameras.push(material::camera(camera));
        document.nodes.push(Node {
            name: &camera.name,
            camera: Some(index as u32),
            ..rigid(&camera.world_from_camera)
        });
    }
}

/// A node at the place of a rotation and translation.
fn rigid(world_from_local: &Affine3A) -> Node<'static> {
    let rotation = Quat::from_mat3a(&world_from_local.matrix3).normalize();
    Node {
        translation: Some(world_from_local.translation.to_array()),
        rotation: (rotation != Quat::IDENTITY).then(|| Box::new(rotation.to_array())),
        ..Node::default()
    }
}

fn lights<'a>(parts: &'a SceneParts, document: &mut Document<'a>) {
    // Equal lights share one record: a thousand lamps of one kind differ by their nodes only.
    let mut records: Vec<Value> = Vec::new();
    let mut known: BTreeMap<(&str, [u32; 7]), u32> = BTreeMap::new();
    for (light, source) in &parts.punctual {
        let [r, g, b] = light.intensity.to_array();
        let numbers = [
            r,
            g,
            b,
            light.range,
            light.cos_inner,
            light.cos_outer,
            light.kind as u32 as f32,
        ];
        let index = *known
            .entry((&source.mesh, numbers.map(f32::to_bits)))
            .or_insert_with(|| {
                records.push(material::light(light, &source.mesh));
                records.len() as u32 - 1
            });
        let node = match light.kind {
            LightKind::Point | LightKind::Triangle => Node {
                translation: Some(light.position_ws.to_array()),
                ..Node::default()
            },
            LightKind::Spot | LightKind::Directional => rigid(&Affine3A::from_rotation_translation(
                Quat::from_rotation_arc(Vec3::NEG_Z, light.normal_ws),
                light.position_ws,
            )),
        };
        document.nodes.push(Node {
            name: &source.node,
            extensions: Some(NodeExtensions {
                punctual: LightIndex { light: index },
            }),
            ..node
        });
    }
    if !records.is_empty() {
        document.extensions = Some(json!({ "KHR_lights_punctual": { "lights": records } }));
    }
}

/// The extensions that the document uses, found by their names in what few JSON values may use them.
fn extensions_used(document: &Document) -> Vec<&'static str> {
    let text: String = document
        .materials
        .iter()
        .chain(&document.extensions)
        .map(Value::to_string)
        .collect();
    EXTENSIONS
        .into_iter()
        .filter(|name| text.contains(&format!("\"{name}\":")))
        .collect()
}

#[cfg(test)]
mod tests;
