//! A scene, loaded, checked and ready for rays.
//!
//! Data flows one way: a glTF file ([`load`]) or a generator ([`generate`]) fills a [`SceneParts`]; [`Scene::new`]
//! validates it, finds the lights and builds what every ray needs of the acceleration structure; after that a scene never changes, but for what is
//! made, read or decoded when a ray first needs it ([`stored`], [`bvh`]), and may be dropped again between rays ([`Scene::make_room`]).
//!
//! Absent from this crate: GPU, random state (samples take their `u` as an argument), windows. Files are read in
//! [`gltf`] and made in [`export`] only, by way of [`mod@file`], which everything that writes files uses. After [`Scene::new`] has succeeded every index is in range, every normal
//! is of unit length, every radiance is finite and at least zero.

mod alone;
pub mod assemble;
pub mod bsdf;
pub mod bvh;
pub mod camera;
pub mod error;
pub mod export;
pub mod file;
pub mod generate;
pub mod gltf;
mod inputs;
pub mod instance;
pub mod light;
pub mod material;
mod memory;
pub mod mesh;
pub mod packed;
mod recentre;
mod relight;
pub mod report;
mod scene;
mod shading;
pub mod stored;
pub mod surface;
pub mod texture;
mod validate;

pub use bsdf::{Bsdf, BsdfSample};
pub use bvh::{Hit, PrimitiveId, Ray};
pub use camera::Camera;
pub use error::SceneError;
pub use instance::Instance;
pub use light::{Light, LightKind, LightPoint, LightSource};
pub use material::Material;
pub use memory::{KeptBytes, Memory, MemoryUse};
pub use mesh::Mesh;
pub use report::Report;
pub use scene::{Counts, Scene, SceneParts, load};
pub use stored::StoredMesh;
pub use surface::Surface;
pub use texture::Texture;

/// Luminance of linear Rec. 709 RGB: the scalar by which this project weighs colours.
#[inline]
pub fn luminance(rgb: glam::Vec3) -> f32 {
    rgb.dot(glam::Vec3::new(0.2126, 0.7152, 0.0722))
}
