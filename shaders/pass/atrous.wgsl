// One pass of the filter over all pixels: crates/render/src/clean/filter.rs.
#import "clean/guide.wgsl"
#import "lib/constants.wgsl"
#import "record/clean.wgsl"

@group(3) @binding(1) var<storage, read> guides: array<Guide>;
@group(3) @binding(2) var<storage, read> light: array<vec4<f32>>;
@group(3) @binding(3) var<storage, read_write> filtered: array<vec4<f32>>;
// Pixels between taps, in x.
@group(3) @binding(4) var<uniform> tap_distance: vec4<u32>;

// twin: crates/render/src/clean/filter.rs TOLERANCE
const TOLERANCE: f32 = 2.0;

// twin: crates/render/src/clean/filter.rs mixed
fn mixed(at: vec2<u32>, guide: Guide, here: vec4<f32>) -> vec4<f32> {
    let per_tolerated = 1.0 / (TOLERANCE * sqrt(here.w) + 1e-6);
    let step = i32(tap_distance.x);
    let per_distance = 1.0 / f32(step);
    let size = vec2<i32>(i32(clean.now.width), i32(clean.now.height));
    let y = luminance(here.rgb);
    var sum = vec4<f32>(0.0);
    var weights = 0.0;
    for (var row = -1; row <= 1; row++) {
        for (var column = -1; column <= 1; column++) {
            let tap = vec2<i32>(at) + vec2<i32>(column, row) * step;
            // Rows and columns beyond the picture are left out.
            if any(tap < vec2<i32>(0)) || any(tap >= size) {
                continue;
            }
            let pixel = pixel_at(vec2<u32>(tap));
            let other = guides[pixel];
            if !is_surface(other) {
                continue;
            }
            let found = light[pixel];
            let unlike = abs(luminance(found.rgb) - y) * per_tolerated + unlikeness(guide, other, per_distance);
            let of_place = select(0.25, 0.5, row == 0) * select(0.25, 0.5, column == 0);
            let weight = of_place * falloff(unlike);
            // The last one is the variance.
            sum += found * vec4<f32>(vec3<f32>(weight), weight * weight);
            weights += weight;
        }
    }
    let scale = 1.0 / weights;
    return sum * vec4<f32>(vec3<f32>(scale), scale * scale);
}

@compute @workgroup_size(8, 8)
fn atrous(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy) {
        return;
    }
    let pixel = pixel_at(id.xy);
    let guide = guides[pixel];
    var here = light[pixel];
    if is_surface(guide) {
        here = mixed(id.xy, guide, here);
    }
    filtered[pixel] = here;
}
