// What a ray found, resolved.
#import "lib/constants.wgsl"
#import "record/ray.wgsl"
#import "scene/bindings.wgsl"
#import "scene/bsdf.wgsl"
#import "scene/texture.wgsl"

struct Surface {
    position_ws: vec3<f32>,
    // Index of the light that this triangle is, or NONE.
    light: u32,
    geometric_normal_ws: vec3<f32>,
    id: vec2<u32>,
    // Towards where the ray came from, as far as that lies within the surface.
    back_ws: vec3<f32>,
    emitted: vec3<f32>,
    bsdf: Bsdf,
}

// A unit vector, or zero.
fn try_normalize(v: vec3<f32>) -> vec3<f32> {
    let inverse = 1.0 / length(v);
    if is_finite(inverse) && inverse > 0.0 {
        return v * inverse;
    }
    return vec3<f32>(0.0);
}

fn normalize_or(v: vec3<f32>, other: vec3<f32>) -> vec3<f32> {
    let unit = try_normalize(v);
    if is_black(unit) {
        return other;
    }
    return unit;
}

// twin: crates/scene/src/surface.rs usable_normal
fn usable_normal(wanted: vec3<f32>, geometric: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    var shading = try_normalize(wanted);
    if is_black(shading) {
        return geometric;
    }
    if dot(shading, geometric) < 0.0 {
        shading = -shading;
    }
    let cosine = dot(shading, wo);
    if cosine >= 1e-3 {
        return shading;
    }
    return normalize_or(shading + wo * (1e-3 - cosine), geometric);
}

// Direction, and handedness in w; 0 there if there is none.
// twin: crates/scene/src/surface.rs uv_tangent
fn uv_tangent(mesh: u32, triangle: u32, reference: u32) -> vec4<f32> {
    let stream = details[mesh + MESH_UVS + details[reference + 1u]];
    let corners = corners_of(mesh, triangle);
    let a = detail_vec2(stream + 2u * corners.x);
    let uv1 = detail_vec2(stream + 2u * corners.y) - a;
    let uv2 = detail_vec2(stream + 2u * corners.z) - a;
    let positions = details[mesh + MESH_POSITIONS];
    let p = detail_vec3(positions + 3u * corners.x);
    let q = detail_vec3(positions + 3u * corners.y);
    let r = detail_vec3(positions + 3u * corners.z);
    let turn = uv1.x * uv2.y - uv1.y * uv2.x;
    let tangent = try_normalize(((q - p) * uv2.y - (r - p) * uv1.y) * sign(turn));
    return vec4<f32>(tangent, select(-sign(turn), 0.0, is_black(tangent)));
}

// twin: crates/scene/src/surface.rs mapped_normal
fn mapped_normal(place: Place, triangle: u32, material: u32, normal: vec3<f32>) -> vec3<f32> {
    let reference = material + MATERIAL_NORMAL_TEXTURE;
    if !has_texel(place, reference) {
        return normal;
    }
    var tangent = vec4<f32>(0.0);
    let tangents = details[place.mesh + MESH_TANGENTS];
    if tangents != NONE {
        let direction = try_normalize(stream_vec4(place, tangents).xyz);
        if !is_black(direction) {
            tangent = vec4<f32>(direction, detail_f32(tangents + 4u * place.corners.x + 3u));
        }
    }
    if tangent.w == 0.0 {
        tangent = uv_tangent(place.mesh, triangle, reference);
    }
    if tangent.w == 0.0 {
        return normal;
    }
    let x = try_normalize(tangent.xyz - normal * dot(normal, tangent.xyz));
    if is_black(x) {
        return normal;
    }
    let y = cross(normal, x) * tangent.w;
    let mapped = referenced_texel(place, reference).xyz * 2.0 - 1.0;
    let scale = detail_f32(material + MATERIAL_NORMAL_SCALE);
    return normalize_or(x * (mapped.x * scale) + y * (mapped.y * scale) + normal * mapped.z, normal);
}

// Flags of a triangle's material word.
const SMOOTH: u32 = 0x80000000u;
const DETAILED: u32 = 0x40000000u;

