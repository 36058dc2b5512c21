// Where the samples of a pixel do not tell their variance, that between the pixels around it takes its place.
#import "clean/guide.wgsl"
#import "lib/constants.wgsl"
#import "record/clean.wgsl"

@group(3) @binding(1) var<storage, read> guides: array<Guide>;
@group(3) @binding(2) var<storage, read> light: array<vec4<f32>>;
@group(3) @binding(3) var<storage, read_write> varied: array<vec4<f32>>;

// twin: crates/render/src/clean/filter.rs LEAST_ALIKE
const LEAST_ALIKE: f32 = 4.0;
// twin: crates/render/src/clean/filter.rs REACH
const REACH: u32 = 2u;

// twin: crates/render/src/clean/filter.rs estimate_variance
fn variance_around(at: vec2<u32>, here: Guide) -> f32 {
    // Of those on the same surface, and of all: weights, values, squares.
    var alike = vec3<f32>(0.0);
    var all = vec3<f32>(0.0);
    let first = at - min(at, vec2<u32>(REACH));
    let end = min(at + REACH + 1u, vec2<u32>(clean.now.width, clean.now.height));
    for (var v = first.y; v < end.y; v++) {
        for (var u = first.x; u < end.x; u++) {
            let other = pixel_at(vec2<u32>(u, v));
            let guide = guides[other];
            if !is_surface(guide) {
                continue;
            }
            let y = luminance(light[other].rgb);
            let values = vec3<f32>(1.0, y, y * y);
            let away = max(max(u, at.x) - min(u, at.x), max(v, at.y) - min(v, at.y));
            alike += values * falloff(unlikeness(here, guide, 1.0 / f32(max(away, 1u))));
            all += values;
        }
    }
    var sums = alike;
    if alike.x < LEAST_ALIKE {
        sums = all;
    }
    let mean = sums.y / sums.x;
    return max(sums.z / sums.x - mean * mean, 0.0);
}

@compute @workgroup_size(8, 8)
fn vary(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy) {
        return;
    }
    let pixel = pixel_at(id.xy);
    let guide = guides[pixel];
    var here = light[pixel];
    if !(here.w > 0.0) && is_surface(guide) {
        here.w = variance_around(id.xy, guide);
    }
    varied[pixel] = here;
}
