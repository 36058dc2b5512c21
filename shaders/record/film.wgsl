// What the passes leave behind: sums per pixel, and observations. Rust: crates/render/src/gpu/layout.rs

// The share of the control variate that a pixel takes, and what was seen of both, by luminance.
struct PixelControl {
    share: f32,
    // Samples seen; fewer after each lesson.
    count: f32,
    mean_found: f32,
    mean_control: f32,
    // Sums of the squared and of the mixed deviations from the means.
    found_sq: f32,
    control_sq: f32,
    mixed: f32,
    // Of luminances: a power of two; 0 before there was a control.
    scale: f32,
}

struct FilmPixel {
    // R, G, B, luminance squared, each times the weight of its frame: the rounded sum, and what rounding lost.
    hi: vec4<f32>,
    lo: vec4<f32>,
    weight_hi: f32,
    weight_lo: f32,
    count: u32,
    nonfinite: u32,
    // Of all frames, whatever was cleared.
    rays_nearest: u32,
    rays_occluded: u32,
    pad0: u32,
    pad1: u32,
    control: PixelControl,
}

// What an eye-path vertex found out about a light.
struct Observation {
    position_ws: vec3<f32>,
    // NO_LIGHT: no observation.
    light: u32,
    normal_ws: vec3<f32>,
    flags: u32,
    unshadowed: f32,
    irradiance: f32,
    pmf: f32,
    // Luminance of what arrived from where the path went on, if it is OBSERVED_BOUNCE.
    bounce_radiance: f32,
}

const NO_LIGHT: u32 = 0xffffffffu;

const OBSERVED_PRIMARY: u32 = 1u;
const OBSERVED_VISIBLE: u32 = 2u;
// It stands for as many as the run that it is kept in says.
const OBSERVED_FOR_MANY: u32 = 4u;
// The path went on from there: into which part of the hemisphere is told by the bits from OBSERVED_PART on.
const OBSERVED_BOUNCE: u32 = 8u;
const OBSERVED_PART: u32 = 8u;
