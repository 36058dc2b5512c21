// Sums of auxiliary values. Rust: crates/render/src/gpu/layout.rs

struct AovPixel {
    // Albedo, normal, position, emission, one after the other, as pairs: the rounded sum, and what rounding lost.
    hi: array<vec4<f32>, 3>,
    lo: array<vec4<f32>, 3>,
    // Metres.
    depth_hi: f32,
    depth_lo: f32,
    // Samples that hit something.
    hits: u32,
    // Chosen by the last sample; NO_LIGHT: none.
    light: u32,
}
