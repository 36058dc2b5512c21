// The picture as a screen shows it: one thread of work per texel of the picture, whatever the size of the window.
// The same curve as `crates/render/src/image/display.rs`, from which a test checks it.

struct Params {
    // Factor on radiance: 2^stops.
    exposure: f32,
    // 1: radiance, through the tone curve. 0: values in 0..1 that are shown as they are (debug views).
    tone_mapped: u32,
}

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var<uniform> params: Params;

@vertex
fn whole_target(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn main(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let linear = textureLoad(picture, vec2i(at.xy), 0).rgb;
    if params.tone_mapped == 0u {
        return vec4f(srgb(clamp(linear, vec3f(0.0), vec3f(1.0))), 1.0);
    }
    return vec4f(srgb(agx(linear * params.exposure)), 1.0);
}

// Sobotka's AgX (2022) by the polynomial of Wrensch, "Minimal AgX Implementation" (2023), power 1.15, saturation 1.2.
fn agx(linear: vec3f) -> vec3f {
    let inset = mat3x3f(
        vec3f(0.84247906, 0.04232824, 0.04237566),
        vec3f(0.0784336, 0.87846864, 0.0784336),
        vec3f(0.079223745, 0.07916613, 0.879143),
    );
    let outset = mat3x3f(
        vec3f(1.196879, -0.05289685, -0.052971635),
        vec3f(-0.09802088, 1.1519031, -0.09804345),
        vec3f(-0.09902974, -0.09896118, 1.1510737),
    );
    let min_stops = -12.47393;
    let max_stops = 4.026069;
    let stops = log2(max(inset * clamp(linear, vec3f(0.0), vec3f(1e30)), vec3f(1e-10)));
    let x = clamp((stops - min_stops) / (max_stops - min_stops), vec3f(0.0), vec3f(1.0));
    let x2 = x * x;
    let x4 = x2 * x2;
    let curve = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    let shaped = pow(max(curve, vec3f(0.0)), vec3f(1.15));
    let grey = vec3f(dot(shaped, vec3f(0.2126, 0.7152, 0.0722)));
    let saturated = outset * (grey + 1.2 * (shaped - grey));
    return pow(clamp(saturated, vec3f(0.0), vec3f(1.0)), vec3f(2.2));
}

// IEC 61966-2-1.
fn srgb(linear: vec3f) -> vec3f {
    let low = 12.92 * linear;
    let high = 1.055 * pow(linear, vec3f(1.0 / 2.4)) - 0.055;
    return select(high, low, linear <= vec3f(0.0031308));
}
