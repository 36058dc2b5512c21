// The scene: uploaded once. Rust: crates/render/src/gpu/scene.rs, crates/render/src/gpu/layout.rs
#import "lib/constants.wgsl"

const NONE: u32 = 0xffffffffu;

// Where in `details` each section begins, and what there is one of.
struct SceneParams {
    // Roots of trees in `nodes`; NONE where there is nothing.
    fixed_root: u32,
    top_root: u32,
    // 2 words each: instance, root.
    placed: u32,
    // Word offsets from here on.
    triangles: u32,
    instances: u32,
    meshes: u32,
    materials: u32,
    textures: u32,
    emitter_lights: u32,
    albedo: u32,
    srgb: u32,
    light_count: u32,
    radius: f32,
    // 1: some light can be hit.
    area_lights: u32,
    pad0: u32,
    pad1: u32,
}

// One light; LightKind in the low byte of `kind`.
struct Light {
    // Triangle: first corner. Point, spot: position.
    position_ws: vec3<f32>,
    kind: u32,
    edge1_ws: vec3<f32>,
    area: f32,
    edge2_ws: vec3<f32>,
    // FAR or more: no end.
    range: f32,
    normal_ws: vec3<f32>,
    cos_inner: f32,
    intensity: vec3<f32>,
    cos_outer: f32,
    primitive: vec2<u32>,
    pad: vec2<u32>,
}

@group(1) @binding(0) var<uniform> scene: SceneParams;
// Eight words of four for each node of eight boxes: see crates/scene/src/bvh/node.rs.
@group(1) @binding(1) var<storage, read> nodes: array<vec4<u32>>;
// Twenty words of four for each pack of eight triangles: see crates/scene/src/bvh/pack.rs.
@group(1) @binding(2) var<storage, read> packs: array<vec4<u32>>;
@group(1) @binding(3) var<storage, read> lights: array<Light>;
@group(1) @binding(4) var<storage, read> details: array<u32>;
// RGBA, 8 bits each.
@group(1) @binding(5) var<storage, read> texels: array<u32>;

// What the scene has, so that what it lacks costs nothing.
override HAS_INSTANCES: bool = true;
override HAS_MASKS: bool = true;
// Textures, vertex colours or smooth normals.
override HAS_DETAIL: bool = true;

fn detail_f32(at: u32) -> f32 {
    return bitcast<f32>(details[at]);
}

fn detail_vec2(at: u32) -> vec2<f32> {
    return vec2<f32>(detail_f32(at), detail_f32(at + 1u));
}

fn detail_vec3(at: u32) -> vec3<f32> {
    return vec3<f32>(detail_f32(at), detail_f32(at + 1u), detail_f32(at + 2u));
}

fn detail_vec4(at: u32) -> vec4<f32> {
    return vec4<f32>(detail_f32(at), detail_f32(at + 1u), detail_f32(at + 2u), detail_f32(at + 3u));
}

// Words of the records in `details`.
const TRIANGLE_WORDS: u32 = 6u;
const INSTANCE_WORDS: u32 = 40u;
const MESH_WORDS: u32 = 8u;
const MATERIAL_WORDS: u32 = 56u;
const TEXTURE_WORDS: u32 = 4u;

fn instance_at(instance: u32) -> u32 {
    return scene.instances + instance * INSTANCE_WORDS;
}

// Fields of an instance.
const LOCAL_FROM_WORLD: u32 = 0u;
const WORLD_FROM_LOCAL: u32 = 12u;
const WORLD_NORMAL_FROM_LOCAL: u32 = 24u;
const INSTANCE_MESH: u32 = 33u;
const INSTANCE_IDENTITY: u32 = 34u;
const INSTANCE_FIRST_TRIANGLE: u32 = 35u;
const INSTANCE_FIRST_EMITTER: u32 = 36u;

// Three columns at word `at`.
fn matrix_at(at: u32) -> mat3x3<f32> {
    return mat3x3<f32>(detail_vec3(at), detail_vec3(at + 3u), detail_vec3(at + 6u));
}

// Fields of a mesh: offsets of its streams, NONE where it has none.
const MESH_INDICES: u32 = 0u;
const MESH_POSITIONS: u32 = 1u;
const MESH_NORMALS: u32 = 2u;
const MESH_UVS: u32 = 3u;
const MESH_UVS1: u32 = 4u;
const MESH_TANGENTS: u32 = 5u;
const MESH_COLORS: u32 = 6u;

fn mesh_of(instance: u32) -> u32 {
    return scene.meshes + details[instance_at(instance) + INSTANCE_MESH] * MESH_WORDS;
}

fn corners_of(mesh: u32, triangle: u32) -> vec3<u32> {
    let at = details[mesh + MESH_INDICES] + 3u * triangle;
    return vec3<u32>(details[at], details[at + 1u], details[at + 2u]);
}

// Fields of a material.
const MATERIAL_DIFFUSE: u32 = 0u;
const MATERIAL_GGX_ALPHA: u32 = 3u;
const MATERIAL_F0: u32 = 4u;
const MATERIAL_F90: u32 = 7u;
const MATERIAL_EMISSION: u32 = 8u;
const MATERIAL_FLAGS: u32 = 11u;
const MATERIAL_BASE_COLOR: u32 = 12u;
const MATERIAL_METALLIC: u32 = 15u;
const MATERIAL_ROUGHNESS: u32 = 16u;
const MATERIAL_DIELECTRIC_F0: u32 = 17u;
const MATERIAL_DIELECTRIC_F90: u32 = 20u;
const MATERIAL_ALPHA: u32 = 21u;
const MATERIAL_CUTOFF: u32 = 22u;
const MATERIAL_NORMAL_SCALE: u32 = 23u;
const MATERIAL_BASE_COLOR_TEXTURE: u32 = 24u;
const MATERIAL_METALLIC_ROUGHNESS_TEXTURE: u32 = 32u;
const MATERIAL_NORMAL_TEXTURE: u32 = 40u;
const MATERIAL_EMISSIVE_TEXTURE: u32 = 48u;

const DOUBLE_SIDED: u32 = 1u;
const MASKED_MATERIAL: u32 = 2u;

fn material_at(material: u32) -> u32 {
    return scene.materials + material * MATERIAL_WORDS;
}
