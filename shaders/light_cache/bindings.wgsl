// What light samplers draw from: packed by crates/light-cache/src/packed.rs and the `pack` of each sampler.

@group(2) @binding(0) var<storage, read> cache: array<vec4<u32>>;

fn cache_word(at: u32) -> u32 {
    return cache[at >> 2u][at & 3u];
}

fn cache_f32(at: u32) -> f32 {
    return bitcast<f32>(cache_word(at));
}

// The point that wants light.
struct ShadingPoint {
    position_ws: vec3<f32>,
    // First hit of the eye path.
    primary: bool,
    normal_ws: vec3<f32>,
}

// A drawn light; pmf 0: none.
struct Choice {
    light: u32,
    pmf: f32,
    // Irradiance per channel to add to what the light brings: a control variate.
    control: vec3<f32>,
}

// Without a control variate.
fn plain_choice(light: u32, pmf: f32) -> Choice {
    return Choice(light, pmf, vec3<f32>(0.0));
}

// Bits that differ from point to point.
// twin: crates/light-cache/src/records.rs salt
fn salt_of(point: ShadingPoint) -> u32 {
    let bits = bitcast<vec3<u32>>(point.position_ws);
    return bits.x ^ ((bits.y << 11u) | (bits.y >> 21u)) ^ ((bits.z << 22u) | (bits.z >> 10u));
}
