// Textures and vertex streams at a point of a triangle.
#import "scene/bindings.wgsl"

struct Span {
    first: u32,
    second: u32,
    fraction: f32,
}

// twin: crates/scene/src/texture.rs texels
fn texel_span(wrap: u32, coordinate: f32, size: u32, nearest: bool) -> Span {
    var u = coordinate;
    if !is_finite(u) {
        u = 0.0;
    }
    var unit: f32;
    if wrap == 0u {
        unit = u - floor(u);
    } else if wrap == 1u {
        let pair = u - 2.0 * floor(0.5 * u);
        unit = select(pair, 2.0 - pair, pair > 1.0);
    } else {
        unit = clamp(u, 0.0, 1.0);
    }
    let last = i32(size) - 1;
    let x = unit * f32(size) - select(0.5, 0.0, nearest);
    let below = floor(x);
    let low = i32(below);
    let high = low + 1;
    if wrap == 0u {
        let first = select(min(low, last), last, low < 0);
        return Span(u32(first), u32(select(high, 0, high > last)), x - below);
    }
    return Span(u32(clamp(low, 0, last)), u32(clamp(high, 0, last)), x - below);
}

fn texel(at: u32, srgb: bool) -> vec4<f32> {
    let codes = unpack4xU8(texels[at]);
    if srgb {
        return vec4<f32>(
            detail_f32(scene.srgb + codes.x),
            detail_f32(scene.srgb + codes.y),
            detail_f32(scene.srgb + codes.z),
            f32(codes.w) / 255.0,
        );
    }
    return vec4<f32>(codes);
}

fn between(a: vec4<f32>, b: vec4<f32>, f: f32) -> vec4<f32> {
    return a * (1.0 - f) + b * f;
}

// twin: crates/scene/src/texture.rs sample
fn sample_texture(texture: u32, uv: vec2<f32>) -> vec4<f32> {
    let record = scene.textures + texture * TEXTURE_WORDS;
    let first = details[record];
    let width = details[record + 1u];
    let height = details[record + 2u];
    let flags = details[record + 3u];
    let srgb = (flags & 16u) != 0u;
    let nearest = (flags & 32u) != 0u;
    let x = texel_span(flags & 3u, uv.x, width, nearest);
    let y = texel_span((flags >> 2u) & 3u, uv.y, height, nearest);
    let top = first + y.first * width;
    var value = texel(top + x.first, srgb);
    if !nearest {
        let bottom = first + y.second * width;
        let above = between(value, texel(top + x.second, srgb), x.fraction);
        let below = between(texel(bottom + x.first, srgb), texel(bottom + x.second, srgb), x.fraction);
        value = between(above, below, y.fraction);
    }
    if !srgb {
        value = value / 255.0;
    }
    return value;
}

// A point of a triangle, for its streams.
struct Place {
    mesh: u32,
    corners: vec3<u32>,
    weights: vec3<f32>,
}

fn place_on(mesh: u32, triangle: u32, u: f32, v: f32) -> Place {
    return Place(mesh, corners_of(mesh, triangle), vec3<f32>(1.0 - u - v, u, v));
}

fn stream_vec2(place: Place, stream: u32) -> vec2<f32> {
    return detail_vec2(stream + 2u * place.corners.x) * place.weights.x
        + detail_vec2(stream + 2u * place.corners.y) * place.weights.y
        + detail_vec2(stream + 2u * place.corners.z) * place.weights.z;
}

fn stream_vec3(place: Place, stream: u32) -> vec3<f32> {
    return detail_vec3(stream + 3u * place.corners.x) * place.weights.x
        + detail_vec3(stream + 3u * place.corners.y) * place.weights.y
        + detail_vec3(stream + 3u * place.corners.z) * place.weights.z;
}

fn stream_vec4(place: Place, stream: u32) -> vec4<f32> {
    return detail_vec4(stream + 4u * place.corners.x) * place.weights.x
        + detail_vec4(stream + 4u * place.corners.y) * place.weights.y
        + detail_vec4(stream + 4u * place.corners.z) * place.weights.z;
}

// Whether the texture that `reference` (a word of a material) names can be looked up on this mesh.
fn has_texel(place: Place, reference: u32) -> bool {
    return details[reference] != NONE && details[place.mesh + MESH_UVS + details[reference + 1u]] != NONE;
}

// twin: crates/scene/src/inputs.rs texel
fn referenced_texel(place: Place, reference: u32) -> vec4<f32> {
    let uv = stream_vec2(place, details[place.mesh + MESH_UVS + details[reference + 1u]]);
    let turned = detail_vec2(reference + 2u) * uv.x + detail_vec2(reference + 4u) * uv.y;
    return sample_texture(details[reference], turned + detail_vec2(reference + 6u));
}

// twin: crates/scene/src/inputs.rs factor
fn texel_or_white(place: Place, reference: u32) -> vec4<f32> {
    if has_texel(place, reference) {
        return referenced_texel(place, reference);
    }
    return vec4<f32>(1.0);
}

// Linear base colour and alpha.
// twin: crates/scene/src/inputs.rs base_color
fn base_color(place: Place, material: u32) -> vec4<f32> {
    let texel = texel_or_white(place, material + MATERIAL_BASE_COLOR_TEXTURE);
    var color = vec4<f32>(1.0);
    let colors = details[place.mesh + MESH_COLORS];
    if colors != NONE {
        color = stream_vec4(place, colors);
    }
    return vec4<f32>(detail_vec3(material + MATERIAL_BASE_COLOR), detail_f32(material + MATERIAL_ALPHA)) * texel * color;
}

// Emitted radiance; zero in the holes of an alpha mask.
// twin: crates/scene/src/inputs.rs emission
fn emission(place: Place, material: u32) -> vec3<f32> {
    let masked = (details[material + MATERIAL_FLAGS] & MASKED_MATERIAL) != 0u;
    if masked && base_color(place, material).w < detail_f32(material + MATERIAL_CUTOFF) {
        return vec3<f32>(0.0);
    }
    return detail_vec3(material + MATERIAL_EMISSION) * texel_or_white(place, material + MATERIAL_EMISSIVE_TEXTURE).xyz;
}

// Whether a triangle with an alpha mask is there.
// twin: crates/scene/src/bvh/alpha.rs visible
fn mask_visible(instance: u32, triangle: u32, u: f32, v: f32) -> bool {
    let mesh = mesh_of(instance);
    let record = scene.triangles + (details[instance_at(instance) + INSTANCE_FIRST_TRIANGLE] + triangle) * TRIANGLE_WORDS;
    let material = material_at(details[record + 4u] & 0x3fffffffu);
    let alpha = base_color(place_on(mesh, triangle, u, v), material).w;
    return alpha >= detail_f32(material + MATERIAL_CUTOFF);
}