// twin: crates/scene/src/surface.rs refine
fn refine(surface: ptr<function, Surface>, flags: u32, material: u32, local_normal: vec3<f32>, ray: Ray, hit: Hit) {
    let instance = instance_at(hit.id.x);
    let place = place_on(mesh_of(hit.id.x), hit.id.y, hit.u, hit.v);
    var normal = local_normal;
    if (flags & SMOOTH) != 0u {
        normal = normalize_or(stream_vec3(place, details[place.mesh + MESH_NORMALS]), normal);
    }
    if (flags & DETAILED) != 0u {
        normal = mapped_normal(place, hit.id.y, material, normal);
        let base = base_color(place, material).xyz;
        let metal = texel_or_white(place, material + MATERIAL_METALLIC_ROUGHNESS_TEXTURE);
        let metallic = detail_f32(material + MATERIAL_METALLIC) * metal.z;
        let roughness = detail_f32(material + MATERIAL_ROUGHNESS) * metal.y;
        let dielectric_f0 = detail_vec3(material + MATERIAL_DIELECTRIC_F0);
        let dielectric_f90 = detail_f32(material + MATERIAL_DIELECTRIC_F90);
        (*surface).bsdf.diffuse = base * (1.0 - metallic);
        (*surface).bsdf.f0 = dielectric_f0 * (1.0 - metallic) + base * metallic;
        (*surface).bsdf.f90 = dielectric_f90 + (1.0 - dielectric_f90) * metallic;
        (*surface).bsdf.alpha = max(roughness * roughness, 1e-3);
        if !is_black((*surface).emitted) {
            (*surface).emitted = emission(place, material);
        }
    }
    if details[instance + INSTANCE_IDENTITY] == 0u {
        normal = matrix_at(instance + WORLD_NORMAL_FROM_LOCAL) * normal;
    }
    (*surface).bsdf.normal_ws = usable_normal(normal, (*surface).geometric_normal_ws, -ray.direction_ws);
}

// twin: crates/scene/src/surface.rs surface
fn surface_at(ray: Ray, hit: Hit) -> Surface {
    let instance = instance_at(hit.id.x);
    let record = scene.triangles + (details[instance + INSTANCE_FIRST_TRIANGLE] + hit.id.y) * TRIANGLE_WORDS;
    let local_normal = detail_vec3(record);
    let material_word = details[record + 4u];
    var position_ws: vec3<f32>;
    var normal_ws = local_normal;
    if !HAS_INSTANCES || details[instance + INSTANCE_IDENTITY] != 0u {
        let along = ray.origin_ws + ray.direction_ws * hit.t;
        position_ws = along - local_normal * (dot(local_normal, along) - detail_f32(record + 3u));
    } else {
        let mesh = mesh_of(hit.id.x);
        let local = stream_vec3(place_on(mesh, hit.id.y, hit.u, hit.v), details[mesh + MESH_POSITIONS]);
        let at = instance + WORLD_FROM_LOCAL;
        position_ws = matrix_at(at) * local + detail_vec3(at + 9u);
        normal_ws = normalize(matrix_at(instance + WORLD_NORMAL_FROM_LOCAL) * local_normal);
    }
    let facing = dot(normal_ws, ray.direction_ws);
    let front = facing <= 0.0;
    let geometric_normal_ws = select(-normal_ws, normal_ws, front);
    let material = material_at(material_word & ~(SMOOTH | DETAILED));
    let emitter = details[record + 5u];
    var light = NONE;
    if emitter != NONE {
        light = details[scene.emitter_lights + details[instance + INSTANCE_FIRST_EMITTER] + emitter];
    }
    let emits = front || (details[material + MATERIAL_FLAGS] & DOUBLE_SIDED) != 0u;
    var surface = Surface(
        position_ws,
        light,
        geometric_normal_ws,
        hit.id,
        normal_ws * facing - ray.direction_ws,
        select(vec3<f32>(0.0), detail_vec3(material + MATERIAL_EMISSION), emits),
        Bsdf(
            geometric_normal_ws,
            detail_f32(material + MATERIAL_GGX_ALPHA),
            detail_vec3(material + MATERIAL_DIFFUSE),
            detail_f32(material + MATERIAL_F90),
            detail_vec3(material + MATERIAL_F0),
        ),
    );
    if HAS_DETAIL && (material_word & (SMOOTH | DETAILED)) != 0u {
        refine(&surface, material_word, material, local_normal, ray, hit);
    }
    return surface;
}

// twin: crates/scene/src/surface.rs off_surface
fn off_surface(surface: Surface, wi_ws: vec3<f32>) -> vec3<f32> {
    let largest = max(max_element(abs(surface.position_ws)), scene.radius / 32.0);
    let size = largest / 65536.0;
    let side = select(size, -size, dot(wi_ws, surface.geometric_normal_ws) < 0.0);
    return surface.geometric_normal_ws * side + surface.back_ws * size;
}

// twin: crates/scene/src/surface.rs ray_from
fn ray_from(surface: Surface, wi_ws: vec3<f32>, t_max: f32) -> Ray {
    return Ray(surface.position_ws + off_surface(surface, wi_ws), wi_ws, t_max);
}

// twin: crates/scene/src/surface.rs shadow_ray
fn shadow_ray(surface: Surface, wi_ws: vec3<f32>, distance: f32) -> Ray {
    const END: f32 = 1.0 - 1.0 / 262144.0;
    let moved = off_surface(surface, wi_ws);
    let t_max = max(distance * END - length(moved), 0.0);
    return Ray(surface.position_ws + moved, wi_ws - moved / distance, t_max);
}
