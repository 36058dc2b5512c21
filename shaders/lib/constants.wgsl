// Numbers that WGSL has no names for.

const PI: f32 = 3.1415927;
const FRAC_PI_2: f32 = 1.5707964;
const FRAC_PI_4: f32 = 0.7853982;
const FRAC_1_PI: f32 = 0.31830987;
const SQRT_2: f32 = 1.4142135;
const MIN_POSITIVE: f32 = 1.17549435e-38;
const FLT_MAX: f32 = 3.4028234e38;
// Distances that have no end. WGSL has no infinity.
const FAR: f32 = 3.0e38;

// Rec. 709.
// twin: crates/scene/src/lib.rs luminance
fn luminance(rgb: vec3<f32>) -> f32 {
    return dot(rgb, vec3<f32>(0.2126, 0.7152, 0.0722));
}

fn max_element(v: vec3<f32>) -> f32 {
    return max(v.x, max(v.y, v.z));
}

// Whether a number is neither infinite nor NaN, by its bits: comparisons with NaN are not to be relied on in WGSL.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn is_black(rgb: vec3<f32>) -> bool {
    return all(rgb == vec3<f32>(0.0));
}
