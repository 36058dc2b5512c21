//! Tests on files built in code.

mod broken;
mod fuzz;
mod geometry;
mod looks;
mod textures;

use super::read;
use crate::{SceneError, SceneParts};
use serde_json::{Value, json};
use std::path::PathBuf;
use tempfile::TempDir;

/// Builds a glTF file piece by piece.
#[derive(Clone, Debug, Default)]
struct Builder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Builder {
    /// Adds bytes as a buffer view of their own.
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views
            .push(json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }));
        self.bytes.extend_from_slice(bytes);
        self.views.len() - 1
    }

    /// Adds an accessor over bytes of its own.
    fn accessor(&mut self, bytes: &[u8], component: u32, shape: &str, count: usize) -> usize {
        let view = self.view(bytes);
        self.accessors
            .push(json!({ "bufferView": view, "componentType": component, "type": shape, "count": count }));
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let shape = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][N];
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, shape, values.len())
    }

    fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5123, "SCALAR", values.len())
    }

    /// The JSON of a file with these parts and `rest`, all its own bytes inside.
    fn json(&self, rest: Value) -> Value {
        let mut file = json!({
            "asset": { "version": "2.0" },
            "buffers": [{
                "byteLength": self.bytes.len(),
                "uri": format!("data:application/octet-stream;base64,{}", base64(&self.bytes)),
            }],
            "bufferViews": self.views,
            "accessors": self.accessors,
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0, "name": "node" }],
        });
        let all = file.as_object_mut().unwrap();
        all.extend(rest.as_object().unwrap().clone());
        file
    }

    /// As binary container, its bytes in the binary chunk.
    fn glb(&self, rest: Value) -> Vec<u8> {
        let mut json = self.json(rest);
        json["buffers"][0].as_object_mut().unwrap().remove("uri");
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut data = self.bytes.clone();
        data.resize(data.len().next_multiple_of(4), 0);
        let mut file = b"glTF\x02\0\0\0".to_vec();
        file.extend((12 + 8 + text.len() as u32 + 8 + data.len() as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", text), (b"BIN\0", data)] {
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        file
    }

    fn read(&self, rest: Value) -> Result<SceneParts, SceneError> {
        read_json(&self.json(rest))
    }

    fn load(&self, rest: Value) -> SceneParts {
        self.read(rest).unwrap_or_else(|error| panic!("{error}"))
    }
}

/// A right triangle in the xy plane that faces +z, with legs of length 1.
const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// A builder that holds the positions of [`TRIANGLE`] as accessor 0.
fn triangle() -> Builder {
    let mut builder = Builder::default();
    builder.floats(&TRIANGLE);
    builder
}

/// `meshes` with one primitive.
fn mesh(primitive: Value) -> Value {
    json!([{ "name": "mesh", "primitives": [primitive] }])
}

/// The plain triangle as a `meshes` array.
fn plain() -> Value {
    mesh(json!({ "attributes": { "POSITION": 0 } }))
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = |chunk: &[u8]| {
        let word = chunk.iter().fold(0_u32, |word, &b| word << 8 | u32::from(b)) << (8 * (3 - chunk.len()));
        (0..4)
            .map(move |i| DIGITS[(word >> (18 - 6 * i)) as usize & 63] as char)
            .collect::<String>()
    };
    let mut text: String = bytes.chunks(3).map(digits).collect();
    let padding = (3 - bytes.len() % 3) % 3;
    text.truncate(text.len() - padding);
    text + &"=".repeat(padding)
}

/// Writes files into a folder of their own; the folder lives as long as the handle.
fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    folder
}

fn read_bytes(name: &str, bytes: &[u8]) -> Result<SceneParts, SceneError> {
    let folder = folder(&[(name, bytes)]);
    let path: PathBuf = folder.path().join(name);
    read(&path)
}

fn read_json(json: &Value) -> Result<SceneParts, SceneError> {
    read_bytes("test.gltf", json.to_string().as_bytes())
}

/// A PNG of the given RGBA texels.
fn png(width: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let height = texels.len() as u32 / width;
    let image = image::RgbaImage::from_raw(width, height, texels.as_flattened().to_vec()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn warns(parts: &SceneParts, text: &str) -> bool {
    parts.report.warnings.iter().any(|warning| warning.contains(text))
}
