// Which pixels show the same surface.
#import "lib/constants.wgsl"
#import "record/clean.wgsl"

// twin: crates/render/src/clean/filter.rs NORMAL_TOLERANCE
const NORMAL_TOLERANCE: f32 = 32.0;

// twin: crates/render/src/clean/frame.rs is_surface
fn is_surface(guide: Guide) -> bool {
    return guide.footprint > 0.0;
}

// How far `other` lies off the surface, in edges of a pixel.
// twin: crates/render/src/clean/frame.rs off_plane
fn off_plane(guide: Guide, other: vec3<f32>) -> f32 {
    return abs(dot(guide.normal, other - guide.position)) / guide.footprint;
}

// Minus the logarithm of how surely two pixels show the same surface, given one over the pixels between them.
// twin: crates/render/src/clean/filter.rs unlikeness
fn unlikeness(a: Guide, b: Guide, per_distance: f32) -> f32 {
    let turned = (1.0 - dot(a.normal, b.normal)) * NORMAL_TOLERANCE;
    return max(turned, 0.0) + off_plane(a, b.position) * per_distance;
}

// About exp(-x), and 0 from 8 on.
// twin: crates/render/src/clean/filter.rs falloff
fn falloff(x: f32) -> f32 {
    let base = max(1.0 - 0.125 * x, 0.0);
    let squared = base * base;
    let fourth = squared * squared;
    return fourth * fourth;
}
