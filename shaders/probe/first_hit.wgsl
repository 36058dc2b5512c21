// Auxiliary images: what a path meets first.
#import "lib/sum.wgsl"
#import "record/aov.wgsl"
#import "record/film.wgsl"
#import "record/frame.wgsl"
#import "scene/surface.wgsl"

@group(3) @binding(2) var<storage, read_write> aovs: array<AovPixel>;

// Before the path of a pixel: it may hit nothing.
fn probe_pixel(pixel: u32) {
    if frame.clear != 0u {
        aovs[pixel] = AovPixel();
    }
    aovs[pixel].light = NO_LIGHT;
}

// At the path's first hit, `distance` metres away, `light` having been chosen there.
// twin: crates/render/src/path.rs first_hit
// twin: crates/render/src/film/tile.rs add_aovs
fn probe_first_hit(pixel: u32, surface: Surface, distance: f32, light: u32) {
    let albedo = surface.bsdf.diffuse + surface.bsdf.f0;
    let normal = surface.bsdf.normal_ws;
    let position = surface.position_ws;
    var values = array<vec4<f32>, 3>(
        vec4<f32>(albedo, normal.x),
        vec4<f32>(normal.yz, position.xy),
        vec4<f32>(position.z, surface.emitted),
    );
    var pixel_sums = aovs[pixel];
    for (var i = 0u; i < 3u; i++) {
        let pair = add_to_pair(TwoSum(pixel_sums.hi[i], pixel_sums.lo[i]), values[i]);
        pixel_sums.hi[i] = pair.sum;
        pixel_sums.lo[i] = pair.error;
    }
    let depth = add_to_pair(
        TwoSum(vec4<f32>(pixel_sums.depth_hi), vec4<f32>(pixel_sums.depth_lo)),
        vec4<f32>(distance),
    );
    pixel_sums.depth_hi = depth.sum.x;
    pixel_sums.depth_lo = depth.error.x;
    pixel_sums.hits += 1u;
    pixel_sums.light = light;
    aovs[pixel] = pixel_sums;
}
